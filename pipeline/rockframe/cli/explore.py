"""rockframe explore: show the response in a browser while the structure and the motion change."""

from __future__ import annotations

import argparse
import os
import secrets
import socket
import sys
import warnings
import webbrowser
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import whole_number
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.interruption import raising

if TYPE_CHECKING:
    from rockframe.explorer.answer import ExploredMotion
    from rockframe.options.pulse import PulseOptions
    from rockframe.results.records import RecordsFile
    from rockframe.stages.respond import Pair
    from rockframe.study.kinds import Structure

_HIGHEST_PORT: Final = 65535
#: Packages of the extra `explorer`.
_EXTRA: Final = ("h11", "starlette", "uvicorn")


def add_explore(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the port."""
    arguments.add_records(parser)
    parser.add_argument(
        "--port",
        type=_port,
        default=0,
        metavar="N",
        help="port to listen on (default: any free port)",
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="print the address without opening a browser"
    )
    arguments.add_structures(parser)


def run_explore(options: argparse.Namespace) -> None:
    """Read the records, print the address, and serve until interrupted."""
    from rockframe.stages.common import choose_structures

    try:
        from rockframe.explorer.server import LOOPBACK, application, run_server
    except ImportError as error:
        package = (error.name or "").partition(".")[0]
        if package not in _EXTRA:
            raise
        missing = isinstance(error, ModuleNotFoundError) and error.name == package
        reason = f"{package} is not installed" if missing else f"{package} is of another version"
        raise ParameterError(
            f"{reason}. Install the explorer with: pip install 'rockframe[explorer]'."
        ) from None
    structures = _shown(choose_structures(arguments.chosen_structures(options), options.structure))
    with _listening(LOOPBACK, options.port) as listening:
        motions = _motions(options)
        port = listening.getsockname()[1]
        token = secrets.token_urlsafe(24)
        address = f"http://{LOOPBACK}:{port}/{token}/"
        app = application(motions, structures, token, port)
        if options.json:
            console.show_json(
                {"address": address, "records": [s.record.record_id for s in motions]}
            )
        else:
            print(f"{address}\n{len(motions)} motions; Ctrl-C stops the explorer.")
        sys.stdout.flush()
        try:
            with raising():
                if not options.no_browser:
                    webbrowser.open(address)
                run_server(app, listening)
        except KeyboardInterrupt:
            print("rockframe: explorer stopped.", file=sys.stderr)


def _shown(stated: Sequence[Structure]) -> list[Structure]:
    """Return the structures that the page can show; warn about the others."""
    from rockframe.structures.contract import kind_of

    structures = [structure for structure in stated if kind_of(structure).sliders(structure)]
    names = ", ".join(repr(setting.name) for setting in stated if setting not in structures)
    shows = (
        "The explorer shows free frames with prismatic columns, and bents of two columns of one "
        "density, only"
    )
    if not structures:
        raise ParameterError(f"{shows}. State at least one such structure: {names} are not.")
    if names:
        warnings.warn(f"{shows}: without {names}.", RockframeWarning, stacklevel=2)
    return structures


def _motions(options: argparse.Namespace) -> list[ExploredMotion]:
    """Return the horizontal records, each with the vertical component of its station, and after the
    second component of a station both.
    """
    from rockframe.components import vertical_beside
    from rockframe.explorer.answer import PULSE_SEARCH, ExploredMotion
    from rockframe.options.respond import Ensemble
    from rockframe.results.records import open_records
    from rockframe.results.versions import VersionSources
    from rockframe.rocking.response import as_ground
    from rockframe.stages.common import horizontal
    from rockframe.stages.pulse import usable
    from rockframe.stages.respond import pairs_of, with_vertical

    with arguments.records_file(options.records) as (given, _), open_records(given) as file:
        names, everything = set(horizontal(file)), list(file)
        searches: dict[str, PulseOptions | None] = dict.fromkeys(names)
        for name in names:
            with suppress(ParameterError):
                searches[name] = usable(name, file, PULSE_SEARCH)
        sources = VersionSources.of(file, Ensemble(), [*names])
        uncertain = {name: sources.uncertain(file.read(name)) for name in names}
        both = {name: _in_both(file, pair) for name, pair in pairs_of(file).items()}
    beside = vertical_beside(everything)
    motions = []
    for record in everything:
        name = record.record_id
        if name in names:
            ground = with_vertical(record, beside) if name in beside else as_ground(record)
            motions.append(ExploredMotion(record, ground, searches[name], uncertain[name]))
            motions += both.get(name, [])
    return motions


def _in_both(file: RecordsFile, pair: Pair) -> list[ExploredMotion]:
    """Return the motion of both components of a station; none, with a warning, if they do not fit
    together.
    """
    from rockframe.explorer.answer import ExploredMotion
    from rockframe.wobbling import PairAcceleration

    try:
        both = file.in_both(pair.records)
    except ParameterError as error:
        warnings.warn(f"{pair.name}: {error}", RockframeWarning, stacklevel=2)
        return []
    motion = PairAcceleration.from_pair(both, vertical=both.vertical is not None)
    named = replace(both.first, record_id=pair.name, component="both")
    return [ExploredMotion(named, motion, None)]


def _listening(host: str, port: int) -> socket.socket:
    try:
        return socket.create_server((host, port))
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise ParameterError(
            f"port {port} cannot be opened: {reason}. Choose another with --port."
        ) from None


def _port(text: str) -> int:
    if not 0 <= (port := whole_number(text)) <= _HIGHEST_PORT:
        raise argparse.ArgumentTypeError(f"Invalid port {text!r}. Must be 0 to {_HIGHEST_PORT}")
    return port
