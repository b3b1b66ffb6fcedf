"""The Tab key: what a shell shows for the words typed so far, and the code that asks for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rockframe.cli.main import _VERBS, SHELLS, main

RUN = "from rockframe.cli.main import main; main()"


def completed(line: str, folder: Path) -> list[str]:
    """Return what the command answers to a shell that completes a line."""
    answer = folder / "answer"
    asked = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
    }
    subprocess.run([sys.executable, "-c", RUN], cwd=folder, env=os.environ | asked, check=True)
    return [word.strip() for word in answer.read_text(encoding="utf-8").split("\n")]


def test_commands_options_choices_and_files_are_completed(tmp_path: Path) -> None:
    (tmp_path / "motion.csv").touch()
    assert completed("rockframe scr", tmp_path) == ["screen"]
    assert completed("rockframe respond --margins ", tmp_path) == ["none", "first", "robust"]
    assert completed("rockframe respond --marg", tmp_path) == ["--margins"]
    assert completed("rockframe ingest mot", tmp_path) == ["motion.csv"]
    assert completed("rockframe figure moment", tmp_path) == ["moment-rotation"]
    (tmp_path / "screen.nc").touch()
    assert completed("rockframe figure scr", tmp_path) == ["screen.nc"]
    assert set(completed("rockframe ", tmp_path)) >= {*_VERBS}


@pytest.mark.parametrize("shell", SHELLS)
def test_the_code_for_a_shell_names_the_command(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--completion", shell])
    printed = capsys.readouterr().out
    assert "rockframe" in printed
    assert ("complete --command rockframe" if shell == "fish" else "compdef") in printed


def test_another_shell_is_an_error_of_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["--completion", "csh"])
    assert "invalid choice: 'csh'" in capsys.readouterr().err
