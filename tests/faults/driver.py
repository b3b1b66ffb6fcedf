"""`rockframe` with a pool that starts at once; by default a small study starts none."""

from __future__ import annotations

import argparse
import sys

from rockframe.cli import arguments
from rockframe.cli.main import main
from rockframe.engines.engine import ProcessPool


# the arguments of `chosen_engine`, which it replaces
def at_once(options: argparse.Namespace, *, shares_folder: bool = True) -> ProcessPool:  # noqa: ARG001
    return ProcessPool(2, patience=0.0)


if __name__ == "__main__":
    arguments.chosen_engine = at_once
    sys.exit(main())
