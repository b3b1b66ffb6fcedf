"""`rockframe`: parse the command line, run the verb, turn what the user can mend into one line."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version

from rockframe.cli import fetch, formats, ingest, pulse, respond, table1
from rockframe.errors import RockframeError

_VERBS = (table1, fetch, ingest, pulse, respond, formats)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rockframe",
        description="From strong-motion records to the rocking response of free-standing frames: "
        "pulses, histories, stability verdicts.",
        epilog="Exit status: 0 done; 1 done, but some records were rejected or are missing (they "
        "are listed); "
        "2 something for you to mend, said in one line.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {version('rockframe')}")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in _VERBS:
        name = module.__name__.rsplit(".", 1)[-1]
        summary = (module.__doc__ or "").split(": ", 1)[1].rstrip(".\n")
        verb = verbs.add_parser(
            name, help=summary, description=f"{summary[:1].upper()}{summary[1:]}."
        )
        module.add_arguments(verb)
        verb.add_argument("--json", action="store_true", help="print JSON instead of tables")
        verb.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after the command's name; those of the process by default.

    Returns
    -------
    int
        Exit status: 0 done, 1 done with rejected records, 2 the user's mistake, 130 interrupted.
    """
    options = _parser().parse_args(arguments)
    try:
        status: int = options.run(options)
        sys.stdout.flush()
    except RockframeError as error:
        print(f"rockframe: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("rockframe: interrupted; nothing half-written was left behind.", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of our output has gone: `rockframe ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return status
