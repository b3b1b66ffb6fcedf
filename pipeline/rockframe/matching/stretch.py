"""Cuts of a record: to the times at which a pulse can be strong enough, and around a pulse.

A coefficient is the length of the projection of the record on a wavelet. Its square is therefore at
most the energy of the record in the time in which the wavelet is not zero (Cauchy-Schwarz).
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

#: Factor of the least energy, for safety: at the coarse times of the search, a few thousandths of a
#: wavelet's energy are outside the times in which it is not zero.
_SAFE: Final = 0.98
#: Number of samples kept on either side of the times of the search. Without high frequencies a
#: record that ends suddenly rings beyond its end, and wavelets there need what rings.
_RINGING: Final = 8
#: Room around a pulse, so that a maximum may move during refinement: factor of the period, shift in
#: time relative to the period, and increase of the number of half cycles.
_LONGER: Final = 1.15
_LATER: Final = 0.25
_MORE: Final = 0.5
#: Number of further samples at either end, and their taper. A sudden end would change the
#: interpolation between samples, and move flat maxima by 5e-5.
_BESIDE: Final = 64
_RISE: Final = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _BESIDE))


def strong_stretch(
    signal: Signal, within: int, far: Float, floor: Float
) -> tuple[Signal, NDArray[np.intp], range, Float]:
    """Cut records to the times at which wavelets can explain at least an energy.

    Returns the cut records that have such times, all of one length; their indices; the indices of
    their samples at these times; and the first of these times [s].

    Parameters
    ----------
    signal : Signal
        The records, at the times of the search and, cyclically, beyond.
    within : int
        Number of samples at the times of the search.
    far : array, shape (2,)
        Two distances from the centre [s]: nearly all energy of the wavelet is within the first, and
        it is zero beyond the second.
    floor : array, shape (signals,)
        The least energy of each record.
    """
    if not floor.any():
        return signal, np.arange(floor.size), range(within), np.zeros(floor.size)
    half = math.ceil(far[0] / signal.time_step) + 1
    block = max(1, half // 4)
    ends = np.empty((floor.size, 2), dtype=np.intp)
    least = _SAFE * floor / signal.time_step
    strong_blocks(signal.samples, within, block, -(-half // block), least, ends)
    rows = np.flatnonzero(ends[:, 1])
    if rows.size == 0:
        return signal, rows, range(0), np.zeros(0)
    longest = int((ends[rows, 1] - ends[rows, 0]).max())
    first = np.minimum(ends[rows, 0], within - longest)
    times = range(_RINGING, _RINGING + longest)
    size = times.stop + _RINGING
    padded = 2 * scipy.fft.next_fast_len(
        -(-(size + math.ceil(far[1] / signal.time_step)) // 2), real=True
    )
    places = (first[:, None] + np.arange(-_RINGING, size - _RINGING)) % signal.padded
    samples = signal.samples[rows[:, None], places]
    cut = padded_signal(samples, signal.time_step, signal.weighting, padded)
    return cut, rows, times, first * signal.time_step


def cut_around(
    signal: Signal, wavelet: str, period: float, time: float, half_cycles: float | None
) -> Signal:
    """Cut a record to the samples around a pulse, outside of which its wavelet is zero.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name of the wavelet.
    period, time : float
        T_p and centre of the pulse [s].
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
    """Return True if a cut contains all of a pulse that is within the record.

    Parameters
    ----------
    cut, signal : Signal
        Result of `cut_around`, and the record.
    wavelet, period, time, half_cycles
        Parameters of the pulse, as in `cut_around`.
    """
    reach, faded = period * _reach(wavelet, half_cycles), _BESIDE * cut.time_step
    first, last = cut.start, cut.start + cut.duration
    whole = first == 0.0 or time - reach > first + faded
    whole &= last > signal.duration - 0.5 * cut.time_step or time + reach < last - faded
    return whole and cut.period - cut.duration > reach


def _reach(wavelet: str, half_cycles: float | None) -> float:
    return max(part.reach for part in WAVELETS[wavelet].parts(half_cycles))
