"""A structure that rocks, drawn to scale from the side: a still, or a moving picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from rockframe.cells import plain
from rockframe.errors import InputError
from rockframe.figures.captioned import (
    DRAWN_TO,
    PAGE_WIDTH,
    Captioned,
    caption_path,
    of_record,
    of_structure,
    styled,
    time_limits,
)
from rockframe.frame import RockingFrame
from rockframe.provenance import whole_file
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration, as_ground, respond
from rockframe.signals.processing import integrate
from rockframe.unequal import UnequalBent, bent_positions, respond_bent
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Formats of moving pictures, and the formats of the still of the same figure.
MOVING: Final = (".gif", ".apng", ".mp4")
#: Frames per second, and their largest number: a longer motion is drawn at fewer per second.
_PER_SECOND, _MOST_FRAMES = 12, 180
#: Resolution of moving pictures [dots per inch].
_DPI: Final = 90
#: Distance of the columns' axes, over the height and over the width of a column, whichever is more.
_SPACING: Final = (0.75, 2.5)
#: Depth of the drawn beam over the height of a column.
BEAM: Final = 0.12
#: Colours of stone and of the ground.
STONE: Final[dict[str, Any]] = {"facecolor": "#e6dfd0", "edgecolor": "#4f4738", "linewidth": 0.9}
GROUND: Final[dict[str, Any]] = {"facecolor": "#b9b4a8", "edgecolor": "#4f4738", "hatch": "///"}


@dataclass(frozen=True, eq=False)
class Moving(Captioned):
    """A figure that moves, as a still at its largest rotation.

    Parameters
    ----------
    times : array, shape (frames,)
        Times of the frames [s].
    move : callable
        Moves the figure to a time [s].
    """

    times: Float
    move: Callable[[float], object]


def outlines(frame: RockingFrame, theta: float, spacing: float) -> tuple[list[Float], Float | None]:
    """Return the corners of all columns, or of two where no number is stated, and of their beam.

    Parameters
    ----------
    frame : RockingFrame
        The frame; without a beam there is one column.
    theta : float
        Rotation [rad], positive to the right.
    spacing : float
        Distance of the axes of neighbouring columns [m].

    Returns
    -------
    columns : list of array, shape (4, 2)
        Corners of each column relative to the ground [m], from the left at the base.
    beam : array of shape (4, 2) or None
        Corners of the beam.

    Notes
    -----
    A column turns about its right corner if theta is positive. Its left upper corner, which carries
    the beam, then moves by u and v of (7) and (10).
    """
    b, top, height = 0.5 * frame.width, 0.5 * frame.top_contact_width, frame.height
    side = math.copysign(1.0, theta)
    corners = np.array([[-b, 0.0], [b, 0.0], [top, height], [-top, height]])
    turned = _turned(corners, np.array([side * b, 0.0]), theta)
    if frame.mass_ratio == 0.0:
        return [turned], None
    axes = spacing * (np.arange(count_of(frame)) - 0.5 * (count_of(frame) - 1))
    carrying = 3 if side > 0.0 else 2
    moved = turned[carrying] - corners[carrying]
    half, depth = axes[-1] + 1.6 * max(b, top), BEAM * height
    beam = np.array([[-half, 0.0], [half, 0.0], [half, depth], [-half, depth]])
    columns = [turned + np.array([x, 0.0]) for x in axes]
    return columns, beam + np.array([0.0, height]) + moved


def bent_outlines(bent: UnequalBent, theta: float) -> tuple[list[Float], Float]:
    """Return the corners of both columns and of the beam of a bent, as `outlines`.

    The bases stand on two levels; the lower one is at 0. The beam turns about the top corner of the
    left column that carries it.
    """
    at, side, tall = bent_positions(bent, theta), math.copysign(1.0, theta), max(bent.heights)
    columns = []
    for k, turned in enumerate((theta, float(at.theta_2))):
        half, height = 0.5 * bent.widths[k], bent.heights[k]
        rest = np.array([[-half, 0.0], [half, 0.0], [half, height], [-half, height]])
        rest += [(k - 0.5) * bent.spacing, tall - height]
        columns.append(_turned(rest, rest[1 if side > 0.0 else 0], turned))
    carrying = 3 if side > 0.0 else 2
    corner = np.array([-0.5 * (bent.spacing + side * bent.widths[0]), tall])
    half = 0.5 * bent.spacing + 0.8 * max(bent.widths)
    depth = bent.beam_depth or BEAM * tall
    beam = np.array([[-half, tall], [half, tall], [half, tall + depth], [-half, tall + depth]])
    moved = columns[0][carrying] - corner
    return columns, _turned(beam, corner, float(at.psi)) + moved


def _turned(corners: Float, pivot: Float, theta: float) -> Float:
    """Return corners that are turned clockwise about a point."""
    turn = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    return np.asarray((corners - pivot) @ turn.T + pivot)


def count_of(frame: RockingFrame | UnequalBent) -> int:
    """Return the number of columns that are drawn."""
    if isinstance(frame, UnequalBent):
        return 2
    return frame.columns or (1 if frame.mass_ratio == 0.0 else 2)


def spacing_of(frame: RockingFrame | UnequalBent, spacing: float | None) -> float:
    """Return the distance of the axes of neighbouring columns that are drawn [m]."""
    if isinstance(frame, UnequalBent):
        return frame.spacing
    return spacing or max(_SPACING[0] * frame.height, _SPACING[1] * frame.width)


def times_of(low: float, high: float) -> Float:
    """Return the times of the pictures between two times [s]."""
    return np.linspace(low, high, max(2, min(_MOST_FRAMES, math.ceil(_PER_SECOND * (high - low)))))


def draw_animation(
    record: Record,
    frame: RockingFrame | UnequalBent,
    motion: GroundAcceleration | None = None,
    *,
    spacing: float | None = None,
) -> Moving:
    """Draw the structure to scale under a record, with the ground and the rotation.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame or UnequalBent
        The frame, or two columns that differ.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes the vertical acceleration.
    spacing : float, optional
        Distance of the axes of neighbouring columns of a frame [m]; by default three quarters of
        the height, or two and a half widths.
    """
    ground = as_ground(motion or record)
    response = history_of(frame, ground)
    distance = spacing_of(frame, spacing)
    time = np.asarray(response.time)
    theta = np.nan_to_num(np.asarray(response.theta), nan=0.0)
    ratio = over_balance(frame, theta)
    samples = record.time_step * np.arange(record.acceleration.size)
    velocity = integrate(record.acceleration, record.time_step)
    travel = integrate(velocity, record.time_step)
    low, high = time_limits(time, np.abs(ratio) > 1e-3, 1.0)
    if math.isfinite(response.overturning_time):
        high = min(high, response.overturning_time + 1.0)
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 0.72 * PAGE_WIDTH), layout="constrained")
        scene, below, last = figure.subplots(3, 1, height_ratios=[3.0, 0.8, 0.8])
        shapes = _scene(scene, frame, distance, float(np.abs(travel).max()))
        below.plot(samples, record.acceleration / GRAVITY, color="0.45", linewidth=0.7)
        below.set_ylabel("ground [g]")
        last.plot(time, ratio, linewidth=0.9)
        last.set_ylabel("θ/α")
        reach = min(max(1.1 * float(np.abs(ratio).max()), 0.01), DRAWN_TO)
        last.set_ylim(-reach, reach)
        last.set_xlabel("time [s]")
        marks = [panel.axvline(low, color="C3", linewidth=1.0) for panel in (below, last)]
        for panel in (below, last):
            panel.set_xlim(low, high)
    at_record = record.record_id

    def move(now: float) -> None:
        turned = float(np.interp(now, time, theta))
        moved = float(np.interp(now, samples, travel))
        columns, beam = _outlines_of(frame, turned, distance)
        for shape, corners in zip(
            shapes[:-1], [*columns, *([] if beam is None else [beam])], strict=True
        ):
            shape.set_xy(corners + np.array([moved, 0.0]))
        shapes[-1].set_xy(_ground(scene, moved, _levels(frame)))
        for mark in marks:
            mark.set_xdata([now, now])
        scene.set_title(f"{frame.name} under {at_record}, {now:.2f} s")

    furthest = float(time[int(np.argmax(np.abs(theta[time <= high])))]) if theta.size else low
    with styled():
        move(furthest)
    drawn = "One column" if count_of(frame) == 1 else f"{count_of(frame)} columns"
    if isinstance(frame, UnequalBent):
        drawn = "Both columns and the beam, which turns,"
    elif frame.mass_ratio > 0.0:
        drawn += " and the beam" if frame.columns else " of the frame and the beam"
    caption = (
        f"{drawn} from the side, to scale, with the ground, which moves by "
        f"the displacement of the record; below, ground acceleration and rotation. The motion is "
        f"in this plane. {of_structure(frame)} {of_record(record, response, ground)}"
    )
    return Moving(figure, "The structure as it rocks", caption, times_of(low, high), move)


def history_of(structure: RockingFrame | UnequalBent, ground: GroundAcceleration) -> Any:
    """Return the bare response of a structure with its histories."""
    if isinstance(structure, UnequalBent):
        return respond_bent(structure, ground)
    return respond(structure, ground)


def over_balance(structure: RockingFrame | UnequalBent, theta: Float) -> Float:
    """Return rotations over that at which a structure balances on the same side [1]."""
    if isinstance(structure, UnequalBent):
        right, left = structure.balance_rotations
        return np.asarray(theta / np.where(theta < 0.0, left, right))
    return np.asarray(theta / structure.slenderness)


def _outlines_of(
    structure: RockingFrame | UnequalBent, theta: float, spacing: float
) -> tuple[list[Float], Float | None]:
    if isinstance(structure, UnequalBent):
        return bent_outlines(structure, theta)
    return outlines(structure, theta, spacing)


def _levels(structure: RockingFrame | UnequalBent) -> tuple[float, float]:
    """Return the levels of the ground under the left and the right half of a structure [m]."""
    if isinstance(structure, UnequalBent):
        left, right = (max(structure.heights) - height for height in structure.heights)
        return left, right
    return 0.0, 0.0


def _scene(
    scene: Axes, frame: RockingFrame | UnequalBent, spacing: float, travel: float
) -> list[Polygon]:
    """Set up the axes, and return the shapes: columns, beam if there is one, ground."""
    height = max(frame.heights) if isinstance(frame, UnequalBent) else frame.height
    beam = isinstance(frame, UnequalBent) or frame.mass_ratio > 0.0
    half = 0.5 * spacing * (count_of(frame) - 1) + 0.9 * height + travel
    top = (1.25 + BEAM) * height if beam else 1.25 * height
    scene.set_xlim(-half, half)
    scene.set_ylim(-0.1 * height, top)
    scene.set_aspect("equal")
    scene.set_ylabel("[m]")
    scene.grid(visible=False)
    shapes = [Polygon(np.zeros((4, 2)), **STONE) for _ in range(count_of(frame) + beam)]
    for shape in shapes:
        scene.add_patch(shape)
    soil = Polygon(_ground(scene, 0.0, _levels(frame)), **GROUND)
    scene.add_patch(soil)
    return [*shapes, soil]


def _ground(scene: Axes, moved: float, levels: tuple[float, float]) -> Float:
    """Return the corners of the ground, which move with it, with a step where levels differ."""
    (low, high), (bottom, _) = scene.get_xlim(), scene.get_ylim()
    start, end = (0.94 * np.array([low, high]) + moved).tolist()
    left, right = levels
    step = [[moved, right], [moved, left]] if left != right else []
    return np.array([[start, bottom], [end, bottom], [end, right], *step, [start, left]])


def save_moving(drawn: Moving, path: Path) -> Path:
    """Write a moving picture, and its caption as a text file beside it.

    Parameters
    ----------
    drawn : Moving
        The figure.
    path : Path
        File that ends in .gif, .apng, or .mp4, which needs ffmpeg.

    Returns
    -------
    Path
        The file of the caption.

    Raises
    ------
    InputError
        If there is no ffmpeg, or the file cannot be written.
    """
    span = float(drawn.times[-1] - drawn.times[0])
    rate: Any = (drawn.times.size - 1) / span if span > 0.0 else _PER_SECOND
    with styled(), whole_file(path) as partial, mpl.rc_context({"savefig.bbox": None}):
        writer = _writer(path, rate)
        figure = drawn.figure
        if engine := figure.get_layout_engine():  # the layout is that of all frames
            engine.execute(figure)
            figure.set_layout_engine("none")
        writer.setup(drawn.figure, str(partial), dpi=_DPI)
        for now in drawn.times.tolist():
            drawn.move(now)
            writer.grab_frame()
        writer.finish()
    beside = caption_path(path)
    with whole_file(beside) as partial:
        partial.write_text(f"{plain(drawn.title)}. {plain(drawn.caption)}\n", encoding="utf-8")
    return beside


def _writer(path: Path, rate: Any) -> Any:
    if path.suffix.lower() != ".mp4":
        return PillowWriter(fps=rate)
    if not FFMpegWriter.isAvailable():
        raise InputError(path, "cannot be written without ffmpeg. Install it, or write .gif.")
    return FFMpegWriter(
        fps=rate, extra_args=["-pix_fmt", "yuv420p", "-vf", "scale=trunc(iw/2)*2:trunc(ih/2)*2"]
    )
