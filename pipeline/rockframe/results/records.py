"""records.nc: the samples of the records and what is known of them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from rockframe.record import Orientation, Record
from rockframe.results.files import RECORDS, opened
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


class _Trigger(IntEnum):
    IN_TIME = 0
    LATE = 1


def records_dataset(records: Sequence[Record], passports: Sequence[Passport] = ()) -> xr.Dataset:
    """Return the dataset of the ingest stage: the records' samples and what is known of them.

    Parameters
    ----------
    records : sequence of Record
        At least one.
    passports : sequence of Passport
        One for each record, or none at all: then the dataset has no measures.
    """
    velocities = [peak(integrate(r.acceleration, r.time_step)) for r in records]
    variables = _known(records, velocities) | (_measured(passports) if passports else {})
    return xr.Dataset(variables, attrs={"title": "Strong-motion records"})


def _numbers(values: Sequence[float], units: str, long_name: str) -> xr.Variable:
    return variable("record", np.array(values, dtype=np.float64), units, long_name)


def _measured(passports: Sequence[Passport]) -> dict[str, xr.Variable]:
    return {
        **{
            name: _numbers([getattr(p.measures, name) for p in passports], units, long_name)
            for name, (units, long_name) in _MEASURES.items()
        },
        "late_trigger": flags(
            "record", [p.late_trigger for p in passports], _Trigger, "trigger of the recording"
        ),
        "passport": flags(
            "record", [p.verdict for p in passports], CheckVerdict, "verdict of the record passport"
        ),
    }


def _known(records: Sequence[Record], velocities: Sequence[float]) -> dict[str, xr.Variable]:
    return {
        "record_id": record_ids(records),
        "row_size": row_sizes(records),
        "time_step": _numbers([r.time_step for r in records], "s", "interval between samples"),
        "acceleration": variable(
            "obs",
            np.concatenate([r.acceleration for r in records]),
            "m s-2",
            "ground acceleration, all records one after the other",
        ),
        "pga": _numbers(
            [peak(r.acceleration) for r in records], "m s-2", "peak ground acceleration"
        ),
        "pgv": _numbers(velocities, "m s-1", "peak ground velocity, at rest before the record"),
        **{
            name: texts("record", [getattr(r, name) for r in records], long_name)
            for name, long_name in _TEXTS.items()
        },
        "orientation": flags(
            "record", [r.orientation for r in records], Orientation, "direction of the component"
        ),
        "azimuth": _numbers(
            [r.azimuth for r in records],
            "degree",
            "direction of positive acceleration, clockwise from north",
        ),
        "magnitude": _numbers([r.magnitude for r in records], "1", "magnitude of the earthquake"),
        "epicentral_distance": _numbers(
            [r.epicentral_distance for r in records], "km", "distance to the epicentre"
        ),
        "processing": texts(
            "record", ["; ".join(r.processing) for r in records], "processing after reading"
        ),
    }


def read_records(path: str | Path) -> list[Record]:
    """Read what `records_dataset` described.

    Raises
    ------
    InputError
        If the file is missing, damaged, or not the output of the ingest stage.
    """
    with opened(Path(path), RECORDS) as dataset:
        loaded = dataset.load()
    ends = np.cumsum(loaded["row_size"].values)
    texts = {name: loaded[name].values for name in _TEXTS}
    numbers = {
        name: loaded[name].values
        for name in ("time_step", "azimuth", "magnitude", "epicentral_distance")
    }
    records = []
    for i, end in enumerate(ends):
        size = int(loaded["row_size"].values[i])
        steps = str(loaded["processing"].values[i])
        records.append(
            Record(
                record_id=str(loaded["record_id"].values[i]),
                acceleration=loaded["acceleration"].values[end - size : end],
                orientation=Orientation(int(loaded["orientation"].values[i])),
                processing=tuple(steps.split("; ")) if steps else (),
                **{name: str(values[i]) for name, values in texts.items()},  # type: ignore[arg-type]
                **{name: float(values[i]) for name, values in numbers.items()},  # type: ignore[arg-type]
            )
        )
    return records
