"""Selected recordings with both horizontals: one spectrum and one scale for both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.screening import sine, stored, three

from rockframe.cli.main import main
from rockframe.components import (
    HorizontalPair,
    pair_horizontals,
    rotate,
    rotd_spectral_acceleration,
)
from rockframe.errors import ParameterError
from rockframe.ingest import read_file
from rockframe.options.ingest import IngestOptions, SelectOptions
from rockframe.record import Record
from rockframe.results.pulses import read_metadata
from rockframe.results.records import RecordsFile, open_records
from rockframe.signals.measures import spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.select import Selection, read_selection, select_stage

TARGET = "period_s,sa_g,sigma_ln_sa\n0.2,0.5,0.5\n0.5,0.6,0.5\n1,0.4,0.5\n2,0.2,0.6\n"


@pytest.fixture(scope="module")
def real(bundled_records: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("pairs")
    recordings = [bundled_records / f"Ridgecrest2019-{name}.V1" for name in ("CLC", "CCC")]
    ingest_stage(recordings, home / "records.nc", IngestOptions(), workers=0)
    return home


def selected(home: Path, **options: Any) -> Selection:
    target = home / "target.csv"
    target.write_text(TARGET, encoding="utf-8")
    wanted = SelectOptions(**{"target": target, "motions": 2, "pairs": "rotd50", **options})
    return select_stage(home / "records.nc", home / "selected.nc", wanted)


def of_selected(home: Path) -> dict[str, Record]:
    with open_records(home / "selected.nc") as file:
        return {record.record_id: record for record in file}


def levels(first: Record, second: Record, period: float) -> dict[str, float]:
    """Return Sa of two horizontals of known azimuths, by the public functions for each."""
    sweep = rotd_spectral_acceleration(HorizontalPair(first, second), period)
    alone = [spectral_acceleration(r.acceleration, r.time_step, [period]) for r in (first, second)]
    mean = float(np.sqrt(alone[0] * alone[1])[0])
    return {"rotd50": sweep.percentile(50), "rotd100": sweep.percentile(100)} | {
        "geometric-mean": mean
    }


@pytest.mark.parametrize("pairs", ["geometric-mean", "rotd50", "rotd100"])
def test_pairs_have_the_target_where_they_are_scaled(real: Path, pairs: str) -> None:
    """The spectrum of both written components is that of the target; both have one factor."""
    selection = selected(real, pairs=pairs, scale_period_s=0.7)
    records, scales = of_selected(real), read_selection(real / "selected.csv")
    aim = np.exp(selection.target.log_sa_at(0.7))
    seconds = {row["pair_of"]: row["record_id"] for row in selection.rows if row["pair_of"]}
    assert set(seconds) == {row["record_id"] for row in selection.motions}
    for row in selection.motions:
        first, second = records[row["record_id"]], records[seconds[row["record_id"]]]
        assert scales[first.record_id] == scales[second.record_id] == row["scale"]
        assert_allclose(levels(first, second, 0.7)[pairs], aim, rtol=5e-6)
    assert len(selection.rows) == 6  # two recordings, each with its vertical
    assert {scales[row["record_id"]] for row in selection.rows if row["vertical_of"]} == {
        row["scale"] for row in selection.motions
    }


def test_the_largest_direction_needs_the_smallest_factor(real: Path) -> None:
    """RotD100 is larger than RotD50 of a motion that is not the same in all directions."""
    scales = {}
    for pairs in ("rotd50", "rotd100"):
        motions = selected(real, pairs=pairs, scale_period_s=0.7).motions
        scales[pairs] = {row["record_id"]: row["scale"] for row in motions}
    for name, scale in scales["rotd100"].items():
        assert scale < scales["rotd50"][name]


def test_rotd_depends_on_neither_azimuths_nor_the_sense_of_a_component(
    real: Path, tmp_path: Path
) -> None:
    """The same motion, rotated by 37 degrees with one component reversed and no azimuths."""
    with open_records(real / "records.nc") as file:
        pairs, _ = pair_horizontals(file)
    turned = []
    for pair in pairs:
        first, second = rotate(pair, 37.0), rotate(pair, 127.0)
        for record, sign, name in ((first, 1.0, "a"), (second, -1.0, "b")):
            turned.append(
                replace(
                    record,
                    record_id=f"{record.station}-{name}",
                    acceleration=sign * record.acceleration,
                    azimuth=np.nan,
                )
            )
    stored(turned, tmp_path)
    before, after = selected(real), selected(tmp_path)
    by_station = {row["station"]: row["scale"] for row in before.motions}
    assert {row["station"] for row in after.motions} == set(by_station)
    for row in after.motions:
        assert_allclose(row["scale"], by_station[row["station"]], rtol=2e-3)  # whole degrees


def test_pairs_scaled_by_pgv_have_this_pgv(real: Path) -> None:
    selection = selected(real, pairs="geometric-mean", scale_pgv_m_s=0.4)
    records = of_selected(real)
    for row in selection.rows:
        if row["pair_of"]:
            both = [records[row["pair_of"]], records[row["record_id"]]]
            pgv = [peak(integrate(r.acceleration, r.time_step)) for r in both]
            assert_allclose(np.sqrt(pgv[0] * pgv[1]), 0.4, rtol=5e-6)


def test_a_component_alone_is_no_pair(tmp_path: Path) -> None:
    """One of three recordings lacks the other horizontal, so three cannot be selected."""
    stored([*three("a"), *three("b"), sine("c", 3.0)], tmp_path)
    selection = selected(tmp_path)
    assert (selection.records, selection.candidates) == (3, 2)
    assert selection.left_out["c"] == "pairs need both horizontals"
    with pytest.raises(
        ParameterError, match=r"only 2 can be selected of 3 recordings\. Filtered out: 1 by pairs\."
    ):
        selected(tmp_path, motions=3)


def flatfile_of(home: Path, path: Path) -> None:
    """Write the flatfile of the records of a folder, with RotD50 as `--pairs` computes it."""
    periods = [0.01, 0.2, 0.5, 0.7, 1.0, 2.0, 4.0]
    with open_records(home / "records.nc") as file:
        pairs, _ = pair_horizontals(file)
    rows = ["ID,Sta,PGV,Lowest," + ",".join(f"Sa {period}" for period in periods)]
    for pair in pairs:
        sweeps = [rotd_spectral_acceleration(pair, period) for period in periods]
        sa = ",".join(repr(sweep.percentile(50)) for sweep in sweeps)
        rows.append(f"{pair.first.record_id},{pair.first.station},0.4,0.05,{sa}")
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


WORDS = ("record_id=ID", "station=Sta", "sa_m_s2=Sa {}", "lowest_usable_frequency_hz=Lowest")


def test_a_flatfile_gives_the_selection_of_its_waveforms(real: Path, tmp_path: Path) -> None:
    """The spectra are the same, so the scales are; the list scales the records that are read."""
    flatfile_of(real, tmp_path / "flat.csv")
    of_waveforms = selected(real, scale_period_s=0.7)
    (tmp_path / "target.csv").write_text(TARGET, encoding="utf-8")
    options = SelectOptions(
        target=tmp_path / "target.csv", motions=2, scale_period_s=0.7, flatfile_columns=WORDS
    )
    listed = select_stage(tmp_path / "flat.csv", tmp_path / "list.csv", options)
    assert not list(tmp_path.glob("*.nc"))
    scales = {row["record_id"]: row["scale"] for row in of_waveforms.motions}
    assert {row["record_id"]: row["scale"] for row in listed.motions} == scales
    assert_allclose(listed.log_sa, of_waveforms.log_sa, rtol=1e-9, atol=1e-9)
    assert read_selection(tmp_path / "list.csv") == scales


def test_the_list_of_a_flatfile_scales_the_files_that_it_names(
    bundled_records: Path, tmp_path: Path
) -> None:
    """The archive's names of the files are the identifiers of the records in them."""
    rows = (
        "Record Sequence Number,EQID,Earthquake Name,YEAR,Station Name,File Name (Horizontal 1),"
        "File Name (Horizontal 2),File Name (Vertical),T0.200S,T2.000S\n"
        "7,1,Ridgecrest,2019,CLC,RIDGE\\CLC090.AT2,RIDGE\\CLC360.AT2,RIDGE\\CLC-UP.AT2,1.0,0.2\n"
    )
    (tmp_path / "flat.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "target.csv").write_text("period_s,sa_g\n0.2,0.5\n2,0.1\n", encoding="utf-8")
    wanted = SelectOptions(target=tmp_path / "target.csv", motions=1)
    listed = select_stage(tmp_path / "flat.csv", tmp_path / "list.csv", wanted)
    files = tmp_path / "download"
    files.mkdir()
    records = read_file(bundled_records / "Ridgecrest2019-CLC.V1")
    for row, record in zip(listed.rows, records, strict=True):
        samples = record.acceleration / 9.81
        header = f"PEER\nRidgecrest, {record.component}\nACCELERATION IN UNITS OF G\n"
        lines = "\n".join(f"{value: .7E}" for value in samples)
        size = f"NPTS= {samples.size}, DT= {record.time_step:.4f} SEC\n"
        (files / row["file"]).write_text(f"{header}{size}{lines}\n", encoding="utf-8")
    options = IngestOptions(selection=tmp_path / "list.csv")
    done = ingest_stage([files], tmp_path / "made.nc", options, workers=0)
    assert len(done.accepted) == 3
    with open_records(tmp_path / "made.nc") as file:
        for record in file:
            assert record.processing[-1] == "scaled by 0.5"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pulse_like": True}, "pulse_like needs waveforms, which a flatfile has not. Remove it."),
        (
            {"scale_pgv_m_s": 0.4},
            r"only 0 can be selected of 2 recordings\. Filtered out: 2 by pgv\.",
        ),
        (
            {"scale_pgv_m_s": 4.0, "flatfile_columns": (*WORDS, "pgv_m_s=PGV")},
            r"only 0 can be selected of 2 recordings\. Filtered out: 2 by scale_bounds\.",
        ),
        (
            {"periods_s": (0.2, 3.0), "target": "long.csv"},
            "Filtered out: 2 by usable_period_longest",
        ),
    ],
)
def test_a_selection_from_a_flatfile_that_is_impossible(
    real: Path, tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    flatfile_of(real, tmp_path / "flat.csv")
    text = (tmp_path / "flat.csv").read_text(encoding="utf-8").replace(",0.4,0.05,", ",0.4,0.5,")
    (tmp_path / "flat.csv").write_text(text, encoding="utf-8")
    (tmp_path / "long.csv").write_text("period_s,sa_g\n0.2,0.5\n4,0.05\n", encoding="utf-8")
    (tmp_path / "target.csv").write_text(TARGET, encoding="utf-8")
    target = tmp_path / options.pop("target", "target.csv")
    wanted = SelectOptions(target=target, motions=2, **{"flatfile_columns": WORDS, **options})
    with pytest.raises(ParameterError, match=message):
        select_stage(tmp_path / "flat.csv", tmp_path / "list.csv", wanted)
    assert not (tmp_path / "list.csv").exists()


def test_the_output_says_what_is_selected_from(
    real: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A list needs a flatfile, a file of records waveforms; the search of PEER takes numbers."""
    (tmp_path / "target.csv").write_text("period_s,sa_g\n0.2,0.5\n2,0.1\n", encoding="utf-8")
    flat = tmp_path / "flat.csv"
    flat.write_text(
        "Record Sequence Number,EQID,Earthquake Name,YEAR,T0.200S,T2.000S\n"
        "7,1,Kobe,1995,1.0,0.2\n8,1,Kobe,1995,1.0,0.2\n",
        encoding="utf-8",
    )
    words = ["--target", f"{tmp_path}/target.csv", "--motions", "2", "--output"]
    assert main(["select", str(flat), *words, f"{tmp_path}/list.csv"]) == 0
    assert "Record sequence numbers, for the search of PEER: 7, 8" in capsys.readouterr().out
    for files, output, message in (
        ([flat], "s.nc", "flat.csv: is a NGA-West2 flatfile without waveforms. State the list"),
        ([real / "records.nc"], "s.csv", "has waveforms. State a netCDF file as output"),
        ([flat, flat], "s.csv", "2 files to select from for a list. Must be one flatfile."),
    ):
        assert main(["select", *map(str, files), *words, f"{tmp_path}/{output}"]) == 2
        assert message in capsys.readouterr().err
    assert main(["select", str(flat), *words, f"{tmp_path}/s.csv", "--pulses", "p.nc"]) == 2
    assert "--pulses has no effect: a flatfile has no waveforms" in capsys.readouterr().err
    assert not list(tmp_path.glob("s*"))


def test_a_table_by_words_is_not_of_peer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Decimal commas select what points do; its names are no numbers of PEER, even as digits; a
    file of records is refused with the way out.
    """
    (tmp_path / "target.csv").write_text("period_s,sa_g\n0.2,0.6\n1,0.3\n2,0.1\n", encoding="utf-8")
    flat = tmp_path / "flat.csv"
    flat.write_text("ID;SA_0,2;SA_1;SA_2\n11;0,6;0,3;0,1\n12;1;1;1\n", encoding="utf-8")
    words = ["--flatfile-columns", "record_id=ID", "sa_g=SA_{}", "--motions", "1", "--output"]
    words = ["select", str(flat), "--target", f"{tmp_path}/target.csv", *words]
    assert main([*words, f"{tmp_path}/list.csv"]) == 0
    out = capsys.readouterr().out
    assert "2 of 2 recordings were candidates." in out
    assert "PEER" not in out
    assert read_selection(tmp_path / "list.csv") == {"11": pytest.approx(1.0)}
    assert main([*words, f"{tmp_path}/list.nc"]) == 2
    assert "has no waveforms. State the list of its files as output" in capsys.readouterr().err


def test_a_pair_is_usable_as_long_as_both_components(
    real: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The target ends at 2 s, and one component of each pair says nothing beyond 1 s."""

    def usable(_file: RecordsFile, name: str) -> tuple[float, float]:
        return 0.0, 1.0 if name.endswith("360") else 9.0

    monkeypatch.setattr(RecordsFile, "usable_periods", usable)
    with pytest.raises(ParameterError, match="Filtered out: 2 by usable_period_longest"):
        selected(real)


@pytest.mark.parametrize(("wanted", "station"), [(True, "CLC"), (False, "CCC")])
def test_a_pair_is_pulse_like_if_a_component_is(
    real: Path, monkeypatch: pytest.MonkeyPatch, *, wanted: bool, station: str
) -> None:
    """The second component of CLC has a pulse, and no component of CCC."""
    known = read_metadata(real / "records.nc", None)
    pulse_like: list[bool | None] = [name == "Ridgecrest2019-CLC-360" for name in known.names]
    metadata = replace(known, pulse_like=pulse_like)
    monkeypatch.setattr("rockframe.stages.select.read_metadata", lambda *_: metadata)
    (real / "pulses.nc").write_bytes(b"")
    (real / "target.csv").write_text(TARGET, encoding="utf-8")
    options = SelectOptions(
        target=real / "target.csv", motions=1, pairs="rotd50", pulse_like=wanted
    )
    selection = select_stage(
        real / "records.nc", real / "pulsed.nc", options, pulses_path=real / "pulses.nc"
    )
    assert [row["station"] for row in selection.motions] == [station]
