#!/usr/bin/env bash
# Question: are the spectra of the package sdof (compiled, "parallel integration") right at 0.05 to 0.5 s for a record
# at 100 samples/s?
# Guess: within a few per cent; average acceleration with ten steps in a period shortens nothing that much.
# Came (sdof 0.0.12), SA / exact at T = 0.05, 0.1, 0.2, 0.3, 0.5 s: 0.3 0.371 2.631 1.152 0.999.
# Below 50 steps in a period it interpolates the record, but integrates it with the old, longer step.
# Why it hurts: the short-period plateau moves to longer periods; SA is up to 2.6 times too large, or a quarter.
# This package: solves straight pieces exactly; tests/signals/test_response_spectrum.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check sdof==0.0.12 numpy==2.4.6 scipy==1.17.1
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import sdof
from scipy import signal

print("sdof", version("sdof"))
step = 0.01
time = np.arange(3000) * step
noise = np.random.default_rng(5).standard_normal(time.size)
sections = signal.butter(3, [0.2, 20.0], "band", fs=100.0, output="sos")
motion = signal.sosfilt(sections, noise) * np.exp(-(((time - 12.0) / 4.0) ** 2))
periods = np.array([0.05, 0.1, 0.2, 0.3, 0.5, 1.0])


def exact(period, damping=0.05):
    """Return the peak displacement under the motion, straight between its samples."""
    w = 2.0 * np.pi / period
    system = ([[0.0, 1.0], [-w * w, -2.0 * damping * w]], [[0.0], [-1.0]], [[1.0, 0.0]], [[0.0]])
    dense = np.arange(20 * (time.size - 1) + 1) * step / 20.0
    _, u, _ = signal.lsim(system, np.interp(dense, time, motion), dense)
    return np.abs(u).max()


true = np.array([exact(period) for period in periods])
plain = np.asarray(sdof.spectrum(motion, step, 0.05, list(periods))[0][1])
ratio = plain / true
print("T [s]                     ", periods)
print("SA of sdof / exact        ", np.round(ratio, 3))
assert ratio[1] < 0.45 and ratio[2] > 2.3 and abs(ratio[5] - 1.0) < 0.01
PYTHON
