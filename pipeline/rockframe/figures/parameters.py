"""Figures of parameters: restitution, size of the equivalent column, and ratio of heights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rockframe.figures.captioned import LINES, PAGE_WIDTH, PRINT_WIDTH, Captioned, styled
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.rocking.spectra.overturning import column_of
from rockframe.unequal import UnequalBent
from rockframe.unequal.ensemble import HeightRatios, over_height_ratios

#: Mass ratio that reaches the limit of eq (28) to round-off.
_LIMIT: Final = 1e15
#: Slenderness [rad] of frames of which it does not matter.
_ANY: Final = 0.1
#: Slendernesses [degrees] and mass ratios of Figure 7; the ratios are assumed: the paper does not
#: state them.
_SLENDERNESSES: Final = np.arange(0.1, 60.0, 0.1)
_RESTITUTION_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, math.inf)
#: Mass ratios of Figure 5.
_SIZE_RATIOS: Final = np.linspace(0.0, 10.0, 201)


def draw_restitution() -> Captioned:
    """Draw sqrt(r) over the slenderness, with a curve for each mass ratio: eq (43)."""
    gammas = _RESTITUTION_RATIOS
    finite = [min(gamma, _LIMIT) for gamma in gammas]
    limits = [column_of(_ANY, gamma).slenderness_limit for gamma in finite]
    ends = np.degrees(limits)
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.9), layout="constrained")
        axes = figure.subplots()
        for i, gamma in enumerate(gammas):
            rocking = _SLENDERNESSES[np.radians(_SLENDERNESSES) < limits[i]]
            values = [column_of(a, finite[i]).restitution for a in np.radians(rocking).tolist()]
            axes.plot(
                np.append(rocking, ends[i]),
                np.append(values, 0.0),
                label=f"γ = {gamma:g}".replace("inf", "∞"),
                linestyle=LINES[i % len(LINES)],
            )
        axes.set_xlim(0.0, 60.0)
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel("slenderness  α  [degrees]")
        axes.set_ylabel(r"largest restitution  $\sqrt{r}$")
        axes.legend(loc="lower left")
    listed = ", ".join(f"{gamma:g}" for gamma in gammas).replace("inf", "∞")
    caption = (
        "Largest coefficient of restitution √r, the angular velocity after an impact over that "
        "before, of frames of rectangular columns: eq (43), over the slenderness α, for mass "
        f"ratios γ = {listed}. It vanishes at {ends[0]:.2f} degrees for γ = {gammas[0]:g} and at "
        f"{ends[-1]:.2f} degrees for γ = {gammas[-1]:g}".replace("inf", "∞")
        + "; stockier frames do not rock. No record is used."
    )
    return Captioned(figure, "Figure 7: largest restitution", caption)


#: Mass ratios of the paper's two examples: the Temple of Apollo and the bridge bent.
_EXAMPLES: Final = {0.3: "temple", 4.0: "bridge"}
_SMALL: Final[dict[str, Any]] = {
    "textcoords": "offset points",
    "color": "0.35",
    "fontsize": 7,
}


def draw_equivalent_size() -> Captioned:
    """Draw R-hat / R and p-hat / p over the mass ratio: eqs (27) to (29)."""
    gamma = _SIZE_RATIOS
    frames = [column_of(_ANY, ratio) for ratio in (*gamma.tolist(), _LIMIT)]
    size = np.array([frame.effective_size / frame.size for frame in frames])
    frequency = np.array(
        [frame.effective_frequency_parameter / frame.frequency_parameter for frame in frames]
    )
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        _draw_curve(axes, size, r"$\hat R\,/\,R$", upwards=1)
        _draw_curve(axes, frequency, r"$\hat p\,/\,p$", upwards=-1)
        for where, name in _EXAMPLES.items():
            axes.axvline(where, color="0.6", linewidth=0.8, linestyle=":")
            axes.annotate(
                f"{name}, γ = {where:g}", (where, 1.0), xytext=(3, 1), va="bottom", **_SMALL
            )
        axes.set_xlim(0.0, float(gamma[-1]))
        axes.set_ylim(0.75, 1.58)
        axes.set_xlabel(r"mass ratio  $\gamma = m_b\,/\,(N m_c)$")
        axes.set_ylabel("ratio to the column alone")
    caption = (
        "Semi-diagonal R̂ and frequency parameter p̂ of the single column that rocks like a frame "
        "of columns with semi-diagonal R, frequency parameter p and the same slenderness, over the "
        f"mass ratio γ from {gamma[0]:g} to {gamma[-1]:g}: R̂/R = (1 + 3γ)/(1 + 2γ), eq (29), and "
        "p̂/p = [(1 + 2γ)/(1 + 3γ)]^½, eq (27), of rectangular columns; dashed, the limits of a "
        f"very heavy beam, {size[-1]:.4g} and {frequency[-1]:.4g}, eq (28). Dotted: the paper's "
        "Temple of Apollo and its bridge bent. No record is used."
    )
    return Captioned(figure, "Figure 5: size of the equivalent column", caption)


def _draw_curve(axes: Axes, ratios: NDArray[np.float64], label: str, upwards: int) -> None:
    """Draw a curve with its name, and its last value as the limit; `upwards` is -1 if it falls."""
    gamma, values, limit = _SIZE_RATIOS, ratios[:-1], float(ratios[-1])
    (line,) = axes.plot(gamma, values)
    axes.axhline(limit, color=line.get_color(), linewidth=0.8, linestyle="--")
    axes.annotate(
        label,
        (gamma[-1], values[-1]),
        xytext=(-4, -8 * upwards),
        textcoords="offset points",
        ha="right",
        va="top" if upwards > 0 else "bottom",
        color=line.get_color(),
    )
    axes.annotate(
        f"γ → ∞: {limit:.4g}",
        (0.5 * gamma[-1], limit),
        xytext=(0, 2 * upwards),
        va="bottom" if upwards > 0 else "top",
        **_SMALL,
    )


#: Ratios of the heights, and multiples of the motions, of the figure of unequal columns.
_HEIGHT_RATIOS: Final = (0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0)
_MULTIPLES: Final = (1.0, 2.0, 3.0)


def draw_unequal_columns(motions: Sequence[Record], bent: UnequalBent) -> Captioned:
    """Draw peak, share that overturns and difference of level over the ratio of two heights.

    Parameters
    ----------
    motions : sequence of Record
        The records.
    bent : UnequalBent
        A bent, with the mean height, the widths, the spacing and the beam of those that are drawn.
    """
    ensemble = Ensemble(corner=1.0)
    results = over_height_ratios(bent, motions, _HEIGHT_RATIOS, _MULTIPLES, ensemble)
    ratios = results.ratios
    equal = results.peak_rotation_ratio[:, -1:]
    shown = np.isfinite(results.peak_rotation_ratio).all(axis=1) & (equal[:, 0] > 0.0)
    change = results.peak_rotation_ratio[shown] / equal[shown]
    level = 100.0 * results.peak_level_difference[shown]
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 2.7), layout="constrained")
        first, second, third = figure.subplots(1, 3)
        first.plot(ratios, change.T, color="0.75", linewidth=0.7)
        third.plot(ratios, level.T, color="0.75", linewidth=0.7)
        if shown.any():
            first.plot(ratios, np.median(change, axis=0), color="C0")
            third.plot(ratios, np.median(level, axis=0), color="C0")
        for k, scale in enumerate(_MULTIPLES):
            line = LINES[k % len(LINES)]
            shares = 100.0 * results.share_overturned[:, k]
            second.plot(ratios, shares, color=f"C{k}", linestyle=line, label=f"{scale:g} times")
        second.legend(title="the records")
        first.set(ylabel="peak over that of equal columns")
        second.set(ylabel="share that overturns [%]", ylim=(0.0, 100.0))
        third.set(ylabel="difference of level [cm]", ylim=(0.0, None))
        for axes in (first, second, third):
            axes.axvline(bent.height_ratio, color="black", linewidth=0.7, linestyle=":")
            axes.set(xlabel="lower over higher column", xlim=(ratios[0], ratios[-1]))
    return Captioned(
        figure, "Columns of unequal height", _of_unequal(bent, motions, results, change)
    )


def _of_unequal(
    bent: UnequalBent, motions: Sequence[Record], results: HeightRatios, change: NDArray[np.float64]
) -> str:
    """Return the caption of the figure of unequal columns."""
    shares = 100.0 * results.share_overturned
    most = float(np.abs(shares[:-1] - shares[-1]).max())
    above = float((shares[:-1] - shares[-1]).max())
    peaks = "no median peak is known"
    if change.size:
        low, high = 100.0 * (change.min() - 1.0), 100.0 * (change.max() - 1.0)
        peaks = f"from {low:+.0f} to {high:+.0f} %"
    levels = results.peak_level_difference[np.isfinite(results.peak_level_difference).all(axis=1)]
    level = 100.0 * float(np.median(levels[:, 0])) if levels.size else math.nan
    each = ", ".join(
        f"{shares[0, k]:.0f} and {shares[-1, k]:.0f} % at {scale:g} times the records"
        for k, scale in enumerate(_MULTIPLES)
    )
    mean, (left, right) = 0.5 * sum(bent.heights), bent.widths
    records = "one record" if len(motions) == 1 else f"{len(motions)} records, each"
    return (
        f"Two columns with a mean height of {mean:g} m, {left:g} and {right:g} m wide and "
        f"{bent.spacing:g} m apart, under a beam of {bent.mass_ratio:g} times their mass, over the "
        f"ratio of their heights, under {records} with 64 plausible bents. "
        "Left: median of the largest rotation over that of the balance, over the same of columns "
        f"of equal height, under the records themselves ({peaks}). Middle: share that overturns; "
        f"at ratios of 0.6 and 1 it is {each}; it differs from that at ratio 1 by at most "
        f"{most:.0f} percentage points, and is at most {max(above, 0.0):.0f} above it. Right: "
        "largest difference of level between both ends of the span, under the records themselves; "
        f"its median at 0.6 is {level:.1f} cm. Grey: each record; blue: median of the records. "
        f"Dotted: the ratio of the stated bent, {bent.height_ratio:.2f}."
    )
