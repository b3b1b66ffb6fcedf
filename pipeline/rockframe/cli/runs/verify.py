"""rockframe verify: verify the files of a run against its manifest."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rockframe.cli.console import show_json
from rockframe.cli.options import path
from rockframe.errors import InputError, ParameterError


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, and the sample to recompute."""
    parser.add_argument(
        "folder", type=path, help="folder of a run, which contains its manifest.json"
    )
    parser.add_argument(
        "--recompute",
        type=int,
        nargs="?",
        const=3,
        metavar="N",
        help="recompute results and compare numbers, to 1e-6 of the largest value of their "
        "variable: pulses and responses of about N records (default: 3), screenings and spectra in "
        "full, which takes as long as in the run",
    )


def run_verify(options: argparse.Namespace) -> int:
    """Verify the run and print the result. Return 0 only if there are no faults."""
    from rockframe.stages.report import strange_report, verify_run

    found = verify_run(options.folder)
    faults = [*found.faults, *strange_report(options.folder), *_plan_faults(options.folder)]
    repeated = _recomputed(options, faults)
    if options.json:
        show_json(
            {
                "files": found.files,
                "records": {name: len(held.records) for name, held in found.datasets.items()},
                "faults": faults,
                "computed_again": repeated,
                "same_source": found.same_source,
                "other_versions": dict(found.other_versions),
                "other_processor": found.other_processor,
                "whole": not faults,
            }
        )
    else:
        for name, held in found.datasets.items():
            print(f"{name}: {len(held.records)} records")
        if not found.same_source:
            print("made by another version of the source code")
        if found.other_versions:
            made = ", ".join(f"{name} {number}" for name, number in found.other_versions.items())
            print(f"made with other versions of libraries: {made}")
        if found.other_processor:
            print(
                f"made on another kind of processor ({found.other_processor}): recomputed "
                "here, numbers may differ in their last digits"
            )
        for what in repeated:
            print(f"recomputed: {what}")
        if not faults:
            print(f"{options.folder}: complete; all {found.files} files match the manifest")
    for fault in faults:
        print(f"rockframe: fault: {fault}", file=sys.stderr)
    return 1 if faults else 0


def _plan_faults(folder: Path) -> list[str]:
    """Return the faults of the plan and of other internal files of the run."""
    from rockframe.runs.plan import KEPT
    from rockframe.runs.plan_file import read_plan
    from rockframe.runs.state import damaged

    faults = [f"{path}: {what}." for path, what in damaged(folder, {}).items()]
    plan = folder / KEPT / "plan.json"
    if plan.is_file():
        try:
            read_plan(folder)
        except InputError as error:
            faults.append(str(error))
    elif plan.parent.is_dir():
        faults.append(f"{plan}: missing. `rockframe run` writes it again.")
    return faults


def _recomputed(options: argparse.Namespace, faults: list[str]) -> list[str]:
    """Recompute results if this is requested and all files are correct; append new faults."""
    from rockframe.runs.recompute import recompute

    if options.recompute is None:
        return []
    if options.recompute < 1:
        raise ParameterError(f"Invalid --recompute {options.recompute}. Must be at least 1.")
    if faults:
        return []
    done, found = recompute(options.folder, options.recompute)
    faults += found
    return done
