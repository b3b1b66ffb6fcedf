"""Hazard curves in the formats of OpenQuake and the USGS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import SHARED

from rockframe.errors import InputError, ParameterError
from rockframe.risk import LognormalFragility, Site, overturning_rate, read_hazard
from rockframe.selection.target import read_target
from rockframe.units import GRAVITY

SAMPLE = SHARED / "catalogues" / "openquake_hazard_curve-mean-PGA.csv"
EXPORTS = SHARED / "openquake_exports"
REPORTS = SHARED / "reports" / "hazard"
needs_sample = pytest.mark.skipif(not SAMPLE.exists(), reason="the sample is not here")


def openquake(
    path: Path,
    levels: Sequence[float],
    sites: Sequence[tuple[float, float, Sequence[float]]],
    imt: str = "PGA",
    years: float = 50.0,
) -> Path:
    """Write a file as OpenQuake 3.x does; return its path."""
    heading = f"kind='mean', investigation_time={years}, imt='{imt}'"
    lines = [f"#{',' * (len(levels) + 2)}\"generated_by='OpenQuake engine 3.16.0', {heading}\""]
    lines.append(",".join(["lon", "lat", "depth", *(f"poe-{level:.7f}" for level in levels)]))
    for lon, lat, values in sites:
        cells = ",".join(f"{value:.6E}" for value in values)
        lines.append(f"{lon:.5f},{lat:.5f},0.00000,{cells}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_lognormal_fragility_under_a_power_law_has_a_closed_form(tmp_path: Path) -> None:
    """int P d(k x^-a) = k m^-a exp(a^2 beta^2 / 2); rate r gives poe 1 - exp(-r t) in t years."""
    k, a, median, beta, years = 1e-3, 2.0, 0.6, 0.35, 50.0
    levels = np.round(np.geomspace(0.03, 30.0, 31), 7)
    poe = (-np.expm1(-k * levels**-a * years)).tolist()
    curve = read_hazard(
        openquake(tmp_path / "curve.csv", levels.tolist(), [(10.0, 40.0, poe)], years=years)
    )
    rate = overturning_rate(curve, LognormalFragility(median * GRAVITY, beta))
    expected = k * median**-a * math.exp(0.5 * (a * beta) ** 2)
    assert_allclose(rate.rate, expected, rtol=1e-6)
    assert_allclose(rate.low, rate.rate, rtol=1e-12)


def test_folders_and_files_without_what_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no hazard curves of OpenQuake in the folder"):
        read_hazard(tmp_path)
    path = openquake(tmp_path / "curve.csv", [0.1, 0.2], [(10.0, 40.0, [0.2, 0.1])])
    with pytest.raises(InputError, match="names no sites"):
        read_hazard(path, Site(name="Haifa"))


@pytest.mark.parametrize("value", [-0.1, 0.0, math.inf, math.nan])
def test_median_and_beta_of_a_lognormal_fragility_are_positive(value: float) -> None:
    """With a negative beta a frame would stand better the stronger the motion."""
    with pytest.raises(ParameterError, match=f"Invalid median {value}"):
        LognormalFragility(value, 0.4)
    with pytest.raises(ParameterError, match=f"Invalid beta {value}"):
        LognormalFragility(2.0, value)


@needs_sample
def test_sample_of_openquake() -> None:
    """The file has probabilities in one year: the first four are equal, and 0 is at most 5e-7."""
    curve = read_hazard(SAMPLE, (-65.1349, 0.0))
    assert curve.measure == "pga"
    assert_allclose(curve.intensity[[0, -2]], [0.01 * GRAVITY, 0.4641589 * GRAVITY])
    expected = -np.log1p([-1.591452e-2, -1.812691e-4, -5e-7])
    assert_allclose(curve.rate[[0, -2, -1]], expected, rtol=1e-12)
    assert read_hazard(SAMPLE, (-64.5, 0.505)).intensity[-2] == pytest.approx(0.1 * GRAVITY)


@needs_sample
@pytest.mark.parametrize(
    ("site", "message"),
    [
        (None, "has 5 sites. Choose one with --hazard-site LON LAT"),
        (
            (-64.5, 0.6),
            r"nearest to -64.5 0.6 is 11.1 km away, at -64.5 0.5. Must be within 10 km",
        ),
        ((-63.0, 2.0), ":5: 0 different rates at this site. Must be two or more"),
    ],
)
def test_site_that_has_no_curve(site: tuple[float, float] | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_hazard(SAMPLE, site)


@pytest.mark.parametrize(
    ("imt", "measure", "unit"),
    [("PGV", "pgv", 0.01), ("SA(0.5)", "sa_0.5s", GRAVITY), ("SA(1.0)", "sa_1s", GRAVITY)],
)
def test_measures_of_openquake(tmp_path: Path, imt: str, measure: str, unit: float) -> None:
    file = openquake(tmp_path / "c.csv", [1.0, 2.0], [(0.0, 0.0, [1e-3, 1e-4])], imt)
    curve = read_hazard(file)
    assert curve.measure == measure
    assert_allclose(curve.intensity, [unit, 2.0 * unit])


@pytest.mark.parametrize(
    ("imt", "poe", "message"),
    [
        ("CAV", [0.1, 0.01], ":1: is of imt 'CAV'. Must be PGA, PGV or SA"),
        ("PGA", [1.1, 0.01], ":3: probability 1.1. Must be from 0 to 1"),
        ("PGA", [0.01, 0.1], ":3: annual_rate .* after .*. Must be smaller"),
        ("SA(0)", [0.1, 0.01], "period must be above 0 s"),
    ],
)
def test_damaged_files_of_openquake(
    tmp_path: Path, imt: str, poe: list[float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_hazard(openquake(tmp_path / "c.csv", [0.3, 0.5], [(0.0, 0.0, poe)], imt))


def test_printed_ends_have_the_rate_that_their_digits_leave(tmp_path: Path) -> None:
    """1.000000 is at least 0.9999995, and 0.000000 at most 0.0000005."""
    levels, poe = [0.005, 0.01, 0.1, 0.2, 0.4, 0.8], [1.0, 1.0, 0.5, 0.1, 0.0, 0.0]
    curve = read_hazard(openquake(tmp_path / "c.csv", levels, [(0.0, 0.0, poe)]))
    assert_allclose(curve.intensity / GRAVITY, levels[1:5])
    expected = [-math.log(5e-7), math.log(2.0), -math.log(0.9), 5e-7]
    assert_allclose(curve.rate, np.array(expected) / 50.0, rtol=1e-6)
    assert curve.note == (
        "probability 1 up to 0.01 g: 0.29 a year is used there, the least that the printed digits "
        "leave; probability 0 from 0.4 g: 1e-08 a year is used there, the most that the printed "
        "digits leave"
    )


def test_an_end_beyond_its_neighbour_is_left_out_with_what_that_changes(tmp_path: Path) -> None:
    """0.9999998 is above what 1.000000 leaves; so is 1e-7 below what 0.000000 leaves."""
    poe = [1.0, 0.9999998, 0.1, 1e-7, 0.0]
    file = openquake(tmp_path / "c.csv", [0.01, 0.02, 0.2, 0.4, 0.8], [(0.0, 0.0, poe)])
    file.write_text(
        file.read_text().replace("1.000000E+00,1.000000E+00", "1.000000E+00,9.999998E-01")
    )
    curve = read_hazard(file)
    assert_allclose(curve.intensity / GRAVITY, [0.02, 0.2, 0.4])
    assert curve.note == (
        "probability 1 up to 0.01 g: left out, because the printed digits leave a probability not "
        "above that at 0.02 g; motions below 0.02 g are not counted; probability 0 from 0.8 g: "
        "left out, because the printed digits leave a probability not below that at 0.4 g; motions "
        "above 0.4 g count as 0.4 g"
    )


@pytest.mark.parametrize(("median", "beta"), [(0.25, 0.15), (0.9, 0.15)])
def test_printed_ends_hardly_change_a_rate_of_closed_form(
    tmp_path: Path, median: float, beta: float
) -> None:
    """Rates 3.1e-5 x^-4 print as P = 1 at 0.1 g, and as 0 at 7.5 g. Without these points the rate
    lacks all weaker motions, or counts all stronger ones as equal to the last point.
    """
    levels = [0.1, 0.35, 0.7, 1.4, 7.5] if median < 0.5 else [0.4, 0.8, 7.5]
    poe = [round(-math.expm1(-3.1e-5 * level**-4.0 * 50.0), 6) for level in levels]
    assert (poe[0] == 1.0) == (median < 0.5)
    assert poe[-1] == 0.0
    curve = read_hazard(openquake(tmp_path / "c.csv", levels, [(0.0, 0.0, poe)]))
    rate = overturning_rate(curve, LognormalFragility(median * GRAVITY, beta))
    expected = 3.1e-5 * median**-4.0 * math.exp(0.5 * (4.0 * beta) ** 2)
    assert_allclose(rate.rate, expected, rtol=0.04)


@pytest.mark.skipif(not REPORTS.exists(), reason="the exports are not here")
@pytest.mark.parametrize(("name", "low"), [("h_one.csv", 0.036), ("h_zero.csv", 0.099)])
def test_printed_ends_of_a_real_export_count(name: str, low: float) -> None:
    """Without the points of probability 1 or 0, the rate is lower by this share."""
    whole = read_hazard(REPORTS / name)
    printed = (0 if name == "h_one.csv" else -1,)
    without = replace(
        whole,
        intensity=np.delete(whole.intensity, printed),
        rate=np.delete(whole.rate, printed),
    )
    fragility = LognormalFragility(0.5 * GRAVITY, 0.4)
    rates = [overturning_rate(hazard, fragility).rate for hazard in (without, whole)]
    assert rates[0] / rates[1] < 1.0 - low
    assert whole.note


def test_beyond_its_ends_a_curve_states_no_rate(tmp_path: Path) -> None:
    file = openquake(tmp_path / "c.csv", [0.1, 0.2], [(0.0, 0.0, [0.2, 0.1])])
    rates = read_hazard(file).rate_of(np.array([0.09, 0.1, 0.2, 0.21]) * GRAVITY)
    assert np.isnan(rates).tolist() == [True, False, False, True]


def test_rates_of_the_usgs(tmp_path: Path) -> None:
    """The file has a row of annual rates for each site; its folder is named after the measure."""
    path = tmp_path / "SA1P0" / "total.csv"
    path.parent.mkdir()
    path.write_text(
        "name,lon,lat,0.0025,0.019,0.0427,0.144,5.54\n"
        "Oakland CA,-122.25,37.8,2.8e-03,2.8e-03,2.4e-03,4.6e-04,0.0\n"
        "San Jose CA,-121.9,37.35,2.9e-03,2.0e-03,6.1e-04,4.6e-06,0.0\n"
    )
    curve = read_hazard(path, (-122.251, 37.801))
    assert curve.measure == "sa_1s"
    assert_allclose(curve.intensity / GRAVITY, [0.019, 0.0427, 0.144])
    assert_allclose(curve.rate, [2.8e-3, 2.4e-3, 4.6e-4])
    other = path.rename(tmp_path / "total.csv")
    with pytest.raises(InputError, match="does not state its measure"):
        read_hazard(other, (-121.9, 37.35))


def test_a_curve_of_the_usgs_as_two_columns(tmp_path: Path) -> None:
    path = tmp_path / "hazard_SA0P2.csv"
    path.write_text("Ground Motion (g),Annual Frequency of Exceedence\n0.1,0.01\n1,0.0001\n")
    assert read_hazard(path).measure == "sa_0.2s"


def test_probabilities_under_their_own_name_are_converted(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("sa_0.5s_g,probability_in_50_years\n0.1,0.9\n0.5,0.1\n")
    assert_allclose(read_hazard(path).rate, [-math.log(0.1) / 50.0, -math.log(0.9) / 50.0])


def test_decimal_commas_between_semicolons(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("pgv_m_s;annual_rate\n0,1;1e-2\n1,5;0,0001\n")
    curve = read_hazard(tmp_path / "c.csv")
    assert (curve.intensity.tolist(), curve.rate.tolist()) == ([0.1, 1.5], [1e-2, 1e-4])


def test_a_site_is_refused_where_there_are_none(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("pga_g,annual_rate\n0.1,0.01\n0.5,0.001\n")
    with pytest.raises(InputError, match="has no sites to choose from"):
        read_hazard(path, (0.0, 0.0))


_HEAD = "#,,\"kind='{kind}', investigation_time=50.0, imt='PGA'\"\n"
_SITES = (
    "custom_site_id,lon,lat,depth,poe-0.1,poe-0.5\n"
    "here,23.0,38.0,0.0,{first},0.01\nthere,24.0,38.0,0.0,0.2,0.02\n"
)


def exported(path: Path, kind: str = "mean", first: str = "0.1") -> Path:
    path.write_text(_HEAD.format(kind=kind) + _SITES.format(first=first))
    return path


def test_a_site_is_chosen_by_its_name_or_as_the_nearest(tmp_path: Path) -> None:
    """Both ways lead to the same row; 0.05 degrees of latitude are 5.56 km, of longitude 4.38."""
    path = exported(tmp_path / "curve.csv")
    named, near = read_hazard(path, Site(name="there")), read_hazard(path, (24.0, 38.05))
    assert named.rate.tolist() == near.rate.tolist()
    assert_allclose(named.rate, [-math.log(0.8) / 50, -math.log(0.98) / 50])
    assert named.site == "site there"
    assert near.site == "the nearest site, at 24 38, 5.56 km from the requested place"
    assert read_hazard(path, Site((24.0, 38.05), within=5.56)).site == near.site
    beside = read_hazard(path, (24.05, 38.0)).site
    assert beside == "the nearest site, at 24 38, 4.38 km from the requested place"
    with pytest.raises(InputError, match=r"5\.56 km away, at 24 38\. Must be within 5 km"):
        read_hazard(path, Site((24.0, 38.05), within=5.0))
    with pytest.raises(InputError, match=r"0 sites 'nowhere'\. Must be one of: here, there"):
        read_hazard(path, Site(name="nowhere"))


@pytest.mark.parametrize("column", ["custom_site_id", "site_id", "name"])
def test_sites_are_named_by_the_column_of_their_program(column: str, tmp_path: Path) -> None:
    text = exported(tmp_path / "curve.csv").read_text()
    (tmp_path / "curve.csv").write_text(text.replace("custom_site_id", column))
    assert read_hazard(tmp_path / "curve.csv", Site(name="there")).site == "site there"


def test_the_curve_of_a_folder_is_chosen_by_its_kind(tmp_path: Path) -> None:
    """The mean is the default; 0.1 and 0.3 tell which of the two files was read."""
    exported(tmp_path / "hazard_curve-mean-PGA_1.csv")
    exported(tmp_path / "hazard_curve-max-PGA_1.csv", "max", "0.3")
    (tmp_path / "realizations_1.csv").write_text("rlz_id,branch_path,weight\n0,A,1.0\n")
    here = Site(name="here")
    assert_allclose(read_hazard(tmp_path, here).rate[0], -math.log(0.9) / 50)
    assert_allclose(read_hazard(tmp_path, here, "max").rate[0], -math.log(0.7) / 50)
    with pytest.raises(
        InputError, match=r"0 hazard curves of kind 'quantile-0\.84'.*mean-PGA_1\.csv"
    ):
        read_hazard(tmp_path, here, "quantile-0.84")
    with pytest.raises(InputError, match=r"of kind 'max'\. Must be 'mean', as stated"):
        read_hazard(tmp_path / "hazard_curve-max-PGA_1.csv", here, "mean")
    exported(tmp_path / "hazard_curve-mean-PGA_2.csv")
    with pytest.raises(InputError, match=r"2 hazard curves of kind 'mean' in the folder\. State"):
        read_hazard(tmp_path, here)


@pytest.mark.parametrize(
    ("columns", "contents"),
    [
        ("lon,lat,0.100000~PGA,0.100000~SA(0.1)", r"uniform hazard spectra \(hazard_uhs\)"),
        ("lon,lat,PGA-0.1,SA(0.1)-0.1", r"hazard maps \(hazard_map\)"),
        ("imt,iml,poe,mag,dist,mean", "a disaggregation"),
        ("event_id,gmv_PGA,custom_site_id", r"ground-motion fields \(gmf-data\).*_from_gmfs"),
        ("lon,lat,PGA,PGV,SA(0.1)", r"hazard maps \(hazard_map\)"),
        ("lon,lat,depth,SA(0.1)", r"hazard maps \(hazard_map\)"),
        ("site_id,lon,lat,gmv_PGA,gsd_PGA", r"mean ground-motion fields \(avg_gmf\).*_from_gmfs"),
        ("custom_site_id,lon,lat,PGA", r"mean ground-motion fields \(avg_gmf\).*_from_gmfs"),
    ],
)
def test_other_files_of_openquake_are_named_with_what_to_export(
    tmp_path: Path, columns: str, contents: str
) -> None:
    path = tmp_path / "file.csv"
    path.write_text("#,,\"generated_by='OpenQuake engine 3.26.2'\"\n" + columns + "\n1,2,3,4\n")
    with pytest.raises(InputError, match=f":2: contains {contents}.*") as caught:
        read_hazard(path, (23.0, 38.0))
    assert "Export the hazard curves of the same calculation" in str(caught.value)
    assert ("_from_gmfs" in str(caught.value)) == ("fields" in contents)
    if "spectra" not in contents:
        with pytest.raises(InputError, match=r":2: contains .* Export the uniform hazard spectra"):
            read_target(path)


def test_a_map_of_named_sites_is_recognised_by_its_file(tmp_path: Path) -> None:
    path = tmp_path / "hazard_map-mean-475y_3.csv"
    path.write_text("#,,\"generated_by='OpenQuake engine 3.26.2'\"\ncustom_site_id,lon,lat,PGA\n")
    with pytest.raises(InputError, match=r":2: contains hazard maps \(hazard_map\)"):
        read_hazard(path)


@pytest.mark.skipif(not EXPORTS.exists(), reason="the exports are not here")
def test_real_exports_are_read_or_named() -> None:
    """Five curves, and six files of other kinds, of four demonstrations."""
    said = {}
    for path in sorted(EXPORTS.glob("*.csv")):
        try:
            said[path.name] = read_hazard(path, (0.5, -0.5)).measure
        except InputError as error:
            said[path.name] = error.reason.split(". ")[0]
    assert sorted(said.values()) == [
        "contains a disaggregation",
        "contains ground-motion fields (gmf-data)",
        "contains hazard maps (hazard_map)",
        "contains hazard maps (hazard_map)",
        "contains mean ground-motion fields (avg_gmf)",
        "contains uniform hazard spectra (hazard_uhs)",
        *["pga"] * 4,
        "sa_1s",
    ]
