"""The wavelet transform is unbiased, invariant, and equal to other computations."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.conftest import examples

from rockframe.errors import ParameterError
from rockframe.matching.match import best_match, match_pulse, scalogram
from rockframe.matching.signal import integrate_velocity
from rockframe.wavelets.family import RICKERS, WAVELETS
from rockframe.wavelets.pulse import Pulse

TIME = 0.01 * np.arange(1001, dtype=np.float64)
EXPECTED = json.loads((Path(__file__).parents[1] / "expected" / "f_wavelet.json").read_text())
OTHER = {
    "symmetric_ricker": "antisymmetric_ricker",
    "antisymmetric_ricker": "symmetric_ricker",
}


def synthetic() -> np.ndarray:
    """Return the record of f_wavelet.json [g], whose best pulses are known."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.4, T_p=0.8, time=5.0).acceleration(TIME)
    fast = 0.05 * np.sin(14 * np.pi * TIME) * np.exp(-(((TIME - 5) / 2) ** 2))
    slow = 0.03 * np.sin(3.8 * np.pi * TIME + 0.3) * np.exp(-(((TIME - 5.5) / 2) ** 2))
    return np.asarray(pulse + fast + slow)


def test_scalograms_are_of_rickers() -> None:
    with pytest.raises(ParameterError, match=r"Invalid wavelet 'haar'. Must be one of: symmetric"):
        scalogram(TIME, 0.01, "haar", np.array([0.4]))


@pytest.mark.parametrize("wavelet", RICKERS)
@examples(20)
@given(
    a_p=st.floats(0.1, 10.0),
    period=st.floats(0.3, 2.0),
    time=st.floats(4.0, 6.0),
    phase=st.sampled_from([0.0, math.pi]),
)
def test_a_planted_pulse_is_found(
    wavelet: str, a_p: float, period: float, time: float, phase: float
) -> None:
    planted = Pulse(wavelet=wavelet, a_p=a_p, T_p=period, time=time, phase=phase)
    match = match_pulse(planted.acceleration(TIME), 0.01, wavelet)
    assert match.pulse.T_p == pytest.approx(period, rel=1e-5)
    assert match.pulse.time == pytest.approx(time, abs=1e-5)
    assert match.pulse.a_p == pytest.approx(a_p, rel=1e-5)
    assert match.pulse.phase == phase
    assert match.match_index == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize(("pulses", "equal_periods"), [(2, True), (2, False), (5, False)])
def test_of_several_pulses_the_one_that_explains_most_is_found(
    wavelet: str, pulses: int, equal_periods: bool
) -> None:
    """The grid of the search is coarser than the difference of their energies."""
    random = np.random.default_rng(8)
    time = 0.02 * np.arange(1000 + 600 * pulses)
    for _ in range(60):
        periods = np.exp(random.uniform(math.log(0.4), math.log(2.0), pulses))
        norms = random.uniform(0.985, 1.015, pulses)
        record = np.zeros(time.size)
        for i, norm in enumerate(norms):
            one = Pulse(
                wavelet=wavelet,
                a_p=1.0,
                T_p=periods[0 if equal_periods else i],
                time=random.uniform(8.0, 10.0) + 12.0 * i,
                phase=random.uniform(0.0, 3.0) if wavelet not in RICKERS else 0.0,
                half_cycles=1.7 if WAVELETS[wavelet].has_half_cycles else None,
            ).acceleration(time)
            record += norm * one / np.linalg.norm(one)
        index = match_pulse(record, 0.02, wavelet).match_index
        assert index == pytest.approx(norms.max() / np.linalg.norm(norms), abs=1e-5)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("stronger", [None, 7, 19])
def test_of_many_pulses_the_strongest_or_else_the_first_is_found(
    wavelet: str, stronger: int | None
) -> None:
    """There are more than are refined, and they lie anywhere between the times of the search."""
    number = 1.7 if WAVELETS[wavelet].has_half_cycles else None
    record = np.zeros(4500)
    for k in range(20):
        a_p = 1.004 if k == stronger else 1.0
        one = Pulse(wavelet=wavelet, a_p=a_p, T_p=0.431, time=2.13 * (k + 1), half_cycles=number)
        record += one.acceleration(0.01 * np.arange(record.size))
    time = match_pulse(record, 0.01, wavelet).pulse.time
    assert time == pytest.approx(2.13 * ((stronger or 0) + 1), abs=1e-3)


def test_the_start_of_a_long_sine_is_not_lost_among_its_cycles() -> None:
    """A wavelet at the start is cut, and matches the sine better than one inside."""
    sine = np.sin(2.0 * math.pi * 1.7 * 0.005 * np.arange(40_001))
    match = match_pulse(sine, 0.005, "symmetric_ricker")
    assert match.pulse.time < 0.5
    assert match.match_index == pytest.approx(0.06047, abs=1e-5)


@pytest.mark.parametrize("wavelet", RICKERS)
def test_a_record_turned_round_has_the_same_pulse(wavelet: str) -> None:
    """Many of these records have theirs at an end."""
    at_end = 0
    for seed in range(25):
        record = np.cumsum(np.random.default_rng(seed).normal(size=400))
        record -= record.mean()
        one, other = (match_pulse(r, 0.02, wavelet) for r in (record, record[::-1].copy()))
        assert other.match_index == pytest.approx(one.match_index, rel=1e-6)
        at_end += min(one.pulse.time, other.pulse.time) < 0.3 * one.pulse.T_p
    assert at_end > 5


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("weighting", ["energy", "velocity"])
def test_the_match_index_is_that_of_the_sums_over_samples(wavelet: str, weighting: str) -> None:
    """The velocity of a wavelet may have a mean, as that of half a cycle."""
    random = np.random.default_rng(3)
    for width in (12, 40):
        record = np.convolve(random.normal(size=1500), np.hanning(width), "same")
        match = match_pulse(record, 0.02, wavelet, weighting=weighting)
        pulse, quantity = match.pulse, "velocity" if weighting == "velocity" else "acceleration"
        whole = integrate_velocity(record, 0.02) if weighting == "velocity" else record
        tau = (0.02 * np.arange(record.size) - pulse.time) / pulse.T_p
        explained = 0.0
        for part in WAVELETS[wavelet].parts(pulse.half_cycles):
            ends = np.linspace(-part.reach, part.reach, 20_001)
            energy = np.sum(getattr(part, quantity)(ends) ** 2) * (ends[1] - ends[0])
            product = 0.02 * np.sum(getattr(part, quantity)(tau) * whole)
            explained += product**2 / (pulse.T_p * energy)
        index = math.sqrt(explained / (0.02 * np.sum(whole**2)))
        assert match.match_index == pytest.approx(index, rel=1e-5)


@pytest.mark.parametrize("wavelet", WAVELETS)
def test_the_unit_of_a_record_does_not_change_its_match(wavelet: str) -> None:
    record = np.convolve(np.random.default_rng(4).normal(size=1500), np.hanning(30), "same")
    record /= np.abs(record).max()
    expected = match_pulse(record, 0.02, wavelet)
    for unit in (1.1e-15, 1e12, 9e14):
        match = match_pulse(unit * record, 0.02, wavelet)
        assert match.match_index == pytest.approx(expected.match_index, rel=1e-6)
        assert match.pulse.a_p == pytest.approx(unit * expected.pulse.a_p, rel=1e-5)


def test_a_record_that_no_wavelet_resembles_has_a_match_all_the_same() -> None:
    """Their products are zero to round-off, and those of single precision are zero."""
    alternating, spike = np.cos(math.pi * np.arange(20_000)), 0.11 * np.eye(1, 3001, 3000)[0]
    for record, weighting in ((alternating, "energy"), (spike, "energy"), (spike, "velocity")):
        match = match_pulse(1e-14 * record, 1e-4, "symmetric_ricker", weighting=weighting)
        assert 0.0 <= match.match_index <= 1.0


@pytest.mark.parametrize("wavelet", WAVELETS)
def test_of_two_equal_pulses_the_first_is_found(wavelet: str) -> None:
    """Otherwise round-off, which differs between processors, would decide."""
    number = 1.7 if WAVELETS[wavelet].has_half_cycles else None
    for period in (0.43, 0.5, 0.77, 1.1):
        planted = Pulse(wavelet=wavelet, a_p=1.0, T_p=period, time=8.0, half_cycles=number)
        pulse = planted.acceleration(0.01 * np.arange(3001))
        record = 0.5 * (pulse + pulse[::-1])
        for one in (record, np.concatenate([np.zeros(377), record])):
            time = match_pulse(one, 0.01, wavelet).pulse.time
            assert time - 0.01 * (one.size - record.size) == pytest.approx(8.0, abs=1e-3)


@pytest.mark.parametrize("mother", RICKERS)
def test_one_mother_on_the_other_pulse(mother: str) -> None:
    key = "sym_mother_on_antisym_pulse" if mother == "symmetric_ricker" else None
    expected = EXPECTED[key or "antisym_mother_on_sym_pulse"]
    planted = Pulse(wavelet=OTHER[mother], a_p=1.0, T_p=1.0, time=5.0)
    match = match_pulse(planted.acceleration(TIME), 0.01, mother)
    assert match.pulse.T_p == pytest.approx(expected["s_over_Tp"], rel=1e-6)
    assert abs(match.pulse.time - 5.0) == pytest.approx(expected["xi_over_Tp"], abs=1e-6)
    assert match.match_index == pytest.approx(expected["matching_index"], abs=1e-9)


@pytest.mark.parametrize(("wavelet", "key"), list(zip(RICKERS, ("sym", "anti"), strict=True)))
def test_synthetic_record(wavelet: str, key: str) -> None:
    expected = EXPECTED["synthetic_record"][key]
    match = match_pulse(synthetic(), 0.01, wavelet)
    assert match.pulse.T_p == pytest.approx(expected["T_p"], rel=1e-7)
    assert match.pulse.time == pytest.approx(expected["xi"], abs=1e-7)
    assert match.pulse.a_p == pytest.approx(abs(expected["a_p"]), rel=1e-7)
    assert (match.pulse.phase == 0.0) == (expected["a_p"] > 0.0)
    assert match.match_index == pytest.approx(expected["matching_index"], abs=1e-9)


def test_best_of_the_synthetic_record_is_the_planted_wavelet() -> None:
    matches = [match_pulse(synthetic(), 0.01, wavelet) for wavelet in RICKERS]
    assert matches[best_match(matches)].pulse.wavelet == "symmetric_ricker"


@pytest.mark.parametrize("wavelet", RICKERS)
def test_amplitude_scales_and_period_stretches(wavelet: str) -> None:
    one = match_pulse(synthetic(), 0.01, wavelet).pulse
    stretched = match_pulse(3.0 * synthetic(), 0.02, wavelet, periods_s=(0.2, 10.0)).pulse
    assert stretched.a_p == pytest.approx(3.0 * one.a_p, rel=1e-6)
    assert stretched.T_p == pytest.approx(2.0 * one.T_p, rel=1e-6)
    assert stretched.length_scale == pytest.approx(12.0 * one.length_scale, rel=1e-6)


def test_reversed_record_gives_the_reversed_pulse() -> None:
    one = match_pulse(synthetic(), 0.01, "symmetric_ricker")
    other = match_pulse(-synthetic(), 0.01, "symmetric_ricker")
    assert {one.pulse.phase, other.pulse.phase} == {0.0, math.pi}
    assert other.pulse.T_p == one.pulse.T_p


@pytest.mark.parametrize("wavelet", RICKERS)
def test_a_brute_force_grid_finds_nothing_better(wavelet: str) -> None:
    record = synthetic()
    match = match_pulse(record, 0.01, wavelet)
    mother = RICKERS[wavelet]
    norm = math.sqrt(float(record @ record))
    best = 0.0
    for period in np.geomspace(0.2, 5.0, 150):
        tau = (TIME[None, :] - TIME[::3, None]) / period
        daughters = mother.acceleration(tau) / math.sqrt(period * mother.energy / 0.01)
        best = max(best, float(np.abs(daughters @ record).max()) / norm)
    assert best <= match.match_index
    assert best == pytest.approx(match.match_index, rel=5e-3)


@pytest.mark.parametrize("wavelet", RICKERS)
def test_pywavelets_sees_the_same_optimum(wavelet: str) -> None:
    """PyWavelets samples its wavelets coarsely: it errs by half a sample and half a percent."""
    record = synthetic()
    match = match_pulse(record, 0.01, wavelet)
    periods = match.pulse.T_p * np.array([0.97, 1.0, 1.03])
    picture = np.abs(scalogram(record, 0.01, wavelet, periods))
    row, column = np.unravel_index(picture.argmax(), picture.shape)
    norm = math.sqrt(float(record @ record) * 0.01)
    assert row == 1
    assert TIME[column] == pytest.approx(match.pulse.time, abs=0.015)
    assert picture.max() / norm == pytest.approx(match.match_index, rel=0.01)


def test_a_period_at_the_end_of_the_range_is_said_to_be_so() -> None:
    planted = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=2.0, time=5.0).acceleration(TIME)
    assert match_pulse(planted, 0.01, "symmetric_ricker", periods_s=(0.2, 1.0)).at_period_bound
    assert not match_pulse(planted, 0.01, "symmetric_ricker").at_period_bound


def test_zeros_hold_no_pulse() -> None:
    with pytest.raises(ParameterError, match="all samples are zero"):
        match_pulse(np.zeros(100), 0.01, "symmetric_ricker")


def test_unknown_wavelet_is_named() -> None:
    with pytest.raises(ParameterError, match=r"wavelet 'haar'. Must be symmetric_ricker"):
        match_pulse(np.ones(100), 0.01, "haar")


def test_a_record_too_short_for_the_periods_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"range of periods from 2 to 5 s .* of 0.99 s"):
        match_pulse(TIME[:100], 0.01, "symmetric_ricker", periods_s=(2.0, 5.0))


def test_reversed_range_is_refused() -> None:
    with pytest.raises(ParameterError, match="Must be two positive numbers that increase"):
        match_pulse(np.ones(100), 0.01, "symmetric_ricker", periods_s=(3.0, 1.0))
