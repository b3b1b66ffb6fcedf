"""Parts of a rocking frame: columns, tendons, dissipaters, pivots and abutments."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, ConfigDict, Field, PlainSerializer, Strict

from rockframe.errors import invalid, require_known

#: I_o / (m_c R^2) of a rectangular column about its base corner.
RECTANGULAR: Final = 4.0 / 3.0

#: Column sections accepted by `inertia_ratio_of` and `shape_of`.
SECTIONS: Final = ("rectangular", "circular")
#: The area of a section grows with this power of the width; the depth of rectangles is constant.
_POWER: Final = {"rectangular": 1, "circular": 2}


def inertia_ratio_of(section: str, height: float, width: float) -> float:
    """Return I_o / (m_c R^2) of a prismatic column about its base edge [1].

    Parameters
    ----------
    section : str
        ``rectangular``, or ``circular`` for a solid cylinder, which rocks on a point of its rim.
    height, width : float
        Height and width (diameter) of the column [m].

    Raises
    ------
    ParameterError
        If the section is neither of these.

    Notes
    -----
    The ratio is 4/3 for the rectangle, and 4/3 - sin(alpha)^2 / 12 for the cylinder, from
    I_o / m_c = 5 b^2 / 4 + 4 h^2 / 3 (re-derived).

    Examples
    --------
    >>> round(inertia_ratio_of("circular", 9.6, 1.6), 6)
    1.331081
    """
    require_known("section", section, SECTIONS)
    if section == "rectangular":
        return RECTANGULAR
    return RECTANGULAR - width**2 / (width**2 + height**2) / 12.0


@dataclass(frozen=True)
class ColumnShape:
    """Properties that affect rocking, besides the height and the widths of a column.

    Parameters
    ----------
    inertia_ratio : float
        I_o / (m_c R^2) about the base corner, which is at the distance R from the centre of
        gravity [1].
    centre_of_gravity : float
        Height of the centre of gravity above the base [m].
    """

    inertia_ratio: float
    centre_of_gravity: float


def tapered(section: str, height: float, width: float, top_width: float) -> ColumnShape:
    """Return the shape of a solid column whose width changes linearly from base to top.

    Parameters
    ----------
    section : str
        ``rectangular`` for a trapezoid of constant depth, ``circular`` for a frustum of a cone.
    height, width, top_width : float
        Height, and widths (diameters) at base and top [m].

    Raises
    ------
    ParameterError
        If the section is neither of these, or a dimension is not positive.

    Notes
    -----
    The area and its moments are integrated over the height (re-derived).

    Examples
    --------
    >>> drum = tapered("circular", 10.0, 2.0, 1.6)
    >>> round(drum.centre_of_gravity, 4), round(drum.inertia_ratio, 4)
    (4.6311, 1.3756)
    """
    _require_size(height=height, width=width, top_width=top_width)
    require_known("section", section, SECTIONS)
    power = _POWER[section]
    # moments of order 0 to 2 of the area over the height, and of its squared radius of gyration
    area, first, second = (_moment(power, order, width, top_width) for order in range(3))
    gyration = _moment(power + 2, 0, width, top_width) / (12.0 if power == 1 else 16.0)
    centre = height * first / area
    about_base = height**2 * second / area + gyration / area
    return _shape(about_base, centre, width)


def height_variance(section: str, top_ratio: float) -> float:
    """Return the variance of the height of a solid column's mass, over its height squared [1].

    Parameters
    ----------
    section : str
        ``rectangular`` or ``circular``.
    top_ratio : float
        Width at the top over that at the base [1]; 1 also of hollow prismatic columns.

    Examples
    --------
    >>> round(12.0 * height_variance("circular", 1.0), 12)
    1.0
    """
    power = _POWER[section]
    area, first, second = (_moment(power, order, 1.0, top_ratio) for order in range(3))
    return second / area - (first / area) ** 2


def hollow(
    section: str,
    height: float,
    width: float,
    inner_width: float,
    depth: float | None = None,
    inner_depth: float | None = None,
) -> ColumnShape:
    """Return the shape of a hollow prismatic column.

    Parameters
    ----------
    section : str
        ``rectangular``, with the depths, or ``circular``.
    height, width, inner_width : float
        Height, and outer and inner width (diameter) [m].
    depth, inner_depth : float, optional
        Outer and inner depth of a rectangular section, out of the plane of rocking [m].

    Raises
    ------
    ParameterError
        If the section is neither of these, a dimension is not positive, an inner dimension is not
        below the outer one, or the depths of a rectangular section are missing.

    Examples
    --------
    >>> round(hollow("circular", 9.6, 1.6, 1.2).inertia_ratio, 4)
    1.3349
    """
    _require_size(height=height, width=width, inner_width=inner_width)
    _require_below(inner_width, width, "inner_width")
    require_known("section", section, SECTIONS)
    if section == "circular":
        gyration = (width**2 + inner_width**2) / 16.0
    else:
        if depth is None or inner_depth is None:
            missing = "depth" if depth is None else "inner_depth"
            must = "stated together with an inner width, unless the section is circular"
            raise invalid(missing, None, "a hollow rectangular column", must)
        _require_size(depth=depth, inner_depth=inner_depth)
        _require_below(inner_depth, depth, "inner_depth")
        area = depth * width - inner_depth * inner_width
        gyration = (depth * width**3 - inner_depth * inner_width**3) / (12.0 * area)
    return _shape(height**2 / 3.0 + gyration, 0.5 * height, width)


def volume(
    section: str,
    height: float,
    width: float,
    *,
    top_width: float | None = None,
    inner_width: float | None = None,
    depth: float | None = None,
    inner_depth: float | None = None,
) -> float:
    """Return the volume of a column [m3].

    Parameters
    ----------
    section : str
        ``rectangular``, with the depth, or ``circular``.
    height, width, top_width, inner_width, depth, inner_depth : float
        Dimensions as for `tapered` and `hollow` [m].

    Raises
    ------
    ParameterError
        If the depth of a rectangular section is missing.

    Examples
    --------
    >>> round(volume("circular", 9.6, 1.6), 3)
    19.302
    """
    top = width if top_width is None else top_width
    if section == "circular":
        outer = math.pi / 12.0 * (width**2 + width * top + top**2)
        return height * (outer - 0.25 * math.pi * (inner_width or 0.0) ** 2)
    if depth is None:
        raise invalid("depth", None, "a rectangular column", "stated together with its density")
    return height * (0.5 * (width + top) * depth - (inner_width or 0.0) * (inner_depth or 0.0))


def _moment(power: int, order: int, base: float, top: float) -> float:
    """Return the integral of z^order (base + (top - base) z)^power over z from 0 to 1."""
    growth = top - base
    return sum(
        math.comb(power, k) * base ** (power - k) * growth**k / (k + order + 1.0)
        for k in range(power + 1)
    )


def _shape(about_base: float, centre: float, width: float) -> ColumnShape:
    """Return the shape, from the inertia over the mass about the middle of the base [m2]."""
    squared = centre**2 + 0.25 * width**2
    return ColumnShape((about_base + 0.25 * width**2) / squared, centre)


def _require_size(**dimensions: float) -> None:
    for name, value in dimensions.items():
        if not value > 0.0:
            raise invalid(name, value, "a column", "positive")


def _require_below(inner: float, outer: float, name: str) -> None:
    if not inner < outer:
        raise invalid(name, inner, "a hollow column", f"below the outer one, {outer:g} m")


Float = NDArray[np.float64]


@dataclass(frozen=True)
class Lever:
    """The line from the pivot of a column to a point of the column.

    Parameters
    ----------
    length : float
        Length of the line [m].
    angle : float
        Angle of the line from the vertical at rest [rad]. The point is highest at this |theta|.

    Examples
    --------
    >>> float(Lever(2.0, 0.1).lift(0.1).round(6))
    0.009992
    """

    length: float
    angle: float

    def shift(self, theta: ArrayLike) -> Float:
        """Return the horizontal displacement at a rotation [m]."""
        theta = np.asarray(theta, dtype=np.float64)
        # sin(angle) - sin(angle - |theta|) without cancellation at small theta
        half = 0.5 * np.abs(theta)
        u: Float = np.sign(theta) * np.sin(half) * np.cos(self.angle - half)
        return 2.0 * self.length * u

    def lift(self, theta: ArrayLike) -> Float:
        """Return the vertical displacement at a rotation [m]."""
        half = 0.5 * np.abs(np.asarray(theta, dtype=np.float64))
        v: Float = np.sin(half) * np.sin(self.angle - half)
        return 2.0 * self.length * v

    def rotation_at(self, shift: float, lift: float) -> float:
        """Return the least |theta| at which a displacement [m] is reached; infinite if neither is.

        Examples
        --------
        >>> lever = Lever(2.0, 0.1)
        >>> round(lever.rotation_at(float(lever.shift(0.05)), math.inf), 12)
        0.05
        >>> round(lever.rotation_at(math.inf, float(lever.lift(0.03))), 12)
        0.03
        """
        sine = math.sin(self.angle) - shift / self.length
        cosine = math.cos(self.angle) + lift / self.length
        across = self.angle - math.asin(sine) if sine >= -math.cos(self.angle) else math.inf
        return min(across, self.angle - math.acos(cosine) if cosine <= 1.0 else math.inf)

    def shift_rate(self, theta: ArrayLike, omega: ArrayLike) -> Float:
        """Return the horizontal velocity [m s-1] at a rotation and its rate."""
        phi = self.angle - np.abs(np.asarray(theta, dtype=np.float64))
        rate: Float = self.length * np.cos(phi) * np.asarray(omega)
        return rate

    def lift_rate(self, theta: ArrayLike, omega: ArrayLike) -> Float:
        """Return the vertical velocity [m s-1] at a rotation and its rate."""
        theta, omega = np.asarray(theta, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        side = _side(theta, omega)
        rate: Float = self.length * side * np.sin(self.angle - np.abs(theta)) * omega
        return rate

    def acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> tuple[Float, Float]:
        """Return the horizontal and vertical acceleration relative to the ground [m s-2]."""
        theta, omega = np.asarray(theta, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        growth = np.asarray(omega_rate, dtype=np.float64)
        phi = self.angle - np.abs(theta)
        sine, cosine, square = _side(theta, omega) * np.sin(phi), np.cos(phi), omega**2
        return (
            self.length * (cosine * growth + sine * square),
            self.length * (sine * growth - cosine * square),
        )


def _side(theta: Float, omega: Float) -> Float:
    """Return sgn(theta), or at theta = 0 the side to which the frame starts to rotate."""
    return np.where(theta == 0.0, np.sign(omega), np.sign(theta))


def _plain(schema: dict[str, Any]) -> None:
    """Reduce a JSON schema to the first paragraph of the class, without infinite defaults."""
    schema["description"] = schema["description"].partition("\n\n")[0]
    for key in schema["properties"].values():
        if key.get("default") == math.inf:
            key["default"] = None


#: How pydantic reads a restraint from a table.
_TABLE: Final = ConfigDict(extra="forbid", serialize_by_alias=True, json_schema_extra=_plain)
#: A number; text is not converted.
_Number = Annotated[float, Strict()]
#: A number that is infinite where a table does not state it.
_Unbounded = Annotated[
    _Number,
    BeforeValidator(
        lambda stated: math.inf if stated is None else stated, json_schema_input_type=float | None
    ),
    PlainSerializer(lambda number: None if number == math.inf else number),
]


def _key(name: str, description: str, example: float | None = None) -> Any:
    """Return the annotation of a field with its key in tables."""
    return Field(alias=name, description=description, examples=[example] if example else None)


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """An unbonded tendon through the axis of each column, from the foundation to the beam.

    Parameters
    ----------
    area, modulus : float
        Cross-section [m2] and Young's modulus [Pa] of one tendon.
    length : float, optional
        Free length [m]; by default the height of the columns, which the frame fills in.
    prestress : float
        Force of the tendon at rest [N].
    yield_stress : float, optional
        Yield stress [Pa]; by default the tendon never yields.
    loses_prestress : bool
        If true, the tendon yields at the yield stress, and its prestress decreases by the plastic
        elongation. If false, it stays elastic, and the time at which it exceeds the yield stress is
        reported.

    Raises
    ------
    ParameterError
        If a dimension or the modulus is not positive, the prestress is negative or above the yield
        stress, or the tendon loses prestress and has no yield stress.

    Examples
    --------
    >>> tendon = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=2e5)
    >>> round(tendon.stiffness / 1e6, 1)
    20.3
    """

    __pydantic_config__: ClassVar = _TABLE

    area: Annotated[_Number, _key("area_m2", "Cross-section [m2].", 1.0e-3)]
    modulus: Annotated[_Number, _key("modulus_pa", "Young's modulus [Pa].", 195.0e9)]
    length: Annotated[
        _Number | None,
        _key("length_m", "Free length [m]; by default the height of the column.", 9.6),
    ] = None
    prestress: Annotated[_Number, _key("prestress_n", "Force at rest [N].")] = 0.0
    yield_stress: Annotated[
        _Unbounded,
        _key("yield_stress_pa", "Yield stress [Pa]; by default the tendon never yields.", 1.6e9),
    ] = math.inf
    loses_prestress: Annotated[
        bool,
        Strict(),
        _key(
            "loses_prestress",
            "Model the loss of prestress when the tendon yields; otherwise only the time of "
            "yielding is reported.",
        ),
    ] = False

    def __post_init__(self) -> None:
        lengths = () if self.length is None else ("length",)
        _require_positive(self, "area", "modulus", *lengths, "yield_stress")
        if self.loses_prestress and math.isinf(self.yield_stress):
            raise invalid("yield_stress", None, "a tendon", "stated, as it loses prestress")
        if not 0.0 <= self.prestress < self.yield_force:
            limit = f" and below its yield force, {self.yield_force:g} N"
            allowed = f"zero or above{limit if self.prestress > 0.0 else ''}"
            raise invalid("prestress", self.prestress, "a tendon", allowed)

    @property
    def stiffness(self) -> float:
        """Axial stiffness E A / L [N/m]."""
        if self.length is None:
            raise invalid("length", None, "a tendon", "stated, or filled in by its frame")
        return self.modulus * self.area / self.length

    @property
    def yield_force(self) -> float:
        """Force at which the tendon yields [N]."""
        return self.yield_stress * self.area

    def force(self, stretch: float) -> float:
        """Return the force [N] at a stretch [m] of a tendon that has not yielded before."""
        force = self.prestress + self.stiffness * stretch
        return min(force, self.yield_force) if self.loses_prestress else force


@dataclass(frozen=True, kw_only=True)
class Dissipater:
    """Bars across each joint of a column, elastic-perfectly plastic in tension and compression.

    Parameters
    ----------
    stiffness, yield_force : float
        Stiffness [N/m] and yield force [N] of all bars across one joint together.
    lever_arm : float
        Distance from the pivot to the bars [m], the same whichever side the column rocks to: half
        the width, for bars on the axis of the column. Bars off the axis would need two groups.

    Raises
    ------
    ParameterError
        If a value is not positive.

    Examples
    --------
    >>> Dissipater(stiffness=5e7, yield_force=2e5, lever_arm=0.8).lever_arm
    0.8
    """

    __pydantic_config__: ClassVar = _TABLE

    stiffness: Annotated[
        _Number, _key("stiffness_n_m", "Stiffness of all bars across one joint [N/m].", 5.0e7)
    ]
    yield_force: Annotated[
        _Number, _key("yield_force_n", "Yield force of all bars across one joint [N].", 1.0e5)
    ]
    lever_arm: Annotated[
        _Number,
        _key(
            "lever_arm_m",
            "Distance from the pivot to the bars, before its edge crushes [m]; the same for "
            "rocking to either side, as of bars on the axis.",
            0.8,
        ),
    ]

    def __post_init__(self) -> None:
        _require_positive(self, *(field.name for field in fields(self)))
        if not math.isfinite(self.yield_force):
            raise invalid("yield_force", self.yield_force, "a dissipater", "finite")


@dataclass(frozen=True, kw_only=True)
class Abutment:
    """The joint between the deck and the abutments, at either end.

    Parameters
    ----------
    gap : float
        Displacement of the deck that closes the joint [m].
    uplift_allowance : float, optional
        Largest lift of the deck that bearings, joints and services tolerate [m].

    Raises
    ------
    ParameterError
        If the gap or the allowance is not positive.

    Examples
    --------
    >>> Abutment(gap=0.3).gap
    0.3
    """

    __pydantic_config__: ClassVar = _TABLE

    gap: Annotated[_Number, _key("gap_m", "Displacement of the deck that closes the joint [m].")]
    uplift_allowance: Annotated[
        _Unbounded,
        _key(
            "uplift_allowance_m",
            "Largest lift of the deck that bearings, joints and services tolerate [m]; by default "
            "unlimited.",
        ),
    ] = math.inf

    def __post_init__(self) -> None:
        _require_positive(self, "gap", "uplift_allowance")


@dataclass(frozen=True, kw_only=True)
class Pivot:
    """Edges of the columns that crush until a block of uniform stress carries the column.

    Parameters
    ----------
    compressive_strength : float
        Compressive strength of the edge [Pa], uniform over the block of stress.
    depth : float
        Depth of the edge, out of the plane of rocking [m].

    Raises
    ------
    ParameterError
        If a value is not positive.

    Examples
    --------
    >>> Pivot(compressive_strength=30e6, depth=1.4).inset(2.1e6)
    0.025
    """

    __pydantic_config__: ClassVar = _TABLE

    compressive_strength: Annotated[
        _Number, _key("compressive_strength_pa", "Compressive strength of the edge [Pa].")
    ]
    depth: Annotated[_Number, _key("depth_m", "Depth of the edge, out of the plane [m].")]

    def __post_init__(self) -> None:
        _require_positive(self, "compressive_strength", "depth")

    def inset(self, force: float) -> float:
        """Return the distance from the edge to the middle of the block under a force [N], in m."""
        return 0.5 * force / (self.compressive_strength * self.depth)


def _require_positive(restraint: Tendon | Dissipater | Abutment | Pivot, *names: str) -> None:
    for name in names:
        value = getattr(restraint, name)
        unbounded = name.startswith(("yield", "uplift"))
        if not value > 0.0 or (math.isinf(value) and not unbounded):
            kind = type(restraint).__name__.lower()
            owner = f"{'an' if kind[0] == 'a' else 'a'} {kind}"
            raise invalid(name, value, owner, "positive")
