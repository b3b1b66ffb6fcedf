"""Run a plan: finished steps are kept, the others are performed; a kill loses one step at most."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace as changed
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.errors import InputError, RockframeError
from rockframe.provenance import (
    DAMAGED,
    MANIFEST,
    listed_outputs,
    refuse_obstacles,
    remove_file,
)
from rockframe.runs.plan import KEPT, PAGE, SHARD_FOLDER, Plan, make_plan
from rockframe.runs.state import (
    StepState,
    damaged,
    faults_of,
    locked,
    read_plan,
    remove_former,
    remove_output,
    remove_partials,
    remove_unless_folder,
    states_of,
    take_back_manifest,
    write_plan,
)

if TYPE_CHECKING:
    from rockframe.engines.engine import Engine

#: Steps after the manifest; the manifest does not list their files.
_AFTER: Final = frozenset(["report", "verify"])


#: Folders of the files of batches, of this version and of earlier ones.
_FOLDERS_OF_BATCHES: Final = (f"{SHARD_FOLDER}/", "batches/")
#: A function that reports the progress of a run.
Report = Callable[..., None]


def _ignore(*_progress: object) -> None:
    """Report nothing."""


def run_plan(
    plan: Plan,
    folder: Path,
    *,
    engine: Engine | None = None,
    replace: bool = False,
    on_fault: Report = _ignore,
    on_start: Report = _ignore,
    on_step: Report = _ignore,
    on_progress: Report = _ignore,
) -> tuple[list[str], list[str]]:
    """Perform the steps of a plan that are not done.

    Parameters
    ----------
    plan : Plan
        The plan to carry out.
    folder : Path
        The folder of the run; created if it is missing.
    engine : Engine, optional
        Anything with `map`: an engine, or an executor of `concurrent.futures`. It gets the steps or
        their tasks, as rule 9 of `Engine` says; by default a process pool.
    replace : bool
        Remove the run of another study from the folder.
    on_fault : callable, optional
        Called with a message about each corrupted file.
    on_start : callable, optional
        Called with the states of the steps to do, which say why, before the first is performed.
    on_step : callable, optional
        Called with the name of each finished step, its number, and the number of all steps to do.
    on_progress : callable, optional
        Called with the name of a step under way, the number of its finished parts, and of all parts
        (None while that is unknown); not of steps that workers perform.

    Returns
    -------
    list of str
        Names of the steps that were performed; empty if nothing was to do.
    list of str
        Corrupted or missing files, which were written again.

    Raises
    ------
    InputError
        If the folder is in use by another run or contains other files, or if a step finds an input
        or option that the user must correct.
    """
    folder = folder.resolve()
    with locked(folder):
        states, faults = prepare(plan, folder, replace=replace, on_fault=on_fault)
        waiting = [state for state in states if not state.is_done]
        todo = [state.step for state in waiting]
        if todo:
            on_start(waiting)
            from rockframe.runs.performing import perform_all  # it imports every stage

            perform_all(plan, todo, folder, engine, on_step, on_progress)
        _remove_page_of_former_run(plan, folder, on_fault)
    return [step.name for step in todo], faults


def prepare(
    plan: Plan, folder: Path, *, replace: bool, on_fault: Report
) -> tuple[list[StepState], list[str]]:
    """Prepare a folder for the steps of a plan that are not done; the lock must be held.

    Parameters
    ----------
    plan : Plan
        The plan to carry out.
    folder : Path
        The folder of the run.
    replace : bool
        Remove the run of another study from the folder.
    on_fault : callable
        Called with a message about each corrupted file.

    Returns
    -------
    list of StepState
        The state of each step; corrupted files are removed.
    list of str
        The corrupted files.

    Raises
    ------
    InputError
        If the folder contains other files.
    """
    stamps = (Path(KEPT, "steps", f"{step.name}.json") for step in plan.steps)
    refuse_obstacles(folder / name for name in (*stamps, Path(KEPT, "plan.json")))
    former = _clear_folder(plan, folder, replace, on_fault)
    remove_partials(plan, folder)
    corrupted = _corrupted(plan, former, folder)
    states = states_of(plan, folder)
    faults = faults_of(corrupted, states)
    for fault in faults:
        on_fault(f"{fault}; made again.")
    for path in corrupted:
        remove_unless_folder(path)
    for state in states:
        for name in state.step.outputs if state.fault else ():
            remove_output(plan, folder, name)
    if any(not state.is_done and state.step.name not in _AFTER for state in states):
        take_back_manifest(plan, folder)
    write_plan(plan, folder)
    return states, faults


def _remove_page_of_former_run(plan: Plan, folder: Path, on_fault: Report) -> None:
    """Remove the page that `rockframe report` wrote of former results, if no step writes one."""
    page = folder / PAGE
    if PAGE in plan.outputs or not page.is_file():
        return
    from rockframe.stages.report import shows_another_run  # it imports the schema of all files

    if shows_another_run(folder):
        remove_file(page)
        on_fault(f"{page}: showed former results; removed. `rockframe report` writes a new one.")


def _corrupted(plan: Plan, former: Plan | None, folder: Path) -> dict[Path, str]:
    """Return the run's own files that match neither the former plan nor this one."""
    before = former.files if former is not None else {}
    corrupted = damaged(folder, {name: text for name, text in before.items() if name in plan.files})
    now = damaged(folder, plan.files)
    return {path: fault for path, fault in corrupted.items() if path in now}


def _clear_folder(plan: Plan, folder: Path, replace: bool, on_fault: Report) -> Plan | None:
    """Refuse a folder with other files, and remove files that the study no longer writes.

    Returns the former plan of the same study. The study of a command is another than a user's study
    of that name; where the file of a study lies does not matter, so that it can be moved.
    """
    former, damage = _former_plan(folder)
    if former is not None and _named(former) == _named(plan):
        remove_partials(former, folder)
        for gone in remove_former(plan, former, folder):
            if not gone.startswith(_FOLDERS_OF_BATCHES):
                on_fault(f"{folder / gone}: no longer an output of the study; removed.")
        return former
    content = f"the run of {_named(former)}" if former else _foreign_file(plan, folder)
    if not content:
        return None
    if former is None and _has_own_manifest(plan, folder):
        on_fault(f"{damage or folder / KEPT / 'plan.json: missing'}; made again.")
        return None
    if not replace:
        holds = f"holds {content}{f', and {damage}' if damage else ''}"
        advice = "" if plan.of_command else ", or --replace"
        raise InputError(folder, f"{holds}. Use another folder{advice}.")
    if former is not None:
        remove_partials(former, folder)
        remove_former(plan, former, folder)
        shutil.rmtree(folder / KEPT / "steps", ignore_errors=True)
    for name in (*listed_outputs(folder / MANIFEST), Path(MANIFEST)):
        remove_file(folder / name)
    return None


def _named(plan: Plan) -> str:
    """Return the name of the study of a plan, or of the command whose study it is."""
    return f"the command {plan.study}" if plan.of_command else f"the study {plan.study!r}"


def _former_plan(folder: Path) -> tuple[Plan | None, str]:
    """Return the plan of the run in a folder, if any, and a message if it is corrupted."""
    path = folder / KEPT / "plan.json"
    if not path.is_file():
        return None, ""
    try:
        return read_plan(folder), ""
    except InputError:
        return None, f"{path}: {DAMAGED}"


def _has_own_manifest(plan: Plan, folder: Path) -> bool:
    """Return True if the manifest in the folder belongs to this study."""
    return any(s.is_done for s in states_of(plan, folder) if s.step.outputs == (MANIFEST,))


def _foreign_file(plan: Plan, folder: Path) -> str:
    """Return a file that has the name of an output but is not from this study, as text, or ""."""
    names = [*plan.outputs, MANIFEST, PAGE]
    return next((name for name in names if (folder / name).exists()), "")


def outlook(plan: Plan, states: Sequence[StepState], folder: Path) -> list[StepState]:
    """Return the states, with steps as outdated that a run of the present study would repeat.

    A study that cannot be read or planned any more changes nothing, nor does one that a command
    made.

    Parameters
    ----------
    plan : Plan
        The plan of the run in the folder.
    states : sequence of StepState
        The states of its steps.
    folder : Path
        The folder of the run.
    """
    from rockframe.study.study import read_study  # it imports pydantic

    if plan.of_command:
        return list(states)
    try:
        present = make_plan(read_study(plan.study_files[0].path), folder)
        would = {state.step.name: state for state in states_of(present, folder)}
    except RockframeError:
        return list(states)
    later = [would.get(state.step.name, state) for state in states]
    return [
        changed(state, state="outdated", reason=then.reason)
        if state.is_done and not then.is_done
        else state
        for state, then in zip(states, later, strict=True)
    ]
