"""Pulses at ends of records, periods at ends of ranges, and records that cannot be searched."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from rockframe.errors import ParameterError
from rockframe.matching.match import match_pulse
from rockframe.matching.record_pulses import find_pulses
from rockframe.matching.signal import require_record
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import WAVELETS
from rockframe.wavelets.pulse import Pulse

TIME = 0.01 * np.arange(2000, dtype=np.float64)


@pytest.mark.parametrize("centre", [0.3, 19.8])
@pytest.mark.parametrize("wavelet", ["symmetric_ricker", "antisymmetric_ricker"])
def test_a_pulse_cut_by_the_record_is_said_to_be_cut(wavelet: str, centre: float) -> None:
    planted = Pulse(wavelet=wavelet, a_p=1.0, T_p=2.0, time=centre)
    match = match_pulse(planted.acceleration(TIME), 0.01, wavelet)
    assert match.cut
    assert match.outside > 0.01
    assert 0.0 <= match.pulse.time <= TIME[-1]


def test_a_whole_pulse_is_not() -> None:
    planted = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=2.0, time=6.0)
    match = match_pulse(planted.acceleration(TIME), 0.01, "symmetric_ricker")
    assert not match.cut
    assert match.outside < 1e-12


def test_the_start_does_not_see_the_end() -> None:
    """Wavelets do not wrap around: a pulse at the end explains nothing at the start."""
    planted = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=4.0, time=19.0)
    match = match_pulse(planted.acceleration(TIME), 0.01, "symmetric_ricker")
    assert match.pulse.time > 15.0


@pytest.mark.parametrize(("strength", "allowed"), [(1e-15, 1.1), (1e15, 0.9)])
def test_the_weakest_and_the_strongest_record(strength: float, allowed: float) -> None:
    record = strength * np.sin(np.arange(500.0)) / np.sin(np.arange(500.0)).max()
    assert require_record(allowed * record, 0.01).shape == (500,)
    with pytest.raises(ParameterError, match="Must be from 1e-15 to 1e\\+15"):
        require_record(record / allowed, 0.01)


@pytest.mark.parametrize("wavelet", WAVELETS)
def test_both_ends_of_the_periods_are_flagged(wavelet: str) -> None:
    half_cycles = 2.0 if WAVELETS[wavelet].has_half_cycles else None
    planted = Pulse(wavelet=wavelet, a_p=1.0, T_p=1.5, time=10.0, half_cycles=half_cycles)
    record = planted.acceleration(TIME)
    assert match_pulse(record, 0.01, wavelet, periods_s=(0.2, 0.5)).at_period_bound
    assert match_pulse(record, 0.01, wavelet, periods_s=(4.0, 5.0)).at_period_bound


def test_ends_of_the_half_cycles_are_flagged() -> None:
    wavelet = "mavroeidis_papageorgiou"
    planted = Pulse(wavelet=wavelet, a_p=1.0, T_p=1.5, time=10.0, half_cycles=2.5)
    record = planted.acceleration(TIME)
    assert match_pulse(record, 0.01, wavelet, most_half_cycles=2.0).at_half_cycle_bound
    assert not match_pulse(record, 0.01, wavelet, most_half_cycles=4.0).at_half_cycle_bound


@pytest.mark.parametrize(
    ("half_cycles", "centre", "phase"),
    [(1.05, 9.0, 0.8), (1.05, 9.0, 1.57), (1.05, 1.0, 1.57), (1.1, 0.5, 0.8)],
)
def test_a_maximum_near_two_bounds_is_found(
    half_cycles: float, centre: float, phase: float
) -> None:
    """A pulse cut by the record's end has its maximum at one half cycle and T_p below 5 s.

    A fine grid of T_p and times, with sums over the samples, has no larger coefficient.
    """
    time = 0.02 * np.arange(500)
    pulse = partial(Pulse, wavelet="mavroeidis_papageorgiou", a_p=1.0)
    planted = pulse(T_p=4.95, time=centre, half_cycles=half_cycles, phase=phase)
    record = planted.acceleration(time)
    match = match_pulse(record, 0.02, "mavroeidis_papageorgiou")
    long = 0.02 * np.arange(-1000, 1500)
    grid = []
    for period in np.arange(4.85, 5.0, 0.01):
        for t in match.pulse.time + np.arange(-0.05, 0.06, 0.01):
            parts = [
                pulse(T_p=period, time=t, half_cycles=1.0, phase=part)
                for part in (0.0, 0.5 * math.pi)
            ]
            squares = [
                (record @ part.acceleration(time)) ** 2 / (part.acceleration(long) ** 2).sum()
                for part in parts
            ]
            grid.append((sum(squares) / (record**2).sum(), period))
    largest, period = max(grid)
    assert match.match_index**2 == pytest.approx(largest, rel=1e-5)
    assert match.pulse.T_p == pytest.approx(period, abs=0.01)
    assert not match.at_period_bound


def test_a_range_of_less_than_an_octave_is_searched() -> None:
    planted = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.003, time=10.0)
    match = match_pulse(
        planted.acceleration(TIME),
        0.01,
        "symmetric_ricker",
        periods_s=(1.0, 1.01),
    )
    assert match.pulse.T_p == pytest.approx(1.003, rel=1e-6)


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (np.zeros(500), "all samples are zero, there is no pulse"),
        (np.full(500, 0.3), "all samples are equal, there is no pulse"),
        (0.3 + 1e-12 * np.sin(np.arange(500.0)), "all samples are equal, there is no pulse"),
        (np.where(np.arange(500) == 7, math.nan, 1.0), "not all samples are finite"),
        (np.where(np.arange(500) == 7, math.inf, 1.0), "not all samples are finite"),
        (1e25 * np.sin(np.arange(500.0)), "Must be from 1e-15 to 1e\\+15"),
        (1e-25 * np.sin(np.arange(500.0)), "Must be from 1e-15 to 1e\\+15"),
        (np.resize([0.3, -0.3], 500), "its velocity is zero at all samples"),
        (np.ones((2, 500)), r"of shape \(2, 500\). Must be one row"),
        (np.ones(1), r"of shape \(1,\). Must be one row of two samples or more"),
    ],
)
def test_records_without_a_pulse_to_look_for(record: np.ndarray, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        find_pulses(record, 0.01, PulseOptions())


def test_the_periods_told_are_those_that_were_searched() -> None:
    options = PulseOptions(surrogates=0)
    found = find_pulses(np.sin(np.arange(60.0) ** 1.5), 0.05, options)
    assert found.periods == pytest.approx((0.4, 2.95))  # 8 steps, the duration


@pytest.mark.parametrize("step", [0.0, -0.01, math.nan])
def test_time_steps_that_are_none(step: float) -> None:
    with pytest.raises(ParameterError, match="Invalid time step"):
        find_pulses(np.sin(TIME), step, PulseOptions())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"wavelet": ("haar",)}, "wavelet 'haar'. Must be symmetric_ricker"),
        ({"wavelet": ()}, "wavelet .*Must be a list of one or more"),
        ({"periods_s": (0.0, 5.0)}, "Must be two positive numbers that increase"),
        ({"periods_s": (0.2, math.inf)}, "Must be two positive numbers"),
        ({"most_half_cycles": 0.5}, "most_half_cycles 0.5. Must be at least 1"),
        ({"most_half_cycles": math.nan}, "most_half_cycles nan. Must be at"),
    ],
)
def test_options_that_are_none(options: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        PulseOptions(**options)


def test_the_pulse_that_is_used_must_be_looked_for() -> None:
    with pytest.raises(ParameterError, match=r"pulse_wavelet .* is not matched. Must be one"):
        PulseOptions(wavelet=("symmetric_ricker",), pulse_wavelet="ricker_any_phase")


def test_a_negative_number_of_runners_up_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"runners_up -1. Must be zero or positive"):
        PulseOptions(runners_up=-1)


@pytest.mark.parametrize("chosen", [tuple(WAVELETS), ("mavroeidis_papageorgiou",)])
def test_more_half_cycles_are_no_error_of_wavelets_without_them(chosen: tuple[str, ...]) -> None:
    """The pulse in the velocity and runners-up are searched with some of the wavelets alone."""
    planted = Pulse(wavelet="mavroeidis_papageorgiou", a_p=1.0, T_p=0.5, time=3.0, half_cycles=5.0)
    options = PulseOptions(wavelet=chosen, most_half_cycles=6.0, surrogates=0)
    pulses = find_pulses(planted.acceleration(0.01 * np.arange(600)), 0.01, options)
    matched = pulses.matches["mavroeidis_papageorgiou"].pulse
    assert matched.half_cycles == pytest.approx(5.0, rel=1e-3)
