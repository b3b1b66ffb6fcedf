#!/usr/bin/env bash
# Question: what rate of collapse gives pyFragility for a lognormal fragility and a hazard curve of 8 to 20 points?
# Guess: within 10 % of the integral, because every program joins hazard points by straight lines in log-log.
# Came (pyFragility 0.2.0), over the exact rate: 114.8 with 8 points, 32.0 with 10, 4.9 with 20.
# A cubic spline through the rates themselves (not their logarithms) swings between the points, and is extended below
# the first point down to 0.01 g; the size of each swing is added.
# Why it hurts: rates are 5 to 115 times too large from an ordinary table of hazard, with a correct fragility.
# This package: joins the points in log-log, inside the table only; tests/risk/test_hazard.py has this case.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check pyFragility==0.2.0 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyFragility as pf

print("pyFragility", version("pyFragility"))
slope, scale, median, spread = 2.5, 1e-4, 0.8, 0.4
exact = scale * median**-slope * np.exp(0.5 * (slope * spread) ** 2)
print(f"hazard {scale:g} * im^-{slope:g} a year, median {median} g, spread {spread}: exact rate {exact:.3e} a year")
tables = {
    "8 points, 0.05 to 1.5 g": np.array([0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5]),
    "10 points, 0.05 to 2 g": np.array([0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 2.0]),
    "20 points, 0.0025 to 2.13 g": np.geomspace(0.0025, 2.13, 20),
}
ratios = []
for name, im in tables.items():
    hazard = pf.HazardCurve(im, scale * im**-slope)
    rate = pf.mean_annual_frequency(pf.LognormalFragility(median, spread), hazard)
    inside = pf.mean_annual_frequency(
        pf.LognormalFragility(median, spread), hazard, im_grid=np.linspace(im[0], im[-1], 500))
    ratios.append(rate / exact)
    print(f"{name}: {rate:.3e}, {rate / exact:.1f} times the exact rate; "
          f"summed inside the table only {inside / exact:.2f} times")
assert ratios[0] > 100.0 and ratios[1] > 25.0 and ratios[2] > 4.0
PYTHON
