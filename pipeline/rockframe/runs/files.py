"""The internal files of a run: its plan, its lock and its manifest."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from filelock import lock_descriptor

from rockframe.errors import InputError
from rockframe.provenance import (
    DAMAGED,
    is_sealed,
    is_within,
    read_json,
    sealed,
    sha256_of,
    whole_file,
)
from rockframe.runs.plan import KEPT, Input, Plan
from rockframe.runs.state import files_of
from rockframe.runs.step import Step

_PLAN: Final = "plan.json"
_AGAIN: Final = "Restore the file, or write it again with `rockframe run`."


def write_plan(plan: Plan, folder: Path) -> None:
    """Write the plan and its files, except files that exist with the same content.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    content = {
        "study": plan.study,
        "parameters": plan.parameters,
        "inputs": [{**asdict(i), "path": str(i.path)} for i in plan.inputs],
        "study_files": [{**asdict(i), "path": str(i.path)} for i in plan.study_files],
        "steps": [asdict(step) for step in plan.steps],
        "keys": plan.keys,
        "files": plan.files,
        "source_code_hash": plan.source,
    }
    texts = {name: text.encode() for name, text in plan.files.items()}
    for name, text in {**texts, f"{KEPT}/{_PLAN}": sealed(content)}.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != text:
            with whole_file(path) as partial:
                partial.write_bytes(text)


def read_plan(folder: Path) -> Plan:
    """Read the plan of the run in a folder.

    Raises
    ------
    InputError
        If the plan is missing, cannot be read, or is corrupted.
    """
    path = folder / KEPT / _PLAN
    if not path.is_file():
        raise InputError(folder, "contains no run of a study. Start one with `rockframe run`.")
    try:
        text = path.read_bytes()
        content = read_json(text)
        plan = Plan(
            content["study"],
            content["parameters"],
            _inputs(content["inputs"]),
            tuple(_step(step) for step in content["steps"]),
            {step["name"]: content["keys"][step["name"]] for step in content["steps"]},
            dict(content["files"]),
            str(content["source_code_hash"]),
            _inputs(content.get("study_files", ())),
        )
        # a run of another study removes the outputs and stamps that are named here
        names = [n for step in plan.steps for n in (step.name, *step.outputs)]
        outside = [name for name in (*plan.outputs, *names) if not is_within(name)]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(path, f"cannot be read ({error}). {_AGAIN}") from None
    if outside:
        raise InputError(path, f"names {outside[0]!r}. Must be within the folder.")
    if not is_sealed(text):
        raise InputError(path, f"{DAMAGED}. {_AGAIN}")
    return plan


def _inputs(content: Iterable[Mapping[str, str]]) -> tuple[Input, ...]:
    return tuple(Input(i["name"], Path(i["path"]), i["sha256"]) for i in content)


def _step(content: Mapping[str, Any]) -> Step:
    lists = {"batch", "inputs", "outputs"}
    values: dict[str, Any] = {key: tuple(v) if key in lists else v for key, v in content.items()}
    return Step(**values)


#: Retries, because `is_locked` holds the lock for a moment.
_TRIES: Final = 5
_PAUSE: Final = 0.02


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a run's folder during the block; the system frees it if the process dies.

    Raises
    ------
    InputError
        If another run holds the lock, or the folder cannot be written to.
    """
    path = folder / KEPT / "lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # child processes do not inherit the descriptor
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None
    try:
        if not _acquired(descriptor):
            raise InputError(folder, "in use by another run. Wait until it ends.")
        yield
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Return True if a run is using a folder.

    Examples
    --------
    >>> is_locked(Path("no-such-folder"))
    False
    """
    path = folder / KEPT / "lock"
    if not path.is_file():
        return False
    try:
        try:
            descriptor = os.open(path, os.O_RDWR)  # NFS locks only files opened for writing
        except OSError:  # in a folder of another user
            descriptor = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    try:
        return not _acquired(descriptor)
    finally:
        os.close(descriptor)


def _acquired(descriptor: int) -> bool:
    """Take the lock. Retry for a moment, because `is_locked` briefly holds it too."""
    for _ in range(_TRIES):
        try:
            if lock_descriptor(descriptor, blocking=False):
                return True
        except OSError:  # a file system without locks: the user must avoid two runs at once
            return True
        time.sleep(_PAUSE)
    return False


def finish(folder: Path) -> int:
    """Hash the inputs and outputs of the run in a folder, and write ``manifest.json``.

    Parameters
    ----------
    folder : Path
        The folder of the run, with its plan.

    Returns
    -------
    int
        Number of files of the run, including the manifest.

    Raises
    ------
    InputError
        If an input changed or is missing since the run was planned, or if an output is missing.
    """
    from rockframe.results.manifest import write_manifest

    plan = read_plan(folder)
    inputs = {file.name: file.sha256 for file in plan.inputs}
    changed, read = changed_inputs(plan.inputs), _read_by_ingest(folder)
    if not changed:
        inputs = _members(plan, set(read.values()) - set(inputs.values())) | inputs
        known = set(inputs.values())
        changed = [(name, "changed") for name, sha256 in read.items() if sha256 not in known]
    for name, reason in changed:
        raise InputError(
            name,
            f"{reason} since the run began. Run again, and do not change inputs before the end.",
        )
    last = next(k for k, step in enumerate(plan.steps) if step.stage == "manifest")
    kept = [name for step in plan.steps[:last] if not step.temporary for name in step.outputs]
    outputs = sorted([*plan.files, *files_of(kept, folder)])
    write_manifest(
        folder,
        inputs=inputs,
        parameters={"study": plan.parameters},
        outputs=[folder / name for name in outputs],
        steps={step.name: plan.keys[step.name] for step in plan.steps if not step.temporary},
    )
    return len(outputs) + 1


def changed_inputs(inputs: Iterable[Input]) -> list[tuple[str, str]]:
    """Return the inputs that changed or are missing since the run was planned.

    Parameters
    ----------
    inputs : iterable of Input
        Inputs of a plan. All of them are hashed.

    Returns
    -------
    list of (str, str)
        Path, and ``changed`` or ``vanished``.
    """
    changed = []
    for file in inputs:
        if not file.path.is_file():
            changed.append((str(file.path), "vanished"))
        elif sha256_of(file.path) != file.sha256:
            changed.append((str(file.path), "changed"))
    return changed


def _read_by_ingest(folder: Path) -> dict[str, str]:
    """Return the name and SHA-256 of each file that ingest read, from records.nc."""
    from rockframe.results.merging import describe
    from rockframe.results.schema import RECORDS

    records = folder / "records.nc"
    return dict(describe(records, RECORDS).inputs) if records.is_file() else {}


def _members(plan: Plan, wanted: Collection[str]) -> dict[str, str]:
    """Return the name and SHA-256 of each archive member that has one of these hashes.

    A record states the hash of its archive member; the plan states the hash of the archive.
    """
    from rockframe.ingest import ARCHIVE_HEAD, contents, is_archive, load, printable

    found: dict[str, str] = {}
    for path, called in ((file.path, file.name) for file in plan.inputs if wanted):
        with path.open("rb") as stream:
            if not is_archive(stream.read(ARCHIVE_HEAD)):
                continue
        try:
            for member in contents(path, load(path)):
                sha256 = hashlib.sha256(member.data).hexdigest()
                if sha256 in wanted:
                    found[called + member.name.removeprefix(printable(path.name))] = sha256
        except InputError:
            continue  # ingest has rejected this archive
    return found
