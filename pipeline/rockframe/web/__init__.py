"""Self-contained HTML pages from templates, and the pictures of strips and bars in them.

uPlot, in `vendor`, draws the plots.
"""

from __future__ import annotations

import base64
import hashlib
import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import starmap
from pathlib import Path
from typing import Any, Final

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from rockframe.cells import plain, plain_values
from rockframe.frame import unusual
from rockframe.provenance import package_versions
from rockframe.rocking import MARGIN_LEGEND, VERDICT_RULE, SpreadVerdict, Strip

_HOME: Final = Path(__file__).parent
#: Shared parts of the script; each may use those before it.
_PARTS: Final = ("page", "frame", "plots", "player")


def drawn_shape(values: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Return the geometry of a structure for its drawing, and what is unusual of it, in words.

    Parameters
    ----------
    values : mapping of str to value
        Properties of the structure by name; a finite ``spacing`` means two columns that differ.

    Examples
    --------
    >>> drawn_shape({"height": 9.6, "width": 1.6, "mass_ratio": 60.0, "slenderness": 0.165})[1]
    'mass_ratio 60 is above 50'
    """
    if math.isnan(values.get("spacing", math.nan)):
        wanted = ("height", "width", "top_contact_width", "mass_ratio", "slenderness")
        shape = {name: values[name] for name in wanted if name in values}
        return shape, unusual(*(shape[name] for name in ("height", "mass_ratio", "slenderness")))
    shape = {
        "heights": [values["height_left"], values["height_right"]],
        "widths": [values["width_left"], values["width_right"]],
        "balance": [values["balance_rotation_right"], values["balance_rotation_left"]],
        **{name: values[name] for name in ("spacing", "beam_depth", "beam_offset", "mass_ratio")},
    }
    least = min(shape["balance"])
    each = [unusual(height, shape["mass_ratio"], least) for height in shape["heights"]]
    return shape, "; ".join(dict.fromkeys(filter(None, each)))


def render_page(
    home: Path, parts: Sequence[str], *, connect: str | None = None, **content: Any
) -> tuple[str, str]:
    """Return a page and its Content-Security-Policy; all text of the content is plain and escaped.

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
    page = _template(home, "template.html").render(
        policy=rules,
        script=Markup(code),  # noqa: S704 -- our own files, no text of a record
        style=Markup(look),  # noqa: S704
        plotter="uPlot 1.6.32, © Leon Sorokin, MIT licence",
        rule=VERDICT_RULE,
        legend=MARGIN_LEGEND,
        version=package_versions()["rockframe"],
        **_plain(content),
    )
    return page, rules


def render_still(home: Path, template: str, **content: Any) -> str:
    """Return a page without scripts; all text of the content is plain and escaped.

    Parameters
    ----------
    home : Path
        Folder of the template, and of its ``style.css``.
    template : str
        Name of the template.
    **content
        Values that the template shows.
    """
    look = _style(home)
    return _template(home, template).render(
        policy=policy("", look, images=bool(content.get("logo"))),
        style=Markup(look),  # noqa: S704 -- our own file
        version=package_versions()["rockframe"],
        **_plain(content),
    )


def _plain(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a page with plain facts, which become JSON; others pass `finalize`."""
    return {key: plain_values(part) if key == "facts" else part for key, part in content.items()}


def _shown(value: Any) -> Any:
    """Return a value as a template writes it: texts are plain, unless they are our own pictures."""
    return plain(value) if isinstance(value, str) and not isinstance(value, Markup) else value


@cache
def _template(home: Path, name: str) -> Template:
    environment = Environment(
        loader=FileSystemLoader([home, _HOME]),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    # browsers refuse NaN in JSON, and then show an empty page
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "allow_nan": False}
    return environment.get_template(name)


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


def policy(script: str, style: str, connect: str | None = None, *, images: bool = False) -> str:
    """Return the Content-Security-Policy of a page.

    Parameters
    ----------
    script, style : str
        The only script and style that are allowed, identified by their hashes.
    connect : str, optional
        Address to which the script may send requests; by default none.
    images : bool
        The page has pictures of its own, which are part of it.

    Examples
    --------
    >>> policy("", "").split("; ")[0]
    "default-src 'none'"
    """
    rules = [
        "default-src 'none'",
        f"script-src '{_hash(script)}'",
        f"style-src '{_hash(style)}'",
        *(["img-src data:"] if images else []),
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
#: Scales at the ticks of a strip [1]; `strip.html` and the table of results write them.
_TICKS: Final = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_LEAST: Final = 1.2


def tone(verdict: SpreadVerdict) -> str:
    """Return the class of a verdict's colour in the style sheets, one of eleven by its danger, or
    that of responses that were not computed.

    Examples
    --------
    >>> from rockframe.rocking import Verdict
    >>> tone(SpreadVerdict(Verdict.STANDS, share_overturned=0.02, robust_scale=1.06))
    'tone-5'
    """
    return f"tone-{round(10.0 * verdict.danger)}" if verdict.is_computed else "toneless"


#: Classes of the parts of a strip: below the scale of 10 %, and above those of 10, 25 and 50 %.
_SHARES: Final = ("strip-0", "strip-10", "strip-25", "strip-50")


def strip_svg(strip: Strip) -> str:
    """Return a strip as SVG: the share that overturns at each scale, and below it the scales that
    overturn the structure as given. Scales that were not computed are hatched in both.
    """
    parts = []
    for reached, low, high in strip.shares_between(*STRIP_ENDS):
        start, end = _place(low), _place(high)
        parts.append(
            _hatched(start, end, 0.0, 11.0)
            if reached is None
            else _rect(_SHARES[reached], start, 0.0, end - start, 11.0)
        )
    if unknown := strip.nominal_unknown(STRIP_ENDS[1]):
        parts.append(_hatched(_place(unknown[0]), _place(unknown[1]), 13.0, 4.0))
    for low, high in strip.overturning:
        start = _place(low)
        parts.append(_rect("strip-falls", start, 13.0, max(_place(high) - start, _LEAST), 4.0))
    ticks = "".join(f"M{_place(scale):.1f} 11v2" for scale in _TICKS)
    parts.append(f'<path class="strip-tick" d="{ticks}"/>')
    middle = _place(1.0)
    parts.append(f'<path class="strip-one" d="M{middle:g} 0V17"/>')
    beyond = strip.largest_scale < STRIP_ENDS[1]
    words = strip.words + f"; not computed above {strip.largest_scale:.3g}" * beyond
    words = html.escape(words)
    return (
        f'<svg class="strip" viewBox="0 0 {_WIDTH:g} 17" preserveAspectRatio="none" role="img" '
        f'aria-label="{words}"><title>{words}</title>{"".join(parts)}</svg>'
    )


#: Number of points of a path in plan, and its extent [units of the picture].
_POINTS: Final = 1500
_EXTENT: Final = 100.0


def path_svg(u_x: NDArray[np.float64], u_y: NDArray[np.float64]) -> str:
    """Return the path of the deck, seen from above, as SVG; "" if it does not move.

    Parameters
    ----------
    u_x, u_y : array, shape (samples,)
        Displacement from the ground along both components of the motion [m]; NaN after overturning.
    """
    moved = np.flatnonzero(np.hypot(u_x, u_y) > 0.0)
    if not moved.size:
        return ""
    x, y = (one[moved[0] : moved[-1] + 1] for one in (u_x, u_y))
    every = max(1, x.size // _POINTS)
    reach = float(np.nanmax(np.hypot(x, y)))
    points = _EXTENT / reach * np.column_stack([x, -y])[::every]
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in points.tolist())
    words = f"Path of the deck seen from above; the circle has a radius of {100.0 * reach:.1f} cm"
    side = _EXTENT + 4.0
    box = f"{-side:g} {-side:g} {2 * side:g} {2 * side:g}"
    return (
        f'<svg class="deck-path" viewBox="{box}" role="img" '
        f'aria-label="{words}"><title>{words}</title><circle class="deck-reach" r="{_EXTENT:g}"/>'
        f'<path class="deck-axes" d="M{-side:g} 0H{side:g}M0 {-side:g}V{side:g}"/>'
        f'<polyline class="deck-line" points="{line}"/><circle class="deck-rest" r="2.5"/></svg>'
    )


#: Rotation over slenderness up to which the path of the deck is drawn.
_DRAWN_TO: Final = 1.3


def deck_path(
    theta: NDArray[np.float64],
    u_x: NDArray[np.float64],
    u_y: NDArray[np.float64],
    slenderness: float,
) -> str:
    """Return `path_svg` of the deck until it falls.

    Parameters
    ----------
    theta, u_x, u_y : array, shape (samples,)
        Tilt [rad], and displacement along both components of the motion [m].
    slenderness : float
        Slenderness of the frame [rad].
    """
    stands = theta <= _DRAWN_TO * slenderness
    return path_svg(*(np.where(stands, component, np.nan) for component in (u_x, u_y)))


def _place(scale: float) -> float:
    """Return the distance of a scale from the left end, on a logarithmic axis."""
    low, high = map(math.log, STRIP_ENDS)
    place = (math.log(scale) - low) / (high - low) if scale > 0.0 else 0.0
    return _WIDTH * min(max(place, 0.0), 1.0)


def _rect(name: str, x: float, y: float, width: float, height: float) -> str:
    return f'<rect class="{name}" x="{x:.1f}" y="{y:g}" width="{width:.1f}" height="{height:g}"/>'


#: Distance of the lines of a hatching [units of the picture].
_HATCH: Final = 4.0


def _hatched(start: float, end: float, y: float, height: float) -> str:
    """Return a part that was not computed: an outline with upright lines."""
    count = math.ceil((end - start) / _HATCH)
    lines = "".join(f"M{start + _HATCH * k:.1f} {y:g}v{height:g}" for k in range(1, count))
    hatch = f'<path class="strip-hatch" d="{lines}"/>' if lines else ""
    return _rect("strip-unknown", start, y, end - start, height) + hatch


#: Height of a bar with its label, middle of the bars and half their width [units of the picture].
_BAR: Final = 14.0
_MIDDLE: Final = 150.0
_HALF: Final = 80.0


def bars_svg(values: Mapping[str, float], chance: float, most: str, words: str) -> str:
    """Return rank correlations as SVG: one bar each, from -1 to 1; none for unknown values.

    Parameters
    ----------
    values : mapping of str to float
        Values by their labels; NaN if unknown.
    chance : float
        Value that dotted lines mark, up and down.
    most : str
        Label of the bar that is marked.
    words : str
        The picture in words.
    """
    parts = []
    for place, (label, value) in enumerate(values.items()):
        y = _BAR * place
        base = y + 0.7 * _BAR
        parts.append(f'<text x="62" y="{base:g}" text-anchor="end">{html.escape(label)}</text>')
        if math.isfinite(value):
            name = "bar-most" if label == most else "bar"
            start, length = _MIDDLE + min(value, 0.0) * _HALF, abs(value) * _HALF
            parts.append(_rect(name, start, y + 2.0, length, _BAR - 4.0))
    height = _BAR * len(values)
    left = min(0.0, 62.0 - 5.5 * max(map(len, values), default=0))  # of the longest label
    for chance_line in (-chance, chance):
        parts.append(
            f'<path class="bar-chance" d="M{_MIDDLE + chance_line * _HALF:.1f} 0V{height:g}"/>'
        )
    parts.append(f'<path class="bar-zero" d="M{_MIDDLE:g} 0V{height:g}"/>')
    said = html.escape(words)
    return (
        f'<svg class="bars" viewBox="{left:g} 0 {_WIDTH - left:g} {height:g}" role="img" '
        f'aria-label="{said}"><title>{said}</title>{"".join(parts)}</svg>'
    )


#: Width and height of the plotting area of a curve [units of the picture].
PLOT_SIZE: Final = (300, 130)


@dataclass(frozen=True)
class Plot:
    """A plot of probabilities, as paths of SVG.

    `title`, `low` and `high` state the quantity and the ends of its axis. Each curve has a name and
    a path, the path of its confidence band or "", and the centres of its observed shares. `median`
    is the place of the median of the first curve.
    """

    title: str
    low: str
    high: str
    curves: tuple[tuple[str, str], ...]
    bands: tuple[str, ...] = ()
    points: tuple[tuple[tuple[float, float], ...], ...] = ()
    median: float | None = None


def plot_path(x: ArrayLike, y: ArrayLike) -> str:
    """Return the path through points from 0 to 1; "" without a curve."""
    points: NDArray[np.float64] = np.stack([np.asarray(x), np.asarray(y)], axis=1)
    if not np.isfinite(points).all():
        return ""
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in starmap(plot_place, points.tolist()))


def plot_place(x: float, y: float) -> tuple[float, float]:
    """Return the place of a point from 0 to 1 in units of the picture."""
    return round(PLOT_SIZE[0] * x, 1), round(PLOT_SIZE[1] * (1.0 - y), 1)
