"""The stages as path -> path: read, compute, write. The one place where they meet."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame
from rockframe.ingest import (
    CATALOGUE,
    CatalogueEntry,
    Limits,
    ReadOptions,
    Rejection,
    collect,
    read_catalogue,
    write_catalogue,
)
from rockframe.matching import LONGEST_PERIOD, SHORTEST_PERIOD, PulseMatch, match_pulse
from rockframe.provenance import refuse_overwriting, sha256_of, whole_file
from rockframe.record import Orientation, Record
from rockframe.results import (
    PULSES,
    RECORDS,
    RESPONSE,
    input_hash,
    pulses_dataset,
    read_records,
    records_dataset,
    response_dataset,
    write,
)
from rockframe.rocking.response import Response, respond
from rockframe.signals import BandPass, correct, peak
from rockframe.study import SHIPPED_STRUCTURES, read_structures
from rockframe.units import GRAVITY
from rockframe.wavelets import WAVELETS

if TYPE_CHECKING:
    from rockframe.fetch import Fetched, Request

#: Columns of the list of inputs.
_LIST_COLUMNS: Final = ("file", "record_id", "status", "line", "reason")
#: No ground has moved with a fraction of this [m s-2]; gal read as g does.
_IMPOSSIBLE: Final = 100.0 * GRAVITY
#: Called with what is done and what there is to do in all.
Progress = Callable[[int, int], None]


def _silent(_done: int, _total: int) -> None:
    """Report progress to nobody."""


def fetch_stage(
    request: Request,
    folder: Path,
    *,
    timeout: float,
    progress: Callable[[str], None] | None = None,
) -> Fetched:
    """Fetch records into a folder that `ingest_stage` reads, with a `catalogue.csv` of the event.

    Parameters
    ----------
    request : Request
        What to fetch.
    folder : Path
        New, empty, or that of an earlier run of the same request.
    timeout : float
        Longest time for one answer [s].
    progress : callable, optional
        Called with the name of each file that is asked for.

    Raises
    ------
    InputError
        If the folder holds something else, or cannot be written to.
    ServiceError
        If nothing came in, or a service stays silent or refuses what it is asked.
    """
    from rockframe.fetch import fetch  # obspy's client: the other stages need not wait for it

    fetched = fetch(request, folder, timeout=timeout, progress=progress)
    entries = [CatalogueEntry(**facts) for facts in fetched.facts()]
    write_catalogue(folder / CATALOGUE, entries)
    return fetched


@dataclass(frozen=True)
class Ingested:
    """What became of the files: the records that went through, the rejections, what was read.

    `inputs` are the names and SHA-256 of the files that gave the records and of the catalogues.
    """

    records: tuple[Record, ...]
    rejections: tuple[Rejection, ...]
    inputs: Mapping[str, str]


def ingest_stage(
    paths: Sequence[Path],
    output: Path,
    *,
    options: ReadOptions | None = None,
    catalogue: Path | None = None,
    band: BandPass | None = None,
    all_uncorrected: bool = False,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    strict: bool = False,
) -> Ingested:
    """Read record files into ``records.nc``; uncorrected ones get baseline and band-pass.

    Beside it goes a CSV file of the same name: every input, accepted or rejected, with the reason.

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
        Records and rejections.

    Raises
    ------
    InputError
        If a path does not exist, an output would replace an input or a list that is not ours, or
        no record went through, or one was rejected and `strict`: then nothing is written.
    """
    band, options = band or BandPass(), options or ReadOptions()
    beside = output.with_suffix(".csv")
    catalogues = [catalogue] if catalogue else [path / CATALOGUE for path in paths]
    refuse_overwriting((output, beside), (*_files(paths), *catalogues))
    _refuse_strange_list(beside)
    entries = read_catalogue(catalogue) if catalogue else None
    read, rejections = collect(
        paths, options, entries, progress, workers=workers, limits=limits, strict=strict
    )
    records: list[Record] = []
    rejected = list(rejections)
    for record in read:
        try:
            records.append(_processed(record, band, all_uncorrected))
        except ParameterError as error:
            rejected.append(Rejection(file=record.source_file, reason=str(error)))
    del read  # the samples before correction need not wait for the end of the run
    if strict and rejected:
        raise InputError(rejected[0].file, rejected[0].reason, rejected[0].line)
    if not records:
        first, others = rejected[0], len(rejected) - 1
        more = f" ({others} more rejected.)" if others else ""
        raise InputError(first.file, first.reason + more, first.line)
    inputs = {record.source_file: record.source_sha256 for record in records}
    inputs |= {path.name: sha256_of(path) for path in catalogues if path.is_file()}
    result = Ingested(tuple(records), tuple(rejected), inputs)
    write(
        records_dataset(records),
        output,
        RECORDS,
        input_sha256=inputs,
        parameters={
            "all_uncorrected": all_uncorrected,
            "band_pass_hz": [band.low, band.high],
            "time_step_s": options.time_step,
            "units": options.units,
        },
    )
    _write_list(result, beside)
    return result


def _files(paths: Sequence[Path]) -> list[Path]:
    return [file for path in paths for file in (path.iterdir() if path.is_dir() else [path])]


def _refuse_strange_list(path: Path) -> None:
    """The list of inputs is named after the output: do not replace something else of that name."""
    if not path.is_file():
        return
    with path.open("rb") as stream:
        first = stream.readline().decode("latin-1").strip()
    if first != ",".join(_LIST_COLUMNS):
        raise InputError(
            path, "is in the place of the list of inputs, and is not one. Must be moved away."
        )


def _processed(record: Record, band: BandPass, uncorrected: bool) -> Record:
    largest = peak(record.acceleration)
    if largest > _IMPOSSIBLE:
        raise ParameterError(
            f"peak acceleration {largest / GRAVITY:.4g} g of {record.record_id!r}. "
            f"Must be below {_IMPOSSIBLE / GRAVITY:g} g: are the units right?"
        )
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    if not (record.uncorrected or uncorrected):
        return record
    corrected, steps = correct(record.acceleration, record.time_step, band)
    return replace(record, acceleration=corrected, processing=(*record.processing, *steps))


def _write_list(result: Ingested, path: Path) -> None:
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_LIST_COLUMNS)
        for record in result.records:
            writer.writerow([record.source_file, record.record_id, "accepted", "", ""])
        for rejection in result.rejections:
            line = "" if rejection.line is None else rejection.line
            writer.writerow([rejection.file, "", "rejected", line, rejection.reason])


def pulse_stage(
    records_path: Path,
    output: Path,
    *,
    shortest_period: float = SHORTEST_PERIOD,
    longest_period: float = LONGEST_PERIOD,
    progress: Progress = _silent,
) -> tuple[Rejection, ...]:
    """Find the best pulse of each wavelet in each horizontal record: ``pulses.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    shortest_period, longest_period : float
        Range of T_p that is searched [s].
    progress : callable
        Called with the number of records done and in all.

    Returns
    -------
    tuple of Rejection
        Records in which no pulse of these periods can be searched; they are left out.

    Raises
    ------
    InputError
        If the records cannot be read or the output not written.
    ParameterError
        If no record is horizontal, or none can be searched.
    """
    refuse_overwriting([output], [records_path])
    records = _horizontal(read_records(records_path), records_path)
    matched: list[tuple[Record, list[PulseMatch]]] = []
    rejections: list[Rejection] = []
    for i, record in enumerate(records):
        try:
            matched.append((record, _matches(record, shortest_period, longest_period)))
        except ParameterError as error:
            rejections.append(Rejection(file=record.record_id, reason=str(error)))
        progress(i + 1, len(records))
    if not matched:
        raise ParameterError(f"record {rejections[0].file!r}: {rejections[0].reason}")
    write(
        pulses_dataset([record for record, _ in matched], [matches for _, matches in matched]),
        output,
        PULSES,
        input_sha256=input_hash(records_path),
        parameters={"periods_s": [shortest_period, longest_period]},
    )
    return tuple(rejections)


def _matches(record: Record, shortest_period: float, longest_period: float) -> list[PulseMatch]:
    return [
        match_pulse(
            record.acceleration,
            record.time_step,
            name,
            shortest_period=shortest_period,
            longest_period=longest_period,
        )
        for name in WAVELETS
    ]


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
    refuse_overwriting([output], [records_path, structures_path])
    frames = choose_structures(structures_path, structure)
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


def choose_structures(path: Path, name: str | None) -> list[RockingFrame]:
    """Return the structures of a file, or the one of that name.

    Raises
    ------
    InputError
        If the file cannot be read.
    ParameterError
        If there is no structure of that name.

    Examples
    --------
    >>> [frame.name for frame in choose_structures(SHIPPED_STRUCTURES, "apollo-frame")]
    ['apollo-frame']
    """
    frames = read_structures(path)
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
