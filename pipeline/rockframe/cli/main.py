"""`rockframe`: parse the command line, run a command, and print a user's errors in one line."""

from __future__ import annotations

import argparse
import atexit
import errno
import io
import os
import re
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from functools import partial
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Any, Final, NoReturn, TextIO, cast

from rockframe import interruption
from rockframe.cells import plain
from rockframe.cli.console import PlainStream
from rockframe.compiled import before_compiling
from rockframe.errors import RockframeError, RockframeWarning, meant
from rockframe.options import STAGES
from rockframe.provenance import __version__, staying
from rockframe.watch import telling

#: The commands in the order of the help, each with its module and summary.
_VERBS: Final = {
    "table1": ("shipped", "run all stages and print the paper's Table 1 for the records"),
    "init": ("run", "write a commented study file and its schema for editors"),
    "run": ("run", "run all stages of a study, or resume an interrupted run"),
    "status": ("run", "show the progress of the run in a folder"),
    "step": ("run", "perform one step of a run (for workflows)"),
    "show": ("show", "show what happened to one record, from its file to its verdicts"),
    "verify": ("results", "verify the files of a run against its manifest"),
    "fetch": ("stages.ingest", "download and verify records of an event from an FDSN data centre"),
    "ingest": ("stages.ingest", "read and check record files, and write records.nc"),
    "select": ("stages.select", "select and scale records whose spectra match a target"),
    **{stage.name: (stage.command, stage.summary) for stage in STAGES.values() if stage.command},
    "table": ("results", "write the table of records, pulses and responses"),
    "export": (
        "results",
        "write the fragilities of a screening for OpenQuake, oq-vmtk and Pelicun",
    ),
    "figure": ("figure", "draw one figure by its name, or all figures of outputs of stages"),
    "report": ("results", "write an HTML page of a run that works without a network"),
    "explore": (
        "explore",
        "show the response in a browser while the structure and the motion change",
    ),
    "paper": ("shipped", "check the paper's numbers and claims, and draw its figures"),
    "formats": (
        "formats",
        "list the supported formats of records, or show how files would be read",
    ),
}
#: Commands of earlier versions, and what does their work now.
_FORMER: Final = {"draw": "figure", "plan": "run --plan"}
#: An example of each command, printed below its help.
EXAMPLES: Final = {
    "table1": "rockframe table1 --records FOLDER --structures bents.toml -o outputs/mine",
    "init": "rockframe init mine",
    "run": "rockframe run mine.toml -o outputs/mine",
    "status": "rockframe status outputs/mine",
    "step": "rockframe step outputs/mine manifest",
    "show": "rockframe show outputs/mine Ridgecrest2019-CCC-360",
    "verify": "rockframe verify outputs/mine",
    "fetch": "rockframe fetch --url SCEDC --event ci38457511 --radius-km 50 -o ridgecrest",
    "ingest": "rockframe ingest FOLDER -o records.nc",
    "pulse": "rockframe pulse records.nc -o pulses.nc",
    "respond": "rockframe respond records.nc --structures bents.toml -o response.nc",
    "spectrum": "rockframe spectrum --slenderness-degree 14 --mass-ratio 0 4 -o spectrum.nc",
    "screen": "rockframe screen records.nc --structures bents.toml -o screen.nc",
    "compare": "rockframe compare records.nc --structures bridge.toml -o compare.nc",
    "select": "rockframe select records.nc --target spectrum.csv -o selected.nc",
    "table": "rockframe table records.nc pulses.nc response.nc -o table.csv",
    "export": "rockframe export screen.nc -o fragility.xml",
    "figure": "rockframe figure joints --structure bridge-bent -o joints.png",
    "report": "rockframe report outputs/mine",
    "explore": "rockframe explore --records FOLDER",
    "paper": "rockframe paper --claim eq-45",
    "formats": "rockframe formats",
}
#: The options that most people use, of commands with many; the help lists the others below them.
FIRST: Final[Mapping[str, tuple[str, ...]]] = {
    "table1": (
        *("--records", "--structures", "--structure", "--output", "--units", "--time-step-s"),
        *("--catalogue", "--vertical", "--margins", "--format"),
    ),
    "fetch": (
        *("--url", "--event", "--start", "--end", "--network", "--station", "--channel"),
        *("--max-radius", "--radius-km", "--output"),
    ),
    "ingest": (
        *("--output", "--units", "--time-step-s", "--column", "--channels", "--catalogue"),
        *("--station-xml", "--trust", "--uncorrected", "--format"),
    ),
    "select": (
        *("--output", "--target", "--motions", "--periods-s", "--scale-bounds"),
        *("--scale-period-s", "--scale-pgv-m-s", "--most-per-station", "--pulses", "--figure"),
    ),
    "pulse": (
        *("--output", "--wavelet", "--pulse-wavelet", "--periods-s", "--runners-up"),
        *("--surrogates", "--paper", "--format", "--batch", "--workers"),
    ),
    "respond": (
        *("--output", "--structures", "--structure", "--vertical", "--margins", "--histories"),
        *("--forces", "--scales", "--figures", "--format"),
    ),
    "screen": (
        *("--output", "--structures", "--structure", "--pulses", "--scales", "--margins"),
        *("--scenario-members", "--limit-peak-rotation-ratio", "--hazard", "--format"),
    ),
    "spectrum": (
        *("--wavelet", "--slenderness-degree", "--mass-ratio", "--frequency-ratio"),
        *("--half-cycles", "--records", "--output", "--format", "--workers"),
    ),
    "figure": (
        *("--output", "--most", "--records", "--record", "--vertical", "--structures"),
        *("--structure", "--friction", "--spacing", "--grid"),
    ),
    "formats": (
        *("--units", "--time-step-s", "--column", "--channels", "--time-column"),
        *("--skip-lines", "--separator", "--decimal", "--first-line", "--trust"),
    ),
}
#: Shells in which `rockframe --completion` works.
SHELLS: Final = ("bash", "zsh", "fish")
#: Exit status of an internal error, as in sysexits.h.
_FAULT: Final = 70
#: Disk space that the cache of compiled code needs [bytes].
_CACHE_ROOM: Final = 16_000_000


#: Printed before the first compilation of a process; later processes read the code from the cache.
_COMPILING: Final = (
    "rockframe: compiling the kernels for this computer, which the first commands do once."
)

#: System errors on any file or stream that the user can correct, and what to do.
_OF_SYSTEM: Final = {
    errno.EMFILE: "Raise the limit of open files: ulimit -n 1024.",
    errno.ENFILE: "Close other programs.",
}
#: System errors on streams that the user can correct; for files, the code that writes reports them.
_OF_STREAM: Final = frozenset([errno.EBADF, errno.EFBIG, errno.EIO, errno.ENOSPC])

#: Commands that read records, and whose users may look there for an option of `ingest`.
_OF_RECORDS: Final = (
    *("table1", "paper", "select", "pulse", "respond", "spectrum", "screen", "compare"),
    *("figure", "explore"),
)
#: Negative numbers; argparse would treat -1e-5 and -inf as options.
_NEGATIVE: Final = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|-inf", re.IGNORECASE)


def _options_of(parser: argparse.ArgumentParser) -> list[str]:
    """Return the options of a parser, from its help if argparse has no list of them."""
    listed = getattr(parser, "_option_string_actions", None)
    return [*listed] if listed is not None else re.findall(r"--[a-z][\w-]*", parser.format_help())


def _documentation() -> str:
    """Return the address of the documentation, from the metadata of the installed package."""
    from importlib.metadata import PackageNotFoundError, metadata

    try:
        urls = metadata("rockframe").get_all("Project-URL") or ()
    except PackageNotFoundError:
        return ""
    place = dict(url.split(", ", 1) for url in urls).get("Documentation", "")
    return "" if "//owner." in place else place  # the placeholder of a project without an address


class _Parser(argparse.ArgumentParser):
    """A parser that prints errors in one line, without the usage that argparse prints.

    The help of a command with many options begins with those of `FIRST`; the usage names only
    what must be stated.
    """

    _words: Sequence[str] = ()
    _further: Any = None
    _stated: tuple[argparse.Action, ...] = ()

    def add_argument(self, *names: Any, **how: Any) -> argparse.Action:
        """Add an argument; an option that few people use goes to a group of its own."""
        *_, command = self.prog.split()
        first = FIRST.get(command)
        if first is None or not {"--help", "--json", *first}.isdisjoint(names):
            place: Any = super()
        elif not names[0].startswith("-"):
            place = super()
        else:
            self._further = self._further or self.add_argument_group("further options")
            place = self._further
        action: argparse.Action = place.add_argument(*names, **how)
        self._stated = (*self._stated, action)
        return action

    def _parse_optional(self, word: str) -> Any:
        return None if _NEGATIVE.fullmatch(word) else super()._parse_optional(word)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse words; unknown words are an error of the command that they follow."""
        self._words = list(args or ())
        parsed, rest = super().parse_known_args(args, namespace)
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}")
        return parsed, rest

    def format_help(self) -> str:
        """Return the help, with an example of the command and the place of the documentation."""
        *_, command = self.prog.split()
        if command in FIRST:
            required = [action for action in self._stated if action.required]
            named = " ".join(_as_used(action) for action in sorted(required, key=_is_positional))
            self.usage = f"%(prog)s [options] {named}".rstrip()
        example = EXAMPLES.get(command, "rockframe table1, then rockframe report outputs/table1")
        where = f"Documentation: {place}\n" if (place := _documentation()) else ""
        return f"{super().format_help()}\nExample: {example}\n{where}"

    def error(self, message: str) -> NoReturn:
        options_here = _options_of(self)
        words = takewhile(lambda word: word != "--", self._words)
        options = (word.partition("=")[0] for word in words if word.startswith("--"))
        unknown = [
            word for word in options if not any(option.startswith(word) for option in options_here)
        ]
        choice = re.search(r"COMMAND: invalid choice: '([^']*)'", message)
        if choice:
            former = _FORMER.get(choice[1])
            hint = f" Did you mean {former}?" if former else meant(choice[1], _VERBS)
            message = f"unknown command {choice[1]!r}.{hint}"
        elif unknown:
            *_, command = self.prog.split()
            where = _where_else(unknown[0]) if command in _OF_RECORDS else ""
            message = f"unknown option {unknown[0]}.{where or meant(unknown[0], options_here)}"
        message = message.rstrip(".")
        end = "" if message.endswith("?") else "."
        self.exit(2, f"rockframe: error: {message}{end} See {self.prog} --help.\n")

    def _print_message(self, message: str, file: Any = None) -> None:
        (file or sys.stderr).write(message)  # argparse would ignore errors of writing

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        sys.stdout.flush()
        super().exit(status, message)


def _is_positional(action: argparse.Action) -> bool:
    return not action.option_strings


def _as_used(action: argparse.Action) -> str:
    """Return an argument that must be stated, as the usage names it."""
    value = str(action.metavar or action.dest.upper()).replace("-", "_")
    if action.nargs == "*":
        return f"[{value} ...]"
    return " ".join([*action.option_strings[:1], value, *["..."] * (action.nargs == "+")])


def _where_else(option: str) -> str:
    """Return that `ingest` has an option, or ""."""
    from rockframe.options.ingest import Filters, IngestOptions

    for name in (*IngestOptions.model_fields, *Filters.model_fields):
        if f"--{name.replace('_', '-')}".startswith(option):
            return " It is one of `rockframe ingest`: give its records.nc to this command."
    return ""


class _Completion(argparse.Action):
    """Print the code that a shell needs to complete commands, and exit."""

    def __call__(
        self, parser: argparse.ArgumentParser, _options: Any, values: Any, _name: str | None = None
    ) -> None:
        from argcomplete.shell_integration import shellcode

        print(shellcode(["rockframe"], shell=values))
        parser.exit()


def _complete() -> None:
    """Answer a shell that completes a line: argcomplete prints the words and ends the process."""
    import argcomplete

    words = os.environ.get("COMP_LINE", "").split()
    argcomplete.autocomplete(parser(words[1] if len(words) > 1 else ""))


def parser(only: str | None = None) -> argparse.ArgumentParser:
    """Return the parser of the command line.

    Parameters
    ----------
    only : str, optional
        Add the arguments of this command only (default: of all commands). The modules of other
        commands are not imported, so that the help appears quickly.
    """
    whole = _Parser(
        prog="rockframe",
        description="From strong-motion records to the rocking response of free-standing frames: "
        "pulses, histories, stability verdicts.",
        epilog="Exit status: 0 done; 1 done, but some records were rejected or are missing (they "
        "are listed); "
        "2 an error that you can correct; 70 an internal error: please report it.",
    )
    whole.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    whole.add_argument(
        "--completion",
        action=_Completion,
        default=argparse.SUPPRESS,
        choices=SHELLS,
        help="print the code that completes commands, options and files at the Tab key in a shell",
    )
    verbs = whole.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (place, summary) in _VERBS.items():
        verb = verbs.add_parser(
            name, help=summary, description=f"{summary[:1].upper()}{summary[1:]}."
        )
        if only in (None, name):
            module = import_module(f"rockframe.cli.{place}")
            getattr(module, f"add_{name}")(verb)
            verb.add_argument("--json", action="store_true", help="print JSON instead of tables")
            verb.set_defaults(run=getattr(module, f"run_{name}"))
    return whole


def call(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Errors are raised, not printed.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after ``rockframe`` (default: those of the process).

    Returns
    -------
    int
        Exit status: 0 done, 1 done with rejected records.

    Raises
    ------
    RockframeError
        If the user can correct the error.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    options = parser(words[0] if words else "").parse_args(words)
    with staying(_place_of(options)):
        return int(options.run(options) or 0)  # None: the command rejects no records


def _place_of(options: argparse.Namespace) -> Path:
    """Return the innermost folder of the command's output that exists already."""
    output = getattr(options, "output", None) or Path()
    return next((path for path in (output, *output.parents) if _is_folder(path)), Path())


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # such as a name that is too long: the command refuses it
        return False


def _move_cache_from_full_disk() -> None:
    """Move numba's cache if its disk is full; without a cache, each process would compile again."""
    folder = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(folder) if folder else Path(__file__).parents[1]
    while not home.exists():
        home = home.parent
    if shutil.disk_usage(home).free < _CACHE_ROOM:
        elsewhere = tempfile.mkdtemp(prefix="rockframe-cache-")
        atexit.register(shutil.rmtree, elsewhere, ignore_errors=True)
        os.environ["NUMBA_CACHE_DIR"] = elsewhere


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after ``rockframe`` (default: those of the process).

    Returns
    -------
    int
        Exit status: 0 done, 1 done with rejected records, 2 an error that the user can correct, 70
        an internal error, with its traceback, 130 interrupted.
    """
    if "_ARGCOMPLETE" in os.environ:
        _complete()
    atexit.register(interruption.ignore)  # nothing is left to interrupt while Python ends
    with interruption.noting() as noted, telling(lambda line: _say(f"rockframe: {line}")):
        status = _main(arguments)
        if noted() and status != interruption.STATUS:  # too late to stop anything
            _say(interruption.said("the command had finished"))
            return interruption.STATUS
        return status


def _main(arguments: Sequence[str] | None) -> int:
    _open_closed_streams()
    _move_cache_from_full_disk()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that cannot show theta prints "?"
    before_compiling(partial(_say, _COMPILING))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("default", RockframeWarning)
            warnings.showwarning = partial(_warn, warnings.showwarning, set())
            with redirect_stdout(cast(TextIO, PlainStream(sys.stdout))):
                status = call(arguments)
        sys.stdout.flush()
    except RockframeError as error:
        _say(f"rockframe: error: {error}")
        return 2
    except KeyboardInterrupt as interrupt:
        _say(interruption.said(str(interrupt)))
        return interruption.STATUS
    except BrokenPipeError:  # the output is closed, as in `rockframe ... | head`
        _discard(sys.stdout)
        return 0
    except Exception as error:  # noqa: BLE001 - status 1, as of Python, means rejections
        message = _system_error(error)
        _say(f"rockframe: error: {message}" if message else traceback.format_exc().rstrip())
        return 2 if message else _FAULT
    return status


def _warn(
    show: Callable[..., None], printed: set[str], message: Any, category: type[Warning], *where: Any
) -> None:
    """Print a warning about the user's values once, in one line; pass other warnings to `show`."""
    if not issubclass(category, RockframeWarning):
        show(message, category, *where)
    elif str(message) not in printed:
        printed.add(str(message))
        _say(f"rockframe: warning: {message}")


def _open_closed_streams() -> None:
    """Connect closed standard streams to os.devnull, so that no file gets their descriptors."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(descriptor, True)  # workers inherit the streams
            setattr(sys, name, os.fdopen(descriptor, "r" if number == 0 else "w"))


def _system_error(error: Exception) -> str:
    """Return the message for a system error that the user can correct, or ""."""
    if not isinstance(error, OSError):
        return ""
    if error.errno in _OF_STREAM and error.filename is None:
        _discard(sys.stdout)
        return f"standard output: cannot be written: {error.strerror}."
    return f"{error.strerror}. {_OF_SYSTEM[error.errno]}" if error.errno in _OF_SYSTEM else ""


def _say(text: str) -> None:
    """Print to the error stream; if it cannot be written, only the exit status reports the
    error.
    """
    try:
        print(plain(text), file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Discard what a stream still holds; Python would try to write it at exit."""
    with suppress(OSError), Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())


if __name__ == "__main__":
    sys.exit(main())
