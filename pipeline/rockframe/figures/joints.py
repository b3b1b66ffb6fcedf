"""One structure under one record: forces at the joints, phase portrait, restoring moment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.figures.captioned import (
    DRAWN_TO,
    PAGE_WIDTH,
    PRINT_WIDTH,
    Captioned,
    label_of,
    of_record,
    of_structure,
    styled,
    time_limits,
)
from rockframe.figures.moving import over_balance
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.tables.forces import forces_in_words, kilonewtons
from rockframe.rocking import (
    ColumnForces,
    GroundAcceleration,
    Reactions,
    Response,
    Verdict,
    as_ground,
    barrier_rate,
    column_forces,
    impact_friction_demand,
    least_spacing,
    respond,
    restoring_moment,
    trajectory,
)
from rockframe.rocking.contact import static_vertical, uplift_friction_demand
from rockframe.rocking.reactions import model_end, valid_reactions
from rockframe.unequal import BentResponse, UnequalBent, bent_forces, respond_bent

Float = NDArray[np.float64]

#: The curves of moment and barrier extend to this multiple of the slenderness.
_CURVES_TO: Final = 1.3
#: Assumed coefficient of friction of joints, if nothing is stated [1].
_FRICTION: Final = 0.5
#: Demands are drawn up to this multiple of the available friction [1]; they may be infinite.
_SHOWN: Final = 2.0


def draw_any_joints(
    record: Record,
    structure: RockingFrame | UnequalBent,
    motion: GroundAcceleration | None = None,
    *,
    friction: float | None = None,
    spacing: float | None = None,
    beam_centre: float | None = None,
) -> Captioned:
    """Draw the joints of a frame, as `draw_joints`, or of two columns that differ.

    `ParameterError` as for `draw_joints`, or if a spacing is stated of two columns that differ.
    """
    if not isinstance(structure, UnequalBent):
        beside = {"friction": friction, "spacing": spacing, "beam_centre": beam_centre}
        return draw_joints(record, structure, motion, **beside)
    if spacing is not None:
        raise ParameterError(
            f"--spacing {spacing:g} has no effect on bent {structure.name!r}: it has its own. "
            "Leave it out."
        )
    return draw_bent_joints(record, structure, motion, friction=friction)


def draw_bent_joints(
    record: Record,
    bent: UnequalBent,
    motion: GroundAcceleration | None = None,
    *,
    friction: float | None = None,
) -> Captioned:
    """Draw rotation, friction demand and vertical forces of each of two columns that differ.

    Parameters
    ----------
    record, motion, friction
        As for `draw_joints`; the bent states no friction.
    bent : UnequalBent
        The bent.
    """
    ground = as_ground(motion or record)
    response = respond_bent(bent, ground)
    forces = bent_forces(response, ground)
    coefficient, source = _FRICTION if friction is None else friction, "assumed"
    weighed = not math.isnan(bent.weight)
    unit = (kilonewtons(1.0, bent.weight) if weighed else 1.0) / (1.0 + bent.mass_ratio)
    demands = _of_each(forces.base_friction_demand, forces.top_friction_demand)
    verticals = {
        name: unit * each
        for name, each in _of_each(forces.base_vertical, forces.top_vertical).items()
    }
    named = "kN" if weighed else "W"
    figure = _draw_each_joint(response, demands, verticals, coefficient, named)
    caption = (
        "Rotation, friction demand and vertical forces of each joint while the bent rocks; forces "
        f"of closed joints depend on their stiffness. {_bent_in_words(demands, verticals, weighed)}"
        f"Dotted: a coefficient of friction of {coefficient:g}, {source}"
        f"{' and not measured' if friction is None else ''}. "
        f"{of_structure(bent)} {of_record(record, response, ground)}"
    )
    return Captioned(figure, "Forces at the joints of each column", caption)


def _draw_each_joint(
    response: BentResponse,
    demands: Mapping[str, Float],
    verticals: Mapping[str, Float],
    friction: float,
    unit: str,
) -> Figure:
    """Draw rotation, friction demands, and vertical forces in a unit, of each joint."""
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 4.6), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=[0.8, 1.0, 1.0])
        panels[0].plot(response.time, over_balance(response.bent, response.theta), color="0.35")
        furthest = max(1.1 * min(response.peak_rotation_ratio, DRAWN_TO), 0.01)
        panels[0].set(ylabel="θ/α", ylim=(-furthest, furthest))
        for panel, drawn in zip(panels[1:], (demands, verticals), strict=True):
            for name, values in drawn.items():
                line = f"{'C0' if 'left' in name else 'C1'}{'-' if 'base' in name else '--'}"
                panel.plot(response.time, values, line, linewidth=0.8, label=name)
            _legend_above(panel)
        panels[1].axhline(friction, color="black", linestyle=":", linewidth=0.9)
        shown = min(_largest(np.stack([*demands.values()])), _SHOWN * friction)
        panels[1].set(ylabel="friction demand", ylim=(0.0, 1.1 * max(friction, shown or 0.0)))
        panels[2].axhline(0.0, color="black", linewidth=0.9)
        panels[2].set(ylabel=f"vertical force [{unit}]", xlabel="time [s]")
        rotated = np.nan_to_num(np.abs(response.theta), nan=0.0) > 1e-4
        panels[0].set_xlim(*time_limits(response.time, rotated, 1.5))
        figure.align_ylabels(list(panels))
    return figure


def _of_each(base: Float, top: Float) -> dict[str, Float]:
    """Return histories of both columns by the names of their joints."""
    names = [f"{side} {place}" for place in ("base", "top") for side in ("left", "right")]
    return dict(zip(names, [*base, *top], strict=True))


def _bent_in_words(
    demands: Mapping[str, Float], verticals: Mapping[str, Float], weighed: bool
) -> str:
    """Return the sentences about the extremes of each joint; empty if the bent does not rock."""
    if not np.isfinite(np.stack([*verticals.values()])).any():
        return "It does not rock at any sample. "
    unit = " [kN]" if weighed else ", over half the weight W of columns and beam"
    needed = ", ".join(f"{name} {_largest(each):.3f}" for name, each in demands.items())
    form = ".0f" if weighed else ".3f"
    pairs = {name: (_least(each), _largest(each)) for name, each in verticals.items()}
    ends = ", ".join(f"{name} {low:{form}} to {high:{form}}" for name, (low, high) in pairs.items())
    return (
        f"Friction needed at most, at the samples of the record: {needed}. Vertical forces{unit}: "
        f"{ends}; one that is not positive would lift the joint off. "
    )


def draw_joints(
    record: Record,
    frame: RockingFrame,
    motion: GroundAcceleration | None = None,
    *,
    friction: float | None = None,
    spacing: float | None = None,
    beam_centre: float | None = None,
) -> Captioned:
    """Draw rotation, friction demand and vertical forces with their limits.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.
    friction : float, optional
        Assumed coefficient of friction of the joints [1]; by default that of the frame, or 0.5 if
        it states none.
    spacing : float, optional
        Distance between the axes of two columns [m]: adds the forces on each column.
    beam_centre : float, optional
        Height of the beam's centre of mass above its underside [m], where a spacing is stated; by
        default 0.

    Raises
    ------
    ParameterError
        If the columns overlap, or a spacing is stated of a frame without a beam.
    """
    if spacing is not None and frame.mass_ratio == 0.0:
        raise ParameterError(
            f"Invalid spacing {spacing!r} m: frame {frame.name!r} is a column alone, without a "
            "beam (mass_ratio 0). Leave the spacing out."
        )
    ground = as_ground(motion or record)
    whole = respond(frame, ground)
    response, forces = valid_reactions(whole, ground)
    available = _available(frame, friction)
    each, bent = None, ""
    if spacing is not None:
        beam_centre = beam_centre or 0.0
        each = column_forces(whole, ground, spacing=spacing, beam_centre=beam_centre)
        each = ColumnForces(*(part[:, : response.time.size] for part in vars(each).values()))
        bent = (
            f" (two columns {spacing:g} m apart, the beam's centre of mass {beam_centre:g} m above "
            "its underside; impacts would lift it off at a spacing below "
            f"{least_spacing(frame, beam_centre):.2f} m)"
        )
    base, beam = forces.base_vertical, None if each is None else each.top_vertical
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 4.6), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=[0.8, 1.0, 1.0])
        panels[0].plot(response.time, response.theta / frame.slenderness, color="0.35")
        panels[0].set_ylabel("θ/α")
        furthest = min(response.peak_rotation_ratio, DRAWN_TO)
        panels[0].set_ylim(*(side * max(1.1 * furthest, 0.01) for side in (-1.0, 1.0)))
        _draw_friction(panels[1], response, forces, available)
        _draw_vertical(panels[2], response, base, beam)
        panels[2].set_xlabel("time [s]")
        rotated = np.nan_to_num(np.abs(response.theta), nan=0.0) > 1e-4
        panels[0].set_xlim(*time_limits(response.time, rotated, 1.5))
        figure.align_ylabels(list(panels))
    caption = (
        f"Rotation, friction demand and vertical forces{_until(whole)}. "
        f"{_sliding(response, forces, each, available)} {_lift_off(frame, base, beam, bent)} "
        f"{_in_kilonewtons(frame, forces, each)}"
        f"{of_structure(frame)} {of_record(record, response, ground)}"
    )
    return Captioned(figure, "Forces at the joints", caption)


def _until(response: Response) -> str:
    """Return when and why the curves end before the motion; "" if they do not."""
    end, words = model_end(response)
    return f" until the model ends: {words} {end:.2f} s" if words else ""


def _available(frame: RockingFrame, assumed: float | None) -> tuple[float, str]:
    """Return the available coefficient of friction [1] and where it is from, in words."""
    if assumed is not None:
        return assumed, "assumed"
    if frame.friction_coefficient is not None:
        return frame.friction_coefficient, "stated by the structure"
    return _FRICTION, "assumed and not measured"


def _draw_friction(
    panel: Axes, response: Response, forces: Reactions, available: tuple[float, str]
) -> None:
    friction, source = available
    demands = (forces.base_friction_demand, forces.top_friction_demand)
    for demand, label in zip(demands, ("base", "under the beam"), strict=True):
        if np.isfinite(demand).any():
            panel.plot(response.time, demand, linewidth=0.8, label=label)
    label = f"{source.split()[0]} available"
    panel.axhline(friction, color="black", linestyle="--", linewidth=0.9, label=label)
    uplift, label = uplift_friction_demand(response.frame), _at_uplift(response.frame)
    panel.axhline(uplift, color="0.5", linestyle=":", linewidth=0.9, label=f"at {label}")
    panel.set_ylabel("friction demand")
    shown = min(_largest(demands[0]), _SHOWN * friction)
    panel.set_ylim(0.0, 1.1 * max(friction, uplift, shown))
    _legend_above(panel)


def _draw_vertical(panel: Axes, response: Response, base: Float, beam: Float | None) -> None:
    """Draw vertical forces over the static ones, or in kN for one column where it is known.

    The forces are given over the weight of a column.
    """
    time, weight, frame = response.time, response.frame.weight, response.frame
    weighed = not math.isnan(weight)
    at_rest = static_vertical(frame)
    unit = kilonewtons(1.0, weight / (1.0 + frame.mass_ratio)) if weighed else 1.0 / at_rest[0]
    static, share = unit * at_rest[0], unit if weighed else 1.0 / (at_rest[1] or math.nan)
    label = "base joint, mean of all" if weighed else "all base joints"
    panel.plot(time, unit * base, linewidth=0.8, label=label)
    if beam is not None:
        # fmax and fmin ignore NaN, after a fall
        for values, word in ((np.fmax(*beam), "more"), (np.fmin(*beam), "less")):
            panel.plot(time, share * values, linewidth=0.7, label=f"{word} loaded column")
    panel.axhline(0.0, color="black", linestyle="--", linewidth=0.9, label="lift-off")
    panel.set_ylabel("vertical force [kN]" if weighed else "vertical force / static")
    drawn = [line.get_ydata() for line in panel.get_lines()]
    highest = _largest(np.array([_largest(np.asarray(values)) for values in drawn]))
    panel.set_ylim(-0.1 * static, 1.1 * max(highest, static))
    _legend_above(panel)


def _legend_above(panel: Axes) -> None:
    """Put the legend above the panel, where it hides no curve, and no wider than the panel."""
    panel.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0, 1.0, 0.0), mode="expand", ncols=2, fontsize=7,
        borderpad=0, borderaxespad=0.5, handlelength=1.6, handletextpad=0.5,
    )  # fmt: skip


def _largest(values: Float) -> float:
    """Return the largest value; NaN only if all are NaN."""
    return float(np.fmax.reduce(values, axis=None))


def _least(values: Float) -> float:
    """Return the least value; NaN only if all are NaN."""
    return float(np.fmin.reduce(values, axis=None))


def _at_uplift(frame: RockingFrame) -> str:
    return "uplift" if frame.tendon is not None else "uplift, tan α"


def _sliding(
    response: Response,
    forces: Reactions,
    each: ColumnForces | None,
    available: tuple[float, str],
) -> str:
    """Return the sentence about sliding; uplift and impacts count if they occur."""
    frame, (friction, source) = response.frame, available
    demands = {
        "all base joints together": _largest(forces.base_friction_demand),
        "all joints under the beam together": _largest(forces.top_friction_demand),
    }
    if each is not None:
        demands["one base joint"] = _largest(each.base_friction_demand)
        demands["one joint under the beam"] = _largest(each.top_friction_demand)
    if response.impacts:
        demands["each impact"] = impact_friction_demand(frame)
    if response.verdict is not Verdict.NO_UPLIFT:
        demands[_at_uplift(frame)] = uplift_friction_demand(frame)
    needed = {name: demand for name, demand in demands.items() if not math.isnan(demand)}
    listed = ", ".join(f"{name} {demand:.3f}" for name, demand in needed.items())
    slides = max(needed.values()) > friction
    return (
        f"Friction needed at most, at the samples of the record: {listed}; with a "
        f"coefficient of {friction:g}, {source}, the assumption of "
        f"no sliding {'does not hold' if slides else 'holds'}."
    )


def _lift_off(frame: RockingFrame, base: Float, beam: Float | None, bent: str) -> str:
    """Return the sentence about the least vertical forces, given over the weight of a column."""
    at_rest = static_vertical(frame)
    least = {"all base joints together": _least(base) / at_rest[0]}
    if beam is not None:
        least["the beam on one column"] = _least(beam) / at_rest[1]
    forces = {name: force for name, force in least.items() if not math.isnan(force)}
    listed = ", ".join(f"{name} {force:.3f}" for name, force in forces.items())
    holds = min(forces.values()) > 0.0
    pressed = "" if frame.tendon is None else ", with the prestress of tendons"
    return (
        f"Least vertical force over the static one{pressed}: {listed}{bent}; the assumption of no "
        f"lift-off "
        f"{'holds' if holds else 'does not hold'}."
    )


def _in_kilonewtons(frame: RockingFrame, forces: Reactions, each: ColumnForces | None) -> str:
    """Return the sentence about the largest forces; empty if the weight is not known."""
    if math.isnan(frame.weight):
        return ""
    column = frame.weight / (1.0 + frame.mass_ratio)
    largest = {
        "base joint": (forces.base_shear, forces.base_vertical),
        "joint under the beam": (forces.top_shear, forces.top_vertical),
    }
    if each is not None:
        largest["base joint of one of the two columns"] = (each.base_shear, each.base_vertical)
        largest["joint under the beam of one"] = (each.top_shear, each.top_vertical)
    listed = (
        f"{name} {kilonewtons(_largest(np.abs(across)), column):.0f} and "
        f"{kilonewtons(_largest(down), column):.0f}"
        for name, (across, down) in largest.items()
    )
    return (
        f"A column with its share of the beam weighs {frame.weight / 1000.0:.0f} kN; largest "
        f"horizontal and vertical force of one column, the mean of all columns unless one is "
        f"named [kN]: {', '.join(listed)}. "
    )


def _all_rotations(frame: RockingFrame) -> Float:
    """Return rotations [rad] for curves, with both sides of the jump of the moment at 0."""
    reach, edge = _CURVES_TO * frame.slenderness, 1e-12 * frame.slenderness
    exact = (-frame.slenderness, -edge, edge, frame.slenderness)
    return np.union1d(np.linspace(-reach, reach, 401), exact)


def draw_phase_portrait(
    record: Record, frame: RockingFrame, motion: GroundAcceleration | None = None
) -> Captioned:
    """Draw the rate of rotation over the rotation, with the jumps at impacts.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame, without tendons and dissipaters.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.
    """
    ground = as_ground(motion or record)
    response = respond(frame, ground)
    alpha = frame.slenderness
    scale = alpha * frame.effective_frequency_parameter
    theta, omega = trajectory(response)
    curve = _all_rotations(frame)
    barrier = np.where(np.abs(curve) <= alpha, barrier_rate(frame, curve) / scale, np.nan)
    rates = response.impact_velocities / scale
    after = frame.restitution * rates
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.1), layout="constrained")
        axes = figure.subplots()
        axes.plot(theta / alpha, omega / scale, linewidth=0.8)
        for sign in (1.0, -1.0):
            label = "overturns beyond, on still ground" if sign > 0.0 else None
            axes.plot(curve / alpha, sign * barrier, color="0.4", linestyle="--", linewidth=0.9,
                      label=label)  # fmt: skip
        for values, face, label in ((rates, "C1", "before an impact"), (after, "w", "after it")):
            axes.plot(
                0.0 * values,
                values,
                linestyle="",
                marker="o",
                markersize=2.4,
                color="C1",
                markerfacecolor=face,
                markeredgewidth=0.6,
                label=label,
            )
        if response.peak_rotation_ratio > DRAWN_TO:
            axes.set_xlim(-DRAWN_TO, DRAWN_TO)
            axes.set_ylim(-1.5, 1.5)
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel(r"rate  $\dot\theta\,/\,(\hat p\,\alpha)$")
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        "Rate of rotation over p̂ α against rotation over the slenderness α. Dots: just before "
        "(filled) and after (open) each impact, where the rate falls by the restitution. Dashed: "
        "a frame left on still ground beyond this line and moving outwards overturns. "
        f"{of_structure(frame)} {of_record(record, response, ground)}"
    )
    return Captioned(figure, "Phase portrait", caption)


def draw_moment_rotation(
    record: Record, frame: RockingFrame, motion: GroundAcceleration | None = None
) -> Captioned:
    """Draw the restoring moment over the rotation, and the part reached under a record.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame, without tendons and dissipaters.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.
    """
    ground = as_ground(motion or record)
    response = respond(frame, ground)
    alpha = frame.slenderness
    rotations = _all_rotations(frame)
    reached = np.sort(trajectory(response)[0])
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        axes.axhline(0.0, color="0.7", linewidth=0.8)
        axes.plot(
            rotations / alpha,
            restoring_moment(frame, rotations),
            color="0.6",
            linewidth=0.9,
            label="all rotations",
        )
        moment = restoring_moment(frame, reached)
        axes.plot(reached / alpha, moment, linewidth=2.4, label="reached")
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel("moment / uplift moment")
        axes.legend(loc="upper left")
        axes.set_ylim(-1.15, 1.15)
        axes.set_xlim(-DRAWN_TO, DRAWN_TO)
    caption = (
        "Restoring moment over that at uplift, N m_c g R (1 + 2γ) sin α, against the rotation θ "
        "over the slenderness α: rigid up to uplift, then falling to zero at θ = α. The path runs "
        "along one curve and encloses no area; energy is lost in the impacts alone. "
        f"{of_structure(frame)} {of_record(record, response, ground)}"
    )
    return Captioned(figure, "Moment and rotation", caption)


#: Columns that differ, and their joints.
_COLUMNS: Final = tuple((side, place) for place in ("base", "top") for side in ("left", "right"))
#: Forces of each panel, with their labels.
_PANELS: Final = {
    "horizontal force": {
        "peak_base_shear": "base shear",
        "base_joint_horizontal": "base joint",
        "base_key_force": "base key",
        "top_joint_horizontal": "top joint",
        "top_key_force": "top key",
        **{f"{side}_{place}_horizontal": f"{side} {place}" for side, place in _COLUMNS},
    },
    "vertical force": {
        "base_joint_vertical": "base, largest",
        "base_joint_vertical_least": "base, least",
        "top_joint_vertical": "top, largest",
        "top_joint_vertical_least": "top, least",
        **{f"{side}_{place}_vertical": f"{side} {place}, largest" for side, place in _COLUMNS},
        **{f"{side}_{place}_vertical_least": f"{side} {place}, least" for side, place in _COLUMNS},
        "peak_tendon_force": "tendon",
        "peak_dissipater_force": "dissipaters",
    },
    "impulse": {
        "base_impulse_horizontal": "base, horizontal",
        "base_impulse_vertical": "base, vertical",
        "top_impulse_horizontal": "top, horizontal",
        "top_impulse_vertical": "top, vertical",
        **{
            f"{side}_{place}_impulse_{direction}": f"{side} {place}, {direction}"
            for side, place in _COLUMNS
            for direction in ("horizontal", "vertical")
        },
    },
}


def draw_forces(rows: Sequence[Mapping[str, Any]], title: str) -> Captioned:
    """Draw the forces at the joints of each structure with their bands, in kN where it is known.

    Parameters
    ----------
    rows : sequence of mapping
        The rows of one record, as `force_rows` yields them; at least one.
    title : str
        Name of the record.
    """
    structures = list(dict.fromkeys(str(row["structure"]) for row in rows))
    with styled():
        size = (PAGE_WIDTH, 0.6 + 1.55 * len(structures))
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(len(structures), len(_PANELS), squeeze=False)
        for name, panels in zip(structures, grid, strict=True):
            row_of = {row["force"]: row for row in rows if row["structure"] == name}
            for axes, (quantity, labels) in zip(panels, _PANELS.items(), strict=True):
                shown = {label: row_of[key] for key, label in labels.items() if key in row_of}
                _draw_ranges(axes, shown)
                unit = next((row["unit"] for row in shown.values()), "")
                axes.set_xlabel(f"{quantity} [{unit}]")
            panels[0].set_title(label_of(name), loc="left", fontsize=8)
        figure.suptitle(label_of(title), fontsize=9)
    return Captioned(
        figure,
        f"Forces under {title}",
        f"{forces_in_words(rows)} Bars: from the 16 to the 84 % quantile of the ensemble; lines: "
        "its median; diamonds: the nominal value, of the structure as given. Arrows: the quantile "
        "falls on a member that overturns.",
    )


def _draw_ranges(axes: Axes, shown: Mapping[str, Mapping[str, Any]]) -> None:
    """Draw a bar from the 16 to the 84 % quantile of each force, its median and nominal value."""
    values = [value for row in shown.values() for key, value in row.items()
             if key.startswith("value") and math.isfinite(value)]  # fmt: skip
    low, high = min([0.0, *values]), 1.08 * max([*values, 1e-12])
    for place, row in enumerate(shown.values()):
        ends = [float(np.clip(row[f"value_{end}"], low, high)) for end in (16, 84)]
        if not math.isnan(ends[0]):
            axes.barh(place, ends[1] - ends[0], left=ends[0], height=0.55, color="#9ecae1")
        for beyond, edge, marker in ((-math.inf, low, "<"), (math.inf, high, ">")):
            if beyond in (row["value_16"], row["value_84"]):
                (arrow,) = axes.plot(edge, place, marker=marker, color="#d55e00", markersize=4)
                arrow.set(clip_on=False, in_layout=False)
        if math.isfinite(row["value_50"]):
            axes.plot([row["value_50"]] * 2, [place - 0.28, place + 0.28], color="C0")
        axes.plot(row["value"], place, marker="D", markersize=3, color="black", linestyle="")
    axes.set_yticks(range(len(shown)), list(shown))
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlim(low, high)
