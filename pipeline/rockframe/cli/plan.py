"""rockframe plan: write what a run of a study is to do, for a workflow that then does it."""

from __future__ import annotations

import argparse
import sys

from rockframe.cli.arguments import path
from rockframe.cli.outputs import folder_to_write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study, and the folder of its run."""
    add_study(parser)


def add_study(parser: argparse.ArgumentParser) -> None:
    """What `plan` and `run` have in common."""
    parser.add_argument("study", type=path, help="study file (TOML); `rockframe init` writes one")
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder of the run")
    parser.add_argument(
        "--replace",
        action="store_true",
        help="remove the run of another study that the folder holds",
    )


def run(options: argparse.Namespace) -> int:
    """Write the plan; what is done already stays done."""
    from rockframe.cli.console import show_json
    from rockframe.runs import Watch, locked, make_plan, prepare
    from rockframe.study import read_study

    plan = make_plan(read_study(options.study), options.output)
    with locked(options.output):
        states, _ = prepare(plan, options.output, replace=options.replace, watch=Watch(warn))
    todo = [state.step.name for state in states if not state.is_done]
    if options.json:
        show_json({"study": plan.study, "steps": len(plan.steps), "to_do": todo})
    else:
        print(f"{plan.study}: {len(plan.inputs)} inputs, {len(plan.steps)} steps")
    return 0


def warn(text: str) -> None:
    """Say what was found, and is mended."""
    print(f"rockframe: {text}", file=sys.stderr)
