#!/usr/bin/env bash
# Question: peaks are written to netCDF as packed integers (dtype, scale_factor and _FillValue of the encoding). What
# becomes of those that overturn, which are infinite?
# Guess: some wrong number, without an error.
# Came (xarray 2026.9.0, netCDF4 1.7.5.1): 0.0 in int16, and -2147483.648 in int32 with a scale of 0.001; "invalid value
# encountered in cast" is the only warning, and the next reader does not see it.
# Why it hurts: what overturns has moved by nothing, and is the safest of all.
# This package: peaks in its files are floating-point numbers: tests/stages/test_screen_members.py reads infinite ones.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check xarray==2026.9.0 netCDF4==1.7.5.1.post1 \
    numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
import xarray as xr

print(*(f"{name} {version(name)}" for name in ("xarray", "netCDF4", "numpy")))
peak = np.array([0.1, 0.2, np.inf])
came = {}
for kind in ("int16", "int32", "float64"):
    data = xr.Dataset({"peak": ("member", peak)})
    packed = {} if kind == "float64" else {"scale_factor": 0.001, "_FillValue": -32768}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        data.to_netcdf("peaks.nc", encoding={"peak": {"dtype": kind, **packed}})
    with xr.open_dataset("peaks.nc") as read:
        came[kind] = read["peak"].values
    print(kind, came[kind], "warnings:", [str(warning.message) for warning in caught])
assert came["int16"][2] == 0.0 and came["int32"][2] < -2e6 and np.isinf(came["float64"][2])
PYTHON
