"""pulses.nc: the pulses of each record; and the metadata of records and of their pulses."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from rockframe.components import recordings_of_channels
from rockframe.errors import InputError
from rockframe.matching.verdict import PulseVerdict
from rockframe.provenance import sha256_of
from rockframe.record import Part, Record, SiteType
from rockframe.results.records import channels_of, open_records
from rockframe.results.schema import PULSES, RECORDS
from rockframe.results.schema.arrays import Array, Arrays, arrays_of
from rockframe.results.schema.response import PULSES_NC
from rockframe.results.shards import opened_arrays
from rockframe.results.tables.rows import Row, columns_of, rows_along
from rockframe.results.writing import Origin, write_rows
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    from rockframe.matching.match import PulseMatch
    from rockframe.matching.record_pulses import RecordPulses
    from rockframe.results.schema.arrays import Dataset


def write_pulses(
    answers: Iterable[tuple[Record, RecordPulses]],
    path: Path,
    *,
    batch: str = "",
    **origin: Unpack[Origin],
) -> Arrays:
    """Write the output of the pulse stage, complete or not at all; one record is in memory at a
    time. Return what was written, without the series.

    Parameters
    ----------
    answers : iterable of (Record, RecordPulses)
        Each record with its pulses; all have the same wavelets and number of runners-up. If the
        iterable raises an error, no file is left.
    path : Path
        The file to write; an older file is replaced.
    batch : str
        The batch of the records, ``2/3``; empty for all records.
    **origin
        Keywords of `Origin`; the parameters include the number of ``runners_up``.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    rows = (
        (_series(record, pulses.matches[pulses.used].pulse), _values(record, pulses))
        for record, pulses in answers
    )
    complete = partial(_complete, runners_up=origin["parameters"]["runners_up"])
    return write_rows(PULSES_NC, rows, path, complete, batch=batch, **origin)


def _values(record: Record, pulses: RecordPulses) -> dict[str, Any]:
    return {
        "record_id": record.record_id,
        "row_size": record.acceleration.size,
        "samples_sha256": record.samples_sha256,
        "found": pulses,
    }


def _series(record: Record, pulse: Pulse) -> dict[str, NDArray[np.float64]]:
    return {
        "residual": record.acceleration - pulse.acceleration(record.time),
        "pulse_velocity": pulse.velocity(record.time),
        "pulse_displacement": pulse.displacement(record.time),
    }


def _complete(columns: Mapping[str, list[Any]], runners_up: int) -> dict[str, Any]:
    """Return the values of all variables except the series."""
    pulses: list[RecordPulses] = columns["found"]
    # Some runners-up do not exist: nothing of the record is left to search.
    further = [[*p.runners_up, *[None] * (runners_up - len(p.runners_up))] for p in pulses]
    return {
        **{name: values for name, values in columns.items() if name != "found"},
        **PULSES_NC.filled("match", [list(p.matches.values()) for p in pulses]),
        **PULSES_NC.filled("likeness", [list(p.likeness.values()) for p in pulses]),
        **PULSES_NC.filled("velocity", [p.velocity for p in pulses]),
        **(PULSES_NC.filled("runner_up", further) if runners_up else {}),
        **PULSES_NC.filled("used_match", [p.matches[p.used] for p in pulses]),
        **PULSES_NC.filled("used_likeness", [p.likeness[p.used] for p in pulses]),
        "best_wavelet": [p.used for p in pulses],
        "shortest_period": [p.periods[0] for p in pulses],
        "longest_period": [p.periods[1] for p in pulses],
        "wavelet": list(pulses[0].matches),
    }


#: Fields of a match, with their variables.
_OF_MATCH: Final = columns_of(
    "record_id match_index outside at_period_bound at_half_cycle_bound",
    "wavelet a_p T_p time=pulse_time phase half_cycles",
)
_BOUNDS: Final = ("match_index", "outside", "at_period_bound", "at_half_cycle_bound")


def best_of(pulses: Arrays) -> Arrays:
    """Return the values of the selected pulses, along ``record``."""
    wavelets = pulses["wavelet"].values.tolist()
    chosen = [wavelets.index(name) for name in pulses["best_wavelet"].values.tolist()]
    best = {}
    for name, variable in pulses.variables.items():
        if "wavelet" in variable.dims:
            values = np.broadcast_to(variable.values, (len(chosen), *variable.shape[-1:]))
            values = values[np.arange(len(chosen)), chosen]
            best[name] = Array.of(["record"], values, variable.attrs)
        else:
            best[name] = variable
    return pulses.with_variables(best)


def best_pulses(pulses: Path | Dataset) -> dict[str, PulseMatch]:
    """Return the selected pulse of each record of a pulse file, by record identifier.

    Parameters
    ----------
    pulses : Path or Dataset
        Output of the pulse stage, or `loaded_pulses` of it.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    from rockframe.matching.match import PulseMatch  # loads the search

    if isinstance(pulses, Path):
        pulses = loaded_pulses(pulses)
    best: dict[str, PulseMatch] = {}
    if "record_id" not in pulses:  # a batch without accepted records
        return best
    for row in rows_along(best_of(arrays_of(pulses)), "record", _OF_MATCH):
        name, match = row.pop("record_id"), {key: row.pop(key) for key in _BOUNDS}
        if math.isnan(row["half_cycles"]):
            row["half_cycles"] = None
        best[name] = PulseMatch(pulse=Pulse(**row), **match)
    return best


def sample_hashes(pulses: Dataset) -> dict[str, str]:
    """Return the hash of the samples from which each pulse was computed, by record."""
    columns = (
        pulses[key].values.tolist() if key in pulses else []
        for key in ("record_id", "samples_sha256")
    )
    return dict(zip(*columns, strict=True))


def require_pulses_of(path: Path, names: Collection[str]) -> None:
    """Refuse a file with pulses of other records only.

    Raises
    ------
    InputError
        If the file has pulses, but none of records with these names.
    """
    with opened_arrays(path, PULSES, empty=True) as pulses:
        has = pulses["record_id"].values.tolist() if "record_id" in pulses else []
    if has and not {*has} & {*names}:
        message = "contains no pulse of these records. Use the pulses of these records."
        raise InputError(path, message)


def require_samples(path: Path, hashes: Mapping[str, str], record: Record) -> None:
    """Refuse the pulses of a file if that of a record was computed from other samples.

    Raises
    ------
    InputError
        If the pulse of the record was computed from other samples.
    """
    if hashes.get(record.record_id, record.samples_sha256) != record.samples_sha256:
        raise InputError(
            path,
            f"the pulse of {record.record_id!r} was computed from other samples. "
            "Compute the pulses of these records.",
        )


def loaded_pulses(path: Path, names: Collection[str] | None = None) -> Arrays:
    """Return a pulse file without its series; empty for a batch without accepted records.

    Parameters
    ----------
    path : Path
        Output of the pulse stage.
    names : collection of str, optional
        Only the records with these names; of an index, only their shards are read.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened_arrays(path, PULSES, empty=True) as pulses:
        pulses = pulses.without("obs")
        if names is not None and "record_id" in pulses:
            wanted = {*names}
            listed = enumerate(pulses["record_id"].values.tolist())
            pulses = pulses.isel(record=[place for place, name in listed if name in wanted])
        return pulses.loaded()


_OF_PULSE: Final = (
    "a_p_g=a_p T_p_s=T_p pulse_time_s=pulse_time phase_rad=phase half_cycles L_p_m=L_p"
)
#: Columns of a row, and columns of a further pulse.
_COLUMNS: Final = columns_of(
    f"record_id wavelet best=best_wavelet {_OF_PULSE} match_index energy_share outside p_value",
    "surrogate_median surrogate_high pgv_ratio velocity_energy_ratio velocity_indicator",
    "velocity_T_p_s=velocity_T_p at_period_bound at_half_cycle_bound cut surrogates pulse_verdict",
)
_OF_RUNNER_UP: Final = {
    "record_id": "record_id",
    **{key: f"runner_up_{name}" for key, name in columns_of(_OF_PULSE, "energy_share").items()},
}


def pulse_rows(pulses: Path | Dataset) -> list[Row]:
    """Return a row for each record and wavelet; units are in the names.

    The row of the selected pulse, ``best``, has its runners-up.

    Parameters
    ----------
    pulses : Path or Dataset
        Output of the pulse stage, or what `write_pulses` returned.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    if isinstance(pulses, Path):
        pulses = loaded_pulses(pulses)
    if "record_id" not in pulses:  # a batch without accepted records
        return []
    rows = list(rows_along(pulses, "record wavelet", _COLUMNS))
    further: dict[str, list[Row]] = {}
    if "runner_up_a_p" in pulses:
        for row in rows_along(pulses, "record runner_up", _OF_RUNNER_UP):
            if math.isfinite(row["a_p_g"]):
                further.setdefault(row.pop("record_id"), []).append(row)
    for row in rows:
        row["best"] = row["best"] == row["wavelet"]
        row["runners_up"] = further.get(row["record_id"], []) if row["best"] else []
    return rows


Float = NDArray[np.float64]

#: Numerical metadata of a record, and numbers of its selected pulse.
DISTANCES: Final = (
    "epicentral_distance",
    "distance_rrup",
    "distance_rjb",
    "distance_hypocentral",
)
NUMBERS: Final = ("magnitude", *DISTANCES, "vs30", "azimuth", "pga", "pgv")
PULSE_NUMBERS: Final = ("a_p", "T_p", "L_p")
#: Result of the test against noise; None if the pulse was not tested.
_LIKE: Final = {
    PulseVerdict.UNTESTED: None,
    PulseVerdict.PULSE: True,
    PulseVerdict.NOISE: False,
    PulseVerdict.AT_BOUND: False,
}
_TEXTS: Final = ("event", "network", "station", "start_time", "component")
#: Key of a recording, which records that are not independent share.
Recording = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class RecordMetadata:
    """Metadata and measures of records; unknown values are NaN, an empty text, or None.

    Parameters
    ----------
    names : list of str
        Identifiers of the records, in the order of the file.
    texts : dict of str to list of str
        ``event``, ``network``, ``station``, ``start_time``, ``component`` and ``site`` of each.
    numbers : dict of str to array, shape (records,)
        `NUMBERS`, and `PULSE_NUMBERS` of the selected pulse, in SI units.
    recordings : list of tuple of str
        Recording of each: components of one motion share it, and so do a sequence and the motions
        that it consists of.
    pulse_like : list of bool or None
        True if the selected pulse passes the test against noise; None if this is unknown.
    """

    names: list[str]
    texts: dict[str, list[str]]
    numbers: dict[str, Float]
    recordings: list[Recording]
    pulse_like: list[bool | None]


def recordings_of(records: Path | Dataset) -> dict[str, Recording]:
    """Return the recording of each record by its identifier; records that are not independent, such
    as its components, have the same one.

    Parameters
    ----------
    records : Path or Dataset
        Output of the ingest stage, or what it wrote.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    if isinstance(records, Path):
        with opened_arrays(records, RECORDS) as dataset:
            return recordings_of(dataset)
    channels = channels_of(records)
    names = [channel.record_id for channel in channels]
    sequences = records["parts"].values if "parts" in records else [""] * len(names)
    parts = {
        name: [Part.of(part) for part in str(text).split("; ")]
        for name, text in zip(names, sequences, strict=True)
        if text
    }
    return dict(zip(names, recordings_of_channels(channels, parts), strict=True))


def peaks_of(records_path: Path) -> dict[str, float]:
    """Return the peak acceleration of each record [g] by its identifier.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened_arrays(records_path, RECORDS) as records:
        names, peaks = records["record_id"].values.tolist(), records["pga"].values / GRAVITY
        return dict(zip(names, peaks.tolist(), strict=True))


def read_metadata(
    records_path: Path, pulses_path: Path | None, with_pulses: Collection[str] | None = None
) -> RecordMetadata:
    """Read metadata and measures of the records of a file, and of their selected pulses.

    Parameters
    ----------
    records_path : Path
        Output of ``rockframe ingest``.
    pulses_path : Path, optional
        Output of ``rockframe pulse`` for the same records; without this file, pulses are unknown.
    with_pulses : collection of str, optional
        Names of the only records of which the pulses are read, by default all.

    Raises
    ------
    InputError
        If a file cannot be read, if no pulse belongs to these records, or if a pulse was computed
        from other samples.
    """
    with opened_arrays(records_path, RECORDS) as file:
        records = file.without("obs").loaded()
    names = [str(name) for name in records["record_id"].values]
    unknown = np.full(len(names), np.nan)
    pulses = dict.fromkeys(PULSE_NUMBERS, unknown)
    like: list[bool | None] = [None] * len(names)
    if pulses_path is not None:
        pulses, like = _pulses(pulses_path, records_path, names, with_pulses)
    return RecordMetadata(
        names=names,
        texts={
            **{name: [str(text) for text in records[name].values] for name in _TEXTS},
            "site": [SiteType(int(flag)).words for flag in records["site_type"].values],
        },
        numbers={name: records[name].values.astype(np.float64) for name in NUMBERS} | pulses,
        recordings=[*recordings_of(records).values()],
        pulse_like=like,
    )


def _pulses(
    path: Path, records_path: Path, names: list[str], some: Collection[str] | None
) -> tuple[dict[str, Float], list[bool | None]]:
    """Return the numbers of each selected pulse, and the result of its test against noise."""
    require_pulses_of(path, names)
    pulses = loaded_pulses(path, some)
    hashes = sample_hashes(pulses)
    # The file that the pulses were computed from has their samples; another one is read.
    if sha256_of(records_path) not in json.loads(pulses.attrs["input_sha256"]).values():
        with open_records(records_path) as records:
            for name in [name for name in names if name in hashes]:
                require_samples(path, hashes, records.read(name))
    values = {name: np.full(len(names), np.nan) for name in PULSE_NUMBERS}
    like: list[bool | None] = [None] * len(names)
    row_of = {name: row for row, name in enumerate(names)}
    if "record_id" not in pulses:  # a batch without accepted records
        return values, like
    best = best_of(pulses)
    names_of_file = best["record_id"].values.tolist()
    best = best.isel(record=[k for k, name in enumerate(names_of_file) if name in row_of])
    rows = [row_of[str(name)] for name in best["record_id"].values]
    for quantity, numbers in values.items():
        numbers[rows] = best[quantity].values
    for row, verdict in zip(rows, best["pulse_verdict"].values, strict=True):
        like[row] = _LIKE[PulseVerdict(int(verdict))]
    return values, like
