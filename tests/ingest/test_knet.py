from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.ingest.imitations import knet_heading

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.record import Orientation

PATH = Path("AOM0170806140843.EW")
COUNTS = (100, -300, 200, 400)


def knet(counts: tuple[int, ...] = COUNTS, direction: str = "E-W", peak: str | None = None) -> str:
    """Return a file at 2 Hz in which each count is 0.001 gal."""
    gal = 0.001 * np.array(counts)
    stated = f"{np.abs(gal - gal.mean()).max():.3f}" if peak is None else peak
    rows = [
        "".join(f"{count:9d}" for count in counts[start : start + 8])
        for start in range(0, len(counts), 8)
    ]
    head = knet_heading(2, len(counts) / 2, direction, "2000(gal)/2000000", stated)
    return "\n".join([*head, *rows, ""])


def test_facts() -> None:
    [record] = read_bytes(PATH, knet().encode())
    assert (record.record_id, record.component, record.azimuth) == (f"{PATH}", "EW", 90.0)
    assert (record.station, record.network, record.magnitude) == ("AOM017", "BO", 7.2)
    # Record Time is in Japanese time (UTC+9), and the recorder adds 15 s to it.
    assert record.start_time == "2008-06-13T23:44:03.000000Z"
    assert (record.time_step, record.uncorrected) == (0.5, True)


@given(st.lists(st.integers(-8_000_000, 8_000_000), min_size=2, max_size=40))
def test_round_trip_with_the_offset_left(counts: list[int]) -> None:
    [record] = read_bytes(PATH, knet(tuple(counts)).encode())
    assert record.acceleration == pytest.approx(1e-5 * np.array(counts), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("direction", "component", "azimuth", "place"),
    [("2", "EW1", 90.0, "borehole"), ("4", "NS2", 0.0, "surface"), ("5", "EW2", 90.0, "surface")],
)
def test_kik_net(direction: str, component: str, azimuth: float, place: str) -> None:
    [record] = read_bytes(PATH, knet(direction=direction).encode())
    assert (record.component, record.azimuth) == (component, azimuth)
    assert record.station == f"AOM017 ({place})"


def test_vertical() -> None:
    assert read_bytes(PATH, knet(direction="U-D").encode())[0].orientation is Orientation.VERTICAL


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("     -300", "", r":12: 2 s at 2 Hz stated, that is 4 samples, but 3 in the file"),
        ("     -300", "      nan", r":18: acceleration 'nan'\. Must be a finite number"),
        ("     -300", "      inf", r":18: acceleration 'inf'\. Must be a finite number"),
        ("     -300", "    -3000", r":15: peak 0\.4 gal stated, but -2\.425 gal in the file"),
        ("Mag.              7.2", "Mag.              x", r":5: Mag\. 'x'\. Must be a number"),
        ("2000(gal)/2000000", "2000/2000000", r":14: Scale Factor '2000/2000000'\. Must be as in"),
        ("2000(gal)/2000000", "2000(gal)/0", r":14: Scale Factor .*two positive numbers"),
        ("2Hz", "0Hz", r":12: 2 s at 0 Hz stated, that is 0 samples, but 4 in the file"),
        ("2Hz", "2kHz", r":11: Sampling Freq\(Hz\) '2kHz'\. Must be as in '100Hz'"),
        ("E-W", "7", r":13: Dir\. '7'\. Must be one of N-S, E-W, U-D, or 1 to 6"),
        ("Lat.              39.028\n", "", r":2: 'Long\. +140\.880', where 'Lat\.' and its"),
        ("AOM017", "", r":6: 'Station Code', where 'Station Code' and its value are"),
        ("2008/06/14 08:44:18", "2008-06-14", r"obspy's KNET reader failed: "),
        ("Memo.", "M\xe9mo.", r":17: 'M"),
    ],
)
def test_damaged(old: str, new: str, message: str) -> None:
    text = knet()
    assert old in text
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, text.replace(old, new, 1).encode("latin-1"))


@pytest.mark.parametrize("share", [0.3, 0.6, 0.93, 0.98])
def test_truncated(share: float) -> None:
    data = knet(tuple(range(-40, 40))).encode()
    with pytest.raises(InputError, match=r"Must be|in the file|are expected"):
        read_bytes(PATH, data[: int(share * len(data))])


def test_units_must_agree() -> None:
    with pytest.raises(InputError, match="acceleration units 'g' given, but the file states 'gal'"):
        read_bytes(PATH, knet().encode(), ReadOptions(units="g"))


def test_obspy_reads_the_same() -> None:
    """The header in the form of the centre is read without obspy: samples, time and network."""
    text = knet(tuple(range(-40, 40))).encode()
    [record] = read_bytes(PATH, text)
    [trace] = read_stream(PATH, text, "KNET")
    assert record.start_time == str(trace.stats.starttime)
    assert record.network == trace.stats.network
    assert record.time_step == trace.stats.delta
    assert np.array_equal(record.acceleration, trace.data * (0.01 * 2000.0 / 2000000.0))


@pytest.mark.parametrize(
    ("old", "new"),
    [("2008/06/14 08:44:18", "2008/6/14 8:44:18"), ("2008/06/14 08:44:03", "2008/06/14 8:44:03")],
)
def test_unusual_headers_are_read_by_obspy(old: str, new: str) -> None:
    [usual], [unusual] = (
        read_bytes(PATH, text.encode()) for text in (knet(), knet().replace(old, new))
    )
    assert unusual.start_time == usual.start_time


@pytest.mark.parametrize(
    ("old", "new"),
    [("Height(m) 42", "Height(m) x"), ("08:44:03", "08:44"), ("08:43:00", "25:43:00")],
)
def test_headers_that_obspy_refuses_are_refused(old: str, new: str) -> None:
    with pytest.raises(InputError, match="obspy's KNET reader failed: "):
        read_bytes(PATH, knet().replace(old, new).encode())
