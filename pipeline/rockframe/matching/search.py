"""The search: all periods, half-cycle numbers and times by the FFT, phases in closed form.

For each period the inner products with the parts of a wavelet at all times are one inverse
transform each. What a wavelet of period T_p has beyond a few times 1 / T_p is nothing, so only
that part of the spectrum is transformed back, to a few samples a period: an octave longer, half
the samples. The parts are even and odd, their cross term is zero, and the best phase at each time
is the projection on their span: c1^2 / E1 + c2^2 / E2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.signal import Signal, padded_size, part_energies, part_spectra
from rockframe.wavelets import RICKERS, WAVELETS

Float = NDArray[np.float64]
Single = NDArray[np.float32]
SingleComplex = NDArray[np.complex64]

#: Periods of the ladder in an octave: |C| is within 2e-3 of its maximum between two rungs.
PERIODS_PER_OCTAVE: Final = 14
#: The ladder has a rung at this period [s], so that records share their wavelets.
_ANCHOR: Final = 0.2
#: Samples in the shortest period of an octave, at least.
_SAMPLES_PER_PERIOD: Final = 8
#: Spectra of the wavelets are tabled to this frequency times T_p, so many lines to the unit.
_HIGHEST: Final = 8
_FINENESS: Final = 2048
#: The three wavelets whose parts are the two Rickers.
_ANY_PHASE: Final = "ricker_any_phase"


@dataclass(frozen=True, eq=False)
class Heights:
    """Over the ladder of periods, the largest coefficient at any time and phase.

    Parameters
    ----------
    periods : array, shape (periods,)
        T_p [s].
    half_cycles : tuple of float, or of None
        Numbers of half cycles that were searched [1].
    power : array, shape (signals, periods, half_cycles)
        Largest square of the coefficient with the weight of energy.
    times : array, shape (signals, periods, half_cycles)
        When [s].
    """

    periods: Float
    half_cycles: tuple[float | None, ...]
    power: Float
    times: Float


def ladder(low: float, high: float, per_octave: int = PERIODS_PER_OCTAVE) -> Float:
    """Return the periods of the search, in equal ratios; at least one [s].

    Examples
    --------
    >>> ladder(0.2, 0.5, 2).round(3)
    array([0.2  , 0.283, 0.4  ])
    """
    first = math.ceil(per_octave * math.log2(low / _ANCHOR) - 1e-9)
    last = math.floor(per_octave * math.log2(high / _ANCHOR) + 1e-9)
    if last < first:
        return np.array([math.sqrt(low * high)])
    return np.asarray(_ANCHOR * 2.0 ** (np.arange(first, last + 1) / per_octave))


def search(
    signal: Signal,
    periods: Float,
    wavelets: Sequence[str],
    half_cycles: Sequence[float],
    fineness: int = _SAMPLES_PER_PERIOD,
) -> dict[str, Heights]:
    """Return the largest coefficients of each wavelet over periods and half-cycle numbers.

    Parameters
    ----------
    signal : Signal
        What is searched.
    periods : array, shape (periods,)
        T_p in ascending order [s].
    wavelets : sequence of str
        Names of wavelets.
    half_cycles : sequence of float
        Numbers to be searched, of wavelets that have one.
    fineness : int
        Times at which the coefficients are wanted, in the shortest period of an octave.
    """
    spans = [(span, number) for span in _spans(wavelets) for number in _numbers(span, half_cycles)]
    found: dict[str, list[Float]] = {name: [] for name in wavelets}
    for octave in octaves(signal, periods, fineness):
        columns: dict[str, list[Float]] = {name: [] for name in wavelets}
        for span, number in spans:
            products = correlations(octave, span, number)[..., : octave.within]
            for name, power in _powers(products, span, wavelets):
                columns[name].append(_largest(power, octave))
        for name, parts in columns.items():
            found[name].append(np.stack(parts, axis=-1))
    heights = {}
    for name, rows in found.items():
        power, times = np.concatenate(rows, axis=2)
        heights[name] = Heights(periods, tuple(_numbers(name, half_cycles)), power, times)
    return heights


@dataclass(frozen=True, eq=False)
class Octave:
    """Periods within a factor of two, and the part of a spectrum that their wavelets see.

    Parameters
    ----------
    periods : array, shape (periods,)
        T_p, ascending [s].
    spectrum : array, shape (signals, lines)
        Of the signals, in single precision.
    lines : array, shape (periods, lines)
        Where in the tabled spectra of the wavelets each line is.
    count, within : int
        Times of the inverse transform, and of those the ones within the signal.
    step : float
        Interval between the times, the first of which is 0 [s].
    of_velocity : bool
        Whether velocities are compared.
    """

    periods: Float
    spectrum: SingleComplex
    lines: NDArray[np.intp]
    count: int
    within: int
    step: float
    of_velocity: bool


def octaves(signal: Signal, periods: Float, fineness: int) -> Iterator[Octave]:
    """Cut the periods into octaves, and for each the signal down to what its wavelets see."""
    numbers = np.floor(np.log2(periods / periods[0]) + 1e-9).astype(int)
    for number in range(int(numbers[-1]) + 1):
        chosen = periods[numbers == number]
        if chosen.size == 0:
            continue
        wanted = padded_size(math.ceil(fineness * signal.period / float(chosen[0])))
        count = min(wanted, signal.padded)
        highest = math.floor((_HIGHEST - 1.0 / _FINENESS) * signal.period / float(chosen[-1]))
        bins = min(count // 2, highest)
        lines = np.outer(chosen * (_FINENESS / signal.period), np.arange(bins))
        step = signal.period / count
        yield Octave(
            periods=chosen,
            spectrum=np.atleast_2d(signal.spectrum)[:, :bins].astype(np.complex64),
            lines=np.rint(lines, out=lines).astype(np.intp),
            count=count,
            within=int(signal.duration / step) + 1,
            step=step,
            of_velocity=signal.weighting.of_velocity,
        )


def correlations(octave: Octave, span: str, half_cycles: float | None) -> Single:
    """Return inner products with the parts of a wavelet at all times, up to a factor.

    Parameters
    ----------
    octave : Octave
        Periods and spectrum.
    span : str
        Name of the wavelet whose parts are taken.
    half_cycles : float or None
        Their number.

    Returns
    -------
    array, shape (signals, periods, parts, times)
        Times the square root of the period and over `step`: the coefficients with the weight of
        energy.
    """
    shape = _shape(span, half_cycles, octave.of_velocity)
    rows, bins = octave.lines.shape
    sizes = (octave.spectrum.shape[0], rows, shape.shape[0], octave.count // 2 + 1)
    table = np.empty(sizes, dtype=np.complex64)
    table[..., bins:] = 0.0
    for i, part in enumerate(shape):
        seen = np.take(part, octave.lines, mode="clip")
        np.multiply(seen, octave.spectrum[:, None, :], out=table[:, :, i, :bins])
    return np.asarray(scipy.fft.irfft(table, octave.count, overwrite_x=True))


@lru_cache(maxsize=64)
def _shape(span: str, half_cycles: float | None, of_velocity: bool) -> SingleComplex:
    """Conjugate spectra of the parts with unit energy, over nu in steps of 1 / _FINENESS."""
    energies = np.array(part_energies(span, half_cycles, of_velocity))
    lines = _HIGHEST * _FINENESS
    spectra = np.stack(part_spectra(span, half_cycles, 1.0 / _FINENESS, lines, of_velocity))
    return np.asarray(np.conj(spectra) / np.sqrt(energies)[:, None], dtype=np.complex64)


def _spans(wavelets: Sequence[str]) -> list[str]:
    """Names of the wavelets whose parts are wanted: the Rickers of both phases serve three."""
    rickers = [name for name in wavelets if name in RICKERS or name == _ANY_PHASE]
    others = [name for name in wavelets if name not in rickers]
    if len(rickers) == 1:
        return rickers + others
    return ([_ANY_PHASE] if rickers else []) + others


def _numbers(wavelet: str, half_cycles: Sequence[float]) -> list[float | None]:
    return [*half_cycles] if WAVELETS[wavelet].has_half_cycles else [None]


def _powers(products: Single, span: str, wavelets: Sequence[str]) -> Iterator[tuple[str, Single]]:
    """Squares of the coefficients of the wavelets that a span holds; `products` are used up."""
    squares = np.square(products, out=products)
    if span in RICKERS:
        yield span, squares[:, :, 0]
        return
    if span == _ANY_PHASE:
        for i, name in enumerate(RICKERS):
            if name in wavelets:
                yield name, squares[:, :, i]
    if span in wavelets:
        yield span, np.add(squares[:, :, 0], squares[:, :, 1], out=squares[:, :, 0])


def _largest(power: Single, octave: Octave) -> Float:
    """Largest value over the times and when, from the parabola through it and its neighbours.

    Of shape (2, signals, periods): heights and times.
    """
    scale = octave.periods / octave.step**2
    rows = power.reshape(-1, power.shape[-1])
    every = np.arange(rows.shape[0])
    top = rows.argmax(axis=-1)

    def beside(offset: int) -> Float:
        return np.asarray(rows[every, inner + offset], dtype=np.float64)

    def shaped(height: Float, time: Float) -> Float:
        shape = power.shape[:-1]
        return np.stack([height.reshape(shape) * scale, time.reshape(shape) * octave.step])

    if octave.within < 3:
        inner = top
        return shaped(beside(0), top)
    inner = np.minimum(np.maximum(top, 1), octave.within - 2)
    before, here, after = beside(-1), beside(0), beside(1)
    bend = 2.0 * here - before - after
    located = (top == inner) & (bend > 0.0)
    shift = np.where(located, 0.5 * (after - before) / np.where(located, bend, 1.0), top - inner)
    raised = here + np.where(located, 0.25 * (after - before) * shift, 0.0)
    ends = np.where(top < inner, before, after)
    return shaped(np.where(located | (top == inner), raised, ends), inner + shift)
