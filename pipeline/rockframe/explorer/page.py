"""The HTML page of the explorer, which sends requests only to its own server."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from rockframe.column import RECTANGULAR, SECTIONS, inertia_ratio_of
from rockframe.explorer.answer import Motion
from rockframe.frame import RockingFrame
from rockframe.provenance import versions
from rockframe.rocking.stated_verdict import MARGIN_LEGEND, VERDICT_RULE
from rockframe.web.assets import UPLOT, environment, policy, script, style

_HOME: Final = Path(__file__).parent
#: Parts of the page's own script; each may use those before it.
_PARTS: Final = ("settings", "main")


def render(motions: Sequence[Motion], frames: Sequence[RockingFrame]) -> tuple[str, str]:
    """Return the page and its Content-Security-Policy.

    Parameters
    ----------
    motions : sequence of Motion
        Records to choose from.
    frames : sequence of RockingFrame
        Structures to choose from; the first is shown.
    """
    code, look = script(_HOME, _PARTS), style(_HOME)
    page = (
        environment(_HOME)
        .get_template("template.html")
        .render(
            script=Markup(code),  # noqa: S704 -- our own files, no text of a record
            style=Markup(look),  # noqa: S704
            plotter=UPLOT,
            rule=VERDICT_RULE,
            legend=MARGIN_LEGEND,
            version=versions()["rockframe"],
            facts={
                "records": [_record(motion) for motion in motions],
                "structures": [_structure(frame) for frame in frames],
            },
        )
    )
    return page, policy(code, look, connect="'self'")


def _record(motion: Motion) -> dict[str, Any]:
    record = motion.record
    place = "/".join(part for part in (record.station, record.component) if part)
    return {
        "id": record.record_id,
        "title": ", ".join(part for part in (record.event, place) if part),
        "duration": record.duration,
        "vertical": motion.ground.vertical is not None,
    }


def _structure(frame: RockingFrame) -> dict[str, Any]:
    names = ("name", "height", "width", "mass_ratio", "restitution_factor")
    return {**{name: getattr(frame, name) for name in names}, "section": _section(frame)}


def _section(frame: RockingFrame) -> str:
    """Return the section with the inertia of the frame; if there is none, the inertia ratio."""
    if frame.inertia_ratio == RECTANGULAR:
        return SECTIONS[0]
    for section in SECTIONS[1:]:
        if frame.inertia_ratio == inertia_ratio_of(section, frame.height, frame.width):
            return section
    return repr(frame.inertia_ratio)
