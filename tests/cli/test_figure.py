"""`rockframe figure` and `rockframe paper` as a user types them."""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.typing import NDArray
from tests.commands import options_of

from rockframe.cli.main import main
from rockframe.errors import ParameterError
from rockframe.figures.captioned import caption_path
from rockframe.paper.claim import Claim
from rockframe.paper.claims import all_claims
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration, as_ground
from rockframe.stages.named_figures import FIGURES
from rockframe.stages.named_figures.paper import read_claims
from rockframe.stages.named_figures.shown import FigureRequest
from rockframe.study.structures import SHIPPED_STRUCTURES
from rockframe.wavelets.pulse import Pulse


@pytest.fixture(scope="module", autouse=True)
def two_ratios_of_heights() -> Iterator[None]:
    """The figure of unequal columns has the ends of its range: each ratio is an ensemble more."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rockframe.figures.parameters._HEIGHT_RATIOS", (0.6, 1.0))
        yield


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two text records that state their units."""
    folder = tmp_path_factory.mktemp("figures") / "motions"
    folder.mkdir()
    for name, a_p, period in (("weak", 0.3, 0.8), ("strong", 0.45, 1.0)):
        pulse = Pulse(wavelet="antisymmetric_ricker", a_p=a_p, T_p=period, time=3.0)
        table = [0.01 * np.arange(801), pulse.acceleration(0.01 * np.arange(801))]
        rows = (f"{time:.2f},{value:.8f}\n" for time, value in zip(*table, strict=True))
        (folder / f"{name}.csv").write_text("time_s,acc_g\n" + "".join(rows), encoding="utf-8")
    return folder


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


def read(motions: Path) -> tuple[str | Path, ...]:
    return ("--records", motions, "--grid", "12")


def stated(motions: Path, figure: str) -> tuple[str | Path, ...]:
    """Return the records and the resolution of maps, if the figure takes them."""
    records, grid = read(motions)[:-2], read(motions)[-2:]
    takes = FIGURES[figure].takes
    return (*(records if takes("records") else ()), *(grid if takes("grid") else ()))


@pytest.fixture(scope="module")
def claims() -> list[Claim]:
    """All claims that need no records, which take a second to check."""
    return all_claims()


@pytest.fixture(scope="module")
def paper(motions: Path, claims: list[Claim]) -> tuple[Path, list[dict[str, str]]]:
    """The folder that `paper` writes for these motions, and the claims that it prints."""
    folder, printed = motions.with_name("paper"), StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setattr("rockframe.stages.named_figures.paper.all_claims", lambda: claims)
        assert run("paper", "--output", folder, *read(motions), "--json") == 0
    return folder, json.loads(printed.getvalue())["claims"]


@pytest.mark.parametrize("name", FIGURES)
def test_each_figure_is_drawn_with_its_caption(
    motions: Path,
    paper: tuple[Path, list[dict[str, str]]],
    tmp_path: Path,
    name: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The file is byte-identical to the one that `paper` writes."""
    output = tmp_path / "figure.png"
    bent = ("--spacing", "12", "--beam-centre", "1") if name == "joints" else ()
    assert run("figure", name, "--output", output, *bent, *stated(motions, name), "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert output.read_bytes() == (paper[0] / "figures" / f"figure-{name}.png").read_bytes()
    beside = Path(printed["caption_file"])
    assert beside.read_text(encoding="utf-8") == f"{printed['title']}. {printed['caption']}\n"


def test_the_record_that_turns_the_structure_furthest_is_drawn(
    motions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "figure.png"
    assert run("figure", "phase-portrait", "--output", output, *stated(motions, "joints")) == 0
    assert "Record strong" in capsys.readouterr().out
    words = ("figure", "phase-portrait", "--output", output, "--record", "weak")
    assert run(*words, *stated(motions, "joints")) == 0
    assert "Record weak" in capsys.readouterr().out


def test_figure_8_says_how_many_of_the_records_it_shows(motions: Path, tmp_path: Path) -> None:
    output = tmp_path / "figure.png"
    assert run("figure", "8", "--output", output, *stated(motions, "8")) == 0
    caption = output.with_suffix(".caption.txt").read_text(encoding="utf-8")
    assert "1 of 2 records are shown; --record names others." in caption


def test_a_figure_of_the_bundled_records_with_their_vertical_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--record", "Ridgecrest2019-CCC-360", "--vertical", "--spacing", "12")
    assert run("figure", "joints", "--output", tmp_path / "joints.png", *words) == 0
    printed = capsys.readouterr().out
    assert "Ridgecrest2019-CCC-360, with its vertical motion" in printed
    assert "the assumption of no lift-off holds" in printed


@pytest.mark.parametrize("more", ['section = "circular"', "top_width_m = 0.8"])
def test_a_frame_of_other_columns_is_no_bent_of_two_rectangles(
    motions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: str
) -> None:
    text = f'[[structure]]\nname = "a"\nheight_m = 8.0\nwidth_m = 1.4\nmass_ratio = 3.0\n{more}\n'
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    words = ("--structures", str(tmp_path / "a.toml"), "--output", str(tmp_path / "a.png"))
    assert run("figure", "unequal-columns", "--records", str(motions), *words) == 2
    assert "Must be a free frame of rectangular, prismatic columns" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("12", "--output", "a.png"),
            "'12' is no figure, and no output of a stage (.nc). Names are: 5",
        ),
        (("joint", "--output", "a.png"), "Did you mean joints?"),
        (("5", "7", "--output", "a.png"), "'5' is the name of one figure, and no output"),
        (("a.nc", "--output", "a.png"), "is named like a file. State a folder"),
        (("a.nc", "--output", "a", "--vertical"), "--vertical has no effect on outputs of stages"),
        (("5", "--output", "a.png", "--most", "3"), "or draw outputs of stages."),
        (("5", "--output", "a.bmp"), "Must end in .png, .pdf, .svg, .gif, .apng or .mp4"),
        (("joints", "--output", "a.png", "--friction", "0"), "Invalid friction"),
        (("joints", "--output", "a.png", "--spacing", "1"), "Invalid spacing"),
        (("11", "--output", "a.png", "--record", "other"), "Must be one of: strong, weak"),
        (("joints", "--output", "a.png", "--vertical"), "no vertical record"),
        (("joints", "--output", "a.png", "--record", "weak", "--record", "strong"), "Must be one"),
        (("joints", "--output", "a.png", "--structure", "tower"), "Invalid structure"),
        (("joints", "--output", "a.png", "--beam-centre", "1"), "no effect without --spacing"),
        (
            ("joints", "--output", "a.png", "--spacing", "9", "--structure", "slender-column"),
            "is a column alone",
        ),
    ],
)
def test_the_users_mistake_is_one_line_and_status_2(
    motions: Path,
    words: tuple[str, ...],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(motions.parent)
    try:
        status = run("figure", *words, *stated(motions, words[0] if words[0] in FIGURES else "5"))
    except SystemExit as ended:
        status = int(str(ended.code))
    assert status == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(motions.parent.glob("a.*"))


def test_a_claim_is_shown_alone(
    claims: list[Claim], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rockframe.paper.claims.all_claims", lambda: claims)
    assert run("paper", "--claim", "temple-p") == 0
    printed = capsys.readouterr().out
    assert "1.381 rad/s" in printed
    assert "agrees" in printed
    assert run("paper", "--claim", "temple-q") == 2
    assert "Must be one of: brick-p" in capsys.readouterr().err


def test_the_paper_is_checked_and_its_page_is_whole(
    paper: tuple[Path, list[dict[str, str]]],
) -> None:
    folder, claims = paper
    assert {claim["finding"] for claim in claims} == {
        "agrees", "differs", "misprint", "cannot be checked",
    }  # fmt: skip
    page = (folder / "paper-checked.md").read_text(encoding="utf-8")
    assert "0 of the paper's 6 records were found" in page
    for name in FIGURES:
        assert f"(figures/figure-{name}.png)" in page
        assert (folder / "figures" / f"figure-{name}.png").is_file()
    assert run("verify", folder) == 0


def test_the_paper_checked_again_is_the_same(
    motions: Path,
    paper: tuple[Path, list[dict[str, str]]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The figures are copied here, because another test draws each of them again."""

    def drawn_before(_records: Path, folder: Path, _grid: int) -> dict[str, str]:
        copied = Path(shutil.copytree(paper[0] / "figures", folder / "figures"))
        drawn = [copied / f"figure-{name}.png" for name in FIGURES]
        texts = [caption_path(path).read_text(encoding="utf-8") for path in drawn]
        return {f"figures/{path.name}": text[:-1] for path, text in zip(drawn, texts, strict=True)}

    monkeypatch.setattr("rockframe.stages.named_figures.paper.draw_all", drawn_before)
    again = tmp_path / "again"
    assert run("paper", "--output", again, *read(motions), "--json") == 0
    assert (again / "manifest.json").read_bytes() == (paper[0] / "manifest.json").read_bytes()


def test_a_claim_is_read_as_it_was_checked(
    claims: list[Claim], paper: tuple[Path, list[dict[str, str]]]
) -> None:
    """Texts that spreadsheets would take for formulas come back too."""
    assert read_claims(paper[0])[: len(claims)] == claims
    assert [claim["name"] for claim in paper[1]][: len(claims)] == [c.name for c in claims]


def test_a_finished_paper_is_only_printed(
    motions: Path, paper: tuple[Path, list[dict[str, str]]], capsys: pytest.CaptureFixture[str]
) -> None:
    before = (paper[0] / "paper-checked.md").stat().st_mtime_ns
    assert run("paper", "--output", paper[0], *read(motions), "--json") == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["claims"] == paper[1]
    assert printed.err == ""  # no step
    assert (paper[0] / "paper-checked.md").stat().st_mtime_ns == before


def test_the_page_keeps_out_of_the_folder_of_the_records(motions: Path) -> None:
    assert run("paper", "--output", motions, *read(motions)) == 2
    assert sorted(file.name for file in motions.iterdir()) == ["strong.csv", "weak.csv"]


def test_figure_11_lists_the_records_without_vertical_motion(
    motions: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def above_the_strong_one(record: Record, _beside: Mapping[str, Record]) -> GroundAcceleration:
        if record.record_id == "weak":
            raise ParameterError("nothing beside it.")
        return as_ground(record)

    words = ("figure", "11", "--output", tmp_path / "a.png", *stated(motions, "11"), "--vertical")
    assert run(*words) == 2
    assert "record 'strong': no vertical record" in capsys.readouterr().err
    monkeypatch.setattr("rockframe.stages.named_figures.shown.with_vertical", above_the_strong_one)
    assert run(*words) == 1
    printed = capsys.readouterr()
    assert printed.err == "rockframe: rejected: weak: nothing beside it.\n"
    assert "strong: stands" in printed.out
    assert "weak: " not in printed.out


@pytest.mark.parametrize("invalid", [{"grid": 1}, {"grid": 4001}, {"friction": 0.0}])
def test_numbers_of_figures_have_bounds(invalid: dict[str, Any]) -> None:
    def no_records() -> AbstractContextManager[tuple[Path, int]]:
        raise AssertionError

    for allowed in (2, 4000):
        assert FigureRequest(records=no_records, grid=allowed).friction is None
    with pytest.raises(ParameterError, match=f"Invalid {next(iter(invalid))} "):
        FigureRequest(records=no_records, **invalid)


def test_a_map_of_one_point_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("figure", "9", "--output", tmp_path / "a.png", "--grid", "1") == 2
    assert "Invalid grid 1. Must be 2 to 4000." in capsys.readouterr().err


def options_of_figures() -> list[argparse.Action]:
    """Return the options of `rockframe figure` that are not for all figures."""
    common = ("help", "figure", "output", "json")
    return [one for one in options_of("figure") if one.dest not in common]


#: Values of the options that are fields of a request, and what they need beside them.
VALUES: dict[str, tuple[str, ...]] = {
    "record": ("--record", "weak"),
    "structure": ("--structure", "apollo-frame"),
    "vertical": ("--vertical",),
    "friction": ("--friction", "0.3"),
    "spacing": ("--spacing", "13"),
    "beam_centre": ("--spacing", "12", "--beam-centre", "1"),
    "grid": ("--grid", "16"),
}
#: What is drawn without them.
BESIDE = {"beam_centre": ("--spacing", "12"), "grid": ("--grid", "12")}


def words_of(action: argparse.Action) -> tuple[str, ...]:
    """Return an option with a value that its type accepts."""
    if action.dest in VALUES:
        return VALUES[action.dest]
    if action.dest == "structures":
        return ("--structures", str(SHIPPED_STRUCTURES))
    values = list(map(str, action.choices or ("1",)))
    count = action.nargs if isinstance(action.nargs, int) else 1
    return (
        action.option_strings[0],
        *(str(1 + k) if count > 1 else values[0] for k in range(count)),
    )


@pytest.mark.parametrize("name", FIGURES)
def test_each_option_reaches_the_figure_or_is_refused_in_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All pairs of figure and option, as the parser states them; nothing is drawn here."""
    reached: list[list[Path] | None] = []

    def note(given: list[Path] | None) -> AbstractContextManager[tuple[Path, int]]:
        reached.append(given)
        raise ParameterError("reached")

    monkeypatch.setattr("rockframe.cli.arguments.records_file", note)
    for action in options_of_figures():
        words = words_of(action)
        taken = FIGURES[name].takes(action.dest)
        if taken and not FIGURES[name].takes("records"):
            continue  # drawn in the next test
        assert run("figure", name, "--output", tmp_path / "a.png", *words) == 2, words
        error = capsys.readouterr().err
        if taken:
            assert (reached.pop() is not None) == (action.dest == "records"), words
        else:
            flag = f"--{action.dest.replace('_', '-')}"
            assert f"{flag} has no effect on figure {name}. Leave it out, or draw" in error
            assert error.count("\n") == 1
    assert not reached
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", FIGURES)
def test_each_option_changes_the_picture_and_the_caption(
    motions: Path, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All options of a figure besides the records, as the parser states them."""

    def shaken_upwards(record: Record, _beside: Mapping[str, Record]) -> GroundAcceleration:
        upwards = GroundAcceleration.from_samples(0.5 * record.acceleration[::-1], 0.01)
        return as_ground(record).with_vertical(upwards)

    monkeypatch.setattr("rockframe.stages.named_figures.shown.with_vertical", shaken_upwards)
    monkeypatch.setattr("rockframe.figures.spectra._SCALES", np.array([0.9, 1.0, 1.1]))
    monkeypatch.setattr("rockframe.figures.captioned._PRINT", 60)

    def drawn(*words: str) -> tuple[NDArray[np.float64], str]:
        output, given = tmp_path / "figure.png", stated(motions, name)
        if "--grid" in given:
            given = (*given[:-1], "48")
        if "--grid" in words:
            given = given[:-2]
        assert run("figure", name, "--output", output, *given, *words) == 0
        return imread(output), caption_path(output).read_text(encoding="utf-8")

    for action in options_of_figures():
        if action.dest in VALUES and FIGURES[name].takes(action.dest):
            words = VALUES[action.dest]
            if action.dest == "record" and FIGURES[name].shows == "best_matched":
                words = ("--record", "strong")  # by default the other record
            before, after = drawn(*BESIDE.get(action.dest, ())), drawn(*words)
            assert before[1] != after[1], action.dest
            same = before[0].shape == after[0].shape and (before[0] == after[0]).all()
            assert not same, action.dest
