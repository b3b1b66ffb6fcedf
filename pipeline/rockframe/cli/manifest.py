"""rockframe manifest: end the run of a study with the list of all that went in and came out."""

from __future__ import annotations

import argparse

from rockframe.cli.arguments import path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder of a run."""
    parser.add_argument("folder", type=path, help="folder of a run, with its plan")


def run(options: argparse.Namespace) -> int:
    """Hash everything again, and write the manifest."""
    from rockframe.cli.console import show_json
    from rockframe.runs import finish

    files = finish(options.folder)
    if options.json:
        show_json({"files": files, "output": str(options.folder)})
    else:
        print(f"{files} files in {options.folder}")
    return 0
