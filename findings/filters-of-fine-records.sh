#!/usr/bin/env bash
# Question: a record is band-passed from its low corner to 20 Hz (order 4, both ways) by eqsig and by gmspy. Does it
# matter whether it has 100, 200 or 500 samples/s?
# Guess: no: corner and order are those of common practice, and PGA and PGV show nothing.
# Came (eqsig 1.2.17, gmspy 0.1.3), PGD / right one, the same in both: 100 samples/s 1.00 at 0.05 Hz; 200 samples/s 1.40
# at 0.05 Hz, 1.06 at 0.02 Hz; 500 samples/s 4.2 at 0.2 Hz, 118 at 0.1 Hz, 374 at 0.05 Hz. PGA is right within 0.3 % in
# all of these, and PGV within 3 % in the first four. The last digit of a corner changes these numbers.
# Both write the filter as one ratio of polynomials, whose roots lie so close together that double precision moves them;
# sections of second order (SciPy's output="sos") do not have this.
# Why it hurts: displacements, drifts of soft structures and long-period spectra of 200 to 500 samples/s are wrong while
# the accelerations look right.
# This package: filters with sections of second order; tests/signals/test_signals.py has records at 500 samples/s.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check eqsig==1.2.17 gmspy==0.1.3 numpy==2.4.6 \
    scipy==1.17.1
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import eqsig
import numpy as np
from gmspy import freq_filt
from scipy import signal
from scipy.integrate import cumulative_trapezoid

print("eqsig", version("eqsig"), "gmspy", version("gmspy"), "scipy", version("scipy"))


def record(rate):
    """Return a motion of 60 s from 0.1 to 20 Hz, with PGA 3 m/s2."""
    time = np.arange(round(60 * rate)) / rate
    noise = np.random.default_rng(5).standard_normal(time.size)
    sections = signal.butter(2, [0.1, 20.0], "band", fs=rate, output="sos")
    motion = signal.sosfiltfilt(sections, noise) * np.exp(-(((time - 20.0) / 5.0) ** 2))
    return 3.0 * motion / np.abs(motion).max()


def peaks(motion, rate):
    """Return PGA, PGV and PGD."""
    velocity = cumulative_trapezoid(motion, dx=1.0 / rate, initial=0.0)
    displacement = cumulative_trapezoid(velocity, dx=1.0 / rate, initial=0.0)
    return np.array([np.abs(values).max() for values in (motion, velocity, displacement)])


ratios = {}
for rate, corner in ((100, 0.05), (200, 0.05), (200, 0.02), (500, 0.2), (500, 0.1), (500, 0.05)):
    motion = record(rate)
    sections = signal.butter(4, [corner, 20.0], "band", fs=rate, output="sos")
    right = peaks(signal.sosfiltfilt(sections, motion), rate)
    filtered = eqsig.AccSignal(motion, 1.0 / rate)
    filtered.butter_pass([corner, 20.0])
    by_eqsig = peaks(filtered.values, rate) / right
    by_gmspy = peaks(freq_filt(1.0 / rate, motion, freq1=corner, freq2=20.0), rate) / right
    ratios[rate, corner] = by_eqsig
    print(f"{rate} samples/s, {corner} Hz: PGA, PGV, PGD / right: eqsig", np.round(by_eqsig, 3), "gmspy",
          np.round(by_gmspy, 3))
    assert np.allclose(by_eqsig, by_gmspy, rtol=0.2)
assert all(abs(ratio[0] - 1.0) < 0.01 for ratio in ratios.values())
assert abs(ratios[100, 0.05][2] - 1.0) < 0.02 and abs(ratios[500, 0.2][1] - 1.0) < 0.1
assert min(ratios[500, 0.2][2], ratios[500, 0.1][2]) > 2.0 and ratios[500, 0.05][2] > 50.0
PYTHON
