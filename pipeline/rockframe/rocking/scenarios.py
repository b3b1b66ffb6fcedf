"""Verdicts and peaks of many scenarios, packed for the vectorised kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import on_threads, threads
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import NO_UPLIFT, kernel, lanes, steps
from rockframe.rocking.kernels.tails import DISTANCE, EXCURSION_SIZE, fill_ahead
from rockframe.rocking.kernels.ties import ELASTIC
from rockframe.rocking.reactions import demands_at_rest, levers_of
from rockframe.rocking.response import (
    Motion,
    as_ground,
    refuse_flight,
    require_some,
    ties_of,
    vertical_in_g,
)
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Largest numbers of scenarios and of ground coefficients in a pack; they limit its memory.
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
class _Pack:
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
        bounds = np.abs(self.across) @ powers
        if self.upwards.size:
            bounds = bounds + np.abs(self.upwards) @ powers
        self.strongest = bounds.max()  # of the sum of both |accelerations| [g]
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
        pull = 1.0 + self.strongest * np.abs(scale) + ties
        pieces = self.divisions(constants[:, 1] * np.sqrt(pull))
        yielding = (constants[:, _KINDS] != ELASTIC).any(axis=1)
        pieces[yielding | (pieces > _MOST_PIECES)] = _SCALAR
        return pieces

    def divisions(self, rate: Float) -> NDArray[np.int64]:
        """Return the number of steps per interval, a power of two, for these rates [s-1]."""
        stride = steps.MAX_SMOOTH_STRIDE if self.form[0] else steps.MAX_STRIDE
        pieces = np.exp2(np.ceil(np.log2(rate * self.ground.time_step / stride)).clip(min=0.0))
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
    demands : bool
        Compute the demands on the joints.
    """

    def __init__(self, scenarios: int, excursions: int = 0, *, demands: bool = False) -> None:
        self.verdicts = np.empty(scenarios, dtype=np.int8)
        self.summaries = np.empty((scenarios, kernel.SUMMARY_SIZE))
        self.demands = demands
        self.kept = excursions
        self.excursions = np.zeros((scenarios, excursions, EXCURSION_SIZE))
        self.excursions[:, :, DISTANCE] = -np.inf


class ScenarioPacker:
    """Scenarios that one thread collects; each pack is computed when it is full.

    Parameters
    ----------
    results : Results
        Arrays that the results are written to.
    """

    def __init__(self, results: Results) -> None:
        self._results = results
        self._packs: dict[tuple[bool, bool, bool], _Pack] = {}

    def add(
        self,
        scenarios: Index,
        motion: Prepared,
        scale: Float,
        constants: Float,
        levers: Float | None = None,
    ) -> None:
        """Add scenarios of one motion: indices in `results`, scales, constants of the frames.

        `levers` are the results of `reactions.levers_of`, if demands are requested.
        """
        pieces = motion.pieces(scale, constants)
        tied = np.asarray(constants[:, _TIES:].any(axis=1))
        for count, ties in sorted({*zip(pieces.tolist(), tied.tolist(), strict=True)}):
            some = np.flatnonzero((pieces == count) & (tied == ties))
            if count == _SCALAR:
                self._one_by_one(scenarios[some], motion, scale[some], constants[some])
                continue
            form = (*motion.form, ties)
            pack = self._packs.setdefault(form, _Pack())
            rows, bounds = motion.rows(count)
            slots = np.zeros((some.size, lanes.ASKED_SIZE))
            slots[:, lanes.FIRST] = pack.length
            slots[:, lanes.INTERVALS] = rows.shape[0]
            slots[:, lanes.TIME_STEP] = motion.ground.time_step / count
            slots[:, lanes.START_TIME] = motion.ground.start_time
            slots[:, lanes.SCALE] = scale[some]
            slots[:, lanes.SLENDERNESS : lanes.RESTITUTION + 1] = constants[some, :_TIES]
            slots[:, lanes.TIE_STIFFNESS : lanes.TIE_FORCE + 1] = constants[some, _TIES : _TIES + 2]
            slots[:, lanes.PIECES] = count
            if levers is not None:
                slots[:, lanes.SWINGS] = levers[some]
            for p_hat in np.unique(constants[some, 1]).tolist() if self._results.kept else ():
                slots[slots[:, lanes.P_HAT] == p_hat, lanes.AHEAD] = pack.nodes - pack.length
                pack.ahead.append(motion.ahead(count, p_hat))
                pack.nodes += len(pack.ahead[-1])
            pack.rows.append(rows)
            pack.bounds.append(bounds)
            pack.slots.append(slots)
            pack.scenarios.append(scenarios[some])
            pack.length += rows.shape[0]
            many = sum(part.size for part in pack.scenarios)
            numbers = pack.length * rows.shape[1] + pack.nodes
            if many >= AT_A_TIME or numbers >= _MOST_NUMBERS:
                self._compute(form)

    def complete(self) -> None:
        """Compute the packs that are not full."""
        for key in list(self._packs):
            self._compute(key)

    def _compute(self, key: tuple[bool, bool, bool]) -> None:
        pack = self._packs.pop(key)
        slots = np.concatenate(pack.slots)
        # the longest first, so that all lanes finish at about the same time
        order = np.argsort(-slots[:, lanes.INTERVALS], kind="stable")
        scenarios = np.concatenate(pack.scenarios)[order]
        verdicts = np.empty(scenarios.size, dtype=np.int8)
        summaries = np.empty((scenarios.size, kernel.SUMMARY_SIZE))
        after = np.zeros(pack.rows[0].shape[1])
        bounds = np.concatenate(pack.bounds)
        excursions = self._results.excursions[scenarios if self._results.kept else []]
        lanes.integrate_lanes(
            np.concatenate([*(rows.ravel() for rows in pack.rows), after]),
            bounds,
            coarse_bounds(bounds),
            steps.YES if key[0] else steps.NO,
            steps.YES if key[1] else steps.NO,
            steps.YES if key[2] else steps.NO,
            slots[order],
            verdicts,
            summaries,
            np.concatenate([*pack.ahead, np.empty((0, 1 + key[1]))]),
            excursions,
            steps.YES if self._results.demands else steps.NO,
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
                np.ascontiguousarray(motion.across),
                np.ascontiguousarray(motion.upwards),
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
        summaries[:, kernel.BASE_SHEAR :] = math.nan
        self._results.verdicts[scenarios] = verdicts
        self._results.summaries[scenarios] = summaries


def _rows(coefficients: Float, time_step: float, pieces: int) -> Float:
    """Return coefficients in powers of time over an interval's length, divided into pieces."""
    powers = 6 if coefficients.shape[1] > 2 else 2
    rows = np.zeros((coefficients.shape[0], powers))
    rows[:, : coefficients.shape[1]] = coefficients * time_step ** np.arange(coefficients.shape[1])
    if pieces == 1:
        return rows
    if powers == 2:
        starts = rows[:, :1] + np.arange(pieces) / pieces * rows[:, 1:]
        slopes = np.broadcast_to(rows[:, 1:] / pieces, starts.shape)
        return np.stack([starts, slopes], axis=2).reshape(-1, powers)
    shifts = np.zeros((pieces, powers, powers))
    for piece, k, j in np.ndindex(shifts.shape):
        if k >= j:
            shifts[piece, k, j] = math.comb(k, j) * (piece / pieces) ** (k - j) / pieces**j
    return np.ascontiguousarray(np.einsum("ik,pkj->ipj", rows, shifts)).reshape(-1, powers)


def coarse_bounds(bounds: Float) -> Float:
    """Return the largest of the bounds of each `lanes.COARSE` rows."""
    coarse = bounds[: bounds.shape[0] // lanes.COARSE * lanes.COARSE]
    while len(coarse) > bounds.shape[0] // lanes.COARSE:
        coarse = np.maximum(coarse[::2], coarse[1::2])
    return np.ascontiguousarray(coarse)


def _bounds(rows: Float, *, curved: bool) -> Float:
    """Return bounds of |acceleration| in each interval; exact if piecewise linear."""
    parts = rows.reshape(rows.shape[0], -1, 6 if curved else 2)
    if curved:
        return np.ascontiguousarray(np.abs(parts).sum(axis=2))
    ends = np.maximum(np.abs(parts[:, :, 0]), np.abs(parts.sum(axis=2)))
    return np.ascontiguousarray(ends)


#: Number of scenarios for which another thread pays off.
_WORTH_A_THREAD: Final = 256


@dataclass(frozen=True, eq=False)
class Scenarios:
    """Outcome of each scenario, in the order of the request.

    Parameters
    ----------
    verdict : array of int8, shape (scenarios,)
        Values of `Verdict`.
    peak_rotation : array, shape (scenarios,)
        Largest absolute rotation [rad], including free rocking after the end of the motion; pi/2
        if overturned.
    peak_rotation_ratio : array, shape (scenarios,)
        Largest absolute rotation over the slenderness of the frame [1].
    peak_velocity : array, shape (scenarios,)
        Largest absolute angular velocity [rad s-1], including free rocking; for a frame that
        overturns, until overturning.
    impact_velocity : array, shape (scenarios,)
        Largest velocity [m s-1] at which the lifted corner of a column's base meets the ground,
        2 b |theta'| just before an impact, including free rocking; 0 if there is no impact.
    uplift_time, overturning_time : array, shape (scenarios,)
        Times of the first uplift and of overturning [s]; NaN if there is none.
    impacts : array of int32, shape (scenarios,)
        Number of impacts during the motion, or until overturning.
    excursions : array, shape (scenarios, kept, 3)
        Excursions with the largest distances from the separatrix of the linear theory, the largest
        first: start [s], side (+1 or -1), and distance [alpha], positive beyond the separatrix and
        minus infinity if a scenario has fewer excursions. An excursion that overturns is the last
        one of its scenario in time.
    base_shear : array, shape (scenarios,)
        Largest force of the ground over the weight of columns and beam [1], at the samples, until
        overturning. NaN unless demands are requested, and where ties yield or the sampling is so
        coarse that the scalar kernel computes the scenario.
    friction_demand : array, shape (scenarios,)
        Largest coefficient of friction that base and top joints need while the frame rocks [1]; or
        at rest if it does not uplift. NaN as `base_shear`.
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    peak_velocity: Float
    impact_velocity: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]
    excursions: Float
    base_shear: Float
    friction_demand: Float


@dataclass(frozen=True, eq=False)
class Peaks:
    """Outcome of each frame under each motion at each scale.

    Parameters
    ----------
    verdict, peak_rotation, peak_rotation_ratio, peak_velocity, impact_velocity : array
        See `Scenarios`; shape (motions, frames, scales).
    uplift_time, overturning_time, impacts : array
        See `Scenarios`; shape (motions, frames, scales).
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    peak_velocity: Float
    impact_velocity: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]


def respond_scenarios(
    grounds: Sequence[Motion | Prepared],
    frames: Sequence[RockingFrame],
    ground: ArrayLike,
    frame: ArrayLike,
    scale: ArrayLike,
    *,
    excursions: int = 0,
    demands: bool = False,
) -> Scenarios:
    """Compute verdict and peaks of scenarios. A scenario is a frame under a motion at a scale.

    Parameters
    ----------
    grounds : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames; each with its own restitution factor.
    ground, frame : array_like of int, shape (scenarios,)
        Scenario k is ``frames[frame[k]]`` under ``grounds[ground[k]]``.
    scale : array_like, shape (scenarios,)
        Factor of the horizontal and vertical acceleration [1].
    excursions : int
        Largest number of excursions to keep for each scenario. Above 0, the computation takes a
        sixth longer.
    demands : bool
        Compute base shear and friction demand, which takes a tenth longer.

    Returns
    -------
    Scenarios
        The result of a scenario has the same bits whichever other scenarios are computed, in
        whichever order.

    Raises
    ------
    ParameterError
        If the three arrays differ in length, an index is out of range, a scale is not finite, or a
        scaled vertical acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> column = RockingFrame(height=9.6, width=1.6)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.5)
    >>> found = respond_scenarios([pulse], [bent, column], [0, 0, 0], [0, 0, 1], [0.1, 0.5, 0.5])
    >>> found.peak_rotation_ratio.round(4)
    array([0.    , 0.6517, 9.5114])
    """
    which, whose, factors = _checked(len(grounds), len(frames), ground, frame, scale)
    constants = np.array([constants_of(frame) for frame in frames]).reshape(len(frames), -1)
    widths = np.array([frame.width for frame in frames])
    _refuse_flights(grounds, which, factors)
    order = np.argsort(which, kind="stable")
    levers = np.array([levers_of(frame) for frame in frames if demands])
    results = Results(factors.size, excursions, demands=demands)

    def compute(part: Index) -> None:
        packer = ScenarioPacker(results)
        for chosen in np.split(part, np.flatnonzero(np.diff(which[part])) + 1):
            motion = grounds[which[chosen[0]]]
            ready = motion if isinstance(motion, Prepared) else Prepared(as_ground(motion))
            weighed = levers[whose[chosen]] if demands else None
            packer.add(chosen, ready, factors[chosen], constants[whose[chosen]], weighed)
        packer.complete()

    on_threads(compute, _parts(order))
    forces = lanes.shear_and_friction(results.summaries)
    still = np.flatnonzero(results.verdicts == NO_UPLIFT) if demands else np.arange(0)
    for k in np.unique(which[still]).tolist():
        chosen = still[which[still] == k]
        resting = [frames[index] for index in whose[chosen]]
        forces[chosen] = demands_at_rest(_ground_of(grounds[k]), resting, factors[chosen])
    return Scenarios(
        verdict=results.verdicts,
        peak_rotation=results.summaries[:, kernel.PEAK].copy(),
        peak_rotation_ratio=results.summaries[:, kernel.PEAK] / constants[whose, 0],
        peak_velocity=results.summaries[:, kernel.PEAK_VELOCITY].copy(),
        impact_velocity=results.summaries[:, kernel.IMPACT_VELOCITY] * widths[whose],
        uplift_time=results.summaries[:, kernel.UPLIFT_TIME].copy(),
        overturning_time=results.summaries[:, kernel.OVERTURNING_TIME].copy(),
        impacts=results.summaries[:, kernel.IMPACTS].astype(np.int32),
        excursions=_highest_first(results.excursions),
        base_shear=np.where(demands, forces[:, 0], math.nan),
        friction_demand=np.where(demands, forces[:, 1], math.nan),
    )


def respond_many(
    motions: Sequence[Motion | Prepared],
    frames: Sequence[RockingFrame],
    scales: ArrayLike = (1.0,),
) -> Peaks:
    """Compute verdict and peaks of each frame under each motion at each scale.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames; each with its own restitution factor.
    scales : array_like, shape (scales,)
        Factor of the horizontal and vertical acceleration [1].

    Returns
    -------
    Peaks
        The result of a scenario has the same bits whichever other scenarios are computed.

    Raises
    ------
    ParameterError
        If there is no motion, frame or scale, a scale is not finite, or a scaled vertical
        acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.5)
    >>> respond_many([pulse], [bent], [0.1, 0.5, 1.0]).peak_rotation_ratio[0, 0, :2].round(4)
    array([0.    , 0.6517])
    """
    factors = scales_of(scales, motions=motions, frames=frames)
    shape = (len(motions), len(frames), factors.size)
    ground, frame, scale = (axis.ravel() for axis in np.indices(shape))
    scenarios = respond_scenarios(motions, frames, ground, frame, factors[scale])
    return Peaks(*(getattr(scenarios, field.name).reshape(shape) for field in fields(Peaks)))


def scales_of(scales: ArrayLike, **more: Sequence[object]) -> Float:
    """Check the scales, and other sequences by name, and return the scales as an array.

    Raises
    ------
    ParameterError
        If a sequence is empty or none, or a scale is not finite.
    """
    factors = np.atleast_1d(np.asarray(scales, dtype=np.float64))
    require_some(**more, scales=factors)  # type: ignore[arg-type]
    if factors.ndim != 1 or not np.isfinite(factors).all():
        raise ParameterError(f"Invalid scales {factors}. Must be a row of finite numbers.")
    return factors


def _refuse_flights(grounds: Sequence[Motion | Prepared], which: Index, factors: Float) -> None:
    """Raise an error if a motion falls faster than gravity at one of its scales."""
    for k, motion in enumerate(grounds):
        ground = motion.ground if isinstance(motion, Prepared) else motion
        if isinstance(ground, GroundAcceleration) and ground.vertical is not None:
            scales = factors[which == k]
            for scale in (scales.min(), scales.max()) if scales.size else ():
                refuse_flight(ground, float(scale))


def _ground_of(motion: Motion | Prepared) -> GroundAcceleration:
    return motion.ground if isinstance(motion, Prepared) else as_ground(motion)


def _highest_first(excursions: Float) -> Float:
    order = np.argsort(-excursions[:, :, DISTANCE], axis=1, kind="stable")
    return np.take_along_axis(excursions, order[:, :, None], axis=1)


def _parts(order: Index) -> list[Index]:
    """Divide scenarios among threads, into parts that the kernel can take at a time."""
    if not order.size:
        return []
    worth = min(threads(), math.ceil(order.size / _WORTH_A_THREAD))
    return np.array_split(order, max(worth, math.ceil(order.size / AT_A_TIME)))


def _checked(
    grounds: int, frames: int, ground: ArrayLike, frame: ArrayLike, scale: ArrayLike
) -> tuple[Index, Index, Float]:
    """Return the checked indices and scales of the requested scenarios."""
    factors = np.asarray(scale, dtype=np.float64)
    indices = []
    for label, values, number in (("ground", ground, grounds), ("frame", frame, frames)):
        index = np.asarray(values)
        if index.size == 0:
            index = index.astype(np.intp)
        if index.shape != factors.shape or factors.ndim != 1:
            raise ParameterError(
                f"Invalid {label} indices of shape {index.shape}. Must be one row, as long as that "
                f"of the scales, {factors.shape}."
            )
        if not np.issubdtype(index.dtype, np.integer):
            raise ParameterError(f"Invalid {label} indices of {index.dtype}. Must be integers.")
        outside = np.flatnonzero((index < 0) | (index >= number))
        if outside.size:
            raise ParameterError(
                f"Invalid {label} index {index[outside[0]]} of scenario {outside[0]}. Must be 0 to "
                f"{number - 1}."
            )
        indices.append(index.astype(np.intp))
    wrong = np.flatnonzero(~np.isfinite(factors))
    if wrong.size:
        raise ParameterError(
            f"Invalid scale {factors[wrong[0]]} of scenario {wrong[0]}. Must be finite."
        )
    return indices[0], indices[1], factors
