"""Files of structures, and the bundled structures and records."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from rockframe.column import ColumnShape, hollow, inertia_ratio_of, tapered, volume
from rockframe.crushing import crushed
from rockframe.errors import InputError, RockframeWarning, invalid
from rockframe.frame import RockingFrame, unusual
from rockframe.options.fields import Name
from rockframe.options.model import Options
from rockframe.study import restraints
from rockframe.study.toml import line_of, parse, read_text

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


class StructureEntry(restraints.TableEntry):
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
        Restraints of the frame.
    isolated, fixed : table, optional
        Rivals for comparison: the same deck on isolators, and on monolithic columns.
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
    tendon: restraints.TendonEntry | None = None
    dissipater: restraints.DissipaterEntry | None = None
    pivot: restraints.PivotEntry | None = None
    abutment: restraints.AbutmentEntry | None = None
    isolated: restraints.IsolatedEntry | None = None
    fixed: restraints.FixedEntry | None = None

    def made(self) -> RockingFrame:
        """Return the frame that the entry describes; its edges crush if the entry states a pivot.

        Raises
        ------
        ParameterError
            If the frame does not rock, or if keys exclude each other.
        """
        return self.on_pivots(self.whole())

    def whole(self) -> RockingFrame:
        """Return the frame with intact edges."""
        self._reject_contradictions()
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
        """Return the frame with crushed edges, if the entry states a pivot."""
        return frame if self.pivot is None else crushed(frame, self.pivot.made())

    def _mass(self) -> float | None:
        """Return the mass of a column, stated or from its density [kg]."""
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

    def _reject_contradictions(self) -> None:
        """Reject keys that exclude each other, and keys that need a missing key."""
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
                    allowed = f"absent where {other} {getattr(self, other)!r} is stated"
                    raise invalid(key, getattr(self, key), f"frame {self.name!r}", allowed)
        for key, other in needed.items():
            if getattr(self, key) is not None and getattr(self, other) is None:
                allowed = f"stated with {other}"
                raise invalid(key, getattr(self, key), f"frame {self.name!r}", allowed)


Rival = Literal["restrained", "hybrid", "isolated", "fixed"]


class CompareEntry(Options):
    """The rivals of each structure, in addition to those that a structure states itself."""

    against: Annotated[tuple[Rival, ...] | None, Field(examples=[["isolated"]], strict=False)] = (
        None
    )
    """Rivals to compute; by default all that are stated."""
    restrained: restraints.TendonEntry | None = None
    """Tendons of structures that state none."""
    hybrid: restraints.DissipaterEntry | None = None
    """Dissipaters of structures that state none, in addition to their tendons."""
    isolated: restraints.IsolatedEntry | None = None
    """Isolators of structures that state none."""
    fixed: restraints.FixedEntry | None = None
    """Monolithic columns of structures that state none."""


class _StructuresFile(Options):
    structure: Annotated[tuple[StructureEntry, ...], Field(min_length=1, strict=False)]
    compare: CompareEntry = CompareEntry()


def read_structures(path: str | Path = SHIPPED_STRUCTURES) -> list[RockingFrame]:
    """Read the structures of a TOML file.

    Parameters
    ----------
    path : str or Path
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
    path = Path(path)
    text = read_text(path)
    return frames_of(path, text, parse(path, text, _StructuresFile).structure)


def read_bridges(path: Path) -> tuple[tuple[StructureEntry, ...], CompareEntry]:
    """Read the structure entries of a TOML file, and the alternative systems to compare with.

    Raises
    ------
    InputError
        Under the same conditions as in `read_structures`.
    """
    text = read_text(path)
    content = parse(path, text, _StructuresFile)
    frames_of(path, text, content.structure)  # rejects a name stated twice
    return content.structure, content.compare


def frames_of(path: Path, text: str, entries: Sequence[StructureEntry]) -> list[RockingFrame]:
    """Return the frames that the ``[[structure]]`` tables of a file describe.

    An unusual height, slenderness or mass ratio raises a warning.

    Raises
    ------
    InputError
        If a name is stated twice.
    """
    frames: dict[str, RockingFrame] = {}
    for i, entry in enumerate(entries):
        if entry.name in frames:  # not earlier: finding the line reads the whole text
            line = line_of(text, ("structure", i, "name"))
            raise InputError(path, f"name {entry.name!r}. Must not be stated twice.", line)
        frame = frames[entry.name] = entry.made()
        if words := unusual(frame.height, frame.mass_ratio, frame.slenderness):
            at = line_of(text, ("structure", i))
            warning = f"{path}:{at}: structure {entry.name!r}: {words}. Check units and values."
            warnings.warn(warning, RockframeWarning, stacklevel=3)
    return list(frames.values())
