"""The pulse that is used of each record, read back from pulses.nc."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

from rockframe.matching import PulseMatch
from rockframe.results.loaded_pulses import loaded_pulses
from rockframe.wavelets import Pulse

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
