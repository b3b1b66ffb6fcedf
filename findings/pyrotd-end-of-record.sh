#!/usr/bin/env bash
# Question: is the spectrum of pyrotd right at long periods, if the motion is a pulse near the end of the record?
# Guess: yes, or slightly low, because the free vibration after the record is not counted.
# Came (pyrotd 0.6.1), pulse of 1 s, SA / exact at T = 0.5, 1, 2, 5, 10 s: 0.906 3.722 0.292 0.199 0.173.
# The response is computed by FFT without zeros behind the record, so what vibrates after its end comes in again at
# its beginning: too small where it cancels, and too large where the record is a multiple of the period.
# Why it hurts: SA and RotD of pulses and of records that were cut short are wrong from 1 s on, in both senses.
# This package: integrates in time from rest; tests/signals/test_response_spectrum.py has this case.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check pyrotd==0.6.1 numpy==2.4.6 scipy==1.17.1 numba==0.68.1
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyrotd
from scipy import signal

print("pyrotd", version("pyrotd"))
step, periods = 0.01, np.array([0.5, 1.0, 2.0, 5.0, 10.0])
pulse = np.sin(2.0 * np.pi * np.arange(101) * step)


def exact(motion, period, damping=0.05):
    """Return the pseudo-spectral acceleration of a motion that is straight between its samples."""
    w = 2.0 * np.pi / period
    system = ([[0.0, 1.0], [-w * w, -2.0 * damping * w]], [[0.0], [-1.0]], [[1.0, 0.0]], [[0.0]])
    _, u, _ = signal.lsim(system, motion, np.arange(motion.size) * step)
    return w * w * np.abs(u).max()


for name, before, expected in (("record of 1 s", 0, None), ("pulse at the end of 30 s", 2900, None)):
    motion = np.concatenate([np.zeros(before), pulse])
    with_rest = np.concatenate([motion, np.zeros(20000)])
    ours = pyrotd.calc_spec_accels(step, motion, 1.0 / periods, 0.05).spec_accel
    padded = pyrotd.calc_spec_accels(step, with_rest, 1.0 / periods, 0.05).spec_accel
    forced = np.array([exact(motion, period) for period in periods])
    true = np.array([exact(with_rest, period) for period in periods])
    print(name, "T", periods)
    print("  pyrotd / exact during the record      ", np.round(ours / forced, 3))
    print("  pyrotd / exact with free vibration    ", np.round(ours / true, 3))
    print("  pyrotd with 200 s of zeros / exact    ", np.round(padded / true, 3))
    if before == 0:
        assert abs(ours[1] / true[1] - 3.72) < 0.05 and ours[3] / true[3] < 0.25
    assert np.all(np.abs(padded / true - 1.0) < 0.05)
PYTHON
