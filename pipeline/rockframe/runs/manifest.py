"""Write the manifest of a run, if its inputs are unchanged since they were planned and read."""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from pathlib import Path

from rockframe.errors import InputError
from rockframe.ingest import ARCHIVE_HEAD, contents, is_archive, load, printable
from rockframe.provenance import sha256_of
from rockframe.runs.plan import Plan
from rockframe.runs.plan_file import read_plan
from rockframe.runs.state import files_of


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
    changed, read = changed_inputs(plan), _read_by_ingest(folder)
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


def changed_inputs(plan: Plan) -> list[tuple[str, str]]:
    """Return the inputs that changed or are missing since the run was planned.

    Parameters
    ----------
    plan : Plan
        The plan of a run. All its inputs are hashed.

    Returns
    -------
    list of (str, str)
        Path, and ``changed`` or ``vanished``.
    """
    changed = []
    for file in plan.inputs:
        if not file.path.is_file():
            changed.append((str(file.path), "vanished"))
        elif sha256_of(file.path) != file.sha256:
            changed.append((str(file.path), "changed"))
    return changed


def _read_by_ingest(folder: Path) -> dict[str, str]:
    """Return the name and SHA-256 of each file that ingest read, from records.nc."""
    from rockframe.results.reading import describe
    from rockframe.results.schema import RECORDS

    records = folder / "records.nc"
    return dict(describe(records, RECORDS).inputs) if records.is_file() else {}


def _members(plan: Plan, wanted: Collection[str]) -> dict[str, str]:
    """Return the name and SHA-256 of each archive member that has one of these hashes.

    A record states the hash of its archive member; the plan states the hash of the archive.
    """
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
