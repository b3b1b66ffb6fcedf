"""Help texts: an example of each command that its parser takes, and where to read more."""

from __future__ import annotations

import shlex
from email.message import Message

import pytest
from tests.commands import commands

from rockframe.cli.main import EXAMPLES, main, parser


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
