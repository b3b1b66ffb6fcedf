"""Answers of the explorer: the kernel's numbers, and histories thinned without visible loss."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe import (
    Ensemble,
    GroundAcceleration,
    PairAcceleration,
    ParameterError,
    RockingFrame,
    bent_ensemble,
    margins,
    respond,
    respond_bent,
    wobble,
    wobbling_ensemble,
)
from rockframe.explorer.answer import (
    ExploredMotion,
    Settings,
    _places,
    answer,
    margin,
    read_settings,
)
from rockframe.matching.record_pulses import find_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.versions import Uncertain
from rockframe.rocking import as_ground, ensemble_responses, with_envelope
from rockframe.signals.processing import AsRead, BandPass, correct
from rockframe.structures.contract import kind_of

from .conftest import PIERS

BENT = {
    "height": "9.6",
    "width": "1.6",
    "mass_ratio": "4",
    "restitution_factor": "1",
    "section": "rectangular",
    "scale": "1",
    "vertical": "0",
    "pulse": "0",
    "from": "0",
    "to": "1000",
}


def asked(motions: list[ExploredMotion], **other: str) -> Any:
    held = {motion.record.record_id: motion for motion in motions}
    return answer(held, read_settings({"record": next(iter(held)), **BENT, **other}))


def unpacked(content: bytes) -> tuple[dict[str, Any], NDArray[np.float32]]:
    """Return the facts and the histories of an answer, unpacked as by the page's script."""
    end = content.index(b"\n") + 1
    facts = json.loads(content[:end])
    return facts, np.frombuffer(content, "<f4", offset=end).reshape(5, facts["drawn"])


def test_the_answer_is_that_of_respond(bundled: list[ExploredMotion]) -> None:
    reply = asked(bundled, scale="1.5")
    record = bundled[0].record
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    expected = respond(frame, ground.scaled(1.5))
    facts, (time, acceleration, theta, u, v) = unpacked(reply.packed())
    assert facts["verdict"] == expected.verdict.name.lower()
    assert facts["peak_rotation_ratio"] == expected.peak_rotation_ratio
    np.testing.assert_allclose(theta, expected.theta, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(u, expected.u, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(v, expected.v, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(acceleration, 1.5 * record.acceleration, rtol=1e-6)
    np.testing.assert_allclose(time, record.time, rtol=1e-6)


@pytest.fixture(scope="module")
def strong(bundled: list[ExploredMotion]) -> Record:
    """The strong 30 s of a record of 100 s, enough for margins and members."""
    record = bundled[0].record
    return replace(record, acceleration=record.acceleration[2400:5400])


@pytest.mark.parametrize("scale", ["1", "1.3"])
def test_members_are_shaken_by_the_versions_of_an_uncorrected_record(
    strong: Record, scale: str
) -> None:
    band = BandPass(0.063, 40.0)
    record = replace(strong, acceleration=correct(strong.acceleration, strong.time_step, band)[0])
    uncertain = Uncertain(record, AsRead(strong.acceleration, band))
    motion = ExploredMotion(record, as_ground(record), uncertain=uncertain)
    reply = margin({record.record_id: motion}, settings_of(record, scale=scale))
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    ground = as_ground(record).scaled(float(scale))
    versions = uncertain.versions(Ensemble(), record).scaled(float(scale))
    [[varied]] = ensemble_responses([ground], [frame], None, [versions])
    [[unvaried]] = ensemble_responses([ground], [frame])
    assert reply["bands"] == varied.facts() != unvaried.facts()
    drawn = with_envelope(respond(frame, ground), ground, None, versions)
    assert len(reply["envelope"]["high"]) == -(-ground.at_nodes()[0].size // 2)
    highest = float(np.asarray(drawn.theta_high).max())
    assert max(reply["envelope"]["high"]) == pytest.approx(highest, abs=1e-6)


def settings_of(record: Record, **other: str) -> Settings:
    return read_settings({"record": record.record_id, **BENT, **other})


def test_the_margin_is_that_of_margins(bundled: list[ExploredMotion], strong: Record) -> None:
    column = RockingFrame(height=2.0, width=0.2)
    settings = {"height": "2", "width": "0.2", "mass_ratio": "0", "scale": "1"}
    held = {motion.record.record_id: motion for motion in bundled}
    held[strong.record_id] = ExploredMotion(strong, as_ground(strong))
    reply = margin(held, settings_of(strong, **settings))
    [[expected]] = margins([strong], [column], ensemble=Ensemble())
    assert f"<title>{expected.strip.words}</title>" in reply["strip"]
    assert reply["strip"].count("strip-falls") == len(expected.strip.overturning)
    [[share]] = ensemble_responses([strong], [column])
    assert reply["bands"] == share.facts()
    assert expected.robust is not None
    assert reply["words"].endswith(f"10 % overturn at {expected.robust.s10:.2f}")


def test_the_envelope_on_the_page_contains_that_of_all_samples(
    bundled: list[ExploredMotion],
) -> None:
    """Each interval of time has the lowest and the highest of its samples."""
    held = {motion.record.record_id: motion for motion in bundled}
    settings = read_settings({"record": bundled[0].record.record_id, **BENT})
    envelope = margin(held, settings)["envelope"]
    ground = bundled[0].ground
    assert isinstance(ground, GroundAcceleration)
    across = replace(ground, vertical=None)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    full = with_envelope(respond(frame, across), across)
    place = np.searchsorted(envelope["time"], full.time, side="right") - 1
    assert (np.array(envelope["low"])[place] <= np.asarray(full.theta_low) + 1e-6).all()
    assert (np.array(envelope["high"])[place] >= np.asarray(full.theta_high) - 1e-6).all()
    assert max(envelope["high"]) == pytest.approx(
        float(np.asarray(full.theta_high).max()), abs=1e-6
    )


def test_vertical_motion_counts_where_there_is_one(bundled: list[ExploredMotion]) -> None:
    plain, both = asked(bundled), asked(bundled, vertical="1")
    ground = bundled[0].ground
    assert isinstance(ground, GroundAcceleration)
    assert plain.response.peak_rotation != both.response.peak_rotation
    assert both.response.peak_rotation == pytest.approx(
        respond(plain.response.structure, ground).peak_rotation, rel=1e-12
    )


def test_the_pulse_alone_is_that_of_the_record(bundled: list[ExploredMotion]) -> None:
    """The pulse is sampled like the record, so the responses differ only by interpolation."""
    reply = asked(bundled, pulse="1", scale="2")
    best = find_pulses(bundled[0].record, options=PulseOptions(surrogates=0))
    pulse = best.matches[best.used].pulse
    expected = respond(reply.response.structure, GroundAcceleration.from_pulse(pulse).scaled(2.0))
    assert reply.response.peak_rotation == pytest.approx(expected.peak_rotation, rel=1e-3)
    assert reply.facts()["pulse_words"].endswith(f"T_p {pulse.T_p:.3g} s")
    assert asked(bundled).facts()["pulse_words"] is None


def test_a_record_without_a_usable_period_has_no_pulse(bundled: list[ExploredMotion]) -> None:
    with pytest.raises(ParameterError, match=r"Invalid pulse '1' of record .*no usable periods"):
        asked([replace(bundled[0], search=None)], pulse="1")


def test_the_section_counts(bundled: list[ExploredMotion]) -> None:
    ratios = [
        asked(bundled, section=section).response.structure.inertia_ratio
        for section in ("rectangular", "circular", "1.25")
    ]
    assert "above 50" in asked(bundled, mass_ratio="51").facts()["unusual"]
    assert ratios == [4.0 / 3.0, pytest.approx(1.331081, abs=1e-6), 1.25]


SLOPE = {
    **{name: str(value) for name, value in kind_of(PIERS).sliders(PIERS).items()},
    **{name: BENT[name] for name in ("scale", "vertical", "pulse", "from", "to")},
    "kind": "unequal",
}


def sloping(motions: list[ExploredMotion], **other: str) -> tuple[Any, Settings]:
    held = {motion.record.record_id: motion for motion in motions}
    settings = read_settings({"record": next(iter(held)), **SLOPE, **other})
    return held, settings


def test_two_unequal_columns_answer_as_respond_bent(bundled: list[ExploredMotion]) -> None:
    held, settings = sloping(bundled, scale="1.5")
    reply = answer(held, settings)
    expected = respond_bent(PIERS, as_ground(bundled[0].record).scaled(1.5))
    facts, (_, _, theta, u, v) = unpacked(reply.packed())
    assert facts["peak_rotation_ratio"] == expected.peak_rotation_ratio > 0.0
    for drawn, history in ((theta, expected.theta), (u, expected.u), (v, expected.v)):
        np.testing.assert_allclose(drawn, history, rtol=1e-6, atol=1e-12)
    assert (facts["heights"], facts["spacing"]) == ([9.0, 7.0], 12.0)
    assert facts["balance"] == [*PIERS.balance_rotations]
    level = f"{100.0 * expected.peak_level_difference:.1f} cm"
    assert ["nominal level difference", level] in facts["peaks"]
    assert ["width of the right column", "1.5 m"] in facts["properties"]
    assert len(reply.table().splitlines()) == expected.time.size + 1


def test_the_margin_of_two_unequal_columns_has_their_ensemble(strong: Record) -> None:
    motion = ExploredMotion(strong, as_ground(strong))
    reply = margin(*sloping([motion]))
    assert reply["bands"] == bent_ensemble(PIERS, strong).facts()
    assert reply["envelope"] is None
    assert "strip" in reply["strip"]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("height_left", "tall", "Invalid height_left 'tall'. Must be a finite number."),
        ("height_right", "0", "Invalid heights (9.0, 0.0) of bent 'own'. Must be between"),
        ("spacing", "1", "Invalid spacing 1.0 of bent 'own'. Must be above 1.45 m"),
        ("section", "circular", "Invalid setting 'section'. Must be one of: record"),
        ("kind", "fixed", "Invalid kind 'fixed'. Must be one of: rocking, unequal."),
    ],
)
def test_a_wrong_value_of_two_columns_is_named(
    bundled: list[ExploredMotion], name: str, value: str, words: str
) -> None:
    with pytest.raises(ParameterError) as error:
        sloping(bundled, **{name: value})
    assert words in str(error.value)


def test_two_unequal_columns_rock_in_one_plane_only(both: ExploredMotion) -> None:
    with pytest.raises(ParameterError, match=r"not computed for both directions\. Must be in one"):
        answer(*sloping([both]))


def test_columns_of_two_densities_are_not_shown() -> None:
    alike = replace(PIERS, column_masses=(9.0 * 1.4e4, 7.0 * 1.5e4))
    kind = kind_of(PIERS)
    assert kind.sliders(alike) == kind.sliders(PIERS) != {}
    assert kind.sliders(replace(PIERS, column_masses=(5e4, 5e4))) == {}


def test_a_long_record_keeps_its_extremes(long: ExploredMotion) -> None:
    reply = asked([long], scale="0.6")
    assert reply.response.verdict.name == "STANDS"
    places, response = reply.places, reply.response
    assert response.theta.size == 60_000
    assert places.size <= 12_000
    assert np.all(np.diff(places) > 0)
    for series in (response.theta, response.v, reply.ground.acceleration()):
        for part in np.array_split(np.arange(60_000), 100):
            kept = series[np.intersect1d(part, places)]
            assert kept.max() == series[part].max()
            assert kept.min() == series[part].min()


def test_what_is_zoomed_into_is_drawn_in_full(long: ExploredMotion) -> None:
    places = asked([long], **{"from": "200", "to": "210"}).places
    inside = places[(places >= 20_000) & (places <= 21_000)]
    assert np.array_equal(inside, np.arange(20_000, 21_001))


def test_a_long_fall_ends_where_it_falls(long: ExploredMotion) -> None:
    reply = asked([long], height="3", width="0.3", mass_ratio="0", scale="2")
    theta = reply.response.theta
    standing = int(np.isfinite(theta).sum())
    assert reply.response.verdict.name == "OVERTURNS"
    assert {standing - 1, standing} <= set(reply.places)


def test_a_fall_that_ends_between_extremes_is_drawn_to_its_end(long: ExploredMotion) -> None:
    """The curve ends at the last sample before the fall, whatever happens around it."""
    reply = asked([long], height="3", width="0.3", mass_ratio="0", scale="2")
    theta = np.full(60_000, np.nan)
    theta[:30_000] = 0.01 * np.sin(0.05 * np.arange(30_000))
    theta[29_900:30_000] = np.linspace(-0.02, 0.02, 100)[np.arange(100) * 37 % 100]
    theta[29_950], theta[29_999] = 0.0, 0.001
    places = _places(replace(reply.response, theta=theta), reply.ground, (100.0, 110.0))
    assert {29_999, 30_000} <= set(places)


def test_the_table_holds_every_sample(long: ExploredMotion) -> None:
    reply = asked([long])
    lines = reply.table().splitlines()
    assert lines[0] == "time_s,acceleration_m_s2,theta_rad,u_m,v_m"
    assert len(lines) == 60_001
    assert float(lines[20_001].split(",")[2]) == pytest.approx(reply.response.theta[20_000], 1e-8)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("height", "tall", "Invalid height 'tall'. Must be a finite number."),
        ("height", "0", "Invalid height 0.0 of frame 'own'. Must be between 0.001 and 1000 m."),
        ("width", "inf", "Invalid width 'inf'. Must be a finite number."),
        ("height", "6_5", "Invalid height '6_5'. Must be a finite number."),
        ("height", "６", "Invalid height '６'. Must be a finite number."),
        ("section", "0.9", "Invalid inertia_ratio 0.9 of frame 'own'. Must be above 1"),
        ("width", "12", "Must be below 45.56 degrees for mass_ratio 4"),
        ("mass_ratio", "-1", "Invalid mass_ratio -1.0"),
        ("restitution_factor", "1.5", "Must be above 0 and below 1.05598: it multiplies"),
        ("scale", "0", "Invalid scale 0.0. Must be above 0 and at most 100."),
        ("section", "round", "Invalid section 'round'. Must be one of: rectangular, circular."),
        ("vertical", "yes", "Invalid vertical 'yes'. Must be 0 or 1."),
        ("record", "nowhere", "Invalid record 'nowhere'. Must be one of: Ridgecrest2019-CCC-090"),
        ("number_of_columns", "4", "Invalid setting 'number_of_columns'. Must be one of: record"),
    ],
)
def test_a_wrong_value_is_named(
    bundled: list[ExploredMotion], name: str, value: str, words: str
) -> None:
    with pytest.raises(ParameterError) as error:
        asked(bundled, **{name: value})
    assert words in str(error.value)


def test_a_setting_left_out_is_named() -> None:
    with pytest.raises(ParameterError, match=r"Missing setting 'record'\. State each setting once"):
        read_settings({"vertical": "1"})


def test_no_vertical_is_made_up(bundled: list[ExploredMotion]) -> None:
    with pytest.raises(ParameterError, match="no vertical was recorded beside it"):
        asked(bundled[1:], vertical="1")


def test_a_ground_that_falls_faster_than_the_frame_is_refused(
    bundled: list[ExploredMotion],
) -> None:
    with pytest.raises(ParameterError, match="lose contact with the ground"):
        asked(bundled, vertical="1", scale="20")


ROUND = {"record": "CCC-both", "section": "circular", "scale": "0.6"}


def in_both(motion: ExploredMotion) -> PairAcceleration:
    """Return the horizontal motion in both directions."""
    assert isinstance(motion.ground, PairAcceleration)
    return replace(motion.ground, z=None)


def test_both_components_are_answered_as_by_wobble(both: ExploredMotion) -> None:
    reply = asked([both], **ROUND)
    ground = in_both(both).scaled(0.6)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, section="circular")
    expected = wobble(frame, ground)
    facts, _ = unpacked_series(reply.packed())
    assert facts["verdict"] == expected.verdict.name.lower()
    assert facts["peak_rotation_ratio"] == expected.peak_rotation_ratio
    assert facts["impacts"] is None
    assert "Path of the deck seen from above" in facts["path"]
    _, series = unpacked_series(reply.packed())
    assert [*series] == ["time", "acceleration", "theta", "u", "v", "phi"]
    for name in ("theta", "phi", "v"):
        np.testing.assert_allclose(series[name], getattr(expected, name), rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(series["u"], expected.u, rtol=1e-6, atol=1e-12)
    heads, first, *_ = reply.table().splitlines()
    assert heads.endswith("acceleration_y_m_s2,theta_rad,u_m,v_m,phi_rad,u_x_m,u_y_m")
    assert first.split(",")[-3:] == ["", "0", "0"]


def unpacked_series(content: bytes) -> tuple[dict[str, Any], dict[str, NDArray[np.float32]]]:
    """Return the facts and the named histories of an answer."""
    end = content.index(b"\n") + 1
    facts = json.loads(content[:end])
    rows = np.frombuffer(content, "<f4", offset=end).reshape(-1, facts["drawn"])
    return facts, dict(zip(facts["series"], rows, strict=True))


def test_the_margin_of_both_components_is_that_of_their_ensemble(both: ExploredMotion) -> None:
    settings = read_settings({**BENT, **ROUND})
    found = margin({"CCC-both": both}, settings)
    ground = in_both(both).scaled(0.6)
    assert isinstance(settings.structure, RockingFrame)
    spread = wobbling_ensemble(settings.structure, ground)
    assert found["bands"] == spread.facts()
    assert found["envelope"] is None
    assert "nominal outcome not computed" in found["strip"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"section": "rectangular"},
            "Invalid section rectangular of the columns.*Must be circular",
        ),
        ({"pulse": "1"}, "Invalid pulse '1'.*both directions has no pulse"),
    ],
)
def test_settings_that_both_components_do_not_have_are_refused(
    both: ExploredMotion, change: dict[str, str], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        asked([both], **{**ROUND, **change})
