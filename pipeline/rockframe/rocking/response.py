"""Response of a frame, free or restrained, to a ground motion or to its pulse, with histories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import plain
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.notebook import Shown, history_dataset
from rockframe.parts import Abutment
from rockframe.record import Record
from rockframe.rocking.assessments import (
    Band,
    ContactDemand,
    EnsembleResponse,
    JointForces,
    Margin,
    PartResponse,
    verdict_of,
)
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import kernel, ties
from rockframe.rocking.kernels.ties import TIE_LOG_SIZE
from rockframe.rocking.verdict import SpreadVerdict, Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]
#: Motions that shake a frame.
Motion = Record | Pulse | GroundAcceleration

#: Largest moment of ties over that of gravity. The stronger the ties, the smaller the kernel's
#: steps.
_STRONGEST: Final = 1e4
_NONE: Final = (0.0, 0.0, math.inf, -math.inf, ties.ELASTIC)


@dataclass(frozen=True, eq=False)
class RestraintResponse:
    """Forces, yielding and energy of the tendons and dissipaters of a frame.

    Parameters
    ----------
    tendon_force : array, shape (nodes,)
        Force of one tendon [N]; NaN after overturning, or without tendons.
    dissipater_force : array, shape (nodes,)
        Force of the dissipaters across one joint [N]; NaN after overturning, or without them.
    peak_tendon_force, peak_dissipater_force : float
        Largest force of a tendon, and of the dissipaters across one joint, also after the end of
        the motion [N]; NaN without them.
    tendon_yields, dissipater_yields : float
        Time at which the yield force is first reached [s]; NaN if never.
    tendon_force_left : float
        Force of a tendon when the frame has come to rest [N]: less than the prestress if the tendon
        has yielded, more if dissipaters keep the joints open; NaN if the frame overturns.
    dissipated_energy : float
        Energy dissipated by yielding in one column, over the weight of the column [m].
    residual_rotation : float
        The |theta| at which the frame comes to rest [rad]; above zero if dissipaters keep the
        joints open. The moments of gravity, tendon and yielded dissipaters then balance.
    """

    tendon_force: Float
    dissipater_force: Float
    peak_tendon_force: float
    peak_dissipater_force: float
    tendon_yields: float
    dissipater_yields: float
    tendon_force_left: float
    dissipated_energy: float
    residual_rotation: float


def ties_of(frame: RockingFrame) -> ties.Ties:
    """Return the ties of a frame for the kernel, as moments over the moment of gravity.

    Raises
    ------
    ParameterError
        If a tie is so strong that the kernel would never end.
    """
    if not frame.restrained:
        return ()
    tendon, dissipater = _NONE, _NONE
    if frame.tendon is not None:
        lever = frame.tie_lever
        tendon = (
            frame.tie_moment(frame.tendon.stiffness * lever, lever),
            frame.tie_moment(frame.tendon.prestress, lever),
            frame.tie_moment(frame.tendon.yield_force, lever),
            *((0.0, ties.CABLE) if frame.tendon.loses_prestress else (-math.inf, ties.ELASTIC)),
        )
    if frame.dissipater is not None:
        lever = frame.dissipater.lever_arm
        highest = frame.joints * frame.tie_moment(frame.dissipater.yield_force, lever)
        dissipater = (
            frame.joints * frame.tie_moment(frame.dissipater.stiffness * lever, lever),
            *(0.0, highest, -highest, ties.PLASTIC),
        )
    for name, tie in (("tendon", tendon), ("dissipater", dissipater)):
        moment = max(part for part in tie[:3] if math.isfinite(part))
        if moment > _STRONGEST:
            raise ParameterError(
                f"Invalid {name} of frame {frame.name!r}: its stiffness or force has {moment:.3g} "
                f"times the moment of gravity. Must be {_STRONGEST:g} times at most."
            )
    return tendon, dissipater


def restraint_response(
    frame: RockingFrame, forces: Float, log: Float, peak_rotation: float
) -> RestraintResponse:
    """Convert the kernel's results on the ties to forces.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    forces, log : array
        The arrays `forces` and `tie_log` that `kernel.integrate` filled.
    peak_rotation : float
        Largest |theta| [rad].
    """
    tendon, dissipater = frame.tendon, frame.dissipater
    nothing = np.full(forces.shape[0], math.nan)
    left = math.nan
    highest = min(peak_rotation, frame.abutment_rotation)
    tendon_force = dissipater_force = nothing
    if tendon is not None:
        tendon_force = forces[:, 0] / frame.tie_moment(1.0, frame.tie_lever)
        rest = float(log[0, ties.REST])
        if not math.isnan(rest):
            stretched = ties.stretch(rest) - float(log[0, ties.PLASTIC_STRETCH])
            left = max(0.0, tendon.prestress + tendon.stiffness * frame.tie_lever * stretched)
    if dissipater is not None:
        dissipater_force = forces[:, 1] / frame.tie_moment(frame.joints, dissipater.lever_arm)
    return RestraintResponse(
        tendon_force=tendon_force,
        dissipater_force=dissipater_force,
        peak_tendon_force=frame.tension(highest) if tendon else math.nan,
        peak_dissipater_force=frame.bar_force(highest) if dissipater else math.nan,
        tendon_yields=float(log[0, ties.YIELD_TIME]),
        dissipater_yields=float(log[1, ties.YIELD_TIME]),
        tendon_force_left=left,
        dissipated_energy=float(log[:, ties.WORK].sum()) * frame.moment_arm,
        residual_rotation=float(log[0, ties.REST]),
    )


def first_crossing(time: Float, u: Float, velocity: Float, level: float) -> tuple[float, float]:
    """Return when and how fast |u| first reaches a level; between nodes u is a Hermite cubic.

    Returns
    -------
    (float, float)
        Time [s] and speed [m s-1]; NaN if the level is never reached.

    Examples
    --------
    >>> time = np.array([0.0, 1.0])
    >>> first_crossing(time, time**2, 2.0 * time, 0.25)
    (0.5, 1.0)
    """
    if abs(u[0]) >= level:
        return float(time[0]), abs(float(velocity[0]))
    size, speed = np.abs(u), np.abs(velocity)
    # no Hermite cubic exceeds its larger end by more than 4/27 of this
    within = (speed[1:] + speed[:-1]) * np.diff(time)
    near = np.flatnonzero(np.maximum(size[1:], size[:-1]) + 4.0 / 27.0 * within >= level)
    if not near.size:
        return math.nan, math.nan
    from scipy.interpolate import CubicHermiteSpline  # takes long to import

    for k in near:
        piece = slice(k, k + 2)
        path = CubicHermiteSpline(time[piece], u[piece], velocity[piece])
        side = u[k] if size[k] > size[k + 1] else u[k + 1]
        roots = path.solve(math.copysign(level, side), extrapolate=False)
        if roots.size or size[k + 1] >= level:
            when = float(roots[0]) if roots.size else float(time[k + 1])
            return when, abs(float(path(when, 1)))
    return math.nan, math.nan


#: Number of impacts whose times are stored; all impacts are counted.
_LOGGED_IMPACTS = 4096


@dataclass(frozen=True, eq=False, repr=False)
class Response(Shown):
    """The rocking response of a frame: histories, peaks and verdict.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    time, theta, omega : array, shape (nodes,)
        Time [s], rotation [rad] and its rate [rad s-1]; NaN after overturning. At an impact the
        rate is that just after it.
    verdict : Verdict
        Nominal outcome. A frame overturns if its rotation reaches pi/2, during the motion or freely
        after it.
    peak_rotation : float
        Largest absolute rotation [rad], including free rocking after the end of the motion.
    peak_time : float
        Time of the peak rotation [s]; NaN if it is reached after the end of the motion or never.
    uplift_time, overturning_time : float
        Times of the first uplift and of overturning [s]; NaN if there is none.
    impacts : int
        Number of impacts during the motion, and the one after it that may precede overturning.
        Impacts slower than 1e-10 p-hat, just before rest, are not counted.
    impact_times, impact_velocities : array
        Time [s] of each of the first 4096 impacts, and the rate just before it [rad s-1].
    to_pulse : ToPulse, optional
        Response to the record's pulse alone, if `with_pulse` added it.
    margin : Margin, optional
        Margin against overturning, if `with_margins` added it.
    ensemble : EnsembleResponse, optional
        Response of an ensemble of plausible structures, if `with_ensemble` added it.
    theta_low, theta_high : array, shape (nodes,), optional
        The 16 and 84 % quantiles of the rotations of that ensemble [rad], if `with_envelope` added
        them; infinite where a quantile falls on a member that has overturned.
    contact : ContactDemand, optional
        Demand on the joints, if `with_contact` added it.
    forces : JointForces, optional
        Largest forces at the joints, if `with_forces` added them.
    force_bands : JointForces, optional
        Bands of these forces of an ensemble, if `with_forces` added them.
    restraint : RestraintResponse, optional
        Response of tendons and dissipaters, if there are any.
    gap_closed_time, closing_velocity : float
        Time [s] and velocity [m s-1] at which the deck first closes the gap of the frame's
        abutment; NaN if never during the motion, or without an abutment. The response is not valid
        after this time.
    lift_exceeded_time : float
        Time at which the deck's lift first exceeds the allowance of the abutment [s]; NaN if never
        during the motion, or without an abutment.
    parts : tuple of PartResponse
        Responses to the motions of a sequence, if `with_parts` added them.
    """

    #: Names of the histories.
    HISTORIES: ClassVar = ("time", "theta", "omega", "impact_times", "impact_velocities")

    frame: RockingFrame
    time: Float
    theta: Float
    omega: Float
    verdict: Verdict
    peak_rotation: float
    peak_time: float
    uplift_time: float
    overturning_time: float
    impacts: int
    impact_times: Float
    impact_velocities: Float
    to_pulse: ToPulse | None = None
    margin: Margin | None = None
    ensemble: EnsembleResponse | None = None
    theta_low: Float | None = None
    theta_high: Float | None = None
    contact: ContactDemand | None = None
    forces: JointForces[float] | None = None
    force_bands: JointForces[Band] | None = None
    restraint: RestraintResponse | None = None
    gap_closed_time: float = math.nan
    closing_velocity: float = math.nan
    lift_exceeded_time: float = math.nan
    parts: tuple[PartResponse, ...] = ()

    def facts(self) -> dict[str, str]:
        """Return verdict and peaks, for the table in notebooks."""
        verdict = self.spread_verdict
        said = {
            "structure": self.frame.name,
            "nominal verdict" if verdict.is_nominal else "verdict": verdict.sentence,
        }
        if self.ensemble is not None:
            said |= self.ensemble.facts()
        if self.verdict != Verdict.OVERTURNS:
            said["largest θ/α"] = f"{self.peak_rotation_ratio:.3f}"
            said["largest u"] = f"{self.peak_u:.3f} m"
            said["largest v"] = f"{self.peak_v:.4f} m"
        else:
            said["nominal overturning time"] = f"{self.overturning_time:.2f} s"
        if math.isfinite(self.gap_closed_time):
            said["gap closes at"] = f"{self.gap_closed_time:.2f} s"
        return {
            name: value for name, value in {**said, "impacts": str(self.impacts)}.items() if value
        }

    def draw(self, axes: Axes) -> None:
        """Draw theta / alpha over time."""
        axes.axhspan(-1.0, 1.0, color="0.94", zorder=0)
        if self.theta_low is not None and self.theta_high is not None:
            band = np.clip([self.theta_low, self.theta_high], -math.pi, math.pi)
            low, high = band / self.frame.slenderness
            axes.fill_between(self.time, low, high, color="C0", alpha=0.25, linewidth=0.0)
        axes.plot(self.time, self.theta / self.frame.slenderness, linewidth=0.9)
        axes.set(xlabel="time [s]", ylabel="θ/α", ylim=(-1.5, 1.5))
        title = plain(f"{self.frame.name or 'frame'}: {self.spread_verdict.sentence}")
        axes.set_title(title, parse_math=False)

    def to_xarray(self) -> xr.Dataset:
        """Return the histories over time, with verdict, peak ratio and impacts as attributes."""
        histories = {
            "theta": (self.theta, "rad", "rotation of the columns"),
            "omega": (self.omega, "rad s-1", "rate of the rotation"),
            "u": (self.u, "m", "horizontal displacement of the beam relative to the ground"),
            "v": (self.v, "m", "vertical lift of the beam"),
        }
        return history_dataset(
            self.time,
            histories,
            structure=self.frame.name,
            verdict=str(self.verdict),
            peak_rotation_ratio=self.peak_rotation_ratio,
            impacts=self.impacts,
        )

    @property
    def structure(self) -> RockingFrame:
        """The frame."""
        return self.frame

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict, from the ensemble if the response has one, with the margin if it has one.

        Examples
        --------
        >>> from rockframe import Pulse, RockingFrame, respond
        >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=20.0, T_p=1.5)
        >>> respond(RockingFrame(height=3.0, width=0.4), pulse).spread_verdict.words
        'overturns 0.3 s'
        """
        events = {
            "gap_closed_time": self.gap_closed_time,
            "lift_exceeded_time": self.lift_exceeded_time,
            "tendon_yield_time": self.restraint.tendon_yields if self.restraint else math.nan,
        }
        return verdict_of(self, events)

    @property
    def u(self) -> Float:
        """Horizontal displacement of the beam relative to the ground [m], eq (7)."""
        return self.frame.horizontal_displacement(self.theta)

    @property
    def v(self) -> Float:
        """Vertical lift of the beam [m], eq (10)."""
        return self.frame.vertical_displacement(self.theta)

    @property
    def peak_rotation_ratio(self) -> float:
        """Largest |theta| / alpha [1]."""
        return self.peak_rotation / self.frame.slenderness

    @property
    def peak_u(self) -> float:
        """Largest |u| [m]; |u| grows with |theta| up to overturning."""
        return float(self.frame.horizontal_displacement(self.peak_rotation))

    @property
    def peak_v(self) -> float:
        """Largest v [m]; if the columns are prismatic, the beam is highest at |theta| = alpha."""
        highest = min(self.peak_rotation, self.frame.beam.angle)
        return float(self.frame.vertical_displacement(highest))


def respond(
    frame: RockingFrame,
    motion: Record | Pulse | GroundAcceleration,
    *,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    free_rocking: float = 0.0,
) -> Response:
    """Return the rocking response: eq (26), with eq (43) at each impact.

    A positive ground acceleration starts a rotation with theta < 0 (the frame lags behind).

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration. Samples of a record are joined by straight lines; a pulse is a
        continuous function. A `GroundAcceleration` may also have a vertical component.
    initial_rotation, initial_velocity : float
        Rotation [rad] and its rate [rad s-1] at the start.
    free_rocking : float
        Time after the end of the motion for which the histories continue [s]. The verdict does not
        depend on it: once the ground is still, the energy decides exactly.

    Returns
    -------
    Response
        Histories at the nodes of the motion, and the verdict.

    Raises
    ------
    ParameterError
        If the motion or the initial state is not finite, the initial rotation is not within pi/2,
        or the ground falls faster than gravity.

    Notes
    -----
    Makris and Vassiliou (2013), eqs (26), (36), (43).

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> response = respond(bent, pulse)
    >>> response.verdict.name, round(response.peak_rotation_ratio, 4)
    ('STANDS', 0.6517)
    """
    ground = as_ground(motion).followed_by_rest(free_rocking)
    require_some(frames=[frame])
    refuse_flight(ground)
    _require_state(initial_rotation, initial_velocity)
    time = ground.time
    theta = np.empty(time.size)
    omega = np.empty(time.size)
    impact_log = np.empty((_LOGGED_IMPACTS, 2))
    summary = np.empty(kernel.SUMMARY_SIZE)
    crossing = ties_of(frame)
    forces = np.empty((time.size, len(crossing)))
    tie_log = np.empty((len(crossing), TIE_LOG_SIZE))
    verdict = kernel.integrate(
        np.ascontiguousarray(ground.coefficients / GRAVITY),
        np.ascontiguousarray(vertical_in_g(ground)),
        ground.time_step,
        ground.start_time,
        1.0,
        frame.slenderness,
        frame.effective_frequency_parameter,
        frame.restitution,
        initial_rotation,
        initial_velocity,
        theta,
        omega,
        impact_log,
        summary,
        crossing,
        forces,
        tie_log,
    )
    impacts = int(summary[kernel.IMPACTS])
    response = Response(
        frame=frame,
        time=time,
        theta=theta,
        omega=omega,
        verdict=Verdict(verdict),
        peak_rotation=float(summary[kernel.PEAK]),
        peak_time=float(summary[kernel.PEAK_TIME]),
        uplift_time=float(summary[kernel.UPLIFT_TIME]),
        overturning_time=float(summary[kernel.OVERTURNING_TIME]),
        impacts=impacts,
        impact_times=impact_log[:impacts, 0].copy(),
        impact_velocities=impact_log[:impacts, 1].copy(),
        restraint=restraint_response(frame, forces, tie_log, float(summary[kernel.PEAK]))
        if crossing
        else None,
    )
    return response if frame.abutment is None else _at_abutment(response, frame.abutment)


def _require_state(rotation: float, velocity: float) -> None:
    if not (math.isfinite(rotation) and abs(rotation) < 0.5 * math.pi):
        raise ParameterError(f"Invalid initial_rotation {rotation!r} rad. Must be within +-pi/2.")
    if not math.isfinite(velocity):
        raise ParameterError(f"Invalid initial_velocity {velocity!r}. Must be finite.")


def _at_abutment(response: Response, abutment: Abutment) -> Response:
    """Add the times at which the deck closes the gap and exceeds the allowed lift."""
    frame, time = response.frame, response.time
    speed = frame.horizontal_velocity(response.theta, response.omega)
    sunk = response.v < 0.0  # on its way to overturning, the deck sinks below its place at rest
    lift = np.where(sunk, 0.0, response.v)
    rise = np.where(sunk, 0.0, frame.vertical_velocity(response.theta, response.omega))
    closed, velocity = first_crossing(time, response.u, speed, abutment.gap)
    return replace(
        response,
        gap_closed_time=closed,
        closing_velocity=velocity,
        lift_exceeded_time=first_crossing(time, lift, rise, abutment.uplift_allowance)[0],
    )


def as_ground(motion: Record | Pulse | GroundAcceleration) -> GroundAcceleration:
    """Return a record, pulse or ground acceleration as a `GroundAcceleration`."""
    if isinstance(motion, Record):
        return GroundAcceleration.from_samples(motion.acceleration, motion.time_step)
    if isinstance(motion, Pulse):
        return GroundAcceleration.from_pulse(motion)
    if not isinstance(motion, GroundAcceleration):  # such as a list, where types are not checked
        allowed = "a Record, Pulse or GroundAcceleration"  # type: ignore[unreachable]
        raise ParameterError(f"Invalid motion of type {type(motion).__name__}. Must be {allowed}.")
    return motion


def require_some(**named: Sequence[object]) -> None:
    """Raise an error if a sequence of motions, frames or models is none, empty or of others."""
    for label, things in named.items():
        if not hasattr(things, "__len__"):
            kind = type(things).__name__
            raise ParameterError(f"Invalid {label} of type {kind}. Must be a sequence of {label}.")
        if len(things) == 0:
            raise ParameterError(f"Invalid number of {label}, 0. Must be one or more.")
        for item in things if label == "frames" else ():
            if not isinstance(item, RockingFrame):
                kind = type(item).__name__
                raise ParameterError(f"Invalid frame of type {kind}. Must be a RockingFrame.")


def refuse_flight(ground: GroundAcceleration, scale: float = 1.0) -> None:
    """Raise an error if the ground falls faster than gravity: the frame would lose contact."""
    lowest = scale * min(ground.upward_bounds(), key=lambda bound: scale * bound)
    if lowest <= -GRAVITY:
        raise ParameterError(
            f"Invalid vertical acceleration {lowest:.4g} m/s2. Must be above {-GRAVITY:g}: the "
            "frame would lose contact with the ground."
        )


def vertical_in_g(ground: GroundAcceleration) -> Float:
    """Return the vertical acceleration [g] for the kernel; no rows if there is none."""
    if ground.vertical is None:
        return np.empty((0, ground.coefficients.shape[1]))
    return ground.vertical / GRAVITY


@dataclass(frozen=True)
class ToPulse:
    """The response to the pulse of a record alone.

    Parameters
    ----------
    verdict : Verdict
        Verdict under the pulse alone.
    peak_rotation_ratio : float
        Largest |theta| / alpha under the pulse alone [1].
    error : float
        Relative error of the peak rotation: the peak under the pulse over the peak under the
        record, minus 1. NaN if either overturns the frame, or the record does not uplift it.
    """

    verdict: Verdict
    peak_rotation_ratio: float
    error: float

    @classmethod
    def of(cls, response: Any, alone: Any, peak: str, ratio: float | None = None) -> Self:
        """Return it from both responses, with the error of a peak; some kinds have no ratio."""
        at_record, at_pulse = getattr(response, peak), getattr(alone, peak)
        stands = Verdict.OVERTURNS not in (response.verdict, alone.verdict)
        error = at_pulse / at_record - 1.0 if stands and at_record > 0.0 else math.nan
        return cls(alone.verdict, alone.peak_rotation_ratio if ratio is None else ratio, error)


def with_pulse(response: Response, pulse: Pulse) -> Response:
    """Return a response to a record with the response to its pulse added as `to_pulse`.

    Parameters
    ----------
    response : Response
        Response to the record.
    pulse : Pulse
        The record's pulse.

    Examples
    --------
    >>> from rockframe import Pulse, Record, RockingFrame
    >>> import numpy as np
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5, time=5.0)
    >>> samples = pulse.acceleration(0.005 * np.arange(2000))
    >>> record = Record(record_id="pulse", acceleration=samples, time_step=0.005)
    >>> round(abs(with_pulse(respond(bent, record), pulse).to_pulse.error), 3)
    0.0
    """
    alone = respond(response.frame, pulse)
    return replace(response, to_pulse=ToPulse.of(response, alone, "peak_rotation"))
