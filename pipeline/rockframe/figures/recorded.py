"""A record before anything rocks: its motion, the build-up of its energy, its response spectrum."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from rockframe.figures.captioned import PAGE_WIDTH, Captioned, label_of, plain_ticks, styled
from rockframe.record import Record
from rockframe.signals.measures import significant_duration, spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.units import GRAVITY

#: Periods of the response spectrum [s].
_PERIODS: Final = np.geomspace(0.05, 10.0, 160)


def draw_record(record: Record) -> Captioned:
    """Draw acceleration, velocity, displacement, Husid's build-up and the response spectrum.

    Parameters
    ----------
    record : Record
        The record, as `ingest` wrote it.
    """
    step, acceleration = record.time_step, record.acceleration
    velocity = integrate(acceleration, step)
    displacement = integrate(velocity, step)
    time = step * np.arange(acceleration.size)
    growth = integrate(acceleration**2, step)
    begin, end = significant_duration(acceleration, step)
    spectrum = spectral_acceleration(acceleration, step, _PERIODS)
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 0.75 * PAGE_WIDTH), layout="constrained")
        halves: Any = figure.subfigures(1, 2, width_ratios=[1.25, 1.0])
        left, right = halves
        panels = left.subplots(4, 1, sharex=True)
        shown = (
            (acceleration / GRAVITY, "a [g]", ".3g"),
            (velocity, "v [m/s]", ".3g"),
            (displacement, "d [m]", ".3g"),
        )
        for panel, (series, label, form) in zip(panels, shown, strict=False):
            panel.plot(time, series, linewidth=0.6)
            most = int(np.argmax(np.abs(series)))
            panel.plot(time[most], series[most], "o", color="C3", markersize=3.5)
            panel.set_ylabel(label)
            panel.set_title(f"peak {abs(series[most]):{form}} at {time[most]:.2f} s", loc="right")
        panels[3].plot(time, 100.0 * growth / growth[-1], linewidth=1.0)
        panels[3].axvspan(begin, end, color="C0", alpha=0.15, linewidth=0)
        panels[3].set_ylabel("Arias [%]")
        panels[3].set_title(f"5 to 95 %: {end - begin:.1f} s", loc="right")
        panels[3].set_xlabel("time [s]")
        left.align_ylabels(list(panels))
        axes = right.subplots()
        axes.semilogx(_PERIODS, spectrum / GRAVITY)
        axes.axhline(peak(acceleration) / GRAVITY, color="0.5", linestyle=":", linewidth=0.8)
        plain_ticks(axes.xaxis, _PERIODS[0], _PERIODS[-1])
        axes.set_xlim(_PERIODS[0], _PERIODS[-1])
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("period [s]")
        axes.set_ylabel("Sa, 5 % damped [g]")
        axes.set_title(label_of(record.record_id))
    strongest = _PERIODS[int(np.argmax(spectrum))]
    caption = (
        f"Record {record.record_id}: acceleration, velocity, displacement, and the build-up of the "
        f"Arias intensity (Husid); the shaded part has 5 to 95 % of it, {end - begin:.1f} s. On "
        f"the right, the response spectrum with 5 % damping, largest at {strongest:.2f} s; the "
        f"dotted line is the peak ground acceleration. {_processing(record)}"
    )
    return Captioned(figure, "A record", caption)


def _processing(record: Record) -> str:
    """Return what was done to the record, and the periods that can be used."""
    done = "; ".join(record.processing) or "none"
    usable = ""
    if record.lowest_usable_frequency > 0.0:
        usable = f" Usable up to a period of {1.0 / record.lowest_usable_frequency:.1f} s."
    return f"{record.time_step:g} s between samples; processing: {done}.{usable}"
