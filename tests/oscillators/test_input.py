"""Invalid input: an error of one line with key, value and allowed values."""

from __future__ import annotations

import math
from typing import Any

import pytest

from rockframe import (
    FixedFrame,
    IsolatedDeck,
    ParameterError,
    Pulse,
    RockingFrame,
    respond_oscillator,
    respond_oscillators,
)
from rockframe.parts import Dissipater
from rockframe.structures.comparison import Rivals

RUBBER: dict[str, Any] = {"strength_ratio": 0.05, "period": 2.5}
COLUMNS: dict[str, Any] = {
    "columns": 2, "height": 9.6, "width": 1.6, "depth": 1.6, "modulus": 30e9,
    "column_mass": 6e4, "deck_mass": 5e5,
}  # fmt: skip


def test_the_facts_of_an_elastic_frame_have_no_ductility_and_no_yielding() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.0)
    facts = respond_oscillator(FixedFrame(period=0.5), pulse).facts()
    assert {*facts} == {"bridge", "largest u", "left u", "largest force over weight"}


def test_bridges_are_compared_with_a_free_frame() -> None:
    bars = Dissipater(stiffness=5e7, yield_force=1e5, lever_arm=0.8)
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=5e4, dissipater=bars)
    with pytest.raises(ParameterError, match="State it without them"):
        Rivals(bent)


@pytest.mark.parametrize(
    ("make", "valid", "wrong", "words"),
    [
        (IsolatedDeck.lead_rubber, RUBBER, {"strength_ratio": -0.05}, "positive and finite"),
        (IsolatedDeck.lead_rubber, RUBBER, {"strength_ratio": math.nan}, "positive and finite"),
        (IsolatedDeck.lead_rubber, RUBBER, {"period": 0.0}, "positive and finite"),
        (IsolatedDeck.lead_rubber, RUBBER, {"period": None}, "State period, or both"),
        (IsolatedDeck.lead_rubber, RUBBER, {"effective_period": 2.0}, "State period, or both"),
        (IsolatedDeck.lead_rubber, RUBBER, {"yield_displacement": -0.01}, "0 or above"),
        (IsolatedDeck.lead_rubber, RUBBER, {"damping_ratio": 1.0}, "at least 0 and below 1"),
        (IsolatedDeck.friction_pendulum, {"friction": 0.06}, {"radius": -2.0}, "positive"),
        (IsolatedDeck.friction_pendulum, {"radius": 2.0}, {"friction": 0.0}, "positive"),
        (IsolatedDeck.friction_pendulum, {"radius": 2.0}, {"friction": math.inf}, "positive"),
        (FixedFrame, {}, {"period": math.inf}, "positive and finite"),
        (FixedFrame, {"period": 0.5}, {"strength_ratio": 0.0}, "above 0"),
        (FixedFrame, {"period": 0.5}, {"strength_ratio": math.nan}, "above 0"),
        (FixedFrame, {"period": 0.5}, {"damping_ratio": -0.05}, "at least 0 and below 1"),
        (FixedFrame, {"period": 0.5}, {"post_yield_ratio": 1.0}, "at least 0 and below 1"),
        (FixedFrame, {"period": 0.5}, {"stability_coefficient": 1.0}, "at least 0 and below 1"),
        (FixedFrame, {"period": 0.5}, {"limit_ductility": 0.9}, "at least 1"),
        (FixedFrame.from_columns, COLUMNS, {"modulus": 1e6}, r"the columns buckle below it"),
        (FixedFrame.from_columns, COLUMNS, {"modulus": -1.0}, "positive and finite"),
        (FixedFrame.from_columns, COLUMNS, {"depth": 0.0}, "positive and finite"),
        (FixedFrame.from_columns, COLUMNS, {"column_mass": math.nan}, "0 or above"),
        (FixedFrame.from_columns, COLUMNS, {"cracked_stiffness_ratio": 0.0}, "positive"),
    ],
)
def test_a_wrong_value(make: Any, valid: dict[str, Any], wrong: dict[str, Any], words: str) -> None:
    [(key, value)] = wrong.items()
    with pytest.raises(ParameterError) as raised:
        make(**valid | wrong, name="mine")
    assert "\n" not in str(raised.value)
    assert words in str(raised.value)
    assert "'mine'" in str(raised.value)
    if words.startswith("State period"):
        return
    assert f"Invalid {key} {value!r}" in str(raised.value)


def test_isolators_have_no_viscous_damping_unless_it_is_stated() -> None:
    """Their strength dissipates; damping beside it would count that twice."""
    own = IsolatedDeck(**RUBBER, yield_displacement=0.01)
    pendulum = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
    assert own == IsolatedDeck.lead_rubber(**RUBBER, yield_displacement=0.01)
    assert own.damping_ratio == pendulum.damping_ratio == 0.0


def test_the_strength_alone_is_stiffer_than_the_effective_period() -> None:
    with pytest.raises(ParameterError, match=r"effective_period 3.0 .* below 2.006 s"):
        IsolatedDeck.lead_rubber(strength_ratio=0.1, effective_period=3.0, design_displacement=0.1)


def test_the_effective_period_is_that_of_the_secant_at_the_design_displacement() -> None:
    deck = IsolatedDeck.lead_rubber(
        strength_ratio=0.05, effective_period=2.5, design_displacement=0.25
    )
    k, _, q, _ = deck.constants
    assert math.tau / math.sqrt(k + q / 0.25) == pytest.approx(2.5, rel=1e-14)


def test_the_columns_stiffness_and_mass() -> None:
    """Columns have 12 E I / H^3 each, and 13/35 of their mass: int (3 x^2 - 2 x^3)^2 dx."""
    frame = FixedFrame.from_columns(**{**COLUMNS, "depth": None}, cracked_stiffness_ratio=0.5)
    stiffness = 2.0 * 12.0 * 0.5 * 30e9 * math.pi * 0.8**4 / 4.0 / 9.6**3
    share = 9.0 / 5.0 - 12.0 / 6.0 + 4.0 / 7.0
    mass = 5e5 + share * 2.0 * 6e4
    assert frame.period == pytest.approx(math.tau * math.sqrt(mass / stiffness), rel=1e-14)


def test_many_need_one_of_each() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
    frame = FixedFrame(period=0.5)
    with pytest.raises(ParameterError, match="number of models, 0"):
        respond_oscillators([], [pulse])
    with pytest.raises(ParameterError, match="Invalid scales"):
        respond_oscillators([frame], [pulse], [math.nan])
