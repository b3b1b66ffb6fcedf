"""The hazard curve of a site, its readers, and the mean annual rate of overturning."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.cells import decimal, read_rows
from rockframe.errors import InputError, ParameterError
from rockframe.risk.fragility import Fragility
from rockframe.risk.measures import COLUMNS, MEASURES, Measure, measure_of_column, spectral

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


Lines = list[tuple[int, list[str]]]

#: Column of the annual rates, and of probabilities in a number of years.
_RATE: Final = "annual_rate"
_PROBABILITY: Final = re.compile(r"probability_in_(\d+(?:\.\d+)?)_years?")
#: A curve contains probabilities if it starts between `_NEAR_ONE` and 1 and falls with a smaller
#: power of the intensity than `_LEVEL`. Rates may level off too, but seldom just below 1 per year.
_NEAR_ONE: Final = 0.9
_LEVEL: Final = 0.5
#: The largest accepted rate is once a year at `Measure.yearly`, and falls with this power of the
#: intensity. It is several times the rate at the most active sites.
_FALL: Final = 2.0
_CONVERT: Final = (
    "If these are probabilities in 50 years, name the column probability_in_50_years: they are "
    "then converted"
)
#: Headings of the USGS hazard tools, in lower case.
_USGS: Final = re.compile(r"annual (frequency|rate) of exceed[ae]nce", re.IGNORECASE)
_GROUND_MOTION: Final = re.compile(r"ground motion \(g\)", re.IGNORECASE)
#: Names of measures in OpenQuake files, and in names of folders and files of the USGS.
_IMT: Final = re.compile(r"PGA|PGV|SA\((\d*\.?\d+)\)|SA(\d+)P(\d+)")
_NAMED: Final = re.compile(r"(?<![A-Za-z0-9])(?:PGA|PGV|SA\d+P\d+)(?![A-Za-z0-9])")
_VELOCITY: Final = 0.01  # both have velocities in cm/s
#: Number of characters of an invalid row that messages show.
_SHOWN: Final = 80
#: Largest distance of a site from the requested place, and the earth's radius [km].
_NEAR, _EARTH = 1.0, 6371.0


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of a curve in a file: intensities in the unit of the measure's column, and rates or
    probabilities.

    `years` is the time of the probabilities, or 0 for annual rates.
    """

    measure: Measure
    lines: Sequence[int]
    intensity: Float
    values: Float
    years: float = 0.0


def read_hazard(path: str | Path, site: tuple[float, float] | None = None) -> HazardCurve:
    r"""Read a hazard curve.

    Parameters
    ----------
    path : str or Path
        CSV of two columns, `annual_rate` or `probability_in_50_years` (or another number) and one
        of pga_g, pgv_m_s, a_p_g, L_p_m, sa_1s_g (or another period); or hazard curves of OpenQuake
        or of the USGS.
    site : (float, float), optional
        Longitude and latitude [degree]. The nearest site of the file, within 1 km, is read. It is
        not needed if the file has one site.

    Raises
    ------
    InputError
        If the file cannot be read, has other columns, invalid numbers or no curve; if an intensity
        or a rate is too large for any site, or the rates are level near 1; if no site is near, or
        the file has several sites and none is requested.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.csv")
    ...     _ = path.write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    ...     read_hazard(path).measure
    'pga'
    """
    path = Path(path)
    lines = _lines(path)
    comment = " ".join(lines[0][1]) if lines and lines[0][1][0].startswith("#") else ""
    lines = lines[1:] if comment else lines
    header = [name.strip() for name in lines[0][1]] if lines else []
    if "lon" in header and "lat" in header:
        return _curve(path, _at_site(path, lines, header, comment, site))
    if site is not None:
        raise InputError(path, "has no sites to choose from. Do not state a site for it.")
    return _curve(path, _of_two_columns(path, lines, header))


def _lines(path: Path) -> Lines:
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return list(read_rows(stream))
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"not a table ({error}). Must be CSV in UTF-8.") from None


def _of_two_columns(path: Path, lines: Lines, header: Sequence[str]) -> _Points:
    """Read a column of intensities and one of rates or probabilities."""
    line = lines[0][0] if lines else 1
    measures = [measure_of_column(name) for name in header]
    often = [i for i, name in enumerate(header) if _years(name) is not None]
    if len(header) == 2 and len(often) == 1 and _GROUND_MOTION.search(header[1 - often[0]]):
        measures[1 - often[0]] = _named_by(path)
    strong = [i for i, measure in enumerate(measures) if measure is not None]
    if len(header) != 2 or len(often) != 1 or len(strong) != 1:
        known = ", ".join((*COLUMNS, "sa_1s_g"))
        stated = ", ".join(header)[:_SHOWN] or "missing"
        raise InputError(path, f"columns {stated}. Must be {_RATE} and one of {known}.", line=line)
    measure, years = measures[strong[0]], _years(header[often[0]])
    assert measure is not None  # noqa: S101  `strong` has only such columns
    rows = np.array([_numbers(path, row, at) for at, row in lines[1:]]).reshape(-1, 2)
    return _Points(
        measure,
        [at for at, _ in lines[1:]],
        rows[:, strong[0]],
        rows[:, often[0]],
        years or 0.0,
    )


def _years(heading: str) -> float | None:
    """Return the years of a column of probabilities, 0 for rates, None for another column."""
    stated = _PROBABILITY.fullmatch(heading)
    if stated:
        return float(stated[1]) or None
    return 0.0 if heading == _RATE or _USGS.search(heading) else None


def _at_site(
    path: Path, lines: Lines, header: Sequence[str], comment: str, site: tuple[float, float] | None
) -> _Points:
    """Read the row of a site from a table of OpenQuake (``poe-0.1``) or the USGS (``0.1``)."""
    imt, years = re.search(r"imt=['\"]([^'\"]+)", comment), 0.0
    measure = _measure_of(path, imt[1], 1) if imt else _named_by(path)
    if imt:
        years = _investigation_time(path, comment, line=lines[0][0] - 1)
    columns = {i: _intensity(name, "poe-" if imt else "") for i, name in enumerate(header)}
    found = {i: level for i, level in columns.items() if level is not None}
    line, row = _nearest(path, lines, header, site)
    values = np.array([_cell(path, row, i, header[i], line) for i in found])
    unit = _VELOCITY if measure.name == "pgv" else 1.0  # m/s and g are the units of the columns
    return _Points(measure, [line] * len(found), np.array([*found.values()]) * unit, values, years)


def _investigation_time(path: Path, comment: str, line: int) -> float:
    """Return the years of the probabilities in a file of OpenQuake."""
    stated = re.search(r"investigation_time=([^,\s]*)", comment)
    text = stated[1] if stated else ""
    try:
        years = decimal(text)
    except ValueError:
        years = 0.0
    if not years > 0.0:
        what = f"investigation_time {text!r}" if stated else "no investigation_time"
        raise InputError(path, f"{what}. Must be a number of years above 0.", line=line)
    return years


def _intensity(heading: str, before: str) -> float | None:
    try:
        return decimal(heading.removeprefix(before)) if heading.startswith(before) else None
    except ValueError:
        return None


def _nearest(
    path: Path, lines: Lines, header: Sequence[str], site: tuple[float, float] | None
) -> tuple[int, list[str]]:
    """Return the row of the requested site, or of the only one."""
    places = []
    for line, row in lines[1:]:
        try:
            places.append((decimal(row[header.index("lon")]), decimal(row[header.index("lat")])))
        except (ValueError, IndexError):
            shown = ", ".join(row)[:_SHOWN]
            raise InputError(
                path, f"{shown!r} without longitude and latitude. Must be degrees.", line=line
            ) from None
    if site is None and len(places) != 1:
        raise InputError(path, f"has {len(places)} sites. Choose one with --hazard-site LON LAT.")
    if site is None:
        return lines[1]
    away = [_distance(site, place) for place in places] or [math.inf]
    best = int(np.argmin(away))
    if away[best] > _NEAR:
        there = f", at {places[best][0]:g} {places[best][1]:g}" if places else ""
        nearest = f"the site nearest to {site[0]:g} {site[1]:g} is {away[best]:.3g} km away{there}"
        raise InputError(path, f"{nearest}. Must be within {_NEAR:g} km.")
    return lines[1 + best]


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the distance between two places [km], by the haversine formula."""
    (x, y), (u, v) = ((math.radians(lon), math.radians(lat)) for lon, lat in (one, other))
    share = math.sin(0.5 * (v - y)) ** 2
    share += math.cos(y) * math.cos(v) * math.sin(0.5 * (u - x)) ** 2
    return 2.0 * _EARTH * math.asin(min(1.0, math.sqrt(share)))


def _measure_of(path: Path, imt: str, line: int | None = None) -> Measure:
    """Return the measure with this name in files of OpenQuake and the USGS."""
    stated = _IMT.fullmatch(imt)
    if stated is None:
        raise InputError(path, f"is of imt {imt!r}. Must be PGA, PGV or SA(T).", line)
    period = stated[1] or (f"{stated[2]}.{stated[3]}" if stated[2] else "")
    if not period:
        return MEASURES[imt.lower()]
    if not float(period) > 0.0:
        raise InputError(path, f"is of {imt}. The period must be above 0 s.", line)
    return spectral(float(period))


def _named_by(path: Path) -> Measure:
    """Return the measure that is part of the name of the file or of its folder."""
    for name in (path.stem, path.absolute().parent.name):
        stated = _NAMED.search(name.replace("_", "-"))
        if stated:
            return _measure_of(path, stated[0])
    raise InputError(
        path,
        "does not state its measure. The name of the file or of its folder must contain PGA, PGV "
        "or SA1P0 (1.0 s).",
    )


def _curve(path: Path, points: _Points) -> HazardCurve:
    """Return the curve of rates, without points that have no information."""
    measure, rates = points.measure, points.values
    printed = points.intensity
    if points.years:
        wrong = np.flatnonzero(~((rates >= 0.0) & (rates <= 1.0)))
        if wrong.size:
            message = f"probability {rates[wrong[0]]:g}. Must be from 0 to 1."
            raise InputError(path, message, line=points.lines[wrong[0]])
        with np.errstate(divide="ignore"):
            rates = -np.log1p(-rates) / points.years
    kept = np.ones(rates.size, dtype=bool)
    if points.years or len(set(points.lines)) < rates.size:  # written by a hazard program
        # probabilities 0 and 1 have no rate; of equal rates the largest intensity is kept
        kept = (rates > 0.0) & np.isfinite(rates) & (np.append(rates[1:], -1.0) != rates)
        if kept.sum() < 2:
            raise InputError(
                path,
                f"{kept.sum()} different rates at this site. Must be two or more.",
                line=points.lines[-1] if points.lines else 1,
            )
    for line, x, rate in zip(np.array(points.lines)[kept], printed[kept], rates[kept], strict=True):
        _require_possible(path, int(line), measure, float(x), float(rate))
    lines = np.array(points.lines, dtype=int)[kept]
    _require_monotone(path, lines, measure.column, printed[kept], rates[kept])
    if not points.years:
        _refuse_probabilities(path, lines, np.stack([printed[kept], rates[kept]], axis=1))
    return HazardCurve(measure.name, printed[kept] * measure.printed, rates[kept])


def _require_monotone(
    path: Path, lines: NDArray[np.int_], column: str, intensity: Float, rates: Float
) -> None:
    """Require two points or more, with increasing intensities and decreasing, positive rates."""
    if rates.size < 2:
        line = int(lines[-1]) if lines.size else 1
        raise InputError(path, f"{rates.size} points. Must be two or more.", line=line)
    for values, name, sign, must in (
        (intensity, column, 1.0, "larger"),
        (rates, _RATE, -1.0, "smaller"),
    ):
        wrong = np.flatnonzero(sign * np.diff(values) <= 0.0)
        if wrong.size:
            one, other = values[wrong[0] : wrong[0] + 2]
            raise InputError(
                path,
                f"{name} {other:g} after {one:g}. Must be {must}.",
                line=int(lines[wrong[0] + 1]),
            )
    if rates[-1] <= 0.0:
        raise InputError(path, f"{_RATE} {rates[-1]:g}. Must be above 0.", line=int(lines[-1]))


def _require_possible(
    path: Path, line: int, measure: Measure, intensity: float, rate: float
) -> None:
    if not 0.0 < intensity <= measure.largest:
        message = (
            f"{measure.column} {intensity:g}. Must be above 0 and at most {measure.largest:g}."
        )
        raise InputError(path, message, line=line)
    if rate * (intensity / measure.yearly) ** _FALL > 1.0:
        most = (measure.yearly / intensity) ** _FALL
        raise InputError(
            path,
            f"{_RATE} {rate:g} at {measure.column} {intensity:g}. Must be at most {most:.2g}: the "
            f"most active sites have less. {_CONVERT}.",
            line=line,
        )


def _refuse_probabilities(path: Path, lines: NDArray[np.int_], values: Float) -> None:
    """Reject a curve that starts just below 1 and stays there."""
    (weak, often), (strong, less) = values[:2]
    if _NEAR_ONE <= often <= 1.0 and often / less < (strong / weak) ** _LEVEL:
        raise InputError(
            path,
            f"{_RATE} {often:g}, then {less:g}: level near 1, as probabilities in many years are. "
            f"Must be rates. {_CONVERT}.",
            line=int(lines[1]),
        )


def _numbers(path: Path, row: list[str], line: int) -> list[float]:
    numbers = []
    with suppress(ValueError):
        numbers = [decimal(cell) for cell in row]
    if len(numbers) != 2:
        shown = ", ".join(row)[:_SHOWN]
        raise InputError(path, f"{shown!r}. Must be two numbers.", line=line)
    return numbers


def _cell(path: Path, row: list[str], index: int, column: str, line: int) -> float:
    """Return the number in a cell of the row of a site."""
    cell = row[index] if index < len(row) else ""
    try:
        return decimal(cell)
    except ValueError:
        message = f"column {column!r}: {cell[:_SHOWN]!r}. Must be a number."
        raise InputError(path, message, line=line) from None
