"""Overturning spectra of pulses, rocking spectra of records, and drift over the size of columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import (
    FixedLocator,
    FormatStrFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
)
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.figures.captioned import (
    LINES,
    PRINT_WIDTH,
    Captioned,
    label_of,
    styled,
    wavelet_words,
)
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.response import rocking_spectrum_dataset, spectrum_dataset
from rockframe.rocking import (
    GroundAcceleration,
    Verdict,
    overturning_spectrum,
    respond_many,
    rocking_spectrum,
)
from rockframe.selection.target import TargetSpectrum
from rockframe.units import GRAVITY
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Shades of the map: frame stands, overturns after an impact, overturns without impact.
_SHADES: Final = ("#ffffff", "#e3e3e3", "#bdbdbd")
#: If a curve has fewer points than this, its points are marked.
_FEW: Final = 30
#: A mass ratio above this represents the limit of an infinitely heavy beam.
_HEAVY: Final = 1e12

#: Slendernesses [degrees] and mass ratios of Figure 9; the last ratio represents a very heavy beam.
#: The ratios are assumed: the paper does not state them.
_SLENDERNESSES: Final = (10.0, 14.0)
_MASS_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, 1e15)
#: Limits of the axes of Figure 9 [1].
_FREQUENCY_RATIOS: Final = (1.0, 8.0)
_AMPLITUDES: Final = (1.0, 15.0)
#: Relative tolerance of its curves [1]: less than a hundredth of the width of a line.
_TOLERANCE: Final = 1e-6


def draw_figure_9(*, grid: int = 400) -> Captioned:
    """Draw Figure 9 of the paper.

    Parameters
    ----------
    grid : int
        Points along each side of a map.
    """
    spectrum = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(_SLENDERNESSES),
        _MASS_RATIOS,
        np.linspace(*_FREQUENCY_RATIOS, grid),
        np.linspace(*_AMPLITUDES, grid),
        tolerance=_TOLERANCE,
    )
    return draw_overturning_spectra(spectrum_dataset(spectrum))


def draw_overturning_spectra(dataset: xr.Dataset) -> Captioned:
    """Draw the smallest overturning amplitudes over the map of the lightest beam.

    Parameters
    ----------
    dataset : Dataset
        As returned by `spectrum_dataset`. The figure has a column of panels for each wavelet, a row
        for each slenderness and a curve for each mass ratio.
    """
    wavelets, alphas = dataset["wavelet"].values, dataset["slenderness"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 4.1), layout="constrained")
        panels = figure.subplots(
            len(alphas), len(wavelets), sharex=True, sharey=True, squeeze=False
        )
        for row, alpha in zip(panels, alphas, strict=True):
            for panel, wavelet in zip(row, wavelets, strict=True):
                _draw_overturning(panel, dataset.sel(wavelet=wavelet, slenderness=alpha))
                name = str(wavelet).removesuffix("_ricker").replace("_", " ")
                panel.set_title(f"{name}, {math.degrees(alpha):.3g}°", fontsize=7, pad=3)
        for panel in panels[-1]:
            panel.set_xlabel(r"$\omega_p\,/\,p$", fontsize=8)
        for panel in panels[:, 0]:
            panel.set_ylabel(r"$a_p\,/\,(g\,\tan\alpha)$", fontsize=8)
        handles = [*panels[0, 0].get_lines(), *_patches(float(dataset["mass_ratio"][0]))]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=7)
    return Captioned(
        figure, "Figure 9: minimum overturning acceleration spectra", _caption(dataset)
    )


def _draw_overturning(panel: Axes, panel_of: xr.Dataset) -> None:
    ratio, amplitude = panel_of["frequency_ratio"].values, panel_of["amplitude"].values
    few = ratio.size < _FEW  # mark points, and show the first and last cells in full
    lightest = panel_of["overturning"].isel(mass_ratio=0).transpose("amplitude", "frequency_ratio")
    edges = _edges(ratio)
    panel.pcolorfast(
        edges,
        _edges(amplitude),
        lightest.values,
        cmap=ListedColormap(_SHADES),
        vmin=0,
        vmax=len(_SHADES) - 1,
    )
    for i, gamma in enumerate(panel_of["mass_ratio"].values):
        least = panel_of["minimum_overturning_amplitude"].isel(mass_ratio=i).values
        panel.plot(
            *((ratio, least) if few else _extended_to_top(ratio, least, amplitude[-1])),
            label=_gamma(gamma),
            linestyle=LINES[i % len(LINES)],
            linewidth=0.9,
            marker="." if few else "",
        )
    panel.set_xlim((edges[0], edges[-1]) if few else (ratio[0], ratio[-1]))
    panel.set_ylim(0.0, amplitude[-1])
    panel.yaxis.set_major_locator(MaxNLocator(3, integer=True))
    panel.grid(visible=False)
    panel.tick_params(labelsize=7)


def _extended_to_top(
    ratio: NDArray[np.float64], least: NDArray[np.float64], top: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Extend a curve to the top of the panel, between its last point and the next."""
    finite = np.flatnonzero(np.isfinite(least))
    if not finite.size or finite[-1] + 1 >= ratio.size:
        return ratio, least
    end = finite[-1] + 1
    leaves = 0.5 * (ratio[end - 1] + ratio[end])
    return np.append(ratio[:end], leaves), np.append(least[:end], top)


def _edges(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edges of cells, half-way between nodes that may be unevenly spaced."""
    if nodes.size == 1:
        return np.asarray([nodes[0] - 0.5, nodes[0] + 0.5])
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    return np.asarray([2.0 * nodes[0] - middle[0], *middle, 2.0 * nodes[-1] - middle[-1]])


def _gamma(gamma: float) -> str:
    return "γ → ∞" if gamma > _HEAVY else f"γ = {gamma:g}"


def _patches(lightest: float) -> list[Patch]:
    words = ("after an impact", "without impact")
    return [
        Patch(facecolor=shade, label=f"{_gamma(lightest)}: overturns {word}")
        for shade, word in zip(_SHADES[1:], words, strict=True)
    ]


def _caption(dataset: xr.Dataset) -> str:
    ratio, amplitude = dataset["frequency_ratio"].values, dataset["amplitude"].values
    gammas = ", ".join(
        "∞" if gamma > _HEAVY else f"{gamma:g}" for gamma in dataset["mass_ratio"].values
    )
    alphas = " and ".join(f"{math.degrees(a):.3g}" for a in dataset["slenderness"].values)
    pulses = wavelet_words(" and ".join(map(str, dataset["wavelet"].values)))
    return (
        "Least amplitude a_p / (g tan α) of a pulse that overturns a frame of rectangular columns, "
        f"over ω_p / p with p of the column alone, for mass ratios γ = {gammas}; slenderness α = "
        f"{alphas} degrees, {pulses} pulses, restitution by eq (43). Where a curve ends, nothing "
        f"up to {amplitude[-1]:g} overturns. Shaded: all amplitudes that overturn the frame of the "
        "first mass ratio; white areas above its curve are islands in which the frame stands. Each "
        f"panel and mass ratio is a map of {ratio.size} x {amplitude.size} responses, with edges "
        f"refined to a share of 1e-6; intervals thinner than {np.diff(amplitude).max():.2g} may be "
        "missed. No record is used."
    )


#: Slendernesses of the rocking spectra of one record [degrees]; first value, last value and number
#: of 2 pi / p [s].
_ROCKING: Final = (6.0, 10.0, 14.0, 20.0)
_PERIODS: Final = (2.0, 15.0, 261)
#: Slendernesses that are closer to that of the structure are not drawn [rad].
_APART: Final = math.radians(0.25)


def draw_record_spectrum(
    record: Record, frame: RockingFrame, motion: GroundAcceleration | None = None
) -> Captioned:
    """Draw the rocking spectra of a record, for the slenderness and the mass ratio of a frame.

    Curves of four other slendernesses show how much it matters.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame, without tendons and dissipaters.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.

    Raises
    ------
    ParameterError
        If the frame has tendons or dissipaters.
    """
    _require_free(frame, "Rocking spectra")
    beside = [angle for angle in np.radians(_ROCKING) if abs(angle - frame.slenderness) > _APART]
    alphas, periods = sorted([frame.slenderness, *beside]), np.linspace(*_PERIODS)
    spectra = rocking_spectrum([motion or record], alphas, [frame.mass_ratio], periods)
    shown = rocking_spectrum_dataset([record.record_id], spectra)
    vertical = motion is not None and motion.vertical is not None
    return draw_rocking_spectrum(shown, frame, vertical=vertical)


def _require_free(frame: RockingFrame, figure: str) -> None:
    if frame.restrained:
        raise ParameterError(
            f"Frame {frame.name!r} has tendons or dissipaters. {figure} are of frames without "
            "them: choose another structure."
        )


def _unlike(frame: RockingFrame) -> str:
    """Return the sentence of a caption about what a marked frame does not share with the curves."""
    shared = {
        "rectangular columns": frame.column_section == "rectangular" and frame.prismatic,
        "the restitution of eq (43)": frame.restitution_factor == 1.0,
        "columns whose edges do not crush": frame.before_crushing is None,
        "a deck without abutments": frame.abutment is None,
    }
    lacking = [words for words, same in shared.items() if not same]
    return (
        f" The curves are not those of {frame.name} itself: they have {' and '.join(lacking)}."
        if (lacking)
        else ""
    )


def draw_rocking_spectrum(
    dataset: xr.Dataset, frame: RockingFrame | None = None, *, vertical: bool = False
) -> Captioned:
    """Draw peaks over 2 pi / p for each slenderness; curves have gaps where the frame overturns.

    Parameters
    ----------
    dataset : Dataset
        As returned by `rocking_spectrum_dataset`, for one record and mass ratio.
    frame : RockingFrame, optional
        A frame whose slenderness and 2 pi / p are marked.
    vertical : bool
        True if the vertical motion shakes the columns, too.
    """
    spectra = dataset.squeeze(("record", "mass_ratio"))
    period = spectra["column_period"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.8), layout="constrained")
        panels = figure.subplots(2, 1, sharex=True)
        for panel, name in zip(panels, ("peak_rotation_ratio", "peak_velocity"), strict=True):
            _draw_rocking(panel, spectra, name, frame)
        panels[0].axhline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        panels[0].set_title(label_of(str(spectra["record_id"].item())), fontsize=8)
        panels[0].set_ylabel("largest |θ|/α")
        panels[1].set_ylabel(r"largest $|\dot\theta|$ [rad s$^{-1}$]")
        panels[1].set_xlabel(r"$2\pi/p$ of a column [s]")
        panels[1].set_xlim(period[0], period[-1])
        for panel in panels:
            panel.set_ylim(bottom=0.0)
        figure.align_ylabels(list(panels))
        handles, _ = panels[0].get_legend_handles_labels()
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        f"Largest rotation over the slenderness, and largest rate, under record "
        f"{spectra['record_id'].item()}, {'with' if vertical else 'without'} its vertical "
        "motion, free rocking after its end included, over 2π/p of the columns "
        f"from {period[0]:g} to {period[-1]:g} s ({period.size} values), for the slendernesses α "
        f"named and mass ratio γ = {float(spectra['mass_ratio']):g}; rectangular columns, "
        "restitution by eq (43). A curve has gaps where the frame overturns; where it is jagged, "
        "the peak depends on which impacts come first, and more periods would show more teeth."
    )
    if frame is not None:
        caption += (
            f" Black: the slenderness of {frame.name}; the line marks 2π/p of its columns, "
            f"{2.0 * math.pi / frame.frequency_parameter:.3g} s.{_unlike(frame)}"
        )
    return Captioned(figure, "Rocking spectra", caption)


def _draw_rocking(panel: Axes, spectra: xr.Dataset, name: str, frame: RockingFrame | None) -> None:
    stands = spectra["verdict"] != Verdict.OVERTURNS
    if frame is not None:
        period = 2.0 * math.pi / frame.frequency_parameter
        panel.axvline(period, color="black", linewidth=0.6)
    for i, alpha in enumerate(spectra["slenderness"].values):
        own = frame is not None and alpha == frame.slenderness
        peaks = np.where(stands.isel(slenderness=i), spectra[name].isel(slenderness=i), np.nan)
        panel.plot(
            # a thin line, because a heavy one fills the teeth of irregular responses
            spectra["column_period"],
            peaks,
            label=f"α = {math.degrees(alpha):.3g}°"
            + (f", {label_of(frame.name)}" if own and frame else ""),
            color="black" if own else f"C{i}",
            linestyle="-" if own else LINES[i % len(LINES)],
            linewidth=1.2 if own else 0.8,
        )


#: Heights of columns [m] and scales of the records of the figure of drifts. Single responses are
#: irregular, so each record is taken at many scales.
_HEIGHTS: Final = np.geomspace(2.5, 80.0, 21)
_SCALES: Final = np.geomspace(0.8, 1.25, 21)
#: Slendernesses beside that of the structure [degrees].
_BESIDE: Final = (8.0, 11.0, 14.0)
#: Largest share that overturns [1] of columns whose median is compared with that of the highest.
_FEW_FALL: Final = 0.1


def draw_drift_by_size(
    records: Sequence[Record],
    frame: RockingFrame,
    motions: Sequence[GroundAcceleration] | None = None,
) -> Captioned:
    """Draw the median drift of columns, and the share that overturns, over their height.

    There is a curve for the slenderness of a frame, and others for other slendernesses; all have
    its mass ratio.

    Parameters
    ----------
    records : sequence of Record
        The ground motions, all of which count equally.
    frame : RockingFrame
        The frame, without tendons and dissipaters.
    motions : sequence of GroundAcceleration, optional
        Motions of the ground, if they include more than the records: with vertical acceleration.

    Raises
    ------
    ParameterError
        If the frame has tendons or dissipaters.
    """
    _require_free(frame, "Drifts over the size")
    vertical = motions is not None and all(ground.vertical is not None for ground in motions)
    alphas = [frame.slenderness]
    alphas += [
        angle for angle in np.radians(_BESIDE).tolist() if abs(angle - frame.slenderness) > _APART
    ]
    told = []
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 4.0), layout="constrained")
        panels = figure.subplots(2, 1, sharex=True)
        for i, alpha in enumerate(sorted(alphas)):
            drift, fallen = _drifts(motions or records, alpha, frame.mass_ratio)
            own = alpha == frame.slenderness
            label = f"α = {math.degrees(alpha):.3g}°" + (f", {label_of(frame.name)}" if own else "")
            style = {"color": "black" if own else f"C{i}", "linestyle": "-" if own else LINES[i]}
            panels[0].plot(
                _HEIGHTS, np.where(np.isfinite(drift), drift, np.nan), label=label, **style
            )
            panels[1].plot(_HEIGHTS, fallen, **style)
            told.append(_change(alpha, drift, fallen))
        for panel in panels:
            panel.axvline(frame.height, color="black", linewidth=0.6)
            panel.set_ylim(bottom=0.0)
        panels[0].set_ylabel("median drift  u  [m]")
        panels[1].set_ylabel("share that overturns")
        panels[1].set_xscale("log")
        panels[1].set_xlim(_HEIGHTS[0], _HEIGHTS[-1])
        panels[1].xaxis.set_major_locator(FixedLocator([2.5, 5.0, 10.0, 20.0, 40.0, 80.0]))
        panels[1].xaxis.set_major_formatter(FormatStrFormatter("%g"))
        panels[1].xaxis.set_minor_formatter(NullFormatter())
        panels[1].set_xlabel("height of the columns [m]")
        figure.align_ylabels(list(panels))
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        f"Median of the largest drift u, and share that overturns, over the height of columns of "
        f"equal slenderness α and mass ratio γ = {frame.mass_ratio:g}, {len(records)} records, "
        f"{'with' if vertical else 'without'} their vertical motion, at "
        f"{_SCALES.size} scales from {_SCALES[0]:g} to {_SCALES[-1]:g}, {_HEIGHTS.size} heights "
        f"from {_HEIGHTS[0]:g} to {_HEIGHTS[-1]:g} m; rectangular columns, restitution by eq "
        "(43). Structures that overturn count as an infinite drift. Far from overturning, the "
        "equation of motion of u contains the slenderness but no size. "
        f"{' '.join(told)} Black: the slenderness of {frame.name}; the line marks its height, "
        f"{frame.height:g} m.{_unlike(frame)}"
    )
    return Captioned(figure, "Drift over the size of columns", caption)


def _drifts(
    motions: Sequence[Record] | Sequence[GroundAcceleration], alpha: float, gamma: float
) -> tuple[Float, Float]:
    """Return the median drift [m] of columns of each height, and the share that overturns."""
    frames = [
        RockingFrame(height=height, width=height * math.tan(alpha), mass_ratio=gamma)
        for height in _HEIGHTS.tolist()
    ]
    peaks = respond_many(motions, frames, _SCALES)
    fell = peaks.verdict == Verdict.OVERTURNS
    rotations = peaks.peak_rotation.swapaxes(0, 1)
    drift = [
        frame.horizontal_displacement(rotation)
        for frame, rotation in zip(frames, rotations, strict=True)
    ]
    median = np.median(np.where(fell.swapaxes(0, 1), np.inf, drift), axis=(1, 2))
    return median, fell.mean(axis=(0, 2))


def _change(alpha: float, drift: Float, fallen: Float) -> str:
    """Return how much the median drift changes with the height where few overturn."""
    few = fallen <= _FEW_FALL
    if not few[-1]:
        return f"α = {math.degrees(alpha):.3g}°: too many overturn at any height."
    first = int(np.flatnonzero(~few)[-1]) + 1 if not few.all() else 0
    apart = float(np.abs(drift[first:] / drift[-1] - 1.0).max())
    return (
        f"α = {math.degrees(alpha):.3g}°: from {_HEIGHTS[first]:.3g} m on, where at most "
        f"{100.0 * _FEW_FALL:.0f} % overturn, the median is within {100.0 * apart:.0f} % of the "
        f"{drift[-1]:.3g} m at {_HEIGHTS[-1]:g} m."
    )


def draw_selection(target: TargetSpectrum, log_sa: NDArray[np.float64]) -> Captioned:
    """Draw the spectra of selected motions, their median and 16 and 84 % values, and the target.

    Parameters
    ----------
    target : TargetSpectrum
        The target.
    log_sa : array, shape (motions, periods)
        Natural logarithm of the spectra of the scaled motions in m s-2.
    """
    spread = log_sa.std(axis=0, ddof=1 if len(log_sa) > 1 else 0)
    both = [(log_sa.mean(axis=0), spread, "C0", "selected")]
    if target.deviation is not None:
        both.append((target.log_sa, target.deviation, "black", "target"))
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.2), layout="constrained")
        panel = figure.subplots()
        each = np.exp(log_sa) / GRAVITY
        panel.loglog(target.period, each.T, color="0.75", linewidth=0.5)
        panel.lines[0].set_label("motions")
        for mean, deviation, color, name in both:
            for sign in (-1.0, 1.0):
                edge = np.exp(mean + sign * deviation) / GRAVITY
                label = f"{name}, 16 and 84 %" if sign < 0.0 else None
                panel.plot(target.period, edge, "--", color=color, linewidth=0.9, label=label)
        aim, median = (np.exp(x) / GRAVITY for x in (target.log_sa, log_sa.mean(axis=0)))
        panel.plot(target.period, aim, color="black", linewidth=1.6, label="target, median")
        panel.plot(target.period, median, color="C0", linewidth=1.2, label="selected, median")
        if target.conditioning_period:
            panel.axvline(target.conditioning_period, color="0.6", linewidth=0.8, linestyle=":")
        panel.set_xlabel("period [s]")
        panel.set_ylabel("Sa, 5 % damped [g]")
        panel.set_xlim(target.period[0], target.period[-1])
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FormatStrFormatter("%g"))
            axis.set_minor_formatter(NullFormatter())
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        f"Pseudo-spectral acceleration, 5 % damped, of {len(log_sa)} scaled motions at "
        f"{target.period.size} periods, their median and their 16 and 84 % values (one standard "
        f"deviation of ln Sa below and above the mean), and the target: {target.words}."
    )
    if target.deviation is None:
        caption += " The target has no spread."
    if target.conditioning_period:
        caption += f" The dotted line marks {target.conditioning_period:g} s, where it is given."
    return Captioned(figure, "Spectra of the selected motions", caption)
