"""Search over the scale of a motion for the first overturning of frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.assessments import FirstOverturning
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels.tails import match_excursions
from rockframe.rocking.scenarios import Prepared, respond_scenarios
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: All sampled scales are on a lattice: place k is the least scale times _LATTICE_RATIO**k.
_LATTICE_STEP: Final = 1e-4
_LATTICE_RATIO: Final = math.exp(_LATTICE_STEP)
#: The search first looks for rocking, a peak |theta| / alpha above `_ROCKS`, in steps of `_OUTSET`
#: places. It then samples from `_BELOW` of these steps below the first place that rocks.
_OUTSET: Final = 256
_ROCKS: Final = 0.1
_BELOW: Final = 6
#: Places between the scales that are sampled in any case: up to the first that overturns, and
#: above it.
_COARSE: Final = 64
_COARSE_STEPS_ABOVE: Final = 256
#: Levels of refinement: (width, (distance, neighbours), (distance, neighbours)). An interval of
#: this width [places] is halved if an excursion without a counterpart, in it or in one of the given
#: number of intervals on either side, begins above the distance [alpha] from the separatrix. One
#: of the two conditions is enough. The values were chosen on 860 pairs, 8 lattices each;
#: `tests/benchmarks/margins.py` counts the pairs in which the lowest sliver is missed.
_LEVELS: Final = (
    (64, (-0.05, 36), (-0.18, 1)),
    (32, (-0.15, 44), (-0.20, 1)),
    (16, (-0.12, 24), (-0.38, 0)),
    (8, (-0.05, 52), (-0.25, 0)),
    (4, (-0.22, 22), (-0.35, 0)),
    (2, (0.00, 1), (-0.18, 0)),
)
#: An interval is also halved if an excursion with a counterpart may reach the separatrix within it:
#: if the distance, raised by its change over the interval, is above this one [alpha].
_PAIRED: Final = -0.03
#: Number of excursions of each response that are compared; more do not change the result.
KEPT: Final = 12
#: Two excursions are counterparts if they are on the same side, begin within `_SAME_TIME` / p_hat
#: of each other [s], and their distances from the separatrix differ by less than `_SAME_DISTANCE`
#: [alpha].
_SAME_TIME: Final = 0.2
_SAME_DISTANCE: Final = 0.12
#: Relative tolerance of the critical scale [1].
EDGE_TOLERANCE: Final = 1e-6
#: Tolerance of the interval's upper end, as a share of the interval's width [1].
_WIDTH_TOLERANCE: Final = 0.01
#: Number of scales sampled between the first overturning and the scale from which it prevails.
_BETWEEN: Final = 32
#: Number of coarse scales that are computed at a time.
_AT_A_TIME: Final = 16
#: Number of parts into which bisection divides an interval.
_PARTS: Final = 4


@dataclass(frozen=True, eq=False)
class _Samples:
    """Outcomes at sampled scales, in ascending order; `place` is the index of a scale."""

    place: Int
    fallen: NDArray[np.bool_]
    excursions: Float

    def take(self, chosen: NDArray[np.generic]) -> _Samples:
        return _Samples(self.place[chosen], self.fallen[chosen], self.excursions[chosen])

    def and_(self, other: _Samples) -> _Samples:
        every = (self, other)
        place = np.concatenate([samples.place for samples in every])
        return _Samples(
            place,
            np.concatenate([samples.fallen for samples in every]),
            np.concatenate([samples.excursions for samples in every]),
        ).take(np.unique(place, return_index=True)[1])


#: A search yields scales, and is sent the verdicts, peaks and excursions of the frame at them.
Answer: TypeAlias = tuple[NDArray[np.bool_], Float, Float]
Search: TypeAlias = Generator[Float, Answer, "FirstOverturning"]


@dataclass(eq=False)
class SliverSearch:
    """A search that yields scales and is sent the outcomes at them.

    Parameters
    ----------
    least, largest : float
        Ends of the range of scales that is searched [1].
    frequency_parameter : float
        p_hat of the frame [rad s-1].
    """

    least: float
    largest: float
    frequency_parameter: float
    responses: int = field(default=0, init=False)

    def _scales(self, place: Int) -> Float:
        scales: Float = np.minimum(self.least * powers(_LATTICE_RATIO, place), self.largest)
        return scales

    def _at(self, scales: Float) -> Generator[Float, Answer, Answer]:
        self.responses += scales.size
        return (yield scales)

    def _sampled(self, place: Int) -> Generator[Float, Answer, _Samples]:
        fallen, _, excursions = yield from self._at(self._scales(place))
        return _Samples(place, fallen, excursions)

    def search(self) -> Search:
        """Sample coarsely, refine where slivers may be, bisect the first, sample above it."""
        span = math.log(self.largest / self.least) if self.least < self.largest else -1.0
        last = math.ceil(span / _LATTICE_STEP)
        samples = yield from self._coarse(last)
        if samples is None:
            return self._nothing()
        for level in _LEVELS:
            wanted = self._irregular(samples, *level)
            if wanted.size:
                samples = samples.and_((yield from self._sampled(wanted)))
        if not samples.fallen.any():
            return self._nothing()
        even = samples.take((samples.place - samples.place[0]) % _COARSE == 0)
        topmost = int(samples.place[-1])
        above = np.arange(topmost + _COARSE_STEPS_ABOVE, last, _COARSE_STEPS_ABOVE)
        above = np.append(above, [last] if last > topmost else above[:0])
        even = even.and_((yield from self._sampled(above)))
        lower, upper = yield from self._edges(samples.and_(even))
        return (yield from self._above(even, lower, upper))

    def _nothing(self) -> FirstOverturning:
        nan = math.nan
        return FirstOverturning(nan, nan, nan, nan, (), nan, self.responses)

    def _coarse(self, last: int) -> Generator[Float, Answer, _Samples | None]:
        """Sample coarsely from where the frame begins to rock to the first scale that overturns."""
        start = None
        for places in _portions(np.arange(0, last + 1, _OUTSET)):
            _, peaks, _ = yield from self._at(self._scales(places))
            if (peaks > _ROCKS).any():
                start = max(0, int(places[np.argmax(peaks > _ROCKS)]) - _BELOW * _OUTSET)
                break
        if start is None:
            return None
        samples = None
        for places in _portions(np.arange(start, last + 1, _COARSE)):
            more = yield from self._sampled(places)
            samples = more if samples is None else samples.and_(more)
            if more.fallen.any():
                break
        return samples

    def _irregular(self, samples: _Samples, width: int, *limits: tuple[float, int]) -> Int:
        """Return the middles of the intervals of a width that may contain slivers."""
        if samples.fallen.any():
            samples = samples.take(np.arange(int(np.argmax(samples.fallen)) + 1))
        single, paired = np.full((2, samples.place.size - 1), -np.inf)
        window = _SAME_TIME / self.frequency_parameter
        match_excursions(samples.excursions, window, _SAME_DISTANCE, single, paired)
        single[samples.fallen[1:]] = np.inf
        chosen = paired > _PAIRED
        for distance, around in limits:
            near = np.convolve(single > distance, np.ones(2 * around + 1))
            chosen |= near[around : around + single.size] > 0.0
        chosen &= np.diff(samples.place) == width
        middles: Int = samples.place[:-1][chosen] + width // 2
        return middles

    def _edges(self, samples: _Samples) -> Generator[Float, Answer, tuple[float, float]]:
        """Bisect both ends of the first interval that overturns."""
        scales = self._scales(samples.place)
        first = int(np.argmax(samples.fallen))
        stands, falls = float(scales[first - 1]), float(scales[first])
        lower = yield from self._edge(stands, falls, EDGE_TOLERANCE * falls)
        standing = np.flatnonzero(~samples.fallen[first:]) + first
        if standing.size == 0:
            return lower, self.largest
        stands, falls = float(scales[standing[0]]), float(scales[standing[0] - 1])
        tolerance = max(EDGE_TOLERANCE * lower, _WIDTH_TOLERANCE * (falls - lower))
        return lower, (yield from self._edge(stands, falls, tolerance))

    def _edge(
        self, stands: float, falls: float, tolerance: float
    ) -> Generator[Float, Answer, float]:
        """Bisect one end of an interval to a tolerance; return the scale that overturns."""
        while abs(falls - stands) > tolerance:
            stands, falls = yield from self._divided(stands, falls)
        return falls

    def _divided(
        self, stands: float, falls: float
    ) -> Generator[Float, Answer, tuple[float, float]]:
        """Divide the interval between a standing and an overturning scale; return one part.

        Of the parts whose ends differ in outcome, the one at the lowest scales is returned.
        """
        shares = np.arange(_PARTS + 1) / _PARTS
        within = (1.0 - shares) * stands + shares * falls
        fallen, _, _ = yield from self._at(within[1:-1])
        standing = np.flatnonzero(~fallen) + 1
        rises = stands < falls
        part = int(np.argmax([*fallen, True])) if rises else int(standing.max(initial=0))
        return float(within[part]), float(within[part + 1])

    def _above(
        self, even: _Samples, lower: float, upper: float
    ) -> Generator[Float, Answer, FirstOverturning]:
        """Summarise the outcomes above the first interval of overturning."""
        scales = self._scales(even.place)
        here = scales > upper
        scales = np.concatenate([[lower, upper], scales[here], [self.largest]])
        fallen = np.concatenate([[True, True], even.fallen[here]])
        # each sample represents the scales from itself to the next sample
        lengths = np.diff(np.log(scales))
        span = float(lengths.sum())
        prevails = _prevails(fallen, lengths)
        prevails_from = math.nan if prevails is None else float(scales[prevails])
        share = math.nan
        if prevails != 0:
            end = self.largest if prevails is None else prevails_from
            half_step = (end / lower) ** (0.5 / _BETWEEN)
            scales_between = lower * half_step * powers(half_step**2, np.arange(_BETWEEN))
            falls, _, _ = yield from self._at(scales_between)
            share = float(falls.mean())
        standing = float(lengths[~fallen].sum()) / span if span > 0.0 else 0.0
        return FirstOverturning(
            lower,
            upper,
            prevails_from,
            share,
            _islands(scales, fallen),
            standing,
            self.responses,
        )


def powers(ratio: float, exponent: Int) -> Float:
    """Return the powers of a ratio, with integer exponents of 0 or more.

    They are repeated products, whose last bits are the same on every processor; those of numpy.exp
    are not, and a rocking response amplifies the difference.
    """
    return _table(ratio, int(exponent.max(initial=0)).bit_length())[exponent]


@lru_cache(maxsize=8)
def _table(ratio: float, bits: int) -> Float:
    """Return the powers with exponents below 2**bits."""
    return np.cumprod(np.append(1.0, np.full((1 << bits) - 1, ratio)))


def _portions(places: Int) -> list[Int]:
    return [places[k : k + _AT_A_TIME] for k in range(0, places.size, _AT_A_TIME)]


def _prevails(fallen: NDArray[np.bool_], lengths: Float) -> int | None:
    """Return the sample from which overturning prevails (see `FirstOverturning`), or None."""
    balance = np.where(fallen, lengths, -lengths)
    worst, start = 0.0, None
    for k in range(balance.size - 1, -1, -1):
        worst = float(balance[k]) + min(0.0, worst)
        if fallen[k] and worst > 0.0:
            start = k
    return start


def _islands(scales: Float, fallen: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return the intervals that stand; each ends half-way to the next scale that overturns."""
    changes = np.flatnonzero(fallen[1:] != fallen[:-1]) + 1
    ends = np.sqrt(scales[changes - 1] * scales[changes])
    if changes.size and changes[0] == 2:
        ends[0] = scales[1]  # the upper end of the first interval was bisected
    ends = np.append(ends, scales[-1])[: 2 * ((changes.size + 1) // 2)]
    return tuple((float(a), float(b)) for a, b in ends.reshape(-1, 2))


Request = TypeVar("Request")
Outcomes = TypeVar("Outcomes")
Result = TypeVar("Result")


def first_overturnings(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    least: Float,
    largest: Float,
) -> list[FirstOverturning]:
    """Find the first overturning of each pair of a frame and a ground motion.

    Parameters
    ----------
    grounds, frames : sequence
        Ground motions and frames.
    ground, frame : array of int, shape (lines,)
        Indices of the ground motion and the frame of each pair (line).
    least, largest : array, shape (lines,)
        Ends of the range of scales that is searched [1].

    Returns
    -------
    list of FirstOverturning
        The result of a line is the same, to the last bit, whichever other lines are computed.
    """
    prepared = [Prepared(each) for each in grounds]
    results: dict[int, FirstOverturning] = {}
    searches = [
        SliverSearch(float(low), float(high), frames[k].effective_frequency_parameter).search()
        for low, high, k in zip(least, largest, frame.tolist(), strict=True)
    ]
    wanted: dict[int, Float] = {}
    for line, search in enumerate(searches):
        advance(search, None, line, wanted, results)
    while wanted:
        lines = np.repeat([*wanted], [scales.size for scales in wanted.values()])
        answers = respond_scenarios(
            prepared,
            frames,
            ground[lines],
            frame[lines],
            np.concatenate([*wanted.values()]),
            excursions=KEPT,
        )
        start = 0
        for line, scales in [*wanted.items()]:
            part = slice(start, start + scales.size)
            start += scales.size
            answer = (
                answers.verdict[part] == Verdict.OVERTURNS,
                answers.peak_rotation_ratio[part],
                answers.excursions[part],
            )
            advance(searches[line], answer, line, wanted, results)
    return [results[line] for line in range(len(searches))]


def advance(
    search: Generator[Request, Outcomes, Result],
    answer: Outcomes | None,
    line: int,
    wanted: dict[int, Request],
    results: dict[int, Result],
) -> None:
    """Send an answer to a search; store its next request in `wanted` or its result in `results`."""
    try:
        wanted[line] = next(search) if answer is None else search.send(answer)
    except StopIteration as end:
        wanted.pop(line, None)
        results[line] = end.value


def answered(
    search: Generator[Request, Outcomes, Result], answer: Callable[[Request], Outcomes]
) -> Result:
    """Return the result of a search, which yields requests and is sent the answers."""
    try:
        request = next(search)
        while True:
            request = search.send(answer(request))
    except StopIteration as stop:
        result: Result = stop.value
        return result


#: Largest multiple of the motion at which overturning is searched [1].
LARGEST_SCALE: Final = 10.0
#: Largest downward acceleration of the ground that is allowed, as a share of gravity [1].
_NEARLY: Final = 1.0 - 1e-9


def largest_scale_of(ground: GroundAcceleration, largest_scale: float) -> float:
    """Return the largest scale of a search, at which the ground falls more slowly than gravity.

    Parameters
    ----------
    ground : GroundAcceleration
        The motion.
    largest_scale : float
        Largest scale if there is no vertical motion [1].

    Raises
    ------
    ParameterError
        If the largest scale is below 1 or not finite.
    """
    if not (math.isfinite(largest_scale) and largest_scale >= 1.0):
        raise ParameterError(f"Invalid largest scale {largest_scale!r}. Must be 1 or more.")
    lowest = ground.upward_bounds()[0]
    return min(largest_scale, _NEARLY * GRAVITY / -lowest if lowest < 0.0 else math.inf)


def least_scale_of(ground: GroundAcceleration, frame: RockingFrame) -> float:
    """Return a scale below which the frame cannot uplift; infinite if the ground is still."""
    powers = ground.time_step ** np.arange(ground.coefficients.shape[1])
    strongest = float((np.abs(ground.coefficients) * powers).sum(axis=1).max())
    tangent = frame.uplift_acceleration / GRAVITY
    pull = strongest + tangent * max(abs(bound) for bound in ground.upward_bounds())
    return frame.uplift_acceleration / pull if pull > 0.0 else math.inf
