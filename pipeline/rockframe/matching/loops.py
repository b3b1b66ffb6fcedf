"""Compiled loops of the search and of the refinement."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.wavelets.loops import FRESH, fill_lines, window_energies

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
    spectrum: SingleComplex, shape: SingleComplex, scales: Float, table: SingleComplex
) -> None:
    """Multiply the spectra of signals and of a wavelet's parts.

    Parameters
    ----------
    spectrum : array, shape (signals, bins)
        Spectra of the signals.
    shape : array, shape (parts, tabulated lines)
        Conjugate spectra of the parts.
    scales : array, shape (periods,)
        Distance of two bins, in tabulated lines.
    table : array, shape (signals, periods, parts, bins or more)
        Filled with the products, and with 0 beyond the bins.
    """
    bins = spectrum.shape[1]
    row = np.empty(bins, dtype=np.complex64)
    lines = np.empty(bins, dtype=np.intp)
    for j in range(scales.size):
        for k in range(bins):
            lines[k] = int(np.rint(scales[j] * k))
        for part in range(shape.shape[0]):
            for k in range(bins):
                row[k] = shape[part, lines[k]]
            for i in range(spectrum.shape[0]):
                for k in range(bins):
                    table[i, j, part, k] = spectrum[i, k] * row[k]
                for k in range(bins, table.shape[3]):
                    table[i, j, part, k] = 0.0


@compiled
def tops(
    products: Single,
    times: tuple[int, int, float],
    kinds: NDArray[np.intp],
    factors: Float,
    rows: NDArray[np.intp],
    first: tuple[int, int],
    highest: Float,
) -> None:
    """Find the largest squares over time, between its steps on parabolas through three of them.

    Parameters
    ----------
    products : array, shape (signals, periods, numbers, parts, times)
        Inner products.
    times : tuple of int, int and float
        First step of time that is searched, and the one after the last; and the distance from the
        last step to the end of the range, in steps, below 1.
    kinds : array, shape (kinds,)
        For each result: 0 or 1 for the square of this part, or 2 for the sum of both squares.
    factors : array, shape (periods,)
        Factors of the squares.
    rows : array, shape (signals,)
        Row of `highest` of each signal.
    first : tuple of int
        First period and first number in `highest`.
    highest : array, shape (rows, periods or more, numbers or more, kinds)
        Filled with the largest squares.
    """
    start, stop, beyond = times
    within = stop - start
    power = np.empty(within + 1, dtype=np.float32)
    bits = power.view(np.int32)  # integers have the same order, and their maximum is vectorised
    for i in range(products.shape[0]):
        for j in range(products.shape[1] * products.shape[2]):
            period, number = j // products.shape[2], j % products.shape[2]
            parts = products[i, period, number]
            for n in range(kinds.size):
                row = parts[kinds[n] % 2, start : stop + 1]
                for k in range(within + 1):
                    power[k] = row[k] * row[k]
                if kinds[n] == 2:
                    other = parts[1, start : stop + 1]
                    for k in range(within + 1):
                        power[k] += other[k] * other[k]
                most, top = bits[0], 0
                for k in range(within):
                    most = max(most, bits[k])
                while bits[top] < most:
                    top += 1
                square = float(power[top])
                if within > 1:  # a parabola fits the product of one part better than its square
                    heights = power if kinds[n] == 2 else row
                    square = max(
                        square, _square_between(heights, top, within - 1, beyond, kinds[n])
                    )
                highest[rows[i], first[0] + period, first[1] + number, n] = square * factors[period]


@inlined
def _square_between(heights: Single, top: int, last: int, beyond: float, kind: int) -> float:
    """Return the larger of the squares around the highest step and at the end of the range."""
    middle = max(top, 1)
    least, most = -0.5 if top > 0 else -1.0, 0.5 if top < last else beyond
    around = _largest_square(heights[middle - 1 :], least, most, kind)
    return max(around, _largest_square(heights[last - 1 :], beyond, beyond, kind))


@inlined
def _largest_square(three: Single, least: float, most: float, kind: int) -> float:
    """Return the largest square on the parabola through three values, within a range of steps.

    The range is around the second value. Values of kind 2 are squares already.
    """
    before, here, after = float(three[0]), float(three[1]), float(three[2])
    slope, bend = 0.5 * (after - before), before - 2.0 * here + after
    shift = min(max(-slope / bend, least), most) if bend * here < 0.0 else most
    value = here + shift * (slope + 0.5 * shift * bend)
    return value if kind == 2 else value * value


@compiled
def strong_blocks(
    samples: Single, within: int, block: int, half: int, floor: Float, ends: NDArray[np.intp]
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
    ends : array, shape (signals, 3)
        Rows are filled, one for each signal with enough energy: its index, its first sample with
        enough energy, and the one after its last.

    Returns
    -------
    count, longest : int
        Number of signals with enough energy, and the largest distance of their ends.
    """
    blocks = -(-within // block)
    growth = np.zeros(blocks + 1)
    count, longest = 0, 0
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
    numbers : array, shape (6,)
        Duration with and without the zeros, and start of the signal [s]; distance over T_p within
        which a series over time is accurate; power of T_p in the weighting of squares; and 1 if
        velocities are compared, otherwise 0.
    gaussians : array, shape (parts, 3)
        Spectra of the wavelet's parts as in `fill_lines`, or empty.
    energies : array, shape (parts,)
        Energies of the parts, replaced by those of each point if `gaussians` is empty.
    points : array, shape (points, variables)
        ln T_p and, where the wavelet has it, the number of half cycles.
    time : float
        Time near which the maxima are [s].
    tops : array, shape (points, 4 + parts)
        Filled with period, time, weighted square, explained energy and factors.
    """
    whole, duration, start, near = numbers[0], numbers[1], numbers[2], numbers[3]
    parts, of_velocity = energies.size, numbers[5] > 0.0
    spectra = np.empty((parts, spectrum.size), dtype=np.complex128)
    series = np.empty((parts, _TERMS))
    for p in range(points.shape[0]):
        period, gamma = math.exp(points[p, 0]), points[p, points.shape[1] - 1]
        line, tau, shift = period / whole, (time - start) / period, 0.0
        if gaussians.size == 0:
            window_energies(gamma, of_velocity, energies)
        fill_lines(line, gamma, gaussians, of_velocity, spectra)
        for _ in range(_MOST_SHIFTS):
            _expand(spectra, spectrum, line, tau, series)
            shift = _top_near(
                series, energies, max(-tau, -near), min(duration / period - tau, near)
            )
            tau += shift
            if abs(shift) < near:
                break
        tops[p, 0], tops[p, 1], tops[p, 3] = period, start + tau * period, 0.0
        for part in range(parts):
            product = 0.0
            for n in range(_TERMS - 1, -1, -1):
                product = product * shift + series[part, n]
            tops[p, 4 + part] = product / (period * energies[part])
            tops[p, 3] += product * tops[p, 4 + part]
        tops[p, 2] = tops[p, 3] * period ** numbers[4]


@compiled
def _expand(spectra: Complex, signal: Complex, line: float, tau: float, series: Float) -> None:
    """Fill in the coefficients of the products in powers of the time around tau."""
    series[:] = 0.0
    angle, rate = 2.0 * math.pi * tau * line, 2.0 * math.pi * line
    turn = complex(math.cos(angle), math.sin(angle))
    at = complex(1.0, 0.0)
    for k in range(spectra.shape[1]):
        if k % FRESH == 0:
            at = complex(math.cos(angle * k), math.sin(angle * k))
        turned = signal[k] * at
        for part in range(spectra.shape[0]):
            value = turned * spectra[part, k].conjugate()
            power = 2.0 * line if k > 0 else line  # the others stand for negative frequencies too
            for n in range(_TERMS):  # real parts of the terms with powers of i k rate
                series[part, n] += power * (value.real if n % 2 == 0 else value.imag)
                power *= k * rate / (n + 1.0)
        at *= turn
    for n in range(1, _TERMS):
        if n % 4 == 1 or n % 4 == 2:
            for part in range(spectra.shape[0]):
                series[part, n] = -series[part, n]


@compiled
def _top_near(series: Float, energies: Float, low: float, high: float) -> float:
    """Return the time of the maximum of the sum of squares near 0, within bounds."""
    total = np.zeros(_TERMS)
    for part in range(energies.size):
        for n in range(_TERMS):
            for m in range(_TERMS - n):
                total[n + m] += series[part, n] * series[part, m] / energies[part]
    x = 0.0
    for _ in range(_MOST_STEPS):
        rise, curve = 0.0, 0.0
        for n in range(_TERMS - 1, 0, -1):
            curve = curve * x + (n - 1) * n * total[n] if n > 1 else curve
            rise = rise * x + n * total[n]
        move = -rise / curve if curve < 0.0 else math.copysign(high - low, rise)
        last, x = x, min(max(x + move, low), high)
        if abs(x - last) < 1e-14:
            break
    return x
