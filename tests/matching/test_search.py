"""Times that are skipped cannot contain the best match, and cuts do not move a pulse."""

from __future__ import annotations

import numpy as np
import pytest

from rockframe.matching.loops import tops
from rockframe.matching.match import match_pulses
from rockframe.matching.record_pulses import likeness
from rockframe.matching.refine import _LONGEST_MOVE, crest, uphill
from rockframe.matching.search import ladder, search, summits
from rockframe.matching.signal import (
    Weighting,
    cut_around,
    holds,
    period_range,
    prepared,
    transform_record,
)
from rockframe.matching.verdict import PulseVerdict
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import WAVELETS
from rockframe.wavelets.pulse import Pulse

from .test_likeness import noise, with_pulse
from .test_noise import STEP, TIME


@pytest.mark.parametrize("weighting", list(Weighting))
def test_where_no_wavelet_can_be_as_high_is_not_searched(weighting: Weighting) -> None:
    """A coefficient's square is at most the energy in its window (Cauchy-Schwarz).

    Heights that may be the highest equal those of the complete search, except for the rounding of
    spectral lines.
    """
    long = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=4.0, time=15.0).acceleration(TIME)
    records = np.stack([noise(0), noise(1), long])
    options = PulseOptions(weighting=weighting.value)
    periods = ladder(0.2, 5.0, 5)
    signal = prepared(records, STEP, options, 5.0)
    weight = weighting.of_square(periods)[:, None]
    whole, part = (
        search(signal, periods, options.wavelet, (1.0, 2.0, 3.0), 6, nearly=nearly)
        for nearly in (0.0, 0.95)
    )
    # Slow drifts are on the first spectral lines, where rounding matters.
    rounding = 5e-2 if weighting.of_velocity else 2e-3
    left_out = 0
    for name, all_heights in whole.items():
        some = part[name].power
        least = 0.95 * (all_heights.power * weight).max(axis=(1, 2), keepdims=True)
        wanted = all_heights.power * weight >= 1.01 * least
        np.testing.assert_allclose(some[wanted], all_heights.power[wanted], rtol=rounding)
        left_out += int((some == 0.0).sum())
    assert left_out > 0 or weighting is Weighting.AREA  # it favours short periods


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("time", [0.4, 8.0, 29.7])
def test_a_crest_is_that_of_the_whole_record(wavelet: str, time: float) -> None:
    """Samples outside the wavelet are cut off without effect, also if it extends past an end."""
    record = with_pulse(3, 1.0)
    half_cycles = 1.5 if WAVELETS[wavelet].has_half_cycles else None
    signal = prepared(record, STEP, PulseOptions(), 5.0)
    for _ in range(3):  # the series over time is exact at its centre
        cut = crest(signal, wavelet, 1.1, time, half_cycles)
        time = cut.time
    whole = crest(signal, wavelet, 1.1, time, half_cycles, every=True)
    assert cut.signal.samples.size < record.size
    exact = 1e-3 if WAVELETS[wavelet].has_half_cycles else 1e-9  # kinks have high frequencies
    assert cut.explained == pytest.approx(whole.explained, rel=exact)
    if exact < 1e-3:
        assert cut.time == pytest.approx(whole.time, abs=exact)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("period", [0.5, 1.3])
def test_summits_are_the_maxima_of_the_transform(wavelet: str, period: float) -> None:
    """They are compared with sums over the samples."""
    record = with_pulse(3, 0.2)
    number = 1.5 if WAVELETS[wavelet].has_half_cycles else None
    power = np.zeros(record.size)
    tau = (STEP / period) * np.arange(-record.size, record.size + 1, dtype=np.float64)
    for part in WAVELETS[wavelet].parts(number):
        products = np.correlate(part.acceleration(tau), record, "valid")[-2:0:-1]
        power += (STEP * products) ** 2 / (period * part.energy)
    before, after = np.roll(power, 1), np.roll(power, -1)
    before[0] = after[-1] = 0.0
    tops = np.flatnonzero((power > before) & (power >= after))
    signal = prepared(record, STEP, PulseOptions(), 5.0)
    found = np.array(summits(signal, wavelet, period, number, nearly=0.25))
    for square, time in found:
        top = tops[np.abs(tops * STEP - time).argmin()]
        assert time == pytest.approx(top * STEP, abs=0.06 * period)
        assert square == pytest.approx(power[top], rel=0.05)
    for top in tops[power[tops] > 0.6 * power.max()]:
        assert np.abs(found[:, 1] - top * STEP).min() < 0.06 * period


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("centre", [0.1, -0.1])
def test_summits_at_the_end_are_as_high_as_at_the_start(wavelet: str, centre: float) -> None:
    """A record ends between two times of the search, and starts at the first one."""
    options = PulseOptions()
    number = 1.5 if WAVELETS[wavelet].has_half_cycles else None
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0, time=centre)
    for size in range(500, 530):
        record = pulse.acceleration(STEP * np.arange(size))
        highest = []
        for one in (record, record[::-1].copy()):
            signal = prepared(one, STEP, options, 5.0)
            found = summits(signal, wavelet, 1.0, number, nearly=0.95)
            heights = search(signal, np.array([1.0]), (wavelet,), (1.5,))[wavelet].power
            highest += [max(square for square, _ in found), float(heights.max())]
            assert all(0.0 <= time <= (1.0 + 1e-12) * signal.duration for _, time in found)
        np.testing.assert_allclose(highest, highest[0], rtol=0.06)


def top_of(products: np.ndarray, steps: range, beyond: float, kind: int) -> float:
    """Return the largest square of one signal, at one period of a wavelet with these parts."""
    highest, best = np.empty((3, 2, 1, 1)), np.array([[0.0], [0.0], [np.inf]])
    power = np.empty(len(steps) + 1, dtype=np.float32)
    work, place = (power, power.view(np.int32)), (np.array([1]), 1, 0, 1)
    factors = np.array([[2.0], [3.0]])
    times = (steps.start, beyond)
    tops(products[None], work, times, np.array([kind]), factors, place, best, highest)
    np.testing.assert_array_equal(best[:, 0], [0.0, 3.0 * highest[1, 1, 0, 0], np.inf])
    return float(highest[1, 1, 0, 0]) / 2.0


@pytest.mark.parametrize("kind", [0, 1, 2])
@pytest.mark.parametrize("top", [-0.6, 0.0, 0.3, 0.7, 3.4, 6.6, 7.2, 7.4, 7.9, 9.0])
def test_the_largest_square_of_a_parabola_is_exact(kind: int, top: float) -> None:
    """It is the largest from the first step to the end, which is 0.4 steps after the last."""
    start, beyond = 3, 0.4

    def curve(step: np.ndarray | float) -> np.ndarray:
        return np.asarray(1.0 - ((step - top) / 16.0) ** 2)

    products = np.full((2, 16), 7.0, dtype=np.float32)  # larger outside the range
    steps = np.arange(9.0)
    values = np.sqrt(0.5 * curve(steps)) if kind == 2 else -curve(steps)
    products[:, start : start + 9] = 0.0
    products[slice(None) if kind == 2 else kind, start : start + 9] = values
    largest = float(curve(min(max(top, 0.0), 7.0 + beyond)))
    assert top_of(products, range(start, start + 8), beyond, kind) == pytest.approx(
        largest if kind == 2 else largest**2, rel=1e-6
    )


def test_an_end_above_all_steps_counts() -> None:
    """The last step is below another one, and the end of the range is above both."""
    products = np.zeros((1, 8), dtype=np.float32)
    products[0, :5] = [0.5, 1.0, 0.5, 0.8, 1.6]
    on_parabola = 0.8 + 0.25 * (1.6 - 0.5) + 0.125 * (0.5 - 1.6 + 1.6)
    assert top_of(products, range(4), 0.5, 0) == pytest.approx(on_parabola**2, rel=1e-6)


def test_a_start_from_which_a_hollow_curve_falls_counts() -> None:
    products = np.zeros((1, 8), dtype=np.float32)
    products[0, :4] = [1.0, 0.4, 0.1, 0.1]
    assert top_of(products, range(3), 0.5, 0) == 1.0


def test_the_unit_of_a_record_does_not_change_its_verdict() -> None:
    """Surrogates are drawn in single precision, in which squares of 1e20 overflow."""
    options = PulseOptions(wavelet=("symmetric_ricker",), surrogates=19)
    for unit in (1e-12, 1e12):
        record = unit * with_pulse(1, 3.0)
        found = likeness(record, STEP, match_pulses(record, STEP, options), options)
        assert found["symmetric_ricker"].verdict is PulseVerdict.PULSE
        assert found["symmetric_ricker"].p_value == pytest.approx(0.05)


@pytest.mark.parametrize("weighting", list(Weighting))
def test_cut_records_that_end_suddenly_keep_their_highest_coefficients(
    weighting: Weighting,
) -> None:
    """Smoothed noise is strong at its ends, where decimated samples ring beyond the record."""
    options = PulseOptions(weighting=weighting.value)
    for seed in range(12):
        random = np.random.default_rng(seed)
        noise = np.convolve(random.normal(size=1000), np.ones(random.integers(2, 60)), "same")
        low, high = period_range(noise.size, 0.01, options)
        signal, periods = prepared(noise, 0.01, options, high), ladder(low, high)
        chosen = (signal, periods, options.wavelet, options.half_cycles)
        whole, cut = search(*chosen), search(*chosen, nearly=0.95)
        weight = weighting.of_square(periods)[:, None]
        for name, heights in whole.items():
            highest = (heights.power * weight).max()
            assert (cut[name].power * weight).max() == pytest.approx(highest, rel=3e-3)


def test_a_cut_holds_its_own_pulse_and_none_that_leaves_it() -> None:
    """To either side, or because it is longer; a pulse may leave it with the record itself."""
    wavelet = "symmetric_ricker"
    record = transform_record(noise(0), STEP, Weighting.ENERGY, 5.0)
    cut = cut_around(record, wavelet, 1.0, 15.0, None)
    assert 0.0 < cut.start < cut.start + cut.duration < record.duration
    held = {
        (period, time): holds(cut, record, wavelet, period, time, None)
        for period in (1.0, 2.0)
        for time in (13.0, 15.0, 17.0)
    }
    assert [place for place, answer in held.items() if answer] == [(1.0, 15.0)]
    for end in (0.0, record.duration):
        assert holds(cut_around(record, wavelet, 1.0, end, None), record, wavelet, 1.0, end, None)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("bend", [-0.5, 0.5])
def test_a_step_leads_uphill_and_is_limited(sign: float, bend: float) -> None:
    """Newton's method steps by slope over curvature, and downhill where the curve is hollow."""
    for slope in (0.01, 10.0):
        assert uphill([sign * slope], (bend, 0.0, 0.0)) == [sign * min(slope / 0.5, _LONGEST_MOVE)]


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_a_step_of_two_variables_leads_to_the_top_or_away_from_a_hollow(angle: float) -> None:
    """In axes turned by an angle; curvatures of 3 and 5, the second downward or upward."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    slope = turn @ [0.03, -0.04]
    for second in (-5.0, 5.0):
        bend = turn @ np.diag([-3.0, second]) @ turn.T
        step = uphill(slope.tolist(), (bend[0, 0], bend[0, 1], bend[1, 1]))
        np.testing.assert_allclose(turn.T @ step, [0.01, -0.008], atol=1e-15)
