#!/usr/bin/env bash
# Question: two components of one record have 6,000 samples at 0.005 s; one time axis was made as i * 0.005, the other
# as i / 200 (or by adding steps). How many samples has their sum in xarray?
# Guess: 6,000; or an error, if the axes differ.
# Came (xarray 2026.9.0): 5180 samples; 19 with steps added; 240 with an axis read in single precision.
# Axes are joined by exact equality of floating-point numbers; what differs in the last digit is dropped silently, and a
# Dataset of both has up to twice the samples with NaN between.
# Why it hurts: peaks of resultants and RotD of two components are taken from what is left; no warning is printed.
# rockframe: components are arrays with one stated step, cut to common samples by index and start time.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check xarray==2026.9.0 numpy==2.4.6 pandas==3.1.1
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import xarray as xr

print("xarray", version("xarray"))
count, step = 6000, 0.005
axes = {
    "i / 200": np.arange(count) / 200.0,
    "steps added": np.cumsum(np.full(count, step)) - step,
    "read in single precision": (np.arange(count) * step).astype(np.float32).astype(float),
}
rng = np.random.default_rng(2)
north = xr.DataArray(rng.standard_normal(count), {"time": np.arange(count) * step}, name="north")
east = rng.standard_normal(count)
whole = float(np.hypot(north.values, east).max())
left = {}
for name, axis in axes.items():
    other = xr.DataArray(east, {"time": axis})
    resultant = np.sqrt(north**2 + other**2)
    together = xr.Dataset({"north": north, "east": other})
    left[name] = resultant.sizes["time"]
    print(f"i * 0.005 with {name}: {left[name]} of {count} samples are left, peak of the resultant "
          f"{float(resultant.max()):.3f} (true {whole:.3f}); Dataset of both: {together.sizes['time']} samples")
assert left["i / 200"] == 5180 and left["steps added"] < 30 and left["read in single precision"] == 240
PYTHON
