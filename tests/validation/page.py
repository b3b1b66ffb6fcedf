"""Tables of docs/validation.md, written between their two comments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).resolve().parents[2] / "docs"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_page(found: dict[str, str], path: Path) -> None:
    """Replace the tables of the page, each between its two comments."""
    text = path.read_text(encoding="utf-8")
    for name, rows in found.items():
        start, end = f"<!-- table {name} -->", f"<!-- end of {name} -->"
        if start in text:
            before, rest = text.split(start)
            text = before + f"{start}\n\n{rows}\n\n{end}" + rest.split(end)[1]
    path.write_text(text, encoding="utf-8")
