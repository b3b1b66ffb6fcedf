"""Forces at the four joints of a bent of two unequal columns.

Both columns and the beam are statically determinate: the moments of each column about its base
corner, and those of the beam, give the forces at the top joints; the forces at the base follow. The
equations are Newton's and Euler's, re-derived in coordinates that move with the ground. Impulses of
impacts obey the same ones, with changes of velocities in place of accelerations.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields
from functools import lru_cache
from typing import Generic

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import Band, Value
from rockframe.rocking.margins.ensemble import quantiles, shaken
from rockframe.rocking.margins.members import Versions, draws
from rockframe.rocking.reactions import ColumnForces, ground_at_nodes
from rockframe.rocking.verdict import Verdict
from rockframe.unequal.bent import UnequalBent, linkage_of, tables
from rockframe.unequal.ensemble import bent_members
from rockframe.unequal.linkage import Linkage, Pose, Velocities
from rockframe.unequal.response import BentResponse, Motion, respond_bent
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


def bent_forces(response: BentResponse, motion: Motion) -> ColumnForces:
    """Compute the forces at base and top of both columns.

    Parameters
    ----------
    response : BentResponse
        A response from `respond_bent`.
    motion : Record, Pulse or GroundAcceleration
        The ground motion of the response.

    Returns
    -------
    ColumnForces
        Forces on the left and the right column over half the weight of both columns [1]; NaN at
        rest, because the forces of closed joints depend on their stiffness, and after overturning.
        Where a vertical force is not positive, the joint would lift off, and the model does not
        hold.

    Raises
    ------
    ParameterError
        If the response is that of another structure, or the nodes of the motion are not those of
        the response.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> from rockframe.unequal.response import respond_bent
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> forces = bent_forces(respond_bent(bent, pulse), pulse)
    >>> [round(float(np.nanmin(vertical)), 2) for vertical in forces.top_vertical]
    [2.98, 3.01]
    """
    if not isinstance(response, BentResponse):
        kind = type(response).__name__  # type: ignore[unreachable]
        raise ParameterError(f"Invalid response of type {kind}. Must be a BentResponse.")
    across, upwards = ground_at_nodes(response.time, motion)
    left = _on_the_left(response, across, upwards)
    sign = np.where(left, -1.0, 1.0)
    moves = _Moves.of(response, sign * across, upwards, left)
    top_x, top_y = moves.top_forces()
    (columns, _), (base_x, base_y) = moves.masses, moves.column_accelerations
    base_x = columns * (base_x + moves.across) - top_x
    base_y = columns * (base_y + GRAVITY + moves.upwards) - top_y
    unit = 2.0 / GRAVITY

    def chosen(values: Float) -> Float:
        right, mirrored = values[:, 0, 0], values[:, 0, 1]
        return np.where(moves.rocks, unit * np.where(left, mirrored, right), np.nan)

    return ColumnForces(
        base_shear=sign * chosen(base_x),
        base_vertical=chosen(base_y),
        top_shear=sign * chosen(top_x),
        top_vertical=-chosen(top_y),
    )


@dataclass(frozen=True)
class BentForces(Generic[Value]):
    """Largest and least forces in the joints of both columns, over half the weight of all [1].

    They are those at the nodes of the motion while the bent rocks, and NaN if it does not uplift,
    or if it overturns. Of vertical forces, a least one that is not positive means that the joint
    would lift off. Impulses are the largest of all impacts [s], 0 without impacts.

    Parameters
    ----------
    left_base_horizontal, left_base_vertical, left_base_vertical_least : float
        Largest horizontal force between ground and left column, largest and least vertical one.
    left_base_impulse_horizontal, left_base_impulse_vertical : float
        Largest impulses of impacts there [s].
    left_top_horizontal, ..., left_top_impulse_vertical : float
        The same between beam and left column.
    right_base_horizontal, ..., right_top_impulse_vertical : float
        The same of the right column.
    """

    left_base_horizontal: Value
    left_base_vertical: Value
    left_base_vertical_least: Value
    left_base_impulse_horizontal: Value
    left_base_impulse_vertical: Value
    left_top_horizontal: Value
    left_top_vertical: Value
    left_top_vertical_least: Value
    left_top_impulse_horizontal: Value
    left_top_impulse_vertical: Value
    right_base_horizontal: Value
    right_base_vertical: Value
    right_base_vertical_least: Value
    right_base_impulse_horizontal: Value
    right_base_impulse_vertical: Value
    right_top_horizontal: Value
    right_top_vertical: Value
    right_top_vertical_least: Value
    right_top_impulse_horizontal: Value
    right_top_impulse_vertical: Value


@dataclass(frozen=True)
class BentDemand:
    """Largest base shear of a bent, and the friction that its joints need; NaN if it overturns.

    Parameters
    ----------
    peak_base_shear : float
        Largest force of the ground over the weight of columns and beam [1].
    base_friction_demand, top_friction_demand : float
        Largest shear over vertical force at the base and under the beam, of either column [1]; of
        both together while the bent is at rest.
    """

    peak_base_shear: float
    base_friction_demand: float
    top_friction_demand: float


def largest_forces(response: BentResponse, forces: ColumnForces) -> BentForces[float]:
    """Return the largest and least forces in the joints of both columns, and impulses of impacts.

    Parameters
    ----------
    response : BentResponse
        A response from `respond_bent`.
    forces : ColumnForces
        Its forces, from `bent_forces`.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> from rockframe.unequal.response import respond_bent
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> response = respond_bent(bent, pulse)
    >>> largest = largest_forces(response, bent_forces(response, pulse))
    >>> round(largest.left_base_horizontal, 3), round(largest.right_base_horizontal, 3)
    (0.202, 0.215)
    """
    share = 1.0 + response.bent.mass_ratio
    stands = np.isfinite(response.theta).all() and response.verdict is Verdict.STANDS
    rocks = np.isfinite(forces.base_shear[0]) & stands
    impulses = _largest_impulses(response) if rocks.any() else np.full((2, 2, 2), math.nan)
    each = {}
    for side, name in enumerate(("left", "right")):
        for k, place in enumerate(("base", "top")):
            shear, vertical = (
                getattr(forces, f"{place}_{part}")[side, rocks] / share
                for part in ("shear", "vertical")
            )
            each[f"{name}_{place}_horizontal"] = _largest(np.abs(shear))
            each[f"{name}_{place}_vertical"] = _largest(vertical)
            each[f"{name}_{place}_vertical_least"] = -_largest(-vertical)
            for part, impulse in zip(("horizontal", "vertical"), impulses[k, :, side], strict=True):
                each[f"{name}_{place}_impulse_{part}"] = float(impulse)
    return BentForces(**each)


def force_bands(
    bent: UnequalBent, motion: Motion, ensemble: Ensemble, versions: Versions | None = None
) -> BentForces[Band]:
    """Return the 16, 50 and 84 % quantiles of the largest forces over the members of an ensemble.

    They are those of the members that uplift, and NaN if none does: forces of closed joints depend
    on their stiffness. A member that overturns counts as beyond all others.

    Parameters
    ----------
    bent : UnequalBent
        The nominal bent.
    motion, ensemble, versions
        As for `bent_ensemble`; the ensemble has members.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> bands = force_bands(bent, pulse, Ensemble(members=16))
    >>> [round(force, 3) for force in bands.left_base_horizontal]
    [0.201, 0.202, 0.204]
    """
    grounds, of_member = shaken([motion], ensemble, [versions])
    each, fallen = [], []
    shaking = zip(of_member[0].tolist(), draws(ensemble)[:, 3].tolist(), strict=True)
    for member, (version, scale) in zip(bent_members(ensemble, bent), shaking, strict=True):
        ground = grounds[version].scaled(scale)
        response = respond_bent(member, ground)
        if response.verdict is not Verdict.NO_UPLIFT:
            each.append(astuple(largest_forces(response, bent_forces(response, ground))))
            fallen.append(response.verdict is Verdict.OVERTURNS)
    bands = {}
    for k, field in enumerate(fields(BentForces)):
        worse = -1.0 if field.name.endswith("_least") else 1.0
        values = np.array([math.inf if falls else worse * forces[k]
                           for forces, falls in zip(each, fallen, strict=True)])  # fmt: skip
        bounds = worse * quantiles(values) if each else np.full(3, math.nan)
        bands[field.name] = tuple(sorted(bounds.tolist()))
    return BentForces(**bands)


def _largest_impulses(response: BentResponse) -> Float:
    """Return the largest impulses, shape (2: base and top, 2: horizontal and vertical, columns)."""
    velocities = response.impact_velocities
    largest = [np.abs(velocities[side]).max(initial=0.0)
               for side in (velocities > 0.0, velocities < 0.0)]  # fmt: skip
    impulses = impulses_of(response.bent) * np.array(largest)[:, None, None, None]
    return np.asarray(impulses.max(axis=0))


@lru_cache(maxsize=1024)
def impulses_of(bent: UnequalBent) -> Float:
    """Return the impulses of impacts per unit rate of theta just before them.

    Parameters
    ----------
    bent : UnequalBent
        The bent.

    Returns
    -------
    array, shape (2, 2, 2, 2)
        Impulses over half the weight of columns and beam, times the rate [s per rad s-1], of
        impacts to the right and to the left; at base and top; horizontal, without a sign, and
        vertical, positive where it presses the joint; on the left and on the right column.

    Notes
    -----
    Re-derived: the changes of momentum of both columns and the beam, nine equations. With the
    restitution of the linkage the eight impulses at corners fulfil them. Where `restitution_factor`
    states another one, a moment that is the same on both columns is the ninth unknown.

    Examples
    --------
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> to_right, _ = impulses_of(bent)
    >>> to_right[0, 1].round(3)
    array([0.239, 0.323])
    """
    linkage, factor = linkage_of(bent), bent.restitution_factor
    change = linkage.changes(factor)
    (columns, beam), (own, turning) = linkage.masses, linkage.inertias
    pose = linkage.pose(np.zeros((2, 1, 2, 1)))
    x, y = change.columns
    moments = 0.5 * columns * (pose.x * y - pose.y * x) - own * change.rotations
    known = [*moments, -beam * change.beam[1], turning * change.turn, -beam * change.beam[0]]
    nothing, each = np.zeros_like(pose.x[0]), np.ones_like(pose.x[0])
    rows = [[*row, each if k < 2 else nothing] for k, row in enumerate(_equations(linkage, pose))]
    rows.append([each, nothing, each, nothing, nothing])
    solved = _solved(rows, known)
    top_x, top_y = solved[:4:2], solved[1:4:2]
    base_x, base_y = columns * x - top_x, columns * y - top_y
    impulses = np.array([[np.abs(base_x), base_y], [np.abs(top_x), -top_y]])
    unit = 2.0 / ((1.0 + bent.mass_ratio) * GRAVITY)
    return np.moveaxis(unit * impulses[..., 0, :, 0], -1, 0)


def demand_of(response: BentResponse, motion: Motion, forces: ColumnForces) -> BentDemand:
    """Return the largest base shear and the friction that the joints need.

    Parameters
    ----------
    response, motion
        As for `bent_forces`, from which the `forces` are.
    """
    if response.verdict is Verdict.OVERTURNS:
        return BentDemand(np.nan, np.nan, np.nan)
    across, upwards = ground_at_nodes(response.time, motion)
    at_rest = np.abs(across) / (GRAVITY + upwards)
    demands = {}
    for place in ("base", "top"):
        shear, vertical = (getattr(forces, f"{place}_{part}") for part in ("shear", "vertical"))
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.where(vertical > 0.0, np.abs(shear) / vertical, np.inf).max(axis=0)
        needed = np.where(np.isnan(shear[0]), at_rest, needed)
        demands[f"{place}_friction_demand"] = float(needed.max())
    shear = _base_shear(response, forces, across)
    return BentDemand(peak_base_shear=float(np.abs(shear).max()), **demands)


def base_shear(response: BentResponse, motion: Motion) -> Float:
    """Return the force of the ground over the weight of columns and beam at the nodes [1].

    At rest the ground carries all along. Parameters and errors are those of `bent_forces`; after
    overturning it is NaN.
    """
    across, _ = ground_at_nodes(response.time, motion)
    return _base_shear(response, bent_forces(response, motion), across)


def _base_shear(response: BentResponse, forces: ColumnForces, across: Float) -> Float:
    shear = 0.5 * forces.base_shear.sum(axis=0) / (1.0 + response.bent.mass_ratio)
    shear = np.where(np.isnan(shear), across / GRAVITY, shear)
    return np.where(np.isnan(response.theta), np.nan, shear)


def _largest(values: Float) -> float:
    """Return the largest of values; NaN of none."""
    return float(values.max()) if values.size else np.nan


def _on_the_left(response: BentResponse, across: Float, upwards: Float) -> NDArray[np.bool_]:
    """Return True at the nodes at which a bent rocks to the left, or begins to."""
    _, limit = response.bent.uplift_accelerations
    begins = across > limit * (GRAVITY + upwards)
    moving = np.where(response.omega == 0.0, np.where(begins, -1.0, 1.0), response.omega)
    return np.asarray(np.where(response.theta == 0.0, moving, response.theta) < 0.0)


@dataclass(frozen=True, eq=False)
class _Moves:
    """Positions and accelerations at the nodes, in the coordinates of both sides.

    Accelerations are relative to the ground, `across` and `upwards` those of the ground [m s-2].
    """

    linkage: Linkage
    pose: Pose
    across: Float
    upwards: Float
    rocks: NDArray[np.bool_]
    spins: Float
    corners: tuple[Float, Float]
    turn: Float
    beam: tuple[Float, Float]

    @classmethod
    def of(
        cls, response: BentResponse, across: Float, upwards: Float, left: NDArray[np.bool_]
    ) -> _Moves:
        """Return the accelerations at the nodes of a response."""
        bent = response.bent
        linkage = linkage_of(bent)
        theta = np.abs(np.stack([response.theta, response.theta_2]))[:, None, None]
        theta = np.broadcast_to(np.nan_to_num(theta), (2, 1, 2, left.size))
        sign = np.where(left, -1.0, 1.0)
        rates = np.nan_to_num(sign * np.stack([response.omega, response.omega_2]))[:, None, None]
        turn_rate = np.nan_to_num(sign * response.psi_rate)
        pose = linkage.pose(theta)
        spins = _spins(bent, pose, (rates, turn_rate), (across, upwards))
        corners = _corner_accelerations(pose, rates, spins)
        relative = corners[0][1] - corners[0][0], corners[1][1] - corners[1][0]
        turn = (relative[0] * pose.up - relative[1] * pose.across) / linkage.span**2
        lever = linkage.lever(pose)
        beam = (
            corners[0][0] + turn * lever[1] - turn_rate**2 * lever[0],
            corners[1][0] - turn * lever[0] - turn_rate**2 * lever[1],
        )
        right, other = bent.uplift_accelerations
        limit = np.where(left, other, right)
        moves = (response.theta != 0.0) | (response.omega != 0.0)
        rocks = moves | (-across > limit * (GRAVITY + upwards))
        rocks &= np.isfinite(response.theta)
        return cls(linkage, pose, across, upwards, rocks, spins, corners, turn, beam)

    @property
    def masses(self) -> tuple[Float, Float]:
        """Masses of columns and beam over that of both columns [1]."""
        return self.linkage.masses

    @property
    def column_accelerations(self) -> tuple[Float, Float]:
        """Accelerations of the columns' centres relative to the ground [m s-2]."""
        return 0.5 * self.corners[0], 0.5 * self.corners[1]

    def top_forces(self) -> tuple[Float, Float]:
        """Return the forces of the beam on both columns, over the mass of both columns [m s-2]."""
        (columns, mass), (own, turning) = self.linkage.masses, self.linkage.inertias
        pose, gravity = self.pose, GRAVITY + self.upwards
        x, y = self.column_accelerations
        # moments about the base corners: counterclockwise, while rotations are clockwise
        moments = 0.5 * columns * (pose.x * (y + gravity) - pose.y * (x + self.across))
        moments = moments - own * self.spins
        vertical = -mass * (self.beam[1] + gravity)
        forces = _solved(_equations(self.linkage, pose), [*moments, vertical, turning * self.turn])
        return forces[::2], forces[1::2]


def _equations(linkage: Linkage, pose: Pose) -> list[list[Float]]:
    """Return the factors of the forces of the beam in its equations and those of the columns.

    The forces are x and y on the first column, x and y on the second; the equations the moments of
    each column about its base corner, the vertical force and the moment of the beam.
    """
    first_x, first_y = (-line for line in linkage.lever(pose))
    second_x, second_y = first_x + pose.across, first_y + pose.up
    nothing = np.zeros_like(pose.x[0])
    return [
        [-pose.y[0], pose.x[0], nothing, nothing],
        [nothing, nothing, -pose.y[1], pose.x[1]],
        [nothing, nothing + 1.0, nothing, nothing + 1.0],
        [-first_y, first_x, -second_y, second_x],
    ]


def _solved(rows: list[list[Float]], known: list[Float]) -> Float:
    """Return the solution of linear equations at all points, the unknowns in the first axis."""
    matrix = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    right = np.stack(np.broadcast_arrays(*known), axis=-1)
    return np.moveaxis(np.linalg.solve(matrix, right[..., None])[..., 0], -1, 0)


def _corner_accelerations(pose: Pose, rates: Float, spins: Float) -> tuple[Float, Float]:
    """Return the accelerations of the loaded corners relative to the ground [m s-2]."""
    return spins * pose.y - rates**2 * pose.x, -spins * pose.x - rates**2 * pose.y


def _spins(
    bent: UnequalBent,
    pose: Pose,
    rates: tuple[Float, Float],
    ground: tuple[Float, Float],
) -> Float:
    """Return the angular accelerations of both columns [rad s-2].

    The beam keeps its length, which gives them up to a multiple of the tangent. The principle of
    virtual power along the tangent gives that multiple.
    """
    linkage, (columns, turn_rate) = linkage_of(bent), rates
    tangent = linkage.tangent(pose, tables(bent).courses.inertia[..., None])
    gain = np.stack([-(pose.across * pose.y[0] - pose.up * pose.x[0])] * 2)
    gain[1] = pose.across * pose.y[1] - pose.up * pose.x[1]
    x, y = _corner_accelerations(pose, columns, np.zeros_like(gain))
    stretched = (x[1] - x[0]) * pose.across + (y[1] - y[0]) * pose.up
    needed = -(turn_rate**2) * linkage.span**2 - stretched
    some = needed * gain / (gain**2).sum(axis=0)
    x, y = _corner_accelerations(pose, columns, some)
    turn = ((x[1] - x[0]) * pose.up - (y[1] - y[0]) * pose.across) / linkage.span**2
    lever = linkage.lever(pose)
    beam = np.stack(
        [
            x[0] + turn * lever[1] - turn_rate**2 * lever[0],
            y[0] - turn * lever[0] - turn_rate**2 * lever[1],
        ]
    )
    moved = Velocities(0.5 * np.stack([x, y]), beam, some, turn)
    push, pull = linkage.pulls(tangent)
    across, upwards = ground
    power = -(GRAVITY + upwards) * pull - across * push - linkage.product(moved, tangent)
    share = power / linkage.product(tangent, tangent)
    return np.asarray(some + share * tangent.rotations)
