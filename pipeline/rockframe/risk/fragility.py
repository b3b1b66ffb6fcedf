"""Limit states, and the probability that they are exceeded as a function of intensity."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.notebook import Shown
from rockframe.quantities import LIMITED, QUANTITIES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]


@dataclass(frozen=True)
class LimitState:
    """A state that a structure reaches when it overturns, or when a peak reaches a limit.

    Parameters
    ----------
    quantity : str
        One of `quantities.LIMITED`, or empty for overturning.
    value : float
        The limit, in SI units.

    Examples
    --------
    >>> LimitState("peak_u", 0.2).name, LimitState("peak_u", 0.2).words, OVERTURNING.name
    ('peak_u_0.2m', 'u ≥ 0.2 m', 'overturning')
    """

    quantity: str
    value: float

    @property
    def name(self) -> str:
        """Name in datasets and tables."""
        if not self.quantity:
            return "overturning"
        return f"{self.quantity}_{self.value:g}{QUANTITIES[self.quantity].suffix.removeprefix('_')}"

    @property
    def words(self) -> str:
        """Name in figures."""
        if not self.quantity:
            return self.name
        quantity = QUANTITIES[self.quantity]
        return f"{quantity.symbol} ≥ {self.value:g} {quantity.si_unit}".rstrip()

    @classmethod
    def named(cls, name: str) -> LimitState:
        """Return the limit state with a name.

        Examples
        --------
        >>> LimitState.named("peak_rotation_ratio_0.5")
        LimitState(quantity='peak_rotation_ratio', value=0.5)
        """
        for quantity in (limited.name for limited in LIMITED):
            if name.startswith(f"{quantity}_"):
                return cls(quantity, float(name.removeprefix(f"{quantity}_").rstrip("m_s")))
        return OVERTURNING

    def reached(
        self, peaks: Mapping[str, NDArray[Any]], overturned: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return True for each scenario that reaches the limit state.

        Parameters
        ----------
        peaks : mapping of str to array
            The quantities of `quantities.LIMITED` by name, for each scenario.
        overturned : array of bool
            True for scenarios that overturn.
        """
        if not self.quantity:
            return overturned
        return np.asarray(overturned | (peaks[self.quantity] >= self.value))


#: The limit state of overturning, which is always included.
OVERTURNING: Final = LimitState("", 0.0)


class Outcome(IntEnum):
    """Result of a fit: the values of the flag variable `fragility_outcome`.

    Here, overturning means reaching the limit state of the fit.
    """

    FITTED = 0
    NONE_OVERTURN = 1
    ALL_OVERTURN = 2
    SEPARATED = 3
    NOT_RISING = 4
    UNKNOWN = 5
    ABSENT = 6
    UNDETERMINED = 7

    @property
    def sentence(self) -> str:
        """Outcome in words, for overturning."""
        return self.sentence_of("")

    def sentence_of(self, limit: str) -> str:
        """Return the outcome in words for a limit such as ``u ≥ 0.2 m``; "" for overturning."""
        words = {"reaches": "overturns it", "reach": "overturn", "state": "overturning"}
        if limit:
            words = {"reaches": f"reaches {limit}", "reach": f"reach {limit}", "state": limit}
        return _SENTENCES[self].format(**words)


_SENTENCES: Final = {
    Outcome.FITTED: "fitted by maximum likelihood",
    Outcome.NONE_OVERTURN: "no motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.ALL_OVERTURN: "every motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.SEPARATED: "all that {reach} are stronger than all that do not: the likelihood has no "
    "maximum, and the curve is a step somewhere between the two",
    Outcome.NOT_RISING: "{state} does not become more frequent with this measure",
    Outcome.UNKNOWN: "the measure is not known, or is the same for all motions",
    Outcome.ABSENT: "the structure has no such restraint",
    Outcome.UNDETERMINED: "not determined by these data",
}


def determined(
    median: ArrayLike, beta_high: ArrayLike, lowest: ArrayLike, highest: ArrayLike
) -> NDArray[np.bool_]:
    """Return True for each curve that its data determine.

    The probability must rise with the intensity at 90 % confidence, two-sided, so that the upper
    bound of the lognormal beta is finite. Only then is the confidence interval of the median
    bounded, too (Fieller's theorem; Finney's g below 1). The median must also be one of the
    intensities tried: elsewhere only the assumed form of the curve states where half of the
    motions reach the limit.

    Parameters
    ----------
    median, beta_high : array_like
        Median, and upper 90 % bound of the lognormal beta [1]; infinite or NaN if there is none.
    lowest, highest : array_like
        Range of the intensities tried, in the unit of the median.

    References
    ----------
    Fieller (1954), Some problems in interval estimation, Journal of the Royal Statistical Society
    B 16(2), 175-185. Finney (1971), Probit analysis, 3rd edition, Cambridge, chapter 4.

    Examples
    --------
    >>> determined([0.4, 5.3, 0.4], [0.6, 0.6, math.inf], 0.05, 0.66).tolist()
    [True, False, False]
    """
    within = (np.asarray(lowest) <= median) & (median <= np.asarray(highest))
    return np.asarray(within & np.isfinite(beta_high))


def why_undetermined(median: float, lowest: float, highest: float, unit: str = "") -> str:
    """Return the reason why data do not determine a curve, in words.

    Examples
    --------
    >>> why_undetermined(5.3, 0.05, 0.66, "g")
    'not determined by these data: the fit has its median at 5.3 g, outside 0.05 to 0.66 g as tried'
    """
    space = unit and f" {unit}"
    tried = f"{lowest:.3g} to {highest:.3g}{space} as tried"
    why = f"the fit has its median at {median:.3g}{space}, outside {tried}"
    if lowest <= median <= highest:
        why = "the lognormal β of the fit has no upper bound at 90 % confidence"
    return f"{Outcome.UNDETERMINED.sentence}: {why}"


#: Distribution of the logarithm of the intensity at overturning: normal or logistic.
Curve: TypeAlias = Literal["lognormal", "logistic"]

#: Confidence level of the bands.
CONFIDENCE: Final = 0.9
#: Standard deviation of the logistic distribution of scale 1.
_UNIT: Final = math.pi / math.sqrt(3.0)
#: Intensities are equal up to this factor: exp(ln x) is not x to the last bits.
_EQUAL: Final = 1.0 + 1e-13
_WITHOUT_MAXIMUM: Final = (Outcome.NONE_OVERTURN, Outcome.ALL_OVERTURN, Outcome.SEPARATED)


@dataclass(frozen=True, eq=False, repr=False)
class Fragility(Shown):
    """Share of motions that overturn a structure, as a function of an intensity measure.

    P = F(intercept + slope ln x). F is the standard normal distribution for a lognormal curve (a
    probit model), and 1 / (1 + exp(-y)) for a logistic curve.

    Parameters
    ----------
    outcome : Outcome
        Result of the fit. There is a curve only if it is ``FITTED``, or ``UNDETERMINED`` (see
        `determined`): that curve is the one of maximum likelihood, but other data of the same kind
        would give quite another one. Otherwise its values are NaN.
    motions, observations, overturned : int
        Number of independent motions, of observations (motions times scales), and of observations
        that overturn, in at least one member if they are shares of an ensemble.
    lowest, highest : float
        Range of the intensities of the observations, in the unit of the measure.
    safe_to, overturned_from : float
        Strongest observation that stands, and weakest that overturns, each in at least one member.
    intercept, slope : float
        Coefficients of the argument of F over the logarithm of the intensity.
    covariance : array, shape (2, 2)
        Covariance of intercept and slope, with scales and azimuths of one motion as one cluster;
        NaN for one or two motions, or if the others do not determine a curve without one.
    stood, fell : array, shape (motions,)
        For each independent motion, the strongest intensity that is below all at which any of it
        overturns, and the weakest above all at which any of it stands; 0 and inf if there is none.
    log_likelihood : array, shape (motions,)
        Log-likelihood of each independent motion. If the verdicts are separated, the limit for
        steep curves: 0, except for motions at the step itself if some stand and others overturn.
    pseudo_r2, concordance, brier : float
        Goodness of fit: McFadden's 1 - ln L / ln L_0; the share of pairs (one overturns, one
        stands) in which the overturning motion is stronger; the mean squared error of P.
    curve : {"lognormal", "logistic"}
        The form of the curve.

    Examples
    --------
    >>> from rockframe.risk import fit_fragility
    >>> fit = fit_fragility([1.0, 2.0, 3.0], [1.0, 2.0], [[0, 0], [0, 1], [1, 1]])
    >>> fit.outcome.name, round(fit.median, 2)
    ('SEPARATED', nan)
    >>> fit = fit_fragility([1.0, 2.0, 3.0], [1.0, 2.0], [[0, 1], [0, 1], [0, 1]])
    >>> fit.outcome.name, round(fit.median, 2)
    ('UNDETERMINED', 2.57)
    """

    outcome: Outcome
    motions: int
    observations: int
    overturned: int
    lowest: float = math.nan
    highest: float = math.nan
    safe_to: float = math.nan
    overturned_from: float = math.nan
    intercept: float = math.nan
    slope: float = math.nan
    covariance: Float = field(default_factory=lambda: np.full((2, 2), np.nan))
    stood: Float = field(default_factory=lambda: np.empty(0), repr=False)
    fell: Float = field(default_factory=lambda: np.empty(0), repr=False)
    log_likelihood: Float = field(default_factory=lambda: np.empty(0), repr=False)
    pseudo_r2: float = math.nan
    concordance: float = math.nan
    brier: float = math.nan
    curve: Curve = "lognormal"

    def facts(self) -> dict[str, str]:
        """Return median, spread and counts, for the table in notebooks."""
        counts = {
            "motions": str(self.motions),
            "overturned": f"{self.overturned} of {self.observations}",
        }
        if self.outcome is Outcome.UNDETERMINED:
            return {"result": why_undetermined(self.median, self.lowest, self.highest), **counts}
        if self.outcome is not Outcome.FITTED:
            return {"result": self.outcome.sentence, **counts}
        (low, high), (least, most) = self.median_band, self.lognormal_beta_band
        return {
            "median": f"{self.median:.4g} ({low:.4g} to {high:.4g})",
            "lognormal β": f"{self.lognormal_beta:.3g} ({least:.3g} to {most:.3g})",
            "curve": self.curve,
            **counts,
        }

    def draw(self, axes: Axes) -> None:
        """Draw the curve with its 90 % confidence band; the band alone if data determine none."""
        if not math.isnan(self.lowest):
            x = np.geomspace(0.8 * self.lowest, 1.25 * self.highest, 101)
            axes.fill_between(x, *self.band(x), alpha=0.2, linewidth=0)
            if self.outcome is Outcome.UNDETERMINED:
                axes.set_title(self.outcome.sentence)
            else:
                axes.plot(x, self.probability(x))
            axes.set_xscale("log")
        axes.set(ylim=(0.0, 1.0), xlabel="intensity", ylabel="probability")

    def to_xarray(self) -> xr.Dataset:
        """Return the curve and its 90 % confidence band over the intensity."""
        import xarray as xr

        x = np.geomspace(0.8 * self.lowest, 1.25 * self.highest, 101)
        curves = {
            "probability": self.probability(x),
            "low": self.band(x)[0],
            "high": self.band(x)[1],
        }
        values = {name: ("intensity", curve, {"units": "1"}) for name, curve in curves.items()}
        return xr.Dataset(values, {"intensity": x}, {"outcome": self.outcome.name.lower()})

    @property
    def median(self) -> float:
        """Intensity at which half of the motions overturn."""
        if not self.slope > 0.0:
            return math.nan
        with np.errstate(over="ignore"):  # infinite if the curve is nearly level
            return float(np.exp(-self.intercept / self.slope))

    @property
    def lognormal_beta(self) -> float:
        """Standard deviation of ln x at overturning [1]: that of F over the slope."""
        return self._deviation / self.slope if self.slope > 0.0 else math.nan

    @property
    def logistic_scale(self) -> float:
        """Scale of the logistic distribution that has this standard deviation of ln x [1].

        A lognormal and a logistic curve with the same median and standard deviation differ by at
        most 0.023, but their tails differ by orders of magnitude.
        """
        return self.lognormal_beta / _UNIT

    @property
    def _deviation(self) -> float:
        """Standard deviation of F."""
        return 1.0 if self.curve == "lognormal" else _UNIT

    @property
    def median_band(self) -> tuple[float, float]:
        """90 % confidence bounds of the median, by the delta method; NaN without a covariance."""
        if not self.slope > 0.0:
            return math.nan, math.nan
        middle = -self.intercept / self.slope
        direction = np.array([1.0, middle]) / self.slope
        error = self._quantile * math.sqrt(direction @ self.covariance @ direction)
        with np.errstate(over="ignore"):  # few motions can leave it open to 0 or infinity
            low, high = np.exp([middle - error, middle + error]).tolist()
        return low, high

    @property
    def lognormal_beta_band(self) -> tuple[float, float]:
        """90 % confidence bounds of the lognormal beta [1], from those of the slope."""
        if not self.slope > 0.0:
            return math.nan, math.nan
        error = self._quantile * math.sqrt(self.covariance[1, 1])
        least, unit = self.slope - error, self._deviation
        return unit / (self.slope + error), math.inf if least <= 0.0 else unit / least

    @property
    def _quantile(self) -> float:
        return float(scipy.special.stdtrit(self.motions - 1, 0.5 * (1.0 + CONFIDENCE)))

    def probability(self, intensity: ArrayLike) -> Float:
        """Return the probability of overturning [1]; NaN without a curve."""
        return self._of(self.intercept + self.slope * np.log(np.asarray(intensity, np.float64)))

    def _of(self, argument: Float) -> Float:
        """Return F of an argument."""
        return np.asarray(distribution(self.curve)(argument))

    def band(self, intensity: ArrayLike) -> tuple[Float, Float]:
        """Return the 90 % confidence bounds of the probability [1].

        With a curve they follow from the covariance and Student's t. If no motion or every motion
        overturned, or the verdicts are separated, there is no curve. The upper bound then follows
        from the number of independent motions that stand at this intensity or above, and the lower
        bound from the number that overturn at this intensity or below: overturning is assumed not
        to become rarer with intensity. A motion of which only a part overturns at an intensity is
        in neither number there. Otherwise the bounds are 0 and 1, or NaN if the structure
        cannot reach the limit state (``ABSENT``).
        """
        x = np.asarray(intensity, dtype=np.float64)
        zeros, ones = np.zeros_like(x), np.ones_like(x)
        if self.slope > 0.0 and np.isfinite(self.covariance).all():
            terms = np.stack([ones, np.log(x)])
            variance = np.einsum("i...,ij,j...->...", terms, self.covariance, terms)
            error = self._quantile * np.sqrt(variance)
            middle = self.intercept + self.slope * terms[1]
            return self._of(middle - error), self._of(middle + error)
        if self.outcome in _WITHOUT_MAXIMUM:
            stand = self.stood.size - np.searchsorted(np.sort(self.stood) * _EQUAL, x)
            fall = np.searchsorted(np.sort(self.fell), x * _EQUAL, side="right")
            # where one motion stands and another overturns, neither bound applies
            low = np.where(stand > 0, zeros, 1.0 - _left_open(fall))
            return low, np.where(fall > 0, ones, _left_open(stand))
        return (np.full_like(x, np.nan),) * 2 if self.outcome is Outcome.ABSENT else (zeros, ones)


def distribution(curve: Curve) -> Callable[[Float], Float]:
    """Return the distribution function F of a curve: standard normal or logistic."""
    form: Callable[[Float], Float] = (
        scipy.special.ndtr if curve == "lognormal" else scipy.special.expit
    )
    return form


def _left_open(motions: NDArray[np.intp]) -> Float:
    """Return the upper bound of the probability of an event that none of the motions caused."""
    chance = 0.5 * (1.0 - CONFIDENCE)
    return np.where(motions > 0, 1.0 - chance ** (1.0 / np.maximum(motions, 1)), 1.0)
