"""Ensembles of bridges that do not rock: their members are separate responses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rockframe import ParameterError, Pulse, RockingFrame
from rockframe.options.respond import BridgeEnsemble, Ensemble
from rockframe.oscillators.ensemble import bridge_draws, bridge_members
from rockframe.oscillators.response import respond_oscillators
from rockframe.parts import Abutment
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.rocking import ensemble_responses
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import draws
from rockframe.rocking.verdict import ModelEnd
from rockframe.structures.comparison import Rivals, compare
from rockframe.structures.contract import Compared
from rockframe.units import GRAVITY

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
RUBBER = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=3.0)
PENDULUM = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
FIXED = FixedFrame(period=0.5, strength_ratio=0.2, stability_coefficient=0.02)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.3 * GRAVITY, T_p=1.5)
SMALL = BridgeEnsemble(members=16, seed=4)
SAME = BridgeEnsemble(
    members=16,
    **dict.fromkeys(("height", "width", "amplitude", "friction"), 0.0),
    impact_loss=1.0,
    **dict.fromkeys(("isolator_strength", "isolator_stiffness", "cracked_stiffness"), 0.0),
    yield_strength=0.0,
)


def compared(isolated: IsolatedDeck, ensemble: BridgeEnsemble) -> dict[str, Compared]:
    compared = compare(Rivals(BENT, isolated=isolated, fixed=FIXED), PULSE, ensemble)
    return {model.model: model for model in compared}


@pytest.mark.parametrize("isolated", [RUBBER, PENDULUM])
def test_without_spreads_the_bands_are_the_nominal_peaks(isolated: IsolatedDeck) -> None:
    for model in compared(isolated, SAME).values():
        assert model.ensemble is not None
        assert model.ensemble.share_overturned == 0.0
        for name, peak in (("peak_u", model.peak_u), ("peak_base_shear", model.peak_base_shear)):
            assert_allclose(getattr(model.ensemble.bands, name), peak, rtol=1e-9)


@pytest.mark.parametrize("model", [RUBBER, PENDULUM, FIXED])
def test_members_are_separate_responses(model: IsolatedDeck | FixedFrame) -> None:
    isolated, fixed = (model, None) if isinstance(model, IsolatedDeck) else (None, model)
    rivals = Rivals(BENT, isolated=isolated, fixed=fixed)
    [ensemble] = [
        compared_model.ensemble
        for compared_model in compare(rivals, PULSE, SMALL)
        if compared_model.model != "free"
    ]
    assert ensemble is not None
    scales = draws(SMALL)[:, 3]
    every = respond_oscillators(bridge_members(SMALL, model), [PULSE], scales).peak_displacement[0]
    assert_allclose(ensemble.bands.peak_u, quantiles(np.diag(every)), rtol=1e-9)
    rocking = set(ensemble.bands) - {"peak_u", "peak_v", "peak_base_shear"}
    assert all(math.isnan(bound) for name in rocking for bound in ensemble.bands[name])
    assert math.isnan(ensemble.share_uplifted)


def test_each_bridge_has_its_own_spreads() -> None:
    factors = bridge_draws(SMALL)
    pendulums, rubber = bridge_members(SMALL, PENDULUM), bridge_members(SMALL, RUBBER)
    fixed = bridge_members(SMALL, FIXED)
    assert {pendulum.period for pendulum in pendulums} == {PENDULUM.period}
    friction = [pendulum.strength_ratio / PENDULUM.strength_ratio for pendulum in pendulums]
    assert_allclose(friction, factors["friction"])
    strength = [deck.strength_ratio / RUBBER.strength_ratio for deck in rubber]
    assert_allclose(strength, factors["isolator_strength"])
    stiffness = [(RUBBER.period / deck.period) ** 2 for deck in rubber]
    assert_allclose(stiffness, factors["isolator_stiffness"])
    stiffness = [(FIXED.period / frame.period) ** 2 for frame in fixed]
    assert_allclose(stiffness, factors["cracked_stiffness"])
    strength = [frame.strength_ratio / FIXED.strength_ratio for frame in fixed]
    assert_allclose(strength, factors["yield_strength"])
    # P-delta is a fixed stiffness
    geometric = [
        frame.stability_coefficient / frame.period**2
        for frame in fixed
        if isinstance(frame, FixedFrame)
    ]
    assert_allclose(geometric, FIXED.stability_coefficient / FIXED.period**2)
    for name, drawn in factors.items():
        spread = getattr(SMALL, name)
        assert spread * 14 / 16 < max(drawn) - 1.0 < spread
        assert -spread < min(drawn) - 1.0 < -spread * 14 / 16


def test_rocking_bridges_have_the_ensemble_of_respond() -> None:
    free = compared(RUBBER, SMALL)["free"].ensemble
    same = Ensemble(members=16, seed=4)
    [[alone]] = ensemble_responses([PULSE], [BENT], same)
    assert free == alone or str(free) == str(alone)  # NaN of restraints
    assert_array_equal(draws(SMALL), draws(same))


def test_the_model_of_a_fixed_bridge_ends_at_its_ductility() -> None:
    models = compared(RUBBER, BridgeEnsemble())
    fixed = models["fixed"].ensemble
    assert models["fixed"].model_end is ModelEnd.DUCTILITY_EXCEEDED
    assert fixed is not None
    assert fixed.share_model_ends == 1.0
    assert models["isolated"].ensemble is not None
    assert models["isolated"].ensemble.model_ends is None
    gap = float(np.median(models["isolated"].ensemble.bands.peak_u))
    narrow = Rivals(replace(BENT, abutment=Abutment(gap=gap)), isolated=RUBBER)
    [_, isolated] = compare(narrow, PULSE, BridgeEnsemble())
    assert isolated.ensemble is not None
    assert isolated.ensemble.share_model_ends == 0.5


def test_members_that_collapse_count_as_the_largest() -> None:
    frame = FixedFrame(period=0.5, strength_ratio=0.28, stability_coefficient=0.1)
    [_, fixed] = compare(Rivals(BENT, fixed=frame), PULSE, BridgeEnsemble())
    assert fixed.ensemble is not None
    assert fixed.ensemble.share_overturned > 0.0
    assert math.isinf(fixed.ensemble.bands.peak_base_shear[2])


def test_a_member_that_buckles_names_the_spread() -> None:
    slender = replace(FIXED, stability_coefficient=0.5)
    words = r"spread cracked_stiffness 0\.7 of .*'fixed': member \d+ has 0\.\d+ times the stiffness"
    with pytest.raises(ParameterError, match=words):
        compare(Rivals(BENT, fixed=slender), PULSE, BridgeEnsemble(cracked_stiffness=0.7))


def test_without_members_there_is_no_ensemble() -> None:
    assert compared(RUBBER, BridgeEnsemble(members=0))["fixed"].ensemble is None
    assert compare(Rivals(BENT, fixed=FIXED), PULSE)[1].ensemble is None
