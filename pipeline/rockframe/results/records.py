"""records.nc: the samples of the records and what is known of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from enum import IntEnum
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.errors import ParameterError
from rockframe.record import Orientation, Record
from rockframe.results.files import RECORDS, damage_named, named, opened, put
from rockframe.results.growing import growing
from rockframe.results.variables import flags, record_ids, row_sizes, texts, variable
from rockframe.signals import CheckVerdict, Passport, integrate, peak

#: Text of a record, by variable: field of Record, long name.
_TEXTS: Final = {
    "event": "name of the earthquake",
    "station": "code or name of the station",
    "network": "code of the network",
    "component": "name of the component in the archive",
    "start_time": "time of the first sample, UTC",
    "facts_source": "where event, magnitude and distance are from, as the catalogue says",
    "source_file": "name of the file that held the record",
    "source_format": "format of that file",
    "source_sha256": "SHA-256 of that file",
    "instrument_file": "name of the StationXML file that turned counts into acceleration",
    "instrument_sha256": "SHA-256 of that StationXML file",
}

#: Numbers of a record, by variable: unit, long name.
_NUMBERS: Final = {
    "time_step": ("s", "interval between samples"),
    "azimuth": ("degree", "direction of positive acceleration, clockwise from north"),
    "magnitude": ("1", "magnitude of the earthquake"),
    "epicentral_distance": ("km", "distance to the epicentre"),
    "vs30": ("m s-1", "mean velocity of shear waves in the uppermost 30 m"),
    "peak_ratio": ("1", "peak in the file over the peak that its header states, before processing"),
    "filter_low": ("Hz", "lower corner of the filters that the archive states"),
    "filter_high": ("Hz", "upper corner of the filters that the archive states"),
}

#: Peaks of a record, by variable: unit, long name.
_PEAKS: Final = {
    "pga": ("m s-2", "peak ground acceleration"),
    "pgv": ("m s-1", "peak ground velocity, at rest before the record"),
}

#: Numbers of a passport, by variable: field of Measures, unit, long name.
_MEASURES: Final = {
    "arias_intensity": ("m s-1", "Arias intensity"),
    "significant_duration": ("s", "significant duration, 5 to 95 % of the Arias intensity"),
    "significant_duration_75": ("s", "significant duration, 5 to 75 % of the Arias intensity"),
    "strong_start": ("s", "time of 5 % of the Arias intensity, since the first sample"),
    "usable_period_shortest": ("s", "shortest usable period; 0 if none is usable"),
    "usable_period_longest": ("s", "longest usable period; 0 if none is usable"),
    "end_velocity": ("m s-1", "velocity at the end of the record, from rest"),
    "end_displacement": ("m", "displacement at the end of the record, from rest"),
    "noise_level": ("m s-2", "root mean square of the acceleration before the event, as recorded"),
}


_SAMPLES: Final = variable(
    "obs", np.empty(0), "m s-2", "ground acceleration, all records one after the other"
)


class _Trigger(IntEnum):
    IN_TIME = 0
    LATE = 1


#: Flags of a record, by variable: enumeration, long name; the last two are of the passport.
_FLAGS: Final = {
    "orientation": (Orientation, "direction of the component"),
    "late_trigger": (_Trigger, "trigger of the recording"),
    "passport": (CheckVerdict, "verdict of the record passport"),
}


def write_records(
    records: Iterable[tuple[Record, Passport | None]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
) -> dict[str, str]:
    """Write the output of the ingest stage, whole or not at all; holds one record at a time.

    The same inputs give the same bytes.

    Parameters
    ----------
    records : iterable of (Record, Passport or None)
        At least one; if one has no passport, none must have one: then there are no measures. An
        error that it raises leaves no file.
    path : Path
        Where it goes; an older file there is replaced.
    input_sha256 : mapping
        Name and SHA-256 of each input besides the files that held the records.
    parameters : mapping
        The options of the stage; JSON values.

    Returns
    -------
    dict of str to str
        Name and SHA-256 of each input, the files of the records among them.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    columns: dict[str, list[Any]] = defaultdict(list)
    source = iter(records)
    # What is wrong with all of them is said before there is a folder or a file.
    first = tuple(islice(source, 1))
    with named(path) as partial:
        with growing(partial, {"acceleration": _SAMPLES}) as append:
            for record, passport in chain(first, source):
                append({"acceleration": record.acceleration})
                for name, value in _known(record, passport).items():
                    columns[name].append(value)
        held = dict(zip(columns["source_file"], columns["source_sha256"], strict=True))
        held |= zip(columns["instrument_file"], columns["instrument_sha256"], strict=True)
        held.pop("", None)
        inputs = {**held, **input_sha256}
        put(
            _dataset(columns),
            partial,
            RECORDS,
            input_sha256=inputs,
            parameters=parameters,
            mode="a",
        )
    return inputs


def _known(record: Record, passport: Passport | None) -> dict[str, Any]:
    """What is known of a record, by variable."""
    known: dict[str, Any] = {
        "record_id": record.record_id,
        "row_size": record.acceleration.size,
        "pga": peak(record.acceleration),
        "pgv": peak(integrate(record.acceleration, record.time_step)),
        "orientation": record.orientation,
        "processing": "; ".join(record.processing),
        **{name: getattr(record, name) for name in (*_TEXTS, *_NUMBERS)},
    }
    if passport is not None:
        known |= {name: getattr(passport.measures, name) for name in _MEASURES}
        known |= {"late_trigger": passport.late_trigger, "passport": passport.verdict}
    return known


def _dataset(columns: Mapping[str, list[Any]]) -> xr.Dataset:
    """Return all variables but the samples."""
    numbers = {**_NUMBERS, **_PEAKS, **(_MEASURES if "passport" in columns else {})}
    variables = {
        "record_id": record_ids(columns["record_id"]),
        "row_size": row_sizes(columns["row_size"]),
        **{
            name: variable("record", np.array(columns[name], dtype=np.float64), units, long_name)
            for name, (units, long_name) in numbers.items()
        },
        **{name: texts("record", columns[name], long_name) for name, long_name in _TEXTS.items()},
        **{
            name: flags("record", columns[name], kind, long_name)
            for name, (kind, long_name) in _FLAGS.items()
            if name in columns
        },
        "processing": texts("record", columns["processing"], "processing after reading"),
    }
    return xr.Dataset(variables, attrs={"title": "Strong-motion records"})


class RecordsFile:
    """A records file, open for reading one record at a time; closes at the end of a ``with`` block.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe ingest``.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with ExitStack() as stack:
            dataset = stack.enter_context(opened(self.path, RECORDS))
            self._samples = dataset["acceleration"].variable
            self._known = dataset.drop_vars("acceleration").load()
            self._open = stack.pop_all()
        self._ends = np.cumsum(self._known["row_size"].values)
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
        return [str(name) for name in self._known["record_id"].values]

    @property
    def orientations(self) -> list[Orientation]:
        """Orientations of the records."""
        return [Orientation(int(value)) for value in self._known["orientation"].values]

    def read(self, name: str) -> Record:
        """Read the record of this name.

        Raises
        ------
        ParameterError
            If there is none.
        InputError
            If it is damaged.
        """
        if name not in self._rows:
            known = ", ".join(self.names)
            raise ParameterError(f"Invalid record {name!r}. Must be one of: {known}.")
        row = self._rows[name]

        def value(variable: str) -> Any:
            return self._known[variable].values[row]

        end, steps = int(self._ends[row]), str(value("processing"))
        with damage_named(self.path, RECORDS):
            samples = self._samples[end - int(value("row_size")) : end].values
        return Record(
            record_id=name,
            acceleration=samples,
            orientation=Orientation(int(value("orientation"))),
            processing=tuple(steps.split("; ")) if steps else (),
            **{text: str(value(text)) for text in _TEXTS},  # type: ignore[arg-type]
            **{number: float(value(number)) for number in _NUMBERS},  # type: ignore[arg-type]
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
        If the file is missing, damaged, or something else.

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
        If the file is missing, damaged, or not the output of the ingest stage.
    """
    with open_records(path) as records:
        return list(records)
