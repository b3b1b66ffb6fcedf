"""Kinematics of two columns of unequal size under one rigid beam: a four-bar linkage.

Rocking to the right, column i turns clockwise by theta_i about its right base corner P_i, and
carries the beam on its left top corner, at P_i + Rot(theta_i) r_i with r_i = (-2 b_i, 2 h_i). The
beam is rigid, so both corners keep their distance. Rocking to the left is the same motion of the
mirrored bent. All masses are over that of both columns.

With the inertia A = sum of m (dc/dq)^2 + I (dtheta/dq)^2 over columns and beam, the slope of the
potential Q = sum of m dy/dq and the pull X = sum of m dx/dq, and q = theta_1, the motion is
(re-derived from the Lagrangian)

A q'' = -A' q'^2 / 2 - (g + a_v) Q - a X.

In the course s, with ds/dq = sqrt(A(q) / A(0)), and q the rotation of the column that turns faster
at rest, no rate remains on the right side:

s'' = -(1 + a_v/g) G(s) - (a/g) H(s), G = g Q dq/ds / A(0), H = g X dq/ds / A(0).

For equal columns s = q, G = p_hat^2 sin(alpha - s) and H = p_hat^2 cos(alpha - s): eq (26) of
Makris and Vassiliou (2013). The course also passes dead centres of the linkage, where a column
turns back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InternalError
from rockframe.unequal.kernels import steps
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Signs of the sides: rocking to the right (theta > 0), and to the left.
_SIDES: Final = np.array([[1.0], [-1.0]])
#: Points in each interval of the course that is solved at once.
_POINTS: Final = 20
#: Lengths of these intervals [rad]: shorter ones if the iteration does not converge.
_LENGTHS: Final = (0.4, 0.1, 0.025, 0.00625)
#: Longest course [rad], most rounds of the iteration in an interval, and the change at which it
#: ends [rad].
_LONGEST: Final = 40.0
_MOST_ROUNDS: Final = 60
_SETTLED: Final = 1e-15
#: Number of steps to locate the end of a course, and of halvings to locate an equilibrium.
_FALSE_POSITIONS: Final = 28
_HALVINGS: Final = 52
_QUARTER_TURN: Final = 0.5 * np.pi


@dataclass(frozen=True, eq=False)
class Sizes:
    """Dimensions of several bents of two columns; the second column stands right of the first.

    Parameters
    ----------
    heights, widths : array, shape (bents, 2)
        Heights 2h and widths 2b of the columns [m]. Their tops are level.
    spacing : array, shape (bents,)
        Distance between the axes of the columns [m].
    shares : array, shape (bents, 2)
        Masses of the columns over that of both [1].
    mass_ratio : array, shape (bents,)
        Mass of the beam over that of both columns [1].
    beam_depth, beam_offset : array, shape (bents,)
        Depth of the beam, and distance of its centre of mass from the middle between the axes,
        towards the second column [m].
    """

    heights: Float
    widths: Float
    spacing: Float
    shares: Float
    mass_ratio: Float
    beam_depth: Float
    beam_offset: Float

    @property
    def inertia(self) -> tuple[Float, Float]:
        """Moments of inertia of columns and beam about their centres [m2].

        The beam is a rectangle as long as the spacing and half of both widths.
        """
        columns = self.shares * (self.widths**2 + self.heights**2) / 12.0
        length = self.spacing + self.widths.mean(axis=1)
        return columns, self.mass_ratio * (length**2 + self.beam_depth**2) / 12.0


@dataclass(frozen=True, eq=False)
class Velocities:
    """Velocities of the bodies of bents per unit rate of a coordinate; vectors in a first axis.

    Parameters
    ----------
    columns : array, shape (2, 2, ...)
        Components x and y of the velocities of the centres of both columns [m].
    beam : array, shape (2, ...)
        The same of the beam [m].
    rotations : array, shape (2, ...)
        Rates of the columns' rotations [1].
    turn : array, shape (...)
        Rate of the beam's rotation [1].
    """

    columns: Float
    beam: Float
    rotations: Float
    turn: Float


@dataclass(frozen=True, eq=False)
class Pose:
    """Lines of a linkage at given rotations [m]; the first axis of x and y is the column.

    Parameters
    ----------
    x, y : array, shape (2, ...)
        Components of the lines from the base corners to the loaded top corners.
    across, up : array, shape (...)
        Components of the line between the loaded top corners, from the first column to the second.
    """

    x: Float
    y: Float
    across: Float
    up: Float


class Linkage:
    """Positions and velocities of several bents on both sides.

    Arrays have the axes columns (2), bents, sides (2), points, in this order. Coordinates of the
    left side are mirrored, so that all rotations are positive outwards.

    Parameters
    ----------
    sizes : Sizes
        Dimensions of the bents.
    """

    def __init__(self, sizes: Sizes) -> None:
        self.sizes = sizes
        self.width = sizes.widths.T[:, :, None, None]
        self.height = sizes.heights.T[:, :, None, None]
        columns, beam = sizes.inertia
        self.masses = sizes.shares.T[:, :, None, None], sizes.mass_ratio[:, None, None]
        self.inertias = columns.T[:, :, None, None], beam[:, None, None]
        wider = 0.5 * (sizes.widths[:, 1] - sizes.widths[:, 0])[:, None, None]
        spacing = sizes.spacing[:, None, None]
        #: Distance of the base corners across, and of the loaded top corners.
        self.feet = _SIDES * spacing + wider
        self.span = spacing - _SIDES * wider
        reach = (0.5 * sizes.spacing + sizes.beam_offset)[:, None, None]
        #: Line from the loaded corner of the first column to the beam's centre of mass, at rest.
        self.centre = _SIDES * reach + 0.5 * self.width[0], 0.5 * sizes.beam_depth[:, None, None]

    def pose(self, theta: Float) -> Pose:
        """Return the lines of the linkage at rotations of both columns."""
        sine, cosine = np.sin(theta), np.cos(theta)
        x = self.height * sine - self.width * cosine
        y = self.height * cosine + self.width * sine
        up = y[1] - y[0] - self.height[1] + self.height[0]
        return Pose(x, y, self.feet + x[1] - x[0], up)

    def beam_rotation(self, pose: Pose) -> Float:
        """Return the clockwise rotation of the beam, mirrored on the left side [rad]."""
        return np.asarray(np.arctan2(-_SIDES * pose.up, _SIDES * pose.across))

    def lever(self, pose: Pose) -> tuple[Float, Float]:
        """Return the line from the loaded corner of the first column to the beam's centre [m]."""
        x, y = self.centre
        cosine, sine = _SIDES * pose.across / self.span, -_SIDES * pose.up / self.span
        return x * cosine + y * sine, y * cosine - x * sine

    def beam_displacement(self, pose: Pose) -> tuple[Float, Float]:
        """Return the displacements of the beam's centre of mass, outwards and up [m]."""
        across, up = self.lever(pose)
        u = pose.x[0] + self.width[0] + across - self.centre[0]
        return u, pose.y[0] - self.height[0] + up - self.centre[1]

    def gains(self, pose: Pose) -> Float:
        """Return the rates of both rotations, up to a common factor [m2].

        A rate is zero at a dead centre, where a column turns back.
        """
        first, second = _SIDES * (pose.across * pose.y - pose.up * pose.x)
        return np.stack([second, first])

    def velocities(self, pose: Pose, rates: Float) -> Velocities:
        """Return the velocities of all bodies for rates of the rotations that fit each other."""
        corner_x, corner_y = rates * pose.y, -rates * pose.x
        turn = (corner_x[1] - corner_x[0]) * pose.up - (corner_y[1] - corner_y[0]) * pose.across
        turn = turn / self.span**2
        across, up = self.lever(pose)
        beam = np.stack([corner_x[0] + turn * up, corner_y[0] - turn * across])
        return Velocities(0.5 * np.stack([corner_x, corner_y]), beam, rates, turn)

    def product(self, first: Velocities, second: Velocities) -> Float:
        """Return the kinetic inner product of two fields of velocities [m2]."""
        (columns, beam), (own, turning) = self.masses, self.inertias
        moving = columns * (first.columns * second.columns).sum(axis=0)
        moving = moving + own * first.rotations * second.rotations
        carried = beam * (first.beam * second.beam).sum(axis=0)
        return np.asarray(moving.sum(axis=0) + carried + turning * first.turn * second.turn)

    def pulls(self, field: Velocities) -> tuple[Float, Float]:
        """Return X and Q, the mass-weighted sums of a field's velocities across and up [m]."""
        columns, beam = self.masses
        across, up = (columns * field.columns).sum(axis=1) + beam * field.beam
        return across, up

    @property
    def closed(self) -> Velocities:
        """Velocities with closed joints per unit rate of theta_1."""
        pose = self.pose(np.zeros((2, self.sizes.spacing.size, 2, 1)))
        rates = self.gains(pose)
        return self.velocities(pose, rates / rates[0])

    def tangent(self, pose: Pose, inertia: Float) -> Velocities:
        """Return the velocities per unit rate of the course, with A(0) as the inertia."""
        field = self.velocities(pose, self.gains(pose))
        size = np.sqrt(inertia / self.product(field, field))
        return Velocities(
            size * field.columns, size * field.beam, size * field.rotations, size * field.turn
        )

    def kept_speeds(self) -> Float:
        """Return theta_1' after an impact over that before it, by side before, shape (bents, 2).

        The contacts of the new side do no work under its virtual velocities, so the kinetic inner
        product of the new field with the change of all velocities is zero. For equal columns this
        is eq (43) of Makris and Vassiliou (2013).
        """
        return np.asarray(self._impact()[2][:, ::-1, 0])

    def changes(self, factor: float) -> Velocities:
        """Return the changes of all velocities in an impact per unit rate of theta_1 before it.

        They are in the coordinates of the side after the impact. `factor` multiplies the ratio of
        the speeds of `kept_speeds` [1].
        """
        old, new, ratio = self._impact()
        kept = factor * ratio
        return Velocities(
            kept * new.columns - old.columns,
            kept * new.beam - old.beam,
            kept * new.rotations - old.rotations,
            kept * new.turn - old.turn,
        )

    def _impact(self) -> tuple[Velocities, Velocities, Float]:
        """Return the fields before and after impacts and the ratio of theta_1', by side after."""
        new = self.closed
        mirrored = np.array([-1.0, 1.0])[:, None, None, None]  # the other side's coordinates
        columns = -mirrored[..., None] * new.columns[:, :, :, ::-1]
        # towards the joints: the mirrored rotation is opposite, and so is its rate
        beam = -mirrored * new.beam[:, :, ::-1]
        old = Velocities(columns, beam, new.rotations[:, :, ::-1], new.turn[:, ::-1])
        ratio = self.product(old, new) / self.product(new, new)
        return old, new, np.asarray(ratio)


@dataclass(frozen=True, eq=False)
class Courses:
    """The rotations of several bents along their courses, on both sides.

    Parameters
    ----------
    linkage : Linkage
        The bents.
    inertia : array, shape (bents, 2)
        A(0) of each side for the faster rotation at rest as q, of which the course is [m2].
    ends : array, shape (bents, 2)
        Course at which a column lies flat (rotation pi/2), or the linkage reaches a dead centre
        [rad].
    locked : array of bool, shape (bents, 2)
        True if the end is a dead centre.
    series : array, shape (2, bents, 2, intervals, points)
        Chebyshev coefficients of the rotations in each interval of the course.
    length : float
        Length of an interval [rad].
    """

    linkage: Linkage
    inertia: Float
    ends: Float
    locked: NDArray[np.bool_]
    series: Float
    length: float

    def rotations(self, course: Float) -> Float:
        """Return the rotations of both columns [rad], shape (2, bents, 2, points).

        `course` has the shape (bents, 2, points).
        """
        return _rotations(self.series, self.length, course)


@lru_cache(maxsize=1)
def _matrices() -> tuple[Float, Float]:
    """Return the matrices of the integrals over an interval of length one, and of coefficients."""
    points = -np.cos(np.pi * np.arange(_POINTS) / (_POINTS - 1))
    values = np.polynomial.chebyshev.chebvander(points, _POINTS - 1)
    coefficients = np.linalg.inv(values)
    integrals = np.stack(
        [
            np.polynomial.chebyshev.chebval(
                points, np.polynomial.chebyshev.chebint(row, lbnd=-1.0, scl=0.5)
            )
            for row in np.eye(_POINTS)
        ],
        axis=1,
    )
    return np.asarray(integrals @ coefficients), np.asarray(coefficients, dtype=np.float64)


def _rotations(series: Float, length: float, course: Float) -> Float:
    """Return the values of Chebyshev series of the intervals that a course lies in."""
    interval = np.clip((course / length).astype(int), 0, series.shape[3] - 1)
    within = 2.0 * (course / length - interval) - 1.0
    angles = np.arccos(np.clip(within, -1.0, 1.0))
    values = np.cos(angles[..., None] * np.arange(_POINTS))
    bents, sides = np.ogrid[: course.shape[0], : course.shape[1]]
    chosen = series[:, bents[..., None], sides[..., None], interval]
    # exactly zero at rest, where the sum has round-off
    return np.where(course == 0.0, 0.0, (chosen * values).sum(axis=-1))


def courses_of(sizes: Sizes) -> Courses:
    """Return the courses of bents, each up to where it ends.

    Raises
    ------
    InternalError
        If the iteration for a course does not converge.
    """
    linkage = Linkage(sizes)
    closed = linkage.closed
    # in units of the column that turns faster, so that the iteration converges
    faster = closed.rotations.max(axis=0)
    inertia = linkage.product(closed, closed) / faster**2
    for length in _LENGTHS:
        series = _series(linkage, inertia, length)
        if series is not None:
            break
    else:
        raise InternalError(
            "internal error: the course of a bent has no solution. Please report it, with the bent."
        )
    ends = _first_end(linkage, series, length)
    theta = _rotations(series, length, ends[..., None])
    locked = (_QUARTER_TURN - theta.max(axis=0) > 1e-9)[..., 0]
    return Courses(linkage, inertia[..., 0], ends, locked, series, length)


def _series(linkage: Linkage, inertia: Float, length: float) -> Float | None:
    """Return the series of the courses in intervals of a length; None if they do not converge."""
    integral, coefficients = _matrices()
    start = np.zeros((2, linkage.sizes.spacing.size, 2, 1))
    solved: list[Float] = []
    ended = np.zeros(start.shape[1:3], dtype=bool)
    while not ended.all() and len(solved) * length < _LONGEST:
        theta = _interval(linkage, inertia, start, length * integral, ended)
        if theta is None:
            return None
        solved.append(theta @ coefficients.T)
        start = theta[..., -1:]
        ended |= (_open(linkage, theta) <= 0.0).any(axis=-1)
    return np.stack(solved, axis=3) if ended.all() else None


def _interval(
    linkage: Linkage,
    inertia: Float,
    start: Float,
    integral: Float,
    ended: NDArray[np.bool_],
) -> Float | None:
    """Return the rotations at the points of the next interval, by Picard's iteration.

    Courses that have ended stay where they are. None if the iteration does not converge.
    """
    goes = np.where(ended, 0.0, 1.0)[..., None]
    theta = np.broadcast_to(start, (*start.shape[:3], _POINTS))
    for _ in range(_MOST_ROUNDS):
        rates = linkage.tangent(linkage.pose(theta), inertia).rotations
        new = start + (goes * rates) @ integral.T
        if not np.abs(new).max() < _LONGEST:
            return None
        if np.abs(new - theta).max() <= _SETTLED * max(1.0, float(np.abs(new).max())):
            return np.asarray(new)
        theta = new
    return None


def _open(linkage: Linkage, theta: Float) -> Float:
    """Return a number that is positive up to the end of the course."""
    gains = linkage.gains(linkage.pose(theta)).min(axis=0) / linkage.span**2
    return np.asarray(np.minimum(_QUARTER_TURN - theta.max(axis=0), gains))


def _first_end(linkage: Linkage, series: Float, length: float) -> Float:
    """Return where the courses end, by false position from the first point beyond the end."""
    count = series.shape[3]
    grid = np.linspace(0.0, length * count, 20 * count + 1)
    course = np.broadcast_to(grid, (*series.shape[1:3], grid.size))
    free = _open(linkage, _rotations(series, length, course))
    first = (free <= 0.0).argmax(axis=-1)[..., None]
    low, high = grid[first - 1], grid[first]
    at_low, at_high = (np.take_along_axis(free, k, axis=-1) for k in (first - 1, first))
    moved = np.full(low.shape, -1)  # 1 if the last step moved the end beyond, 0 the other, -1 none
    for _ in range(_FALSE_POSITIONS):
        rise = at_low - at_high
        middle = low + (high - low) * at_low / np.where(rise > 0.0, rise, 1.0)
        value = _open(linkage, _rotations(series, length, middle))
        over = value <= 0.0
        # an end that stays twice in a row counts half, so that it moves (the Illinois method)
        weight = np.where(moved == over, 0.5, 1.0)
        at_low, at_high = (
            np.where(over, weight * at_low, value),
            np.where(over, value, weight * at_high),
        )
        moved = over.astype(int)
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    return np.asarray(middle[..., 0])


def moments_along(courses: Courses, course: Float) -> tuple[Float, Float]:
    """Return G and H at points of the course, shape (bents, 2, points) [s-2]."""
    theta = courses.rotations(course)
    field = courses.linkage.tangent(courses.linkage.pose(theta), courses.inertia[..., None])
    across, up = courses.linkage.pulls(field)
    factor = GRAVITY / courses.inertia[..., None]
    return np.asarray(factor * up), np.asarray(factor * across)


@dataclass(frozen=True, eq=False)
class Tables:
    """Numbers of several bents for the kernel.

    Parameters
    ----------
    courses : Courses
        The courses of the bents. Those of the kernel end at pi/2: they are `stretch` times these.
    stretch : array, shape (bents, 2)
        Factor of the courses [1].
    numbers : array, shape (bents, TABLE_SIZE)
        The named slots of `steps`.
    frequency : array, shape (bents,)
        Largest rate at which the motion changes, p_hat of equal columns [s-1].
    crossings : array of int, shape (bents, 2)
        Number of equilibria of each side: one if the bent can overturn and does not lock.
    """

    courses: Courses
    stretch: Float
    numbers: Float
    frequency: Float
    crossings: NDArray[np.int64]


def tables_of(sizes: Sizes, kept: Float) -> Tables:
    """Return the tables of bents with these velocity ratios of impacts, shape (bents, 2)."""
    courses = courses_of(sizes)
    bents = sizes.spacing.size
    stretch = _QUARTER_TURN / courses.ends
    count = steps.DEGREE + 1
    points = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
    half = 0.5 * steps.PIECE_WIDTH
    middles = (np.arange(steps.PIECES) + 0.5) * steps.PIECE_WIDTH
    course = (middles[:, None] + half * points).ravel() / stretch[..., None]
    curves = np.stack(moments_along(courses, course), axis=2) * stretch[:, :, None, None]
    curves = curves.reshape(bents, 2, 2, steps.PIECES, count)
    fitted = curves @ _monomials(points).T / half ** np.arange(count)
    pieces = np.zeros((bents, 2, steps.PIECES, steps.PIECE_SIZE))
    pieces[..., : steps.ENERGY] = np.moveaxis(fitted, 2, 3).reshape(
        bents, 2, steps.PIECES, steps.ENERGY
    )
    powers = np.arange(1, count + 1)
    pull = fitted[:, :, 0] / powers
    rise = [(pull * edge**powers).sum(axis=-1) for edge in (-half, half)]
    gained = rise[1] - rise[0]
    pieces[..., steps.ENERGY] = np.cumsum(gained, axis=-1) - gained - rise[0]
    numbers = np.zeros((bents, 2, steps.SIDE_SIZE))
    at_rest = fitted[:, :, :, 0] @ (-half) ** np.arange(count)
    numbers[..., steps.LIMIT] = at_rest[..., 0] / at_rest[..., 1]
    numbers[..., steps.BOUNCE] = kept * stretch[:, ::-1] / stretch
    numbers[..., steps.PIECES_FROM :] = pieces.reshape(bents, 2, -1)
    barrier, crossings = _barriers(pieces)
    numbers[..., steps.BARRIER] = barrier
    within = np.minimum((barrier / steps.PIECE_WIDTH).astype(int), steps.PIECES - 1)
    chosen = np.take_along_axis(pieces, within[..., None, None], axis=2)[:, :, 0]
    x = (barrier - (within + 0.5) * steps.PIECE_WIDTH)[..., None]
    risen = (chosen[..., steps.PULL : steps.PUSH] / powers * x**powers).sum(axis=-1)
    numbers[..., steps.CREST] = chosen[..., steps.ENERGY] + risen
    strongest = np.hypot(curves[:, :, 0], curves[:, :, 1]).max(axis=(1, 2, 3))
    return Tables(
        courses,
        stretch,
        numbers.reshape(bents, steps.TABLE_SIZE),
        np.sqrt(strongest),
        crossings,
    )


def _barriers(pieces: Float) -> tuple[Float, NDArray[np.int64]]:
    """Return the courses of the first equilibria, or the end, and the numbers of equilibria."""
    half, powers = 0.5 * steps.PIECE_WIDTH, np.arange(steps.DEGREE + 1)
    curves = pieces[..., steps.PULL : steps.PUSH]
    grid = np.linspace(-half, half, 9)
    held = curves @ (grid[:, None] ** powers).T > 0.0
    changes = (held[..., :-1] != held[..., 1:]).reshape(*held.shape[:2], -1)
    piece, step = np.divmod(changes.argmax(axis=-1), grid.size - 1)
    curve = np.take_along_axis(curves, piece[..., None, None], axis=2)[:, :, 0]
    low, high = grid[step], grid[step + 1]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        above = (curve * middle[..., None] ** powers).sum(axis=-1) > 0.0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    barrier = (piece + 0.5) * steps.PIECE_WIDTH + 0.5 * (low + high)
    count = changes.sum(axis=-1)
    return np.where(count > 0, barrier, _QUARTER_TURN), np.asarray(count)


def _monomials(points: Float) -> Float:
    """Return the matrix from values at points to coefficients in powers, in extended precision."""
    wide = points.astype(np.longdouble)
    rows = []
    for k in range(points.size):
        others = np.delete(wide, k)
        row = np.ones(1, dtype=np.longdouble)
        for other in others:
            row = np.append(0.0, row) - other * np.append(row, 0.0)
        rows.append(row / np.prod(wide[k] - others))
    return np.asarray(np.stack(rows, axis=1), dtype=np.longdouble)
