"""Script, style and security policy of a self-contained page."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined

_HOME: Final = Path(__file__).parent
#: Shared parts of the script; each may use those before it.
_PARTS: Final = ("page", "frame", "plots", "player")
#: The plotting library, as credited at the foot of a page.
UPLOT: Final = "uPlot 1.6.32, © Leon Sorokin, MIT licence"


def environment(home: Path) -> Environment:
    """Return a Jinja environment for a folder and the shared templates; all text is escaped."""
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
        Names of its own parts; each may use those before it.
    """
    # The licence must accompany every copy, so each page includes it.
    licence, drawing = (
        _read(_HOME, "vendor/uPlot.LICENSE"),
        _read(_HOME, "vendor/uPlot.iife.min.js"),
    )
    shared = [_read(_HOME, f"script/{name}.js") for name in _PARTS]
    own = [_read(home, f"script/{name}.js") for name in parts]
    body = "\n".join([*shared, *own])
    return f'/*\n{licence}*/\n{drawing}\n(() => {{\n"use strict";\n{body}}})();\n'


def style(home: Path) -> str:
    """Return the style of a page: uPlot's, the shared one, and its own."""
    names = [(_HOME, "vendor/uPlot.min.css"), (_HOME, "style.css"), (home, "style.css")]
    return "\n".join(_read(folder, name) for folder, name in names)


def policy(script: str, style: str, connect: str | None = None) -> str:
    """Return the Content-Security-Policy of a page.

    Parameters
    ----------
    script, style : str
        The only script and style that are allowed, identified by their hashes.
    connect : str, optional
        Address to which the script may send requests; by default none.

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
