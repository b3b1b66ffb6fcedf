"""Files of structures and of the bridges to compare with, and the bundled ones."""

from __future__ import annotations

import math
import warnings
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, core_schema

from rockframe.errors import InputError, RockframeWarning, invalid
from rockframe.options.model import Name, Options, rule
from rockframe.options.respond import BridgeEnsemble
from rockframe.parts import (
    Abutment,
    Dissipater,
    Tendon,
    volume,
)
from rockframe.rivals import (
    COLUMN_SHARE,
    LIMIT_DUCTILITY,
    YIELD_DISPLACEMENT,
    FixedFrame,
    IsolatedDeck,
)
from rockframe.study.kinds import KINDS, Structure
from rockframe.study.toml import line_of, parse, read_text
from rockframe.units import GRAVITY

_PACKAGE: Final = Path(__file__).parents[1]
#: The bundled structures.
SHIPPED_STRUCTURES: Final = _PACKAGE / "data" / "structures.toml"


def bundled_records() -> Path:
    """Return the folder of the bundled records.

    Examples
    --------
    >>> bundled_records().name
    'ridgecrest2019'
    """
    installed = _PACKAGE / "data" / "ridgecrest2019"
    if installed.is_dir():
        return installed
    return _PACKAGE.parents[1] / "records" / "ridgecrest2019"  # a source tree


def _for_example(value: float) -> Any:
    return Field(examples=[value])


def _key(name: str, example: float | None = None) -> Any:
    """Return the annotation of a field with its key in tables."""
    return Field(alias=name, examples=[example] if example else None)


class TableEntry(Options):
    """A table that is checked by building the object that it describes."""

    @model_validator(mode="after")
    def _checked(self) -> Self:
        try:
            self.made()
        except ArithmeticError:
            message = "a value of this table is too large or too small to compute with"
            raise rule(f"{message}. Check units and values") from None
        return self

    @abstractmethod
    def made(self) -> Any:
        """Return the object that the table describes."""


class StructureTable(TableEntry):
    """A ``[[structure]]`` table of any kind; `KINDS` names the class of each kind."""

    name: Name
    kind: str

    @classmethod
    def for_value(cls, value: Any) -> type[StructureTable]:
        """Return the class of the kind that a table states; rocking by default."""
        kind = value.get("kind") if isinstance(value, dict) else None
        declared = KINDS.get(kind, KINDS["rocking"]) if isinstance(kind, str) else KINDS["rocking"]
        table: type[StructureTable] = resolve_name(declared.table)
        return table

    @abstractmethod
    def made(self) -> Structure:
        """Return the structure that the table describes."""

    def unusual(self) -> str:
        """Return what is unusual about the structure, in words, for a warning; "" if nothing is."""
        return ""


class _OfKind:
    """Annotation of a `StructureTable` that is validated as a table of its kind."""

    @staticmethod
    def _validated(value: Any) -> StructureTable:
        if isinstance(value, StructureTable):
            return value
        kind = value.get("kind", "rocking") if isinstance(value, dict) else "rocking"
        if not (isinstance(kind, str) and kind in KINDS):
            allowed = {"expected": ", ".join(map(repr, KINDS))}
            error = InitErrorDetails(type="literal_error", loc=("kind",), input=kind, ctx=allowed)
            raise ValidationError.from_exception_data("StructureTable", [error])
        return StructureTable.for_value(value).model_validate(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return the schema of pydantic: the class is chosen when a table is read."""
        return core_schema.no_info_plain_validator_function(self._validated)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        """Return the JSON schema: a table of one of the kinds."""
        tables = [resolve_name(kind.table) for kind in KINDS.values()]
        for table in tables:
            table.model_rebuild()
        return {"anyOf": [handler(table.__pydantic_core_schema__) for table in tables]}


#: A ``[[structure]]`` table of one of the kinds.
AnyStructure: TypeAlias = Annotated[StructureTable, _OfKind()]


class IsolatorsTable(TableEntry):
    """Isolators under the deck: lead-rubber bearings, or friction pendulums."""

    strength_ratio: Annotated[float | None, _for_example(0.05)] = None
    """Characteristic strength of lead-rubber bearings over the weight of the deck."""
    period: Annotated[float | None, _key("period_s", 3.0)] = None
    """Period from the stiffness of lead-rubber bearings after yielding [s]."""
    effective_period: Annotated[float | None, _key("effective_period_s", 2.5)] = None
    """Period from the secant stiffness at the design displacement [s]; replaces period_s."""
    design_displacement: Annotated[float | None, _key("design_displacement_m", 0.25)] = None
    """Design displacement [m]."""
    yield_displacement: Annotated[float, _key("yield_displacement_m")] = YIELD_DISPLACEMENT
    """Yield displacement of lead-rubber bearings [m]."""
    radius: Annotated[float | None, _key("radius_m", 2.5)] = None
    """Radius of friction pendulums [m]."""
    friction: Annotated[float | None, _for_example(0.05)] = None
    """Coefficient of friction of friction pendulums."""
    damping_ratio: float = 0.0
    """Viscous damping, as a fraction of critical damping."""

    def isolated(self) -> IsolatedDeck:
        """Return the deck on its isolators."""
        fields = IsolatorsTable.model_fields
        values = {name: value for name, value in self if name in fields and value is not None}
        if "radius" in values or "friction" in values:
            for name, field in fields.items():
                value = getattr(self, name)
                if name not in ("radius", "friction", "damping_ratio") and value != field.default:
                    raise invalid(name, value, "isolators", "absent where a pendulum is stated")
            for name, other in (("radius", "friction"), ("friction", "radius_m")):
                if name not in values:
                    message = f"stated together with {other}"
                    raise invalid(name, None, "friction pendulums", message)
            del values["yield_displacement"]
            return IsolatedDeck.friction_pendulum(**values)
        if self.strength_ratio is None:
            pendulum = "stated, or radius_m and friction of a pendulum"
            raise invalid("strength_ratio", None, "lead-rubber bearings", pendulum)
        pair = {
            "effective_period_s": self.effective_period,
            "design_displacement_m": self.design_displacement,
        }
        secant = [key for key, value in pair.items() if value is not None]
        if self.period is None and len(secant) < len(pair):
            raise invalid("period", None, "bearings", f"stated, or {' and '.join(pair)}")
        if self.period is not None and secant:
            allowed = f"absent where {secant[0]} is stated"
            raise invalid("period", self.period, "bearings", allowed)
        return IsolatedDeck.lead_rubber(**values)


class IsolatedEntry(IsolatorsTable):
    """Isolators under the deck: lead-rubber bearings, or friction pendulums."""

    def made(self) -> IsolatedDeck:
        """Return the deck on its isolators."""
        return self.isolated()


class IsolatedStructure(StructureTable, IsolatorsTable):
    """A ``[[structure]]`` that is a deck on isolators and rigid piers."""

    kind: Literal["isolated"] = "isolated"
    """Kind of the structure."""
    mass_ratio: Annotated[float | None, _for_example(4.0)] = None
    """Mass of the deck over that of the piers; by default the base shear is that of the deck."""
    abutment: Abutment | None = None
    """Gap at the ends of the deck."""

    def made(self) -> IsolatedDeck:
        """Return the deck on its isolators."""
        ratio = math.inf if self.mass_ratio is None else self.mass_ratio
        deck = self.isolated()
        return replace(deck, name=self.name, mass_ratio=ratio, abutment=self.abutment)


class MonolithicTable(TableEntry):
    """Columns that are monolithic with ground and deck."""

    modulus: Annotated[float, _key("modulus_pa", 30.0e9)]
    """Young's modulus of the columns [Pa]."""
    cracked_stiffness_ratio: float = 1.0
    """Stiffness of the cracked section over that of the uncracked section."""
    damping_ratio: float = 0.05
    """Viscous damping, as a fraction of critical damping."""
    strength_ratio: Annotated[float | None, _for_example(0.2)] = None
    """Force at first yield over the weight of the deck and of 13/35 of the columns; by default the
    columns do not yield."""
    moment_capacity: Annotated[float | None, _key("moment_capacity_nm", 4.0e6)] = None
    """Moment at which both ends of a column yield [N m]; replaces strength_ratio."""
    post_yield_ratio: float = 0.0
    """Ratio of the stiffness after yielding to the elastic stiffness (hardening)."""
    p_delta: bool = True
    """Include P-delta: the moment of the weight of the deck and half the columns on the drift."""
    limit_ductility: float = LIMIT_DUCTILITY
    """Largest drift over the yield drift for which the model is valid; by default that of Caltrans,
    Seismic Design Criteria 1.7, section 2.2.4, for bents of several columns."""

    def of_columns(self, **size: Any) -> FixedFrame:
        """Return the frame of one column of a size: see `FixedFrame.from_columns`."""
        fields = MonolithicTable.model_fields
        values = {name: value for name, value in self if name in fields and value is not None}
        moment = values.pop("moment_capacity", None)
        if moment is not None:
            if self.strength_ratio is not None:
                ratio = f"absent where strength_ratio {self.strength_ratio:g} is stated"
                raise invalid("moment_capacity", moment, "columns", ratio)
            if not moment > 0.0:
                raise invalid("moment_capacity", moment, "columns", "positive")
            moving = (size["deck_mass"] + COLUMN_SHARE * size["column_mass"]) * GRAVITY
            values["strength_ratio"] = 2.0 * moment / (size["height"] * moving)
        return FixedFrame.from_columns(columns=1, **values | size)


class FixedEntry(MonolithicTable):
    """Columns that are monolithic with ground and deck."""

    def made(self) -> FixedFrame:
        """Return a frame with these columns; its dimensions are 1 m, and it has no P-delta."""
        return self.of_columns(height=1.0, width=1.0, column_mass=0.0, deck_mass=1.0, p_delta=False)


class FixedStructure(StructureTable, MonolithicTable):
    """A ``[[structure]]`` whose columns are fixed to the ground and to the deck."""

    kind: Literal["fixed"] = "fixed"
    """Kind of the structure."""
    height_m: float
    """Clear height of a column [m]."""
    width_m: float
    """Width of a column along the motion [m]; of a circular one, its diameter."""
    section: Literal["rectangular", "circular"] = "rectangular"
    """Section of the columns."""
    depth_m: Annotated[float | None, _for_example(1.6)] = None
    """Depth of rectangular columns across the motion [m]."""
    mass_ratio: float
    """Mass of the deck over that of all columns."""
    column_mass_kg: Annotated[float | None, _for_example(61440.0)] = None
    """Mass of a column [kg], or its density."""
    density_kg_m3: Annotated[float | None, _for_example(2500.0)] = None
    """Density of the columns [kg/m3]."""
    abutment: Abutment | None = None
    """Gap at the ends of the deck."""

    def made(self) -> FixedFrame:
        """Return the frame of columns that are solid and prismatic."""
        circular, whole = self.section == "circular", f"frame {self.name!r}"
        if circular and self.depth_m is not None:
            raise invalid("depth", self.depth_m, whole, "absent where the section is circular")
        if not circular and self.depth_m is None:
            raise invalid("depth", None, whole, "stated for rectangular columns")
        if (self.column_mass_kg is None) == (self.density_kg_m3 is None):
            must = "stated, or density_kg_m3, and not both"
            raise invalid("column_mass", self.column_mass_kg, whole, must)
        mass = self.column_mass_kg
        if self.density_kg_m3 is not None:
            size = (self.height_m, self.width_m)
            mass = self.density_kg_m3 * volume(self.section, *size, depth=self.depth_m)
        if mass is None or not 0.0 < mass < math.inf:
            raise invalid("density", self.density_kg_m3, whole, "positive and finite")
        columns = self.of_columns(
            height=self.height_m,
            width=self.width_m,
            depth=self.depth_m,
            column_mass=mass,
            deck_mass=self.mass_ratio * mass,
        )
        return replace(columns, name=self.name, abutment=self.abutment)


Rival = Literal["restrained", "hybrid", "isolated", "fixed"]


class CompareEntry(Options):
    """The rivals of each structure, in addition to those that a structure states itself."""

    against: Annotated[tuple[Rival, ...] | None, Field(examples=[["isolated"]], strict=False)] = (
        None
    )
    """Rivals to compute; by default all that are stated."""
    restrained: Tendon | None = None
    """Tendons of structures that state none."""
    hybrid: Dissipater | None = None
    """Dissipaters of structures that state none, in addition to their tendons."""
    isolated: IsolatedEntry | None = None
    """Isolators of structures that state none."""
    fixed: FixedEntry | None = None
    """Monolithic columns of structures that state none."""
    ensemble: BridgeEnsemble = BridgeEnsemble()
    """Plausible bridges whose responses give shares and bands."""


class _StructuresFile(Options):
    structure: Annotated[tuple[AnyStructure, ...], Field(min_length=1, strict=False)]
    compare: CompareEntry = CompareEntry()


def read_structures(path: str | Path = SHIPPED_STRUCTURES) -> list[Any]:
    """Read the structures of a TOML file.

    Parameters
    ----------
    path : str or Path
        File of ``[[structure]]`` tables; by default the bundled structures.

    Returns
    -------
    list of RockingFrame, IsolatedDeck, FixedFrame or another kind
        In the order of the file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or an invalid value, states a name
        twice, or describes a structure that is impossible.

    Examples
    --------
    >>> [frame.name for frame in read_structures()][:2]
    ['bridge-bent', 'apollo-column']
    """
    path = Path(path)
    text = read_text(path)
    return build_structures(path, text, parse(path, text, _StructuresFile).structure)


def read_bridges(path: Path) -> tuple[tuple[StructureTable, ...], CompareEntry]:
    """Read the structure entries of a TOML file, and the alternative systems to compare with.

    Raises
    ------
    InputError
        Under the same conditions as in `read_structures`.
    """
    text = read_text(path)
    content = parse(path, text, _StructuresFile)
    build_structures(path, text, content.structure)  # rejects a name stated twice
    return content.structure, content.compare


def build_structures(path: Path, text: str, entries: Sequence[StructureTable]) -> list[Structure]:
    """Return the structures that the ``[[structure]]`` tables of a file describe.

    An unusual structure raises a warning, such as a rocking frame that is a kilometre high.

    Raises
    ------
    InputError
        If a name is stated twice.
    """
    structures: dict[str, Structure] = {}
    for i, entry in enumerate(entries):
        if entry.name in structures:  # not earlier: finding the line reads the whole text
            line = line_of(text, ("structure", i, "name"))
            raise InputError(path, f"name {entry.name!r} is stated twice.", line)
        structures[entry.name] = entry.made()
        if words := entry.unusual():
            at = line_of(text, ("structure", i))
            warning = f"{path}:{at}: structure {entry.name!r}: {words}. Check units and values."
            warnings.warn(warning, RockframeWarning, stacklevel=3)
    return list(structures.values())
