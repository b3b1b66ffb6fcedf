"""Examples in Markdown: blocks of shell, Python and TOML, and the output shown after them.

A fenced block of ``sh`` or ``python`` is run; a ``text`` block that follows it is what it prints.
Comments before a block give instructions that readers do not see:

- ``<!-- file: NAME -->``: the block is the content of that file;
- ``<!-- not run: REASON -->``: it is not run;
- ``<!-- exit: N -->``: the shell ends with that status;
- ``<!-- before: COMMANDS -->``: shell commands, run first;
- ``<!-- columns: N -->``: from here on, tables are printed for a terminal of this width;
- ``<!-- picture: SHOWN DRAWN -->``: the picture SHOWN of the repository is compared with the file
  DRAWN, which the commands before have drawn.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_PARTS = re.compile(
    r"<!-- (?P<mark>file|not run|exit|before|columns|picture):\s(?P<said>.*?)\s-->"
    r"|^(?P<indent> *)```(?P<kind>\w*)[^\n]*\n(?P<body>.*?)^(?P=indent)```$",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """One block of a page, with the instructions in the comments before it."""

    kind: str
    body: str
    line: int
    marks: dict[str, str]


def blocks(page: str) -> Iterator[Block]:
    """Yield the blocks of a page in their order."""
    marks: dict[str, str] = {}
    for part in _PARTS.finditer(page):
        line = page.count("\n", 0, part.start()) + 1
        if part["mark"] == "before":
            yield Block("sh", part["said"], line, {})
        elif part["mark"] in ("columns", "picture"):
            yield Block(part["mark"], part["said"], line, {})
        elif part["mark"]:
            marks[part["mark"]] = part["said"]
        else:
            indent = part["indent"]
            body = re.sub(rf"^{indent}", "", part["body"], flags=re.MULTILINE)
            yield Block(part["kind"], body, line, marks)
            marks = {}


def missing(shown: str, printed: str) -> str | None:
    """Return the first line that is shown but was not printed in this order, or None.

    ``...`` stands for anything, and the number of spaces does not count.
    """
    lines = iter([" ".join(line.split()) for line in printed.splitlines()])
    for wanted in (" ".join(line.split()) for line in shown.splitlines()):
        if wanted in ("", "..."):
            continue
        pattern = re.compile(".*".join(re.escape(part) for part in re.split(r" ?\.\.\. ?", wanted)))
        if not any(pattern.fullmatch(line) for line in lines):
            return wanted
    return None
