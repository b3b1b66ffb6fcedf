"""Pages that follow the package by themselves: all public names, all commands, all formats."""

from __future__ import annotations

import argparse
import contextlib
import inspect
import io
import os
import re
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray

import rockframe
from rockframe.cli.main import main, parser
from rockframe.ingest import FORMATS

_STUB = Path(rockframe.__file__).with_suffix(".pyi")
#: Rooms of the package, in the order in which a reader needs them, with what they are.
_ROOMS: Mapping[str, str] = {
    "record": "Records",
    "ingest": "Reading",
    "frame": "Frames",
    "wavelets": "Wavelets and pulses",
    "matching": "Pulses of records",
    "rocking": "Response",
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
    """Write the generated pages anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    _write_names(folder)
    _write_commands(folder)
    _write_datasets(folder)
    (folder / "formats.txt").write_text(_formats(), encoding="utf-8")


def public_names() -> dict[str, list[str]]:
    """Return the public names by the room they are from, as the stub of the package lists them."""
    found = defaultdict(list)
    stub = _STUB.read_text(encoding="utf-8")
    for room, name in re.findall(r"^from \.(\w+)[.\w]* import (\w+) as", stub, re.MULTILINE):
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
    text = "\n".join([_API, "", _table("", "name", "what it is"), *rows])
    (folder / "api.md").write_text(_index("Python", text, pages), encoding="utf-8")


def _linked(name: str) -> str:
    """Return a name that leads to its place, and the first line of its docstring."""
    thing = getattr(rockframe, name)
    said = (inspect.getdoc(thing) or "").partition("\n")[0] if callable(thing) else _NAMED[name]
    return f"{{py:obj}}`~rockframe.{name}` | {_code(said)}"


def _code(text: str) -> str:
    """Keep what is literal, and options, as they are typed."""
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
    # The help of a terminal of one width, whatever this one has.
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
    return "\n".join([_table("format", "usual endings", "what it is", "in obspy"), *rows, ""])


def _write_datasets(folder: Path) -> None:
    """Variables of the files that the stages write, as they are in files just written."""
    with tempfile.TemporaryDirectory() as made:
        home = Path(made)
        records = home / "records.nc"
        rockframe.ingest_stage([rockframe.bundled_records() / "Ridgecrest2019-CCC.V1"], records)
        rockframe.pulse_stage(records, home / "pulses.nc")
        (home / "hazard.csv").write_text("pga_g,annual_rate\n0.05,0.05\n0.8,0.0002\n")
        for words in _FURTHER:
            with contextlib.redirect_stdout(io.StringIO()):
                main([word.format(home=home) for word in words.split()])
        for path in sorted(home.glob("*.nc")):
            with xarray.open_dataset(path) as dataset:
                text = _variables(dataset)
            (folder / f"dataset-{path.stem}.txt").write_text(text, encoding="utf-8")


def _variables(dataset: xarray.Dataset) -> str:
    rows = [
        f"| `{name}` | {', '.join(map(str, array.dims))} | {array.attrs.get('units', '')} "
        f"| {_said(array)} |"
        for name, array in dataset.variables.items()
    ]
    return "\n".join([_table("variable", "dimensions", "unit", "what it is"), *rows, ""])


def _said(array: xarray.Variable) -> str:
    flags = ""
    if "flag_meanings" in array.attrs:
        kind = "flag_values" if "flag_values" in array.attrs else "flag_masks"
        values = map(str, np.atleast_1d(array.attrs[kind]))
        meanings = array.attrs["flag_meanings"].split()
        flags = ": " + ", ".join(f"{v} {m}" for v, m in zip(values, meanings, strict=True))
    return (str(array.attrs.get("long_name", "")) + flags).replace("|", r"\|")


def _table(*heads: str) -> str:
    return f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}"


def _fenced(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```\n"


def _index(title: str, text: str, pages: Sequence[str]) -> str:
    listed = "\n".join(pages)
    return f"# {title}\n\n{text}\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n"


#: Files of further commands, as small as they come.
_FURTHER = (
    "respond {home}/records.nc --pulses {home}/pulses.nc --output {home}/response.nc",
    "screen {home}/records.nc --pulses {home}/pulses.nc --structure slender-frame --scales 1 "
    "--hazard {home}/hazard.csv --design-dimension height --design-range 2 4 --design-steps 2 "
    "--histories all --output {home}/screen.nc",
    "spectrum --wavelet symmetric_ricker --slenderness-deg 14 --mass-ratio 0 --frequency-ratio 3 "
    "--max-amplitude 4 --output {home}/spectrum.nc",
    "spectrum --records {home}/records.nc --slenderness-deg 10 --column-period 5 "
    "--output {home}/rocking.nc",
)

_API = """All public names are in `rockframe` itself: `import rockframe`, then `rockframe.respond`.
Arrays are of NumPy, in SI units; angles are in rad. What a user can mend is raised as a child of
{py:class}`rockframe.RockframeError`, in one line that says what is wrong, and what it must be."""

#: What the mappings are; their repr would be a page.
_NAMED = {
    "RICKERS": "The two wavelets of Makris and Vassiliou (2013), by name",
    "WAVELETS": "All wavelets, by name, in the order of tables and datasets",
}

_COMMANDS = """What each command prints as its `--help`. All take `--json`.

"""
