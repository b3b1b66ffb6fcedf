"""Restraints of a rocking frame: tendons, dissipaters, pivots and abutments.

Each class is also a table of structures and studies: a field states its key, and the description
and the example that new studies show. pydantic reads tables; in Python, a restraint is constructed
without it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar, Final

from pydantic import BeforeValidator, ConfigDict, Field, PlainSerializer, Strict

from rockframe.errors import invalid


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
        stated = () if self.length is None else ("length",)
        _require_positive(self, "area", "modulus", *stated, "yield_stress")
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
