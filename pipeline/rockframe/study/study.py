"""A study: one TOML file that says all of a run."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rockframe.errors import InputError
from rockframe.study.sections import (
    BatchesTable,
    FiguresTable,
    Filters,
    RecordsTable,
    ReportTable,
)
from rockframe.study.stage_tables import (
    PulseTable,
    RespondTable,
    RockingSpectrumTable,
    ScreenTable,
    SpectrumTable,
)
from rockframe.study.structures import (
    SHIPPED_STRUCTURES,
    StructureEntry,
    bundled_records,
    frames_of,
    read_structures,
)
from rockframe.study.toml import Name, Strict, line_of, parse, read_text


class StudyTables(Strict):
    """A study file as it stands: strict, so that what is misspelt is said and not ignored."""

    name: Name
    """What the study is called: letters and digits of any script, points, hyphens, underscores."""
    structures: str | None = None
    """TOML file of [[structure]] tables, relative to this file; without it and without
    [[structure]] tables here, the shipped structures."""
    records: RecordsTable | None = None
    filters: Filters = Filters()
    pulse: PulseTable = PulseTable()
    respond: RespondTable = RespondTable()
    screen: ScreenTable | None = None
    spectrum: SpectrumTable | None = None
    rocking_spectrum: RockingSpectrumTable | None = None
    figures: FiguresTable = FiguresTable()
    report: ReportTable = ReportTable()
    batches: BatchesTable = BatchesTable()
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
        return self.beside(stated) if stated else SHIPPED_STRUCTURES

    def beside(self, stated: str) -> Path:
        """Return the absolute path that the file states relative to itself."""
        path = self.path.parent / stated
        # a link keeps its name: lists do not depend on where it leads
        return path.resolve() if path.name == ".." else path.parent.resolve() / path.name

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
    named: list[tuple[tuple[str | int, ...], str]] = []
    if study.tables.structures is not None:
        named.append((("structures",), study.tables.structures))
    table, screen = study.tables.records, study.tables.screen
    if screen is not None and screen.hazard is not None:
        named.append((("screen", "hazard"), screen.hazard))
    if table is not None:
        named += [(("records", "paths"), path) for path in table.paths or ()]
        for key in ("station_xml", "catalogue", "limits"):
            stated = getattr(table, key)
            named += [(("records", key), stated)] if stated is not None else []
    for where, stated in named:
        if not study.beside(stated).exists():
            key = ".".join(map(str, where))
            message = f"{key} {stated!r}: no such file or folder. Must exist, beside the study."
            raise InputError(study.path, message, line_of(text, where))


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
