"""Formats whose real files may not be redistributed: the tests read them from the shared folder.

The numbers in the tables are printed in the files. Where a file prints no peak, it was taken from
the columns with awk.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, read_bytes, read_file
from rockframe.record import Orientation, SiteType

from .test_damaged_archives import harmful, harmless, samples, wrong

G, GAL = 9.81, 0.01
#: Format, samples, time step, unit of the peaks, their resolution, and the peaks.
Stated = tuple[str, int, float, float, float, tuple[float, ...]]
FILES: dict[str, Stated] = {
    "renadic/arica0911131.v1": ("volume1_pairs", 26600, 0.005, G, 1e-3, (0.052, -0.029, -0.057)),
    "renadic/cuya0911131.v1": ("volume1_pairs", 5652, 0.005, G, 1e-3, (0.132, 0.064, 0.129)),
    "renadic/papudo1002271.v1": ("volume1_pairs", 17754, 0.005, G, 1e-3, (0.295, -0.155, 0.421)),
    "cwa/2-EDH.dat": ("cwa", 6000, 0.02, GAL, 1e-3, (1.615, 3.888, -4.486)),
    "cwa/2-EGF.dat": ("cwa", 6000, 0.02, GAL, 1e-3, (-7.118, -4.546, 5.025)),
    "unam/CANA1709.191": ("unam", 43200, 0.005, GAL, 1e-2, (9.14, 9.24, -7.87)),
    "unam/PZPU1709.191": ("unam", 48600, 0.005, GAL, 1e-2, (53.3781, 119.9722, -92.5023)),
    "bhrc/5520-1.V1": ("bhrc", 15616, 0.005, G / 10, 1e-5, (1.94316, 0.998684, 2.61898)),
    "bhrc/5523-1.V1": ("bhrc", 13056, 0.005, G / 10, 1e-6, (0.229147, 0.0892871, -0.148103)),
    "csmnc/ua0001.dat": ("csmnc", 12800, 0.005, GAL, 1e-3, (-16.986,)),
    "itaca_old/16833_V.cor.acc": ("itaca", 59220, 0.005, 1.0, 1e-7, (2.5850007,)),
    "usc/274o42pv.s0b": ("usc", 574, 0.02, GAL, 1e-3, (9.492,)),
    "usc/274o42pv.s0c": ("usc", 574, 0.02, GAL, 1e-3, (6.359,)),
    "usc/usaca40.044": ("usc", 5983, 0.005, GAL, 1e-2, (514.03,)),
}
#: Digitised film: length [s], and the largest printed accelerations [g/10].
UNEVEN: dict[str, tuple[float, float, tuple[float, ...]]] = {
    "csmip_old/LA116TH.RAW": (59.996, 0.005, (-2.003, 0.604, -1.428)),
    "usc/017m30lw.e0b": (30.034, 0.004, (-1.113,)),
    "usc/017m30lw.e0c": (30.031, 0.004, (-1.010,)),
    "usc/017m30lw.s0a": (34.716, 0.004, (-2.647,)),
    "usc/017m30lw.s0c": (34.696, 0.004, (-2.869,)),
    "usc/274o42ah.m0a": (24.841, 0.005, (-0.551,)),
}
#: Number of header lines of the files whose damaged copies are read.
HEADERS: dict[str, int] = {
    "usc/274o42pv.s0b": 46,
    "usc/274o42ah.m0a": 27,
    "usc/usaca40.044": 7,
    "csmnc/ua0001.dat": 17,
    "cwa/2-EDH.dat": 22,
    "renadic/cuya0911131.v1": 27,
    "itaca_old/16833_V.cor.acc": 10,
    "bhrc/5523-1.V1": 27,
    "csmip_old/LA116TH.RAW": 27,
    "unam/CANA1709.191": 109,
}


@pytest.fixture
def folder(shared_records: Path) -> Path:
    found = shared_records.parent / "more_formats"
    if not found.is_dir():
        pytest.skip("the folder of more formats is absent")
    return found


@pytest.mark.parametrize("name", FILES)
def test_the_samples_are_those_that_the_file_states(folder: Path, name: str) -> None:
    kind, count, step, unit, resolution, peaks = FILES[name]
    records = read_file(folder / name)
    assert [record.source_format for record in records] == [kind] * len(peaks)
    for record, peak in zip(records, peaks, strict=True):
        assert (record.acceleration.size, record.time_step) == (count, step)
        largest = record.acceleration[np.abs(record.acceleration).argmax()] / unit
        # Caltech prints peaks with the opposite sign.
        found = abs(largest) if name.startswith("usc") else largest
        assert found == pytest.approx(peak, abs=1.001 * resolution)


@pytest.mark.parametrize("name", UNEVEN)
def test_digitised_film_is_interpolated(folder: Path, name: str) -> None:
    """Linear interpolation never exceeds the points, and passes near each peak."""
    length, step, peaks = UNEVEN[name]
    for record, peak in zip(read_file(folder / name), peaks, strict=True):
        assert record.time_step == step
        assert record.duration == pytest.approx(length, abs=step)
        largest = float(np.abs(record.acceleration).max()) / (G / 10)
        assert 0.95 * abs(peak) < largest <= abs(peak) * (1 + 1e-9)
        assert "interpolated linearly" in record.processing[0]


def test_every_new_format_has_one_claim(folder: Path) -> None:
    for name in (*FILES, *UNEVEN):
        head = (folder / name).read_bytes()[:4096]
        assert sum(known.sniff(head) for known in FORMATS) == 1, name


@pytest.mark.parametrize("name", HEADERS)
def test_no_damaged_copy_reads_wrong(folder: Path, name: str) -> None:
    data = (folder / name).read_bytes()
    good = samples(read_bytes(name, data))
    cases = list(harmful(data, HEADERS[name]))
    assert len(cases) > 80
    # UNAM's files are large, and most of their header does not describe the samples.
    few = cases[::6] if name.startswith("unam") else cases
    assert [damage for damage, copy in few if wrong(name, copy, good)] == []
    for dress, copy in harmless(data):
        assert samples(read_bytes(name, copy)) == good, dress


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("usc/274o42ah.m0a", b".110 G/10", b".210 G/10", "root mean square .210 G/10 stated"),
        ("usc/274o42ah.m0a", b"=   2925", b"=   2924", "2925 samples|2924 samples stated"),
        ("usc/274o42ah.m0a", b"AND G/10 ", b"AND GAL  ", "tape in a layout that cannot be read"),
        ("usc/274o42pv.s0b", b"-9.49200", b"-9.59200", "peak 9.592 cm/s2 stated"),
        ("renadic/cuya0911131.v1", b"0.132 G, AT", b"0.142 G, AT", "peak 0.142 g stated"),
        ("renadic/cuya0911131.v1", b"AT  11.895", b"AT  11.995", "peak stated at 11.995 s"),
        (
            "renadic/cuya0911131.v1",
            b"  0.025 -0.065",
            b"  0.027 -0.065",
            "time 0.03 s after 0.027 s",
        ),
        ("cwa/2-EDH.dat", b"-4.486", b"-4.586", "peak -4.586 gal stated"),
        ("cwa/2-EDH.dat", b"(Hz): 50", b"(Hz): 40", "samples stated"),
        ("unam/CANA1709.191", b"/9.14/", b"/9.44/", "peak 9.44 gal N00E stated"),
        ("csmnc/ua0001.dat", b"27.06 SEC", b"28.06 SEC", "peak stated at 28.06 s"),
        ("itaca_old/16833_V.cor.acc", b"2.5850007E", b"2.6850007E", "peak 2.6850007 m/s2 stated"),
        ("bhrc/5523-1.V1", b".200000E+03", b".100000E+03", "at 100 samples a second stated"),
        ("usc/usaca40.044", b"TYPE=VL", b"TYPE=DP", "block of DP. Must be VL"),
    ],
)
def test_a_lie_in_the_header_is_found(
    folder: Path, name: str, old: bytes, new: bytes, message: str
) -> None:
    data = (folder / name).read_bytes()
    assert old in data
    with pytest.raises(InputError, match=message):
        read_bytes(name, data.replace(old, new, 1))


def test_what_else_the_headers_say(folder: Path) -> None:
    north = read_file(folder / "unam" / "CANA1709.191")[0]
    assert (north.station, north.magnitude, north.azimuth) == ("CANA", 7.1, 0.0)
    assert north.start_time == "2017-09-19T18:14:44.000Z"
    up = read_file(folder / "cwa" / "2-EDH.dat")[0]
    assert (up.orientation, up.start_time) == (Orientation.VERTICAL, "2018-02-06T15:50:29.000Z")
    [ew] = read_file(folder / "csmnc" / "ua0001.dat")
    assert (ew.site_type, ew.azimuth, ew.magnitude) == (SiteType.FREE_FIELD, 90.0, 4.0)
    along, _, across = read_file(folder / "bhrc" / "5520-1.V1")
    assert (along.azimuth, across.azimuth, along.magnitude) == (352.0, 82.0, 6.1)
    [whittier] = read_file(folder / "usc" / "274o42pv.s0b")
    assert (whittier.magnitude, whittier.epicentral_distance) == (5.9, 44.15)
    [floor] = read_file(folder / "usc" / "usaca40.044")
    assert floor.site_type is SiteType.STRUCTURE


@pytest.mark.parametrize("name", ["274o42ah.m0a", "274o42pv.s0b"])
def test_distances_from_coordinates_agree_with_those_of_the_archive(
    folder: Path, name: str
) -> None:
    """Caltech's headers print coordinates in degrees, minutes and seconds, and the distance."""
    from rockframe.ingest.identify import distances

    text = (folder / "usc" / name).read_text(encoding="latin-1")
    parts = re.findall(r"(\d\d) (\d\d) (\d\d)N, (\d{3}) (\d\d) (\d\d)W", text)
    degrees = [[int(a) + int(b) / 60 + int(c) / 3600 for a, b, c in (p[:3], p[3:])] for p in parts]
    (station, event) = ((north, -west) for north, west in degrees)
    [record] = read_file(folder / "usc" / name)
    found = distances(event, station)["epicentral_distance"]
    assert found == pytest.approx(record.epicentral_distance, rel=0.01)
