"""Self-contained HTML pages from templates, and the strip of a margin as a picture.

uPlot, in `vendor`, draws the plots.
"""

from __future__ import annotations

import base64
import hashlib
import html
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from rockframe.provenance import versions
from rockframe.rocking import MARGIN_LEGEND, VERDICT_RULE, Strip

_HOME: Final = Path(__file__).parent
#: Shared parts of the script; each may use those before it.
_PARTS: Final = ("page", "frame", "plots", "player")


def render_page(
    home: Path, parts: Sequence[str], *, connect: str | None = None, **content: Any
) -> tuple[str, str]:
    """Return a page and its Content-Security-Policy; all text of the content is escaped.

    Parameters
    ----------
    home : Path
        Folder of the page, with its ``template.html`` and ``style.css``, and its own parts of the
        script in ``script``.
    parts : sequence of str
        Names of its own parts of the script; each may use those before it.
    connect : str, optional
        Address to which the script may send requests; by default none.
    **content
        Other values that the template shows.
    """
    code, look = _script(home, parts), _style(home)
    rules = policy(code, look, connect)
    environment = Environment(
        loader=FileSystemLoader([home, _HOME]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    page = environment.get_template("template.html").render(
        policy=rules,
        script=Markup(code),  # noqa: S704 -- our own files, no text of a record
        style=Markup(look),  # noqa: S704
        plotter="uPlot 1.6.32, © Leon Sorokin, MIT licence",
        rule=VERDICT_RULE,
        legend=MARGIN_LEGEND,
        version=versions()["rockframe"],
        **content,
    )
    return page, rules


def _script(home: Path, parts: Sequence[str]) -> str:
    """Return the script of a page: uPlot with its licence, the shared parts, and its own."""
    # The licence must accompany every copy, so each page includes it.
    licence = _read(_HOME, "vendor/uPlot.LICENSE")
    drawing = _read(_HOME, "vendor/uPlot.iife.min.js")
    shared = [_read(_HOME, f"script/{name}.js") for name in _PARTS]
    own = [_read(home, f"script/{name}.js") for name in parts]
    body = "\n".join([*shared, *own])
    return f'/*\n{licence}*/\n{drawing}\n(() => {{\n"use strict";\n{body}}})();\n'


def _style(home: Path) -> str:
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


#: Scales at the ends of a strip [1], and the width of the strip in units of the picture.
STRIP_ENDS: Final = (0.1, 10.0)
_WIDTH: Final = 240.0
_LEAST: Final = 1.2


def strip_svg(strip: Strip) -> str:
    """Return a strip as SVG: the scales that overturn, and below them the robust margin."""
    robust = strip.robust
    parts = [f'<rect class="strip-stands" width="{_WIDTH:g}" height="10"/>']
    for low, high in strip.overturning:
        start = _place(low)
        width = max(_place(high) - start, _LEAST)
        parts.append(_rect("strip-falls", start, 0.0, width, 10.0))
    known = [_place(one) for one in robust if not math.isnan(one)]
    if known:
        end = known[-1] if len(known) == len(robust) else _WIDTH
        parts.append(_rect("strip-robust", known[0], 13.0, max(end - known[0], _LEAST), 2.0))
        parts += [_rect("strip-robust", one - 0.6, 11.5, 1.2, 5.0) for one in known]
    middle = _place(1.0)
    parts.append(f'<path class="strip-one" d="M{middle:g} 0V17"/>')
    words = html.escape(strip.words)
    return (
        f'<svg class="strip" viewBox="0 0 {_WIDTH:g} 17" preserveAspectRatio="none" role="img" '
        f'aria-label="{words}"><title>{words}</title>{"".join(parts)}</svg>'
    )


def _place(scale: float) -> float:
    """Return the distance of a scale from the left end, on a logarithmic axis."""
    low, high = map(math.log, STRIP_ENDS)
    return _WIDTH * min(max((math.log(scale) - low) / (high - low), 0.0), 1.0)


def _rect(name: str, x: float, y: float, width: float, height: float) -> str:
    return f'<rect class="{name}" x="{x:.1f}" y="{y:g}" width="{width:.1f}" height="{height:g}"/>'
