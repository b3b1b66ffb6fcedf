"""The stretch of a record in which a pulse can be strong enough, and that around a pulse.

A coefficient is the length of the projection of the record on a wavelet. Its square is therefore at
most the record's energy where the wavelet is not zero (Cauchy-Schwarz).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.loops import strong_blocks
from rockframe.matching.signal import Signal, padded_signal, padded_size
from rockframe.wavelets.family import WAVELETS

Float = NDArray[np.float64]

#: Share of the least energy that suffices: a few thousandths of a wavelet's energy lie in what the
#: times of the search add at its ends.
_SAFE: Final = 0.98
#: How much longer and later a maximum may be, relative to the period, than the point from which
#: the samples around it were cut, and the samples beside them, which fade: a sudden end would
#: disturb what lies between the samples, and move flat maxima by 5e-5.
_LONGER: Final = 1.15
_LATER: Final = 0.25
_BESIDE: Final = 64
_RISE: Final = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _BESIDE))
#: How much larger its number of half cycles.
_MORE: Final = 0.5


def strong_stretch(signal: Signal, far: Float, floor: Float) -> tuple[Signal, NDArray[np.intp]]:
    """Cut records to where wavelets can explain as much as `floor`; also return their indices.

    Parameters
    ----------
    signal : Signal
        The records, at the times of the search.
    far : array, shape (2,)
        Distances from the centre within which the wavelet's energy lies, and beyond which it is
        zero [s].
    floor : array, shape (signals,)
        Least energy.
    """
    if not floor.any():
        return signal, np.arange(floor.size)
    half = math.ceil(far[0] / signal.time_step) + 1
    block = max(1, half // 4)
    ends = np.empty((floor.size, 2), dtype=np.intp)
    strong_blocks(signal.samples, block, -(-half // block), _SAFE * floor / signal.time_step, ends)
    rows = np.flatnonzero(ends[:, 1])
    if rows.size == 0:
        return signal, rows
    first, last = int(ends[rows, 0].min()), int(ends[rows, 1].max())
    least = last - first + math.ceil(far[1] / signal.time_step)
    padded = 2 * scipy.fft.next_fast_len(-(-least // 2), real=True)
    samples, start = signal.samples[rows, first:last], first * signal.time_step
    return padded_signal(samples, signal.time_step, signal.weighting, padded, start), rows


def cut_around(
    signal: Signal, wavelet: str, period: float, time: float, half_cycles: float | None
) -> Signal:
    """Cut a record to the samples around a pulse; its wavelet is zero outside them.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name.
    period, time : float
        T_p and centre [s].
    half_cycles : float or None
        Number of half cycles.
    """
    reach = period * _reach(wavelet, half_cycles and half_cycles + _MORE) * _LONGER
    beside = (reach + _LATER * period) / signal.time_step + _BESIDE
    middle, size = time / signal.time_step, signal.samples.size
    first, last = max(0, math.floor(middle - beside)), min(size, math.ceil(middle + beside) + 1)
    samples = signal.samples[first:last].copy()
    if first > 0:
        samples[:_BESIDE] *= _RISE
    if last < size:
        samples[-_BESIDE:] *= _RISE[::-1]
    padded = padded_size(last - first + math.ceil(reach / signal.time_step))
    start = first * signal.time_step
    return padded_signal(samples, signal.time_step, signal.weighting, padded, start)


def holds(
    cut: Signal,
    signal: Signal,
    wavelet: str,
    period: float,
    time: float,
    half_cycles: float | None,
) -> bool:
    """Return True if samples hold a pulse whole, or what the record has of it.

    Parameters
    ----------
    cut, signal : Signal
        Result of `cut_around`, and the record.
    wavelet, period, time, half_cycles
        As those of `cut_around`.
    """
    reach, faded = period * _reach(wavelet, half_cycles), _BESIDE * cut.time_step
    first, last = cut.start, cut.start + cut.duration
    whole = first == 0.0 or time - reach > first + faded
    whole &= last > signal.duration - 0.5 * cut.time_step or time + reach < last - faded
    return whole and cut.period - cut.duration > reach


def _reach(wavelet: str, half_cycles: float | None) -> float:
    return max(part.reach for part in WAVELETS[wavelet].parts(half_cycles))
