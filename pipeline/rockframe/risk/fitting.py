"""Fit of a fragility by logistic regression over the logarithm of the intensity."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.risk.fragility import Fragility
from rockframe.risk.limits import Outcome

Float = NDArray[np.float64]


def fit_fragility(
    intensity: ArrayLike,
    scales: ArrayLike | None = None,
    overturned: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
) -> Fragility:
    """Fit the probability of overturning over the logarithm of an intensity.

    Parameters
    ----------
    intensity : array_like, shape (motions,)
        Intensity of each motion as recorded. Motions with an unknown or non-positive one are
        skipped.
    scales : array_like, shape (scales,), optional
        Multiples of the motions [1].
    overturned : array_like of bool, shape (motions, scales)
        True if the motion at this scale overturns the structure. Without scales the shape is
        (motions,), and it may be the second argument: ``fit_fragility(intensity, overturned)``.
    clusters : array_like of int, shape (motions,), optional
        Motions with the same number are not independent, for example azimuths of one record.

    Raises
    ------
    ParameterError
        If the shapes do not fit.

    Examples
    --------
    >>> fragility = fit_fragility([1.0, 2.0, 3.0, 4.0], [False, True, False, True])
    >>> fragility.outcome.name, round(fragility.median, 3)
    ('FITTED', 2.264)
    """
    if scales is None or overturned is None:
        alone = scales if overturned is None else overturned
        scales, overturned = (1.0,), np.reshape(np.asarray(alone, dtype=bool), (-1, 1))
    strength = np.asarray(intensity, dtype=np.float64)
    factors = np.asarray(scales, dtype=np.float64)
    fell = np.asarray(overturned, dtype=bool)
    if fell.shape != (strength.size, factors.size):
        raise ParameterError(
            f"Invalid verdicts of shape {fell.shape}. Must be {(strength.size, factors.size)}."
        )
    belongs = np.arange(strength.size) if clusters is None else np.asarray(clusters)
    known = np.isfinite(strength) & (strength > 0.0)
    strength, fell = strength[known], fell[known]
    _, belongs = np.unique(belongs[known], return_inverse=True)
    x = np.log(strength)[:, None] + np.log(factors)
    tried = _tried(x, fell, belongs)
    if tried.outcome is not Outcome.FITTED:
        return tried
    fit = maximum_likelihood(x, fell, belongs)
    if not fit.slope > 0.0:
        return replace(tried, outcome=Outcome.NOT_RISING)
    return replace(
        tried,
        **vars(fit),
        pseudo_r2=float(1.0 - fit.log_likelihood.sum() / _without_measure(fell)),
        concordance=_concordance(x, fell),
    )


def _tried(x: Float, fell: NDArray[np.bool_], clusters: NDArray[np.intp]) -> Fragility:
    """Return a fragility without a curve: the range tried, and the outcome."""
    outcome = _outcome(x, fell)
    motions = int(clusters.max(initial=-1)) + 1
    stands, falls = np.full(motions, -np.inf), np.full(motions, np.inf)
    if x.size:
        np.maximum.at(stands, clusters, np.where(fell, -np.inf, x).max(axis=1))
        np.minimum.at(falls, clusters, np.where(fell, x, np.inf).min(axis=1))
    return Fragility(
        outcome,
        motions=motions,
        observations=fell.size,
        overturned=int(fell.sum()),
        lowest=math.exp(x.min()) if x.size else math.nan,
        highest=math.exp(x.max()) if x.size else math.nan,
        safe_to=math.nan if fell.all() else math.exp(x[~fell].max()),
        overturned_from=math.exp(x[fell].min()) if fell.any() else math.nan,
        stood=np.exp(stands),
        fell=np.exp(falls),
        # a step explains separated verdicts completely, so the likelihood tends to 1
        log_likelihood=np.zeros(motions if outcome is Outcome.SEPARATED else 0),
    )


def _outcome(x: Float, fell: NDArray[np.bool_]) -> Outcome:
    if not fell.size:
        return Outcome.UNKNOWN
    if not fell.any():
        return Outcome.NONE_OVERTURN
    if fell.all():
        return Outcome.ALL_OVERTURN
    if x.min() == x.max():
        return Outcome.UNKNOWN
    if x[~fell].max() <= x[fell].min():
        return Outcome.SEPARATED
    if x[fell].max() <= x[~fell].min():
        return Outcome.NOT_RISING
    return Outcome.FITTED


def _without_measure(fell: NDArray[np.bool_]) -> float:
    share = float(fell.mean())
    return fell.size * (share * math.log(share) + (1.0 - share) * math.log1p(-share))


def _concordance(x: Float, fell: NDArray[np.bool_]) -> float:
    """Return Mann and Whitney's U over the number of pairs; ties count half."""
    safe = np.sort(x[~fell])
    strong = x[fell]
    below = np.searchsorted(safe, strong, side="left")
    upto = np.searchsorted(safe, strong, side="right")
    return float((below + upto).sum() / (2.0 * safe.size * strong.size))


#: Number of observations that are processed together, to limit memory.
_BLOCK: Final = 65536
#: Largest number of Newton steps; many are needed only if the data hardly overlap.
_STEPS: Final = 200
#: Gain of log-likelihood below which the iteration ends [1].
_ENOUGH: Final = 1e-12


@dataclass(frozen=True)
class LogisticFit:
    """The curve P = 1 / (1 + exp(-(intercept + slope x))), with fields as in `Fragility`."""

    intercept: float
    slope: float
    covariance: Float
    log_likelihood: Float
    brier: float


def maximum_likelihood(
    x: Float, happened: NDArray[np.bool_], clusters: NDArray[np.intp]
) -> LogisticFit:
    """Return the curve of maximum likelihood. It exists only if the outcomes overlap in x.

    Parameters
    ----------
    x : array, shape (rows, columns)
        Values, not all equal.
    happened : array of bool, shape (rows, columns)
        Outcomes, which must overlap in x.
    clusters : array of int, shape (rows,)
        Number of the cluster of each row, from 0 without gaps. Rows of one cluster are not
        independent.

    Notes
    -----
    The covariance is the sandwich estimate over clusters, H^-1 (sum s s^T) H^-1 n / (n - 1), with
    s the sum of the scores of a cluster (Liang and Zeger 1986).
    """
    centre, spread = float(x.mean()), float(x.std())
    z = (x - centre) / spread
    where = np.zeros(2)
    total, gradient, curvature = _terms(z, happened, where)
    for _ in range(_STEPS):
        step = np.linalg.solve(curvature, gradient)
        length = 1.0
        while True:
            there = _terms(z, happened, where + length * step)
            if there[0] >= total or length < 1e-10:
                break
            length *= 0.5
        gain = there[0] - total
        where, (total, gradient, curvature) = where + length * step, there
        if gain <= _ENOUGH * (1.0 + abs(total)):
            break
    return _described(z, happened, clusters, where, np.linalg.inv(curvature), (centre, spread))


def _terms(z: Float, happened: NDArray[np.bool_], where: Float) -> tuple[float, Float, Float]:
    """Return the log-likelihood, its gradient, and its curvature times -1."""
    total, gradient, curvature = 0.0, np.zeros(2), np.zeros((2, 2))
    for rows in _blocks(z):
        part, missed, weight = _of_block(z[rows], happened[rows], where)
        total += float(part.sum())
        moments = [float((weight * z[rows] ** power).sum()) for power in range(3)]
        gradient += [float(missed.sum()), float((missed * z[rows]).sum())]
        curvature += [[moments[0], moments[1]], [moments[1], moments[2]]]
    return total, gradient, curvature


def _of_block(z: Float, happened: NDArray[np.bool_], where: Float) -> tuple[Float, Float, Float]:
    """Return log-likelihood, observed minus expected outcome, and variance of each observation."""
    logit = where[0] + where[1] * z
    probability = scipy.special.expit(logit)
    likelihood = scipy.special.log_expit(np.where(happened, logit, -logit))
    return likelihood, happened - probability, probability * scipy.special.expit(-logit)


def _blocks(z: Float) -> list[slice]:
    height = max(1, _BLOCK // z.shape[1])
    return [slice(start, start + height) for start in range(0, z.shape[0], height)]


def _described(
    z: Float,
    happened: NDArray[np.bool_],
    clusters: NDArray[np.intp],
    where: Float,
    inverse: Any,
    scaling: tuple[float, float],
) -> LogisticFit:
    count = int(clusters.max()) + 1
    likelihood, scores, squares = np.zeros(count), np.zeros((count, 2)), 0.0
    for rows in _blocks(z):
        part, missed, _ = _of_block(z[rows], happened[rows], where)
        np.add.at(likelihood, clusters[rows], part.sum(axis=1))
        both = np.stack([missed.sum(axis=1), (missed * z[rows]).sum(axis=1)], axis=1)
        np.add.at(scores, clusters[rows], both)
        squares += float((missed**2).sum())
    # scores add up to zero, so with two clusters they are opposite, and their covariance singular
    spread_of_scores = scores.T @ scores * (count / (count - 1.0) if count > 2 else np.nan)
    centre, spread = scaling
    back = np.array([[1.0, -centre / spread], [0.0, 1.0 / spread]])
    intercept, slope = back @ where
    return LogisticFit(
        intercept=float(intercept),
        slope=float(slope),
        covariance=back @ inverse @ spread_of_scores @ inverse @ back.T,
        log_likelihood=likelihood,
        brier=squares / z.size,
    )
