"""Figures of pulses, and of the search for pulses."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Final

from rockframe.cli import arguments
from rockframe.cli.figures_of_frames import chosen_records, title_of
from rockframe.errors import ParameterError
from rockframe.figures import pulses
from rockframe.figures.captioned import Captioned
from rockframe.figures.pulses import draw_record_and_pulse
from rockframe.matching.likeness import likeness, pulse_words
from rockframe.matching.match import PulseMatch, best_ricker, match_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.paper.table1 import paper_record_of
from rockframe.record import Record
from rockframe.results.plots.records import (
    match_curve_dataset,
    pulse_dataset,
    scalogram_dataset,
)
from rockframe.results.records import open_records
from rockframe.stages.pulse import usable
from rockframe.wavelets.family import RICKERS

#: Records of the paper's Figure 8, by their names in its Table 1, and their wavelets.
_PAPER: Final = {"Erzincan/EW": "symmetric_ricker", "Pacoima Dam/164": "antisymmetric_ricker"}
#: Largest number of records on a page.
_MOST_RECORDS: Final = 6


def draw_8(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the requested records; by default the paper's two records, or the two best matches."""
    records, status = _records(options)
    if options.record and len(records) > _MOST_RECORDS:
        raise ParameterError(
            f"Invalid number of records, {len(records)}. Must be at most {_MOST_RECORDS}."
        )
    matches = [_rickers(record, matching) for record, matching in records]
    chosen = [(i, best_ricker(found)) for i, found in enumerate(matches)]
    if not options.record:
        chosen = _default([record for record, _ in records], matches)
    datasets = [
        pulse_dataset(records[i][0], matches[i][wavelet], _tested(*records[i], wavelet))
        for i, wavelet in chosen
    ]
    titles = {record.record_id: title_of(record).replace("\n", ", ") for record, _ in records}
    drawn = draw_record_and_pulse(datasets, titles)
    shown = len({i for i, _ in chosen})
    if shown < len(records):
        others = "--record names others"
        caption = f"{drawn.caption} {shown} of {len(records)} records are shown; {others}."
        drawn = replace(drawn, caption=caption)
    return drawn, status


def draw_scalogram(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the transform for whichever Ricker wavelet matches better."""
    (record, matching), status = _best_matched(options)
    matches = _rickers(record, matching)
    best = matches[best_ricker(matches)]
    tested = _tested(record, matching, best.pulse.wavelet)
    return pulses.draw_scalogram(scalogram_dataset(record, best, matching, tested)), status


def draw_match_curves(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the match index of all wavelets over the period."""
    (record, matching), status = _best_matched(options)
    matches = match_pulses(record.acceleration, record.time_step, matching)
    return pulses.draw_match_curves(match_curve_dataset(record, matches, matching)), status


def _records(
    options: argparse.Namespace,
) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the requested records with their usable options, and the exit status."""
    with arguments.stated_records(options) as (path, status), open_records(path) as file:
        return [
            (file.read(name), usable(name, file, PulseOptions()))
            for name in chosen_records(options, file)
        ], status


def _best_matched(options: argparse.Namespace) -> tuple[tuple[Record, PulseOptions], int]:
    """Return the requested record; by default the record that a Ricker wavelet matches best."""
    records, status = _records(options)
    if options.record and len(records) > 1:
        raise ParameterError(
            f"Invalid number of records, {len(records)}. Must be one for this figure."
        )

    def index(pair: tuple[Record, PulseOptions]) -> float:
        matches = _rickers(*pair)
        return matches[best_ricker(matches)].match_index

    return max(records, key=index) if len(records) > 1 else records[0], status


def _rickers(record: Record, matching: PulseOptions) -> dict[str, PulseMatch]:
    alone = matching.replaced(wavelet=tuple(RICKERS))
    return match_pulses(record.acceleration, record.time_step, alone)


def _tested(record: Record, matching: PulseOptions, wavelet: str) -> str:
    """Test the match of a wavelet against noise, and return the result as text."""
    matches = match_pulses(record.acceleration, record.time_step, matching)
    samples, step = record.acceleration, record.time_step
    found = likeness(samples, step, matches, matching, record.record_id)[wavelet]
    return pulse_words(found.verdict, found.p_value)


def _default(records: list[Record], matches: list[dict[str, PulseMatch]]) -> list[tuple[int, str]]:
    """Return the paper's two records if available, otherwise the best record for each wavelet."""
    printed = [paper_record_of(record.source_file) for record in records]
    named = {paper.record: i for i, paper in enumerate(printed) if paper is not None}
    if all(name in named for name in _PAPER):
        return [(named[name], wavelet) for name, wavelet in _PAPER.items()]
    return [
        (max(range(len(matches)), key=lambda i: matches[i][wavelet].match_index), wavelet)
        for wavelet in _PAPER.values()
    ]
