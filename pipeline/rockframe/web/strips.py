"""Strips over the scale of the motion, drawn in SVG for a page."""

from __future__ import annotations

import html
import math
from typing import Final, Protocol

#: Scales at the ends of a strip [1], and the width of the strip in units of the picture.
STRIP_ENDS: Final = (0.1, 10.0)
_WIDTH: Final = 240.0
_LEAST: Final = 1.2


class _Strip(Protocol):
    """The strip to draw: a `rockframe.rocking.Strip`."""

    @property
    def overturning(self) -> tuple[tuple[float, float], ...]: ...
    @property
    def robust(self) -> tuple[float, ...]: ...
    @property
    def words(self) -> str: ...


def strip_svg(strip: _Strip) -> str:
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
    told = html.escape(strip.words)
    return (
        f'<svg class="strip" viewBox="0 0 {_WIDTH:g} 17" preserveAspectRatio="none" role="img" '
        f'aria-label="{told}"><title>{told}</title>{"".join(parts)}</svg>'
    )


def _place(scale: float) -> float:
    """Return the distance of a scale from the left end, on a logarithmic axis."""
    low, high = map(math.log, STRIP_ENDS)
    return _WIDTH * min(max((math.log(scale) - low) / (high - low), 0.0), 1.0)


def _rect(name: str, x: float, y: float, width: float, height: float) -> str:
    return f'<rect class="{name}" x="{x:.1f}" y="{y:g}" width="{width:.1f}" height="{height:g}"/>'
