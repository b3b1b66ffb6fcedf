#!/usr/bin/env bash
# Question: is a record of 128 samples/s, written and read as SAC by obspy, the same record?
# Guess: yes: 1/128 s is an exact number in the single precision of SAC's header.
# Came (obspy 1.5.1): samples/s 128.00819252432154, end of 600 s shifted by -0.0384 s; one warning says that it rounds.
# The reader rounds the step to microseconds, and so changes every step that is no whole number of them.
# Why it hurts: the SAC file and the miniSEED file of one record cannot be merged, and components of the two kinds
# cannot be rotated; after 10 minutes the clocks differ by five samples.
# This package: reads the step of SAC headers itself, as it stands; tests/ingest/test_sac.py has this case.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check obspy==1.5.1 numpy==2.4.6 'setuptools<81'
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import obspy
from obspy import Stream, Trace

print("obspy", version("obspy"))
trace = Trace(np.sin(np.arange(128 * 600)).astype(np.float32), {"sampling_rate": 128.0, "channel": "HNE"})
trace.write("record.sac", format="SAC")
trace.write("record.mseed", format="MSEED")
sac, miniseed = obspy.read("record.sac")[0], obspy.read("record.mseed")[0]
late = sac.stats.endtime - trace.stats.endtime
print("samples/s from SAC", sac.stats.sampling_rate, "from miniSEED", miniseed.stats.sampling_rate)
print("step in the header", float(np.float32(sac.stats.sac.delta)), "step of the trace", sac.stats.delta)
print("end of 600 s shifted by", round(late, 4), "s")
north = miniseed.copy()
north.stats.channel = "HNN"
messages = []
for act in (lambda: Stream([sac, north]).rotate("NE->RT", back_azimuth=30.0),
            lambda: Stream([sac, miniseed]).merge()):
    try:
        act()
    except Exception as error:
        messages.append(str(error))
        print(type(error).__name__ + ":", error)
assert sac.stats.delta == 0.007812 and miniseed.stats.delta == 0.0078125
assert abs(late + 0.0384) < 0.001 and len(messages) == 2
PYTHON
