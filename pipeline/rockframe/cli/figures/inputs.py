"""Choose the records and the structure that a figure shows."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

from rockframe.cli.arguments import chosen_structures, stated_records
from rockframe.components.pairing import vertical_beside
from rockframe.errors import ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.paper.table1 import paper_record_of
from rockframe.record import Record
from rockframe.results.records import RecordsFile, open_records
from rockframe.rocking import GroundAcceleration, Verdict, respond
from rockframe.stages.common import horizontal
from rockframe.stages.respond import choose_structures, with_vertical


@dataclass(frozen=True)
class Pair:
    """The record, structure and motion of a figure, and the exit status."""

    record: Record
    frame: RockingFrame
    motion: GroundAcceleration | None
    status: int


def pair_of(options: argparse.Namespace) -> Pair:
    """Return the record and the structure of a figure that shows one record."""
    frame = structure_of(options)
    if options.record and len(options.record) > 1:
        raise ParameterError(
            f"Invalid number of records, {len(options.record)}. Must be one for this figure."
        )
    with stated_records(options) as (given, status), open_records(given) as file:
        record = _largest_rotation(file, chosen_records(options, file), frame)
        beside = vertical_beside(file) if options.vertical else {}
    motion = with_vertical(record, beside) if options.vertical else None
    return Pair(record, frame, motion, status)


def chosen_records(options: argparse.Namespace, file: RecordsFile) -> list[str]:
    """Return the names of the requested records, or of all horizontal records."""
    known = horizontal(file)
    for name in options.record or ():
        require_known("record", name, known)
    return list(options.record or known)


def _largest_rotation(file: RecordsFile, names: list[str], frame: RockingFrame) -> Record:
    """Return the record with the largest rotation without overturning, or the first."""
    best, furthest = file.read(names[0]), 0.0
    for name in names if len(names) > 1 else ():
        record = file.read(name)
        response = respond(frame, record)
        if response.verdict is Verdict.SAFE and response.peak_rotation > furthest:
            best, furthest = record, response.peak_rotation
    return best


def structure_of(options: argparse.Namespace) -> RockingFrame:
    """Return the requested structure, or the first: by default the paper's bridge bent."""
    return choose_structures(chosen_structures(options), options.structure)[0]


def title_of(record: Record) -> str:
    """Return the names of event and record in two lines."""
    printed = paper_record_of(record.source_file)
    if printed is not None:
        return f"{printed.event}\n{printed.record}"
    place = "/".join(part for part in (record.station, record.component) if part)
    return "\n".join(part for part in (record.event, place or record.record_id) if part)
