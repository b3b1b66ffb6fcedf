"""Metadata and measures of the records of a file and of their pulses, without samples."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.matching.likeness import PulseVerdict
from rockframe.provenance import sha256_of
from rockframe.record import SiteType
from rockframe.results.pulses import best_of, loaded_pulses
from rockframe.results.reading import opened
from rockframe.results.schema import RECORDS

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
    pulse_like : list of bool or None
        True if the selected pulse passes the test against noise; None if this is unknown.
    """

    names: list[str]
    texts: dict[str, list[str]]
    numbers: dict[str, Float]
    pulse_like: list[bool | None]


def read_metadata(records_path: Path, pulses_path: Path | None) -> RecordMetadata:
    """Read metadata and measures of the records of a file, and of their selected pulses.

    Parameters
    ----------
    records_path : Path
        Output of ``rockframe ingest``.
    pulses_path : Path, optional
        Output of ``rockframe pulse`` for the same records; without this file, pulses are unknown.

    Raises
    ------
    InputError
        If a file cannot be read, or if the pulses belong to other records.
    """
    with opened(records_path, RECORDS) as file:
        records = file.drop_vars("acceleration").load()
    names = [str(name) for name in records["record_id"].values]
    unknown = np.full(len(names), np.nan)
    pulses = dict.fromkeys(PULSE_NUMBERS, unknown)
    like: list[bool | None] = [None] * len(names)
    if pulses_path is not None:
        pulses, like = _pulses(pulses_path, sha256_of(records_path), names)
    return RecordMetadata(
        names=names,
        texts={
            **{name: [str(text) for text in records[name].values] for name in _TEXTS},
            "site": [SiteType(int(flag)).words for flag in records["site_type"].values],
        },
        numbers={name: records[name].values.astype(np.float64) for name in NUMBERS} | pulses,
        pulse_like=like,
    )


def _pulses(
    path: Path, records: str, names: list[str]
) -> tuple[dict[str, Float], list[bool | None]]:
    """Return the numbers of each selected pulse, and the result of its test against noise."""
    pulses = loaded_pulses(path)
    if records not in json.loads(pulses.attrs["input_sha256"]).values():
        raise InputError(path, "was made from other records. Use the pulses of these records.")
    values = {name: np.full(len(names), np.nan) for name in PULSE_NUMBERS}
    like: list[bool | None] = [None] * len(names)
    row_of = {name: row for row, name in enumerate(names)}
    if "record_id" not in pulses:  # a batch without accepted records
        return values, like
    best = best_of(pulses)
    rows = [row_of[str(name)] for name in best["record_id"].values]
    for quantity, numbers in values.items():
        numbers[rows] = best[quantity].values
    for row, verdict in zip(rows, best["pulse_verdict"].values, strict=True):
        like[row] = _LIKE[PulseVerdict(int(verdict))]
    return values, like
