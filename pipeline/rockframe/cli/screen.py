"""rockframe screen: screen structures by many records at many scales."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from rockframe.bounds import MOST_NUMBERS
from rockframe.cells import decimal
from rockframe.cli.arguments import (
    add_filters,
    add_reading,
    add_structures,
    add_vertical,
    path,
)
from rockframe.cli.computing import add_histories, add_scheduler
from rockframe.cli.outputs import file_to_write

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.rocking import Design
    from rockframe.stages import Selection


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records, structures, scales and filters in; verdicts, ranks, fragility and rates out."""
    parser.add_argument(
        "records",
        type=path,
        nargs="+",
        help="output of `rockframe ingest`; or files and folders of records",
    )
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    parser.add_argument("--pulses", type=path, metavar="FILE", help="output of `rockframe pulse`")
    add_structures(parser)
    add_vertical(parser)
    parser.add_argument(
        "--scales",
        type=values,
        nargs="+",
        metavar="SCALE",
        help="multiples of the records, increasing; or FROM:TO:COUNT, evenly spaced "
        "(default: 0.5 0.75 1 1.25 1.5 2 2.5 3)",
    )
    parser.add_argument(
        "--azimuths",
        type=values,
        nargs="+",
        metavar="DEGREES",
        default=[],
        help="turn each pair of horizontals toward these azimuths; or FROM:TO:COUNT",
    )
    _add_filters(parser)
    parser.add_argument(
        "--no-margins",
        action="store_true",
        help="leave out critical scales and safe islands, which take most of the time",
    )
    add_histories(parser, "none")
    _add_results(parser)
    add_reading(parser, "; and that compute")
    add_scheduler(parser)


def _add_filters(parser: argparse.ArgumentParser) -> None:
    add_filters(parser)
    group = parser.add_argument_group("filters by the pulse, with --pulses")
    for option, what in (("period-s", "period T_p [s]"), ("length-m", "length a_p T_p^2 [m]")):
        group.add_argument(
            f"--pulse-{option}", type=float, nargs=2, metavar=("FROM", "TO"), help=f"only {what}"
        )
    group.add_argument(
        "--pulse-like", choices=("yes", "no"), help="only if the pulse is (is not) more than chance"
    )


def _add_results(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--hazard",
        type=path,
        metavar="FILE",
        help="hazard curve of the site: CSV of annual_rate and one of pga_g, pgv_m_s, a_p_g, L_p_m",
    )
    parser.add_argument(
        "--design",
        choices=("height", "width", "mass_ratio"),
        help="look for the smallest height (slenderness kept), width (height kept) or mass ratio "
        "that keeps theta/alpha below a limit for a share of the records; a scan, as demand is "
        "not monotone in size",
    )
    parser.add_argument(
        "--design-range",
        type=float,
        nargs=2,
        metavar=("LEAST", "LARGEST"),
        help="range of the scan, in m for height and width",
    )
    for option, kind, default, metavar, of in (
        ("limit", float, 0.5, "RATIO", "limit of theta/alpha"),
        ("share", float, 0.9, "SHARE", "share of the records"),
        ("steps", int, 41, "N", "values tried in the range"),
    ):
        parser.add_argument(
            f"--design-{option}",
            type=kind,
            default=default,
            metavar=metavar,
            help=f"{of} (default: {default})",
        )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the draws of the bands (default: 0)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the stage, print the tables."""
    from rockframe.cli.arguments import records_file
    from rockframe.cli.computing import engine
    from rockframe.cli.console import progress_bar, show_rejections
    from rockframe.cli.screen_tables import show
    from rockframe.rocking import Histories
    from rockframe.stages import SCALES, screen_stage
    from rockframe.study import SHIPPED_STRUCTURES

    design, selection = _design(options), _selection(options)
    where = engine(options)
    scales = SCALES if options.scales is None else _together("scales", options.scales)
    try:
        with records_file(options) as (records, status), progress_bar("screening") as progress:
            done = screen_stage(
                records,
                options.output,
                structures_path=options.structures or SHIPPED_STRUCTURES,
                structure=options.structure,
                pulses_path=options.pulses,
                selection=selection,
                azimuths=_together("azimuths", options.azimuths),
                vertical=options.vertical,
                scales=scales,
                margins=not options.no_margins,
                histories=Histories(options.histories),
                hazard_path=options.hazard,
                design=design,
                seed=options.seed,
                engine=where,
                progress=progress,
            )
    except KeyboardInterrupt:
        print(
            "rockframe: interrupted; complete batches are kept, the same command goes on.",
            file=sys.stderr,
        )
        return 130
    show(options.output, done, as_json=options.json)
    show_rejections(done.rejections)
    return 1 if done.rejections else status


def values(text: str) -> list[float]:
    """Return the numbers that a word states: one, or FROM:TO:COUNT."""
    parts = text.split(":")
    try:
        if len(parts) == 1:
            return [decimal(text)]
        first, last, count = map(decimal, parts)
        if not (2 <= count <= MOST_NUMBERS and count.is_integer()):
            raise ValueError
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"Invalid value {text!r}. Must be a number or FROM:TO:COUNT, of 2 to {MOST_NUMBERS}"
        ) from None
    from rockframe.study import evenly

    return evenly(first, last, int(count))


def _together(what: str, parts: Sequence[list[float]]) -> list[float]:
    from rockframe.errors import ParameterError

    numbers = [number for part in parts for number in part]
    if len(numbers) > MOST_NUMBERS:
        raise ParameterError(f"{len(numbers)} {what}. Must be at most {MOST_NUMBERS}.")
    return numbers


def _selection(options: argparse.Namespace) -> Selection:
    from rockframe.cli.arguments import filters
    from rockframe.stages import Selection

    period, length = options.pulse_period_s, options.pulse_length_m
    return Selection(
        filters=filters(options),
        pulse_period_s=None if period is None else (period[0], period[1]),
        pulse_length_m=None if length is None else (length[0], length[1]),
        pulse_like=None if options.pulse_like is None else options.pulse_like == "yes",
    )


def _design(options: argparse.Namespace) -> Design | None:
    from rockframe.errors import ParameterError
    from rockframe.rocking import Design

    if (options.design is None) != (options.design_range is None):
        raise ParameterError("--design and --design-range belong together. Must both be given.")
    if options.design is None:
        return None
    return Design(
        dimension=options.design,
        lowest=options.design_range[0],
        highest=options.design_range[1],
        limit=options.design_limit,
        share=options.design_share,
        steps=options.design_steps,
    )
