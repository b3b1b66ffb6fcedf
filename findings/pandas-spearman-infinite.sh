#!/usr/bin/env bash
# Question: four of ten structures overturn, so their peaks are infinite. Spearman's rank correlation of a parameter with
# the peaks, by DataFrame.corr(method="spearman")?
# Guess: infinity has the largest rank, as in SciPy: -0.53.
# Came (pandas 3.1.1): +1.00, without a warning. Series.corr of the same two columns by the same method is -0.53, as are
# SciPy and polars. DataFrame.corr leaves out what is infinite; for Kendall's it does so, too.
# Why it hurts: the sensitivity of those that stand is taken for that of all, here with the opposite sign.
# This package: members that overturn have the largest rank: tests/rocking/test_spreads.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check pandas==3.1.1 numpy==2.4.6 scipy==1.17.1 \
    polars==2.1.0
cd "$work"
"$work/venv/bin/python" -W error - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
import polars as pl
from scipy.stats import kendalltau, spearmanr

print(*(f"{name} {version(name)}" for name in ("pandas", "scipy", "polars")))
width = np.array([1.05, 1.06, 1.07, 1.08, 1.09, 1.10, 1.01, 1.02, 1.03, 1.04])
peak = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, *4 * [np.inf]])  # the four narrowest overturn
frame = pd.DataFrame({"width": width, "peak": peak})
for method, other in (("spearman", spearmanr), ("kendall", kendalltau)):
    table = frame.corr(method=method).loc["width", "peak"]
    series = frame["width"].corr(frame["peak"], method=method)
    right = other(width, peak).statistic
    print(f"{method}: DataFrame.corr {table:+.2f}, Series.corr {series:+.2f}, SciPy {right:+.2f}")
    assert table > 0.99 and series < -0.2 and abs(series - right) < 1e-12
in_polars = pl.DataFrame({"w": width, "p": peak}).select(pl.corr("w", "p", method="spearman")).item()
print(f"polars: {in_polars:+.2f}")
assert abs(in_polars - spearmanr(width, peak).statistic) < 1e-12
PYTHON
