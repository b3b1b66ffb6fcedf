"""Compiled loops of the search and of the refinement."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.wavelets.loops import FRESH

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Single = NDArray[np.float32]
SingleComplex = NDArray[np.complex64]

#: Number of terms of the Taylor series over time.
_TERMS: Final = 6
_MOST_SHIFTS: Final = 30
_MOST_STEPS: Final = 8


@compiled
def match_lines(
    spectrum: SingleComplex,
    shape: SingleComplex,
    scales: Float,
    lines: NDArray[np.intp],
    row: SingleComplex,
    table: SingleComplex,
) -> None:
    """Multiply the spectra of signals and of a wavelet's parts.

    Parameters
    ----------
    spectrum : array, shape (signals, bins or more)
        Spectra of the signals.
    shape : array, shape (parts, tabulated lines)
        Conjugate spectra of the parts.
    scales : array, shape (periods,)
        Distance of two bins, in tabulated lines.
    lines, row : array, shape (bins,)
        Overwritten.
    table : array, shape (signals, periods, parts, bins or more)
        Filled with the products, and with 0 beyond the bins.
    """
    for j in range(scales.size):
        for k in range(lines.size):
            lines[k] = int(np.rint(scales[j] * k))
        for part in range(shape.shape[0]):
            for k in range(lines.size):
                row[k] = shape[part, lines[k]]
            for i in range(table.shape[0]):
                for k in range(table.shape[3]):
                    table[i, j, part, k] = spectrum[i, k] * row[k] if k < lines.size else 0.0


@compiled
def tops(
    products: Single,
    work: tuple[Single, NDArray[np.int32]],
    times: tuple[int, float],
    kinds: NDArray[np.intp],
    factors: Float,
    place: tuple[NDArray[np.intp], int, int, int],
    best: Float,
    highest: Float,
) -> None:
    """Find the largest squares over time, between its steps on parabolas through three of them.

    Parameters
    ----------
    products : array, shape (signals periods numbers, parts, steps)
        Inner products.
    work : tuple of array, shape (steps that are searched and one more,)
        Overwritten. The second has the same memory as the first: integers have the same order as
        positive numbers, and their maximum is vectorised.
    times : tuple of int and float
        First step that is searched; and distance from the last one to the end of the range, in
        steps, below 1.
    kinds : array, shape (kinds,)
        For each result: 0 or 1 for the square of this part, or 2 for the sum of both squares.
    factors : array, shape (2, periods)
        Factors of the squares, and further ones with which their largest is chosen.
    place : tuple of array, shape (signals,), and int
        Row of `best` and `highest` of each signal; first period and first number in `highest`; and
        count of numbers.
    best : array, shape (rows, kinds)
        Raised to the largest squares with both factors.
    highest : array, shape (rows, periods or more, numbers or more, kinds)
        Filled with the largest squares.
    """
    (power, bits), (rows, first_period, first_number, count), item = work, place, 0
    last = power.size - 2
    for i in range(rows.size):
        for j in range(factors.shape[1] * count):
            period, number = j // count, j % count
            for n in range(kinds.size):
                row = products[item, kinds[n] % 2, times[0] :]
                other = products[item, products.shape[1] - 1, times[0] :]
                for k in range(power.size):
                    power[k] = row[k] * row[k]
                if kinds[n] == 2:
                    for k in range(power.size):
                        power[k] += other[k] * other[k]
                top = _largest_of(bits, last)
                square = float(power[top])
                if last > 0:  # a parabola fits the product of one part better than its square
                    heights = power if kinds[n] == 2 else row
                    square = max(square, _largest_between(heights, top, last, times[1], kinds[n]))
                square *= factors[0, period]
                highest[rows[i], first_period + period, first_number + number, n] = square
                best[rows[i], n] = max(best[rows[i], n], square * factors[1, period])
            item += 1


@inlined
def _largest_of(numbers: NDArray[np.int32], last: int) -> int:
    """Return the place of the largest of the numbers up to the place `last`."""
    most, place = numbers[0], 0
    for k in range(last + 1):
        if numbers[k] > most:
            most = numbers[k]
    while numbers[place] < most:
        place += 1
    return place


@inlined
def _largest_between(heights: Single, top: int, last: int, beyond: float, kind: int) -> float:
    """Return the larger of the squares around the highest step and at the end of the range.

    They are those of parabolas through three heights; heights of kind 2 are squares already.
    """
    square, middle, least, most = 0.0, max(top, 1), -0.5, 0.5 if top < last else beyond
    if top == 0:
        least = -1.0
    for _ in range(2):
        before, here, after = heights[middle - 1], heights[middle], heights[middle + 1]
        slope, bend = 0.5 * (float(after) - before), float(before) - 2.0 * here + after
        shift = min(max(-slope / bend, least), most) if bend * here < 0.0 else most
        value = here + shift * (slope + 0.5 * shift * bend)
        square = max(square, value if kind == 2 else value * value)
        middle, least, most = last, beyond, beyond  # the end of the range
    return square


@compiled
def strong_blocks(
    samples: Single,
    within: int,
    block: int,
    half: int,
    floor: Float,
    growth: Float,
    ends: NDArray[np.intp],
) -> tuple[int, int]:
    """Find the signals that have enough energy somewhere, and where.

    Parameters
    ----------
    samples : array, shape (signals, samples)
        Samples, of which the first `within` count.
    block, half : int
        Number of samples of a block, and number of neighbouring blocks on each side. The energy of
        a block includes that of these neighbours.
    floor : array, shape (signals,)
        Least energy of a block, as a sum of squares.
    growth : array, shape (blocks + 1,)
        Overwritten.
    ends : array, shape (signals, 3)
        Rows are filled, one for each signal with enough energy: its index, its first sample with
        enough energy, and the one after its last.

    Returns
    -------
    count, longest : int
        Number of signals with enough energy, and the largest distance of their ends.
    """
    blocks, count, longest = growth.size - 1, 0, 0
    growth[0] = 0.0
    for i in range(samples.shape[0]):
        for m in range(blocks):
            growth[m + 1] = growth[m]
            for k in range(m * block, min((m + 1) * block, within)):
                growth[m + 1] += float(samples[i, k]) ** 2
        first, last = blocks, 0
        for m in range(blocks):
            low, high = max(m - half, 0), min(m + half + 1, blocks)
            if growth[high] - growth[low] >= floor[i]:
                first, last = min(first, low), high
        if last:
            ends[count, 0], ends[count, 1] = i, first * block
            ends[count, 2] = min(last * block, within)
            longest = max(longest, ends[count, 2] - ends[count, 1])
            count += 1
    return count, longest


@compiled
def cut_samples(
    samples: Single, ends: NDArray[np.intp], last: int, beside: int, size: int, cuts: Single
) -> None:
    """Copy a stretch of each signal, cyclically.

    Parameters
    ----------
    samples : array, shape (signals, samples)
        Samples, zeros beyond the record included.
    ends : array, shape (cuts, 3)
        Index of each signal and its first sample, as `strong_blocks` fills them in.
    last : int
        Largest first sample.
    beside : int
        Number of samples before the first one that are copied too.
    size : int
        Number of samples to copy.
    cuts : array, shape (cuts, size or more)
        Filled with the samples.
    """
    for i in range(cuts.shape[0]):
        at = min(ends[i, 1], last) - beside
        for k in range(size):
            cuts[i, k] = samples[ends[i, 0], (at + k) % samples.shape[1]]


@compiled
def crests(
    spectrum: Complex,
    numbers: Float,
    gaussians: Float,
    spectra: Complex,
    energies: Float,
    points: Float,
    time: float,
    tops: Float,
) -> None:
    """Find the maxima over time at several points, each near one time.

    The inner products of the record and the parts of the wavelet are Taylor series in the time.

    Parameters
    ----------
    spectrum : array, shape (lines,)
        Lines of the signal's spectrum that are summed.
    numbers : array, shape (5,)
        Duration with and without the zeros, and start of the signal [s]; distance over T_p within
        which a series over time is accurate; and power of T_p in the weighting of squares.
    gaussians : array, shape (parts, 3)
        Height, power from 1 to 3 and rate of each part's spectrum, height nu^power exp(-rate nu^2),
        times i if the power is odd; or empty.
    spectra : array, shape (parts points, lines) or (parts, lines)
        Spectra of the wavelet's parts at each point; overwritten if `gaussians` is not empty.
    energies : array, shape (points, parts)
        Energies of the parts.
    points : array, shape (points, variables)
        ln T_p, and more that is not used here.
    time : float
        Time near which the maxima are [s].
    tops : array, shape (points, 4 + parts)
        Filled with period, time, weighted square, explained energy and factors.
    """
    parts, near = energies.shape[1], numbers[3]
    series = np.empty((parts + 1, _TERMS))
    for p in range(points.shape[0]):
        period, shift = math.exp(points[p, 0]), 0.0
        line, tau = period / numbers[0], (time - numbers[2]) / period
        _fill_gaussians(gaussians, line, spectra)
        for _ in range(_MOST_SHIFTS):
            _expand(spectra, p * parts % spectra.shape[0], spectrum, line, tau, series)
            least, most = max(-tau, -near), min(numbers[1] / period - tau, near)
            shift = _top_near(series, energies, p, least, most)
            tau += shift
            if abs(shift) < near:
                break
        tops[p, 0], tops[p, 1], tops[p, 3] = period, numbers[2] + tau * period, 0.0
        for part in range(parts):
            product = 0.0
            for n in range(_TERMS - 1, -1, -1):
                product = product * shift + series[part, n]
            tops[p, 4 + part] = product / (period * energies[p, part])
            tops[p, 3] += product * tops[p, 4 + part]
        tops[p, 2] = tops[p, 3] * period ** numbers[4]


@inlined
def _fill_gaussians(gaussians: Float, line: float, spectra: Complex) -> None:
    for part in range(gaussians.shape[0]):
        for k in range(spectra.shape[1]):
            nu = k * line
            size = gaussians[part, 0] * nu * math.exp(-gaussians[part, 2] * (nu * nu))
            if gaussians[part, 1] == 2.0:
                spectra[part, k] = complex(size * nu, 0.0)
            else:
                spectra[part, k] = complex(
                    0.0, size * nu * nu if gaussians[part, 1] > 2.0 else size
                )


@inlined
def _expand(
    spectra: Complex, first: int, signal: Complex, line: float, tau: float, series: Float
) -> None:
    """Fill in the coefficients of the products in powers of the time around tau.

    The spectra are in rows from `first`, one for each row of the series but the last.
    """
    series[:] = 0.0
    parts, angle, rate = series.shape[0] - 1, 2.0 * math.pi * tau * line, 2.0 * math.pi * line
    turn = complex(math.cos(angle), math.sin(angle))
    at = complex(1.0, 0.0)
    for k in range(signal.size):
        if k % FRESH == 0:
            at = complex(math.cos(angle * k), math.sin(angle * k))
        turned = signal[k] * at
        for part in range(parts):
            value = turned * spectra[first + part, k].conjugate()
            power = 2.0 * line if k > 0 else line  # the others stand for negative frequencies too
            for n in range(_TERMS):  # real parts of the terms with powers of i k rate
                series[part, n] += power * (value.real if n % 2 == 0 else value.imag)
                power *= k * rate / (n + 1.0)
        at *= turn
    for part in range(parts):
        for n in range(1, _TERMS):
            if n % 4 == 1 or n % 4 == 2:
                series[part, n] = -series[part, n]


@inlined
def _top_near(series: Float, energies: Float, point: int, low: float, high: float) -> float:
    """Return the time of the maximum of the sum of squares near 0, within bounds.

    The sum is filled in in the last row of the series.
    """
    total = energies.shape[1]
    for part in range(total):
        for n in range(_TERMS):
            for m in range(_TERMS - n):
                square = series[part, n] * series[part, m] / energies[point, part]
                series[total, n + m] += square
    x = 0.0
    for _ in range(_MOST_STEPS):
        rise, curve = 0.0, 0.0
        for n in range(_TERMS - 1, 0, -1):
            curve = curve * x + (n - 1) * n * series[total, n] if n > 1 else curve
            rise = rise * x + n * series[total, n]
        move = -rise / curve if curve < 0.0 else math.copysign(high - low, rise)
        last, x = x, min(max(x + move, low), high)
        if abs(x - last) < 1e-14:
            break
    return x
