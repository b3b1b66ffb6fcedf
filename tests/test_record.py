"""Records of obspy's traces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rockframe import Orientation, ParameterError, Record, bundled_records, read_file
from rockframe.ingest.obspy_plugin import PLUGINS


def trace(channel: str = "HNN", **header: object) -> Any:
    from obspy import Trace  # the plug-in has silenced obspy's warning of its own imports

    stated = {"network": "CI", "station": "CCC", "channel": channel, "delta": 0.01, **header}
    return Trace(np.array([0.0, 0.2, -0.1]), stated)


@pytest.mark.parametrize(
    ("channel", "orientation", "azimuth"),
    [
        ("HNE", Orientation.HORIZONTAL, 90.0),
        ("HNN", Orientation.HORIZONTAL, 0.0),
        ("HNZ", Orientation.VERTICAL, math.nan),
        ("HN1", Orientation.UNSTATED, math.nan),
        ("1", Orientation.UNSTATED, math.nan),
    ],
)
def test_the_channel_code_states_the_direction(
    channel: str, orientation: Orientation, azimuth: float
) -> None:
    record = Record.from_trace(trace(channel), units="g")
    assert record.orientation is orientation
    assert record.azimuth == pytest.approx(azimuth, nan_ok=True)
    assert record.acceleration == pytest.approx(9.81 * np.array([0.0, 0.2, -0.1]))


def test_stated_fields_replace_those_of_the_trace() -> None:
    record = Record.from_trace(trace("HN1"), record_id="shake", azimuth=37.0, component="N37E")
    assert (record.record_id, record.azimuth, record.component) == ("shake", 37.0, "N37E")
    assert (record.network, record.station, record.start_time) == ("CI", "CCC", "")


def test_a_stream_keeps_what_the_plug_in_read() -> None:
    path = bundled_records() / "Ridgecrest2019-CCC.V1"
    read = read_file(path)
    stream = PLUGINS["CSMIPV1"].read_format(str(path))
    for one, other in zip(Record.from_stream(stream), read, strict=True):
        assert one.samples_sha256 == other.samples_sha256
        assert one.station == other.station


def test_a_trace_with_a_gap_or_another_unit_is_refused() -> None:
    gap = trace()
    gap.data = np.ma.masked_invalid([0.0, np.nan, 1.0])
    with pytest.raises(ParameterError, match=r"it has a gap\. Must be without gaps"):
        Record.from_stream([gap])
    with pytest.raises(ParameterError, match="acceleration units"):
        Record.from_trace(trace(), units="counts")
