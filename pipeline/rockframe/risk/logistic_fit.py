"""Maximum-likelihood fit of a logistic curve, with the covariance of its coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

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
    small = np.exp(-np.abs(logit))
    probability = np.where(logit >= 0.0, 1.0, small) / (1.0 + small)
    # ln P of an outcome is -ln(1 + exp(-logit)) or -ln(1 + exp(logit)), here without overflow
    against = np.where(happened, -logit, logit)
    likelihood = -(np.maximum(against, 0.0) + np.log1p(small))
    return likelihood, happened - probability, small / (1.0 + small) ** 2


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
