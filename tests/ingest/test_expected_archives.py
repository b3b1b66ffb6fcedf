"""The archives' real files read as the shared table says; its peaks are in g of 9.80665 m/s2."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from tests.ingest.shared import files_of

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, collect, read_file, sorted_out
from rockframe.record import Orientation, Record
from rockframe.signals.processing import BandPass, correct

STANDARD_GRAVITY = 9.80665
#: Number of samples before the motion; the table subtracts their mean as the offset.
QUIET = 1000
Facts = tuple[int, float, float]


def expected(shared_records: Path, name: str) -> list[Facts]:
    with (shared_records / "EXPECTED.tsv").open(encoding="utf-8") as stream:
        return [
            (int(row["samples"]), float(row["time_step_s"]), float(row["pga"]))
            for row in csv.DictReader(stream, delimiter="\t")
            if row["file"] == name
        ]


def signed_peak(record: Record, unit: float, quiet: int | None = 0) -> float:
    """Return the peak over `unit`, minus the mean of the first `quiet` samples (None: of all)."""
    samples = record.acceleration
    offset = samples[:quiet].mean() if quiet != 0 else 0.0
    return float((samples - offset)[np.abs(samples - offset).argmax()]) / unit


def compare(path: Path, unit: float, quiet: int | None, options: ReadOptions) -> None:
    rows = expected(path.parents[2], path.name)
    records = read_file(path, options)
    assert [(r.acceleration.size, r.time_step) for r in records] == [row[:2] for row in rows]
    for record, (_, _, peak) in zip(records, rows, strict=True):
        assert signed_peak(record, unit, quiet) == pytest.approx(peak, abs=6e-7)


@pytest.mark.parametrize(
    ("folder", "quiet"),
    [("knet", None), ("esm", 0), ("geonet", 0), ("afad", 0), ("miniseed", QUIET)],
)
def test_archives(shared_records: Path, folder: str, quiet: int | None) -> None:
    for name in files_of(folder):
        path = shared_records / "formats" / name
        compare(path, STANDARD_GRAVITY, quiet, ReadOptions())


@pytest.mark.parametrize(
    ("ending", "units", "unit"), [(".sac", "g", 9.81), (".SAC", "cm/s2", 0.01)]
)
def test_sac(shared_records: Path, ending: str, units: str, unit: float) -> None:
    for name in files_of("sac", ending):
        path = shared_records / "formats" / name
        compare(path, unit, 0, ReadOptions(units=units))
        with pytest.raises(InputError, match="units unstated"):
            read_file(path)


@pytest.mark.parametrize(
    ("name", "unit", "options"),
    [
        # The table treats the numbers as m/s2; their size (0.76 g) shows that they are in cm/s2.
        ("CHV1-20140203E.txt", 9.81, ReadOptions(units="m/s2")),
        ("tabasFN.txt", 9.81, ReadOptions(units="g", time_step=0.02)),
    ],
)
def test_text(shared_records: Path, name: str, unit: float, options: ReadOptions) -> None:
    compare(shared_records / "formats" / "text" / name, unit, 0, options)


def test_text_without_a_time_step(shared_records: Path) -> None:
    with pytest.raises(InputError, match=r"time step unstated.*--time-step"):
        read_file(shared_records / "formats" / "text" / "tabasFN.txt", ReadOptions(units="g"))


@pytest.mark.parametrize(
    ("file", "facts"),
    [
        ("knet/NGNH311106302345.EW1", ("EW1", 90.0, "NGNH31 (borehole)", "BO", 2.4)),
        ("knet/NGNH311106302345.EW2", ("EW2", 90.0, "NGNH31 (surface)", "BO", 2.4)),
        ("esm/HI.ARS1..HNN.D.20190728.160908.C.ACC.ASC", ("HNN", 0.0, "ARS1", "HI", 4.6)),
        ("geonet/20180212_211557_WPWS_20.V2A", ("S16W", 196.0, "WPWS", "", 4.17)),
        ("afad/20170720223109_0921.txt", ("N-S", 0.0, "0921", "", 6.5)),
    ],
)
def test_facts(shared_records: Path, file: str, facts: tuple[str, float, str, str, float]) -> None:
    record = read_file(shared_records / "formats" / file)[0]
    found = record.component, record.azimuth, record.station, record.network, record.magnitude
    assert found == facts


def test_folder_of_miniseed(shared_records: Path) -> None:
    records, rejections = sorted_out(collect([shared_records / "formats" / "miniseed"]))
    assert [record.record_id[-3:] for record in records] == ["HNE", "HNN", "HNZ"]
    assert rejections == []


def test_the_same_motion_as_miniseed_and_as_v1(shared_records: Path) -> None:
    """The two differ by at most 0.302 % of the peak: the V1 was made with another sensitivity
    (0.27 %), and its g is 9.81 m/s2 here (0.03 %).
    """
    counts = [
        read_file(shared_records / "formats" / "miniseed" / f"CI.CLC..{code}.mseed")[0]
        for code in ("HNE", "HNN", "HNZ")
    ]
    printed = read_file(shared_records / "ridgecrest2019" / "CICLC.v1")
    for one, other in zip(counts, printed, strict=True):
        assert (one.orientation is Orientation.VERTICAL) == (
            other.orientation is Orientation.VERTICAL
        )
        a, b = one.acceleration[:], other.acceleration[:]
        a, b = a - np.median(a), b - np.median(b)
        shift = int(np.abs(b).argmax()) - int(np.abs(a).argmax())
        start, end = max(0, -shift), min(a.size, b.size - shift)
        peak = np.abs(a).max()
        assert np.abs(a[start:end] - b[start + shift : end + shift]).max() < 0.0031 * peak


def test_full_response_against_sensitivity(shared_records: Path) -> None:
    """From 1 to 10 Hz, the stages amplify 0.1 to 1.6 % more than the stated sensitivity."""
    path = shared_records / "formats" / "miniseed" / "CI.CLC..HNE.mseed"
    [alone], [full] = read_file(path), read_file(path, ReadOptions(water_level=60.0))
    assert full.processing == (
        "response removed: mean removed, 5% cosine taper, water level 60 dB (CI.CLC.xml)",
    )
    band = BandPass(0.5, 10.0)
    a, b = (correct(record.acceleration, record.time_step, band)[0] for record in (alone, full))
    assert np.abs(b).max() == pytest.approx(np.abs(a).max(), rel=0.02)


@pytest.mark.parametrize("water_level", [None, 60.0])
def test_response_per_nanometre(
    shared_records: Path, tmp_path: Path, water_level: float | None
) -> None:
    path = shared_records / "formats" / "miniseed" / "CI.CLC..HNE.mseed"
    xml = tmp_path / "nano.xml"
    xml.write_text(path.with_name("CI.CLC.xml").read_text().replace("M/S**2", "nm/s**2"))
    [metres] = read_file(path, ReadOptions(water_level=water_level))
    [nanometres] = read_file(path, ReadOptions(water_level=water_level, station_xml=xml))
    ratio = np.abs(nanometres.acceleration).max() / np.abs(metres.acceleration).max()
    assert ratio == pytest.approx(1e-9, rel=1e-9)


@pytest.mark.parametrize("units", ["M/S", "furlong"])
def test_first_stage_of_another_quantity(shared_records: Path, tmp_path: Path, units: str) -> None:
    path = shared_records / "formats" / "miniseed" / "CI.CLC..HNE.mseed"
    sensitivity, stages = path.with_name("CI.CLC.xml").read_text().split('<Stage number="1">', 1)
    xml = tmp_path / "odd.xml"
    xml.write_text(f'{sensitivity}<Stage number="1">{stages.replace("M/S**2", units, 1)}')
    with pytest.raises(InputError, match=rf"first stage of CI\.CLC\.\.HNE is per '{units}', its"):
        read_file(path, ReadOptions(water_level=60.0, station_xml=xml))
