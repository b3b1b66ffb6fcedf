"""The demand of a response on the joints, as stored in response.nc."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rockframe.frame import RockingFrame
from rockframe.parts import Tendon
from rockframe.rocking.contact import impact_friction_demand, with_contact
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.reactions import column_forces, reactions
from rockframe.rocking.response import respond
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse


def test_least_spacing_is_where_the_beam_would_lift_off_a_column() -> None:
    """At the least spacing the smallest column force is zero; at larger ones it is positive."""
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, beam_depth=2.0)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    response = with_contact(respond(bent, pulse), pulse)
    assert response.contact is not None
    mirrored = GroundAcceleration.from_pulse(pulse).scaled(-1.0)
    other = with_contact(respond(bent, mirrored), mirrored).contact
    assert other is not None
    assert other.least_spacing == response.contact.least_spacing
    for factor, holds in ((1.001, True), (0.999, False)):
        spacing = factor * response.contact.least_spacing
        forces = column_forces(response, pulse, spacing=spacing, beam_centre=1.0)
        assert bool(np.nanmin(forces.top_vertical) > 0.0) is holds


def test_the_contact_demand_is_the_extreme_of_the_reactions() -> None:
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    response = respond(bent, pulse)
    forces, demand = reactions(response, pulse), with_contact(response, pulse).contact
    assert demand is not None
    assert demand.base_friction_demand == forces.base_friction_demand.max()
    assert demand.top_friction_demand == forces.top_friction_demand.max()
    assert demand.least_base_vertical == forces.base_vertical.min() / 5.0
    assert demand.least_top_vertical == forces.top_vertical.min() / 4.0
    assert demand.impact_friction_demand == impact_friction_demand(bent)


def test_a_frame_at_rest_needs_the_friction_of_the_ground_and_no_impact() -> None:
    """At rest, shear over weight is the acceleration in g, and vertical forces are static."""
    weak = GroundAcceleration.from_samples(0.1 * GRAVITY * np.sin(np.arange(100.0)), 0.01)
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    demand = with_contact(respond(bent, weak), weak).contact
    assert demand is not None
    largest = np.abs(weak.acceleration()).max() / GRAVITY
    assert demand.base_friction_demand == pytest.approx(largest, rel=1e-12)
    assert demand.least_base_vertical == pytest.approx(1.0, rel=1e-12)
    assert math.isnan(demand.impact_friction_demand)
    tendon = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=5e5)
    tied = replace(bent, column_mass=48e3, tendon=tendon)
    pressed = with_contact(respond(tied, weak), weak).contact
    assert pressed is not None
    assert pressed.least_base_vertical == pytest.approx(1.0, rel=1e-12)
    assert pressed.least_top_vertical == pytest.approx(1.0, rel=1e-12)


def test_a_beam_lighter_than_its_columns_has_a_joint_too() -> None:
    weak = GroundAcceleration.from_samples(0.1 * GRAVITY * np.sin(np.arange(100.0)), 0.01)
    light = RockingFrame(height=9.6, width=1.6, mass_ratio=0.25)
    demand = with_contact(respond(light, weak), weak).contact
    assert demand is not None
    assert demand.least_top_vertical == pytest.approx(1.0, rel=1e-12)


def test_a_column_alone_has_no_joint_under_a_beam() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.3 * GRAVITY, T_p=1.0)
    demand = with_contact(respond(RockingFrame(height=9.6, width=1.6), pulse), pulse).contact
    assert demand is not None
    assert math.isnan(demand.top_friction_demand)
    assert math.isnan(demand.least_top_vertical)


def test_of_a_frame_that_overturns_no_demand_is_stated() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0 * GRAVITY, T_p=1.5)
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    demand = with_contact(respond(bent, pulse), pulse).contact
    assert demand is not None
    assert math.isnan(demand.base_friction_demand)
