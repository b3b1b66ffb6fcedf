"""The demand that is exceeded once in a return period: the hazard curve with the fragilities."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.risk.fitting import fit_fragility
from rockframe.risk.fragility import Curve, Fragility
from rockframe.risk.hazard import HazardCurve, LognormalFragility, overturning_rate

Float = NDArray[np.float64]

#: Number of levels of the demand at which its annual rate is computed.
_LEVELS: Final = 48


@dataclass(frozen=True, eq=False)
class DemandHazard:
    """Annual rates at which a demand reaches increasing levels.

    Parameters
    ----------
    level : array, shape (levels,)
        Levels of the demand, in SI units; the last one is infinite: the structure overturns.
    rate, low, high : array, shape (levels,)
        Mean annual rate and its bounds [1/year], not increasing; the rate is NaN where the
        fragility of the level is not determined.
    extrapolated : array, shape (levels,)
        Share of the rate from intensities that were not tried [1].
    most_frequent : float
        Rate at which the hazard curve begins [1/year]: more frequent demands are not known.

    Examples
    --------
    >>> demand = DemandHazard(*(np.array(one) for one in (
    ...     [0.1, 1.0, np.inf], [1e-2, 1e-4, 1e-6], [5e-3, 5e-5, 0.0], [2e-2, 2e-4, 1e-5],
    ...     [0.0, 0.0, 0.5])))
    >>> value, low, high, share = demand.at(1000.0)
    >>> round(value, 3), round(low, 3), round(high, 3), share
    (0.316, 0.224, 0.447, 0.0)
    """

    level: Float
    rate: Float
    low: Float
    high: Float
    extrapolated: Float
    most_frequent: float = math.inf

    def at(self, return_period: float) -> tuple[float, float, float, float]:
        """Return the demand that is exceeded once in a return period, and its bounds.

        Parameters
        ----------
        return_period : float
            Return period [year].

        Returns
        -------
        value, low, high : float
            Demand in SI units: 0 if even the smallest level is rarer, infinite if overturning is
            more frequent, NaN if no fragility is determined there, or if the hazard curve begins
            with rarer motions.
        extrapolated : float
            Share of the rate at this demand from intensities that were not tried [1].
        """
        aim = 1.0 / return_period
        if aim > self.most_frequent:
            return (math.nan,) * 4
        value, low, high = (_where(self.level, each, aim) for each in self._rates())
        known = np.flatnonzero(np.isfinite(self.rate))
        near = known[np.argmin(np.abs(np.log(self.rate[known].clip(1e-300) / aim)))]
        share = float(self.extrapolated[near]) if math.isfinite(value) and value else math.nan
        return value, low, high, share

    def _rates(self) -> tuple[Float, Float, Float]:
        return self.rate, self.low, self.high


def _where(level: Float, rate: Float, aim: float) -> float:
    """Return the level that is reached at a rate, straight between the points in log-log."""
    known = np.isfinite(rate)
    if not known.any():
        return math.nan
    level, rate = level[known], rate[known]
    if rate[-1] >= aim:
        return math.inf if math.isinf(level[-1]) else math.nan
    above = np.flatnonzero(rate >= aim)
    if not above.size:
        return 0.0
    k = int(above[-1])
    ends = level[k : k + 2]
    if math.isinf(ends[1]):  # between the largest level and overturning
        return float(ends[0])
    if rate[k + 1] <= 0.0:
        return float(ends[1])
    share = math.log(rate[k] / aim) / math.log(rate[k] / rate[k + 1])
    return float(ends[0] * (ends[1] / ends[0]) ** share)


def demand_hazard(
    curve: HazardCurve,
    level: ArrayLike,
    fragility_of: Callable[[float], Fragility | LognormalFragility],
) -> DemandHazard:
    """Return the annual rates at which a demand reaches each level.

    Parameters
    ----------
    curve : HazardCurve
        Hazard curve of the site.
    level : array_like, shape (levels,)
        Positive, increasing levels in SI units; the last one may be infinite.
    fragility_of : callable
        Returns the fragility of reaching a level, over the measure of the curve.

    Raises
    ------
    ParameterError
        If the levels are not positive and increasing.

    Notes
    -----
    The rate of reaching d is the integral of P(D >= d | x) over the rates of the intensities x, as
    of `overturning_rate`. If D is lognormal about c x^b with the deviation s, and the rates are
    k x^-a, it is k (d/c)^(-a/b) exp((a s / b)^2 / 2).
    """
    levels = np.asarray(level, dtype=np.float64)
    if not (levels.size and (levels > 0.0).all() and (np.diff(levels) > 0.0).all()):
        raise ParameterError("Invalid levels of a demand. Must be positive and increasing.")
    rates = [overturning_rate(curve, fragility_of(float(each))) for each in levels]
    rate, low, high, extrapolated = (
        np.array([getattr(each, name) for each in rates])
        for name in ("rate", "low", "high", "extrapolated")
    )
    # A higher level is not reached more often; fits of few motions may differ from this slightly.
    falling = np.minimum.accumulate(np.where(np.isnan(rate), np.inf, rate))
    rate = np.where(np.isnan(rate), np.nan, falling)
    bounds = (np.minimum.accumulate(low), np.minimum.accumulate(high))
    return DemandHazard(levels, rate, *bounds, extrapolated, float(curve.rate[0]))


def demands_at(
    curve: HazardCurve,
    return_periods: Sequence[float],
    peaks: Float,
    intensities: tuple[Float, Float],
    clusters: NDArray[np.int64],
    form: Curve,
) -> Mapping[str, Float]:
    """Return the demand of one structure at return periods, from its peaks at several scales.

    Parameters
    ----------
    curve : HazardCurve
        Hazard curve of the site.
    return_periods : sequence of float
        Return periods [year].
    peaks : array, shape (motions, scales, members)
        Largest demand in each scenario, infinite where the structure overturns.
    intensities : (array of shape (motions,), array of shape (scales,))
        Intensity of each motion in the measure of the curve, and its factor at each scale.
    clusters : array of int, shape (motions,)
        Recording of each motion.
    form : {"lognormal", "logistic"}
        Form of the fragility curves.

    Returns
    -------
    mapping of str to array, shape (return periods,)
        ``value``, ``low``, ``high`` and ``extrapolated`` of `DemandHazard.at`.
    """
    finite = peaks[np.isfinite(peaks) & (peaks > 0.0)]
    names = ("value", "low", "high", "extrapolated")
    if not finite.size:
        return {name: np.full(len(return_periods), np.nan) for name in names}
    levels = np.append(np.unique(np.geomspace(finite.min(), finite.max(), _LEVELS)), np.inf)

    def fragility_of(level: float) -> Fragility:
        return fit_fragility(*intensities, (peaks >= level).mean(axis=-1), clusters, curve=form)

    demand = demand_hazard(curve, levels, fragility_of)
    found = np.array([demand.at(period) for period in return_periods])
    return dict(zip(names, found.T, strict=True))
