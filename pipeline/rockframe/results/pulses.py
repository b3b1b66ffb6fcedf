"""pulses.nc: for each record the best pulse of each mother wavelet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rockframe.matching import PulseMatch, best_match
from rockframe.results.files import PULSES, opened
from rockframe.results.variables import record_ids, texts, variable
from rockframe.wavelets import Pulse


def pulses_dataset(names: Sequence[str], matches: Sequence[Sequence[PulseMatch]]) -> xr.Dataset:
    """Return the dataset of the pulse stage: for each record the best pulse of each wavelet.

    Parameters
    ----------
    names : sequence of str
        Identifiers of the records, at least one.
    matches : sequence of sequence of PulseMatch
        For each record its matches, the same wavelets in the same order.
    """
    dims = ("record", "wavelet")

    def numbers(quantity: str, units: str, long_name: str) -> xr.Variable:
        data = [[getattr(m.pulse, quantity) for m in row] for row in matches]
        return variable(dims, np.array(data, dtype=np.float64), units, long_name)

    best = [best_match(row) for row in matches]
    chosen = [row[i] for row, i in zip(matches, best, strict=True)]
    shape = (len(names), len(matches[0]))
    variables = {
        "record_id": record_ids(names),
        "a_p": numbers("a_p", "m s-2", "amplitude of the acceleration pulse"),
        "T_p": numbers("T_p", "s", "period of the acceleration pulse"),
        "pulse_time": numbers("time", "s", "centre of the pulse, from the record's first sample"),
        "phase": numbers("phase", "rad", "phase of the pulse; pi is the reversed wavelet"),
        "half_cycles": variable(
            dims, np.full(shape, np.nan), "1", "number of half cycles; a Ricker wavelet has none"
        ),
        "match_index": variable(
            dims,
            np.array([[m.match_index for m in row] for row in matches]),
            "1",
            "cosine between record and pulse, the root of the share of energy explained",
        ),
        "at_period_bound": variable(
            dims,
            np.array([[m.at_period_bound for m in row] for row in matches], dtype=np.int8),
            "1",
            "whether the best period is an end of the range searched, not a maximum",
            flag_values=np.array([0, 1], dtype=np.int8),
            flag_meanings="within_range at_bound",
        ),
        "L_p": numbers("length_scale", "m", "length scale of the pulse, a_p T_p^2"),
        "best_wavelet": texts(
            "record", [m.pulse.wavelet for m in chosen], "wavelet with the largest match index"
        ),
        "a_p_best": variable(
            "record", np.array([m.pulse.a_p for m in chosen]), "m s-2", "a_p of the best wavelet"
        ),
        "T_p_best": variable(
            "record", np.array([m.pulse.T_p for m in chosen]), "s", "T_p of the best wavelet"
        ),
    }
    wavelets = texts("wavelet", [m.pulse.wavelet for m in matches[0]], "mother wavelet")
    return xr.Dataset(
        variables, coords={"wavelet": wavelets}, attrs={"title": "Acceleration pulses of records"}
    )


def best_pulses(path: Path) -> dict[str, PulseMatch]:
    """Return the best pulse of each record of a pulse file, by record identifier.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    with opened(path, PULSES) as dataset:
        pulses = dataset.load()
    found: dict[str, PulseMatch] = {}
    if "record_id" not in pulses:  # of a batch in which no record came through
        return found
    for i, name in enumerate(pulses["record_id"].values):
        wavelet = str(pulses["best_wavelet"].values[i])
        best = pulses.isel(record=i).sel(wavelet=wavelet)
        pulse = Pulse(
            wavelet=wavelet,
            a_p=float(best["a_p"]),
            T_p=float(best["T_p"]),
            time=float(best["pulse_time"]),
            phase=float(best["phase"]),
        )
        found[str(name)] = PulseMatch(
            pulse=pulse,
            match_index=float(best["match_index"]),
            at_period_bound=bool(best["at_period_bound"]),
        )
    return found
