"""The rocking frame: N free-standing columns of equal size, capped with a rigid beam.

Equation numbers are those of Makris and Vassiliou (2013), COMPDYN 2013. The frame rocks like one
free-standing column of the same slenderness and a larger size, but loses more energy at impacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any, ClassVar, Final, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError, invalid, require_known
from rockframe.parts import (
    RECTANGULAR,
    SECTIONS,
    Abutment,
    Dissipater,
    Lever,
    Pivot,
    Tendon,
    height_variance,
    inertia_ratio_of,
)
from rockframe.units import GRAVITY

#: Dimensions of a frame [m].
_MOST_COLUMNS: Final = 1000
_LENGTHS: Final = ("height", "width", "top_width", "centre_of_gravity", "beam_depth")
#: Smallest and largest dimension of a free-standing structure [m].
_SMALLEST: Final = 0.001
_LARGEST: Final = 1000.0
#: Bounds of I_o / (m_c R^2): it is 1 for a point mass, and no column exceeds the upper bound.
_LEAST_INERTIA: Final = 1.0
_LARGEST_INERTIA: Final = 100.0
#: Largest mass ratio: eq (28) has reached its limit to round-off.
_HEAVIEST: Final = 1e15

#: Beyond these limits a value is usually a typing error or in a wrong unit.
_HEAVY: Final = 50.0
_SLENDER: Final = 2.0
_STOCKY: Final = 35.0
#: No free-standing pier or column is higher: the rocking piers of the Rangitikei bridge have 76 m.
#: Vases and models on shake tables are lower than the other limit, bridges and temples are not [m].
_HIGH, _LOW = 100.0, 0.2


def unusual(height: float, mass_ratio: float, slenderness: float) -> str:
    """Return in words which values of a frame are unusual; "" if none is.

    Parameters
    ----------
    height, mass_ratio, slenderness : float
        Height of a column [m], mass ratio [1] and slenderness [rad] of the frame.

    Examples
    --------
    >>> unusual(9.6, 60.0, 0.02)
    'mass_ratio 60 is above 50; slenderness 1.15 degrees is below 2'
    """
    angle = math.degrees(slenderness)
    limits = {
        f"height {height:g} m is above {_HIGH:g}": height > _HIGH,
        f"height {height:g} m is below {_LOW:g}": height < _LOW,
        f"mass_ratio {mass_ratio:g} is above {_HEAVY:g}": mass_ratio > _HEAVY,
        f"slenderness {angle:.2f} degrees is below {_SLENDER:g}": angle < _SLENDER,
        f"slenderness {angle:.2f} degrees is above {_STOCKY:g}": angle > _STOCKY,
    }
    return "; ".join(words for words, beyond in limits.items() if beyond)


@dataclass(frozen=True, kw_only=True, repr=False)
class RockingFrame:
    """A rocking frame; with ``mass_ratio=0``, a single free-standing column.

    Parameters
    ----------
    height, width : float
        Height 2h and width 2b of a column [m].
    mass_ratio : float
        Mass of the cap beam over the mass of all columns, gamma = m_b / (N m_c) [1].
    name : str
        Name in tables.
    inertia_ratio : float, optional
        I_o / (m_c R^2) of a column about its base corner, which is at the distance R from the
        centre of gravity [1]; by default that of a solid prismatic column of the stated section
        (`inertia_ratio_of`), or 4/3, a rectangle. `tapered` and `hollow` return it for others.
    restitution_factor : float
        Factor of the velocity ratio of eq (43) [1]. Of rigid bodies that touch at their edges, 1
        is the smallest possible loss; measured losses can be smaller or larger.
    top_width : float, optional
        Width on which the beam rests [m]; by default the width of the base.
    centre_of_gravity : float, optional
        Height of a column's centre of gravity above its base [m]; by default half the height.
        `tapered` and `hollow` return it together with the inertia ratio.
    beam_depth : float, optional
        Depth of the beam [m]; its centre of mass is at half the depth. Only the least spacing of
        two columns depends on it.
    columns : int, optional
        Number of columns below the beam, which figures draw; by default two. The motion does not
        depend on it.
    column_mass : float, optional
        Mass of one column [kg]. Restraints and forces in newtons need it; free rocking does not
        depend on it.
    section : str, optional
        Section of the columns, ``rectangular`` or ``circular``, on which the default of
        `inertia_ratio`, and mass and inertia of columns of another size depend. A stated
        `inertia_ratio` stays, such as that of a hollow column. By default the section whose
        `inertia_ratio_of` is the inertia ratio.
    section_both : str, optional
        Section of the columns for both directions of the ground motion, ``circular``, if the plane
        takes solid prismatic rectangles instead, as the paper does for its cylinders.
    friction_coefficient : float, optional
        Coefficient of friction available at the joints [1]. Rocking does not depend on it: shear
        keys carry what exceeds the friction.
    tendon, dissipater : Tendon, Dissipater, optional
        Restraints of each column. A tendon without a length gets that of the columns.
    abutment : Abutment, optional
        The joints at the ends of the deck.
    before_crushing : RockingFrame, optional
        The frame before its edges crushed; `crushed` sets it.

    Raises
    ------
    ParameterError
        If a dimension is not between 1 mm and 1 km, the centre of gravity is not within the height,
        the inertia ratio is not above 1 and at most 100, the mass ratio is not between 0 and 1e15,
        the coefficient of friction is negative, or the restitution factor makes the velocity ratio
        of impacts 0 or less, or 1 or more; if
        the restitution of eq (43) is not positive, because so stocky a frame does not rock; or if
        there is a restraint without the mass of a column.

    Notes
    -----
    Makris and Vassiliou (2013). For an `inertia_ratio` other than 4/3, and for columns that are not
    prismatic, the equations are re-derived; such a frame rocks like one column, too.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(bent.frequency_parameter, 2), round(bent.effective_frequency_parameter, 3)
    (1.23, 1.023)
    >>> round(bent.restitution, 3)
    0.947
    """

    kind: ClassVar[str] = "rocking"

    height: float
    width: float
    mass_ratio: float = 0.0
    name: str = "frame"
    inertia_ratio: float = None  # type: ignore[assignment]  # __post_init__ fills it in
    restitution_factor: float = 1.0
    top_width: float | None = None
    centre_of_gravity: float | None = None
    beam_depth: float | None = None
    columns: int | None = None
    column_mass: float | None = None
    section: str | None = None
    section_both: str | None = None
    friction_coefficient: float | None = None
    tendon: Tendon | None = None
    dissipater: Dissipater | None = None
    abutment: Abutment | None = None
    before_crushing: RockingFrame | None = None

    def __repr__(self) -> str:
        """Return the arguments that differ from their defaults, as they are written in Python."""
        shown = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        values = (
            f"{name}={value!r}" for name, (value, default) in shown.items() if value != default
        )
        return f"RockingFrame({', '.join(values)})"

    def __post_init__(self) -> None:
        self._require_numbers()
        for label in _LENGTHS:
            value = getattr(self, label)
            if value is not None and not _SMALLEST <= value <= _LARGEST:
                raise self._invalid(label, f"between {_SMALLEST:g} and {_LARGEST:g} m")
        self._fill_in_inertia()
        if not _LEAST_INERTIA < self.inertia_ratio <= _LARGEST_INERTIA:
            raise self._invalid(
                "inertia_ratio",
                f"above {_LEAST_INERTIA:g} and at most {_LARGEST_INERTIA:g}: about the corner it "
                "is 1 for a mass in one point, and 4/3 for a rectangle",
            )
        if not 0.0 <= self.mass_ratio <= _HEAVIEST:
            raise self._invalid("mass_ratio", f"between 0 and {_HEAVIEST:g}")
        if self.centre_height >= self.height:
            raise self._invalid("centre_of_gravity", f"below the height, {self.height:g} m")
        if self.column_mass is None and self.restrained:
            raise self._invalid("column_mass", "stated together with a tendon or a dissipater")
        if self.column_mass is not None and not 0.0 < self.column_mass < math.inf:
            raise self._invalid("column_mass", "positive")
        friction = self.friction_coefficient
        if friction is not None and not 0.0 <= friction < math.inf:
            raise self._invalid("friction_coefficient", "zero or above")
        self._require_columns()
        self._fill_in_length()
        self._require_loss()
        self._require_section_both()

    def _require_columns(self) -> None:
        most = _MOST_COLUMNS if self.mass_ratio > 0.0 else 1
        if self.columns is not None and not 1 <= self.columns <= most:
            allowed = f"an integer from 1 to {most}" if most > 1 else "1: without a beam"
            raise self._invalid("columns", allowed)

    def _require_section_both(self) -> None:
        if self.section_both not in (None, "circular"):
            raise self._invalid("section_both", "circular, or absent")
        solid = self.prismatic and self.inertia_ratio == RECTANGULAR and self.section != "circular"
        if self.section_both is not None and not solid:
            allowed = "absent unless the columns are solid, prismatic and rectangular in the plane"
            raise self._invalid("section_both", f"{allowed}: state the section alone")

    def _require_loss(self) -> None:
        """Require that impacts take some of the speed, but not all of it."""
        rigid = self._rigid_restitution
        if rigid <= 0.0:
            limit = f"below {math.degrees(self.slenderness_limit):.2f} degrees"
            raise ParameterError(
                f"Invalid slenderness {math.degrees(self.slenderness):.2f} degrees of frame "
                f"{self.name!r} (height {self.height:g} m, width {self.width:g} m). Must be "
                f"{limit if self.prismatic else 'less'} for mass_ratio {self.mass_ratio:g}: the "
                f"restitution (eq 43) would be {rigid:.3f}, and a frame that loses all "
                "speed at an impact does not rock."
            )
        if not 0.0 < self.restitution < 1.0:
            raise self._invalid(
                "restitution_factor",
                f"above 0 and below {1.0 / rigid:.6g}: it multiplies the velocity ratio of eq "
                f"(43), {rigid:.4g}, and each impact must lose speed, so that the "
                "product stays below 1",
            )

    def _require_numbers(self) -> None:
        ratios = ("mass_ratio", "inertia_ratio", "restitution_factor")
        for label in (*_LENGTHS, *ratios, "column_mass", "friction_coefficient"):
            value = getattr(self, label)
            absent = value is None and getattr(RockingFrame, label, 0.0) is None
            if not (absent or isinstance(value, Real)):
                raise self._invalid(label, "a number")

    def _fill_in_inertia(self) -> None:
        if self.section is not None:
            require_known("section", self.section, SECTIONS)
        if cast("float | None", self.inertia_ratio) is None:
            section = self.section or "rectangular"
            ratio = inertia_ratio_of(section, self.height, self.width)
            object.__setattr__(self, "inertia_ratio", ratio)

    def _fill_in_length(self) -> None:
        if self.tendon is not None and self.tendon.length is None:
            object.__setattr__(self, "tendon", replace(self.tendon, length=self.height))

    def _invalid(self, quantity: str, allowed: str) -> ParameterError:
        return invalid(quantity, getattr(self, quantity), f"frame {self.name!r}", allowed)

    @property
    def weight(self) -> float:
        """Weight of a column with its share of the beam [N]; NaN if the mass is not known."""
        return (1.0 + self.mass_ratio) * (self.column_mass or math.nan) * GRAVITY

    @property
    def restrained(self) -> bool:
        """True if tendons or dissipaters cross the joints."""
        return self.tendon is not None or self.dissipater is not None

    @property
    def prismatic(self) -> bool:
        """True if the columns have equal widths at base and top, and their centre at mid-height."""
        return self.top_width is None and self.centre_of_gravity is None

    @property
    def top_contact_width(self) -> float:
        """Width on which the beam rests, 2 b_t [m]."""
        return self.width if self.top_width is None else self.top_width

    @property
    def centre_height(self) -> float:
        """Height of a column's centre of gravity above its base, h_c [m]."""
        return 0.5 * self.height if self.centre_of_gravity is None else self.centre_of_gravity

    @property
    def size(self) -> float:
        """Distance R from the pivot of a column to its centre of gravity [m]."""
        return 0.5 * math.hypot(2.0 * self.centre_height, self.width)

    @property
    def slenderness(self) -> float:
        """Slenderness of the column that rocks like the frame [rad]; atan(b / h) if prismatic."""
        if self.prismatic:
            return math.atan2(self.width, self.height)
        return math.atan2(*self._arms)

    @property
    def beam(self) -> Lever:
        """Line from the pivot of a column to the point at which the beam rests on it."""
        if self.prismatic:
            return Lever(2.0 * self.size, self.slenderness)
        return Lever(math.hypot(self._reach, self.height), math.atan2(self._reach, self.height))

    @property
    def centre(self) -> Lever:
        """Line from the pivot of a column to its centre of gravity."""
        return Lever(self.size, math.atan2(0.5 * self.width, self.centre_height))

    @property
    def _reach(self) -> float:
        """Horizontal distance between the pivots of a column at base and top, b + b_t [m]."""
        return 0.5 * (self.width + self.top_contact_width)

    @property
    def _arms(self) -> tuple[float, float]:
        """Moment arms of the weight and of the horizontal inertia, beam included [m]."""
        gamma = self.mass_ratio
        across = 0.5 * self.width + gamma * self._reach
        return across, self.centre_height + gamma * self.height

    @property
    def _inertia(self) -> float:
        """Moment of inertia about the pivots with the beam, over the mass of one column [m2]."""
        column = self.inertia_ratio * self.size**2
        return column + self.mass_ratio * (self._reach**2 + self.height**2)

    @property
    def slenderness_limit(self) -> float:
        """Slenderness of prismatic columns at which the restitution of eq (43) vanishes [rad]."""
        gamma = self.mass_ratio
        return math.asin(
            min(1.0, math.sqrt((self.inertia_ratio + 4.0 * gamma) / (2.0 + 8.0 * gamma)))
        )

    @property
    def frequency_parameter(self) -> float:
        """Frequency parameter of one column, p = sqrt(3 g / 4 R) if rectangular [rad s-1]."""
        return math.sqrt(GRAVITY / (self.inertia_ratio * self.size))

    @property
    def effective_size(self) -> float:
        """Size of the column that rocks like the frame, R-hat of eq (29) [m]."""
        gamma = self.mass_ratio
        if not self.prismatic:
            return self._inertia / (self.inertia_ratio * math.hypot(*self._arms))
        return self.size * (1.0 + 4.0 * gamma / self.inertia_ratio) / (1.0 + 2.0 * gamma)

    @property
    def effective_frequency_parameter(self) -> float:
        """Frequency parameter of the frame, p-hat of eq (27) [rad s-1]."""
        return math.sqrt(GRAVITY / (self.inertia_ratio * self.effective_size))

    @property
    def restitution(self) -> float:
        """Angular velocity after an impact over that before it [1].

        It is sqrt(r) of eq (43) times the restitution factor.
        """
        return self.restitution_factor * self._rigid_restitution

    @property
    def _rigid_restitution(self) -> float:
        """Velocity ratio sqrt(r) of eq (43), of rigid bodies that touch at their edges [1]."""
        gamma = self.mass_ratio
        if not self.prismatic:
            kept = self._inertia - 0.5 * self.width**2 - 2.0 * gamma * self._reach**2
            return kept / self._inertia
        loss = 2.0 * math.sin(self.slenderness) ** 2 * (1.0 + 4.0 * gamma)
        return 1.0 - loss / (self.inertia_ratio + 4.0 * gamma)

    @property
    def uplift_acceleration(self) -> float:
        """Ground acceleration at which the frame uplifts [m s-2].

        It is g tan(alpha) of eq (36), plus a term for the prestress of tendons.
        """
        across, upwards = (self.width, self.height) if self.prismatic else self._arms
        hold = 0.0
        if self.tendon is not None:
            moment = self.tie_moment(self.tendon.prestress, self.tie_lever)
            hold = moment / math.cos(self.slenderness)
        return GRAVITY * (across / upwards + hold)

    @property
    def joints(self) -> float:
        """Number of joints of a column: one at its base and, with a beam, one at its top."""
        return 2.0 if self.mass_ratio > 0.0 else 1.0

    @property
    def tie_lever(self) -> float:
        """Stretch of a tendon over 2 sin(|theta| / 2) [m]; smaller for a column without a beam."""
        return self._reach if self.mass_ratio > 0.0 else 0.5 * self.width

    def tie_moment(self, force: float, lever: float) -> float:
        """Return the moment of a force [N] at a lever [m] in each column, over that of gravity [1].

        The moment of gravity is that of a horizontal column with its share of the beam.
        """
        return force * lever / ((self.column_mass or math.nan) * GRAVITY * self.moment_arm)

    @property
    def moment_arm(self) -> float:
        """Moment of gravity of a horizontal column and its beam, over the column's weight [m]."""
        return math.hypot(*self._arms)

    def tension(self, theta: float) -> float:
        """Return the force [N] of a tendon that has not yielded, at a rotation [rad]; 0 without."""
        stretch = 2.0 * self.tie_lever * math.sin(0.5 * abs(theta))
        return 0.0 if self.tendon is None else self.tendon.force(stretch)

    @property
    def abutment_rotation(self) -> float:
        """Least |theta| [rad] at which the deck closes the gap or exceeds the allowed lift."""
        if self.abutment is None:
            return math.inf
        return self.beam.rotation_at(self.abutment.gap, self.abutment.uplift_allowance)

    def bar_force(self, theta: float) -> float:
        """Return the force [N] of the dissipaters across one joint at the first rotation [rad] to
        `theta`; 0 without them.
        """
        bars = self.dissipater
        if bars is None:
            return 0.0
        stretch = 2.0 * bars.lever_arm * math.sin(0.5 * abs(theta))
        return min(bars.stiffness * stretch, bars.yield_force)

    @property
    def column_section(self) -> str | None:
        """Section of the columns, stated or recognised by the inertia ratio; None if unknown."""
        if self.section is not None or not self.prismatic:
            return self.section
        size = (self.height, self.width)
        matching = (
            name for name in SECTIONS if self.inertia_ratio == inertia_ratio_of(name, *size)
        )
        return next(matching, None)

    @property
    def in_both_directions(self) -> Self:
        """The frame with the section of its columns for both directions of the ground motion.

        It is the frame itself unless `section_both` states another section than that of the plane.

        Examples
        --------
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, section_both="circular")
        >>> round(bent.inertia_ratio, 4), round(bent.in_both_directions.inertia_ratio, 4)
        (1.3333, 1.3311)
        """
        if self.section_both is None:
            return self
        ratio = inertia_ratio_of(self.section_both, self.height, self.width)
        return replace(self, section=self.section_both, inertia_ratio=ratio, section_both=None)

    def resized(self, height: float, width: float) -> Self:
        """Return the frame with another height and width [m], its other dimensions in proportion.

        The mass of a column is proportional to the height and to the width, or for a circular
        section to the height and the square of the width; the depth of other columns does not
        change. The inertia is that of the same section, unless the section is unknown: then the
        inertia ratio does not change. The length of tendons is proportional to the height, and
        the lever arm of dissipaters to the width. Sections and forces of restraints do not change.

        Examples
        --------
        >>> column = RockingFrame(height=8.0, width=1.6, top_width=1.2)
        >>> column.resized(4.0, 0.8).top_width
        0.6
        >>> drum = RockingFrame(height=6.0, width=1.0, column_mass=1000.0, section="circular")
        >>> drum.resized(12.0, 2.0).column_mass
        8000.0
        """
        top, centre, mass = self.top_width, self.centre_of_gravity, self.column_mass
        tendon, bars = self.tendon, self.dissipater
        taller, wider = height / self.height, width / self.width
        deeper = wider if self.column_section == "circular" else 1.0
        return replace(
            self,
            height=height,
            width=width,
            inertia_ratio=self.inertia_ratio
            if taller == wider
            else self.resized_inertia(taller, wider),
            top_width=top and top * width / self.width,
            centre_of_gravity=centre and centre * height / self.height,
            column_mass=mass and mass * taller * wider * deeper,
            tendon=tendon and replace(tendon, length=tendon.length and tendon.length * taller),
            dissipater=bars and replace(bars, lever_arm=bars.lever_arm * wider),
        )

    def resized_inertia(self, taller: Any, wider: Any) -> Any:
        """Return the inertia ratio of columns of the same section, higher and wider by factors, or
        by arrays of them.

        The part of the inertia that the height gives grows with its square, the rest with that of
        the width. Edges that crushed change neither.
        """
        whole = self.before_crushing or self
        section = whole.column_section
        rectangular = self.prismatic and self.inertia_ratio == RECTANGULAR
        if section is None or rectangular:
            return self.inertia_ratio
        along = height_variance(section, whole.top_contact_width / whole.width) * self.height**2
        across = (self.inertia_ratio - 1.0) * self.size**2 - along
        squared = (taller * self.centre_height) ** 2 + (0.5 * wider * self.width) ** 2
        return 1.0 + (taller**2 * along + wider**2 * across) / squared

    def horizontal_displacement(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Return the displacement u of the beam from the ground [m], eq (7), at `theta` [rad].

        Examples
        --------
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
        >>> float(bent.horizontal_displacement(bent.slenderness).round(9))
        1.6
        """
        return self.beam.shift(theta)

    def vertical_displacement(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Return the vertical lift v of the beam [m], eq (10), at `theta` [rad].

        Examples
        --------
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
        >>> float(bent.vertical_displacement(0.0))
        0.0
        """
        return self.beam.lift(theta)

    def horizontal_velocity(self, theta: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
        """Return the rate of u [m s-1], eq (8), at `theta` [rad] and its rate `omega` [rad s-1]."""
        return self.beam.shift_rate(theta, omega)

    def vertical_velocity(self, theta: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
        """Return the rate of v [m s-1], eq (11), at `theta` [rad] and its rate `omega` [rad s-1].

        At theta = 0 the rate jumps; the value just after the impact is returned.
        """
        return self.beam.lift_rate(theta, omega)

    def horizontal_acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> NDArray[np.float64]:
        """Return u'' [m s-2], eq (9), at theta [rad], theta' `omega` and theta'' `omega_rate`."""
        return self.beam.acceleration(theta, omega, omega_rate)[0]

    def vertical_acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> NDArray[np.float64]:
        """Return v'' [m s-2], eq (12), at theta [rad], theta' `omega` and theta'' `omega_rate`."""
        return self.beam.acceleration(theta, omega, omega_rate)[1]


def crushed(frame: RockingFrame, pivot: Pivot) -> RockingFrame:
    """Return the frame on its pivots after the edges of the columns have crushed.

    A block of uniform stress carries the column, its share of the beam, and the tendon. The pivot
    moves inwards by half the length of this block. The force of the tendon is taken at |theta|
    equal to the slenderness on the new pivots, so both are found by iteration. The force of
    dissipaters is not added. Their lever arm becomes shorter by the mean of the moves at base and
    top, so the moments of yielding bars are exact; their stiffness is too small by the square of
    half the difference of these moves, over that of the lever arm. The given frame is stored in
    `before_crushing` of the result.

    Raises
    ------
    ParameterError
        If there is no column_mass, the block is longer than half the column, or a pivot moves past
        the dissipaters.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3)
    >>> round(crushed(bent, Pivot(compressive_strength=30e6, depth=1.4)).width, 3)
    1.544
    """
    owner = f"frame {frame.name!r}"
    if frame.column_mass is None:
        raise invalid("column_mass", None, owner, "stated together with a pivot")
    weight = frame.column_mass * GRAVITY
    crushed_frame, tension = frame, 0.0
    for _ in range(50):
        base = pivot.inset((1.0 + frame.mass_ratio) * weight + tension)
        top = pivot.inset(frame.mass_ratio * weight + tension)
        over = max(4.0 * base / frame.width, 4.0 * top / frame.top_contact_width)
        if over > 1.0:
            strength = pivot.compressive_strength
            narrowest = min(frame.width, frame.top_contact_width)
            over += 4.0 * pivot.inset(frame.tension(frame.slenderness) - tension) / narrowest
            enough = 1.006 * over * strength  # so that three digits are not rounded below it
            needed = f"its block of {2.0 * base:.3g} m is longer than half the width"
            allowed = f"larger; {enough:.3g} Pa is enough at this depth: {needed}"
            raise invalid("compressive_strength", strength, f"the pivot of {owner}", allowed)
        crushed_frame = _on_pivots(frame, base, top)
        before, tension = tension, crushed_frame.tension(crushed_frame.slenderness)
        if abs(tension - before) <= 1e-12 * weight:
            break
    return crushed_frame


def _on_pivots(frame: RockingFrame, base: float, top: float) -> RockingFrame:
    """Return the same columns on pivots moved inwards [m], with inertia and levers about these."""
    width, top_width = frame.width - 2.0 * base, frame.top_contact_width - 2.0 * top
    central = (frame.inertia_ratio - 1.0) * frame.size**2
    bars = frame.dissipater
    if bars is not None:
        moved = 0.5 * (base + top) if frame.joints > 1.0 else base
        if bars.lever_arm <= moved:
            allowed = f"above {moved:.3g} m, by which the pivots of crushed edges move inwards"
            raise invalid("lever_arm", bars.lever_arm, "a dissipater", allowed)
        bars = replace(bars, lever_arm=bars.lever_arm - moved)
    return replace(
        frame,
        width=width,
        top_width=top_width,
        centre_of_gravity=frame.centre_height,
        inertia_ratio=1.0 + central / (frame.centre_height**2 + 0.25 * width**2),
        dissipater=bars,
        section_both=None,
        before_crushing=frame,
    )
