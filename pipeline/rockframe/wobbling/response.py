"""Response of columns with circular ends that roll on their rims, under a rigid slab.

The tilt theta >= 0 and its direction phi describe the motion: the columns do not slide, and do not
spin about their axes, so the slab only translates. For a column of height H with radii b at the
base and b_t at the top, centre of gravity at z, mass m, and inertia I1 about a transverse and I3
about its own axis, with S = b + b_t and gamma the mass ratio, the displacements of the column's
centre and of the slab in the direction phi, and the lift of the slab, are

rho = b (1 - cos theta) + z sin theta,  u = S (1 - cos theta) + H sin theta,
v = S sin theta - H (1 - cos theta).

With A = b^2 + z^2 + I1/m + gamma (S^2 + H^2),
B = rho^2 + gamma u^2 + I1/m sin(theta)^2 + I3/m (1 - cos theta)^2,
V = g [b sin theta - z (1 - cos theta) + gamma v], w = rho + gamma u, and the ground acceleration
a_r in the direction phi and a_t across it, per mass of a column (re-derived):

A theta'' = B' phi'^2 / 2 - V' - a_r w',  (B phi')' = -a_t w.

u and v are those of the planar frame, (7) and (10) of Makris and Vassiliou (2013) in the direction
phi, and A is its inertia.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError, invalid
from rockframe.frame import RockingFrame
from rockframe.notebook import Shown, history_dataset
from rockframe.parts import height_variance
from rockframe.rocking.assessments import (
    Band,
    ContactDemand,
    EnsembleResponse,
    JointForces,
    Margin,
)
from rockframe.rocking.response import ties_of
from rockframe.rocking.verdict import SpreadVerdict, Verdict
from rockframe.units import GRAVITY
from rockframe.wobbling import kernel
from rockframe.wobbling.motion import PairAcceleration, PairMotion, as_pair

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]

#: Default shortening of the contact under the weight [m].
SHORTENING: Final = 1e-4
#: Tilt within which the far rim touches, over the speed at upright and the time constant of the
#: contact [1]; measured in a program for contacts.
TOUCHING: Final = 0.45
#: Energy below which columns are put to rest, over that at which they overturn [1].
_REST: Final = 1e-8
#: Longest step over the time constant of the structure [1]; peaks between steps are then exact to
#: 1e-9 of their size.
_STRIDE: Final = 0.03


@dataclass(frozen=True, eq=False)
class WobblingResponse(Shown):
    """The response of a frame with round columns to both directions of the ground motion.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    time : array, shape (samples,)
        Times of the samples of the motion [s].
    theta, phi : array, shape (samples,)
        Tilt of the columns and its direction, from x towards y [rad]; phi is NaN while the columns
        stand upright, and both are NaN after overturning.
    theta_rate, phi_rate : array, shape (samples,)
        Rates of theta and phi [rad s-1].
    u_x, u_y, v : array, shape (samples,)
        Displacement of the slab from the ground along x and y, and its lift [m].
    verdict : Verdict
        Nominal outcome. A frame overturns if theta reaches pi/2, during the motion or freely after
        it.
    peak_rotation : float
        Largest theta [rad], including free motion after the end of the record.
    peak_time : float
        Time of the largest theta [s]; NaN if it is reached after the end of the motion or never.
    uplift_time, overturning_time : float
        Times of the first uplift and of overturning [s]; NaN if there is none.
    contact_shortening : float
        Shortening of the contact under the weight [m].
    contact : ContactDemand, optional
        Demand on the joints, see `wobbling_contact`.
    forces, force_bands : JointForces, optional
        Largest forces at the joints, see `wobbling_forces`, and their bands over an ensemble.
    margin : Margin, optional
        Margin against overturning.
    ensemble : EnsembleResponse, optional
        Response of plausible structures.
    """

    #: Names of the histories.
    HISTORIES: ClassVar = ("time", "theta", "phi", "theta_rate", "phi_rate", "u_x", "u_y", "v")

    frame: RockingFrame
    time: Float
    theta: Float
    phi: Float
    theta_rate: Float
    phi_rate: Float
    u_x: Float
    u_y: Float
    v: Float
    verdict: Verdict
    peak_rotation: float
    peak_time: float
    uplift_time: float
    overturning_time: float
    contact_shortening: float = SHORTENING
    contact: ContactDemand | None = None
    forces: JointForces[float] | None = None
    force_bands: JointForces[Band] | None = None
    margin: Margin | None = None
    ensemble: EnsembleResponse | None = None

    @property
    def structure(self) -> RockingFrame:
        """The frame."""
        return self.frame

    @property
    def u(self) -> Float:
        """Displacement of the slab from the ground, the length of its vector [m]."""
        return np.hypot(self.u_x, self.u_y)

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict, from the ensemble if the response has one, with the margin if it has one."""
        spread, robust = self.ensemble, self.margin and self.margin.robust
        return SpreadVerdict(
            self.verdict,
            overturning_time=self.overturning_time,
            share_overturned=spread.share_overturned if spread else math.nan,
            share_uplifted=spread.share_uplifted if spread else math.nan,
            robust_scale=robust.s10 if robust else None,
            largest_scale=self.margin.largest_scale if self.margin else math.nan,
        )

    @property
    def peak_rotation_ratio(self) -> float:
        """Largest theta over the slenderness of the frame [1]."""
        return self.peak_rotation / self.frame.slenderness

    @property
    def peak_u(self) -> float:
        """Largest horizontal displacement of the slab, the length of its vector [m]."""
        return float(self.frame.horizontal_displacement(self.peak_rotation))

    @property
    def peak_v(self) -> float:
        """Largest lift of the slab [m]."""
        highest = min(self.peak_rotation, self.frame.beam.angle)
        return float(self.frame.vertical_displacement(highest))

    def facts(self) -> dict[str, str]:
        """Return verdict and peaks, for the table in notebooks."""
        rows = {"structure": self.frame.name, "nominal verdict": self.verdict.label}
        if self.verdict is Verdict.OVERTURNS:
            return rows | {"nominal overturning time": f"{self.overturning_time:.2f} s"}
        return rows | {
            "largest θ/α": f"{self.peak_rotation_ratio:.3f}",
            "largest u": f"{self.peak_u:.3f} m",
            "largest v": f"{self.peak_v:.4f} m",
        }

    def draw(self, axes: Axes) -> None:
        """Draw the path of the slab, seen from above."""
        axes.plot(self.u_x, self.u_y, linewidth=0.9)
        axes.set(xlabel="u_x [m]", ylabel="u_y [m]", aspect="equal")
        axes.set_title(f"{self.frame.name or 'frame'}: {self.verdict.label}")

    def to_xarray(self) -> xr.Dataset:
        """Return the histories over time, with verdict and peak ratio as attributes."""
        histories = {
            "theta": (self.theta, "rad", "tilt of the columns"),
            "phi": (self.phi, "rad", "direction of the tilt, from x towards y"),
            "u_x": (self.u_x, "m", "displacement of the slab along x relative to the ground"),
            "u_y": (self.u_y, "m", "displacement of the slab along y relative to the ground"),
            "v": (self.v, "m", "vertical lift of the slab"),
        }
        return history_dataset(
            self.time,
            histories,
            structure=self.frame.name,
            verdict=str(self.verdict),
            peak_rotation_ratio=self.peak_rotation_ratio,
        )


def wobble(
    frame: RockingFrame,
    motion: PairMotion,
    *,
    contact_shortening: float = SHORTENING,
    start: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
) -> WobblingResponse:
    """Compute the response of a frame with round columns to both directions of a ground motion.

    Parameters
    ----------
    frame : RockingFrame
        Frame or column of circular section, with tendons or without. `width` and `top_width` are
        diameters; the inertia ratio is that of the section, as `inertia_ratio_of`, `tapered` and
        `hollow` return.
    motion : PairAcceleration, HorizontalPair or BothDirections
        The ground motion; of a pair, both horizontal components.
    contact_shortening : float
        Shortening of the contact under the weight [m]: the softer the contact, the farther from
        upright a column passes and still loses energy. At 0 no energy is lost.
    start : sequence of four floats
        theta [rad], its rate [rad s-1], phi [rad] and its rate [rad s-1] at the first sample; by
        default the frame stands at rest.

    Raises
    ------
    ParameterError
        If the columns are not circular; if the frame has dissipaters, an abutment, crushed edges,
        or tendons that lose prestress; if the contact's shortening is negative, the start is not a
        tilt below pi/2 with finite rates, or the ground falls faster than gravity.

    Notes
    -----
    The equations are those of the module; the model is that of Stefanou, Vardoulakis and Mavraganis
    (2011, doi 10.1016/j.ijnonlinmec.2010.07.008) and of Vassiliou (2018, doi 10.1002/eqe.3013): a
    body rolls on its rim without slip, and without spin.

    Rolling loses no energy. A column that passes upright within theta_min loses the share
    L_0 / (1 + (theta_min / theta_c)^2) of its energy, with theta_c = 0.45 |theta'| sqrt(delta / g),
    delta the shortening of the contact, and 1 - L_0 the square of the frame's `restitution`.

    Examples
    --------
    >>> from rockframe import Pulse, inertia_ratio_of
    >>> inertia = inertia_ratio_of("circular", 9.6, 1.6)
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, inertia_ratio=inertia)
    >>> along = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.5)
    >>> across = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.5, time=0.4)
    >>> response = wobble(bent, PairAcceleration.from_pulses(along, across))
    >>> response.verdict.label, round(response.peak_rotation_ratio, 3)
    ('stands', 0.467)
    """
    frame = rolling(frame)
    ground = as_pair(motion)
    require_no_flight(ground)
    history = np.zeros((1, ground.x.size, 4))  # at rest they are not stored
    first = state_of(start)
    verdict, summary = integrated(
        ground,
        [constants(frame, contact_shortening=contact_shortening)],
        starts=first[None],
        history=history,
    )
    states = history[0]
    peak, peak_time, uplift_time, overturning_time, _ = summary[0].tolist()
    states[ground.time > overturning_time] = math.nan
    theta, phi, theta_rate, phi_rate = polar(states)
    # a direction without the round-off of an angle: a motion along x stays exactly on x
    along = states[:, :2].T / np.where(theta == 0.0, 1.0, np.hypot(*states[:, :2].T))
    u_x, u_y = frame.horizontal_displacement(theta) * along
    upright = theta == 0.0
    return WobblingResponse(
        frame=frame,
        time=ground.time,
        theta=theta,
        phi=np.where(upright, math.nan, phi),
        theta_rate=theta_rate,
        phi_rate=np.where(upright, math.nan, phi_rate),
        u_x=u_x,
        u_y=u_y,
        v=frame.vertical_displacement(theta),
        verdict=Verdict(int(verdict[0])),
        peak_rotation=peak,
        peak_time=peak_time,
        uplift_time=uplift_time,
        overturning_time=overturning_time,
        contact_shortening=contact_shortening,
    )


def integrated(
    ground: PairAcceleration,
    members: Sequence[Float] | Float,
    starts: Float | None = None,
    history: Float | None = None,
) -> tuple[NDArray[np.int8], Float]:
    """Return verdicts and summaries of members, see `kernel.integrate`; times [s] are absolute.

    Raises
    ------
    RuntimeError
        If a member took more steps than any motion can need: an internal error.
    """
    count, in_g = len(members), ground.in_g()
    verdicts = np.empty(count, dtype=np.int8)
    summaries = np.empty((count, kernel.SUMMARY_SIZE))
    kernel.integrate(
        np.column_stack([in_g, np.diff(in_g, axis=0, append=in_g[-1:]) / ground.time_step]),
        ground.time_step,
        np.ascontiguousarray(members),
        np.zeros((count, 4)) if starts is None else np.ascontiguousarray(starts),
        verdicts,
        summaries,
        np.empty((0, 0, 4)) if history is None else history,
    )
    if (verdicts == kernel.FAILED).any():
        member = int(np.flatnonzero(verdicts == kernel.FAILED)[0])
        raise RuntimeError(
            f"internal error: the wobbling of member {member} did not end: please report it"
        )
    times = [kernel.PEAK_TIME, kernel.UPLIFT_TIME, kernel.OVERTURNING_TIME]
    summaries[:, times] += ground.start_time
    return verdicts, summaries


def constants(
    frame: RockingFrame,
    *,
    contact_shortening: float = SHORTENING,
    scale: float = 1.0,
    length: float = 1.0,
) -> Float:
    """Return the slots of a member of the kernel, see there.

    Raises
    ------
    ParameterError
        If the shortening is negative or not finite, or the inertia ratio is too small for round
        columns.
    """
    if not (math.isfinite(contact_shortening) and contact_shortening >= 0.0):
        raise invalid(
            "contact_shortening", contact_shortening, f"frame {frame.name!r}", "zero or above"
        )
    gamma, height, centre = frame.mass_ratio, frame.height, frame.centre_height
    radius, reach = 0.5 * frame.width, 0.5 * (frame.width + frame.top_contact_width)
    transverse = (frame.inertia_ratio - 1.0) * frame.size**2
    planar = frame.inertia_ratio * frame.size**2 + gamma * (reach**2 + height**2)
    righting, lever = radius + gamma * reach, centre + gamma * height
    gb, gz = GRAVITY * righting / planar, GRAVITY * lever / planar
    tie_force = tie_stiffness = 0.0
    if frame.tendon is not None:
        arm, mass = frame.tie_lever, (frame.column_mass or math.nan) * planar
        tie_force = frame.tendon.prestress * arm / mass
        tie_stiffness = 2.0 * frame.tendon.stiffness * arm**2 / mass
    member = np.zeros(kernel.MEMBER_SIZE)
    member[[kernel.GB, kernel.GZ]] = gb, gz
    member[kernel.K0] = (centre**2 + gamma * height**2 + transverse) / planar
    member[kernel.K1] = 2.0 * (radius * centre + gamma * reach * height) / planar
    axial = axial_inertia(frame)
    member[kernel.K2] = (radius**2 + gamma * reach**2 + axial) / planar
    member[[kernel.TIE_FORCE, kernel.TIE_STIFFNESS]] = tie_force, tie_stiffness
    member[kernel.LOSS] = 1.0 - frame.restitution**2
    member[kernel.CONTACT] = TOUCHING * math.sqrt(contact_shortening / GRAVITY)
    member[[kernel.SCALE, kernel.LENGTH]] = scale, length
    member[kernel.REST] = _REST * gb**2 / (math.hypot(gb, gz) + gz)
    member[kernel.STRIDE] = _STRIDE / math.sqrt(math.hypot(gb, gz) + 0.5 * tie_stiffness)
    return member


def axial_inertia(frame: RockingFrame) -> float:
    """Return the inertia of a round column about its axis, over its mass [m2].

    It is twice what the section adds to the inertia about a transverse axis.

    Raises
    ------
    ParameterError
        If the inertia ratio is too small for columns of this shape.

    Examples
    --------
    >>> from rockframe import inertia_ratio_of
    >>> inertia = inertia_ratio_of("circular", 9.6, 1.6)
    >>> solid = RockingFrame(height=9.6, width=1.6, inertia_ratio=inertia)
    >>> round(axial_inertia(solid), 9), round(0.8**2 / 2, 9)
    (0.32, 0.32)
    """
    along = height_variance("circular", frame.top_contact_width / frame.width) * frame.height**2
    axial = 2.0 * ((frame.inertia_ratio - 1.0) * frame.size**2 - along)
    if not axial > 0.0:
        least = 1.0 + along / frame.size**2
        raise invalid(
            "inertia_ratio",
            frame.inertia_ratio,
            f"frame {frame.name!r}",
            f"above {least:.6g}, that of round columns without a width",
        )
    return axial


def require_no_flight(ground: PairAcceleration, scale: float = 1.0) -> None:
    """Raise an error if the ground falls faster than gravity: the frame would lose contact."""
    lowest = 0.0 if ground.z is None else scale * float(ground.z.min())
    if lowest <= -GRAVITY:
        raise ParameterError(
            f"Invalid vertical acceleration {lowest:.4g} m/s2. Must be above {-GRAVITY:g}: the "
            "frame would lose contact with the ground."
        )


def rolling(frame: RockingFrame) -> RockingFrame:
    """Return the frame with its section for both directions, which must be circular.

    Raises
    ------
    ParameterError
        If a part is one that the model lacks, the columns are not circular or their inertia is too
        small, or a tendon is so stiff that the kernel would never end.
    """
    if not isinstance(frame, RockingFrame):
        kind = type(frame).__name__  # type: ignore[unreachable]
        raise ParameterError(f"Invalid frame of type {kind}. Must be a RockingFrame.")
    if part := _lacking(frame):
        raise ParameterError(
            f"Invalid frame {frame.name!r} with {part}, for both directions of the ground motion. "
            "Remove them, or respond in one plane."
        )
    frame = frame.in_both_directions
    if frame.column_section != "circular":
        section = frame.column_section or "unknown"
        raise ParameterError(
            f"Invalid section {section} of the columns of frame {frame.name!r}, for both "
            "directions of the ground motion. Must be circular: state the section."
        )
    axial_inertia(frame)
    ties_of(frame)
    return frame


def _lacking(frame: RockingFrame) -> str:
    """Return the first part of a frame that the model lacks; "" if it has all."""
    parts = {
        "dissipaters": frame.dissipater is not None,
        "an abutment": frame.abutment is not None,
        "crushed edges": frame.before_crushing is not None,
        "tendons that lose prestress": frame.tendon is not None and frame.tendon.loses_prestress,
    }
    return next((name for name, present in parts.items() if present), "")


def why_in_one_plane(frame: RockingFrame) -> str:
    """Return why a frame is not computed for both directions, in a few words; "" if it is.

    Examples
    --------
    >>> why_in_one_plane(RockingFrame(height=7.5, width=1.8))
    'columns not circular'
    """
    if part := _lacking(frame):
        return f"with {part}"
    if frame.in_both_directions.column_section != "circular":
        return "columns not circular"
    try:
        rolling(frame)
    except ParameterError as error:
        return str(error)
    return ""


def state_of(start: Sequence[float]) -> Float:
    """Return the state of the kernel of theta, its rate, phi and its rate."""
    values = [float(value) for value in start]
    if len(values) != 4 or not np.isfinite(values).all() or not 0.0 <= values[0] < 0.5 * math.pi:
        raise ParameterError(
            f"Invalid start {tuple(values)}. Must be four finite numbers: theta from 0 to below "
            "pi/2, its rate, phi and its rate."
        )
    theta, theta_rate, phi, phi_rate = values
    if theta == 0.0 and (theta_rate != 0.0 or phi_rate != 0.0):
        raise ParameterError(
            f"Invalid start {tuple(values)}: upright with a rate. Must have a positive theta."
        )
    size = math.tan(0.5 * theta)
    rate = 0.5 * (1.0 + size * size) * theta_rate
    x, y = math.cos(phi), math.sin(phi)
    across = size * phi_rate
    return np.array([size * x, size * y, rate * x - across * y, rate * y + across * x])


def polar(states: Float) -> tuple[Float, Float, Float, Float]:
    """Return theta, phi and their rates of states of the kernel, shape (..., 4)."""
    x, y, x_rate, y_rate = np.moveaxis(states, -1, 0)
    size = np.hypot(x, y)
    with np.errstate(invalid="ignore", divide="ignore"):
        outward, across = (x * x_rate + y * y_rate) / size, (x * y_rate - y * x_rate) / size
        phi_rate = across / size
    theta_rate = np.where(size == 0.0, 0.0, 2.0 * outward / (1.0 + size**2))
    return 2.0 * np.arctan(size), np.arctan2(y, x), theta_rate, phi_rate
