#!/usr/bin/env bash
# Question: one object of ground-motion-tools is asked for SD(T1) at 1 s, and then at 3 s. What is the second answer?
# Guess: SD at 3 s: the period is an argument of the call.
# Came (0.3.1): 0.1913 and 0.1913; a new object, asked for 3 s alone, gives 0.0287.
# Measures are kept by their name, without the period: the first period that was asked for is used ever after, for SA
# and SV at T1, too.
# Why it hurts: measures of one record for several structures are all those of the first structure.
# This package: periods are an argument of spectral_acceleration, which keeps nothing.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check ground-motion-tools==0.3.1 numpy==2.4.6 scipy==1.17.1
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from ground_motion_tools.enums import GMIMEnum
from ground_motion_tools.im import GMIntensityMeasures

print("ground-motion-tools", version("ground-motion-tools"))
step = 0.01
time = np.arange(3000) * step
motion = np.sin(2.0 * np.pi * time) * np.exp(-(((time - 12.0) / 4.0) ** 2))
measures = GMIntensityMeasures(motion, step)
first, second = (float(measures.get_im(GMIMEnum.SD_T1, period=period)["SD_T1"][0]) for period in (1.0, 3.0))
fresh = float(GMIntensityMeasures(motion, step).get_im(GMIMEnum.SD_T1, period=3.0)["SD_T1"][0])
print(f"SD at 1 s {first:.4f}, then at 3 s {second:.4f}; a new object gives at 3 s {fresh:.4f}")
assert second == first and fresh < 0.2 * first
PYTHON
