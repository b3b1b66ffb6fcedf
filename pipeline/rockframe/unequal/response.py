"""Response of a bent of two unequal columns to a ground motion, with histories and joint forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import plain
from rockframe.errors import ParameterError
from rockframe.notebook import Shown, history_dataset
from rockframe.record import Record
from rockframe.rocking.assessments import (
    Band,
    EnsembleResponse,
    Margin,
    PartResponse,
    verdict_of,
)
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import ToPulse, as_ground, refuse_flight, vertical_in_g
from rockframe.rocking.verdict import SpreadVerdict, Verdict
from rockframe.unequal.bent import UnequalBent, bent_positions, linkage_of, require_bent, tables
from rockframe.unequal.kernels import kernel
from rockframe.unequal.linkage import Pose, Velocities
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from rockframe.unequal.forces import BentDemand, BentForces

Float = NDArray[np.float64]
Motion = Record | Pulse | GroundAcceleration

#: Number of impacts whose times are stored; all impacts are counted.
_LOGGED_IMPACTS = 4096
#: Rounds of the iteration for the course at a stated rotation.
_ROUNDS = 60


@dataclass(frozen=True, eq=False, repr=False)
class BentResponse(Shown):
    """The rocking response of a bent of two unequal columns.

    Parameters
    ----------
    bent : UnequalBent
        The bent.
    time : array, shape (nodes,)
        Times of the nodes of the motion [s].
    theta, theta_2, psi : array, shape (nodes,)
        Rotations of the left column, the right column and the beam, clockwise [rad]; NaN after
        overturning.
    omega, omega_2, psi_rate : array, shape (nodes,)
        Rates of these rotations [rad s-1]; those just after an impact.
    u, v : array, shape (nodes,)
        Displacement of the beam's centre of mass relative to the ground, to the right and up [m].
    verdict : Verdict
        Nominal outcome. The bent overturns if a column reaches pi/2 or the linkage its dead centre,
        during the motion or freely after it.
    peaks : tuple of (float, float)
        Largest |theta| to the right and to the left [rad], including free rocking after the end of
        the motion.
    peak_time : float
        Time of the peak that is nearer to its equilibrium [s]; NaN if it is reached after the end
        of the motion or never.
    uplift_time, overturning_time : float
        Times of the first uplift and of overturning [s]; NaN if there is none.
    impacts : int
        Number of impacts during the motion, and those after it that precede overturning.
    impact_times, impact_velocities : array
        Time [s] of each of the first 4096 impacts, and the rate of theta just before it [rad s-1].
    margin : Margin, optional
        Margin against overturning, if it was computed.
    ensemble : EnsembleResponse, optional
        Response of an ensemble of plausible bents, if it was computed.
    to_pulse : ToPulse, optional
        Response to the record's pulse alone, if it was computed.
    contact, forces, column_forces, column_bands : object, optional
        Friction that the joints need, base shear, and forces in the joints of both columns with
        their quantiles over the ensemble, as `rockframe.unequal.forces` has them, if computed.
    parts : tuple of PartResponse
        Responses to the motions of a sequence.
    """

    #: Names of the histories.
    HISTORIES: ClassVar = (
        *("time", "theta", "theta_2", "psi", "omega", "omega_2", "psi_rate", "u", "v"),
        *("impact_times", "impact_velocities"),
    )

    bent: UnequalBent
    time: Float
    theta: Float
    theta_2: Float
    psi: Float
    omega: Float
    omega_2: Float
    psi_rate: Float
    u: Float
    v: Float
    verdict: Verdict
    peaks: tuple[float, float]
    peak_time: float
    uplift_time: float
    overturning_time: float
    impacts: int
    impact_times: Float
    impact_velocities: Float
    margin: Margin | None = None
    ensemble: EnsembleResponse | None = None
    to_pulse: ToPulse | None = None
    contact: BentDemand | None = None
    forces: BentDemand | None = None
    column_forces: BentForces[float] | None = None
    column_bands: BentForces[Band] | None = None
    parts: tuple[PartResponse, ...] = ()

    @property
    def structure(self) -> UnequalBent:
        """The bent."""
        return self.bent

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict, from the ensemble if there is one."""
        return verdict_of(self, {})

    @property
    def peak_rotation(self) -> float:
        """Largest |theta| on either side [rad]."""
        return max(self.peaks)

    @property
    def peak_rotation_ratio(self) -> float:
        """Largest |theta| over its value at the unstable equilibrium of the same side [1]."""
        sides = zip(self.peaks, self.bent.balance_rotations, strict=True)
        return max(peak / balance for peak, balance in sides)

    @property
    def peak_rotation_2(self) -> float:
        """Largest |theta_2| [rad]; NaN if the bent overturns."""
        if self.verdict is Verdict.OVERTURNS:
            return math.nan
        return float(np.abs(bent_positions(self.bent, self._turning_points).theta_2).max())

    @property
    def peak_level_difference(self) -> float:
        """Largest difference of level between both ends of the span [m]."""
        return float(np.abs(bent_positions(self.bent, self._turning_points).drop).max())

    @property
    def peak_u(self) -> float:
        """Largest |u| [m]."""
        return float(np.abs(bent_positions(self.bent, self._turning_points).u).max())

    @property
    def peak_v(self) -> float:
        """Largest v [m], up to the unstable equilibrium."""
        right, left = self.bent.balance_rotations
        highest = np.clip(self._turning_points, -left, right)
        return float(bent_positions(self.bent, highest).v.max())

    @property
    def _turning_points(self) -> Float:
        right, left = self.peaks
        return np.array([right, -left if left > 0.0 else 0.0])

    def facts(self) -> dict[str, str]:
        """Return verdict and peaks, for the table in notebooks."""
        said = {"structure": self.bent.name, "nominal verdict": self.verdict.label}
        if self.verdict is Verdict.OVERTURNS:
            return said | {"nominal overturning time": f"{self.overturning_time:.2f} s"}
        right, left = self.peaks
        return said | {
            "largest θ, right and left": f"{right:.4f} rad, {left:.4f} rad",
            "largest θ over balance": f"{self.peak_rotation_ratio:.3f}",
            "largest rotation of the right column": f"{self.peak_rotation_2:.4f} rad",
            "largest difference of level of the beam": f"{self.peak_level_difference:.4f} m",
            "largest u": f"{self.peak_u:.3f} m",
            "impacts": str(self.impacts),
        }

    def draw(self, axes: Axes) -> None:
        """Draw the rotations of both columns over time."""
        axes.plot(self.time, self.theta, linewidth=0.9, label="left column")
        axes.plot(self.time, self.theta_2, linewidth=0.9, label="right column")
        right, left = self.bent.balance_rotations
        axes.axhspan(-left, right, color="0.94", zorder=0)
        axes.set(xlabel="time [s]", ylabel="θ [rad]", ylim=(-1.5 * left, 1.5 * right))
        axes.legend(fontsize=8)
        axes.set_title(plain(f"{self.bent.name}: {self.verdict.label}"), parse_math=False)

    def to_xarray(self) -> xr.Dataset:
        """Return the histories over time, with verdict, peak ratio and impacts as attributes."""
        histories = {
            "theta": (self.theta, "rad", "rotation of the left column"),
            "theta_2": (self.theta_2, "rad", "rotation of the right column"),
            "psi": (self.psi, "rad", "rotation of the beam"),
            "omega": (self.omega, "rad s-1", "rate of the rotation of the left column"),
            "u": (self.u, "m", "horizontal displacement of the beam relative to the ground"),
            "v": (self.v, "m", "vertical displacement of the beam"),
        }
        return history_dataset(
            self.time,
            histories,
            structure=self.bent.name,
            verdict=str(self.verdict),
            peak_rotation_ratio=self.peak_rotation_ratio,
            impacts=self.impacts,
        )


def respond_bent(
    bent: UnequalBent,
    motion: Motion,
    *,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    free_rocking: float = 0.0,
) -> BentResponse:
    """Return the rocking response of a bent of two unequal columns.

    A positive ground acceleration starts a rotation with theta < 0 (the bent lags behind).

    Parameters
    ----------
    bent : UnequalBent
        The bent.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration, as for `respond`; it may have a vertical component.
    initial_rotation, initial_velocity : float
        Rotation of the left column [rad] and its rate [rad s-1] at the start. A rate without a
        rotation is towards the side of its sign.
    free_rocking : float
        Time after the end of the motion for which the histories continue [s]. The verdict does not
        depend on it.

    Returns
    -------
    BentResponse
        Histories at the nodes of the motion, and the verdict.

    Raises
    ------
    ParameterError
        If the motion or the initial state is not finite, the initial rotation is beyond the end of
        the model, or the ground falls faster than gravity.

    Notes
    -----
    Re-derived for a four-bar linkage, `rockframe.unequal.linkage`. For equal columns it is eq (26)
    with eq (43) of Makris and Vassiliou (2013).

    Examples
    --------
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> response = respond_bent(bent, pulse)
    >>> response.verdict.label, round(response.peak_rotation_ratio, 3)
    ('stands', 0.381)
    """
    require_bent(bent)
    ground = as_ground(motion).followed_by_rest(free_rocking)
    refuse_flight(ground)
    table = tables(bent)
    time = ground.time
    histories = np.empty((time.size, 3))
    log = np.empty((_LOGGED_IMPACTS, 3))
    summary = np.empty(kernel.SUMMARY_SIZE)
    verdict = kernel.integrate(
        np.ascontiguousarray(ground.coefficients / GRAVITY),
        np.ascontiguousarray(vertical_in_g(ground)),
        ground.time_step,
        ground.start_time,
        table.numbers[0],
        float(table.frequency[0]),
        _start(bent, initial_rotation, initial_velocity),
        histories,
        log,
        summary,
    )
    impacts = int(summary[kernel.IMPACTS])
    logged = log[:impacts]
    states = _states(bent, histories)
    right, left = _rotations(bent, summary[[kernel.PEAK_RIGHT, kernel.PEAK_LEFT]][:, None])[:, 0]
    sign = 1.0 - 2.0 * logged[:, 2]
    return BentResponse(
        bent=bent,
        time=time,
        **states,
        verdict=Verdict(verdict),
        peaks=(float(right), float(left)),
        peak_time=float(summary[kernel.PEAK_TIME]),
        uplift_time=float(summary[kernel.UPLIFT_TIME]),
        overturning_time=float(summary[kernel.OVERTURNING_TIME]),
        impacts=impacts,
        impact_times=logged[:, 0].copy(),
        impact_velocities=sign * _rate_at_rest(bent, logged),
    )


def _rate_at_rest(bent: UnequalBent, logged: Float) -> Float:
    """Return the rates of theta of impacts from those of the course [rad s-1]."""
    table = tables(bent)
    factor = bent_scale(bent) * table.stretch[0]
    return np.asarray(logged[:, 1] / factor[logged[:, 2].astype(int)])


def bent_scale(bent: UnequalBent) -> float:
    """Return the rate of the course over that of theta at rest [1], before its stretch."""
    return float(linkage_of(bent).closed.rotations.max())


def _rotations(bent: UnequalBent, course: Float) -> Float:
    """Return |theta| at courses of the kernel, shape (2 sides, points)."""
    table = tables(bent)
    within = course[None] / table.stretch[0][:, None]
    return np.asarray(table.courses.rotations(within)[0, 0])


def _start(bent: UnequalBent, rotation: float, velocity: float) -> tuple[float, float, int]:
    """Return course, its rate and side of an initial state."""
    if not math.isfinite(velocity):
        raise ParameterError(f"Invalid initial_velocity {velocity!r}. Must be finite.")
    if rotation == 0.0 and velocity == 0.0:
        return 0.0, 0.0, -1
    direction = rotation if rotation != 0.0 else velocity
    side = 0 if direction > 0.0 else 1
    table = tables(bent)
    grid = np.linspace(0.0, 0.5 * math.pi, 2001)
    ends = _rotations(bent, np.broadcast_to(grid, (2, grid.size)))[side]
    last = int(ends.argmax())
    if not abs(rotation) < ends[last]:
        raise ParameterError(
            f"Invalid initial_rotation {rotation!r} rad. Must be within {ends[last]:.4g} rad, "
            "where the model ends."
        )
    above = int(np.searchsorted(ends[: last + 1], abs(rotation)))
    low, high = grid[max(above - 1, 0)], grid[above]
    for _ in range(_ROUNDS):
        middle = 0.5 * (low + high)
        below = _rotations(bent, np.full((2, 1), middle))[side, 0] < abs(rotation)
        low, high = (middle, high) if below else (low, middle)
    course = 0.5 * (low + high) if rotation != 0.0 else 0.0
    field = _field(bent, np.full((2, 1), course / table.stretch[0, side]))[1]
    slope = float(field.rotations[0, 0, side, 0]) / table.stretch[0, side]
    return course, math.copysign(1.0, direction) * velocity / slope, side


def _field(bent: UnequalBent, course: Float) -> tuple[Pose, Velocities]:
    """Return pose and tangent at courses of both sides before their stretch, shape (2, points)."""
    table, linkage = tables(bent), linkage_of(bent)
    pose = linkage.pose(table.courses.rotations(course[None]))
    return pose, linkage.tangent(pose, table.courses.inertia[..., None])


def _states(bent: UnequalBent, histories: Float) -> dict[str, Any]:
    """Return the histories of a response from those of the kernel."""
    course, rate, side = histories.T
    table, linkage = tables(bent), linkage_of(bent)
    stretch = table.stretch[0]
    within = np.stack([np.where(side == j, course, 0.0) / stretch[j] for j in range(2)])
    theta = table.courses.rotations(within[None])
    pose = linkage.pose(theta)
    field = linkage.tangent(pose, table.courses.inertia[..., None])
    psi = linkage.beam_rotation(pose)
    u, v = linkage.beam_displacement(pose)
    left = side == 1.0
    gone = np.isnan(side)

    def signed(values: Float, *, even: bool = False) -> Float:
        right, mirrored = values[0]
        chosen = np.where(left, mirrored if even else -mirrored, right)
        return np.where(gone, math.nan, chosen)

    speed = rate / np.where(left, stretch[1], stretch[0])
    return {
        "theta": signed(theta[0]),
        "theta_2": signed(theta[1]),
        "psi": signed(psi),
        "omega": signed(field.rotations[0]) * speed,
        "omega_2": signed(field.rotations[1]) * speed,
        "psi_rate": signed(field.turn) * speed,
        "u": signed(u),
        "v": signed(v, even=True),
    }
