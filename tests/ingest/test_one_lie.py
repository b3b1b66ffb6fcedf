"""Files with one changed value that the file also states elsewhere: each is rejected.

The files are real where the shared ones are beside the repository, else imitations of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.ingest.imitations import IMITATIONS, content, imitation

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.ingest.registry import HEAD, sniff_format

AT2 = "peer_at2/IMPVALL_E04-140_example1.AT2"
V1, V2 = "csmip/CE89146.V1", "csmip/CE89146.V2"
V0, V2C = "cosmos/NP1795-n.305.v0c", "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c"
SMC = "smc/np01002p_4225a_a.smc"
KNET = "knet/AOM0170806140843.EW"
ESM = "esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC"
GEONET = "geonet/20180212_211557_WPWS_20.V2A"
AFAD = "afad/20170720223109_0921.txt"


@dataclass(frozen=True)
class Lie:
    """A replacement of the first match of a pattern in a file, and the words of the rejection."""

    file: str
    pattern: bytes
    new: bytes
    words: str


LIES = [
    Lie(AT2, rb"PGA=   .48431 G", b"PGA=   .58431 G", "peak 0.58431 g stated"),
    Lie(AT2, rb"PGA=   .48431 G", b"PGA= 475.11 CM/S2", "PGA in units of 'CM/S2'"),
    Lie(AT2, rb"UNITS OF G", b"UNITS OF CM/S2", "peak 0.48431 g stated, but"),
    Lie(AT2, rb"NPTS=   7818", b"NPTS=   7813", "NPTS 7813 in the header, 7818 samples"),
    Lie(AT2, rb"ACCELERATION", b"VELOCITY", "is a velocity time series"),
    Lie(V1, rb"Chan  1: 360 Deg", b"Chan  1:  90 Deg", "channel '090', but 360 in item 27"),
    Lie(
        V1, rb"Chan  2:  Up ", b"Chan  2: 180 ", "channel '180', but 500 in item 27|a line such as"
    ),
    Lie(V1, rb"Chan  2:  Up    ", b"Chan  2: 180 Deg", "channel '180', but 500 in item 27"),
    Lie(V1, rb"units of g \.", b"units of gal", "acceleration units 'gal'"),
    Lie(V1, rb"200 pts/sec", b"100 pts/sec", "100 samples a second stated, but 200"),
    Lie(V1, rb"at 200 Samples", b"at 100 Samples", "200 samples a second stated, but 100"),
    Lie(V1, rb"Length = 66.000", b"Length = 33.000", "record length 33.000 s stated, but 66 s"),
    Lie(V1, rb"Max  =   .079", b"Max  =  -.079", "peak -0.079 g stated, but 0.07918 g"),
    Lie(V1, rb" .0791795", b" .0891795", "peak 0.0891795 g stated"),
    Lie(V1, rb"30.590 sec", b"30.690 sec", "peak stated at 30.69 s, but at 30.59 s"),
    Lie(
        V2, rb"Chan  1: 360 Deg     from", b"Chan  2: 360 Deg     from", "channel 1, but channel 2"
    ),
    Lie(V2, rb"\nChan  1: 360 Deg", b"\nChan  1:  90 Deg", "channel '090', but 360 in item 27"),
    Lie(V2, rb"length = 60.000", b"length = 66.000", "record length 66.000 s stated, but 60 s"),
    Lie(V2, rb"at   30.585   sec", b"at   30.685   sec", "peak stated at 30.685 s"),
    Lie(V2, rb"=    77.280 ", b"=   -77.280 ", "peak -77.28 cm/s2 stated"),
    Lie(V2, rb"in cm/sec2\.", b"in g.     ", "acceleration units 'g'"),
    Lie(V2, rb"equally spaced at  .005", b"equally spaced at  .010", "interval 0.01 s stated, but"),
    Lie(V0, rb"Raw accel", b"Corrected accel", "'corrected', but stage 0"),
    Lie(V0, rb"units=counts \(50\)", b"units=cm/sec2(50)", "units 'cm/sec2', but code 50"),
    Lie(V0, rb": 90 Deg", b":180 Deg", "component 180 stated, but 90 in item 54"),
    Lie(V0, rb"985881 counts", b"885881 counts", "peak 885881 counts stated"),
    Lie(V0, rb"985881.0", b"885881.0", "peak 885881 counts stated"),
    Lie(V0, rb"0.794729", b"7.947290", "7.94729 uV a count .* make 133.333 V .* 13.4 V in item 23"),
    Lie(V0, rb"1.200000       4.116", b"0.120000       4.116", "make 0.4116 V, but 4.116 V"),
    Lie(V0, rb"45.290 sec", b"55.290 sec", "peak stated at 55.29 s"),
    Lie(V2C, rb"-6.852 cm/sec2", b" 6.852 cm/sec2", "peak 6.852 cm/sec2 stated, but -6.85"),
    Lie(V2C, rb"76.215 sec", b"79.215 sec", "peak stated at 79.215 s"),
    Lie(V2C, rb"below  0.03 Hz", b"below  0.30 Hz", "filter corner 0.3 Hz in words, but 0.03 Hz"),
    Lie(V2C, rb"42000 acceleration", b"42000 velocity    ", "'velocity', but quantity 1"),
    Lie(V2C, rb"cm/sec2\(04\)", b"g      (04)", "units 'g', but code 4"),
    Lie(SMC, rb"component=    133", b"component=    313", "component 313 stated, but azimuth 133"),
    Lie(SMC, rb"-0.2225194E\+03", b"-0.2325194E+03", "peak -232.5194 cm/s2 stated"),
    Lie(SMC, rb"0.7550000E\+01", b"0.8550000E+01", "peak stated at 8.55 s"),
    Lie(SMC, rb" 0.2000000E\+03", b" 0.1000000E+03", "peak stated at 7.55 s, but at 15.1 s"),
    Lie(KNET, rb"100Hz", b"200Hz", "at 200 Hz stated, that is 23000 samples, but 11500"),
    Lie(KNET, rb"3920\(gal\)", b"3940(gal)", "peak 16.452 gal stated, but -?16.53"),
    Lie(KNET, rb"\(gal\)/6182761", b"(gal)/6282761", "peak 16.* gal stated"),
    Lie(ESM, rb"PGA_CM/S\^2: 0.300022", b"PGA_CM/S^2: -0.300022", "peak -0.300022 cm/s2 stated"),
    Lie(ESM, rb"TIME_PGA_S: 20.67", b"TIME_PGA_S: 21.67", "peak stated at 21.67 s, but at 20.67"),
    Lie(ESM, rb"INTERVAL_S: 0.005", b"INTERVAL_S: 0.010", "DURATION_S 95.64 in the header"),
    Lie(ESM, rb"UNITS: cm/s\^2", b"UNITS: g", "UNITS 'g'"),
    Lie(GEONET, rb"peak    -41.6", b"peak     41.6", "peak 41.6 mm/s2 stated, but -41.6"),
    Lie(GEONET, rb"43.68 sec", b"48.68 sec", "peak stated at 53.68 s, but at 48.68 s"),
    Lie(GEONET, rb"Component S16W", b"Component S74E", "component 'S74E' is 106 degrees, but 196"),
    Lie(GEONET, rb"at 0.020 sec", b"at 0.010 sec", "time step 0.010 s stated, but 0.02 s"),
    Lie(AFAD, rb"\(E-W\) 12.163827", b"(E-W) 11.163827", "peak 11.163827 gal E-W stated"),
    Lie(
        AFAD, rb"DATA          : 28683", b"DATA          : 28682", "28682 in the header, 28683 rows"
    ),
]


@pytest.mark.parametrize("file", IMITATIONS)
def test_imitations_are_read(file: str) -> None:
    """So that the rejections of changed copies are of what was changed."""
    assert read_bytes(Path(file), imitation(file))


def told(lie: Lie) -> bytes:
    data = content(lie.file)
    assert re.search(lie.pattern, data), lie.pattern
    return re.sub(lie.pattern, lambda _: lie.new, data, count=1)


@pytest.mark.parametrize("lie", LIES, ids=lambda lie: f"{Path(lie.file).suffix}: {lie.words}")
def test_a_lie_is_refused(lie: Lie) -> None:
    with pytest.raises(InputError, match=lie.words):
        read_bytes(Path(lie.file), told(lie))


def swapped(table: str, one: int, other: int) -> str:
    rows = [line.split() for line in table.splitlines() if line.strip()]
    for row in rows:
        row[one], row[other] = row[other], row[one]
    return "\n".join(" ".join(row) for row in rows) + "\n"


def test_columns_of_afad_in_another_order_are_refused() -> None:
    text = content(AFAD).decode("latin-1")
    head, mark, table = text.partition("U-D\n" if "U-D\n" in text else "U-D\r\n")
    data = (head + mark + swapped(table, 0, 1)).encode("latin-1")
    with pytest.raises(InputError, match=r"peak 13.200332 gal N-S stated"):
        read_bytes(Path(AFAD), data)


def channels(data: bytes, top: bytes) -> list[bytes]:
    starts = [match.start() for match in re.finditer(top, data)] + [len(data)]
    return [data[start:end] for start, end in pairwise(starts)]


@pytest.mark.parametrize(
    ("file", "top", "samples"),
    [
        (V1, rb"(?m)^Uncorrected", rb"(?s)Format: \(8f9\.6\).*?\n(?P<samples>.*)/&"),
        (V2, rb"(?m)^Corrected", rb"(?s)cm/sec2\. \(8f10\.6\).*?\n(?P<samples>.*?) 12000 points"),
    ],
)
def test_samples_of_one_channel_under_the_header_of_another_are_refused(
    file: str, top: bytes, samples: bytes
) -> None:
    data = content(file)
    one, other, third = channels(data, top)
    mine, yours = re.search(samples, one), re.search(samples, other)
    assert mine
    assert yours
    mixed = one.replace(mine["samples"], yours["samples"]) + other + third
    with pytest.raises(InputError, match=r"peak .* stated, but"):
        read_bytes(Path(file), mixed)


@pytest.mark.parametrize("scale", [2.0, -1.0, 0.01, 9.81])
@pytest.mark.parametrize("file", [V2C, ESM])
def test_samples_in_other_units_are_refused(file: str, scale: float) -> None:
    data = content(file)
    known = sniff_format(data[:HEAD])
    lines = data.split(b"\n")
    changed = [rescaled(line, scale) for line in lines]
    with pytest.raises(InputError, match=r"peak .* stated, but"):
        known.read(Path(file), b"\n".join(changed), ReadOptions())


def rescaled(line: bytes, scale: float) -> bytes:
    """Multiply the sample of a line that holds only one, at the same width; keep other lines."""
    if not re.fullmatch(rb" *-?\d+\.\d+(e[-+]\d+)?\r?", line):
        return line
    value, width = scale * float(line), len(line.rstrip())
    form: Callable[[float], str] = "{:15.6e}".format if b"e" in line else "{:.6f}".format
    return form(value).rjust(width).encode() if np.isfinite(value) else line
