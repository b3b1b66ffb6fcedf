"""Target spectra: correlations as published, conditional spectra as normal distributions, files."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import SHARED

from rockframe.errors import InputError, ParameterError
from rockframe.risk import Site
from rockframe.selection.target import correlation, read_target
from rockframe.units import GRAVITY

#: Correlations that Baker's own program prints (tests of OpenQuake's hazardlib).
PRINTED = {
    (0.1, 0.5): 0.4745240873,
    (0.15, 0.5): 0.5734688765,
    (0.05, 0.15): 0.9153049738,
    (0.05, 0.1): 0.9421213925,
}
MODEL = "period_s,sa_g,sigma_ln_sa\n0.1,0.8,0.7\n0.5,0.5,0.6\n1,0.3,0.65\n2,0.1,0.75\n"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.csv"
    path.write_text(MODEL, encoding="utf-8")
    return path


def test_correlations_are_those_of_the_authors_program() -> None:
    for (first, other), expected in PRINTED.items():
        assert_allclose(correlation([first, other], [first, other])[0, 1], expected, rtol=1e-9)


def test_correlations_are_symmetric_and_one_for_equal_periods() -> None:
    periods = np.geomspace(0.01, 10.0, 40)
    matrix = correlation(periods, periods)
    assert_allclose(matrix, matrix.T, rtol=0.0, atol=0.0)
    assert_allclose(np.diag(matrix), 1.0, rtol=1e-12)
    assert matrix.min() > 0.0


def test_periods_without_published_correlations_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"^Invalid period 12 s\. Must be from 0.01 to 10 s"):
        correlation([1.0, 12.0], [1.0])


def test_a_conditional_spectrum_is_the_given_normal_distribution(model: Path) -> None:
    """The covariance of some components, given the others, is the inverse of their part of the
    inverse covariance; the mean follows from the same part.
    """
    free = read_target(model)
    given = read_target(model, given=(0.5, 0.9 * GRAVITY))
    assert free.covariance is not None
    assert given.covariance is not None
    rest = np.array([0, 2, 3])
    precision = np.linalg.inv(free.covariance)
    within = np.linalg.inv(precision[np.ix_(rest, rest)])
    away = np.log(0.9 / 0.5)
    assert_allclose(given.covariance[np.ix_(rest, rest)], within, rtol=1e-9)
    shift = -within @ precision[rest, 1] * away
    assert_allclose(given.log_sa[rest] - free.log_sa[rest], shift, rtol=1e-9)
    assert_allclose(given.epsilon, away / 0.6, rtol=1e-12)


def test_a_conditional_spectrum_has_no_spread_where_it_is_given(model: Path) -> None:
    """The period is added to the target; its mean there is the given acceleration."""
    target = read_target(model, [0.1, 1.0], (0.7, 0.4 * GRAVITY))
    assert target.period.tolist() == [0.1, 0.7, 1.0]
    assert target.deviation is not None
    assert target.deviation[1] == 0.0
    assert_allclose(np.exp(target.log_sa[1]) / GRAVITY, 0.4, rtol=1e-12)


def test_a_power_law_is_read_exactly_between_its_periods(tmp_path: Path) -> None:
    """Both axes are logarithmic: Sa = 0.2 / T at 0.7 s is 0.2 / 0.7, also stated by its mean."""
    path = tmp_path / "target.csv"
    for text in ("sa_g\n0.5,0.4\n2,0.1\n", f"mean_ln_sa_g\n0.5,{np.log(0.4)}\n2,{np.log(0.1)}\n"):
        path.write_text(f"period_s,{text}", encoding="utf-8")
        target = read_target(path, [0.7])
        assert_allclose(np.exp(target.log_sa) / GRAVITY, 0.2 / 0.7, rtol=1e-12)
        assert target.deviation is None


def test_a_uniform_hazard_spectrum_of_openquake_is_read() -> None:
    """The fifth column after PGA of the nearest site; PGA has no period, and is left out."""
    path = SHARED / "openquake_exports" / "hazard_uhs-mean_1.csv"
    if not path.is_file():
        pytest.skip("no files of OpenQuake beside the repository")
    target = read_target(path, site=Site((-0.1, -0.289)), probability=0.02)
    assert target.period.tolist() == [0.025, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0]
    assert_allclose(np.exp(target.log_sa[4]) / GRAVITY, 7.552432e-01, rtol=1e-12)
    assert "2 % in 50 years, the nearest site, at -0.10071 -0.28913" in target.words


#: First line of a uniform hazard spectrum of OpenQuake.
UHS: Final = '#,,,,,"investigation_time=50.0"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ":1: columns missing. Must be period_s, sa_g or mean_ln_sa_g"),
        ("T,sa_g\n1,1\n2,1\n", ":1: columns T, sa_g. Must be period_s, sa_g or mean_ln_sa_g"),
        ("period_s,sa_g\n1,0.4\n", ": 1 periods. Must be two or more."),
        ("period_s,sa_g\n1,0.4\n0.5,0.4\n", ":3: period_s 0.5 after 1. Must increase."),
        ("period_s,sa_g\n1,0.4\n1,0.3\n", ":3: period_s 1 after 1. Must increase."),
        ("period_s,sa_g\n0,0.4\n1,0.4\n", ":2: period_s 0. Must be above 0."),
        ("period_s,sa_g\n1,392\n2,0.4\n", ":2: sa_g 392. Must be above 0 and at most 50, in g."),
        ("period_s,mean_ln_sa_g\n1,6\n2,0\n", ":2: mean_ln_sa_g 6. Must be at most 3.91, of g."),
        ("period_s,sa_g\n1,x\n2,0.4\n", ":2: sa_g 'x'. Must be a number."),
        (
            "period_s,sa_g,sigma_ln_sa\n1,1,-0.6\n2,1,0.6\n",
            ":2: sigma_ln_sa -0.6. Must be zero or positive.",
        ),
        ("lon,lat,0.1~PGA\n0,0,1\n", ":1: no investigation_time"),
        (UHS + "lon,lat,0.1~PGA\n0,0,1\n", ":3: no SA(T) of probability 0.1. Must be one or more."),
        (UHS + "lon,lat,0.1~SA(0)\n0,0,1\n", ":2: is of SA(0). The period must be above 0 s."),
        (
            UHS + "lon,lat,0.1~SA(1.0)\n0,0,0\n",
            ":3: 0.1~SA(1.0) 0. Its probability is above that of the first intensity level.",
        ),
        (UHS + "lon,lat,0.1~SA(1.0)\n0,0,-1\n", ":3: 0.1~SA(1.0) -1. Must be above 0."),
    ],
)
def test_a_file_that_is_no_target_is_named(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_target(path)
    assert str(error.value).startswith(f"{path}{message}")


def test_a_uniform_spectrum_is_chosen_by_its_probability(tmp_path: Path) -> None:
    path = tmp_path / "hazard_uhs.csv"
    heading = "lon,lat,0.1~PGA,0.1~SA(1.0),0.02~PGA,0.02~SA(1.0)"
    path.write_text(f'#,,,,,"investigation_time=50.0"\n{heading}\n0,0,1,0.2,2,0.4\n')
    assert_allclose(np.exp(read_target(path, probability=0.02).log_sa), 0.4 * GRAVITY)
    for deviation in (None, 0.05):
        with pytest.raises(InputError, match=r"State one of 0.1, 0.02 with --hazard-probability"):
            read_target(path, probability=deviation)


#: A spectrum whose levels end at 0.8 g, as OpenQuake writes it, and its first line.
SATURATED: Final = (
    UHS + "lon,lat,0.1~PGA,0.1~SA(0.1),0.1~SA(0.5),0.1~SA(1.0),0.02~PGA,0.02~SA(0.1),0.02~SA(0.5),"
    "0.02~SA(1.0),0.9~PGA,0.9~SA(0.1),0.9~SA(0.5),0.9~SA(1.0)\n"
    "0,0,0.3,0.8,0.56,0.25,0.4,0.8,0.8,0.53,0.1,0.2,0.1,0\n"
)


@pytest.mark.parametrize(
    ("probability", "periods", "message"),
    [
        (0.1, None, r"0\.1~SA\(0\.1\) 0\.8\. The ordinate at probability 0\.02 is the same\."),
        (0.02, (0.5, 1.0), r"0\.02~SA\(0\.5\) 0\.8\. The largest ordinate is that of several"),
        (0.1, (0.2,), r"0\.1~SA\(0\.1\) 0\.8"),  # it decides what is interpolated
        (0.9, (0.7,), r"0\.9~SA\(1\.0\) 0\. Its probability is above"),
    ],
)
def test_an_ordinate_at_the_end_of_the_levels_is_refused(
    tmp_path: Path, probability: float, periods: tuple[float, ...] | None, message: str
) -> None:
    path = tmp_path / "hazard_uhs.csv"
    path.write_text(SATURATED)
    with pytest.raises(InputError, match=message) as error:
        read_target(path, periods, probability=probability)
    assert "Extend intensity_measure_types_and_levels of the job" in str(error.value)


@pytest.mark.parametrize(
    ("probability", "periods", "expected"),
    [(0.1, (0.5, 1.0), (0.56, 0.25)), (0.02, (1.0,), (0.53,)), (0.9, (0.1, 0.5), (0.2, 0.1))],
)
def test_periods_within_the_levels_are_read(
    tmp_path: Path, probability: float, periods: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    path = tmp_path / "hazard_uhs.csv"
    path.write_text(SATURATED)
    target = read_target(path, periods, probability=probability)
    assert_allclose(np.exp(target.log_sa) / GRAVITY, expected)


@pytest.mark.skipif(not SHARED.is_dir(), reason="no files of OpenQuake beside the repository")
def test_no_site_of_a_real_export_seems_to_end_at_its_levels() -> None:
    """624 sites at two probabilities; and a job before and after its levels were extended."""
    folder = SHARED / "reports" / "hazard"
    with pytest.raises(InputError, match="is the last intensity level of the job"):
        read_target(folder / "saturated_uhs.csv", probability=0.02)
    longer = read_target(folder / "same_job_with_more_levels_uhs.csv", probability=0.02)
    assert_allclose(np.exp(longer.log_sa[0]) / GRAVITY, 2.885112)
    path = SHARED / "openquake_exports" / "hazard_uhs-mean_1.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()[2:]]
    assert len(rows) == 624
    for lon, lat, *_ in rows[::26]:  # reading takes a while
        for probability in (0.1, 0.02):
            read_target(path, site=Site((float(lon), float(lat))), probability=probability)


def test_a_target_must_cover_the_periods(model: Path) -> None:
    with pytest.raises(InputError, match=r"covers periods from 0\.1 to 2 s, not 3 s"):
        read_target(model, [1.0, 3.0])


def test_only_a_model_with_a_spread_can_be_conditional(tmp_path: Path, model: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text("period_s,sa_g\n0.5,0.4\n2,0.1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"no column sigma_ln_sa\. A conditional spectrum needs"):
        read_target(path, given=(1.0, 1.0))
    model.write_text(MODEL.replace("0.6\n", "0\n"), encoding="utf-8")
    with pytest.raises(InputError, match=r"sigma_ln_sa 0 at 0\.5 s\. Must be above 0"):
        read_target(model, given=(0.5, 1.0))


def test_a_file_without_sites_takes_none(model: Path) -> None:
    with pytest.raises(InputError, match="has no sites and probabilities to choose from"):
        read_target(model, site=Site((0.0, 0.0)))
