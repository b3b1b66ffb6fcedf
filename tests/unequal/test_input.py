"""Bents that cannot rock are refused in one line that says why."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rockframe import (
    Ensemble,
    GroundAcceleration,
    RockingFrame,
    bent_ensemble,
    respond_bent,
    respond_bents,
)
from rockframe.errors import ParameterError

from .cases import BENT

STILL = GroundAcceleration.from_samples(np.zeros(2), 0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"heights": (9.0, 7.0, 8.0)}, "heights of bent 'bent', of 3 columns.*columns under one r"),
        ({"widths": (1.0, 1.0, 1.2, 1.0)}, "widths of bent 'bent', of 4 columns. Must be two"),
        ({"heights": 9.0}, r"Invalid heights 9.0 of bent 'bent'. Must be two numbers, left and"),
        ({"heights": (9.0,)}, "Invalid heights .* Must be two numbers, left and right"),
        ({"heights": ("9", "7")}, "Invalid heights .* Must be two numbers"),
        ({"heights": (9.0, np.nan)}, "Invalid heights .* Must be between 0.001 and 1000 m"),
        ({"widths": (1.4, -1.0)}, "Invalid widths .* Must be between 0.001 and 1000 m"),
        ({"spacing": "12"}, "Invalid spacing '12' of bent 'bent'. Must be a number"),
        ({"spacing": 1.2}, "Invalid spacing 1.2 of bent 'bent'. Must be above 1.4 m, or the colu"),
        ({"mass_ratio": -1.0}, "Invalid mass_ratio -1.0 of bent 'bent'. Must be between 0 and 1e"),
        ({"beam_depth": -1.0}, "Invalid beam_depth -1.0"),
        ({"beam_offset": 7.0}, "Invalid beam_offset 7.0.*the beam would tip over"),
        ({"column_masses": (1e4, 0.0)}, "Invalid column_masses .* Must be positive"),
        ({"column_masses": (1e4, 1e4, 1e4)}, "of 3 columns"),
        ({"restitution_factor": 1.2}, "Invalid restitution_factor 1.2.*no impact keeps all energy"),
        ({"widths": (9.0, 9.0), "spacing": 20.0}, "more slender.*loses all speed"),
        (
            {"heights": (19.8, 1.42), "widths": (11.9, 0.42), "spacing": 11.4},
            "the columns and the beam lock before they reach an unstable equilibrium",
        ),
    ],
)
def test_bents_are_checked(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words) as raised:
        replace(BENT, **change)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"initial_rotation": 1.6}, "Invalid initial_rotation 1.6 rad. Must be within 1.0"),
        ({"initial_velocity": np.inf}, "Invalid initial_velocity inf. Must be finite"),
        ({"free_rocking": -1.0}, "Invalid duration -1.0"),
    ],
)
def test_options_are_checked(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        respond_bent(BENT, STILL, **options)


def test_other_structures_are_refused() -> None:
    frame: Any = RockingFrame(height=9.0, width=1.4)
    for call in (
        lambda: respond_bent(frame, STILL),
        lambda: respond_bents([STILL], [frame]),
        lambda: bent_ensemble(frame, STILL),
    ):
        with pytest.raises(
            ParameterError, match=r"Invalid bent of type RockingFrame\. Must be an U"
        ):
            call()
    with pytest.raises(ParameterError, match="Invalid number of bents, 0"):
        respond_bents([STILL], [])


def test_the_ground_must_not_fall_faster_than_gravity() -> None:
    falling = STILL.with_vertical(GroundAcceleration.from_samples(np.full(2, -9.8), 0.01))
    assert respond_bent(BENT, falling).peak_rotation == 0.0
    with pytest.raises(ParameterError, match="lose contact"):
        respond_bent(BENT, falling.scaled(1.01))
    with pytest.raises(ParameterError, match="lose contact"):
        respond_bents([falling], [BENT], [1.0, 1.01])
    with pytest.raises(ParameterError, match="lose contact"):
        bent_ensemble(BENT, falling)  # some members have 1.01 times the motion


def test_ensembles_are_checked() -> None:
    with pytest.raises(ParameterError, match="number of members 0"):
        bent_ensemble(BENT, STILL, Ensemble(members=0))
    stocky = replace(BENT, heights=(1.6, 1.3), mass_ratio=0.0)
    with pytest.raises(ParameterError, match=r"member \d+ cannot rock\. .*loses all speed"):
        bent_ensemble(stocky, STILL, Ensemble(width=0.5))
