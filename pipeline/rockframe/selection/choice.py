"""Choose scaled motions whose spectra match a target: factors, first choice, and exchanges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Final

import numpy as np
import scipy  # its submodules load when they are first used
from numpy.typing import NDArray

from rockframe.selection.target import TargetSpectrum

Float = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Weight of errors of the standard deviation, relative to errors of the mean, as Baker and Lee.
_WEIGHT: Final = 2.0
#: Sets of spectra that are simulated for the first choice; the one nearest to the target is used.
_TRIALS: Final = 20
#: Largest number of rounds in which each motion may be exchanged; few are needed.
_ROUNDS: Final = 20
#: Smallest relative improvement for which a motion is exchanged: larger than rounding.
_GAIN: Final = 1e-9
#: Factors of each motion around that of least squares, in mean standard deviations of the target:
#: motions at one level would have too little spread.
_LEVELS: Final = np.linspace(-2.0, 2.0, 9)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Motions with the factors that each may be scaled by.

    Parameters
    ----------
    motion : array, shape (candidates,)
        Number of the motion; a motion with several factors occurs several times.
    factor : array, shape (candidates,)
        Factor on the motion [1].
    log_sa : array, shape (candidates, periods)
        Natural logarithm of the spectrum of the scaled motion in m s-2.
    """

    motion: Integers
    factor: Float
    log_sa: Float


def scaled_to_fit(log_sa: Float, target: TargetSpectrum, bounds: tuple[float, float]) -> Candidates:
    """Return motions scaled by least squares of ln Sa over the periods.

    The factor of a motion is within the bounds. If the target has a spread, each motion may also be
    scaled to levels up to two standard deviations above and below.

    Parameters
    ----------
    log_sa : array, shape (motions, periods)
        Natural logarithm of the unscaled spectra.
    target : TargetSpectrum
        The target.
    bounds : (float, float)
        Smallest and largest factor.
    """
    best = (target.log_sa - log_sa).mean(axis=1)
    levels = np.zeros(1)
    if target.deviation is not None:
        levels = float(target.deviation.mean()) * _LEVELS
    factor = np.clip(_in_digits(np.exp(best[:, None] + levels).ravel()), *bounds)
    motion = np.repeat(np.arange(len(log_sa)), levels.size)
    return Candidates(motion, factor, log_sa[motion] + np.log(factor)[:, None])


def scaled_by(log_sa: Float, factor: Float, bounds: tuple[float, float]) -> Candidates:
    """Return the motions whose factor is within the bounds, scaled by it.

    Parameters
    ----------
    log_sa : array, shape (motions, periods)
        Natural logarithm of the unscaled spectra.
    factor : array, shape (motions,)
        Factor of each motion.
    bounds : (float, float)
        Smallest and largest factor.

    Examples
    --------
    >>> scaled_by(np.zeros((3, 1)), np.array([0.1, 1.0, 9.0]), (0.25, 4.0)).motion.tolist()
    [1]
    """
    factor = _in_digits(factor)
    within = np.flatnonzero((bounds[0] <= factor) & (factor <= bounds[1]))
    return Candidates(within, factor[within], log_sa[within] + np.log(factor[within])[:, None])


def _in_digits(factor: Float) -> Float:
    """Return factors with the six digits that `processing` of a scaled record states.

    Responses can depend on the last digit of a double, which differs between computers.
    """
    return np.array([float(f"{value:.6g}") for value in factor.tolist()])


@dataclass(frozen=True, eq=False)
class Groups:
    """Groups of motions, such as those of one station, of which only some may be chosen.

    Parameters
    ----------
    of : array, shape (motions,)
        Number of the group of each motion.
    most : int
        Largest number of motions of one group.
    """

    of: Integers
    most: int


def choose(
    candidates: Candidates,
    target: TargetSpectrum,
    number: int,
    groups: Sequence[Groups] = (),
    seed: int = 0,
) -> Integers:
    """Return the positions of the chosen candidates; fewer than `number` if the limits forbid more.

    Parameters
    ----------
    candidates : Candidates
        The scaled motions.
    target : TargetSpectrum
        The target.
    number : int
        Number of motions to choose; no motion is chosen twice.
    groups : sequence of Groups
        Limits of the motions of one group.
    seed : int
        Seed of the simulated spectra.

    Notes
    -----
    The algorithm is that of Baker and Lee (2018). The first choice are the motions nearest to
    spectra that are simulated from the target. Then each motion in turn is exchanged for the one
    that brings the sum of squared errors of mean and standard deviation, which counts twice, to its
    minimum, until no exchange helps. Without a spread of the target, the sum of the squared errors
    of all motions is minimised, so the nearest motions are chosen.

    Under several limits a motion that is chosen early can leave too few for the rest, or only
    distant ones. The first choice is then the largest and nearest set of all, if it would otherwise
    be too small or if the target has no spread.

    References
    ----------
    Baker and Lee (2018), An improved algorithm for selecting ground motions to match a conditional
    spectrum, Journal of Earthquake Engineering 22(4), 708-723.

    Examples
    --------
    >>> target = TargetSpectrum(np.array([0.5, 1.0]), np.zeros(2), None, "")
    >>> motions = scaled_by(np.array([[0.3, 0.2], [0.0, 0.1], [0.5, -0.5]]), np.ones(3), (1.0, 1.0))
    >>> choose(motions, target, 2).tolist()
    [1, 0]
    """
    limits = [Groups(np.arange(candidates.motion.max(initial=-1) + 1), 1), *groups]
    wanted = _wanted(target, number, seed)
    chosen = _in_turn(candidates, wanted, limits)
    if not chosen:
        return np.zeros(0, dtype=np.int64)
    # one limit, with that of each motion within it, never leads into a dead end
    if len(groups) > 1 and (len(chosen) < number or target.covariance is None):
        chosen = _together(candidates, wanted, limits)
    best = float(_errors(candidates.log_sa[chosen][None], target)[0])
    for _ in range(_ROUNDS):
        before = best
        for place in range(len(chosen)):
            rest = chosen[:place] + chosen[place + 1 :]
            errors = _errors_with(candidates.log_sa, candidates.log_sa[rest], target)
            errors = np.where(_allowed(candidates, rest, limits), errors, np.inf)
            if errors.min() < best * (1.0 - _GAIN):
                chosen[place] = int(np.argmin(errors))
                best = float(errors[chosen[place]])
        if best == before:
            break
    return np.array(chosen, dtype=np.int64)


def _in_turn(candidates: Candidates, wanted: Float, limits: Sequence[Groups]) -> list[int]:
    """Return for each wanted spectrum the nearest candidate of those that are left."""
    chosen: list[int] = []
    for spectrum in wanted:
        allowed = _allowed(candidates, chosen, limits)
        if not allowed.any():
            break
        misfit = _misfit(candidates, spectrum)
        chosen.append(int(np.argmin(np.where(allowed, misfit, np.inf))))
    return chosen


def _together(candidates: Candidates, wanted: Float, limits: Sequence[Groups]) -> list[int]:
    """Return the set, as large as wanted or possible, with the least sum of distances.

    The distance of a candidate is that from the nearest wanted spectrum. With the limit of each
    motion and two others, the sets are flows from the groups of the one to those of the other, so
    the linear programme has whole numbers for its solution; with more limits they are required.
    """
    distance = reduce(
        np.minimum, (_misfit(candidates, spectrum) for spectrum in np.unique(wanted, axis=0))
    )
    every = np.arange(distance.size)
    rules = []
    for limit in limits:
        members = (np.ones(distance.size), (limit.of[candidates.motion], every))
        rules.append(
            scipy.optimize.LinearConstraint(scipy.sparse.csr_array(members), ub=limit.most)
        )

    def least(cost: Float, *more: object) -> NDArray[np.bool_]:
        solution = scipy.optimize.milp(
            cost,
            integrality=int(len(limits) > 3),
            bounds=scipy.optimize.Bounds(0.0, 1.0),
            constraints=[*rules, *more],
            options={"mip_rel_gap": 0.0},
        )
        return np.asarray(solution.x > 0.5)

    number = min(len(wanted), int(least(-np.ones(distance.size)).sum()))
    of_that_size = scipy.optimize.LinearConstraint(np.ones((1, distance.size)), number, number)
    chosen = np.flatnonzero(least(distance, of_that_size))
    return [int(k) for k in chosen[np.argsort(distance[chosen], kind="stable")]]


def _misfit(candidates: Candidates, spectrum: Float) -> Float:
    """Return the sum of the squared differences of each candidate from a spectrum."""
    return np.asarray(((candidates.log_sa - spectrum) ** 2).sum(axis=1))


def _allowed(
    candidates: Candidates, chosen: Sequence[int], limits: Sequence[Groups]
) -> NDArray[np.bool_]:
    """Return which candidates may be chosen beside those that are."""
    allowed = np.ones(candidates.motion.size, dtype=bool)
    for limit in limits:
        group = limit.of[candidates.motion]
        count = np.bincount(group[list(chosen)], minlength=int(limit.of.max(initial=0)) + 1)
        allowed &= count[group] < limit.most
    return allowed


def _wanted(target: TargetSpectrum, number: int, seed: int) -> Float:
    """Return spectra simulated from the target, or its mean if it has no spread."""
    mean = np.broadcast_to(target.log_sa, (number, target.log_sa.size))
    if target.covariance is None:
        return mean
    values, vectors = np.linalg.eigh(target.covariance)
    # the symmetric root is unique, unlike the signs of eigenvectors: all computers agree
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    normal = np.random.default_rng(seed).standard_normal((_TRIALS, *mean.shape))
    trials = mean + normal @ root
    return np.asarray(trials[np.argmin(_errors(trials, target))])


def _errors(sets: Float, target: TargetSpectrum) -> Float:
    """Return the error of each set of spectra, shape (sets, motions, periods)."""
    return _error(sets.sum(axis=1), (sets**2).sum(axis=1), sets.shape[1], target)


def _errors_with(each: Float, rest: Float, target: TargetSpectrum) -> Float:
    """Return the error of the other spectra together with each, shape (candidates,)."""
    total, squares = rest.sum(axis=0) + each, (rest**2).sum(axis=0) + each**2
    return _error(total, squares, len(rest) + 1, target)


def _error(total: Float, squares: Float, number: int, target: TargetSpectrum) -> Float:
    """Return the error of sets by the sums of their logarithms and of the squares of these."""
    mean = total / number
    variance = np.maximum(squares - number * mean**2, 0.0)
    away = ((mean - target.log_sa) ** 2).sum(axis=-1)
    if target.deviation is None:
        return np.asarray(away + variance.sum(axis=-1) / number)
    spread = np.sqrt(variance / max(number - 1, 1))
    return np.asarray(away + _WEIGHT * ((spread - target.deviation) ** 2).sum(axis=-1))
