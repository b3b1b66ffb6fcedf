"""Round columns that wobble under both directions of a ground motion, as a moving picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rockframe.components import BothDirections
from rockframe.errors import ParameterError
from rockframe.figures.captioned import DRAWN_TO, PAGE_WIDTH, of_structure, styled, time_limits
from rockframe.figures.moving import (
    BEAM,
    GROUND,
    STONE,
    Moving,
    count_of,
    draw_animation,
    spacing_of,
    times_of,
)
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration
from rockframe.rocking.verdict import Verdict
from rockframe.signals.processing import integrate
from rockframe.unequal import UnequalBent
from rockframe.units import GRAVITY
from rockframe.wobbling import PairAcceleration, WobblingResponse, wobble

Float = NDArray[np.float64]

#: Points of a rim that are projected.
_RIM: Final = 48


def rims(frame: RockingFrame, theta: float, phi: float) -> Float:
    """Return points of the rims of a column that rolls, relative to the middle of its place.

    Parameters
    ----------
    frame : RockingFrame
        The frame; its widths are diameters.
    theta, phi : float
        Tilt, and its direction from x towards y [rad].

    Returns
    -------
    array, shape (2, points, 3)
        x, y and z of the rims at the base and at the top [m].

    Notes
    -----
    The column turns about the point of its base in the direction phi, which lies on the circle that
    the base covers at rest.
    """
    b, top = 0.5 * frame.width, 0.5 * frame.top_contact_width
    angle = np.linspace(0.0, 2.0 * math.pi, _RIM, endpoint=False)
    along = np.array([math.cos(phi), math.sin(phi), 0.0])
    across = np.array([-math.sin(phi), math.cos(phi), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    tilted_along = math.cos(theta) * along - math.sin(theta) * up
    tilted_up = math.sin(theta) * along + math.cos(theta) * up
    return np.stack(
        [
            np.outer(radius * np.cos(angle) - b, tilted_along)
            + np.outer(radius * np.sin(angle), across)
            + height * tilted_up
            + b * along
            for radius, height in ((b, 0.0), (top, frame.height))
        ]
    )


def outline(points: Float, across: int) -> Float:
    """Return the outline of points, shape (corners, 2), seen along y (``across`` 0) or along x."""
    flat = points.reshape(-1, 3)[:, [across, 2]]
    corners: Float = flat[ConvexHull(flat, qhull_options="QJ").vertices]
    return corners


def draw_rolling(
    motion: BothDirections,
    frame: RockingFrame,
    ground: PairAcceleration | None = None,
    *,
    spacing: float | None = None,
) -> Moving:
    """Draw the structure from two sides and in plan under both components of a motion.

    Parameters
    ----------
    motion : BothDirections
        The two components.
    frame : RockingFrame
        A frame with circular columns.
    ground : PairAcceleration, optional
        Motion of the ground, if it includes the vertical acceleration.
    spacing : float, optional
        Distance of the axes of neighbouring columns [m].

    Raises
    ------
    ParameterError
        If the frame is not computed for both directions.
    """
    shaking = ground or PairAcceleration.from_pair(motion)
    response = wobble(frame, shaking)
    frame, distance = response.frame, spacing_of(frame, spacing)
    states = [np.nan_to_num(x) for x in (response.theta, response.phi, response.u_x, response.u_y)]
    travel = [_travel(x, shaking.time_step) for x in (shaking.x, shaking.y)]
    low, high = time_limits(response.time, states[0] > 1e-3 * frame.slenderness, 1.0)
    if math.isfinite(response.overturning_time):
        high = min(high, response.overturning_time)
    shown = (response.time <= high) & (states[0] <= frame.slenderness)
    furthest = float(response.time[int(np.argmax(np.where(shown, states[0], 0.0)))])
    with styled():
        reaches = [
            _reach(frame, distance, side) + float(np.abs(travel[side]).max()) for side in (0, 1)
        ]
        figure, panels = _panels(shaking, response, (low, high), reaches)
        moves = [
            _side(panels[name], frame, distance, side, reaches[side])
            for side, name in enumerate("xy")
        ]
        path = _plan(panels["plan"], frame, *states[2:])
        marks = [panels[name].axvline(low, color="C3", linewidth=1.0) for name in _IN_TIME]

    def move(now: float) -> None:
        theta, phi, x, y = _at(now, response.time, states)
        for side, redraw in enumerate(moves):
            redraw(theta, phi, (x, y)[side], float(np.interp(now, response.time, travel[side])))
        path(now, response.time, x, y)
        for mark in marks:
            mark.set_xdata([now, now])
        title = f"{frame.name} under both components, {now:.2f} s"
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")

    with styled():
        move(furthest)
    names = f"{motion.first.record_id} (x) and {motion.second.record_id} (y)"
    caption = _caption(response, names)
    title = "The structure as it wobbles"
    return Moving(figure, title, caption, times_of(low, high), move)


def draw_either(
    motion: Record | BothDirections,
    frame: RockingFrame | UnequalBent,
    ground: GroundAcceleration | PairAcceleration | None = None,
) -> Moving:
    """Draw the structure under a record, as `draw_animation`, or under both directions.

    Raises
    ------
    ParameterError
        If the columns cannot rock in both directions.
    """
    if isinstance(motion, Record):
        return draw_animation(motion, frame, cast("GroundAcceleration | None", ground))
    if isinstance(frame, UnequalBent):
        raise ParameterError(
            f"Invalid motion in both directions of bent {frame.name!r}. Must be one record: "
            "columns that differ rock in one plane."
        )
    return draw_rolling(motion, frame, cast("PairAcceleration | None", ground))


#: Panels over time.
_IN_TIME: Final = ("ground", "tilt")


def _panels(
    shaking: PairAcceleration,
    response: WobblingResponse,
    limits: tuple[float, float],
    reaches: Sequence[float],
) -> tuple[Figure, dict[str, Axes]]:
    """Return the figure and its panels, with those over time drawn."""
    figure = Figure(figsize=(PAGE_WIDTH, 0.62 * PAGE_WIDTH), layout="constrained")
    panels = figure.subplot_mosaic(
        [["x", "y", "plan"], ["ground"] * 3, ["tilt"] * 3],
        height_ratios=[3.0, 0.8, 0.8],
        width_ratios=[*reaches, 0.7 * response.frame.height],
    )
    for samples, label in ((shaking.x, "x"), (shaking.y, "y")):
        panels["ground"].plot(response.time, samples / GRAVITY, linewidth=0.6, label=label)
    panels["ground"].set_ylabel("ground [g]")
    panels["ground"].legend(loc="upper right", ncols=2, fontsize=7)
    ratio = response.theta / response.frame.slenderness
    panels["tilt"].plot(response.time, ratio, linewidth=0.9)
    reach = min(max(1.1 * float(np.nanmax(ratio)), 0.01), DRAWN_TO)
    panels["tilt"].set(ylabel="θ/α", xlabel="time [s]", ylim=(0.0, reach))
    for name in _IN_TIME:
        panels[name].set_xlim(*limits)
    return figure, panels


def _caption(response: WobblingResponse, names: str) -> str:
    frame = response.frame
    drawn = f"{count_of(frame)} columns and the beam" if frame.mass_ratio else "The column"
    peak = f"largest θ/α {response.peak_rotation_ratio:.3f}, {response.verdict.label}"
    if response.verdict is Verdict.OVERTURNS:
        peak = f"overturns at {response.overturning_time:.2f} s"
    return (
        f"{drawn} to scale, seen along y and along x, with the ground, which moves by the "
        "displacement of the records; on the right the path of the beam relative to the ground, "
        f"seen from above; below, ground acceleration and tilt. {of_structure(frame)} "
        f"Records {names}: {peak}."
    )


def _travel(acceleration: Float, time_step: float) -> Float:
    return integrate(integrate(acceleration, time_step), time_step)


def _at(now: float, time: Float, states: Sequence[Float]) -> tuple[float, float, float, float]:
    """Return theta, phi, u_x and u_y at a time: the tilt is that of the nearest sample, because its
    direction turns by pi between two samples.
    """
    nearest = int(np.argmin(np.abs(time - now)))
    theta, phi, x, y = (float(values[nearest]) for values in states)
    return theta, phi, x, y


def _reach(frame: RockingFrame, spacing: float, side: int) -> float:
    """Return half the width of a view of the structure [m], without the travel of the ground."""
    return 0.7 * frame.height + (0.5 * spacing * (count_of(frame) - 1) if side == 0 else 0.0)


def _side(
    panel: Axes, frame: RockingFrame, spacing: float, side: int, half: float
) -> Callable[[float, float, float, float], None]:
    """Set up a view from a side; return the function that moves it.

    The columns stand side by side along x: seen along x there is one behind the other.
    """
    count = count_of(frame) if side == 0 else 1
    axes = spacing * (np.arange(count) - 0.5 * (count - 1))
    tall = (1.25 + (BEAM if frame.mass_ratio else 0.0)) * frame.height
    panel.set(xlim=(-half, half), ylim=(-0.1 * frame.height, tall), aspect="equal")
    panel.set_xlabel(("x [m]", "y [m]")[side])
    panel.grid(visible=False)
    shapes = [Polygon(np.zeros((4, 2)), **STONE) for _ in range(count + bool(frame.mass_ratio))]
    soil = Polygon(np.zeros((4, 2)), **GROUND)
    for shape in (*shapes, soil):
        panel.add_patch(shape)
    wide = axes[-1] + 0.8 * max(frame.width, frame.top_contact_width)

    def redraw(theta: float, phi: float, moved: float, ground: float) -> None:
        column = outline(rims(frame, theta, phi), side)
        for shape, axis in zip(shapes, axes, strict=False):
            shape.set_xy(column + np.array([axis + ground, 0.0]))
        if frame.mass_ratio:
            low = frame.height + float(frame.vertical_displacement(theta))
            edges = moved + ground + np.array([-wide, wide, wide, -wide])
            high = low + BEAM * frame.height
            shapes[-1].set_xy(np.stack([edges, [low, low, high, high]], axis=1))
        ends = ground + 0.94 * half * np.array([-1.0, 1.0, 1.0, -1.0])
        bottom = -0.1 * frame.height
        soil.set_xy(np.stack([ends, [bottom, bottom, 0.0, 0.0]], axis=1))

    return redraw


def _plan(
    panel: Axes, frame: RockingFrame, x: Float, y: Float
) -> Callable[[float, Float, float, float], None]:
    """Set up the path of the beam in plan [cm]; return the function that draws it up to a time."""
    fallen = float(frame.horizontal_displacement(DRAWN_TO * frame.slenderness))
    reach = 108.0 * min(float(np.hypot(x, y).max()) + 1e-3, fallen)
    panel.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    panel.set(xlabel="$u_x$ [cm]", ylabel="$u_y$ [cm]")
    (line,) = panel.plot([], [], linewidth=0.6)
    (dot,) = panel.plot([], [], "o", color="C3", markersize=4)

    def redraw(now: float, time: Float, at_x: float, at_y: float) -> None:
        passed: Any = time <= now
        line.set_data(100.0 * x[passed], 100.0 * y[passed])
        dot.set_data([100.0 * at_x], [100.0 * at_y])

    return redraw
