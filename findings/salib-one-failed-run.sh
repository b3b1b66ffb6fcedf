#!/usr/bin/env bash
# Question: one of 5,120 model runs gives NaN (the structure fell over). What does SALib's Sobol' analysis say?
# Guess: NaN for the indices that this run enters, or an error.
# Came (SALib 1.6.0): S1 [0. 0. 0.], ST [0. 0. 0.], half intervals [0. 0. 0.], no warning; without the NaN 0.917 0.083 0.
# This is the answer that a constant response gets, too (there with warnings of division).
# Why it hurts: "no parameter matters, and that is certain" is read off, when one member in thousands had overturned.
# This package: overturned members have a verdict and a peak, so that its rank correlations take all members.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check SALib==1.6.0 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import warnings

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

print("SALib", version("SALib"))
problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.0, 1.0]] * 3}
inputs = sampling.sample(problem, 1024, calc_second_order=False, seed=1)
outputs = inputs[:, 0] + 0.3 * inputs[:, 1]
cases = {"all runs": outputs.copy(), "one NaN": outputs.copy(), "constant": np.full(outputs.size, 0.1)}
cases["one NaN"][5] = np.nan
totals = {}
for name, values in cases.items():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = analysis.analyze(problem, values, calc_second_order=False, seed=1)
    totals[name] = np.asarray(found["ST"])
    print(f"{name} ({values.size} runs): S1 {np.round(found['S1'], 3)}, ST {np.round(found['ST'], 3)}, "
          f"half interval of ST {np.round(found['ST_conf'], 3)}, warnings {len(caught)}")
    if name == "one NaN":
        assert len(caught) == 0 and not np.any(found["ST_conf"])
assert abs(totals["all runs"][0] - 0.917) < 0.01
assert not np.any(totals["one NaN"]) and not np.any(totals["constant"])
PYTHON
