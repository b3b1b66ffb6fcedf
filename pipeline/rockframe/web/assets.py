"""Script, style and policy of a page that holds all that it shows."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined

_HOME: Final = Path(__file__).parent
#: The shared part of a page's script, in the order in which its parts need each other.
_PARTS: Final = ("page", "frame", "plots", "player")
#: What draws the plots, as the foot of a page says it.
UPLOT: Final = "uPlot 1.6.32, © Leon Sorokin, MIT licence"


def environment(home: Path) -> Environment:
    """Return what renders the templates of a folder and the shared ones; all text is escaped."""
    return Environment(
        loader=FileSystemLoader([home, _HOME]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def script(home: Path, parts: Sequence[str]) -> str:
    """Return the script of a page: uPlot with its licence, the shared parts, and its own.

    Parameters
    ----------
    home : Path
        Folder of the page, with its own parts in ``script``.
    parts : sequence of str
        Names of its own parts, in the order in which they need each other.
    """
    # The licence goes with every copy, and each page is one.
    licence, drawing = (
        _read(_HOME, "vendor/uPlot.LICENSE"),
        _read(_HOME, "vendor/uPlot.iife.min.js"),
    )
    shared = [_read(_HOME, f"script/{name}.js") for name in _PARTS]
    own = [_read(home, f"script/{name}.js") for name in parts]
    body = "\n".join([*shared, *own])
    return f'/*\n{licence}*/\n{drawing}\n(() => {{\n"use strict";\n{body}}})();\n'


def style(home: Path) -> str:
    """Return the style of a page: that of uPlot, the shared one, and its own."""
    names = [(_HOME, "vendor/uPlot.min.css"), (_HOME, "style.css"), (home, "style.css")]
    return "\n".join(_read(folder, name) for folder, name in names)


def policy(script: str, style: str, connect: str | None = None) -> str:
    """Return the Content-Security-Policy of a page.

    Parameters
    ----------
    script, style : str
        The only ones that may run; they are named by their hash.
    connect : str, optional
        Whom its script may ask; without it nobody: nothing is loaded from anywhere.

    Examples
    --------
    >>> policy("", "").split("; ")[0]
    "default-src 'none'"
    """
    rules = [
        "default-src 'none'",
        f"script-src '{_hash(script)}'",
        f"style-src '{_hash(style)}'",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    return "; ".join(rules if connect is None else [*rules, f"connect-src {connect}"])


def _read(folder: Path, name: str) -> str:
    return (folder / name).read_text(encoding="utf-8")


def _hash(content: str) -> str:
    digest = hashlib.sha256(content.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"
