"""Comparison of a freely rocking bridge with restrained, hybrid, isolated and monolithic ones.

The same quantities are computed for all: drift and lift of the deck, base shear over the weight of
deck and columns, and the time until which the assumptions of the model hold.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import BridgeEnsemble
from rockframe.oscillators.response import OscillatorResponse, respond_oscillator
from rockframe.record import Record
from rockframe.rivals import COLUMN_SHARE, FixedFrame, IsolatedDeck
from rockframe.rocking.assessments import Band, Bands, EnsembleResponse
from rockframe.rocking.contact import with_contact
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.ensemble import ensemble_responses, quantiles
from rockframe.rocking.margins.members import Versions, draws, hypercube
from rockframe.rocking.reactions import ground_at_nodes, reactions
from rockframe.rocking.response import Response, as_ground, first_crossing, respond
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


class Validity(IntEnum):
    """Event that ends the validity of a model; the values of the flag variable `validity`."""

    HOLDS = 0
    OVERTURNS = 1
    TENDON_YIELDS = 2
    GAP_CLOSES = 3
    LIFT_EXCEEDED = 4
    DUCTILITY_EXCEEDED = 5


@dataclass(frozen=True)
class Rivals:
    """The models of one bridge.

    Parameters
    ----------
    frame : RockingFrame
        The free frame, with a beam and without restraints.
    restrained, hybrid : RockingFrame, optional
        The frame with tendons; the frame with tendons and dissipaters.
    isolated : IsolatedDeck, optional
        The deck on isolators and rigid piers.
    fixed : FixedFrame, optional
        The frame with columns fixed to the ground and the deck.

    Raises
    ------
    ParameterError
        If the frame has no beam, or is restrained.
    """

    frame: RockingFrame
    restrained: RockingFrame | None = None
    hybrid: RockingFrame | None = None
    isolated: IsolatedDeck | None = None
    fixed: FixedFrame | None = None

    def __post_init__(self) -> None:
        if not self.frame.mass_ratio > 0.0:
            raise ParameterError(
                f"Frame {self.frame.name!r} is a column without a beam. Only frames with a "
                "mass_ratio above 0 can be compared with other bridges."
            )
        if self.frame.restrained:
            raise ParameterError(
                f"Frame {self.frame.name!r} has tendons or dissipaters. State it without them: "
                "they belong to the restrained and hybrid models."
            )

    @property
    def models(self) -> dict[str, RockingFrame | IsolatedDeck | FixedFrame]:
        """Models of the bridge, by name."""
        others = {name: getattr(self, name) for name in RIVALS if getattr(self, name) is not None}
        return {"free": self.frame, **others}


#: Names of the models that a free frame is compared with.
RIVALS = ("restrained", "hybrid", "isolated", "fixed")


@dataclass(frozen=True, eq=False)
class Compared:
    """The response of one model of a bridge.

    Parameters
    ----------
    model : str
        Name of the model: free, restrained, hybrid, isolated or fixed.
    time, u, v : array, shape (nodes,)
        Time [s], drift and lift of the deck [m]; NaN after overturning or collapse.
    base_shear : array, shape (nodes,)
        Force of the ground to the right, including that of tendons, over the weight of deck and
        columns [1].
    peak_u, peak_v, residual_u : float
        Largest drift, largest lift, and residual drift [m]; infinite if the frame overturns or
        collapses.
    peak_base_shear : float
        Largest base shear at the nodes [1], until the validity ends; without the impulses of
        impacts, which are instantaneous in the model.
    peak_rotation_ratio, ductility : float
        Largest |theta| / alpha of rocking frames; largest drift over yield drift of others [1].
    peak_tendon_force : float
        Largest force of a tendon [N]; NaN without tendons.
    friction_demand : float
        Coefficient of friction that base and top joints of a rocking frame need, also during
        impacts [1].
    validity : Validity
        Event that first ends the validity of the model.
    valid_until : float
        Time of this event [s]. NaN if there is none, or if it occurs after the end of the motion or
        between two nodes.
    gap_closed_time, closing_velocity : float
        Time [s] and velocity [m s-1] at which the deck first closes the gap of an abutment; NaN if
        never.
    ensemble : EnsembleResponse, optional
        Response of the ensemble of the model, if one was requested.
    """

    model: str
    time: Float
    u: Float
    v: Float
    base_shear: Float
    peak_u: float
    peak_v: float
    residual_u: float
    peak_base_shear: float
    validity: Validity
    valid_until: float
    gap_closed_time: float
    closing_velocity: float
    peak_rotation_ratio: float = math.nan
    ductility: float = math.nan
    peak_tendon_force: float = math.nan
    friction_demand: float = math.nan
    ensemble: EnsembleResponse | None = None


def compare(
    rivals: Rivals,
    motion: Record | Pulse | GroundAcceleration,
    ensemble: BridgeEnsemble | None = None,
    versions: Versions | None = None,
) -> list[Compared]:
    """Compute the responses of all models of a bridge to one motion.

    Parameters
    ----------
    rivals : Rivals
        The models of the bridge.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration, as for `respond`. Isolated and monolithic bridges ignore its vertical
        component.
    ensemble : BridgeEnsemble, optional
        Compute the responses of this ensemble of each model too, unless it has no members.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Returns
    -------
    list of Compared
        One response for each model, the free frame first.

    Raises
    ------
    ParameterError
        If the motion is invalid, see `respond`, or a member of the ensemble is impossible.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> deck = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=3.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.3 * 9.81, T_p=1.5)
    >>> [(one.model, round(one.peak_u, 2)) for one in compare(Rivals(bent, isolated=deck), pulse)]
    [('free', 0.29), ('isolated', 0.39)]
    """
    found = []
    for name, model in rivals.models.items():
        if isinstance(model, RockingFrame):
            found.append(_rocking(name, with_contact(respond(model, motion), motion), motion))
        else:
            response = respond_oscillator(model, motion)
            found.append(_oscillating(name, response, motion, rivals.frame))
    if ensemble is None or not ensemble.members:
        return found
    return [
        replace(one, ensemble=_ensemble(one.model, rivals, motion, ensemble, versions))
        for one in found
    ]


@lru_cache(maxsize=64)
def bridge_draws(ensemble: BridgeEnsemble) -> dict[str, tuple[float, ...]]:
    """Return the factors of the members on each property of bridges that do not rock [1].

    Examples
    --------
    >>> friction = bridge_draws(BridgeEnsemble())["friction"]
    >>> len(friction), round(friction[0], 4)  # the same in each version
    (64, 0.8539)
    """
    rng = np.random.default_rng([ensemble.seed, 1])  # not the draws of the rocking bridges
    drawn = hypercube(rng, ensemble.members, len(_SPREADS))
    return {
        name: tuple((1.0 + getattr(ensemble, name) * (2.0 * drawn[:, k] - 1.0)).tolist())
        for k, name in enumerate(_SPREADS)
    }


#: Spreads of bridges that do not rock.
_SPREADS: Final = (
    *("friction", "isolator_strength", "isolator_stiffness", "cracked_stiffness"),
    "yield_strength",
)


def bridge_members(
    ensemble: BridgeEnsemble, model: IsolatedDeck | FixedFrame
) -> Sequence[IsolatedDeck | FixedFrame]:
    """Return each member of the ensemble of a bridge that does not rock.

    Raises
    ------
    ParameterError
        If a member is impossible; it names the spread and the value of the member.

    Examples
    --------
    >>> deck = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
    >>> ratios = [one.strength_ratio for one in bridge_members(BridgeEnsemble(), deck)]
    >>> 0.051 < min(ratios) < 0.052 < 0.068 < max(ratios) < 0.069
    True
    """
    factors = bridge_draws(ensemble)
    if isinstance(model, IsolatedDeck):
        pendulum = model.yield_displacement == 0.0
        strength = factors["friction" if pendulum else "isolator_strength"]
        stiffness = (1.0,) * ensemble.members if pendulum else factors["isolator_stiffness"]
        return [
            replace(
                model,
                strength_ratio=model.strength_ratio * strong,
                period=model.period / math.sqrt(stiff),
            )
            for strong, stiff in zip(strength, stiffness, strict=True)
        ]
    found = []
    for number, (stiff, strong) in enumerate(
        zip(factors["cracked_stiffness"], factors["yield_strength"], strict=True), 1
    ):
        try:
            found.append(
                replace(
                    model,
                    period=model.period / math.sqrt(stiff),
                    stability_coefficient=model.stability_coefficient / stiff,
                    strength_ratio=model.strength_ratio * strong,
                )
            )
        except ParameterError as error:
            raise ParameterError(
                f"Invalid spread cracked_stiffness {ensemble.cracked_stiffness:g} of the ensemble "
                f"of {model.name!r}: member {number} has {stiff:.4g} times the stiffness. {error} "
                "State a smaller spread."
            ) from None
    return found


def _ensemble(
    name: str,
    rivals: Rivals,
    motion: Record | Pulse | GroundAcceleration,
    ensemble: BridgeEnsemble,
    versions: Versions | None,
) -> EnsembleResponse:
    """Return the response of the ensemble of one model."""
    model = rivals.models[name]
    if isinstance(model, RockingFrame):
        return ensemble_responses([motion], [model], ensemble, [versions])[0][0]
    every = [as_ground(motion)] * ensemble.members
    if versions is not None:
        every = [versions.grounds[k] for k in versions.of_member]
    scales = draws(ensemble)[:, 3].tolist()
    grounds = [one.scaled(scale) for one, scale in zip(every, scales, strict=True)]
    found = [
        _oscillating(name, respond_oscillator(member, ground), ground, rivals.frame)
        for member, ground in zip(bridge_members(ensemble, model), grounds, strict=True)
    ]
    fallen = np.array([math.isinf(one.peak_u) for one in found])
    limited = rivals.frame.abutment is not None or isinstance(model, FixedFrame)
    bands = {
        name: _band(np.where(fallen, np.inf, [getattr(one, name) for one in found]))
        for name in _OF_COMPARED
    }
    return EnsembleResponse(
        members=ensemble.members,
        uplifted=None,
        overturned=int(fallen.sum()),
        model_ends=sum(one.validity is not Validity.HOLDS for one in found) if limited else None,
        bands=Bands(bands),
    )


def _band(peaks: Float) -> Band:
    low, middle, high = quantiles(peaks).tolist()
    return low, middle, high


#: Quantities with bands of bridges that do not rock.
_OF_COMPARED: Final = ("peak_u", "peak_v", "peak_base_shear")


def _rocking(
    name: str, response: Response, motion: Record | Pulse | GroundAcceleration
) -> Compared:
    frame, tied = response.frame, response.restraint
    overturned = response.verdict is Verdict.OVERTURNS
    forces = reactions(response, motion)
    shear = forces.support_shear / (1.0 + frame.mass_ratio)
    ends = {Validity.OVERTURNS: _known(response.overturning_time)} if overturned else {}
    if frame.abutment is not None:
        if response.peak_u >= frame.abutment.gap:
            ends[Validity.GAP_CLOSES] = _known(response.gap_closed_time)
        if response.peak_v >= frame.abutment.uplift_allowance:
            ends[Validity.LIFT_EXCEEDED] = _known(response.lift_exceeded_time)
    if tied is not None and frame.tendon is not None and not frame.tendon.loses_prestress:
        ends[Validity.TENDON_YIELDS] = tied.tendon_yields
    validity, until = _first(ends)
    demands = [
        getattr(response.contact, f"{joint}_friction_demand", math.nan)
        for joint in ("base", "top", "impact")
    ]
    rest = 0.0 if tied is None or math.isnan(tied.residual_rotation) else tied.residual_rotation
    return Compared(
        model=name,
        time=response.time,
        u=response.u,
        v=response.v,
        base_shear=shear,
        peak_u=math.inf if overturned else response.peak_u,
        peak_v=math.inf if overturned else response.peak_v,
        residual_u=math.inf if overturned else float(frame.horizontal_displacement(rest)),
        peak_base_shear=_largest_until(until, response.time, shear),
        peak_rotation_ratio=response.peak_rotation_ratio,
        peak_tendon_force=math.nan if tied is None else tied.peak_tendon_force,
        friction_demand=max((one for one in demands if not math.isnan(one)), default=math.nan),
        validity=validity,
        valid_until=until,
        gap_closed_time=response.gap_closed_time,
        closing_velocity=response.closing_velocity,
    )


def _oscillating(
    name: str,
    response: OscillatorResponse,
    motion: Record | Pulse | GroundAcceleration,
    frame: RockingFrame,
) -> Compared:
    ground = ground_at_nodes(response.time, motion)[0] / GRAVITY
    gamma = frame.mass_ratio
    moved = gamma + (COLUMN_SHARE if isinstance(response.model, FixedFrame) else 0.0)
    shear = (ground * (1.0 + gamma - moved) - moved * response.force_ratio) / (1.0 + gamma)
    closed = closing = math.nan
    ends: dict[Validity, float] = {}
    history = response.time, response.u, response.velocity
    if frame.abutment is not None:
        closed, closing = first_crossing(*history, frame.abutment.gap)
        if response.peak_displacement >= frame.abutment.gap:
            ends[Validity.GAP_CLOSES] = _known(closed)
    if isinstance(response.model, FixedFrame):
        limit = response.model.limit_ductility * response.model.yield_displacement
        if response.peak_displacement >= limit:
            ends[Validity.DUCTILITY_EXCEEDED] = _known(first_crossing(*history, limit)[0])
    validity, until = _first(ends)
    return Compared(
        model=name,
        time=response.time,
        u=response.u,
        v=np.zeros_like(response.u),
        base_shear=shear,
        peak_u=response.peak_displacement,
        peak_v=0.0,
        residual_u=abs(response.residual_displacement),
        peak_base_shear=_largest_until(until, response.time, shear),
        ductility=response.ductility,
        validity=validity,
        valid_until=until,
        gap_closed_time=closed,
        closing_velocity=closing,
    )


def _largest_until(end: float, time: Float, shear: Float) -> float:
    """Return the largest |shear| at the nodes until the validity ends; NaN if it does not."""
    count = time.size if math.isnan(end) else max(1, int(np.searchsorted(time, end, "right")))
    return float(np.nanmax(np.abs(shear[:count])))


def _known(time: float) -> float:
    """Return a time; infinite instead of NaN, for events between or after the nodes."""
    return math.inf if math.isnan(time) else time


def _first(ends: dict[Validity, float]) -> tuple[Validity, float]:
    """Return the event that first ends the validity, and its time; NaN if the time is unknown."""
    happens = {end: time for end, time in ends.items() if not math.isnan(time)}
    if not happens:
        return Validity.HOLDS, math.nan
    first = min(happens, key=lambda end: happens[end])
    return first, happens[first] if math.isfinite(happens[first]) else math.nan
