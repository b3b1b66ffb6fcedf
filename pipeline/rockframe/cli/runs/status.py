"""rockframe status: show the progress of the run in a folder."""

from __future__ import annotations

import argparse
from collections import Counter

from rockframe.cli.options import path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument: the folder of a run."""
    parser.add_argument("folder", type=path, help="folder of the run of a study")


def run(options: argparse.Namespace) -> int:
    """Hash the files and print the state of each step."""
    from rockframe.cli.console import show_json, show_table
    from rockframe.provenance import source_code_hash
    from rockframe.runs.lock import is_locked
    from rockframe.runs.manifest import changed_inputs
    from rockframe.runs.plan_file import read_plan
    from rockframe.runs.run import status_of
    from rockframe.runs.state import damaged

    plan = read_plan(options.folder)
    states = status_of(options.folder)
    running = is_locked(options.folder)
    changed = dict(changed_inputs(plan))
    same_source = plan.source == source_code_hash()
    told = [f"{path}: {what}" for path, what in damaged(options.folder, plan.files).items()]
    faults = list(dict.fromkeys([*told, *(state.fault for state in states if state.fault)]))
    complete = all(state.is_done for state in states) and not faults
    if options.json:
        steps = [{"name": s.step.name, "state": s.state, "fault": s.fault} for s in states]
        counts = dict(Counter(s.state for s in states))
        show_json(
            {
                "study": plan.study,
                "complete": complete,
                "running": running,
                "counts": counts,
                "faults": faults,
                "inputs_changed": changed,
                "same_source": same_source,
                "steps": steps,
            }
        )
        return 0
    rows: dict[str, Counter[str]] = {}
    for state in states:
        rows.setdefault(state.step.stage, Counter())[state.state] += 1
    shown = [[rule, ", ".join(f"{n} {what}" for what, n in c.items())] for rule, c in rows.items()]
    print(f"{plan.study} in {options.folder}")
    show_table("", ["stage", "steps"], shown)
    for fault in faults:
        print(f"{fault}.")
    if changed:
        path, how = next(iter(changed.items()))
        many = f"{len(changed)} of {len(plan.inputs)} inputs changed or vanished"
        print(f"{many} since this was planned: {path} {how}.")
    if not same_source:
        print("made by another version of the source code: `rockframe run` would make it again")
    print("complete" if complete else "a run is at work" if running else "not complete")
    return 0
