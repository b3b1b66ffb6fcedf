"""Fragility curves, and the distribution of peak rotations at one intensity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FormatStrFormatter, LogLocator, NullFormatter

from rockframe.figures.captioned import PAGE_WIDTH, PRINT_WIDTH, Captioned, label_of, styled
from rockframe.results.screen_tables import (
    equal_states,
    fragility_curve,
    kind_row,
    members_of,
    motions_that_count,
    responses_in_words,
    result_in_words,
    title_of_states,
    with_its_limits,
)
from rockframe.results.tables.notes import left_out_motions
from rockframe.results.tables.rows import in_verb_of
from rockframe.risk import LimitState, Measure, Outcome, measure_of
from rockframe.rocking import Verdict


def draw_fragility(screening: xr.Dataset) -> Captioned:
    """Draw the fragility of one structure: a row for each limit state, a panel for each measure.

    Limit states with the same curves share a row. The curve of overturning is in all rows.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`, for one structure.
    """
    screening = with_its_limits(screening)
    measures = [
        measure_of(str(name))
        for name in screening["measure"].values
        if int(screening["fragility_outcome"].sel(measure=name)[0]) != Outcome.UNKNOWN
    ]
    states = equal_states(screening)
    across = max(1, min(len(measures), _ACROSS if len(states) > 1 else 2))
    down = max(1, -(-len(measures) // across))
    structure, kind = str(screening["structure"].item()), kind_row(screening)
    end = in_verb_of(kind, "overturning")
    with styled():
        height = 0.8 + len(states) * (0.25 + (1.65 if across > 2 else 2.3) * down)
        figure = Figure(figsize=(PAGE_WIDTH, height), layout="constrained")
        for state, part in zip(
            states, figure.subfigures(len(states), 1, squeeze=False)[:, 0], strict=True
        ):
            panels = part.subplots(down, across, squeeze=False, sharey=True)
            for axes in panels.ravel()[len(measures) :]:
                axes.set_visible(False)
            for axes, measure in zip(panels.ravel(), measures, strict=False):
                fits = screening.sel(measure=measure.name)
                if state[0] is not states[0][0]:
                    fit = fits.sel(limit_state=states[0][0].name)
                    _draw_curve(axes, fit, measure, **_BESIDE)
                _draw_state(axes, fits.sel(limit_state=state[0].name), state[0], measure)
                _set_axes(axes, fits, measure, width=PAGE_WIDTH / across)
            heading = in_verb_of(kind, title_of_states(state))
            part.suptitle(heading, fontsize=8, fontweight="bold", x=0.01, ha="left")
            several = "reaching it" if state[0].quantity else end
            part.supylabel(f"probability of {several}", fontsize=8)
        figure.suptitle(label_of(structure), fontsize=9)
        figure.legend(
            handles=_handles(end, several=len(states) > 1),
            loc="outside lower center",
            ncols=4,
            fontsize=7,
        )
    limits = [limit for state in states for limit in state]
    told = [part for limit in limits for part in _results_in_words(screening, limit, measures)]
    title = (
        f"{end.capitalize()} fragility of {structure}"
        if len(limits) == 1
        else f"Fragility of {structure}"
    )
    return Captioned(figure, title, _caption(screening, structure, told, states))


#: Largest number of panels side by side, if there are several limit states.
_ACROSS: Final = 4
#: Style of the curve of overturning beside those of other limit states.
_BESIDE: Final[Mapping[str, Any]] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}


def _handles(end: str, *, several: bool) -> list[Line2D | Patch]:
    """Return the entries of the legend; `end` is overturning, or the collapse of bridges."""
    curve = "limit state" if several else end
    handles: list[Line2D | Patch] = [Line2D([], [], color="C0", label=curve)]
    if several:
        handles.append(Line2D([], [], label=end, **_BESIDE))
    return [
        *handles,
        Patch(facecolor="C0", alpha=0.2, linewidth=0, label="90 % confidence"),
        Line2D([], [], linestyle="", marker="o", color="0.35", markersize=3.5,
               label="observed shares"),
    ]  # fmt: skip


def _draw_curve(axes: Axes, fit: xr.Dataset, measure: Measure, **style: Any) -> None:
    """Draw the curve of a fit, if there is one."""
    if int(fit["fragility_outcome"]) == Outcome.FITTED:
        axes.plot(fit["fragility_intensity"] / measure.printed, fit["fragility"], **style)


def _draw_state(axes: Axes, fit: xr.Dataset, limit: LimitState, measure: Measure) -> None:
    """Draw the curve of one limit state, its band and its observed shares; name its median."""
    intensity = fit["fragility_intensity"].values / measure.printed
    low, high = fit["fragility_low"], fit["fragility_high"]
    axes.fill_between(intensity, low, high, color="C0", alpha=0.2, linewidth=0)
    _draw_curve(axes, fit, measure, color="C0")
    outcome = Outcome(int(fit["fragility_outcome"]))
    if outcome is Outcome.FITTED:
        median = float(fit["fragility_median"]) / measure.printed
        words = f"median {f'{median:#.3g}'.rstrip('.')} {measure.unit}"
        axes.plot([median, median, intensity[0]], [0.0, 0.5, 0.5], color="C0", linewidth=0.6,
                  linestyle=":")  # fmt: skip
    else:
        words = f"no curve: {outcome.name.lower().replace('_', ' ')}"
        if outcome is Outcome.UNDETERMINED:
            words = outcome.sentence
        if limit.quantity:
            words = words.replace("overturn", "reach it")
    axes.set_title(words, fontsize=7, fontweight="normal", pad=3)
    axes.plot(
        fit["bin_intensity"] / measure.printed,
        fit["bin_share"],
        "o",
        color="0.35",
        markersize=3.5,
        clip_on=False,
    )


def _set_axes(axes: Axes, fit: xr.Dataset, measure: Measure, *, width: float) -> None:
    """Set the limits, labels and ticks of a panel of some width [inch]."""
    intensity = fit["fragility_intensity"].values / measure.printed
    wide = width / float(np.log10(intensity[-1] / intensity[0])) > _WIDE
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if wide else (1.0,)))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(intensity[0], intensity[-1])
    axes.set_ylim(0.0, 1.0)
    axes.yaxis.set_major_locator(FixedLocator([0.0, 0.25, 0.5, 0.75, 1.0]))
    symbol = measure.symbol if "_" not in measure.symbol else f"${measure.symbol}$"
    axes.set_xlabel(f"{symbol}  [{measure.unit}]" if measure.unit else symbol)


#: Width of a decade [inch] above which its numbers 2 and 5 have labels.
_WIDE: Final = 0.95


def _results_in_words(
    screening: xr.Dataset, limit: LimitState, measures: list[Measure]
) -> list[str]:
    told, logistic = [], fragility_curve(screening) == "logistic"
    for measure in measures:
        fit = screening.sel(measure=measure.name, limit_state=limit.name)
        outcome = Outcome(int(fit["fragility_outcome"]))
        words = limit.words if limit.quantity else ""
        if outcome is Outcome.FITTED:
            scale = f" (logistic scale {float(fit['fragility_logistic_scale']):.3g})"
            told.append(
                f"{measure.symbol}: half {f'reach {words}' if words else 'overturn'} at "
                f"{float(fit['fragility_median']) / measure.printed:.3g} {measure.unit}, "
                f"lognormal β {float(fit['fragility_lognormal_beta']):.3g}"
                f"{scale if logistic else ''}, pseudo R² "
                f"{float(fit['fragility_pseudo_r2']):.2f}"
            )
        else:
            told.append(f"{measure.symbol}: {result_in_words(fit, limit, measure)}")
    return told


def _caption(
    screening: xr.Dataset, structure: str, told: list[str], states: Sequence[Sequence[LimitState]]
) -> str:
    recordings = np.unique(screening["cluster"].values).size
    scales, members = screening["scale"].values, members_of(screening)
    each = "the stated structure alone (nominal)" if members == 1 else f"{members} members each"
    kind = kind_row(screening)
    overturns = "overturns" if screening.sizes["limit_state"] == 1 else "reaches each limit state"
    better = str(screening["better_measure"].item())
    equal = "".join(
        f"{title_of_states(state).capitalize()}. " for state in states if len(state) > 1
    )
    named = f"The better measure is {better}" if better else "No better measure is named"
    return (
        f"{_left_out(screening)}"
        f"Probability that {structure} {in_verb_of(kind, overturns)}, "
        f"{fragility_curve(screening)} in the intensity, of maximum likelihood, from "
        f"{' or '.join(map(str, motions_that_count(screening)))} motions of {recordings} "
        f"recordings at {scales.size} scales from {scales[0]:g} to {scales[-1]:g}, {each}; shaded, "
        "90 % confidence with all scales and components of a recording as one observation, or what "
        "is left open where there is no curve; dots, observed shares in classes of equal numbers; "
        f"dotted, the median. {in_verb_of(kind, equal)}{in_verb_of(kind, '; '.join(told))}. "
        f"{named}: {screening['better_measure_reason'].item()}."
    )


def _left_out(screening: xr.Dataset) -> str:
    """Return the motions that were left out, as the first sentence of a caption."""
    return f"{words} " if (words := left_out_motions(screening)) else ""


def draw_peak_distribution(screening: xr.Dataset) -> Captioned:
    """Draw the distribution of peak rotations with its confidence band.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`, for one structure.
    """
    level = screening["level"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(
            level,
            screening["peak_share_low"],
            screening["peak_share_high"],
            step="post",
            color="C0",
            alpha=0.2,
            linewidth=0,
        )
        axes.step(level, screening["peak_share"], where="post")
        axes.axvline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        axes.set_xlim(float(level[0]), _axis_end(screening))
        axes.set_title(label_of(str(screening["structure"].item())), fontsize=8)
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel(r"peak rotation  $\theta\,/\,\alpha$")
        whose = "motions" if members_of(screening) == 1 else "responses"
        axes.set_ylabel(f"share of {whose} at or below")
    structure = str(screening["structure"].item())
    scale = float(screening["reference_scale"])
    at = int(np.flatnonzero(screening["scale"].values == scale)[0])
    share = _share_overturned(screening.isel(scale=at))
    recordings = np.unique(screening["cluster"].values).size
    caption = (
        f"{_left_out(screening)}"
        f"Share of {responses_in_words(screening)} of {recordings} recordings, at scale "
        f"{scale:g}, in which the peak rotation of {structure} is at most θ/α; "
        f"{100.0 * share:.0f} % overturn, so that the curve ends at {1.0 - share:.2f}. Shaded: "
        "90 % confidence, by drawing recordings with replacement, each with all its members; where "
        "Wilson's interval for their number is wider, that one."
    )
    return Captioned(figure, f"Peak rotations of {structure}", caption)


def _share_overturned(screening: xr.Dataset) -> float:
    """Return the share of motions and members that overturn one structure at one scale."""
    if "overall_share_overturned" in screening:
        return float(screening["overall_share_overturned"])
    counts = screening["verdict_count"].values
    return float(counts[Verdict.OVERTURNS] / counts.sum())


def _axis_end(screening: xr.Dataset) -> float:
    """Return the end of the axis: the last level if a motion overturns, else the largest peak."""
    level, share = screening["level"].values, screening["peak_share"].values
    if share[-1] < 1.0:
        return float(level[-1])
    return min(float(level[-1]), 1.5 * float(level[int(np.argmax(share >= share[-1]))]) + 0.05)
