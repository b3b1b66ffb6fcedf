"""Help texts: an example of each command that its parser takes, and where to read more."""

from __future__ import annotations

import re
import shlex
from email.message import Message

import pytest
from tests.commands import commands, options_of

from rockframe.cli.main import EXAMPLES, FIRST, main, parser


@pytest.mark.parametrize("command", [*commands()])
def test_the_help_of_a_command_ends_with_an_example_that_it_takes(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    printed = capsys.readouterr().out
    assert f"\nExample: {EXAMPLES[command]}\n" in printed
    words = shlex.split(EXAMPLES[command])
    assert words[:2] == ["rockframe", command]
    parser(command).parse_args(words[1:])


def first_group(help_text: str) -> list[str]:
    """Return the options of the first group of a help text, besides help and JSON."""
    (group,) = re.findall(r"\noptions:\n(.*?)\n\n(?:\S|$)", help_text, re.DOTALL)
    named = re.findall(r"^  (?:-\w, )?(--[a-z][\w-]*)", group, re.MULTILINE)
    return [name for name in named if name not in ("--help", "--json")]


@pytest.mark.parametrize("command", [*commands()])
def test_the_help_of_a_command_begins_with_at_most_ten_options(command: str) -> None:
    """Commands with more have them in a table, which names options that the command has."""
    whole = {name for action in options_of(command) for name in action.option_strings}
    listed = first_group(commands()[command].format_help())
    assert len(listed) <= 10
    assert {*FIRST.get(command, ())} <= whole
    assert sorted(FIRST.get(command, listed)) == sorted(listed)


def test_the_usage_of_a_command_with_many_options_names_what_must_be_stated() -> None:
    usage, *_ = commands()["screen"].format_help().splitlines()
    assert usage == "usage: rockframe screen [options] --output OUTPUT RECORDS ..."
    usage, *_ = commands()["ingest"].format_help().splitlines()
    assert usage == "usage: rockframe ingest [options] --output OUTPUT [PATH ...]"


def test_help_says_where_the_documentation_is_once_the_project_has_an_address(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for owner, printed in (("owner", False), ("somebody", True)):
        place = f"https://{owner}.github.io/rockframe"
        installed = Message()
        installed["Project-URL"] = "Source, https://github.com/somebody/rockframe"
        installed["Project-URL"] = f"Documentation, {place}"
        monkeypatch.setattr("importlib.metadata.metadata", {"rockframe": installed}.__getitem__)
        with pytest.raises(SystemExit, match="0"):
            main(["--help"])
        assert (f"Documentation: {place}" in capsys.readouterr().out) is printed
