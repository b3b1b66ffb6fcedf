"""A study: one TOML file that says all of a run."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rockframe.errors import InputError
from rockframe.options import (
    BatchOptions,
    FigureOptions,
    Filters,
    IngestOptions,
    Options,
    PulseOptions,
    ReportOptions,
    RespondOptions,
    RockingSpectrumOptions,
    ScreenOptions,
    SpectrumOptions,
)
from rockframe.options.fields import File, Name, Texts
from rockframe.study.structures import (
    SHIPPED_STRUCTURES,
    StructureEntry,
    bundled_records,
    frames_of,
    read_structures,
)
from rockframe.study.toml import line_of, parse, read_text


class RecordsTable(IngestOptions):
    """Which record files are read, how, and what is done to each record."""

    paths: Annotated[Texts | None, Field(examples=[("motions",)])] = None
    """Record files and folders, relative to this file; by default the bundled records."""


class RespondTable(RespondOptions):
    """The response of each structure to each record."""

    pulses: bool = False
    """Add the response to the pulse of each record alone."""


class StudyTables(Options):
    """The content of a study file."""

    name: Name
    """Name of the study: letters and digits of any script, points, hyphens, underscores."""
    structures: Annotated[File | None, Field(examples=["structures.toml"])] = None
    """TOML file of [[structure]] tables, relative to this file; without it and without
    [[structure]] tables here, the shipped structures."""
    records: RecordsTable | None = None
    filters: Filters = Filters()
    pulse: PulseOptions = PulseOptions()
    respond: RespondTable = RespondTable()
    screen: ScreenOptions | None = None
    spectrum: SpectrumOptions | None = None
    rocking_spectrum: RockingSpectrumOptions | None = None
    figures: FigureOptions = FigureOptions()
    report: ReportOptions = ReportOptions()
    batches: BatchOptions = BatchOptions()
    structure: Annotated[tuple[StructureEntry, ...], Field(strict=False)] = ()
    """A structure of this study."""


@dataclass(frozen=True)
class Study:
    """What a study file says, with its paths where they are.

    Parameters
    ----------
    path : Path
        The file, absolute.
    tables : StudyTables
        What it says.
    """

    path: Path
    tables: StudyTables

    @property
    def name(self) -> str:
        """What the study is called."""
        return self.tables.name

    @property
    def records(self) -> tuple[Path, ...]:
        """Files and folders of records; none of a study without them."""
        table = self.tables.records
        if table is None:
            return ()
        return tuple(map(self.beside, table.paths)) if table.paths else (bundled_records(),)

    @property
    def structures(self) -> Path:
        """The file that holds the ``[[structure]]`` tables: this one, or another."""
        if self.tables.structure:
            return self.path
        stated = self.tables.structures
        return self.beside(stated) if stated is not None else SHIPPED_STRUCTURES

    def beside(self, stated: str | Path) -> Path:
        """Return the absolute path that the file states relative to itself."""
        path = self.path.parent / stated
        # a link keeps its name: lists do not depend on where it leads
        return path.resolve() if path.name == ".." else path.parent.resolve() / path.name

    def files(self) -> dict[tuple[str, ...], Path]:
        """Return the files that the study states besides records, by table and key; absolute."""
        stated: dict[tuple[str, ...], Path] = {
            (key,): path for key, path in self.tables.files().items()
        }
        for table, options in self.tables:
            if isinstance(options, Options):
                stated |= {(table, key): path for key, path in options.files().items()}
        return {where: self.beside(path) for where, path in stated.items()}

    def options(self, table: str) -> Any:
        """Return the options of a table with its files where they are."""
        options = getattr(self.tables, table)
        found = {where[-1]: path for where, path in self.files().items() if where[0] == table}
        return options.replaced(**found)

    def parameters(self) -> dict[str, Any]:
        """Return all that the file says, with the defaults of what it does not, as JSON has it."""
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
        If the file is missing, is not TOML, has an unknown key or a wrong value, or names a file
        that does not exist.

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
            message = "structures stated beside [[structure]] tables. Must be one of them."
            raise InputError(path, message, line_of(text, ("structures",)))
        frames_of(path, text, tables.structure)
    _require_records(study, text)
    _require_files(study, text)
    if not tables.structure:
        read_structures(study.structures)
    return study


def _require_records(study: Study, text: str) -> None:
    """Refuse stages that have nothing to work on, and a study that does nothing."""
    tables = study.tables
    if tables.records is not None:
        return
    for name in ("screen", "rocking_spectrum"):
        if getattr(tables, name) is not None:
            message = f"[{name}] without [records]. Must have records."
            raise InputError(study.path, message, line_of(text, (name,)))
    if tables.spectrum is None:
        raise InputError(study.path, "neither [records] nor [spectrum]. Must have one of them.")


def _require_files(study: Study, text: str) -> None:
    """Refuse what is stated and is not there, before anything runs."""
    table = study.tables.records
    named = dict(study.files())
    for stated in (table.paths or ()) if table is not None else ():
        named[("records", "paths", stated)] = study.beside(stated)
    for where, path in named.items():
        if not path.exists():
            key, name = ".".join(where[:2]), os.path.relpath(path, study.path.parent)
            message = f"{key} {name!r}: no such file or folder. Must exist, beside the study."
            raise InputError(study.path, message, line_of(text, where[:2]))


def structures_text(study: Study) -> str:
    """Return the ``[[structure]]`` tables of a study as a file of its own.

    Parameters
    ----------
    study : Study
        With tables of its own, a file of them, or none: then those that are shipped.
    """
    if not study.tables.structure:
        return read_text(study.structures)
    lines = []
    for entry in study.tables.structure:
        lines.append("[[structure]]")
        stated = entry.model_dump(exclude_none=True)
        lines += [f"{key} = {json.dumps(value)}" for key, value in stated.items()]
        lines.append("")
    return "\n".join(lines)
