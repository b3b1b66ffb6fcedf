"""Select and scale records whose response spectra match a target: a file of scaled records."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal, table_lines
from rockframe.errors import InputError, ParameterError
from rockframe.options.ingest import LARGEST_FACTOR, LEAST_FACTOR, Filters, SelectOptions
from rockframe.provenance import refuse_overwriting
from rockframe.record import Record, is_record_id
from rockframe.results.pulses import RecordMetadata, read_metadata
from rockframe.results.records import RecordsFile, open_records, write_scaled
from rockframe.results.tables.entries import beside, refuse_other_table, write_rows_as
from rockframe.results.writing import input_hash
from rockframe.risk import Site
from rockframe.selection.choice import Candidates, Groups, choose, scaled_by, scaled_to_fit
from rockframe.selection.target import TargetSpectrum, read_target
from rockframe.signals.measures import spectral_acceleration
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
        The selected motions, with units in the names; then the vertical records beside them.
    records, candidates : int
        Number of horizontal records, and of those that the constraints allow.
    left_out : mapping of str to str
        Reasons of the records that are no candidates, by identifier.
    tables : tuple of Path
        The list of the motions, and their spectra.
    """

    target: TargetSpectrum
    log_sa: Float
    rows: list[dict[str, Any]]
    records: int
    candidates: int
    left_out: Mapping[str, str]
    tables: tuple[Path, Path]

    @property
    def motions(self) -> list[dict[str, Any]]:
        """The rows of the selected motions, without the vertical records."""
        return [row for row in self.rows if not row["vertical_of"]]

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
    `IngestOptions` reads, and a table of the spectra.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write: ``selected.nc``, with
        ``selected.csv`` and ``selected-spectra.csv``.
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
    tables = output.with_suffix(".csv"), beside(output.with_suffix(".csv"), "spectra", plain="")
    read = [records_path, options.target, *([pulses_path] if pulses_path else [])]
    refuse_overwriting([output, *tables], read, beside=output)
    refuse_other_table(tables[0], LISTED, "the list of selected motions")
    refuse_other_table(tables[1], _OF_SPECTRA, "the table of their spectra")
    if options.pulse_like is not None and pulses_path is None:
        raise ParameterError("pulse_like needs pulses. State them with --pulses.")
    target = _target(options)
    metadata = read_metadata(records_path, pulses_path)
    with open_records(records_path) as file:
        pool = _Pool(file, metadata, target, options, filters)
        factors, log_sa = pool.chosen(progress)
        verticals = _verticals(file, factors)
        write_scaled(
            file,
            factors | {name: factors[of] for name, of in verticals.items()},
            output,
            input_sha256=input_hash(*read),
            parameters=options.stated() | {"filters": filters.bounds()},
            left_out=pool.left_out,
        )
    away = np.sqrt(((log_sa - target.log_sa) ** 2).mean(axis=1))
    rows = list(_rows(metadata, factors, dict(zip(factors, away, strict=True)), verticals))
    selection = Selection(
        target, log_sa, rows, pool.records, len(pool.names), pool.left_out, tables
    )
    write_rows_as(tables[0], rows)
    write_rows_as(tables[1], selection.spectra())
    return selection


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


class _Pool:
    """The records of a file from which motions are selected.

    After `chosen`, `names` are the candidates, and `left_out` has the reasons of the other
    horizontal records, each of which begins with the constraint.
    """

    def __init__(
        self,
        file: RecordsFile,
        metadata: RecordMetadata,
        target: TargetSpectrum,
        options: SelectOptions,
        filters: Filters,
    ) -> None:
        self._file = file
        self._metadata = metadata
        self._target = target
        self._options = options
        self._filters = filters
        self._rows = {name: row for row, name in enumerate(metadata.names)}
        names = horizontal(file)
        reasons = {name: self._refusal(name) for name in names}
        self.records = len(names)
        self.left_out = {name: reason for name, reason in reasons.items() if reason}
        self.names = [name for name in names if name not in self.left_out]

    def chosen(self, progress: Progress) -> tuple[dict[str, float], Float]:
        """Return the factors of the selected records, in the order of the file, and the logarithms
        of their scaled spectra.

        Raises
        ------
        ParameterError
            If not enough records can be selected.
        """
        options, names = self._options, self.names
        candidates = self._scaled(progress)
        choice = choose(candidates, self._target, options.motions, self._groups(), options.seed)
        within = {names[motion] for motion in candidates.motion}
        low, high = options.scale_bounds
        out = f"scale_bounds exceeded. Must be from {low:g} to {high:g}"
        self.left_out |= dict.fromkeys((name for name in names if name not in within), out)
        self.names = [name for name in names if name in within]
        if choice.size < options.motions:
            raise ParameterError(self._why_few(choice.size))
        choice = choice[np.argsort(candidates.motion[choice])]
        factors = {names[candidates.motion[k]]: float(candidates.factor[k]) for k in choice}
        return factors, candidates.log_sa[choice]

    def _refusal(self, name: str) -> str:
        """Return the reason why a record is no candidate, or ""."""
        row, longest = self._rows[name], float(self._target.period[-1])
        numbers = {key: float(values[row]) for key, values in self._metadata.numbers.items()}
        usable = self._file.usable_periods(name)[1]
        reason = filtered_by(self._filters, numbers, self._metadata.texts["site"][row])
        reason = reason or filtered_by_pulse(
            self._options.pulse_like, self._metadata.pulse_like[row]
        )
        if not reason and usable < longest:
            return f"usable_period_longest {usable:.3g} s. Must be at least {longest:g} s"
        return reason

    def _scaled(self, progress: Progress) -> Candidates:
        """Return the candidates with the factors that the options allow."""
        target, options, rows = self._target, self._options, [self._rows[n] for n in self.names]
        at = options.conditioning_period_s or options.scale_period_s
        periods = [*target.period, *([] if at is None else [at])]
        spectra = np.empty((len(rows), len(periods)))
        for k, name in enumerate(self.names):
            record = self._file.read(name)
            _refuse_scaled(record)
            spectra[k] = spectral_acceleration(record.acceleration, record.time_step, periods)
            progress(k + 1, len(rows))
        everything = np.log(spectra)
        log_sa = everything[:, : target.period.size]
        if at is not None:
            factor = np.exp(target.log_sa_at(at) - everything[:, -1])
            return scaled_by(log_sa, factor, options.scale_bounds)
        if options.scale_pgv_m_s is not None:
            pgv = self._metadata.numbers["pgv"][rows]
            return scaled_by(log_sa, options.scale_pgv_m_s / pgv, options.scale_bounds)
        return scaled_to_fit(log_sa, target, options.scale_bounds)

    def _groups(self) -> list[Groups]:
        """Return the limits of stations and events; unknown ones are groups of their own."""
        texts, rows = self._metadata.texts, [self._rows[name] for name in self.names]
        limits: list[tuple[list[Hashable], int]] = [
            (
                [(texts["network"][r], texts["station"][r] or r) for r in rows],
                self._options.most_per_station,
            )
        ]
        if self._options.most_per_event is not None:
            limits.append(([texts["event"][r] or r for r in rows], self._options.most_per_event))
        groups = []
        for keys, most in limits:
            numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
            groups.append(Groups(np.array([numbers[key] for key in keys], dtype=np.int64), most))
        return groups

    def _why_few(self, reached: int) -> str:
        """Return the message that not enough records can be selected, and why."""
        options = self._options
        removed = Counter(reason.split(" ")[0] for reason in self.left_out.values())
        limits = "most_per_station" + (" or most_per_event" if options.most_per_event else "")
        removed[limits] = len(self.names) - reached
        counted = ", ".join(f"{count} by {name}" for name, count in removed.most_common() if count)
        wanted = f"{options.motions} motions wanted, but only {reached} can be selected of"
        out = f" Left out: {counted}." if counted else ""
        advice = "Allow more, add records, or state fewer motions."
        return f"{wanted} {self.records} horizontal records.{out} {advice}"


def _refuse_scaled(record: Record) -> None:
    """Raise an error if a record is scaled: its factor would be missing in the list."""
    for step in record.processing:
        if step.startswith("scaled by "):
            message = f"record {record.record_id!r} is {step} already. Select from the records as"
            raise ParameterError(f"{message} `rockframe ingest` wrote them, without a selection.")


def _verticals(file: RecordsFile, factors: Mapping[str, float]) -> dict[str, str]:
    """Return the vertical records beside the selected ones, each with the one it belongs to.

    A vertical beside two selected components belongs to neither: it cannot have both factors.
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
    verticals: Mapping[str, str],
) -> Iterator[dict[str, Any]]:
    """Yield the rows of the list: the selected records, then the verticals beside them."""
    rows = {name: row for row, name in enumerate(metadata.names)}
    for name in (*factors, *verticals):
        factor, row = factors[verticals.get(name, name)], rows[name]
        numbers = {key: float(values[row]) for key, values in metadata.numbers.items()}
        yield {
            "record_id": name,
            "scale": factor,
            "event": metadata.texts["event"][row],
            "station": metadata.texts["station"][row],
            **{key: numbers[number] for key, number in _NUMBERS.items()},
            "pga_g": factor * numbers["pga"] / GRAVITY,
            "pgv_m_s": factor * numbers["pgv"],
            "misfit": float(misfits.get(name, math.nan)),
            "vertical_of": verticals.get(name, ""),
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
