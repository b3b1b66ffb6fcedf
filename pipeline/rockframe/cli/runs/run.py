"""rockframe run: run all stages of a study, or resume an interrupted run."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.options import add_options, folder_to_write, path
from rockframe.options.execution import ExecutionOptions

if TYPE_CHECKING:
    from rockframe.runs.plan import Plan
    from rockframe.runs.run import Outcome


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the study, the folder of its run, and where it is computed."""
    parser.add_argument("study", type=path, help="study file (TOML); `rockframe init` writes one")
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder of the run")
    parser.add_argument(
        "--replace",
        action="store_true",
        help="remove the run of another study from the folder",
    )
    parser.add_argument(
        "--plan", action="store_true", help="write only the plan, for a workflow that performs it"
    )
    add_options(parser, ExecutionOptions)


def run(options: argparse.Namespace) -> int:
    """Perform the steps that are not done yet, and print what was done."""
    from rockframe.cli.arguments import chosen_engine
    from rockframe.cli.console import progress_bar, show_json
    from rockframe.results.tables.rejections import rejections_of
    from rockframe.runs.plan import make_plan
    from rockframe.runs.run import Watch, run_plan
    from rockframe.study.study import read_study

    study = read_study(options.study)
    plan = make_plan(study, options.output)
    if options.plan:
        return _write_plan(plan, options)
    try:
        with progress_bar(study.name) as progress:
            outcome = run_plan(
                plan,
                options.output,
                engine=chosen_engine(options),
                replace=options.replace,
                watch=Watch(_warn, lambda _name, done, total: progress(done, total)),
            )
    except KeyboardInterrupt:
        again = "what is done stays done, and the same command resumes"
        raise KeyboardInterrupt(again) from None
    rejected = rejections_of(options.output)
    if options.json:
        show_json(
            {
                "study": study.name,
                "output": str(options.output),
                "steps_done": list(outcome.done),
                "made_again": list(outcome.faults),
                "rejected": rejected,
            }
        )
    else:
        _show(options.output, outcome, rejected)
    return 1 if rejected else 0


def _write_plan(plan: Plan, options: argparse.Namespace) -> int:
    from rockframe.cli.console import show_json
    from rockframe.runs.lock import locked
    from rockframe.runs.run import Watch, prepare

    with locked(options.output):
        states, _ = prepare(plan, options.output, replace=options.replace, watch=Watch(_warn))
    to_do = [state.step.name for state in states if not state.is_done]
    if options.json:
        show_json({"study": plan.study, "steps": len(plan.steps), "to_do": to_do})
    else:
        print(f"{plan.study}: {len(plan.inputs)} inputs, {len(plan.steps)} steps")
    return 0


def _warn(text: str) -> None:
    print(f"rockframe: {text}", file=sys.stderr)


def _show(folder: Path, outcome: Outcome, rejected: dict[str, str]) -> None:
    from rockframe.provenance import MANIFEST, listed_outputs

    files = len(listed_outputs(folder / MANIFEST)) + 1
    did = f"{len(outcome.done)} steps done" if outcome.done else "nothing to do"
    print(f"{did}; {files} files in {folder}")
    for what, reason in rejected.items():
        print(f"rockframe: rejected: {what}: {reason}", file=sys.stderr)
