"""Damaged files of the archives' formats: each reads exactly as the good one, or is rejected.

The good files are small and made here. Losing a header line that does not describe the samples
is harmless.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.record import Record

from . import test_afad, test_cosmos, test_csmip_v2, test_esm, test_geonet, test_knet, test_smc
from . import test_miniseed as seed
from . import test_sac as sac

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

RNG = np.random.default_rng(11)
ONE = [round(float(value), 3) for value in RNG.normal(0.0, 50.0, 83)]
COUNTS = [int(value) for value in RNG.normal(0.0, 5e4, 83)]
TENTHS = tuple(round(float(value), 1) for value in RNG.normal(0.0, 300.0, 83))
ROWS = tuple((a, b, c) for a, b, c in RNG.normal(0.0, 5.0, (40, 3)).round(6).tolist())

#: Name and data of the good file, and the number of its header lines.
TEXTS: dict[str, tuple[str, bytes, int]] = {
    "cosmos": ("a.V2c", test_cosmos.cosmos(test_cosmos.channel(ONE)), 49),
    "cosmos V0": (
        "a.V0c",
        test_cosmos.cosmos(
            test_cosmos.channel(
                [float(n) for n in COUNTS], stage=0, units="counts (50)", reals={34: 0.005}
            )
        ),
        49,
    ),
    "csmip_v2": ("a.V2", test_csmip_v2.v2(test_csmip_v2.channel(samples=ONE)), 46),
    "smc": ("a.smc", test_smc.joined(test_smc.smc(ONE, reals={30: max(ONE), 32: min(ONE)})), 29),
    "knet": ("a.EW", test_knet.knet(tuple(COUNTS)).encode(), 17),
    "esm": ("a.ASC", test_esm.esm(tuple(f"{value:.6f}" for value in ONE)).encode(), 19),
    "geonet": (
        "a.V2A",
        test_geonet.geonet(
            *(
                test_geonet.component(name, TENTHS, bearing=bearing)
                for name, bearing in (("S16W", 196), ("S74E", 106), ("Up", 0))
            )
        ),
        26,
    ),
    "afad": ("a.txt", test_afad.afad(ROWS).encode("latin-1"), 11),
}


def samples(records: list[Record]) -> list[tuple[float, bytes]]:
    return [(record.time_step, record.acceleration.tobytes()) for record in records]


GOOD = {kind: samples(read_bytes(name, data)) for kind, (name, data, _) in TEXTS.items()}


def harmless(data: bytes) -> Iterator[tuple[str, bytes]]:
    lf = data.replace(b"\r\n", b"\n")
    yield "lf", lf
    yield "cr-lf", lf.replace(b"\n", b"\r\n")
    yield "cr-cr-lf", lf.replace(b"\n", b"\r\r\n")
    yield "cr alone", lf.replace(b"\n", b"\r")
    yield "byte order mark", b"\xef\xbb\xbf" + data
    yield "DOS end of file", data + b"\x1a" * 3
    yield "blank lines at the end", data + b"\n \n"


def harmful(data: bytes, header: int) -> Iterator[tuple[str, bytes]]:
    lf = data.replace(b"\r\n", b"\n")
    lines = lf.split(b"\n")
    inside = (header + 1, header + 3, len(lines) - 3)
    for k in (*range(header + 3), *inside):
        yield f"without line {k + 1}", b"\n".join(lines[:k] + lines[k + 1 :])
        yield f"line {k + 1} twice", b"\n".join(lines[: k + 1] + lines[k:])
    for k in inside:
        yield f"line {k + 1} shifted", b"\n".join([*lines[:k], b" " + lines[k], *lines[k + 1 :]])
        yield f"line {k + 1} short", b"\n".join([*lines[:k], lines[k][:-1], *lines[k + 1 :]])
        joined = lines[k] + lines[k + 1]
        yield f"lines {k + 1} and next joined", b"\n".join([*lines[:k], joined, *lines[k + 2 :]])
        for token in (b"nan", b"inf", b"1e400", b"-", b"0x1A", b"1_0", b"1,5"):
            bad = re.sub(rb"\S+(\s*)$", lambda m, t=token: t + m[1], lines[k])  # type: ignore[misc]
            yield f"{token!r} in line {k + 1}", b"\n".join([*lines[:k], bad, *lines[k + 1 :]])
    for share in (0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99):
        yield f"{share:.0%} of it", lf[: int(share * len(lf))]
    for cut in range(1, 10):
        yield f"{cut} bytes less", lf[:-cut]
        yield f"{cut} bytes less at the beginning", lf[cut:]
    middle = len(lf) // 2
    yield "NUL", lf[:middle] + b"\0" + lf[middle:]
    yield "utf-16", lf.decode("latin-1").encode("utf-16")
    yield "twice", lf + lf
    yield "tabs", lf.replace(b"  ", b"\t")


@pytest.mark.parametrize("kind", TEXTS)
def test_dress_makes_no_difference(kind: str) -> None:
    name, data, _ = TEXTS[kind]
    for damage, copy in harmless(data):
        assert samples(read_bytes(name, copy)) == GOOD[kind], damage


def wrong(
    name: str, data: bytes, good: list[tuple[float, bytes]], units: str | None = None
) -> bool:
    """Return True if a file reads with other samples, or is rejected without a reason."""
    try:
        return samples(read_bytes(name, data, ReadOptions(units))) != good
    except InputError as error:
        return len(error.reason.split()) < 2 or "\n" in str(error)


@pytest.mark.parametrize("kind", TEXTS)
def test_none_reads_wrong(kind: str) -> None:
    name, data, header = TEXTS[kind]
    cases = list(harmful(data, header))
    assert len(cases) > 90
    assert [damage for damage, copy in cases if wrong(name, copy, GOOD[kind])] == []


def binary(data: bytes, header: int) -> Iterator[tuple[str, bytes]]:
    for share in (0.1, 0.5, 0.9):
        yield f"{share:.0%} of it", data[: int(share * len(data))]
    for count in (1, 2, 3, 4, 7, 8):
        yield f"{count} bytes less", data[:-count]
        yield f"{count} bytes more", data + bytes(count)
        yield f"{count} bytes less at the beginning", data[count:]
    yield "twice", data + data
    yield "as text", data.decode("latin-1").encode("utf-8")
    yield "line ends converted", data.replace(b"\n", b"\r\n")
    yield "header of NUL", bytes(header) + data[header:]


def test_sac_binary() -> None:
    values = tuple(float(np.float32(value)) for value in ONE)
    data = sac.sac(values)
    good = samples(read_bytes("a.sac", data, ReadOptions("g")))
    cases = list(binary(data, 632))
    for name, place, form, value in (
        ("NPTS", sac.NPTS, "i", 82),
        ("NPTS", sac.NPTS, "i", -1),
        ("NPTS", sac.NPTS, "i", 2**31 - 1),
        ("version", sac.NVHDR, "i", 7),
        ("uneven", sac.LEVEN, "i", 0),
        ("spectrum", sac.IFTYPE, "i", 2),
        ("velocity", sac.IDEP, "i", 7),
        ("maximum", sac.DEPMAX, "f", 1e9),
        *(("step", 0, "f", step) for step in (0.0, -0.02, np.nan, np.inf)),
        *(("sample", 632 + 40, "f", bad) for bad in (np.nan, np.inf, 3e38, 1e4)),
    ):
        copy = bytearray(data)
        struct.pack_into(f"<{form}", copy, place, value)
        cases.append((f"{name} {value}", bytes(copy)))
    assert [damage for damage, copy in cases if wrong("a.sac", copy, good, units="g")] == []


def test_miniseed_records(tmp_path: Path) -> None:
    path = tmp_path / "CLC.mseed"
    (tmp_path / "CLC.xml").write_text(seed.station_xml())
    data = seed.mseed(seed.trace(COUNTS * 30))
    good = samples(read_bytes(path, data))
    size = 512
    assert len(data) // size > 5
    cases = [(damage, copy) for damage, copy in binary(data, 48) if len(copy) % size]
    assert len(cases) > 15
    for k in (1, 3):
        at = k * size
        cases.append((f"without record {k}", data[:at] + data[at + size :]))
        cases.append((f"record {k} twice", data[: at + size] + data[at:]))
        for place in (6, 15, 20, 30, 31, 32, 46, 54, 64, 70, 200, 511):
            flipped = bytearray(data)
            flipped[at + place] ^= 0xFF
            cases.append((f"byte {place} of record {k} flipped", bytes(flipped)))
    # A file that ends with a complete record is a shorter file, as the README says.
    shorter = data[: int(0.5 * len(data)) // size * size]
    assert len(read_bytes(path, shorter)[0].acceleration) < len(COUNTS * 30)
    assert [damage for damage, copy in cases if wrong(str(path), copy, good)] == []
