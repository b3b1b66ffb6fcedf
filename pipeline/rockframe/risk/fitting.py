"""Fit of a fragility by logistic regression over the logarithm of the intensity."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.risk.fragility import Fragility
from rockframe.risk.logistic_fit import maximum_likelihood
from rockframe.risk.outcome import Outcome

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
        intercept=fit.intercept,
        slope=fit.slope,
        covariance=fit.covariance,
        log_likelihood=fit.log_likelihood,
        pseudo_r2=float(1.0 - fit.log_likelihood.sum() / _without_measure(fell)),
        concordance=_concordance(x, fell),
        brier=fit.brier,
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
