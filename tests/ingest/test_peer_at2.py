from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes, read_file
from rockframe.ingest.formats.peer_at2 import Title, read_title
from rockframe.record import Orientation, Record

PATH = Path("RSN77.AT2")

SIZES = [
    "NPTS={n:7d}, DT=   .0100 SEC,                                             ",
    "NPTS= {n}, DT= .01000 SEC",
    "{n}    0.0100    NPTS, DT",
    "NPTS=   {n}, DT=   .0100 SEC,   0 POLE @    40.00000 HZ,  -5 POLE @      .05000 HZ, ACAUSAL",
    "NPTS= {n}, DT= 1.0000E-02",
    "npts={n} dt=.01 sec",
]
UNITS = [
    "ACCELERATION TIME SERIES IN UNITS OF G",
    "ACCELERATION TIME HISTORY IN UNITS OF G. FILTER POINTS: HP=0.1 Hz LP=40.0 Hz",
    "ACCELERATION TIME HISTORY IN UNITS OF G,  PGA= {pga:9.5f} G, PGV=   39.6246 CM/SEC",
    "The units are (g)",
]


def one(data: bytes, options: ReadOptions | None = None) -> Record:
    [record] = read_bytes(PATH, data, options or ReadOptions())
    return record


@given(
    values=st.lists(st.floats(-3, 3).map("{: .7E}".format), min_size=2, max_size=40),
    sizes=st.sampled_from(SIZES),
    units=st.sampled_from(UNITS),
    columns=st.sampled_from([1, 5, 8]),
    end=st.sampled_from(["\n", "\r\n", "\r\r\n", "\r"]),
)
def test_round_trip(
    at2: Callable[..., bytes], values: list[str], sizes: str, units: str, columns: int, end: str
) -> None:
    units = units.format(pga=max((float(value) for value in values), key=abs))
    data = at2(values, sizes.format(n=len(values)), units=units, columns=columns, end=end)
    record = one(data)
    assert record.time_step == 0.01
    assert np.array_equal(record.acceleration, [float(value) * 9.81 for value in values])


@pytest.mark.parametrize("letter", ["D", "d"])
@pytest.mark.parametrize("columns", [1, 5])
def test_exponents_of_fortran_are_those_of_any_program(
    at2: Callable[..., bytes], letter: str, columns: int
) -> None:
    values = [f"{value: .7E}" for value in np.sin(0.3 * np.arange(40.0))]
    printed = [value.replace("E", letter) for value in values]
    record = one(at2(printed, f"NPTS= 40, DT= 0.1000{letter}-01 SEC", columns=columns))
    assert record.time_step == 0.01
    assert np.array_equal(record.acceleration, [float(value) * 9.81 for value in values])
    printed[7] = printed[7].replace(letter, letter + "x")
    with pytest.raises(InputError, match=r"Must be a finite number"):
        one(at2(printed, "NPTS= 40, DT= .01 SEC", columns=columns))
    damaged = [*values[:7], printed[8], *values[8:]]
    with pytest.raises(InputError, match=f"{letter}.*Must be a finite number"):
        one(at2(damaged, "NPTS= 40, DT= .01 SEC", columns=columns))


def test_trailing_blanks_and_no_last_line_end(at2: Callable[..., bytes]) -> None:
    assert one(at2() + b"                    ").acceleration.size == 3


def test_exponent_time_step(at2: Callable[..., bytes]) -> None:
    assert one(at2(sizes="NPTS= 3, DT= 5.0000E-03")).time_step == 0.005


def test_title_facts(at2: Callable[..., bytes]) -> None:
    record = one(at2())
    assert (record.event, record.component) == ("San Fernando, 2/9/1971", "164")
    assert record.station == "Pacoima Dam (upper left abut)"
    assert (record.orientation, record.azimuth) == (Orientation.HORIZONTAL, 164.0)
    assert not record.uncorrected


def test_vertical(at2: Callable[..., bytes]) -> None:
    record = one(at2(title="San Fernando, 2/9/1971, Pacoima Dam, DWN"))
    assert record.orientation is Orientation.DOWNWARD
    assert math.isnan(record.azimuth)


@pytest.mark.parametrize(
    ("line", "title"),
    [
        ("Chi-Chi, Taiwan, 9/20/1999, TCU052, E", Title(
            "Chi-Chi, Taiwan, 9/20/1999", "TCU052", "E")),
        ("IMPERIAL VALLEY 10/15/79 2316, El Centro Array #4, 140  ", Title(
            "IMPERIAL VALLEY 10/15/79 2316", "El Centro Array #4", "140")),
        ("CHALFANT VALLEY 07/21/86 14:42, BISHOP, 160 (CDMG STATION 54424)", Title(
            "CHALFANT VALLEY 07/21/86 14:42", "BISHOP", "160")),
        ("KOBE 01/16/95 2046, 090", Title("KOBE 01/16/95 2046")),
        ("A record, of some station, 090", Title()),
    ],
)  # fmt: skip
def test_title(line: str, title: Title) -> None:
    assert read_title(line) == title


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sizes": "NPTS= 4, DT= .005 SEC"}, r":4: NPTS 4 in the header, 3 samples in the file"),
        ({"sizes": "NPTS= 2, DT= .005 SEC"}, r":4: NPTS 2 in the header, 3 samples in the file"),
        ({"sizes": "NPTS= 3, DT= 0.0 SEC"}, r":4: time step '0.0' s\. Must be a positive number"),
        ({"sizes": "NPTS= 3, DT= -.005 SEC"}, r":4: time step '-.005' s\. Must be a positive"),
        ({"sizes": "NPTS= 3, DT= nan SEC"}, r":4: time step 'nan' s\. Must be a positive number"),
        ({"sizes": "NPTS= 3, DT= 5.0 MSEC"}, r":4: DT in units of 'MSEC'\. Must be seconds"),
        ({"sizes": "NPTS= 3.0, DT= .005 SEC"}, r":4: NPTS '3.0'\. Must be a whole number"),
        ({"sizes": "NPTS= 1, DT= .005 SEC"}, r":4: NPTS '1'\. Must be a whole number of 2"),
        ({"values": [".1", "NaN", ".3"]}, r":5: acceleration 'NaN'\. Must be a finite number"),
        ({"values": [".1", "inf", ".3"]}, r":5: acceleration 'inf'\. Must be a finite number"),
        ({"values": [".1"] * 6 + ["1.2.3"]}, r":6: acceleration '1.2.3'\. Must be a finite"),
        ({"values": [".1", "1_0", ".3"]}, r":5: acceleration '1_0'\. Must be a finite number"),
        ({"units": "ACCELERATION"}, "acceleration units unstated. The header must state"),
        ({"units": "ACCELERATION TIME SERIES IN UNITS OF KM/S2"}, r":3: .*'KM/S2'\. Must be g"),
        ({"units": "VELOCITY TIME SERIES IN UNITS OF CM/S"}, r":3: is a velocity time series"),
        ({"units": "DISPLACEMENT TIME SERIES IN UNITS OF CM"}, r":3: is a displacement time"),
        ({"sizes": "LOST"}, "no NPTS and DT, as in .* in the first 12 lines"),
    ],
)
def test_damaged(at2: Callable[..., bytes], change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        one(at2(**change))


def test_lost_line_of_samples(at2: Callable[..., bytes]) -> None:
    data = at2([".1"] * 20, "NPTS= 20, DT= .01 SEC").split(b"\n")
    with pytest.raises(InputError, match="NPTS 20 in the header, 15 samples in the file"):
        one(b"\n".join(data[:5] + data[6:]))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ReadOptions(units="gal"), r":3: acceleration units 'gal' given, but the file states 'g'"),
        (ReadOptions(time_step=0.01), r":4: time step 0.01 s given, but the file states 0.005 s"),
    ],
)
def test_options_must_agree(at2: Callable[..., bytes], options: ReadOptions, message: str) -> None:
    with pytest.raises(InputError, match=message):
        one(at2(), options)


def test_nul_bytes(at2: Callable[..., bytes]) -> None:
    padded = at2([".1"] * 2000, "NPTS= 2000, DT= .01 SEC") + b"\n\0\0\0"
    with pytest.raises(InputError, match=r":405: NUL byte in a text file"):
        one(padded)


def test_byte_order_marks(at2: Callable[..., bytes]) -> None:
    assert one(b"\xef\xbb\xbf" + at2()).acceleration.size == 3
    with pytest.raises(InputError, match=r"text in UTF-16\. Save it as ASCII or UTF-8"):
        one(at2().decode().encode("utf-16"))


@pytest.mark.parametrize(
    ("name", "component", "azimuth"),
    [
        ("AB1234_1.AT2", "1", math.nan),
        ("AB1234_2.AT2", "2", math.nan),
        ("a.AT2", "0", math.nan),
        ("ch2.AT2", "2", math.nan),
        ("a.AT2", "22", 22.0),
        ("gilroy_1.AT2", "67", 67.0),
        ("I-ELC0.AT2", "0", 0.0),
        ("I-ELC90.AT2", "90", 90.0),
        ("RSN982_NORTHR_JEN022.AT2", "22", 22.0),
        ("RSN159_IMPVALL.H_H-AGR003.AT2", "3", 3.0),
        ("a.AT2", "022", 22.0),
        ("a.AT2", "292", 292.0),
    ],
)
def test_the_number_of_a_channel_is_no_azimuth(
    at2: Callable[..., bytes], name: str, component: str, azimuth: float
) -> None:
    """PEER prints azimuths of one or two digits too; its file names end with them."""
    [record] = read_bytes(name, at2(title=f"1/17/2012, ABC, {component}"), ReadOptions())
    assert record.component == component
    note = f"component '{component}' may be the number of a channel and is not read as an azimuth"
    assert record.processing == ((note,) if math.isnan(azimuth) else ())
    assert record.azimuth == pytest.approx(azimuth, nan_ok=True)
    known = Orientation.UNSTATED if math.isnan(azimuth) else Orientation.HORIZONTAL
    assert record.orientation is known


def test_a_real_channel_number_is_no_azimuth(shared_reports: Path) -> None:
    [record] = read_file(shared_reports / "12_MOLA_1.AT2")
    assert (record.component, record.orientation) == ("1", Orientation.UNSTATED)
    assert math.isnan(record.azimuth)


@pytest.mark.parametrize("place", [4, 13])
@pytest.mark.parametrize(("old", "new"), [(b"E-0", b"E-"), (b".", b""), (b"E-", b"1E-")])
def test_a_line_of_another_width_is_refused_unless_trusted(
    place: int, old: bytes, new: bytes
) -> None:
    """A character that is missing or too many leaves a number, but another one."""
    values = [f"{sample:15.7E}" for sample in np.random.default_rng(1).normal(0.0, 0.1, 150)]
    rows = ["".join(values[k : k + 5]) for k in range(0, 150, 5)]
    header = ["PEER", "A, 1/2/2003, B, 090", "ACCELERATION TIME SERIES IN UNITS OF G"]
    lines = [line.encode() for line in (*header, "NPTS= 150, DT= .01 SEC", *rows)]
    assert read_bytes("a.AT2", b"\n".join(lines), ReadOptions())[0].acceleration.size == 150
    lines[place] = lines[place].replace(old, new, 1)
    with pytest.raises(InputError, match=rf":{place + 1}: .* other lines have 75.*--trust samples"):
        read_bytes("a.AT2", b"\n".join(lines), ReadOptions())
    trusting = ReadOptions(trust=("samples",))
    assert read_bytes("a.AT2", b"\n".join(lines), trusting)[0].acceleration.size == 150


@pytest.mark.parametrize("few", [1, 2])
def test_exponents_of_three_digits_and_the_last_line_may_have_other_widths(few: int) -> None:
    values = [f"{sample:15.7E}" for sample in np.random.default_rng(1).normal(0.0, 0.1, 148)]
    values[10 : 10 + few] = [" -1.0000000E-101"] * few
    rows = ["".join(values[k : k + 5]) for k in range(0, 148, 5)]
    header = "PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 148, DT= .01 SEC\n"
    assert len(rows[2]) != len(rows[0]) != len(rows[-1])
    [record] = read_bytes("a.AT2", (header + "\n".join(rows)).encode(), ReadOptions())
    assert record.acceleration.size == 148


def test_a_large_value_of_fixed_decimals_may_widen_its_line(at2: Callable[..., bytes]) -> None:
    rows = [" 0.12345 -0.23456"] * 40
    rows[7] = " 0.12345 -11.20000"
    record = one(at2(rows, "NPTS= 80, DT= .01 SEC", columns=1))
    assert record.pga == pytest.approx(11.2 * 9.81)


@pytest.mark.parametrize(("units", "peak"), [("G", ".3000 G"), ("CM/S2", "294.3")])
def test_the_peak_of_a_file_in_other_units_is_in_them_or_in_g(units: str, peak: str) -> None:
    """A file of 0.3 g = 294.3 cm/s2."""
    numbers = "0.1 0.3 -0.2" if units == "G" else "98.1 294.3 -196.2"
    peak_units = "" if peak.endswith("G") else f" {units}"
    head = f"A\nB\nACCELERATION IN UNITS OF {units}, PGA= {peak}{peak_units}\n"
    text = f"{head}NPTS= 3, DT= .01 SEC\n{numbers}\n"
    [record] = read_bytes("a.AT2", text.encode())
    assert record.acceleration.tolist() == pytest.approx([0.981, 2.943, -1.962])
    [record] = read_bytes("a.AT2", text.replace(f"{peak}{peak_units}", ".3000 G").encode())
    assert record.peak_ratio == pytest.approx(1.0)
    with pytest.raises(InputError, match=r"peak 0\.31 g stated"):
        read_bytes("a.AT2", text.replace(f"{peak}{peak_units}", ".3100 G").encode())
    with pytest.raises(InputError, match="PGA in units of 'M/S2'"):
        read_bytes("a.AT2", text.replace(f"{peak}{peak_units}", "2.943 M/S2").encode())
