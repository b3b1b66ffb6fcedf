"""The effect of weightings on the period, and the phase as a projection."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rockframe.errors import ParameterError
from rockframe.matching.match import match_pulse, match_pulses
from rockframe.matching.refine import crest
from rockframe.matching.signal import Weighting, integrate_velocity, prepared
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import RICKERS, WAVELETS
from rockframe.wavelets.pulse import Pulse

TIME = 0.01 * np.arange(3001, dtype=np.float64)
ORDER = {"symmetric_ricker": 2, "antisymmetric_ricker": 3}
SHAPES = [
    ("symmetric_ricker", math.pi, None),
    ("antisymmetric_ricker", 0.0, None),
    ("ricker_any_phase", 2.1, None),
    ("mavroeidis_papageorgiou", 4.4, 1.7),
]


@pytest.mark.parametrize("wavelet", RICKERS)
@pytest.mark.parametrize("weighting", ["energy", "area", "none"])
def test_bias_of_the_period(wavelet: str, weighting: str) -> None:
    """For a Ricker record of period T the maximum is at T sqrt((n + 1 - q) / (n + q))."""
    n, q = ORDER[wavelet], Weighting(weighting).exponent
    planted = Pulse(wavelet=wavelet, a_p=1.0, T_p=1.2, time=15.0)
    match = match_pulse(planted.acceleration(TIME), 0.01, wavelet, weighting=weighting)
    expected = 1.2 * math.sqrt((n + 1.0 - q) / (n + q))
    assert match.pulse.T_p == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("wavelet", "phase", "half_cycles"), SHAPES)
@pytest.mark.parametrize("weighting", ["energy", "velocity"])
def test_both_unbiased_weightings_find_what_was_planted(
    wavelet: str, phase: float, half_cycles: float | None, weighting: str
) -> None:
    planted = Pulse(
        wavelet=wavelet, a_p=2.0, T_p=1.2, time=15.0, phase=phase, half_cycles=half_cycles
    )
    match = match_pulse(planted.acceleration(TIME), 0.01, wavelet, weighting=weighting)
    # The ends have kinks between two samples; the velocity is integrated by trapezoids.
    kinks = 2e-3 if half_cycles else 1e-3 if weighting == "velocity" else 1e-6
    assert match.pulse.T_p == pytest.approx(1.2, rel=kinks)
    assert match.pulse.a_p == pytest.approx(2.0, rel=kinks)
    assert match.pulse.time == pytest.approx(15.0, abs=kinks)
    assert math.cos(match.pulse.phase - phase) == pytest.approx(1.0, abs=1e-4)
    if half_cycles:
        assert match.pulse.half_cycles == pytest.approx(half_cycles, rel=kinks)


def test_velocity_weighting_is_the_integrated_wavelet_with_the_root_of_the_period() -> None:
    """int v psi(t/s) dt = -s int a Psi(t/s) dt, with Psi' = psi."""
    record = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=0.9, time=14.0).acceleration(TIME)
    velocity = integrate_velocity(record, 0.01)
    mother = RICKERS["antisymmetric_ricker"]
    for period in (0.7, 1.5):
        tau = (TIME - 15.0) / period
        of_velocity = float(velocity @ mother.acceleration(tau))
        of_acceleration = -period * float(record @ mother.velocity(tau))
        assert of_velocity == pytest.approx(of_acceleration, rel=1e-3)


@pytest.mark.parametrize("wavelet", ["ricker_any_phase", "mavroeidis_papageorgiou"])
def test_projection_is_the_best_of_all_phases(wavelet: str) -> None:
    """The best of 3600 phases explains as much of a noise record."""
    random = np.random.default_rng(3)
    record = random.normal(size=1500)
    options = PulseOptions(wavelet=(wavelet,))
    signal = prepared(record, 0.01, options, 5.0)
    half_cycles = 2.2 if WAVELETS[wavelet].has_half_cycles else None
    point = crest(signal, wavelet, 0.8, 7.0, half_cycles)
    time = 0.01 * np.arange(1500, dtype=np.float64)
    tau = (time - point.time) / point.period
    one, other = (part.acceleration(tau) for part in WAVELETS[wavelet].parts(half_cycles))
    best = 0.0
    for phase in np.linspace(0.0, math.pi, 3600):
        tried = math.cos(phase) * one + math.sin(phase) * other
        best = max(best, float(record @ tried) ** 2 / float(tried @ tried) * 0.01)
    assert point.explained == pytest.approx(best, rel=2e-3)


def test_longer_pulses_win_in_the_velocity() -> None:
    """Energy selects a short strong pulse, velocity a long weak one: the paper's 'override'."""
    short = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=0.5, time=10.0)
    long = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=2.5, time=20.0)
    record = short.acceleration(TIME) + long.acceleration(TIME)
    by = {
        weighting: match_pulse(record, 0.01, "symmetric_ricker", weighting=weighting).pulse.T_p
        for weighting in ("energy", "velocity")
    }
    assert by["energy"] == pytest.approx(0.5, rel=0.05)
    assert by["velocity"] == pytest.approx(2.5, rel=0.05)


def test_unknown_weighting_is_named() -> None:
    with pytest.raises(
        ParameterError, match=r"weighting 'length'. Must be energy, area, none or vel"
    ):
        match_pulse(TIME, 0.01, "symmetric_ricker", weighting="length")


def test_wavelets_searched_together_and_alone_agree() -> None:
    record = np.random.default_rng(4).normal(size=2000)
    together = match_pulses(record, 0.01, PulseOptions())
    for wavelet in WAVELETS:
        alone = match_pulse(record, 0.01, wavelet)
        assert alone.match_index == pytest.approx(together[wavelet].match_index, rel=1e-5)
