"""`rockframe` with a pool that starts at once; by default a small study starts none."""

from __future__ import annotations

import argparse
import sys

from rockframe.cli import arguments
from rockframe.cli.main import main
from rockframe.engines.engine import ProcessPool


def at_once(options: argparse.Namespace) -> ProcessPool:  # noqa: ARG001 -- as the command calls it
    return ProcessPool(2, patience=0.0)


if __name__ == "__main__":
    arguments.chosen_engine = at_once
    sys.exit(main())
