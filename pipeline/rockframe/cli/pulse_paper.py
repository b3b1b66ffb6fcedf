"""`rockframe pulse --paper`: compare the paper's Table 1 with every wavelet and weighting."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rockframe.cli.arguments import records_file
from rockframe.cli.options import chosen
from rockframe.options import IngestOptions, PulseOptions

if TYPE_CHECKING:
    from rockframe.paper import PaperPulse
    from rockframe.record import Record


def show_paper(options: argparse.Namespace) -> int:
    """Match the paper's records in every way and print the comparison."""
    from rockframe.cli.console import show_json
    from rockframe.errors import InputError
    from rockframe.matching import Weighting
    from rockframe.paper import overall_distances, paper_pulses

    records, status = _records(options)
    pulses = paper_pulses(records, list(Weighting))
    if not pulses:
        raise InputError(
            options.records, "holds no record with a name of the paper's. Must hold one."
        )
    if options.json:
        rows = [{**vars(pulse), "distance": pulse.distance} for pulse in pulses]
        ways = [
            {"wavelet": wavelet, "weighting": weighting, "distance": distance}
            for wavelet, weighting, distance in overall_distances(pulses)
        ]
        show_json({"pulses": rows, "overall": ways})
    else:
        _show(pulses)
    return status


def _records(options: argparse.Namespace) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the records with their usable options, and the exit status."""
    from rockframe.results import open_records
    from rockframe.stages import usable
    from rockframe.stages.common import horizontal

    wanted = chosen(options, PulseOptions)
    reading = records_file([options.records], IngestOptions(), None)
    with reading as (path, status), open_records(path) as file:
        return [(file.read(name), usable(name, file, wanted)) for name in horizontal(file)], status


def _show(pulses: Sequence[PaperPulse]) -> None:
    """Print a table for each weighting, and the distance of each way over all records."""
    from rockframe.cli.console import number, show_table
    from rockframe.paper import overall_distances

    for weighting in dict.fromkeys(pulse.weighting for pulse in pulses):
        cells: list[list[str]] = []
        own = [pulse for pulse in pulses if pulse.weighting == weighting]
        for record in dict.fromkeys(pulse.record for pulse in own):
            ways = [pulse for pulse in own if pulse.record == record]
            if cells:
                cells.append([])
            for i, way in enumerate(ways):
                nearest = way.distance == min(one.distance for one in ways)
                cells.append(
                    [
                        record if i == 0 else "",
                        number(way.printed_a_p_g, 2) if i == 0 else "",
                        number(way.printed_period_s, 2) if i == 0 else "",
                        f"{'→ ' if nearest else '  '}{way.wavelet}",
                        number(way.a_p_g, 3),
                        number(way.T_p_s, 3) + ("*" if way.at_period_bound else ""),
                        f"{100.0 * (way.a_p_g / way.printed_a_p_g - 1.0):+.1f} %",
                        f"{100.0 * (way.T_p_s / way.printed_period_s - 1.0):+.1f} %",
                        number(way.distance, 3),
                    ]
                )
        names = (
            *("record", "paper\na_p [g]>", "\nT_p [s]>", "wavelet", "ours\na_p [g]>"),
            *("\nT_p [s]>", "a_p\n>", "T_p\n>", "distance\n>"),
        )
        show_table(f"Weighting {weighting}: the paper's pulses and ours", names, cells)
    show_table(
        "Over all records, the nearest first",
        ("wavelet", "weighting", "distance>"),
        [[w, weighting, number(d, 3)] for w, weighting, d in overall_distances(pulses)],
    )
    print("distance: root mean square of ln(ours / paper) of a_p and T_p. The paper names neither")
    print("wavelet nor weighting nor range of periods for its records; nothing is tuned.")
    if any(pulse.at_period_bound for pulse in pulses):
        print("* the end of the range of periods searched, not a maximum")
