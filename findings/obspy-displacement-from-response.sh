#!/usr/bin/env bash
# Question: what displacement gives remove_response(output="DISP") for an accelerometer that is flat to 100 Hz?
# Guess: the true one but for tapers and drift; the water level of 60 dB only stops division by almost zero.
# Came (obspy 1.5.1): PGD 0.4651, 0.1334, 0.0334 and 0.0083 of the true one for pulses of 0.5, 1, 2 and 4 s.
# The response to displacement grows with frequency squared, so 60 dB below its largest value is near 3 Hz (at
# 200 samples/s), and all motion below is cut. Output ACC, integrated twice, is right to 0.3 %.
# Why it hurts: PGD comes out 2 to 120 times too small, from a correct inventory, without a warning.
# This package: divides by the sensitivity or asks for ACC (--water-level-db), and integrates the corrected acceleration.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check obspy==1.5.1 numpy==2.4.6 'setuptools<81'
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from obspy import Trace
from obspy.core.inventory import Response

print("obspy", version("obspy"))
pole = -981.0 + 1009.0j
response = Response.from_paz(
    [], [pole, pole.conjugate()], stage_gain=1e5, stage_gain_frequency=1.0, input_units="M/S**2",
    output_units="COUNTS", normalization_frequency=1.0, normalization_factor=abs(pole) ** 2)
response.recalculate_overall_sensitivity(1.0)
step = 0.005
time = np.arange(12000) * step
for period, expected in ((0.5, 0.465), (1.0, 0.133), (2.0, 0.0334), (4.0, 0.0083)):
    shift = time - 30.0
    displacement = 0.1 * np.exp(-((2.5 * shift / period) ** 2)) * np.cos(2 * np.pi * shift / period)
    acceleration = np.gradient(np.gradient(displacement, step), step)
    trace = Trace(acceleration * 1e5, {"delta": step})
    trace.stats.response = response
    as_displacement = np.abs(trace.copy().remove_response(output="DISP").data).max() / 0.1
    no_level = np.abs(trace.copy().remove_response(output="DISP", water_level=None).data).max() / 0.1
    twice = trace.copy().remove_response(output="ACC").integrate().integrate()
    integrated = np.abs(twice.data).max() / 0.1
    print(f"pulse of {period} s, PGD over the true one: DISP {as_displacement:.4f}, "
          f"DISP with water_level=None {no_level:.4f}, ACC integrated twice {integrated:.4f}")
    assert abs(as_displacement / expected - 1.0) < 0.05, as_displacement
    assert abs(integrated - 1.0) < 0.01 and abs(no_level - 1.0) < 0.01
PYTHON
