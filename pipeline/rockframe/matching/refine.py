"""The refinement: period, time and half cycles of a maximum, continuously.

The inner products are summed over the record's spectrum, where they are smooth functions of all
three whatever the samples are. The phase follows in closed form; so does the time, from the
Taylor series of the products around a time nearby: Newton's method has one or two variables left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.signal import Signal, part_energies, part_spectra

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Spectra of wavelets are summed up to this frequency times T_p; beyond it a Ricker wavelet is
#: below 1e-16, and the tail of one with kinks, times that of a record, below 1e-3 of the product.
_HIGHEST: Final = 16.0
#: Terms of the Taylor series over time, and how far it is trusted, over T_p.
_TERMS: Final = 6
_NEAR: Final = 0.06
#: Steps of the differences over ln T_p and half cycles: first, and least; errors of T_p of 1e-8.
_FIRST_STEP: Final = 4e-3
_LAST_STEP: Final = 1e-4
#: Longest move of Newton's method, and the one at which it has arrived.
_LONGEST_MOVE: Final = 0.05
_ARRIVED: Final = 1e-8
_MOST_MOVES: Final = 30


@dataclass(frozen=True)
class Refined:
    """A maximum of the transform.

    Parameters
    ----------
    wavelet : str
        Name.
    period, time : float
        T_p and centre [s].
    half_cycles : float or None
        Number of half cycles [1].
    factors : tuple of float
        Least-squares factor of each part of the wavelet, in the unit of the signal.
    weighted : float
        Square of the coefficient with its weight: what is largest.
    explained : float
        Energy of the signal that the wavelet explains.
    """

    wavelet: str
    period: float
    time: float
    half_cycles: float | None
    factors: tuple[float, ...]
    weighted: float
    explained: float


def refine(
    signal: Signal, start: Refined, periods: tuple[float, float], half_cycles: tuple[float, float]
) -> Refined:
    """Climb from a point to the maximum near it, by Newton's method with differences.

    Parameters
    ----------
    signal : Signal
        What is searched.
    start : Refined
        What `crest` gives at a point of the grid.
    periods, half_cycles : tuple of float
        Bounds of the two.
    """
    here, step = start, _FIRST_STEP
    low = np.array([math.log(periods[0]), half_cycles[0]])
    high = np.array([math.log(periods[1]), half_cycles[1]])
    count = 1 if start.half_cycles is None else 2
    low, high = low[:count], high[:count]
    for _ in range(_MOST_MOVES):
        x = _variables(here)
        move = _newton_move(signal, here, step, low, high)
        there = _at(signal, here, np.clip(x + move, low, high))
        if there.weighted < here.weighted:
            if step == _LAST_STEP:
                move *= 0.25
                there = _at(signal, here, np.clip(x + move, low, high))
            if there.weighted <= here.weighted and step == _LAST_STEP:
                return here
        moved = float(np.abs(_variables(there) - x).max())
        here = there if there.weighted >= here.weighted else here
        if moved < _ARRIVED and step == _LAST_STEP:
            return here
        step = min(step, max(_LAST_STEP, 0.1 * moved))
    return here


def crest(
    signal: Signal, wavelet: str, period: float, time: float, half_cycles: float | None
) -> Refined:
    """Return the best time near a given one, phase and amplitude of a wavelet of this period.

    Parameters
    ----------
    signal : Signal
        What is searched.
    wavelet : str
        Name.
    period, time : float
        T_p and the time from which to climb [s].
    half_cycles : float or None
        Number of half cycles [1].
    """
    velocity = signal.weighting.of_velocity
    bins = min(signal.spectrum.size, math.floor(_HIGHEST * signal.period / period) + 1)
    nu = np.arange(bins, dtype=np.float64) * (period / signal.period)
    energies = part_energies(wavelet, half_cycles, velocity)
    spectra = part_spectra(wavelet, half_cycles, nu, velocity)
    matched = np.conj(np.stack(spectra)) * signal.spectrum[:bins]
    for _ in range(_MOST_MOVES):
        series = _taylor(matched, nu, time / period) * (2.0 * period / signal.period)
        shift = _climb(series, energies, (-time / period, (signal.duration - time) / period))
        time += period * shift
        if abs(shift) < _NEAR:
            break
    powers = shift ** np.arange(_TERMS)
    products = series @ powers
    explained = float((products**2 / (period * np.array(energies))).sum())
    return Refined(
        wavelet,
        period,
        time,
        half_cycles,
        tuple((products / (period * np.array(energies))).tolist()),
        explained * period ** (1.0 - 2.0 * signal.weighting.exponent),
        explained,
    )


def _taylor(matched: Complex, nu: Float, tau: float) -> Float:
    """Coefficients of the products in powers of the time around tau, over T_p; (parts, terms)."""
    turned = matched * np.exp(2j * math.pi * tau * nu)
    powers = np.empty((_TERMS, nu.size))
    powers[0] = 1.0
    for k in range(1, _TERMS):
        powers[k] = powers[k - 1] * (2.0 * math.pi / k) * nu
    # i^k: the real part of the even terms, minus the imaginary of the odd ones
    real, imaginary = turned.real @ powers.T, turned.imag @ powers.T
    columns = [real, -imaginary, -real, imaginary]
    return np.stack([columns[k % 4][:, k] for k in range(_TERMS)], axis=1)


def _climb(series: Float, energies: tuple[float, ...], bounds: tuple[float, float]) -> float:
    """Time of the maximum of the sum of squares near 0, over T_p, no further than is trusted."""
    total = sum(
        np.polynomial.polynomial.polymul(row, row) / energy
        for row, energy in zip(series, energies, strict=True)
    )[:_TERMS]
    low, high = max(bounds[0], -_NEAR), min(bounds[1], _NEAR)
    slope = np.polynomial.polynomial.polyder(total)
    bend = np.polynomial.polynomial.polyder(slope)
    x = 0.0
    for _ in range(8):
        rise, curve = (float(np.polynomial.polynomial.polyval(x, p)) for p in (slope, bend))
        move = -rise / curve if curve < 0.0 else math.copysign(_NEAR, rise)
        x, last = min(max(x + move, low), high), x
        if abs(x - last) < 1e-14:
            break
    return x


def _variables(point: Refined) -> Float:
    x = [math.log(point.period)]
    return np.array(x if point.half_cycles is None else [*x, point.half_cycles])


def _at(signal: Signal, near: Refined, x: Float) -> Refined:
    number = None if near.half_cycles is None else float(x[1])
    return crest(signal, near.wavelet, math.exp(x[0]), near.time, number)


def _newton_move(signal: Signal, here: Refined, step: float, low: Float, high: Float) -> Float:
    """Move to the top of the parabola through neighbours; what a bound forbids stays."""
    x = np.clip(_variables(here), low + step, high - step)  # so that the neighbours are within

    def height(*offset: float) -> float:
        return math.log(max(_at(signal, here, x + step * np.array(offset)).weighted, 1e-300))

    if x.size == 1:
        before, middle, after = height(-1.0), height(0.0), height(1.0)
        slope = np.array([after - before]) / (2.0 * step)
        bend = np.array([[after - 2.0 * middle + before]]) / step**2
    else:
        middle = height(0.0, 0.0)
        left, right, down, up = height(-1, 0), height(1, 0), height(0, -1), height(0, 1)
        corners = height(1, 1) + height(-1, -1) - left - right - down - up + 2.0 * middle
        slope = np.array([right - left, up - down]) / (2.0 * step)
        cross = 0.5 * corners / step**2
        bend = np.array(
            [
                [(right - 2.0 * middle + left) / step**2, cross],
                [cross, (up - 2.0 * middle + down) / step**2],
            ]
        )
    move = _uphill(slope, bend)
    offset = x - _variables(here)
    target = np.clip(x + move, low, high)
    held = (target != x + move) & (np.abs(slope) > 0.0)
    if held.any() and not held.all():  # slide along the bound
        free = ~held
        rest = slope[free] + bend[np.ix_(free, held)] @ (target - x)[held]
        move[free] = _uphill(rest, bend[np.ix_(free, free)])
        move[held] = (target - x)[held]
    return move + offset


def _uphill(slope: Float, bend: Float) -> Float:
    values, axes = np.linalg.eigh(bend)
    along = axes.T @ slope
    move = axes @ (along / np.maximum(np.abs(values), 1e-6))
    longest = float(np.abs(move).max())
    return np.asarray(move * min(1.0, _LONGEST_MOVE / longest) if longest > 0.0 else move)
