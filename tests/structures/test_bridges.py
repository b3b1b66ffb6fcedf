"""Isolated and fixed bridges as structures of files and as rivals in comparisons."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from tests.structures.contract import FEW, PULSE, SHAKE

from rockframe import FixedFrame, IsolatedDeck, RespondOptions, RockingFrame, read_structures
from rockframe.errors import InputError
from rockframe.oscillators.margins import can_collapse, oscillator_margin
from rockframe.parts import Abutment
from rockframe.structures.comparison import Rivals, compare
from rockframe.structures.contract import Shaking, respond_each

ISOLATED = 'name = "deck"\nkind = "isolated"\n'
FIXED = (
    'name = "pier"\nkind = "fixed"\nheight_m = 9.6\nwidth_m = 1.6\nmass_ratio = 4.0\n'
    "modulus_pa = 30e9\n"
)
ROUND = f'{FIXED}section = "circular"\ndensity_kg_m3 = 2500.0\n'


def read(folder: Path, table: str) -> object:
    """Return the structure of a table."""
    path = folder / "structures.toml"
    path.write_text(f"[[structure]]\n{table}", encoding="utf-8")
    [structure] = read_structures(path)
    return structure


def test_a_table_of_isolators_is_the_deck_that_they_carry(tmp_path: Path) -> None:
    gap = "mass_ratio = 4.0\n[structure.abutment]\ngap_m = 0.2\n"
    lead = read(tmp_path, f"{ISOLATED}strength_ratio = 0.05\nperiod_s = 3.0\n{gap}")
    assert lead == IsolatedDeck(
        strength_ratio=0.05,
        period=3.0,
        yield_displacement=0.01,
        mass_ratio=4.0,
        abutment=Abutment(gap=0.2),
        name="deck",
    )
    pendulum = read(tmp_path, f"{ISOLATED}radius_m = 2.0\nfriction = 0.06\n")
    assert pendulum == IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06, name="deck")


def test_a_table_of_monolithic_columns_is_the_frame_of_them(tmp_path: Path) -> None:
    """The mass cancels, so the density and any number of columns give the same period."""
    found = read(tmp_path, ROUND)
    assert isinstance(found, FixedFrame)
    mass = 2500.0 * 9.6 * math.pi * 0.8**2
    sizes: dict[str, Any] = {"height": 9.6, "width": 1.6, "modulus": 30e9}
    two = FixedFrame.from_columns(
        columns=2, column_mass=mass, deck_mass=8.0 * mass, name="pier", **sizes
    )
    assert found.period == pytest.approx(two.period, rel=1e-12)
    assert found.stability_coefficient == pytest.approx(two.stability_coefficient, rel=1e-12)
    assert (found.mass_ratio, found.name) == (4.0, "pier")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (f"{ISOLATED}height_m = 9.6\n", "unknown key 'height_m'. Must be one of: strength_ratio"),
        (f"{ISOLATED}radius_m = 2.0\n", "key 'friction' missing. Must be stated together with"),
        (f"{FIXED}density_kg_m3 = 2500.0\n", "key 'depth_m' missing"),
        (f"{ROUND}depth_m = 1.0\n", "depth_m 1.0. Must be absent where the section is circular"),
        (f"{ROUND}column_mass_kg = 1.0\n", "column_mass_kg 1.0. Must be stated, or density_kg_m3"),
        (ISOLATED.replace("isolated", "sliding"), "kind 'sliding'. Must be rocking, unequal, iso"),
    ],
)
def test_each_mistake_is_named(tmp_path: Path, table: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        read(tmp_path, table)
    assert words in str(error.value)


def test_a_rival_of_a_comparison_responds_as_the_structure_of_its_kind() -> None:
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, abutment=Abutment(gap=0.05))
    own: dict[str, Any] = {"mass_ratio": 4.0, "abutment": Abutment(gap=0.05)}
    deck = IsolatedDeck(strength_ratio=0.05, period=3.0, yield_displacement=0.01, **own)
    pier = FixedFrame(period=0.4, strength_ratio=0.2, **own)
    _, *compared = compare(Rivals(bent, isolated=deck, fixed=pier), SHAKE)
    for one, response in zip(
        compared, respond_each([deck, pier], Shaking(SHAKE, RespondOptions())), strict=True
    ):
        assert one.peak_u == response.peak_u  # type: ignore[attr-defined]
        assert one.peak_base_shear == response.peak_base_shear  # type: ignore[attr-defined]
        assert one.model_end == response.model_end  # type: ignore[attr-defined]


def test_only_p_delta_beyond_the_hardening_collapses() -> None:
    soft = FixedFrame(period=1.0, strength_ratio=0.1, stability_coefficient=0.1)
    hard = FixedFrame(
        period=1.0, strength_ratio=0.1, stability_coefficient=0.1, post_yield_ratio=0.2
    )
    assert [can_collapse(one) for one in (soft, hard)] == [True, False]
    margin, none = (oscillator_margin(one, PULSE, FEW) for one in (soft, hard))
    assert margin.robust is not None
    assert 0.0 < margin.critical_scale < margin.largest_scale
    assert margin.robust.s10 == pytest.approx(margin.critical_scale, rel=0.5)
    assert math.isnan(none.critical_scale)
