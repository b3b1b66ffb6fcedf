"""One fragility over many structures: its dimensionless measure, its fits and what is printed."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.screening import STRUCTURES, sine, site, stored, structures

from rockframe.cli.main import main
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import ScreenOptions
from rockframe.record import Record
from rockframe.results.screen import pooled_fits, read_screening
from rockframe.results.screen_tables import screen_summary
from rockframe.risk import POOLED, fit_fragility, pooled_intensities
from rockframe.rocking import respond
from rockframe.signals.processing import integrate, peak
from rockframe.stages.screen import screen_stage, screening_figures

SCALES = tuple(np.geomspace(0.4, 3.0, 6).tolist())
#: The slender column under another name, and a frame with bars.
MORE = """
[[structure]]
name = "copy"
height_m = 3.0
width_m = 0.45

[[structure]]
name = "barred"
height_m = 6.0
width_m = 1.2
column_mass_kg = 20e3
[structure.dissipater]
stiffness_n_m = 5e6
yield_force_n = 2e4
lever_arm_m = 0.6
"""


@pytest.mark.parametrize(("gamma", "amplitude"), [(0.0, 1.55), (2.0, 1.7)])
def test_twice_the_size_and_time_stretched_by_the_root_of_two_rock_equally(
    gamma: float, amplitude: float
) -> None:
    """p theta-double-dot = f(t p): theta and the dimensionless measures are equal, PGV is not."""
    small = RockingFrame(height=3.0, width=0.45, mass_ratio=gamma)
    large = small.resized(6.0, 0.9)
    brief = sine("brief", amplitude)
    long = replace(brief, time_step=math.sqrt(2.0) * brief.time_step)
    ratios = [respond(*pair).peak_rotation_ratio for pair in ((small, brief), (large, long))]
    assert 0.1 < ratios[0] < 1.0
    assert ratios[1] == pytest.approx(ratios[0], rel=1e-6)
    measured = [
        pooled_intensities([frame], *(np.array([x]) for x in (motion.pga, pgv(motion))))
        for frame, motion in ((small, brief), (large, long))
    ]
    for name in ("dimensionless_pga", "dimensionless_pgv"):
        assert_allclose(measured[1][name], measured[0][name], rtol=1e-12)
    assert_allclose(measured[1]["pgv"], math.sqrt(2.0) * measured[0]["pgv"])


def pgv(motion: Record) -> float:
    return peak(integrate(motion.acceleration, motion.time_step))


def test_a_frame_has_the_measures_of_the_column_that_rocks_like_it() -> None:
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    larger = frame.effective_size / frame.size
    column = RockingFrame(height=larger * 9.6, width=larger * 1.6)
    both = pooled_intensities([frame, column], np.array([3.0]), np.array([0.7]))
    for name in POOLED:
        assert both[name][0] == pytest.approx(both[name][1])


@pytest.fixture(scope="module")
def screened(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pooled")
    screen_stage(
        stored(site(12), folder),
        folder / "screen.nc",
        ScreenOptions(
            scales=SCALES,
            margins="none",
            pooled=True,
            limit_peak_rotation_ratio=(0.3,),
            limit_peak_u_m=(0.1,),
        ),
        structures_path=structures(folder, STRUCTURES + MORE),
    )
    return folder / "screen.nc"


def test_the_pooled_fit_is_that_of_the_stacked_scenarios(screened: Path) -> None:
    found = read_screening(screened)
    free = ["stout", "slender", "copy"]
    assert found["pooled"].values.tolist() == [1, 1, 1, 0]
    assert found["pooled_limit_state"].values.tolist() == ["overturning", "peak_rotation_ratio_0.3"]
    fell = found["verdict"].sel(structure=free) == 2
    stacked = np.concatenate([fell.sel(structure=name).values for name in free])
    uplift = found["uplift_acceleration"].sel(structure=free).values[:, None]
    p = found["effective_frequency_parameter"].sel(structure=free).values[:, None]
    measure = (p * found["pgv"].values / uplift).ravel()
    clusters = np.tile(found["cluster"].values, len(free))
    expected = fit_fragility(measure, SCALES, stacked, clusters)
    fit = found.sel(pooled_measure="dimensionless_pgv", pooled_limit_state="overturning")
    assert_allclose(fit["pooled_fragility_median"], expected.median)
    assert_allclose(fit["pooled_fragility_lognormal_beta"], expected.lognormal_beta)
    assert_allclose(fit["pooled_log_likelihood"], expected.log_likelihood.sum())
    assert int(fit["pooled_fragility_motions"]) == 12
    assert int(fit["pooled_fragility_observations"]) == 12 * 6 * 3


def test_a_copy_of_a_structure_is_no_further_evidence(tmp_path: Path) -> None:
    """Recordings are the observations: the median, beta and their bands stay, ln L doubles."""
    _, slender = STRUCTURES.split("\n\n")
    copy = slender.replace("slender", "copy")
    options = ScreenOptions(scales=SCALES, margins="none", pooled=True)
    where = structures(tmp_path, f"{slender}\n{copy}")
    records, output = stored(site(12), tmp_path), tmp_path / "screen.nc"
    screen_stage(records, output, options, structures_path=where)
    found = read_screening(output).sel(limit_state="overturning", measure="pgv")
    alone = found.sel(structure="slender")
    both = found.sel(pooled_limit_state="overturning", pooled_measure="pgv")
    for name in ("median", "median_low", "median_high", "lognormal_beta", "lognormal_beta_high"):
        assert_allclose(both[f"pooled_fragility_{name}"], alone[f"fragility_{name}"], rtol=1e-6)
    assert_allclose(both["pooled_log_likelihood"], 2.0 * alone["log_likelihood"])


def test_the_gain_over_pga_and_the_restrained_structures_are_said(
    screened: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = screened.parent
    words = ["screen", str(folder / "records.nc"), "--margins", "none", "--pooled", "--scales"]
    words += [*(f"{scale!r}" for scale in SCALES), "--structures", str(folder / "structures.toml")]
    words += ["--output", str(folder / "again.nc")]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "One fragility for 3 structures (lognormal curves)" in printed
    assert "Not among them: barred. With tendons or dissipaters," in printed
    assert main([*words, "--json"]) == 0
    pooled = json.loads(capsys.readouterr().out)["pooled"]
    assert pooled["structures"] == ["stout", "slender", "copy"]
    assert pooled["restrained"] == ["barred"]
    fits = {fit["measure"]: fit for fit in pooled["fragility"]}
    own, of_pga = fits["dimensionless_pgv"], fits["pga"]
    assert own["aic_below_pga"] == 2.0 * (own["log_likelihood"] - of_pga["log_likelihood"]) > 0.0
    beta, gain = own["lognormal_beta"], own["aic_below_pga"]
    assert f"the lognormal β of overturning is {beta:.3g}, over PGA" in printed
    assert f"The AIC of p PGV/(g tan α) is {gain:.3g} below that of PGA" in printed
    with (folder / "again-pooled.csv").open(newline="", encoding="utf-8") as stream:
        rows = {row["measure"]: row for row in csv.DictReader(stream)}
    assert float(rows["dimensionless_pgv"]["median"]) == own["median"]


def test_the_pooled_fragility_is_read_and_drawn_as_that_of_one_structure(screened: Path) -> None:
    together = pooled_fits(read_screening(screened))
    assert together is not None
    (said,) = screen_summary(together)
    assert said["structure"] == "one of 3 structures"
    assert {fit["measure"] for fit in said["fragility"]} == {*POOLED}
    *_, (name, what, drawn) = screening_figures(screened, 1)
    assert (name, what) == ("fragility-pooled", "one of 3 structures")
    assert "p PGV/(g tan α): half overturn at" in drawn.caption


def test_one_free_standing_structure_is_not_pooled(tmp_path: Path) -> None:
    _, slender = STRUCTURES.split("\n\n")
    where = structures(tmp_path, slender + MORE.split("\n\n")[1])
    with pytest.raises(ParameterError, match="at least two rocking structures without tendons"):
        screen_stage(
            stored(site(2), tmp_path),
            tmp_path / "screen.nc",
            ScreenOptions(pooled=True),
            structures_path=where,
        )
