from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, ReadOptions, read_bytes
from rockframe.record import Orientation

Lines = list[str]
PATH = Path("CCC.V1")


@given(st.lists(st.integers(-9999999, 9999999).map(lambda n: n / 1e6), min_size=2, max_size=40))
def test_round_trip(
    v1: Callable[..., bytes], channel: Callable[..., Lines], samples: list[float]
) -> None:
    [record] = read_bytes(PATH, v1(channel(samples=samples)))
    assert np.array_equal(record.acceleration, np.array(samples) * 9.81)


def test_facts(v1: Callable[..., bytes]) -> None:
    [record] = read_bytes(PATH, v1())
    assert (record.record_id, record.component, record.azimuth) == ("CCC", "090", 90.0)
    assert (record.network, record.station, record.event) == ("CI", "CCC", "")
    assert record.start_time == "2019-07-06T03:19:40.04Z"
    assert record.time_step == 0.01
    assert record.uncorrected


def test_touching_numbers(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    [record] = read_bytes(PATH, v1(channel(samples=[-1.5] * 9)))
    assert (record.acceleration == -1.5 * 9.81).all()


def test_channels_of_one_name_are_numbered(
    v1: Callable[..., bytes], channel: Callable[..., Lines]
) -> None:
    other = channel(samples=(0.1, -0.2, 0.25))
    records = read_bytes(PATH, v1(channel(), channel("Up"), other))
    assert [record.record_id for record in records] == ["CCC-090-1", "CCC-UP", "CCC-090-3"]
    with pytest.raises(InputError, match=r"channel '090' occurs twice"):
        read_bytes(PATH, v1(channel(), channel("Up"), channel()))


def test_station_number(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    lines = channel()
    lines[3] = "89146-L2500-12044.02                 Start time:  2/13/12, 21:06:45.0 PST"
    lines[4] = "Station No. 89146   40.941N, 123.633W      Etna  s/n 2500"
    [record] = read_bytes(PATH, v1(lines))
    assert (record.station, record.network, record.start_time) == ("89146", "", "")


@pytest.mark.parametrize(
    ("index", "old", "new", "message"),
    [
        (27, "     3", "     4", r":28: 4 samples stated, but 3 in 'No\. of Points'"),
        (10, "3", "4", r":28: 3 samples stated, but 4 in 'No\. of Points'"),
        (14, "    3", "    5", r":28: 3 samples stated, but 5 in item 28 of the integer header"),
        (27, "of g", "of cm", r":28: acceleration units 'cm'\. Must be g"),
        (27, "100 pts", "200 pts", r":28: 200 samples a second stated, but 100 in line 11"),
        (27, "100 pts", "0.0 pts", r":28: '0.0' samples a second\. Must be a positive number"),
        (27, "points", "", r":28: .*such as '10000 Accelerogram points"),
        (28, "-0.200000", "      nan", r":29: acceleration 'nan' in characters 10 to 18"),
        (28, "-0.200000", "*********", r":29: acceleration '\*+' in characters 10 to 18"),
        (28, "-0.200000", "  -200000", r":29: acceleration '-200000'.*decimal point"),
        (28, " 0.100000", "0.100000", r":29: 26 characters of samples\. Must be 72"),
    ],
)
def test_damaged(
    v1: Callable[..., bytes],
    channel: Callable[..., Lines],
    index: int,
    old: str,
    new: str,
    message: str,
) -> None:
    lines = channel()
    if index == 14:
        lines[14] = lines[14][:55] + new + lines[14][60:]
    else:
        assert old in lines[index]
        lines[index] = lines[index].replace(old, new, 1)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, v1(lines))


@pytest.mark.parametrize(
    ("label", "code", "orientation"),
    [
        ("Up", 500, Orientation.VERTICAL),
        ("Vert", 500, Orientation.VERTICAL),
        ("Vert", 600, Orientation.DOWNWARD),
        ("Down", 600, Orientation.DOWNWARD),
        ("Up", 600, None),
        ("Down", 500, None),
        ("Up", 90, None),
    ],
)
def test_the_sense_of_a_vertical(
    v1: Callable[..., bytes],
    channel: Callable[..., Lines],
    label: str,
    code: int,
    orientation: Orientation | None,
) -> None:
    lines = channel(label)
    lines[14] = lines[14][:50] + f"{code:5d}" + lines[14][55:]
    if orientation is None:
        with pytest.raises(InputError, match=rf":7: channel .* but {code} in item 27 of the int"):
            read_bytes(PATH, v1(lines))
    else:
        assert read_bytes(PATH, v1(lines))[0].orientation is orientation


def test_lost_line_of_samples(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    lines = channel(samples=[0.1] * 20)
    with pytest.raises(InputError, match=r":28: 20 samples stated, 12 in the file"):
        read_bytes(PATH, v1(lines[:29] + lines[30:]))


def test_shifted_line_of_samples(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    lines = channel(samples=[0.1] * 20)
    lines[29] = lines[29][1:]
    with pytest.raises(InputError, match=r":30: 71 characters of samples\. Must be 72: 8 columns"):
        read_bytes(PATH, v1(lines))


def test_lost_header_line(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    lines = channel()
    with pytest.raises(InputError, match=r":28: .*line 28 of a channel's header"):
        read_bytes(PATH, v1(lines[:16] + lines[17:]))


@pytest.mark.parametrize("kept", [10, 28])
def test_truncated(v1: Callable[..., bytes], channel: Callable[..., Lines], kept: int) -> None:
    with pytest.raises(
        InputError, match=r"ends after 10 of the 28 lines|3 samples stated, 0 in the file"
    ):
        read_bytes(PATH, v1(channel()[:kept]))


def test_lost_channel(v1: Callable[..., bytes], channel: Callable[..., Lines]) -> None:
    lines = channel()
    lines[4] += "  (3 Chns of  3 at Sta)"
    with pytest.raises(InputError, match=r":5: 3 channels in the header, 2 in the file"):
        read_bytes(PATH, v1(lines, channel("360 Deg")))


def test_options_must_agree(v1: Callable[..., bytes]) -> None:
    with pytest.raises(InputError, match=r":28: time step 0.02 s given, but the file states 0.01"):
        read_bytes(PATH, v1(), ReadOptions(time_step=0.02))


def test_blank_lines_alone() -> None:
    known = next(known for known in FORMATS if known.name == "csmip_v1")
    with pytest.raises(InputError, match=r"the file contains only blank lines\."):
        read_bytes("blank.V1", b"\n \n", file_format=known)
