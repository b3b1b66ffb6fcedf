"""A stream written as AT2 reads back with the same samples (to the digits written) and header."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from tests.conftest import examples

from rockframe.errors import ParameterError
from rockframe.ingest import read_bytes, read_file

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

#: Half a unit in the last of eight digits.
HALF_DIGIT = 0.5e-7
NAMES = st.text(st.characters(codec="latin-1", categories=("L", "N", "Zs")), max_size=20).map(
    lambda text: " ".join(text.split())
)


def stream_of(samples: Any, **header: object) -> Any:
    from obspy import Stream, Trace

    return Stream([Trace(np.asarray(samples), header=header)])


def written(stream: Any, **options: object) -> bytes:
    file = BytesIO()
    stream.write(file, format="PEERAT2", **options)
    return file.getvalue()


@examples(60)
@given(
    samples=hnp.arrays(np.float64, st.integers(2, 40), elements=st.floats(-1e3, 1e3)),
    step=st.floats(1e-5, 2.0),
    event=NAMES,
    station=NAMES,
    component=st.from_regex(r"[A-Z0-9]{1,6}", fullmatch=True),
)
def test_round_trip(
    samples: NDArray[np.float64], step: float, event: str, station: str, component: str
) -> None:
    event = f"{event} 1/17/1995".strip()
    own = {"units": "m s-2", "event": event, "station": station}
    stream = stream_of(samples, delta=step, channel=component, _format="PEERAT2", peerat2=own)
    [record] = read_bytes("a.AT2", written(stream))
    np.testing.assert_allclose(
        record.acceleration, samples, rtol=HALF_DIGIT * (1.0 + 1e-7), atol=1e-300
    )
    assert record.time_step == stream[0].stats.delta
    assert (record.event, record.station, record.component) == (event, station, component)


def test_a_written_file_is_written_again_the_same(at2: Callable[..., bytes]) -> None:
    from obspy import read

    once = written(read(BytesIO(at2()), format="PEERAT2"))
    assert written(read(BytesIO(once), format="PEERAT2")) == once


def test_real_files(shared_records: Path, tmp_path: Path) -> None:
    from obspy import read

    for name in ("RSN1_HELENA.A_A-HMC180.AT2", "RSN77_SFERN_PUL164.AT2"):
        path = shared_records / "formats" / "peer_at2" / name
        read(str(path), format="PEERAT2").write(str(tmp_path / path.name), format="PEERAT2")
        [before], [after] = read_file(path), read_file(tmp_path / path.name)
        np.testing.assert_allclose(after.acceleration, before.acceleration, rtol=1e-7)
        for fact in ("time_step", "event", "station", "component", "azimuth", "record_id"):
            assert getattr(after, fact) == getattr(before, fact), fact


@pytest.mark.parametrize("azimuth", ["67", "0"])
def test_an_azimuth_of_few_digits_is_kept_and_the_number_of_a_channel_is_none(
    at2: Callable[..., bytes], azimuth: str
) -> None:
    from obspy import UTCDateTime, read

    source = at2(title=f"1/17/2012, ABC, {azimuth.zfill(3)}")
    stream = read(BytesIO(source), format="PEERAT2")
    stream[0].stats.channel = azimuth
    [record] = read_bytes("a.AT2", written(stream))
    assert record.azimuth == float(azimuth)
    other = stream_of([0.1, 0.2], channel="22", starttime=UTCDateTime("2012-01-17"))
    for name in ("a.AT2", "HN22.AT2"):
        [record] = read_bytes(name, written(other, units="g"))
        assert np.isnan(record.azimuth)
        assert record.processing[0].startswith("component '22' may be the number of a channel")


def test_units_are_converted() -> None:
    for units, one in (("g", 9.81), ("gal", 0.01), ("m/s2", 1.0)):
        [record] = read_bytes("a.AT2", written(stream_of([1.0, -2.0]), units=units))
        np.testing.assert_allclose(record.acceleration, [one, -2.0 * one], rtol=1e-7)


def test_an_event_without_a_date_gets_that_of_the_start() -> None:
    from obspy import UTCDateTime

    stream = stream_of(
        [0.1, 0.2], station="CLC", channel="HNE", starttime=UTCDateTime("2019-07-06T03:19:40")
    )
    [record] = read_bytes("a.AT2", written(stream, units="g"))
    assert (record.event, record.station, record.component) == ("7/6/2019", "CLC", "HNE")


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        ([0.1, np.nan], r"Sample 1 of trace '\.\.\.' is nan\. Must be finite"),
        ([np.inf, 0.1], r"Sample 0 of trace '\.\.\.' is inf\. Must be finite"),
        ([0.1, 1e31], r"Sample 1 of trace '\.\.\.' is 1e\+31\. Must be finite, below 1e30"),
        ([0.1], r"has 1 samples\. Must have 2 or more"),
    ],
)
def test_samples_that_at2_cannot_say(samples: list[float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        written(stream_of(samples), units="g")


def test_several_traces(tmp_path: Path) -> None:
    stream = stream_of([0.1, 0.2]) + stream_of([0.1, 0.2])
    with pytest.raises(ParameterError, match=r"stream of 2 traces: an AT2 file has one"):
        stream.write(str(tmp_path / "a.AT2"), format="PEERAT2", units="g")
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_known_to_be_acceleration(at2: Callable[..., bytes]) -> None:
    from obspy import read

    with pytest.raises(ParameterError, match=r"states no acceleration units\. State them"):
        written(stream_of([0.1, 0.2]))
    with pytest.raises(ParameterError, match=r"units 'm/s'\. Must be one of: g, gal"):
        written(stream_of([0.1, 0.2]), units="m/s")
    velocity = read(BytesIO(at2()), format="PEERAT2").integrate()
    with pytest.raises(ParameterError, match=r'processed by "ObsPy .*integrate.*acceleration'):
        written(velocity)
    assert written(velocity.differentiate(), units="m/s2")


@pytest.mark.parametrize(
    ("station", "words"),
    [
        ("Niğde", r"name 'Niğde' of trace .* An AT2 file has Latin letters only"),
        ("VELOCITY TIME", r"could not be read again: is a velocity time series"),
        ("NPTS= 9, DT= 1", r"could not be read again: "),
    ],
)
def test_names_that_at2_cannot_say(station: str, words: str) -> None:
    own = {"units": "m s-2", "station": station}
    with pytest.raises(ParameterError, match=words):
        written(stream_of([0.1, 0.2], _format="PEERAT2", peerat2=own))
