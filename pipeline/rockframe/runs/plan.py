"""The plan of a run: its inputs with their hashes, and its steps."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from rockframe.cells import write_rows
from rockframe.errors import InputError
from rockframe.ingest import folder_names, is_catalogue, printable, read_catalogue
from rockframe.provenance import (
    refuse_overwriting,
    sha256_of,
    source_code_hash,
    versions,
)
from rockframe.runs.step import INPUTS, STRUCTURES, Step, steps_of
from rockframe.study.passport import read_limits
from rockframe.study.study import Study, structures_text

#: Where a run keeps what is no result: plan, stamps, lock. Hidden, beside the results.
KEPT: Final = ".rockframe"
#: Suffixes of files that tell of records and hold none.
_BESIDE: Final = frozenset([".xml", ".json", ".quakeml", ".stationxml"])


@dataclass(frozen=True)
class Input:
    """A file that a study reads.

    Parameters
    ----------
    name : str
        Its name in lists: the stated folder, followed by its path there.
    path : Path
        The file.
    sha256 : str
        Its hash when the run was planned.
    """

    name: str
    path: Path
    sha256: str


@dataclass(frozen=True)
class Plan:
    """The inputs, steps and files of a run.

    Parameters
    ----------
    study : str
        Name of the study.
    parameters : mapping
        What its file says.
    inputs : tuple of Input
        Every file that the study reads.
    steps : tuple of Step
        In an order in which each can follow those before it.
    keys : mapping of str to str
        What stands for all that a step depends on, by its name.
    files : mapping of str to str
        Texts that the plan itself puts into the run's folder, by name.
    source : str
        Hash of the package's source code that made the plan.
    """

    study: str
    parameters: Mapping[str, Any]
    inputs: tuple[Input, ...]
    steps: tuple[Step, ...]
    keys: Mapping[str, str]
    files: Mapping[str, str]
    source: str

    @property
    def outputs(self) -> list[str]:
        """Files and folders that stay when the run is done."""
        kept = (name for step in self.steps if not step.temporary for name in step.outputs)
        return [*self.files, *kept]


def make_plan(study: Study, folder: Path) -> Plan:
    """Return the plan of a study: nothing is written.

    Parameters
    ----------
    study : Study
        What is to be done.
    folder : Path
        The folder of the run.

    Raises
    ------
    InputError
        If the folder lies among the records, an output would replace or hold what is read, or a
        file cannot be read.
    """
    inputs = tuple(_inputs(study, folder))
    _require_sound(study)
    steps = tuple(steps_of(study, _count(inputs)))
    files = {INPUTS: _listed(inputs)}
    if study.records:
        files[STRUCTURES] = structures_text(study)
    known = {name: _digest(text) for name, text in files.items()}
    keys: dict[str, str] = {}
    # libraries compute too: what an older one made is made again, or the manifest would not be true
    code = (source_code_hash(), _digest(json.dumps(versions(), sort_keys=True)))
    for step in steps:
        outside = [file.sha256 for file in _outside(step, inputs)]
        if step.stage == "manifest":
            outside = [_digest(json.dumps(study.parameters(), sort_keys=True))]
        keys[step.name] = _whole(step, steps).key(known, *code, *outside)
        known |= dict.fromkeys(step.outputs, keys[step.name])
    plan = Plan(study.name, study.parameters(), inputs, steps, keys, files, source_code_hash())
    _refuse_inputs(plan, study, folder)
    return plan


def _outside(step: Step, inputs: Sequence[Input]) -> list[Input]:
    """Return the files outside the run that a step reads."""
    if step.stage == "ingest":
        return list(inputs)
    stated = {value for value in step.options.values() if isinstance(value, str)}
    return [file for file in inputs if str(file.path) in stated]


def _whole(step: Step, steps: Sequence[Step]) -> Step:
    """Return for a merge the stage on all records at once, which gives the same, else the step."""
    parts = [part for part in steps if part.temporary and set(part.outputs) & set(step.inputs)]
    return replace(parts[0], batch=(1, 1)) if parts else step


def _refuse_inputs(plan: Plan, study: Study, folder: Path) -> None:
    """Refuse to overwrite an input, with ``--replace`` too."""
    read = [*(file.path for file in plan.inputs), study.path, study.structures]
    made = {*plan.outputs, *(name for step in plan.steps for name in step.outputs)}
    refuse_overwriting((folder / name for name in sorted(made) if not name.endswith("/")), read)
    for name in sorted(name for name in made if name.endswith("/")):
        for path in read:
            if path.resolve().is_relative_to((folder / name).resolve()):
                raise InputError(path, f"lies in {name} of the run. Must be elsewhere.")


def _require_sound(study: Study) -> None:
    """Read what stages would refuse too, but only after hours, or once an older run was undone."""
    files = study.files()
    if ("records", "limits") in files:
        read_limits(files["records", "limits"])
    if ("records", "catalogue") in files:
        read_catalogue(files["records", "catalogue"])
    if ("screen", "hazard") in files:
        from rockframe.risk import read_hazard  # scipy, which other studies need not wait for

        path, screen = files["screen", "hazard"], study.tables.screen
        measure = read_hazard(path, screen.hazard_site if screen else None).measure
        if screen is not None and screen.azimuths_degree and measure in ("a_p", "L_p"):
            unknown = f"is of {measure}, which is not known for rotated motions"
            raise InputError(path, f"{unknown}. Must be of PGA or PGV.")


def _inputs(study: Study, folder: Path) -> Iterator[Input]:
    """Every file that is read, once, under a name of its own."""
    names: set[str] = set()
    paths: set[Path] = set()
    for name, path in _named(study, folder):
        if path in paths:
            continue
        called, number = printable(name), 1
        while called in names:
            number += 1
            called = f"{printable(name)} ({number})"
        names.add(called)
        paths.add(path)
        yield Input(called, path, sha256_of(path))


def _named(study: Study, folder: Path) -> Iterator[tuple[str, Path]]:
    for stated, called in zip(study.records, folder_names(study.records), strict=True):
        if stated.is_dir():
            if folder.resolve().is_relative_to(stated.resolve()):
                raise InputError(folder, "lies among the records. Must be another folder.")
            yield from _within(stated, called)
        else:
            yield stated.name, stated
            beside = sorted(stated.parent.glob("*.xml"))  # of a miniSEED file
            yield from ((path.name, path) for path in beside if path.is_file())
    for where, path in study.files().items():
        if where != ("structures",):
            yield path.name, path


def _within(folder: Path, called: str) -> Iterator[tuple[str, Path]]:
    """Every file in a folder and in its folders that can be opened and is not hidden; sorted."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if not any(part.startswith(".") for part in name.parts) and _can_be_opened(path):
            yield f"{called}/{name.as_posix()}", path


def _can_be_opened(path: Path) -> bool:
    try:
        return path.is_file() and os.access(path, os.R_OK)
    except OSError:  # its folder is closed: the list of the records has a row for it
        return False


def _count(inputs: tuple[Input, ...]) -> int:
    """About how many records there are: so many batches are worth it."""
    count = 0
    for file in inputs:
        if file.path.suffix.lower() not in _BESIDE and not is_catalogue(file.path):
            count += _members(file.path)
    return max(count, 1)


def _members(path: Path) -> int:
    """Files in an archive, if it is a whole one; of anything else, one."""
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                return len(archive.infolist())
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        pass
    return 1


def _listed(inputs: tuple[Input, ...]) -> str:
    stream = io.StringIO()
    rows = ([i.name, i.path.stat().st_size, i.sha256] for i in inputs)
    write_rows(stream, [["file", "bytes", "sha256"], *rows])
    return stream.getvalue()


def _digest(text: str) -> str:
    import hashlib

    return hashlib.sha256(text.encode()).hexdigest()
