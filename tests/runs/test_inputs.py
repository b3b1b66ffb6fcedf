"""Inputs of a run: each is listed once under a unique name, or rejected in one line."""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
import zipfile
from pathlib import Path

import pytest
from tests.runs.small import FEW, STUDY, make_study, run

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.ingest import sources_of
from rockframe.provenance import sha256_of
from rockframe.results.records import read_records
from rockframe.results.tables.entries import rows_of
from rockframe.runs.plan import make_plan
from rockframe.study.study import read_study
from rockframe.units import GRAVITY

#: The end of a ZIP archive that states a wrong position of its list of members.
DAMAGED_ZIP = b"hello" * 20 + b"PK\5\6" + bytes([0, 0, 0, 0, 1, 0, 1, 0, 46, 0, 0, 0, 255, 255])


def listed(study: Path) -> list[str]:
    return [file.name for file in make_plan(read_study(study), study.parent / "run").inputs]


def stating(study: Path, paths: str) -> Path:
    study.write_text(FEW.replace('["motions"]', paths))
    return study


def test_folders_of_one_name_keep_all_their_files(tmp_path: Path) -> None:
    """Two events have records and catalogues of the same file names."""
    study = stating(make_study(tmp_path, 1), '["motions", "far/motions"]')
    shutil.copytree(tmp_path / "motions", tmp_path / "far" / "motions")
    other = tmp_path / "far" / "motions" / "motion-0.csv"
    other.write_text(other.read_text().replace("0.3", "0.2"))
    for folder, magnitude in (("motions", 6.5), ("far/motions", 7.5)):
        heads = "file,event,station,network,magnitude,epicentral_distance_km,source"
        text = f"{heads}\nmotion-0.csv,quake,here,XX,{magnitude},10.0,measured\n"
        (tmp_path / folder / "catalogue.csv").write_text(text)
    assert run(study, tmp_path / "run") == 0
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    names = ["catalogue.csv", "motion-0.csv"]
    assert set(manifest["inputs"]) == {
        f"{folder}/{name}" for folder in ("motions", "motions-2") for name in names
    }
    assert main(["verify", str(tmp_path / "run")]) == 0
    files = [row["file"] for row in rows_of(tmp_path / "run" / "records.csv")]
    assert {"motions/motion-0.csv", "motions-2/motion-0.csv"} <= set(files)


def test_file_that_is_stated_twice_over_is_listed_once(tmp_path: Path) -> None:
    study = stating(make_study(tmp_path, 2), '["motions", "motions/motion-0.csv"]')
    assert listed(study) == ["motions/motion-0.csv", "motions/motion-1.csv"]


def test_files_of_one_name_have_a_number(tmp_path: Path) -> None:
    study = stating(make_study(tmp_path, 1), '["motions/motion-0.csv", "far/motion-0.csv"]')
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "motion-0.csv").write_text("0.1\n")
    assert listed(study) == ["motion-0.csv", "motion-0.csv (2)"]


def test_link_is_called_as_it_is_named(tmp_path: Path) -> None:
    """The location of an archive on one machine must not appear in the run."""
    study = stating(make_study(tmp_path, 1), '["archive"]')
    (tmp_path / "archive").symlink_to("motions")
    assert listed(study) == ["archive/motion-0.csv"]
    (source,) = sources_of([tmp_path / "archive"])
    assert source.name == "motion-0.csv"


def test_what_cannot_be_opened_is_no_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The plan skips such a file; ingest later lists it as rejected."""
    study = stating(make_study(tmp_path, 1), '["motions"]')
    closed = tmp_path / "motions" / "closed"
    closed.mkdir()
    (closed / "motion.csv").write_text("0.1\n")
    (tmp_path / "motions" / "loop.csv").symlink_to("loop.csv")
    stat = os.stat

    def deny(path: str | Path, **options: bool) -> os.stat_result:
        if Path(path).parent == closed:
            raise PermissionError(13, "Permission denied", str(path))
        return stat(path, **options)

    monkeypatch.setattr("os.stat", deny)
    assert listed(study) == ["motions/motion-0.csv"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
@pytest.mark.parametrize("name", ["motions", "motion.csv"])
def test_pipe_is_not_waited_for(tmp_path: Path, name: str) -> None:
    study = stating(make_study(tmp_path, 1), f'["motions/{name}"]')
    os.mkfifo(tmp_path / "motions" / name)
    with pytest.raises(InputError, match=r"is not a regular file\."):
        listed(study)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_pipe_beside_a_record_is_no_station_file(tmp_path: Path) -> None:
    study = stating(make_study(tmp_path, 1), '["motions/motion-0.csv"]')
    os.mkfifo(tmp_path / "motions" / "station.xml")
    assert listed(study) == ["motion-0.csv"]


def test_records_in_archives_are_inputs_beside_their_archives(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A record states the hash of its member; the list of inputs states that of the archive.

    The plan takes damaged archives as they are, and ingest rejects them.
    """
    study = stating(make_study(tmp_path, 3), '["motions"]')
    motions = tmp_path / "motions"
    with zipfile.ZipFile(motions / "event.zip", "w") as archive:
        archive.write(motions / "motion-0.csv", "motion-0.csv")
    (motions / "motion-1.csv.gz").write_bytes(
        gzip.compress((motions / "motion-1.csv").read_bytes())
    )
    damaged = {"notes.zip": DAMAGED_ZIP, "strong.zip": DAMAGED_ZIP + bytes(6)}
    for name, content in damaged.items():
        (motions / name).write_bytes(content)
    held = {
        f"motions/{name}": sha256_of(motions / name.partition(":")[2])
        for name in ("event.zip:motion-0.csv", "motion-1.csv.gz:motion-1.csv")
    }
    for name in ("motion-0.csv", "motion-1.csv"):
        (motions / name).unlink()
    assert run(study, tmp_path / "run") == 1
    said = capsys.readouterr().err
    assert all(f"rejected: {name}" in said for name in damaged)
    planned = {row["file"]: row["sha256"] for row in rows_of(tmp_path / "run" / "inputs.csv")}
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert manifest["inputs"] == planned | held
    assert main(["verify", str(tmp_path / "run")]) == 0


def test_names_that_do_not_print_are_listed_as_they_are_said(tmp_path: Path) -> None:
    study = stating(make_study(tmp_path, 2), '["motions"]')
    for k, name in enumerate((b"El Centro\n(NS).csv", b"\xff.csv")):
        record = tmp_path / "motions" / f"motion-{k}.csv"
        try:
            record.rename(Path(os.fsdecode(os.fsencode(tmp_path / "motions") + b"/" + name)))
        except OSError:
            pytest.skip("a file system that refuses such names")
    assert run(study, tmp_path / "run") == 0
    rows, entries = (list(rows_of(tmp_path / "run" / f"{n}.csv")) for n in ("records", "inputs"))
    assert len(rows) == 2
    assert [entry["file"] for entry in entries] == [f"motions/{row['file']}" for row in rows]
    for row in rows:
        assert main(["show", str(tmp_path / "run"), row["file"]]) == 0


def test_file_of_an_option_that_is_none_leaves_an_older_run_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path, 1, FEW)
    assert run(study, tmp_path / "run") == 0
    (tmp_path / "option.txt").write_text("bogus = 1\n")
    for option in ("limits", "catalogue"):
        study.write_text(FEW.replace('units = "g"', f'units = "g"\n{option} = "option.txt"'))
        assert run(study, tmp_path / "run") == 2
        assert "option.txt:1: " in capsys.readouterr().err
        assert main(["verify", str(tmp_path / "run")]) == 0


def test_hazard_curve_that_is_none_is_refused_before_anything_runs(tmp_path: Path) -> None:
    """The screening reads the curve and may start hours later."""
    (tmp_path / "hazard.csv").write_text("pga_g,rate\n0.1,0.01\n")
    screen = '[screen]\nhazard = "hazard.csv"\n[figures]'
    study = make_study(tmp_path, 1, FEW.replace("[figures]", screen))
    with pytest.raises(InputError, match=r"hazard\.csv:1: "):
        listed(study)


def test_hazard_curve_of_what_is_not_known_of_turned_pairs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "hazard.csv").write_text("a_p_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    screen = '[screen]\nhazard = "hazard.csv"\nazimuths_degree = [0.0, 45.0]\n[figures]'
    study = make_study(tmp_path, 1, FEW.replace("[figures]", screen))
    with pytest.raises(InputError, match=r"hazard\.csv: is for a_p, .* Must be of PGA or PGV"):
        listed(study)


_ISOLATED = "isolated]\nstrength_ratio = 0.05\nperiod_s = 3.0\n"


@pytest.mark.parametrize(
    ("tables", "reason"),
    [
        (
            "[compare.fixed]\nmodulus_pa = 3e10\n",
            r"compare\]: key 'column_mass_kg' or 'density_kg_m3' missing",
        ),
        (f"[compare.{_ISOLATED}", r"compare\]: Frame 'slender-column' is a column without a beam"),
        ("[compare]\n", r"compare\]: No bridge to compare with 'bridge-bent'"),
        ("[screen]\nstructure = 'bent'\n", r"screen\]: Invalid structure 'bent'\. Must be one of"),
        ("[screen]\nlimit_peak_gap_ratio = [1.0]\n", r"screen\]: Missing gap_m of abutments"),
        (
            "[screen]\nstructure = 'bridge-bent'\npooled = true\n",
            r"screen\]: pooled needs at least",
        ),
        (
            "[screen.design]\ndimension = 'width'\nrange = [1.0, 60.0]\n",
            r"screen\]: .*slenderness",
        ),
        (
            "[screen]\nscenario_members = 64\n[screen.ensemble]\nheight = 0.99\n",
            r"screen\]: Invalid spread .* of the ensemble of frame 'bridge-bent'",
        ),
        (
            "[spectrum]\nwavelet = ['symmetric_ricker']\nslenderness_degree = [10.0]\n"
            "frequency_ratio = [0.001]\n",
            r"spectrum\]: Invalid frequency_ratio 0\.001",
        ),
        (
            "[spectrum]\nwavelet = ['symmetric_ricker']\nslenderness_degree = [10.0]\n"
            "frequency_ratio = [3.0]\namplitude_step = 1e-9\n",
            r"spectrum\]: Invalid amplitude step 1e-09",
        ),
        (
            "[rocking_spectrum]\nslenderness_degree = [10.0, 95.0]\n",
            r"rocking_spectrum\]: Invalid",
        ),
    ],
)
def test_what_follows_from_the_study_alone_is_refused_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tables: str, reason: str
) -> None:
    """Stages would fail hours later, and name generated files that the user has not written."""
    study = make_study(tmp_path, 1, FEW.replace("[figures]", f"{tables}[figures]"))
    assert run(study, tmp_path / "run", "--plan") == 2
    said = capsys.readouterr().err
    assert re.fullmatch(rf"rockframe: error: {study}:\d+: \[{reason}[^\n]*\n", said), said
    assert not (tmp_path / "run").exists()


def test_structures_with_different_rivals_are_refused_before_anything_runs(tmp_path: Path) -> None:
    study = make_study(tmp_path, 1, FEW.replace("[figures]", f"[compare.{_ISOLATED}[figures]"))
    columns = study.read_text().replace("width_m = 0.2", "width_m = 0.2\nmass_ratio = 2.0")
    fixed = "[structure.fixed]\nmodulus_pa = 3e10\n"
    study.write_text(columns + fixed)
    with pytest.raises(InputError, match=r"small\.toml:\d+: \[compare\]: key 'column_mass_kg'"):
        listed(study)
    study.write_text(f"{columns}column_mass_kg = 9e3\ndepth_m = 1.0\n{fixed}")
    with pytest.raises(InputError, match="'slender-column' has the models free, isolated, fixed"):
        listed(study)


def test_tendons_that_no_kernel_can_compute_are_refused_at_once(
    tmp_path: Path,
) -> None:
    text = FEW.replace("members = 16", "members = 0") + "column_mass_kg = 1.0\n[structure.tendon]\n"
    tendon = "area_m2 = 1e3\nmodulus_pa = 2e11\n"
    study = make_study(tmp_path, 1, text + tendon)
    with pytest.raises(InputError, match=r"small\.toml:\d+: \[respond\]: Invalid tendon"):
        listed(study)


@pytest.mark.parametrize("name", ["inputs.csv", "records.csv", "figures/motion.csv"])
def test_record_that_an_output_would_replace_is_kept(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--replace` applies to an older run, not to the inputs of the study."""
    study = make_study(tmp_path, 1, STUDY.replace('["motions"]', f'["motions/{name}"]'))
    record = tmp_path / "motions" / name
    record.parent.mkdir(exist_ok=True)
    (tmp_path / "motions" / "motion-0.csv").rename(record)
    before = record.read_bytes()
    assert run(study, tmp_path / "motions", "--replace") == 2
    assert f"{name.split('/')[-1]}: " in capsys.readouterr().err
    assert record.read_bytes() == before


def test_structures_that_an_output_would_replace_are_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tables, _, structures = FEW.partition("[[")
    study = make_study(tmp_path, 1, f'structures = "structures.toml"\n{tables}')
    (tmp_path / "structures.toml").write_text(f"[[{structures}")
    assert run(study, tmp_path, "--replace") == 2
    assert "structures.toml: is an input of this command" in capsys.readouterr().err


def test_a_study_takes_the_list_of_selected_records(tmp_path: Path) -> None:
    """The records of the run are those of the list, each times its factor; the list is an input."""
    study = make_study(tmp_path, 3)
    selection = tmp_path / "chosen" / "selected.csv"
    selection.parent.mkdir()
    selection.write_text("record_id,scale,pga_g\nmotion-1,2.0,\nmotion-2,0.5,\n", encoding="utf-8")
    text = FEW.replace('units = "g"', 'units = "g"\nselection = "chosen/selected.csv"')
    study.write_text(text, encoding="utf-8")
    assert "selected.csv" in listed(study)
    assert run(study, tmp_path / "run", "--plan") == 0
    assert main(["step", str(tmp_path / "run"), "ingest"]) == 0
    peaks = {record.record_id: record.pga for record in read_records(tmp_path / "run/records.nc")}
    assert peaks == pytest.approx({"motion-1": 0.70 * GRAVITY, "motion-2": 0.2 * GRAVITY}, rel=1e-3)
    selection.write_text("record_id,scale\nmotion-1,none\n", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"selected\.csv:2: scale 'none'\. Must be a number from 0.001"
    ):
        listed(study)
