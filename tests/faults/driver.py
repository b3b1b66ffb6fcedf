"""`rockframe` with a pool that starts at once: a small study would not be worth its start."""

from __future__ import annotations

import sys

from rockframe.cli import computing
from rockframe.cli.main import main
from rockframe.engines import ProcessPool

if __name__ == "__main__":
    computing.engine = lambda _options: ProcessPool(2, patience=0.0)  # type: ignore[assignment]
    sys.exit(main())
