#!/usr/bin/env bash
# Question: four of ten structures overturn, so their peaks are infinite. Where does the curve of seaborn.ecdfplot end?
# Guess: at 0.6: those that overturn are beyond every number, as in matplotlib and statsmodels.
# Came (seaborn 0.13.2): at 1.0, without a warning. The boxplot has the median 0.35 instead of 0.55, and the histogram six
# values: all of seaborn leaves out what is infinite. matplotlib's own ecdf passes 0.6 at the largest finite peak.
# Why it hurts: a distribution of peaks, or a fragility drawn from it, says that nothing overturns.
# This package: those that overturn count as larger than all others: tests/rocking/test_ensemble.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check seaborn==0.13.2 matplotlib==3.11.2 \
    pandas==3.1.1 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" -W error -W ignore::DeprecationWarning - <<'PYTHON'
from importlib.metadata import version

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import seaborn

print(*(f"{name} {version(name)}" for name in ("seaborn", "matplotlib")))
peak = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, *4 * [np.inf]])


def at_the_largest(line):
    """Return the height of a curve at the largest finite peak."""
    x, y = (np.asarray(values, dtype=float) for values in line.get_data())
    return float(y[np.isfinite(x)].max())


curve = at_the_largest(seaborn.ecdfplot(x=peak).lines[0])
own = at_the_largest(plt.subplots()[1].ecdf(peak))
plt.close("all")
medians = {float(line.get_ydata()[0]) for line in seaborn.boxplot(y=peak).lines[4:5]}
plt.close("all")
counted = sum(patch.get_height() for patch in seaborn.histplot(x=peak).patches)
print(f"curve at the largest finite peak: seaborn {curve:.1f}, matplotlib {own:.1f}; median of the box {medians}; "
      f"in the histogram {counted:.0f} of {peak.size}; share that stands {np.isfinite(peak).mean():.1f}")
assert curve == 1.0 and abs(own - 0.6) < 1e-9 and abs(medians.pop() - 0.35) < 1e-9 and counted == 6
PYTHON
