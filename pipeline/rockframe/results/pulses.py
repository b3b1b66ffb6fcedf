"""pulses.nc: for each record the best pulse of each wavelet, and more of the one that is used."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.matching.found import RecordPulses
from rockframe.record import Record
from rockframe.results.merging import no_records
from rockframe.results.schema import PULSES, PULSES_NC
from rockframe.results.writing import growing, named, put
from rockframe.wavelets.pulse import Pulse

_SERIES: Final = ("residual", "pulse_velocity", "pulse_displacement")


def write_pulses(
    answers: Iterable[tuple[Record, RecordPulses]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str] | None = None,
    batch: str = "",
) -> None:
    """Write the output of the pulse stage, whole or not at all; holds one record at a time.

    Parameters
    ----------
    answers : iterable of (Record, RecordPulses)
        Each record and what was found in it, the same wavelets and number of runners-up in all.
        An error that it raises leaves no file.
    path : Path
        Where it goes; an older file there is replaced.
    input_sha256 : mapping
        Name and SHA-256 of each input.
    parameters : mapping
        The options of the stage; JSON values; the number of ``runners_up`` among them.
    left_out : mapping of str to str, optional
        Why records that went in did not come out, by identifier; read after the answers.
    batch : str
        Of the batch of which it is, ``2/3``; empty for all records.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    columns: dict[str, list[Any]] = defaultdict(list)
    source = iter(answers)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    series = {name: PULSES_NC[name].holding([]) for name in _SERIES}
    with named(path) as partial:
        with growing(partial, series) as append:
            for record, found in chain(first, source):
                append(_series(record, found.matches[found.used].pulse))
                columns["record_id"].append(record.record_id)
                columns["row_size"].append(record.acceleration.size)
                columns["samples_sha256"].append(record.samples_sha256)
                columns["found"].append(found)
        made = _dataset(columns, parameters["runners_up"]) if columns else no_records()
        put(
            made.assign_attrs(batch=batch) if batch else made,
            partial,
            PULSES,
            input_sha256=input_sha256,
            parameters=parameters,
            left_out=left_out,
            mode="a" if columns else "w",
        )


def _series(record: Record, pulse: Pulse) -> dict[str, NDArray[np.float64]]:
    return {
        "residual": record.acceleration - pulse.acceleration(record.time),
        "pulse_velocity": pulse.velocity(record.time),
        "pulse_displacement": pulse.displacement(record.time),
    }


def _dataset(columns: Mapping[str, list[Any]], runners_up: int) -> xr.Dataset:
    """Return all variables but the series."""
    found: list[RecordPulses] = columns["found"]
    # Nothing is left to look in for some of the runners-up.
    further = [[*p.runners_up, *[None] * (runners_up - len(p.runners_up))] for p in found]
    return PULSES_NC.dataset(
        {
            **{name: values for name, values in columns.items() if name != "found"},
            **PULSES_NC.filled("match", [list(p.matches.values()) for p in found]),
            **PULSES_NC.filled("likeness", [list(p.likeness.values()) for p in found]),
            **PULSES_NC.filled("velocity", [p.velocity for p in found]),
            **(PULSES_NC.filled("runner_up", further) if runners_up else {}),
            **PULSES_NC.filled("used_match", [p.matches[p.used] for p in found]),
            **PULSES_NC.filled("used_likeness", [p.likeness[p.used] for p in found]),
            "best_wavelet": [p.used for p in found],
            "shortest_period": [p.periods[0] for p in found],
            "longest_period": [p.periods[1] for p in found],
            "wavelet": list(found[0].matches),
        }
    )
