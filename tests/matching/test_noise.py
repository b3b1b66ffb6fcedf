"""Errors of pulses of each kind that were added to coloured noise.

``python -m tests.matching.test_noise`` prints them in a table.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from rockframe.matching.match import match_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.pulse import Pulse

STEP = 0.02
TIME = STEP * np.arange(1500, dtype=np.float64)
KINDS = (
    ("symmetric_ricker", 0.0, None),
    ("antisymmetric_ricker", math.pi, None),
    ("ricker_any_phase", 0.9, None),
    ("mavroeidis_papageorgiou", 2.0, 1.6),
)
#: Energy of the pulse over that of the noise: allowed bias and spread of ln T_p and ln a_p over
#: 24 records. The largest measured ones were 0.005 and 0.044, 0.012 and 0.082.
LIMITS = {10.0: (0.01, 0.05), 3.0: (0.02, 0.1)}


def coloured(random: np.random.Generator) -> np.ndarray:
    """Return noise of a soil of 1 to 4 Hz that swells and fades."""
    frequency = np.fft.rfftfreq(TIME.size, STEP)
    soil = random.uniform(1.0, 4.0)
    colour = frequency / np.hypot(0.2, frequency) / np.hypot(1.0 - (frequency / soil) ** 2, 1.0)
    noise = np.fft.irfft(colour * np.fft.rfft(random.normal(size=TIME.size)), TIME.size)
    return np.asarray(noise * (TIME / 8.0) ** 2 * np.exp(2.0 - TIME / 4.0))


def errors(kind: tuple[str, float, float | None], ratio: float, count: int) -> np.ndarray:
    """Return the errors of ln T_p, ln a_p and time over T_p."""
    wavelet, phase, half_cycles = kind
    found = []
    for seed in range(count):
        random = np.random.default_rng([seed, 11])
        planted = Pulse(
            wavelet=wavelet,
            a_p=1.0,
            T_p=random.uniform(0.5, 2.0),
            time=random.uniform(6.0, 14.0),
            phase=phase,
            half_cycles=half_cycles,
        )
        pulse, noise = planted.acceleration(TIME), coloured(random)
        noise *= math.sqrt(float(pulse @ pulse) / float(noise @ noise) / ratio)
        match = match_pulses(pulse + noise, STEP, PulseOptions(wavelet=(wavelet,)))[wavelet]
        found.append(
            [
                math.log(match.pulse.T_p / planted.T_p),
                math.log(match.pulse.a_p / planted.a_p),
                (match.pulse.time - planted.time) / planted.T_p,
            ]
        )
    return np.array(found)


@pytest.mark.parametrize("ratio", LIMITS)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind[0])
def test_bias_and_spread(kind: tuple[str, float, float | None], ratio: float) -> None:
    off = errors(kind, ratio, 24)
    bias, spread = LIMITS[ratio]
    assert np.abs(off[:, :2].mean(axis=0)).max() < bias
    assert off[:, :2].std(axis=0).max() < spread
    assert np.abs(off[:, 2]).max() < 0.1


def table() -> None:
    print(
        "wavelet                  energy    bias ln T_p  ln a_p    spread ln T_p  ln a_p  time/T_p"
    )
    for kind in KINDS:
        for ratio in (100.0, 10.0, 3.0, 1.0):
            off = errors(kind, ratio, 24)
            bias, spread = off.mean(axis=0), off.std(axis=0)
            print(
                f"{kind[0]:24s} {ratio:6g}   {bias[0]:+11.3f}  {bias[1]:+6.3f}   "
                f"{spread[0]:13.3f}  {spread[1]:6.3f}  {spread[2]:6.3f}"
            )


if __name__ == "__main__":
    table()
