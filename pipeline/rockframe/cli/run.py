"""Commands of runs: init, run, status, step."""

from __future__ import annotations

import argparse
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, folder_to_write, path
from rockframe.errors import InputError, ParameterError, RockframeWarning, require_known
from rockframe.interruption import keeping
from rockframe.options import STRUCTURES
from rockframe.options.model import ExecutionOptions

if TYPE_CHECKING:
    from rockframe.engines.engine import Engine
    from rockframe.runs.plan import Plan
    from rockframe.runs.state import StepState

_RESTRAINTS: Final = ("tendon", "dissipater", "abutment")
_RESUMES: Final = "finished steps are kept; the same command resumes"


def add_run(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the study, the folder of its run, and where it is computed."""
    parser.add_argument("study", type=path, help="study file (TOML); `rockframe init` writes one")
    parser.add_argument(
        "--output", "-o", type=folder_to_write, required=True, help="folder of the run"
    )
    parser.add_argument(
        "--replace",
        action="store_true",
        help="remove the run of another study from the folder",
    )
    parser.add_argument(
        "--plan", action="store_true", help="write only the plan, for a workflow that performs it"
    )
    parser.add_argument(
        "--no-shared-folder",
        action="store_true",
        help="the workers of the scheduler cannot read the folder: steps are performed here, and "
        "send records to the workers",
    )
    add_options(parser, ExecutionOptions)


def run_run(options: argparse.Namespace) -> int:
    """Perform the steps that are not done yet, and print what was done."""
    from rockframe.results.tables.entries import rejected_inputs, rejections_of
    from rockframe.runs.plan import make_plan
    from rockframe.study.study import read_study

    study = read_study(options.study)
    plan = make_plan(study, options.output)
    if options.plan:
        _write_plan(plan, options)
        return 0
    done, faults, reasons = carry_out(
        plan, options.output, engine=_engine(options), replace=options.replace
    )
    rejected = rejected_inputs(options.output)
    if options.json:
        console.show_json(
            {
                "study": study.name,
                "output": str(options.output),
                "steps_done": done,
                "reasons": reasons,
                "made_again": faults,
                "rejected": rejections_of(options.output),
            }
        )
        return 1 if rejected else 0
    _show(options.output, len(done))
    return console.show_rejections(rejected)


def carry_out(
    plan: Plan, folder: Path, *, engine: Engine | None = None, replace: bool = False
) -> tuple[list[str], list[str], dict[str, str]]:
    """Perform the steps of a plan that are not done, and report progress, faults and reasons.

    Returns the names of the performed steps, the faults, and why each step was performed.
    """
    from rockframe.runs.run import run_plan

    reasons: dict[str, str] = {}

    def on_start(waiting: Sequence[StepState]) -> None:
        reasons.update((state.step.name, state.reason) for state in waiting)
        _explain(waiting)

    progress = console.progress_of_steps(plan.study)
    with keeping(_RESUMES), _warned_of(folder), progress as (on_step, on_progress):
        done, faults = run_plan(
            *(plan, folder),
            engine=engine,
            replace=replace,
            on_fault=_warn,
            on_start=on_start,
            on_step=on_step,
            on_progress=on_progress,
        )
    return done, faults, reasons


@contextmanager
def _warned_of(folder: Path) -> Iterator[None]:
    """Do not warn of the copy of the structures in a run: the plan warned of the user's file."""
    with warnings.catch_warnings():
        copy = re.escape(f"{folder / STRUCTURES}:")
        warnings.filterwarnings("ignore", message=copy, category=RockframeWarning)
        yield


def _engine(options: argparse.Namespace) -> Engine | None:
    """Return the stated engine; None leaves the choice to the run, which may have nothing to do."""
    if chosen(options, ExecutionOptions) == ExecutionOptions() and not options.no_shared_folder:
        return None
    return arguments.chosen_engine(options, shares_folder=not options.no_shared_folder)


def _write_plan(plan: Plan, options: argparse.Namespace) -> None:
    from rockframe.runs.run import prepare
    from rockframe.runs.state import locked

    with locked(options.output):
        states, _ = prepare(plan, options.output, replace=options.replace, on_fault=_warn)
    to_do = [state.step.name for state in states if not state.is_done]
    if options.json:
        reasons = {state.step.name: state.reason for state in states if not state.is_done}
        console.show_json(
            {"study": plan.study, "steps": len(plan.steps), "to_do": to_do, "reasons": reasons}
        )
    else:
        print(f"{plan.study}: {len(plan.inputs)} inputs, {len(plan.steps)} steps")


def _explain(waiting: Sequence[StepState]) -> None:
    """Print why steps are repeated, one line for equal reasons of a stage."""
    from rockframe.runs.reasons import NOT_YET

    counts = Counter((s.step.stage, s.reason) for s in waiting if s.reason != NOT_YET)
    for (stage, reason), count in counts.items():
        many = f" ({count} steps)" if count > 1 else ""
        console.complain(f"repeating {stage}{many}: {reason}")


def _warn(text: str) -> None:
    console.complain(text)


def _restrained(structures: Iterable[Any]) -> str:
    """Return the names of the restrained frames, each with its restraints; "" if none is."""
    tables = {s.name: [key for key in _RESTRAINTS if getattr(s, key, None)] for s in structures}
    return ", ".join(f"{name} ({', '.join(own)})" for name, own in tables.items() if own)


def _show(folder: Path, done: int) -> None:
    from rockframe.provenance import MANIFEST, listed_outputs
    from rockframe.results.tables.entries import rows_of
    from rockframe.study.structures import read_structures

    files = len(listed_outputs(folder / MANIFEST))
    summary = list(rows_of(folder / "summary.csv"))
    console.show_first(summary)
    console.show_summary(summary)
    with _warned_of(folder):
        restrained = _restrained(read_structures(folder / STRUCTURES)) if summary else ""
    if restrained:
        print(f"With their restraints: {restrained}. `[compare]` has them without.")
    did = f"{done} steps done" if done else "nothing to do"
    print(f"{did}; {files} files and their manifest in {folder}")


def add_status(parser: argparse.ArgumentParser) -> None:
    """Add the argument: the folder of a run."""
    parser.add_argument("folder", type=path, help="folder of the run of a study")


def run_status(options: argparse.Namespace) -> None:
    """Hash the files and print the state of each step."""
    from rockframe.provenance import source_code_hash
    from rockframe.results.tables.entries import left_out_of
    from rockframe.runs.run import outlook
    from rockframe.runs.state import (
        changed_inputs,
        damaged,
        faults_of,
        is_locked,
        read_plan,
        states_of,
    )

    plan = read_plan(options.folder)
    planned = states_of(plan, options.folder)
    running = is_locked(options.folder)
    inputs = (*plan.inputs, *plan.study_files)
    faults = faults_of(damaged(options.folder, plan.files), planned)
    complete = all(state.is_done for state in planned) and not faults
    states = outlook(plan, planned, options.folder)
    left_out = {} if faults else left_out_of(options.folder)  # a corrupted file cannot be read
    facts = {
        "study": plan.study,
        "complete": complete,
        "running": running,
        "counts": dict(Counter(state.state for state in states)),
        "faults": faults,
        "inputs_changed": dict(changed_inputs(inputs)),
        "left_out": left_out,
        "same_source": plan.source == source_code_hash(),
    }
    if options.json:
        steps = [
            {"name": s.step.name, "state": s.state, "fault": s.fault, "reason": s.reason}
            for s in states
        ]
        console.show_json({**facts, "steps": steps})
    else:
        command = plan.study if plan.of_command else "run"
        _show_status(options.folder, facts, states, len(inputs), f"`rockframe {command}`")


def _show_status(
    folder: Path, facts: Mapping[str, Any], states: Sequence[StepState], inputs: int, again: str
) -> None:
    """Print the state of a run in words; `again` is the command that repeats it."""
    from rockframe.results.tables.notes import reasons_in_words

    print(f"{facts['study']} in {folder}")
    for file, reasons in facts["left_out"].items():
        if reasons:
            print(f"{len(reasons)} left out of {file}: {reasons_in_words(reasons)}")
    _show_states(states)
    for fault in facts["faults"]:
        print(f"{fault}.")
    changed = facts["inputs_changed"]
    if changed:
        path, how = next(iter(changed.items()))
        many = f"{len(changed)} of {inputs} inputs changed or are missing"
        print(f"{many} since the run was planned: {path} {how}.")
        print(f"{again} would repeat the steps that depend on them")
    if not facts["same_source"]:
        print(f"made by another version of the source code: {again} would repeat the run")
    done = "complete for the inputs as planned" if changed else "complete"
    waits = "a run is in progress" if facts["running"] else "not complete"
    print(done if facts["complete"] else waits)


def _show_states(states: Sequence[StepState]) -> None:
    """Print the number of steps in each state and why they run, for each stage."""
    rows: dict[str, Counter[str]] = {}
    reasons: dict[str, dict[str, None]] = {}
    for state in states:
        rows.setdefault(state.step.stage, Counter())[state.state] += 1
        reasons.setdefault(state.step.stage, {})[state.reason] = None
    shown = [
        [stage, ", ".join(f"{n} {state}" for state, n in c.items()), _joined(reasons[stage])]
        for stage, c in rows.items()
    ]
    console.show_table("", ["stage", "steps", "why"], shown)


def _joined(reasons: Iterable[str]) -> str:
    """Return the first reasons of a stage, for a cell of a table."""
    first, *others = [reason for reason in reasons if reason] or [""]
    return first + (f" and {len(others)} other reasons" if others else "")


def add_step(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, the name of a step, and how it is computed."""
    parser.add_argument("folder", type=path, help="folder of the run, which contains its plan")
    parser.add_argument("name", help="name of the step, as `rockframe status --json` lists it")
    add_options(parser, ExecutionOptions)


def run_step(options: argparse.Namespace) -> int:
    """Perform the step. Return 1 if records were rejected."""
    from rockframe.runs.performing import Work, perform
    from rockframe.runs.state import read_plan

    engine = arguments.chosen_engine(options)
    plan = read_plan(options.folder)
    steps = {step.name: step for step in plan.steps}
    require_known("step", options.name, steps)
    step = steps[options.name]
    workers = chosen(options, ExecutionOptions).workers
    folder, origin = options.folder.resolve(), plan.origins[step.name]
    status = perform(Work(step, folder, workers, origin, given=engine))
    if options.json:
        console.show_json(
            {"step": step.name, "outputs": list(step.outputs), "rejected": bool(status)}
        )
    return status


def add_init(parser: argparse.ArgumentParser) -> None:
    """Add the argument: the name of the study."""
    parser.add_argument(
        "name", help="name of the study; NAME.toml is written to the current folder"
    )


def run_init(options: argparse.Namespace) -> None:
    """Write the study file and its schema, unless the study file exists."""
    from pydantic import TypeAdapter, ValidationError

    from rockframe.options.model import Name
    from rockframe.provenance import refuse_obstacles, whole_file
    from rockframe.study.study import SCHEMA, commented_study, schema

    try:
        name = TypeAdapter(Name).validate_python(options.name.removesuffix(".toml"))
    except ValidationError:
        raise ParameterError(
            f"Invalid name {options.name!r}. Must be 1 to 64 letters, digits, points, hyphens or "
            "underscores."
        ) from None
    study, schema_file = Path(f"{name}.toml"), Path(SCHEMA)
    if study.exists():
        raise InputError(study, "exists already. Choose another name.")
    refuse_obstacles([schema_file])
    for file, text in ((study, commented_study(name)), (schema_file, schema())):
        with whole_file(file) as partial:
            partial.write_text(text, encoding="utf-8")
    if options.json:
        console.show_json({"study": str(study), "schema": str(schema_file)})
    else:
        print(f"{study}, {schema_file}")
        print(f"rockframe run {study} --output {name}")
