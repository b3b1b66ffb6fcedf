"""Response of a frame to a ground motion: the shell around the kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.notebook import Shown, history_dataset
from rockframe.record import Record
from rockframe.restraint import Abutment
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import kernel
from rockframe.rocking.kernels.ties import TIE_LOG_SIZE
from rockframe.rocking.restrained import (
    RestraintResponse,
    first_crossing,
    restraint_response,
    ties_of,
)
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from rockframe.rocking.contact import ContactDemand
    from rockframe.rocking.margins.margins import Margin
    from rockframe.rocking.pulse_only_response import ToPulse

Float = NDArray[np.float64]

#: Number of impacts that are kept with their times; all are counted.
_LOGGED_IMPACTS = 4096


class Verdict(IntEnum):
    """Outcome of a response; the values of the flag variable `verdict`.

    ``UNDECIDED`` is a verdict that stated small perturbations change: `with_margins` gives it,
    `respond` does not.
    """

    NO_UPLIFT = kernel.NO_UPLIFT
    SAFE = kernel.SAFE
    OVERTURNED = kernel.OVERTURNED
    UNDECIDED = 3

    def __str__(self) -> str:
        return self.name

    def __format__(self, format_spec: str) -> str:
        return format(self.name, format_spec)


@dataclass(frozen=True, eq=False)
class Response(Shown):
    """Histories of a frame's rocking, and its outcome.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    time, theta, omega : array, shape (nodes,)
        Time [s], rotation [rad] and its rate [rad s-1]; NaN after overturning. The rate at an
        impact is the one after it.
    verdict : Verdict
        Overturned means that the rotation reaches pi/2, during the motion or freely after it.
    peak_rotation : float
        Largest absolute rotation [rad], free rocking after the record's end included.
    peak_time : float
        When [s]; NaN if it is reached after the end of the motion or never.
    uplift_time, overturning_time : float
        First uplift and overturning [s]; NaN if there is none.
    impacts : int
        Number of impacts during the motion; the last ones before rest, slower than
        1e-10 p-hat, are cut off.
    impact_times, impact_velocities : array
        The first 4096 impacts: time [s] and rate just before [rad s-1].
    to_pulse : ToPulse, optional
        What the record's pulse alone does, if `with_pulse` has added it.
    margin : Margin, optional
        How far the verdict is from another one, if `with_margins` has added it.
    contact : ContactDemand, optional
        What the joints must bear, if `with_contact` has added it.
    restraint : RestraintResponse, optional
        What tendons and dissipaters went through, if there are any.
    gap_closed_time, closing_velocity : float
        When the deck first closes the gap of the frame's abutment [s], and how fast [m s-1]; NaN if
        never during the motion, or without an abutment. From then on the frame is another one.
    lift_exceeded_time : float
        When its lift first exceeds the allowance of the abutment [s]; likewise.
    """

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
    contact: ContactDemand | None = None
    restraint: RestraintResponse | None = None
    gap_closed_time: float = math.nan
    closing_velocity: float = math.nan
    lift_exceeded_time: float = math.nan

    def facts(self) -> dict[str, str]:
        """Return verdict and peaks, for the table in notebooks."""
        said = {"structure": self.frame.name, "verdict": str(self.verdict)}
        if self.verdict != Verdict.OVERTURNED:
            said["largest θ/α"] = f"{self.peak_rotation_ratio:.3f}"
            said["largest u"] = f"{self.peak_u:.3f} m"
            said["largest v"] = f"{self.peak_v:.4f} m"
        else:
            said["overturns at"] = f"{self.overturning_time:.2f} s"
        if math.isfinite(self.gap_closed_time):
            said["gap closes at"] = f"{self.gap_closed_time:.2f} s"
        if self.margin is not None:
            said["critical scale"] = f"{self.margin.critical_scale:.3f}"
        return {
            name: value for name, value in {**said, "impacts": str(self.impacts)}.items() if value
        }

    def draw(self, axes: Axes) -> None:
        """Draw theta / alpha over time into axes."""
        axes.axhspan(-1.0, 1.0, color="0.94", zorder=0)
        axes.plot(self.time, self.theta / self.frame.slenderness, linewidth=0.9)
        axes.set(xlabel="time [s]", ylabel="θ/α", ylim=(-1.5, 1.5))
        axes.set_title(f"{self.frame.name or 'frame'}: {self.verdict}")

    def to_xarray(self) -> xr.Dataset:
        """Return the histories over time, with verdict and peaks as attributes."""
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
        """Largest |u| [m]; u grows with |theta| all the way to overturning."""
        return abs(float(self.frame.horizontal_displacement(self.peak_rotation)))

    @property
    def peak_v(self) -> float:
        """Largest v [m]; the beam is highest at |theta| = alpha if prismatic."""
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
    """Integrate eq (26) with eq (43) at each impact.

    Positive ground acceleration starts rotation with theta < 0 (the frame lags behind).

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration. Samples of a record are joined by straight lines; a pulse is taken as
        the continuous function. A `GroundAcceleration` may hold a vertical acceleration too.
    initial_rotation, initial_velocity : float
        Rotation [rad] and its rate [rad s-1] at the start.
    free_rocking : float
        Go on with the histories for so long after the end of the motion [s]. The verdict does not
        need it: once the ground is still it follows from the energy exactly.

    Returns
    -------
    Response
        Histories at the nodes of the motion, and the verdict.

    Raises
    ------
    ParameterError
        If the motion or the initial state is not finite, the frame already overturned, or the
        ground falls faster than gravity.

    Notes
    -----
    Makris and Vassiliou (2013), eqs (26), (36), (43).

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> response = respond(bent, pulse)
    >>> response.verdict.name, round(response.peak_rotation_ratio, 4)
    ('SAFE', 0.6517)
    """
    ground = as_ground(motion).followed_by_rest(free_rocking)
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
        ground.coefficients / GRAVITY,
        vertical_in_g(ground),
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
    """Add when the deck closes the gap or lifts too far."""
    frame, time = response.frame, response.time
    speed = frame.horizontal_velocity(response.theta, response.omega)
    rise = frame.vertical_velocity(response.theta, response.omega)
    closed, velocity = first_crossing(time, response.u, speed, abutment.gap)
    return replace(
        response,
        gap_closed_time=closed,
        closing_velocity=velocity,
        lift_exceeded_time=first_crossing(time, response.v, rise, abutment.uplift_allowance)[0],
    )


def as_ground(motion: Record | Pulse | GroundAcceleration) -> GroundAcceleration:
    """Return the ground acceleration that a record or a pulse stands for."""
    if isinstance(motion, Record):
        return GroundAcceleration.from_samples(motion.acceleration, motion.time_step)
    if isinstance(motion, Pulse):
        return GroundAcceleration.from_pulse(motion)
    return motion


def refuse_flight(ground: GroundAcceleration, scale: float = 1.0) -> None:
    """Refuse a ground that falls faster than gravity: the frame would lose contact with it."""
    lowest = scale * min(ground.upward_bounds(), key=lambda bound: scale * bound)
    if lowest <= -GRAVITY:
        raise ParameterError(
            f"Invalid vertical acceleration {lowest:.4g} m/s2. Must be above {-GRAVITY:g}: the "
            "frame would lose contact with the ground."
        )


def vertical_in_g(ground: GroundAcceleration) -> Float:
    """Vertical acceleration [g] as the kernel takes it: without rows if there is none."""
    if ground.vertical is None:
        return np.empty((0, ground.coefficients.shape[1]))
    return ground.vertical / GRAVITY
