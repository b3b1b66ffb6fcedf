"""Every kind of structure keeps the rules of `rockframe.structures.contract`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest
from tests.structures.contract import keeps_the_rules

from rockframe import FixedFrame, IsolatedDeck, RockingFrame, UnequalBent
from rockframe.parts import Abutment, Dissipater, Tendon
from rockframe.study.kinds import KINDS

TENDON = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=1e5, yield_stress=1.6e9)
BARS = Dissipater(stiffness=5e7, yield_force=2e5, lever_arm=0.8)
BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=6e4, name="bent")
GAP = Abutment(gap=0.1)

#: Structures of each kind: free, restrained and so on.
OF_KINDS: Final[dict[str, list[Any]]] = {
    "rocking": [
        BENT,
        RockingFrame(height=2.0, width=0.2, name="slender"),
        RockingFrame(
            height=9.6,
            width=1.6,
            mass_ratio=4.0,
            column_mass=6e4,
            tendon=TENDON,
            dissipater=BARS,
            abutment=GAP,
            name="hybrid",
        ),
    ],
    "unequal": [
        UnequalBent(
            heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6, name="slope"
        ),
        UnequalBent(heights=(2.4, 2.0), widths=(0.3, 0.25), spacing=4.0, name="slight"),
    ],
    "isolated": [
        IsolatedDeck.lead_rubber(strength_ratio=0.05, period=3.0, name="lead"),
        IsolatedDeck(
            strength_ratio=0.06,
            period=2.8,
            yield_displacement=0.0,
            mass_ratio=4.0,
            abutment=GAP,
            name="pendulum",
        ),
    ],
    "fixed": [
        FixedFrame(period=0.4, name="elastic"),
        FixedFrame(period=0.4, strength_ratio=0.3, post_yield_ratio=0.02, name="hardening"),
        FixedFrame(
            period=0.6,
            strength_ratio=0.25,
            stability_coefficient=0.04,
            mass_ratio=4.0,
            name="collapsible",
        ),
    ],
}


def test_every_kind_is_put_through() -> None:
    assert OF_KINDS.keys() == KINDS.keys()


@pytest.mark.parametrize("kind", OF_KINDS)
def test_each_kind_keeps_the_rules(kind: str, tmp_path: Path) -> None:
    keeps_the_rules(OF_KINDS[kind], tmp_path)
