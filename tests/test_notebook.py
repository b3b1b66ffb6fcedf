"""Features for notebooks: tables with plots, axes as argument and return value, short calls."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

import rockframe
from rockframe import Pulse, Record, RockingFrame, Verdict, respond
from rockframe.errors import ParameterError
from rockframe.notebook import Shown
from rockframe.options.pulse import PulseOptions

FRAME = RockingFrame(name="<bent>", height=9.6, width=1.6, mass_ratio=4.0)
DECK = rockframe.IsolatedDeck.lead_rubber(strength_ratio=0.05, period=2.5)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5)
TIME = 0.01 * np.arange(1200)
RECORD = Record(
    record_id="shake",
    acceleration=Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5, time=6.0).acceleration(TIME),
    time_step=0.01,
    event="a < b",
)


def shown() -> dict[str, Shown]:
    fit = rockframe.fit_fragility([1.0, 2.0, 3.0, 4.0], [False, True, False, True])
    angle = math.radians(14.0)
    return {
        "record": RECORD,
        "response": respond(FRAME, RECORD),
        "oscillator": rockframe.respond_oscillator(DECK, RECORD),
        "margin": rockframe.margins(PULSE, FRAME),
        "fragility": fit,
        "no fragility": rockframe.fit_fragility([1.0, 2.0], [False, False]),
        "rocking spectrum": rockframe.rocking_spectrum([RECORD], [angle], [0.0], [3.0, 6.0]),
        "overturning spectrum": rockframe.overturning_spectrum(
            [PULSE], [angle], [0.0], [3.0, 4.0], np.arange(0.5, 4.1, 0.5)
        ),
    }


@pytest.fixture(scope="module")
def things() -> dict[str, Shown]:
    return shown()


def test_html_holds_the_facts_and_a_drawing(things: dict[str, Shown]) -> None:
    pages: dict[str, str] = {name: thing._repr_html_() for name, thing in things.items()}
    for name, page in pages.items():
        assert page.count("<tr>") == len(things[name].facts()) > 1
        assert 'src="data:image/png;base64,iVBOR' in page
    assert "a &lt; b" in pages["record"]  # names are text, not markup
    assert "&lt;bent&gt;" in pages["response"]


def test_axes_are_taken_and_given_back(things: dict[str, Shown]) -> None:
    for thing in things.values():
        axes = Figure().subplots()
        assert thing.plot(axes) is axes
        assert axes.get_xlabel()


def test_a_margin_marks_the_motion_itself(things: dict[str, Shown]) -> None:
    axes = things["margin"].plot(Figure().subplots())
    (line,) = (drawn for drawn in axes.get_lines() if drawn.get_label() == "the motion itself")
    assert_array_equal(line.get_xdata(), [1.0, 1.0])
    assert axes.get_xlim()[0] == 0.0
    labels = axes.get_legend_handles_labels()[1]
    assert sorted(labels) == ["overturns", "stands", "the motion itself"]


def test_a_rocking_spectrum_is_drawn_up_to_overturning(things: dict[str, Shown]) -> None:
    assert things["rocking spectrum"].plot(Figure().subplots()).get_ylim() == (0.0, 1.5)


def test_without_axes_there_is_a_figure() -> None:
    from matplotlib import pyplot as plt

    axes = RECORD.plot()
    (line,) = axes.get_lines()
    assert_allclose(np.asarray(line.get_ydata(), dtype=float), RECORD.acceleration / 9.81)
    plt.close("all")


def test_datasets_are_the_arrays(things: dict[str, Any]) -> None:
    response = things["response"]
    dataset = response.to_xarray()
    assert_array_equal(dataset["theta"].sel(time=6.0, method="nearest"), response.theta[600])
    assert (dataset.attrs["verdict"], dataset["u"].attrs["units"]) == ("STANDS", "m")
    assert_array_equal(RECORD.to_xarray().values, RECORD.acceleration)
    assert things["rocking spectrum"].to_xarray()["peak_velocity"].dims[-1] == "column_period"
    least = things["overturning spectrum"].to_xarray()
    assert_array_equal(
        least[0, 0, 0], things["overturning spectrum"].minimum_overturning_amplitude[0, 0, 0]
    )
    deck = things["oscillator"]
    moved = deck.to_xarray()
    assert_array_equal(moved["u"].values, deck.u)
    assert moved["velocity"].attrs["units"] == "m s-1"
    assert moved.attrs["peak_force_ratio"] == deck.peak_force_ratio
    assert isinstance(things["fragility"].to_xarray(), xr.Dataset)


def test_a_verdict_prints_its_name() -> None:
    assert str(Verdict.STANDS) == f"{Verdict.STANDS}" == "STANDS"
    assert f"{Verdict.OVERTURNS:>12}" == "   OVERTURNS"
    assert int(Verdict.STANDS) == 1


def test_a_record_has_its_peak_and_can_be_scaled() -> None:
    assert_allclose(RECORD.pga, 4.9)
    double = RECORD.scaled(2.0)
    assert_allclose(double.acceleration, 2.0 * RECORD.acceleration)
    assert (double.record_id, double.processing) == ("shake", ("scaled by 2",))


def test_a_record_alone_is_searched_for_pulses() -> None:
    options = PulseOptions(surrogates=0, wavelet=("symmetric_ricker",))
    pulses = rockframe.find_pulses(RECORD, options=options)
    again = rockframe.find_pulses(RECORD.acceleration, 0.01, options)
    assert pulses.matches["symmetric_ricker"].pulse == again.matches["symmetric_ricker"].pulse
    for arguments in ((RECORD, 0.01), (RECORD.acceleration,)):
        with pytest.raises(ParameterError, match="Must be stated for an array, not for a Record"):
            rockframe.find_pulses(*arguments)


def test_margins_of_one_motion_and_one_frame() -> None:
    [[expected]] = rockframe.margins([PULSE], [FRAME])
    assert rockframe.margins(PULSE, FRAME) == expected
    assert rockframe.margins(PULSE, [FRAME]) == rockframe.margins([PULSE], FRAME) == [[expected]]


def test_units_of_a_file_are_stated_in_the_call(tmp_path: Path) -> None:
    path = tmp_path / "shake.txt"
    path.write_text("0.1\n-0.2\n0.1\n", encoding="utf-8")
    [record] = rockframe.read_file(path, units="g", time_step=0.02)
    assert_allclose(record.pga, 0.2 * 9.81)
    assert record.time_step == 0.02


def test_fragility_of_verdicts_without_scales() -> None:
    fell = [False, True, False, True]
    short = rockframe.fit_fragility([1.0, 2.0, 3.0, 4.0], fell)
    assert short.median == rockframe.fit_fragility([1.0, 2.0, 3.0, 4.0], overturned=fell).median
    long = rockframe.fit_fragility([1.0, 2.0, 3.0, 4.0], [1.0], [[outcome] for outcome in fell])
    assert short.median == long.median


@pytest.mark.parametrize("name", ["half_sine", "full_sine", "full_cosine"])
def test_pulses_of_textbooks_are_consistent(name: str) -> None:
    """Velocity and displacement are integrals; energy and spectrum are integrals of the pulse."""
    pulse = Pulse(wavelet=name, a_p=3.0, T_p=2.0, time=1.0)
    mother, end = pulse.mother, pulse.mother.reach
    times = np.array([0.6, 1.0, 1.3, 2.6])
    motions = pulse.acceleration, pulse.velocity, pulse.displacement
    for inner, outer in pairwise(motions):
        for t in times:
            total = quad(inner, -1.0, t, points=(0.0, 0.5, 1.5, 2.0), limit=200)[0]
            assert_allclose(outer(t), total, atol=1e-9)
    assert_allclose(np.abs(pulse.acceleration(np.linspace(-1, 3, 4001))).max(), 3.0, rtol=1e-6)
    square = quad(lambda x: float(mother.acceleration(np.array(x)) ** 2), -end, end)[0]
    assert_allclose(mother.energy, square)
    tau = np.linspace(-end, end, 20_001)
    for nu in (0.3, 1.0, 1.7):
        wave = mother.acceleration(tau) * np.exp(-2j * np.pi * nu * tau)
        assert_allclose(mother.spectrum(np.array(nu)), np.trapezoid(wave, tau), atol=1e-7)
    turned = Pulse(wavelet=name, a_p=3.0, T_p=2.0, time=1.0, phase=math.pi)
    assert_allclose(turned.acceleration(times), -pulse.acceleration(times))
