"""Pulses of records: one table for all, and the ones that are used."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.matching.likeness import PulseVerdict
from rockframe.matching.match import PulseMatch
from rockframe.results.reading import opened
from rockframe.results.schema import PULSES
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

#: Variables of which a match is made.
_OF_MATCH: Final = (
    *("a_p", "T_p", "pulse_time", "phase", "half_cycles"),
    *("match_index", "outside", "at_period_bound", "at_half_cycle_bound"),
)


def best_pulses(path: Path) -> dict[str, PulseMatch]:
    """Return the pulse that is used of each record of a pulse file, by record identifier.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    pulses = loaded_pulses(path)
    found: dict[str, PulseMatch] = {}
    if "record_id" not in pulses:  # of a batch in which no record came through
        return found
    rows = {str(name): i for i, name in enumerate(pulses["wavelet"].values)}
    columns = {name: pulses[name].values for name in _OF_MATCH}
    for i, name in enumerate(pulses["record_id"].values):
        wavelet = str(pulses["best_wavelet"].values[i])
        best = {key: values[i, rows[wavelet]] for key, values in columns.items()}
        pulse = Pulse(
            wavelet=wavelet,
            a_p=float(best["a_p"]),
            T_p=float(best["T_p"]),
            time=float(best["pulse_time"]),
            phase=float(best["phase"]),
            half_cycles=None if math.isnan(best["half_cycles"]) else float(best["half_cycles"]),
        )
        found[str(name)] = PulseMatch(
            pulse=pulse,
            match_index=float(best["match_index"]),
            at_period_bound=bool(best["at_period_bound"]),
            at_half_cycle_bound=bool(best["at_half_cycle_bound"]),
            outside=float(best["outside"]),
        )
    return found


def pulses_with_hashes(path: Path) -> dict[str, tuple[Pulse, str]]:
    """Return the pulse that is used of each record, and ``samples_sha256`` of what it is of.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    found = best_pulses(path)
    hashes = loaded_pulses(path)["samples_sha256"].values if found else ()
    return {
        name: (match.pulse, str(text))
        for (name, match), text in zip(found.items(), hashes, strict=True)
    }


def loaded_pulses(path: Path) -> xr.Dataset:
    """Return all of a pulse file but its series; of a batch without records there is nothing.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    with opened(path, PULSES, empty=True) as dataset:
        return dataset.drop_dims("obs", errors="ignore").load()


#: Keys of a row and their variables, in the order of the row; a_p comes before them in g.
_NUMBERS: Final = {
    "T_p_s": "T_p",
    "pulse_time_s": "pulse_time",
    "phase_rad": "phase",
    "half_cycles": "half_cycles",
    "L_p_m": "L_p",
    "match_index": "match_index",
    "energy_share": "energy_share",
    "outside": "outside",
    "p_value": "p_value",
    "surrogate_median": "surrogate_median",
    "surrogate_high": "surrogate_high",
}
_FLAGS: Final = ("at_period_bound", "at_half_cycle_bound", "cut")
#: Keys of a row and their variables, that are of the record.
_OF_RECORD: Final = {
    "pgv_ratio": "pgv_ratio",
    "velocity_energy_ratio": "velocity_energy_ratio",
    "velocity_indicator": "velocity_indicator",
    "velocity_T_p_s": "velocity_T_p",
}
#: What a row of a further pulse takes of the above.
_OF_RUNNER_UP: Final = (
    *("T_p_s", "pulse_time_s", "phase_rad", "half_cycles", "L_p_m", "energy_share"),
)


def pulse_rows(pulses_path: Path) -> list[dict[str, Any]]:
    """Return a row for each record and wavelet of a pulse file; units are in the names.

    The row of the pulse that is used, ``best``, has its runners-up.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    pulses = loaded_pulses(pulses_path)
    if "record_id" not in pulses:  # of a batch in which no record came through
        return []
    columns = {str(name): array.values for name, array in pulses.variables.items()}
    return [
        _row(columns, i, k)
        for i in range(pulses.sizes["record"])
        for k in range(pulses.sizes["wavelet"])
    ]


def _row(columns: Mapping[str, Any], i: int, k: int) -> dict[str, Any]:
    wavelet = str(columns["wavelet"][k])
    best = str(columns["best_wavelet"][i]) == wavelet
    return {
        "record_id": str(columns["record_id"][i]),
        "wavelet": wavelet,
        "best": best,
        "a_p_g": float(columns["a_p"][i, k]) / GRAVITY,
        **{key: float(columns[name][i, k]) for key, name in _NUMBERS.items()},
        **{key: float(columns[name][i]) for key, name in _OF_RECORD.items()},
        **{name: bool(columns[name][i, k]) for name in _FLAGS},
        "surrogates": int(columns["surrogates"][i, k]),
        "pulse_verdict": PulseVerdict(int(columns["pulse_verdict"][i, k])).name.lower(),
        "runners_up": _runners_up(columns, i) if best else [],
    }


def _runners_up(columns: Mapping[str, Any], i: int) -> list[dict[str, float]]:
    amplitudes = columns.get("runner_up_a_p")
    if amplitudes is None:
        return []
    return [
        {
            "a_p_g": float(a_p) / GRAVITY,
            **{key: float(columns[f"runner_up_{_NUMBERS[key]}"][i, rank]) for key in _OF_RUNNER_UP},
        }
        for rank, a_p in enumerate(amplitudes[i])
        if np.isfinite(a_p)
    ]
