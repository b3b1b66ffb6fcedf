#!/usr/bin/env bash
# Question: does konno_ohmachi_smoothing of obspy, with its defaults, leave a flat Fourier spectrum flat?
# Guess: yes: a smoothing divides by the sum of its weights, whatever its scale.
# Came (obspy 1.5.1): 'from 1.0 to 53.8'; peak at 8.18 Hz (true 2.38), kappa 0.0209 s (true 0.04), 120.4 times at 10 Hz.
# normalize=False, the default, means weights that are not divided by their sum, which grows with frequency.
# Why it hurts: corner frequencies, kappa and noise ratios of smoothed spectra are wrong (kappa here by half), while a
# ratio of two spectra smoothed alike is right and hides it.
# This package: its corner compares mean powers of bands of signal and noise; it smooths no spectrum.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check obspy==1.5.1 numpy==2.4.6 'setuptools<81'
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from obspy.signal.konnoohmachismoothing import konno_ohmachi_smoothing

print("obspy", version("obspy"))
frequency = np.linspace(0.0, 50.0, 5001)[1:]
flat = konno_ohmachi_smoothing(np.ones(500), frequency[9::10], 40)
print("flat spectrum, smoothed: from", round(float(flat.min()), 2), "to", round(float(flat.max()), 1))
source = frequency**2 / (1.0 + frequency**2) * np.exp(-np.pi * 0.04 * frequency)
fit = (frequency > 10.0) & (frequency < 25.0)
results = {}
for normalize in (False, True):
    smooth = konno_ohmachi_smoothing(source, frequency, 40, normalize=normalize)
    kappa = -np.polyfit(frequency[fit], np.log(smooth[fit]), 1)[0] / np.pi
    results[normalize] = frequency[np.argmax(smooth)], kappa
    print(f"normalize={normalize}: peak at {results[normalize][0]:.2f} Hz "
          f"(true {frequency[np.argmax(source)]:.2f}), kappa {kappa:.4f} s (true 0.04), "
          f"{smooth[999] / source[999]:.1f} times the spectrum at 10 Hz")
assert flat.max() > 40.0 and flat.min() < 1.1
assert abs(results[False][1] - 0.0209) < 0.001 and results[False][0] > 7.0
assert abs(results[True][1] - 0.04) < 0.001
PYTHON
