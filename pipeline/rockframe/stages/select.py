"""Select and scale records whose response spectra match a target: a file of scaled records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal, table_lines
from rockframe.components import HorizontalPair, rotd, rotd_spectral_acceleration
from rockframe.engines.engine import on_threads
from rockframe.errors import InputError, ParameterError
from rockframe.ingest.identify import record_ids
from rockframe.options.ingest import LARGEST_FACTOR, LEAST_FACTOR, Filters, SelectOptions
from rockframe.provenance import refuse_overwriting
from rockframe.record import Record, is_record_id
from rockframe.results.pulses import RecordMetadata, read_metadata
from rockframe.results.records import RecordsFile, open_records, write_scaled
from rockframe.results.tables.entries import beside, refuse_other_table, write_rows_as
from rockframe.results.writing import input_hash
from rockframe.risk import Site
from rockframe.selection.flatfile import Recording, read_flatfile
from rockframe.selection.pool import Pool, periods_of
from rockframe.selection.target import TargetSpectrum, read_target, target_files
from rockframe.signals.measures import spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.stages.common import Progress, filtered_by, filtered_by_pulse, horizontal, silent
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Columns that a list of selected records must have; `select_stage` writes more.
LISTED: Final = ("record_id", "scale")
#: First columns of the table of spectra.
_OF_SPECTRA: Final = ("period_s", "target_sa_g")
#: Columns of numbers in the list, with the name of the number in records.nc.
_NUMBERS: Final = {
    "magnitude": "magnitude",
    "epicentral_distance_km": "epicentral_distance",
    "distance_rrup_km": "distance_rrup",
    "vs30_m_s": "vs30",
}


@dataclass(frozen=True, eq=False)
class Selection:
    """A selection of scaled motions.

    Parameters
    ----------
    target : TargetSpectrum
        The target.
    log_sa : array, shape (motions, periods)
        Natural logarithm of the spectra of the selected, scaled motions in m s-2.
    rows : list of dict
        The selected motions, with units in the names; then the second components of pairs, and the
        vertical records beside them.
    records, candidates : int
        Number of horizontal records, or recordings, and of those that the constraints allow.
    left_out : mapping of str to str
        Reasons of those that are no candidates, by identifier.
    tables : tuple of Path
        The list of the motions, and their spectra.
    noun : str
        Plural of what was selected from.
    """

    target: TargetSpectrum
    log_sa: Float
    rows: list[dict[str, Any]]
    records: int
    candidates: int
    left_out: Mapping[str, str]
    tables: tuple[Path, Path]
    noun: str = "horizontal records"

    @property
    def motions(self) -> list[dict[str, Any]]:
        """The rows of the selected motions, without verticals and second components of pairs."""
        return [row for row in self.rows if not (row["vertical_of"] or row["pair_of"])]

    def periods(self) -> list[dict[str, float]]:
        """Return a row for each period: median and standard deviation, of target and selection.

        The standard deviation of a target without a spread is NaN.
        """
        target, number = self.target, len(self.log_sa)
        spread = self.log_sa.std(axis=0, ddof=1 if number > 1 else 0)
        wanted = np.full(spread.shape, np.nan) if target.deviation is None else target.deviation
        median, aim = (np.exp(x) / GRAVITY for x in (self.log_sa.mean(axis=0), target.log_sa))
        columns = {
            "period_s": target.period,
            "target_sa_g": aim,
            "median_sa_g": median,
            "median_difference": median / aim - 1.0,
            "target_sigma_ln_sa": wanted,
            "sigma_ln_sa": spread,
        }
        return [
            {name: float(values[k]) for name, values in columns.items()}
            for k in range(target.period.size)
        ]

    def spectra(self) -> list[dict[str, float]]:
        """Return the rows of `periods`, with Sa of each motion [g] under its identifier."""
        names = [row["record_id"] for row in self.motions]
        each = (np.exp(self.log_sa) / GRAVITY).T.tolist()
        return [
            row | dict(zip(names, sa, strict=True))
            for row, sa in zip(self.periods(), each, strict=True)
        ]


def refuse_columns(options: SelectOptions) -> None:
    """Refuse columns of a flatfile where a file of records shall be written.

    Raises
    ------
    ParameterError
        If columns of a flatfile are stated.
    """
    if options.flatfile_columns:
        message = "flatfile_columns: a flatfile has no waveforms. State the list of its files as"
        raise ParameterError(f"{message} output, such as selected.csv.")


def select_stage(
    records_path: str | Path,
    output: str | Path,
    options: SelectOptions,
    *,
    pulses_path: str | Path | None = None,
    filters: Filters | None = None,
    progress: Progress = silent,
) -> Selection:
    r"""Select motions whose spectra match a target, and write them scaled, as a file of records.

    Beside the file are a list of the motions with their scales, which ``selection`` of
    `IngestOptions` reads, and a table of the spectra. Of a flatfile, which has spectra but no
    waveforms, only these tables are written: the list names the files to download.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write: ``selected.nc``, with
        ``selected.csv`` and ``selected-spectra.csv``. Or a flatfile (`read_flatfile`), and the list
        to write, ``selected.csv``.
    options : SelectOptions
        Target, number of motions, scales and constraints.
    pulses_path : str or Path, optional
        Output of `pulse_stage` for the same records, for the constraint on pulses.
    filters : Filters, optional
        Filters of records; by default all horizontal records.
    progress : callable
        Called with the number of spectra computed and in total.

    Raises
    ------
    InputError
        If a file cannot be read or written, or if the target does not cover the periods.
    ParameterError
        If not enough records can be selected, if pulses are needed but not stated, or if records
        are scaled already.

    Examples
    --------
    >>> import tempfile, rockframe
    >>> motion = rockframe.bundled_records() / "Ridgecrest2019-CLC.V1"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     home = Path(folder)
    ...     _ = (home / "target.csv").write_text("period_s,sa_g\n0.5,0.6\n1,0.3\n2,0.1\n")
    ...     _ = rockframe.ingest_stage([motion], home / "records.nc", workers=0)
    ...     wanted = SelectOptions(target=home / "target.csv", motions=1)
    ...     found = select_stage(home / "records.nc", home / "selected.nc", wanted)
    >>> [(row["record_id"], round(row["scale"], 3)) for row in found.motions]
    [('Ridgecrest2019-CLC-360', 0.892)]
    """
    records_path, output = Path(records_path), Path(output)
    pulses_path, filters = Path(pulses_path) if pulses_path else None, filters or Filters()
    if output.suffix.lower() == ".csv":
        return _of_flatfile(records_path, output, options, filters)
    refuse_columns(options)
    tables = output.with_suffix(".csv"), beside(output.with_suffix(".csv"), "spectra", plain="")
    read = [records_path, *target_files(options.target), *([pulses_path] if pulses_path else [])]
    _refuse_places([output, *tables], tables, read, output)
    if options.pulse_like is not None and pulses_path is None:
        raise ParameterError("pulse_like needs pulses. State them with --pulses.")
    target = _target(options)
    metadata = read_metadata(records_path, pulses_path)
    with open_records(records_path) as file:
        records = _Records(file, metadata, target, options, filters)
        factors, log_sa = records.chosen(progress)
        pool, seconds = records.pool, {records.beside[n]: n for n in factors if n in records.beside}
        verticals = _verticals(file, factors)
        further = verticals | seconds
        write_scaled(
            file,
            factors | {name: factors[of] for name, of in further.items()},
            output,
            input_sha256=input_hash(*read),
            parameters=options.stated() | {"filters": filters.bounds()},
            left_out=pool.left_out,
        )
    away = np.sqrt(((log_sa - target.log_sa) ** 2).mean(axis=1))
    misfits = dict(zip(factors, away, strict=True))
    rows = list(_rows(metadata, factors, misfits, seconds, verticals))
    return _written(target, log_sa, rows, pool, tables)


def _refuse_places(
    outputs: Sequence[Path], tables: Sequence[Path], read: Sequence[Path], output: Path
) -> None:
    """Refuse to replace inputs and other tables."""
    refuse_overwriting(outputs, read, beside=output)
    refuse_other_table(tables[0], LISTED, "the list of selected motions")
    refuse_other_table(tables[1], _OF_SPECTRA, "the table of their spectra")


def _written(
    target: TargetSpectrum,
    log_sa: Float,
    rows: list[dict[str, Any]],
    pool: Pool,
    tables: tuple[Path, Path],
) -> Selection:
    """Write the list and the table of spectra; return the selection."""
    selection = Selection(
        target, log_sa, rows, pool.number, len(pool.names), pool.left_out, tables, pool.noun
    )
    write_rows_as(tables[0], rows)
    write_rows_as(tables[1], selection.spectra())
    return selection


def _of_flatfile(path: Path, output: Path, options: SelectOptions, filters: Filters) -> Selection:
    """Select recordings of a flatfile, and write the list of their files."""
    if path.suffix == ".nc":
        raise InputError(path, "has waveforms. State a netCDF file as output, such as selected.nc.")
    if options.pulse_like is not None:
        raise ParameterError("pulse_like needs waveforms, which a flatfile has not. Remove it.")
    tables = output, beside(output, "spectra", plain="")
    _refuse_places(tables, tables, [path, *target_files(options.target)], output)
    target = _target(options)
    at = periods_of(target, options)
    flatfile = read_flatfile(path, at, options.flatfile_columns or (), options.pairs)
    recordings = {recording.name: recording for recording in flatfile.recordings}
    rows = dict(zip(recordings, flatfile.log_sa, strict=True))
    reasons = {
        name: _refusal_of_recording(recording, rows[name], at, filters, options)
        for name, recording in recordings.items()
    }
    pool = Pool("recordings", reasons, target, options)
    kept = [recordings[name] for name in pool.names]
    factors, log_sa = pool.chosen(
        np.array([rows[name] for name in pool.names]).reshape(-1, at.size),
        [each.station and (each.network, each.station) for each in kept],
        [each.event for each in kept],
        np.array([each.numbers["pgv"] for each in kept]),
    )
    away = np.sqrt(((log_sa - target.log_sa) ** 2).mean(axis=1))
    listed = [
        row
        for (name, factor), misfit in zip(factors.items(), away.tolist(), strict=True)
        for row in _files_of(recordings[name], factor, misfit)
    ]
    return _written(target, log_sa, listed, pool, tables)


def _refusal_of_recording(
    recording: Recording, log_sa: Float, periods: Float, filters: Filters, options: SelectOptions
) -> str:
    """Return the reason why a recording of a flatfile is no candidate, or ""."""
    reason = filtered_by(filters, recording.numbers, "unknown")
    unknown = periods[np.isnan(log_sa)]
    longest = float(periods.max())
    if not reason and unknown.size:
        reason = f"sa unknown at {unknown[0]:g} s. Must be stated"
    if not reason and recording.longest < longest:
        reason = f"usable_period_longest {recording.longest:.3g} s. Must be at least {longest:g} s"
    if not reason and options.scale_pgv_m_s is not None and not recording.numbers["pgv"] > 0.0:
        reason = "pgv unknown. Must be stated"
    return reason


def _files_of(recording: Recording, factor: float, misfit: float) -> Iterator[dict[str, Any]]:
    """Yield the rows of the list for the files of a recording: its horizontals and its vertical."""
    named = [name for name in recording.files if name] or [""]
    ids = [record_ids(Path(name), [""])[0] if name else recording.name for name in named]
    horizontals = sum(bool(name) for name in recording.files[:2])
    numbers = recording.numbers
    for place, (name, record_id) in enumerate(zip(named, ids, strict=True)):
        upright = place > 0 and place >= horizontals
        level = math.nan if upright else factor  # peaks are those of both horizontals
        yield {
            "record_id": record_id,
            "scale": factor,
            "event": recording.event,
            "station": recording.station,
            **{key: numbers[number] for key, number in _NUMBERS.items()},
            "pga_g": level * numbers["pga"] / GRAVITY,
            "pgv_m_s": level * numbers["pgv"],
            "misfit": math.nan if place else misfit,
            "vertical_of": ids[0] if upright else "",
            "pair_of": ids[0] if place and not upright else "",
            "recording": recording.name,
            "file": name,
        }


def _target(options: SelectOptions) -> TargetSpectrum:
    site = Site(options.hazard_site, options.hazard_site_id or "", options.hazard_site_within_km)
    target = read_target(
        options.target,
        options.periods_s,
        options.condition,
        site=site,
        probability=options.hazard_probability,
    )
    period = options.scale_period_s
    if period is not None and not target.period[0] <= period <= target.period[-1]:
        first, last = target.period[0], target.period[-1]
        message = f"scale_period_s {period:g}. Must be within the periods of the target, {first:g}"
        raise ParameterError(f"{message} to {last:g} s.")
    return target


class _Records:
    """The records of a file from which single components or pairs are selected.

    A pair has the identifier of its first component; `beside` has the second one.
    """

    def __init__(
        self,
        file: RecordsFile,
        metadata: RecordMetadata,
        target: TargetSpectrum,
        options: SelectOptions,
        filters: Filters,
    ) -> None:
        self._file, self._metadata, self._options = file, metadata, options
        self._periods = periods_of(target, options)
        self._rows = {name: row for row, name in enumerate(metadata.names)}
        self.beside: dict[str, str] = {}
        names, alone = horizontal(file), dict[str, str]()
        if options.pairs is not None:
            self.beside, alone = _pairs(file)
            names = [name for name in names if name in self.beside or name in alone]
        longest = float(target.period[-1])
        reasons = {name: alone.get(name) or self._refusal(name, filters, longest) for name in names}
        noun = "horizontal records" if options.pairs is None else "recordings"
        self.pool = Pool(noun, reasons, target, options)

    def chosen(self, progress: Progress) -> tuple[dict[str, float], Float]:
        """Return the factors of the selected motions, in the order of the file, and the logarithms
        of their scaled spectra.

        Raises
        ------
        ParameterError
            If not enough motions can be selected.
        """
        names, texts = self.pool.names, self._metadata.texts
        spectra, pgv = np.empty((len(names), self._periods.size)), np.empty(len(names))
        for k, name in enumerate(names):
            spectra[k], pgv[k] = self._measured(name)
            progress(k + 1, len(names))
        rows = [self._rows[name] for name in names]
        stations = [
            texts["station"][r] and (texts["network"][r], texts["station"][r]) for r in rows
        ]
        events = [texts["event"][row] for row in rows]
        return self.pool.chosen(np.log(spectra), stations, events, pgv)

    def _refusal(self, name: str, filters: Filters, longest: float) -> str:
        """Return the reason why a record, or its pair, is no candidate, or ""."""
        together = [name, *([self.beside[name]] if name in self.beside else [])]
        rows = [self._rows[each] for each in together]
        for row in rows:
            numbers = {key: float(values[row]) for key, values in self._metadata.numbers.items()}
            reason = filtered_by(filters, numbers, self._metadata.texts["site"][row])
            if reason:
                return reason
        pulse_like = [self._metadata.pulse_like[row] for row in rows]
        reason = filtered_by_pulse(
            self._options.pulse_like, True if True in pulse_like else pulse_like[0]
        )
        usable = min(self._file.usable_periods(each)[1] for each in together)
        if not reason and usable < longest:
            return f"usable_period_longest {usable:.3g} s. Must be at least {longest:g} s"
        return reason

    def _measured(self, name: str) -> tuple[Float, float]:
        """Return the spectrum [m s-2] and the peak ground velocity [m s-1] of a record or pair."""
        periods, pairs = self._periods, self._options.pairs
        if pairs is None:
            record = self._file.read(name)
            _refuse_scaled(record)
            spectrum = spectral_acceleration(record.acceleration, record.time_step, periods)
            return spectrum, float(self._metadata.numbers["pgv"][self._rows[name]])
        both = self._file.in_both([name, self.beside[name]])
        for record in both[:2]:
            _refuse_scaled(record)
        return _measures_of_pair(both.first, both.second, periods, pairs)


def _pairs(file: RecordsFile) -> tuple[dict[str, str], dict[str, str]]:
    """Return the second horizontal of each recording by the first one, and for horizontals without
    another one the reason why they are no pair.
    """
    upright = dict(zip(file.names, file.orientations, strict=True))
    beside, alone = dict[str, str](), dict[str, str]()
    for together in file.motions:
        level = [name for name in together if not upright[name].upright]
        if len(level) > 1:
            try:
                both = file.in_both(level)
            except ParameterError as error:
                alone |= dict.fromkeys(level, f"pairs impossible: {error}")
            else:
                [second] = [name for name in level if name != both.first.record_id]
                beside[both.first.record_id] = second
        alone |= dict.fromkeys(level if len(level) == 1 else [], "pairs need both horizontals")
    return beside, alone


def _measures_of_pair(
    first: Record, second: Record, periods: Float, measure: str
) -> tuple[Float, float]:
    """Return the spectrum [m s-2] and the peak ground velocity [m s-1] of two horizontals at right
    angles. Neither their azimuths nor the sense of one of them changes RotD.
    """
    if measure == "geometric-mean":
        levels = [
            [
                *spectral_acceleration(record.acceleration, record.time_step, periods),
                peak(integrate(record.acceleration, record.time_step)),
            ]
            for record in (first, second)
        ]
        *spectrum, pgv = np.sqrt(np.prod(levels, axis=0))
        return np.array(spectrum), float(pgv)
    pair = HorizontalPair(replace(first, azimuth=90.0), replace(second, azimuth=0.0))
    share = float(measure.removeprefix("rotd"))
    sweeps = on_threads(partial(rotd_spectral_acceleration, pair), periods.tolist())
    pgv = rotd(pair, transform=integrate).percentile(share)
    return np.array([sweep.percentile(share) for sweep in sweeps]), pgv


def _refuse_scaled(record: Record) -> None:
    """Raise an error if a record is scaled: its factor would be missing in the list."""
    for step in record.processing:
        if step.startswith("scaled by "):
            message = f"record {record.record_id!r} is {step} already. Select from the records as"
            raise ParameterError(f"{message} `rockframe ingest` wrote them, without a selection.")


def _verticals(file: RecordsFile, factors: Mapping[str, float]) -> dict[str, str]:
    """Return the vertical records beside the selected ones, each with the one it belongs to.

    A vertical beside two single components that are selected belongs to neither: it cannot have
    both factors.
    """
    upright = {name for name, of in zip(file.names, file.orientations, strict=True) if of.upright}
    verticals: dict[str, str] = {}
    for together in file.motions:
        selected = [name for name in together if name in factors]
        if len(selected) == 1:
            verticals |= {name: selected[0] for name in together if name in upright}
    return verticals


def _rows(
    metadata: RecordMetadata,
    factors: Mapping[str, float],
    misfits: Mapping[str, float],
    seconds: Mapping[str, str],
    verticals: Mapping[str, str],
) -> Iterator[dict[str, Any]]:
    """Yield the rows of the list: the selected records, the other components of pairs, and the
    verticals beside them.
    """
    rows = {name: row for row, name in enumerate(metadata.names)}
    for name in (*factors, *seconds, *verticals):
        first, row = seconds.get(name) or verticals.get(name, name), rows[name]
        numbers = {key: float(values[row]) for key, values in metadata.numbers.items()}
        yield {
            "record_id": name,
            "scale": factors[first],
            "event": metadata.texts["event"][row],
            "station": metadata.texts["station"][row],
            **{key: numbers[number] for key, number in _NUMBERS.items()},
            "pga_g": factors[first] * numbers["pga"] / GRAVITY,
            "pgv_m_s": factors[first] * numbers["pgv"],
            "misfit": float(misfits.get(name, math.nan)),
            "vertical_of": verticals.get(name, ""),
            "pair_of": seconds.get(name, ""),
        }


def read_selection(path: Path) -> dict[str, float]:
    r"""Read a list of selected records: the scale of each by its identifier.

    Parameters
    ----------
    path : Path
        CSV with the columns ``record_id`` and ``scale``; others are ignored.

    Raises
    ------
    InputError
        If the file cannot be read, lacks a column or a record, states a record twice, or a scale
        that is not a number from 0.001 to 1000.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "selected.csv")
    ...     _ = path.write_text("record_id,scale\nshake,1.5\n")
    ...     read_selection(path)
    {'shake': 1.5}
    """
    lines = table_lines(path)
    header = lines[0][1] if lines else []
    for column in LISTED:
        if column not in header:
            columns = ", ".join(header)[:80] or "missing"
            must = f"Must include {' and '.join(LISTED)}, as `rockframe select` writes them."
            raise InputError(path, f"columns {columns}. {must}", line=1)
    factors: dict[str, float] = {}
    for line, row in lines[1:]:
        cells = dict(zip(header, row, strict=False))
        name, scale = (cells.get(column, "") for column in LISTED)
        if not is_record_id(name) or name in factors:
            said = f"{name!r} is stated twice" if name in factors else f"{name[:80]!r}"
            raise InputError(path, f"record_id {said}. Must be a record, stated once.", line=line)
        try:
            factors[name] = decimal(scale)
        except ValueError:
            factors[name] = math.nan
        if not LEAST_FACTOR <= factors[name] <= LARGEST_FACTOR:
            must = f"Must be a number from {LEAST_FACTOR:g} to {LARGEST_FACTOR:g}."
            raise InputError(path, f"scale {scale[:80]!r}. {must}", line=line)
    if not factors:
        raise InputError(path, "states no record. Must state one or more.")
    return factors
