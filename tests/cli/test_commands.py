"""The commands as a user types them: what they print, write and refuse."""

from __future__ import annotations

import argparse
import csv
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from tests.commands import STRUCTURE, ingested, run
from tests.recorded.record import HERE as RECORDED
from tests.recorded.record import differences, names, numbers
from tests.recorded.shapes import shapes

import rockframe
from rockframe.cli.main import parser
from rockframe.errors import InputError
from rockframe.ingest import FORMATS
from rockframe.paper.pulses import find_paper_record
from rockframe.study.study import Study, StudyTables
from rockframe.wavelets.pulse import Pulse

#: Options for a quick run when only the records matter, with figures and without.
DRAWN = ("--structure", "bridge-bent", "--margins", "none", "--surrogates", "0")
STATIONS = ("CCC", "CLC", "TOW2")
ONE = (*DRAWN, "--histories", "none", "--ensemble-members", "0")


def test_from_a_text_file_to_verdicts(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    records = ingested(motion)
    structures = motion.with_name("mine.toml")
    structures.write_text(STRUCTURE)
    output = motion.with_name("response.nc")
    capsys.readouterr()
    words = ("respond", records, "--structures", structures, "--output", output, "--json")
    assert run(*words) == 0
    (row,) = json.loads(capsys.readouterr().out)["responses"]
    assert (row["record_id"], row["structure"], row["verdict"]) == ("motion", "portico", "stands")
    with rockframe.open_response(output) as response:
        history = response.sel(record="motion", structure="portico")
    frame = rockframe.RockingFrame(height=4.0, width=0.8, mass_ratio=0.5)
    (record,) = rockframe.read_records(records)
    computed = rockframe.respond(frame, record)
    np.testing.assert_array_equal(history["theta"], computed.theta)
    np.testing.assert_array_equal(history["u"], computed.u)
    assert row["peak_rotation_ratio"] == computed.peak_rotation_ratio


def test_pulse_finds_what_was_planted(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    records = ingested(motion)
    capsys.readouterr()
    assert run("pulse", records, "--output", motion.with_name("pulses.nc"), "--json") == 0
    best = next(row for row in json.loads(capsys.readouterr().out)["pulses"] if row["best"])
    assert best["wavelet"] == "antisymmetric_ricker"
    assert best["T_p_s"] == pytest.approx(1.0, rel=1e-5)
    assert best["a_p_g"] == pytest.approx(0.4, rel=1e-5)


def test_tables_are_printed(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    records = ingested(motion)
    assert run("pulse", records, "--output", motion.with_name("pulses.nc")) == 0
    assert run("respond", records, "--output", motion.with_name("response.nc")) == 0
    printed = capsys.readouterr().out
    for words in ("→ antisymmetric_ricker", "bridge-bent", "slender-column", "motion"):
        assert words in printed


def test_every_option_of_every_command_says_what_it_is() -> None:
    (verbs,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001
    for name, verb in verbs.choices.items():
        assert [(name, a.dest) for a in verb._actions if not a.help] == []  # noqa: SLF001


def test_formats_are_those_of_the_registry(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("formats", "--json") == 0
    names = [entry["name"] for entry in json.loads(capsys.readouterr().out)]
    assert names == [entry.name for entry in FORMATS]


def test_table1_writes_what_it_says(table1: Path) -> None:
    manifest = json.loads((table1 / "manifest.json").read_text())
    assert set(manifest["outputs"]) == {
        path.relative_to(table1).as_posix()
        for path in table1.rglob("*")
        if path.is_file() and path.name != "manifest.json"
        if not path.is_relative_to(table1 / "logs")
        if not any(part.startswith(".") for part in path.relative_to(table1).parts)
    }
    drawn = [name for name in manifest["outputs"] if name.endswith(".png")]
    assert len(drawn) == 3 * 6 + 3 * 3  # with histories; of 6 records, and of 3 stations
    for folder, count in (("margins", 6), ("sensitivity", 9), ("paths", 3)):
        assert sum(name.startswith(f"figures/{folder}/") for name in drawn) == count
    assert "ridgecrest2019/Ridgecrest2019-CLC.V1" in manifest["inputs"]


def test_without_histories_margins_and_members_there_is_nothing_to_draw(tmp_path: Path) -> None:
    motion, output = tmp_path / "motion.csv", tmp_path / "run"
    motion.write_text("".join(f"{3.0 * math.sin(0.06 * k)}\n" for k in range(800)))
    words = ("--units", "m/s2", "--time-step-s", "0.01", "--surrogates", "0", "--workers", "0")
    options = ("--histories", "none", "--margins", "none", "--structure", "slender-frame")
    nobody = ("--ensemble-members", "0")
    assert run("table1", "--records", motion, *words, *options, *nobody, "--output", output) == 0
    assert not list(output.rglob("*.png"))


def test_table1_rows_are_records_by_structures(table1: Path) -> None:
    with (table1 / "table.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len({(row["record_id"], row["structure"]) for row in rows}) == 9 * 5
    assert {row["event"] for row in rows} == {"2019 Ridgecrest"}
    assert {row["magnitude"] for row in rows} == {"7.1"}


def test_table1_has_margins(table1: Path) -> None:
    """A structure that overturns does so at a scale below 1; the bridge bent needs more than 1."""
    rows = in_one_plane(table1)
    for row in rows:
        if row["verdict"] == "overturns":
            assert float(row["critical_scale"]) < 1.0
        assert float(row["robust_scale_10"]) <= float(row["robust_scale_25"] or "inf")
        assert float(row["largest_scale"]) == 10.0
    assert all(float(r["critical_scale"]) > 1.0 for r in rows if r["structure"] == "bridge-bent")


def test_real_records_overturn_the_slender_ones_and_spare_the_bridge(table1: Path) -> None:
    fallen = {row["structure"] for row in in_one_plane(table1) if row["overturning_time_s"]}
    assert fallen == {"slender-column", "slender-frame"}


def in_one_plane(table1: Path) -> list[dict[str, str]]:
    with (table1 / "table.csv").open(newline="") as stream:
        return [row for row in csv.DictReader(stream) if not row["components"]]


def test_both_directions_overturn_round_columns_that_stand_in_one_plane(table1: Path) -> None:
    """The shares of `tests.benchmarks.wobbling --table`, within four standard errors."""
    with (table1 / "table.csv").open(newline="") as stream:
        rows = {(row["record"], row["structure"]): row for row in csv.DictReader(stream)}
    shares = {
        ("CCC/both", "bridge-bent"): 0.64,
        ("CCC/both", "apollo-column"): 0.33,
        ("CLC/both", "bridge-bent"): 0.0,
        ("TOW2/both", "apollo-column"): 0.46,
    }
    for pair, share in shares.items():
        assert float(rows[pair]["share_overturned"]) == pytest.approx(share, abs=0.25)
        assert rows[pair]["critical_scale"] == rows[pair]["largest_scale"] == ""
        assert float(rows[pair]["robust_scale_10"]) < 2.0
    assert float(rows["CCC/090", "bridge-bent"]["share_overturned"]) == 0.0
    slender = rows["CCC/both", "slender-column"]
    assert slender["not_computed"] == "not computed for both directions: columns not circular"
    assert slender["verdict"] == "not_computed"
    assert slender["peak_u_m"] == slender["share_overturned"] == ""
    with (table1 / "summary.csv").open(newline="") as stream:
        summary = {row["structure"]: row for row in csv.DictReader(stream)}
    bent = summary["bridge-bent"]
    assert (bent["directions"], bent["records"]) == ("2", "3")
    three = [float(rows[f"{name}/both", "bridge-bent"]["share_overturned"]) for name in STATIONS]
    assert float(bent["share_overturned"]) == pytest.approx(sum(three) / 3.0)
    assert (summary["slender-column"]["directions"], summary["slender-column"]["records"]) == (
        *("1", "6"),
    )


def test_the_beam_makes_the_slender_frame_safer(table1: Path) -> None:
    with (table1 / "table.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    falls = [
        sum(bool(row["overturning_time_s"]) for row in rows if row["structure"] == name)
        for name in ("slender-column", "slender-frame")
    ]
    assert falls[1] < falls[0]


def test_every_recorded_number_is_as_before(table1: Path) -> None:
    """An intended change is recorded again and listed in the changelog.

    Numbers may differ by what processors differ: see `tests.recorded.record.TOLERANCES`.
    """
    recorded = json.loads((RECORDED / "numbers.json").read_text(encoding="utf-8"))
    found = numbers(table1)
    assert set(recorded.pop("files")) <= set(found.pop("files"))
    assert not differences(found, recorded)


@pytest.mark.parametrize(
    ("name", "now"),
    [
        ("pulses.nc:p_value", [24, 24, 11.33, -0.22]),
        ("response.nc:peak_u", [30, 22, 5.002, 1.0]),
        ("response.nc:peak_u", [30, 23, 5.0, 1.0]),
        ("response.nc:robust_scale_10", [30, 22, 5.0, 1.03]),
        ("records.nc:record_id", [6, "other"]),
    ],
)
def test_a_number_that_differs_is_named_with_its_difference(name: str, now: list[object]) -> None:
    recorded = {"pulses.nc:p_value": [24, 24, 11.85, -0.22], "records.nc:record_id": [6, "one"]}
    chaotic = ("response.nc:peak_u", "response.nc:robust_scale_10")
    recorded |= {key: [30, 22, 5.0, 1.0] for key in chaotic}
    (line,) = differences(recorded | {name: now}, recorded)
    assert line.startswith(f"{name}: ")
    assert not differences(recorded | {"response.nc:peak_u": [30, 22, 5.0002, 1.0]}, recorded)


def test_no_recorded_name_is_lost() -> None:
    """Commands, options, study keys, Python names, flags may be added, but none may disappear."""
    recorded = json.loads((RECORDED / "names.json").read_text(encoding="utf-8"))
    found = names()
    for verb, options in recorded.pop("commands").items():
        assert set(options) <= set(found["commands"][verb]), verb
    for kind, before in recorded.items():
        assert set(before) <= set(found[kind]), kind


def test_json_keeps_its_recorded_keys_and_types(tmp_path: Path) -> None:
    """Each command may add keys to its JSON for the bundled records, but not drop any."""
    recorded = json.loads((RECORDED / "json.json").read_text(encoding="utf-8"))
    found = shapes(tmp_path)
    for verb, before in recorded.items():
        assert set(before) <= set(found[verb]), verb


def test_table1_computes_what_its_study_states_unless_the_command_line_does(
    motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def plan(study: Study, *_where: object) -> NoReturn:
        asked.append(study.tables)
        raise InputError(motion, "is not computed here.")

    stated = '[records]\n[respond]\nmargins = "none"\nstructure = "slender-column"\n'
    (tmp_path / "table1.toml").write_text(f'name = "table1"\n{stated}', encoding="utf-8")
    monkeypatch.setattr("rockframe.study.study.SHIPPED_STUDIES", tmp_path)
    monkeypatch.setattr("rockframe.runs.plan.make_plan", plan)
    asked: list[StudyTables] = []
    words = ("table1", "--records", motion, "--output", tmp_path / "run")
    assert [run(*words), run(*words, "--structure", "slender-frame", "--units", "g")] == [2, 2]
    assert [table.respond.structure for table in asked] == ["slender-column", "slender-frame"]
    assert [table.respond.margins for table in asked] == ["none", "none"]
    assert [table.records.units for table in asked if table.records] == [None, "g"]


def test_table1_is_repeated_to_the_byte(motion: Path, tmp_path: Path) -> None:
    read = ("--records", motion, "--units", "g", "--time-step", "0.01")
    few = ("--surrogates", "19", "--ensemble-members", "16")
    words = (*read, "--structure", "slender-column", *few)
    folders = (tmp_path / "one", tmp_path / "other")
    assert [run("table1", *words, "--output", folder, "--json") for folder in folders] == [0, 0]
    one, other = (json.loads((f / "manifest.json").read_text()) for f in folders)
    assert one == other


def test_the_page_of_the_bundled_records_is_small_and_the_run_still_whole(
    table1: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(table1, tmp_path / "table1")
    assert run("report", folder) == 0
    assert (folder / "report.html").stat().st_size < 4_000_000
    assert run("verify", folder) == 0


def test_the_module_is_the_command() -> None:
    words = [sys.executable, "-m", "rockframe", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("rockframe ")


def test_a_verdict_needs_no_heavy_import_to_explain_itself() -> None:
    code = (
        "import sys; from rockframe.cli.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'obspy', 'rich', 'xarray', 'pydantic'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[]\n")


def test_a_record_that_is_not_the_papers_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file has the name of one of the paper's records but contains another motion."""
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=0.4, T_p=1.0, time=3.0)
    time = 0.01 * np.arange(801)
    path = tmp_path / "RSN77_SFERN_PUL164.csv"
    columns = np.column_stack([time, pulse.acceleration(time)])
    np.savetxt(path, columns, fmt="%.6f", delimiter=",", header="time_s,acc_g", comments="")
    words = ("--records", path, "--output", tmp_path / "run", "--json", *ONE)
    assert run("table1", *words) == 0
    result = json.loads(capsys.readouterr().out)
    (row,) = result["rows"]
    assert (row["event"], row["magnitude"]) == ("1971 San Fernando", 6.6)
    assert row["facts_source"] == "Makris and Vassiliou (2013), Table 1"
    pga = next(entry for entry in result["paper"] if entry["quantity"] == "pga_g")
    assert pga["paper"] == 1.23
    assert pga["remark"] == "not the paper's record or processing"
    with (tmp_path / "run" / "paper.csv").open(newline="") as stream:
        assert [row["quantity"] for row in csv.DictReader(stream)] == [
            "pga_g",
            "pgv_m_s",
            *("a_p_g", "T_p_s"),  # of the selected pulse
            *("a_p_g", "T_p_s"),  # of the wavelet of Mavroeidis and Papageorgiou
        ]


def test_what_an_older_run_wrote_does_not_linger(motion: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    own = ("--units", "g", "--time-step", "0.01", "--output", folder, *DRAWN)
    assert run("table1", "--records", motion, *own) == 0
    other = motion.with_name("other.csv")
    motion.rename(other)
    (folder / "notes.txt").write_text("mine")
    assert run("table1", "--records", other, *own) == 0
    assert {path.name for path in (folder / "figures").rglob("*.png")} == {"other.png"}
    assert (folder / "notes.txt").read_text() == "mine"


def test_an_interrupted_table_resumes(
    motion: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Finished steps are kept, and the reason of each other step is said."""
    folder = tmp_path / "run"
    words = ("--units", "g", "--time-step", "0.01", "--output", folder, *ONE)

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rockframe.stages.respond.respond_stage", interrupt)
        assert run("table1", "--records", motion, *words) == 130
    said = "finished steps are kept; the same command resumes"
    assert said in capsys.readouterr().err
    assert not (folder / "manifest.json").exists()
    assert run("status", folder, "--json") == 0
    steps = {step["name"]: step for step in json.loads(capsys.readouterr().out)["steps"]}
    assert (steps["ingest"]["state"], steps["respond"]["reason"]) == ("done", "not run yet")
    assert run("table1", "--records", motion, *words) == 0
    assert "rockframe: 1/5 respond, " in capsys.readouterr().err
    assert run("table1", "--records", motion, *words) == 0
    assert capsys.readouterr().err == ""  # nothing to do
    before = motion.read_text(encoding="utf-8")
    motion.write_text(f"{before}0.0\n", encoding="utf-8")
    assert run("status", folder) == 0
    said = "`rockframe table1` would repeat the steps that depend on them"
    assert said in capsys.readouterr().out
    motion.write_text(before, encoding="utf-8")
    assert run("report", folder) == 0
    assert run("table1", "--records", motion, *words, "--surrogates", "19") == 0
    said = capsys.readouterr().err
    assert "rockframe: repeating pulse: option surrogates changed from 0 to 19\n" in said
    assert "report.html: showed former results; removed. `rockframe report` writes a new" in said
    assert run("verify", folder, "--recompute") == 0


def test_a_record_too_short_for_a_pulse_is_listed_and_the_others_go_on(
    motion: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tiny = motion.with_name("tiny.csv")
    tiny.write_text("0.1\n0.3\n0.2\n")
    bad = motion.with_name("bad.csv")
    bad.write_text("0.1\ninf\n")
    words = ("--units", "g", "--time-step", "0.01", "--output", tmp_path / "run", "--json")
    assert run("table1", "--records", motion, tiny, bad, *ONE, *words) == 1
    captured = capsys.readouterr()
    assert "rejected: tiny: Invalid range of periods" in captured.err
    assert "rejected: bad.csv:2: " in captured.err
    lines = {entry["file"]: entry["line"] for entry in json.loads(captured.out)["rejected"]}
    assert lines == {"bad.csv": 2, "tiny": None}
    rows = {row["record_id"]: row for row in json.loads(captured.out)["rows"]}
    assert rows["tiny"]["T_p_s"] is None
    assert rows["tiny"]["verdict"] == "stands"
    assert rows["motion"]["T_p_s"] == pytest.approx(1.0, rel=1e-5)


def test_uncorrected_text_is_corrected_when_it_is_said_to_be(motion: Path) -> None:
    output = motion.with_name("records.nc")
    words = ("--units", "g", "--time-step", "0.01", "--output", output)
    hum = 1e-4 * np.sin(np.arange(2403))  # a stretch of constant samples would be a gap
    long = np.tile(np.loadtxt(motion), 3) + 0.05 + hum
    np.savetxt(motion, long, fmt="%.8f")
    assert run("ingest", motion, "--uncorrected", *words) == 0
    (record,) = rockframe.read_records(str(output))
    assert "band-pass" in record.processing[-1]
    assert abs(record.acceleration.mean()) < 1e-3 < 0.05


def test_only_the_papers_own_names_are_the_papers() -> None:
    assert find_paper_record("RSN77_SFERN_PUL164.AT2") == find_paper_record("PUL164.AT2")
    assert find_paper_record("my_own_PUL164.AT2") is None


def test_facts_from_the_file_are_kept_and_missing_ones_borrowed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=1.23, T_p=1.0, time=3.0)
    samples = pulse.acceleration(0.01 * np.arange(801))
    path = tmp_path / "records" / "RSN77_SFERN_PUL164.csv"
    path.parent.mkdir()
    np.savetxt(path, samples, fmt="%.6f")
    columns = "file,event,station,network,magnitude,epicentral_distance_km,source"
    row = f"{path.name},,,,5.5,,mine"
    (path.parent / "catalogue.csv").write_text(f"{columns}\n{row}\n")
    words = ("--units", "g", "--time-step", "0.01", "--output", tmp_path / "run", "--json")
    assert run("table1", "--records", path.parent, *ONE, *words) == 0
    (result,) = json.loads(capsys.readouterr().out)["rows"]
    assert (result["magnitude"], result["epicentral_distance_km"]) == (5.5, 11.9)
    assert result["facts_source"] == "mine; Makris and Vassiliou (2013), Table 1"
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    inputs = {"records/RSN77_SFERN_PUL164.csv", "records/catalogue.csv"}
    assert set(manifest["inputs"]) == inputs


def test_of_what_fell_show_tells_when_and_no_rotation(
    table1: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("show", table1, "Ridgecrest2019-CCC-360") == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    fallen, both = (line for line in lines if line[:1] == ["slender-frame"])
    assert both[1:3] == ["not", "computed"]
    assert fallen[1:5] == ["overturns", "100", "%", "(95"]
    assert fallen[-2:] == ["overturns", "overturns"]
    event = "event 2019 Ridgecrest, M 7.1, station CCC, Repi 34.5 km"
    assert event in [" ".join(line) for line in lines]
