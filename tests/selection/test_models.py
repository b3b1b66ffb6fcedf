"""Ground-motion models with weights: moments of mixtures, disaggregations, and OpenQuake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import SHARED

from rockframe.errors import InputError
from rockframe.selection.models import Mixture, _of_maker
from rockframe.selection.target import correlation, read_target, target_files
from rockframe.units import GRAVITY

PERIODS = np.array([0.2, 0.5, 1.0, 2.0])
MODELS = """[ground_motion_models]
models = { BooreEtAl2014 = 0.6, AkkarEtAlRjb2014 = 0.4 }
magnitude = 6.5
distance_rjb_km = 12.0
rake_degree = 0.0
vs30_m_s = 400.0
"""
DISAGGREGATION = (
    '#,,,,,"investigation_time=50.0"\nimt,iml,poe,mag,dist,mean\n'
    "SA(1.0),0.2,0.1,6.0,10.0,0.02\nSA(1.0),0.2,0.1,7.0,30.0,0.04\nSA(1.0),0.2,0.1,8.0,90.0,0\n"
    "PGA,0.3,0.1,6.0,10.0,0.05\n"
)


def written(folder: Path, text: str = MODELS) -> Path:
    path = folder / "models.toml"
    path.write_text(text, encoding="utf-8")
    return path


def mixture(seed: int = 1, models: int = 2, scenarios: int = 3) -> Mixture:
    rng = np.random.default_rng(seed)
    shape = (models, scenarios, PERIODS.size)
    weight = rng.uniform(0.1, 1.0, shape[:2])
    return Mixture(
        rng.normal(0.0, 0.5, shape), rng.uniform(0.4, 0.8, shape), weight / weight.sum(), ""
    )


def test_moments_are_those_of_samples() -> None:
    """Half a million spectra, each of a model and scenario drawn by its weight."""
    of, matrix, rng = mixture(), correlation(PERIODS, PERIODS), np.random.default_rng(7)
    mean, covariance = of.moments(matrix)
    samples = []
    for (m, s), weight in np.ndenumerate(of.weight):
        within = np.outer(of.deviation[m, s], of.deviation[m, s]) * matrix
        count = round(500_000 * weight)
        samples.append(rng.multivariate_normal(of.mean[m, s], within, count))
    drawn = np.concatenate(samples)
    assert_allclose(drawn.mean(axis=0), mean, atol=5e-3)
    assert_allclose(np.cov(drawn.T), covariance, atol=1e-2)


def test_a_conditional_mixture_is_that_of_the_samples_near_the_condition() -> None:
    """Samples whose ln Sa at 1 s is within 0.02 of the stated one: a model and scenario counts by
    its density there, which the exceedance of a disaggregation is not; so one scenario of one model
    is compared, and the weights in the next test.
    """
    of, matrix = mixture(models=1, scenarios=1), correlation(PERIODS, PERIODS)
    within = np.outer(of.deviation[0, 0], of.deviation[0, 0]) * matrix
    drawn = np.random.default_rng(3).multivariate_normal(of.mean[0, 0], within, 1_000_000)
    log_sa = of.mean[0, 0, 2] + 0.3
    near = drawn[np.abs(drawn[:, 2] - log_sa) < 0.02]
    mean, covariance, epsilon = of.given(2, log_sa, matrix)
    assert_allclose(near.mean(axis=0), mean, atol=0.02)
    assert_allclose(np.cov(near.T), covariance, atol=0.02)
    assert_allclose(epsilon, 0.3 / of.deviation[0, 0, 2], rtol=1e-12)


def test_models_count_by_their_exceedance_within_a_scenario() -> None:
    """Two models of which one never reaches the acceleration: the other one has all the weight."""
    low_and_high = np.stack([np.full((1, 4), -9.0), np.zeros((1, 4))])
    of = Mixture(low_and_high, np.full((2, 1, 4), 0.5), np.array([[0.9], [0.1]]), "")
    matrix = correlation(PERIODS, PERIODS)
    mean, covariance, epsilon = of.given(2, 0.5, matrix)
    alone = Mixture(low_and_high[1:], np.full((1, 1, 4), 0.5), np.ones((1, 1)), "")
    assert_allclose(mean, alone.given(2, 0.5, matrix)[0], rtol=1e-9)
    assert_allclose(covariance, alone.given(2, 0.5, matrix)[1], atol=1e-9)
    assert_allclose(epsilon, 1.0, rtol=1e-9)


def test_equal_models_are_one_model_and_the_condition_has_no_spread() -> None:
    of, matrix = mixture(models=1, scenarios=2), correlation(PERIODS, PERIODS)
    twice = Mixture(
        np.concatenate([of.mean, of.mean]),
        np.concatenate([of.deviation, of.deviation]),
        np.concatenate([0.3 * of.weight, 0.7 * of.weight]),
        "",
    )
    mean, covariance, epsilon = of.given(1, 0.4, matrix)
    again = twice.given(1, 0.4, matrix)
    assert_allclose(again[0], mean, rtol=1e-12)
    assert_allclose(again[1], covariance, atol=1e-12)
    assert_allclose(again[2], epsilon, rtol=1e-12)
    assert_allclose(mean[1], 0.4, rtol=1e-12)
    assert_allclose(covariance[1], 0.0, atol=1e-12)
    assert (np.linalg.eigvalsh(covariance) > -1e-12).all()


@pytest.mark.filterwarnings("ignore")
def test_without_openquake_the_message_says_what_to_install(tmp_path: Path) -> None:
    try:
        import openquake.hazardlib  # noqa: F401
    except ImportError:
        with pytest.raises(InputError, match=r"need OpenQuake \(.*Install openquake-engine"):
            read_target(written(tmp_path))
    else:
        pytest.skip("OpenQuake is installed")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MODELS.replace("magnitude = 6.5", ""), "magnitude and disaggregation are both missing"),
        (MODELS + 'disaggregation = "d.csv"\n', "magnitude and disaggregation are both stated"),
        (MODELS.replace("0.6", "0.0"), "models.BooreEtAl2014 0.0. Must be"),
        (MODELS.replace("models = {", "models = {} #"), "models"),
        (MODELS.replace("vs30_m_s", "vs30"), ":6: unknown key 'ground_motion_models.vs30'"),
        (MODELS.replace("400.0", "-400.0"), "vs30_m_s -400.0. Must be"),
        # a model of OpenQuake would take NaN for some style of faulting, each for another one
        (MODELS.replace("rake_degree = 0.0", "rake_degree = nan"), "rake_degree nan. Must be"),
    ],
)
def test_files_of_models_with_a_fault(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        read_target(written(tmp_path, text))
    assert message in str(error.value)


def of_disaggregation(folder: Path, table: str = DISAGGREGATION) -> Path:
    (folder / "d.csv").write_text(table, encoding="utf-8")
    text = MODELS.replace("magnitude = 6.5", 'disaggregation = "d.csv"\ndepth_to_top_km = 6.0')
    text = text.replace("distance_rjb_km = 12.0", "dip_degree = 90.0")
    return written(folder, text)


def test_a_disaggregation_belongs_to_the_files_of_a_target(tmp_path: Path) -> None:
    """So that its hash is stored, and the selection cannot replace it."""
    path = of_disaggregation(tmp_path)
    assert target_files(path) == [path, tmp_path / "d.csv"]


@pytest.mark.parametrize(
    ("table", "given", "message"),
    [
        (DISAGGREGATION, None, "has 2 levels (SA(1.0) = 0.2 g, PGA = 0.3 g). Must be one, or"),
        (DISAGGREGATION, (1.0, 0.3), "Must be of SA(1) = 0.3 g, on which the spectrum is cond"),
        (DISAGGREGATION, (0.5, 0.2), "Must be of SA(0.5) = 0.2 g, on which"),
        (DISAGGREGATION.replace("0.02\n", "1.5\n"), (1.0, 0.2), "mean 1.5. Must be a probability"),
        (
            DISAGGREGATION.replace("0.02\n", "x\n"),
            (1.0, 0.2),
            ":3: 'SA(1.0), 0.2, 0.1, 6.0, 10.0, x",
        ),
        ("imt,iml,poe,mag,eps,mean\n", None, ":1: columns imt, iml, poe, mag, eps, mean. Must be"),
    ],
)
def test_disaggregations_with_a_fault(
    tmp_path: Path, table: str, given: tuple[float, float] | None, message: str
) -> None:
    condition = None if given is None else (given[0], given[1] * GRAVITY)
    with pytest.raises(InputError) as error:
        read_target(of_disaggregation(tmp_path, table), given=condition)
    assert message in str(error.value)


class Maker:
    """A stand-in for the maker of contexts: ln Sa = magnitude - R_JB / period, in one magnitude."""

    def new_ctx(self, size: int) -> np.recarray:
        return np.recarray(size, [("mag", float), ("rjb", float)])

    def get_mean_stds(self, contexts: list[np.recarray]) -> np.ndarray:
        [context] = contexts
        assert len({*context.mag.tolist()}) == 1
        mean = context.mag - context.rjb / PERIODS[:, None]
        return np.array([mean, 0.1 * context.mag + 0.0 * mean, mean, mean])[:, None]


def test_scenarios_keep_their_order_when_magnitudes_are_taken_together() -> None:
    scenarios = {"mag": np.array([7.0, 6.0, 7.0, 5.0]), "rjb": np.array([1.0, 2.0, 3.0, 4.0])}
    mean, deviation = _of_maker(Maker(), ["mag", "rjb"], scenarios, PERIODS.size)
    expected = scenarios["mag"][:, None] - scenarios["rjb"][:, None] / PERIODS
    assert_allclose(mean, expected, rtol=1e-12)
    assert_allclose(deviation, np.broadcast_to(0.1 * scenarios["mag"][:, None], mean.shape))


def hazardlib(name: str, periods: np.ndarray, **parameters: float) -> np.ndarray:
    """Return mean and standard deviation of ln Sa [ln g] by another way into OpenQuake: the method
    `compute` of the model itself.
    """
    from openquake.hazardlib import imt, valid

    model, size = valid.gsim(name), 1
    context = np.recarray(size, [(key, float) for key in parameters])
    for key, value in parameters.items():
        context[key] = value
    out = np.zeros((4, periods.size, size))
    model.compute(context, [imt.SA(float(period)) for period in periods], *out)
    return out[:2, :, 0]


BOORE = {"mag": 6.5, "rjb": 12.0, "rake": 0.0, "vs30": 400.0}


@pytest.fixture(scope="module")
def _openquake() -> None:
    pytest.importorskip("openquake.hazardlib", reason="the extra openquake is not installed")


@pytest.mark.usefixtures("_openquake")
@pytest.mark.filterwarnings("ignore")
def test_models_are_those_of_openquake(tmp_path: Path) -> None:
    target = read_target(written(tmp_path), PERIODS.tolist())
    each = [hazardlib(name, PERIODS, **BOORE) for name in ("BooreEtAl2014", "AkkarEtAlRjb2014")]
    mean = 0.6 * each[0][0] + 0.4 * each[1][0]
    between = 0.6 * (each[0][0] - mean) ** 2 + 0.4 * (each[1][0] - mean) ** 2
    assert_allclose(target.log_sa, mean + np.log(GRAVITY), rtol=1e-9)
    assert target.deviation is not None
    variance = 0.6 * each[0][1] ** 2 + 0.4 * each[1][1] ** 2 + between
    assert_allclose(target.deviation, np.sqrt(variance), rtol=1e-9)
    assert "0.6 BooreEtAl2014 + 0.4 AkkarEtAlRjb2014" in target.words
    assert "RotD50" in target.words


@pytest.mark.usefixtures("_openquake")
@pytest.mark.filterwarnings("ignore")
def test_a_model_alone_gives_the_conditional_spectrum_of_its_table(tmp_path: Path) -> None:
    """A CSV of its median and standard deviation is the same target."""
    mean, deviation = hazardlib("BooreEtAl2014", PERIODS, **BOORE)
    rows = [
        f"{t},{np.exp(m):.17g},{s:.17g}" for t, m, s in zip(PERIODS, mean, deviation, strict=True)
    ]
    table = tmp_path / "table.csv"
    table.write_text("period_s,sa_g,sigma_ln_sa\n" + "\n".join(rows) + "\n", encoding="utf-8")
    path = written(tmp_path, MODELS.replace(", AkkarEtAlRjb2014 = 0.4", ""))
    given = (1.0, 0.4 * GRAVITY)
    one, other = read_target(table, given=given), read_target(path, PERIODS.tolist(), given)
    assert_allclose(one.log_sa, other.log_sa, rtol=1e-9)
    assert one.covariance is not None
    assert other.covariance is not None
    assert_allclose(one.covariance, other.covariance, atol=1e-9)
    assert one.words.split("(ε")[1] == other.words.split("(ε")[1]


@pytest.mark.usefixtures("_openquake")
@pytest.mark.filterwarnings("ignore")
def test_bins_of_a_disaggregation_count_by_their_rates(tmp_path: Path) -> None:
    """Two bins with a probability, at distances of a vertical fault whose top is at 6 km depth."""
    path = of_disaggregation(tmp_path)
    path.write_text(path.read_text().replace(", AkkarEtAlRjb2014 = 0.4", ""), encoding="utf-8")
    given = (1.0, 0.2 * GRAVITY)
    target = read_target(path, PERIODS.tolist(), given)
    rates = -np.log1p(-np.array([0.02, 0.04]))
    expected = np.zeros(PERIODS.size)
    along = correlation(PERIODS, [1.0])[:, 0]
    for share, magnitude, distance in zip(
        rates / rates.sum(), (6.0, 7.0), (10.0, 30.0), strict=True
    ):
        parameters = BOORE | {"mag": magnitude, "rjb": np.sqrt(distance**2 - 36.0)}
        mean, deviation = hazardlib("BooreEtAl2014", PERIODS, **parameters)
        epsilon = (np.log(0.2) - mean[2]) / deviation[2]
        expected += share * (mean + along * deviation * epsilon)
    assert_allclose(target.log_sa - np.log(GRAVITY), expected, rtol=1e-9)
    assert target.deviation is not None
    assert target.deviation[2] == 0.0


@pytest.mark.usefixtures("_openquake")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("BooreEtAl2014", "BooreEtAl3014", "model 'BooreEtAl3014'. Must be a model of OpenQuake"),
        ("BooreEtAl2014", "AvgGMPE", "AvgGMPE cannot be computed at these periods (IndexError:"),
        ("BooreEtAl2014", "KothaEtAl2020Slope", "slope, for which there is no key. Choose another"),
        ("distance_rjb_km = 12.0\n", "", "BooreEtAl2014 needs distance_rjb_km. State them."),
        (
            "BooreEtAl2014",
            "ChiouYoungs2014",
            "ChiouYoungs2014 needs depth_to_top_km, dip_degree, distance_rrup_km, distance_rx_km, "
            "vs30_measured, z1_0_m. State them.",
        ),
    ],
)
def test_what_a_model_needs_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        read_target(written(tmp_path, MODELS.replace(old, new)))
    assert message in str(error.value)


@pytest.mark.usefixtures("_openquake")
@pytest.mark.filterwarnings("ignore")
def test_the_disaggregation_that_openquake_exported(tmp_path: Path) -> None:
    """It has two levels of PGA, on which no spectrum is conditional: the message names both."""
    source = SHARED / "openquake_exports" / "Mag_Dist-mean-0_5.csv"
    if not source.is_file():
        pytest.skip("no files of OpenQuake beside the repository")
    path = of_disaggregation(tmp_path, source.read_text(encoding="utf-8"))
    with pytest.raises(InputError, match=r"has 2 levels \(PGA = 0\.2225 g, PGA = 0\.1699 g\)"):
        read_target(path)
    lines = source.read_text(encoding="utf-8").splitlines()
    one = [line for line in lines if "1.69922E-01" not in line]
    path = of_disaggregation(tmp_path, "\n".join(one))
    target = read_target(path)
    assert target.deviation is not None
    assert ((target.deviation > 0.5) & (target.deviation < 1.5)).all()
