"""records.nc: the samples of the records and what is known of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.record import Orientation, Record, SiteType
from rockframe.results.files import RECORDS, named, put
from rockframe.results.growing import growing
from rockframe.results.recorded import NUMBERS, TEXTS, RecordsFile, open_records
from rockframe.results.variables import flags, record_ids, row_sizes, texts, variable
from rockframe.signals import CheckVerdict, Passport, integrate, peak

_TITLE: Final = "Strong-motion records"

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
    "end_velocity": ("m s-1", "velocity at the end of the record"),
    "end_displacement": ("m", "displacement at the end of the record"),
    "noise_level": ("m s-2", "root mean square of the acceleration before the event, as recorded"),
}


_SAMPLES: Final = variable(
    "obs", np.empty(0), "m s-2", "ground acceleration, all records one after the other"
)


class _Trigger(IntEnum):
    IN_TIME = 0
    LATE = 1


#: Numbers of the two horizontals of a motion, by variable: unit, long name.
_SWEEPS: Final = {
    "pga_rotd50": ("m s-2", "RotD50 of the peak ground acceleration of both horizontals"),
    "pga_rotd100": ("m s-2", "RotD100 of the peak ground acceleration of both horizontals"),
    "pgv_rotd50": ("m s-1", "RotD50 of the peak ground velocity of both horizontals"),
    "pgv_rotd100": ("m s-1", "RotD100 of the peak ground velocity of both horizontals"),
    "azimuth_rotd100": ("degree", "azimuth of the largest acceleration, clockwise from north"),
}

#: Flags of a record, by variable: enumeration, long name; the last two are of the passport.
_FLAGS: Final = {
    "orientation": (Orientation, "direction of the component"),
    "site_type": (SiteType, "place of the sensor, as far as the header says"),
    "late_trigger": (_Trigger, "trigger of the recording"),
    "passport": (CheckVerdict, "verdict of the record passport"),
}


def write_records(
    records: Iterable[tuple[Record, Passport | None]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    sweep: Callable[[RecordsFile], Mapping[str, Sequence[float]]] | None = None,
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
    sweep : callable, optional
        Called with the records before they are put in their place; gives numbers of both
        horizontals of each record, by variable.

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
        inputs = {**{name: digest for name, digest in held.items() if digest}, **input_sha256}
        origin = {"input_sha256": inputs, "parameters": parameters}
        put(_dataset(columns), partial, RECORDS, mode="a", **origin)
        if sweep is not None:
            put(_swept(partial, sweep), partial, RECORDS, mode="a", **origin)
    return inputs


def _swept(
    partial: Path, sweep: Callable[[RecordsFile], Mapping[str, Sequence[float]]]
) -> xr.Dataset:
    with open_records(partial) as records:
        found, unknown = sweep(records), np.full(len(records.names), np.nan)
    return xr.Dataset(
        {
            name: variable("record", np.array(found.get(name, unknown)), units, long_name)
            for name, (units, long_name) in _SWEEPS.items()
        },
        attrs={"title": _TITLE},
    )


def _known(record: Record, passport: Passport | None) -> dict[str, Any]:
    """What is known of a record, by variable."""
    known: dict[str, Any] = {
        "record_id": record.record_id,
        "row_size": record.acceleration.size,
        "pga": peak(record.acceleration),
        "pgv": peak(integrate(record.acceleration, record.time_step)),
        "orientation": record.orientation,
        "site_type": record.site_type,
        "processing": "; ".join(record.processing),
        **{name: getattr(record, name) for name in (*TEXTS, *NUMBERS)},
    }
    if passport is not None:
        known |= {name: getattr(passport.measures, name) for name in _MEASURES}
        known |= {"late_trigger": passport.late_trigger, "passport": passport.verdict}
    return known


def _dataset(columns: Mapping[str, list[Any]]) -> xr.Dataset:
    """Return all variables but the samples."""
    numbers = {**NUMBERS, **_PEAKS, **(_MEASURES if "passport" in columns else {})}
    variables = {
        "record_id": record_ids(columns["record_id"]),
        "row_size": row_sizes(columns["row_size"]),
        **{
            name: variable("record", np.array(columns[name], dtype=np.float64), units, long_name)
            for name, (units, long_name) in numbers.items()
        },
        **{name: texts("record", columns[name], long_name) for name, long_name in TEXTS.items()},
        **{
            name: flags("record", columns[name], kind, long_name)
            for name, (kind, long_name) in _FLAGS.items()
            if name in columns
        },
        "processing": texts("record", columns["processing"], "processing after reading"),
    }
    return xr.Dataset(variables, attrs={"title": _TITLE})
