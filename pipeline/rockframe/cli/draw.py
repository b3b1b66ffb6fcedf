"""rockframe draw: draw each record with its pulse and the response of all structures."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cli.arguments import path
from rockframe.cli.table import add_stages

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.results import TableRow

#: The list of the figures in their folder.
_INDEX: Final = "figures.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Three files of stages in, a folder of figures out."""
    add_stages(parser)
    parser.add_argument("--output", type=path, required=True, help="folder to write")
    parser.add_argument(
        "--most",
        type=int,
        default=24,
        metavar="N",
        help="most figures; of more records, those under which a structure stands and turns "
        "furthest (default: 24)",
    )


def run(options: argparse.Namespace) -> int:
    """Draw, and say how many."""
    from rockframe.cli.console import show_json
    from rockframe.cli.table import rows_of
    from rockframe.errors import ParameterError
    from rockframe.provenance import replaced_folder

    if options.most < 1:
        raise ParameterError(f"Invalid number of figures {options.most}. Must be at least 1.")
    files = (options.records, options.pulses, options.response)
    rows = rows_of(*files)
    with replaced_folder(options.output, _INDEX) as partial:
        chosen = _furthest(rows, options.response, options.most)
        draw(rows, files, partial, chosen)
        lines = ["record_id,file", *(f"{name},{name}.png" for name in chosen)]
        (partial / _INDEX).write_text("\n".join(lines) + "\n", encoding="utf-8")
    if options.json:
        show_json({"records": chosen, "output": str(options.output)})
    else:
        print(f"{len(chosen)} figures in {options.output}")
    return 0


def draw(
    rows: Sequence[TableRow], files: Sequence[Path], folder: Path, chosen: Sequence[str]
) -> None:
    """Draw one figure for each of the records that are chosen."""
    from rockframe.cli.console import progress_bar
    from rockframe.figures import draw_response_history, save
    from rockframe.results import best_pulses, open_records, open_response

    titles = {row.record_id: f"{row.event}, {row.record}".removeprefix(", ") for row in rows}
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
                titles[name],
            )
            save(figure, folder / f"{name}.png")
            progress(i + 1, len(chosen))


def _furthest(rows: Sequence[TableRow], response: Path, most: int) -> list[str]:
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
