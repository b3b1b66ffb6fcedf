"""Robust margins of ensembles of plausible structures, and the effect of sampling on them."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.rocking.assessments import RobustMargin
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.first_overturning import (
    LARGEST_SCALE,
    advance,
    largest_scale_of,
    least_scale_of,
    powers,
)
from rockframe.rocking.margins.members import draws, members, require_members
from rockframe.rocking.response import as_ground, refuse_flight, require_some
from rockframe.rocking.scenarios import Prepared, respond_scenarios
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int = NDArray[np.int64]

#: Shares of the ensemble whose scales are found [1].
SHARES: Final = (0.10, 0.25, 0.50)
#: The scale of a share is the mean of the scales at which `_LEVELS` shares are reached, spaced
#: evenly within `_NEAR` of the stated share [1]. Where the share hardly rises with the scale, a
#: single crossing would be uncertain.
_LEVELS: Final = 9
_NEAR: Final = 0.03
#: Peak |theta| / alpha of a member that rocks [1].
_ROCKS: Final = 0.3
#: Number of bootstrap samples of the members, for the sampling error.
_RESAMPLED: Final = 100


class Grid(NamedTuple):
    """The scales of a search for robust margins.

    Attributes
    ----------
    step : float
        Relative step from one scale to the next [1].
    averaged : int
        Number of scales on either side over which the share is averaged, to reduce sampling noise.
    every : int
        The scale at which overturning begins is searched with one member of this number, another
        one at each scale.
    to_rock, to_fall : int
        Steps of this search, first for a peak |theta| / alpha above 0.3, then for overturning.
    block, some : int
        Number of scales in one request for all members, and in one request for some of them.
    """

    step: float
    averaged: int
    every: int = 16
    to_rock: int = 8
    to_fall: int = 2
    block: int = 3
    some: int = 8


#: The scales of motions in one plane.
IN_ONE_PLANE: Final = Grid(step=0.01, averaged=4)


def robust_margins(
    motions: Sequence[Record | Pulse | GroundAcceleration],
    frames: Sequence[RockingFrame],
    ensemble: Ensemble | None = None,
    *,
    largest_scale: float = LARGEST_SCALE,
) -> list[list[RobustMargin]]:
    """Find the scales at which 10, 25 and 50 % of an ensemble of each frame overturn.

    The draws of the ensemble are the same for all frames, motions and scales. A coarse search, in
    steps of 2 % with a sixteenth of the members (other members at each step), finds the scale at
    which overturning begins. From there all members are tried in steps of 1 %, until half of them
    overturn.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames as stated.
    ensemble : Ensemble, optional
        Number of members, spreads and seed.
    largest_scale : float
        Largest scale that is searched [1]. The search ends earlier if the ground would fall faster
        than gravity at a smaller scale.

    Returns
    -------
    list of list of RobustMargin
        For each motion the margins of all frames. A margin does not depend on the other motions
        and frames.

    Raises
    ------
    ParameterError
        If the ensemble has no members, a member cannot rock, the largest scale is below 1 or not
        finite, or a vertical acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> [[margin]] = robust_margins([pulse], [bent])
    >>> round(margin.s25, 2), round(margin.s50, 2)
    (1.07, 1.1)
    """
    chosen = ensemble or Ensemble()
    require_members(chosen)
    require_some(motions=motions, frames=frames)
    families = [members(chosen, frame) for frame in frames]
    amplitude = draws(chosen)[:, 3]
    rows = []
    for motion in motions:
        ground = as_ground(motion)
        refuse_flight(ground)
        largest = largest_scale_of(ground, largest_scale)
        weakest = [min(family, key=lambda frame: frame.uplift_acceleration) for family in families]
        searches = [
            FamilySearch(amplitude, least_scale_of(ground, frame), largest, chosen.seed).search()
            for frame in weakest
        ]
        changes = changed_by_sampling([ground], frames, chosen)[0]
        row = _side_by_side(Prepared(ground), families, searches)
        rows.append(
            [
                replace(margin, sampling_changes=count)
                for margin, count in zip(row, changes.tolist(), strict=True)
            ]
        )
    return rows


#: A search yields members and scales, and is sent the verdicts and peaks of these scenarios.
Answer: TypeAlias = tuple[Bool, Float]
Search: TypeAlias = Generator[tuple[Int, Float], Answer, RobustMargin]
_Tried: TypeAlias = Generator[tuple[Int, Float], Answer, Answer]


def _side_by_side(
    ground: Prepared, families: Sequence[Sequence[RockingFrame]], searches: list[Search]
) -> list[RobustMargin]:
    """Run the searches under one ground motion in common batches."""
    frames = [*chain(*families)]
    count = len(families[0])
    results: dict[int, RobustMargin] = {}
    wanted: dict[int, tuple[Int, Float]] = {}
    for line, search in enumerate(searches):
        advance(search, None, line, wanted, results)
    while wanted:
        frame = np.concatenate([line * count + member for line, (member, _) in wanted.items()])
        scale = np.concatenate([scales for _, scales in wanted.values()])
        peaks = respond_scenarios([ground], frames, np.zeros_like(frame), frame, scale)
        end = 0
        for line, (member, _) in [*wanted.items()]:
            part = slice(end, end := end + member.size)
            fallen = peaks.verdict[part] == Verdict.OVERTURNS
            answer = fallen, peaks.peak_rotation_ratio[part]
            advance(searches[line], answer, line, wanted, results)
    return [results[line] for line in range(len(searches))]


@dataclass(eq=False)
class FamilySearch:
    """The search for the robust margin of one ensemble, at powers of 1 + the step of its grid.

    Parameters
    ----------
    amplitude : array, shape (members,)
        Factor of each member on the motion [1].
    least, largest : float
        Scale below which no member uplifts, and largest scale [1].
    seed : int
        Random seed of the bootstrap.
    grid : Grid
        The scales.
    begins : int, optional
        Power at which members are known to overturn; searched by default.
    responses : int
        Number of responses that were requested.
    """

    amplitude: Float
    least: float
    largest: float
    seed: int
    grid: Grid = IN_ONE_PLANE
    begins: int | None = None
    responses: int = 0

    def search(self) -> Search:
        """Increase the scale from where overturning begins until half of the members overturn."""
        growth, block = math.log1p(self.grid.step), self.grid.block
        last = math.floor(math.log(self.largest / self.amplitude.max()) / growth)
        lowest = self.begins
        if lowest is None or lowest > last:
            lowest = yield from self._beginning(last)
        if lowest is None:
            return RobustMargin(*(math.nan,) * 6, self.responses)
        falls = np.empty((0, self.amplitude.size), dtype=bool)
        while lowest + len(falls) <= last:
            top = lowest + len(falls)
            more = yield from self._all(top, min(top + block, last + 1))
            falls = np.concatenate([falls, more])
            while self._starts_too_high(falls) and self._scale(lowest) > self.least:
                lowest -= block
                more = yield from self._all(lowest, lowest + block)
                falls = np.concatenate([more, falls])
            averages = self._averaged(falls.mean(axis=1))[: -self.grid.averaged]
            if (averages >= SHARES[-1] + _NEAR).any():
                break
        return self._margin(lowest, falls)

    def _starts_too_high(self, falls: Bool) -> bool:
        """Return True if the least share is reached so early that smaller scales are needed.

        The averages at the first scales lack neighbours on their lower side.
        """
        shares = self._averaged(falls.mean(axis=1))[: self.grid.averaged + 1]
        return bool((shares >= SHARES[0] - _NEAR).any())

    def _scale(self, power: float) -> float:
        return math.exp(math.log1p(self.grid.step) * power)

    def _tried(self, power: Int, member: Int) -> _Tried:
        """Request verdicts and peaks |theta| / alpha [1]; return both, shape (powers, members)."""
        up, down = (powers(1.0 + self.grid.step, np.maximum(k, 0)) for k in (power, -power))
        scale = (up / down)[:, None] * self.amplitude[member]
        self.responses += scale.size
        fallen, peaks = yield np.broadcast_to(member, scale.shape).ravel(), scale.ravel()
        return fallen.reshape(scale.shape), peaks.reshape(scale.shape)

    def _all(self, start: int, end: int) -> Generator[tuple[Int, Float], Answer, Bool]:
        """Return which members overturn at powers from start to end, shape (powers, members)."""
        falls, _ = yield from self._tried(np.arange(start, end), np.arange(self.amplitude.size))
        return falls

    def _beginning(self, last: int) -> Generator[tuple[Int, Float], Answer, int | None]:
        """Return a power below which members hardly overturn; None if none ever overturns."""
        if not self.least < self.largest:
            return None
        grid = self.grid
        start = math.floor(math.log(self.least) / math.log1p(grid.step))
        rocks = yield from self._first(start, last, grid.to_rock, _ROCKS)
        start = last + 1 if rocks is None else max(start, rocks - grid.to_rock)
        return (yield from self._first(start, last, grid.to_fall, math.inf))

    def _first(
        self, start: int, last: int, step: int, peak: float
    ) -> Generator[tuple[Int, Float], Answer, int | None]:
        """Return the first power at which a tried member overturns or exceeds a peak ratio."""
        count = self.amplitude.size
        some, together = np.arange(0, count, self.grid.every), self.grid.some * step
        for low in range(start, last + 1, together):
            power = np.arange(low, min(low + together, last + 1), step)
            falls, peaks = yield from self._tried(power, (some + power[:, None]) % count)
            reached = (falls | (peaks > peak)).any(axis=1)
            if reached.any():
                return int(power[reached.argmax()])
        return None

    def _margin(self, lowest: int, falls: Bool) -> RobustMargin:
        """Return the scales of the three shares, with their bootstrap errors."""
        count = self.amplitude.size
        rng = np.random.default_rng(self.seed)
        again = rng.multinomial(count, np.full(count, 1.0 / count), _RESAMPLED)
        # counts are exact on every processor; a share may equal one of the levels of a crossing
        weights = np.concatenate([np.ones((1, count), dtype=np.int64), again])
        shares = self._averaged(falls.astype(np.int64) @ weights.T) / count
        margins = []
        for share in SHARES:
            crossing = _crossing(shares, share)
            low, high = np.quantile(np.nan_to_num(crossing[1:], nan=len(falls)), (0.16, 0.84))
            error = self._scale(0.5 * float(high - low)) - 1.0
            reached = not math.isnan(crossing[0])
            scale = self._scale(lowest + float(crossing[0])) if reached else math.nan
            margins.append((scale, error if reached else math.nan))
        (s10, error10), (s25, error25), (s50, error50) = margins
        return RobustMargin(s10, s25, s50, error10, error25, error50, self.responses)

    def _averaged(self, values: Float | Int) -> Float:
        """Return means over the scales averaged on either side, along the first axis."""
        total = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
        place, averaged = np.arange(len(values)), self.grid.averaged
        start, end = np.maximum(place - averaged, 0), np.minimum(place + averaged + 1, len(values))
        means: Float = ((total[end] - total[start]).T / (end - start)).T
        return means


def _crossing(shares: Float, share: float) -> Float:
    """Return the mean place at which each column reaches shares near `share`; NaN if never."""
    levels = share + np.linspace(-_NEAR, _NEAR, _LEVELS)
    places = np.array([_first_place(shares, level) for level in levels])
    last: Float = np.nan_to_num(places, nan=len(shares) - 1.0).mean(axis=0)
    return np.where(np.isnan(places[_LEVELS // 2]), math.nan, last)


def _first_place(shares: Float, share: float) -> Float:
    """Return the interpolated row at which each column first reaches a share; NaN if never.

    Examples
    --------
    >>> _first_place(np.array([[0.0, 0.5, 0.1], [0.5, 0.6, 0.1]]), 0.25).tolist()
    [0.5, 0.0, nan]
    """
    reached = shares >= share
    first = reached.argmax(axis=0)
    column = np.arange(shares.shape[1])
    after, before = shares[first, column], shares[np.maximum(first - 1, 0), column]
    rise = np.where(first > 0, after - before, 1.0)
    places: Float = np.where(first > 0, first - (after - share) / rise, 0.0)
    places[~reached.any(axis=0)] = math.nan
    return places


#: Half length [samples] and shape parameter of the Kaiser window of the interpolation. Its error
#: is at most 1e-4 up to 0.9 of the Nyquist frequency.
_TAPS: Final = 32
_KAISER: Final = 8.0


def changed_by_sampling(
    grounds: Sequence[GroundAcceleration], frames: Sequence[RockingFrame], ensemble: Ensemble
) -> Int:
    """Count the members that stand instead of overturning, or overturn instead of standing, when a
    record is sampled twice as finely, shape (motions, frames).

    Parameters and errors are those of `robust_margins`.
    """
    family = [*chain(*(members(ensemble, frame) for frame in frames))]
    shape = (len(grounds), len(frames), ensemble.members)
    motion = np.repeat(np.arange(len(grounds)), len(family))
    whose = np.tile(np.arange(len(family)), len(grounds))
    scale = np.tile(draws(ensemble)[:, 3], len(grounds) * len(frames))
    given, finer = (
        respond_scenarios(sampled, family, motion, whose, scale).verdict == Verdict.OVERTURNS
        for sampled in (grounds, [resampled(original) for original in grounds])
    )
    return np.asarray((given != finer).reshape(shape).sum(axis=2))


def resampled(ground: GroundAcceleration) -> GroundAcceleration:
    """Return a sampled motion with half the time step; return a continuous motion unchanged.

    Parameters
    ----------
    ground : GroundAcceleration
        The motion. Only a piecewise linear one is resampled.

    Examples
    --------
    >>> import numpy as np
    >>> coarse = GroundAcceleration.from_samples(np.sin(np.arange(200.0)), 1.0)
    >>> between = resampled(coarse).acceleration()[101]
    >>> bool(abs(between - np.sin(50.5)) < 1e-5)
    True
    """
    if ground.coefficients.shape[1] != 2:
        return ground
    step = 0.5 * ground.time_step
    finer = GroundAcceleration.from_samples(
        _interleaved(ground.acceleration()), step, ground.start_time
    )
    if ground.vertical is None:
        return finer
    last = ground.vertical[-1, 0] + ground.time_step * ground.vertical[-1, 1]
    upwards = np.append(ground.vertical[:, 0], last)
    return finer.with_vertical(
        GroundAcceleration.from_samples(_interleaved(upwards), step, ground.start_time)
    )


def _interleaved(samples: Float) -> Float:
    """Return samples and values half-way between them, by Kaiser-windowed sinc interpolation."""
    distance = np.arange(-_TAPS, _TAPS) + 0.5
    window = np.i0(_KAISER * np.sqrt(1.0 - (distance / _TAPS) ** 2)) / np.i0(_KAISER)
    weights = np.sinc(distance) * window
    between = np.convolve(samples, weights / weights.sum())[_TAPS : _TAPS + samples.size - 1]
    finer = np.empty(2 * samples.size - 1)
    finer[::2] = samples
    finer[1::2] = between
    return finer
