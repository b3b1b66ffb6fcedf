"""`ingest --azimuth` and `--strike`: rotated records replace the recorded horizontals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from rockframe import HorizontalPair, rotd
from rockframe.cli.main import main
from rockframe.errors import InputError, RockframeWarning
from rockframe.options.ingest import IngestOptions
from rockframe.options.respond import RespondOptions
from rockframe.record import Record
from rockframe.results.records import read_records
from rockframe.results.response import open_response
from rockframe.signals.measures import arias_intensity, spectral_acceleration
from rockframe.signals.passport import Passport
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.respond import respond_stage


def peer(
    path: Path, component: str, samples: NDArray[np.float64], station: str = "Christmas Canyon"
) -> None:
    """Write a PEER file of samples [g] every 0.01 s."""
    path.write_text(
        "PEER NGA STRONG MOTION DATABASE RECORD\n"
        f"Ridgecrest, 7/6/2019, {station}, {component}\n"
        "ACCELERATION TIME SERIES IN UNITS OF G\n"
        f"NPTS= {samples.size}, DT= .0100 SEC\n" + "\n".join(f"{a:.7f}" for a in samples)
    )


def three(folder: Path, cut: int = 0, azimuths: tuple[str, str] = ("090", "360")) -> Path:
    """Write PEER files of one station: two horizontals, one shorter by `cut`, and a vertical."""
    folder.mkdir(exist_ok=True)
    for k, component in enumerate((*azimuths, "UP")):
        samples = 0.05 * np.random.default_rng(k).standard_normal(4000 - (cut if k == 1 else 0))
        peer(folder / f"CCC{component}.AT2", component, samples)
    return folder


def test_toward_a_recorded_azimuth_the_motion_is_the_recorded_one(tmp_path: Path) -> None:
    folder = three(tmp_path / "in")
    ingest_stage([folder], tmp_path / "as.nc", workers=0)
    ingest_stage(
        [folder], tmp_path / "to.nc", workers=0, options=IngestOptions(azimuth_degree=90.0)
    )
    recorded = {record.component: record for record in read_records(tmp_path / "as.nc")}
    toward, upward = read_records(tmp_path / "to.nc")
    np.testing.assert_array_equal(toward.acceleration, recorded["090"].acceleration)
    np.testing.assert_array_equal(upward.acceleration, recorded["UP"].acceleration)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "as.csv", "as.nc", "in", "to.csv", "to.nc"
    ]  # fmt: skip


def test_a_vertical_is_cut_with_its_pair_and_found_by_respond(tmp_path: Path) -> None:
    folder = three(tmp_path / "in", cut=30)
    output = tmp_path / "records.nc"
    result = ingest_stage([folder], output, workers=0, options=IngestOptions(strike_degree=0.0))
    records = read_records(output)
    assert [record.acceleration.size for record in records] == [3970] * 3
    assert [record.azimuth for record in records[:2]] == [90.0, 0.0]
    assert [row.status for row in result.entries] == ["accepted"] * 3 + ["rotated"] * 2
    assert (
        respond_stage(
            output, tmp_path / "response.nc", options=RespondOptions(vertical=True, margins="none")
        )
        == ()
    )
    with open_response(tmp_path / "response.nc") as response:
        assert len(response.records) == 3  # each component, and both together


def test_rotd_of_both_horizontals_stands_beside_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The Housner intensity has 121 periods; here, the column only has to be that of the function.
    monkeypatch.setattr("rockframe.results.records.housner_intensity", arias_intensity)
    folder = three(tmp_path / "in")
    for name, rotation in (("as.nc", None), ("to.nc", 30.0)):
        options = IngestOptions(azimuth_degree=rotation, spectral_periods_s=(1.0,))
        ingest_stage([folder], tmp_path / name, options, workers=0)
    with xr.open_dataset(tmp_path / "as.nc") as recorded, xr.open_dataset(tmp_path / "to.nc") as to:
        across = recorded.isel(record=[0, 1])
        assert (across["pga_rotd100"] >= across["pga"].max()).all()
        assert (across["pga_rotd50"] <= across["pga_rotd100"]).all()
        assert np.isnan(recorded["pga_rotd50"].values[2])
        for name in ("pga_rotd50", "pga_rotd100", "pgv_rotd50", "pgv_rotd100", "azimuth_rotd100"):
            assert to[name].values[0] == recorded[name].values[0] == recorded[name].values[1]
        _require_spectra(recorded, to, read_records(tmp_path / "to.nc")[0])


def _require_spectra(recorded: xr.Dataset, to: xr.Dataset, rotated: Record) -> None:
    """Spectra are those of the record itself, and RotD those of the pair, whatever the rotation."""
    assert to["spectral_period"].values.tolist() == [1.0]
    expected = spectral_acceleration(rotated.acceleration, rotated.time_step, [1.0])
    np.testing.assert_array_equal(to["spectral_acceleration"].values[0], expected)
    found = arias_intensity(rotated.acceleration, rotated.time_step)
    assert to["housner_intensity"].values[0] == found
    assert np.isnan(recorded["spectral_acceleration_rotd50"].values[2]).all()
    across = recorded["spectral_acceleration"].values[:2].max(axis=0)
    assert (recorded["spectral_acceleration_rotd100"].values[0] >= across).all()
    for share in ("rotd50", "rotd100"):
        name = f"spectral_acceleration_{share}"
        for other in (to[name].values[0], recorded[name].values[1]):
            np.testing.assert_array_equal(recorded[name].values[0], other)


def test_rotd_is_that_of_the_pair_cut_to_its_vertical_wherever_the_files_lie(
    tmp_path: Path,
) -> None:
    """Peaks near the end of both horizontals lie beyond the vertical, so they do not count."""
    chance = np.random.default_rng(7)
    for name, component, size, station in (
        ("a", "090", 4000, "Christmas Canyon"),
        ("b", "090", 4000, "Another"),
        ("c", "UP", 3980, "Christmas Canyon"),
        ("m", "360", 3990, "Christmas Canyon"),
    ):
        samples = 0.05 * chance.standard_normal(size)
        samples[3985:] = 0.4
        peer(tmp_path / f"{name}.AT2", component, samples, station)
    with pytest.warns(RockframeWarning, match=r"without 0.1 s and 13 % of the energy of 'a'"):
        ingest_stage([tmp_path], tmp_path / "records.nc", workers=0)
    first, second, vertical = (
        next(r for r in read_records(tmp_path / "records.nc") if r.record_id == name)
        for name in "amc"
    )
    east, north = (
        replace(one, acceleration=one.acceleration[: vertical.acceleration.size])
        for one in (first, second)
    )
    expected = rotd(HorizontalPair(east, north))
    with xr.open_dataset(tmp_path / "records.nc") as written:
        found = dict(zip(written["record_id"].values, written["pga_rotd100"].values, strict=True))
    assert found["a"] == found["m"] == expected.percentile(100)
    assert expected.percentile(100) < 0.9 * first.pga
    assert np.isnan([found["b"], found["c"]]).all()


def test_what_is_of_no_pair_is_rejected_with_the_reason(tmp_path: Path) -> None:
    folder = three(tmp_path / "in")
    (folder / "alone.csv").write_text("time_s,acc_g\n0.0,0.1\n0.1,-0.2\n0.2,0.3\n")
    options = IngestOptions(azimuth_degree=30.0)
    result = ingest_stage([folder], tmp_path / "records.nc", options, workers=0)
    assert [record.record_id for record in result.accepted] == ["CCC090-rotated-30", "CCCUP"]
    (rejection,) = result.rejections
    assert rejection.file == "alone.csv"
    assert rejection.reason.startswith("record 'alone': direction unstated.")
    with pytest.raises(InputError, match=r"alone\.csv: record 'alone': direction unstated"):
        ingest_stage(
            [folder],
            tmp_path / "other.nc",
            options.replaced(strict=True),
            workers=0,
        )
    assert not (tmp_path / "other.csv").exists()


def test_no_pair_at_all_leaves_the_table(tmp_path: Path) -> None:
    folder = three(tmp_path / "in", azimuths=("090", "135"))
    with pytest.raises(InputError, match=r"azimuths 90 and 135 degrees .* \(1 more rejected"):
        ingest_stage(
            [folder / "CCC090.AT2", folder / "CCC135.AT2"],
            tmp_path / "records.nc",
            workers=0,
            options=IngestOptions(azimuth_degree=30.0),
        )
    assert (tmp_path / "records.csv").exists()
    assert not (tmp_path / "records.nc").exists()


def test_damage_of_the_components_is_that_of_the_motion(tmp_path: Path) -> None:
    time = 0.01 * np.arange(4000)
    for azimuth, seed in (("090", 1), ("360", 2)):
        samples = 0.3 * np.random.default_rng(seed).standard_normal(4000) * np.exp(-time / 8)
        if azimuth == "090":
            samples[2000:2010] = 0.9  # clipped at the range of its instrument
        peer(tmp_path / f"CCC{azimuth}.AT2", azimuth, samples)
    output = tmp_path / "records.nc"

    def toward(azimuth: float) -> Passport:
        [record] = ingest_stage(
            [tmp_path / "CCC090.AT2", tmp_path / "CCC360.AT2"],
            output,
            options=IngestOptions(uncorrected=True, azimuth_degree=azimuth),
            workers=0,
        ).accepted
        return record.passport

    between = toward(30.0)
    assert between.measures.clipped_samples == 10
    assert {"clipped_samples", "opening_share"} <= {*between.warnings}
    assert between.late_trigger
    assert toward(0.0).measures.clipped_samples == 1


def test_the_cut_end_of_the_components_is_that_of_the_motion(tmp_path: Path) -> None:
    """The motion itself ends at rest: its components were tapered when they were filtered."""
    paths, shares = [tmp_path / f"CCC{azimuth}.AT2" for azimuth in ("090", "360")], []
    for k, path in enumerate(paths):
        noise = 0.3 * np.random.default_rng(k).standard_normal(4000)
        peer(path, path.stem[3:], noise * np.geomspace(0.01, 1.0, 4000))
    for azimuth in (None, 30.0):
        options = IngestOptions(uncorrected=True, azimuth_degree=azimuth)
        found = ingest_stage(paths, tmp_path / "records.nc", options=options, workers=0).accepted
        shares.append([one.passport.measures.closing_share for one in found])
    assert shares[1] == [max(shares[0])]


def test_long_names_stay_apart(tmp_path: Path) -> None:
    for end in "pq":
        folder = three(tmp_path / end)
        for path in folder.iterdir():
            text = path.read_text().replace("Christmas Canyon", f"Station {end}")
            path.with_name(f"{'A' * 54}-{end}-{path.name}").write_text(text)
            path.unlink()
    output = tmp_path / "records.nc"
    ingest_stage(
        [tmp_path / "p", tmp_path / "q"], output, IngestOptions(azimuth_degree=30.0), workers=0
    )
    names = [record.record_id for record in read_records(output)]
    assert len(names) == len({*names}) == 4
    assert max(map(len, names)) == 64


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, output = three(tmp_path / "in"), tmp_path / "records.nc"
    words = ["ingest", str(folder), "--output", str(output)]
    assert main([*words, "--strike", "320"]) == 0
    assert "CCC090-rotated-50" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="2"):
        main([*words, "--azimuth", "nan"])
    assert capsys.readouterr().err.count("\n") == 1
    assert main([*words, "--azimuth", "1", "--strike", "2"]) == 2
    assert "State only one of them" in capsys.readouterr().err
