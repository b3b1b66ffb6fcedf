"""Read study files, and write a commented study and the JSON schema."""

from __future__ import annotations

import json
import math
import os
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from pydantic import Field, create_model
from pydantic_core import PydanticUndefined

from rockframe.errors import InputError
from rockframe.options import STAGES, loaded
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.model import (
    BatchOptions,
    FigureOptions,
    File,
    Name,
    Options,
    ReportOptions,
    Texts,
    description,
    option_fields,
    options_within,
)
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions
from rockframe.study.structures import (
    SHIPPED_STRUCTURES,
    AnyStructure,
    build_structures,
    bundled_records,
    read_structures,
)
from rockframe.study.toml import line_of, parse, read_text

#: Folder of the shipped studies.
SHIPPED_STUDIES: Final = SHIPPED_STRUCTURES.parent / "studies"


class RecordsTable(IngestOptions):
    """Record files, and options of reading and processing them."""

    paths: Annotated[Texts | None, Field(examples=[("motions",)])] = None
    """Record files and folders, relative to this file; by default the bundled records."""


class RespondTable(RespondOptions):
    """The response of each structure to each record."""

    pulses: bool = False
    """Add the response to the selected pulse alone, without the rest of the record."""


class _FirstTables(Options):
    """Tables of every study, before those of the stages that it requests."""

    name: Name
    """Name of the study: letters and digits of any script, points, hyphens, underscores."""
    structures: Annotated[File | None, Field(examples=["structures.toml"])] = None
    """TOML file of [[structure]] tables, relative to this file; without it and without
    [[structure]] tables here, the shipped structures."""
    records: RecordsTable | None = None
    filters: Filters = Filters()
    pulse: PulseOptions = PulseOptions()
    respond: RespondTable = RespondTable()


#: Stages that run only if the study has their table.
REQUESTED: Final = tuple(stage for stage in STAGES.values() if stage.requested)

if TYPE_CHECKING:

    class _WithRequested(_FirstTables):
        def __getattr__(self, name: str) -> Any: ...

else:
    _WithRequested = create_model(
        "_WithRequested",
        __base__=_FirstTables,
        **{stage.name: (loaded(stage.options) | None, None) for stage in REQUESTED},
    )


class StudyTables(_WithRequested):
    """Contents of a study file."""

    figures: FigureOptions = FigureOptions()
    report: ReportOptions = ReportOptions()
    batches: BatchOptions = BatchOptions()
    structure: Annotated[tuple[AnyStructure, ...], Field(strict=False)] = ()
    """A structure of this study."""


@dataclass(frozen=True)
class Study:
    """A study file with its paths resolved.

    Parameters
    ----------
    path : Path
        The file, absolute.
    tables : StudyTables
        Its contents.
    home : Path, optional
        Folder to which paths are relative, if a command changed the contents of the file (default:
        the folder of the file).
    """

    path: Path
    tables: StudyTables
    home: Path | None = None

    @property
    def name(self) -> str:
        """Name of the study."""
        return self.tables.name

    @property
    def records(self) -> tuple[Path, ...]:
        """Files and folders of records; empty for a study without records."""
        table = self.tables.records
        if table is None:
            return ()
        return tuple(map(self.resolved, table.paths)) if table.paths else (bundled_records(),)

    @property
    def structures(self) -> Path:
        """File with the ``[[structure]]`` tables: the study file itself, or another one."""
        if self.tables.structure:
            return self.path
        given = self.tables.structures
        return self.resolved(given) if given is not None else SHIPPED_STRUCTURES

    def resolved(self, file: str | Path) -> Path:
        """Return the absolute path of a path stated relative to the study file, or to `home`."""
        path = (self.home or self.path.parent) / file
        # the last part is not resolved: a symbolic link is listed under its own name
        return path.resolve() if path.name == ".." else path.parent.resolve() / path.name

    def files(self) -> dict[tuple[str, ...], Path]:
        """Return the absolute paths of all stated files except records, by table and key."""
        named: dict[tuple[str, ...], Path] = {
            (key,): path for key, path in self.tables.files().items()
        }
        for table, options in self.tables:
            if isinstance(options, Options):
                named |= {(table, key): path for key, path in options.files().items()}
        return {where: self.resolved(path) for where, path in named.items()}

    def options(self, table: str) -> Any:
        """Return the options of a table with absolute paths; None without the table."""
        options = getattr(self.tables, table)
        files_here = {where[-1]: path for where, path in self.files().items() if where[0] == table}
        return options.replaced(**files_here) if files_here else options

    def parameters(self) -> dict[str, Any]:
        """Return all values of the study, with defaults filled in, as JSON values."""
        return dict(json.loads(self.tables.model_dump_json()))


def read_study(path: Path) -> Study:
    r"""Read a study file.

    Parameters
    ----------
    path : Path
        The TOML file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or an invalid value, or names a
        file that does not exist.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "mine.toml")
    ...     _ = path.write_text('name = "mine"\n[records]\n')
    ...     read_study(path).records[0].name
    'ridgecrest2019'
    """
    text = read_text(path)
    tables = parse(path, text, StudyTables)
    study = Study(path.resolve(), tables)
    if tables.structure:
        if tables.structures is not None:
            message = "structures and [[structure]] tables both stated. State only one of them."
            raise InputError(path, message, line_of(text, ("structures",)))
        build_structures(path, text, tables.structure)
    _require_records(study, text)
    _require_files(study, text)
    if not tables.structure:
        read_structures(study.structures)
    return study


def shipped_study(name: str) -> Study:
    """Return a shipped study, which a command of its name computes.

    Paths that the command adds to it are relative to the current folder.

    Examples
    --------
    >>> shipped_study("paper").tables.respond.structure
    'bridge-bent'
    """
    path = SHIPPED_STUDIES / f"{name}.toml"
    return Study(path, parse(path, read_text(path), StudyTables), home=Path.cwd())


def _require_records(study: Study, text: str) -> None:
    """Reject a study without any stage, and stages that need records if there are none."""
    tables = study.tables
    if tables.records is not None:
        return
    requested = [stage for stage in REQUESTED if study.options(stage.name) is not None]
    for stage in requested:
        if stage.of_records:
            message = f"[{stage.name}] without [records]. State the records in [records]."
            raise InputError(study.path, message, line_of(text, (stage.name,)))
    if not requested:
        alone = "".join(f" nor [{stage.name}]" for stage in REQUESTED if not stage.of_records)
        raise InputError(study.path, f"neither [records]{alone}. State one of them.")


def _require_files(study: Study, text: str) -> None:
    """Reject paths that do not exist, before anything runs."""
    table = study.tables.records
    named = dict(study.files())
    for file in (table.paths or ()) if table is not None else ():
        named[("records", "paths", file)] = study.resolved(file)
    for where, path in named.items():
        if not path.exists():
            key, name = ".".join(where[:2]), os.path.relpath(path, study.path.parent)
            message = f"{key} {name!r}: no such file or folder beside the study."
            raise InputError(study.path, message, line_of(text, where[:2]))


def structures_text(study: Study) -> str:
    """Return the ``[[structure]]`` tables of a study as the text of a separate file.

    A study without structures of its own has the bundled structures.
    """
    if not study.tables.structure:
        return read_text(study.structures)
    lines = []
    for entry in study.tables.structure:
        lines.append("[[structure]]")
        fields = entry.model_dump()
        tables = {key: fields.pop(key) for key in list(fields) if isinstance(fields[key], dict)}
        lines += _stated_keys(fields)
        for name, table in tables.items():
            lines += [f"[structure.{name}]", *_stated_keys(table)]
        lines.append("")
    return "\n".join(lines)


def _stated_keys(table: dict[str, Any]) -> list[str]:
    return [f"{key} = {json.dumps(value)}" for key, value in table.items() if value is not None]


#: File name of the schema, beside the studies that refer to it.
SCHEMA: Final = "study.schema.json"
_STRUCTURE: Final = """\
# Structures of this study; by default those that rockframe ships.
# [[structure]]
# name = "bridge-bent"
# height_m = 9.6     # of a column
# width_m = 1.6
# mass_ratio = 4.0   # mass of the beam over that of all columns; 0: a column alone
# In place of mass_ratio, with column_mass_kg or density_kg_m3: columns (their number) and
# beam_mass_kg, or beam_length_m, beam_width_m and beam_depth_m of a solid beam.
# Columns of other shapes: section, top_width_m, inner_width_m, depth_m, inner_depth_m,
# inertia_ratio, centre_of_gravity_m, beam_depth_m; section_both = "circular" for a motion in both
# directions, where the plane keeps a rectangle. Impacts with another restitution:
# restitution_factor. Forces in kN need column_mass_kg or density_kg_m3; friction_coefficient is
# subtracted from those of shear keys. Restraints need the mass too, and are tables of their own:
# structure.tendon and structure.dissipater with the keys of compare.restrained and compare.hybrid,
# structure.pivot with compressive_strength_pa and depth_m, structure.abutment with gap_m and
# uplift_allowance_m. The tables structure.isolated and structure.fixed state rivals of this
# structure alone.
"""


def commented_study(name: str) -> str:
    """Return the text of a study of the bundled records: every key with its meaning and default.

    Examples
    --------
    >>> commented_study("mine").splitlines()[2]
    'name = "mine"'
    """
    lines = [f"#:schema ./{SCHEMA}", "# A study: rockframe run FILE --output FOLDER", ""]
    lines[2:] = [f'name = "{name}"', "", *_keys(StudyTables, skip=("name",))]
    for key, field in StudyTables.model_fields.items():
        table = options_within(field.annotation)
        if table is None or key == "structure":
            continue
        keys = _keys(table)
        for inner, nested in option_fields(table).items():
            below = options_within(nested.annotation)
            if below is not None:
                keys += ["", *_comment(below.__doc__ or ""), f"[{key}.{inner}]", *_keys(below)]
        heading = [f"[{key}]", *keys]
        if field.default is None and key != "records":  # a stage that runs only if requested
            heading = [line if line[:1] in ("#", "") else f"# {line}" for line in heading]
        lines += ["", *_comment(table.__doc__ or ""), *heading]
    return "\n".join([*lines, "", _STRUCTURE])


def schema() -> str:
    """Return the JSON schema of study files, as text.

    Examples
    --------
    >>> json.loads(schema())["additionalProperties"]
    False
    """
    tables = StudyTables.model_json_schema()
    return json.dumps(tables, indent=2, sort_keys=True, allow_nan=False) + "\n"


def _keys(table: type, skip: tuple[str, ...] = ()) -> list[str]:
    lines: list[str] = []
    for key, field in option_fields(table).items():
        if key in skip or options_within(field.annotation) is not None:
            continue
        lines += _comment(description(table, key))
        if field.default in (None, PydanticUndefined, math.inf):
            lines.append(f"# {key} = {_toml((field.examples or [''])[0])}")
        else:
            lines.append(f"{key} = {_toml(field.default)}")
    return lines


def _comment(text: str) -> list[str]:
    first = " ".join(text.split("\n\n")[0].split())
    return [f"# {line}" for line in textwrap.wrap(first, 98)]


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)  # JSON is TOML for texts, numbers, and lists
