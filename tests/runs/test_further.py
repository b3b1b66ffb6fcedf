"""Screening and spectra as steps of a run: shown, drawn, verified and recomputed."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Mapping
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import netCDF4
import pytest
from tests.runs.small import FEW, STUDY, contents, make_study, run

from rockframe.cli.main import main, parser
from rockframe.engines.engine import ProcessPool
from rockframe.errors import InputError
from rockframe.options.model import FigureOptions
from rockframe.provenance import MANIFEST, sealed, sha256_of
from rockframe.results.response import read_rocking_spectrum
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import write_screen_tables
from rockframe.rocking import Verdict
from rockframe.runs.performing import recompute
from rockframe.stages.figures import draw_curves, figures_stage

FURTHER = """
[screen]
scales = [1.0, 3.0]
margins = "none"

[screen.design]
dimension = "height"
range = [6.0, 12.0]
steps = 3

[spectrum]
wavelet = ["symmetric_ricker"]
slenderness_degree = [14.0]
frequency_ratio = [4.0]
max_amplitude = 9.0
amplitude_step = 0.5

[rocking_spectrum]
slenderness_degree = [14.0]
column_period_s = [3.0, 6.0]
"""


#: Batches, members and noise are tested elsewhere.
IN_ONE_BATCH = (
    STUDY.replace("records = 2", "records = 9")
    .replace('margins = "first"', 'margins = "first"\n[respond.ensemble]\nmembers = 16')
    .replace("[figures]", "[pulse]\nsurrogates = 0\n[figures]")
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run with screening and spectra."""
    home = tmp_path_factory.mktemp("further")
    study = make_study(home, 4, f"{IN_ONE_BATCH}{FURTHER}")
    assert run(study, home / "run") == 0
    return home / "run"


#: The pulse of the second of two records is longer than is asked for.
SCREENED = """
[screen]
scales = [1.0]
margins = "none"
hazard = "hazard.csv"
pulse_period_s = [0.0, 0.85]
"""


@pytest.fixture(scope="module")
def screened_and_said(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with a study of a screening and its run, and the messages of that run."""
    home, said = tmp_path_factory.mktemp("screened"), StringIO()
    (home / "hazard.csv").write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    study = make_study(home, 2, f"{FEW}{SCREENED}")
    with redirect_stderr(said):
        assert run(study, home / "run") == 0
    return home, said.getvalue()


@pytest.fixture
def screened(screened_and_said: tuple[Path, str], tmp_path: Path) -> Path:
    """A copy of that folder, to change."""
    return Path(shutil.copytree(screened_and_said[0], tmp_path / "screened"))


@pytest.fixture
def home(finished: Path, tmp_path: Path) -> Path:
    """A copy of the study and its run, to change."""
    return Path(shutil.copytree(finished.parent, tmp_path / "home"))


@pytest.fixture
def folder(home: Path) -> Path:
    """The copy of the run."""
    return home / "run"


def test_each_stage_has_its_figures_and_the_index_lists_them(finished: Path) -> None:
    listed = (finished / "figures" / "figures.csv").read_text(encoding="utf-8").splitlines()
    assert listed[0] == "file,shows"
    shown = dict(line.split(",") for line in listed[1:])
    assert {file.partition("/")[0] for file in shown if "/" in file} == {
        "margins",
        "sensitivity",
        "screen",
        "spectrum",
        "rocking_spectrum",
    }
    assert shown["screen/fragility-slender-column.png"] == "slender-column"
    assert "motion-3.png" in shown
    assert shown["margins/motion-3.png"] == "motion-3"
    drawn = {p.relative_to(finished / "figures").as_posix() for p in finished.rglob("*.png")}
    assert drawn == set(shown)


def test_the_report_shows_the_screening(finished: Path) -> None:
    page = (finished / "report.html").read_text(encoding="utf-8")
    section = page.partition('<section id="screening"')[2].partition("</section>")[0]
    for words in ("Fragility", "Ranking", "Design", "overturning", "slender-column", "<svg"):
        assert words in section
    assert "style=" not in section  # the page's policy forbids it


def test_figures_of_single_records_are_as_many_as_are_asked_for(
    finished: Path, tmp_path: Path
) -> None:
    """Records under which a standing frame rotates furthest come first."""
    words = ["figure", str(finished / "rocking_spectrum.nc"), "--most", "1", "--output"]
    assert main([*words, str(tmp_path / "figures")]) == 0
    (figure,) = (tmp_path / "figures").rglob("*.png")
    spectrum = read_rocking_spectrum(finished / "rocking_spectrum.nc")
    stands = spectrum["verdict"] != Verdict.OVERTURNS
    peaks = spectrum["peak_rotation_ratio"].where(stands, 0.0)
    furthest = peaks.max(["slenderness", "mass_ratio", "column_period"]).argmax("record")
    assert figure.name == f"{spectrum['record_id'].values[furthest]}-mass-ratio-0.png"


def test_workers_draw_the_same_bytes(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker gets its task, and returns its result, as pickles."""

    class Pickled(ProcessPool):
        def map(self, function: Any, batches: Any) -> Any:
            asked.append((self.workers, len(batches)))
            for batch in batches:
                yield sent(function(sent(batch)))

    def sent(value: Any) -> Any:
        return pickle.loads(pickle.dumps(value))  # noqa: S301  our own value

    asked: list[tuple[int | None, int]] = []
    monkeypatch.setattr("rockframe.stages.figures.ProcessPool", Pickled)
    files = [finished / name for name in ("records.nc", "pulses.nc", "response.nc")]
    drawn = figures_stage(files, tmp_path / "figures", FigureOptions(most=1), workers=3)
    assert asked == [(3, 1)]
    assert len(drawn) == 3
    before = contents(finished / "figures")
    for file in drawn:
        assert (tmp_path / "figures" / file).read_bytes() == before[file]


def test_only_figures_of_changed_files_are_drawn_again(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second of two files changes; a figure of the first then differs from what was drawn."""
    names = ("rocking_spectrum.nc", "spectrum.nc")
    for name in names:
        shutil.copy(finished / name, tmp_path / name)
    asked: list[str] = []

    def noted(given: Mapping[str, Path], *further: Any) -> dict[str, str]:
        asked.extend(given)
        return draw_curves(given, *further)

    monkeypatch.setattr("rockframe.stages.figures.draw_curves", noted)

    def drawn_again() -> list[str]:
        asked.clear()
        files = [tmp_path / name for name in names]
        figures_stage(files, tmp_path / "figures", FigureOptions(most=1))
        return asked

    assert set(drawn_again()) == {"rocking_spectrum", "spectrum"}
    before = contents(tmp_path / "figures")
    assert drawn_again() == []
    assert contents(tmp_path / "figures") == before
    with netCDF4.Dataset(tmp_path / "spectrum.nc", "a") as file:
        file.history = "touched"
    assert drawn_again() == ["spectrum"]
    (first, *_) = sorted((tmp_path / "figures" / "rocking_spectrum").glob("*.png"))
    first.write_bytes(first.read_bytes()[:-1])
    assert drawn_again() == ["rocking_spectrum"]
    assert first.read_bytes() == before[first.relative_to(tmp_path / "figures").as_posix()]


def test_file_among_the_figures_is_not_replaced_with_them(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "figures"
    words = [
        "figure",
        str(finished / "rocking_spectrum.nc"),
        "--most",
        "1",
        "--output",
        str(folder),
    ]
    assert main(words) == main(words) == 0
    mine = folder / "mine.txt"
    mine.write_text("what I saw")
    assert main(words) == 2
    assert "mine.txt: is not a figure of this stage" in capsys.readouterr().err
    assert mine.read_text() == "what I saw"


def test_file_is_not_replaced_by_a_folder_of_figures(finished: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("what I saw")
    with pytest.raises(InputError, match=r"mine\.txt: is a file. Must be a folder"):
        figures_stage([finished / "rocking_spectrum.nc"], mine)
    assert mine.read_text() == "what I saw"


@pytest.mark.faults
@pytest.mark.parametrize("change", ["list damaged", "figure gone"])
def test_figures_in_folders_are_made_again(home: Path, change: str) -> None:
    """The figures of screening and spectra are in subfolders, and they are made again as well."""
    folder = home / "run"
    before, index = contents(folder), folder / "figures" / "figures.csv"
    if change == "list damaged":
        index.write_bytes(index.read_bytes()[:-9])
    else:
        (folder / "figures" / "screen" / "fragility-slender-column.png").unlink()
    assert run(home / "small.toml", folder) == 0
    assert contents(folder) == before


def test_study_without_figures_leaves_nothing_behind_and_with_them_makes_all_again(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The subfolders of screening and spectra are removed together with their figures."""
    folder, study = home / "run", home / "small.toml"
    before, text = contents(folder), study.read_text()
    mine = folder / "figures" / "mine.txt"
    mine.write_text("a file of the user's own stays")
    study.write_text(text.replace("most = 1", "most = 0"))
    assert run(study, folder) == 0
    said = capsys.readouterr().err
    assert f"{mine.parent}: no longer an output of the study; removed." in said
    assert [path.name for path in mine.parent.iterdir()] == ["mine.txt"]
    assert main(["verify", str(folder)]) == 0
    mine.unlink()
    mine.parent.rmdir()
    study.write_text(text)
    assert run(study, folder) == 0
    assert contents(folder) == before


def test_list_of_figures_that_is_gone_is_named_and_they_are_made_again(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run does not draw again while one of the user's files is among the figures."""
    folder, before = home / "run", contents(home / "run")
    index, mine = (folder / "figures" / name for name in ("figures.csv", "screen/mine.txt"))
    index.unlink()
    (index.parent / ".snakemake_timestamp").touch()  # as a workflow leaves it
    assert main(["verify", str(folder)]) == 1
    assert str(index) in capsys.readouterr().err
    assert main(["status", str(folder)]) == 0
    assert f"{index}: missing" in capsys.readouterr().out
    mine.write_text("what I saw")
    assert run(home / "small.toml", folder) == 2
    assert f"{mine}: is not a figure of this stage" in capsys.readouterr().err
    mine.unlink()
    assert run(home / "small.toml", folder) == 0
    assert f"{index}: missing" in capsys.readouterr().err
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["screen.nc", "screen.nc"], "is of the same kind as"),
        (
            ["records.nc", "response.nc"],
            "stated without pulses. Figures of records need three files",
        ),
        (["screen.csv"], "is not a netCDF file. Must be the output of a stage, such as"),
        (["nowhere.nc"], "nowhere.nc: no such file. Must be the output of a stage."),
    ],
)
def test_files_that_do_not_make_figures_are_refused(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], names: list[str], words: str
) -> None:
    files = [str(finished / name) for name in names]
    assert main(["figure", *files, "--output", str(tmp_path / "figures")]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "figures").exists()


def test_computed_again_it_is_the_same(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(finished), "--recompute", "2"]) == 0
    printed = capsys.readouterr().out
    for words in (
        "pulse: 2 records",
        "respond: 2 records",
        "screen",
        "spectrum",
        "rocking_spectrum",
    ):
        assert f"recomputed: {words}, equal to the last bit" in printed


def test_on_another_processor_it_is_nearly_the_same(
    screened: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A difference in the last bits is no fault, and `verify` states how large it is."""
    folder = screened / "run"
    table = (folder / "screen.csv").read_bytes()
    manifest = json.loads((folder / MANIFEST).read_text())
    with netCDF4.Dataset(folder / "screen.nc", "a") as file:
        file["peak_u"][:] = file["peak_u"][:] * (1.0 + 1e-9)
    write_screen_tables(folder / "screen.nc")
    for name in ("screen.nc", "screen.csv", "scenarios.csv", "fragility.csv"):
        manifest["outputs"][name] = sha256_of(folder / name)
    (folder / MANIFEST).write_bytes(sealed(manifest))
    assert main(["report", str(folder)]) == 0
    assert main(["verify", str(folder), "--recompute", "1"]) == 0
    assert "screen, equal within 1e-09 of the largest of each" in capsys.readouterr().out
    assert table != (folder / "screen.csv").read_bytes()
    (folder / "screen.csv").write_bytes(table)
    _, faults = recompute(folder, 1)
    assert faults == [f"{folder / 'screen.csv'}: differs when written again."]


def test_what_was_not_computed_so_is_found(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The files are intact and match their hashes, but a recomputation gives other values."""
    changed = {"response.nc": "theta", "screen.nc": "peak_u", "spectrum.nc": "verdict"}
    manifest = json.loads((folder / MANIFEST).read_text())
    for name, variable in changed.items():
        with netCDF4.Dataset(folder / name, "a") as file:
            values = file[variable][:]
            values.flat[:] = 1
            file[variable][:] = values
        manifest["outputs"][name] = sha256_of(folder / name)
    (folder / MANIFEST).write_bytes(sealed(manifest))
    assert main(["report", str(folder)]) == 0
    assert main(["verify", str(folder)]) == 0
    assert main(["verify", str(folder), "--recompute"]) == 1
    said = capsys.readouterr().err
    assert [name for name in changed if f"{folder / name}:" not in said] == []


def test_what_cannot_be_computed_again_is_a_fault(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(folder / ".rockframe")
    assert main(["verify", str(folder), "--recompute"]) == 1
    assert "contains no study plan" in capsys.readouterr().err


def test_missing_page_is_a_fault(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "report.html").unlink()
    assert main(["verify", str(folder)]) == 1
    assert "report.html: missing" in capsys.readouterr().err


def test_lists_of_other_lengths_are_faults(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((folder / MANIFEST).read_text())
    for name in ("table.csv", "records.csv"):
        lines = (folder / name).read_text().splitlines(keepends=True)
        (folder / name).write_text("".join(lines[:-1]))
        manifest["outputs"][name] = sha256_of(folder / name)
    (folder / MANIFEST).write_bytes(sealed(manifest))
    assert main(["verify", str(folder)]) == 1
    said = capsys.readouterr().err
    assert "records.csv: 3 accepted, 4 in records.nc" in said
    assert "table.csv: 7 rows, 8 responses" in said


def test_record_that_a_screening_is_not_asked_for_is_not_rejected(
    screened_and_said: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """It is filtered out, as with the filters of the study and with `rockframe screen`."""
    home, said = screened_and_said
    assert "rejected" not in said
    assert main(["show", str(home / "run"), "motion-1"]) == 0
    assert "not in screen.nc pulse_period_s 0.9" in capsys.readouterr().out


def test_screening_of_a_record_is_shown(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(finished), "motion-3", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["screening"]
    assert [row["structure"] for row in rows] == ["bridge-bent", "slender-column"]
    bent, column = (row["verdicts"] for row in rows)
    assert bent == {"1": "stands", "3": "overturns"}
    assert column == {"1": "overturns", "3": "overturns"}
    assert main(["show", str(finished), "motion-3"]) == 0
    printed = capsys.readouterr().out
    assert "outcome at multiples of the record" in printed
    assert "stands at 1; overturns at 3" in printed
    assert "overturns at 1, 3" in printed


@pytest.mark.parametrize("number", ["-1e-05", "-inf", "-3", "-.5", "-1.5E+3"])
def test_any_number_that_a_study_states_is_one_on_the_command_line(number: str) -> None:
    words = ["ingest", "motion.csv", "--output", "records.nc", "--pga-g", number, "9"]
    assert parser().parse_args(words).pga_g == [float(number), 9.0]


def test_without_its_hazard_file_only_the_screening_cannot_be_recomputed(
    tmp_path: Path, screened_and_said: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The file of the hazard curve is missing; pulses and responses do not need it."""
    home, _ = screened_and_said
    hazard = home / "hazard.csv"
    away = shutil.move(hazard, tmp_path)
    status = main(["verify", str(home / "run"), "--recompute"])
    shutil.move(away, hazard)
    assert status == 1
    said = capsys.readouterr()
    assert "recomputed: respond: 2 records" in said.out
    assert f"screen cannot be recomputed: {hazard}: cannot be read" in said.err


def test_a_run_says_which_structures_have_restraints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gap = '\n[[structure]]\nname = "joint"\nheight_m = 9.6\nwidth_m = 1.6\n'
    study = make_study(tmp_path, 1, f"{FEW}{gap}[structure.abutment]\ngap_m = 0.3\n")
    assert run(study, tmp_path / "run") == 0
    assert "With their restraints: joint (abutment)." in capsys.readouterr().out


def test_a_screening_in_batches_is_resumed_by_batch(
    screened: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The only motion of the second batch is filtered out; the seed concerns no scenario."""
    study = tmp_path / "batches" / "small.toml"
    shutil.copytree(screened, study.parent, ignore=shutil.ignore_patterns("run"))
    text = study.read_text(encoding="utf-8").replace("records = 9", "records = 1")
    study.write_text(text, encoding="utf-8")
    folder = study.parent / "run"

    def steps() -> set[str]:
        capsys.readouterr()
        assert run(study, folder, "--json") == 0
        return set(json.loads(capsys.readouterr().out)["steps_done"])

    assert {"screen-001", "screen-002", "index-screen"} <= steps()
    for name, content in contents(screened / "run").items():
        if name.endswith(".csv"):
            assert contents(folder)[name] == content, name
    assert steps() == set()
    before = contents(folder)
    (folder / "shards" / "screen-001.nc").unlink()
    assert main(["verify", str(folder)]) == 1
    assert "screen-001.nc: missing" in capsys.readouterr().err
    assert steps() == {"screen-001", "manifest", "verify"}
    assert contents(folder) == before
    assert main(["verify", str(folder), "--recompute", "2"]) == 0
    study.write_text(text.replace("scales = [1.0]", "scales = [1.0]\nseed = 1"), encoding="utf-8")
    assert not steps() & {"screen-001", "screen-002"}
    assert json.loads(read_screening(folder / "screen.nc").attrs["parameters"])["seed"] == 1
