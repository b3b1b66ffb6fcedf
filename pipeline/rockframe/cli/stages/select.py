"""rockframe select: select and scale records whose response spectra match a target."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, file_to_write
from rockframe.errors import InputError, ParameterError
from rockframe.options.ingest import Filters, SelectOptions
from rockframe.provenance import refuse_obstacles

if TYPE_CHECKING:
    from rockframe.stages.select import Selection


def add_select(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, target, scales, constraints, and the files to write."""
    arguments.add_motions(parser, flatfiles=True)
    parser.add_argument(
        "--figure",
        type=file_to_write(".png", ".pdf", ".svg"),
        metavar="FILE",
        help="draw the spectra against the target: .png, .pdf or .svg",
    )
    add_options(parser, SelectOptions)
    add_options(parser, Filters, title=arguments.FILTERS)


def run_select(options: argparse.Namespace) -> int:
    """Run the stage, draw the figure if requested, and print the selection."""
    from rockframe.stages.select import refuse_columns, select_stage

    wanted = chosen(options, SelectOptions)
    if options.figure is not None:
        refuse_obstacles([options.figure, options.figure.with_suffix(".caption.txt")])
    if options.output.suffix.lower() == ".csv":
        given: AbstractContextManager[tuple[Path, int]] = nullcontext((_flatfile(options), 0))
    else:
        refuse_columns(wanted)
        _refuse_flatfiles(options)
        given = arguments.records_file(options.records)
    bar = console.progress_bar("computing spectra")
    with given as (records, status), bar as progress:
        selection = select_stage(
            records,
            options.output,
            wanted,
            pulses_path=options.pulses,
            filters=chosen(options, Filters),
            progress=progress,
        )
    files = [*dict.fromkeys([options.output, *selection.tables])]
    if options.figure is not None:
        files.append(_draw(selection, options.figure))
    if options.json:
        _show_json(selection, files)
    else:
        _show(selection, files, of_archive=not wanted.flatfile_columns)
    return status


def _flatfile(options: argparse.Namespace) -> Path:
    """Return the flatfile that is stated.

    Raises
    ------
    ParameterError
        If there are several files, or pulses.
    """
    if len(options.records) != 1:
        number = len(options.records)
        raise ParameterError(f"{number} files to select from for a list. Must be one flatfile.")
    if options.pulses is not None:
        raise ParameterError("--pulses has no effect: a flatfile has no waveforms. Remove it.")
    [flatfile] = options.records
    return Path(flatfile)


def _refuse_flatfiles(options: argparse.Namespace) -> None:
    """Refuse a flatfile from which a file of records shall be written."""
    from rockframe.ingest.catalogue import catalogue_kind  # the command has other imports without

    for file in options.records:
        kind = catalogue_kind(file) if file.is_file() else ""
        if "flatfile" in kind:
            advice = "State the list of its files as output, such as selected.csv."
            raise InputError(file, f"is a {kind} without waveforms. {advice}")


def _draw(selection: Selection, file: Path) -> Path:
    from rockframe.figures.captioned import save_captioned
    from rockframe.figures.spectra import draw_selection

    save_captioned(draw_selection(selection.target, selection.log_sa), file)
    return file


def _show_json(selection: Selection, files: list[Path]) -> None:
    console.show_json(
        {
            "target": selection.target.words,
            "records": selection.records,
            "candidates": selection.candidates,
            "left_out": dict(selection.left_out),
            "motions": selection.motions,
            "seconds": [row for row in selection.rows if row["pair_of"]],
            "verticals": [row for row in selection.rows if row["vertical_of"]],
            "periods": selection.periods(),
            "files": [str(file) for file in files],
        }
    )


def _rounded(row: Mapping[str, float], key: str) -> float:
    """Return a difference without the sign of a zero that is printed."""
    return round(row[key], 3) + 0.0


def _show(selection: Selection, files: list[Path], *, of_archive: bool) -> None:
    """Print the selection; `of_archive` is True if the names are not those of the user's table."""
    seconds = {row["pair_of"]: row["record_id"] for row in selection.rows if row["pair_of"]}
    motions = [row | {"with": seconds.get(row["record_id"], "")} for row in selection.motions]
    columns = [
        console.column("record", "record_id"),
        *([console.column("and", "with")] if seconds else []),
        console.column("event", "event"),
        console.column("station", "station"),
        console.column("M>", "magnitude", ".1f"),
        console.column("Repi [km]>", "epicentral_distance_km", ".0f"),
        console.column("scale>", "scale", ".3f"),
        console.column("PGA [g]>", "pga_g", ".3f"),
        console.column("PGV [m/s]>", "pgv_m_s", ".3f"),
        console.column("misfit>", "misfit", ".2f"),
    ]
    console.show_rows(
        f"{len(selection.motions)} motions for {selection.target.words}", columns, motions
    )
    spread = selection.target.deviation is not None
    columns = [
        console.column("period [s]>", "period_s", ".3g"),
        console.column("target Sa [g]>", "target_sa_g", ".4f"),
        console.column("median Sa [g]>", "median_sa_g", ".4f"),
        console.column("difference [%]>", "median_difference", "+.1f", 100.0, rule=_rounded),
        *([console.column("target σ>", "target_sigma_ln_sa", ".3f")] if spread else []),
        console.column("σ of ln Sa>", "sigma_ln_sa", ".3f"),
    ]
    rows = selection.periods()
    console.show_rows("Spectra of the selected motions", columns, rows)
    worst = max(rows, key=lambda row: abs(row["median_difference"]))
    said = f"Largest difference of the median: {100.0 * worst['median_difference']:+.1f} % at "
    said += f"{worst['period_s']:.3g} s."
    if spread:
        apart = max(rows, key=lambda row: abs(row["sigma_ln_sa"] - row["target_sigma_ln_sa"]))
        away = apart["sigma_ln_sa"] - apart["target_sigma_ln_sa"]
        said += f" Of the standard deviation: {away:+.3f} at {apart['period_s']:.3g} s."
    print(said)
    removed = Counter(reason.split(" ")[0] for reason in selection.left_out.values())
    out = ", ".join(f"{count} by {name}" for name, count in removed.most_common())
    print(
        f"{selection.candidates} of {selection.records} {selection.noun} were candidates"
        f"{out and ' (filtered out: '}{out}{out and ')'}. The misfit is the root mean square of "
        "ln(Sa/target) over the periods."
    )
    names = [str(row.get("recording", "")) for row in selection.motions]
    digits = [name.removeprefix("NGAsub").removeprefix("RSN") for name in names]
    if of_archive and all(number.isdigit() for number in digits):
        print(f"Record sequence numbers, for the search of PEER: {', '.join(digits)}")
    for file in files:
        print(file)
