"""Assessments that a response may carry: demand and forces on the joints, ensemble, margins."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import exp, lgamma
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeAlias, TypeVar

from rockframe.notebook import Shown
from rockframe.quantities import BANDED, QUANTITIES
from rockframe.record import Part
from rockframe.rocking.verdict import ModelEnd, SpreadVerdict, Strip, Verdict, strip_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class ContactDemand:
    """Extreme joint forces of all columns together, over the nodes of a response.

    Parameters
    ----------
    base_friction_demand, top_friction_demand : float
        Largest shear over vertical force at the base and under the beam [1]; NaN without a beam.
    impact_friction_demand : float
        Coefficient of friction that each impact needs [1]; NaN without impacts.
    least_base_vertical, least_top_vertical : float
        Least vertical force at the base and under the beam, over the static force [1]. If it is not
        positive, the joint would lift off.
    least_spacing : float
        Distance between two columns beyond which the beam does not lift off either column, also
        during impacts [m]; NaN without a stated depth of the beam, and for restrained frames.
    """

    base_friction_demand: float
    top_friction_demand: float
    impact_friction_demand: float
    least_base_vertical: float
    least_top_vertical: float
    least_spacing: float


@dataclass(frozen=True)
class PartResponse:
    """Response to one motion of a sequence; NaN if the frame overturns before it.

    Parameters
    ----------
    part : Part
        The motion: its record, and its times in the sequence.
    start_rotation_ratio : float
        |theta| / alpha of the frame when the motion begins [1]; 0 at rest.
    peak_rotation_ratio, peak_u : float
        Largest |theta| / alpha [1] and |u| [m] until the next motion begins.
    tendon_force, dissipater_force : float
        Forces of a tendon, and of the dissipaters across one joint, when the motion begins [N]:
        what earlier motions left; NaN without them.
    """

    part: Part
    start_rotation_ratio: float
    peak_rotation_ratio: float
    peak_u: float
    tendon_force: float
    dissipater_force: float


#: A number, or the quantiles of an ensemble.
Value = TypeVar("Value")


@dataclass(frozen=True)
class JointForces(Generic[Value]):
    """Largest forces and impulses of one column, over its weight with its share of the beam.

    They are means over the columns of a frame: of two columns, one carries more, the other less
    (see `column_forces`). Multiplied by the frame's `weight` they are in N and N s.

    Parameters
    ----------
    peak_base_shear : float
        Largest horizontal force of the ground on the column, through contact and tendons [1].
    base_joint_horizontal, top_joint_horizontal : float
        Largest horizontal force in the joints at base and top [1]; NaN without a beam, as all
        values of the joint at the top.
    base_joint_vertical, top_joint_vertical : float
        Largest vertical force in these joints [1].
    base_joint_vertical_least, top_joint_vertical_least : float
        Least vertical force in them [1]; if it is not positive, the joint would lift off.
    base_key_force, top_key_force : float
        Largest horizontal force that the friction of the same instant does not carry, for which a
        shear key must be designed [1]; all of it if the frame states no coefficient of friction.
    base_impulse_horizontal, top_impulse_horizontal : float
        Horizontal impulse of the strongest impact [s]; 0 without impacts.
    base_impulse_vertical, top_impulse_vertical : float
        Vertical impulse of the same impact [s].
    """

    peak_base_shear: Value
    base_joint_horizontal: Value
    base_joint_vertical: Value
    base_joint_vertical_least: Value
    base_key_force: Value
    top_joint_horizontal: Value
    top_joint_vertical: Value
    top_joint_vertical_least: Value
    top_key_force: Value
    base_impulse_horizontal: Value
    base_impulse_vertical: Value
    top_impulse_horizontal: Value
    top_impulse_vertical: Value


#: Level of the interval of a share [1].
CONFIDENCE: Final = 0.90
#: Largest number of members whose intervals are computed without SciPy.
_MANY: Final = 256
#: Number of times that the range of a share is halved to find a limit of its interval.
_HALVINGS: Final = 50


#: The 16, 50 and 84 % quantiles of a peak; infinite where a quantile falls on a member that
#: overturns.
Band: TypeAlias = tuple[float, float, float]


class Bands(Mapping[str, Band]):
    """Bands of the peaks of an ensemble: those of `quantities.BANDED`, by name or as attributes.

    Parameters
    ----------
    bands : mapping of str to tuple of float
        Bands by the names of the quantities, in the units of files. Quantities that are left out
        are NaN: the structure does not have them, such as the force of a tendon.

    Examples
    --------
    >>> bands = Bands({"peak_u": (0.1, 0.2, 0.4)})
    >>> bands["peak_u"][1], bands.peak_u[2], bands.friction_demand[0]
    (0.2, 0.4, nan)
    """

    def __init__(self, bands: Mapping[str, Band]) -> None:
        unknown = (math.nan, math.nan, math.nan)
        self._bands = {quantity.name: bands.get(quantity.name, unknown) for quantity in BANDED}

    def __getitem__(self, name: str) -> Band:
        return self._bands[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._bands)

    def __len__(self) -> int:
        return len(self._bands)

    def __getattr__(self, name: str) -> Band:
        if name.startswith("_") or name not in self._bands:
            raise AttributeError(name)
        return self._bands[name]

    def __repr__(self) -> str:
        return f"Bands({self._bands})"


@dataclass(frozen=True)
class EnsembleResponse:
    """Responses of an ensemble to the motion itself: shares of the members, and bands of peaks.

    Parameters
    ----------
    members : int
        Number of members.
    uplifted : int or None
        Number of members that uplift; None for bridges that do not rock.
    overturned : int
        Number of members that overturn or collapse.
    model_ends : int or None
        Number of members for which the gap of an abutment closes, the allowed lift is exceeded or a
        tendon yields that is modelled as elastic; None if the structure has no such limit.
    bands : Bands
        Bands of the peaks.
    rank_correlations : mapping of str to float
        Spearman's rank correlation between the draws of each spread and the peak of |theta| /
        slenderness [1], see `rank_correlations`; empty for bridges that do not rock.
    model_end : ModelEnd
        Event that ends the model of most members.
    """

    members: int
    uplifted: int | None
    overturned: int
    model_ends: int | None
    bands: Bands
    rank_correlations: Mapping[str, float] = field(default_factory=dict)
    model_end: ModelEnd = ModelEnd.NONE

    def with_forces(self, forces: JointForces[Band] | None) -> EnsembleResponse:
        """Return the ensemble with the band of the base shear of its forces, if it has none."""
        if forces is None or not math.isnan(self.bands.peak_base_shear[0]):
            return self
        return replace(self, bands=Bands({**self.bands, "peak_base_shear": forces.peak_base_shear}))

    def facts(self) -> dict[str, str]:
        """Return the share that overturns and the bands of peaks, for the table in notebooks."""
        share, low, high = (
            100.0 * getattr(self, f"share_overturned{end}") for end in ("", "_low", "_high")
        )
        rows = {f"of {self.members} plausible structures": f"{self.overturned} overturn"}
        rows["share that overturns, 90 % interval"] = f"{share:.0f} % ({low:.0f} to {high:.0f})"
        for name in ("peak_rotation_ratio", "peak_u"):
            quantity, band = QUANTITIES[name], self.bands[name]
            finite = [quantity.text(bound) for bound in band if math.isfinite(bound)]
            unit = f" [{quantity.shown_unit}]" if quantity.shown_unit else ""
            label = f"{quantity.symbol}, 16 50 84 %{unit}"
            rows[label] = " ".join([*finite, *["overturns"] * (len(finite) < len(band))])
        return rows

    @property
    def share_overturned(self) -> float:
        """Share of the members that overturn [1]."""
        return self.overturned / self.members

    @property
    def share_overturned_low(self) -> float:
        """Lower limit of the 90 % interval of the share that overturns [1]."""
        return share_interval(self.overturned, self.members)[0]

    @property
    def share_overturned_high(self) -> float:
        """Upper limit of the 90 % interval of the share that overturns [1]."""
        return share_interval(self.overturned, self.members)[1]

    @property
    def share_uplifted(self) -> float:
        """Share of the members that uplift [1]; NaN for bridges that do not rock."""
        return math.nan if self.uplifted is None else self.uplifted / self.members

    @property
    def share_model_ends(self) -> float:
        """Share of the members for which the model ends [1]; NaN without a limit."""
        return math.nan if self.model_ends is None else self.model_ends / self.members


@lru_cache(maxsize=4096)
def share_interval(count: int, members: int) -> tuple[float, float]:
    """Return the interval of Clopper and Pearson of a share, at the level `CONFIDENCE` [1].

    Examples
    --------
    >>> [round(limit, 3) for limit in share_interval(0, 64)]
    [0.0, 0.046]
    """
    return _least_share(count, members), 1.0 - _least_share(members - count, members)


def _least_share(count: int, members: int) -> float:
    """Return the share with which `count` members or more are as rare as the tail of the interval.

    `scipy.special.betaincinv` returns the same within 1e-14. It is used for many members only,
    because its import takes a tenth of the time of a command.
    """
    if count == 0:
        return 0.0
    if members > _MANY:
        import scipy

        return float(scipy.special.betaincinv(count, members - count + 1, 0.5 * (1.0 - CONFIDENCE)))
    sizes = range(count, members + 1)
    ways = [lgamma(members + 1) - lgamma(k + 1) - lgamma(members - k + 1) for k in sizes]
    tail, low, high = 0.5 * (1.0 - CONFIDENCE), 0.0, 1.0
    for _ in range(_HALVINGS):
        share = 0.5 * (low + high)
        yes, no = math.log(share), math.log1p(-share)
        rare = sum(exp(w + k * yes + (members - k) * no) for w, k in zip(ways, sizes, strict=True))
        low, high = (share, high) if rare < tail else (low, share)
    return share


@dataclass(frozen=True)
class FirstOverturning:
    """The lowest interval of overturning that was found, and the outcome at larger scales.

    Parameters
    ----------
    lower, upper : float
        Ends of the interval of scales that overturn [1]. The frame overturns at both ends. NaN if
        no interval was found. `upper` is the largest scale if the interval reaches it.
    prevails_from : float
        Least scale s from which overturning prevails: whichever larger scale t is chosen, more than
        half of the scales from s to t overturn [1]. NaN if there is none.
    share_before : float
        Share of the scales between `lower` and `prevails_from` that overturn [1]; NaN if the two
        are equal.
    islands : tuple of (float, float)
        Intervals of scale above `lower` in which the frame stands [1], found from samples 0.64 to
        2.56 % apart.
    standing_share : float
        Share of the scales from `lower` to the largest at which the frame stands [1].
    responses : int
        Number of responses that were computed.
    """

    lower: float
    upper: float
    prevails_from: float
    share_before: float
    islands: tuple[tuple[float, float], ...]
    standing_share: float
    responses: int


@dataclass(frozen=True)
class RobustMargin:
    """Least scales at which shares of an ensemble overturn.

    Parameters
    ----------
    s10, s25, s50 : float
        Least multiple of the motion at which 10, 25 and 50 % overturn [1]. Two averages reduce the
        sampling error: the share at a scale is the mean over the scales from 4 % below to 4 %
        above it, and `s25` is the mean of the scales at which nine shares from 22 to 28 % are
        reached. NaN if the share is not reached at any scale.
    error10, error25, error50 : float
        Relative sampling errors of these scales [1]: half the width of the central 68 % interval
        over ensembles drawn again from the members (bootstrap). NaN where the scale is NaN.
    responses : int
        Number of responses that were computed.
    sampling_changes : int
        Number of members that stand instead of overturning, or overturn instead of standing, under
        the motion itself when the record is sampled twice as finely; -1 if not computed.
    """

    s10: float
    s25: float
    s50: float
    error10: float
    error25: float
    error50: float
    responses: int
    sampling_changes: int = 0


@dataclass(frozen=True, repr=False)
class Margin(Shown):
    """The margin of one frame against overturning under one motion.

    Parameters
    ----------
    first : FirstOverturning
        The first overturning that was found, and the outcome at larger scales.
    largest_scale : float
        Largest multiple of the motion that was searched [1].
    robust : RobustMargin, optional
        The scales at which 10, 25 and 50 % of an ensemble overturn, if they were requested.
    """

    first: FirstOverturning
    largest_scale: float
    robust: RobustMargin | None = None

    def facts(self) -> dict[str, str]:
        """Return robust margin, critical scale and islands, for the table in notebooks."""
        least = self.critical_scale
        scale = f"none up to {self.largest_scale:g}" if math.isnan(least) else f"{least:.4f}"
        return {
            **({"robust margin": self.strip.shares} if self.robust else {}),
            "nominal critical scale": scale,
            "islands above it in which the frame stands": str(self.safe_islands),
        }

    def draw(self, axes: Axes) -> None:
        """Draw the scales at which the frame stands and those at which it overturns."""
        least = self.critical_scale
        end = self.largest_scale if math.isnan(least) else min(self.largest_scale, 3.0 * least)
        axes.axvspan(0.0, end, color="C2", alpha=0.3, label="stands")
        for k, (low, high) in enumerate(self.strip.overturning):
            if low < end:  # the edge line keeps slivers visible that are thinner than a pixel
                label = "_" * (k > 0) + "overturns"
                axes.axvspan(low, min(high, end), color="C3", linewidth=0.8, label=label)
        axes.axvline(1.0, color="black", linewidth=0.8, label="the motion itself")
        axes.set(xlim=(0.0, max(end, 1.1)), yticks=[], xlabel="scale of the motion")
        axes.legend(loc="upper left", fontsize=8)

    @property
    def critical_scale(self) -> float:
        """Least multiple of the motion found to overturn [1]; NaN if none was found."""
        return self.first.lower

    @property
    def islands(self) -> tuple[tuple[float, float], ...]:
        """Intervals above the critical scale in which the frame stands [1].

        They are found from scales 0.64 to 2.56 % apart.
        """
        return self.first.islands

    @property
    def safe_islands(self) -> int:
        """Number of `islands`; more closely spaced scales would show more."""
        return len(self.first.islands)

    @property
    def strip(self) -> Strip:
        """Scales that overturn and the robust margin, for figures and pages."""
        robust = self.robust and (self.robust.s10, self.robust.s25, self.robust.s50)
        return strip_of(self.critical_scale, self.largest_scale, self.islands, robust or ())


class _Assessed(Protocol):
    """A response with its ensemble and margin."""

    @property
    def verdict(self) -> Verdict: ...
    @property
    def overturning_time(self) -> float: ...
    @property
    def ensemble(self) -> EnsembleResponse | None: ...
    @property
    def margin(self) -> Margin | None: ...


def verdict_of(response: _Assessed, model_ends: Mapping[str, float]) -> SpreadVerdict:
    """Return the verdict of a response, from its ensemble and margin if it has them.

    Parameters
    ----------
    response : object
        The response of a structure of any kind.
    model_ends : mapping of str to float
        Time of each event of `MODEL_ENDS` [s]; NaN if it does not occur.
    """
    margin, ensemble, nothing = response.margin, response.ensemble, math.nan
    robust = margin.robust if margin else None
    return SpreadVerdict(
        response.verdict,
        overturning_time=response.overturning_time,
        share_overturned=ensemble.share_overturned if ensemble else nothing,
        share_uplifted=ensemble.share_uplifted if ensemble else nothing,
        share_model_ends=ensemble.share_model_ends if ensemble else nothing,
        robust_scale=robust.s10 if robust else None,
        critical_scale=margin.critical_scale if margin else None,
        largest_scale=margin.largest_scale if margin else nothing,
        model_ends=model_ends,
        model_end=ensemble.model_end if ensemble else ModelEnd.NONE,
    )
