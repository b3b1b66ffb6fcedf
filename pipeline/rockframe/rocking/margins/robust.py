"""Robust margins: scales at which given shares of an ensemble of plausible structures overturn.

A critical scale moves when the structure changes by a thousandth. What share of structures that
differ by a hundredth overturns at a scale changes little, and is what an engineer can count on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.batch import respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.gathering import Prepared
from rockframe.rocking.margins.ensemble import Ensemble
from rockframe.rocking.margins.scale_limits import LARGEST_SCALE, largest_scale_of, least_scale_of
from rockframe.rocking.response import Verdict, as_ground, refuse_flight
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

#: Shares of the ensemble whose scales are found [1].
SHARES: Final = (0.10, 0.25, 0.50)
#: Each scale that is tried is larger than the one before by this share [1].
SCALE_STEP: Final = 0.01
#: A share is the mean over so many scales on either side: one scale shows the noise of the members.
AVERAGED: Final = 4
#: Where overturning begins is sought with every so many-th member, in so many steps at a time: a
#: peak |theta| / alpha of so much first, then one that overturns.
_EVERY: Final = 8
_TO_ROCK: Final = 8
_ROCKS: Final = 0.3
_TO_FALL: Final = 3
#: Scales that are asked for at a time.
_BLOCK: Final = 4
#: Below this share the scales that matter have not begun [1].
_BEGUN: Final = 0.05
#: Ensembles that are drawn from the members again, for the sampling error.
_RESAMPLED: Final = 200


@dataclass(frozen=True)
class RobustMargin:
    """Least scales at which shares of an ensemble overturn.

    Parameters
    ----------
    s10, s25, s50 : float
        Least multiple of the motion at which 10, 25 and 50 % overturn [1], as the mean over the
        scales within 4 %; NaN if so many do at none.
    error10, error25, error50 : float
        Their sampling errors as a share of them [1]: half the range that holds the middle 68 % of
        the ensembles that are drawn again from the members. NaN where the scale is.
    responses : int
        Responses that were computed.
    """

    s10: float
    s25: float
    s50: float
    error10: float
    error25: float
    error50: float
    responses: int


def robust_margins(
    motions: Sequence[Record | Pulse | GroundAcceleration],
    frames: Sequence[RockingFrame],
    ensemble: Ensemble | None = None,
    *,
    largest_scale: float = LARGEST_SCALE,
) -> list[list[RobustMargin]]:
    """Find the scales at which 10, 25 and 50 % of an ensemble of each frame overturn.

    The draws of the ensemble are the same for all frames, motions and scales. Overturning is first
    sought in steps of 3 % with an eighth of the members; from there on all members are tried in
    steps of 1 %, until half of them overturn.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as `respond` takes them.
    frames : sequence of RockingFrame
        The frames as stated.
    ensemble : Ensemble, optional
        Number of members, spreads and seed.
    largest_scale : float
        Where the search ends [1]; earlier for a vertical acceleration that would then fall faster
        than gravity.

    Returns
    -------
    list of list of RobustMargin
        For each motion those of the frames; the same bits whatever else is asked for.

    Raises
    ------
    ParameterError
        If the spreads leave a frame that does not rock, the largest scale is below 1 or not finite,
        or a vertical acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> [[margin]] = robust_margins([pulse], [bent])
    >>> round(margin.s25, 2), round(margin.s50, 2)
    (1.08, 1.1)
    """
    asked = ensemble or Ensemble()
    families = [asked.frames(frame) for frame in frames]
    amplitude = asked.draws()[:, 3]
    found = []
    for motion in motions:
        ground = as_ground(motion)
        refuse_flight(ground)
        largest = largest_scale_of(ground, largest_scale)
        prepared = Prepared(ground)
        found.append(
            [
                _Family(prepared, family, amplitude, largest, asked.seed).margin()
                for family in families
            ]
        )
    return found


@dataclass(eq=False)
class _Family:
    """An ensemble on one ground, and what is known of it at powers of 1 + SCALE_STEP."""

    ground: Prepared
    frames: list[RockingFrame]
    amplitude: Float
    largest: float
    seed: int
    responses: int = 0

    def margin(self) -> RobustMargin:
        """Walk up from where overturning begins until half of the members overturn."""
        growth = math.log1p(SCALE_STEP)
        last = math.floor(math.log(self.largest / self.amplitude.max()) / growth)
        weakest = min(self.frames, key=lambda frame: frame.uplift_acceleration)
        least = least_scale_of(self.ground.ground, weakest)
        start = self._beginning(least, last)
        if start is None:
            nan = math.nan
            return RobustMargin(nan, nan, nan, nan, nan, nan, self.responses)
        lowest, falls = start, np.empty((0, len(self.frames)), dtype=bool)
        while lowest + len(falls) <= last:
            top = lowest + len(falls)
            falls = np.concatenate([falls, self._tried(top, min(top + _BLOCK, last + 1))[0]])
            while _averaged(falls.mean(axis=1))[0] >= _BEGUN and self._scale(lowest) > least:
                falls = np.concatenate([self._tried(lowest - _BLOCK, lowest)[0], falls])
                lowest -= _BLOCK
            if (_averaged(falls.mean(axis=1))[:-AVERAGED] >= SHARES[-1]).any():
                break
        return self._told(lowest, falls)

    def _scale(self, power: float) -> float:
        return math.exp(math.log1p(SCALE_STEP) * power)

    def _tried(self, start: int, end: int, step: int = 1, every: int = 1) -> tuple[Bool, Float]:
        """Which members overturn, and their peaks over alpha [1]; shape (powers, members)."""
        powers = np.arange(start, end, step)
        member = np.arange(0, len(self.frames), every)
        scale = np.exp(math.log1p(SCALE_STEP) * powers)[:, None] * self.amplitude[member]
        found = respond_scenarios(
            [self.ground],
            self.frames,
            np.zeros(scale.size, dtype=np.int64),
            np.tile(member, powers.size),
            scale.ravel(),
        )
        self.responses += scale.size
        falls = np.asarray(found.verdict == Verdict.OVERTURNED).reshape(scale.shape)
        return falls, found.peak_rotation_ratio.reshape(scale.shape)

    def _beginning(self, least: float, last: int) -> int | None:
        """A power below which members hardly overturn; None if they do at none."""
        if not least < self.largest:
            return None
        start = math.floor(math.log(least) / math.log1p(SCALE_STEP))
        rocks = self._first(start, last, _TO_ROCK, _ROCKS)
        if rocks is None:
            return None
        falls = self._first(max(start, rocks - _TO_ROCK), last, _TO_FALL, math.inf)
        return None if falls is None else falls - AVERAGED

    def _first(self, start: int, last: int, step: int, peak: float) -> int | None:
        """The first power, in steps, at which a member overturns or exceeds a peak over alpha."""
        for low in range(start, last + 1, _BLOCK * step):
            falls, peaks = self._tried(low, min(low + _BLOCK * step, last + 1), step, _EVERY)
            found = (falls | (peaks > peak)).any(axis=1)
            if found.any():
                return low + step * int(found.argmax())
        return None

    def _told(self, lowest: int, falls: Bool) -> RobustMargin:
        """Find the scales, and their errors by drawing from the members again."""
        count = len(self.frames)
        rng = np.random.default_rng(self.seed)
        again = rng.multinomial(count, np.full(count, 1.0 / count), _RESAMPLED)
        weights = np.concatenate([np.ones((1, count)), again]) / count
        shares = _averaged(falls.astype(np.float64) @ weights.T)
        told = []
        for share in SHARES:
            crossing = _crossings(shares, share)
            low, high = np.quantile(np.nan_to_num(crossing[1:], nan=len(falls)), (0.16, 0.84))
            error = self._scale(0.5 * float(high - low)) - 1.0
            found = not math.isnan(crossing[0])
            scale = self._scale(lowest + float(crossing[0])) if found else math.nan
            told.append((scale, error if found else math.nan))
        (s10, error10), (s25, error25), (s50, error50) = told
        return RobustMargin(s10, s25, s50, error10, error25, error50, self.responses)


def _averaged(shares: Float) -> Float:
    """Means over the neighbours on either side, as far as there are any; along the first axis."""
    total = np.concatenate([np.zeros_like(shares[:1]), np.cumsum(shares, axis=0)])
    place = np.arange(len(shares))
    start, end = np.maximum(place - AVERAGED, 0), np.minimum(place + AVERAGED + 1, len(shares))
    means: Float = ((total[end] - total[start]).T / (end - start)).T
    return means


def _crossings(shares: Float, share: float) -> Float:
    """Where each column reaches a share for the first time, between its rows; NaN if nowhere."""
    reached = shares >= share
    first = reached.argmax(axis=0)
    column = np.arange(shares.shape[1])
    after, before = shares[first, column], shares[np.maximum(first - 1, 0), column]
    rise = np.where(first > 0, after - before, 1.0)
    places: Float = np.where(first > 0, first - (after - share) / rise, 0.0)
    places[~reached.any(axis=0)] = math.nan
    return places
