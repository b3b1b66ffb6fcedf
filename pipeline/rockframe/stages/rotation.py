"""RotD measures and rotation of the pairs of horizontals in a file of records."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rockframe.components.pairing import HorizontalPair, motion_of, pair_horizontals
from rockframe.components.rotation import rotate, rotd
from rockframe.errors import InputError
from rockframe.record import Orientation, Record
from rockframe.results.records import RecordsFile
from rockframe.results.tables.entries import Entry
from rockframe.signals.passport import Passport
from rockframe.signals.processing import integrate
from rockframe.stages.acceptance import Acceptance, checked


def sweeps(file: RecordsFile, recorded: RecordsFile | None = None) -> dict[str, Sequence[float]]:
    """Return measures of both horizontals over all azimuths for each record.

    Parameters
    ----------
    file : RecordsFile
        The records.
    recorded : RecordsFile, optional
        The recorded components, if the records were rotated; one motion is in memory at a time.

    Returns
    -------
    dict of str to sequence of float
        One value per record by variable: RotD50 and RotD100 of PGA [m s-2] and PGV [m s-1], and the
        azimuth of the largest acceleration [degree]; NaN for verticals and unpaired records.
    """
    source = recorded or file
    across = dict(zip(source.names, source.orientations, strict=True))
    of_motion = {
        motion_of(pair.first): _rotd_measures(pair)
        for names in _motions(source)
        if sum(across[name] is Orientation.HORIZONTAL for name in names) == 2
        for pair in pair_horizontals(map(source.read, names))[0]
    }
    found = [
        {} if record.orientation.upright else of_motion.get(motion_of(record), {})
        for record in file
    ]
    return {
        variable: [of_record.get(variable, np.nan) for of_record in found]
        for variable in next(iter(of_motion.values()), {})
    }


def rotated(
    file: RecordsFile, azimuths: Sequence[float], acceptance: Acceptance
) -> Iterator[tuple[Record, Passport | None]]:
    """Yield the motion of each pair toward the azimuths, and the vertical records unchanged.

    If a pair is cut to a common length, its vertical is cut too. Unpaired records are rejected with
    the reason.

    Parameters
    ----------
    file : RecordsFile
        The records as recorded; one motion is in memory at a time.
    azimuths : sequence of float
        Directions of the motions [degree].
    acceptance : Acceptance
        Receives the rows of the recorded components and of the rotated records.
    """
    recorded = {
        row.record_id: row for row in acceptance.entries if row.record_id and not row.reason
    }
    corrected = {one.record_id for one in acceptance.accepted if one.corrected_here}
    acceptance.accepted.clear()
    acceptance.entries[:] = [row for row in acceptance.entries if row.record_id not in recorded]
    for names in _motions(file):
        records = [file.read(name) for name in names]
        pairs, unpaired = pair_horizontals(records)
        for one in unpaired:
            row = recorded[one.record_id]
            _refuse(acceptance, replace(row, reason=f"record {one.record_id!r}: {one.reason}"))
        verticals = {r.record_id: r for r in records if r.orientation.upright}
        for pair in pairs:
            yield from _toward(pair, azimuths, acceptance, recorded, corrected)
            if pair.vertical:
                verticals[pair.vertical.record_id] = pair.vertical
        for name, vertical in verticals.items():
            if acceptance.let_through(vertical, recorded[name], corrected_here=name in corrected):
                yield vertical, recorded[name].passport
    acceptance.require_some()


def _toward(
    pair: HorizontalPair,
    azimuths: Sequence[float],
    acceptance: Acceptance,
    recorded: Mapping[str, Entry],
    corrected: set[str],
) -> Iterator[tuple[Record, Passport | None]]:
    made = [rotate(pair, azimuth) for azimuth in azimuths]
    names = [component.record_id for component in (pair.first, pair.second)]
    for record in made:
        # A component perpendicular to the azimuth does not contribute to the motion toward it.
        within = [
            recorded[one.record_id].passport
            for one in (pair.first, pair.second)
            if (record.azimuth - one.azimuth) % 180.0 != 90.0
        ]
        passports = [one for one in within if one is not None]
        row = checked(record, record, acceptance.limits, passports)
        here = not corrected.isdisjoint(names)
        if acceptance.let_through(record, row, corrected_here=here):
            yield record, row.passport
    into = " and ".join(repr(record.record_id) for record in made)
    acceptance.entries.extend(
        replace(recorded[name], note=f"rotated into {into}.") for name in names
    )


def _refuse(acceptance: Acceptance, row: Entry) -> None:
    if acceptance.options.strict:
        raise InputError(row.file, row.reason)
    acceptance.entries.append(row)


def _rotd_measures(pair: HorizontalPair) -> dict[str, float]:
    pga, pgv = rotd(pair), rotd(pair, transform=integrate)
    return {
        "pga_rotd50": pga.percentile(50),
        "pga_rotd100": pga.percentile(100),
        "pgv_rotd50": pgv.percentile(50),
        "pgv_rotd100": pgv.percentile(100),
        "azimuth_rotd100": pga.strongest_azimuth,
    }


def _motions(file: RecordsFile) -> list[list[str]]:
    """Return the identifiers of the records of each motion, in the order of the file."""
    names: defaultdict[Hashable, list[str]] = defaultdict(list)
    for record in file:
        names[motion_of(record)].append(record.record_id)
    return list(names.values())
