"""Target spectra: of files, OpenQuake, codes and ground-motion models, and conditional ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.cells import decimal
from rockframe.errors import InputError, ParameterError
from rockframe.risk.hazard_files import (
    has_uniform_spectra,
    read_uniform_spectrum,
    refuse_other_targets,
    table_of,
)
from rockframe.risk.hazard_sites import Site
from rockframe.risk.measures import spectral
from rockframe.selection.codes import PERIODS, Asce7, Eurocode8, read_target_file
from rockframe.selection.models import GroundMotionModels, disaggregation_of, mixture_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Range of the correlations [s].
CORRELATED: Final = (0.01, 10.0)
#: Columns of a file: period, median or mean of the logarithm, standard deviation of the logarithm.
_PERIOD, _MEDIAN, _MEAN, _DEVIATION = "period_s", "sa_g", "mean_ln_sa_g", "sigma_ln_sa"
#: Relative difference of periods that are equal.
_SAME: Final = 1e-6
#: Suffixes of files with parameters of a target.
_PARAMETERS: Final = (".toml", ".json")
#: Number of characters of a heading that messages show.
_SHOWN: Final = 80


@dataclass(frozen=True, eq=False)
class TargetSpectrum:
    """The spectrum that selected motions shall match: 5 % damped, of one horizontal component.

    Parameters
    ----------
    period : array, shape (periods,)
        Periods, increasing [s].
    log_sa : array, shape (periods,)
        Mean of the natural logarithm of the pseudo-spectral acceleration in m s-2.
    covariance : array, shape (periods, periods), optional
        Covariance of the logarithms [1]; None if no spread is stated.
    words : str
        The spectrum in words.
    conditioning_period : float
        Period at which the spectrum is given, so that its spread is zero there [s]; 0 without one.
    epsilon : float
        Standard deviations of the given acceleration above the mean of the ground-motion model.
    """

    period: Float
    log_sa: Float
    covariance: Float | None
    words: str
    conditioning_period: float = 0.0
    epsilon: float = math.nan

    @property
    def deviation(self) -> Float | None:
        """Standard deviation of the logarithm, shape (periods,); None if no spread is stated."""
        return None if self.covariance is None else np.sqrt(np.diag(self.covariance))

    def log_sa_at(self, period: float) -> float:
        """Return the mean of the logarithm at a period within the spectrum [ln m s-2]."""
        return float(np.interp(math.log(period), np.log(self.period), self.log_sa))


def correlation(periods: ArrayLike, others: ArrayLike) -> Float:
    """Return the correlation of ln Sa at two periods, shape (periods, periods).

    Parameters
    ----------
    periods, others : array_like
        Periods [s], from 0.01 to 10.

    Raises
    ------
    ParameterError
        If a period is outside this range.

    References
    ----------
    Baker and Jayaram (2008), Correlation of spectral acceleration values from NGA ground motion
    models, Earthquake Spectra 24(1), 299-317.

    Examples
    --------
    >>> correlation([0.1, 1.0], [1.0]).round(3).tolist()
    [[0.279], [1.0]]
    """
    first, second = (np.atleast_1d(np.asarray(x, dtype=np.float64)) for x in (periods, others))
    for period in (*first, *second):
        if not CORRELATED[0] <= period <= CORRELATED[1]:
            message = f"Invalid period {period:g} s. Must be from 0.01 to 10 s: Baker and Jayaram"
            raise ParameterError(f"{message} (2008) state correlations of spectra for these only.")
    low = np.minimum.outer(first, second)
    high = np.maximum.outer(first, second)
    long = 1.0 - np.cos(0.5 * np.pi - 0.366 * np.log(high / np.maximum(low, 0.109)))
    fall = 1.0 - 1.0 / (1.0 + np.exp(100.0 * np.minimum(high, 0.2) - 5.0))
    short = 1.0 - 0.105 * fall * (high - low) / (high - 0.0099)
    mixed = long + 0.5 * (np.sqrt(long) - long) * (1.0 + np.cos(np.pi * low / 0.109))
    mixed_or_short = np.where(high < 0.2, np.minimum(short, mixed), mixed)
    return np.asarray(np.where(high <= 0.109, short, np.where(low > 0.109, long, mixed_or_short)))


def read_target(
    path: Path,
    periods: Sequence[float] | None = None,
    given: tuple[float, float] | None = None,
    *,
    site: Site | None = None,
    probability: float | None = None,
) -> TargetSpectrum:
    r"""Read a target spectrum.

    Parameters
    ----------
    path : Path
        CSV with the columns ``period_s``, ``sa_g`` (the median) or ``mean_ln_sa_g``, and optionally
        ``sigma_ln_sa``; or uniform hazard spectra of OpenQuake; or the parameters of a design code
        or of ground-motion models (`read_target_file`).
    periods : sequence of float, optional
        Periods of the target [s]; by default those of the file. Between its periods, ln Sa and its
        standard deviation are linear in the logarithm of the period.
    given : (float, float), optional
        Period [s] and acceleration [m s-2] on which the spectrum is conditional; the file must
        contain the mean and the standard deviation of a ground-motion model.
    site, probability
        As for `read_uniform_spectrum`.

    Raises
    ------
    InputError
        If the file cannot be read, has invalid numbers, or does not cover the periods; if a
        conditional spectrum is requested and it has no standard deviation.
    ParameterError
        If a period with a standard deviation is outside the range of `correlation`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "model.csv")
    ...     _ = path.write_text("period_s,sa_g,sigma_ln_sa\n0.5,0.4,0.6\n1,0.2,0.6\n2,0.1,0.7\n")
    ...     target = read_target(path, given=(1.0, 0.2 * GRAVITY * np.exp(0.6)))
    >>> print(f"{target.epsilon:.3f}", target.deviation.round(3).tolist())
    1.000 [0.398, 0.0, 0.464]
    """
    is_code = path.suffix.lower() in _PARAMETERS
    parameters = read_target_file(path) if is_code else None
    if not is_code and has_uniform_spectra(path):
        spectrum = read_uniform_spectrum(path, site, probability, periods)
        table, words = np.stack([spectrum.period, np.log(spectrum.sa)], axis=1), spectrum.words
    else:
        if probability is not None or (site is not None and (site.place or site.name)):
            message = "has no sites and probabilities to choose from. Do not state them for it."
            raise InputError(path, message)
        if isinstance(parameters, GroundMotionModels):
            return _of_models(path, parameters, periods, given)
        table, words = (
            _of_code(path, periods, parameters) if parameters else (_read_table(path), "")
        )
    if given is not None and table.shape[1] < 3:
        message = f"no column {_DEVIATION}. A conditional spectrum needs the standard deviation of"
        raise InputError(path, f"{message} ln Sa that the ground-motion model states.")
    wanted = _with_period(np.array(sorted(periods) if periods else table[:, 0]), given)
    _require_cover(path, table[:, 0], wanted)
    log_sa, *deviation = (
        np.interp(np.log(wanted), np.log(table[:, 0]), column) for column in table.T[1:]
    )
    words = f"{path.name}{words and ', '}{words}"
    if not deviation:
        return TargetSpectrum(wanted, log_sa, None, words)
    covariance = correlation(wanted, wanted) * np.outer(deviation[0], deviation[0])
    target = TargetSpectrum(wanted, log_sa, covariance, words)
    return target if given is None else _given(path, target, *given)


def target_files(path: Path) -> list[Path]:
    """Return the files that a target is read from: its own, and the one that it names, if any."""
    if path.suffix.lower() != ".toml":
        return [path]
    parameters = read_target_file(path)
    if isinstance(parameters, Asce7) and parameters.design_maps is not None:
        return [path, path.parent / parameters.design_maps]
    if isinstance(parameters, GroundMotionModels):
        further = disaggregation_of(path, parameters)
        return [path, *([further] if further else [])]
    return [path]


def _of_code(
    path: Path, periods: Sequence[float] | None, code: Asce7 | Eurocode8
) -> tuple[Float, str]:
    """Return periods [s] and ln Sa [ln m s-2] of a design code as columns, and its name."""
    wanted = np.array(sorted(periods or PERIODS))
    sa, words = code.at(path, wanted)
    words = words if code.scale == 1.0 else f"{code.scale:g} times {words}"
    return np.stack([wanted, np.log(sa)], axis=1), words


def _of_models(
    path: Path,
    models: GroundMotionModels,
    periods: Sequence[float] | None,
    given: tuple[float, float] | None,
) -> TargetSpectrum:
    """Return the spectrum of ground-motion models, conditional if one is requested."""
    wanted = _with_period(np.array(sorted(periods or PERIODS)), given)
    mixture = mixture_of(path, models, wanted, given)
    correlated = correlation(wanted, wanted)
    words = f"{path.name}, {mixture.words}"
    if given is None:
        return TargetSpectrum(wanted, *mixture.moments(correlated), words)
    place = int(np.argmin(np.abs(wanted - given[0])))
    log_sa, covariance, epsilon = mixture.given(place, math.log(given[1]), correlated)
    covariance[place, :] = covariance[:, place] = 0.0  # without rounding
    words = _conditional(words, given, epsilon)
    return TargetSpectrum(wanted, log_sa, covariance, words, given[0], epsilon)


def _with_period(wanted: Float, given: tuple[float, float] | None) -> Float:
    """Return the periods, with that of the condition, if any."""
    if given is None or np.isclose(wanted, given[0], rtol=_SAME, atol=0.0).any():
        return wanted
    return np.sort(np.append(wanted, given[0]))


def _conditional(words: str, given: tuple[float, float], epsilon: float) -> str:
    sa = f"SA({given[0]:g} s) = {given[1] / GRAVITY:.4g} g"
    return f"{words}, given {sa} (ε = {epsilon:.2f})"


def _given(path: Path, target: TargetSpectrum, period: float, sa: float) -> TargetSpectrum:
    """Return the spectrum conditional on its acceleration at one of its periods: a normal
    distribution of ln Sa, given one of its components.
    """
    assert target.covariance is not None  # noqa: S101  a table with standard deviations
    place = int(np.argmin(np.abs(target.period - period)))
    variance = float(target.covariance[place, place])
    if variance <= 0.0:
        message = f"{_DEVIATION} 0 at {period:g} s. Must be above 0 where the spectrum is given."
        raise InputError(path, message)
    away = math.log(sa) - float(target.log_sa[place])
    share = target.covariance[place] / variance
    covariance = target.covariance - np.outer(share, target.covariance[place])
    covariance[place, :] = covariance[:, place] = 0.0  # without rounding
    epsilon = away / math.sqrt(variance)
    words = _conditional(target.words, (period, sa), epsilon)
    return TargetSpectrum(
        target.period, target.log_sa + share * away, covariance, words, period, epsilon
    )


def _require_cover(path: Path, covered: Float, wanted: Float) -> None:
    for period in wanted:
        if not covered[0] * (1.0 - _SAME) <= period <= covered[-1] * (1.0 + _SAME):
            message = f"covers periods from {covered[0]:g} to {covered[-1]:g} s, not {period:g} s."
            raise InputError(path, f"{message} State periods within this range.")


def _read_table(path: Path) -> Float:
    """Return periods [s], ln Sa [ln m s-2] and standard deviations, where stated, as columns."""
    lines, header, _ = table_of(path)
    refuse_other_targets(path, header, lines[0][0] if lines else 1)
    middle = [name for name in (_MEDIAN, _MEAN) if name in header]
    wanted = [_PERIOD, *middle, *([_DEVIATION] if _DEVIATION in header else [])]
    if len(middle) != 1 or sorted(header) != sorted(wanted):
        shown = ", ".join(header)[:_SHOWN] or "missing"
        must = f"Must be {_PERIOD}, {_MEDIAN} or {_MEAN}, and if known {_DEVIATION}; or uniform"
        message = f"columns {shown}. {must} hazard spectra of OpenQuake (hazard_uhs)."
        raise InputError(path, message, line=lines[0][0] if lines else 1)
    rows = [
        _row(path, line, dict(zip(header, row, strict=False)), wanted) for line, row in lines[1:]
    ]
    if len(rows) < 2:
        raise InputError(path, f"{len(rows)} periods. Must be two or more.")
    for (line, _), before, other in zip(lines[2:], rows, rows[1:], strict=False):
        if not before[0] < other[0]:
            message = f"{_PERIOD} {other[0]:g} after {before[0]:g}. Must increase."
            raise InputError(path, message, line=line)
    return np.array(rows)


def _row(path: Path, line: int, cells: dict[str, str], columns: Sequence[str]) -> list[float]:
    """Return period, ln Sa and, if stated, the standard deviation of a line."""
    values = []
    for column in columns:
        cell = cells.get(column, "")
        try:
            value = decimal(cell)
        except ValueError:
            message = f"{column} {cell[:_SHOWN]!r}. Must be a number."
            raise InputError(path, message, line=line) from None
        largest = spectral(1.0).largest
        if column == _PERIOD and not value > 0.0:
            raise InputError(path, f"{column} {value:g}. Must be above 0.", line=line)
        if column == _MEDIAN and not 0.0 < value <= largest:
            message = f"{column} {value:g}. Must be above 0 and at most {largest:g}, in g."
            raise InputError(path, message, line=line)
        if column == _MEAN and not value <= math.log(largest):
            message = f"{column} {value:g}. Must be at most {math.log(largest):.2f}, of g."
            raise InputError(path, message, line=line)
        if column == _DEVIATION and value < 0.0:
            raise InputError(path, f"{column} {value:g}. Must be zero or positive.", line=line)
        values.append(value)
    logarithm = math.log(values[1]) if _MEDIAN in columns else values[1]
    return [values[0], logarithm + math.log(GRAVITY), *values[2:]]
