"""The verdict from the share of an ensemble, its words and its colour; envelopes of histories."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.rocking import (
    GroundAcceleration,
    SpreadVerdict,
    Verdict,
    VerdictKind,
    ensemble_responses,
    members,
    respond,
    with_ensemble,
    with_envelope,
)
from rockframe.rocking.margins.members import draws
from rockframe.rocking.verdict import ModelEnd
from rockframe.wavelets.pulse import Pulse

from .motions import BENT

shares = st.floats(0.0, 1.0)
scales = st.none() | st.just(math.nan) | st.floats(0.01, 10.0)


@pytest.mark.parametrize(
    ("overturned", "members_", "kind"),
    [
        (0, 64, VerdictKind.STANDS),
        (3, 64, VerdictKind.STANDS),  # 4.7 %
        (5, 100, VerdictKind.STANDS),  # at most 5 %
        (4, 64, VerdictKind.MAY_OVERTURN),  # 6.3 %
        (60, 64, VerdictKind.MAY_OVERTURN),  # 93.8 %
        (95, 100, VerdictKind.OVERTURNS),  # at least 95 %
        (61, 64, VerdictKind.OVERTURNS),  # 95.3 %
    ],
)
def test_the_verdict_follows_from_the_share_alone(
    overturned: int, members_: int, kind: VerdictKind
) -> None:
    for nominal in Verdict:
        share = overturned / members_
        assert SpreadVerdict(nominal, share_overturned=share, share_uplifted=1.0).kind is kind


@pytest.mark.parametrize(
    ("share", "words"), [(0.051, "5.1"), (0.949, "94.9"), (0.31, "31"), (0.94, "94")]
)
def test_a_rounded_share_does_not_contradict_the_rule(share: float, words: str) -> None:
    verdict = SpreadVerdict(Verdict.STANDS, share_overturned=share)
    assert verdict.words == f"may overturn ({words} %)"


def test_no_uplift_means_that_no_member_uplifts() -> None:
    alone = SpreadVerdict(Verdict.NO_UPLIFT, share_overturned=0.0, share_uplifted=1.0 / 64.0)
    assert alone.words == "stands"
    none = SpreadVerdict(Verdict.NO_UPLIFT, share_overturned=0.0, share_uplifted=0.0)
    assert none.words == "no uplift"


@pytest.mark.parametrize(
    ("verdict", "sentence"),
    [
        (SpreadVerdict(Verdict.STANDS), "stands"),
        (SpreadVerdict(Verdict.OVERTURNS, overturning_time=5.84), "overturns 5.8 s"),
        (
            SpreadVerdict(Verdict.STANDS, critical_scale=0.906),
            "stands; nominal critical scale 0.91",
        ),
        (
            SpreadVerdict(Verdict.STANDS, critical_scale=math.nan, largest_scale=10.0),
            "stands; nominal critical scale > 10",
        ),
        (
            SpreadVerdict(
                Verdict.OVERTURNS, overturning_time=5.8, share_overturned=0.3, robust_scale=0.94
            ),
            "may overturn (30 %); 10 % overturn at 0.94",
        ),
        (
            SpreadVerdict(
                Verdict.STANDS,
                share_overturned=0.0,
                robust_scale=math.nan,
                critical_scale=1.0,
                largest_scale=2.5,
            ),
            "stands; 10 % overturn at > 2.5",
        ),
        (
            SpreadVerdict(
                Verdict.STANDS,
                share_overturned=0.0,
                share_model_ends=0.69,
                model_ends={"gap_closed_time": 36.5, "tendon_yield_time": 30.0},
            ),
            "stands; tendon yields in 69 %",
        ),
        (
            SpreadVerdict(Verdict.STANDS, share_overturned=0.0, share_model_ends=0.03),
            "stands; model ends in 3 %",
        ),
        (
            SpreadVerdict(
                Verdict.STANDS,
                share_overturned=0.0,
                share_model_ends=0.69,
                model_ends={"gap_closed_time": math.nan},
                model_end=ModelEnd.GAP_CLOSES,
            ),
            "stands; gap closes in 69 %",
        ),
    ],
)
def test_sentences(verdict: SpreadVerdict, sentence: str) -> None:
    assert verdict.sentence == sentence


@given(shares, shares, scales)
def test_a_larger_share_is_never_safer(first: float, other: float, scale: float | None) -> None:
    low, high = sorted((first, other))
    assert verdict_of(low, scale).danger <= verdict_of(high, scale).danger


@given(shares, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_a_smaller_margin_is_never_safer(share: float, first: float, other: float) -> None:
    low, high = sorted((first, other))
    assert verdict_of(share, low).danger >= verdict_of(share, high).danger


@given(shares, scales)
def test_the_colour_lies_between_its_ends(share: float, scale: float | None) -> None:
    assert 0.0 <= verdict_of(share, scale).danger <= 1.0


def test_ends_of_the_colour() -> None:
    assert verdict_of(0.0, 2.0).danger == 0.0
    assert verdict_of(1.0, 0.5).danger == 1.0
    assert SpreadVerdict(Verdict.OVERTURNS).danger == 1.0


@pytest.mark.parametrize("scale", [1.0, 1.06, 1.19])
def test_a_margin_below_1_2_is_not_green(scale: float) -> None:
    """It is nearer to the colour between the ends, 0.5, than to that of safety, 0."""
    assert verdict_of(0.0, scale).danger > 0.25


def verdict_of(share: float, scale: float | None) -> SpreadVerdict:
    return SpreadVerdict(Verdict.STANDS, share_overturned=share, robust_scale=scale)


#: A pulse that overturns some of the members of the bent.
NEAR = Pulse(wavelet="symmetric_ricker", a_p=0.547 * 9.81, T_p=1.5)


def test_a_response_with_its_ensemble_states_the_share() -> None:
    [response] = with_ensemble([respond(BENT, NEAR)], NEAR)
    [[expected]] = ensemble_responses([NEAR], [BENT])
    assert repr(response.ensemble) == repr(expected)
    assert response.spread_verdict.share_overturned == expected.share_overturned
    assert response.spread_verdict.nominal is response.verdict
    assert response.facts()["verdict"] == response.spread_verdict.sentence
    assert "nominal verdict" in respond(BENT, NEAR).facts()


@pytest.mark.parametrize(("a_p", "fallen"), [(0.5, 0), (1.0, 1)])
def test_the_facts_of_an_ensemble_are_its_bands(a_p: float, fallen: int) -> None:
    """A quantile that members reach by overturning is a word."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=a_p * NEAR.a_p, T_p=1.5)
    [[ensemble]] = ensemble_responses([pulse], [BENT])
    bands = {
        "θ/α": np.array(ensemble.bands.peak_rotation_ratio),
        "u": 100.0 * np.array(ensemble.bands.peak_u),
    }
    for label, band in bands.items():
        (words,) = (
            text for name, text in ensemble.facts().items() if name.startswith(f"{label}, 16")
        )
        finite = band[np.isfinite(band)]
        assert [float(word) for word in words.split()[: finite.size]] == pytest.approx(
            finite, rel=0.01
        )
        assert words.split()[finite.size :] == ["overturns"] * (3 - finite.size)
        assert finite.size <= 3 - fallen


def test_an_envelope_without_spreads_is_the_history() -> None:
    nothing = dict.fromkeys(("height", "width", "amplitude"), 0.0)
    alone = Ensemble(impact_loss=1.0, **nothing)
    weaker = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.5)
    response = with_envelope(respond(BENT, weaker), weaker, alone)
    assert_array_equal(response.theta_low, response.theta)
    assert_array_equal(response.theta_high, response.theta)


def test_an_envelope_has_the_quantiles_of_separate_responses() -> None:
    """A member that has fallen lies beyond all others."""
    later = Pulse(wavelet="symmetric_ricker", a_p=NEAR.a_p, T_p=NEAR.T_p, time=5.0)
    samples = later.acceleration(0.02 * np.arange(800))
    motion = GroundAcceleration.from_samples(samples, 0.02)
    response = with_envelope(respond(BENT, motion), motion)
    ensemble = Ensemble()
    each = [
        respond(member, GroundAcceleration.from_samples(scale * samples, 0.02)).theta
        for member, scale in zip(
            members(ensemble, BENT), draws(ensemble)[:, 3].tolist(), strict=True
        )
    ]
    theta = np.stack(each)
    fallen = np.isnan(theta)
    side = np.sign(np.array([rotation[~np.isnan(rotation)][-1] for rotation in each]))
    theta = np.where(fallen, side[:, None] * 1e3, theta)
    low, high = np.quantile(theta, (0.16, 0.84), axis=0)
    near = (np.abs(low) < 3.0) & (np.abs(high) < 3.0)
    assert near.any()
    assert fallen.any()
    np.testing.assert_allclose(np.asarray(response.theta_low)[near], low[near], atol=1e-12)
    np.testing.assert_allclose(np.asarray(response.theta_high)[near], high[near], atol=1e-12)


def test_an_envelope_needs_members() -> None:
    with pytest.raises(ParameterError, match="Invalid number of members 0"):
        with_envelope(respond(BENT, NEAR), NEAR, Ensemble(members=0))


def test_the_colour_of_a_margin_beyond_the_search_is_that_of_the_largest_scale() -> None:
    searched = {scale: SpreadVerdict(Verdict.STANDS, share_overturned=0.0, robust_scale=math.nan,
                                     largest_scale=scale) for scale in (1.2, 10.0)}  # fmt: skip
    measured = SpreadVerdict(Verdict.STANDS, share_overturned=0.0, robust_scale=1.2)
    assert searched[1.2].danger == measured.danger
    assert searched[10.0].danger == 0.0
