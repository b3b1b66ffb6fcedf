"""Rotation of the pairs of horizontals in a file of records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from rockframe.components.pairing import HorizontalPair, pair_horizontals
from rockframe.components.rotation import rotate
from rockframe.options.passport import PassportLimits
from rockframe.outcome import InputOutcome
from rockframe.results.records import RecordsFile
from rockframe.stages.acceptance import Inspected, checked


def rotated(
    file: RecordsFile,
    outcomes: Sequence[InputOutcome],
    azimuths: Sequence[float],
    limits: PassportLimits,
) -> Iterator[Inspected]:
    """Yield the motion of each pair toward the azimuths, and the vertical records unchanged.

    If a pair is cut to a common length, its vertical is cut too. Unpaired records are rejected with
    the reason. Inputs that were not accepted come first, unchanged.

    Parameters
    ----------
    file : RecordsFile
        The records as recorded; one motion is in memory at a time.
    outcomes : sequence of InputOutcome
        The outcomes of all inputs, with the passports of the records in the file.
    azimuths : sequence of float
        Directions of the motions [degree].
    limits : PassportLimits
        Limits of the checks.
    """
    recorded = {one.record_id: one for one in outcomes if one.status == "accepted"}
    yield from ((None, one) for one in outcomes if one.status != "accepted")
    for names in file.motions.values():
        records = [file.read(name) for name in names]
        pairs, unpaired = pair_horizontals(records)
        for alone in unpaired:
            reason = f"record {alone.record_id!r}: {alone.reason}"
            yield None, replace(recorded[alone.record_id], status="rejected", reason=reason)
        verticals = {r.record_id: r for r in records if r.orientation.upright}
        for pair in pairs:
            yield from _toward(pair, azimuths, recorded, limits)
            if pair.vertical:
                verticals[pair.vertical.record_id] = pair.vertical
        yield from ((vertical, recorded[name]) for name, vertical in verticals.items())


def _toward(
    pair: HorizontalPair,
    azimuths: Sequence[float],
    recorded: Mapping[str, InputOutcome],
    limits: PassportLimits,
) -> Iterator[Inspected]:
    made = [rotate(pair, azimuth) for azimuth in azimuths]
    components = [(one, recorded[one.record_id]) for one in (pair.first, pair.second)]
    corrected = any(outcome.corrected_here for _, outcome in components)
    for record in made:
        # A component perpendicular to the azimuth does not contribute to the motion toward it.
        passports = [
            outcome.passport
            for component, outcome in components
            if (record.azimuth - component.azimuth) % 180.0 != 90.0 and outcome.passport
        ]
        outcome = checked(record, record, limits, passports)
        yield record, replace(outcome, corrected_here=corrected)
    into = " and ".join(repr(record.record_id) for record in made)
    for _, outcome in components:
        yield None, replace(outcome, status="rotated", reason=f"rotated into {into}.")
