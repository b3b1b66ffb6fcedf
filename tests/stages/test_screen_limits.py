"""Screenings with limit states other than overturning, or spectral acceleration as a measure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast, get_args

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from tests.conftest import SHARED
from tests.screening import STRUCTURES, sine, site, stored, structures, three

from rockframe import Abutment, RockingFrame, Tendon, respond, respond_many
from rockframe.components import pair_horizontals, rotd, rotd_spectral_acceleration
from rockframe.errors import ParameterError
from rockframe.figures.fragility import draw_fragility
from rockframe.options.model import FurtherMeasure
from rockframe.options.respond import DesignOptions, ScreenOptions
from rockframe.report.page import screening_content
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import screen_rows, screen_summary
from rockframe.risk import FURTHER, LimitState, Outcome, fit_fragility
from rockframe.risk.fragility import OVERTURNING
from rockframe.signals.measures import (
    arias_intensity,
    cumulative_absolute_velocity,
    spectral_acceleration,
)
from rockframe.signals.processing import integrate
from rockframe.stages.screen import screen_stage
from rockframe.stages.screening.outcomes import ScreenedStructures
from rockframe.structures.screening import quantities_of
from rockframe.units import GRAVITY

Screen = Callable[..., xr.Dataset]
SCALES = np.geomspace(0.25, 3.0, 8)
LIMITS = {
    "limit_peak_rotation_ratio": (0.25, 0.5),
    "limit_peak_u_m": (0.1,),
    "limit_peak_v_m": (0.005,),
    "limit_peak_impact_velocity_m_s": (0.15,),
}


@pytest.fixture(scope="module")
def names() -> list[str]:
    others = ["peak_u_0.1m", "peak_v_0.005m", "peak_impact_velocity_0.15m_s"]
    return ["overturning", "peak_rotation_ratio_0.25", "peak_rotation_ratio_0.5", *others]


def test_each_limit_has_the_fragility_of_its_peaks(screen: Screen, names: list[str]) -> None:
    """A motion that overturns reaches all limits; others reach those that their peaks exceed."""
    found = screen(site(6), scales=SCALES, **LIMITS)
    assert found["limit_state"].values.tolist() == names
    one = found.sel(structure="slender")
    peaks = {
        "overturning": one["peak_rotation_ratio"] > np.inf,
        "peak_rotation_ratio_0.25": one["peak_rotation_ratio"] >= 0.25,
        "peak_rotation_ratio_0.5": one["peak_rotation_ratio"] >= 0.5,
        "peak_u_0.1m": one["peak_u"] >= 0.1,
        "peak_v_0.005m": one["peak_v"] >= 0.005,
        "peak_impact_velocity_0.15m_s": one["peak_impact_velocity"] >= 0.15,
    }
    for name, exceeded in peaks.items():
        reached = (exceeded | (one["verdict"] == 2)).values
        fit = one.sel(limit_state=name, measure="pga")
        expected = fit_fragility(found["pga"].values, SCALES, reached)
        assert int(fit["fragility_overturned"]) == reached.sum() == expected.overturned
        assert_allclose(float(fit["fragility_median"]), expected.median)


def test_tendons_yield_and_gaps_close() -> None:
    """Both agree with each response; a free structure reaches them only by overturning."""
    column = RockingFrame(height=3.0, width=0.45, column_mass=1e3, name="free")
    tendon = Tendon(area=1e-5, modulus=2e11, length=3.0, prestress=500.0, yield_stress=9e7)
    tied = replace(column, tendon=tendon, abutment=Abutment(gap=0.05), name="tied")
    records = site(6)
    found = respond_many(records, [column, tied])
    yields, closes = [], []
    for i, record in enumerate(records):
        part = (found.verdict[i], found.peak_rotation[i], found.impact_velocity[i])
        peaks, fell = quantities_of([column, tied], *part), found.verdict[i] == 2
        reached = [
            LimitState(f"peak_{what}_ratio", 1.0).reached(peaks, fell) for what in ("tendon", "gap")
        ]
        assert all((limit[0] == fell[0]).all() for limit in reached)
        response = respond(tied, record)
        assert response.restraint is not None
        yields.append((not np.isnan(response.restraint.tendon_yields), bool(reached[0][1, 0])))
        closes.append((response.peak_u >= 0.05, bool(reached[1][1, 0])))
    for pairs in (yields, closes):
        assert {one for one, _ in pairs} == {True, False}
        assert all(one == other for one, other in pairs)


def test_a_tendon_that_loses_prestress_never_exceeds_its_yield_force() -> None:
    """Its force is that of the response, also where the screening compares it with a limit."""
    elastic = Tendon(area=1e-5, modulus=2e11, length=3.0, prestress=500.0, yield_stress=9e7)
    tendon = replace(elastic, loses_prestress=True)
    tied = RockingFrame(height=3.0, width=0.45, column_mass=1e3, tendon=tendon)
    records = site(6)
    found = respond_many(records, [tied], SCALES)
    ratios = []
    for i, record in enumerate(records):
        part = (found.verdict[i], found.peak_rotation[i], found.impact_velocity[i])
        peaks = quantities_of([tied], *part)
        ratios.append(peaks["peak_tendon_ratio"][0])
        response = respond(tied, record.scaled(SCALES[-1]))
        assert response.restraint is not None
        force = response.restraint.peak_tendon_force
        assert_allclose(ratios[-1][-1], force / tendon.yield_force, rtol=1e-9)
    stands = np.zeros(np.shape(ratios), dtype=np.bool_)
    reached = LimitState("peak_tendon_ratio", 1.0).reached(
        {"peak_tendon_ratio": np.array(ratios)}, stands
    )
    assert {*reached.ravel().tolist()} == {True, False}
    assert np.max(ratios) == 1.0


def test_each_limit_has_a_rate_and_its_parts(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    found = screen(site(6), scales=SCALES, hazard=hazard, **LIMITS)
    rate = found["annual_rate"]
    assert rate.dims == ("structure", "limit_state")
    assert_allclose(found["disaggregation"].sum("hazard_point", skipna=False), rate)
    outcome = found["fragility_outcome"].sel(measure="pga")
    curve = outcome.isin([Outcome.FITTED, Outcome.UNDETERMINED])
    assert (rate.notnull() == curve).all()
    assert curve.any()


def test_design_for_a_drift(screen: Screen) -> None:
    """A candidate with the width of the structure has the structure's share below the limit."""
    design = DesignOptions(
        dimension="width", range=(0.45, 0.9), quantity="peak_u", limit=0.1, steps=2, share=0.5
    )
    found = screen(site(6), design=design)
    one = found.sel(structure="slender", scale=1.0)
    share = float(((one["peak_u"] < 0.1) & (one["verdict"] != 2)).mean())
    assert float(one["design_share"][0]) == share
    assert found["design_limit"].attrs["units"] == "m"


def test_design_for_an_impact_velocity(screen: Screen) -> None:
    """As for the drift; the impact velocities are those of the responses."""
    design = DesignOptions(
        dimension="width", range=(0.45, 0.9), quantity="peak_impact_velocity", limit=0.1, steps=2
    )
    records = site(6)
    found = screen(records, design=design)
    one = found.sel(structure="slender", scale=1.0)
    column = RockingFrame(height=3.0, width=0.45)
    expected = respond_many(records, [column]).impact_velocity[:, 0, 0]
    assert_array_equal(one["peak_impact_velocity"], expected)
    assert float(one["design_share"][0]) == ((expected < 0.1) & (one["verdict"] != 2)).mean()
    assert found["design_limit"].attrs["units"] == "m s-1"


def test_spectral_accelerations_are_measures(screen: Screen) -> None:
    records = site(4)
    found = screen(records, scales=SCALES, spectral_periods_s=(0.5, 1.0))
    assert found["measure"].values.tolist()[-2:] == ["sa_0.5s", "sa_1s"]
    expected = [spectral_acceleration(r.acceleration, r.time_step, [0.5, 1.0]) for r in records]
    assert_allclose(found["spectral_acceleration"].values, expected)
    fit = found.sel(structure="slender", limit_state="overturning", measure="sa_1s")
    reached = (found["verdict"].sel(structure="slender") == 2).values
    of_pga = fit_fragility([float(sa[1]) for sa in expected], SCALES, reached)
    assert_allclose(float(fit["fragility_median"]), of_pga.median)


def test_fragilities_over_measures_of_equal_motions_differ_by_their_scale_and_power(
    screen: Screen,
) -> None:
    """The motions are one sine at several amplitudes A. CAV is proportional to A, and the Arias
    intensity to A squared: its beta is twice as large, and both likelihoods are that of PGA.
    """
    records = site(5)
    found = screen(records, scales=SCALES, measures=("cav", "arias_intensity"))
    one = found.sel(structure="slender", limit_state="overturning")
    of_pga = one.sel(measure="pga")
    for name, power, function in (
        ("cav", 1, cumulative_absolute_velocity),
        ("arias_intensity", 2, arias_intensity),
    ):
        fit = one.sel(measure=name)
        values = [function(record.acceleration, record.time_step) for record in records]
        assert_allclose(found[name], values)
        ratio = values[0] / records[0].pga ** power
        median = ratio * float(of_pga["fragility_median"]) ** power
        assert_allclose(fit["fragility_median"], median, rtol=1e-6)
        beta = power * float(of_pga["fragility_lognormal_beta"])
        assert_allclose(fit["fragility_lognormal_beta"], beta, rtol=1e-6)
        assert_allclose(fit["log_likelihood"], of_pga["log_likelihood"])
        assert_allclose(fit["bin_share"], of_pga["bin_share"])
        ends = fit["fragility_intensity"].values[[0, -1]]
        assert_allclose(
            ends * [1.25, 0.8], fit[["fragility_lowest", "fragility_highest"]].to_array()
        )


def test_measures_of_both_horizontals_are_those_of_the_pair(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("sa_1s_rotd50_g,annual_rate\n0.05,0.01\n0.5,0.001\n")
    records = [*three("a"), sine("alone", 2.0)]
    found = screen(records, measures=("pga_rotd50", "pgv_rotd100"), hazard=hazard)
    pair = pair_horizontals(records)[0][0]
    for name, sweep in (
        ("pga_rotd50", rotd(pair)),
        ("pgv_rotd100", rotd(pair, transform=integrate)),
        ("spectral_acceleration_rotd50", rotd_spectral_acceleration(pair, 1.0)),
    ):
        value = sweep.percentile(100 if name.endswith("rotd100") else 50)
        assert_allclose(found[name].values.ravel(), [value, value, np.nan])
    assert str(found["hazard_measure"].item()) == "sa_1s_rotd50"
    row = next(screen_rows(found))
    assert row["sa_1s_rotd50_g"] == found["spectral_acceleration_rotd50"].values[0, 0] / GRAVITY


def test_measures_of_both_horizontals_need_a_pair_and_periods(screen: Screen) -> None:
    with pytest.raises(
        ParameterError, match=r"pga_rotd50 is unknown for all motions\. It needs both"
    ):
        screen(site(2), measures=("pga_rotd50",))
    with pytest.raises(ParameterError, match="measures sa_rotd50 without spectral_periods_s"):
        ScreenOptions(measures=("sa_rotd50",))


def test_options_and_measures_have_the_same_names() -> None:
    of_both = {"sa_rotd50", "sa_rotd100"}
    assert {*get_args(FurtherMeasure)} == {*FURTHER} | of_both


def test_a_hazard_curve_of_spectral_acceleration_needs_no_stated_period(
    screen: Screen, tmp_path: Path
) -> None:
    hazard = tmp_path / "SA0P5.csv"
    hazard.write_text("lon,lat,0.05,0.5,5.0\n12.0,42.0,0.1,0.001,0.00001\n", encoding="utf-8")
    found = screen(site(6), scales=SCALES, hazard=hazard, hazard_site=(12.001, 42.0))
    assert str(found["hazard_measure"].item()) == "sa_0.5s"
    stated = "the nearest site, at 12 42, 0.08 km from the requested place"
    assert str(found["hazard_site"].item()) == stated
    assert (found["annual_rate_high"] > 0.0).all()


def test_a_folder_of_openquake_has_one_curve_of_each_kind(screen: Screen, tmp_path: Path) -> None:
    for kind, first in (("mean", 0.2), ("max", 0.4)):
        head = f"#,,\"kind='{kind}', investigation_time=50.0, imt='PGA'\"\n"
        rows = f"lon,lat,depth,poe-0.05,poe-0.5\n12.0,42.0,0.0,{first},0.001\n"
        (tmp_path / f"hazard_curve-{kind}-PGA_1.csv").write_text(head + rows)
    found = screen(site(6), scales=SCALES, hazard=tmp_path, hazard_curve="max")
    assert_allclose(found["hazard_rate"][0], -np.log1p(-0.4) / 50.0)


@pytest.mark.skipif(not SHARED.exists(), reason="the samples are not here")
def test_a_file_of_openquake_as_delivered(screen: Screen) -> None:
    hazard = SHARED / "catalogues" / "openquake_hazard_curve-mean-PGA.csv"
    found = screen(site(6), scales=SCALES, hazard=hazard, hazard_site=(-65.135, 0.001))
    assert_allclose(found["hazard_rate"][0], -np.log1p(-1.591452e-2))
    assert (found["annual_rate_high"] < 0.017).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hazard_site": (1.0, 2.0)}, "hazard_site without hazard"),
        ({"hazard_curve": "max"}, "hazard_curve without hazard"),
        ({"hazard": "h.csv", "hazard_site": (42.0, 100.0)}, "Must be longitude, then latitude"),
        (
            {"hazard": "h.csv", "hazard_site": (1.0, 2.0), "hazard_site_id": "a"},
            "hazard_site and hazard_site_id both stated",
        ),
        ({"limit_peak_u_m": (0.0,)}, "limit_peak_u_m with 0. Must be above 0"),
    ],
)
def test_options_that_cannot_be(options: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        ScreenOptions(**options)


def test_limits_of_restraints_need_restraints(screen: Screen) -> None:
    with pytest.raises(ParameterError, match=r"Missing gap_m of abutments. Must be stated for lim"):
        screen(site(2), limit_peak_gap_ratio=(1.0,))
    with pytest.raises(
        ParameterError, match=r"Missing yield_stress_pa of tendons. Must be stated for"
    ):
        screen(site(2), limit_peak_tendon_ratio=(1.0,))


@pytest.mark.filterwarnings("error")
def test_a_structure_without_a_gap_has_no_fragility_of_it(tmp_path: Path) -> None:
    """It has no rate, table row or curve either; they would be those of overturning."""
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    text = f"{STRUCTURES}[structure.abutment]\ngap_m = 0.05\n"
    options = {"scales": [0.5, 1.0, 2.0], "hazard": hazard, "limit_peak_gap_ratio": [1.0]}
    screen_stage(
        stored(site(6), tmp_path),
        tmp_path / "screen.nc",
        ScreenOptions(margins="none", **options),
        structures_path=structures(tmp_path, text),
    )
    found = read_screening(tmp_path / "screen.nc")
    without = found.sel(structure="stout", limit_state="peak_gap_ratio_1")
    for name in ("fragility", "fragility_high", "bin_share", "annual_rate", "annual_rate_high"):
        assert without[name].isnull().all(), name
    assert found["annual_rate_high"].sel(structure="slender").notnull().all()
    for row in screen_summary(found):
        expected = {"overturning"} | (
            {"peak_gap_ratio_1"} if row["structure"] == "slender" else set()
        )
        for part in ("fragility", "rates"):
            assert {one["limit_state"] for one in row[part]} == expected
    assert "gap" not in draw_fragility(found.sel(structure="stout")).caption
    assert len(screening_content(found)["fragility"][0][1]) == 1


@pytest.mark.parametrize(
    ("quantity", "key"), [("peak_tendon_ratio", "yield_stress_pa"), ("peak_gap_ratio", "gap_m")]
)
def test_a_design_for_a_restraint_needs_it_in_every_structure(
    screen: Screen, quantity: str, key: str
) -> None:
    """A structure without the restraint would otherwise get the design for overturning."""
    design = {"dimension": "height", "range": (3.0, 6.0), "quantity": quantity, "steps": 2}
    with pytest.raises(ParameterError, match=f"Missing {key} of frame 'stout'. Must be stated for"):
        screen(site(2), design=design)


def test_words_of_an_outcome_name_the_limit() -> None:
    limit = LimitState.named("peak_u_0.1m")
    assert Outcome.NONE_OVERTURN.sentence_of(limit.words).startswith("no motion reaches u ≥ 0.1 m")
    assert Outcome.NONE_OVERTURN.sentence.startswith("no motion overturns it")


def test_structures_share_the_memory_of_their_shares() -> None:
    """An archive of many structures holds the shares of each limit once."""
    arrays = [np.zeros((3, 2, 4)), np.ones((3, 2, 4))]
    frames = [RockingFrame(height=9.6, width=1.6), RockingFrame(height=6.0, width=0.8)]
    limits = [OVERTURNING, LimitState("peak_u", 0.2)]
    run = SimpleNamespace(
        request=SimpleNamespace(structures=frames, limits=limits),
        shares=lambda n: arrays[n].copy(),
        has=lambda *_: True,
    )
    first, second = ScreenedStructures.reached_by_each(cast("Any", run), [np.arange(3)] * 2)
    for one, other, array in zip(first, second, arrays, strict=True):
        assert one is not None
        assert other is not None
        assert one.base is other.base
        assert_array_equal(one, array[:, 0])
