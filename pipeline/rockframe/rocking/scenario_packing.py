"""Packing of scenarios into batches for the vectorised kernel.

What the kernel receives for a scenario depends on this scenario alone, and so does its result.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import kernel, lanes, steps
from rockframe.rocking.kernels.excursions import DISTANCE, EXCURSION_SIZE, fill_ahead
from rockframe.rocking.kernels.ties import ELASTIC
from rockframe.rocking.response import vertical_in_g
from rockframe.rocking.restrained import ties_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Largest numbers of scenarios and of ground coefficients in a batch; they limit its memory.
AT_A_TIME: Final = 16384
_MOST_NUMBERS: Final = 2_000_000
#: Places in `constants_of` of the first tie, and of the kinds of both ties.
_TIES: Final = 3
_KINDS: Final = [7, 12]
#: Largest number of pieces of an interval, a power of two.
_MOST_PIECES: Final = 16
#: In place of a number of pieces: the scalar kernel computes the scenario.
_SCALAR: Final = 0


@dataclass
class _Batch:
    """Scenarios whose ground motions have rows of one form."""

    rows: list[Float] = field(default_factory=list)
    bounds: list[Float] = field(default_factory=list)
    slots: list[Float] = field(default_factory=list)
    scenarios: list[Index] = field(default_factory=list)
    ahead: list[Float] = field(default_factory=list)
    length: int = 0
    nodes: int = 0


@lru_cache(maxsize=4096)
def constants_of(frame: RockingFrame) -> tuple[float, ...]:
    """Return the numbers of a frame for the kernels: slenderness, p-hat, restitution, two ties."""
    ties = ties_of(frame) or ((0.0,) * 5, (0.0,) * 5)
    own = (frame.slenderness, frame.effective_frequency_parameter, frame.restitution)
    return (*own, *ties[0], *ties[1])


class Prepared:
    """A ground motion in the form of the vectorised kernel. Each part is computed when needed.

    Parameters
    ----------
    ground : GroundAcceleration
        The motion.
    """

    def __init__(self, ground: GroundAcceleration) -> None:
        self.ground = ground
        self.across = ground.coefficients / GRAVITY
        self.upwards = vertical_in_g(ground)
        powers = ground.time_step ** np.arange(self.across.shape[1])
        self._strongest = (np.abs(self.across) @ powers).max()
        if self.upwards.size:
            self._strongest = (np.abs(self.across) @ powers + np.abs(self.upwards) @ powers).max()
        #: (True if the degree is above 1, True if there is a vertical component).
        self.form = (self.across.shape[1] > 2, self.upwards.shape[0] > 0)
        self._rows: dict[int, tuple[Float, Float]] = {}
        self._ahead: dict[tuple[int, float], Float] = {}

    def pieces(self, scale: Float, constants: Float) -> NDArray[np.int64]:
        """Return the number of pieces of each interval: 1, 2, 4, ..., or `_SCALAR`, by scenario.

        The vectorised kernel computes neither frames whose ties yield, nor steps so long that they
        need more than `_MOST_PIECES` pieces.
        """
        ties = constants[:, _TIES] + constants[:, _TIES + 1]
        rate = constants[:, 1] * np.sqrt(1.0 + self._strongest * np.abs(scale) + ties)
        stride = steps.MAX_SMOOTH_STRIDE if self.form[0] else steps.MAX_STRIDE
        pieces = np.exp2(np.ceil(np.log2(rate * self.ground.time_step / stride)).clip(min=0.0))
        yielding = (constants[:, _KINDS] != ELASTIC).any(axis=1)
        pieces[yielding | (pieces > _MOST_PIECES)] = _SCALAR
        return np.asarray(pieces, dtype=np.int64)

    def rows(self, pieces: int) -> tuple[Float, Float]:
        """Return the coefficients with each interval divided into pieces, and their bounds."""
        if pieces not in self._rows:
            parts = [part for part in (self.across, self.upwards) if part.size]
            step = self.ground.time_step
            rows = np.concatenate([_rows(part, step, pieces) for part in parts], axis=1)
            self._rows[pieces] = rows, _bounds(rows, curved=self.form[0])
        return self._rows[pieces]

    def ahead(self, pieces: int, frequency_parameter: float) -> Float:
        """Return the integrals of `fill_ahead`, computed once for each frequency parameter."""
        key = (pieces, frequency_parameter)
        if key not in self._ahead:
            rows, _ = self.rows(pieces)
            self._ahead[key] = np.empty((rows.shape[0] + 1, 1 + self.form[1]))
            rate = frequency_parameter * (self.ground.time_step / pieces)
            fill_ahead(rows, 6 if self.form[0] else 2, rate, self._ahead[key])
        return self._ahead[key]


class Results:
    """Arrays for the results of scenarios.

    Parameters
    ----------
    scenarios : int
        Number of scenarios.
    excursions : int
        Number of excursions to keep for each scenario.
    """

    def __init__(self, scenarios: int, excursions: int = 0) -> None:
        self.verdicts = np.empty(scenarios, dtype=np.int8)
        self.summaries = np.empty((scenarios, kernel.SUMMARY_SIZE))
        self.kept = excursions
        self.excursions = np.zeros((scenarios, excursions, EXCURSION_SIZE))
        self.excursions[:, :, DISTANCE] = -np.inf


class ScenarioPacker:
    """Scenarios that one thread collects; each batch is computed when it is full.

    Parameters
    ----------
    results : Results
        Arrays that the results are written to.
    """

    def __init__(self, results: Results) -> None:
        self._results = results
        self._batches: dict[tuple[bool, bool, bool], _Batch] = {}

    def add(self, scenarios: Index, motion: Prepared, scale: Float, constants: Float) -> None:
        """Add scenarios of one motion: indices in `results`, scales, constants of the frames."""
        pieces = motion.pieces(scale, constants)
        tied = np.asarray(constants[:, _TIES:].any(axis=1))
        for count, ties in sorted({*zip(pieces.tolist(), tied.tolist(), strict=True)}):
            some = np.flatnonzero((pieces == count) & (tied == ties))
            if count == _SCALAR:
                self._one_by_one(scenarios[some], motion, scale[some], constants[some])
                continue
            form = (*motion.form, ties)
            batch = self._batches.setdefault(form, _Batch())
            rows, bounds = motion.rows(count)
            slots = np.zeros((some.size, lanes.ASKED_SIZE))
            slots[:, lanes.FIRST] = batch.length
            slots[:, lanes.INTERVALS] = rows.shape[0]
            slots[:, lanes.TIME_STEP] = motion.ground.time_step / count
            slots[:, lanes.START_TIME] = motion.ground.start_time
            slots[:, lanes.SCALE] = scale[some]
            slots[:, lanes.SLENDERNESS : lanes.RESTITUTION + 1] = constants[some, :_TIES]
            slots[:, lanes.TIE_STIFFNESS : lanes.TIE_FORCE + 1] = constants[some, _TIES : _TIES + 2]
            for one in np.unique(constants[some, 1]).tolist() if self._results.kept else ():
                slots[slots[:, lanes.P_HAT] == one, lanes.AHEAD] = batch.nodes - batch.length
                batch.ahead.append(motion.ahead(count, one))
                batch.nodes += len(batch.ahead[-1])
            batch.rows.append(rows)
            batch.bounds.append(bounds)
            batch.slots.append(slots)
            batch.scenarios.append(scenarios[some])
            batch.length += rows.shape[0]
            many = sum(part.size for part in batch.scenarios)
            numbers = batch.length * rows.shape[1] + batch.nodes
            if many >= AT_A_TIME or numbers >= _MOST_NUMBERS:
                self._compute(form)

    def complete(self) -> None:
        """Compute the batches that are not full."""
        for key in list(self._batches):
            self._compute(key)

    def _compute(self, key: tuple[bool, bool, bool]) -> None:
        batch = self._batches.pop(key)
        slots = np.concatenate(batch.slots)
        # the longest first, so that all lanes finish at about the same time
        order = np.argsort(-slots[:, lanes.INTERVALS], kind="stable")
        scenarios = np.concatenate(batch.scenarios)[order]
        verdicts = np.empty(scenarios.size, dtype=np.int8)
        summaries = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
        after = np.zeros(batch.rows[0].shape[1])
        bounds = np.concatenate(batch.bounds)
        excursions = self._results.excursions[scenarios if self._results.kept else []]
        coarse = bounds[: bounds.shape[0] // lanes.COARSE * lanes.COARSE]
        while len(coarse) > bounds.shape[0] // lanes.COARSE:
            coarse = np.maximum(coarse[::2], coarse[1::2])
        lanes.integrate_lanes(
            np.concatenate([*(rows.ravel() for rows in batch.rows), after]),
            bounds,
            coarse,
            steps.YES if key[0] else steps.NO,
            steps.YES if key[1] else steps.NO,
            steps.YES if key[2] else steps.NO,
            slots[order],
            verdicts,
            summaries,
            np.concatenate([*batch.ahead, np.empty((0, 1 + key[1]))]),
            excursions,
        )
        self._results.verdicts[scenarios] = verdicts
        self._results.summaries[scenarios] = summaries
        if self._results.kept:
            self._results.excursions[scenarios] = excursions

    def _one_by_one(
        self, scenarios: Index, motion: Prepared, scale: Float, constants: Float
    ) -> None:
        verdicts = np.empty(scenarios.size, dtype=np.int8)
        summaries = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
        tied = np.asarray(constants[:, _TIES:].any(axis=1))
        for form, chosen in ((steps.NO, ~tied), (steps.YES, tied)):
            some = np.flatnonzero(chosen)
            verdict = np.empty(some.size, dtype=np.int8)
            summary = np.empty((some.size, kernel.SUMMARY_SIZE))
            if not some.size:
                continue
            slenderness, frequency_parameter, restitution = np.ascontiguousarray(
                constants[some, :_TIES].T
            )
            kernel.integrate_many(
                motion.across,
                motion.upwards,
                motion.ground.time_step,
                motion.ground.start_time,
                scale[some],
                slenderness,
                frequency_parameter,
                restitution,
                verdict,
                summary,
                form,
                np.ascontiguousarray(constants[some, _TIES:]),
            )
            verdicts[some], summaries[some] = verdict, summary
        self._results.verdicts[scenarios] = verdicts
        self._results.summaries[scenarios] = summaries


def _rows(coefficients: Float, time_step: float, pieces: int) -> Float:
    """Return coefficients in powers of time over an interval's length, divided into pieces."""
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
    """Return bounds of |acceleration| in each interval; exact if piecewise linear."""
    parts = rows.reshape(rows.shape[0], -1, 6 if curved else 2)
    if curved:
        return np.ascontiguousarray(np.abs(parts).sum(axis=2))
    ends = np.maximum(np.abs(parts[:, :, 0]), np.abs(parts.sum(axis=2)))
    return np.ascontiguousarray(ends)
