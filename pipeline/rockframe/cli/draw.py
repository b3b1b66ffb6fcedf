"""rockframe draw: draw what the stages found: each record with its responses, and all curves."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cli.arguments import path
from rockframe.cli.outputs import folder_to_write

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rockframe.results import TableRow

#: The list of the figures in their folder.
_INDEX: Final = "figures.csv"
#: What the figure of a record is drawn from.
_OF_RECORDS: Final = ("records", "pulses", "response")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files of stages in, a folder of figures out."""
    parser.add_argument(
        "files",
        type=path,
        nargs="+",
        metavar="FILE",
        help="outputs of stages: of ingest, pulse and respond, all three, for a figure of each "
        "record; of screen for fragility and peaks; of spectrum for its curves",
    )
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder to write")
    parser.add_argument(
        "--most",
        type=int,
        default=24,
        metavar="N",
        help="most figures of single records; of more, those under which a structure stands and "
        "turns furthest (default: 24)",
    )


def run(options: argparse.Namespace) -> int:
    """Draw, and say how many."""
    from rockframe.cells import write_rows
    from rockframe.cli.console import show_json
    from rockframe.cli.curves import draw_curves
    from rockframe.errors import ParameterError
    from rockframe.provenance import replaced_folder

    if options.most < 1:
        raise ParameterError(f"Invalid number of figures {options.most}. Must be at least 1.")
    given = _by_kind(options.files)
    _refuse_strange(options.output)
    drawn: dict[str, str] = {}
    with replaced_folder(options.output) as partial:
        if "response" in given:
            drawn |= _draw_records(given, partial, options.most)
        drawn |= draw_curves(given, partial, options.most)
        with (partial / _INDEX).open("w", newline="", encoding="utf-8") as stream:
            write_rows(stream, [("file", "shows"), *drawn.items()])
    if options.json:
        show_json({"figures": drawn, "output": str(options.output)})
    else:
        print(f"{len(drawn)} figures in {options.output}")
    return 0


def _refuse_strange(folder: Path) -> None:
    """Refuse to replace a folder with files that are none of its figures."""
    from rockframe.errors import InputError
    from rockframe.results import rows_of

    index = folder / _INDEX
    figures = [folder / row["file"] for row in rows_of(index) if row.get("file")]
    ours = {index, *figures, *(figure.with_suffix(".caption.txt") for figure in figures)}
    for file in sorted(folder.rglob("*")):
        mark = file.name.startswith(".") and index.is_file()  # of a workflow
        if file not in ours and not mark and (file.is_symlink() or not file.is_dir()):
            unlisted = f"is none of the figures that are replaced: {_INDEX} does not list it."
            raise InputError(file, f"{unlisted} Must be elsewhere.")


def _by_kind(files: Sequence[Path]) -> dict[str, Path]:
    """The files by what they hold: one of a kind, and of records all that their figures want."""
    from rockframe.errors import InputError
    from rockframe.results import kind_of

    given: dict[str, Path] = {}
    for file in files:
        kind = kind_of(file)
        if kind in given:
            raise InputError(file, f"of kind {kind!r}, as is {given[kind]}. Must be one of a kind.")
        given[kind] = file
    missing = [kind for kind in _OF_RECORDS if kind not in given]
    if 0 < len(missing) < len(_OF_RECORDS):
        stated = next(given[kind] for kind in _OF_RECORDS if kind in given)
        raise InputError(
            stated, f"without a file of kind {missing[0]!r}. Must be given with all three."
        )
    return given


def _draw_records(given: Mapping[str, Path], folder: Path, most: int) -> dict[str, str]:
    """What each figure shows, by its file."""
    from rockframe.cli.table import rows_of

    files = tuple(given[kind] for kind in _OF_RECORDS)
    first: dict[str, TableRow] = {}

    def rows() -> Iterator[TableRow]:
        for row in rows_of(*files):  # of very many one of each record is held
            first.setdefault(row.record_id, row)
            yield row

    chosen = _furthest(rows(), given["response"], most)
    draw(first.values(), files, folder, chosen)
    return {f"{name}.png": name for name in chosen}


def draw(
    rows: Iterable[TableRow], files: Sequence[Path], folder: Path, chosen: Sequence[str]
) -> None:
    """Draw one figure for each of the records that are chosen."""
    from rockframe.cli.console import progress_bar
    from rockframe.figures import draw_response_history, save
    from rockframe.results import best_pulses, open_records, open_response, stated_pulse

    by_record = {row.record_id: vars(row) for row in rows}
    pulses = best_pulses(files[1])
    with (
        open_records(files[0]) as records,
        open_response(files[2]) as response,
        progress_bar("drawing") as progress,
    ):
        for i, name in enumerate(chosen):
            figure = draw_response_history(
                records.read(name).acceleration,
                pulses.get(name),
                [response.sel(record=name, structure=s) for s in response.kept(name)],
                f"{by_record[name]['event']}, {by_record[name]['record']}".removeprefix(", "),
                tested=stated_pulse(by_record[name]),
            )
            save(figure, folder / f"{name}.png")
            progress(i + 1, len(chosen))


def _furthest(rows: Iterable[TableRow], response: Path, most: int) -> list[str]:
    """Records with histories; of too many, those under which something turns furthest."""
    from rockframe.results import open_response

    furthest: dict[str, float] = {}
    for row in rows:
        stands = row.verdict in ("safe", "undecided") and math.isnan(row.overturning_time_s)
        ratio = row.peak_rotation_ratio if stands else 0.0
        furthest[row.record_id] = max(ratio, furthest.get(row.record_id, 0.0))
    with open_response(response) as file:
        furthest = {name: ratio for name, ratio in furthest.items() if file.kept(name)}
    chosen = set(sorted(furthest, key=lambda name: -furthest[name])[:most])
    return [name for name in furthest if name in chosen]
