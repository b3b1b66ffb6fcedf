"""The rows of a table in the manner of the paper's Table 1, from the three stages' files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.matching.likeness import PulseVerdict, pulse_words
from rockframe.results.reading import opened
from rockframe.results.schema import RECORDS, RESPONSE
from rockframe.results.schema.response import CONTACT, ROBUST, FateUnderPulse
from rockframe.results.tables.pulse_rows import pulse_rows
from rockframe.rocking.margins.perturbed import Sensitivity
from rockframe.rocking.response import Verdict
from rockframe.rocking.stated_verdict import StatedVerdict
from rockframe.units import GRAVITY

#: What a row takes from the best pulse.
_OF_PULSE: Final = (
    *("a_p_g", "T_p_s", "wavelet", "match_index", "L_p_m", "at_period_bound"),
    "pulse_verdict",
)
#: Dimensions of what is known of a record and a structure.
_PAIR: Final = ("record", "structure")
#: What a row takes from the record: texts, then numbers.
_OF_RECORD: Final = (
    *("event", "station", "component", "source_file", "facts_source"),
    *("magnitude", "epicentral_distance", "pga", "pgv"),
)
_NO_PULSE: Final = {
    "wavelet": "",
    "pulse_verdict": "",
    "at_period_bound": False,
    **dict.fromkeys(("a_p_g", "T_p_s", "match_index", "L_p_m", "p_value"), math.nan),
}


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """One record and structure. Units are in the names; unknown is NaN or an empty string."""

    event: str
    record: str
    magnitude: float
    epicentral_distance_km: float
    pga_g: float
    pgv_m_s: float
    a_p_g: float
    T_p_s: float
    wavelet: str
    match_index: float
    L_p_m: float
    at_period_bound: bool
    structure: str
    peak_rotation_ratio: float
    u_max_m: float
    v_max_m: float
    impacts: int
    verdict: str
    verdict_words: str = ""
    undecided_by: str = ""
    critical_scale: float = math.nan
    largest_scale: float = math.nan
    safe_islands: float = math.nan
    robust_scale_10: float = math.nan
    robust_scale_25: float = math.nan
    robust_scale_50: float = math.nan
    robust_error_10: float = math.nan
    robust_error_25: float = math.nan
    robust_error_50: float = math.nan
    uplift_time_s: float
    overturning_time_s: float
    record_id: str
    source_file: str
    facts_source: str = ""
    pulse_verdict: str = ""
    pulse_p_value: float = math.nan
    verdict_to_pulse: str = ""
    peak_rotation_ratio_to_pulse: float = math.nan
    surrogate_error: float = math.nan
    base_friction_demand: float = math.nan
    top_friction_demand: float = math.nan
    impact_friction_demand: float = math.nan
    least_base_vertical: float = math.nan
    least_top_vertical: float = math.nan


def table_rows(records_path: Path, pulses_path: Path, response_path: Path) -> Iterator[TableRow]:
    """Give a row for each record and structure, the structures of a record together.

    Parameters
    ----------
    records_path, pulses_path, response_path : Path
        Outputs of the ingest, pulse and respond stages for the same records.

    Raises
    ------
    InputError
        If one of the files is missing, damaged, or something else, or the responses are to other
        records.
    """
    with opened(records_path, RECORDS) as dataset:
        records = {name: dataset[name].values for name in ("record_id", *_OF_RECORD)}
    row_of = {str(name): i for i, name in enumerate(records["record_id"])}
    best = {row["record_id"]: row for row in pulse_rows(pulses_path) if row["best"]}
    for answer in response_rows(response_path):
        name = answer["record_id"]
        if name not in row_of:
            must_be = f"which {records_path} does not. Must be of the same records."
            raise InputError(response_path, f"holds {name!r}, {must_be}")
        event, station, component, source_file, facts_source, *numbers = (
            records[variable][row_of[name]] for variable in _OF_RECORD
        )
        magnitude, distance, pga, pgv = map(float, numbers)
        pulse = best.get(name, _NO_PULSE)
        yield TableRow(
            event=str(event),
            record="/".join(str(part) for part in (station, component) if part) or name,
            magnitude=magnitude,
            epicentral_distance_km=distance,
            pga_g=pga / GRAVITY,
            pgv_m_s=pgv,
            source_file=str(source_file),
            facts_source=str(facts_source),
            **{key: pulse[key] for key in _OF_PULSE},
            pulse_p_value=pulse["p_value"],
            **answer,
        )


def response_rows(response_path: Path) -> Iterator[dict[str, Any]]:
    """Give a row for each record and structure of a response file; units are in the names."""
    with opened(response_path, RESPONSE, empty=True) as dataset:
        if "record_id" not in dataset:  # of a batch in which no record came through
            return
        columns = {
            str(name): array.values if array.ndim == len(_PAIR) else array.values[:, np.newaxis]
            for name, array in dataset.variables.items()
            if array.dims in (_PAIR, _PAIR[:1])
        }
        records = [str(name) for name in dataset["record_id"].values]
        structures = [str(name) for name in dataset["structure"].values]
    for i, record in enumerate(records):
        for k, structure in enumerate(structures):
            row = {
                "record_id": record,
                "structure": structure,
                "peak_rotation_ratio": float(columns["peak_rotation_ratio"][i, k]),
                "u_max_m": float(columns["peak_u"][i, k]),
                "v_max_m": float(columns["peak_v"][i, k]),
                "impacts": int(columns["impacts"][i, k]),
                "verdict": Verdict(int(columns["verdict"][i, k])).name.lower(),
                **_margin(columns, i, k),
                "uplift_time_s": float(columns["uplift_time"][i, k]),
                "overturning_time_s": float(columns["overturning_time"][i, k]),
                **_to_pulse(columns, i, k),
                **{name: float(columns[name][i, k]) for name in CONTACT if name in columns},
            }
            yield row | {"verdict_words": stated_verdict(row).words}


def stated_verdict(row: Mapping[str, Any]) -> StatedVerdict:
    """Return the verdict of a row, computed or read from ``table.csv``.

    Examples
    --------
    >>> row = {"verdict": "undecided", "overturning_time_s": "31.2"}
    >>> stated_verdict(row).words
    'undecided, overturned 31.2 s'
    """
    critical = _number(row, "critical_scale")
    return StatedVerdict(
        Verdict[row["verdict"].upper()],
        overturning_time=_number(row, "overturning_time_s"),
        critical_scale=None if math.isnan(_number(row, "largest_scale")) else critical,
    )


def stated_pulse(row: Mapping[str, Any]) -> str:
    """Return what the test against noise says of the pulse of a row; empty without a pulse.

    Examples
    --------
    >>> stated_pulse({"pulse_verdict": "noise", "pulse_p_value": "0.32"})
    'best match, not told from noise (p = 0.32)'
    """
    if not row.get("pulse_verdict"):
        return ""
    return pulse_words(PulseVerdict[row["pulse_verdict"].upper()], _number(row, "pulse_p_value"))


def pulse_mark(row: Mapping[str, Any]) -> str:
    """Return the mark of a pulse that the test against noise calls noise, or nothing.

    Examples
    --------
    >>> pulse_mark({"pulse_verdict": "noise"}), pulse_mark({"pulse_verdict": "pulse"})
    ('†', '')
    """
    return "†" if row.get("pulse_verdict") == PulseVerdict.NOISE.name.lower() else ""


def _number(row: Mapping[str, Any], name: str) -> float:
    """A cell of a CSV file is a text, empty if the number is not known."""
    value = row.get(name, "")
    return math.nan if value == "" else float(value)


def _to_pulse(columns: Mapping[str, NDArray[Any]], i: int, k: int) -> dict[str, Any]:
    """What the pulse alone does; not known if it was not asked for."""
    if "surrogate_error" not in columns:
        unknown = ("peak_rotation_ratio_to_pulse", "surrogate_error")
        return {"verdict_to_pulse": "", **dict.fromkeys(unknown, math.nan)}
    return {
        "verdict_to_pulse": FateUnderPulse(int(columns["verdict_to_pulse"][i, k])).name.lower(),
        "peak_rotation_ratio_to_pulse": float(columns["peak_rotation_ratio_to_pulse"][i, k]),
        "surrogate_error": float(columns["surrogate_error"][i, k]),
    }


def _margin(columns: Mapping[str, NDArray[Any]], i: int, k: int) -> dict[str, Any]:
    """What a file has of margins; not known if they were not asked for."""
    if "critical_scale" not in columns:
        unknown = ("critical_scale", "largest_scale", "safe_islands")
        return {"undecided_by": "", **dict.fromkeys((*unknown, *ROBUST), math.nan)}
    bits = Sensitivity(int(columns["undecided_by"][i, k]))
    return {
        "undecided_by": ", ".join(str(bit.name).lower() for bit in bits),
        "critical_scale": float(columns["critical_scale"][i, k]),
        "largest_scale": float(columns["largest_scale"][i, 0]),
        "safe_islands": int(columns["safe_islands"][i, k]),
        **{name: float(columns[name][i, k]) if name in columns else math.nan for name in ROBUST},
    }
