"""Hazard curves in NRML, in JSON of the USGS, and by the user's words: one curve in each."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe.errors import InputError, ParameterError
from rockframe.options.respond import ScreenOptions
from rockframe.risk import HazardCurve, Site, read_hazard
from rockframe.units import GRAVITY

LEVELS = np.array([0.1, 0.2, 0.4, 0.8])
RATES = np.array([0.01, 0.004, 0.0009, 0.0001])
NRML = """<?xml version="1.0" encoding="utf-8"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.5" xmlns:gml="http://www.opengis.net/gml">
  <hazardCurves IMT="SA" saPeriod="1.0" saDamping="5.0" investigationTime="50.0" statistics="mean">
    <IMLs> {levels} </IMLs>
    <hazardCurve><gml:Point><gml:pos>23.73 37.98</gml:pos></gml:Point>
      <poEs>{poes}</poEs></hazardCurve>
    <hazardCurve><gml:Point><gml:pos>22.0 40.0</gml:pos></gml:Point>
      <poEs>0.9 0.5 0.1 0.01</poEs></hazardCurve>
  </hazardCurves>
</nrml>
"""
POES = [float(f"{poe:.9e}") for poe in -np.expm1(-50.0 * RATES)]


def nrml() -> str:
    levels, poes = (" ".join(map(repr, values)) for values in (LEVELS.tolist(), POES))
    return NRML.format(levels=levels, poes=poes)


def today(**others: Any) -> str:
    """Return an answer of the web service of today, with PGA beside the curve."""
    total = {"component": "Total", "values": {"xs": LEVELS.tolist(), "ys": RATES.tolist()}}
    grid = {"component": "Grid", "values": {"xs": LEVELS.tolist(), "ys": (RATES / 2).tolist()}}
    curves = [
        {"imt": {"display": "1.0 s", "value": "SA1P0"}, "data": [grid, total]},
        {"imt": {"value": "PGA"}, "data": [{"component": "Total", "values": {"xs": [0.1, 0.2],
                                                                             "ys": [0.1, 0.01]}}]},
    ]  # fmt: skip
    return json.dumps({"status": "success", "response": {"hazardCurves": curves, **others}})


def former() -> str:
    """Return an answer of nshmp-haz-ws."""
    metadata = {"imt": {"value": "SA1P0"}, "xvalues": LEVELS.tolist()}
    data = [{"component": "Total", "yvalues": RATES.tolist()}]
    return json.dumps({"response": [{"metadata": metadata, "data": data}]})


def table(separator: str, mark: str = ".", scale: float = 1.0, periods: bool = False) -> str:
    """Return a report's table, with a title and a column that is not needed."""
    rows = [("Nr", "Sa [g]", "TR" if periods else "Rate")]
    for k, (x, rate) in enumerate(zip(LEVELS, RATES, strict=True)):
        often = 1.0 / rate if periods else rate
        rows.append(
            (str(k), f"{scale * x:.6g}".replace(".", mark), f"{often:.10g}".replace(".", mark))
        )
    return "Hazard of the site, 2024\n\n" + "\n".join(map(separator.join, rows)) + "\n"


def read(folder: Path, text: str, site: Any = None, **options: Any) -> HazardCurve:
    path = folder / "curve.dat"
    path.write_text(text, encoding="utf-8")
    return read_hazard(path, site, **options)


RATE, PERIOD = ("sa_1s_g=Sa [g]", "annual_rate=Rate"), ("return_period_years=TR", "sa_1s_g=sa [g]")


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (nrml(), {"site": (23.7, 38.0)}),
        (nrml(), {"site": Site((23.7, 38.0)), "measure": "sa_1s"}),
        (today(), {"measure": "sa_1s"}),
        (former(), {}),
        (table(","), {"columns": RATE}),
        (table(";", ","), {"columns": RATE}),
        (table("\t"), {"columns": RATE}),
        (table(",", periods=True), {"columns": PERIOD}),
        (table(",", scale=9.81), {"columns": ("sa_1s_m_s2=Sa [g]", "annual_rate=Rate")}),
        (table(",", scale=981.0), {"columns": ("sa_1s_cm_s2=Sa [g]", "annual_rate=Rate")}),
        (table(",", scale=100.0), {"columns": ("sa_1s_percent_g=Sa [g]", "annual_rate=Rate")}),
        (table("  ").replace("Sa [g]", "Sa"), {"columns": ("sa_1s_g=2", "annual_rate=3")}),
        ("\n".join(table(",").splitlines()[3:]), {"columns": ("sa_1s_g=2", "annual_rate=3")}),
    ],
)
def test_one_curve_in_every_format(tmp_path: Path, text: str, options: dict[str, Any]) -> None:
    curve = read(tmp_path, text, **options)
    assert curve.measure == "sa_1s"
    assert_allclose(curve.intensity, LEVELS * GRAVITY, rtol=1e-9)
    assert_allclose(curve.rate, RATES, rtol=1e-7)


def test_probabilities_of_a_table_become_rates(tmp_path: Path) -> None:
    text = "PGV;P50\n" + "".join(f"{100 * x};{p}\n" for x, p in zip(LEVELS, POES, strict=True))
    curve = read(tmp_path, text, columns=("pgv_cm_s=PGV", "probability_in_50_years=P50"))
    assert curve.measure == "pgv"
    assert_allclose(curve.intensity, LEVELS, rtol=1e-9)
    assert_allclose(curve.rate, RATES, rtol=1e-7)


def test_a_curve_may_be_stated_to_be_of_both_horizontals(tmp_path: Path) -> None:
    assert read(tmp_path, former(), measure="sa_1s_rotd50").measure == "sa_1s_rotd50"
    assert read(tmp_path, former(), measure="sa_1.0s").measure == "sa_1s"
    text = "pga_g,annual_rate\n0.1,0.01\n0.2,0.001\n"
    assert read(tmp_path, text, measure="pga_rotd100").measure == "pga_rotd100"


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (nrml(), {}, "has 2 sites. Choose one with --hazard-site LON LAT"),
        (nrml(), {"site": (0.0, 0.0)}, "the site nearest to 0 0 is"),
        (
            nrml().replace("50.0", "none"),
            {"site": (22.0, 40.0)},
            "investigationTime 'none'. Must be",
        ),
        (nrml().replace("0.9 0.5", "0.5"), {}, "2 hazard curves of 4 IMLs. Must have a place and"),
        (nrml().replace("hazardCurves", "uniformHazardSpectra"), {}, "no hazardCurves. Must be"),
        (nrml()[:300], {}, "is no XML"),
        ("<!DOCTYPE a><nrml/>", {}, "XML with a document type"),
        (
            nrml(),
            {"site": (22.0, 40.0), "measure": "pga"},
            "no curve of 'pga'. Must be one of: sa_1s",
        ),
        (today(), {}, "has curves of sa_1s, pga. State one with --hazard-measure."),
        (today(), {"measure": "sa_2s"}, "no curve of 'sa_2s'. Must be one of: sa_1s, pga."),
        (
            today(hazardCurves=[]),
            {},
            "no response.hazardCurves. Must be hazard curves of the USGS.",
        ),
        ("{", {}, "is no JSON"),
        (former(), {"site": (0.0, 0.0)}, "has no sites to choose from"),
        (former().replace("0.8]", "NaN]"), {}, "is no JSON|without imt, xs and ys"),
        (former().replace("0.0001]", "0.0001, 0.00001]"), {}, "4 ground motions and 5 frequencies"),
        (
            today().replace('"PGA"', '"SA1P0"'),
            {},
            "several curves of sa_1s. Must be one of each meas",
        ),
        (
            former().replace("[{", "[" + former()[14:-2] + ", {", 1),
            {},
            "several curves of sa_1s. Must be one of each measure",
        ),
        (today().replace('"Grid"', '"Total"'), {}, "without imt, xs and ys of its total"),
        (
            nrml().replace(
                "<hazardCurves", nrml()[nrml().index("<hazardCurves") : -8] + "<hazardCurves"
            ),
            {"site": (22.0, 40.0)},
            "several hazardCurves of sa_1s. Must be one of each measure",
        ),
        (former().replace("SA1P0", "MMI"), {}, "is of imt 'MMI'. Must be PGA, PGV or SA(T)"),
        (
            table(","),
            {"columns": ("sa_1s_g=Sa", "annual_rate=Rate")},
            "no line with columns 'Sa' and",
        ),
        (
            table(","),
            {"columns": ("sa_1s_g=Sa [g]",)},
            "Must be one measure and one of annual_rate",
        ),
        (
            table(","),
            {"columns": ("sa_1s=Sa [g]", "annual_rate=Rate")},
            "'sa_1s' unknown. Must be on",
        ),
        (table(",") + "end\n", {"columns": RATE}, ":8: 'end'. Must have numbers in columns Sa [g]"),
        ("Sa [g],Rate\n0.1,0.01\n", {"columns": RATE}, "1 rows of numbers. Must be two or more."),
        (
            "Sa [g],TR\n0.1,0\n0.2,9\n",
            {"columns": PERIOD},
            ":2: return period 0. Must be above 0 year",
        ),
        (table(","), {"columns": ("sa_1s_g=0", "annual_rate=3")}, "0 rows of numbers"),
        (
            "pga_g,annual_rate\n0.1,0.01\n0.2,0.001\n",
            {"measure": "pgv"},
            "is a hazard curve of pga.",
        ),
    ],
)
def test_a_file_with_a_fault_is_one_line(
    tmp_path: Path, text: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError) as error:
        read(tmp_path, text, **options)
    assert any(part in str(error.value) for part in message.split("|"))
    assert "\n" not in str(error.value)


def test_words_need_a_hazard_curve() -> None:
    with pytest.raises(ParameterError, match="hazard_columns without hazard"):
        ScreenOptions(hazard_columns=("pga_g=PGA", "annual_rate=Rate"))
