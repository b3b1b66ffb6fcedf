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
        """Return the annual rate at which an intensity within the curve is exceeded [1/year]."""
        logs = np.interp(np.log(intensity), np.log(self.intensity), np.log(self.rate))
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
    logs = np.log(curve.intensity)
    steps = ((np.arange(_CELLS)[:, None] + 0.5 + 0.5 * _NODES) / _CELLS).ravel()
    middle = np.exp(logs[:-1, None] + np.diff(logs)[:, None] * steps)
    often = _frequencies(np.log(curve.rate), steps)
    above = float(curve.rate[-1])
    top = curve.intensity[-1]
    probability = fragility.probability(middle)
    low, high = fragility.band(middle)
    contributions = np.append((probability * often).sum(axis=1), fragility.probability(top) * above)
    rate = float(contributions.sum())
    outside = (middle < fragility.lowest) | (middle > fragility.highest)
    beyond = float((probability * often)[outside].sum())
    beyond += float(contributions[-1]) if top > fragility.highest else 0.0
    return OverturningRate(
        rate=rate,
        low=float((low * often).sum() + fragility.band(top)[0] * above),
        high=float((high * often).sum() + above),
        contributions=contributions,
        extrapolated=beyond / rate if rate > 0.0 else math.nan,
    )


def _frequencies(falling: Float, steps: Float) -> Float:
    """Return the annual rate of the intensities about each point, shape (segments, points)."""
    ends = np.linspace(0.0, 1.0, _CELLS + 1)
    slope = np.diff(falling)[:, None]
    exceeded = np.exp(falling[:-1, None] + slope * ends)
    shares = _WEIGHTS * np.exp(slope * steps).reshape(-1, _CELLS, _WEIGHTS.size)
    shares /= shares.sum(axis=2, keepdims=True)  # so that the rates of each cell add up exactly
    return np.asarray((-np.diff(exceeded, axis=1)[:, :, None] * shares).reshape(len(slope), -1))
