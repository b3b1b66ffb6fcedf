"""pulses.nc: for each record the best pulse of each wavelet, and details of the selected one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.record_pulses import RecordPulses
from rockframe.record import Record
from rockframe.results.ragged import write_rows
from rockframe.results.schema import PULSES_NC
from rockframe.results.writing import Origin
from rockframe.wavelets.pulse import Pulse


def write_pulses(
    answers: Iterable[tuple[Record, RecordPulses]],
    path: Path,
    *,
    batch: str = "",
    **origin: Unpack[Origin],
) -> None:
    """Write the output of the pulse stage, complete or not at all; one record is in memory at a
    time.

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
        (_series(record, found.matches[found.used].pulse), _values(record, found))
        for record, found in answers
    )
    complete = partial(_complete, runners_up=origin["parameters"]["runners_up"])
    write_rows(PULSES_NC, rows, path, complete, batch=batch, **origin)


def _values(record: Record, found: RecordPulses) -> dict[str, Any]:
    return {
        "record_id": record.record_id,
        "row_size": record.acceleration.size,
        "samples_sha256": record.samples_sha256,
        "found": found,
    }


def _series(record: Record, pulse: Pulse) -> dict[str, NDArray[np.float64]]:
    return {
        "residual": record.acceleration - pulse.acceleration(record.time),
        "pulse_velocity": pulse.velocity(record.time),
        "pulse_displacement": pulse.displacement(record.time),
    }


def _complete(columns: Mapping[str, list[Any]], runners_up: int) -> dict[str, Any]:
    """Return the values of all variables except the series."""
    found: list[RecordPulses] = columns["found"]
    # Some runners-up do not exist: nothing of the record is left to search.
    further = [[*p.runners_up, *[None] * (runners_up - len(p.runners_up))] for p in found]
    return {
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
