"""Target spectra of ground-motion models, computed by OpenQuake: several models with weights."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Self

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field, model_validator

from rockframe.cells import decimal
from rockframe.errors import InputError
from rockframe.options.model import Options, rule
from rockframe.risk.hazard_files import table_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Parameters of models: the key of this package, and the name in OpenQuake.
_NAMES: Final = {
    "magnitude": "mag", "rake_degree": "rake", "dip_degree": "dip", "depth_to_top_km": "ztor",
    "hypocentral_depth_km": "hypo_depth", "rupture_width_km": "width",
    "distance_rrup_km": "rrup", "distance_rjb_km": "rjb", "distance_rx_km": "rx",
    "distance_ry0_km": "ry0", "distance_hypocentral_km": "rhypo",
    "epicentral_distance_km": "repi", "vs30_m_s": "vs30", "vs30_measured": "vs30measured",
    "z1_0_m": "z1pt0", "z2_5_km": "z2pt5", "backarc": "backarc", "region": "region",
    "distance_volcanic_front_km": "xvf",
}  # fmt: skip
#: Columns of a disaggregation by magnitude and distance.
_MAG_DIST: Final = ("imt", "iml", "poe", "mag", "dist")
#: Largest relative difference of the disaggregated acceleration from the stated one.
_SAME_LEVEL: Final = 0.02
#: Largest difference of a dip from the vertical [degree].
_UPRIGHT: Final = 0.01
_SA: Final = re.compile(r"SA\((\d*\.?\d+)\)")

_Distance = Annotated[float, Field(ge=0.0, le=2000.0)]
_Depth = Annotated[float, Field(ge=0.0, le=800.0)]
_Weight = Annotated[float, Field(gt=0.0, lt=math.inf)]


class GroundMotionModels(Options):
    """Ground-motion models with weights, and the scenario for which they are evaluated.

    Examples
    --------
    >>> GroundMotionModels(models={"BooreEtAl2014": 1.0}, magnitude=6.5).stated_numbers()
    {'mag': 6.5}
    """

    models: Annotated[dict[str, _Weight], Field(min_length=1)]
    magnitude: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    disaggregation: str | None = None
    distance_rrup_km: _Distance | None = None
    distance_rjb_km: _Distance | None = None
    distance_rx_km: Annotated[float, Field(ge=-2000.0, le=2000.0)] | None = None
    distance_ry0_km: _Distance | None = None
    distance_hypocentral_km: _Distance | None = None
    epicentral_distance_km: _Distance | None = None
    rake_degree: Annotated[float, Field(ge=-180.0, le=180.0)] | None = None
    dip_degree: Annotated[float, Field(gt=0.0, le=90.0)] | None = None
    depth_to_top_km: _Depth | None = None
    hypocentral_depth_km: _Depth | None = None
    rupture_width_km: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    vs30_m_s: Annotated[float, Field(gt=0.0, le=5000.0)] | None = None
    vs30_measured: bool | None = None
    z1_0_m: Annotated[float, Field(ge=0.0, le=20_000.0)] | None = None
    z2_5_km: Annotated[float, Field(ge=0.0, le=20.0)] | None = None
    backarc: bool | None = None
    region: Annotated[int, Field(ge=0, le=1000)] | None = None
    distance_volcanic_front_km: Annotated[float, Field(ge=-2000.0, le=2000.0)] | None = None
    scale: Annotated[float, Field(gt=0.0, lt=100.0)] = 1.0

    @model_validator(mode="after")
    def _one_scenario(self) -> Self:
        if (self.magnitude is None) == (self.disaggregation is None):
            both = "both stated" if self.magnitude is not None else "both missing"
            raise rule(f"magnitude and disaggregation are {both}. State one of them")
        if self.disaggregation is not None and self.distance_rrup_km is not None:
            raise rule("disaggregation has the distances. Remove distance_rrup_km")
        return self

    def stated_numbers(self) -> dict[str, float]:
        """Return the stated parameters by their names in OpenQuake."""
        values = {own: getattr(self, name) for name, own in _NAMES.items()}
        return {own: float(value) for own, value in values.items() if value is not None}


@dataclass(frozen=True, eq=False)
class Mixture:
    """Normal distributions of ln Sa with weights: models in scenarios.

    Parameters
    ----------
    mean, deviation : array, shape (models, scenarios, periods)
        Mean [ln m s-2] and standard deviation [1] of ln Sa.
    weight : array, shape (models, scenarios)
        Weights, which add up to 1.
    words : str
        The models in words.
    """

    mean: Float
    deviation: Float
    weight: Float
    words: str

    def moments(self, correlation: Float) -> tuple[Float, Float]:
        """Return mean and covariance of ln Sa over all models and scenarios.

        Parameters
        ----------
        correlation : array, shape (periods, periods)
            Correlation of ln Sa within a model [1].

        Notes
        -----
        The covariance is the mean of those within the models and that of their means (law of total
        covariance).
        """
        return _moments(self.mean, self.deviation, correlation, self.weight)

    def given(self, place: int, log_sa: float, correlation: Float) -> tuple[Float, Float, float]:
        """Return mean and covariance of ln Sa if it has a value at one period, and the mean of the
        standard deviations by which this value exceeds the means.

        Parameters
        ----------
        place : int
            Number of the period.
        log_sa : float
            The value [ln m s-2].
        correlation : array, shape (periods, periods)
            Correlation of ln Sa within a model [1].

        Notes
        -----
        Within a scenario, a model counts by its weight times the probability with which it exceeds
        the value there, as a disaggregation does.

        References
        ----------
        Lin, Harmsen, Baker and Luco (2013), Conditional spectrum computation incorporating multiple
        causal earthquakes and ground-motion prediction models, BSSA 103(2A), 1103-1116.
        """
        epsilon = (log_sa - self.mean[:, :, place]) / self.deviation[:, :, place]
        exceeding = self.weight * scipy.special.ndtr(-epsilon)
        scenarios = self.weight.sum(axis=0) / np.maximum(exceeding.sum(axis=0), 1e-300)
        weight = exceeding * scenarios
        weight = weight / weight.sum()
        along = correlation[place]
        mean = self.mean + self.deviation * along * epsilon[:, :, None]
        within = correlation - np.outer(along, along)
        total, spread = _moments(mean, self.deviation, within, weight)
        return total, spread, float((weight * epsilon).sum())


def _moments(
    mean: Float, deviation: Float, correlation: Float, weight: Float
) -> tuple[Float, Float]:
    total = np.einsum("ms,msi->i", weight, mean)
    away = mean - total
    between = np.einsum("ms,msi,msj->ij", weight, away, away)
    within = np.einsum("ms,msi,msj->ij", weight, deviation, deviation) * correlation
    return total, within + between


def mixture_of(
    path: Path,
    models: GroundMotionModels,
    periods: Float,
    given: tuple[float, float] | None = None,
) -> Mixture:
    """Return the distributions of ln Sa that ground-motion models state.

    Parameters
    ----------
    path : Path
        File of the models: a disaggregation is in its folder.
    models : GroundMotionModels
        Models, weights and scenario.
    periods : array, shape (periods,)
        Periods [s].
    given : (float, float), optional
        Period [s] and acceleration [m s-2] of which the disaggregation is.

    Raises
    ------
    InputError
        If OpenQuake is not installed, a model is unknown, has no value at a period, or needs a
        parameter that is not stated; if the disaggregation cannot be read or is of another level.
    """
    scenarios, weight = _scenarios(path, models, given)
    names = list(models.models)
    shares = np.array([models.models[name] for name in names])
    moments, components = [], []
    for name in names:
        mean, deviation, component = _evaluated(path, name, scenarios, periods)
        moments.append((mean + math.log(models.scale * GRAVITY), deviation))
        components.append(component)
    mean, deviation = (np.array(each) for each in zip(*moments, strict=True))
    parts = [
        f"{share:.3g} {name}" for share, name in zip(shares / shares.sum(), names, strict=True)
    ]
    words = " + ".join(parts) if len(parts) > 1 else names[0]
    words += f", {', '.join(dict.fromkeys(components))}"
    words = words if models.scale == 1.0 else f"{models.scale:g} times {words}"
    return Mixture(mean, deviation, np.outer(shares / shares.sum(), weight), words)


def disaggregation_of(path: Path, models: GroundMotionModels) -> Path | None:
    """Return the file of the disaggregation; None without one."""
    return None if models.disaggregation is None else path.parent / models.disaggregation


def _scenarios(
    path: Path, models: GroundMotionModels, given: tuple[float, float] | None
) -> tuple[dict[str, Float], Float]:
    """Return the parameters of each scenario by name, and their weights."""
    numbers = models.stated_numbers()
    file = disaggregation_of(path, models)
    if file is None:
        scenarios, weight = {own: np.array([value]) for own, value in numbers.items()}, np.ones(1)
    else:
        magnitude, distance, weight = _disaggregated(file, given)
        scenarios = {own: np.full(weight.size, value) for own, value in numbers.items()}
        scenarios |= {"mag": magnitude, "rrup": distance}
    upright = abs(numbers.get("dip", 0.0) - 90.0) <= _UPRIGHT
    if upright and "rrup" in scenarios and "ztor" in scenarios:
        # a site abeam of a vertical fault
        along = np.sqrt(np.maximum(scenarios["rrup"] ** 2 - scenarios["ztor"] ** 2, 0.0))
        scenarios = {"rjb": along, "rx": along, "ry0": np.zeros_like(along)} | scenarios
    return scenarios, weight


def _disaggregated(file: Path, given: tuple[float, float] | None) -> tuple[Float, Float, Float]:
    """Return magnitude, distance [km] and weight of each bin of a disaggregation of OpenQuake.

    A bin counts by its rate; its probability is that of exceedance within some years.
    """
    lines, header, _ = table_of(file)
    if header[:5] != [*_MAG_DIST] or len(header) != 6:
        shown = ", ".join(header)[:80] or "missing"
        must = f"Must be {', '.join(_MAG_DIST)} and a probability, as Mag_Dist of OpenQuake"
        raise InputError(file, f"columns {shown}. {must}.", lines[0][0] if lines else 1)
    levels: dict[tuple[str, float], list[tuple[float, float, float]]] = {}
    for line, row in lines[1:]:
        try:
            level, magnitude, distance, probability = (decimal(row[k]) for k in (1, 3, 4, 5))
        except (ValueError, IndexError):
            message = f"{', '.join(row)[:80]!r}. Must be a measure and five numbers."
            raise InputError(file, message, line) from None
        if not 0.0 <= probability < 1.0:
            message = f"{header[5]} {probability:g}. Must be a probability below 1."
            raise InputError(file, message, line)
        levels.setdefault((row[0], level), []).append(
            (magnitude, distance, -math.log1p(-probability))
        )
    rows = np.array(_of_level(file, levels, given)).T
    if not rows[2].sum() > 0.0:
        raise InputError(file, "no bin with a probability above 0. Must be one or more.")
    magnitude, distance, rate = rows[:, rows[2] > 0.0]
    return magnitude, distance, rate / rate.sum()


def _of_level(
    file: Path,
    levels: Mapping[tuple[str, float], Sequence[Any]],
    given: tuple[float, float] | None,
) -> Sequence[Any]:
    """Return the bins of the level that is stated, or of the only one."""
    shown = ", ".join(f"{imt} = {level:.4g} g" for imt, level in levels) or "none"
    if given is None:
        if len(levels) != 1:
            message = f"has {len(levels)} levels ({shown}). Must be one, or that of"
            raise InputError(file, f"{message} --conditioning-period-s and --conditioning-sa-g.")
        return next(iter(levels.values()))
    period, level = given[0], given[1] / GRAVITY
    for (imt, other), bins in levels.items():
        match = _SA.fullmatch(imt)
        same = match is not None and math.isclose(float(match[1]), period, rel_tol=1e-6)
        if same and math.isclose(other, level, rel_tol=_SAME_LEVEL):
            return bins
    message = f"is of {shown}. Must be of SA({period:g}) = {level:.4g} g, on which the spectrum is"
    raise InputError(file, f"{message} conditional.")


def _evaluated(
    path: Path, name: str, scenarios: Mapping[str, Float], periods: Float
) -> tuple[Float, Float, str]:
    """Return mean [ln g] and standard deviation of ln Sa, shape (scenarios, periods), and the
    component of the model.
    """
    try:
        from openquake.hazardlib import valid  # an extra; the import takes seconds
        from openquake.hazardlib.contexts import simple_cmaker
        from openquake.hazardlib.gsim import get_available_gsims
    except ImportError as error:
        message = f"ground-motion models need OpenQuake ({error}). Install openquake-engine"
        raise InputError(path, f"{message}, or state the spectrum as CSV.") from None
    if name not in get_available_gsims():
        message = f"model {name[:80]!r}. Must be a model of OpenQuake, such as {_LIKE}."
        raise InputError(path, message)
    try:
        model = valid.gsim(name)
        needed = _needed(path, name, model, scenarios)
        maker = simple_cmaker([model], [f"SA({period:.10g})" for period in periods])
        mean, deviation = _of_maker(maker, needed, scenarios, periods.size)
    except _FAILURES as error:
        said = " ".join(str(error).split())[:100]
        message = f"{name} cannot be computed at these periods ({type(error).__name__}: {said})"
        raise InputError(path, f"{message}. State others, or the spectrum as CSV.") from None
    if not (np.isfinite(mean).all() and (deviation > 0.0).all()):
        raise InputError(path, f"{name} has no finite spectrum for this scenario.")
    component = model.DEFINED_FOR_INTENSITY_MEASURE_COMPONENT
    return mean, deviation, str(getattr(component, "value", "component not stated"))


def _of_maker(
    maker: Any, needed: Collection[str], scenarios: Mapping[str, Float], periods: int
) -> tuple[Float, Float]:
    """Return mean [ln g] and standard deviation, shape (scenarios, periods); OpenQuake takes the
    scenarios of one magnitude together.
    """
    mean, deviation = np.empty((2, scenarios["mag"].size, periods))
    for magnitude in np.unique(scenarios["mag"]):
        rows = np.flatnonzero(scenarios["mag"] == magnitude)
        context = maker.new_ctx(rows.size)
        for own in {*needed} & {*context.dtype.names}:
            context[own] = scenarios[own][rows]
        values = maker.get_mean_stds([context])[:2, 0]  # mean and total, shape (periods, rows)
        mean[rows], deviation[rows] = values[0].T, values[1].T
    return mean, deviation


def _needed(path: Path, name: str, model: Any, scenarios: Mapping[str, Float]) -> set[str]:
    """Return the parameters that a model needs, which must be stated."""
    needed = {
        *model.REQUIRES_RUPTURE_PARAMETERS,
        *model.REQUIRES_DISTANCES,
        *model.REQUIRES_SITES_PARAMETERS,
    }
    keys = {own: key for key, own in _NAMES.items()}
    unstated = sorted(needed - {*scenarios})
    other = [own for own in unstated if own not in keys]
    if other:
        message = f"{name} needs {', '.join(other)}, for which there is no key"
        raise InputError(path, f"{message}. Choose another model, or state the spectrum as CSV.")
    if unstated:
        missing = ", ".join(sorted(keys[own] for own in unstated))
        raise InputError(path, f"{name} needs {missing}. State them.")
    return needed


#: Errors of models of OpenQuake that need more than the parameters of a scenario.
_FAILURES: Final = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, NotImplementedError),
    *(OSError, RuntimeError, TypeError, ValueError),
)
#: Examples of models.
_LIKE: Final = "BooreEtAl2014 or AkkarEtAlRjb2014"
