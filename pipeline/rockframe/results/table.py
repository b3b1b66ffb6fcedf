"""The rows of a table in the manner of the paper's Table 1, from the three stages' files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import xarray as xr

from rockframe.results.files import RECORDS, RESPONSE, opened
from rockframe.results.pulse_rows import pulse_rows
from rockframe.results.to_pulse import FateUnderPulse
from rockframe.rocking.perturbed import Sensitivity
from rockframe.rocking.response import Verdict
from rockframe.units import GRAVITY

#: What a row takes from the best pulse.
_OF_PULSE: Final = (
    *("a_p_g", "T_p_s", "wavelet", "match_index", "L_p_m", "at_period_bound"),
    "pulse_verdict",
)
_NO_PULSE: Final = {
    "wavelet": "",
    "pulse_verdict": "",
    "at_period_bound": False,
    **dict.fromkeys(("a_p_g", "T_p_s", "match_index", "L_p_m"), math.nan),
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
    undecided_by: str = ""
    critical_scale: float = math.nan
    largest_scale: float = math.nan
    safe_islands: float = math.nan
    uplift_time_s: float
    overturning_time_s: float
    record_id: str
    source_file: str
    facts_source: str = ""
    pulse_verdict: str = ""
    verdict_to_pulse: str = ""
    peak_rotation_ratio_to_pulse: float = math.nan
    surrogate_error: float = math.nan


def table_rows(records_path: Path, pulses_path: Path, response_path: Path) -> list[TableRow]:
    """Return a row for each record and structure, the structures of a record together.

    Parameters
    ----------
    records_path, pulses_path, response_path : Path
        Outputs of the ingest, pulse and respond stages for the same records.

    Raises
    ------
    InputError
        If one of the files is missing, damaged, or something else.
    """
    with opened(records_path, RECORDS) as opened_records:
        records = opened_records.drop_vars("acceleration").load()
    row_of = {str(name): i for i, name in enumerate(records["record_id"].values)}
    best = {row["record_id"]: row for row in pulse_rows(pulses_path) if row["best"]}
    rows = []
    for answer in response_rows(response_path):
        name = answer["record_id"]
        record = records.isel(record=row_of[name])
        pulse = best.get(name, _NO_PULSE)
        station, component = str(record["station"].item()), str(record["component"].item())
        rows.append(
            TableRow(
                event=str(record["event"].item()),
                record="/".join(part for part in (station, component) if part) or name,
                magnitude=float(record["magnitude"]),
                epicentral_distance_km=float(record["epicentral_distance"]),
                pga_g=float(record["pga"]) / GRAVITY,
                pgv_m_s=float(record["pgv"]),
                source_file=str(record["source_file"].item()),
                facts_source=str(record["facts_source"].item()),
                **{key: pulse[key] for key in _OF_PULSE},
                **answer,
            )
        )
    return rows


def response_rows(response_path: Path) -> list[dict[str, Any]]:
    """Return a row for each record and structure of a response file; units are in the names."""
    with opened(response_path, RESPONSE) as dataset:
        response = dataset.drop_dims("obs", errors="ignore").load()
    rows = []
    if "record_id" not in response:  # of a batch in which no record came through
        return []
    for k, record_id in enumerate(response["record_id"].values):
        for structure in response["structure"].values:
            answer = response.sel(structure=structure).isel(record=k)
            rows.append(
                {
                    "record_id": str(record_id),
                    "structure": str(structure),
                    "peak_rotation_ratio": float(answer["peak_rotation_ratio"]),
                    "u_max_m": float(answer["peak_u"]),
                    "v_max_m": float(answer["peak_v"]),
                    "impacts": int(answer["impacts"]),
                    "verdict": Verdict(int(answer["verdict"])).name.lower(),
                    **_margin(answer),
                    "uplift_time_s": float(answer["uplift_time"]),
                    "overturning_time_s": float(answer["overturning_time"]),
                    **_to_pulse(answer),
                }
            )
    return rows


def _to_pulse(answer: xr.Dataset) -> dict[str, Any]:
    """What the pulse alone does; not known if it was not asked for."""
    if "surrogate_error" not in answer:
        unknown = ("peak_rotation_ratio_to_pulse", "surrogate_error")
        return {"verdict_to_pulse": "", **dict.fromkeys(unknown, math.nan)}
    return {
        "verdict_to_pulse": FateUnderPulse(int(answer["verdict_to_pulse"])).name.lower(),
        "peak_rotation_ratio_to_pulse": float(answer["peak_rotation_ratio_to_pulse"]),
        "surrogate_error": float(answer["surrogate_error"]),
    }


def _margin(answer: xr.Dataset) -> dict[str, Any]:
    """What a file has of margins; not known if they were not asked for."""
    if "critical_scale" not in answer:
        unknown = ("critical_scale", "largest_scale", "safe_islands")
        return {"undecided_by": "", **dict.fromkeys(unknown, math.nan)}
    bits = Sensitivity(int(answer["undecided_by"]))
    return {
        "undecided_by": ", ".join(str(bit.name).lower().replace("_", " ") for bit in bits),
        "critical_scale": float(answer["critical_scale"]),
        "largest_scale": float(answer["largest_scale"]),
        "safe_islands": int(answer["safe_islands"]),
    }
