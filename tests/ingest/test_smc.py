from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.record import Orientation

Lines = list[str]
PATH = Path("0111a.smc")
UNDEFINED = 1.7e38


def field(value: float) -> str:
    """Return a number in Fortran's 1PE10.4E1."""
    mantissa, _, exponent = f"{value:.4E}".partition("E")
    return f"{mantissa}E{int(exponent):+d}".rjust(10)


def number(value: float) -> float:
    return float(field(value))


def rows(values: Sequence[float]) -> Lines:
    text = "".join(field(value) for value in values)
    return [text[start : start + 80] for start in range(0, len(text), 80)]


def smc(
    values: Sequence[float] = (1.0, -2.5, 0.5),
    *,
    kind: str = "2 CORRECTED ACCELEROGRAM",
    count: int | None = None,
    rate: float = 200.0,
    integers: dict[int, int] | None = None,
    reals: dict[int, float] | None = None,
    comments: Sequence[str] = ("|", "|ref - a report"),
) -> Lines:
    """Return the lines of a file of one component; samples start on line 30 by default."""
    whole = dict.fromkeys(range(1, 49), -32768) | {13: 90, 14: 360, 16: len(comments)}
    whole |= {17: len(values) if count is None else count} | (integers or {})
    real = dict.fromkeys(range(1, 51), UNDEFINED) | {2: rate, 6: 7.1, 17: 89.0} | (reals or {})
    return [
        kind,
        "*",
        "SAF0A",
        "     1989  10  18    0004 Loma Prieta, CA",
        "Moment Mag=      7.1 Ms=      7.1 Ml=      7.0",
        "station = San Francisco, 1295 Shafter, F component=    360",
        "epicentral dist =     89.0       pk     =    104.4",
        "inst type=SMA-1      data source = USGS",
        *["*"] * 3,
        *("".join(f"{whole[i]:10d}" for i in range(k, k + 8)) for k in range(1, 49, 8)),
        *("".join(f"{real[i]:15.7E}" for i in range(k, k + 5)) for k in range(1, 51, 5)),
        *comments,
        *rows(values),
    ]


def joined(lines: Lines) -> bytes:
    return "\r\n".join([*lines, ""]).encode()


def pairs(times: Sequence[float], values: Sequence[float]) -> Lines:
    """Return an uncorrected file of times and accelerations, without a sampling rate."""
    together = [value for pair in zip(times, values, strict=True) for value in pair]
    kind = "1 UNCORRECTED ACCELEROGRAM"
    return smc(together, kind=kind, count=len(values), rate=UNDEFINED)


#: Accelerations [cm/s2] as the five digits of the format hold them.
THOUSANDTHS = st.integers(-900_000_000, 900_000_000).map(lambda n: number(n / 1e3))


@given(st.lists(THOUSANDTHS, min_size=2, max_size=40))
def test_round_trip(values: list[float]) -> None:
    [record] = read_bytes(PATH, joined(smc(values)))
    assert np.array_equal(record.acceleration, 0.01 * np.array(values))


def test_facts() -> None:
    [record] = read_bytes(PATH, joined(smc()))
    assert (record.component, record.azimuth, record.event) == ("360", 360.0, "Loma Prieta, CA")
    assert record.station == "San Francisco, 1295 Shafter, F"
    assert (record.magnitude, record.epicentral_distance) == (7.1, 89.0)
    assert (record.time_step, record.uncorrected, record.start_time) == (0.005, False, "")


def test_start_to_the_millisecond() -> None:
    start = {2: 1989, 3: 291, 4: 0, 5: 4, 6: 5, 7: 120}
    [record] = read_bytes(PATH, joined(smc(integers=start)))
    assert record.start_time == "1989-10-18T00:04:05.120Z"


@pytest.mark.parametrize(
    ("from_up", "orientation"), [(0, Orientation.VERTICAL), (180, Orientation.DOWNWARD)]
)
def test_vertical(from_up: int, orientation: Orientation) -> None:
    [record] = read_bytes(PATH, joined(smc(integers={13: from_up})))
    assert record.orientation is orientation
    assert math.isnan(record.azimuth)


def test_uncorrected() -> None:
    [record] = read_bytes(PATH, joined(smc(kind="1 UNCORRECTED ACCELEROGRAM")))
    assert record.uncorrected


def test_flag_is_told() -> None:
    [record] = read_bytes(PATH, joined(smc(integers={18: 1})))
    assert record.processing == ("archive: problem flagged",)


def test_precise_variant() -> None:
    lines = smc(integers={47: 8})
    lines[29] = " 1.2345678E+00-2.5000000E+00 5.0000000E-01"
    [record] = read_bytes(PATH, joined(lines))
    assert record.acceleration[0] == 0.01 * 1.2345678


@given(st.lists(THOUSANDTHS, min_size=4, max_size=40))
def test_even_pairs(values: list[float]) -> None:
    times = [0.005 * k for k in range(len(values))]
    [record] = read_bytes(PATH, joined(pairs(times, values)))
    assert np.array_equal(record.acceleration, 0.01 * np.array(values))
    assert record.time_step == 0.005
    assert record.uncorrected


def test_uneven_pairs() -> None:
    times = [0.0, 0.005, 0.010, 0.015, 0.020, 0.032, 0.035, 0.040]
    with pytest.raises(InputError, match=r"smc:31: time 0\.032 s after 0\.02 s\. Must be .* even"):
        read_bytes(PATH, joined(pairs(times, [1.0] * 8)))


@pytest.mark.parametrize("kind", ["3 VELOCITY", "4 DISPLACEMENT", "5 RESPONSE SPECTRA"])
def test_siblings(kind: str) -> None:
    with pytest.raises(InputError, match=rf":1: is a {kind[2:].lower()} file, not an accel"):
        read_bytes(PATH, joined(smc(kind=kind)))


@pytest.mark.parametrize(
    ("index", "old", "new", "message"),
    [
        (13, "         3", "         4", r":29: 4 samples stated, 3 in the file"),
        (13, "         3", "    -32768", r":14: None samples stated\. Must be 2 or more"),
        (12, "         2", "         3", r":13: 3 comment lines stated, 2 in the file"),
        (12, "       360", "       270", r":6: component 360 stated, but azimuth 270"),
        (12, "       360", "       36x", r":13: header value '36x'\. Must be a finite number"),
        (17, "2.0000000E+02", "0.0000000E+00", r":18: 0 samples a second\. Must be a positive"),
        (17, "2.0000000E+02", "         .E+02", r":18: header value '\.E\+0"),
        (17, "2.0000000E+02", "          NaN", r":18: header value 'NaN'"),
        (29, "-2.5000E+0", "       NaN", r":30: acceleration 'NaN' in characters 11 to 20"),
        (29, "-2.5000E+0", " -25000E+0", r":30: acceleration '-25000E\+0' .*decimal point"),
        (29, "-2.5000E+0", "2.5000E+0", r":29: 3 samples.*|:30: 29 characters of samples"),
        (0, "2 CORRECTED", "2 MENDED", "unknown format"),
    ],
)
def test_damaged(index: int, old: str, new: str, message: str) -> None:
    lines = smc()
    assert old in lines[index]
    lines[index] = lines[index].replace(old, new, 1)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, joined(lines))


def test_lost_line_of_samples() -> None:
    lines = smc([0.5] * 20)
    with pytest.raises(InputError, match=r":29: 20 samples stated, 12 in the file"):
        read_bytes(PATH, joined(lines[:29] + lines[30:]))


def test_truncated() -> None:
    with pytest.raises(InputError, match=r"the file ends after \d+ of the 27 lines of the header"):
        read_bytes(PATH, joined(smc()[:20]))


@pytest.mark.parametrize(
    ("reals", "message"),
    [
        ({30: 1.0, 32: -2.6, 31: 0.005}, r":24: peak -2\.6 cm/s2 stated, but -2\.5 cm/s2"),
        ({30: 1.0, 32: -2.5, 31: 0.5}, r":24: peak stated at 0\.5 s, but at 0\.005 s"),
        ({30: 2.5, 29: 0.005}, r":23: peak 2\.5 cm/s2 stated, but -2\.5 cm/s2"),
    ],
)
def test_stated_extremes(reals: dict[int, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, joined(smc(reals=reals)))


def test_a_peak_may_be_printed_with_more_digits_than_samples() -> None:
    """Samples have five digits, so the largest, -12.346, may stand for -12.3456."""
    [record] = read_bytes(PATH, joined(smc((1.0, -12.346, 0.5), reals={31: 0.005, 32: -12.3456})))
    assert record.peak_ratio == pytest.approx(12.346 / 12.3456, rel=1e-12)
    with pytest.raises(InputError, match=r":24: peak -12\.3475 cm/s2 stated, but -12\.346 cm/s2"):
        read_bytes(PATH, joined(smc((1.0, -12.346, 0.5), reals={31: 0.005, 32: -12.3475})))


def test_options_must_agree() -> None:
    with pytest.raises(InputError, match=r":18: time step 0.02 s given, but the file states 0.005"):
        read_bytes(PATH, joined(smc()), ReadOptions(time_step=0.02))


def test_pairs_counted_as_values() -> None:
    values = [1.0, -2.0, 3.0, 4.0]
    lines = pairs([0.005 * k for k in range(4)], values)
    twice = smc(
        [value for k, value in enumerate(values) for value in (0.005 * k, value)],
        kind="1 UNCORRECTED ACCELEROGRAM",
        rate=UNDEFINED,
    )
    assert twice != lines
    for form in (lines, twice):
        [record] = read_bytes(PATH, joined(form))
        assert record.acceleration.tolist() == [0.01 * value for value in values]


def test_nul_padding_at_the_end() -> None:
    data = joined(smc())
    [record] = read_bytes(PATH, data + bytes(2048 - len(data) % 2048))
    assert record.acceleration.size == 3
    with pytest.raises(InputError, match=r"NUL byte|unknown format"):
        read_bytes(PATH, data[:-20] + b"\0" + data[-20:])
