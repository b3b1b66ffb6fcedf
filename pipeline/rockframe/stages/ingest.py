"""ingest: from files to records.nc and the table of all inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import CATALOGUE, Limits, ReadOptions, Rejection, collect, read_catalogue
from rockframe.provenance import refuse_overwriting, sha256_of
from rockframe.record import Record
from rockframe.results import (
    RECORDS,
    Entry,
    records_dataset,
    refuse_strange_entries,
    write,
    write_entries,
)
from rockframe.signals import BandPass, correct, passport
from rockframe.study import PassportLimits


@dataclass(frozen=True)
class Ingested:
    """What became of the files.

    Parameters
    ----------
    records : tuple of Record
        Those that went through, after processing.
    rejections : tuple of Rejection
        Those that did not, and the files that gave none.
    entries : tuple of Entry
        Rows of the table, a record or a file each, with the passport where one was made.
    inputs : mapping of str to str
        Names and SHA-256 of the files that gave the records and of the catalogues.
    """

    records: tuple[Record, ...]
    rejections: tuple[Rejection, ...]
    entries: tuple[Entry, ...]
    inputs: Mapping[str, str]


def ingest_stage(
    paths: Sequence[Path],
    output: Path,
    *,
    options: ReadOptions | None = None,
    catalogue: Path | None = None,
    band: BandPass | None = None,
    all_uncorrected: bool = False,
    passport_limits: PassportLimits | None = None,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    strict: bool = False,
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
    catalogue : Path, optional
        CSV of facts about the files; otherwise each folder's own ``catalogue.csv``.
    band : BandPass, optional
        Corner frequencies for uncorrected records.
    all_uncorrected : bool
        Take every record for uncorrected, whatever its format says.
    passport_limits : PassportLimits, optional
        Limits of the checks of each record.
    progress : callable, optional
        Called with the name of each file.
    workers : int, optional
        Most processes that read files, by default one for each core; 0 reads in this one, where a
        crash of a reader is a crash of the run. The output is the same.
    limits : Limits, optional
        Time and memory that reading a file may take.
    strict : bool
        Write nothing if a file is rejected.

    Returns
    -------
    Ingested
        Records, rejections, and the rows of the table.

    Raises
    ------
    InputError
        If a path does not exist, an output would replace an input or a list that is not ours, or
        no record went through, or one was rejected and `strict`: then nothing is written.
    """
    band, options = band or BandPass(), options or ReadOptions()
    checks = passport_limits or PassportLimits()
    beside = output.with_suffix(".csv")
    catalogues = [catalogue] if catalogue else [path / CATALOGUE for path in paths]
    refuse_overwriting((output, beside), (*_files(paths), *catalogues))
    refuse_strange_entries(beside)
    read, unread = collect(
        paths,
        options,
        read_catalogue(catalogue) if catalogue else None,
        progress,
        workers=workers,
        limits=limits,
        strict=strict,
    )
    inspected = [_inspected(record, band, checks, all_uncorrected) for record in read]
    del read  # the samples before correction need not wait for the end of the run
    result = _sorted(inspected, unread, [path for path in catalogues if path.is_file()])
    _require_some(result, strict)
    passports = [e.passport for e in result.entries if e.passport and not e.reason]
    write(
        records_dataset(result.records, passports),
        output,
        RECORDS,
        input_sha256=result.inputs,
        parameters={
            "all_uncorrected": all_uncorrected,
            "band_pass_hz": [band.low, band.high],
            "passport": checks.stated(),
            "time_step_s": options.time_step,
            "units": options.units,
        },
    )
    write_entries(result.entries, beside)
    return result


def _sorted(
    inspected: Sequence[tuple[Record, Entry]],
    unread: Sequence[Rejection],
    catalogues: Sequence[Path],
) -> Ingested:
    """Accepted records first, then what was rejected, each in the order of the files."""
    records = tuple(record for record, entry in inspected if not entry.reason)
    entries = [entry for _, entry in inspected]
    entries += [Entry(r.file, "", reason=r.reason, line=r.line) for r in unread]
    entries.sort(key=lambda entry: bool(entry.reason))
    rejections = [Rejection(e.file, e.reason, e.line) for e in entries if e.reason]
    inputs = {record.source_file: record.source_sha256 for record in records}
    inputs |= {path.name: sha256_of(path) for path in catalogues}
    return Ingested(records, tuple(rejections), tuple(entries), inputs)


def _require_some(result: Ingested, strict: bool) -> None:
    if result.records and not (strict and result.rejections):
        return
    first, others = result.rejections[0], len(result.rejections) - 1
    more = f" ({others} more rejected.)" if others else ""
    raise InputError(first.file, first.reason + more, first.line)


def _files(paths: Sequence[Path]) -> list[Path]:
    return [file for path in paths for file in (path.iterdir() if path.is_dir() else [path])]


def _inspected(
    record: Record, band: BandPass, limits: PassportLimits, all_uncorrected: bool
) -> tuple[Record, Entry]:
    """Return the record after processing, and its row of the table; with a reason: rejected."""
    file, name = record.source_file, record.record_id
    uncorrected = record.uncorrected or all_uncorrected
    try:
        processed = _processed(record, band) if uncorrected else _moving(record)
        corners = band.corners(record.time_step, record.duration) if uncorrected else None
        checked = passport(record, processed, limits, corners)
    except ParameterError as error:
        return record, Entry(file, name, reason=str(error))
    reason = " ".join(str(check) for check in checked.rejections)
    return processed, Entry(file, name, checked, f"record {name!r}: {reason}" if reason else "")


def _moving(record: Record) -> Record:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    return record


def _processed(record: Record, band: BandPass) -> Record:
    corrected, steps = correct(_moving(record).acceleration, record.time_step, band)
    return replace(record, acceleration=corrected, processing=(*record.processing, *steps))
