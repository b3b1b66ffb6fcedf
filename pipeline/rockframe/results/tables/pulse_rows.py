"""Read pulses of records: the table of all pulses, and the selected pulses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import xarray as xr

from rockframe.matching.match import PulseMatch
from rockframe.results.reading import opened
from rockframe.results.schema import PULSES
from rockframe.results.tables.rows import Row, columns_of, rows_along
from rockframe.wavelets.pulse import Pulse

#: Fields of a match, with their variables.
_OF_MATCH: Final = columns_of(
    "record_id match_index outside at_period_bound at_half_cycle_bound",
    "wavelet a_p T_p time=pulse_time phase half_cycles",
)
_BOUNDS: Final = ("match_index", "outside", "at_period_bound", "at_half_cycle_bound")


def best_of(pulses: xr.Dataset) -> xr.Dataset:
    """Return the values of the selected pulses, along ``record``."""
    return pulses.sel(wavelet=pulses["best_wavelet"])


def best_pulses(path: Path) -> dict[str, PulseMatch]:
    """Return the selected pulse of each record of a pulse file, by record identifier.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    pulses = loaded_pulses(path)
    found: dict[str, PulseMatch] = {}
    if "record_id" not in pulses:  # a batch without accepted records
        return found
    for row in rows_along(best_of(pulses), "record", _OF_MATCH):
        name, match = row.pop("record_id"), {key: row.pop(key) for key in _BOUNDS}
        if math.isnan(row["half_cycles"]):
            row["half_cycles"] = None
        found[name] = PulseMatch(pulse=Pulse(**row), **match)
    return found


def pulses_with_hashes(path: Path) -> dict[str, tuple[Pulse, str]]:
    """Return the selected pulse of each record, and ``samples_sha256`` of its record.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    found = best_pulses(path)
    hashes = loaded_pulses(path)["samples_sha256"].values if found else ()
    return {
        name: (match.pulse, str(text))
        for (name, match), text in zip(found.items(), hashes, strict=True)
    }


def loaded_pulses(path: Path) -> xr.Dataset:
    """Return a pulse file without its series; empty for a batch without accepted records.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened(path, PULSES, empty=True) as dataset:
        return dataset.drop_dims("obs", errors="ignore").load()


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


def pulse_rows(pulses_path: Path) -> list[Row]:
    """Return a row for each record and wavelet of a pulse file; units are in the names.

    The row of the selected pulse, ``best``, has its runners-up.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    pulses = loaded_pulses(pulses_path)
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
