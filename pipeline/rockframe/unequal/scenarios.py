"""Verdicts and peaks of many bents of two unequal columns, packed for the vectorised kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import on_threads, threads
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import steps
from rockframe.rocking.response import as_ground, refuse_flight
from rockframe.rocking.scenarios import (
    AT_A_TIME,
    Prepared,
    coarse_bounds,
    respond_scenarios,
    scales_of,
)
from rockframe.unequal.bent import UnequalBent, bent_positions, require_bent, tables
from rockframe.unequal.kernels import kernel, lanes
from rockframe.unequal.kernels.steps import TABLE_SIZE
from rockframe.unequal.linkage import Tables
from rockframe.unequal.response import Motion

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Number of scenarios for which another thread pays off.
_WORTH_A_THREAD: Final = 256


@dataclass(frozen=True, eq=False)
class BentPeaks:
    """Outcome of each bent under each motion at each scale, shape (motions, bents, scales).

    Parameters
    ----------
    verdict : array of int8
        Values of `Verdict`.
    peak_rotation : array
        Largest |theta| of the left column [rad], including free rocking after the end of the
        motion; that at the end of the model if the bent overturned.
    peak_rotation_ratio : array
        Largest |theta| over that of the unstable equilibrium of the same side [1].
    uplift_time, overturning_time : array
        Times of the first uplift and of overturning [s]; NaN if there is none.
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    uplift_time: Float
    overturning_time: Float


def respond_bents(
    motions: Sequence[Motion], bents: Sequence[UnequalBent], scales: ArrayLike = (1.0,)
) -> BentPeaks:
    """Compute verdict and peaks of each bent under each motion at each scale.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond_bent`.
    bents : sequence of UnequalBent
        The bents.
    scales : array_like, shape (scales,)
        Factor of the horizontal and vertical acceleration [1].

    Returns
    -------
    BentPeaks
        The result of a scenario has the same bits whichever other scenarios are computed.

    Raises
    ------
    ParameterError
        If there is no motion, bent or scale, a scale is not finite, or a scaled vertical
        acceleration falls faster than gravity.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.2)
    >>> respond_bents([pulse], [bent], [0.1, 0.5, 1.0]).peak_rotation_ratio[0, 0, :2].round(3)
    array([0.   , 0.381])
    """
    factors = scales_of(scales, motions=motions, bents=bents)
    for bent in bents:
        require_bent(bent)
    grounds = [as_ground(motion) for motion in motions]
    for ground in grounds:
        for scale in (factors.min(), factors.max()):
            refuse_flight(ground, float(scale))
    shape = (len(grounds), len(bents), factors.size)
    which, whose, scale = (axis.ravel() for axis in np.indices(shape))
    results = outcomes_of(grounds, bents, which, whose, factors[scale])
    each = {name: values.reshape(shape) for name, values in results.items()}
    right, left = each["peak"], each["speed"]
    balances = np.array([bent.balance_rotations for bent in bents])[:, :, None]
    return BentPeaks(
        verdict=each["verdict"],
        peak_rotation=np.maximum(right, left),
        peak_rotation_ratio=np.maximum(right / balances[:, 0], left / balances[:, 1]),
        uplift_time=each["uplift_time"],
        overturning_time=each["overturning_time"],
    )


def outcomes_of(
    grounds: Sequence[GroundAcceleration],
    bents: Sequence[UnequalBent],
    ground: Index,
    bent: Index,
    scale: Float,
) -> dict[str, NDArray[Any]]:
    """Return outcomes of scenarios: verdicts, peaks on both sides, and times.

    Bents of equal columns are computed as frames, and have the bits of `respond_scenarios`. Of them
    both peaks are the larger one, from which the same quantities follow.

    Parameters
    ----------
    grounds, bents : sequence
        Ground motions and bents.
    ground, bent : array of int, shape (scenarios,)
        Indices of the ground motion and the bent of each scenario.
    scale : array, shape (scenarios,)
        Factor of the ground acceleration [1].

    Returns
    -------
    dict of str to array, shape (scenarios,)
        ``verdict``; ``peak`` and ``speed``, the largest |theta| to the right and to the left [rad];
        ``uplift_time`` and ``overturning_time`` [s].
    """
    equal = np.array([structure.has_equal_columns for structure in bents])[bent]
    results = {name: np.empty(scale.size) for name in ("peak", "speed", *_TIMES)}
    results = {"verdict": np.empty(scale.size, dtype=np.int8), **results}
    for some, compute in ((equal, _of_equal_columns), (~equal, _of_unequal_columns)):
        chosen = np.flatnonzero(some)
        if chosen.size:
            asked = ground[chosen], bent[chosen], scale[chosen]
            for name, values in compute(grounds, bents, *asked).items():
                results[name][chosen] = values
    return results


#: Names of the times of scenarios.
_TIMES: Final = ("uplift_time", "overturning_time")


def _of_equal_columns(
    grounds: Sequence[GroundAcceleration],
    bents: Sequence[UnequalBent],
    ground: Index,
    bent: Index,
    scale: Float,
) -> dict[str, NDArray[Any]]:
    """Return the outcomes of bents of equal columns, which are frames."""
    frames = [structure.equal_bent for structure in bents]
    results = respond_scenarios(grounds, frames, ground, bent, scale)
    times = {name: getattr(results, name) for name in _TIMES}
    peak = results.peak_rotation
    return {"verdict": results.verdict, "peak": peak, "speed": peak, **times}


def _of_unequal_columns(
    grounds: Sequence[GroundAcceleration],
    bents: Sequence[UnequalBent],
    ground: Index,
    bent: Index,
    scale: Float,
) -> dict[str, NDArray[Any]]:
    """Return the outcomes of other bents from the kernel of the linkage."""
    table = [tables(structure) for structure in bents]
    verdicts, summaries = outcomes(grounds, table, ground, bent, scale)
    peaks = np.empty((scale.size, 2))
    order = np.argsort(bent, kind="stable")
    for chosen in np.split(order, np.flatnonzero(np.diff(bent[order])) + 1):
        sides = summaries[chosen][None, :, [kernel.PEAK_RIGHT, kernel.PEAK_LEFT]]
        peaks[chosen] = rotations(table[bent[chosen[0]]], sides)[0]
    times = summaries[:, [kernel.UPLIFT_TIME, kernel.OVERTURNING_TIME]].T
    return {
        "verdict": verdicts,
        "peak": peaks[:, 0],
        "speed": peaks[:, 1],
        **dict(zip(_TIMES, times, strict=True)),
    }


def quantities_of(bents: Sequence[UnequalBent], right: Float, left: Float) -> dict[str, Float]:
    """Return the quantities of scenarios from the largest |theta| on both sides [rad].

    Parameters
    ----------
    bents : sequence of UnequalBent
        The bents.
    right, left : array, shape (bents, scenarios)
        Largest |theta| to the right and to the left [rad].

    Returns
    -------
    dict of str to array, shape (bents, scenarios)
        ``peak_rotation_ratio`` [1], ``peak_u``, ``peak_v`` and ``peak_level_difference`` [m].
    """
    ratio, u, v, drop = (np.empty_like(right) for _ in range(4))
    for k, bent in enumerate(bents):
        balances = bent.balance_rotations
        sides = np.stack([right[k], -left[k]])
        at = bent_positions(bent, np.where(sides == 0.0, 0.0, sides))
        highest = np.minimum(np.abs(sides), np.array(balances)[:, None])
        ratio[k] = np.maximum(right[k] / balances[0], left[k] / balances[1])
        u[k], drop[k] = np.abs(at.u).max(axis=0), np.abs(at.drop).max(axis=0)
        v[k] = bent_positions(bent, np.copysign(highest, sides)).v.max(axis=0)
    return {
        "peak_rotation_ratio": ratio,
        "peak_u": u,
        "peak_v": v,
        "peak_level_difference": drop,
    }


def rotations(table: Tables, courses: Float) -> Float:
    """Return |theta| at courses of the kernel on the right and the left.

    Both have the shape (bents, points, 2).
    """
    within = np.moveaxis(courses, -1, 1) / table.stretch[..., None]
    return np.moveaxis(table.courses.rotations(within)[0], 1, -1)


@dataclass
class _Pack:
    """Scenarios whose ground motions have rows of one form."""

    rows: list[Float] = field(default_factory=list)
    bounds: list[Float] = field(default_factory=list)
    slots: list[Float] = field(default_factory=list)
    scenarios: list[Index] = field(default_factory=list)
    length: int = 0


def outcomes(
    grounds: Sequence[GroundAcceleration],
    bents: Sequence[Tables],
    ground: Index,
    bent: Index,
    scale: Float,
) -> tuple[NDArray[np.int8], Float]:
    """Return verdicts and summaries of scenarios, see `lanes.integrate_lanes`.

    Parameters
    ----------
    grounds : sequence of GroundAcceleration
        Ground motions.
    bents : sequence of Tables
        Numbers of bents, counted over all of these.
    ground, bent : array of int, shape (scenarios,)
        Indices of the ground motion and the bent of each scenario.
    scale : array, shape (scenarios,)
        Factor of the ground acceleration [1].
    """
    numbers = np.concatenate([bent_tables.numbers for bent_tables in bents])
    frequency = np.concatenate([bent_tables.frequency for bent_tables in bents])
    verdicts = np.empty(scale.size, dtype=np.int8)
    summaries = np.empty((scale.size, kernel.SUMMARY_SIZE))

    def compute(part: Index) -> None:
        packs: dict[tuple[bool, bool], _Pack] = {}
        for k in np.unique(ground[part]).tolist():
            motion = Prepared(grounds[k])
            pack = packs.setdefault(motion.form, _Pack())
            chosen = part[ground[part] == k]
            _add(pack, motion, chosen, (scale[chosen], bent[chosen], frequency[bent[chosen]]))
        for form, pack in packs.items():
            _compute(pack, form, numbers, verdicts, summaries)

    order = np.argsort(ground, kind="stable")
    worth = min(threads(), math.ceil(order.size / _WORTH_A_THREAD))
    parts = (
        np.array_split(order, max(worth, math.ceil(order.size / AT_A_TIME))) if order.size else []
    )
    on_threads(compute, parts)
    return verdicts, summaries


def _add(
    pack: _Pack, motion: Prepared, scenarios: Index, of_each: tuple[Float, Index, Float]
) -> None:
    """Add scenarios of one motion to a pack: their scales, bents and frequencies."""
    scale, bent, frequency = of_each
    counts = motion.divisions(frequency * np.sqrt(1.0 + motion.strongest * np.abs(scale)))
    for count in np.unique(counts).tolist():
        some = counts == count
        rows, bounds = motion.rows(count)
        slots = np.empty((int(some.sum()), lanes.ASKED_SIZE))
        slots[:, lanes.FIRST] = pack.length
        slots[:, lanes.INTERVALS] = rows.shape[0]
        slots[:, lanes.TIME_STEP] = motion.ground.time_step / count
        slots[:, lanes.START_TIME] = motion.ground.start_time
        slots[:, lanes.SCALE] = scale[some]
        slots[:, lanes.TABLE] = bent[some] * TABLE_SIZE
        slots[:, lanes.FREQUENCY] = frequency[some]
        pack.rows.append(rows)
        pack.bounds.append(bounds)
        pack.slots.append(slots)
        pack.scenarios.append(scenarios[some])
        pack.length += rows.shape[0]


def _compute(
    pack: _Pack,
    form: tuple[bool, bool],
    numbers: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> None:
    """Compute the scenarios of a pack, and store their results."""
    slots = np.concatenate(pack.slots)
    # the longest first, so that all lanes finish at about the same time
    order = np.argsort(-slots[:, lanes.INTERVALS], kind="stable")
    scenarios = np.concatenate(pack.scenarios)[order]
    verdict = np.empty(scenarios.size, dtype=np.int8)
    summary = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
    bounds = np.concatenate(pack.bounds)
    after = np.zeros(pack.rows[0].shape[1])
    lanes.integrate_lanes(
        np.concatenate([*(rows.ravel() for rows in pack.rows), after]),
        bounds,
        coarse_bounds(bounds),
        steps.YES if form[0] else steps.NO,
        steps.YES if form[1] else steps.NO,
        slots[order],
        numbers.ravel(),
        verdict,
        summary,
    )
    verdicts[scenarios] = verdict
    summaries[scenarios] = summary
