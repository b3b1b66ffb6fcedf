"""Real files that are installed with obspy: they may be read here, and need not be bundled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes, read_file

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def installed() -> Path:
    """Return the folder of obspy's readers; skip if their test data are not installed."""
    import obspy

    folder = Path(obspy.__file__).parent / "io"
    if not (folder / "nied" / "tests" / "data").is_dir():
        pytest.skip("obspy is installed without its test data")
    return folder


def test_a_record_of_knet(installed: Path) -> None:
    """The header states all of this; the recorder starts 15 s early, nine hours ahead of UTC."""
    [record] = read_file(installed / "nied" / "tests" / "data" / "test.knet")
    assert (record.station, record.component, record.azimuth) == ("AKT013", "EW", 90.0)
    assert record.start_time.startswith("1996-08-10T18:12:24.0")
    assert (record.acceleration.size, record.time_step) == (5900, 0.01)
    moving = record.acceleration - record.acceleration.mean()
    assert np.abs(moving).max() == pytest.approx(0.04383, abs=0.5e-5)
    # 38.920 N 140.630 E to 39.6069 N 140.3213 E: 76.4 km north and 26.6 km west
    assert record.epicentral_distance == pytest.approx(np.hypot(76.4, 26.6), abs=0.2)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"4.383", b"4.483", "peak 4.483 gal stated"),
        (b"100Hz", b"200Hz", "at 200 Hz stated, that is 11800 samples, but 5900"),
        (b"2000(gal)", b"2010(gal)", "peak 4.383 gal stated"),
    ],
)
def test_a_lie_in_a_record_of_knet_is_found(
    installed: Path, old: bytes, new: bytes, message: str
) -> None:
    data = (installed / "nied" / "tests" / "data" / "test.knet").read_bytes()
    assert old in data
    with pytest.raises(InputError, match=message):
        read_bytes("test.EW", data.replace(old, new, 1))


@pytest.mark.parametrize("name", ["test.sac", "test.sac.swap"])
def test_sac_in_either_order_of_bytes(installed: Path, name: str) -> None:
    """SAC's own example is a sine with a period of 20 samples, and states no unit."""
    path = installed / "sac" / "tests" / "data" / name
    with pytest.raises(InputError, match=r"units unstated.*--units"):
        read_file(path)
    [record] = read_bytes(path, path.read_bytes(), ReadOptions(units="m/s2"))
    expected = -np.sin(2.0 * np.pi * np.arange(100) / 20.0)  # in single precision
    assert record.acceleration == pytest.approx(expected, abs=2e-5)
    assert (record.station, record.component, record.time_step) == ("STA", "Q", 1.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("sac/tests/data/seism-longer.sac", "NPTS 998 in the header, 1000 samples"),
        ("sac/tests/data/seism-shorter.sac", "NPTS 1000 in the header, 998 samples"),
        ("sac/tests/data/dis.G.SCZ.__.BHE_short", "300 samples at 0.05 s"),
        ("sac/tests/data/seism.sac", "IDEP 50 is volts"),
        ("sac/tests/data/null_terminated.sac", "IDEP 6 is displacement"),
        ("mseed/tests/data/test.mseed", "'BHZ' is a velocity, of a seismometer"),
        ("mseed/tests/data/gaps.mseed", r"gap in BW\.BGLD\.\.EHE"),
        ("mseed/tests/data/qualityflags.mseed", "flag missing or padded data"),
        ("mseed/tests/data/brokenlastrecord.mseed", "byte 4096"),
        ("mseed/tests/data/encoding/smallASCII_bigEndian.mseed", "contains 8 of"),
        ("mseed/tests/data/bizarre/emptyfile.mseed", "empty file"),
        ("mseed/tests/data/fullseed.mseed", "unknown format"),
    ],
)
def test_what_is_no_record_of_acceleration_is_rejected(
    installed: Path, name: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_file(installed / name)
