"""Accelerograms and response histories: all structures under one record, and Figure 11."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from rockframe.figures.captioned import (
    DRAWN_TO,
    LINES,
    PAGE_WIDTH,
    Captioned,
    label_of,
    of_structure,
    styled,
    time_limits,
    wavelet_words,
)
from rockframe.matching.match import PulseMatch
from rockframe.record import Record
from rockframe.results.schema.response import Validity
from rockframe.rocking import Response, SpreadVerdict, Verdict
from rockframe.rocking.verdict import MODEL_ENDS, ModelEnd
from rockframe.study.kinds import declared_kind
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

Float = NDArray[np.float64]

#: Time that is drawn before the first and after the last visible rocking [s]; rotation over
#: slenderness above which rocking is visible [1].
_MARGIN: Final = 3.0
_VISIBLE: Final = 0.005
#: Shares of the ensemble that a verdict states.
_SHARES: Final = ("share_overturned", "share_uplifted", "share_model_ends")


def draw_response_history(
    acceleration: Float,
    match: PulseMatch | None,
    histories: Sequence[Dataset],
    title: str,
    *,
    tested: str = "",
) -> Figure:
    """Draw accelerogram, matched pulse, theta/alpha, v and u of one record.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2] at the histories' times.
    match : PulseMatch or None
        The matched pulse, if any.
    histories : sequence of Arrays or xarray.Dataset
        As returned by ``open_response(...).history`` or ``.sel``, one for each structure.
    title : str
        First line of the figure.
    tested : str
        Result of the test of the pulse against noise, as `pulse_words` returns it.

    Returns
    -------
    matplotlib.figure.Figure
        Panels over one time axis; if several structures lift off, each has a panel of its uplift.
    """
    lifting = [each for each in histories if np.nanmax(each["v"].values, initial=0.0) > 0.0]
    apart = len(lifting) > 1
    small = max(_SMALL, _LIFTS / max(len(lifting), 1)) if apart else 1.2
    heights = [1.4, 1.6, *[small] * (len(lifting) if apart else 1), 1.3]
    with styled():
        # a line of the legend for each structure
        size = (7.2, 1.2 + sum(heights) + 0.16 * (3 + len(histories)))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        ground, rotation, *uplift, drift = panels
        time = histories[0]["time"].values
        _draw_ground(ground, time, acceleration, match, tested)
        own = dict(zip([str(each["structure"].values) for each in lifting], uplift, strict=False))
        for k, history in enumerate(histories):
            panel = own.get(str(history["structure"].values)) if apart else uplift[0]
            _draw_structure((rotation, panel, drift), history, k)
        if apart:
            _name_uplifts(own)
        else:
            uplift[0].set_ylabel("uplift  v [cm]")
        figure.suptitle(label_of(title), x=0.01, ha="left", fontsize=10, fontweight="bold")
        rotation.set_ylabel("rotation  θ/α")
        drift.set_ylabel("drift  u [cm]")
        rotation.axhline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        rotation.axhline(-1.0, color="0.6", linewidth=0.8, linestyle=":")
        rotation.set_ylim(*_rotation_limits(histories))
        drift.set_xlabel("time [s]")
        drift.set_xlim(*_window(time, histories))
        _align_labels(figure, panels)
        handles: list[Artist] = [*rotation.get_legend_handles_labels()[0]]
        if any(np.isfinite(history["overturning_time"].values) for history in histories):
            falling = f"beyond {DRAWN_TO:g} α, falling: drawn no further"
            handles.append(Line2D([], [], color="0.4", marker="x", linestyle="", label=falling))
        if any("theta_low" in history for history in histories):
            shaded = "lines: nominal; shaded: 16 to 84 % of the ensemble of plausible structures"
            handles.append(Patch(facecolor="0.4", alpha=0.2, label=shaded))
        figure.legend(handles=handles, loc="outside lower center")
    return figure


#: Distance of a label from its axis [pt]; numbers of six characters fit between.
_TO_LABEL: Final = 40.0


def _align_labels(figure: Figure, panels: Sequence[Axes]) -> None:
    """Place the labels of panels below each other.

    Matplotlib would measure the numbers of all panels for each of them, which takes a fifth of the
    time of the figure.
    """
    for panel in panels:
        beside = offset_copy(panel.transAxes, figure, x=-_TO_LABEL, units="points")
        panel.yaxis.set_label_coords(0.0, 0.5, transform=beside)
        panel.ticklabel_format(axis="y", scilimits=(-2, 4))  # numbers stay short


#: Heights of all panels of uplift together, and of one of them at least [inch].
_LIFTS: Final = 2.6
_SMALL: Final = 0.4


def _name_uplifts(panels: Mapping[str, Axes]) -> None:
    """Name the panels of the uplift of each structure, and give them one scale."""
    highest = max(panel.get_ylim()[1] for panel in panels.values())
    for name, panel in panels.items():
        panel.set_ylim(-0.03 * highest, highest)
        panel.set_ylabel("v [cm]", fontsize=8)
        panel.annotate(f"uplift of {name}", (0.99, 0.95), xycoords="axes fraction", fontsize=7,
                       ha="right", va="top")  # fmt: skip


def _draw_ground(
    panel: Axes,
    time: Float,
    acceleration: Float,
    match: PulseMatch | None,
    tested: str,
) -> None:
    panel.plot(time, acceleration / GRAVITY, color="0.55", linewidth=0.7, label="ground")
    largest = float(np.abs(acceleration).max())
    if match is not None:
        _draw_pulse(panel, match, tested)
        largest = max(largest, match.pulse.a_p)
    panel.set_ylabel("ground  [g]")
    panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
    panel.set_ylim(-1.1 * largest / GRAVITY, 1.1 * largest / GRAVITY)
    _draw_metric_axis(panel)


def _draw_metric_axis(panel: Axes) -> None:
    """Draw an axis of m s-2 on the right of a panel of accelerations in g."""
    metric = panel.secondary_yaxis(
        "right", functions=(lambda g: np.multiply(g, GRAVITY), lambda a: np.divide(a, GRAVITY))
    )
    metric.set_ylabel("[m s$^{-2}$]")


def _draw_pulse(panel: Axes, match: PulseMatch, tested: str) -> None:
    pulse = match.pulse
    reach = pulse.mother.reach * pulse.T_p
    near = np.linspace(pulse.time - reach, pulse.time + reach, 400)
    name = wavelet_words(pulse.wavelet)
    label = f"{name}:  $a_p$ = {pulse.a_p / GRAVITY:.2f} g,  $T_p$ = {pulse.T_p:.2f} s, "
    if match.at_period_bound:
        label += "end of range"
    else:
        label += f"match {match.match_index:.2f}" + (f"\n{tested}" if tested else "")
    panel.plot(near, pulse.acceleration(near) / GRAVITY, color="black", linewidth=1.8, label=label)


def _draw_structure(panels: Sequence[Axes | None], history: Dataset, number: int) -> None:
    """Draw theta/alpha, v and u of a structure in the panels that there are."""
    time = history["time"].values
    verdict = _verdict_in(history)
    label = label_of(f"{history['structure'].values}: {verdict.sentence}")
    colours = len(rcParams["axes.prop_cycle"])
    colour, line = f"C{number}", LINES[number // colours % len(LINES)]
    series = (history[name].values for name in ("theta", "v", "u"))
    drawn = _until_falling(float(history["slenderness"].values), *series)
    for panel, values in zip(panels, drawn, strict=True):
        if panel is None:
            continue
        panel.plot(time[: values.size], values, label=label, color=colour, linestyle=line)
        if verdict.overturns and values.size:
            panel.plot(time[values.size - 1], values[-1], marker="x", color=colour)
    if "theta_low" in history and panels[0] is not None:
        _draw_envelope(panels[0], history, colour)


def _draw_envelope(panel: Axes, history: Dataset, colour: Any) -> None:
    """Draw the middle 68 % of the ensemble's rotations until it leaves the panel."""
    slenderness = float(history["slenderness"].values)
    low, high = (history[name].values / slenderness for name in ("theta_low", "theta_high"))
    beyond = ~((low >= -DRAWN_TO) & (high <= DRAWN_TO))
    end = int(np.argmax(beyond)) if beyond.any() else beyond.size
    time = history["time"].values[:end]
    panel.fill_between(time, low[:end], high[:end], alpha=0.2, linewidth=0.0, color=colour)


def _verdict_in(history: Dataset) -> SpreadVerdict:
    """Return the verdict of a dataset of one record and structure."""

    def number(name: str) -> float | None:
        return float(history[name].values) if name in history else None

    shares: dict[str, Any] = {name: number(name) for name in _SHARES if name in history}
    return SpreadVerdict(
        Verdict(int(history["verdict"].values)),
        overturning_time=float(history["overturning_time"].values),
        robust_scale=number("robust_scale_10"),
        critical_scale=number("critical_scale"),
        largest_scale=number("largest_scale") or math.nan,
        **shares,
        model_ends={name: float(history[name].values) for name in MODEL_ENDS if name in history},
        model_end=ModelEnd(int(history["model_end"].values) if "model_end" in history else 0),
        fails=declared_kind(str(history["kind"].values) if "kind" in history else "").fails,
    )


def _until_falling(
    slenderness: float, theta: Float, v: Float, u: Float
) -> tuple[Float, Float, Float]:
    """Return theta / alpha, and v and u [cm], as far as they are drawn; NaN without a rotation."""
    ratio = theta / slenderness
    falls = np.isnan(u) if math.isnan(slenderness) else ~(np.abs(ratio) <= DRAWN_TO)
    end = int(np.argmax(falls)) if falls.any() else falls.size
    return ratio[:end], 100.0 * v[:end], 100.0 * u[:end]


def _rotation_limits(histories: Sequence[Dataset]) -> tuple[float, float]:
    ratios = [float(history["peak_rotation_ratio"].values) for history in histories]
    furthest = max((min(ratio, DRAWN_TO) for ratio in ratios if not math.isnan(ratio)), default=0.0)
    furthest = max(1.08 * furthest, 0.02)
    return -furthest, furthest


def _window(time: Float, histories: Sequence[Dataset]) -> tuple[float, float]:
    moving = np.zeros(time.size, dtype=bool)
    for history in histories:
        ratio = np.abs(history["theta"].values) / float(history["slenderness"].values)
        if np.isnan(ratio).all():  # it does not rock
            drift = np.abs(history["u"].values)
            ratio = drift / max(float(np.nanmax(drift)), np.finfo(float).tiny)
        moving |= np.nan_to_num(ratio) > _VISIBLE
    return time_limits(time, moving, _MARGIN)


#: Number of records side by side; further records are drawn below.
_ACROSS: Final = 3
#: Share of the largest rotation above which rotation is visible [1], and time that is drawn before
#: and after visible rotation [s].
_VISIBLE_IN_GRID: Final = 0.01
_GRID_MARGIN: Final = 1.5
_LABELS: Final = ("ground [g]", "θ/α", "v [cm]", "u [cm]")
_HEIGHTS: Final = (0.8, 1.0, 0.8, 1.0)


def draw_response_grid(
    records: Sequence[Record],
    responses: Sequence[Response],
    titles: Sequence[str],
    *,
    vertical: bool = False,
) -> Captioned:
    """Draw ground acceleration, theta/alpha, v and u of one structure, with a column per record.

    Parameters
    ----------
    records : sequence of Record
        The ground motions.
    responses : sequence of Response
        The response of the structure to each record.
    titles : sequence of str
        Title of each column.
    vertical : bool
        True if the motions include vertical components.
    """
    columns = list(zip(records, responses, titles, strict=True))
    bands = -(-len(columns) // _ACROSS)
    across = min(_ACROSS, len(columns))
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 0.3 + 4.2 * bands), layout="constrained")
        above = None
        for band, part in enumerate(figure.subfigures(bands, 1, squeeze=False)[:, 0]):
            shown = columns[band * across : (band + 1) * across]
            panels = part.subplots(
                4, across, sharex="col", sharey="row", squeeze=False, height_ratios=_HEIGHTS
            )
            if above is not None:  # panels of one kind share one scale
                for panel, other in zip(panels[:, 0], above[:, 0], strict=True):
                    panel.sharey(other)
            above = panels
            for column in range(across):
                if column >= len(shown):
                    for panel in panels[:, column]:
                        panel.set_visible(False)
                    continue
                record, response, title = shown[column]
                _draw_column(panels[:, column], record, response)
                panels[0, column].set_title(label_of(title), fontsize=8)
                panels[-1, column].set_xlabel("time [s]")
            _draw_metric_axis(panels[0, len(shown) - 1])
            for panel, label in zip(panels[:, 0], _LABELS, strict=True):
                panel.set_ylabel(label)
            part.align_ylabels(list(panels[:, 0]))
    return Captioned(
        figure,
        "Figure 11: histories of the rocking frame",
        _caption(records, responses, vertical),
    )


def _draw_column(panels: NDArray[np.object_], record: Record, response: Response) -> None:
    time = response.time
    slenderness = response.frame.slenderness
    series = _until_falling(slenderness, response.theta, response.v, response.u)
    panels[0].plot(time, record.acceleration / GRAVITY, color="0.45", linewidth=0.5)
    for panel, values in zip(panels[1:], series, strict=True):
        panel.plot(time[: values.size], values, linewidth=0.9)
    panels[1].annotate(_outcome_words(response), (0.97, 0.96), xycoords="axes fraction", fontsize=7,
                       ha="right", va="top")  # fmt: skip
    ratio = np.abs(series[0])
    visible = ratio > _VISIBLE_IN_GRID * ratio.max(initial=0.0)
    panels[0].set_xlim(*time_limits(time[: ratio.size], visible, _GRID_MARGIN))


def _outcome_words(response: Response) -> str:
    verdict = response.spread_verdict
    return verdict.words if verdict.overturns else f"max {response.peak_rotation_ratio:.3f}"


def _caption(records: Sequence[Record], responses: Sequence[Response], vertical: bool) -> str:
    ground = "Horizontal and vertical" if vertical else "Horizontal"
    parts = []
    for record, response in zip(records, responses, strict=True):
        verdict = response.spread_verdict
        fate = verdict.words
        if not verdict.overturns:
            fate += (
                f", θ/α {response.peak_rotation_ratio:.3f}, u {100.0 * response.peak_u:.1f} cm, "
                f"v {100.0 * response.peak_v:.2f} cm"
            )
        parts.append(f"{record.record_id}: {fate}")
    return (
        "Ground acceleration, rotation θ over slenderness α, uplift v and drift u of the beam; "
        "panels of one kind have one scale. "
        f"{of_structure(responses[0].frame)} {ground} ground motion; eq (26), with the "
        "restitution of eq (43) at each impact. Largest nominal values, free rocking after the "
        f"record included: {'; '.join(parts)}."
    )


#: Time that is drawn after the last visible drift [s], and the share of the largest drift that is
#: visible.
_DRIFT_MARGIN: Final = 2.0
_VISIBLE_DRIFT: Final = 0.1
_OSCILLATORS: Final = ("isolated", "fixed")
#: A falling bridge is drawn up to this multiple of the largest drift of the others.
_FALLING: Final = 1.3
_PANELS: Final = (("u", 100.0, "drift  u [cm]"), ("v", 100.0, "lift  v [cm]"))
#: Number of intervals of the drawn time in each of which the base shear has one range.
_RANGES: Final = 400


def draw_comparison(histories: Dataset) -> Captioned:
    """Draw the histories of all models of one structure under one record.

    Parameters
    ----------
    histories : Dataset
        As returned by `read_histories` of a comparison.
    """
    record, structure = (str(histories[name].values) for name in ("record_id", "structure"))
    time = histories["time"].values
    with styled():
        models = [str(model) for model in histories["model"].values]
        size = (PAGE_WIDTH, 4.2 + 0.7 * len(models))
        figure = Figure(figsize=size, layout="constrained")
        ratios = (2.0, 1.3, *(0.75 for _ in models))
        panels = figure.subplots(2 + len(models), 1, sharex=True, height_ratios=ratios)
        handles = []
        window = _comparison_window(histories)
        reach = _largest_drift(histories)
        for k, model in enumerate(models):
            history = histories.isel(model=k)
            drawn = np.nan_to_num(np.abs(history["u"].values), nan=np.inf) <= _FALLING * reach
            last = time.size if drawn.all() else int(np.argmin(drawn))
            dashes: Literal["--", "-"] = "--" if model in _OSCILLATORS else "-"
            for panel, (name, factor, _) in zip(panels, _PANELS, strict=False):
                panel.plot(
                    time[:last], factor * history[name].values[:last], color=f"C{k}", linewidth=0.8,
                    linestyle=dashes,
                )  # fmt: skip
            _draw_shear(panels[2 + k], time[:last], history["base_shear"].values[:last], window, k)
            ended = Validity(int(history["validity"].values))
            when = float(history["valid_until"].values)
            if np.isfinite(when) and when <= time[-1]:
                at = min(int(np.searchsorted(time, when)), max(last - 1, 0))
                panels[0].plot(time[at], 100.0 * history["u"].values[at], "x", color=f"C{k}")
            at_time = f" at {when:.1f} s" if np.isfinite(when) else ""
            end = ended.name.lower().replace("_", " ")
            words = f"{model}: {end}{at_time}" if ended else model
            handles.append(Line2D([], [], color=f"C{k}", label=words, linestyle=dashes))
        for panel, (_, _, label) in zip(panels, _PANELS, strict=False):
            panel.set_ylabel(label)
        _name_shears(panels[2:], models)
        panels[0].set_title(label_of(f"{structure} under {record}"))
        panels[-1].set_xlabel("time [s]")
        panels[-1].set_xlim(*window)
        figure.align_ylabels(list(panels))
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    title = f"Bridges under {record}"
    caption = (
        f"Drift and lift of the deck of {structure} under record {record}, and for each model the "
        "envelope of the base shear over the weight of deck and columns: its range in each short "
        "interval. Solid: rocking frames; dashed: the same "
        "deck on isolators, and on monolithic columns. A cross marks when the "
        "assumptions of a model fail."
    )
    return Captioned(figure, title, caption)


def _draw_shear(
    panel: Axes, time: Float, shear: Float, window: tuple[float, float], number: int
) -> None:
    """Draw the range of the base shear in each short interval of the drawn time.

    A line would cover the panel, because the shear of rocking bridges changes sign in each impact.
    """
    ends = np.linspace(*window, _RANGES + 1)
    starts = np.unique(np.searchsorted(time, ends))
    starts = starts[starts < time.size]
    if starts.size:
        low, high = (np.append(lowest := part.reduceat(shear, starts), lowest[-1])
                     for part in (np.fmin, np.fmax))  # fmt: skip
        at = np.append(time[starts], time[-1])
        panel.fill_between(at, low, high, step="post", color=f"C{number}", linewidth=0.4)


def _name_shears(panels: Sequence[Axes], models: Sequence[str]) -> None:
    """Name the panels of the base shear, and give them one scale."""
    largest = max(abs(end) for panel in panels for end in panel.get_ylim())
    for panel, model in zip(panels, models, strict=True):
        panel.set_ylim(-1.3 * largest, 1.3 * largest)
        panel.annotate(model, (0.99, 0.93), xycoords="axes fraction", fontsize=7, ha="right",
                       va="top")  # fmt: skip
    panels[len(panels) // 2].set_ylabel("base shear / W")


def _largest_drift(histories: Dataset) -> float:
    """Return the largest drift [m] of bridges that do not overturn, or of all if all overturn."""
    peaks = histories["peak_u"].values
    standing = peaks[np.isfinite(peaks)]
    return float(standing.max() if standing.size else np.nanmax(np.abs(histories["u"].values)))


def _comparison_window(histories: Dataset) -> tuple[float, float]:
    """Return the times that are drawn: from the start to shortly after the last visible drift."""
    time = histories["time"].values
    drift = np.nan_to_num(np.abs(histories["u"].values))
    rocking = drift[[str(model) not in _OSCILLATORS for model in histories["model"].values]]
    moving = rocking if rocking.max() > 0.0 else drift
    return time_limits(time, (moving > _VISIBLE_DRIFT * moving.max()).any(axis=0), _DRIFT_MARGIN)
