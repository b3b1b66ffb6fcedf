"""Mistakes on the command line: one line, the right exit status and no partial output."""

from __future__ import annotations

import argparse
import contextlib
import csv
import json
import sys
from pathlib import Path

import pytest
from tests.commands import STRUCTURE, ingested, run

import rockframe
from rockframe.cells import TABLE_FORMATS
from rockframe.cli.main import parser


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


def test_where_filters_leave_nothing_they_are_named_before_what_cannot_be_read(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = motion.with_name("bad.csv")
    bad.write_text("0.1\ninf\n")
    words = ("--units", "g", "--time-step", "0.01", "--output", motion.with_name("records.nc"))
    assert run("ingest", bad, motion, *words, "--pga-g", "8", "9") == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert "error: motion.csv: pga_g 0.399783" in error
    assert error.endswith("Must be from 8 to 9. (1 rejected.)")


def test_a_second_structure_does_not_silently_take_the_place_of_the_first(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("--structure", "bridge-bent", "--structure", "apollo-frame")
    with pytest.raises(SystemExit, match="2"):
        run("table1", *words)
    assert "argument --structure: stated twice. State it once" in capsys.readouterr().err


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


def test_unknown_structure_is_refused_with_those_there_are(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = ingested(motion)
    output = motion.with_name("response.nc")
    assert run("respond", records, "--structure", "tower", "--output", output) == 2
    assert "Must be one of: bridge-bent, apollo-column" in capsys.readouterr().err
    assert not output.exists()


def typed(*words: str | Path) -> tuple[str, ...]:
    return tuple(str(word) for word in words)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("motion.csv", "The table beside motion.nc would replace it"),
        ("motion.nc", "Choose another file"),
    ],
)
def test_ingest_never_replaces_its_input(
    motion: Path, capsys: pytest.CaptureFixture[str], name: str, words: str
) -> None:
    """The output `motion.nc` comes with its list of inputs, `motion.csv`."""
    read = motion.rename(motion.with_name(name))
    before = read.read_bytes()
    stated = ("--units", "g", "--time-step", "0.01", "--output", motion.with_name("motion.nc"))
    assert run("ingest", read, *stated) == 2
    assert f"is an input of this command. {words}" in capsys.readouterr().err
    assert read.read_bytes() == before
    assert [path.name for path in motion.parent.iterdir()] == [name]


def test_what_is_written_must_fit_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Options that name outputs check the ending of the name before anything is written."""
    monkeypatch.chdir(tmp_path)
    verbs = next(a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001
    writing = [
        (verb, action)
        for verb, its in verbs.choices.items()
        for action in its._actions  # noqa: SLF001
        if action.dest in ("output", "figures")
    ]
    assert len(writing) > 10
    for verb, action in writing:
        assert callable(action.type)
        with pytest.raises(argparse.ArgumentTypeError, match=r"Must end in|State a folder"):
            action.type("table.txt")
        if action.default is not None:
            assert action.type(str(action.default)) == action.default, verb
    with pytest.raises(SystemExit, match="2"):
        run("table", "records.nc", "pulses.nc", "response.nc", "--output", "table.txt")
    must = "Must end in .csv, .xlsx, .md, .tex or .parquet"
    said = f"argument --output/-o: 'table.txt'. {must}. See rockframe table --help."
    assert capsys.readouterr().err == f"rockframe: error: {said}\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("table_format", TABLE_FORMATS)
def test_ingest_replaces_its_own_table_and_no_other(
    motion: Path, table_format: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if table_format in ("xlsx", "parquet"):
        pytest.importorskip("pyarrow", reason="needs the extra tables")
    strange = motion.with_name("read_me" + TABLE_FORMATS[table_format])
    strange.write_text("name,age\n")
    stated = ("--units", "g", "--time-step", "0.01", "--format", table_format)
    words = ("ingest", motion, *stated, "--output", strange.with_suffix(".nc"))
    assert run(*words) == 2
    assert "is in the place of the list of inputs" in capsys.readouterr().err
    assert strange.read_text() == "name,age\n"
    strange.unlink()
    assert run(*words) == run(*words) == 0


@pytest.mark.parametrize(
    ("verb", "table_format", "package"),
    [
        ("ingest", "xlsx", "openpyxl"),
        ("ingest", "parquet", "pyarrow"),
        ("table1", "xlsx", "openpyxl"),
    ],
)
def test_a_format_without_its_package_is_refused_before_reading(
    motion: Path,
    verb: str,
    table_format: str,
    package: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Otherwise the command would do all its work and then fail to write its table."""
    monkeypatch.setitem(sys.modules, package, None)
    output = motion.with_name("made.nc" if verb == "ingest" else "made")
    stated = ("--units", "g", "--time-step", "0.01", "--format", table_format)
    given = [motion] if verb == "ingest" else ["--records", motion]
    assert run(verb, *given, *stated, "--output", output) == 2
    must = f"Tables as {table_format} need the package {package}. Install it with: pip install"
    assert must in capsys.readouterr().err
    assert list(motion.parent.iterdir()) == [motion]


@pytest.mark.parametrize("verb", ["pulse", "respond"])
def test_a_stage_never_replaces_its_input(motion: Path, verb: str) -> None:
    records = ingested(motion)
    before = records.read_bytes()
    assert run(verb, records, "--output", records) == 2
    assert records.read_bytes() == before


def test_a_file_of_structures_is_never_replaced(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = ingested(motion)
    structures = motion.with_name("mine.nc")
    structures.write_text(STRUCTURE)
    assert run("respond", records, "--structures", structures, "--output", structures) == 2
    assert "is an input of this command" in capsys.readouterr().err
    assert structures.read_text() == STRUCTURE


def test_table1_keeps_out_of_the_folder_of_the_records(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--units", "g", "--time-step", "0.01", "--output", motion.parent)
    assert run("table1", "--records", motion, *words) == 2
    assert "contains the records. Choose another folder." in capsys.readouterr().err
    assert [path.name for path in motion.parent.iterdir()] == ["motion.csv"]


def test_a_mistake_leaves_a_finished_run_as_it_was(motion: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    read = ("--units", "g", "--time-step", "0.01")
    few = ("--margins", "none", "--ensemble-members", "0", "--surrogates", "0")
    words = typed("table1", "--records", motion, *read, *few)
    assert run(*words, "--output", folder) == 0
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for mistake in (
        ("--structure", "typo"),
        ("--band-pass", "40", "1"),
        ("--records", "no-such-file"),
        ("--catalogue", "no-such-file"),
    ):
        assert run(*words, "--output", folder, *mistake) == 2, mistake
        now = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        assert now == before, mistake


def test_gal_taken_for_g_is_noticed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gal.csv"
    path.write_text("0\n300\n-250\n")
    words = ("--units", "g", "--time-step", "0.01", "--output", tmp_path / "records.nc")
    assert run("ingest", path, *words) == 2
    assert (
        "record 'gal': peak_acceleration 2943 m s-2. Must be at most 98.1 m s-2"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "words",
    [
        ("ingest", "x.csv", "--time-step", "abc", "--output", "x.nc"),
        ("ingest", "", "--output", "x.nc"),
        ("respond", "x.nc"),
        ("screen",),
    ],
)
def test_a_mistyped_command_is_one_line(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        run(*words)
    error = capsys.readouterr().err
    assert stopped.value.code == 2
    assert error.startswith("rockframe: error: ")
    assert error.count("\n") == 1


OF_WORKERS = [
    "pulse records.nc --output p.nc",
    "respond records.nc --output r.nc",
    "screen motions --output s.nc",
]
OF_READERS = ["table1 --output run", "ingest motions --output r.nc"]


@pytest.mark.parametrize(
    ("command", "number"),
    [(command, "0") for command in OF_WORKERS]
    + [(command, n) for command in OF_WORKERS + OF_READERS for n in ("-1", "10000")],
)
def test_number_of_workers_and_0_for_reading_files_alone(
    command: str,
    number: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(*command.split(), "--workers", number) == 2
    error = capsys.readouterr().err
    assert f"--workers {number}. Must be " in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "option", ["--workers", "--surrogates", "--seed", "--batch", "--periods-s"]
)
def test_number_of_thousands_of_digits_is_one_short_line(
    option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python does not convert text of more than 4,300 digits to an integer."""
    with pytest.raises(SystemExit, match="2"):
        run("pulse", "records.nc", option, "9" * 5000)
    error = capsys.readouterr().err
    assert error.startswith("rockframe: error: ")
    assert (error.count("\n"), len(error) < 200) == (1, True)


def test_a_folder_of_rejects_still_gives_the_table_and_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, output = tmp_path / "motions", tmp_path / "out" / "records.nc"
    folder.mkdir()
    for name in "ab":
        (folder / f"{name}.txt").write_text("0.1\n0.2\n")
    (folder / "request.json").write_text("{}")
    assert run("ingest", folder, "--output", output, "--json") == 2
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert (result["accepted"], result["output"]) == ([], None)
    assert [row["file"] for row in result["rejected"]] == ["a.txt", "b.txt"]
    assert [row["file"] for row in result["unread"]] == ["request.json"]
    assert said.err.count("rockframe: rejected: ") == 2
    assert said.err.splitlines()[-1].startswith("rockframe: error: a.txt: acceleration units unst")
    with output.with_suffix(".csv").open(newline="") as stream:
        rows = [(row["file"], row["status"]) for row in csv.DictReader(stream)]
    assert rows == [("a.txt", "rejected"), ("b.txt", "rejected"), ("request.json", "unread")]
    assert not output.exists()


def test_what_was_written_into_the_folder_before_is_no_input(motion: Path) -> None:
    output = motion.with_name("records.nc")
    words = ("ingest", motion.parent, "--units", "g", "--time-step", "0.01", "--output", output)
    before = []
    for _ in range(2):
        assert run(*words) == 0
        before.append(output.read_bytes())
    assert before[0] == before[1]


def test_a_file_in_the_folder_that_is_no_netcdf_is_not_replaced(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = motion.with_name("mine.nc")
    output.write_text("time_s,acc_g\n0.0,0.1\n0.1,0.2\n")
    assert run("ingest", motion.parent, "--output", output) == 2
    assert "mine.nc: is an input of this command" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["respond", "screen"])
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--ensemble-members", "15"), "--ensemble-members 15. Must be 0, or at least 16"),
        (("--ensemble-height", "-0.1"), "--ensemble-height -0.1. Must be zero or positive."),
        (
            ("--ensemble-width", "0.99"),
            "Invalid spread width 0.99 of the ensemble of frame 'wide': member 1 has width 6.4",
        ),
        (
            ("--ensemble-impact-loss", "0.5"),
            "--ensemble-impact-loss 0.5. Must be at least 1.",
        ),
    ],
)
def test_ensembles_that_cannot_be(
    motion: Path,
    capsys: pytest.CaptureFixture[str],
    verb: str,
    words: tuple[str, str],
    told: str,
) -> None:
    structures, output = motion.with_name("wide.toml"), motion.with_name(f"{verb}.nc")
    structures.write_text(STRUCTURE.replace("portico", "wide").replace("0.8", "3.9"))
    asked = (ingested(motion), "--structures", structures, "--margins", "robust", *words)
    capsys.readouterr()
    assert run(verb, *asked, "--output", output) == 2
    lines = capsys.readouterr().err.splitlines()
    # The structure is so wide that there are warnings as well.
    (error,) = (line for line in lines if not line.startswith("rockframe: warning: "))
    assert told in error
    assert not output.exists()


def test_verify_accepts_the_folder_after_recompute(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An option with an optional value takes the next word, here the folder."""
    assert run("verify", "--recompute", tmp_path / "gone") == 2
    assert "gone" in capsys.readouterr().err
    assert run("verify", "--recompute", "5") == 2
    assert "Folder of the run missing" in capsys.readouterr().err


def test_help_states_the_unit_of_a_velocity_not_that_of_its_last_letter(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        run("screen", "--help")
    assert "--limit-peak-impact-velocity-m-s M/S" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["ingset", "a.csv"], "unknown command 'ingset'. Did you mean ingest? See"),
        (["draw", "screen.nc"], "unknown command 'draw'. Did you mean figure? See"),
        (["plan", "a.toml"], "unknown command 'plan'. Did you mean run --plan? See"),
        (["ingest", "a.csv", "--xyzzy"], "unknown option --xyzzy. See"),
        (["ingest", "--", "--odd"], "arguments are required: --output/-o. See"),
        (
            ["ingest", "a.csv", "--ouput", "a.nc"],
            "unknown option --ouput. Did you mean --output? See",
        ),
        (["table", "--records", "a.nc", "--output", "d"], "See rockframe table --help."),
        (["table1", "--magnitude", "8", "6"], "See rockframe table1 --help."),
        (["ingest", "a.csv", "--magnitude", "8", "6", "--output", "a.nc"], "[8, 6]. The lower"),
    ],
)
def test_a_misspelt_word_is_named_with_the_word_meant_and_the_help_of_its_command(
    capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    with contextlib.suppress(SystemExit):
        assert run(*words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "said"),
    [("hight_m = 9.6", "Did you mean height_m?"), ("height_m = 9,6", "need a point, as in 9.6")],
)
def test_a_misspelt_key_and_a_decimal_comma_in_a_study_are_explained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, said: str
) -> None:
    frames = tmp_path / "frames.toml"
    frames.write_text(f'[[structure]]\nname = "a"\n{line}\nwidth_m = 1.6\nmass_ratio = 4.0\n')
    words = ("respond", "r.nc", "--structures", frames, "--output", tmp_path / "a.nc")
    assert run(*words) == 2
    assert said in capsys.readouterr().err
