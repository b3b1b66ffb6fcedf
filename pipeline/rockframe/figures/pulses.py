"""Pulses: the search over the period, the scalogram, and Figure 8 of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rockframe.figures.captioned import (
    LINES,
    PRINT_WIDTH,
    Captioned,
    label_of,
    plain_ticks,
    printed_pga,
    styled,
    time_limits,
    wavelet_words,
)
from rockframe.matching.match import PulseMatch, best_ricker, match_curve, match_pulses, scalogram
from rockframe.matching.record_pulses import Likeness, likeness
from rockframe.matching.verdict import pulse_words
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

_NAMES: Final = {
    "symmetric_ricker": "symmetric Ricker",
    "antisymmetric_ricker": "antisymmetric Ricker",
    "ricker_any_phase": "Ricker, any phase",
    "mavroeidis_papageorgiou": "Mavroeidis-Papageorgiou",
}


def draw_match_curves(record: Record, options: PulseOptions) -> Captioned:
    """Draw the match index over the period and mark the best match of each wavelet.

    Parameters
    ----------
    record : Record
        The record.
    options : PulseOptions
        Options of the search.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.
    """
    matches = match_pulses(record.acceleration, record.time_step, options)
    periods, curves = match_curve(record.acceleration, record.time_step, options)
    told = []
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.0), layout="constrained")
        axes = figure.subplots()
        for k, (name, curve) in enumerate(curves.items()):
            period, index = matches[name].pulse.T_p, matches[name].match_index
            color = f"C{k}"
            axes.plot(periods, curve, label=_NAMES[name], linestyle=LINES[k], color=color)
            axes.plot(period, index, marker="o", markersize=4, linestyle="", color=color)
            told.append(f"{_NAMES[name]} {index:.3f} at T_p = {period:.3f} s")
        axes.set_xscale("log")
        plain_ticks(axes.xaxis, float(periods[0]), float(periods[-1]))
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("period  $T_p$ [s]")
        axes.set_ylabel("match index")
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        "Largest match index (cosine between record and wavelet) at each period, over all times, "
        f"phases and up to {options.most_half_cycles:g} half cycles. Dots: the best match "
        f"of each wavelet: {'; '.join(told)}. Record {record.record_id}. T_p of "
        "different wavelets cannot be compared."
    )
    return Captioned(figure, "Match index and period", caption)


#: Times are drawn if a coefficient is above this share of the largest coefficient [1].
_SEEN: Final = 0.25
#: Time that is drawn before and after these times [s].
_MARGIN: Final = 2.0
#: Largest numbers of periods and times in the picture.
_PERIODS: Final = 160
_TIMES: Final = 1500


def draw_scalogram(record: Record, options: PulseOptions) -> Captioned:
    """Draw the match index over period and time, and mark the best match.

    Parameters
    ----------
    record : Record
        The record.
    options : PulseOptions
        Options of the search; the better Ricker wavelet of its wavelets is drawn.

    Raises
    ------
    ParameterError
        If there is no Ricker wavelet of fixed phase, the record is constant or not finite, or no
        period is left to search.
    """
    samples, step = record.acceleration, record.time_step
    matches = match_pulses(samples, step, options)
    wavelet = best_ricker(matches)
    tested = likeness(samples, step, matches, options, record.record_id)[wavelet]
    best = matches[wavelet]
    centre, period = best.pulse.time, best.pulse.T_p
    periods = np.geomspace(*options.periods_s, _PERIODS)
    time, indices = _picture(record, wavelet, periods)
    highest = indices.max(axis=0)
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        mesh = axes.pcolormesh(
            time,
            periods,
            indices,
            cmap="Greys",
            vmin=0.0,
            shading="nearest",
            rasterized=True,
        )
        axes.plot(
            centre, period, linestyle="", marker="+", markersize=11, markeredgewidth=1.6, color="C1"
        )
        axes.set_yscale("log")
        ends = float(periods[0]), float(periods[-1])
        axes.set_ylim(*ends)
        plain_ticks(axes.yaxis, *ends)
        axes.set_xlim(*time_limits(time, highest >= _SEEN * highest.max(), _MARGIN))
        axes.grid(visible=False)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("period  $T_p$ [s]")
        bar = figure.colorbar(mesh, ax=axes)
        bar.set_label("match index")
    caption = (
        f"Match index of the {wavelet_words(wavelet)} wavelet, by PyWavelets, at each period and "
        "time: the energy-normalised coefficient divided by the root of the record's energy. "
        f"Cross: the best match, a_p = {best.pulse.a_p / GRAVITY:.3f} g, T_p = {period:.3f} s at "
        f"{centre:.2f} s, {_tested(tested)}, match index {best.match_index:.3f}. "
        f"Record {record.record_id} ({printed_pga(record)})."
    )
    return Captioned(figure, "Wavelet transform", caption)


def _picture(record: Record, wavelet: str, periods: Float) -> tuple[Float, Float]:
    """Return times, and the match index at each period and time."""
    samples, step = record.acceleration, record.time_step
    picture = np.abs(scalogram(samples, step, wavelet, periods))
    picture /= math.sqrt(float(samples @ samples) * step)
    # draw the largest of the skipped times, so that no ridge is lost
    starts = np.arange(0, samples.size, max(1, math.ceil(samples.size / _TIMES)))
    return record.time[starts], np.maximum.reduceat(picture, starts, axis=1)


def _tested(likeness: Likeness) -> str:
    return pulse_words(likeness.verdict, likeness.p_value)


#: Time that is drawn before and after the pulse: as a multiple of its reach [1], and at least [s].
_AROUND: Final = 1.5
_LEAST: Final = 5.0
#: Room for the legend above the curves, as a share of their height.
_FOR_LEGEND: Final = 0.2


#: A record, a pulse in it, and the result of its test against noise.
Tested = tuple[Record, PulseMatch, Likeness]


def draw_record_and_pulse(
    pulses: Sequence[Tested], titles: Sequence[str], remark: str = ""
) -> Captioned:
    """Draw the acceleration of each record with its pulse as a heavy line.

    Parameters
    ----------
    pulses : sequence of (Record, PulseMatch, Likeness)
        Records, each with a pulse and its test against noise, one for each panel.
    titles : sequence of str
        Title of each record.
    remark : str
        Last sentence of the caption.
    """
    with styled():
        size = (PRINT_WIDTH, 0.4 + 1.65 * len(pulses))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(len(pulses), 1, squeeze=False)[:, 0]
        for panel, tested, title in zip(panels, pulses, titles, strict=True):
            _draw(panel, *tested)
            pulse = tested[1].pulse
            named = (
                f"{wavelet_words(pulse.wavelet)}, $a_p$ = {pulse.a_p / GRAVITY:.3f} g, "
                f"$T_p$ = {pulse.T_p:.3f} s"
            )
            panel.set_title(f"{label_of(title)}\n{named}", fontsize=7)
        panels[-1].set_xlabel("time [s]")
    told = " ".join(_words(*tested) for tested in pulses)
    caption = (
        "Ground acceleration (thin) and the pulse that explains most of it (heavy): largest "
        f"coefficient of the energy-normalised wavelet transform. {told} {remark}"
    )
    title = "Figure 8: records and their acceleration pulses"
    return Captioned(figure, title, caption.rstrip())


def _draw(panel: Axes, record: Record, match: PulseMatch, likeness: Likeness) -> None:
    time, pulse = record.time, match.pulse
    reach = pulse.mother.reach * pulse.T_p
    half = max(_LEAST, _AROUND * reach)
    seen = abs(time - pulse.time) <= half
    near = abs(time - pulse.time) <= reach
    panel.plot(time[seen], record.acceleration[seen] / GRAVITY, color="0.45", linewidth=0.6)
    panel.plot(
        time[near],
        pulse.acceleration(time)[near] / GRAVITY,
        color="black",
        linewidth=1.6,
        label=_tested(likeness),
    )
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + _FOR_LEGEND * (high - low))
    panel.legend(loc="upper right", fontsize=7)
    ends = max(float(time[0]), pulse.time - half), min(float(time[-1]), pulse.time + half)
    panel.set_xlim(*ends)
    panel.set_ylabel("ground  [g]")


def _words(record: Record, match: PulseMatch, likeness: Likeness) -> str:
    pulse = match.pulse
    return (
        f"{record.record_id}: {wavelet_words(pulse.wavelet)}, a_p = {pulse.a_p / GRAVITY:.3f} g, "
        f"T_p = {pulse.T_p:.3f} s, match index {match.match_index:.3f}, {_tested(likeness)}, "
        f"{printed_pga(record)}."
    )
