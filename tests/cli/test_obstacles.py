"""A folder in the place of an output file: one line that names it, before any work."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.runs.small import FEW, make_study, run

from rockframe.cli.main import main

#: Command, folder of its output and the file that the folder `work/...` stands for.
COMMANDS = {
    "init study": "mine.toml",
    "init schema": "study.schema.json",
    "ingest": "records.nc",
    "ingest list": "records.csv",
    "pulse": "pulses.nc",
    "respond": "response.nc",
    "screen": "screen.nc",
    "screen table": "fragility.csv",
    "spectrum": "spectrum.nc",
    "rocking": "rocking.nc",
    "table": "table.csv",
    "results": "figures/figures.csv",
    "figure": "figure.png",
    "caption": "figure.caption.txt",
    "table1": "response.nc",
    "table1 manifest": "manifest.json",
    "paper": "paper-checked.md",
    "report": "page.html",
    "run": "table.csv",
    "run list": "records.csv",
    "run manifest": "manifest.json",
    "run plan": ".rockframe/plan.json",
    "run figures": "figures/figures.csv",
}
STAGES = ("records.nc", "pulses.nc", "response.nc")


def words_of(name: str, made: Path) -> str:
    """Return the command line of a case; it writes to the current folder."""
    run_files = " ".join(str(made / "run" / file) for file in STAGES)
    records = f"{made / 'run' / 'records.nc'}"
    motions = f"{made / 'motions'} --units g --time-step-s 0.01"
    return {
        "init": "init mine",
        "ingest": f"ingest {motions} --output records.nc",
        "pulse": f"pulse {records} --output pulses.nc",
        "respond": f"respond {records} --output response.nc",
        "screen": f"screen {records} --scales 1 --output screen.nc",
        "spectrum": "spectrum --wavelet symmetric_ricker --slenderness-degree 14 "
        "--frequency-ratio 3 --output spectrum.nc",
        "rocking": f"spectrum --records {records} --slenderness-degree 14 --output rocking.nc",
        "table": f"table {run_files} --output table.csv",
        "results": f"figure {run_files} --output figures",
        "figure": "figure 7 --output figure.png",
        "caption": "figure 7 --output figure.png",
        "table1": f"table1 --records {motions} --output .",
        "paper": f"paper --records {records} --output .",
        "report": f"report {made / 'run'} --output page.html",
        "run": f"run {made / 'small.toml'} --output .",
    }[name.split()[0]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `run`."""
    home = tmp_path_factory.mktemp("obstacles")
    text = FEW.replace("most = 0", "most = 1")
    assert run(make_study(home, 2, text), home / "run") == 0
    return home


@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_in_the_place_of_a_file_is_named_before_any_work(
    name: str, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """Nothing is computed or written, and the same command says the same again."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rockframe.provenance.tempfile.mkstemp", None)  # no file is begun
    obstacle = tmp_path / COMMANDS[name]
    obstacle.mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    words = words_of(name, made).split()
    for _ in range(2):
        assert main(words) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        what = "exists already" if name == "init study" else "is a folder, in the place of a file"
        assert f"{COMMANDS[name]}: {what}" in said
        assert [p for p in sorted(tmp_path.rglob("*")) if p.name != "lock"] == before


def test_an_output_below_a_file_names_the_file(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "notes").write_text("mine")
    assert main(["figure", "7", "--output", str(tmp_path / "notes" / "figure.png")]) == 2
    said = (
        f"{tmp_path / 'notes'}: is a file. Must be a folder, because figure.png is written into it."
    )
    assert capsys.readouterr().err == f"rockframe: error: {said}\n"


def test_a_name_that_is_too_long_is_one_line(tmp_path: Path, capsys: Any) -> None:
    assert main(["figure", "7", "--output", str(tmp_path / f"{'x' * 300}.png")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "cannot be written: File name too long." in said


def test_once_the_folder_is_moved_the_run_goes_on(made: Path, tmp_path: Path, capsys: Any) -> None:
    """The obstacle replaced a finished file: the run makes that file again."""
    study, folder = made / "small.toml", tmp_path / "run"
    shutil.copytree(made / "run", folder)
    table = folder / "table.csv"
    before = table.read_bytes()
    table.unlink()
    table.mkdir()
    assert main(["run", str(study), "--output", str(folder)]) == 2
    table.rename(folder / "moved")
    assert run(study, folder) == 0
    assert table.read_bytes() == before
    assert f"{table}: missing; made again." in capsys.readouterr().err
