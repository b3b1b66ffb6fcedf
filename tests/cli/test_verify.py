"""A run is intact only if all files match its manifest and belong to the same run."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, processor, sealed, sha256_of
from rockframe.results.contents import TOLERANCE, differences
from rockframe.results.run import read_run
from rockframe.stages.report import verify_run
from rockframe.wavelets.pulse import Pulse

#: Options of responses that take little time.
FEW = ("--structure", "bridge-bent", "--margins", "none", "--ensemble-members", "0")
#: All options of the run but its records and folder.
WORDS = ("--units", "g", "--time-step", "0.01", "--surrogates", "0", *FEW)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small run."""
    home = tmp_path_factory.mktemp("verify")
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.4, T_p=1.0, time=3.0)
    np.savetxt(home / "motion.csv", pulse.acceleration(0.01 * np.arange(801)), fmt="%.8f")
    paths = ["--records", str(home / "motion.csv"), "--output", str(home / "run")]
    assert main(["table1", *paths, *WORDS]) == 0
    return home / "run"


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    """A copy of the run, for a test to change."""
    return Path(shutil.copytree(made, tmp_path / "run"))


def restated(run: Path, name: str) -> None:
    """Update the hash of the file in the manifest."""
    manifest = json.loads((run / MANIFEST).read_text())
    manifest["outputs"][name] = sha256_of(run / name)
    (run / MANIFEST).write_bytes(sealed(manifest))


def test_a_whole_run_is_whole(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = verify_run(run)
    assert (found.faults, found.same_source) == ((), True)
    assert {name: held.records for name, held in found.datasets.items()} == {
        "records.nc": ("motion",),
        "pulses.nc": ("motion",),
        "response.nc": ("motion",),
    }
    assert main(["verify", str(run)]) == 0
    assert "whole" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["records.nc", "response.nc", "table.csv"])
def test_one_bit_is_enough(run: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    content = bytearray((run / name).read_bytes())
    content[len(content) // 2] ^= 1
    (run / name).write_bytes(content)
    (fault,) = verify_run(run).faults
    assert f"{name}: SHA-256" in fault
    assert main(["verify", str(run), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["whole"] is False


def test_what_is_missing_is_named(run: Path) -> None:
    (run / "pulses.nc").unlink()
    assert "pulses.nc: missing" in verify_run(run).faults[0]


def test_a_cut_file_is_damaged_even_if_the_manifest_agrees(run: Path) -> None:
    content = (run / "response.nc").read_bytes()
    (run / "response.nc").write_bytes(content[: len(content) // 2])
    restated(run, "response.nc")
    (fault,) = verify_run(run).faults
    assert "response.nc: cannot be read as netCDF" in fault


def test_files_of_two_runs_do_not_make_one(run: Path, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "other.csv", np.sin(np.arange(900)), fmt="%.5f")
    words = ["--units", "m/s2", "--time-step", "0.01", "--output", str(run / "records.nc")]
    assert main(["ingest", str(tmp_path / "other.csv"), *words]) == 0
    restated(run, "records.nc")
    restated(run, "records.csv")
    faults = verify_run(run).faults
    assert any("pulses.nc: was made from another records.nc" in fault for fault in faults)
    assert any("response.nc: holds 'motion', which is not in records.nc" in f for f in faults)


def test_what_an_interrupted_run_left_is_a_fault(run: Path) -> None:
    (run / ".partial-abc").mkdir()
    assert "left by an interrupted run" in verify_run(run).faults[0]


def test_lost_plan_is_written_by_the_same_command(
    run: Path, made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`rockframe run` could not: there is no study file of the user."""
    plan = run / ".rockframe" / "plan.json"
    plan.unlink()
    assert main(["verify", str(run)]) == 1
    said = capsys.readouterr().err
    assert f"{plan}: missing. Repeat the command that computed the run.\n" in said
    motion = ["--records", str(made.with_name("motion.csv")), "--output", str(run)]
    assert main(["table1", *motion, *WORDS]) == 0
    assert main(["verify", str(run)]) == 0


def test_page_that_the_user_changed_stays_and_is_a_fault(
    run: Path, made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is no step of the command, which shows its results and leaves the page to `verify`."""
    page = run / "report.html"
    page.write_text("<p>my notes</p>")
    motion = ["--records", str(made.with_name("motion.csv")), "--output", str(run)]
    assert main(["table1", *motion, *WORDS, "--format", "markdown"]) == 0
    assert page.read_text() == "<p>my notes</p>"
    assert main(["verify", str(run)]) == 1
    assert "report.html: is corrupted. Write it again" in capsys.readouterr().err


def test_without_a_manifest_no_run_ended(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (run / MANIFEST).unlink()
    assert main(["verify", str(run)]) == 2
    assert "the run is not complete" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "cannot be read"),
        ("[]", "contains no 'inputs'"),
        ('{"inputs": {}}', "contains no 'outputs'"),
        ('{"inputs": {}, "outputs": [1]}', "contains another 'outputs'"),
        (
            '{"inputs": {}, "outputs": {"../x": ""}, "parameters": {}, "source_code_hash": "", '
            '"versions": {}}',
            "names outputs outside its folder",
        ),
    ],
)
def test_a_manifest_that_is_none_is_refused(run: Path, text: str, words: str) -> None:
    (run / MANIFEST).write_text(text)
    for reader in (verify_run, read_run):
        with pytest.raises(InputError, match=words):
            reader(run)


def test_other_source_code_is_said(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    manifest = json.loads((run / MANIFEST).read_text())
    (run / MANIFEST).write_bytes(sealed(manifest | {"source_code_hash": "0" * 64}))
    assert main(["verify", str(run)]) == 0
    assert "another version of the source code" in capsys.readouterr().out


def test_other_libraries_are_said(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Another numpy may change the last bits, so the user must know before computing again."""
    manifest = json.loads((run / MANIFEST).read_text())
    manifest["versions"]["numpy"] = "1.0"
    (run / MANIFEST).write_bytes(sealed(manifest))
    assert main(["verify", str(run)]) == 0
    assert "made with other versions of libraries: numpy 1.0" in capsys.readouterr().out
    assert main(["verify", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["other_versions"] == {"numpy": "1.0"}


def test_another_processor_is_said(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """On another processor numpy uses other instructions, which can change the last bits."""
    assert main(["verify", str(run)]) == 0
    assert "another kind of processor" not in capsys.readouterr().out
    manifest = json.loads((run / MANIFEST).read_text())
    assert manifest["processor"] == processor()
    (run / MANIFEST).write_bytes(sealed(manifest | {"processor": "riscv64 RVV"}))
    assert main(["verify", str(run)]) == 0
    assert "made on another kind of processor (riscv64 RVV)" in capsys.readouterr().out
    assert main(["verify", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["other_processor"] == "riscv64 RVV"
    del manifest["processor"]  # a run of an earlier version
    (run / MANIFEST).write_bytes(sealed(manifest))
    assert verify_run(run).other_processor == ""


@pytest.mark.parametrize(
    ("name", "factor", "found"),
    [
        ("peak_u", 1.0 + 0.1 * TOLERANCE, []),
        ("peak_u", 1.0 + 10.0 * TOLERANCE, ["peak_u of 'motion'"]),
        ("peak_u", np.nan, ["peak_u of 'motion'"]),
        ("theta", 1.0 + 10.0 * TOLERANCE, ["theta of 'motion'"]),
        ("width", 2, ["width"]),
        ("impacts", 2, ["impacts of 'motion'"]),
    ],
)
def test_numbers_agree_within_the_tolerance_and_counts_exactly(
    run: Path, tmp_path: Path, name: str, factor: float, found: list[str]
) -> None:
    other = Path(shutil.copy(run / "response.nc", tmp_path / "other.nc"))
    with netCDF4.Dataset(other, "a") as file:
        file[name][:] = file[name][:] * factor
    records, share, differing = differences(other, run / "response.nc", "response")
    assert (records, differing) == (1, found)
    assert share == (0.0 if found else pytest.approx(0.1 * TOLERANCE, rel=1e-6))


def test_response_to_other_pulses_is_of_another_run(run: Path) -> None:
    """With `--pulses`, response.nc has pulse-only responses, so the pulses must be the run's."""
    words = [*FEW, "--output", str(run / "response.nc")]
    pulses = ["--pulses", str(run / "pulses.nc")]
    assert main(["respond", str(run / "records.nc"), *pulses, *words]) == 0
    restated(run, "response.nc")
    assert verify_run(run).faults == ()
    words = ["--periods", "0.5", "3.0", "--surrogates", "0", "--output", str(run / "pulses.nc")]
    assert main(["pulse", str(run / "records.nc"), *words]) == 0
    restated(run, "pulses.nc")
    (fault,) = verify_run(run).faults
    assert "response.nc: was made from another pulses.nc" in fault


def test_records_of_other_files_than_the_listed_ones_are_a_fault(run: Path) -> None:
    manifest = json.loads((run / MANIFEST).read_text())
    manifest["inputs"]["motion.csv"] = "0" * 64
    (run / MANIFEST).write_bytes(sealed(manifest))
    (fault,) = verify_run(run).faults
    assert "records.nc: was made from a 'motion.csv' that the manifest does not list" in fault


def test_record_that_is_lost_between_two_stages_is_a_fault(tmp_path: Path) -> None:
    """A batch was forgotten when the batches were merged."""
    for name, height in (("one", 0.4), ("two", 0.5)):
        pulse = Pulse(wavelet="symmetric_ricker", a_p=height, T_p=1.0, time=3.0)
        np.savetxt(tmp_path / f"{name}.csv", pulse.acceleration(0.01 * np.arange(601)), fmt="%.8f")
    folder, words = tmp_path / "run", [*FEW, "--histories", "none"]
    given = ["--records", str(tmp_path / "one.csv"), str(tmp_path / "two.csv")]
    given += ["--units", "g", "--time-step", "0.01", "--surrogates", "0", "--output", str(folder)]
    assert main(["table1", *given, *words]) == 0
    part = ["--batch", "1/2", "--output", str(folder / "response.nc")]
    assert main(["respond", str(folder / "records.nc"), *part, *words]) == 0
    restated(folder, "response.nc")
    assert any(
        "response.nc: neither contains 'two' of records.nc nor states a reason" in fault
        for fault in verify_run(folder).faults
    )
