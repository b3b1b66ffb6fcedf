#!/usr/bin/env bash
# Question: measures of one record are computed, one after another. Does their order matter?
# Guess: no: functions of measures read the record.
# Came (gmimtools 0.2.0): after get_CAVstd_cy the record has zeros in every second whose peak is below 0.025 g.
# In a record of 40 s, 24 s are 0 afterwards: CAV 3.34 before and 3.13 m/s after, displacement at the end 0.012 and
# 0.257 m. What any other program computes from the array afterwards is wrong, too.
# Standardized CAV leaves quiet seconds out; the function does so in the caller's own array.
# Why it hurts: weak beginnings and ends are cut off with steps, so velocity and displacement drift; nothing is said.
# This package: no function changes its input; records are read-only arrays; tests/rocking/test_input.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check gmimtools==0.2.0 numpy==2.4.6 scipy==1.17.1 \
    pandas==2.3.3
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from gmimtools import gmim
from scipy import signal

print("gmimtools", version("gmimtools"))
step = 0.01
time = np.arange(4000) * step
noise = np.random.default_rng(5).standard_normal(time.size)
sections = signal.butter(2, [0.1, 20.0], "band", fs=100.0, output="sos")
record = signal.sosfiltfilt(sections, noise) * np.exp(-(((time - 15.0) / 6.0) ** 2))
record *= 1.0 / np.abs(record).max()  # PGA 1 m/s2


def measures(accelerations):
    """Return PGA [m/s2], PGV [m/s], Arias intensity [m/s], CAV [m/s] and the displacement at the end [m]."""
    velocity = np.cumsum(accelerations) * step
    return [round(float(value), 4) for value in (
        gmim.get_PGA_cy(accelerations), gmim.get_PGV_cy(accelerations, step),
        gmim.get_Ia_cy(accelerations, step)[0], gmim.get_CAV_cy(accelerations, step),
        np.sum(velocity) * step)]


original = record.copy()
before = measures(record)
again = measures(record)
gmim.get_CAVstd_cy(record, step)
after = measures(record)
changed = np.flatnonzero(record != original)
print("PGA, PGV, Arias, CAV, displacement at the end before", before)
print("after get_CAVstd_cy                                 ", after)
print("samples changed:", changed.size, "of", record.size, "in the seconds", sorted(set((changed // 100).tolist())))
assert before == again and changed.size > 1000 and not record[changed].any()
assert after[3] < 0.95 * before[3] and after[4] > 10.0 * before[4] and after[0] == before[0]
PYTHON
