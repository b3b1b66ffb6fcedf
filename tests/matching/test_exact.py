"""The search of each wavelet compared with brute force, PyWavelets and independent numbers."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rockframe.matching.match import match_pulse, match_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import WAVELETS
from rockframe.wavelets.pulse import Pulse

EXPECTED = json.loads(
    (Path(__file__).parents[1] / "expected" / "f_wavelet.json").read_text(encoding="utf-8")
)
STEP = 0.004
TIME = STEP * np.arange(5001, dtype=np.float64)


def noise(seed: int, size: int = 1600) -> np.ndarray:
    """Return coloured noise that swells and fades."""
    random = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(size, 0.01)
    colour = frequency / (0.3 + frequency**2)
    time = 0.01 * np.arange(size)
    envelope = (time / 4.0) ** 2 * np.exp(2.0 - time / 2.0)
    return np.asarray(envelope * np.fft.irfft(colour * np.fft.rfft(random.normal(size=size)), size))


@pytest.mark.parametrize(
    ("ricker", "key"),
    [
        ("symmetric_ricker", "MP_best_fit_of_sym_Ricker"),
        ("antisymmetric_ricker", "MP_best_fit_of_antisym_Ricker"),
    ],
)
def test_mavroeidis_papageorgiou_on_ricker_pulses(ricker: str, key: str) -> None:
    expected = EXPECTED[key]
    planted = Pulse(wavelet=ricker, a_p=1.0, T_p=1.0, time=10.0)
    match = match_pulse(planted.acceleration(TIME), STEP, "mavroeidis_papageorgiou")
    assert match.pulse.T_p == pytest.approx(expected["T_p_MP_over_Tp"], rel=2e-5)
    assert match.pulse.half_cycles == pytest.approx(expected["gamma"], rel=3e-5)
    assert match.pulse.time == pytest.approx(10.0 + expected["xi_over_Tp"], abs=1e-6)
    assert math.sin(match.pulse.phase - expected["phi_mod_pi"]) == pytest.approx(0.0, abs=1e-4)
    assert match.match_index == pytest.approx(expected["matching_index"], abs=1e-7)
    assert match.pulse.a_p == pytest.approx(expected["a_p_MP_over_a_p"], rel=1e-5)


def test_energies_are_those_of_the_theory() -> None:
    """The energies are E(gamma, phi) of psi; our acceleration is -(pi / gamma) psi."""
    for gamma in (1.0, 1.4, 2.0, 3.0):
        even, odd = WAVELETS["mavroeidis_papageorgiou"].parts(gamma)
        for part, phi in ((even, 0.0), (odd, 0.5 * math.pi)):
            tau, step = np.linspace(-0.5 * gamma, 0.5 * gamma, 20_001, retstep=True)
            turn = 2.0 * math.pi * tau
            psi = np.sin(turn / gamma) * np.cos(turn + phi)
            psi += gamma * np.sin(turn + phi) * (1.0 + np.cos(turn / gamma))
            np.testing.assert_allclose(part.acceleration(tau), -math.pi / gamma * psi, atol=1e-12)
            square = float((psi**2).sum() * step) * (math.pi / gamma) ** 2
            assert part.energy == pytest.approx(square, rel=1e-8)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("seed", range(2))
def test_brute_force_finds_nothing_better(wavelet: str, seed: int) -> None:
    """Brute force tries a grid of periods, times, half cycles; phases follow by least squares."""
    record = noise(seed, 400)
    time = 0.01 * np.arange(record.size)
    match = match_pulse(record, 0.01, wavelet, periods_s=(0.4, 2.0))
    numbers = (1.0, 2.0, 3.0) if WAVELETS[wavelet].has_half_cycles else (None,)
    best = 0.0
    for half_cycles in numbers:
        parts = WAVELETS[wavelet].parts(half_cycles)
        for period in np.geomspace(0.4, 2.0, 24):
            tau = (time[None, :] - time[::3, None]) / period
            share = np.zeros(tau.shape[0])
            for part in parts:
                share += (part.acceleration(tau) @ record) ** 2 / (period * part.energy) * 0.01
            best = max(best, float(share.max()) / float(record @ record))
    assert match.energy_share >= best * (1.0 - 1e-3)
    assert match.energy_share == pytest.approx(best, rel=0.05)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize(("factor", "stretch"), [(-2.5, 1.0), (1.0, 1.7), (0.3, 0.6)])
def test_amplitude_and_period_scale_with_the_record(
    wavelet: str, factor: float, stretch: float
) -> None:
    record = noise(7)
    one = match_pulse(record, 0.01, wavelet, periods_s=(0.3, 3.0)).pulse
    other = match_pulse(
        factor * record,
        0.01 * stretch,
        wavelet,
        periods_s=(0.3 * stretch, 3.0 * stretch),
    ).pulse
    assert other.a_p == pytest.approx(abs(factor) * one.a_p, rel=1e-6)
    assert other.T_p == pytest.approx(stretch * one.T_p, rel=1e-6)
    assert other.time == pytest.approx(stretch * one.time, rel=1e-6)
    assert other.length_scale == pytest.approx(
        abs(factor) * stretch**2 * one.length_scale, rel=3e-6
    )
    turned = math.pi if factor < 0.0 else 0.0
    assert math.cos(other.phase - one.phase - turned) == pytest.approx(1.0, abs=1e-8)


def test_more_freedom_explains_more() -> None:
    for seed in range(6):
        found = match_pulses(noise(seed), 0.01, PulseOptions(periods_s=(0.3, 5.0)))
        better = found["ricker_any_phase"].match_index + 1e-12
        assert better >= found["symmetric_ricker"].match_index
        assert better >= found["antisymmetric_ricker"].match_index


def test_match_grows_with_the_half_cycles_that_are_allowed() -> None:
    record = noise(2)
    indices = [
        match_pulse(record, 0.01, "mavroeidis_papageorgiou", most_half_cycles=most).match_index
        for most in (1.0, 2.0, 3.0, 4.0)
    ]
    assert all(after >= before - 1e-6 for before, after in pairwise(indices))
