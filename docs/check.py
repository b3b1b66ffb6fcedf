"""Check the built pages: every reference has a target, and every public name is described.

``python docs/check.py FOLDER``: internal references are followed; external references, which need a
network, are only checked for their form.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from generate import public_names

_TEXT_PAGES = ("genindex.html", "search.html")
_EXTERNAL = re.compile(r"https://[a-z0-9-]+(\.[a-z0-9-]+)+(:\d+)?(/[^\s]*)?")


@dataclass
class Page(HTMLParser):
    """References and targets of one page."""

    path: Path
    references: list[str] = field(default_factory=list)
    loaded: list[str] = field(default_factory=list)
    targets: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()
        self.feed(self.path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Record the references, loaded files and targets in a tag."""
        stated = {key: value for key, value in attrs if value}
        if "id" in stated:
            self.targets.add(stated["id"])
        if tag == "a" and "href" in stated:
            self.references.append(stated["href"])
        loading = {"script": "src", "img": "src", "link": "href", "iframe": "src"}
        if tag in loading and loading[tag] in stated and stated.get("rel") != "canonical":
            self.loaded.append(stated[loading[tag]])


def faults(folder: Path) -> tuple[int, int, list[str]]:
    """Return the numbers of pages and references, and the faults."""
    pages = {path.resolve(): Page(path) for path in sorted(folder.rglob("*.html"))}
    count, found = 0, []
    for path, page in pages.items():
        here = path.relative_to(folder.resolve())
        for reference in page.references + page.loaded:
            count += 1
            reason = _fault(reference, path, pages, loaded=reference in page.loaded)
            if reason:
                found.append(f"{here}: {reference}: {reason}")
    known = set().union(*(page.targets for page in pages.values()))
    found += [
        f"rockframe.{name}: has no place in the reference"
        for names in public_names().values()
        for name in names
        if f"rockframe.{name}" not in known
    ]
    return len(pages), count, found


def _fault(reference: str, path: Path, pages: dict[Path, Page], *, loaded: bool) -> str | None:
    parts = urlsplit(reference)
    if parts.scheme == "data":
        return None
    if parts.scheme or parts.netloc:
        if loaded:
            return "is loaded from elsewhere. Must be beside the pages."
        return None if _EXTERNAL.fullmatch(reference) else "Must be https://HOST/PATH."
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not target.is_file():
        return "no such file"
    if parts.fragment and target in pages and target.name not in _TEXT_PAGES:
        wanted = unquote(parts.fragment)
        return None if wanted in pages[target].targets | {""} else "no such place in the page"
    return None


def main() -> int:
    """Check a folder; return 1 if there are faults."""
    pages, references, found = faults(Path(sys.argv[1]))
    names = sum(map(len, public_names().values()))
    print(f"{pages} pages, {references} references, {names} public names, {len(found)} faults")
    for fault in found:
        print(fault, file=sys.stderr)
    return 1 if found or not pages else 0


if __name__ == "__main__":
    sys.exit(main())
