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
#: How far below its first point a hazard curve is continued, as a share of the intensity [1].
_CONTINUED: Final = 0.1
#: Relative error of rates, which are not above that of the first point of the curve [1].
_ROUND_OFF: Final = 1e-9


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
        Share of the rate from intensities that were not tried, or below the hazard curve [1].
    most_frequent : float
        Rate at which the hazard curve begins [1/year]: more frequent demands are not known.
    without_demand : float
        Rate of the weakest motion that was tried and has no demand [1/year]; 0 if there is none.

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
    without_demand: float = 0.0

    def at(self, return_period: float) -> tuple[float, float, float, float]:
        """Return the demand that is exceeded once in a return period, and its bounds.

        Parameters
        ----------
        return_period : float
            Return period [year].

        Returns
        -------
        value, low, high : float
            Demand in SI units. It is infinite if overturning is more frequent, and 0 if even the
            smallest level is rarer and motions that are at least as frequent were tried and have
            no demand. The value is NaN if no fragility is determined there, if only weaker motions
            than those tried could have it, or if the hazard curve begins with rarer motions; then
            the lower bound is 0.
        extrapolated : float
            Share of the rate at this demand from intensities that were not tried, or that are
            below the hazard curve if it continues with the slope of its beginning [1].
        """
        aim = 1.0 / return_period
        if aim > self.most_frequent * (1.0 - _ROUND_OFF):
            return math.nan, 0.0, math.nan, math.nan
        value, low, high = (_where(self.level, each, aim) for each in self._rates())
        if not (aim <= self.without_demand and math.isfinite(self.rate[0])):
            value, high = (each or math.nan for each in (value, high))
        if not (math.isfinite(value) and value):
            return value, low, high, math.nan
        places = np.flatnonzero(np.isfinite(self.rate))
        near = places[np.argmin(np.abs(np.log(self.rate[places].clip(1e-300) / aim)))]
        return value, low, high, float(self.extrapolated[near])

    def _rates(self) -> tuple[Float, Float, Float]:
        return self.rate, self.low, self.high


def _where(level: Float, rate: Float, aim: float) -> float:
    """Return the level that is reached at a rate, straight between the points in log-log.

    It is 0 if all levels that have a rate are reached more rarely.
    """
    is_finite = np.isfinite(rate)
    if not is_finite.any():
        return math.nan
    level, rate = level[is_finite], rate[is_finite]
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
    without_demand: float = math.inf,
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
    without_demand : float
        Least intensity that was tried and has no demand, where the first level is the smallest
        demand; infinite if there is none.

    Raises
    ------
    ParameterError
        If the levels are not positive and increasing.

    Notes
    -----
    The rate of reaching d is the integral of P(D >= d | x) over the rates of the intensities x, as
    of `overturning_rate`. If D is lognormal about c x^b with the deviation s, and the rates are
    k x^-a, it is k (d/c)^(-a/b) exp((a s / b)^2 / 2).

    Motions below the first point of the curve do not count in the rate. The upper bound counts
    those down to a tenth of it, if the curve continues with the slope with which it begins.
    """
    levels = np.asarray(level, dtype=np.float64)
    if not (levels.size and (levels > 0.0).all() and (np.diff(levels) > 0.0).all()):
        raise ParameterError("Invalid levels of a demand. Must be positive and increasing.")
    below = _continued(curve)
    fragilities = [fragility_of(float(each)) for each in levels]
    rates = [overturning_rate(curve, each) for each in fragilities]
    rate, low, high, extrapolated = (
        np.array([getattr(each, name) for each in rates])
        for name in ("rate", "low", "high", "extrapolated")
    )
    lacking = np.array([overturning_rate(below, each).contributions[0] for each in fragilities])
    lacking = np.where(np.isnan(lacking), 0.0, lacking)
    high = high + lacking
    with np.errstate(invalid="ignore"):  # a rate of 0 has no share
        extrapolated = (extrapolated * rate + lacking) / (rate + lacking)
    # A higher level is not reached more often; fits of few motions may differ from this slightly.
    falling = np.minimum.accumulate(np.where(np.isnan(rate), np.inf, rate))
    rate = np.where(np.isnan(rate), np.nan, falling)
    bounds = (np.minimum.accumulate(low), np.minimum.accumulate(high))
    often = curve.rate_of(max(without_demand, float(curve.intensity[0])))
    return DemandHazard(
        *(levels, rate, *bounds, extrapolated),
        most_frequent=float(curve.rate[0]),
        without_demand=float(np.nan_to_num(often)),
    )


def _continued(curve: HazardCurve) -> HazardCurve:
    """Return the curve below its first point, with the slope with which it begins."""
    logs = np.log(curve.rate[:2]), np.log(curve.intensity[:2])
    slope = float(np.diff(logs[0])[0] / np.diff(logs[1])[0])
    first, often = curve.intensity[0], curve.rate[0]
    intensity = np.array([_CONTINUED * first, first])
    return HazardCurve(curve.measure, intensity, np.array([often * _CONTINUED**slope, often]))


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
        Largest demand in each scenario, infinite where the structure overturns, and 0 where it
        does not uplift.
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
        unknown = {name: np.full(len(return_periods), np.nan) for name in names}
        has_peaks = not np.isnan(
            peaks
        ).all()  # a structure without the quantity has no bound either
        return unknown | ({"low": np.zeros(len(return_periods))} if has_peaks else {})
    levels = np.append(np.unique(np.geomspace(finite.min(), finite.max(), _LEVELS)), np.inf)

    def fragility_of(level: float) -> Fragility:
        return fit_fragility(*intensities, (peaks >= level).mean(axis=-1), clusters, curve=form)

    tried = np.outer(*intensities)[(peaks == 0.0).all(axis=-1)]
    least = float(tried[tried > 0.0].min(initial=math.inf))
    demand = demand_hazard(curve, levels, fragility_of, least)
    demands = np.array([demand.at(period) for period in return_periods])
    return dict(zip(names, demands.T, strict=True))
