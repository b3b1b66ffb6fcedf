"""Verdicts, and margins, as tables and pages show them: in words, colours and strips."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING, Final, Self

from rockframe.rocking import kernels

if TYPE_CHECKING:
    from rockframe.rocking.response import Response

#: The rule of `Margin.verdict`, in the words of its docstring. All tables, pages and documents that
#: show verdicts print it.
VERDICT_RULE: Final = (
    "A verdict is undecided for one or more of four reasons. Amplitude or restitution: it "
    "changes when the amplitude of the motion, or the restitution of impacts, changes by up to 1 "
    "%. Sampling: it changes when the record is sampled twice as finely. Dimensions: the robust "
    "margin contradicts it, because the structure stands, but 10 % of the ensemble overturn at a "
    "multiple of 1 or less; or because it overturns, but half of the ensemble overturn only at a "
    "multiple of 1 or more, or not at all. Any other verdict is that of the response to the "
    "motion itself: no uplift, safe or overturned."
)
#: Explanation of the values that tables show beside the verdict.
MARGIN_LEGEND: Final = (
    "Critical scale: least multiple of the motion found to overturn the structure. 10, 25, 50 % "
    "overturn: the robust margin, the least multiples at which these shares of an ensemble of "
    "plausible structures overturn."
)


#: Events after which the model no longer describes a bridge, by the variable of their time.
MODEL_ENDS: Final = {
    "gap_closed_time": "gap closes",
    "lift_exceeded_time": "lift exceeded",
    "tendon_yield_time": "tendon yields",
}


class Verdict(IntEnum):
    """Outcome of a response; the values of the flag variable `verdict`.

    Small perturbations change an ``UNDECIDED`` verdict. Only `with_margins` returns it, `respond`
    does not.
    """

    NO_UPLIFT = kernels.NO_UPLIFT
    SAFE = kernels.SAFE
    OVERTURNED = kernels.OVERTURNED
    UNDECIDED = 3

    def __str__(self) -> str:
        return self.name

    def __format__(self, format_spec: str) -> str:
        return format(self.name, format_spec)


class ScaleOutcome(IntEnum):
    """Outcome of a motion at one scale, with the numbers of `Verdict`.

    It states only what happens at that scale. A verdict is on the motion itself, and takes other
    multiples of it into account: only a verdict can be safe.
    """

    NO_UPLIFT = Verdict.NO_UPLIFT
    STANDS = Verdict.SAFE
    OVERTURNS = Verdict.OVERTURNED

    @property
    def label(self) -> str:
        """Outcome in words.

        Examples
        --------
        >>> [outcome.label for outcome in ScaleOutcome]
        ['no uplift', 'stands', 'overturns']
        """
        return self.name.lower().replace("_", " ")


class VerdictKind(StrEnum):
    """Kinds of verdicts. Each has a colour, and a class in the style sheets.

    ``SAFE``: the structure stands, its critical scale is not below 1, and the model holds to the
    end. ``STANDS``: it stands, but no critical scale was searched for, or the model does not hold
    to the end. ``STANDS_LESS_OVERTURNS``: it stands, but its critical scale is below 1.
    """

    SAFE = "safe"
    STANDS = "stands"
    STANDS_LESS_OVERTURNS = "stands_less_overturns"
    OVERTURNED = "overturned"
    NO_UPLIFT = "no_uplift"
    UNDECIDED = "undecided"

    @property
    def label(self) -> str:
        """Name in a heading or a list of choices."""
        if self is VerdictKind.STANDS_LESS_OVERTURNS:
            return "stands, less overturns"
        return self.value.replace("_", " ")


def overturns(verdict: Verdict, overturning_time: float) -> bool:
    """Return True if the motion itself overturns the structure, even if the verdict is undecided.

    Examples
    --------
    >>> overturns(Verdict.UNDECIDED, 5.8), overturns(Verdict.UNDECIDED, math.nan)
    (True, False)
    """
    return verdict is Verdict.OVERTURNED or math.isfinite(overturning_time)


@dataclass(frozen=True)
class StatedVerdict:
    """A verdict with the values that its words contain.

    Parameters
    ----------
    verdict : Verdict
        Verdict as stored.
    overturning_time : float
        Time of overturning under the motion itself [s]; NaN if the structure stands.
    critical_scale : float or None
        Least multiple of the motion that overturns [1]; NaN if none was found, None if it was not
        searched for.
    model_ends : mapping of str to float
        Time of each event of `MODEL_ENDS` [s]; NaN if it does not occur.

    Examples
    --------
    >>> StatedVerdict(Verdict.SAFE, critical_scale=0.906).words
    'stands; 0.91 of the motion would overturn it'
    >>> StatedVerdict(Verdict.UNDECIDED, overturning_time=36.8, critical_scale=0.69).words
    'undecided, overturned 36.8 s'
    >>> StatedVerdict(Verdict.SAFE, critical_scale=2.0, model_ends={"gap_closed_time": 5.8}).words
    'stands; gap closes 5.8 s'
    """

    verdict: Verdict
    overturning_time: float = math.nan
    critical_scale: float | None = None
    model_ends: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, response: Response) -> Self:
        """Return the verdict of a response, with its critical scale if margins were added.

        Examples
        --------
        >>> from rockframe import Pulse, RockingFrame, respond
        >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=20.0, T_p=1.5)
        >>> StatedVerdict.of(respond(RockingFrame(height=3.0, width=0.4), pulse)).words
        'overturned 0.3 s'
        """
        restraint = response.restraint
        return cls(
            response.verdict,
            overturning_time=response.overturning_time,
            critical_scale=None if response.margin is None else response.margin.critical_scale,
            model_ends={
                "gap_closed_time": response.gap_closed_time,
                "lift_exceeded_time": response.lift_exceeded_time,
                "tendon_yield_time": math.nan if restraint is None else restraint.tendon_yields,
            },
        )

    @property
    def overturns(self) -> bool:
        """True if the motion itself overturns the structure, even if the verdict is undecided."""
        return overturns(self.verdict, self.overturning_time)

    @property
    def kind(self) -> VerdictKind:
        """Kind of the verdict, which determines its colour."""
        if self.verdict is not Verdict.SAFE:
            return VerdictKind(self.verdict.name.lower())
        if self.critical_scale is not None and self.critical_scale < 1.0:
            return VerdictKind.STANDS_LESS_OVERTURNS
        known = self.critical_scale is not None and not self._end
        return VerdictKind.SAFE if known else VerdictKind.STANDS

    @property
    def _end(self) -> str:
        """First event that ends the model, with its time."""
        known = [(time, name) for name, time in self.model_ends.items() if math.isfinite(time)]
        if not known:
            return ""
        time, name = min(known)
        return f"; {MODEL_ENDS[name]} {time:.1f} s"

    @property
    def words(self) -> str:
        """Verdict in words; for an undecided one, also the outcome of the motion itself."""
        if self.kind is VerdictKind.STANDS_LESS_OVERTURNS:
            less = f"stands; {self.critical_scale:.2f} of the motion would overturn it"
            return less + self._end
        words = self.kind.label
        if self.kind is VerdictKind.UNDECIDED:
            words += ", overturned" if self.overturns else ", stands"
        known = math.isfinite(self.overturning_time)
        return words + (f" {self.overturning_time:.1f} s" if known else "") + self._end


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
        overturns. Empty if robust margins were not requested.
    """

    overturning: tuple[tuple[float, float], ...]
    largest_scale: float
    robust: tuple[float, ...] = ()

    @property
    def words(self) -> str:
        """The intervals that overturn and the robust margin, in words.

        Examples
        --------
        >>> Strip(((0.62, 0.63), (0.9, 10.0)), 10.0, (0.95, 1.021, math.nan)).words
        'overturns from 0.62; 10, 25, 50 % overturn at 0.95, 1.02, > 10'
        """
        words = f"stands up to {self.largest_scale:.3g}"
        if self.overturning:
            words = f"overturns from {self.overturning[0][0]:.2f}"
        shares = ", ".join(map(self.stated, self.robust))
        return words + (f"; 10, 25, 50 % overturn at {shares}" if self.robust else "")

    def stated(self, scale: float) -> str:
        """Return a scale as text; the largest scale that was searched if none was found (NaN)."""
        return f"> {self.largest_scale:.3g}" if math.isnan(scale) else f"{scale:.2f}"


def strip_of(
    critical_scale: float,
    largest_scale: float,
    islands: Iterable[tuple[float, float]],
    robust: tuple[float, ...] = (),
) -> Strip:
    """Return the strip of a critical scale (NaN if none was found) and the islands above it.

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
    intervals = zip(starts, [*ends, largest_scale], strict=True)
    return Strip(tuple((a, b) for a, b in intervals if a < largest_scale), largest_scale, robust)
