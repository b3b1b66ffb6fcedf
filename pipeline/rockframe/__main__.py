"""Run the command line: ``python -m rockframe``."""

from rockframe.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
