"""One structure under one record: forces at the joints, phase portrait, restoring moment."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import (
    DRAWN_TO,
    PRINT_WIDTH,
    Captioned,
    of_record,
    of_structure,
    styled,
    time_limits,
)

#: Demands are drawn up to this multiple of the available friction [1]; they may be infinite.
_SHOWN: Final = 2.0


def draw_joints(dataset: xr.Dataset, friction: float) -> Captioned:
    """Draw rotation, friction demand and vertical forces with their limits.

    Parameters
    ----------
    dataset : Dataset
        As returned by `joints_dataset`.
    friction : float
        Assumed coefficient of friction of the joints [1].
    """
    time = dataset["time"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 4.6), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=[0.8, 1.0, 1.0])
        panels[0].plot(time, dataset["theta"] / float(dataset["slenderness"]), color="0.35")
        panels[0].set_ylabel("θ/α")
        furthest = min(float(dataset["peak_rotation_ratio"]), DRAWN_TO)
        panels[0].set_ylim(*(side * max(1.1 * furthest, 0.01) for side in (-1.0, 1.0)))
        _draw_friction(panels[1], dataset, friction)
        _draw_vertical(panels[2], dataset)
        panels[2].set_xlabel("time [s]")
        rotated = np.nan_to_num(np.abs(dataset["theta"].values), nan=0.0) > 1e-4
        panels[0].set_xlim(*time_limits(time, rotated, 1.5))
        figure.align_ylabels(list(panels))
    return Captioned(figure, "Forces at the joints", _caption(dataset, friction))


def _draw_friction(panel: Axes, dataset: xr.Dataset, friction: float) -> None:
    time = dataset["time"].values
    for name, label in (("base", "base"), ("top", "under the beam")):
        demand = dataset[f"{name}_friction_demand"].values
        if np.isfinite(demand).any():
            panel.plot(time, demand, linewidth=0.8, label=label)
    panel.axhline(friction, color="black", linestyle="--", linewidth=0.9, label="assumed available")
    uplift = float(dataset["uplift_friction_demand"])
    panel.axhline(uplift, color="0.5", linestyle=":", linewidth=0.9, label="at uplift, tan α")
    panel.set_ylabel("friction demand")
    shown = min(_number(dataset, "base_friction_demand"), _SHOWN * friction)
    panel.set_ylim(0.0, 1.1 * max(friction, uplift, shown))
    _legend_above(panel)


def _draw_vertical(panel: Axes, dataset: xr.Dataset) -> None:
    time = dataset["time"].values
    panel.plot(time, dataset["base_vertical"], linewidth=0.8, label="all base joints")
    if "column_top_vertical" in dataset:
        each = dataset["column_top_vertical"]
        for values, word in ((each.max("column"), "more"), (each.min("column"), "less")):
            panel.plot(time, values, linewidth=0.7, label=f"{word} loaded column")
    panel.axhline(0.0, color="black", linestyle="--", linewidth=0.9, label="lift-off")
    panel.set_ylabel("vertical force / static")
    drawn = [line.get_ydata() for line in panel.get_lines()]
    highest = max(float(np.nanmax(np.asarray(values))) for values in drawn)
    panel.set_ylim(-0.1, 1.1 * max(highest, 1.0))
    _legend_above(panel)


def _legend_above(panel: Axes) -> None:
    """Put the legend above the panel, where it hides no curve."""
    panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=7, borderpad=0)


def _number(dataset: xr.Dataset, name: str) -> float:
    found = dataset.get(f"largest_{name}")
    return math.nan if found is None else float(found)


def _caption(dataset: xr.Dataset, friction: float) -> str:
    demands = {
        "all base joints together": _number(dataset, "base_friction_demand"),
        "all joints under the beam together": _number(dataset, "top_friction_demand"),
        "one base joint": _number(dataset, "column_base_friction_demand"),
        "one joint under the beam": _number(dataset, "column_top_friction_demand"),
        "each impact": float(dataset["impact_friction_demand"]),
        "uplift (tan α)": float(dataset["uplift_friction_demand"]),
    }
    known = {name: demand for name, demand in demands.items() if not math.isnan(demand)}
    stated = ", ".join(f"{name} {demand:.3f}" for name, demand in known.items())
    slides = max(known.values()) > friction
    sliding = (
        f"Friction needed at most, at the samples of the record: {stated}; with a "
        f"coefficient of {friction:g}, assumed and not measured, the assumption of "
        f"no sliding {'does not hold' if slides else 'holds'}."
    )
    return (
        f"Rotation, friction demand and vertical forces. {sliding} "
        f"{_lift_off(dataset)} {of_structure(dataset)} {of_record(dataset)}"
    )


def _lift_off(dataset: xr.Dataset) -> str:
    least = {"all base joints together": float(dataset["least_base_vertical"])}
    bent = ""
    if "spacing" in dataset:
        least["the beam on one column"] = float(dataset["least_column_top_vertical"])
        bent = (
            f" (two columns {float(dataset['spacing']):g} m apart, the beam's centre of mass "
            f"{float(dataset['beam_centre']):g} m above its underside; impacts would lift it off "
            f"at a spacing below {float(dataset['least_spacing']):.2f} m)"
        )
    known = {name: force for name, force in least.items() if not math.isnan(force)}
    stated = ", ".join(f"{name} {force:.3f}" for name, force in known.items())
    holds = min(known.values()) > 0.0
    return (
        f"Least vertical force over the static one: {stated}{bent}; the assumption of no lift-off "
        f"{'holds' if holds else 'does not hold'}."
    )


def draw_phase_portrait(dataset: xr.Dataset) -> Captioned:
    """Draw the rate of rotation over the rotation.

    Parameters
    ----------
    dataset : Dataset
        As returned by `portrait_dataset`.
    """
    alpha = float(dataset["slenderness"])
    scale = alpha * float(dataset["effective_frequency_parameter"])
    curve = dataset["curve_rotation"].values / alpha
    barrier = np.where(np.abs(curve) <= 1.0, dataset["curve_barrier"].values / scale, np.nan)
    rates = dataset["impact_rate"].values / scale
    after = float(dataset["restitution"]) * rates
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.1), layout="constrained")
        axes = figure.subplots()
        axes.plot(dataset["rotation"] / alpha, dataset["rate"] / scale, linewidth=0.8)
        for sign in (1.0, -1.0):
            label = "overturns beyond, on still ground" if sign > 0.0 else None
            axes.plot(curve, sign * barrier, color="0.4", linestyle="--", linewidth=0.9,
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
        if float(dataset["peak_rotation_ratio"]) > DRAWN_TO:
            axes.set_xlim(-DRAWN_TO, DRAWN_TO)
            axes.set_ylim(-1.5, 1.5)
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel(r"rate  $\dot\theta\,/\,(\hat p\,\alpha)$")
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        "Rate of rotation over p̂ α against rotation over the slenderness α. Dots: just before "
        "(filled) and after (open) each impact, where the rate falls by the restitution. Dashed: "
        "a frame left on still ground beyond this line and moving outwards overturns. "
        f"{of_structure(dataset)} {of_record(dataset)}"
    )
    return Captioned(figure, "Phase portrait", caption)


def draw_moment_rotation(dataset: xr.Dataset) -> Captioned:
    """Draw the restoring moment over the rotation, and the part reached under a record.

    Parameters
    ----------
    dataset : Dataset
        As returned by `portrait_dataset`.
    """
    alpha = float(dataset["slenderness"])
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        axes.axhline(0.0, color="0.7", linewidth=0.8)
        axes.plot(
            dataset["curve_rotation"] / alpha,
            dataset["curve_moment"],
            color="0.6",
            linewidth=0.9,
            label="all rotations",
        )
        reached = dataset["restoring_moment"].sortby(dataset["rotation"])
        axes.plot(reached["rotation"] / alpha, reached, linewidth=2.4, label="reached")
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel("moment / uplift moment")
        axes.legend(loc="upper left")
        axes.set_ylim(-1.15, 1.15)
        axes.set_xlim(-DRAWN_TO, DRAWN_TO)
    caption = (
        "Restoring moment over that at uplift, N m_c g R (1 + 2γ) sin α, against the rotation θ "
        "over the slenderness α: rigid up to uplift, then falling to zero at θ = α. The path runs "
        "along one curve and encloses no area; energy is lost in the impacts alone. "
        f"{of_structure(dataset)} {of_record(dataset)}"
    )
    return Captioned(figure, "Moment and rotation", caption)
