"""`rockframe show`: the results of a run for one record."""

from __future__ import annotations

import json
import shutil
import unicodedata
from pathlib import Path

import pytest
from tests.runs.small import FEW, make_study, run

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.results.run import read_run
from rockframe.results.tables.entries import rows_of

FILTERS = "[filters]\npga_g = [0.32, inf]\npgv_m_s = [-inf, 9.0]\n\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a record that is filtered out and a file that is no record."""
    home = tmp_path_factory.mktemp("show")
    study = make_study(home, 3, FEW.replace("[figures]", f"{FILTERS}[figures]"))
    (home / "motions" / "notes.txt").write_text("Nothing of the kind.\n")
    assert run(study, home / "run") == 1
    return home / "run"


def shown(folder: Path, record: str, capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    capsys.readouterr()
    assert main(["show", str(folder), record, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert isinstance(told, dict)
    return told


def test_names_keep_their_letters_from_file_to_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(
        tmp_path, 1, FEW.replace("bridge-bent", "Κίων").replace("most = 0", "most = 1")
    )
    motion = tmp_path / "motions" / "motion-0.csv"
    # DejaVu Sans has no Chinese characters: the figure shows boxes, without a warning.
    motion.rename(motion.with_name("Αθήνα 神戸.csv"))
    assert run(study, tmp_path / "run") == 0
    told = shown(tmp_path / "run", unicodedata.normalize("NFD", "Αθήνα_神戸"), capsys)
    assert told["record_id"] == "Αθήνα_神戸"
    assert told["figure"] == "figures/Αθήνα_神戸.png"
    assert set(told["responses"]) == {"Κίων", "slender-column"}  # type: ignore[call-overload]
    assert main(["verify", str(tmp_path / "run")]) == 0


def test_from_file_to_verdict(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = shown(folder, "motion-2", capsys)
    assert told["status"] == "accepted"
    assert told["file"] == "motion-2.csv"
    assert set(told["responses"]) == {"bridge-bent", "slender-column"}  # type: ignore[call-overload]
    assert main(["show", str(folder), "motion-2.csv"]) == 0
    printed = capsys.readouterr().out
    for words in (
        "SHA-256",
        "PGA 0.40",
        "T_p 1.0",
        "pga_g from 0.32; pgv_m_s to 9\n",
        "bridge-bent",
    ):
        assert words in printed


def test_filtered_record_says_by_what(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = shown(folder, "motion-0", capsys)
    assert (told["status"], told["responses"]) == ("filtered", {})
    assert told["reason"] == "pga_g 0.3. Must be from 0.32 to inf."
    assert [row["record_id"] for row in rows_of(folder / "table.csv")][::2] == [
        "motion-1",
        "motion-2",
    ]


def test_rejected_file_says_why(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = shown(folder, "notes.txt", capsys)
    assert told["status"] == "rejected"
    assert told["reason"]


def test_unknown_record_is_refused_with_those_there_are(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", str(folder), "none"]) == 2
    assert "Must be the name of a file of the run, or one of: motion-1" in capsys.readouterr().err


def test_file_of_several_records_asks_which(
    tmp_path: Path, bundled_records: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--records", str(bundled_records / "Ridgecrest2019-CCC.V1"), "--margins", "none"]
    words += ["--surrogates", "0", "--structure", "bridge-bent", "--output", str(tmp_path)]
    words += ["--histories", "none", "--ensemble-members", "0"]
    assert main(["table1", *words]) == 0
    assert main(["show", str(tmp_path), "Ridgecrest2019-CCC.V1"]) == 2
    assert (
        "is a file of 3 records. Choose one of them: Ridgecrest2019-CCC-090, "
        in capsys.readouterr().err
    )


def test_table_that_is_gone_is_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A page without it would look as if nothing had been computed; `show` reads response.nc."""
    run = Path(shutil.copytree(folder, tmp_path / "run"))
    assert sum(read_run(run, most=0).counts.values()) == 4
    assert main(["show", str(run), "motion-2"]) == 0
    with_table = capsys.readouterr().out
    (run / "table.csv").unlink()
    assert main(["show", str(run), "motion-2"]) == 0
    assert capsys.readouterr().out == with_table
    for most in (None, 1):
        with pytest.raises(InputError, match=r"table.csv: missing. Restore the file as the run"):
            read_run(run, most=most)
