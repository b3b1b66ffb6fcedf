"""Generate pages from the package: public names, commands, formats, and variables of datasets."""

from __future__ import annotations

import argparse
import inspect
import os
import re
import shutil
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import rockframe
from rockframe.cli.main import parser
from rockframe.ingest import FORMATS
from rockframe.results.schema import KINDS, Variable

_STUB = Path(rockframe.__file__).with_suffix(".pyi")
#: Rooms of the package with their titles, in the order in which a reader needs them.
_ROOMS: Mapping[str, str] = {
    "record": "Records",
    "ingest": "Reading",
    "frame": "Frames",
    "parts": "Parts of a frame",
    "wavelets": "Wavelets and pulses",
    "matching": "Pulses of records",
    "assessment": "Assessments",
    "rocking": "Response",
    "oscillators": "Isolated decks and monolithic frames",
    "risk": "Statistics of verdicts",
    "components": "Components",
    "signals": "Signals",
    "stages": "Stages",
    "options": "Options of the stages",
    "results": "Files",
    "study": "Files that a user writes",
    "engines": "Engines",
    "errors": "Errors",
}


def write_all(folder: Path) -> None:
    """Write the generated pages."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    _write_names(folder)
    _write_commands(folder)
    _write_datasets(folder)
    (folder / "formats.txt").write_text(_formats(), encoding="utf-8")


def public_names() -> dict[str, list[str]]:
    """Return the public names by room, from the stub of the package."""
    found = defaultdict(list)
    stub = _STUB.read_text(encoding="utf-8")
    for room, name in re.findall(
        r"^from \.(\w+)[.\w]* import ([A-Za-z]\w*) as", stub, re.MULTILINE
    ):
        found[room].append(name)
    return dict(found)


def _write_names(folder: Path) -> None:
    names = public_names()
    rooms = [*_ROOMS, *sorted(set(names) - set(_ROOMS))]
    pages, rows = [], []
    for room in rooms:
        if room not in names:
            continue
        title = _ROOMS.get(room, room)
        directives = [_directive(name) for name in names[room]]
        page = folder / f"api-{room}.rst"
        page.write_text("\n".join([title, "=" * len(title), "", *directives]), encoding="utf-8")
        pages.append(page.stem)
        rows += [f"| | {_linked(name)} |" for name in names[room]]
        rows[-len(names[room])] = f"| {title} | {_linked(names[room][0])} |"
    text = "\n".join([_API, "", _table("", "name", "description"), *rows])
    (folder / "api.md").write_text(_index("Python", text, pages), encoding="utf-8")


def _linked(name: str) -> str:
    """Return a link to the description of a name, and the first line of its docstring."""
    thing = getattr(rockframe, name)
    said = (inspect.getdoc(thing) or "").partition("\n")[0] if callable(thing) else _NAMED[name]
    return f"{{py:obj}}`~rockframe.{name}` | {_code(said)}"


def _code(text: str) -> str:
    """Set literals and options in code font."""
    return re.sub(r"``(.+?)``|(?<![\w-])(--[a-z-]+)", r"`\1\2`", text).replace("|", r"\|")


def _directive(name: str) -> str:
    thing = getattr(rockframe, name)
    if inspect.isclass(thing):
        kind = "autoexception" if issubclass(thing, Exception) else "autoclass"
    elif inspect.isroutine(thing):
        kind = "autofunction"
    else:
        names = ", ".join(f"``{key}``" for key in thing)
        return f".. py:data:: rockframe.{name}\n\n   {_NAMED[name]}: {names}.\n"
    return f".. {kind}:: rockframe.{name}\n"


def _write_commands(folder: Path) -> None:
    # Fix the width of the help, whatever the width of this terminal.
    os.environ["COLUMNS"] = "88"
    whole = parser()
    (verbs,) = (a for a in whole._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001
    pages = []
    for name, verb in verbs.choices.items():
        page = folder / f"command-{name}.md"
        page.write_text(f"# rockframe {name}\n\n{_fenced(verb.format_help())}", encoding="utf-8")
        pages.append(page.stem)
    head = _COMMANDS + _fenced(whole.format_help())
    (folder / "commands.md").write_text(_index("Commands", head, pages), encoding="utf-8")


def _formats() -> str:
    rows = [
        f"| `{f.name}` | {', '.join(f.extensions)} | {_code(f.description)} | `{f.obspy_name}` |"
        for f in FORMATS
    ]
    return "\n".join([_table("format", "usual extensions", "description", "in obspy"), *rows, ""])


def _write_datasets(folder: Path) -> None:
    """Write the declared variables of each kind of file."""
    for kind in KINDS.values():
        heads = _table("variable", "dimensions", "unit", "description")
        rows = (
            f"| `{one.name}` | {', '.join(one.dims)} | {_units(one)} | {_said(one)} |"
            for one in kind.variables
        )
        text = "\n".join([heads, *rows, ""])
        (folder / f"dataset-{kind.name}.txt").write_text(text, encoding="utf-8")


def _units(one: Variable) -> str:
    return f"{one.units} or {one.also_units}" if one.also_units else one.units


def _said(one: Variable) -> str:
    """Return the description of a variable, the meanings of its flags, and its optional group."""
    said = one.long_name
    if one.holds == "flags":
        said += ": " + ", ".join(f"{member.value} {member.name.lower()}" for member in one.dtype)
    said += f"; {one.comment}" if one.comment else ""
    said += f" (only with {one.group})" if one.group else ""
    return (said + (" (only in shards)" if one.of_files == "one batch" else "")).replace("|", r"\|")


def _table(*heads: str) -> str:
    return f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}"


def _fenced(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```\n"


def _index(title: str, text: str, pages: Sequence[str]) -> str:
    listed = "\n".join(pages)
    return f"# {title}\n\n{text}\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n"


_API = """All public names are in `rockframe` itself: `import rockframe`, then `rockframe.respond`.
Arrays are of NumPy, in SI units; angles are in rad. Errors that a user can correct are subclasses
of {py:class}`rockframe.RockframeError`; the message is one line that states what is wrong and what
is allowed."""

#: Descriptions of the mappings, whose repr would fill a page.
_NAMED = {
    "RICKERS": "The two wavelets of Makris and Vassiliou (2013), by name",
    "WAVELETS": "All wavelets, by name, in the order of tables and datasets",
}

_COMMANDS = """The output of `--help` for each command. All commands take `--json`.

"""
