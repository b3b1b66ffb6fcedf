#!/usr/bin/env bash
# Question: the Sobol' sample was drawn without second-order indices; the analysis is called with its default. And then?
# Guess: an error about the number of runs, which is N (D + 2) and not N (2 D + 2).
# Came (SALib 1.6.0), 3 parameters: ST [1.1 1.17 1.22], right are [0.92 0.08 0.].
# With three parameters and N a power of two, as it must be, N (D + 2) is divisible by 2 D + 2: the runs are taken for
# those of another design. The same holds for one and seven parameters; with others the error comes.
# Why it hurts: a parameter that the model does not contain gets the largest total index.
# This package: its sensitivities are rank correlations of the members that it drew itself; no design is passed on.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check SALib==1.6.0 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

print("SALib", version("SALib"))
found = {}
for number in (2, 3, 4, 7):
    problem = {"num_vars": number, "names": list("abcdefg"[:number]), "bounds": [[0.0, 1.0]] * number}
    inputs = sampling.sample(problem, 1024, calc_second_order=False, seed=1)
    outputs = inputs[:, 0] + 0.3 * inputs[:, 1]
    right = analysis.analyze(problem, outputs, calc_second_order=False, seed=1)["ST"]
    try:
        found[number] = analysis.analyze(problem, outputs, seed=1)["ST"]
    except Exception as error:
        print(f"{number} parameters: {type(error).__name__}")
        continue
    print(f"{number} parameters: ST {np.round(found[number], 2)}, right are {np.round(right, 2)}")
assert set(found) == {3, 7} and found[3][2] > 1.0
PYTHON
