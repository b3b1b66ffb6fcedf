"""The stages as path -> path: read, compute, write. The one place where they meet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame
from rockframe.ingest import CatalogueEntry, ReadOptions, Rejection, collect
from rockframe.matching import LONGEST_PERIOD, SHORTEST_PERIOD, PulseMatch, match_pulse
from rockframe.record import Orientation, Record
from rockframe.results import (
    PULSES,
    RECORDS,
    RESPONSE,
    Entry,
    input_hash,
    pulses_dataset,
    read_records,
    records_dataset,
    response_dataset,
    write,
    write_entries,
)
from rockframe.rocking.response import Response, respond
from rockframe.signals import BandPass, correct, passport
from rockframe.study import SHIPPED_STRUCTURES, PassportLimits, read_structures
from rockframe.wavelets import WAVELETS

#: Called with what is done and what there is to do in all.
Progress = Callable[[int, int], None]


def _silent(_done: int, _total: int) -> None:
    """Report progress to nobody."""


@dataclass(frozen=True)
class Ingested:
    """What became of the files: the records that went through, and the rejections.

    The entries are the rows of the table: one for each record and each rejected file, with the
    record's passport where one was made.
    """

    records: tuple[Record, ...]
    rejections: tuple[Rejection, ...]
    entries: tuple[Entry, ...]


def ingest_stage(
    paths: Sequence[Path],
    output: Path,
    *,
    options: ReadOptions | None = None,
    catalogue: Mapping[str, CatalogueEntry] | None = None,
    band: BandPass | None = None,
    limits: PassportLimits | None = None,
    progress: Callable[[str], None] | None = None,
) -> Ingested:
    """Read record files into ``records.nc``; uncorrected ones get baseline and band-pass.

    Each record gets a passport, and one with a verdict of rejection is rejected. Beside it goes a
    CSV file of the same name: every input, accepted or rejected, with the reason and the checks.

    Parameters
    ----------
    paths : sequence of Path
        Files and folders.
    output : Path
        The netCDF file to write.
    options : ReadOptions, optional
        Units and time step of text files that do not state them.
    catalogue : mapping, optional
        Facts about the files, by file name; otherwise each folder's own ``catalogue.csv``.
    band : BandPass, optional
        Corner frequencies for uncorrected records.
    limits : PassportLimits, optional
        Limits of the passport.
    progress : callable, optional
        Called with the name of each file.

    Returns
    -------
    Ingested
        Records and rejections.

    Raises
    ------
    InputError
        If a path does not exist, or no record went through: then nothing is written.
    """
    band = band or BandPass()
    limits = limits or PassportLimits()
    read, rejections = collect(paths, options or ReadOptions(), catalogue, progress)
    inspected = [_inspected(record, band, limits) for record in read]
    entries = [entry for _, entry in inspected] + [
        Entry(r.file, "", reason=r.reason, line=r.line) for r in rejections
    ]
    rejected = [Rejection(e.file, e.reason, e.line) for e in entries if e.reason]
    accepted = [(record, entry.passport) for record, entry in inspected if not entry.reason]
    if not accepted:
        first, others = rejected[0], len(rejected) - 1
        more = f" ({others} more files were rejected too.)" if others else ""
        raise InputError(first.file, first.reason + more, first.line)
    records = [record for record, _ in accepted]
    write(
        records_dataset(records, [passport for _, passport in accepted if passport]),
        output,
        RECORDS,
        input_sha256={record.source_file: record.source_sha256 for record in records},
        parameters={"band_pass_hz": [band.low, band.high], "passport": limits.stated()},
    )
    entries.sort(key=lambda entry: bool(entry.reason))
    write_entries(entries, output.with_suffix(".csv"))
    return Ingested(tuple(records), tuple(rejected), tuple(entries))


def _inspected(record: Record, band: BandPass, limits: PassportLimits) -> tuple[Record, Entry]:
    """The record after processing, and its row of the table; with a reason, it is rejected."""
    file, name = record.source_file, record.record_id
    try:
        processed = _processed(record, band)
        corners = band.corners(record.time_step) if record.uncorrected else None
        checked = passport(record, processed, limits, corners)
    except ParameterError as error:
        return record, Entry(file, name, reason=str(error))
    reason = " ".join(str(check) for check in checked.rejections)
    return processed, Entry(file, name, checked, f"record {name!r}: {reason}" if reason else "")


def _processed(record: Record, band: BandPass) -> Record:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    if not record.uncorrected:
        return record
    corrected, steps = correct(record.acceleration, record.time_step, band)
    return replace(record, acceleration=corrected, processing=(*record.processing, *steps))


def pulse_stage(
    records_path: Path,
    output: Path,
    *,
    shortest_period: float = SHORTEST_PERIOD,
    longest_period: float = LONGEST_PERIOD,
    progress: Progress = _silent,
) -> None:
    """Find the best pulse of each wavelet in each horizontal record: ``pulses.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    shortest_period, longest_period : float
        Range of T_p that is searched [s].
    progress : callable
        Called with the number of records done and in all.

    Raises
    ------
    InputError
        If the records cannot be read or the output not written.
    ParameterError
        If no record is horizontal, or none of the periods fits a record.
    """
    records = _horizontal(read_records(records_path), records_path)
    matches: list[list[PulseMatch]] = []
    for i, record in enumerate(records):
        try:
            matches.append(
                [
                    match_pulse(
                        record.acceleration,
                        record.time_step,
                        name,
                        shortest_period=shortest_period,
                        longest_period=longest_period,
                    )
                    for name in WAVELETS
                ]
            )
        except ParameterError as error:
            raise ParameterError(f"record {record.record_id!r}: {error}") from None
        progress(i + 1, len(records))
    write(
        pulses_dataset(records, matches),
        output,
        PULSES,
        input_sha256=input_hash(records_path),
        parameters={"periods_s": [shortest_period, longest_period]},
    )


def respond_stage(
    records_path: Path,
    output: Path,
    *,
    structures_path: Path = SHIPPED_STRUCTURES,
    structure: str | None = None,
    progress: Progress = _silent,
) -> None:
    """Compute the response of each structure to each horizontal record: ``response.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    structures_path : Path
        TOML file of ``[[structure]]`` tables; by default the shipped ones.
    structure : str, optional
        Only the structure of this name.
    progress : callable
        Called with the number of records done and in all.

    Raises
    ------
    InputError
        If the records or structures cannot be read, or the output not written.
    ParameterError
        If there is no structure of that name, or no record is horizontal.
    """
    frames = _chosen(read_structures(structures_path), structure)
    records = _horizontal(read_records(records_path), records_path)
    responses: list[list[Response]] = []
    for i, record in enumerate(records):
        responses.append([respond(frame, record) for frame in frames])
        progress(i + 1, len(records))
    write(
        response_dataset(records, frames, responses),
        output,
        RESPONSE,
        input_sha256=input_hash(records_path) | input_hash(structures_path),
        parameters={"structures": [frame.name for frame in frames]},
    )


def _chosen(frames: list[RockingFrame], name: str | None) -> list[RockingFrame]:
    if name is None:
        return frames
    chosen = [frame for frame in frames if frame.name == name]
    if not chosen:
        known = ", ".join(frame.name for frame in frames)
        raise ParameterError(f"Invalid structure {name!r}. Must be one of: {known}.")
    return chosen


def _horizontal(records: list[Record], path: Path) -> list[Record]:
    horizontal = [r for r in records if r.orientation is not Orientation.VERTICAL]
    if not horizontal:
        raise ParameterError(
            f"{path}: all {len(records)} records are vertical. Must hold a horizontal one."
        )
    return horizontal
