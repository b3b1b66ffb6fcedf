"""Write and read the file of records."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.components import (
    BothDirections,
    Channel,
    HorizontalPair,
    both_directions,
    motions_of,
    pair_horizontals,
    reasons_alone,
    rotd_spectral_acceleration,
)
from rockframe.components import rotd as rotd_of
from rockframe.engines.engine import on_threads
from rockframe.errors import InputError, ParameterError, require_known
from rockframe.record import LONGEST_ID, Orientation, Part, Record
from rockframe.results.schema import RECORDS
from rockframe.results.schema.arrays import Arrays
from rockframe.results.schema.records import RECORDS_NC
from rockframe.results.shards import opened_arrays
from rockframe.results.stored import damage_named
from rockframe.results.writing import Growing, Row, slices, write_rows
from rockframe.signals.corner import UNCHANGED, Corner, CornerSource
from rockframe.signals.measures import housner_intensity, spectral_acceleration
from rockframe.signals.passport import Passport
from rockframe.signals.processing import AsRead, BandPass, integrate, peak

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: A record with its passport, and its samples before the correction of this package.
RecordRow: TypeAlias = (
    tuple[Record, Passport | None] | tuple[Record, Passport | None, AsRead | None]
)


def write_records(
    records: Iterable[RecordRow],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    rotd: Mapping[str, Mapping[str, Any]] | None = None,
    spectral_periods: Sequence[float] = (),
    batch: str = "",
    attrs: Mapping[str, str] | None = None,
) -> tuple[dict[str, str], Arrays]:
    """Write the output of the ingest stage, complete or not at all; one record is in memory at a
    time.

    The same inputs give the same bytes.

    Parameters
    ----------
    records : iterable of (Record, Passport or None, AsRead or None)
        At least one record. Either all records have a passport, or none; without passports the file
        has no measures, and no samples as they were read. The last item may be omitted. If the
        iterable raises an error, no file is left.
    path : Path
        The file to write; an older file is replaced.
    input_sha256 : mapping
        Name and SHA-256 of each input except the record files.
    parameters : mapping
        The options of the stage; JSON values.
    rotd : mapping, optional
        Measures of both horizontals by variable, for each record (`RecordsFile.rotd`); by default
        those of the pairs among the records. Without passports the file has none.
    spectral_periods : sequence of float
        Periods [s] of the spectral accelerations that the file contains, with the Housner
        intensity; by default it has neither.
    batch, attrs
        As for `write_rows`; a batch may have no records.

    Returns
    -------
    dict of str to str
        Name and SHA-256 of each input, including the record files.
    Arrays
        What was written, without the samples.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    inputs, periods = dict(input_sha256), tuple(spectral_periods)

    def measures(columns: Mapping[str, list[Any]], written: Growing) -> Mapping[str, Any]:
        if "passport" not in columns:
            return {}
        where = slices(columns["row_size"])

        def record(row: int) -> Record:
            samples = written.appended("acceleration", where[row])
            return _record({name: column[row] for name, column in columns.items()}, samples)

        pairs = rotd_of_motions(channels_of(columns), record, periods) if rotd is None else rotd
        spectra = {"spectral_period": periods} if periods else {}
        return {**rotd_columns(columns["record_id"], pairs, len(periods)), **spectra}

    dataset = write_rows(
        RECORDS_NC,
        (_row(*record, periods=periods) for record in records),
        path,
        partial(_with_sources, inputs),
        further=measures,
        batch=batch,
        attrs=attrs,
        input_sha256=inputs,
        parameters=parameters,
    )
    return inputs, dataset


def _with_sources(
    inputs: dict[str, str], columns: Mapping[str, list[Any]]
) -> Mapping[str, list[Any]]:
    """Add the hashes of the files of the records to those of the inputs; return the columns."""
    for of in ("source", "instrument"):
        for name, digest in zip(columns[f"{of}_file"], columns[f"{of}_sha256"], strict=True):
            if digest:
                inputs.setdefault(name, digest)
    return columns


def write_scaled(
    source: RecordsFile,
    factors: Mapping[str, float],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str] | None = None,
) -> Arrays:
    """Write some records of a file, each times a factor, in their order; return what was written,
    without the samples.

    Measures that depend on the amplitude are scaled; the verdict of the passport is that of the
    record as it was recorded.

    Parameters
    ----------
    source : RecordsFile
        The open file of the records.
    factors : mapping of str to float
        Factor of each record by its identifier.
    path, input_sha256, parameters
        As for `write_records`.
    left_out : mapping of str to str, optional
        Reasons for the other records, by identifier.

    Raises
    ------
    ParameterError
        If the file has no record with one of the identifiers.
    InputError
        If a record is corrupted, or the file cannot be written.
    """
    inputs = dict(input_sha256)
    return write_rows(
        RECORDS_NC,
        (source.scaled_row(name, factor) for name, factor in factors.items()),
        path,
        partial(_with_sources, inputs),
        further=lambda _columns, _written: source.common,
        input_sha256=inputs,
        parameters=parameters,
        left_out=left_out,
    )


def channels_of(values: Mapping[str, Any] | Dataset) -> list[Channel]:
    """Return the channel of each record from the values of a dataset or of its columns."""
    named = ("row_size" if name == "samples" else name for name in Channel._fields)
    held = (values[name] for name in named)
    columns = (getattr(column, "values", np.asarray(column)).tolist() for column in held)
    return [
        Channel(*row)._replace(orientation=Orientation(row[Channel._fields.index("orientation")]))
        for row in zip(*columns, strict=True)
    ]


def rotd_columns(
    names: Iterable[str], rotd: Mapping[str, Mapping[str, Any]], periods: int
) -> dict[str, list[Any]]:
    """Return RotD of each record by variable; NaN for verticals."""
    unknown: dict[str, Any] = {**dict.fromkeys(_ROTD, math.nan), "unpaired": ""}
    if periods:
        unknown |= dict.fromkeys(_ROTD_OF_SPECTRA, [math.nan] * periods)
    of_row = [{**unknown, **rotd.get(name, {})} for name in names]
    return {name: [of_one[name] for of_one in of_row] for name in unknown}


def rotd_of_motions(
    channels: Sequence[Channel],
    record: Callable[[int], Record],
    periods: Sequence[float],
    computed: Mapping[tuple[int, ...], Mapping[str, Mapping[str, Any]]] | None = None,
) -> dict[str, Mapping[str, Any]]:
    """Return RotD of each record that has a pair, and the reason for each horizontal that has none.

    `record` reads the record of a channel by its number; one motion is in memory at a time. Motions
    that `computed` has, by the numbers of their channels, are not computed again.
    """
    measures_of: dict[str, Mapping[str, Any]] = {}
    alone = reasons_alone(channels)
    for rows in motions_of(channels):
        across = [row for row in rows if not channels[row].orientation.upright]
        if len(across) < 2:  # no samples are needed to say so
            names = (channels[row].record_id for row in across)
            measures_of |= {name: {"unpaired": alone[name]} for name in names}
            continue
        if (of_motion := (computed or {}).get(tuple(rows))) is not None:
            measures_of |= of_motion
            continue
        pairs, unpaired = pair_horizontals(map(record, rows))
        measures_of |= {reason.record_id: {"unpaired": reason.reason} for reason in unpaired}
        for pair in pairs:
            of_pair = _rotd_of(pair, periods)
            measures_of |= {component.record_id: of_pair for component in (pair.first, pair.second)}
    return measures_of


def _rotd_of(pair: HorizontalPair, periods: Sequence[float]) -> dict[str, Any]:
    pga, pgv = rotd_of(pair), rotd_of(pair, transform=integrate)
    shares = [value.percentile(share) for value in (pga, pgv) for share in (50, 100)]
    values: dict[str, Any] = dict(zip(_ROTD, (*shares, pga.strongest_azimuth), strict=True))
    sweeps = on_threads(partial(rotd_spectral_acceleration, pair), periods) if periods else []
    for name, share in zip(_ROTD_OF_SPECTRA, (50, 100), strict=True) if periods else ():
        values[name] = [sweep.percentile(share) for sweep in sweeps]
    return values


def _row(
    record: Record,
    passport: Passport | None,
    as_read: AsRead | None = None,
    *,
    periods: Sequence[float] = (),
) -> Row:
    """Return the series of a record and its other values, by variable."""
    series = {"acceleration": record.acceleration}
    if passport is not None:
        unknown = np.broadcast_to(math.nan, record.acceleration.shape)
        series["acceleration_as_read"] = unknown if as_read is None else as_read.samples
    facts = {
        "row_size": record.acceleration.size,
        "pga": peak(record.acceleration),
        "pgv": peak(integrate(record.acceleration, record.time_step)),
        **RECORDS_NC.filled("record", record),
        "processing": "; ".join(record.processing),
        "trusted": "; ".join(record.trusted),
        "parts": "; ".join(map(str, record.parts)),
    }
    if passport is not None:
        facts |= RECORDS_NC.filled("measures", passport.measures)
        facts |= RECORDS_NC.filled("passport", passport)
        facts["corner_frequency_high"] = math.nan if as_read is None else as_read.band.high
    if periods:
        motion = record.acceleration, record.time_step
        facts["spectral_acceleration"] = spectral_acceleration(*motion, periods)
        facts["housner_intensity"] = housner_intensity(*motion)
    return series, facts


def _record(values: Mapping[str, Any], samples: NDArray[np.float64]) -> Record:
    """Return the record of these values by variable."""
    steps, trusted = str(values["processing"]), str(values.get("trusted", ""))
    parts = str(values.get("parts", ""))
    return Record(
        acceleration=samples,
        processing=tuple(steps.split("; ")) if steps else (),
        trusted=tuple(trusted.split("; ")) if trusted else (),
        parts=tuple(map(Part.of, parts.split("; "))) if parts else (),
        **{field.name: field.dtype(values[field.name]) for field in _FIELDS},
    )


#: Fields of a record, except its samples and processing.
_FIELDS: Final = [variable for variable in RECORDS_NC.variables if variable.source == "record"]
#: RotD50 and RotD100 of PGA and PGV, and the azimuth of the largest acceleration.
_ROTD: Final = ("pga_rotd50", "pga_rotd100", "pgv_rotd50", "pgv_rotd100", "azimuth_rotd100")
_ROTD_OF_SPECTRA: Final = ("spectral_acceleration_rotd50", "spectral_acceleration_rotd100")
#: Units of quantities that grow with the amplitude of a motion, and variables that do otherwise.
_OF_MOTION: Final = ("m s-2", "m s-1", "m")
_POWERS: Final = {"vs30": 0, "arias_intensity": 2}
#: Allowed relative difference between the peaks of samples and the stated peaks: samples may have
#: single precision.
_PEAK_TOLERANCE: Final = 1e-5


class RecordsFile:
    """An open file of records, read one record at a time; a ``with`` block closes it.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe ingest``.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with ExitStack() as stack:
            self._series = stack.enter_context(opened_arrays(self.path, RECORDS))
            self._values_of = self._series.without("obs").loaded()
            self._open = stack.pop_all()
        self._samples_of = slices(self._values_of["row_size"].values)
        self._rows = {name: row for row, name in enumerate(self.names)}

    def __enter__(self) -> RecordsFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Record]:
        """Read one record after the other."""
        return map(self.read, self.names)

    def close(self) -> None:
        """Close the file."""
        self._open.close()

    @property
    def names(self) -> list[str]:
        """Identifiers of the records."""
        return [str(name) for name in self._values_of["record_id"].values]

    @property
    def most_parts(self) -> int:
        """Largest number of motions of a sequence in the file; 0 without sequences."""
        if "parts" not in self._values_of:
            return 0
        texts = map(str, self._values_of["parts"].values)
        return max((len(text.split("; ")) for text in texts if text), default=0)

    @property
    def sequences(self) -> list[str]:
        """Identifiers of the records that are sequences of motions."""
        if "parts" not in self._values_of:
            return []
        texts = map(str, self._values_of["parts"].values)
        return [name for name, text in zip(self.names, texts, strict=True) if text]

    def in_both(self, names: Sequence[str]) -> BothDirections:
        """Return both horizontal components of the motion of these records, with the vertical.

        Raises
        ------
        ParameterError
            If they cannot be combined.
        """
        motions, rejected = both_directions([self.read(name) for name in names])
        if not motions:
            raise ParameterError(rejected[0].reason)
        return motions[0]

    def name_of_pair(self, first: str) -> str:
        """Return a name of both horizontals together: ``both`` in place of the first component."""
        component = str(self._values_of["component"].values[self._rows[first]])
        stem = first.removesuffix(component) if component else first
        stem = stem if stem and stem != first else f"{first}-"
        name = f"{stem[: LONGEST_ID - 4]}both"
        return name if name not in self._rows else f"{first[: LONGEST_ID - 10]}-with-both"

    @property
    def orientations(self) -> list[Orientation]:
        """Orientations of the records."""
        return [Orientation(int(value)) for value in self._values_of["orientation"].values]

    @property
    def azimuths(self) -> list[float]:
        """Azimuths of the records, clockwise from north [degree]; NaN if unknown."""
        return list(map(float, self._values_of["azimuth"].values))

    @property
    def motions(self) -> list[list[str]]:
        """Identifiers of the records of each motion, in the order of the file."""
        names, channels = self.names, channels_of(self._values_of)
        return [[names[row] for row in rows] for rows in motions_of(channels)]

    @property
    def rotd(self) -> dict[str, dict[str, Any]]:
        """RotD of each record if the file states it, by variable."""
        named = (*_ROTD, *_ROTD_OF_SPECTRA, "unpaired")
        names = [name for name in named if name in self._values_of]
        values = self._columns(*names)
        return {
            name: {key: column[row] for key, column in values.items()}
            for name, row in self._rows.items()
        }

    def _columns(self, *names: str) -> dict[str, list[Any]]:
        return {name: self._values_of[name].values.tolist() for name in names}

    def samples(self, names: Sequence[str]) -> int:
        """Return the total number of samples of the records with these names."""
        rows = [self._rows[name] for name in names]
        return int(self._values_of["row_size"].values[rows].sum())

    def usable_periods(self, name: str) -> tuple[float, float]:
        """Return the shortest and longest usable period of a record [s]; 0 and infinity if unknown.

        Both are 0 if no period is usable.
        """
        row, bounds = self._rows[name], (0.0, math.inf)
        if "usable_period_longest" not in self._values_of:  # without passports
            return bounds
        corners = (
            float(self._values_of[f"usable_period_{end}"].values[row])
            for end in ("shortest", "longest")
        )
        shortest, longest = (
            default if math.isnan(value) else value
            for value, default in zip(corners, bounds, strict=True)
        )
        return shortest, longest

    def corner(self, name: str) -> Corner:
        """Return the lower corner with which this package corrected a record.

        It is unknown, as for records that this package did not correct, in files without passports
        and in files of earlier versions.
        """
        if "corner_frequency" not in self._values_of:
            return UNCHANGED
        row = self._rows[name]
        frequency, source = (
            self._values_of[f"corner_{of}"].values[row] for of in ("frequency", "source")
        )
        return Corner(float(frequency), CornerSource(int(source)))

    def as_read(self, name: str) -> AsRead | None:
        """Return the samples of a record before this package corrected it, and the band.

        They are unknown, None, for records that this package did not correct, in files without
        passports and in files of earlier versions.

        Raises
        ------
        InputError
            If the record is corrupted.
        """
        if "acceleration_as_read" not in self._series:
            return None
        row = self._rows[name]
        high = float(self._values_of["corner_frequency_high"].values[row])
        if math.isnan(high):
            return None
        samples = self._samples("acceleration_as_read", row)
        try:
            return AsRead(samples, BandPass(self.corner(name).frequency, high))
        except ParameterError as error:
            raise InputError(self.path, f"record {name!r}: {error}") from None

    def _samples(self, variable: str, row: int) -> NDArray[np.float64]:
        """Return the samples of a record by the row in which the file has it."""
        with damage_named(self.path, RECORDS):
            return self._series[variable].isel(obs=self._samples_of[row]).values

    def scaled_row(self, name: str, factor: float) -> Row:
        """Return the series of a record and its other values, by variable, times a factor.

        Raises
        ------
        ParameterError
            If the file has no such record.
        InputError
            If the record is corrupted.
        """
        record = self.read(name).scaled(factor)
        series = {"acceleration": record.acceleration}
        row = self._rows[name]
        if "acceleration_as_read" in self._series:
            series["acceleration_as_read"] = factor * self._samples("acceleration_as_read", row)
        values = {
            str(key): variable.values[row]
            for key, variable in self._values_of.variables.items()
            if variable.dims[:1] == ("record",)
        }
        for variable in RECORDS_NC.variables:
            power = _POWERS.get(variable.name, int(variable.units in _OF_MOTION))
            if power and variable.name in values:
                values[variable.name] = values[variable.name] * factor**power
        return series, {**values, "processing": "; ".join(record.processing)}

    @property
    def common(self) -> dict[str, Any]:
        """Values of the variables that do not belong to single records, such as periods."""
        values = self._values_of.variables.items()
        return {
            str(key): variable.values for key, variable in values if "record" not in variable.dims
        }

    def read(self, name: str) -> Record:
        """Read the record with this name.

        Raises
        ------
        ParameterError
            If the file has no such record.
        InputError
            If the record is corrupted.
        """
        if name not in self._rows:
            require_known("record", name, self._rows)
        row = self._rows[name]
        fields: dict[Any, Any] = {
            key: array.values[row]
            for key, array in self._values_of.variables.items()
            if array.dims == ("record",)
        }
        samples = self._samples("acceleration", row)
        try:
            record = _record(fields, samples)
        except ParameterError as error:
            raise InputError(self.path, str(error)) from None
        self._require_peaks(record, float(fields["pga"]), float(fields["pgv"]))
        return record

    def _require_peaks(self, record: Record, pga: float, pgv: float) -> None:
        """Reject samples whose peaks do not match the stated peaks: wrong slices or wrong units."""
        for name, peak_of_samples, peak_of_file, units in (
            ("acceleration", peak(record.acceleration), pga, "m/s2"),
            ("velocity", peak(integrate(record.acceleration, record.time_step)), pgv, "m/s"),
        ):
            if not math.isclose(peak_of_samples, peak_of_file, rel_tol=_PEAK_TOLERANCE):
                raise InputError(
                    self.path,
                    f"samples of {record.record_id!r} with a peak {name} of "
                    f"{peak_of_samples:g} {units}, stated as {peak_of_file:g} {units}. "
                    "Must be equal.",
                )


def open_records(path: str | Path) -> RecordsFile:
    """Open the output of the ingest stage, to read one record at a time.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.

    Examples
    --------
    >>> import tempfile
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "records.nc")
    ...     _ = write_records([(record, None)], path, input_sha256={}, parameters={})
    ...     with open_records(path) as records:
    ...         [record.duration for record in records]
    [0.2]
    """
    return RecordsFile(path)


def read_records(path: str | Path) -> list[Record]:
    """Read all records of the output of the ingest stage.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or not the output of the ingest stage.

    Examples
    --------
    >>> read_records("no-such-file.nc")
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-file.nc: no such file. Must be a records file.
    """
    with open_records(path) as records:
        return list(records)
