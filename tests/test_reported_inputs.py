"""Every input of the shared folder of reports gives the value of its README, or is refused.

The README lists files that people of this field hold and that failed once. Peaks are in g, and the
places of peaks are counted from 0, as there.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.commands import run

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_file
from rockframe.record import Orientation, Record
from rockframe.risk import read_hazard
from rockframe.selection.target import read_target
from rockframe.units import GRAVITY

FOLDER = Path(__file__).parents[2] / "shared" / "reports"
pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="no folder 'shared/reports' beside the repository"
)
MSEED = "CI.CLC..HNE.mseed"
STEPPED = ReadOptions("g", 0.01)
#: Number of samples, time step [s], and the largest absolute sample [g] of each record.
Stated = tuple[int, float, tuple[float, ...]]
LONG: Stated = (2500, 0.01, (0.5636,))
VALUES: list[tuple[str, ReadOptions, Stated]] = [
    ("01_eight_channels.csv", ReadOptions("g", 0.01, column="1"), LONG),
    ("01_eight_channels.csv", ReadOptions("g", 0.01, column="8"), (2500, 0.01, (1.7 * 0.5636,))),
    ("01_pairs4_gal.th", ReadOptions("gal", 0.01), LONG),
    ("02_savetxt_header.txt", ReadOptions("g", column="2"), (2500, 0.01, (0.4704,))),
    ("02_without_header.txt", ReadOptions("g", column="2"), (2500, 0.01, (0.4704,))),
    ("03_two_components.txt", ReadOptions("g", 0.01, column="2"), LONG),
    ("04_values5perline.txt", STEPPED, LONG),
    ("05_clock_time.csv", ReadOptions(None, 0.01, column="acc_g"), LONG),
    ("06_pandas_index.csv", ReadOptions(column="acc_g"), LONG),
    ("06_trailing_comma.csv", ReadOptions(column="2"), LONG),
    ("07_names_then_units.csv", ReadOptions("g"), (2500, 0.01, (0.4704, 0.5636, 0.3612))),
    ("07_deepsoil.txt", STEPPED, LONG),
    ("07_nees.txt", ReadOptions("g", column="ACC02"), LONG),
    ("08_jma.csv", ReadOptions(), (2500, 0.01, (0.4704, 0.5636, 0.3612))),
    ("08_knet_AOM017.csv", ReadOptions(), (
        11500, 0.01, tuple(peak / 981.0 for peak in (20.557, 16.452, 6.922)))),
    ("09_h1h2v.csv", ReadOptions("g"), (2500, 0.01, (0.5636, 0.4704, 0.3612))),
    ("09_mg.csv", ReadOptions(), LONG),
    ("10_RAC_cicese.dat", ReadOptions(), (
        17880, 0.005, tuple(peak / 981.0 for peak in (72.8008, 64.4431, 59.2262)))),
]  # fmt: skip
REFUSALS: list[tuple[str, ReadOptions, str]] = [
    ("01_eight_channels.csv", STEPPED, r"--column NUMBER, of 1 to 8"),
    ("11_gecko.ms", ReadOptions(), r"StationXML"),
    ("13_scale.sac", ReadOptions("m/s2"), r"Settled by --trust scale"),
    ("17_miniseed3.ms3", ReadOptions(), r"StationXML"),
    (f"14_epoch_ends_early/{MSEED}", ReadOptions(), r"for other times: from 2012-04-13"),
]


def peaks_of(records: list[Record]) -> list[float]:
    return [float(np.abs(record.acceleration).max()) / GRAVITY for record in records]


@pytest.mark.parametrize(("name", "options", "stated"), VALUES)
def test_an_input_gives_the_stated_values(name: str, options: ReadOptions, stated: Stated) -> None:
    count, step, peaks = stated
    records = read_file(FOLDER / name, options)
    assert [record.acceleration.size for record in records] == [count] * len(peaks)
    assert [record.time_step for record in records] == [step] * len(peaks)
    assert peaks_of(records) == pytest.approx(peaks, rel=5e-4)


@pytest.mark.parametrize(("name", "options", "words"), REFUSALS)
def test_an_input_without_its_options_is_refused(
    name: str, options: ReadOptions, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        read_file(FOLDER / name, options)


def recorders() -> None:
    """Kinemetrics K2 and its conversion, a Gecko, and miniSEED 3."""
    records = read_file(FOLDER / "12_K2.evt")
    assert [(record.acceleration.size, record.time_step) for record in records] == [
        (9750, 0.004)
    ] * 6
    first = records[0].acceleration
    assert np.abs(first - first.mean()).max() == pytest.approx(0.0877, abs=5e-5)
    [written] = read_file(FOLDER / "12_MOLA_1.AT2")
    assert np.isnan(written.azimuth)
    for name, count, step in (("11_gecko.ms", 206, 0.004), ("17_miniseed3.ms3", 2000, 0.01)):
        [record] = read_file(FOLDER / name, ReadOptions(sensitivity=1.0))
        assert (record.acceleration.size, record.time_step) == (count, step)


def components() -> None:
    """V beside H1 and H2 is the vertical, WE the east, and SCALE of SAC is a factor if trusted."""
    [_, _, vertical] = read_file(FOLDER / "09_h1h2v.csv", ReadOptions("g"))
    assert vertical.orientation is Orientation.VERTICAL
    files = sorted((FOLDER / "16_itaca_WE").iterdir())
    assert [read_file(path)[0].azimuth for path in files] == [0.0, 90.0]
    [scaled] = read_file(FOLDER / "13_scale.sac", ReadOptions("m/s2", trust=("scale",)))
    motion = scaled.acceleration - scaled.acceleration.mean()
    assert np.abs(motion).max() / GRAVITY == pytest.approx(0.0045, abs=1e-4)


def hazard() -> None:
    """An ordinate at the last level, a map in place of a curve, and probabilities of 0 or 1."""
    folder = FOLDER / "hazard"
    with pytest.raises(InputError, match="is the last intensity level of the job"):
        read_target(folder / "saturated_uhs.csv", probability=0.02)
    target = read_target(folder / "same_job_with_more_levels_uhs.csv", probability=0.02)
    assert np.exp(target.log_sa[0]) / GRAVITY == pytest.approx(2.885112, rel=1e-6)
    with pytest.raises(InputError, match=r"contains hazard maps \(hazard_map\)"):
        read_hazard(folder / "hazard_map-mean-475y_3.csv")
    for name in ("h_one.csv", "h_zero.csv"):
        assert np.isfinite(read_hazard(folder / name).rate).all()


@pytest.mark.parametrize("check", [recorders, components, hazard])
def test_further_inputs(check: Callable[[], None]) -> None:
    check()


@pytest.mark.parametrize("name", ["14_input_g", "14_location_dashes", "14_output_ms2"])
def test_a_station_xml_that_means_the_same_gives_the_same_motion(name: str, tmp_path: Path) -> None:
    """The peak is that of the corrected record, which `ingest` writes."""
    output = tmp_path / "records.nc"
    assert run("ingest", FOLDER / name / MSEED, "--workers", "0", "--output", output) == 0
    with xr.open_dataset(output) as records:
        samples = np.abs(records["acceleration"].values) / GRAVITY
    assert (samples.size, samples.argmax()) == (39001, 3933)
    assert samples.max() == pytest.approx(0.3467, rel=5e-4)


@pytest.mark.parametrize(
    ("motion", "structures", "scale"),
    [("touch.csv", "touch.toml", "1.5"), ("r0557.csv", "s.toml", "2")],
)
def test_a_motion_that_touches_the_limit_of_uplift_ends(
    tmp_path: Path, motion: str, structures: str, scale: str
) -> None:
    folder = FOLDER / "hang"
    words = ("--structures", folder / structures, "--scales", scale, "--margins", "none")
    assert run("screen", folder / motion, *words, "--output", tmp_path / "screen.nc") == 0


def test_every_input_is_in_a_test() -> None:
    """A new file in the folder needs a row here."""
    source = Path(__file__).read_text()
    files = [path for path in FOLDER.rglob("*") if path.is_file() and path.name != "README.md"]
    assert len(files) > 30
    # Files of one case are in a folder, which the tests name.
    places = [path.relative_to(FOLDER).parts for path in files]
    named = {parts[0] if parts[0][0].isdigit() else parts[-1] for parts in places}
    assert [name for name in sorted(named) if f'"{name}' not in source] == []
