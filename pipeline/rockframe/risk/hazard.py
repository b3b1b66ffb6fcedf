"""The hazard curve of a site, and the mean annual rate of overturning.

Hazard studies publish annual rates, or probabilities in a time such as 50 years, and a column
named for one may contain the other. `read_hazard` rejects rates that no site has, and a curve that
stays just below 1, as probabilities do. Small probabilities cannot be told from rates.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal, read_rows
from rockframe.errors import InputError, ParameterError
from rockframe.risk.fragility import Fragility
from rockframe.risk.measures import MEASURES, Measure

Float = NDArray[np.float64]

#: Column of the annual rates.
_RATE: Final = "annual_rate"
#: A curve contains probabilities if it starts between `_NEAR_ONE` and 1 and falls with a smaller
#: power of the intensity than `_LEVEL`. Rates level off too, but seldom just below once a year.
_NEAR_ONE: Final = 0.9
_LEVEL: Final = 0.5
#: Largest possible rates fall with this power of the intensity, from once a year at
#: `Measure.yearly`. They are several times the rates at the most active sites.
_FALL: Final = 2.0
_CONVERT: Final = "Probabilities P in t years are rates of -ln(1 - P) / t."
#: Integration cells per segment of the curve.
_CELLS: Final = 256


@dataclass(frozen=True, eq=False)
class HazardCurve:
    """Annual rates of exceedance at a site, with a power law between the points.

    Parameters
    ----------
    measure : str
        Name of the measure: one of `MEASURES`.
    intensity : array, shape (points,)
        Increasing, in SI units.
    rate : array, shape (points,)
        Annual rates of exceedance [1/year], decreasing.

    Raises
    ------
    ParameterError
        If there are fewer than two points, or they break one of these rules.

    Examples
    --------
    >>> curve = HazardCurve("pgv", np.array([0.1, 1.0]), np.array([1e-2, 1e-4]))
    >>> float(curve.rate_of(0.316).round(5))
    0.001
    """

    measure: str
    intensity: Float
    rate: Float

    def __post_init__(self) -> None:
        for name in ("intensity", "rate"):
            values = getattr(self, name)
            if values.ndim != 1 or values.size < 2:
                raise ParameterError(
                    f"Invalid hazard curve of {values.size} points. Must be two or more."
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
        """Return the annual rate at which intensities within the curve are exceeded [1/year]."""
        logs = np.interp(np.log(intensity), np.log(self.intensity), np.log(self.rate))
        return np.asarray(np.exp(logs))


@dataclass(frozen=True, eq=False)
class OverturningRate:
    """Mean annual rate of overturning, and the contribution of each intensity.

    Parameters
    ----------
    rate, low, high : float
        Mean annual rate [1/year], NaN without a fragility curve, and its bounds.
    contributions : array, shape (points,)
        Contribution of the motions between each point of the hazard curve and the next; the last
        one is that of motions above the curve [1/year].
    extrapolated : float
        Share of the rate from intensities outside the range tried [1].
    """

    rate: float
    low: float
    high: float
    contributions: Float
    extrapolated: float


def overturning_rate(curve: HazardCurve, fragility: Fragility) -> OverturningRate:
    """Return the mean annual rate of overturning, by integration over the hazard curve.

    Motions above the last point of the curve overturn with the probability at that point; in the
    upper bound all of them overturn. Motions below the first point are not counted, because the
    curve does not state how frequent they are.

    Parameters
    ----------
    curve : HazardCurve
        Hazard curve of the site.
    fragility : Fragility
        Fragility over the same measure.

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
    steps = (np.arange(_CELLS) + 0.5) / _CELLS
    middle = np.exp(logs[:-1, None] + np.diff(logs)[:, None] * steps)
    ends = np.linspace(0.0, 1.0, _CELLS + 1)
    falling = np.log(curve.rate)
    exceeded = np.exp(falling[:-1, None] + np.diff(falling)[:, None] * ends)
    often = -np.diff(exceeded, axis=1)
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


def read_hazard(path: Path) -> HazardCurve:
    r"""Read a hazard curve: CSV with the columns ``annual_rate`` and one measure of intensity.

    Parameters
    ----------
    path : Path
        CSV file with the columns `annual_rate` and one of pga_g, pgv_m_s, a_p_g, L_p_m.

    Raises
    ------
    InputError
        If it cannot be read, has other columns, a value that is no number, or is not a curve; if
        an intensity is larger than any, a rate higher than at any site, or the rates are level
        near 1.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.csv")
    ...     _ = path.write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    ...     read_hazard(path).measure
    'pga'
    """
    columns = {measure.column: measure for measure in MEASURES.values()}
    must_be = f"Must be {_RATE} and one of {', '.join(columns)}."
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(read_rows(stream))
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"not a table ({error}). Must be CSV in UTF-8.") from None
    first, names = lines[0] if lines else (1, [])
    header = [name.strip() for name in names]
    known = [name for name in header if name in columns]
    if len(header) != 2 or len(known) != 1 or _RATE not in header:
        raise InputError(path, f"columns {', '.join(header) or 'missing'}. {must_be}", line=first)
    measure = columns[known[0]]
    order = header.index(measure.column), header.index(_RATE)
    points = [tuple(_numbers(path, row, line)[i] for i in order) for line, row in lines[1:]]
    for (line, _), (intensity, rate) in zip(lines[1:], points, strict=True):
        _require_possible(path, line, measure, intensity, rate)
    values = np.array(points).reshape(-1, 2)
    _refuse_probabilities(path, values)
    try:
        return HazardCurve(measure.name, values[:, 0] * measure.printed, values[:, 1])
    except ParameterError as error:
        raise InputError(path, str(error)) from None


def _require_possible(
    path: Path, line: int, measure: Measure, intensity: float, rate: float
) -> None:
    if intensity > measure.largest:
        message = f"{measure.column} {intensity:g}. Must be at most {measure.largest:g}."
        raise InputError(path, message, line=line)
    if intensity > 0.0 and rate * (intensity / measure.yearly) ** _FALL > 1.0:
        most = (measure.yearly / intensity) ** _FALL
        raise InputError(
            path,
            f"{_RATE} {rate:g} at {measure.column} {intensity:g}. Must be at most {most:.2g}: the "
            f"most active sites have less. {_CONVERT}",
            line=line,
        )


def _refuse_probabilities(path: Path, values: Float) -> None:
    """Reject a curve that starts just below 1 and stays there."""
    if len(values) < 2 or not (values[:2] > 0.0).all():
        return
    (weak, often), (strong, less) = values[:2]
    if _NEAR_ONE <= often <= 1.0 and often / less < (strong / weak) ** _LEVEL:
        raise InputError(
            path,
            f"{_RATE} {often:g}, then {less:g}: level near 1, as probabilities in many years are. "
            f"Must be rates. {_CONVERT}",
        )


def _numbers(path: Path, row: list[str], line: int) -> list[float]:
    try:
        numbers = [decimal(cell) for cell in row]
    except ValueError:
        numbers = []
    if len(numbers) != 2:
        raise InputError(path, f"{', '.join(row)!r}. Must be two numbers.", line=line)
    return numbers
