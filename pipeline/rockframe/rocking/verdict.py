"""Verdicts and margins as all tables, pages and figures state them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from itertools import pairwise
from typing import Final

from rockframe.rocking import kernels

#: Largest share of the ensemble that may overturn if a structure stands, and least share if it
#: overturns [1].
STANDS_UP_TO: Final = 0.05
OVERTURNS_FROM: Final = 0.95
#: The rule of `SpreadVerdict.kind`. All tables, pages and documents that show verdicts print it.
VERDICT_RULE: Final = (
    f"A structure stands if at most {STANDS_UP_TO:.0%} of an ensemble of plausible structures and "
    f"motions overturn, overturns if at least {OVERTURNS_FROM:.0%} do, and otherwise may overturn, "
    "with the share that does. Without an ensemble the verdict is nominal: the outcome of the "
    "structure and the motion exactly as given."
).replace("%", " %")
#: Explanation of the margin that tables show beside the verdict.
MARGIN_LEGEND: Final = (
    "10 % overturn at: least multiple of the motion at which 10 % of that ensemble overturn."
)
#: Explanation of the values in the detail of margins.
STRIP_LEGEND: Final = (
    "Critical scale: least multiple of the motion found to overturn the structure as given. 10, "
    "25, 50 % overturn: the robust margin, the least multiples at which these shares of an "
    "ensemble of plausible structures overturn."
)

#: Events after which the model no longer describes a bridge, by the variable of their time.
MODEL_ENDS: Final = {
    "gap_closed_time": "gap closes",
    "lift_exceeded_time": "lift exceeded",
    "tendon_yield_time": "tendon yields",
    "ductility_exceeded_time": "ductility exceeded",
}


class ModelEnd(IntEnum):
    """Event that ends the model; the values of the flag variable `model_end`.

    Overturning, or collapse, ends the model too; it is a verdict of its own.
    """

    NONE = 0
    GAP_CLOSES = 1
    LIFT_EXCEEDED = 2
    TENDON_YIELDS = 3
    DUCTILITY_EXCEEDED = 4
    OVERTURNS = 5

    @property
    def words(self) -> str:
        """Event in words, as in `MODEL_ENDS`; "" for none.

        Examples
        --------
        >>> [event.words for event in ModelEnd][1:-1] == list(MODEL_ENDS.values())
        True
        """
        return self.name.lower().replace("_", " ") if self else ""


def first_end(ends: Mapping[ModelEnd, float]) -> tuple[ModelEnd, float]:
    """Return the event that first ends the model, and its time [s]; NaN if the time is not known.

    Parameters
    ----------
    ends : mapping of ModelEnd to float
        Time of each event that occurs [s]; infinite if it occurs after the motion or between two
        nodes, and NaN if it does not occur.

    Examples
    --------
    >>> first_end({ModelEnd.OVERTURNS: 8.0, ModelEnd.GAP_CLOSES: 3.5})
    (<ModelEnd.GAP_CLOSES: 1>, 3.5)
    """
    happens = {end: time for end, time in ends.items() if not math.isnan(time)}
    if not happens:
        return ModelEnd.NONE, math.nan
    first = min(happens, key=lambda end: happens[end])
    return first, happens[first] if math.isfinite(happens[first]) else math.nan


def sometime(time: float) -> float:
    """Return the time of an event that occurs; infinite instead of NaN, if its time is unknown."""
    return math.inf if math.isnan(time) else time


class Verdict(IntEnum):
    """Outcome of a response to one motion; the values of the flag variable `verdict`."""

    NO_UPLIFT = kernels.NO_UPLIFT
    STANDS = kernels.STANDS
    OVERTURNS = kernels.OVERTURNS
    NOT_COMPUTED = 4

    def __str__(self) -> str:
        return self.name

    def __format__(self, format_spec: str) -> str:
        return format(self.name, format_spec)

    @property
    def label(self) -> str:
        """Outcome in words.

        Examples
        --------
        >>> [outcome.label for outcome in Verdict]
        ['no uplift', 'stands', 'overturns', 'not computed']
        """
        return self.name.lower().replace("_", " ")


#: Outcomes of responses that are computed.
COMPUTED: Final = (Verdict.NO_UPLIFT, Verdict.STANDS, Verdict.OVERTURNS)


class VerdictKind(StrEnum):
    """Kinds of verdicts, in the order of the share that overturns; not computed is the last."""

    NO_UPLIFT = "no_uplift"
    STANDS = "stands"
    MAY_OVERTURN = "may_overturn"
    OVERTURNS = "overturns"
    NOT_COMPUTED = "not_computed"

    @property
    def label(self) -> str:
        """Kind in words."""
        return self.value.replace("_", " ")


#: Margin from which the colour of a structure that stands is that of safety [1].
_FAR: Final = 2.0


@dataclass(frozen=True)
class SpreadVerdict:
    """The verdict on a structure under a motion, from the ensemble if there is one.

    Parameters
    ----------
    nominal : Verdict
        Outcome of the structure and the motion exactly as given.
    overturning_time : float
        Time at which the structure as given overturns [s]; NaN if it stands.
    share_overturned, share_uplifted, share_model_ends : float
        Shares of the ensemble [1]; NaN without an ensemble, and `share_model_ends` also for
        structures without such an event.
    robust_scale : float or None
        Least multiple of the motion at which 10 % of the ensemble overturn [1]; NaN if fewer do up
        to `largest_scale`, None if it was not computed.
    critical_scale : float or None
        Least multiple of the motion that overturns the structure as given [1]; NaN and None as for
        `robust_scale`.
    largest_scale : float
        Largest multiple that was searched [1].
    model_ends : mapping of str to float
        Time of each event of `MODEL_ENDS` for the structure as given [s]; NaN if it does not occur.
    model_end : ModelEnd
        Event that ends the model of most members.
    fails : str
        Verb for the end of the structure: overturn or collapse.

    Examples
    --------
    >>> SpreadVerdict(Verdict.STANDS, share_overturned=0.02, robust_scale=1.06).sentence
    'stands; 10 % overturn at 1.06'
    >>> SpreadVerdict(Verdict.STANDS, share_overturned=0.3125).words
    'may overturn (31 %)'
    >>> SpreadVerdict(Verdict.OVERTURNS, overturning_time=36.8).words
    'overturns 36.8 s'
    >>> SpreadVerdict(Verdict.STANDS, model_ends={"gap_closed_time": 5.8}).words
    'stands; gap closes 5.8 s'
    >>> SpreadVerdict(Verdict.OVERTURNS, share_overturned=1.0, fails="collapse").words
    'collapses'
    """

    nominal: Verdict
    overturning_time: float = math.nan
    share_overturned: float = math.nan
    share_uplifted: float = math.nan
    share_model_ends: float = math.nan
    robust_scale: float | None = None
    critical_scale: float | None = None
    largest_scale: float = math.nan
    model_ends: Mapping[str, float] = field(default_factory=dict)
    model_end: ModelEnd = ModelEnd.NONE
    fails: str = "overturn"

    @property
    def is_nominal(self) -> bool:
        """True if there is no ensemble, so that the verdict is the nominal outcome."""
        return math.isnan(self.share_overturned)

    @property
    def kind(self) -> VerdictKind:
        """Kind of the verdict, by `VERDICT_RULE`; no uplift means that no member uplifts."""
        if self.is_nominal:
            return VerdictKind(self.nominal.name.lower())
        if self.share_overturned >= OVERTURNS_FROM:
            return VerdictKind.OVERTURNS
        if self.share_overturned > STANDS_UP_TO:
            return VerdictKind.MAY_OVERTURN
        return VerdictKind.NO_UPLIFT if self.share_uplifted == 0.0 else VerdictKind.STANDS

    @property
    def words(self) -> str:
        """The verdict in words, with the event that ends the model, if there is one."""
        kind = self.kind
        words = kind.label.replace("overturn", self.fails)
        if kind is VerdictKind.MAY_OVERTURN:
            words += f" ({_percent(self.share_overturned)})"
        if self.is_nominal and math.isfinite(self.overturning_time):
            words += f" {self.overturning_time:.1f} s"
        return words + self._end

    @property
    def margin(self) -> str:
        """The margin in words; empty if none was computed."""
        robust = self.robust_scale is not None
        scale = self.robust_scale if robust else self.critical_scale
        if scale is None:
            return ""
        none = math.isnan(scale)
        scale_words = f"> {self.largest_scale:.3g}" if none else f"{scale:.2f}"
        return (
            f"10 % {self.fails} at {scale_words}"
            if robust
            else f"nominal critical scale {scale_words}"
        )

    @property
    def sentence(self) -> str:
        """The verdict and its margin."""
        return "; ".join(filter(None, (self.words, self.margin)))

    @property
    def overturns(self) -> bool:
        """True if the structure as given overturns, so that its peaks only describe the fall."""
        return self.nominal is Verdict.OVERTURNS

    @property
    def is_computed(self) -> bool:
        """True unless the response was not computed, which is neither safe nor unsafe."""
        return self.nominal is not Verdict.NOT_COMPUTED

    @property
    def danger(self) -> float:
        """Position of the colour from safe, 0, to overturning, 1.

        Half of it is the share that overturns. The other half grows as the margin falls from 2 to
        1. A margin beyond the largest scale that was searched counts as this scale, and one that is
        not known as 1.5. NaN if the response was not computed.

        Examples
        --------
        >>> [round(SpreadVerdict(Verdict.STANDS, share_overturned=share, robust_scale=scale).danger,
        ...     2) for share, scale in ((0.0, 3.0), (0.02, 1.06), (0.31, 0.8), (1.0, 0.4))]
        [0.0, 0.48, 0.66, 1.0]
        """
        if not self.is_computed:
            return math.nan
        share = float(self.overturns) if self.is_nominal else self.share_overturned
        scale = self.critical_scale if self.robust_scale is None else self.robust_scale
        if scale is not None and math.isnan(scale):
            scale = self.largest_scale  # the margin is larger than this
        near = 0.5 if scale is None or math.isnan(scale) else (_FAR - scale) / (_FAR - 1.0)
        near = min(max(near, 0.0), 1.0)
        return 0.5 * (share + max(near, share))

    @property
    def share_ends(self) -> float:
        """Share of the ensemble for which the model ends, or of the structure as given: 0 or 1."""
        if math.isfinite(self.share_model_ends):
            return self.share_model_ends
        return float(any(math.isfinite(time) for time in self.model_ends.values()))

    @property
    def _end(self) -> str:
        """First event that ends the model, with its time or the share of members that reach it."""
        reached = [(time, name) for name, time in self.model_ends.items() if math.isfinite(time)]
        time, name = min(reached, default=(math.nan, ""))
        event = MODEL_ENDS.get(name, self.model_end.words or "model ends")
        if self.share_model_ends > 0.0:
            return f"; {event} in {100.0 * self.share_model_ends:.0f} %"
        nominally = "" if self.is_nominal else " nominally"
        return f"; {event}{nominally} {time:.1f} s" if reached else ""


def _percent(share: float) -> str:
    """Return a share between the limits of the rule, which rounding must not move onto one."""
    whole = f"{100.0 * share:.0f}"
    limits = {f"{100.0 * limit:.0f}" for limit in (STANDS_UP_TO, OVERTURNS_FROM)}
    return f"{100.0 * share:.1f} %" if whole in limits else f"{whole} %"


@dataclass(frozen=True)
class Strip:
    """Intervals of the scale that overturn a frame, and its robust margin.

    Parameters
    ----------
    overturning : tuple of (float, float)
        Intervals of scale that were found to overturn the frame [1], increasing.
    largest_scale : float
        Largest scale that was searched [1].
    robust : tuple of float
        Scales at which 10, 25 and 50 % of the ensemble overturn [1]; NaN if that share never
        overturns. Empty if robust margins were not computed.
    nominal_to : float
        Scale up to which the outcome of the frame as given is known [1]: `largest_scale`, or less
        if a file keeps only the first of many islands; 0 if it was not searched.
    """

    overturning: tuple[tuple[float, float], ...]
    largest_scale: float
    robust: tuple[float, ...] = ()
    nominal_to: float = math.inf

    @property
    def words(self) -> str:
        """The robust margin and the least scale that overturns the frame as given, in words.

        Examples
        --------
        >>> Strip(((0.62, 0.63), (0.9, 10.0)), 10.0, (0.95, 1.021, math.nan)).words
        '10, 25, 50 % overturn at 0.95, 1.02, > 10; nominally overturns from 0.62'
        >>> Strip(((0.62, 2.8),), 2.8).words
        'share of the ensemble not computed; nominally overturns from 0.62'
        >>> Strip((), 10.0, (1.5, 1.6, 1.7), nominal_to=0.0).words
        '10, 25, 50 % overturn at 1.50, 1.60, 1.70; nominal outcome not computed'
        """
        if self.nominal_to == 0.0:
            return f"{self.shares}; nominal outcome not computed"
        words = f"nominally stands up to {self.largest_scale:.3g}"
        if self.overturning:
            words = f"nominally overturns from {self.overturning[0][0]:.2f}"
        return f"{self.shares or 'share of the ensemble not computed'}; {words}"

    def shares_between(self, low: float, high: float) -> list[tuple[int | None, float, float]]:
        """Return the parts of an axis of scales by the shares that were reached below them.

        Returns
        -------
        list of (int or None, float, float)
            Number of the shares 10, 25 and 50 % that were reached, None where none was computed;
            and both ends. Parts without length are left out.

        Examples
        --------
        >>> Strip((), 3.0, (0.5, 2.0, math.nan)).shares_between(0.1, 10.0)
        [(0, 0.1, 0.5), (1, 0.5, 2.0), (2, 2.0, 3.0), (None, 3.0, 10.0)]
        >>> Strip((), 3.0).shares_between(0.1, 10.0)
        [(None, 0.1, 10.0)]
        """
        end = min(max(self.largest_scale, low), high) if self.robust else low
        reached = [scale for scale in self.robust if not math.isnan(scale)]
        ends = [min(max(scale, low), end) for scale in (low, *reached, end)]
        parts: list[tuple[int | None, float, float]] = [
            (count, a, b) for count, (a, b) in enumerate(pairwise(ends)) if a < b
        ]
        return [*parts, (None, end, high)] if end < high else parts

    def nominal_unknown(self, high: float) -> tuple[float, float] | None:
        """Return the part of an axis up to `high` in which the nominal outcome is not known.

        Examples
        --------
        >>> Strip((), 3.0).nominal_unknown(10.0), Strip((), 10.0).nominal_unknown(10.0)
        ((3.0, 10.0), None)
        """
        end = min(self.largest_scale, self.nominal_to)
        return (end, high) if end < high else None

    @property
    def shares(self) -> str:
        """The robust margin in words; empty if it was not computed."""
        scales = ", ".join(map(self.in_words, self.robust))
        return f"10, 25, 50 % overturn at {scales}" if scales else ""

    def in_words(self, scale: float) -> str:
        """Return a scale as text; the largest scale that was searched if none was found (NaN)."""
        return f"> {self.largest_scale:.3g}" if math.isnan(scale) else f"{scale:.2f}"


def strip_of(
    critical_scale: float,
    largest_scale: float,
    islands: Iterable[tuple[float, float]],
    robust: tuple[float, ...] = (),
    *,
    further: bool = False,
) -> Strip:
    """Return the strip of a critical scale (NaN if none was found) and the islands above it.

    If there are `further` islands than those stated, the outcome is known up to the last of them.

    Examples
    --------
    >>> strip_of(0.5, 10.0, [(0.6, 0.7), (2.0, 10.0)]).overturning
    ((0.5, 0.6), (0.7, 2.0))
    """
    if math.isnan(critical_scale):
        return Strip((), largest_scale, robust)
    starts, ends = [critical_scale], []
    for start, end in islands:
        ends.append(start)
        starts.append(end)
    known_to = starts.pop() if further else math.inf
    intervals = zip(starts, ends if further else [*ends, largest_scale], strict=True)
    below = tuple((a, b) for a, b in intervals if a < largest_scale)
    return Strip(below, largest_scale, robust, known_to)
