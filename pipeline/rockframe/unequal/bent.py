"""A bent of two columns of unequal size: its quantities, and the rules that they obey."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real
from typing import ClassVar, Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError, invalid
from rockframe.frame import RockingFrame
from rockframe.unequal.kernels import steps
from rockframe.unequal.linkage import Linkage, Sizes, Tables, tables_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Smallest and largest dimension of a column, and of spacing and depth [m].
_SMALLEST: Final = 0.001
_LARGEST: Final = 1000.0
#: Quantities that are single numbers.
_NUMBERS: Final = ("spacing", "mass_ratio", "beam_depth", "beam_offset", "restitution_factor")
#: Largest mass ratio.
_HEAVIEST: Final = 1e6
#: Points of a course from which the iteration for given rotations starts, and its rounds.
_GUESSES: Final = 200
_ROUNDS: Final = 8


@dataclass(frozen=True, kw_only=True)
class UnequalBent:
    """Two free-standing rectangular columns of unequal size under one rigid beam.

    The tops of the columns are level, so columns of unequal height stand on unequal levels. The
    bent rocks in its plane, and does not slide. It has no tendons, dissipaters or abutments.

    Parameters
    ----------
    heights, widths : sequence of float, length 2
        Heights 2h and widths 2b of the left and the right column [m].
    spacing : float
        Distance between the axes of the columns [m].
    mass_ratio : float
        Mass of the beam over that of both columns [1].
    beam_depth : float
        Depth of the beam [m]; its centre of mass is at half the depth, above the columns.
    beam_offset : float
        Distance of the beam's centre of mass from the middle between the axes, to the right [m].
    column_masses : sequence of float, length 2, optional
        Masses of the columns [kg]; by default both have the same density and depth.
    restitution_factor : float
        Factor of the velocity ratio of both impacts [1].
    name : str
        Name in tables.

    Raises
    ------
    ParameterError
        If there are not two columns, a dimension is not between 1 mm and 1 km, the columns touch,
        a mass or the mass ratio is not positive, a column does not stand, the bent locks before it
        overturns, or an impact keeps no speed or all of it.

    Notes
    -----
    The two columns and the beam are a four-bar linkage with one degree of freedom (re-derived,
    `rockframe.unequal.linkage`). Three unequal columns under one rigid beam have none.

    Examples
    --------
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> [round(limit, 3) for limit in bent.uplift_accelerations]
    [0.18, 0.175]
    >>> [round(kept, 3) for kept in bent.restitutions]
    [0.94, 0.939]
    """

    kind: ClassVar[str] = "unequal"

    heights: Sequence[float]
    widths: Sequence[float]
    spacing: float
    mass_ratio: float = 0.0
    beam_depth: float = 0.0
    beam_offset: float = 0.0
    column_masses: Sequence[float] | None = None
    restitution_factor: float = 1.0
    name: str = "bent"

    def __post_init__(self) -> None:
        for quantity in ("heights", "widths", "column_masses"):
            values = getattr(self, quantity)
            if values is not None:
                object.__setattr__(self, quantity, self._two(quantity, values))
        self._require_lengths()
        if self.column_masses and not all(0.0 < mass < math.inf for mass in self.column_masses):
            raise self._invalid("column_masses", "positive")
        if not 0.0 <= self.mass_ratio <= _HEAVIEST:
            raise self._invalid("mass_ratio", f"between 0 and {_HEAVIEST:g}")
        self._require_rocking()

    def _require_lengths(self) -> None:
        for quantity in _NUMBERS:
            if not isinstance(getattr(self, quantity), Real):
                raise self._invalid(quantity, "a number")
        for quantity in ("heights", "widths"):
            if not all(_SMALLEST <= length <= _LARGEST for length in getattr(self, quantity)):
                raise self._invalid(quantity, f"between {_SMALLEST:g} and {_LARGEST:g} m")
        apart = 0.5 * sum(self.widths)
        if not apart < self.spacing <= _LARGEST:
            raise self._invalid(
                "spacing", f"above {apart:g} m, or the columns touch, and at most {_LARGEST:g} m"
            )
        if not 0.0 <= self.beam_depth <= _LARGEST:
            raise self._invalid("beam_depth", f"between 0 and {_LARGEST:g} m")
        if not abs(self.beam_offset) <= 0.5 * self.spacing:
            raise self._invalid("beam_offset", "within half the spacing: the beam would tip over")

    def resized(self, taller: float, wider: float) -> Self:
        """Return the bent with all heights and all widths multiplied by factors.

        The masses of the columns follow, if they are stated; mass ratio, spacing and beam do not
        change.

        Examples
        --------
        >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0)
        >>> bent.resized(2.0, 1.0).heights
        (18.0, 14.0)
        """
        masses = self.column_masses
        return replace(
            self,
            heights=tuple(taller * height for height in self.heights),
            widths=tuple(wider * width for width in self.widths),
            column_masses=masses and tuple(taller * wider * mass for mass in masses),
        )

    @property
    def has_equal_columns(self) -> bool:
        """True if both columns have the same height and width: then the bent is a frame.

        Its columns turn alike and its beam does not turn, whatever their masses and the place of
        the beam's centre.
        """
        return self.heights[0] == self.heights[1] and self.widths[0] == self.widths[1]

    @property
    def height_ratio(self) -> float:
        """Height of the lower column over that of the higher one [1]."""
        return min(self.heights) / max(self.heights)

    def with_height_ratio(self, ratio: float) -> Self:
        """Return the bent with the same mean height, and another ratio of the heights [1].

        The lower column stays the lower one; of equal columns it is the right one.

        Examples
        --------
        >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0)
        >>> bent.with_height_ratio(0.6).heights
        (10.0, 6.0)
        """
        higher = sum(self.heights) / (1.0 + ratio)
        pair = (higher, ratio * higher)
        left = self.heights[0] >= self.heights[1]
        return replace(self, heights=pair if left else pair[::-1])

    def _two(self, quantity: str, values: Sequence[float]) -> tuple[float, ...]:
        if not hasattr(values, "__len__"):
            raise invalid(quantity, values, f"bent {self.name!r}", "two numbers, left and right")
        if len(values) > 2:
            raise ParameterError(
                f"Invalid {quantity} of bent {self.name!r}, of {len(values)} columns. Must be two: "
                "three or more unequal columns under one rigid beam lock, and cannot rock."
            )
        if len(values) != 2 or not all(isinstance(value, Real) for value in values):
            raise invalid(quantity, values, f"bent {self.name!r}", "two numbers, left and right")
        return tuple(float(value) for value in values)

    def _invalid(self, quantity: str, allowed: str) -> ParameterError:
        return invalid(quantity, getattr(self, quantity), f"bent {self.name!r}", allowed)

    def _require_rocking(self) -> None:
        """Require that the bent stands, rocks on after impacts, and can overturn."""
        rigid = self._rigid_restitutions
        if not min(rigid) > 0.0:
            raise ParameterError(
                f"Invalid shape of bent {self.name!r} (heights {self.heights} m, widths "
                f"{self.widths} m). Must be more slender: an impact would keep {min(rigid):.3f} of "
                "the speed, and a bent that loses all speed at an impact does not rock."
            )
        kept = math.sqrt(rigid[0] * rigid[1])  # both impacts keep the same share of the energy
        if not 0.0 < self.restitution_factor * kept < 1.0:
            raise self._invalid(
                "restitution_factor",
                f"above 0 and below {1.0 / kept:.6g}: no impact keeps all energy, or more",
            )
        sides = zip(("right", "left"), self.uplift_accelerations, strict=True)
        for side, limit in sides:
            if not limit > 0.0:
                raise ParameterError(
                    f"Invalid shape of bent {self.name!r}. Must stand at rest: it would tip to the "
                    f"{side} under its own weight."
                )
        crossings = tables(self).crossings[0].tolist()
        for side, count in zip(("right", "left"), crossings, strict=True):
            if count == 0:
                raise ParameterError(
                    f"Invalid shape of bent {self.name!r} (heights {self.heights} m, spacing "
                    f"{self.spacing:g} m). Must overturn: rocking to the {side}, the columns and "
                    "the beam lock before they reach an unstable equilibrium."
                )

    @property
    def uplift_accelerations(self) -> tuple[float, float]:
        """Ground acceleration that uplifts the bent to the right, and to the left [g].

        To the right the ground accelerates to the left.
        """
        field = linkage_of(self).closed
        across, up = linkage_of(self).pulls(field)
        right, left = (up / across)[0, :, 0].tolist()
        return right, left

    @property
    def restitutions(self) -> tuple[float, float]:
        """Rate of theta_1 after an impact over that before it, from the right and from the left."""
        right, left = self._rigid_restitutions
        return self.restitution_factor * right, self.restitution_factor * left

    @property
    def _rigid_restitutions(self) -> tuple[float, float]:
        right, left = linkage_of(self).kept_speeds()[0].tolist()
        return right, left

    @property
    def balance_rotations(self) -> tuple[float, float]:
        """|theta_1| of the unstable equilibrium on the right, and on the left [rad].

        For equal columns it is their slenderness.
        """
        table = tables(self)
        courses = table.numbers.reshape(1, 2, -1)[:, :, steps.BARRIER] / table.stretch
        right, left = table.courses.rotations(courses[..., None])[0, 0, :, 0].tolist()
        return right, left

    @property
    def locks(self) -> tuple[bool, bool]:
        """True if the linkage reaches a dead centre before a column lies flat, on each side.

        The model ends there. The unstable equilibrium comes before.
        """
        right, left = tables(self).courses.locked[0].tolist()
        return right, left

    @property
    def weight(self) -> float:
        """Half the weight of columns and beam [N]; NaN if the masses are not stated."""
        if self.column_masses is None:
            return math.nan
        return 0.5 * (1.0 + self.mass_ratio) * sum(self.column_masses) * GRAVITY

    @property
    def equal_bent(self) -> RockingFrame:
        """Frame of two equal columns with the mean height and the mean width."""
        return RockingFrame(
            height=0.5 * sum(self.heights),
            width=0.5 * sum(self.widths),
            mass_ratio=self.mass_ratio,
            restitution_factor=self.restitution_factor,
            name=f"{self.name}, equal columns",
        )


@dataclass(frozen=True, eq=False)
class BentPositions:
    """Positions of a bent at rotations of its first column; NaN beyond the end of the model.

    Parameters
    ----------
    theta_2 : array
        Rotation of the second column, clockwise [rad].
    psi : array
        Rotation of the beam, clockwise [rad].
    u, v : array
        Displacement of the beam's centre of mass, to the right and upwards [m].
    drop : array
        Height of the right end of the span above its left end, over both axes [m].
    inertia, pull, push : array
        A [m2], Q [m] and X [m] of `rockframe.unequal.linkage`, over the mass of both columns, for
        q = theta_1.
    """

    theta_2: Float
    psi: Float
    u: Float
    v: Float
    drop: Float
    inertia: Float
    pull: Float
    push: Float


def bent_positions(bent: UnequalBent, theta_1: ArrayLike) -> BentPositions:
    """Return the positions of a bent at rotations of its first column.

    Parameters
    ----------
    bent : UnequalBent
        The bent.
    theta_1 : array_like
        Rotation of the first column, clockwise [rad].

    Returns
    -------
    BentPositions
        Arrays of the shape of `theta_1`.

    Examples
    --------
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> at = bent_positions(bent, 0.1)
    >>> round(float(at.theta_2), 3), round(float(at.psi), 4), round(float(at.drop), 3)
    (0.128, -0.0022, 0.027)
    """
    asked = np.asarray(theta_1, dtype=np.float64)
    given = np.abs(asked.ravel())
    left = np.signbit(asked.ravel())
    table, linkage = tables(bent), linkage_of(bent)
    theta = np.full((2, 1, 2, given.size), math.nan)
    for side in range(2):
        ends = table.courses.ends[:, :, None] * np.linspace(0.0, 1.0, _GUESSES)
        first, second = table.courses.rotations(ends)[:, 0, side]
        grows = np.maximum.accumulate(first)
        theta[0, 0, side] = np.where(given <= grows[-1], given, math.nan)
        theta[1, 0, side] = np.interp(given, grows, second)
    for _ in range(_ROUNDS):
        pose = linkage.pose(theta)
        gap = 0.5 * (pose.across**2 + pose.up**2 - linkage.span**2)
        slope = pose.across * pose.y[1] - pose.up * pose.x[1]
        step = np.full_like(gap, math.nan)  # at a dead centre
        np.divide(gap, slope, out=step, where=slope != 0.0)
        theta = np.stack([theta[0], theta[1] - step])
    sign = np.array([1.0, -1.0])[:, None]
    pose = linkage.pose(theta)
    gains = linkage.gains(pose)
    field = linkage.velocities(pose, gains / gains[0])
    across, up = linkage.pulls(field)
    u, v = linkage.beam_displacement(pose)
    psi = sign * linkage.beam_rotation(pose)
    drop = -bent.spacing * np.sin(psi)
    inertia = linkage.product(field, field)

    def chosen(values: Float) -> Float:
        right, to_left = values[0]
        return np.asarray(np.where(left, to_left, right).reshape(asked.shape))

    every = (sign * theta[1], psi, sign * u, v, drop, inertia, sign * up, across)
    return BentPositions(*(chosen(np.asarray(values)) for values in every))


def sizes_of(bents: Sequence[UnequalBent]) -> Sizes:
    """Return the dimensions of bents as arrays."""
    heights = np.array([bent.heights for bent in bents], dtype=np.float64)
    widths = np.array([bent.widths for bent in bents], dtype=np.float64)
    masses = np.array(
        [bent.column_masses or np.multiply(bent.heights, bent.widths) for bent in bents],
        dtype=np.float64,
    )

    def column(quantity: str) -> Float:
        return np.array([getattr(bent, quantity) for bent in bents], dtype=np.float64)

    return Sizes(
        heights=heights,
        widths=widths,
        spacing=column("spacing"),
        shares=masses / masses.sum(axis=1, keepdims=True),
        mass_ratio=column("mass_ratio"),
        beam_depth=column("beam_depth"),
        beam_offset=column("beam_offset"),
    )


def require_bent(bent: object) -> None:
    """Raise an error if a structure is none of two unequal columns."""
    if not isinstance(bent, UnequalBent):
        raise ParameterError(f"Invalid bent of type {type(bent).__name__}. Must be an UnequalBent.")


@lru_cache(maxsize=1024)
def linkage_of(bent: UnequalBent) -> Linkage:
    """Return the linkage of a bent."""
    return Linkage(sizes_of([bent]))


@lru_cache(maxsize=1024)
def tables(bent: UnequalBent) -> Tables:
    """Return the numbers of a bent for the kernel."""
    return tables_of(sizes_of([bent]), np.array([bent.restitutions]))
