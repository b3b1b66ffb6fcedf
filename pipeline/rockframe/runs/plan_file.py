"""Write and read plan.json, lock the folder of a run, and remove partial files."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from filelock import lock_descriptor

from rockframe.errors import InputError
from rockframe.provenance import DAMAGED, is_sealed, is_within, read_json, sealed, whole_file
from rockframe.runs.plan import KEPT, Input, Plan
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
            tuple(Input(i["name"], Path(i["path"]), i["sha256"]) for i in content["inputs"]),
            tuple(_step(step) for step in content["steps"]),
            {step["name"]: content["keys"][step["name"]] for step in content["steps"]},
            dict(content["files"]),
            str(content["source_code_hash"]),
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


def _step(content: Mapping[str, Any]) -> Step:
    lists = {"batch", "inputs", "outputs"}
    values: dict[str, Any] = {key: tuple(v) if key in lists else v for key, v in content.items()}
    return Step(**values)


#: The end of the names of partial files: the random part of mkstemp, and ``.partial``.
_RANDOM = r"-[A-Za-z0-9_]{8}\.partial"
#: Folders in which a screening keeps finished batches until the end.
_BATCHES = re.compile(r"\.screen-[0-9a-f]{16}\.batches")


def remove_partials(plan: Plan, folder: Path) -> list[str]:
    """Remove partial outputs of a plan; the lock must be held.

    Parameters
    ----------
    plan : Plan
        The plan of the run; files with other names are kept.
    folder : Path
        The folder of the run.

    Returns
    -------
    list of str
        Names of the removed files.
    """
    outputs = {Path(name) for step in plan.steps for name in step.outputs} | {
        Path(name) for name in plan.files
    }
    kept = [path.relative_to(folder) for path in (folder / KEPT).rglob("*.json")]
    kept += [Path(KEPT, "plan.json"), *(Path(KEPT, "steps", f"{s.name}.json") for s in plan.steps)]
    removed = []
    for output in sorted({*outputs, *kept, Path("records.csv")}):
        parent = folder / output.parent
        if not parent.is_dir():
            continue
        wanted = re.compile(re.escape(f".{output.stem}") + _RANDOM + re.escape(output.suffix))
        for path in sorted(parent.iterdir()):
            if wanted.fullmatch(path.name):
                _remove(path)
                removed.append(path.relative_to(folder).as_posix())
    return removed + _remove_batches(plan, folder)


def _remove_batches(plan: Plan, folder: Path) -> list[str]:
    """Remove the batches of a screening, unless the plan has a screening, which resumes from
    them.
    """
    if any(step.stage == "screen" for step in plan.steps):
        return []
    left = [path for path in folder.iterdir() if _BATCHES.fullmatch(path.name)]
    for path in left:
        _remove(path)
    return [path.name for path in left]


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()


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
    descriptor = _opened(folder)
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


def _opened(folder: Path) -> int:
    path = folder / KEPT / "lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o644)  # child processes do not inherit it
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None


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
