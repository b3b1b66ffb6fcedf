"""Pulses are reported as pulses, and noise that swells and fades is not.

``python -m tests.matching.test_likeness`` prints the rates over more records.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from rockframe.errors import ParameterError
from rockframe.matching import record_pulses
from rockframe.matching.match import match_pulses
from rockframe.matching.record_pulses import (
    Likeness,
    _enough,
    _indices,
    find_pulses,
    likeness,
)
from rockframe.matching.search import search
from rockframe.matching.signal import Weighting
from rockframe.matching.verdict import PulseVerdict
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.pulse import Pulse

from .test_noise import STEP, TIME, coloured

RICKERS = PulseOptions(wavelet=("symmetric_ricker", "antisymmetric_ricker"))


def judged(record: np.ndarray, options: PulseOptions = RICKERS) -> dict[str, Likeness]:
    matches = match_pulses(record, STEP, options)
    return likeness(record, STEP, matches, options)


def noise(seed: int) -> np.ndarray:
    return coloured(np.random.default_rng([seed, 5]))


def with_pulse(seed: int, ratio: float) -> np.ndarray:
    """Return noise with a pulse of `ratio` times its energy."""
    planted = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.2, time=10.0).acceleration(TIME)
    beside = noise(seed)
    beside *= math.sqrt(float(planted @ planted) / float(beside @ beside) / ratio)
    return np.asarray(planted + beside)


def calls(records: list[np.ndarray], options: PulseOptions = RICKERS) -> float:
    """Return the share of records in which the symmetric wavelet's match is reported as a pulse.

    Each record has surrogates of its own.
    """
    verdicts = [
        judged(record, options.replaced(seed=k))["symmetric_ricker"].verdict
        for k, record in enumerate(records)
    ]
    return sum(verdict is PulseVerdict.PULSE for verdict in verdicts) / len(verdicts)


def test_noise_is_not_called_a_pulse_more_often_than_the_level_allows() -> None:
    assert calls([noise(seed) for seed in range(40)]) <= 0.05 + 2.0 * math.sqrt(0.05 * 0.95 / 40)


def test_planted_pulses_are_called_pulses() -> None:
    assert calls([with_pulse(seed, 1.0) for seed in range(20)]) >= 0.9


def test_plain_scrambling_calls_noise_a_pulse_because_it_swells_and_fades() -> None:
    """Without the envelope, noise that swells is called a pulse, and steady noise rarely is."""
    plain = RICKERS.replaced(scrambling="plain")
    assert calls([noise(seed) for seed in range(20)], plain) >= 0.7
    steady = [np.random.default_rng([seed, 6]).normal(size=1500) for seed in range(20)]
    assert calls(steady, plain) <= 0.25


@pytest.mark.parametrize("record", [noise(1), with_pulse(2, 0.2), with_pulse(1, 1.0)])
def test_the_result_does_not_depend_on_how_many_surrogates_are_searched_at_once(
    record: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the coarse search rounds otherwise, as it cuts all of them to one length."""
    together = judged(record)
    monkeypatch.setattr(record_pulses, "_VALUES", 0)
    few = judged(record)
    for name, one in together.items():
        assert (one.verdict, one.surrogates) == (few[name].verdict, few[name].surrogates)
        assert one.p_value == pytest.approx(few[name].p_value, abs=0.02)
        assert one.median == pytest.approx(few[name].median, rel=1e-3)


def test_the_search_ends_at_the_first_ten_after_which_no_wavelet_can_pass() -> None:
    """Four surrogates of 99 may match as well; the later wavelet decides."""
    beaten = np.zeros((2, 60), dtype=bool)
    beaten[0, :5] = beaten[1, 20:25] = True
    assert _enough(beaten, 4) == 30
    assert _enough(beaten[:, :20], 4) == 0
    assert _enough(beaten, 5) == 0


def test_the_same_seed_draws_the_same_surrogates() -> None:
    record = with_pulse(3, 0.5)
    assert judged(record) == judged(record)
    other = judged(record, RICKERS.replaced(seed=1))
    assert other["symmetric_ricker"].median != judged(record)["symmetric_ricker"].median


def test_the_last_bit_of_a_sample_does_not_change_the_noise() -> None:
    """Processors round the last bits of samples differently."""
    record = noise(1)
    nearly = record.copy()
    nearly[::7] = np.nextafter(record[::7], np.inf)
    one, other = (judged(each)["symmetric_ricker"] for each in (record, nearly))
    assert other.p_value == one.p_value
    assert other.median == pytest.approx(one.median, rel=1e-6)


def test_records_of_one_length_have_noise_of_their_own() -> None:
    record = noise(1)
    matches = match_pulses(record, STEP, RICKERS)
    found = [likeness(record, STEP, matches, RICKERS, name) for name in ("CCC-090", "CCC-360")]
    assert len({one["symmetric_ricker"].median for one in found}) == 2


def test_drawing_ends_when_the_verdict_is_certain_and_not_before() -> None:
    """If 5 of 99 surrogates match better than the record, p can no longer reach 0.05."""
    some = judged(noise(1))["symmetric_ricker"]
    assert 19 <= some.surrogates < 99
    assert some.verdict is PulseVerdict.NOISE
    assert some.p_value > 0.05
    clear = judged(with_pulse(1, 3.0))["symmetric_ricker"]
    assert clear.surrogates == 99
    assert clear.p_value == pytest.approx(0.01)


@pytest.mark.parametrize(("seed", "ratio"), [(4, 0.1), (8, 0.1), (4, 0.2), (5, 0.2)])
def test_the_high_level_is_exceeded_by_a_twentieth_of_the_surrogates(
    seed: int, ratio: float
) -> None:
    """So a record that 5 to 10 % of them beat is below it, and one that 4 % beat is above it."""
    one = judged(with_pulse(seed, ratio))["symmetric_ricker"]
    beaten = (one.p_value * (one.surrogates + 1) - 1.0) / one.surrogates
    assert 0.04 < beaten < 0.1
    assert (one.match_index < one.high) == (beaten > 0.05)


@pytest.mark.parametrize("seed", [9, 28, 31, 38])
def test_half_of_the_surrogates_exceed_their_median(seed: int) -> None:
    """So noise that slightly more than half of them beat is below it, and vice versa."""
    one = judged(noise(seed))["symmetric_ricker"]
    beaten = (one.p_value * (one.surrogates + 1) - 1.0) / one.surrogates
    assert 0.4 < beaten < 0.6
    assert (one.match_index < one.median) == (beaten > 0.5)


@pytest.mark.parametrize("weighting", list(Weighting))
def test_the_verdict_is_under_the_weighting_of_the_pulse(weighting: Weighting) -> None:
    record = with_pulse(2, 5.0)
    options = RICKERS.replaced(weighting=str(weighting))
    one = judged(record, options)["symmetric_ricker"]
    match = match_pulses(record, STEP, options)["symmetric_ricker"]
    # the coarse search of the comparison lies a little below the refined match
    assert one.match_index == pytest.approx(match.match_index, rel=0.15)
    assert one.median < one.match_index


def test_a_match_at_the_end_of_the_range_is_never_called_a_pulse() -> None:
    options = RICKERS.replaced(periods_s=(0.2, 0.8))
    one = judged(with_pulse(4, 20.0), options)["symmetric_ricker"]
    assert one.verdict is PulseVerdict.AT_BOUND


def test_without_surrogates_nothing_is_said() -> None:
    one = judged(noise(0), RICKERS.replaced(surrogates=0))["symmetric_ricker"]
    assert one.verdict is PulseVerdict.UNTESTED
    assert math.isnan(one.p_value)


@pytest.mark.parametrize("count", [1, 18])
def test_too_few_surrogates_are_refused(count: int) -> None:
    with pytest.raises(ParameterError, match=rf"surrogates {count}. Must be 0, or 19 to 9999"):
        PulseOptions(surrogates=count)


def test_runners_up_are_found_in_what_is_left() -> None:
    planted = [
        Pulse(wavelet="antisymmetric_ricker", a_p=a_p, T_p=period, time=time)
        for a_p, period, time in ((2.0, 1.0, 8.0), (1.0, 0.7, 16.0), (0.5, 1.5, 23.0))
    ]
    record = sum((pulse.acceleration(TIME) for pulse in planted), np.zeros(TIME.size))
    found = find_pulses(record, STEP, PulseOptions(surrogates=0))
    pulses = [found.matches[found.used].pulse, *(up.match.pulse for up in found.runners_up)]
    for pulse, expected in zip(pulses, planted, strict=True):
        assert pulse.a_p == pytest.approx(expected.a_p, rel=1e-3)
        assert pulse.T_p == pytest.approx(expected.T_p, rel=1e-3)
    shares = [found.matches[found.used].energy_share, *(up.energy_share for up in found.runners_up)]
    assert sum(shares) == pytest.approx(1.0, abs=1e-4)


def test_velocity_indicator_tells_a_long_pulse_from_none() -> None:
    off = PulseOptions(surrogates=0, runners_up=0)
    assert find_pulses(with_pulse(5, 30.0), STEP, off).velocity.indicator > 0.85
    assert find_pulses(noise(5), STEP, off).velocity.indicator < 0.15


def test_what_the_coarse_search_skips_is_not_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """A longer pulse, which is searched first, matches a pulse nearly as well as its own period."""
    planted = (
        Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=period, time=10.0).acceleration(TIME)
        for period in np.geomspace(0.3, 4.0, 20)
    )
    records = np.array([one.astype(np.float32) for one in planted])
    skipping = _indices(records, STEP, PulseOptions())
    monkeypatch.setattr(record_pulses, "search", lambda *given, **_: search(*given))
    searching = _indices(records, STEP, PulseOptions())
    np.testing.assert_allclose(skipping, searching, rtol=2e-3)


def test_the_velocity_pulse_is_the_same_whichever_way_the_record_points() -> None:
    off = RICKERS.replaced(surrogates=0)
    one, other = (find_pulses(sign * with_pulse(5, 3.0), STEP, off).velocity for sign in (1, -1))
    assert other.peak_ratio == pytest.approx(one.peak_ratio, rel=1e-9)
    assert other.indicator == pytest.approx(one.indicator, rel=1e-9)


def sudden(seed: int) -> np.ndarray:
    """Return noise that starts within half a second and fades over 1 to 4 s."""
    random = np.random.default_rng([seed, 7])
    fading = np.exp(-(TIME - 5.0) / random.uniform(1.0, 4.0))
    envelope = np.clip((TIME - 4.5) / 0.5, 0.0, 1.0) * np.where(TIME < 5.0, 1.0, fading)
    swelling = (TIME / 8.0) ** 2 * np.exp(2.0 - TIME / 4.0)
    return np.asarray(coloured(random) / np.maximum(swelling, 0.05) * (envelope + 0.02))


ENVELOPES = ("swells once", "rises, stays and fades", "swells twice")


def of_soil(seed: int, envelope: str) -> np.ndarray:
    """Return noise that a damped soil of 1 to 4 Hz has filtered, in one of three envelopes."""
    random = np.random.default_rng([seed, 8, ENVELOPES.index(envelope)])
    soil, damping = random.uniform(1.0, 4.0), random.uniform(0.3, 0.8)
    ratio = np.fft.rfftfreq(TIME.size, STEP) / soil
    filtered = (1.0 + 2j * damping * ratio) / (1.0 - ratio**2 + 2j * damping * ratio)
    slow = ratio * soil / 0.2
    colour = filtered * slow**2 / np.hypot(1.0, slow**2)
    samples = np.fft.irfft(colour * np.fft.rfft(random.normal(size=TIME.size)), TIME.size)
    power, length = random.uniform(1.0, 3.0), random.uniform(4.0, 10.0)
    swelling = (TIME / length * np.exp(1.0 - TIME / length)) ** power
    if envelope == "rises, stays and fades":
        rise = random.uniform(1.0, 4.0)
        fading = np.exp(-(TIME - rise - length) / random.uniform(2.0, 5.0))
        swelling = np.minimum(np.minimum(TIME / rise, 1.0), fading)
    elif envelope == "swells twice":
        swelling = swelling + 0.6 * np.exp(-(((TIME - random.uniform(12.0, 20.0)) / 1.5) ** 2))
    return np.asarray(samples * swelling)


def share_selected(records: list[np.ndarray]) -> float:
    """Return the share of records whose selected pulse, of any wavelet, is reported as a pulse."""
    options = [PulseOptions(runners_up=0, seed=k) for k in range(len(records))]
    found = [
        find_pulses(one, STEP, with_seed) for one, with_seed in zip(records, options, strict=True)
    ]
    pulses = [one.likeness[one.used].verdict is PulseVerdict.PULSE for one in found]
    return sum(pulses) / len(pulses)


def with_any_pulse(seed: int, ratio: float) -> np.ndarray:
    """Return noise of soil with a Ricker of 0.5 to 2 s of `ratio` times its energy."""
    random = np.random.default_rng([seed, 9])
    wavelet = ("symmetric_ricker", "antisymmetric_ricker")[seed % 2]
    period, time = random.uniform(0.5, 2.0), random.uniform(6.0, 14.0)
    pulse = Pulse(wavelet=wavelet, a_p=1.0, T_p=period, time=time).acceleration(TIME)
    beside = of_soil(1000 + seed, ENVELOPES[0])
    return np.asarray(
        pulse + beside * math.sqrt(float(pulse @ pulse) / float(beside @ beside) / ratio)
    )


def table() -> None:
    plain = RICKERS.replaced(scrambling="plain")
    print("called a pulse")
    print(f"noise, 200 records                  {calls([noise(i) for i in range(200)]):.3f}")
    print(f"the same, plain scrambling, 50      {calls([noise(i) for i in range(50)], plain):.3f}")
    print(f"noise that starts at once, 100      {calls([sudden(i) for i in range(100)]):.3f}")
    for ratio in (0.3, 1.0, 3.0):
        share = calls([with_pulse(i, ratio) for i in range(60)])
        print(f"pulse of {ratio:3g} times its energy, 60    {share:.3f}")
    print("selected pulse called a pulse")
    for envelope in ENVELOPES:
        share = share_selected([of_soil(i, envelope) for i in range(200)])
        print(f"noise of soil, {envelope}, 200".ljust(45), f"{share:.3f}")
    for ratio in (0.3, 1.0):
        share = share_selected([with_any_pulse(i, ratio) for i in range(100)])
        print(f"pulse of {ratio:3g} times its energy, 100".ljust(45), f"{share:.3f}")


if __name__ == "__main__":
    table()
