"""The state of a run: each finished step leaves a stamp with the hashes of its outputs."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError
from rockframe.provenance import (
    DAMAGED,
    MANIFEST,
    is_sealed,
    is_within,
    read_json,
    sealed,
    sha256_of,
    whole_file,
)
from rockframe.runs.plan import KEPT, Plan
from rockframe.runs.step import Step

_STAMPS: Final = f"{KEPT}/steps"
_OF_ALL: Final = frozenset(["manifest", "verify"])
#: File that Snakemake writes into an output folder.
_MARK: Final = ".snakemake_timestamp"


@dataclass(frozen=True)
class Stamp:
    """The stamp of a finished step: its key and the hashes of its outputs.

    Parameters
    ----------
    key : str
        Hash of everything that the step depended on.
    outputs : mapping of str to str
        SHA-256 of each file that the step wrote.
    """

    key: str
    outputs: Mapping[str, str]


@dataclass(frozen=True)
class StepState:
    """The state of a step.

    Parameters
    ----------
    step : Step
        The step.
    state : str
        ``done``; ``to do``; ``outdated``, after a change of its inputs, its options, the source
        code or a library; ``damaged``, if an output is corrupted; ``removed``, if its
        outputs were temporary and are no longer needed.
    fault : str
        The corrupted file, if the state is ``damaged``.
    """

    step: Step
    state: str
    fault: str = ""

    @property
    def is_done(self) -> bool:
        """True if the step needs no further work."""
        return self.state in {"done", "removed"}


def states_of(plan: Plan, folder: Path) -> list[StepState]:
    """Return the state of each step; every output is hashed.

    Parameters
    ----------
    plan : Plan
        The plan of the run.
    folder : Path
        The folder of the run.
    """
    listed = _of_manifest(plan, folder)
    states: dict[str, StepState] = {}
    needed: set[str] = set()
    for step in reversed(plan.steps):
        stamps = [s for s in (_read(folder, step.name), listed.get(step.name)) if s]
        stamps.sort(key=lambda stamp: stamp.key != plan.keys[step.name])
        state = _state(step, stamps[0] if stamps else None, plan.keys[step.name], folder)
        if step.temporary and not needed.intersection(step.outputs):
            state = StepState(step, "removed")
        if not state.is_done:
            needed.update(step.inputs)
        states[step.name] = state
    whole, found = True, []
    for step in plan.steps:
        state = states[step.name]
        if step.stage in _OF_ALL and state.is_done and not whole:
            state = StepState(step, "to do")  # it depends on all steps before it
        whole = whole and state.is_done
        found.append(state)
    return found


def _state(step: Step, stamp: Stamp | None, key: str, folder: Path) -> StepState:
    if stamp is None:
        return StepState(step, "to do")
    if stamp.key != key:
        return StepState(step, "outdated")
    if any(name not in stamp.outputs for name in step.outputs if not name.endswith("/")):
        return StepState(step, "to do")  # a corrupted stamp
    for name, stated in stamp.outputs.items():
        path = folder / name
        if not path.is_file():
            return StepState(step, "damaged" if not step.temporary else "to do", f"{path}: missing")
        if sha256_of(path) != stated:
            return StepState(step, "damaged", f"{path}: {DAMAGED}")
    return StepState(step, "done")


def damaged(folder: Path, files: Mapping[str, str]) -> dict[Path, str]:
    """Return the corrupted internal files of a run: plan files, stamps, the manifest.

    Parameters
    ----------
    folder : Path
        The folder of the run.
    files : mapping of str to str
        Required texts of the files of the plan, by name.

    Returns
    -------
    dict of Path to str
        For each faulty file, a message that it is missing or corrupted.
    """
    found: dict[Path, str] = {}
    for path, text in ((folder / name, text) for name, text in files.items()):
        if not path.is_file():
            found[path] = "missing"
        elif _content(path) != text.encode():
            found[path] = DAMAGED
    for path in (*sorted((folder / _STAMPS).glob("[!.]*.json")), folder / MANIFEST):
        if path.is_file() and not is_sealed(_content(path)):
            found[path] = DAMAGED
    return found


def faults_of(corrupted: Mapping[Path, str], states: Sequence[StepState]) -> list[str]:
    """Return a message for each corrupted or missing file of a run."""
    files = [f"{path}: {what}" for path, what in corrupted.items()]
    return list(dict.fromkeys([*files, *(state.fault for state in states if state.fault)]))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None


def stamp(step: Step, key: str, folder: Path) -> None:
    """Write the stamp of a finished step, with the hashes of its outputs.

    Raises
    ------
    InputError
        If an output is missing, or the stamp cannot be written.
    """
    outputs = {name: sha256_of(folder / name) for name in files_of(step.outputs, folder)}
    _write(folder, step.name, Stamp(key, outputs))


def files_of(outputs: Sequence[str], folder: Path) -> list[str]:
    """Return the files among outputs; for folders, each file inside that is not hidden."""
    files: list[str] = []
    for name in outputs:
        if name.endswith("/"):
            found = sorted(path for path in (folder / name).rglob("*") if _is_visible_file(path))
            files += [path.relative_to(folder).as_posix() for path in found]
        else:
            files.append(name)
    return files


def _is_visible_file(path: Path) -> bool:
    return path.is_file() and not path.name.startswith(".")  # Snakemake hides files there


def take_back_manifest(plan: Plan, folder: Path) -> None:
    """Remove the manifest, after writing its data on steps as stamps."""
    listed = _of_manifest(plan, folder)
    for step in plan.steps:
        known = listed.get(step.name)
        if known is not None and _read(folder, step.name) is None:
            _write(folder, step.name, known)
    (folder / MANIFEST).unlink(missing_ok=True)


def remove_spent(plan: Plan, folder: Path, states: Sequence[StepState]) -> None:
    """Remove temporary outputs that no step needs any more, including those of earlier runs."""
    for state in states:
        if state.state == "removed":
            for name in state.step.outputs:
                (folder / name).unlink(missing_ok=True)
                _stamp_file(folder, state.step.name).unlink(missing_ok=True)
    kept = {Path(name).parent for s in states if s.state != "removed" for name in s.step.outputs}
    for step in plan.steps:
        for parent in {Path(name).parent for name in step.outputs if step.temporary}:
            if parent not in kept:
                _remove_if_empty(folder / parent)


def remove_former(plan: Plan, former: Plan, folder: Path) -> list[str]:
    """Remove files of the former plan that this plan does not write; return their names."""
    removed = sorted(n for n in former.written - plan.written if (folder / n).exists())
    for name in removed:
        remove_output(former, folder, name)
    for name in {step.name for step in former.steps} - {step.name for step in plan.steps}:
        _stamp_file(folder, name).unlink(missing_ok=True)
    return removed


def remove_output(plan: Plan, folder: Path, name: str) -> None:
    """Remove an output of a plan: a file, or the files that a step wrote into a folder.

    A name with ``/`` at the end is a folder. Files that are not from the run stay in it.
    """
    path = folder / name
    if not name.endswith("/"):
        remove_file(path)
        return
    listed = _of_manifest(plan, folder)
    for step in plan.steps:
        known = _read(folder, step.name) or listed.get(step.name)
        for file in known.outputs if known is not None and name in step.outputs else ():
            if file.startswith(name) and is_within(file):
                (folder / file).unlink(missing_ok=True)
    (path / _MARK).unlink(missing_ok=True)
    _remove_if_empty(path)


def remove_file(path: Path) -> None:
    """Remove a file or a symbolic link, but no folder."""
    if path.is_file() or path.is_symlink():
        path.unlink()


def _remove_if_empty(folder: Path) -> None:
    """Remove a folder and its subfolders, as far as they contain no files."""
    for path in [*sorted(folder.rglob("*"), reverse=True), folder]:  # innermost first
        if path.is_dir() and not path.is_symlink() and not any(path.iterdir()):
            path.rmdir()


def _stamp_file(folder: Path, name: str) -> Path:
    return folder / _STAMPS / f"{name}.json"


def _write(folder: Path, name: str, left: Stamp) -> None:
    with whole_file(_stamp_file(folder, name)) as partial:
        partial.write_bytes(sealed({"key": left.key, "outputs": dict(left.outputs)}))


def _read(folder: Path, name: str) -> Stamp | None:
    try:
        text = _stamp_file(folder, name).read_bytes()
        content = read_json(text)
        return Stamp(content["key"], dict(content["outputs"])) if is_sealed(text) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _of_manifest(plan: Plan, folder: Path) -> dict[str, Stamp]:
    """Return the stamps of the steps that the manifest of a finished run lists."""
    path = folder / MANIFEST
    try:
        text = path.read_bytes()
        content: Any = read_json(text) if is_sealed(text) else {}
        keys, hashes = content["steps"], {**content["outputs"], MANIFEST: sha256_of(path)}
        stamps = {}
        for step in plan.steps:
            folders = tuple(name for name in step.outputs if name.endswith("/"))
            found = {
                name: sha256
                for name, sha256 in hashes.items()
                if name in step.outputs or name.startswith(folders)
            }
            if step.name in keys and found:
                stamps[step.name] = Stamp(keys[step.name], found)
    except (OSError, ValueError, KeyError, TypeError, InputError):
        return {}
    return stamps


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
    kept = [path.relative_to(folder) for path in (folder / KEPT).rglob("*.json")]
    kept += [Path(KEPT, "plan.json"), *(Path(KEPT, "steps", f"{s.name}.json") for s in plan.steps)]
    removed = []
    for output in sorted({*map(Path, plan.written), *kept, Path("records.csv")}):
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
