from __future__ import annotations

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
PATH = Path("INGLE.V2")
#: Indices of the peak, the interval, the line of items 49 to 64, and the headings of the blocks.
PEAK, INTERVAL, COUNTS, STEP, ACCEL, VELOC, DISPL = 17, 16, 28, 39, 45, 47, 49


def _block(samples: Sequence[float]) -> Lines:
    text = "".join(f"{sample:10.3f}" for sample in samples)
    return [text[start : start + 80] for start in range(0, len(text), 80)]


def channel(label: str = "90 DEG", samples: Sequence[float] = (1.0, -2.5, 0.5)) -> Lines:
    """Return the lines of one channel: acceleration on line 47, velocity 49, displacement 51."""
    count = len(samples)
    peak = max(range(count), key=lambda k: abs(samples[k]))
    integers = [0] * 100
    integers[23] = 2012
    integers[52] = integers[63] = integers[65] = count
    reals = [0.0] * 100
    reals[60] = 0.02
    return [
        f"CORRECTED ACCELEROGRAM   14196-S1874-87274.01.1     CHAN  1: {label}     FROM",
        "UNCORRECTED ACCELEROGRAM DATA              PROCESSED: 11/19/87, CDMG QW87A196",
        "WHITTIER EARTHQUAKE",
        "OCTOBER 1, 1987  07:42 PDT",
        "14196-S1874-87274.01.1               Start time:  2/13/12, 21:06:45.5 UTC (GPS)",
        "STATION NO. 14196   33.905N, 118.279W     SMA-1  S/N 1874",
        "INGLEWOOD - UNION OIL YARD",
        f"CHAN  1: {label}",
        *["WHITTIER EARTHQUAKE     OCTOBER 1, 1987  07:42 PDT"] * 6,
        "ACCELEROGRAM BANDPASS FILTERED WITH RAMPS AT  .200- .400 AND 23.00-25.00 CYC/SEC",
        f"  {count} POINTS OF INSTRUMENT- AND BASELINE-CORRECTED ACCEL, VELOC AND DISPL DATA",
        "AT EQUALLY-SPACED INTERVALS OF    .020  SEC.",
        f"PEAK ACCELERATION = {samples[peak]:9.3f}    CM/SEC/SEC  AT {0.02 * peak:8.3f}   SEC.",
        "PEAK   VELOCITY   =   -16.380      CM/SEC    AT    6.480   SEC.",
        "PEAK DISPLACEMENT =    -1.999        CM      AT    5.920   SEC.",
        "INITIAL VELOCITY  =     -.053   CM/SEC;   INITIAL DISPLACEMENT =    -.042   CM",
        *["WHITTIER EARTHQUAKE     OCTOBER 1, 1987  07:42 PDT"] * 4,
        *("".join(f"{item:5d}" for item in integers[row : row + 16]) for row in range(0, 100, 16)),
        *("".join(f"{item:10.3f}" for item in reals[row : row + 8]) for row in range(0, 100, 8)),
        f"{count:5d} POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC/SEC)",
        *_block(samples),
        f"{count:5d} POINTS OF VELOC DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC)",
        *_block(samples),
        f"{count:5d} POINTS OF DISPL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM)",
        *_block(samples),
        "/&  ----------  END OF DATA FOR CHANNEL  1  ----------",
    ]


def v2(*channels: Lines) -> bytes:
    return "\r\n".join([line for one in channels for line in one] + [""]).encode()


def changed(index: int, old: str, new: str) -> bytes:
    lines = channel()
    assert old in lines[index]
    lines[index] = lines[index].replace(old, new, 1)
    return v2(lines)


@given(st.lists(st.integers(-99999999, 999999999).map(lambda n: n / 1e3), min_size=2, max_size=40))
def test_round_trip(samples: list[float]) -> None:
    [record] = read_bytes(PATH, v2(channel(samples=samples)))
    assert np.array_equal(record.acceleration, 0.01 * np.array(samples))


def test_facts() -> None:
    [record] = read_bytes(PATH, v2(channel()))
    assert (record.component, record.azimuth, record.station) == ("090", 90.0, "14196")
    assert (record.event, record.start_time) == ("WHITTIER EARTHQUAKE", "2012-02-13T21:06:45.5Z")
    assert (record.time_step, record.uncorrected) == (0.02, False)
    assert record.processing == (
        "archive: instrument and baseline corrected",
        "archive: band-pass, ramps 0.2 to 0.4 and 23 to 25 Hz",
    )


def test_no_processing_is_invented() -> None:
    lines = channel()
    lines[14] = "ACCELEROGRAM FILTERED"
    [record] = read_bytes(PATH, v2(lines))
    assert record.processing == ("archive: instrument and baseline corrected",)


def test_several_channels() -> None:
    first, second = read_bytes(PATH, v2(channel(), channel(" UP", samples=[0.5] * 9)))
    assert (first.record_id, second.record_id) == ("INGLE-090", "INGLE-UP")
    assert second.orientation is Orientation.VERTICAL
    assert second.acceleration.size == 9


def test_end_marks_of_dos() -> None:
    [record] = read_bytes(PATH, v2(channel()) + b"\x1a" * 100)
    assert record.acceleration.size == 3


def test_printed_columns() -> None:
    lines = channel()
    lines[ACCEL] = "3 points of accel data equally spaced at .020 sec, in cm/sec2. (8f9.4)"
    lines[ACCEL + 1] = "   1.0000  -2.5000   0.5000"
    [record] = read_bytes(PATH, v2(lines))
    assert record.acceleration.tolist() == [0.01, -0.025, 0.005]


def test_step_with_more_digits_in_the_real_header() -> None:
    lines = [line.replace(".020", ".004") for line in channel()]
    lines[STEP] = lines[STEP][:40] + "  .0041667" + lines[STEP][50:]
    lines[PEAK] = lines[PEAK][:-16] + " .004 SEC."
    [record] = read_bytes(PATH, v2(lines))
    assert record.time_step == 0.0041667


def test_volume_3_is_named() -> None:
    with pytest.raises(InputError, match=r":1: response and Fourier spectra \(CSMIP volume 3\)"):
        read_bytes("CE.V3", b"Response and Fourier amplitude spectra (78 periods)\n")


@pytest.mark.parametrize(
    ("index", "old", "new", "message"),
    [
        (PEAK, "-2.500", "-2.600", r":18: peak -2.6 cm/s2 stated, but -2.5 cm/s2 in the file"),
        (PEAK, "-2.500", " 2.500", r":18: peak 2.5 cm/s2 stated, but -2.5 cm/s2 in the file"),
        (PEAK, "0.020", "1.020", r":18: peak stated at 1.02 s, but at 0.02 s in the file"),
        (PEAK, "-2.500", "-2.5.0", r":18: peak '-2\.5\.0'\. Must be a number"),
        (PEAK, "CM/SEC/SEC", "G", r":18: peak in units of 'G'\. Must be cm/sec2"),
        (PEAK, "PEAK", "PAEK", r":18: .*a line such as 'Peak acceleration"),
        (15, "3", "4", r":46: 3 samples stated, but 4 in line 16"),
        (
            COUNTS,
            "    3",
            "    7",
            r":46: 3 samples stated, but 7 in item 53 of the integer header",
        ),
        (INTERVAL, ".020", ".010", r":46: interval 0.02 s stated, but 0.01 s in line 17"),
        (STEP, "0.020", "0.005", r":46: interval 0.02 s stated, but 0.005 s in item 61"),
        (VELOC, ".020", ".010", r":46: interval 0.02 s stated, but 0.01 s in line 48"),
        (VELOC, "3", "4", r":46: 3 samples stated, but 4 in the veloc block"),
        (DISPL, "DISPL", "DSIPL", r":50: .*the heading of the displ block"),
        (DISPL + 1, "1.000", "", r":50: 3 samples stated, 3 in the file|:51: 25 characters"),
        (ACCEL, "CM/SEC/SEC", "G", r":46: acceleration units 'g'\. Must be cm/sec2"),
        (ACCEL, "ACCEL", "VELOC", r":46: .*the heading of the accel block"),
        (ACCEL + 1, "-2.500", "   nan", r":47: acceleration 'nan' in characters 11 to 20"),
        (ACCEL + 1, "    -2.500", "", r":46: 3 samples stated, 2 in the file"),
    ],
)
def test_damaged(index: int, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, changed(index, old, new))


@pytest.mark.parametrize(
    ("kept", "message"),
    [
        (1, "unknown format"),
        (20, ":20: the file ends after 20 of the 45 lines of a channel's header"),
        (46, ":46: 3 samples stated, 0 in the file|:47: '', where a line such as"),
        (47, ":48: '', where a line such as '12000 points of veloc data"),
        (49, ":50: '', where a line such as '12000 points of displ data"),
    ],
)
def test_truncated(kept: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, v2(channel()[:kept]))


def test_lost_line_of_samples() -> None:
    lines = channel(samples=[0.1] * 20)
    with pytest.raises(InputError, match=r":46: 20 samples stated, 12 in the file"):
        read_bytes(PATH, v2(lines[:46] + lines[47:]))


def test_lost_channel() -> None:
    lines = channel()
    lines[5] += "  (3 Chns of  3 at Sta)"
    with pytest.raises(InputError, match=r":6: 3 channels in the header, 2 in the file"):
        read_bytes(PATH, v2(lines, channel("UP")))


def test_options_must_agree() -> None:
    with pytest.raises(InputError, match=r":46: acceleration units 'g' given, but the file states"):
        read_bytes(PATH, v2(channel()), ReadOptions(units="g"))
