"""pulses.nc: for each record the best pulse of each wavelet, and more of the one that is used."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from enum import IntEnum
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.matching import PulseVerdict, RecordPulses
from rockframe.record import Record
from rockframe.results.files import PULSES, named, put
from rockframe.results.growing import growing
from rockframe.results.merging import no_records
from rockframe.results.variables import flags, record_ids, row_sizes, texts, variable
from rockframe.wavelets import Pulse


class _Period(IntEnum):
    WITHIN_RANGE = 0
    AT_BOUND = 1


class _Ends(IntEnum):
    WHOLE = 0
    CUT_BY_RECORD = 1


#: Numbers of a pulse, by variable: field of Pulse, unit, long name.
_OF_PULSE: Final = {
    "a_p": ("a_p", "m s-2", "amplitude of the acceleration pulse"),
    "T_p": ("T_p", "s", "period of the acceleration pulse"),
    "pulse_time": ("time", "s", "centre of the pulse, from the record's first sample"),
    "phase": ("phase", "rad", "phase of the pulse; pi is the reversed wavelet"),
    "half_cycles": ("half_cycles", "1", "number of half cycles; a Ricker wavelet has none"),
    "L_p": ("length_scale", "m", "length scale of the pulse, a_p T_p^2"),
}
#: Numbers of a match, by variable: field of PulseMatch, unit, long name.
_OF_MATCH: Final = {
    "match_index": (
        "1",
        "cosine between record and pulse, the root of the share of energy explained",
    ),
    "energy_share": ("1", "share of the record's energy that the pulse explains"),
    "outside": ("1", "share of the pulse's energy before or after the record"),
}
#: Flags of a match, by variable: field of PulseMatch, enumeration, long name.
_FLAGS: Final = {
    "at_period_bound": (
        _Period,
        "whether the best period is an end of the range searched, not a maximum",
    ),
    "at_half_cycle_bound": (
        _Period,
        "whether the best number of half cycles is an end of the range searched",
    ),
    "cut": (_Ends, "whether over 1 % of the pulse's energy is before or after the record"),
}
#: Numbers of the comparison with noise, by variable: field of Likeness, unit, long name.
_OF_LIKENESS: Final = {
    "p_value": ("p_value", "share of surrogates that match as well as the record, it among them"),
    "surrogates": ("surrogates", "number of surrogates drawn; fewer once they had decided"),
    "surrogate_match_index": ("match_index", "match index searched as coarsely as surrogates are"),
    "surrogate_median": ("median", "median of the surrogates' match indices"),
    "surrogate_high": ("high", "95 % of the surrogates' match indices are below"),
}
#: Numbers of the velocity pulse, by variable: field of VelocityPulse, long name.
_OF_VELOCITY: Final = {
    "pgv_ratio": ("peak_ratio", "peak velocity without the velocity pulse over the record's"),
    "velocity_energy_ratio": (
        "energy_ratio",
        "squared velocity without the velocity pulse over the record's",
    ),
    "velocity_indicator": ("indicator", "velocity-pulse indicator in the style of Baker (2007)"),
}
#: Series of the pulse that is used: unit, long name.
_SERIES: Final = {
    "residual": ("m s-2", "acceleration of the record without the pulse that is used"),
    "pulse_velocity": ("m s-1", "velocity of the pulse that is used"),
    "pulse_displacement": ("m", "displacement of the pulse that is used"),
}
_PAIR: Final = ("record", "wavelet")


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
    # What is wrong with all of them is said before there is a folder or a file.
    first = tuple(islice(source, 1))
    series = {n: variable("obs", np.empty(0), u, label) for n, (u, label) in _SERIES.items()}
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
    used = [pulses.matches[pulses.used].pulse for pulses in found]
    indices = [pulses.matches[pulses.used].match_index for pulses in found]
    likely = [pulses.likeness[pulses.used] for pulses in found]
    periods = np.array([pulses.periods for pulses in found])
    variables = {
        "record_id": record_ids(columns["record_id"]),
        "row_size": row_sizes(columns["row_size"]),
        "samples_sha256": texts(
            "record", columns["samples_sha256"], "SHA-256 of the record's time step and samples"
        ),
        **_matches(found),
        **_comparisons(found),
        **(_runners_up(found, runners_up) if runners_up else {}),
        "best_wavelet": texts(
            "record", [p.used for p in found], "wavelet of the pulse that is used"
        ),
        "a_p_best": variable(
            "record", np.array([p.a_p for p in used]), "m s-2", "a_p of the pulse that is used"
        ),
        "T_p_best": variable(
            "record", np.array([p.T_p for p in used]), "s", "T_p of the pulse that is used"
        ),
        "match_index_best": variable(
            "record", np.array(indices), "1", "match index of the pulse that is used"
        ),
        "pulse_verdict_best": flags(
            "record", [one.verdict for one in likely], PulseVerdict, "whether it is one, at 5 %"
        ),
        "p_value_best": variable(
            "record",
            np.array([one.p_value for one in likely]),
            "1",
            "share of surrogates that match as well as the record does with it",
        ),
        "shortest_period": variable("record", periods[:, 0], "s", "shortest period searched"),
        "longest_period": variable("record", periods[:, 1], "s", "longest period searched"),
    }
    wavelets = texts("wavelet", list(found[0].matches), "mother wavelet")
    return xr.Dataset(
        variables, coords={"wavelet": wavelets}, attrs={"title": "Acceleration pulses of records"}
    )


def _matches(found: list[RecordPulses]) -> dict[str, xr.Variable]:
    rows = [list(pulses.matches.values()) for pulses in found]
    variables = {}
    for name, (field, units, label) in _OF_PULSE.items():
        data = [[_number(getattr(m.pulse, field)) for m in row] for row in rows]
        variables[name] = variable(_PAIR, np.array(data), units, label)
    for name, (units, label) in _OF_MATCH.items():
        data = [[getattr(m, name) for m in row] for row in rows]
        variables[name] = variable(_PAIR, np.array(data, dtype=np.float64), units, label)
    for name, (kind, label) in _FLAGS.items():
        variables[name] = flags(
            _PAIR, [[int(getattr(m, name)) for m in row] for row in rows], kind, label
        )
    return variables


def _comparisons(found: list[RecordPulses]) -> dict[str, xr.Variable]:
    drawn = [list(pulses.likeness.values()) for pulses in found]
    variables = {
        "pulse_verdict": flags(
            _PAIR,
            [[one.verdict for one in row] for row in drawn],
            PulseVerdict,
            "whether the match is better than those of noise like the record, at 5 %",
        )
    }
    for name, (field, label) in _OF_LIKENESS.items():
        kind = np.int32 if name == "surrogates" else np.float64
        data = np.array([[getattr(one, field) for one in row] for row in drawn], dtype=kind)
        variables[name] = variable(_PAIR, data, "1", label)
    for name, (field, label) in _OF_VELOCITY.items():
        numbers = np.array([getattr(pulses.velocity, field) for pulses in found])
        variables[name] = variable("record", numbers, "1", label)
    periods = np.array([pulses.velocity.pulse.T_p for pulses in found])
    variables["velocity_T_p"] = variable("record", periods, "s", "period of the velocity pulse")
    return variables


def _runners_up(found: list[RecordPulses], count: int) -> dict[str, xr.Variable]:
    """The further pulses; NaN where nothing was left to look in."""
    dims = ("record", "runner_up")
    variables = {}
    for name, (field, units, label) in _OF_PULSE.items():
        data = [[_number(getattr(up.match.pulse, field)) for up in p.runners_up] for p in found]
        variables[f"runner_up_{name}"] = variable(
            dims, _filled(data, count), units, f"{label}, of a further pulse"
        )
    shares = [[up.energy_share for up in pulses.runners_up] for pulses in found]
    variables["runner_up_energy_share"] = variable(
        dims,
        _filled(shares, count),
        "1",
        "share of the record's energy that a further pulse of the wavelet that is used explains",
    )
    return variables


def _filled(rows: list[list[float]], count: int) -> NDArray[np.float64]:
    return np.array([[*row, *[math.nan] * (count - len(row))] for row in rows], dtype=np.float64)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
