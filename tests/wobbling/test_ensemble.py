"""Ensembles of round columns under both components of the bundled stations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    Ensemble,
    PairAcceleration,
    Verdict,
    pair_horizontals,
    read_file,
    wobble,
    wobbling_ensemble,
)
from rockframe.rocking import draws, members
from rockframe.wobbling import kernel
from rockframe.wobbling.ensemble import shortenings
from rockframe.wobbling.response import constants, integrated

from .cases import solid

COLUMN = solid(7.5, 1.8)


@pytest.fixture(scope="module")
def station(request: pytest.FixtureRequest) -> PairAcceleration:
    """The 40 s around the peaks of a bundled station, less their means."""
    folder: Path = request.getfixturevalue("bundled_records")
    [pair], _ = pair_horizontals(read_file(folder / "Ridgecrest2019-CCC.V1"))
    motion = PairAcceleration.from_pair(pair)
    x, y = (a[1500:5500] - a[1500:5500].mean() for a in (motion.x, motion.y))
    return replace(motion, x=x, y=y)


def test_members_are_those_of_the_responses_one_by_one(station: PairAcceleration) -> None:
    """A lane does not depend on the others, so the bands are those of single responses."""
    chosen = Ensemble(members=16)
    found = wobbling_ensemble(COLUMN, station, chosen)
    softness = shortenings(chosen).tolist()
    assert 1e-5 < min(softness) < 1.5e-5 < 6e-4 < max(softness) < 1e-3
    each = [
        wobble(frame, station.scaled(scale), contact_shortening=soft)
        for frame, scale, soft in zip(
            members(chosen, COLUMN), draws(chosen)[:, 3].tolist(), softness, strict=True
        )
    ]
    assert found.overturned == sum(one.verdict is Verdict.OVERTURNS for one in each)
    ratios = sorted(
        np.inf if one.verdict is Verdict.OVERTURNS else one.peak_rotation_ratio for one in each
    )
    assert ratios[2] <= found.bands.peak_rotation_ratio[0] <= ratios[3]
    assert found.bands.peak_u[0] > 0.0


def test_both_directions_decide_and_turning_them_changes_nothing(
    station: PairAcceleration,
) -> None:
    """Each component alone moves the column by a tenth; both together overturn some members."""
    both = wobbling_ensemble(COLUMN, station)
    alone = wobbling_ensemble(COLUMN, replace(station, y=0.0 * station.y))
    turned = wobbling_ensemble(COLUMN, station.turned(37.0))
    assert alone.overturned == 0 < both.overturned
    assert both.bands.peak_rotation_ratio[0] > 2.0 * alone.bands.peak_rotation_ratio[1]
    assert turned.overturned == both.overturned
    assert_allclose(turned.bands.peak_rotation_ratio, both.bands.peak_rotation_ratio, rtol=1e-6)


def test_a_member_that_does_not_end_is_an_internal_error(
    station: PairAcceleration, monkeypatch: pytest.MonkeyPatch
) -> None:
    def endless(*arguments: object) -> None:
        arguments[4][:] = kernel.FAILED  # type: ignore[index]

    monkeypatch.setattr(kernel, "integrate", endless)
    with pytest.raises(RuntimeError, match="internal error: the wobbling of member 0"):
        integrated(station, [constants(COLUMN)])
