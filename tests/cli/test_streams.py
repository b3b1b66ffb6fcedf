"""Closed or full streams, few open files, python -OO: one line and the right exit status."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands import run
from tests.runs import small

from rockframe.cli.main import _VERBS

FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
needs_sh = pytest.mark.skipif(sys.platform == "win32", reason="needs a shell of POSIX")
SAYS_SO = "rockframe: error: standard output: cannot be written: No space left on device.\n"

#: Commands that print something about a finished run; {0} is the folder that contains it.
OF_A_RUN = [
    "status {0}/run",
    "show {0}/run motion-0",
    "verify {0}/run",
    "run {0}/small.toml --output {0}/run",
    "run {0}/small.toml --output {0}/planned --plan",
    "table {0}/run/records.nc {0}/run/pulses.nc {0}/run/response.nc --output {0}/table.csv",
    "figure {0}/run/records.nc {0}/run/pulses.nc {0}/run/response.nc --output {0}/drawn",
    "report {0}/run --output {0}/page.html",
    "formats",
]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `run`."""
    home = tmp_path_factory.mktemp("streams")
    assert small.run(small.make_study(home, 1, small.FEW), home / "run") == 0
    return home


def shell(line: str, *words: str | Path, python: tuple[str, ...] = ()) -> tuple[int, str]:
    """Run a command where the shell line has `"$@"`; return its status and standard error."""
    command = [sys.executable, *python, "-m", "rockframe.cli.main", *map(str, words)]
    done = subprocess.run(["sh", "-c", line, "sh", *command], capture_output=True, text=True)
    return done.returncode, done.stderr


@needs_full
@pytest.mark.parametrize("verb", _VERBS)
def test_help_that_cannot_be_written_is_an_error(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with FULL.open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert run(verb, "--help") == 2
    assert capsys.readouterr().err == SAYS_SO


@needs_full
@pytest.mark.parametrize("command", OF_A_RUN)
def test_output_that_cannot_be_written_is_an_error(
    home: Path, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with FULL.open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert run(*command.format(home).split()) == 2
    assert capsys.readouterr().err.endswith(SAYS_SO)


@pytest.mark.parametrize("command", OF_A_RUN)
def test_closed_output_is_output_that_nobody_wants(
    home: Path, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A service may close the streams; the command still does its work."""
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    assert run(*command.format(home).split()) == 0
    sys.stdout.close()
    sys.stderr.close()


@needs_sh
@pytest.mark.parametrize(
    "closed",
    ["<&- >&- 2>&-", *(pytest.param(one, marks=pytest.mark.faults) for one in (">&-", "2>&-"))],
)
def test_closed_streams_reach_no_file_and_no_worker(motion: Path, closed: str) -> None:
    """The next file opened would get the descriptor of a closed stream, and its printed text."""
    output = motion.with_name("records.nc")
    words = ("ingest", motion, "--units", "g", "--time-step", "0.01", "--output", output)
    assert shell(f'exec "$@" {closed}', *words) == (0, "")
    assert output.is_file()


@needs_full
@pytest.mark.parametrize("full", ["2>/dev/full", ">/dev/full 2>/dev/full", "2>&-"])
def test_status_says_what_the_error_stream_cannot(full: str) -> None:
    assert shell(f'exec "$@" {full}', "status", "no-such-folder") == (2, "")


@needs_sh
def test_table_that_nobody_reads_to_its_end_is_no_error(tmp_path: Path) -> None:
    line = f'{{ "$@"; echo $? > {tmp_path}/status; }} | true'
    assert shell(f"sleep 0.1; {line}", "formats") == (0, "")
    assert (tmp_path / "status").read_text() == "0\n"


@needs_sh
def test_few_open_files_are_one_line(motion: Path) -> None:
    """Python itself needs five open files, and each worker three more."""
    words = ("ingest", motion, "--units", "g", "--time-step", "0.01", "--output", "records.nc")
    status, said = shell('ulimit -n 7; exec "$@"', *words)
    assert (status, said.count("\n")) == (2, 1)
    assert "Too many open files. Raise the limit of open files: ulimit -n 1024." in said


@needs_sh
@pytest.mark.parametrize("words", [("--help",), ("formats",), ("status", "no-such-folder")])
def test_python_without_docstrings(words: tuple[str, ...]) -> None:
    status, said = shell('"$@"', *words, python=("-OO",))
    assert status == (2 if words[0] == "status" else 0)
    assert "Traceback" not in said
