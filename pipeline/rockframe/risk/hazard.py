"""The hazard curve of a site, and the mean annual rate of overturning."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.risk.fragility import Fragility

Float = NDArray[np.float64]

#: Integration cells per segment of the curve.
_CELLS: Final = 128
#: Points and weights of Gauss's rule in each cell.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
#: Further ends of cells about the median, in standard deviations of ln x: a curve may be steep.
_ABOUT_MEDIAN: Final = np.arange(-12.0, 13.0)
#: Intensities are equal up to this share: those of scaled motions have round-off.
_ROUND_OFF: Final = 1e-12


@dataclass(frozen=True, eq=False)
class HazardCurve:
    """Annual rates of exceedance at a site, with a power law between the points.

    Parameters
    ----------
    measure : str
        Name of the measure, see `measure_of`.
    intensity : array, shape (points,)
        Increasing intensities in SI units.
    rate : array, shape (points,)
        Decreasing annual rates of exceedance [1/year].
    site : str
        The site, as a file of several names it, and how far it is from the requested place.
    note : str
        Points whose rates are only bounded by the printed digits, in words.

    Raises
    ------
    ParameterError
        If there are fewer than two points, a value is not positive and finite, the intensities do
        not increase, or the rates do not decrease.

    Examples
    --------
    >>> curve = HazardCurve("pgv", np.array([0.1, 1.0]), np.array([1e-2, 1e-4]))
    >>> float(curve.rate_of(0.316).round(5))
    0.001
    """

    measure: str
    intensity: Float
    rate: Float
    site: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        for name in ("intensity", "rate"):
            values = getattr(self, name)
            if values.ndim != 1 or values.size < 2:
                raise ParameterError(
                    f"Invalid hazard curve of {values.size} points. Must have two or more."
                )
            wrong = np.flatnonzero(~(np.isfinite(values) & (values > 0.0)))
            if wrong.size:
                raise ParameterError(
                    f"Invalid {name} {values[wrong[0]]:g} of point {wrong[0] + 1} of the hazard "
                    "curve. Must be positive and finite."
                )
        if not (np.diff(self.intensity) > 0.0).all():
            raise ParameterError("Invalid intensities of the hazard curve. Must be increasing.")
        if not (np.diff(self.rate) < 0.0).all():
            raise ParameterError("Invalid rates of the hazard curve. Must be decreasing.")

    def rate_of(self, intensity: Float | float) -> Float:
        """Return the annual rate at which an intensity is exceeded [1/year]; NaN beyond the ends of
        the curve, which does not state it.
        """
        beyond = {"left": math.nan, "right": math.nan}
        logs = np.interp(np.log(intensity), np.log(self.intensity), np.log(self.rate), **beyond)
        return np.asarray(np.exp(logs))


@dataclass(frozen=True)
class LognormalFragility:
    """A lognormal fragility curve with stated parameters, for example from a code.

    Parameters
    ----------
    median : float
        Intensity at which half of the motions reach the limit, in SI units.
    beta : float
        Standard deviation of the logarithm of the intensity [1].

    Examples
    --------
    >>> LognormalFragility(2.0, 0.4).probability(np.array([2.0])).tolist()
    [0.5]
    """

    median: float
    beta: float
    lowest: float = 0.0
    highest: float = math.inf

    def __post_init__(self) -> None:
        for name in ("median", "beta"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ParameterError(f"Invalid {name} {getattr(self, name)}. Must be above 0.")

    def probability(self, intensity: Float) -> Float:
        """Return the probability [1]."""
        return np.asarray(scipy.special.ndtr(np.log(intensity / self.median) / self.beta))

    def band(self, intensity: Float) -> tuple[Float, Float]:
        """Return the probability twice, because a stated curve has no band."""
        return (self.probability(intensity),) * 2


@dataclass(frozen=True, eq=False)
class OverturningRate:
    """Mean annual rate of overturning, and the contribution of each intensity.

    Parameters
    ----------
    rate, low, high : float
        Mean annual rate and its bounds [1/year]; the rate is NaN without a fragility curve.
    contributions : array, shape (points,)
        Contribution of the motions between each point of the hazard curve and the next [1/year].
        The last value is that of the motions above the curve.
    extrapolated : float
        Share of the rate from intensities outside the range of the fragility [1].
    """

    rate: float
    low: float
    high: float
    contributions: Float
    extrapolated: float


def overturning_rate(
    curve: HazardCurve, fragility: Fragility | LognormalFragility
) -> OverturningRate:
    """Return the mean annual rate of overturning, by integration over the hazard curve.

    Motions above the last point of the curve overturn with the probability at that point; for the
    upper bound all of them overturn. Motions below the first point are not counted, because the
    curve does not contain their frequency.

    Parameters
    ----------
    curve : HazardCurve
        Hazard curve of the site.
    fragility : Fragility or LognormalFragility
        Fragility over the same measure.

    Notes
    -----
    The rate is the integral of P(x) over the rates of the intensities x, by Gauss's rule in ln x.
    With rates k x^-a, it is k m^-a exp(a^2 beta^2 / 2) for a lognormal fragility of median m.

    Examples
    --------
    >>> from rockframe.risk import fit_fragility
    >>> curve = HazardCurve("pgv", np.array([0.1, 1.0, 10.0]), np.array([1e-2, 1e-4, 1e-6]))
    >>> stands = fit_fragility([0.4, 0.5], [1.0, 2.0], [[0, 0], [0, 0]])
    >>> bounds = overturning_rate(curve, stands)
    >>> bounds.low, f"{bounds.high:.4f}"
    (0.0, '0.0078')
    """
    ends = _ends(curve, fragility)
    middle = np.exp(ends[:-1, None] + np.diff(ends)[:, None] * (0.5 + 0.5 * _NODES)).ravel()
    often = _frequencies(curve, ends)
    top = curve.intensity[-1] * (1.0 + _ROUND_OFF)  # the motions above the curve are stronger
    starts = _WEIGHTS.size * np.searchsorted(ends, np.log(curve.intensity[:-1]))
    probability = fragility.probability(middle)
    low, high = fragility.band(middle)
    contributions, least, most = (
        np.append(np.add.reduceat(values * often, starts), last * curve.rate[-1])
        for values, last in (
            (probability, fragility.probability(top)),
            (low, fragility.band(top)[0]),
            (high, 1.0),
        )
    )
    rate = float(contributions.sum())
    outside = (middle < fragility.lowest) | (middle > fragility.highest)
    beyond = float((probability * often)[outside].sum())
    beyond += float(contributions[-1]) if top > fragility.highest else 0.0
    return OverturningRate(
        rate=rate,
        low=float(least.sum()),
        high=float(most.sum()),
        contributions=contributions,
        extrapolated=beyond / rate if rate > 0.0 else math.nan,
    )


def _ends(curve: HazardCurve, fragility: Fragility | LognormalFragility) -> Float:
    """Return the ends of the cells in ln x.

    They include the points of the curve, the ends of the range of the fragility, and the jumps of
    its bounds: the integrand is smooth within each cell.
    """
    logs = np.log(curve.intensity)
    even = logs[:-1, None] + np.diff(logs)[:, None] * np.arange(_CELLS) / _CELLS
    jumps, steep = np.array([fragility.lowest, fragility.highest]), np.empty(0)
    if isinstance(fragility, LognormalFragility):
        steep = math.log(fragility.median) + fragility.beta * _ABOUT_MEDIAN
    elif fragility.slope > 0.0:
        steep = -fragility.intercept / fragility.slope + fragility.lognormal_beta * _ABOUT_MEDIAN
    else:
        jumps = np.concatenate([jumps, fragility.stood, fragility.fell])
    jumps = np.log(jumps[(jumps > curve.intensity[0]) & (jumps < curve.intensity[-1])])
    steep = steep[(steep > logs[0]) & (steep < logs[-1])]
    return np.unique(np.concatenate([even.ravel(), logs[-1:], jumps, steep]))


def _frequencies(curve: HazardCurve, ends: Float) -> Float:
    """Return the annual rate of the intensities about each point of the cells, in one row."""
    falling = np.interp(ends, np.log(curve.intensity), np.log(curve.rate))
    shares = _WEIGHTS * np.exp(np.diff(falling)[:, None] * (0.5 + 0.5 * _NODES))
    shares /= shares.sum(axis=1, keepdims=True)  # so that the rates of each cell add up exactly
    return np.asarray(-np.diff(np.exp(falling))[:, None] * shares).ravel()
