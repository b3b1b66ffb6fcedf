"""Scenarios gathered for the kernel: ground motions in the form that its lanes take, in batches.

What is gathered of a scenario depends on the scenario alone, so that its answer does too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking import kernel, lanes
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import vertical_in_g
from rockframe.rocking.vectors import LONGEST_STRIDE
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Scenarios and numbers of the ground that the kernel is given at a time: its working memory.
AT_A_TIME: Final = 16384
_MOST_NUMBERS: Final = 2_000_000
#: Into so many pieces, a power of two, the lanes divide an interval; more need the scalar kernel.
_MOST_PIECES: Final = 16


@dataclass
class _Batch:
    """Scenarios whose ground has rows of one form, until there are enough of them."""

    rows: list[Float] = field(default_factory=list)
    bounds: list[Float] = field(default_factory=list)
    asked: list[Float] = field(default_factory=list)
    scenarios: list[Index] = field(default_factory=list)
    length: int = 0


class Answers:
    """Answers to scenarios, of which each is filled in once.

    Parameters
    ----------
    scenarios : int
        Their number.
    """

    def __init__(self, scenarios: int) -> None:
        self.verdicts = np.empty(scenarios, dtype=np.int8)
        self.summaries = np.empty((scenarios, kernel.SUMMARY_SIZE))


class Gathered:
    """Scenarios that are asked for in one thread, answered as the batches are full.

    Parameters
    ----------
    answers : Answers
        What is filled in.
    """

    def __init__(self, answers: Answers) -> None:
        self._answers = answers
        self._batches: dict[tuple[bool, bool], _Batch] = {}

    def ask(
        self, scenarios: Index, ground: GroundAcceleration, scale: Float, constants: Float
    ) -> None:
        """Take in scenarios of one ground: their places, scales, and the frames' constants."""
        across = ground.coefficients / GRAVITY
        upwards = vertical_in_g(ground)
        pieces = _pieces(across, upwards, ground.time_step, scale, constants[:, 1])
        for count in np.unique(pieces):
            some = np.flatnonzero(pieces == count)
            if count > _MOST_PIECES:
                self._one_by_one(scenarios[some], ground, scale[some], constants[some])
                continue
            key = (across.shape[1] > 2, upwards.shape[0] > 0)
            batch = self._batches.setdefault(key, _Batch())
            rows = np.concatenate(
                [
                    _rows(part, ground.time_step, int(count))
                    for part in (across, upwards)
                    if part.size
                ],
                axis=1,
            )
            asked = np.empty((some.size, lanes.ASKED_SIZE))
            asked[:, lanes.FIRST] = batch.length
            asked[:, lanes.INTERVALS] = rows.shape[0]
            asked[:, lanes.TIME_STEP] = ground.time_step / count
            asked[:, lanes.START_TIME] = ground.start_time
            asked[:, lanes.SCALE] = scale[some]
            asked[:, lanes.SLENDERNESS : lanes.RESTITUTION + 1] = constants[some]
            batch.rows.append(rows)
            batch.bounds.append(_bounds(rows, curved=key[0]))
            batch.asked.append(asked)
            batch.scenarios.append(scenarios[some])
            batch.length += rows.shape[0]
            many = sum(part.size for part in batch.scenarios)
            if many >= AT_A_TIME or batch.length * rows.shape[1] >= _MOST_NUMBERS:
                self._answer(key)

    def complete(self) -> None:
        """Answer what is still waiting."""
        for key in list(self._batches):
            self._answer(key)

    def _answer(self, key: tuple[bool, bool]) -> None:
        batch = self._batches.pop(key)
        scenarios = np.concatenate(batch.scenarios)
        verdicts = np.empty(scenarios.size, dtype=np.int8)
        summaries = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
        after = np.zeros(batch.rows[0].shape[1])
        bounds = np.concatenate(batch.bounds)
        whole = bounds[: bounds.shape[0] // lanes.COARSE * lanes.COARSE]
        lanes.integrate_lanes(
            np.concatenate([*(rows.ravel() for rows in batch.rows), after]),
            bounds,
            whole.reshape(-1, lanes.COARSE, bounds.shape[1]).max(axis=1, initial=0.0),
            kernel.YES if key[0] else kernel.NO,
            kernel.YES if key[1] else kernel.NO,
            np.concatenate(batch.asked),
            verdicts,
            summaries,
        )
        self._answers.verdicts[scenarios] = verdicts
        self._answers.summaries[scenarios] = summaries

    def _one_by_one(
        self, scenarios: Index, ground: GroundAcceleration, scale: Float, constants: Float
    ) -> None:
        verdicts = np.empty(scenarios.size, dtype=np.int8)
        summaries = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
        slenderness, frequency_parameter, restitution = np.ascontiguousarray(constants.T)
        kernel.integrate_many(
            ground.coefficients / GRAVITY,
            vertical_in_g(ground),
            ground.time_step,
            ground.start_time,
            scale,
            slenderness,
            frequency_parameter,
            restitution,
            verdicts,
            summaries,
        )
        self._answers.verdicts[scenarios] = verdicts
        self._answers.summaries[scenarios] = summaries


def _pieces(
    across: Float, upwards: Float, time_step: float, scale: Float, frequency_parameter: Float
) -> NDArray[np.int64]:
    """Into how many pieces each interval is divided, for each scenario: 1, 2, 4, ..."""
    powers = time_step ** np.arange(across.shape[1])
    strongest = (np.abs(across) @ powers).max()
    if upwards.size:
        strongest = (np.abs(across) @ powers + np.abs(upwards) @ powers).max()
    rate = frequency_parameter * (1.0 + strongest * np.abs(scale))
    doublings = np.ceil(np.log2(rate * time_step / LONGEST_STRIDE)).clip(0.0, 62.0)
    return np.asarray(2 ** doublings.astype(np.int64), dtype=np.int64)


def _rows(coefficients: Float, time_step: float, pieces: int) -> Float:
    """Coefficients in powers of the time over an interval's length, each divided into pieces."""
    powers = 6 if coefficients.shape[1] > 2 else 2
    rows = np.zeros((coefficients.shape[0], powers))
    rows[:, : coefficients.shape[1]] = coefficients * time_step ** np.arange(coefficients.shape[1])
    if pieces == 1:
        return rows
    shifts = np.array(
        [
            [
                [
                    math.comb(k, j) * (piece / pieces) ** (k - j) / pieces**j if k >= j else 0.0
                    for j in range(powers)
                ]
                for k in range(powers)
            ]
            for piece in range(pieces)
        ]
    )
    return np.ascontiguousarray(np.einsum("ik,pkj->ipj", rows, shifts)).reshape(-1, powers)


def _bounds(rows: Float, *, curved: bool) -> Float:
    """Bounds of the accelerations in each interval: exact for straight lines."""
    parts = rows.reshape(rows.shape[0], -1, 6 if curved else 2)
    if curved:
        return np.ascontiguousarray(np.abs(parts).sum(axis=2))
    ends = np.maximum(np.abs(parts[:, :, 0]), np.abs(parts.sum(axis=2)))
    return np.ascontiguousarray(ends)
