"""Comparison of a_p and T_p in the paper's Table 1 with every wavelet and weighting."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from rockframe.matching.match import match_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.paper.table1 import PaperRecord, paper_record_of
from rockframe.record import Record
from rockframe.units import GRAVITY


@dataclass(frozen=True, kw_only=True)
class PaperPulse:
    """One of the paper's records, matched with one wavelet and weighting.

    Parameters
    ----------
    record : str
        Name in the paper.
    wavelet, weighting : str
        Wavelet and weighting of the match.
    printed_a_p_g, printed_period_s, a_p_g, T_p_s : float
        The paper's values and ours.
    at_period_bound : bool
        True if our period is an end of the searched range, not a maximum of the match.
    """

    record: str
    wavelet: str
    weighting: str
    printed_a_p_g: float
    printed_period_s: float
    a_p_g: float
    T_p_s: float
    at_period_bound: bool = False

    @property
    def distance(self) -> float:
        """Root mean square of ln(ours / paper) of a_p and T_p [1]."""
        ratios = (self.a_p_g / self.printed_a_p_g, self.T_p_s / self.printed_period_s)
        return math.sqrt(sum(math.log(ratio) ** 2 for ratio in ratios) / 2.0)


def paper_pulses(
    records: Iterable[tuple[Record, PulseOptions]], weightings: Sequence[str]
) -> list[PaperPulse]:
    """Match the paper's records, found by their file names, with all wavelets and weightings.

    Parameters
    ----------
    records : iterable of (Record, PulseOptions)
        Records, each with the wavelets and the range of periods to search.
    weightings : sequence of str
        Weightings to use.
    """
    found = []
    for record, options in records:
        printed = paper_record_of(record.source_file)
        if printed is not None:
            for weighting in weightings:
                found += _matched(record, printed, options.replaced(weighting=weighting))
    return found


def _matched(record: Record, printed: PaperRecord, options: PulseOptions) -> list[PaperPulse]:
    matches = match_pulses(record.acceleration, record.time_step, options)
    return [
        PaperPulse(
            record=printed.record,
            wavelet=wavelet,
            weighting=options.weighting,
            printed_a_p_g=printed.a_p_g,
            printed_period_s=printed.T_p_s,
            a_p_g=match.pulse.a_p / GRAVITY,
            T_p_s=match.pulse.T_p,
            at_period_bound=match.at_period_bound,
        )
        for wavelet, match in matches.items()
    ]


def overall_distances(pulses: Sequence[PaperPulse]) -> list[dict[str, Any]]:
    """Return wavelet, weighting and distance over all records, smallest distance first.

    Examples
    --------
    >>> one = PaperPulse(record="a", wavelet="w", weighting="energy", printed_a_p_g=0.4,
    ...     printed_period_s=1.0, a_p_g=0.4, T_p_s=1.1)
    >>> [round(way["distance"], 4) for way in overall_distances([one])]
    [0.0674]
    """
    ways: dict[tuple[str, str], list[float]] = {}
    for pulse in pulses:
        ways.setdefault((pulse.wavelet, pulse.weighting), []).append(pulse.distance**2)
    rows: list[dict[str, Any]] = [
        {"wavelet": one, "weighting": other, "distance": math.sqrt(sum(squares) / len(squares))}
        for (one, other), squares in ways.items()
    ]
    return sorted(rows, key=lambda way: float(way["distance"]))
