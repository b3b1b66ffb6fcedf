"""The manifest of a run: written only if all that went in is still what was planned and read."""

from __future__ import annotations

from pathlib import Path

from rockframe.errors import InputError
from rockframe.provenance import sha256_of, write_manifest
from rockframe.runs.plan import Plan
from rockframe.runs.plan_file import read_plan
from rockframe.runs.state import files_of


def finish(folder: Path) -> int:
    """Hash what went into the run of a folder and what came out, and write ``manifest.json``.

    Parameters
    ----------
    folder : Path
        Of the run, with its plan.

    Returns
    -------
    int
        Number of files of the run, the manifest included.

    Raises
    ------
    InputError
        If an input changed or vanished since the run was planned, or an output is missing.
    """
    plan = read_plan(folder)
    for name, reason in changed_inputs(plan) or _read_otherwise(plan, folder):
        raise InputError(
            name, f"{reason} since the run began. Must stay as it is until the end; run again."
        )
    last = next(k for k, step in enumerate(plan.steps) if step.rule == "manifest")
    kept = [name for step in plan.steps[:last] if not step.temporary for name in step.outputs]
    outputs = sorted([*plan.files, *files_of(kept, folder)])
    write_manifest(
        folder,
        inputs={file.name: file.sha256 for file in plan.inputs},
        parameters={"study": plan.parameters},
        outputs=[folder / name for name in outputs],
        steps={step.name: plan.keys[step.name] for step in plan.steps if not step.temporary},
    )
    return len(outputs) + 1


def changed_inputs(plan: Plan) -> list[tuple[str, str]]:
    """Return the inputs of a plan that are not as they were planned, and how not.

    Parameters
    ----------
    plan : Plan
        Of a run; its inputs are hashed.

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


def _read_otherwise(plan: Plan, folder: Path) -> list[tuple[str, str]]:
    """Inputs that ingest did not find as they were planned, whatever they are now."""
    from rockframe.results import RECORDS, describe  # a second that other commands need not wait

    records = folder / "records.nc"
    if not records.is_file():
        return []
    planned = {file.sha256 for file in plan.inputs}
    read = describe(records, RECORDS).inputs
    return [(name, "changed") for name, sha in read.items() if sha not in planned]
