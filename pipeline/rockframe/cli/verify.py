"""rockframe verify: hash, open and compare the files of a run."""

from __future__ import annotations

import argparse
import sys

from rockframe.cli.arguments import path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder of a run."""
    parser.add_argument("folder", type=path, help="folder of a run, with its manifest.json")


def run(options: argparse.Namespace) -> int:
    """Verify and print; 0 only if the run is whole."""
    from rockframe.cli.console import show_json
    from rockframe.cli.report import strange_report
    from rockframe.stages import verify_run

    found = verify_run(options.folder)
    faults = (*found.faults, *strange_report(options.folder))
    if options.json:
        show_json(
            {
                "files": found.files,
                "records": {name: len(held.records) for name, held in found.datasets.items()},
                "faults": faults,
                "same_source": found.same_source,
                "whole": not faults,
            }
        )
    else:
        for name, held in found.datasets.items():
            print(f"{name}: {len(held.records)} records")
        if not found.same_source:
            print("made by another version of the source code")
        if not faults:
            print(f"{options.folder}: whole; all {found.files} files are as the manifest says")
    for fault in faults:
        print(f"rockframe: fault: {fault}", file=sys.stderr)
    return 1 if faults else 0
