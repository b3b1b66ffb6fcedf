"""The commands as a stranger types them: what is printed, what is written, what is refused."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rockframe
from rockframe.cli.main import main
from rockframe.ingest import FORMATS
from rockframe.wavelets import Pulse

STRUCTURE = """
[[structure]]
name = "portico"
height_m = 4.0
width_m = 0.8
mass_ratio = 0.5
"""


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    """A text record that states nothing but its numbers: one column of g."""
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=0.4, T_p=1.0, time=3.0)
    path = tmp_path / "motion.csv"
    np.savetxt(path, pulse.acceleration(0.01 * np.arange(801)), fmt="%.8f")
    return path


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


def ingested(motion: Path) -> Path:
    output = motion.with_name("records.nc")
    assert run("ingest", motion, "--units", "g", "--time-step", "0.01", "--output", output) == 0
    return output


def test_from_a_text_file_to_verdicts(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    records = ingested(motion)
    structures = motion.with_name("mine.toml")
    structures.write_text(STRUCTURE)
    output = motion.with_name("response.nc")
    capsys.readouterr()
    words = ("respond", records, "--structures", structures, "--output", output, "--json")
    assert run(*words) == 0
    (row,) = json.loads(capsys.readouterr().out)["responses"]
    assert (row["record_id"], row["structure"], row["verdict"]) == ("motion", "portico", "safe")
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
    for words in ("antisymmetric_ricker (best)", "bridge-bent", "slender-column", "motion"):
        assert words in printed


def test_formats_are_those_of_the_registry(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("formats", "--json") == 0
    names = [entry["name"] for entry in json.loads(capsys.readouterr().out)]
    assert names == [entry.name for entry in FORMATS]


@pytest.fixture(scope="module")
def table1(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("table1")
    assert run("table1", "--output", folder, "--json") == 0
    return folder


def test_table1_writes_what_it_says(table1: Path) -> None:
    manifest = json.loads((table1 / "manifest.json").read_text())
    assert set(manifest["outputs"]) == {
        path.relative_to(table1).as_posix()
        for path in table1.rglob("*")
        if path.is_file() and path.name != "manifest.json"
    }
    assert len([name for name in manifest["outputs"] if name.startswith("figures/")]) == 6
    assert "Ridgecrest2019-CLC.V1" in manifest["inputs"]


def test_table1_rows_are_records_by_structures(table1: Path) -> None:
    with (table1 / "table.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 6 * 5
    assert {row["event"] for row in rows} == {"2019 Ridgecrest"}
    assert {row["magnitude"] for row in rows} == {"7.1"}
    assert all(row["verdict"] in {"no_uplift", "safe", "overturned"} for row in rows)


def test_real_records_overturn_the_slender_ones_and_spare_the_bridge(table1: Path) -> None:
    with (table1 / "table.csv").open(newline="") as stream:
        fallen = {
            row["structure"] for row in csv.DictReader(stream) if row["verdict"] == "overturned"
        }
    assert fallen == {"slender-column", "slender-frame"}


def test_the_beam_makes_the_slender_frame_safer(table1: Path) -> None:
    with (table1 / "table.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    falls = [
        sum(row["verdict"] == "overturned" for row in rows if row["structure"] == name)
        for name in ("slender-column", "slender-frame")
    ]
    assert falls[1] < falls[0]


def test_table1_is_repeated_to_the_byte(table1: Path, tmp_path: Path) -> None:
    assert run("table1", "--output", tmp_path, "--json") == 0
    one, other = (json.loads((f / "manifest.json").read_text()) for f in (table1, tmp_path))
    assert one == other


def test_a_verdict_needs_no_heavy_import_to_explain_itself() -> None:
    code = (
        "import sys; from rockframe.cli.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'obspy', 'rich', 'xarray', 'pydantic'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[]\n")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("0.1\n0.2\nx\n", "motion.csv:3"),
        ("0.1\nnan\n0.3\n", "motion.csv:2"),
        ("", "empty"),
    ],
)
def test_the_users_mistake_is_one_line_and_status_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, words: str
) -> None:
    motion = tmp_path / "motion.csv"
    motion.write_text(content)
    output = tmp_path / "records.nc"
    assert run("ingest", motion, "--units", "g", "--time-step", "0.01", "--output", output) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert words in error
    assert sorted(path.name for path in tmp_path.iterdir()) == ["motion.csv"]


def test_one_bad_file_among_good_ones_is_listed_and_status_1(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = motion.with_name("bad.csv")
    bad.write_text("0.1\ninf\n")
    output = motion.with_name("records.nc")
    words = ("--units", "g", "--time-step", "0.01", "--output", output)
    assert run("ingest", motion, bad, *words) == 1
    assert "rejected: bad.csv:2" in capsys.readouterr().err
    assert len(rockframe.read_records(output)) == 1
    with output.with_suffix(".csv").open(newline="") as stream:
        listed = list(csv.DictReader(stream))
    assert [row["status"] for row in listed] == ["accepted", "rejected"]


def test_strict_writes_nothing_and_status_2(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = motion.with_name("bad.csv")
    bad.write_text("0.1\ninf\n")
    output = motion.with_name("records.nc")
    words = ("--units", "g", "--time-step", "0.01", "--output", output)
    assert run("ingest", motion, bad, *words, "--strict", "--workers", "1") == 2
    assert "error: bad.csv:2: acceleration 'inf'" in capsys.readouterr().err
    assert not output.exists()


def test_a_record_that_is_not_the_papers_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The name of the paper's record, but another motion under it."""
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=0.4, T_p=1.0, time=3.0)
    time = 0.01 * np.arange(801)
    path = tmp_path / "RSN77_SFERN_PUL164.csv"
    columns = np.column_stack([time, pulse.acceleration(time)])
    np.savetxt(path, columns, fmt="%.6f", delimiter=",", header="time_s,acc_g", comments="")
    words = (
        "--records",
        path,
        "--structure",
        "bridge-bent",
        "--output",
        tmp_path / "run",
        "--json",
    )
    assert run("table1", *words) == 0
    result = json.loads(capsys.readouterr().out)
    (row,) = result["rows"]
    assert (row["event"], row["magnitude"]) == ("1971 San Fernando", 6.6)
    assert row["facts_source"] == "Makris and Vassiliou (2013), Table 1"
    pga = next(entry for entry in result["paper"] if entry["quantity"] == "pga_g")
    assert pga["paper"] == 1.23
    assert pga["remark"] == "not the paper's record or processing"


def test_unknown_structure_is_refused_with_those_there_are(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = ingested(motion)
    output = motion.with_name("response.nc")
    assert run("respond", records, "--structure", "tower", "--output", output) == 2
    assert "Must be one of: bridge-bent, apollo-column" in capsys.readouterr().err
    assert not output.exists()
