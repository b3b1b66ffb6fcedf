"""Fragilities for OpenQuake, oq-vmtk and Pelicun: rules of the formats, and the curves fitted."""

from __future__ import annotations

import csv
import importlib
import math
import re
import shutil
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.special import expit, ndtr
from tests.screening import site, stored, structures

from rockframe.cli.main import main
from rockframe.errors import InputError, ParameterError
from rockframe.figures.fragility import draw_fragility
from rockframe.options.respond import ExportOptions, ScreenOptions
from rockframe.report.page import _fragility
from rockframe.results.fragility_models import (
    as_nrml,
    export_fragility,
    fragility_model,
    pelicun_rows,
)
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import fragility_rows, rate_rows
from rockframe.risk import Outcome
from rockframe.stages.screen import screen_stage

#: Limit states of the stout frame that are fitted.
STATES = ("overturning", "peak_rotation_ratio_0.25")


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("screen")
    options = ScreenOptions(
        scales=tuple(np.geomspace(0.5, 3.0, 5)),
        margins="none",
        spectral_periods_s=(1.0,),
        limit_peak_rotation_ratio=(0.25, 0.5),
        limit_peak_u_m=(0.1,),
        scenario_members=1,
    )
    hazard = folder / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.02,0.1\n0.2,0.01\n2,0.0001\n")
    options = options.model_copy(update={"hazard": hazard})
    screen_stage(
        stored(site(14), folder),
        folder / "screen.nc",
        structures_path=structures(folder),
        options=options,
    )
    return folder / "screen.nc"


@pytest.fixture
def screening(screen: Path) -> xr.Dataset:
    return read_screening(screen, every_scale=False)


def stated(**options: Any) -> ExportOptions:
    return ExportOptions(**{"structure": "stout", "limit_state": STATES, **options})


def numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def test_the_rules_of_nrml(screening: xr.Dataset) -> None:
    """A function for each taxonomy: levels rise, and each limit state has a probability at each."""
    text = as_nrml(fragility_model(screening, stated(taxonomy=("CR/LFM+CIP",))))
    assert '<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">' in text
    assert "<limitStates>peak_rotation_ratio_0_25 overturning</limitStates>" in text
    assert re.findall(r'<fragilityFunction id="([^"]*)" format="(\w+)">', text) == [
        ("CR/LFM+CIP", "discrete")
    ]
    [(imt, levels)] = re.findall(r'<imls imt="([^"]*)">([^<]*)</imls>', text)
    poes = dict(re.findall(r'<poes ls="([^"]*)">([^<]*)</poes>', text))
    assert imt == "PGA"
    assert (np.diff(numbers(levels)) > 0.0).all()
    assert list(poes) == ["peak_rotation_ratio_0_25", "overturning"]
    for values in map(numbers, poes.values()):
        assert len(values) == len(numbers(levels)) == 40
        assert (np.diff(values) >= 0.0).all()
        assert 0.0 <= values[0] <= values[-1] <= 1.0


def test_probabilities_are_those_of_the_fitted_curves(screening: xr.Dataset) -> None:
    """The levels end at the intensities that were tried: nothing is extrapolated."""
    model = fragility_model(screening, stated(levels=200))
    fit = screening.sel(structure="stout", measure="pga", limit_state="overturning")
    median, beta = float(fit["fragility_median"]) / 9.81, float(fit["fragility_lognormal_beta"])
    assert_allclose(
        model.levels[0, [0, -1]] * 9.81, [fit["fragility_lowest"], fit["fragility_highest"]]
    )
    expected = ndtr(np.log(model.levels[0] / median) / beta)
    assert_allclose(model.probability[0, 1], expected, rtol=1e-12)
    assert np.interp(median, model.levels[0], model.probability[0, 1]) == pytest.approx(
        0.5, abs=0.01
    )


def test_a_milder_state_is_at_least_as_likely(screening: xr.Dataset) -> None:
    """A curve with a wide spread crosses a steeper one; damage states would be negative there."""
    beta = screening["fragility_lognormal_beta"].copy()
    beta.loc[{"limit_state": "overturning"}] = 2.0
    crossed = screening.assign(fragility_lognormal_beta=beta)
    model = fragility_model(crossed, stated())
    mild, severe = model.probability[0]
    assert (mild >= severe).all()
    assert severe[0] > 0.01
    assert mild[0] == severe[0]


def test_units_of_openquake(screening: xr.Dataset) -> None:
    """PGV is in cm/s there, and spectral accelerations are in g."""
    velocity = fragility_model(screening, stated(measure="pgv"))
    assert velocity.imt == "PGV"
    fit = screening.sel(structure="stout", limit_state="overturning")
    assert_allclose(velocity.levels[0, 0], 100.0 * fit["fragility_lowest"].sel(measure="pgv"))
    assert fragility_model(screening, stated(measure="sa_1s")).imt == "SA(1)"


def test_logistic_curves_keep_their_form(screening: xr.Dataset) -> None:
    """P = 1 / (1 + exp(-ln(x / m) / s)) with s = sqrt(3) beta / pi."""
    logistic = screening.assign(fragility_curve="logistic")
    model = fragility_model(logistic, stated())
    scale = np.sqrt(3.0) * model.beta[0, 1] / np.pi
    expected = expit(np.log(model.levels[0] / model.median[0, 1]) / scale)
    assert_allclose(model.probability[0, 1], expected)


def test_each_structure_has_its_taxonomy(screening: xr.Dataset) -> None:
    options = ExportOptions(limit_state=("overturning",), taxonomy=("slender=B/1",))
    assert fragility_model(screening, options).taxonomies == ("stout", "B/1")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"measure": "a_p"}, "measure 'a_p'"),
        ({"measure": "pgd"}, "measure 'pgd'"),
        ({"structure": "tall"}, "structure 'tall'"),
        ({"limit_state": ("falling",)}, "limit state 'falling'"),
        ({"limit_state": None}, r"limit states of 2 quantities \(peak_rotation_ratio, peak_u\)"),
        ({"structure": "slender"}, r"No curve of 'slender', .*Choose others with --structure"),
        ({"structure": None, "limit_state": ("overturning",), "taxonomy": ("A",)}, "STRUCTURE=TAX"),
        ({"taxonomy": ("a#b",)}, r"Invalid taxonomy 'a#b'\. Must be at most 100 ASCII characters"),
        ({"taxonomy": ("x" * 101,)}, "Invalid taxonomy"),
    ],
)
def test_what_cannot_be_exported_is_one_line(
    screening: xr.Dataset, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ParameterError, match=message) as caught:
        fragility_model(screening, stated(**options))
    assert "\n" not in str(caught.value)


def test_the_command_writes_three_files(
    screen: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--structure", "stout", "--limit-state", *STATES, "--output", str(tmp_path / "f.xml"))
    assert main(["export", str(screen), *words]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert re.fullmatch(
        r"stout: PGA from \S+ to \S+, 40 levels; peak_rotation_ratio_0_25, \w+", first
    )
    with (tmp_path / "f-curves.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["taxonomy", "imt", "iml", "peak_rotation_ratio_0_25", "overturning"]
    assert len(rows) == 40
    assert (tmp_path / "f-pelicun.csv").exists()


@pytest.fixture
def undetermined(screen: Path, tmp_path: Path) -> Path:
    """Return a file with a curve whose median is beyond all PGA tried."""
    path = tmp_path / "undetermined.nc"
    shutil.copy(screen, path)
    with netCDF4.Dataset(path, "a") as file:
        outcome = file["fragility_outcome"]
        names = [list(file[name][:]) for name in ("structure", "limit_state", "measure")]
        at = names[0].index("stout"), names[1].index("overturning"), names[2].index("pga")
        assert outcome[at] == Outcome.FITTED
        outcome[at] = Outcome.UNDETERMINED
        file["fragility_median"][at] = 8.0 * file["fragility_highest"][at]
    return path


def test_a_curve_that_is_not_determined_is_exported_on_request_with_a_note(
    undetermined: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(undetermined), "--structure", "stout", "--limit-state", *STATES]
    words += ["--output", str(tmp_path / "f.xml")]
    assert main(words) == 2
    (refusal,) = capsys.readouterr().err.splitlines()
    assert "No curve of 'stout', overturning: not determined by these data: the fit" in refusal
    assert refusal.endswith("or export it with --undetermined.")
    assert not (tmp_path / "f.xml").exists()
    assert main([*words, "--undetermined"]) == 0
    note = "overturning: not determined by these data: the fit has its median at "
    assert f"stout, {note}" in capsys.readouterr().out
    for name in ("f.xml", "f-curves.csv", "f-pelicun.csv"):
        assert note in (tmp_path / name).read_text(encoding="utf-8"), name
    assert "peak_rotation_ratio_0_25: not" not in (tmp_path / "f.xml").read_text(encoding="utf-8")


def test_a_curve_that_is_not_determined_is_said_to_be_so(undetermined: Path) -> None:
    """In tables, rates, figure and page; its median and spread are in none of them."""
    found = read_screening(undetermined, every_scale=False)
    at = {"structure": "stout", "measure": "pga", "limit_state": "overturning"}
    rows = [row for row in fragility_rows(found) if at.items() <= row.items()]
    assert [row["outcome"] for row in rows] == ["undetermined"]
    assert rows[0]["note"].startswith("not determined by these data: ")
    assert all(math.isnan(rows[0][name]) for name in ("median", "lognormal_beta", "median_high"))
    (rate,) = (row for row in rate_rows(found) if at.items() <= row.items())
    assert rate["note"].startswith("its fragility is not determined by these data")
    assert rate["rate_per_year"] > 0.0
    one = found.sel(structure="stout")
    drawn = draw_fragility(one)
    (panel, *_) = [axes for axes in drawn.figure.axes if axes.get_visible()]
    assert panel.get_title("left") == "not determined by these data"
    assert not [line for line in panel.get_lines() if line.get_linestyle() == "-"]
    assert "PGA: not determined by these data: the fit has its median" in drawn.caption
    (_, (plot, *_)), *_ = _fragility(one)
    assert plot.title == "PGA [g], not determined by these data"
    assert [path for name, path in plot.curves if name == "overturning"] == [""]
    assert plot.median is None


def test_an_input_is_not_replaced(screen: Path) -> None:
    with pytest.raises(InputError, match="is an input of this command"):
        export_fragility(screen, screen, stated())


def test_the_table_of_pelicun(screening: xr.Dataset) -> None:
    """Its lognormal limit states have the median in the unit of the demand, and beta."""
    model = fragility_model(screening, stated(measure="sa_1s"))
    [row] = pelicun_rows(model)
    assert (row["ID"], row["Demand-Type"], row["Demand-Unit"]) == (
        "stout", "Peak Spectral Acceleration|1", "g",
    )  # fmt: skip
    fit = screening.sel(structure="stout", measure="sa_1s", limit_state="overturning")
    assert row["LS2-Theta_0"] == pytest.approx(float(fit["fragility_median"]) / 9.81)
    assert row["LS2-Theta_1"] == pytest.approx(float(fit["fragility_lognormal_beta"]))


def test_openquake_reads_it(screen: Path, tmp_path: Path) -> None:
    """Its own reader returns the numbers, zero at zero, and the last probability above."""
    pytest.importorskip("openquake.risklib.read_nrml")
    nrml = importlib.import_module("openquake.hazardlib.nrml")
    importlib.import_module("openquake.risklib.read_nrml").update_validators()
    model, paths = export_fragility(screen, tmp_path / "f.xml", stated())
    read = nrml.to_python(str(paths["nrml"]))
    [functions] = read.values()
    assert read.limitStates == list(model.states)
    assert_allclose(functions.array, model.probability[0], atol=1e-8)
    built = functions.build(read.limitStates, 20, 3)
    assert [float(one(np.array([1e9]))[0]) for one in built] == pytest.approx(
        model.probability[0, :, -1].tolist()
    )
