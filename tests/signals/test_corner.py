"""The lower corner is found where noise and motion meet; without noise it is the default."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.conftest import examples

from rockframe.record import Record
from rockframe.signals.corner import CORNERS, DEFAULT, Corner, CornerSource, _powers, choose_corner
from rockframe.signals.noise import arrival, pre_event
from rockframe.signals.passport import Measures, measured
from rockframe.signals.processing import BandPass, correct, integrate, level, peak

Float = NDArray[np.float64]
STEP = 0.01
QUIET, LENGTH = 200.0, 400.0
TIME: Float = STEP * np.arange(round(LENGTH / STEP), dtype=np.float64)
#: A third of an octave, the distance between corners, and a little for rounded numbers.
THIRD = 1.27


def hum(level: float, seed: int = 3) -> Float:
    """Return white noise."""
    return level * np.random.default_rng(seed).standard_normal(TIME.size)


def wavelet(frequency: float = 2.0, time: float = QUIET + 3.0) -> Float:
    """Return a Ricker wavelet, whose spectrum grows with the square of the frequency."""
    u = (np.pi * frequency * (TIME - time)) ** 2
    return (1.0 - 2.0 * u) * np.exp(-u) * (TIME >= QUIET)


def noise_that_hides_below(frequency: float, ratio: float = 3.0) -> float:
    """Return the level of white noise whose amplitude, times the ratio, is the wavelet's here.

    Mean power per hertz of noise is level**2 * STEP; that of a transient is the square of its
    Fourier integral over the duration of the window.
    """
    lines = np.fft.rfftfreq(TIME.size, STEP)
    amplitude = STEP * np.abs(np.fft.rfft(wavelet()))[np.abs(lines - frequency).argmin()]
    return float(amplitude / np.sqrt((LENGTH - QUIET) * STEP) / np.sqrt(ratio**2 - 1.0))


@pytest.mark.parametrize("crossing", [0.16, 0.25, 0.4, 0.5])
def test_the_corner_is_where_the_motion_rises_above_the_noise(crossing: float) -> None:
    corner = choose_corner(hum(noise_that_hides_below(crossing)) + wavelet(), STEP, 3.0)
    assert corner.source is CornerSource.SIGNAL_TO_NOISE
    assert crossing / THIRD <= corner.frequency <= crossing * THIRD


def test_four_times_the_ratio_is_twice_the_corner() -> None:
    """The spectrum of the wavelet grows with the square of the frequency."""
    record = hum(noise_that_hides_below(0.25)) + wavelet()
    once, four = (choose_corner(record, STEP, ratio).frequency for ratio in (3.0, 12.0))
    assert 2.0 / THIRD <= four / once <= 2.0 * THIRD


def test_more_noise_never_lowers_the_corner() -> None:
    levels = noise_that_hides_below(0.25) * 2.0 ** np.arange(-8.0, 2.0)
    corners = [choose_corner(hum(level) + wavelet(), STEP, 3.0).frequency for level in levels]
    assert corners == sorted(corners)
    assert corners[0] < DEFAULT.frequency < corners[-1]


def test_units_do_not_matter() -> None:
    record = hum(noise_that_hides_below(0.25)) + wavelet()
    corner = choose_corner(record, STEP, 3.0)
    for factor in (1e-200, 1.0 / 980.665, 1e200):
        assert choose_corner(factor * record + factor, STEP, 3.0) == corner


@examples(25)
@given(
    slope=st.floats(-1.0, 1.0),
    offset=st.floats(-10.0, 10.0),
    crossing=st.sampled_from([0.016, 0.05, 0.25, 0.5]),
)
def test_a_straight_line_changes_neither_corner_nor_samples(
    slope: float, offset: float, crossing: float
) -> None:
    """The correction removes a straight line, so nothing may be chosen from one."""
    record = hum(noise_that_hides_below(crossing)) + wavelet()
    moved_by_a_line = record + offset + slope * TIME
    corner = choose_corner(record, STEP, 3.0)
    assert choose_corner(moved_by_a_line, STEP, 3.0) == corner
    band = BandPass(corner.frequency)
    samples, other = (
        correct(samples_of, STEP, band)[0] for samples_of in (record, moved_by_a_line)
    )
    assert np.abs(other - samples).max() <= 1e-11 * peak(moved_by_a_line)


@pytest.mark.parametrize("slope", [1e-4, 0.1])
def test_padding_on_a_straight_line_is_padding(slope: float) -> None:
    record = wavelet() + slope * TIME
    assert choose_corner(record, STEP, 3.0) == DEFAULT
    assert pre_event(level(record), STEP)[0] == 0.0


@pytest.mark.parametrize("slope", [1e-5, 1e-3, -0.1])
def test_a_straight_line_is_no_noise(slope: float) -> None:
    record = hum(1e-4) + wavelet()
    computed = measures_of(record)
    measures = measures_of(record + slope * TIME)
    for each in (computed, measures):
        assert each.pre_event == pytest.approx(0.8 * QUIET, rel=0.02)
    assert measures.noise_level == pytest.approx(computed.noise_level, rel=1e-6)
    assert measures.usable_period_longest == computed.usable_period_longest
    assert measures.opening_share == pytest.approx(computed.opening_share, rel=1e-6)


def measures_of(samples: Float) -> Measures:
    """Return the measures of an uncorrected record after its correction."""
    record = Record(record_id="a", acceleration=samples, time_step=STEP, uncorrected=True)
    corrected, start, _ = correct(samples, STEP, BandPass(0.02))
    after = replace(record, acceleration=corrected, filter_low=0.02, filter_high=40.0)
    return measured(record, after, 3.0, start)


def test_a_coarser_record_of_the_same_motion_has_the_same_corner() -> None:
    """Noise that is as white in half of the samples has the root of half of the power per hertz."""
    level = noise_that_hides_below(0.25)
    coarse = wavelet()[::2] + level / 2.0**0.5 * np.random.default_rng(3).standard_normal(20_000)
    fine = choose_corner(hum(level) + wavelet(), STEP, 3.0)
    assert choose_corner(coarse, 2.0 * STEP, 3.0) == fine


@pytest.mark.parametrize("quiet", [12.6, 25.1, 60.0])
def test_no_frequency_without_a_cycle_of_noise_is_chosen(quiet: float) -> None:
    """The noise is far below the motion, so only its length counts."""
    record = (hum(1e-6) + wavelet())[round((QUIET - quiet) / STEP) :]
    lowest = next(corner for corner in CORNERS if corner * (quiet + 2.0) >= 1.0)
    assert choose_corner(record, STEP, 3.0) == Corner(lowest, CornerSource.SIGNAL_TO_NOISE)


#: What begins 2.6 s before the largest sample of the wavelet.
BEGIN = round((QUIET + 0.4) / STEP)


@pytest.mark.parametrize(
    "record",
    [
        pytest.param((hum(1e-5) + wavelet())[BEGIN + 200 :], id="motion at once"),
        pytest.param((hum(1e-5) + wavelet())[BEGIN - 300 :], id="three seconds of noise"),
        pytest.param(wavelet(), id="zeros before it"),
        pytest.param(np.r_[np.full(20_000, 0.25), hum(1e-4)[:50], wavelet()[BEGIN:]], id="padding"),
        pytest.param(hum(1.0), id="nothing but noise"),
        pytest.param(hum(noise_that_hides_below(1.2)) + wavelet(), id="as strong as a P wave"),
        pytest.param(hum(0.002) * np.where(TIME < 50.0, 0.1, 1.0) + wavelet(), id="growing"),
        pytest.param(np.full(4000, 0.25), id="no motion"),
    ],
)
def test_without_noise_that_is_known_the_corner_is_the_default(record: Float) -> None:
    assert choose_corner(record, STEP, 3.0) == DEFAULT == Corner(0.1, CornerSource.DEFAULT)


def moved(displacement: float) -> Float:
    """Return the acceleration of a ground that stays displaced, in a second, at the wavelet."""
    since = np.clip(TIME - QUIET - 2.5, 0.0, 1.0)
    return 2 * np.pi * displacement * np.sin(2 * np.pi * since) * (since > 0.0) * (since < 1.0)


def test_a_displaced_ground_raises_the_corner_until_it_is_at_rest_before_the_motion() -> None:
    """A filter without delay spreads an offset to both sides, over a period of its corner."""
    record = hum(1e-5) + wavelet() + moved(0.006)
    without = choose_corner(record - moved(0.006), STEP, 3.0)
    chosen = choose_corner(record, STEP, 3.0)
    assert chosen.source is CornerSource.DISPLACEMENT
    assert without.frequency < chosen.frequency <= DEFAULT.frequency
    lower = CORNERS[CORNERS.index(chosen.frequency) - 1]
    assert early_displacement(record, chosen.frequency) <= 0.2 < early_displacement(record, lower)


def early_displacement(record: Float, corner: float) -> float:
    """Return the largest displacement before the motion, as a share of its peak."""
    corrected, (velocity, displacement), _ = correct(record, STEP, BandPass(corner))
    history = displacement + integrate(velocity + integrate(corrected, STEP), STEP)
    return peak(history[: arrival(record)]) / peak(history)


def test_weak_shocks_before_the_event_and_offsets_are_no_arrival() -> None:
    early = 0.01 * wavelet(5.0, QUIET + 1.0)
    record = hum(1e-5) + np.roll(early, round(-90.0 / STEP)) + wavelet()
    for offset in (0.0, -3.0):
        assert arrival(record + offset) * STEP == pytest.approx(QUIET + 2.4, abs=0.3)


@pytest.mark.parametrize(("before", "expected"), [(9, 0), (10, 10)])
def test_an_arrival_needs_ten_samples_on_either_side(before: int, expected: int) -> None:
    quiet, loud = 1e-3 * (-1.0) ** np.arange(before), np.r_[(-1.0) ** np.arange(9), 2.0]
    assert arrival(np.r_[quiet, loud, np.zeros(20)]) == expected


@pytest.mark.parametrize(
    ("frequency", "inside"), [(0.71, True), (1.41, True), (0.69, False), (1.44, False)]
)
def test_amplitudes_around_a_corner_are_those_of_an_octave(frequency: float, inside: bool) -> None:
    """A sine within half an octave of 1 Hz is seen there, and one outside is not."""
    time = 0.01 * np.arange(100_000)
    [around], [own] = (
        _powers(np.sin(2 * np.pi * hertz * time), 0.01, [1.0]) for hertz in (frequency, 1.0)
    )
    assert (around > 0.5 * own) == inside
    assert inside or around < 0.01 * own
