"""The page of the explorer: one HTML that asks nobody but its own server."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from rockframe.explorer.answer import Shaking
from rockframe.frame import RECTANGULAR, SECTIONS, RockingFrame, inertia_ratio_of
from rockframe.provenance import versions
from rockframe.web import UPLOT, environment, policy, script, style

_HOME: Final = Path(__file__).parent
#: The page's own script, in the order in which its parts need each other.
_PARTS: Final = ("settings", "main")


def render(shakings: Sequence[Shaking], frames: Sequence[RockingFrame]) -> tuple[str, str]:
    """Return the page and the policy it is sent with.

    Parameters
    ----------
    shakings : sequence of Shaking
        Records to choose.
    frames : sequence of RockingFrame
        Structures to begin with; the first is shown.
    """
    code, look = script(_HOME, _PARTS), style(_HOME)
    page = (
        environment(_HOME)
        .get_template("template.html")
        .render(
            script=Markup(code),  # noqa: S704 -- our own files, no text of a record
            style=Markup(look),  # noqa: S704
            plotter=UPLOT,
            version=versions()["rockframe"],
            facts={
                "records": [_record(shaking) for shaking in shakings],
                "structures": [_structure(frame) for frame in frames],
            },
        )
    )
    return page, policy(code, look, connect="'self'")


def _record(shaking: Shaking) -> dict[str, Any]:
    record = shaking.record
    place = "/".join(part for part in (record.station, record.component) if part)
    return {
        "id": record.record_id,
        "title": ", ".join(part for part in (record.event, place) if part),
        "duration": record.duration,
        "vertical": shaking.ground.vertical is not None,
    }


def _structure(frame: RockingFrame) -> dict[str, Any]:
    names = ("name", "height", "width", "mass_ratio", "restitution_factor")
    return {**{name: getattr(frame, name) for name in names}, "section": _section(frame)}


def _section(frame: RockingFrame) -> str:
    """The section that has the inertia of the frame; else that inertia itself."""
    if frame.inertia_ratio == RECTANGULAR:
        return SECTIONS[0]
    for section in SECTIONS[1:]:
        if frame.inertia_ratio == inertia_ratio_of(section, frame.height, frame.width):
            return section
    return repr(frame.inertia_ratio)
