"""Search for examples in a page, and comparison of their output."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Final

import pytest

from rockframe.cli.main import parser

from .blocks import blocks, missing

#: How-tos whose examples CI runs.
FIRST_HOW_TOS: Final = ("structures", "forces", "compare")

PAGE = """# A page

```sh
true
```
<!-- file: mine.toml -->
```toml
name = "mine"
```
<!-- before: touch
here -->
<!-- columns: 100 -->
<!-- picture: docs/a.png outputs/b.png -->
1. in a list
   <!-- exit: 2 -->
   ```sh
   false
   ```
"""


def test_blocks_come_with_their_marks() -> None:
    found = [(block.kind, block.body, block.marks) for block in blocks(PAGE)]
    assert found == [
        ("sh", "true\n", {}),
        ("toml", 'name = "mine"\n', {"file": "mine.toml"}),
        ("sh", "touch\nhere", {}),
        ("columns", "100", {}),
        ("picture", "docs/a.png outputs/b.png", {}),
        ("sh", "false\n", {"exit": "2"}),
    ]


def test_lines_are_compared_in_order() -> None:
    assert missing("a\n...\nc\n", "a \nb\nc\n") is None
    assert missing("c\na\n", "a\nb\nc\n") == "a"
    assert missing("2 of ... files\n", "2 of 30 files\n") is None
    assert missing("2 of 30\n", "2 of 30 files\n") == "2 of 30"


def test_each_question_has_a_command_that_there_is() -> None:
    """`parse_args` exits on a command or an option that does not exist."""
    page = Path(__file__).resolve().parents[2] / "docs" / "questions.md"
    found = re.findall(r"`(rockframe [^`]+)`", page.read_text(encoding="utf-8"))
    assert len(found) > 12
    for command in found:
        parser().parse_args(shlex.split(command)[1:])


@pytest.mark.parametrize(
    "page",
    ["README.md", "docs/tutorial.md", *(f"docs/howto/{one}.md" for one in FIRST_HOW_TOS)],
)
def test_printed_examples_of_the_first_pages_fit_their_page(page: str) -> None:
    text = (Path(__file__).parents[2] / page).read_text(encoding="utf-8")
    printed = [block.body for block in blocks(text) if block.kind == "text"]
    assert printed
    assert max(len(line) for body in printed for line in body.splitlines()) <= 100
