"""Fit of a fragility over the logarithm of the intensity, by probit or logistic regression."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.risk.fragility import Curve, Fragility, Outcome, determined, distribution
from rockframe.risk.ties import extremes

Float = NDArray[np.float64]
#: Share of each scenario that overturns, or True and False if each has a single outcome.
Shares: TypeAlias = NDArray[np.bool_] | Float


def fit_fragility(
    intensity: ArrayLike,
    scales: ArrayLike | None = None,
    overturned: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
    *,
    curve: Curve = "lognormal",
) -> Fragility:
    """Fit the probability of overturning over the logarithm of an intensity.

    The fit has the maximum of the likelihood. The lognormal curve is the one of hazard and risk
    analyses. The tails of the logistic curve fall only as a power of the intensity, so they can
    decide the annual rate.

    Parameters
    ----------
    intensity : array_like, shape (motions,)
        Intensity of each motion as recorded. Motions with an unknown or non-positive one are
        skipped.
    scales : array_like, shape (scales,), optional
        Multiples of the motions [1].
    overturned : array_like, shape (motions, scales)
        True if the motion at this scale overturns the structure; or the share of the members of an
        ensemble that it overturns [1]. Without scales the shape is (motions,), and it may be the
        second argument: ``fit_fragility(intensity, overturned)``.
    clusters : array_like of int, shape (motions,), optional
        Motions with the same number are not independent, for example azimuths of one record.
    curve : {"lognormal", "logistic"}
        Form of the curve.

    Raises
    ------
    ParameterError
        If the shapes do not fit, a share is not between 0 and 1, or the curve is not one of these.

    Notes
    -----
    A share f counts as f observations that overturn and 1 - f that stand. The fit is therefore that
    of the members as single observations, each of weight 1 over their number, and members of one
    motion belong to its cluster: more members do not narrow the confidence bands.

    Neighbouring intensities that differ by 1e-5 or less count as equal: in the outcome, the bounds
    of a step and the concordance, neither round-off nor the six digits of a scale factor decide
    which one is larger.

    The outcome is ``UNDETERMINED`` if the data do not determine the curve: see `determined`.

    Examples
    --------
    >>> intensity = [0.5, 0.6, 0.8, 1.0, 1.5, 1.8, 2.0, 2.4, 3.0, 4.0]
    >>> fragility = fit_fragility(intensity, [0, 0, 0, 1, 0, 0, 1, 1, 1, 1])
    >>> fragility.outcome.name, round(fragility.median, 3)
    ('FITTED', 1.456)
    >>> few = fit_fragility([1.0, 2.0, 3.0, 4.0], [0.0, 0.5, 0.5, 1.0])
    >>> few.outcome.name, round(few.median, 3)
    ('UNDETERMINED', 2.342)
    """
    if curve not in get_args(Curve):
        raise ParameterError(f"Invalid curve {curve!r}. Must be lognormal or logistic.")
    if scales is None or overturned is None:
        alone = scales if overturned is None else overturned
        scales, overturned = (1.0,), np.reshape(np.asarray(alone, dtype=np.float64), (-1, 1))
    strength = np.asarray(intensity, dtype=np.float64)
    factors = np.asarray(scales, dtype=np.float64)
    shares = np.asarray(overturned, dtype=np.float64)
    if shares.shape != (strength.size, factors.size):
        raise ParameterError(
            f"Invalid verdicts of shape {shares.shape}. Must be {(strength.size, factors.size)}."
        )
    wrong = shares[~((shares >= 0.0) & (shares <= 1.0))]
    if wrong.size:
        raise ParameterError(f"Invalid share {wrong[0]:g} that overturns. Must be 0 to 1.")
    belongs = np.arange(strength.size) if clusters is None else np.asarray(clusters)
    measured = np.isfinite(strength) & (strength > 0.0)
    strength, fell = strength[measured], _outcomes(shares[measured])
    _, belongs = np.unique(belongs[measured], return_inverse=True)
    x = np.log(strength)[:, None] + np.log(factors)
    least, most = extremes(x)
    ranked = 0.5 * (least + most)
    tried = replace(_tried(ranked, (least, most), fell, belongs), curve=curve)
    if tried.outcome is not Outcome.FITTED:
        return tried
    fit = maximum_likelihood(x, fell, belongs, curve)
    if not fit.slope * float(x.std()) > _LEVEL:
        return replace(tried, outcome=Outcome.NOT_RISING)
    fitted = replace(
        tried,
        **vars(fit),
        pseudo_r2=float(1.0 - fit.log_likelihood.sum() / _without_measure(fell)),
        concordance=_concordance(ranked, fell),
    )
    beta_high = fitted.lognormal_beta_band[1]
    if determined(fitted.median, beta_high, fitted.lowest, fitted.highest):
        return fitted
    return replace(fitted, outcome=Outcome.UNDETERMINED)


def _outcomes(shares: Float) -> Shares:
    """Return booleans if all shares are 0 or 1: half of the likelihood need not be computed."""
    single = ((shares == 0.0) | (shares == 1.0)).all()
    return shares.astype(bool) if single else shares


def _tried(
    x: Float, ends: tuple[Float, Float], shares: Shares, clusters: NDArray[np.intp]
) -> Fragility:
    """Return a fragility without a curve: the range tried, and the outcome.

    `ends` are the least and the largest value that count as equal to each x.
    """
    fell, stood = shares > 0.0, shares < 1.0  # some members may overturn, and others stand
    outcome = _outcome(x, fell, stood)
    strongest = -_least(-x, stood, clusters)
    weakest = _least(x, fell, clusters)
    # an intensity at which some of a motion stands and some overturns is evidence for neither
    stands = -_least(-ends[1], x < weakest[clusters][:, None], clusters)
    falls = _least(ends[0], x > strongest[clusters][:, None], clusters)
    separated = outcome is Outcome.SEPARATED
    return Fragility(
        outcome,
        motions=stands.size,
        observations=fell.size,
        overturned=int(fell.sum()),
        lowest=math.exp(x.min()) if x.size else math.nan,
        highest=math.exp(x.max()) if x.size else math.nan,
        safe_to=math.exp(x[stood].max()) if stood.any() else math.nan,
        overturned_from=math.exp(x[fell].min()) if fell.any() else math.nan,
        stood=np.exp(stands),
        fell=np.exp(falls),
        log_likelihood=_of_step(x, shares, clusters) if separated else np.empty(0),
    )


def _least(x: Float, some: NDArray[np.bool_], clusters: NDArray[np.intp]) -> Float:
    """Return the least of some values of each cluster; infinite if there is none."""
    least = np.full(int(clusters.max(initial=-1)) + 1, np.inf)
    np.minimum.at(least, clusters, np.where(some, x, np.inf).min(axis=1, initial=np.inf))
    return least


def _of_step(x: Float, shares: Shares, clusters: NDArray[np.intp]) -> Float:
    """Return the log-likelihood of each cluster, of separated verdicts.

    A step explains them completely, except at the step itself if some of equal intensity stand and
    others overturn: the likelihood is largest if the probability there is their mean share.
    """
    rows, columns = np.nonzero(x == x[shares < 1.0].max())
    f = shares[rows, columns].astype(np.float64)
    p = f.mean()
    likelihood = np.zeros(int(clusters.max()) + 1)
    single = scipy.special.xlogy(f, p) + scipy.special.xlog1py(1.0 - f, -p)
    np.add.at(likelihood, clusters[rows], single)
    return likelihood


def _outcome(x: Float, fell: NDArray[np.bool_], stood: NDArray[np.bool_]) -> Outcome:
    if not fell.size:
        return Outcome.UNKNOWN
    if not fell.any():
        return Outcome.NONE_OVERTURN
    if not stood.any():
        return Outcome.ALL_OVERTURN
    if x.min() == x.max():
        return Outcome.UNKNOWN
    if x[stood].max() <= x[fell].min():
        return Outcome.SEPARATED
    if x[fell].max() <= x[stood].min():
        return Outcome.NOT_RISING
    return Outcome.FITTED


def _without_measure(shares: Shares) -> float:
    share = float(shares.mean())
    return shares.size * (share * math.log(share) + (1.0 - share) * math.log1p(-share))


def _concordance(x: Float, shares: Shares) -> float:
    """Return Mann and Whitney's U over the number of pairs; ties count half."""
    # of single outcomes the sums are exact, so the order of ties does not matter
    order = np.argsort(x, axis=None, kind=None if shares.dtype == np.bool_ else "stable")
    ordered, fell = x.ravel()[order], shares.ravel()[order].astype(np.float64)
    stands = np.append(0.0, np.cumsum(1.0 - fell))
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > 0.0)
    sizes = np.diff(starts, append=ordered.size)
    both = np.repeat(stands[starts] + stands[starts + sizes], sizes)
    return float((fell * both).sum() / (2.0 * stands[-1] * fell.sum()))


#: Number of observations that are processed together, to limit memory.
_BLOCK: Final = 65536
#: Largest number of Newton steps; many are needed only if the data hardly overlap.
_STEPS: Final = 200
#: Gain of log-likelihood below which the iteration ends [1].
_ENOUGH: Final = 1e-12
#: Largest density of the normal distribution.
_PEAK: Final = 1.0 / math.sqrt(2.0 * math.pi)
#: Ratio of the arguments of a logistic and a normal distribution that are most alike.
_NORMAL: Final = 1.702
#: Slope over standardised values up to which a curve is level but for round-off.
_LEVEL: Final = 1e-9
#: Least determinant of the curvature without one cluster, over that of all: below it, round-off
#: would decide.
_DETERMINED: Final = 1e-9


@dataclass(frozen=True)
class CurveFit:
    """The curve P = F(intercept + slope x), with fields as in `Fragility`."""

    intercept: float
    slope: float
    covariance: Float
    log_likelihood: Float
    brier: float


def maximum_likelihood(
    x: Float, happened: Shares, clusters: NDArray[np.intp], curve: Curve
) -> CurveFit:
    """Return the curve of maximum likelihood. It exists only if the outcomes overlap in x.

    Parameters
    ----------
    x : array, shape (rows, columns)
        Values, not all equal.
    happened : array of bool or float, shape (rows, columns)
        Outcomes, or shares from 0 to 1. They must overlap in x.
    clusters : array of int, shape (rows,)
        Number of the cluster of each row, from 0 without gaps. Rows of one cluster are not
        independent.
    curve : {"lognormal", "logistic"}
        Form of the curve.

    Notes
    -----
    The covariance is that of leaving out one cluster at a time, (sum d d^T) (n - 1) / n. Newton's
    first step to the fit without a cluster is d = (H - h)^-1 s, with the curvature H of all, and
    the curvature h and the sum s of the scores of the cluster. The sandwich estimate H^-1 (sum s
    s^T) H^-1 n / (n - 1) of Liang and Zeger (1986) leaves out h, and is too small for few clusters.
    One step is too small too if verdicts were separated without a cluster: the fit without it would
    be a step. The covariance is NaN if the others do not determine a curve to round-off.
    """
    centre, spread = float(x.mean()), float(x.std())
    z = (x - centre) / spread
    where = _first_guess(z, happened, curve)
    total, gradient, curvature = _terms(z, happened, where, curve)
    if not total >= -z.size * math.log(2.0):  # worse than one half everywhere
        where = np.zeros(2)
        total, gradient, curvature = _terms(z, happened, where, curve)
    for _ in range(_STEPS):
        step = np.linalg.solve(curvature, gradient)
        length = 1.0
        while True:
            there = _terms(z, happened, where + length * step, curve)
            if there[0] >= total or length < 1e-10:
                break
            length *= 0.5
        gain = there[0] - total
        where, (total, gradient, curvature) = where + length * step, there
        if gain <= _ENOUGH * (1.0 + abs(total)):
            break
    where = where + np.linalg.solve(curvature, gradient)  # doubles the number of right digits
    fit = _described(z, happened, clusters, where, curvature, curve)
    # back from the standardised values
    back = np.array([[1.0, -centre / spread], [0.0, 1.0 / spread]])
    intercept, slope = back @ where
    return replace(
        fit,
        intercept=float(intercept),
        slope=float(slope),
        covariance=back @ fit.covariance @ back.T,
    )


def _first_guess(z: Float, happened: Shares, curve: Curve) -> Float:
    """Return the curve of two normal distributions of equal width, of standardised values.

    It is the logistic regression of normally distributed values that stand and that overturn.
    """
    share = float(happened.mean())
    falls = float((happened * z).sum()) / (share * z.size)
    stands = -share * falls / (1.0 - share)  # all values have the mean zero
    slope = (falls - stands) / max(1.0 - share * (1.0 - share) * (falls - stands) ** 2, 1e-3)
    intercept = math.log(share / (1.0 - share)) - 0.5 * slope * (falls + stands)
    return np.array([intercept, slope]) / (_NORMAL if curve == "lognormal" else 1.0)


def _terms(z: Float, happened: Shares, where: Float, curve: Curve) -> tuple[float, Float, Float]:
    """Return the log-likelihood, its gradient, and its curvature times -1."""
    total, gradient, curvature = 0.0, np.zeros(2), np.zeros((2, 2))
    for rows in _blocks(z):
        part, score, weight = _of_block(z[rows], happened[rows], where, curve)
        total += float(part.sum())
        first = weight * z[rows]
        moments = [float(weight.sum()), float(first.sum()), float((first * z[rows]).sum())]
        gradient += [float(score.sum()), float((score * z[rows]).sum())]
        curvature += [[moments[0], moments[1]], [moments[1], moments[2]]]
    return total, gradient, curvature


def _of_block(z: Float, happened: Shares, where: Float, curve: Curve) -> tuple[Float, Float, Float]:
    """Return values of each observation: log-likelihood, its slope, and its curvature times -1.

    Slope and curvature are over the argument of F. Those of a share are means of the two outcomes.
    """
    if happened.dtype != np.bool_:
        both = [_of_block(z, np.full(z.shape, outcome), where, curve) for outcome in (True, False)]
        of_share = (happened * yes + (1.0 - happened) * no for yes, no in zip(*both, strict=True))
        return next(of_share), next(of_share), next(of_share)
    argument = where[0] + where[1] * z
    signed = np.where(happened, argument, -argument)
    if curve == "logistic":
        # as scipy.special.log_expit, which takes three times as long
        likelihood = np.minimum(signed, 0.0) - np.log1p(np.exp(-np.abs(signed)))
        steepness = scipy.special.expit(-signed)
        weight = steepness * scipy.special.expit(signed)
    else:
        likelihood = scipy.special.log_ndtr(signed)
        # density over distribution; below the median as 1 / erfcx, where the logarithms cancel
        steepness = _PEAK * np.exp(-0.5 * signed**2 - likelihood)
        low = np.flatnonzero(signed < -1.0)
        tail = signed.flat[low]
        steepness.flat[low] = 2.0 * _PEAK / scipy.special.erfcx(-tail / math.sqrt(2.0))
        # the curvature is between 0 and 1; far from the data round-off may leave this range
        weight = np.clip(steepness * (steepness + signed), 0.0, 1.0)
    return likelihood, np.where(happened, steepness, -steepness), weight


def _blocks(z: Float) -> list[slice]:
    height = max(1, _BLOCK // z.shape[1])
    return [slice(start, start + height) for start in range(0, z.shape[0], height)]


def _described(
    z: Float,
    happened: Shares,
    clusters: NDArray[np.intp],
    where: Float,
    curvature: Float,
    curve: Curve,
) -> CurveFit:
    count = int(clusters.max()) + 1
    sums, squares = np.zeros((6, count)), 0.0
    for rows in _blocks(z):
        part, score, weight = _of_block(z[rows], happened[rows], where, curve)
        first = weight * z[rows]
        values = (part, score, score * z[rows], weight, first, first * z[rows])
        for total, term in zip(sums, values, strict=True):
            total += np.bincount(clusters[rows], term.sum(axis=1), count)
        probability = distribution(curve)(where[0] + where[1] * z[rows])
        fell = happened[rows].astype(np.float64)
        squares += float((fell * (1.0 - probability) ** 2 + (1.0 - fell) * probability**2).sum())
    likelihood, score, turned, *moments = sums
    # without one of two clusters, the other alone would decide
    steps = np.full((count, 2), np.nan)
    a, b, c = (whole - own for whole, own in zip(curvature.flat[[0, 1, 3]], moments, strict=True))
    rest = a * c - b * b
    determined = rest > _DETERMINED * np.linalg.det(curvature)
    if count > 2 and determined.all() and (a > 0.0).all():
        steps = np.stack([(c * score - b * turned) / rest, (a * turned - b * score) / rest], axis=1)
    return CurveFit(
        intercept=float(where[0]),
        slope=float(where[1]),
        covariance=steps.T @ steps * (1.0 - 1.0 / count),
        log_likelihood=likelihood,
        brier=squares / z.size,
    )
