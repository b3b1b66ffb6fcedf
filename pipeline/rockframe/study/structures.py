"""Files of structures, and the bundled structures and records."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from rockframe.column import ColumnShape, hollow, inertia_ratio_of, tapered, volume
from rockframe.crushing import crushed
from rockframe.errors import InputError, RockframeWarning, invalid
from rockframe.frame import RockingFrame, unusual
from rockframe.options.fields import Name
from rockframe.options.model import Options
from rockframe.restraint import Abutment, Dissipater, Pivot, Tendon
from rockframe.rivals import COLUMN_SHARE, FixedFrame, IsolatedDeck
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


class Entry(Options):
    """A table whose values are checked by what they describe."""

    @model_validator(mode="after")
    def _checked(self) -> Self:
        self.made()
        return self

    def made(self) -> Any:
        """Return what the table describes."""
        raise NotImplementedError


class TendonEntry(Entry):
    """A tendon through the axis of each column, from the foundation to the beam."""

    area_m2: Annotated[float, _for_example(1.0e-3)]
    """Cross-section [m2]."""
    modulus_pa: Annotated[float, _for_example(195.0e9)]
    """Young's modulus [Pa]."""
    length_m: Annotated[float | None, _for_example(9.6)] = None
    """Free length [m]; by default the height of the column."""
    prestress_n: float = 0.0
    """Force at rest [N]."""
    yield_stress_pa: Annotated[float | None, _for_example(1.6e9)] = None
    """Stress at which it yields [Pa]; by default it never does."""
    loses_prestress: bool = False
    """Let it flow when it yields, and lose prestress; otherwise only the time is reported."""

    def made(self, height: float = 1.0) -> Tendon:
        """Return the tendon; by default as long as the column is high."""
        return Tendon(
            area=self.area_m2,
            modulus=self.modulus_pa,
            length=height if self.length_m is None else self.length_m,
            prestress=self.prestress_n,
            yield_stress=math.inf if self.yield_stress_pa is None else self.yield_stress_pa,
            loses_prestress=self.loses_prestress,
        )


class DissipaterEntry(Entry):
    """What yields across each joint of a column."""

    stiffness_n_m: Annotated[float, _for_example(5.0e7)]
    """Of all bars across one joint [N/m]."""
    yield_force_n: Annotated[float, _for_example(1.0e5)]
    """Of all bars across one joint [N]."""
    lever_arm_m: Annotated[float, _for_example(0.8)]
    """From the pivot to the bars [m]."""

    def made(self) -> Dissipater:
        """Return the dissipater."""
        return Dissipater(
            stiffness=self.stiffness_n_m,
            yield_force=self.yield_force_n,
            lever_arm=self.lever_arm_m,
        )


class IsolatedEntry(Entry):
    """Isolators under the deck: lead-rubber bearings, or friction pendulums."""

    strength_ratio: Annotated[float | None, _for_example(0.05)] = None
    """Characteristic strength of lead-rubber bearings over the weight of the deck."""
    period_s: Annotated[float | None, _for_example(3.0)] = None
    """Period on their stiffness after yielding [s]."""
    effective_period_s: Annotated[float | None, _for_example(2.5)] = None
    """Instead of it, the period of the secant stiffness at the design displacement [s]."""
    design_displacement_m: Annotated[float | None, _for_example(0.25)] = None
    """That displacement [m]."""
    yield_displacement_m: float = 0.01
    """Displacement at which they yield [m]."""
    radius_m: Annotated[float | None, _for_example(2.5)] = None
    """Radius of friction pendulums [m]."""
    friction: Annotated[float | None, _for_example(0.05)] = None
    """Their coefficient of friction."""
    damping_ratio: float = 0.0
    """Viscous damping over the critical one."""

    def made(self) -> IsolatedDeck:
        """Return the deck on its isolators."""
        if self.radius_m is not None or self.friction is not None:
            for key in ("strength_ratio", "period_s", "effective_period_s"):
                if getattr(self, key) is not None:
                    raise invalid(key, getattr(self, key), "isolators", "absent beside a pendulum")
            for key in ("radius_m", "friction"):
                if getattr(self, key) is None:
                    raise invalid(key, None, "friction pendulums", "stated with the other")
            return IsolatedDeck.friction_pendulum(
                radius=self.radius_m,  # type: ignore[arg-type]
                friction=self.friction,  # type: ignore[arg-type]
                damping_ratio=self.damping_ratio,
            )
        if self.strength_ratio is None:
            pendulum = "stated, or radius_m and friction of a pendulum"
            raise invalid("strength_ratio", None, "lead-rubber bearings", pendulum)
        return IsolatedDeck.lead_rubber(
            strength_ratio=self.strength_ratio,
            period=self.period_s,
            effective_period=self.effective_period_s,
            design_displacement=self.design_displacement_m,
            yield_displacement=self.yield_displacement_m,
            damping_ratio=self.damping_ratio,
        )


class FixedEntry(Entry):
    """The columns, monolithic with ground and deck."""

    modulus_pa: Annotated[float, _for_example(30.0e9)]
    """Young's modulus of the columns [Pa]."""
    cracked_stiffness_ratio: float = 1.0
    """Stiffness of the cracked section over that of the whole one."""
    damping_ratio: float = 0.05
    """Viscous damping over the critical one."""
    strength_ratio: Annotated[float | None, _for_example(0.2)] = None
    """Force at first yield over the weight of the deck and of 13/35 of the columns; by default they
    do not yield."""
    moment_capacity_nm: Annotated[float | None, _for_example(4.0e6)] = None
    """Instead of it, the moment at which both ends of a column yield [N m]."""
    post_yield_ratio: float = 0.0
    """Stiffness after yielding over the elastic one."""

    def made(
        self,
        *,
        height: float = 1.0,
        width: float = 1.0,
        depth: float | None = None,
        column_mass: float = 0.0,
        deck_mass: float = 1.0,
    ) -> FixedFrame:
        """Return the frame of one column of these dimensions [m] and masses [kg]."""
        strength = math.inf if self.strength_ratio is None else self.strength_ratio
        if self.moment_capacity_nm is not None:
            if self.strength_ratio is not None:
                ratio = f"absent beside strength_ratio {self.strength_ratio:g}"
                raise invalid("moment_capacity", self.moment_capacity_nm, "columns", ratio)
            if not self.moment_capacity_nm > 0.0:
                raise invalid("moment_capacity", self.moment_capacity_nm, "columns", "positive")
            moving = (deck_mass + COLUMN_SHARE * column_mass) * GRAVITY
            strength = 2.0 * self.moment_capacity_nm / (height * moving)
        return FixedFrame.from_columns(
            columns=1,
            height=height,
            width=width,
            depth=depth,
            modulus=self.modulus_pa,
            column_mass=column_mass,
            deck_mass=deck_mass,
            cracked_stiffness_ratio=self.cracked_stiffness_ratio,
            damping_ratio=self.damping_ratio,
            strength_ratio=strength,
            post_yield_ratio=self.post_yield_ratio,
        )


class PivotEntry(Entry):
    """``[structure.pivot]``: the edges on which columns rock, and crush."""

    compressive_strength_pa: float
    depth_m: float

    def made(self) -> Pivot:
        """Return the pivot."""
        return Pivot(compressive_strength=self.compressive_strength_pa, depth=self.depth_m)


class AbutmentEntry(Entry):
    """``[structure.abutment]``: the joints at the ends of the deck."""

    gap_m: float
    uplift_allowance_m: float | None = None

    def made(self) -> Abutment:
        """Return the joint; without an allowance the deck may lift as it likes."""
        allowance = math.inf if self.uplift_allowance_m is None else self.uplift_allowance_m
        return Abutment(gap=self.gap_m, uplift_allowance=allowance)


class StructureEntry(Entry):
    """One ``[[structure]]`` of a file of structures.

    Parameters
    ----------
    name : str
        Name in tables: letters and digits of any script, points, hyphens, underscores.
    height_m, width_m : float
        Height and width of a column [m].
    mass_ratio : float
        Mass of the beam over that of all columns [1]; 0 is a column alone.
    section : str
        Section of the columns: rectangular or circular.
    top_width_m : float, optional
        Width at the top, on which the beam rests, of columns that taper linearly [m].
    inner_width_m : float, optional
        Inner width (diameter) of hollow columns [m].
    depth_m, inner_depth_m : float, optional
        Outer and inner depth, out of the plane of rocking, of hollow rectangular columns [m].
    inertia_ratio : float, optional
        I_o / (m_c R^2) of a column of another shape about its corner, above 1 and at most 100 [1],
        instead of the section.
    centre_of_gravity_m : float, optional
        Height of the centre of gravity of such a column above its base [m]; by default half the
        height.
    restitution_factor : float
        Factor on the restitution of eq (43) [1].
    beam_depth_m : float, optional
        Depth of the beam [m], for the least spacing of two columns.
    column_mass_kg, density_kg_m3 : float, optional
        Mass of one column [kg], or its density; restraints and pivots need one of them, and the
        density of rectangular columns the depth.
    tendon, dissipater, pivot, abutment : table, optional
        What restrains the frame.
    isolated, fixed : table, optional
        The same deck on isolators, and on monolithic columns, to compare with.
    """

    name: Name
    height_m: float
    width_m: float
    mass_ratio: float = 0.0
    section: Literal["rectangular", "circular"] | None = None
    top_width_m: float | None = None
    inner_width_m: float | None = None
    depth_m: float | None = None
    inner_depth_m: float | None = None
    inertia_ratio: float | None = None
    centre_of_gravity_m: float | None = None
    restitution_factor: float = 1.0
    beam_depth_m: float | None = None
    column_mass_kg: float | None = None
    density_kg_m3: float | None = None
    tendon: TendonEntry | None = None
    dissipater: DissipaterEntry | None = None
    pivot: PivotEntry | None = None
    abutment: AbutmentEntry | None = None
    isolated: IsolatedEntry | None = None
    fixed: FixedEntry | None = None

    def made(self) -> RockingFrame:
        """Return the frame that the entry describes, on the pivots that are left to it.

        Raises
        ------
        ParameterError
            If it does not rock, or keys are stated that exclude each other.
        """
        return self.on_pivots(self.whole())

    def whole(self) -> RockingFrame:
        """Return the frame before its edges crush."""
        self._refuse_contradictions()
        shape = self._shape()
        stated = self.top_width_m is not None or self.centre_of_gravity_m is not None
        return RockingFrame(
            height=self.height_m,
            width=self.width_m,
            mass_ratio=self.mass_ratio,
            name=self.name,
            inertia_ratio=shape.inertia_ratio,
            restitution_factor=self.restitution_factor,
            top_width=self.top_width_m,
            centre_of_gravity=shape.centre_of_gravity if stated else None,
            beam_depth=self.beam_depth_m,
            column_mass=self._mass(),
            tendon=None if self.tendon is None else self.tendon.made(self.height_m),
            dissipater=None if self.dissipater is None else self.dissipater.made(),
            abutment=None if self.abutment is None else self.abutment.made(),
        )

    def on_pivots(self, frame: RockingFrame) -> RockingFrame:
        """Return a frame on pivots that crush, if the entry states them."""
        return frame if self.pivot is None else crushed(frame, self.pivot.made())

    def _mass(self) -> float | None:
        """The mass of a column, stated or from its density [kg]."""
        if self.density_kg_m3 is None:
            return self.column_mass_kg
        if not 0.0 < self.density_kg_m3 < math.inf:
            raise invalid("density", self.density_kg_m3, f"frame {self.name!r}", "positive")
        return self.density_kg_m3 * volume(
            self.section or "rectangular",
            *(self.height_m, self.width_m),
            top_width=self.top_width_m,
            inner_width=self.inner_width_m,
            depth=self.depth_m,
            inner_depth=self.inner_depth_m,
        )

    def _shape(self) -> ColumnShape:
        section = self.section or "rectangular"
        size = (self.height_m, self.width_m)
        if self.inertia_ratio is not None:
            centre = self.centre_of_gravity_m
            return ColumnShape(self.inertia_ratio, 0.5 * size[0] if centre is None else centre)
        if self.top_width_m is not None:
            return tapered(section, *size, self.top_width_m)
        if self.inner_width_m is not None:
            return hollow(section, *size, self.inner_width_m, self.depth_m, self.inner_depth_m)
        return ColumnShape(inertia_ratio_of(section, *size), 0.5 * size[0])

    def _refuse_contradictions(self) -> None:
        """Refuse keys that exclude each other, or need one that is missing."""
        excluded = {
            "inertia_ratio": ("section", "inner_width_m", "depth_m", "inner_depth_m"),
            "top_width_m": ("inner_width_m", "inner_depth_m"),
            "density_kg_m3": ("column_mass_kg", "inertia_ratio"),
        }
        needed = {
            "centre_of_gravity_m": "inertia_ratio",
            "inner_depth_m": "inner_width_m",
        }
        if self.density_kg_m3 is None and self.column_mass_kg is None:
            needed["depth_m"] = "inner_width_m"
        if self.inertia_ratio is not None and self.top_width_m is not None:
            needed["inertia_ratio"] = "centre_of_gravity_m"
        for key, others in excluded.items():
            for other in others:
                if None not in (getattr(self, key), getattr(self, other)):
                    beside = f"absent beside {other} {getattr(self, other)!r}"
                    raise invalid(key, getattr(self, key), f"frame {self.name!r}", beside)
        for key, other in needed.items():
            if getattr(self, key) is not None and getattr(self, other) is None:
                beside = f"stated with {other}"
                raise invalid(key, getattr(self, key), f"frame {self.name!r}", beside)


Rival = Literal["restrained", "hybrid", "isolated", "fixed"]


class CompareEntry(Options):
    """The rivals of each structure, beside those that a structure states itself."""

    against: Annotated[tuple[Rival, ...] | None, Field(examples=[["isolated"]], strict=False)] = (
        None
    )
    """Rivals to compute; by default all that are stated."""
    restrained: TendonEntry | None = None
    """Tendons of structures that state none."""
    hybrid: DissipaterEntry | None = None
    """Dissipaters of structures that state none, beside their tendons."""
    isolated: IsolatedEntry | None = None
    """Isolators of structures that state none."""
    fixed: FixedEntry | None = None
    """Monolithic columns of structures that state none."""


class _StructuresFile(Options):
    structure: Annotated[tuple[StructureEntry, ...], Field(min_length=1, strict=False)]
    compare: CompareEntry = CompareEntry()


def read_structures(path: Path = SHIPPED_STRUCTURES) -> list[RockingFrame]:
    """Read the structures of a TOML file.

    Parameters
    ----------
    path : Path
        File of ``[[structure]]`` tables; by default the bundled structures.

    Returns
    -------
    list of RockingFrame
        In the order of the file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or an invalid value, states a name
        twice, or describes a structure that does not rock.

    Examples
    --------
    >>> [frame.name for frame in read_structures()][:2]
    ['bridge-bent', 'apollo-column']
    """
    text = read_text(path)
    return frames_of(path, text, parse(path, text, _StructuresFile).structure)


def read_bridges(path: Path) -> tuple[tuple[StructureEntry, ...], CompareEntry]:
    """Read the structures of a TOML file as they are stated, and their rivals.

    Raises
    ------
    InputError
        As `read_structures` says.
    """
    text = read_text(path)
    content = parse(path, text, _StructuresFile)
    frames_of(path, text, content.structure)  # refuses a name stated twice
    return content.structure, content.compare


def frames_of(path: Path, text: str, entries: Sequence[StructureEntry]) -> list[RockingFrame]:
    """Return the frames that the ``[[structure]]`` tables of a file describe.

    An unusual slenderness or mass ratio warns.

    Raises
    ------
    InputError
        If a name is stated twice.
    """
    frames: dict[str, RockingFrame] = {}
    for i, entry in enumerate(entries):
        if entry.name in frames:  # only now, because finding the line reads the whole text
            line = line_of(text, ("structure", i, "name"))
            raise InputError(path, f"name {entry.name!r}. Must not be stated twice.", line)
        frame = frames[entry.name] = entry.made()
        if words := unusual(frame.mass_ratio, frame.slenderness):
            at = line_of(text, ("structure", i))
            warning = f"{path}:{at}: structure {entry.name!r}: {words}. Check units and values."
            warnings.warn(warning, RockframeWarning, stacklevel=3)
    return list(frames.values())
