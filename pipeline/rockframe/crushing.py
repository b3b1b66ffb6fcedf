"""Frames whose columns rock on crushed edges."""

from __future__ import annotations

from dataclasses import replace

from rockframe.errors import invalid
from rockframe.frame import RockingFrame
from rockframe.restraint import Pivot
from rockframe.units import GRAVITY


def crushed(frame: RockingFrame, pivot: Pivot) -> RockingFrame:
    """Return the frame on its pivots after the edges of the columns have crushed.

    A block of uniform stress carries the column, its share of the beam, and the tendon. The pivot
    moves inwards by half the length of this block. The force of the tendon is taken at |theta|
    equal to the slenderness on the new pivots, so both are found by iteration. The force of
    dissipaters is not added. Their lever arm becomes shorter by the mean of the moves at base and
    top, so the moments of yielding bars are exact; their stiffness is too small by the square of
    half the difference of these moves, over that of the lever arm. The given frame is stored in
    `before_crushing` of the result.

    Raises
    ------
    ParameterError
        If there is no column_mass, the block is longer than half the column, or a pivot moves past
        the dissipaters.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3)
    >>> round(crushed(bent, Pivot(compressive_strength=30e6, depth=1.4)).width, 3)
    1.544
    """
    owner = f"frame {frame.name!r}"
    if frame.column_mass is None:
        raise invalid("column_mass", None, owner, "stated together with a pivot")
    weight = frame.column_mass * GRAVITY
    found, tension = frame, 0.0
    for _ in range(50):
        base = pivot.inset((1.0 + frame.mass_ratio) * weight + tension)
        top = pivot.inset(frame.mass_ratio * weight + tension)
        over = max(4.0 * base / frame.width, 4.0 * top / frame.top_contact_width)
        if over > 1.0:
            strength = pivot.compressive_strength
            narrowest = min(frame.width, frame.top_contact_width)
            over += 4.0 * pivot.inset(frame.tension(frame.slenderness) - tension) / narrowest
            enough = 1.006 * over * strength  # so that three digits are not rounded below it
            needed = f"its block of {2.0 * base:.3g} m is longer than half the width"
            allowed = f"larger; {enough:.3g} Pa is enough at this depth: {needed}"
            raise invalid("compressive_strength", strength, f"the pivot of {owner}", allowed)
        found = _on_pivots(frame, base, top)
        before, tension = tension, found.tension(found.slenderness)
        if abs(tension - before) <= 1e-12 * weight:
            break
    return found


def _on_pivots(frame: RockingFrame, base: float, top: float) -> RockingFrame:
    """Return the same columns on pivots moved inwards [m], with inertia and levers about these."""
    width, top_width = frame.width - 2.0 * base, frame.top_contact_width - 2.0 * top
    central = (frame.inertia_ratio - 1.0) * frame.size**2
    bars = frame.dissipater
    if bars is not None:
        moved = 0.5 * (base + top) if frame.joints > 1.0 else base
        if bars.lever_arm <= moved:
            allowed = f"above {moved:.3g} m, by which the pivots of crushed edges move inwards"
            raise invalid("lever_arm", bars.lever_arm, "a dissipater", allowed)
        bars = replace(bars, lever_arm=bars.lever_arm - moved)
    return replace(
        frame,
        width=width,
        top_width=top_width,
        centre_of_gravity=frame.centre_height,
        inertia_ratio=1.0 + central / (frame.centre_height**2 + 0.25 * width**2),
        dissipater=bars,
        before_crushing=frame,
    )
