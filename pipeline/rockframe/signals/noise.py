"""Pre-event noise, and the frequency band in which the motion exceeds it."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rockframe.signals.processing import Float, level, peak, taper

#: Length of the first window, whose level is used to detect the onset of the motion [s].
_LISTEN: Final = 2.0
#: Onset threshold in units of that level: twice the peak of Gaussian noise in 10,000 samples.
_ONSET: Final = 8.0
#: Bands per octave over which Fourier amplitudes are averaged.
_BANDS_PER_OCTAVE: Final = 3
#: Share of the time before the onset that is not used, because the arrival may be emergent.
_GUARD: Final = 0.2
#: Largest ratio between the levels of the four quarters of a window of noise. Tapered P waves of a
#: triggered record have a larger ratio.
STEADY: Final = 3.0
QUARTERS: Final = 4
#: Distance from a line that rounding may cause, as a share of the largest sample. One digit of a
#: 24-bit recorder is larger.
_ROUNDED: Final = 1e-10
#: Fewest samples on either side of an arrival.
_BESIDE: Final = 10
#: Least number of cycles of a frequency in the noise window; lower frequencies are not judged.
_CYCLES: Final = 2.0
#: Share of a window that is tapered with a cosine, at both ends together.
_TAPER: Final = 0.1
#: Factor between a filter corner and the usable band, as for PEER's lowest usable frequencies.
CORNER_MARGIN: Final = 1.25


def pre_event(acceleration: Float, time_step: float) -> tuple[float, float]:
    """Return length [s] and level [unit of the samples] of the noise before the event.

    The event begins with the first sample that differs from the mean of the first 2 s by more than
    eight times their root mean square. The noise window is the time before it without its last
    fifth, because the arrival may be emergent. The level is the root mean square about the
    least-squares line of the window, which is slow drift and no noise.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration as recorded.
    time_step : float
        Interval between samples [s].

    Returns
    -------
    length, level : float
        Length of the window and level of the noise. They are 0 and NaN if the noise is unknown: no
        event is found; it begins within 2 s; the first 2 s or the window are padding (samples
        on one line); or the motion grows in the window (quarters that differ by a factor of 3).

    Examples
    --------
    >>> hum = 0.001 * np.sin(0.7 * np.arange(500))
    >>> length, level = pre_event(np.r_[hum, 1.0, -1.0], 0.01)
    >>> print(f"{length:g} {level:.5f}")
    4 0.00071
    """
    count = round(_LISTEN / time_step)
    opening = acceleration[:count]
    if count < 2 or is_straight(opening, peak(acceleration)):
        return 0.0, math.nan
    away = np.abs(acceleration - opening.mean()) > _ONSET * opening.std()
    onset = int(away.argmax())
    if onset < count:
        return 0.0, math.nan
    window = acceleration[: round((1.0 - _GUARD) * onset)]
    if window.size < QUARTERS or is_straight(window, peak(acceleration)):
        return 0.0, math.nan
    levels = quarter_levels(window)
    if max(levels) > STEADY * min(levels):
        return 0.0, math.nan
    return time_step * window.size, float(level(window).std())


def is_straight(window: Float, largest: float) -> bool:
    """Return True if samples are on one straight line, as padding is, apart from rounding.

    Parameters
    ----------
    window : array, shape (samples,)
        Part of a record.
    largest : float
        Largest absolute sample of the record.

    Examples
    --------
    >>> is_straight(np.array([0.1, 0.1, 0.1]), 1.0), is_straight(np.array([0.1, 0.1, 0.2]), 1.0)
    (True, False)
    """
    return peak(level(window)) <= _ROUNDED * largest


def quarter_levels(window: Float) -> list[float]:
    """Return the root mean square of each quarter of a window about the line of the window.

    Examples
    --------
    >>> quarter_levels(np.array([1.0, -1.0, -1.0, 1.0]))
    [1.0, 1.0, 1.0, 1.0]
    """
    quarters = np.array_split(level(window), QUARTERS)
    return [float(np.sqrt(np.mean(part**2))) for part in quarters]


def arrival(acceleration: Float) -> int:
    """Return the number of samples before the first arrival.

    The samples up to the peak are divided into the two parts that Gaussian noise of one level each
    fits best (the criterion of Akaike). It needs no threshold: weak shocks before the event do not
    matter, nor does an offset.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration as recorded.

    References
    ----------
    Maeda (1985), A method for reading and checking phase times in autoprocessing system of seismic
    wave data, Zisin 38, 365-379.

    Examples
    --------
    >>> hum = 0.001 * np.sin(0.7 * np.arange(500))
    >>> arrival(np.r_[hum, 0.1 * np.cos(0.3 * np.arange(80)), 1.0])
    500
    """
    rising = acceleration[: int(np.abs(acceleration - np.median(acceleration)).argmax()) + 1]
    if rising.size < 2 * _BESIDE:
        return 0
    centred = rising - rising.mean()
    sums, squares = np.cumsum(centred), np.cumsum(np.square(centred))
    count = np.arange(_BESIDE, rising.size - _BESIDE + 1)
    rest, before, squared = rising.size - count, sums[count - 1], squares[count - 1]
    levels = (
        squared / count - (before / count) ** 2,
        (squares[-1] - squared) / rest - ((sums[-1] - before) / rest) ** 2,
    )
    # Equal samples have a level of zero, or what rounding makes of it.
    least = np.finfo(np.float64).eps * squares[-1] / rising.size
    logarithms = [np.log(np.maximum(level, least)) for level in levels]
    return _BESIDE + int((count * logarithms[0] + rest * logarithms[1]).argmin())


def signal_to_noise_band(
    acceleration: Float, time_step: float, quiet: float, strong: tuple[float, float], ratio: float
) -> tuple[float, float]:
    """Return the band in which the Fourier amplitudes of the motion exceed those of the noise [Hz].

    Both are root-mean-square amplitudes over thirds of an octave, the last of which ends at the
    Nyquist frequency. The noise is scaled to the duration of the motion. The band is the continuous
    one around the largest amplitude.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration as recorded.
    time_step : float
        Interval between samples [s].
    quiet : float
        Length of the noise window at the beginning [s], from `pre_event`.
    strong : (float, float)
        Start and end of the strong motion [s].
    ratio : float
        Smallest accepted ratio of the amplitudes [1].

    Returns
    -------
    low, high : float
        Edges of the band [Hz]. The lower edge is 0 if the motion exceeds the noise even at the
        lowest frequency that can be judged (two cycles in the noise window). The upper edge is
        infinite if it does so up to the Nyquist frequency. Both are NaN if no band exceeds the
        noise.

    Examples
    --------
    >>> time = 0.01 * np.arange(4000)
    >>> hum = 1e-3 * np.random.default_rng(1).standard_normal(4000)
    >>> motion = np.where(time > 20, np.sin(2 * np.pi * 3 * time) * np.exp(-time / 50), 0.0)
    >>> low, high = signal_to_noise_band(hum + motion, 0.01, 20.0, (21.0, 39.0), 3.0)
    >>> low < 3 < high
    True
    """
    onset = round(quiet / time_step)
    first, last = (round(moment / time_step) for moment in strong)
    if onset < 2 or last - first < 2:
        return 0.0, math.inf
    lowest = _CYCLES / quiet
    count = math.floor(_BANDS_PER_OCTAVE * math.log2(0.5 / time_step / lowest))
    if count < 1:
        return 0.0, math.inf
    edges = lowest * 2.0 ** (np.arange(count + 1) / _BANDS_PER_OCTAVE)
    # The last band ends at the Nyquist frequency. What is left above the thirds of an octave is
    # part of their last one if it is narrower than the distance of two Fourier lines.
    line = 1.0 / (time_step * min(onset, last - first))
    if 0.5 / time_step - edges[-1] < line:
        edges[-1] = math.inf
    else:
        edges = np.append(edges, math.inf)
    noise = _density(acceleration[:onset], time_step, edges)
    motion = _density(acceleration[first:last], time_step, edges)
    measured = np.isfinite(noise) & np.isfinite(motion)
    if not measured.any():
        return 0.0, math.inf
    # A band that is too narrow to contain a Fourier line does not limit the others.
    stands_out = ~measured | (motion >= ratio**2 * noise)
    top = int(np.where(measured, motion, -1.0).argmax())
    if not stands_out[top]:
        return math.nan, math.nan
    below = np.flatnonzero(~stands_out[:top])
    above = np.flatnonzero(~stands_out[top:])
    low = float(edges[below[-1] + 1]) if below.size else 0.0
    high = float(edges[top + above[0]]) if above.size else math.inf
    return low, high


def usable_periods(
    time_step: float,
    duration: float,
    corners: tuple[float, float],
    band: tuple[float, float],
) -> tuple[float, float]:
    """Return the shortest and longest usable period of a record [s].

    Parameters
    ----------
    time_step, duration : float
        Time step and duration of the record [s]. Usable periods are at least two time steps and at
        most the duration.
    corners : (float, float)
        Corners of the band-pass [Hz], NaN if unknown. Usable frequencies are inside the band by a
        factor of 1.25.
    band : (float, float)
        Band that exceeds the noise [Hz], from `signal_to_noise_band`.

    Returns
    -------
    shortest, longest : float
        Shortest and longest usable period [s]; both 0 if no period is usable.

    References
    ----------
    Ancheta et al. (2013), PEER NGA-West2 database, PEER Report 2013/03: the factor 1.25.

    Examples
    --------
    >>> usable_periods(0.01, 100.0, (0.1, 40.0), (0.0, 20.0))
    (0.05, 8.0)
    """
    low, high = band
    if math.isnan(low):
        return 0.0, 0.0
    shortest, longest = CORNER_MARGIN / corners[1], 1.0 / (CORNER_MARGIN * corners[0])
    # fmax and fmin ignore NaN.
    if high < math.inf:
        shortest = float(np.fmax(shortest, 1.0 / high))
    if low > 0.0:
        longest = float(np.fmin(longest, 1.0 / low))
    shortest, longest = max(shortest, 2.0 * time_step), min(longest, duration)
    return (0.0, 0.0) if shortest >= longest else (shortest, longest)


def periodogram(window: Float, time_step: float, tapered: float = _TAPER) -> tuple[Float, Float]:
    """Return frequencies [Hz] and power per hertz and second of a window.

    A straight line is removed, and this share of the window is tapered, at both ends together.

    Examples
    --------
    >>> frequencies, power = periodogram(np.sin(2 * np.pi * 0.05 * np.arange(1000)), 0.1)
    >>> print(f"{frequencies[power.argmax()]:g} Hz")
    0.5 Hz
    """
    ends = taper(window.size, tapered)
    lines = np.fft.rfft(level(window) * ends)
    power: Float = np.abs(lines) ** 2 * time_step / np.square(ends).sum()
    return np.asarray(np.fft.rfftfreq(window.size, time_step), dtype=np.float64), power


def _density(window: Float, time_step: float, edges: Float) -> Float:
    """Return the mean power per hertz and second in each band; NaN without a Fourier line."""
    frequencies, power = periodogram(window, time_step)
    band = np.digitize(frequencies, edges)
    lines = np.bincount(band, minlength=edges.size + 1)[1:-1]
    total = np.bincount(band, power, minlength=edges.size + 1)[1:-1]
    mean: Float = np.divide(total, lines, out=np.full(lines.size, np.nan), where=lines > 0)
    return mean
