"""Read the histories of a run, one record at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.ragged import slices
from rockframe.results.reading import opened
from rockframe.results.schema import RECORDS, RESPONSE
from rockframe.results.tables.pulse_rows import best_pulses

Float = NDArray[np.float64]
#: Record and structure.
Pair = tuple[str, str]


@dataclass(frozen=True)
class Ground:
    """The motion of a record, and its selected pulse.

    Parameters
    ----------
    record : str
        Identifier of the record.
    time_step : float
        Interval between samples, from 0 [s].
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2].
    pulse : array, shape (samples of the pulse,)
        Selected pulse [m s-2] over its length; empty if there is no pulse.
    pulse_start : int
        Sample of the record at which the pulse begins.
    """

    record: str
    time_step: float
    acceleration: Float
    pulse: Float
    pulse_start: int


@dataclass(frozen=True)
class History:
    """The history of a structure under a record, at the samples of the record.

    Parameters
    ----------
    record, structure : str
        Names of the record and of the structure.
    theta, u, v : array, shape (samples,)
        Rotation [rad], displacement and lift of the beam [m]; NaN after overturning.
    """

    record: str
    structure: str
    theta: Float
    u: Float
    v: Float


def read_histories(folder: Path, pairs: Sequence[Pair]) -> Iterator[tuple[Ground, list[History]]]:
    """Yield the motion of each requested record, with the histories of its structures.

    Parameters
    ----------
    folder : Path
        Output of ``rockframe table1``.
    pairs : sequence of (str, str)
        Records and structures.

    Yields
    ------
    Ground, list of History
        Motions and histories in the order of response.nc. Pairs without a stored history are
        skipped.

    Raises
    ------
    InputError
        If a file is missing, corrupted, or of another kind.
    """
    wanted = set(pairs)
    pulses = best_pulses(folder / "pulses.nc")
    with (
        opened(folder / "records.nc", RECORDS) as records,
        opened(folder / "response.nc", RESPONSE) as response,
    ):
        rows_of = _rows(records)
        steps = dict(zip(_names(records, "record_id"), records["time_step"].values, strict=True))
        kept = response["history"].values
        for i, (record, rows) in enumerate(_rows(response).items()):
            chosen = [
                structure
                for k, structure in enumerate(_names(response, "structure"))
                if kept[i, k] and (record, structure) in wanted
            ]
            if not chosen:
                continue
            acceleration = records["acceleration"][rows_of[record]].to_numpy()
            step = float(steps[record])
            pulse, start = np.empty(0), 0
            if record in pulses:
                found = pulses[record].pulse
                time = step * np.arange(acceleration.size)
                near = np.flatnonzero(np.abs(time - found.time) <= found.mother.reach * found.T_p)
                pulse, start = found.acceleration(time[near]), int(near[0])
            ground = Ground(record, step, acceleration, pulse, start)
            yield ground, [_history(response, record, name, rows) for name in chosen]


def _history(response: xr.Dataset, record: str, structure: str, rows: slice) -> History:
    k = _names(response, "structure").index(structure)
    theta, u, v = (response[name][k, rows].to_numpy() for name in ("theta", "u", "v"))
    return History(record, structure, theta, u, v)


def _names(dataset: xr.Dataset, variable: str) -> list[str]:
    return [str(name) for name in dataset[variable].values]


def _rows(dataset: xr.Dataset) -> dict[str, slice]:
    """Return the samples of each record along ``obs``."""
    of_obs = slices(dataset["row_size"].values)
    return dict(zip(_names(dataset, "record_id"), of_obs, strict=True))
