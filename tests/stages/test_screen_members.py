"""Screenings in which members of an ensemble respond in each scenario."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from tests.screening import STRUCTURES, sine, site, stored, structures, three

from rockframe.engines.engine import OneProcess, ProcessPool
from rockframe.errors import ParameterError
from rockframe.figures.fragility import draw_fragility, draw_peak_distribution
from rockframe.options.respond import (
    DesignOptions,
    Ensemble,
    RespondOptions,
    ScreenOptions,
)
from rockframe.quantities import QUANTILES
from rockframe.record import Record
from rockframe.report.page import screening_content
from rockframe.results.reading import opened
from rockframe.results.screen import read_screening, screening_of
from rockframe.results.screen_tables import (
    demand_words,
    overall_rows,
    scenario_rows,
    screen_rows,
    write_screen_tables,
)
from rockframe.risk import fit_fragility
from rockframe.rocking import Verdict, as_ground, draws, members, respond
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.respond import respond_stage
from rockframe.stages.screen import screen_stage
from rockframe.study.structures import read_structures

Screen = Callable[..., xr.Dataset]
#: An ensemble whose members are all the stated structure under the motion as recorded.
NO_SPREAD = Ensemble(height=0.0, width=0.0, impact_loss=1.0, amplitude=0.0)
SCALES = np.array([0.5, 1.0, 2.0])


def responses_one_by_one(
    records: list[Any], folder: Path, ensemble: Ensemble
) -> dict[str, np.ndarray]:
    """Return verdicts and peaks by the scalar kernel, (motions, structures, scales, members)."""
    frames = read_structures(folder / "structures.toml")
    found: dict[str, list[float]] = {"fell": [], "peak_rotation_ratio": [], "peak_u": []}
    for record in records:
        for frame in frames:
            for scale in SCALES:
                family = zip(members(ensemble, frame), draws(ensemble)[:, 3], strict=True)
                for member, amplitude in family:
                    one = respond(member, as_ground(record).scaled(scale * amplitude))
                    found["fell"].append(one.verdict is Verdict.OVERTURNS)
                    found["peak_rotation_ratio"].append(one.peak_rotation_ratio)
                    found["peak_u"].append(one.peak_u)
    shape = (len(records), len(frames), SCALES.size, ensemble.members)
    return {name: np.reshape(values, shape) for name, values in found.items()}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a screening of four members a scenario, and two further limits."""
    folder = tmp_path_factory.mktemp("four")
    limits = {"limit_peak_u_m": (0.1,), "limit_peak_rotation_ratio": (0.5,)}
    options = ScreenOptions(margins="none", scales=SCALES, scenario_members=4, **limits)
    records, frames = stored(site(6), folder), structures(folder)
    screen_stage(records, folder / "screen.nc", options, structures_path=frames)
    return folder


@pytest.fixture(scope="module")
def four(home: Path) -> xr.Dataset:
    """The screening of `home`."""
    return read_screening(home / "screen.nc")


def test_shares_and_bands_are_those_of_single_responses(four: xr.Dataset, home: Path) -> None:
    """Each member responds as the same structure under the scaled motion does alone."""
    ensemble = ScreenOptions(scenario_members=4).scenario_ensemble()
    assert ensemble is not None
    alone = responses_one_by_one(site(6), home, ensemble)
    fell, ratio, u = alone["fell"], alone["peak_rotation_ratio"], alone["peak_u"]
    shares = [fell, fell | (ratio >= 0.5), fell | (u >= 0.1)]
    assert four["limit_state"].values.tolist() == [
        "overturning",
        "peak_rotation_ratio_0.5",
        "peak_u_0.1m",
    ]
    for place, reached in enumerate(shares):
        assert_array_equal(four["share_reached"][..., place], reached.mean(axis=3))
        assert 0.0 < reached.mean() < 1.0
    assert ((four["share_reached"] > 0.0) & (four["share_reached"] < 1.0)).any()
    assert_array_equal(four["share_uplifted"], (u > 0.0).mean(axis=3))
    ordered = np.sort(np.where(fell, np.inf, ratio), axis=3)  # of four: 0.48 from the first
    low = np.where(
        np.isinf(ordered[..., 1]), np.inf, 0.52 * ordered[..., 0] + 0.48 * ordered[..., 1]
    )
    assert_allclose(four["peak_rotation_ratio_band"][..., 0], low, atol=1e-9)
    assert int(four["members"]) == 4
    assert_array_equal(four["quantile"], QUANTILES)


def test_a_larger_limit_is_reached_by_fewer_members(screen: Screen) -> None:
    """A member that overturns reaches each limit, and one that reaches 0.5 has reached 0.25."""
    found = screen(site(6), scenario_members=4, limit_peak_rotation_ratio=(0.25, 0.5))
    overturns, quarter, half = (found["share_reached"][..., k].values for k in range(3))
    assert (overturns <= half).all()
    assert (half <= quarter).all()
    assert overturns.sum() < half.sum() < quarter.sum()


def test_nominal_results_are_those_without_members(screen: Screen, four: xr.Dataset) -> None:
    """The stated structure responds beside the members; it is not one of them."""
    plain = screen(site(6), limit_peak_u_m=(0.1,), limit_peak_rotation_ratio=(0.5,))
    for name in ("verdict", "peak_rotation_ratio", "peak_u", "peak_v", "verdict_count"):
        assert_array_equal(four[name], plain[name])
    assert "share_reached" not in plain
    assert int(plain["members"]) == 1


def test_members_without_spread_are_the_stated_structure(screen: Screen) -> None:
    """All shares are 0 or 1, and all quantiles the nominal peak; the statistics follow."""
    asked = {"limit_peak_u_m": (0.1,), "scales": np.geomspace(0.5, 3.0, 6)}
    asked |= {"design": DesignOptions(dimension="height", range=(2.0, 30.0), steps=4)}
    plain = screen(site(8), **asked)
    found = screen(site(8), scenario_members=3, ensemble=NO_SPREAD, **asked)
    fell = plain["verdict"] == Verdict.OVERTURNS
    assert_array_equal(found["share_reached"][..., 0], fell)
    for place in range(len(QUANTILES)):
        band = found["peak_u_band"][..., place]
        assert_array_equal(band, np.where(fell, np.inf, plain["peak_u"]))
    pooled = ("overall_peak_rotation_ratio_band", "overall_peak_u_band", "design_quantile_84")
    for name in plain.variables:  # quantiles between two motions depend on how often they occur
        if name not in ("members", *pooled):
            assert_array_equal(found[name], plain[name], err_msg=str(name))


def test_fragility_and_rate_follow_from_the_shares(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    scales = np.geomspace(0.5, 3.0, 6)
    found = screen(site(8), scenario_members=4, scales=scales, hazard=hazard)
    one = found.sel(structure="slender", limit_state="overturning", measure="pga")
    shares = found["share_reached"].sel(structure="slender", limit_state="overturning").values
    assert ((shares > 0.0) & (shares < 1.0)).any()
    fit = fit_fragility(found["pga"].values, scales, shares)
    assert float(one["fragility_median"]) == fit.median
    assert float(one["fragility_lognormal_beta"]) == fit.lognormal_beta
    nominal = screen(site(8), scales=scales, hazard=hazard)
    assert (found["annual_rate"] != nominal["annual_rate"]).any()


def noise(seed: int) -> Record:
    """Return a record of steps of random height."""
    steps = np.random.default_rng(seed).standard_normal(60)
    return sine(f"noise{seed}", 1.0, acceleration=np.repeat(steps, 10))


def test_ranks_are_by_share_then_by_median(screen: Screen) -> None:
    """The motion that overturns a member ranks before one with a larger median."""
    asked = {"scenario_members": 4, "ensemble": Ensemble(amplitude=0.2)}
    found = screen([noise(1), noise(4), noise(9)], **asked).sel(structure="slender")
    at_one = found.sel(scale=1.0, limit_state="overturning")
    shares, medians = (
        at_one["share_reached"].values,
        at_one["peak_rotation_ratio_band"][:, 1].values,
    )
    assert shares[0] == shares[1] == 0.0 < shares[2]
    assert medians[1] < medians[2] < medians[0]
    assert found["demand_rank"].values.tolist() == [2.0, 3.0, 1.0]


def test_results_over_all_motions_pool_the_members(four: xr.Dataset, home: Path) -> None:
    ensemble = ScreenOptions(scenario_members=4).scenario_ensemble()
    assert ensemble is not None
    alone = responses_one_by_one(site(6), home, ensemble)
    u = np.where(alone["fell"], np.inf, alone["peak_u"])[:, :, 1]
    for k, row in enumerate(overall_rows(four)):
        assert row["share_overturned"] == alone["fell"][:, k, 1].mean()
        assert (
            row["share_overturned_low"] <= row["share_overturned"] <= row["share_overturned_high"]
        )
        expected = np.sort(u[:, k].ravel())[12:11:-1].item()  # the median of 24 is below the 13th
        assert np.sort(u[:, k].ravel())[11] <= row["peak_u_50_m"] <= expected + 1e-12


@pytest.mark.parametrize("statistic", ["share", "quantile_84"])
def test_a_design_has_the_shares_and_quantiles_of_its_members(
    screen: Screen, statistic: str
) -> None:
    """A candidate with the width of the structure has the results of the structure's members."""
    design = DesignOptions(
        dimension="width",
        range=(0.45, 0.9),
        quantity="peak_u",
        limit=0.1,
        steps=4,
        statistic=statistic,
        **({"share": 0.7} if statistic == "share" else {}),
    )
    found = screen(site(6), design=design, scenario_members=4, limit_peak_u_m=(0.1,))
    one = found.sel(structure="slender")
    below = 1.0 - float(one["share_reached"].sel(scale=1.0, limit_state="peak_u_0.1m").mean())
    assert_allclose(float(one["design_share"][0]), below)
    assert float(one["design_quantile_84"][0]) == float(one["overall_peak_u_band"][2])
    met = one["design_share"] >= 0.7 if statistic == "share" else one["design_quantile_84"] < 0.1
    assert float(one["design_smallest"]) == one["design_value"].values[met.values][0]
    assert 0 < met.sum() < 4
    assert found["design_quantile_84"].attrs["units"] == "m"
    assert str(found["design_statistic"].item()) == statistic


def test_groups_of_candidates_change_nothing(
    screen: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Candidates are computed in groups of limited size, scales of a motion in several batches."""
    design = DesignOptions(dimension="width", range=(0.45, 0.9), limit=0.4, steps=5)
    whole = screen(site(3), design=design, scenario_members=4)
    monkeypatch.setattr("rockframe.stages.screening.tasks._RESPONSES", 9)
    parts = screen(site(3), design=design, scenario_members=4)
    assert parts.identical(whole.assign_attrs(parts.attrs))


def test_engines_write_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The stated structures respond in one batch, and their members in one batch for each motion,
    of which a worker computes the second.
    """
    monkeypatch.setattr("rockframe.stages.screening.tasks._RESPONSES", 20)
    records, frames = stored([sine("a", 2.0), sine("b", 3.0)], tmp_path), structures(tmp_path)
    options = ScreenOptions(scales=[1.0, 2.0], margins="none", scenario_members=5)
    files = set()
    for engine in (OneProcess(), ProcessPool(2, patience=1e-9)):
        output = tmp_path / "screen.nc"
        screen_stage(records, output, options, structures_path=frames, engine=engine)
        files.add(output.read_bytes())
    assert len(files) == 1


def test_batches_of_other_members_are_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupted run with other members leaves batches that do not fit."""
    records, output = stored(site(2), tmp_path), tmp_path / "screen.nc"
    options = ScreenOptions(scales=[1.0], margins="none", scenario_members=3)

    def stop(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("rockframe.stages.screen.write_screen_tables", stop)
        with pytest.raises(KeyboardInterrupt):
            screen_stage(records, output, options, structures_path=structures(tmp_path))
    assert len(list(tmp_path.glob(".screen-*.batches"))) == 1
    four = options.replaced(scenario_members=4)
    screen_stage(records, output, four, structures_path=structures(tmp_path))
    found = read_screening(output)["share_reached"]
    assert (4.0 * found % 1.0 == 0.0).all()
    assert not list(tmp_path.glob(".screen-*.batches"))


def test_tables_have_the_shares_and_quantiles(four: xr.Dataset, home: Path) -> None:
    rows = list(scenario_rows(four))
    for name, limit in (("overturned", "overturning"), ("peak_u_0.1m", "peak_u_0.1m")):
        shares = four["share_reached"].sel(limit_state=limit).values.ravel()
        assert_array_equal([row[f"share_{name}"] for row in rows], shares)
    assert_array_equal(
        [row["peak_u_84_m"] for row in rows], four["peak_u_band"][..., 2].values.ravel()
    )
    for row in screen_rows(four):
        share = row["share_overturned"]
        assert row["verdict_words"] == (
            f"may overturn ({100.0 * share:.0f} %)"
            if 0.0 < share < 1.0
            else ("overturns" if share else "stands" if row["share_uplifted"] else "no uplift")
        )
        assert (f"({100.0 * share:.0f} %)" in demand_words(row)) == (share > 0.0)
    content = screening_content(four)
    assert content["responses"] == "24 responses (6 motions, 4 members each)"
    (stout, _) = screening_of(home / "screen.nc", "s05")
    expected = four["share_reached"].sel(structure="stout", limit_state="overturning")[5]
    assert [*stout["shares_overturned"].values()] == expected.values.tolist()


def test_a_member_that_cannot_rock_is_named(screen: Screen) -> None:
    with pytest.raises(ParameterError, match=r"Invalid spread height 0\.99 of the ensemble"):
        screen(site(2), scenario_members=200, ensemble=Ensemble(height=0.99))


def test_a_motion_that_lifts_a_member_off_is_rejected(tmp_path: Path) -> None:
    """At 1.5 times the motion the ground would fall faster than gravity for some members only."""
    records = stored([*three("a", upward=6.5), *three("b")], tmp_path)
    options = ScreenOptions(margins="none", scales=[1.5], vertical=True)
    output, frames = tmp_path / "s.nc", structures(tmp_path)
    assert screen_stage(records, output, options, structures_path=frames).motions == 4
    spread = options.replaced(scenario_members=16, ensemble=Ensemble(amplitude=0.05))
    done = screen_stage(records, output, spread, structures_path=frames)
    assert [one.file for one in done.rejections] == ["a-e", "a-n"]
    assert all("would lose contact" in one.reason for one in done.rejections)
    assert done.motions == 2


def test_a_structure_without_a_gap_has_no_share_of_it(tmp_path: Path) -> None:
    """It would otherwise be the share that overturns."""
    text = f"{STRUCTURES}[structure.abutment]\ngap_m = 0.05\n"
    screen_stage(
        stored(site(4), tmp_path),
        tmp_path / "screen.nc",
        ScreenOptions(margins="none", scenario_members=3, limit_peak_gap_ratio=[1.0]),
        structures_path=structures(tmp_path, text),
    )
    share = read_screening(tmp_path / "screen.nc")["share_reached"].sel(
        limit_state="peak_gap_ratio_1"
    )
    assert share.sel(structure="stout").isnull().all()
    assert 0.0 < float(share.sel(structure="slender").mean(skipna=False)) < 1.0


@pytest.mark.parametrize("members", [0, 1001])
def test_numbers_of_members_that_cannot_be(members: int) -> None:
    with pytest.raises(ParameterError, match=f"scenario_members {members}. Must be"):
        ScreenOptions(scenario_members=members)


def test_neither_copies_nor_members_narrow_a_band(screen: Screen) -> None:
    """Bands are from recordings: eight files of two recordings say as much as the two."""
    two = {"a": 2.5, "b": 3.5}
    once = [sine(name, peak) for name, peak in two.items()]
    often = [sine(f"{one}{n}", peak, station=one) for one, peak in two.items() for n in range(4)]
    asked = {"scenario_members": 4, "ensemble": Ensemble(amplitude=0.3)}
    found, copied = screen(once, **asked), screen(often, **asked)
    without_spread = [screen(once, scenario_members=k, ensemble=NO_SPREAD) for k in (2, 8)]
    assert (
        (found["overall_share_overturned"] > 0.0) & (found["overall_share_overturned"] < 1.0)
    ).any()
    bands = ("overall_share_overturned", "peak_share", "fragility")
    for name in (f"{band}_{end}" for band in bands for end in ("low", "high")):
        assert_allclose(copied[name], found[name], atol=1e-9, err_msg=name)
        assert_allclose(without_spread[0][name], without_spread[1][name], atol=1e-9, err_msg=name)


def test_a_file_of_an_older_version_is_nominal(screen: Screen, tmp_path: Path) -> None:
    """It has no results over all records, and its undecided verdicts are not read."""
    design = DesignOptions(dimension="height", range=(2.0, 30.0), steps=4)
    screen(site(6), margins="first", design=design)
    new = ("members", "quantile", "design_statistic", "design_quantile_84")
    with xr.open_dataset(tmp_path / "screen.nc", decode_times=False) as file:
        lacking = [name for name in file.variables if str(name).startswith("overall_")]
        old = file.drop_vars([*new, *lacking]).load()
    flag = {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "decided undecided"}
    old["undecided"] = (("record", "structure"), np.ones((6, 2), np.int8), flag)
    old.to_netcdf(tmp_path / "old.nc")
    found = read_screening(tmp_path / "old.nc")
    assert "undecided" not in found
    assert list(overall_rows(found)) == []
    content = screening_content(found)
    assert content["nominal"]
    assert content["design"]["by_share"]
    one = found.sel(structure="slender")
    assert "(nominal)" in draw_fragility(one).caption
    fell = float((found["verdict"].sel(structure="slender", scale=1.0) == 2).mean())
    assert f"{100.0 * fell:.0f} % overturn" in draw_peak_distribution(one).caption
    for kind, path in write_screen_tables(tmp_path / "old.nc").items():
        known = tmp_path / f"{kind or 'screen'}.csv"
        assert path.read_text().splitlines()[0] == known.read_text().splitlines()[0]


def test_figures_and_page_name_the_members(four: xr.Dataset) -> None:
    caption = draw_peak_distribution(four.sel(structure="slender")).caption
    assert caption.startswith("Share of 24 responses (6 motions, 4 members each) of 6 recordings")
    share = float(four["overall_share_overturned"].sel(structure="slender", scale=1.0))
    assert f"{100.0 * share:.0f} % overturn" in caption
    assert "4 members each" in draw_fragility(four.sel(structure="slender")).caption
    content = screening_content(four)
    assert not content["nominal"]
    (column,) = (one for one in content["overall_columns"] if one.key == "share_overturned")
    shown = [column.cell(row).partition(" %")[0] for row in content["overall"]]
    shares = four["overall_share_overturned"].sel(scale=1.0).values
    assert shown == [f"{100.0 * one:.0f}" for one in shares]


def test_members_are_shaken_by_the_versions_of_a_record(
    bundled_records: Path, tmp_path: Path
) -> None:
    """Shares and bands at the motion itself are those of `respond`: the members are the same."""
    records = tmp_path / "records.nc"
    ingest_stage([bundled_records / "Ridgecrest2019-CCC.V1"], records, workers=0)
    ensemble = Ensemble(members=16, orientation_degree=3.0)
    frames = structures(tmp_path)
    screened = tmp_path / "screen.nc"
    screen_stage(
        records,
        screened,
        ScreenOptions(
            scales=[1.0],
            scenario_members=16,
            margins="none",
            ensemble=Ensemble(orientation_degree=3.0),
        ),
        structures_path=frames,
    )
    options = RespondOptions(margins="none", ensemble=ensemble)
    respond_stage(records, tmp_path / "r.nc", options, structures_path=frames)
    found = read_screening(screened)
    with opened(tmp_path / "r.nc", "response") as file:
        alone = file[["share_overturned", "share_uplifted", "peak_rotation_ratio_band"]].load()
    shares = found["share_reached"].sel(scale=1.0, limit_state="overturning")
    assert_array_equal(shares, alone["share_overturned"])
    band = found["peak_rotation_ratio_band"].sel(scale=1.0)
    assert_array_equal(band, alone["peak_rotation_ratio_band"])
    assert_array_equal(found["share_uplifted"].sel(scale=1.0), alone["share_uplifted"])
    screen_stage(
        records,
        screened,
        ScreenOptions(
            scales=[1.0],
            scenario_members=16,
            margins="none",
            ensemble=Ensemble(corner=1.0),
        ),
        structures_path=frames,
    )
    unvaried = read_screening(screened)["peak_rotation_ratio_band"].sel(scale=1.0)
    assert (unvaried != band).any()
