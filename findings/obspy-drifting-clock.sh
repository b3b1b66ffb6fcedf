#!/usr/bin/env bash
# Question: the headers of miniSEED records say 100 samples/s, and their start times show 99.9. What do readers say?
# Guess: one trace at 100 samples/s; somewhere there is a warning, or a gap, because 0.6 s are missing after 10 minutes.
# Came (obspy 1.5.1, pymseed 1.0.1): one trace, no gap, no warning; obspy ends at 599.990 s, pymseed at 600.587 s, and
# both say 100 samples/s. A pulse at 540.000 s of the clock is read at 539.460 s.
# Each record is compared with the one before it alone; half a sample is allowed each time, and adds up.
# Why it hurts: phases, delays between stations and pairs of components move by 0.5 s in ten minutes; times of the
# same sample differ between two readers that share one library.
# This package: compares the first and the last record, refuses the file and says which two rates it shows, until
# --trust header or --trust waveform chooses; tests/ingest/test_miniseed.py (records that drift) has this case.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check obspy==1.5.1 pymseed==1.0.1 numpy==2.4.6 \
    'setuptools<81'
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
import io
import warnings
from importlib.metadata import version

import numpy as np
import obspy
from obspy import Trace, UTCDateTime
from pymseed import MS3TraceList

print("obspy", version("obspy"), "pymseed", version("pymseed"))
start = UTCDateTime(2026, 1, 1)
stated, by_clock, count, in_record = 100.0, 99.9, 60000, 400
clock = np.arange(count) / by_clock
samples = np.round(1e6 * np.exp(-(((clock - 540.0) / 0.2) ** 2))).astype(np.int32)
with open("drift.mseed", "wb") as file:
    for first in range(0, count, in_record):
        header = {"network": "XX", "station": "A", "channel": "HNE", "sampling_rate": stated,
                  "starttime": start + first / by_clock}
        part = io.BytesIO()
        Trace(samples[first : first + in_record].copy(), header).write(part, format="MSEED", reclen=4096)
        file.write(part.getvalue())
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    stream = obspy.read("drift.mseed")
told = [str(warning.message) for warning in caught if "rate" in str(warning.message) or "time" in str(warning.message)]
[trace] = stream
peak = trace.times()[np.argmax(trace.data)]
end = trace.stats.endtime - start
print("obspy: traces", len(stream), "gaps", len(stream.get_gaps()), "warnings", told, "samples/s",
      trace.stats.sampling_rate, "end", round(end, 3), "peak at", round(float(peak), 3))
[segment] = [part for channel in MS3TraceList.from_file("drift.mseed") for part in channel]
other = UTCDateTime(segment.endtime_str()) - start
print("pymseed: segments 1 samples/s", segment.samprate, "end", round(other, 3), "last sample by the clock",
      round(float(clock[-1]), 3))
assert not told and not stream.get_gaps() and trace.stats.sampling_rate == segment.samprate == 100.0
assert abs(end - 599.99) < 1e-6 and abs(peak - 539.46) < 0.011 and other - end > 0.59
PYTHON
