"""Screenings count motions in both directions for structures of round columns."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from tests.screening import ROUND as STRUCTURES
from tests.screening import sine, stored, three

from rockframe import (
    DesignOptions,
    Ensemble,
    Filters,
    PairAcceleration,
    ParameterError,
    Record,
    RockframeWarning,
    RockingFrame,
    ScreenOptions,
    fit_fragility,
    read_screening,
    rotd,
    screen_stage,
    wobble,
    wobbling_ensemble,
)
from rockframe.cli.main import main
from rockframe.components import pair_horizontals
from rockframe.results.screen_tables import (
    demand_words,
    fragility_rows,
    margin_note,
    overall_rows,
    responses_in_words,
    screen_rows,
)
from rockframe.results.tables.notes import summary_notes
from rockframe.rocking.margins.members import draws
from rockframe.units import GRAVITY

ROUND = RockingFrame(height=3.0, width=0.5, section_both="circular", name="round")
SCALES = (0.4, 0.5, 1.0)
MEMBERS = 4
PLACES = ["a-e", "a-n", "a-e-both", "b-e", "b-n", "b-e-both", "c-n"]


def station(name: str, later: int) -> list[Record]:
    """Return the components of a station; the second one follows some samples later."""
    east, north, up = three(name)
    return [east, replace(north, acceleration=np.roll(north.acceleration, later)), up]


EAST, NORTH, UP = station("a", 25)
OTHERS = [*station("b", 30)[:2], sine("c-n", 3.5, station="c")]


def screened(folder: Path, *, text: str = STRUCTURES, **options: Any) -> xr.Dataset:
    records = stored([EAST, NORTH, UP, *OTHERS], folder)
    (folder / "structures.toml").write_text(text, encoding="utf-8")
    usual = {"scales": SCALES, "scenario_members": MEMBERS, "margins": "none"}
    chosen = ScreenOptions(**usual | options)
    output, where = folder / "screen.nc", folder / "structures.toml"
    screen_stage(records, output, chosen, structures_path=where)
    return read_screening(output)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    folder = tmp_path_factory.mktemp("screen")
    limits: dict[str, Any] = {"limit_peak_impact_velocity_m_s": (0.1,), "limit_peak_u_m": (0.1,)}
    return screened(folder, pooled=True, margins="first", measures=("cav", "pga_rotd100"), **limits)


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    folder = tmp_path_factory.mktemp("plane")
    return screened(folder, both_directions=False)


def motion() -> PairAcceleration:
    return PairAcceleration(EAST.acceleration, NORTH.acceleration, EAST.time_step)


def test_both_components_are_one_more_motion_of_their_recording(both: xr.Dataset) -> None:
    assert both["record_id"].values.tolist() == PLACES
    assert both["components"].values[2] == "a-e a-n"
    assert both["cluster"].values.tolist() == [0, 0, 0, 1, 1, 1, 2]


def test_its_scenarios_are_those_of_the_functions_for_both_directions(both: xr.Dataset) -> None:
    found = both.isel(record=2).sel(structure="round")
    for scale in SCALES:
        response = wobble(ROUND, motion().scaled(scale))
        at = found.sel(scale=scale)
        assert at["verdict"] == response.verdict
        assert at["peak_rotation_ratio"] == response.peak_rotation_ratio
        assert math.isnan(at["peak_impact_velocity"])
    ensemble = Ensemble().model_copy(update={"members": MEMBERS})
    spread = wobbling_ensemble(ROUND, motion(), ensemble)
    assert (
        found["share_reached"].sel(scale=1.0, limit_state="overturning") == spread.share_overturned
    )
    assert_allclose(found["peak_u_band"].sel(scale=1.0), spread.bands.peak_u, rtol=1e-12)
    assert draws(ensemble).shape[0] == MEMBERS


def test_rows_in_one_plane_keep_their_values(both: xr.Dataset, plane: xr.Dataset) -> None:
    records = [name for name in PLACES if not name.endswith("both")]
    some = both.isel(record=[PLACES.index(name) for name in records])
    assert plane["record_id"].values.tolist() == records
    assert "components" not in plane
    for name in ("verdict", "peak_rotation_ratio", "peak_u", "share_uplifted", "peak_v_band"):
        assert_array_equal(some[name], plane[name])


def test_columns_that_are_not_round_keep_their_numbers(both: xr.Dataset, plane: xr.Dataset) -> None:
    """They are not computed in both directions, and their statistics do not change."""
    square, alone = (dataset.sel(structure="square") for dataset in (both, plane))
    shares = square["share_reached"].isel(record=2)
    assert square["verdict"].isel(record=2).values.tolist() == [4, 4, 4]
    assert np.isnan(shares).all()
    assert np.isnan(square["demand_rank"].values[[2, 5]]).all()
    for name in ("peak_share", "verdict_count", "overall_share_overturned", "overall_peak_u_band"):
        assert_array_equal(square[name], alone[name])
    for name in ("fragility_median", "fragility_observations", "fragility_outcome"):
        at = {"limit_state": "overturning", "measure": "pgv"}
        assert_array_equal(square[name].sel(at), alone[name].sel(at))


def test_only_both_directions_count_for_round_columns(both: xr.Dataset) -> None:
    """Fragility, counts, ranks and shares are those of the two motions in both directions."""
    found, places = both.sel(structure="round"), [2, 5]
    shares = found["share_reached"].sel(limit_state="overturning").values[places]
    assert 0.0 < shares.mean() < 1.0
    assert_allclose(found["overall_share_overturned"], shares.mean(axis=0))
    assert found["verdict_count"].sum("outcome").values.tolist() == [2, 2, 2]
    counting = np.isfinite(found["demand_rank"].values)
    assert np.flatnonzero(counting).tolist() == places
    strength = found["pga"].values[places]
    fit = fit_fragility(strength, np.array(SCALES), shares, found["cluster"].values[places])
    at = found.sel(limit_state="overturning", measure="pga")
    assert at["fragility_observations"] == 6
    assert_allclose(at["fragility_median"], fit.median)
    assert_allclose(at["fragility_lognormal_beta"], fit.lognormal_beta)


def test_their_intensities_are_of_both_components(both: xr.Dataset) -> None:
    (pair,), _ = pair_horizontals([EAST, NORTH])
    found = both.isel(record=2)
    assert_allclose(found["pga"], rotd(pair).percentile(50.0))
    assert_allclose(found["pga_rotd100"], rotd(pair).percentile(100.0))
    of_each = both["cav"].values[:2]
    assert_allclose(found["cav"], math.sqrt(of_each[0] * of_each[1]))
    assert math.isnan(found["azimuth"])


def test_columns_that_roll_have_no_limit_of_impacts(both: xr.Dataset) -> None:
    rows = [row for row in fragility_rows(both) if row["measure"] == "pga"]
    limits = {
        name: [row["limit_state"] for row in rows if row["structure"] == name]
        for name in ("round", "square")
    }
    assert limits["round"] == ["overturning", "peak_u_0.1m"]
    assert "peak_impact_velocity_0.1m_s" in limits["square"]


def test_ranks_among_few_motions_are_comparable_with_those_among_many(both: xr.Dataset) -> None:
    """Two motions count for one structure, five for the other; both groups have the same mean."""
    ranks = both["mean_relative_rank"].values
    of_pairs, in_plane = ranks[[2, 5]], ranks[[0, 1, 3, 4, 6]]
    assert_allclose([of_pairs.mean(), in_plane.mean()], 0.5)
    rows = [row["record_id"] for row in screen_rows(both) if row["structure"] == "round"]
    assert rows == [PLACES[place] for place in np.argsort(ranks, kind="stable")]
    assert not {*rows[:2]} <= {"a-e-both", "b-e-both"}


def test_the_pooled_fragility_has_the_motions_that_count_for_each(both: xr.Dataset) -> None:
    fit = both.sel(pooled_limit_state="overturning", pooled_measure="pga")
    assert fit["pooled_fragility_observations"] == 3 * (2 + 5)


def test_tables_say_which_rows_are_which(both: xr.Dataset) -> None:
    rows = list(screen_rows(both))
    in_both = {row["record_id"] for row in rows if row["components"]}
    assert in_both == {"a-e-both", "b-e-both"}
    overall = list(overall_rows(both))
    assert [(row["structure"], row["records"]) for row in overall] == [("round", 2), ("square", 5)]
    notes = " ".join(summary_notes(overall))
    assert "round: only motions in both directions count" in notes
    assert "In no motion in both directions, so not counted for round columns: c-n." in notes
    assert responses_in_words(both) == "8 or 20 responses (2 or 5 motions, 4 members each)"


def test_a_design_keeps_the_limit_under_the_motions_that_count(tmp_path: Path) -> None:
    """The candidate of the same width has the share of the structure itself."""
    design = DesignOptions(dimension="width", range=(0.5, 1.0), limit=0.5, steps=2)
    limits: dict[str, Any] = {"limit_peak_rotation_ratio": (0.5,), "scales": (0.5,)}
    found = screened(tmp_path, design=design, **limits).sel(structure="round")
    reached = found["share_reached"].sel(scale=0.5, limit_state="peak_rotation_ratio_0.5").values
    in_both, in_plane = reached[[2, 5]].mean(), reached[[0, 1, 3, 4, 6]].mean()
    assert 0.0 <= in_plane < in_both
    assert_allclose(found["design_share"], [1.0 - in_both, 1.0])


def test_the_vertical_component_acts_in_both_directions_too(tmp_path: Path) -> None:
    """Motions without a vertical component are rejected, in both directions as in one plane."""
    stout = replace(ROUND, height=6.0, width=2.3)
    text = STRUCTURES.replace("3.0", "6.0").replace("0.5", "2.3")
    found = screened(tmp_path, text=text, vertical=True, scenario_members=1, scales=(1.0,))
    assert found["record_id"].values.tolist() == PLACES[:3]
    accelerations = (EAST.acceleration, NORTH.acceleration)
    upward = PairAcceleration(*accelerations, EAST.time_step, UP.acceleration)
    at = found.isel(record=2).sel(structure="round", scale=1.0)
    assert at["peak_rotation_ratio"] == wobble(stout, upward).peak_rotation_ratio
    assert at["peak_rotation_ratio"] != wobble(stout, motion()).peak_rotation_ratio
    assert sorted(json.loads(found.attrs["left_out"])) == ["b-e", "b-n", "c-n"]


def test_scenarios_that_are_not_computed_are_neither_counted_nor_printed_as_nan(
    tmp_path: Path,
) -> None:
    """The square column has no scenario of the motion in both directions."""
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    options, where = ScreenOptions(scales=(0.3, 0.4), margins="none"), tmp_path / "structures.toml"
    records, output = stored([EAST, NORTH], tmp_path), tmp_path / "screen.nc"
    done = screen_stage(records, output, options, structures_path=where)
    assert (done.motions, done.scenarios) == (3, 2 * (3 + 2))
    assert done.tables["scenarios"].read_text().count("not_computed") == 2
    words = {
        (row["record_id"], row["structure"]): demand_words(row)
        for row in screen_rows(read_screening(output))
    }
    assert words["a-e-both", "square"] == "–"
    assert not any("nan" in word for word in words.values())


def test_a_filter_that_one_component_passes_keeps_both(tmp_path: Path) -> None:
    """The peak of one component is 0.31 g, of the other 0.41 g."""
    records = stored([EAST, NORTH], tmp_path)
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    screen_stage(
        records,
        tmp_path / "screen.nc",
        ScreenOptions(scales=(0.3,), margins="none"),
        structures_path=tmp_path / "structures.toml",
        filters=Filters(pga_g=(0.35, 9.0)),
    )
    found = read_screening(tmp_path / "screen.nc")
    assert found["record_id"].values.tolist() == ["a-n", "a-e-both"]


def test_a_filter_of_intensity_holds_for_the_motion_in_both_directions(tmp_path: Path) -> None:
    """The stronger component passes; RotD50 of both is less, and a note says what is missing."""
    records = stored([EAST, NORTH], tmp_path)
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    least = 0.99 * float(np.abs(NORTH.acceleration).max()) / GRAVITY
    options, where = ScreenOptions(scales=(0.3,), margins="none"), tmp_path / "structures.toml"
    output, strong = tmp_path / "screen.nc", Filters(pga_g=(least, 9.0))
    done = screen_stage(records, output, options, structures_path=where, filters=strong)
    found = read_screening(output)
    assert found["record_id"].values.tolist() == ["a-n"]
    assert {*done.left_out} == {"a-e", "a-e-both"}
    pga = float(done.left_out["a-e-both"].split()[1].rstrip("."))
    (pair,), _ = pair_horizontals([EAST, NORTH])
    assert_allclose(pga, rotd(pair).percentile(50.0) / GRAVITY, rtol=1e-5)
    assert "round: in one plane; no station has both" in " ".join(
        summary_notes(list(overall_rows(found)))
    )


def test_a_design_of_impacts_is_refused_for_columns_that_roll(tmp_path: Path) -> None:
    design = DesignOptions(
        dimension="width", range=(0.5, 1.0), quantity="peak_impact_velocity", limit=0.5, steps=2
    )
    words = "structure 'round' has no peak_impact_velocity in both directions. State --no-both-dir"
    with pytest.raises(ParameterError, match=words):
        screened(tmp_path, design=design)


def test_a_limit_of_impacts_that_no_structure_has_is_refused(tmp_path: Path) -> None:
    """In one plane round columns have it; with a square column beside them it applies to that."""
    text = STRUCTURES[: STRUCTURES.index("[[structure]]", 20)]
    limited: dict[str, Any] = {"limit_peak_impact_velocity_m_s": (0.1,), "scales": (0.4,)}
    with pytest.raises(ParameterError, match="limit_peak_impact_velocity_m_s applies to no struct"):
        screened(tmp_path, text=text, **limited)
    plane = screened(tmp_path, text=text, both_directions=False, **limited)
    limits = [row["limit_state"] for row in fragility_rows(plane) if row["measure"] == "pga"]
    assert limits == ["overturning", "peak_impact_velocity_0.1m_s"]


@pytest.mark.parametrize("one_plane", ["no second component", "azimuths"])
def test_a_design_of_impacts_is_computed_where_all_motions_are_in_one_plane(
    one_plane: str, tmp_path: Path
) -> None:
    """Columns of which no motion is in both directions rock, and hit the ground."""
    alone = one_plane == "no second component"
    design = DesignOptions(
        dimension="width", range=(0.5, 1.0), quantity="peak_impact_velocity", limit=0.5, steps=2
    )
    records = stored([EAST, OTHERS[2]] if alone else [EAST, NORTH], tmp_path)
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    azimuths = None if alone else (0.0, 45.0)
    options = ScreenOptions(scales=(0.5,), margins="none", design=design, azimuths_degree=azimuths)
    output, where = tmp_path / "screen.nc", tmp_path / "structures.toml"
    screen_stage(records, output, options, structures_path=where)
    found = read_screening(output)
    assert "components" not in found
    assert np.isfinite(found["design_share"]).all()


def test_azimuths_are_in_one_plane() -> None:
    with pytest.raises(ParameterError, match="has no effect with azimuths_degree"):
        ScreenOptions(azimuths_degree=(0.0,), both_directions=False)


def test_a_message_names_the_option_as_it_is_typed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["screen", str(stored([EAST, NORTH], tmp_path)), "--output", str(tmp_path / "s.nc")]
    assert main([*words, "--azimuths-degree", "0", "--no-both-directions"]) == 2
    assert "--no-both-directions has no effect with --azimuths-degree" in capsys.readouterr().err


def test_a_hazard_curve_of_pulses_is_refused_for_columns_that_roll(tmp_path: Path) -> None:
    """Motions in both directions have no pulse, so the rate would be unknown."""
    (tmp_path / "hazard.csv").write_text("L_p_m,annual_rate\n0.1,0.01\n1,0.001\n")
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    with pytest.raises(ParameterError, match=r"unknown in both directions\. State --no-both-dir"):
        screen_stage(
            stored([EAST, NORTH], tmp_path),
            tmp_path / "screen.nc",
            ScreenOptions(hazard=tmp_path / "hazard.csv"),
            structures_path=tmp_path / "structures.toml",
            pulses_path=tmp_path / "no-such-file.nc",
        )


def test_a_spread_of_the_contact_changes_shares_of_columns_that_roll_alone(tmp_path: Path) -> None:
    """Peaks of round columns change, others do not; without round columns, a warning says so."""
    spread: dict[str, Any] = {"ensemble": Ensemble(contact_shortening=1000.0), "scales": (0.45,)}
    found = screened(tmp_path, **spread)["peak_u_band"].sel(scale=0.45)
    usual = screened(tmp_path, scales=(0.45,))["peak_u_band"].sel(scale=0.45)
    changed = (found != usual) & ~(np.isnan(found) & np.isnan(usual))
    of_round = changed.sel(structure="round").any("quantile").values
    assert np.flatnonzero(of_round).tolist() == [2, 5]
    assert not changed.sel(structure="square").any()
    square = STRUCTURES[STRUCTURES.index("[[structure]]", 20) :]
    with pytest.warns(RockframeWarning, match="contact_shortening of the ensemble has no effect"):
        screened(tmp_path, text=square, **spread)


def test_margins_that_nobody_searched_are_missing_and_noted(both: xr.Dataset) -> None:
    """No critical scale is searched in both directions, so there is no number of islands."""
    in_both = both["components"].values != ""
    assert (both["safe_islands"].values[~in_both] >= 0).all()
    assert (both["safe_islands"].values[in_both] == -1).all()
    for row in screen_rows(both):
        assert math.isnan(row["safe_islands"]) is bool(row["components"])
        assert math.isnan(row["critical_scale"]) or not row["components"]
    rows = list(overall_rows(both))
    assert margin_note(both, rows).startswith("round: no critical scale is searched in both dir")
    assert margin_note(both.drop_vars("critical_scale"), rows) == ""


def test_without_any_second_component_a_note_says_what_is_missing(tmp_path: Path) -> None:
    records = stored([EAST, OTHERS[2]], tmp_path)
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    options = ScreenOptions(scales=(0.5,), margins="none")
    where, written = tmp_path / "structures.toml", list[xr.Dataset]()
    output = tmp_path / "screen.nc"
    screen_stage(records, output, options, structures_path=where, written=written.append)
    for found in (written[0], read_screening(output)):
        notes = summary_notes(list(overall_rows(found)))
        assert [note[:41] for note in notes if "no station" in note] == [
            "round: in one plane; no station has both "
        ]
