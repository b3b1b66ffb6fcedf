#!/usr/bin/env bash
# Question: half of the structures overturn, so their peaks are infinite. What is the median of 0.3, 0.5, infinite,
# infinite, and what are the quantiles of ten peaks of which four are infinite?
# Guess: the median is infinite, the 84 % quantile NaN (infinite minus infinite), all others are right.
# Came: np.median is infinite, np.quantile(..., 0.5) NaN with a RuntimeWarning (numpy 2.4.6), and so in pandas 3.1.1 and
# xarray 2026.9.0. The weighted quantiles of xarray are all NaN, even that of 16 %. DuckDB 2.0.1: quantile_cont is right,
# approx_quantile leaves out what is infinite: 0.15, 0.35 and 0.55 instead of 0.24, 0.55 and infinite. SciPy 1.17.1 and
# polars 2.1.0 are right.
# Why it hurts: NaN is left out by the next step (nanmean, a plot, a maximum), so structures that overturn vanish; and
# what the approximate quantile leaves is the distribution of those that stand.
# This package: a quantile is a member, and infinite where it falls on one that overturns: tests/rocking/test_ensemble.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check pandas==3.1.1 numpy==2.4.6 scipy==1.17.1 \
    polars==2.1.0 xarray==2026.9.0 duckdb==2.0.1
cd "$work"
"$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import scipy.stats
import xarray as xr

print(*(f"{name} {version(name)}" for name in ("numpy", "pandas", "xarray", "scipy", "polars", "duckdb")))
few = np.array([0.3, 0.5, np.inf, np.inf])
ten = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, *4 * [np.inf]])
shares = [0.16, 0.5, 0.84]
median = {"np.median": np.median(few), "np.quantile": np.quantile(few, 0.5), "pandas": pd.Series(few).quantile(0.5),
          "xarray": float(xr.DataArray(few).quantile(0.5)), "scipy": float(scipy.stats.quantile(few, 0.5)),
          "polars": pl.Series(few).quantile(0.5, interpolation="linear")}
print("median of", few, *(f"{name} {value:.2f}" for name, value in median.items()))
array = xr.DataArray(ten, dims="member")
weighted = array.weighted(xr.ones_like(array)).quantile(shares).values
peaks = pd.DataFrame({"peak": ten})
[exact], [rough] = (duckdb.sql(f"select {name}(peak, [0.16, 0.5, 0.84]) from peaks").fetchall()[0]
                    for name in ("quantile_cont", "approx_quantile"))
print("16, 50 and 84 % of ten: numpy", np.quantile(ten, shares), "xarray, weighted", weighted,
      "scipy", scipy.stats.quantile(ten, shares), "DuckDB", exact, "approximately", np.round(rough, 2))
assert all(np.isnan(median[name]) for name in ("np.quantile", "pandas", "xarray"))
assert all(np.isinf(median[name]) for name in ("np.median", "scipy", "polars"))
assert np.isnan(weighted).all() and np.isnan(np.quantile(ten, 0.84)) and np.isinf(exact[2]) and rough[2] < 0.6
PYTHON
