"""rockframe step: perform one step of a run (for workflows)."""

from __future__ import annotations

import argparse

from rockframe.cli.options import add_options, chosen, path
from rockframe.options.execution import ExecutionOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, the name of a step, and how it is computed."""
    parser.add_argument("folder", type=path, help="folder of the run, which contains its plan")
    parser.add_argument("name", help="name of the step, as `rockframe status --json` lists it")
    add_options(parser, ExecutionOptions)


def run(options: argparse.Namespace) -> int:
    """Perform the step. Return 1 if records were rejected."""
    from rockframe.errors import ParameterError
    from rockframe.runs.performing import Work, perform
    from rockframe.runs.plan_file import read_plan

    plan = read_plan(options.folder)
    step = next((step for step in plan.steps if step.name == options.name), None)
    if step is None:
        known = ", ".join(step.name for step in plan.steps)
        raise ParameterError(f"Invalid step {options.name!r}. Must be one of: {known}.")
    workers = chosen(options, ExecutionOptions).workers
    return perform(Work(step, options.folder.resolve(), workers, plan.keys[step.name]))
