"""The state of a run: stamps of finished steps, and its plan, lock and manifest."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from filelock import lock_descriptor

from rockframe.errors import InputError
from rockframe.provenance import (
    DAMAGED,
    DRAWN,
    MANIFEST,
    MISSING,
    Stamp,
    is_sealed,
    is_within,
    read_json,
    remove_file,
    sealed,
    sha256_of,
    staying,
    whole_file,
    write_manifest,
)
from rockframe.runs.plan import KEPT, Input, Plan, Step, key_of_step
from rockframe.runs.reasons import NOT_YET, changes

_STAMPS: Final = f"{KEPT}/steps"
_OF_ALL: Final = frozenset(["manifest", "verify"])
#: File that Snakemake writes into an output folder.
_MARK: Final = ".snakemake_timestamp"


@dataclass(frozen=True)
class StepState:
    """The state of a step.

    Parameters
    ----------
    step : Step
        The step.
    state : str
        ``done``; ``to do``; ``outdated``, after a change of its inputs, its options, the source
        code or a library; ``damaged``, if an output is corrupted.
    fault : str
        The corrupted file, if the state is ``damaged``.
    reason : str
        Why the step runs, or runs again; empty if it is done.
    """

    step: Step
    state: str
    fault: str = ""
    reason: str = ""

    @property
    def is_done(self) -> bool:
        """True if the step needs no further work."""
        return self.state == "done"


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
    waiting, states = "", []
    for step in plan.steps:
        stamps = [s for s in (_read(folder, step.name), listed.get(step.name)) if s]
        stamps.sort(key=lambda stamp: stamp.key != plan.keys[step.name])
        state = _state(plan, step, stamps[0] if stamps else None, folder)
        if step.stage in _OF_ALL and state.state in {"done", "damaged"} and waiting:
            kind = "to do" if state.is_done else state.state
            state = StepState(step, kind, state.fault, f"follows from {waiting}")
        waiting = waiting or ("" if state.is_done else step.name)
        states.append(state)
    return states


def _state(plan: Plan, step: Step, stamp: Stamp | None, folder: Path) -> StepState:
    if stamp is None:
        reason = next((f"no stamp for {n}" for n in step.outputs if (folder / n).exists()), NOT_YET)
        return StepState(step, "to do", reason=reason)
    if stamp.key != plan.keys[step.name]:
        return StepState(step, "outdated", reason=changes(stamp.origin, plan, step))
    if any(name not in stamp.outputs for name in step.outputs if not name.endswith("/")):
        return StepState(step, "to do", reason="its stamp is corrupted")
    for path, fault in stamp.faults(folder):
        name = path.relative_to(folder).as_posix()
        reason = f"{name} {'is missing' if fault == MISSING else fault}"
        return StepState(step, "damaged", f"{path}: {fault}", reason)
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
    corrupted: dict[Path, str] = {}
    for path, text in ((folder / name, text) for name, text in files.items()):
        if not path.is_file():
            corrupted[path] = MISSING
        elif _content(path) != text.encode():
            corrupted[path] = DAMAGED
    for path in (*sorted((folder / _STAMPS).glob("[!.]*.json")), folder / MANIFEST):
        if path.is_file() and not is_sealed(_content(path)):
            corrupted[path] = DAMAGED
    return corrupted


def faults_of(corrupted: Mapping[Path, str], states: Sequence[StepState]) -> list[str]:
    """Return a message for each corrupted or missing file of a run."""
    files = [f"{path}: {fault}" for path, fault in corrupted.items()]
    return list(dict.fromkeys([*files, *(state.fault for state in states if state.fault)]))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None


def stamp(step: Step, origin: Mapping[str, Any], folder: Path) -> None:
    """Write the stamp of a finished step, with all that it depended on and hashes of its outputs.

    Raises
    ------
    InputError
        If an output is missing, or the stamp cannot be written.
    """
    written = Stamp.of(key_of_step(origin), files_of(step.outputs, folder), folder)
    _write(folder, step.name, replace(written, origin=origin))


def files_of(outputs: Sequence[str], folder: Path) -> list[str]:
    """Return the files among outputs; for folders, each file inside that is not hidden."""
    files: list[str] = []
    for name in outputs:
        if name.endswith("/"):
            inside = sorted(path for path in (folder / name).rglob("*") if path.is_file())
            # Snakemake hides files there
            visible = (path for path in inside if not path.name.startswith("."))
            files += [path.relative_to(folder).as_posix() for path in visible]
        else:
            files.append(name)
    return files


def take_back_manifest(plan: Plan, folder: Path) -> None:
    """Remove the manifest, after writing its data on steps as stamps."""
    listed = _of_manifest(plan, folder)
    for step in plan.steps:
        recorded = listed.get(step.name)
        if recorded is not None and _read(folder, step.name) is None:
            _write(folder, step.name, recorded)
    remove_file(folder / MANIFEST)


def remove_former(plan: Plan, former: Plan, folder: Path) -> list[str]:
    """Remove files of the former plan that this plan does not write; return their names."""
    gone = {*former.outputs} - {*plan.outputs}
    removed = sorted(name for name in gone if (folder / name).exists())
    for name in removed:
        remove_output(former, folder, name)
        _remove_if_empty((folder / name).parent)
    for name in {step.name for step in former.steps} - {step.name for step in plan.steps}:
        remove_file(_stamp_file(folder, name))
    return removed


def remove_output(plan: Plan, folder: Path, name: str) -> None:
    """Remove an output of a plan: a file, or the files that a step wrote into a folder.

    A name with ``/`` at the end is a folder. Files that are not from the run stay in it.
    """
    path = folder / name
    if not name.endswith("/"):
        remove_unless_folder(path)
        return
    listed = _of_manifest(plan, folder)
    for step in plan.steps:
        recorded = _read(folder, step.name) or listed.get(step.name)
        for file in recorded.outputs if recorded is not None and name in step.outputs else ():
            if file.startswith(name) and is_within(file):
                remove_file(folder / file)
    for hidden in (_MARK, DRAWN):
        remove_file(path / hidden)
    _remove_if_empty(path)


def remove_unless_folder(path: Path) -> None:
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
        partial.write_bytes(sealed(asdict(left)))


def _read(folder: Path, name: str) -> Stamp | None:
    try:
        text = _stamp_file(folder, name).read_bytes()
        content = read_json(text)
        left = Stamp(content["key"], dict(content["outputs"]), dict(content["origin"]))
        return left if is_sealed(text) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _of_manifest(plan: Plan, folder: Path) -> dict[str, Stamp]:
    """Return the stamps of the steps that the manifest of a finished run lists."""
    path = folder / MANIFEST
    try:
        text = path.read_bytes()
        content: Any = read_json(text) if is_sealed(text) else {}
        own = {MANIFEST: hashlib.sha256(text).hexdigest()}
        keys, hashes = content["steps"], {**content["outputs"], **own}
        stamps = {}
        for step in plan.steps:
            folders = tuple(name for name in step.outputs if name.endswith("/"))
            outputs = {
                name: sha256
                for name, sha256 in hashes.items()
                if name in step.outputs or name.startswith(folders)
            }
            if step.name in keys and outputs:
                stamps[step.name] = Stamp(keys[step.name], outputs)
    except (OSError, ValueError, KeyError, TypeError, InputError):
        return {}
    return stamps


#: The end of the names of partial files: the random part of mkstemp, and ``.partial``.
_RANDOM = r"-[A-Za-z0-9_]{8}\.partial"
#: Folders in which a screening, or a batch of it, keeps finished tasks until the end.
_TASKS = re.compile(r"\.(screen(?:-\d+)?)-[0-9a-f]{16}\.batches")


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
    for output in sorted({*map(Path, plan.outputs), *kept, Path("records.csv")}):
        parent = folder / output.parent
        if not parent.is_dir():
            continue
        wanted = re.compile(re.escape(f".{output.stem}") + _RANDOM + re.escape(output.suffix))
        for path in sorted(parent.iterdir()):
            if wanted.fullmatch(path.name):
                _remove(path)
                removed.append(path.relative_to(folder).as_posix())
    return removed + _remove_tasks(plan, folder)


def _remove_tasks(plan: Plan, folder: Path) -> list[str]:
    """Remove the tasks of screenings and batches from which no step of the plan resumes."""
    resumed = {folder / step.outputs[0] for step in plan.steps if step.stage == "screen"}
    left = [
        path
        for path in (*folder.glob(".*"), *folder.glob("*/.*"))
        if (of := _TASKS.fullmatch(path.name)) and path.with_name(f"{of[1]}.nc") not in resumed
    ]
    for path in left:
        _remove(path)
    return [path.relative_to(folder).as_posix() for path in left]


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()


_PLAN: Final = "plan.json"
_AGAIN: Final = "Restore the file, or repeat the command that computed the run."
_NO_RUN: Final = "contains no run of a study. Start one, or repeat the command that computed it."


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
        "origins": plan.origins,
        "keys": plan.keys,  # for workflows
        "files": plan.files,
        "source_code_hash": plan.source,
        "of_command": plan.of_command,
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
        raise InputError(folder, _NO_RUN)
    try:
        text = path.read_bytes()
        content = read_json(text)
        plan = Plan(
            content["study"],
            content["parameters"],
            _inputs(content["inputs"]),
            tuple(_step(step) for step in content["steps"]),
            {step["name"]: content["origins"][step["name"]] for step in content["steps"]},
            *(dict(content["files"]), str(content["source_code_hash"])),
            _inputs(content.get("study_files", ())),
            bool(content.get("of_command", False)),
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
    names = {field.name for field in fields(Step)}  # steps of earlier versions had more
    values: dict[str, Any] = {
        key: tuple(v) if key in lists else v for key, v in content.items() if key in names
    }
    return Step(**values)


#: Retries, because `is_locked` holds the lock for a moment.
_TRIES: Final = 5
_PAUSE: Final = 0.02


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a run's folder during the block; the system frees it if the process dies.

    The folder is not made anew if it is renamed during the block.

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
        with staying(folder):
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
    plan = read_plan(folder)
    inputs = {file.name: file.sha256 for file in plan.inputs}
    changed, read = changed_inputs(plan.inputs), _read_by_ingest(folder)
    if not changed:
        inputs = _archived_files(plan, set(read.values()) - set(inputs.values())) | inputs
        hashes = set(inputs.values())
        changed = [(name, "changed") for name, sha256 in read.items() if sha256 not in hashes]
    for name, reason in changed:
        advice = "Run again, and do not change inputs before the end."
        raise InputError(name, f"{reason} since the run began. {advice}")
    last = next(k for k, step in enumerate(plan.steps) if step.stage == "manifest")
    written = [name for step in plan.steps[:last] for name in step.outputs]
    outputs = sorted([*plan.files, *files_of(written, folder)])
    write_manifest(
        folder,
        inputs=inputs,
        parameters={"study": plan.parameters},
        outputs=[folder / name for name in outputs],
        steps=dict(plan.keys),
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
    from rockframe.results.schema import RECORDS
    from rockframe.results.stored import attributes_of

    records = folder / "records.nc"
    if not records.is_file():
        return {}
    inputs: dict[str, str] = json.loads(attributes_of(records, RECORDS)["input_sha256"])
    return inputs


def _archived_files(plan: Plan, wanted: Collection[str]) -> dict[str, str]:
    """Return the name and SHA-256 of each archive member that has one of these hashes.

    A record states the hash of its archive member; the plan states the hash of the archive.
    """
    from rockframe.ingest import ARCHIVE_HEAD, contents, is_archive, load, printable

    names: dict[str, str] = {}
    for path, called in ((file.path, file.name) for file in plan.inputs if wanted):
        with path.open("rb") as stream:
            if not is_archive(stream.read(ARCHIVE_HEAD)):
                continue
        try:
            for member in contents(path, load(path)):
                sha256 = hashlib.sha256(member.data).hexdigest()
                if sha256 in wanted:
                    names[called + member.name.removeprefix(printable(path.name))] = sha256
        except InputError:
            continue  # ingest has rejected this archive
    return names
