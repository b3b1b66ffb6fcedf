"""Spectra of codes: their corners, published values, and what files of parameters must state."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError, ParameterError
from rockframe.selection.codes import PERIODS, asce7_spectrum, eurocode8_spectrum
from rockframe.selection.target import read_target, target_files
from rockframe.units import GRAVITY

ASCE = "[asce_7]\nsds_g = 1.644\nsd1_g = 0.887\nlong_period_s = 8.0\n"
EC8 = '[eurocode_8]\nground_acceleration_g = 0.25\nground = "B"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "site.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_published_example_of_asce_7() -> None:
    """Moehle (2015), course CE 120 of UC Berkeley: S_DS 1.644 g, S_D1 0.887 g, so that T_0 is 0.1 s
    and the spectrum begins at 0.66 g.
    """
    start, at_corner, plateau, at_one = asce7_spectrum([0.0, 0.108, 0.5, 1.0], 1.644, 0.887, 8.0)
    assert start == pytest.approx(0.66, abs=0.005)
    assert at_corner == pytest.approx(1.644, rel=1e-3)  # 0.2 S_D1 / S_DS
    assert (plateau, at_one) == pytest.approx((1.644, 0.887))


@pytest.mark.parametrize(
    ("ground", "kind", "soil", "corners"),
    [
        ("A", 1, 1.0, (0.15, 0.4, 2.0)),
        ("B", 1, 1.2, (0.15, 0.5, 2.0)),
        ("D", 1, 1.35, (0.2, 0.8, 2.0)),
        ("C", 2, 1.5, (0.1, 0.25, 1.2)),
        ("E", 2, 1.6, (0.05, 0.25, 1.2)),
    ],
)
def test_corners_of_eurocode_8(
    ground: str, kind: int, soil: float, corners: tuple[float, float, float]
) -> None:
    """At T_B and T_C it is 2.5 S a_g, at T_D T_C / T_D of it; it begins at S a_g."""
    b, c, d = corners
    start, first, second, third = eurocode8_spectrum([0.0, b, c, d], 1.0, ground, kind)
    assert start == pytest.approx(soil)
    assert (first, second) == pytest.approx((2.5 * soil, 2.5 * soil))
    assert third == pytest.approx(2.5 * soil * c / d)
    assert eurocode8_spectrum([2.0 * d], 1.0, ground, kind)[0] <= third / 4.0 * 1.0000001


@given(sds=st.floats(0.1, 30.0), ratio=st.floats(0.05, 0.95), period=st.floats(0.001, 20.0))
def test_spectra_have_no_steps(sds: float, ratio: float, period: float) -> None:
    for spectrum in (
        asce7_spectrum([period, period * 1.0001], sds, ratio * sds, 4.0),
        eurocode8_spectrum(np.minimum([period, period * 1.0001], 4.0), sds, "C"),
    ):
        before, after = spectrum
        assert after == pytest.approx(before, rel=5e-4)


def test_a_file_is_a_target_at_the_stated_periods(tmp_path: Path) -> None:
    target = read_target(written(tmp_path, ASCE + "scale = 1.5\n"), [1.0, 0.3])
    np.testing.assert_allclose(target.period, [0.3, 1.0])
    np.testing.assert_allclose(np.exp(target.log_sa), 1.5 * GRAVITY * np.array([1.644, 0.887]))
    assert target.covariance is None
    assert target.words == "site.toml, 1.5 times ASCE 7"
    whole = read_target(written(tmp_path, EC8))
    np.testing.assert_allclose(whole.period, PERIODS)
    plateau = np.exp(whole.log_sa).max()
    assert plateau == pytest.approx(2.5 * 1.2 * 0.25 * GRAVITY)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ASCE.replace("asce_7", "ntc_2018"), ":1: unknown key 'ntc_2018'"),
        (ASCE + EC8, "2 targets. Must be one table, [asce_7], [eurocode_8]"),
        ("", "0 targets"),
        (ASCE.replace("sds_g", "sd_g"), ":2: unknown key 'asce_7.sd_g'"),
        (ASCE.replace("1.644", "-1.0"), "sds_g -1.0. Must be"),
        (EC8.replace('"B"', '"F"'), "ground 'F'. Must be"),
        (EC8 + "spectrum_type = 3\n", "spectrum_type 3. Must be"),
        ("code = 3\n", "unknown key 'code'"),
    ],
)
def test_parameters_that_a_code_does_not_have_are_refused(
    tmp_path: Path, text: str, words: str
) -> None:
    with pytest.raises(InputError) as refused:
        read_target(written(tmp_path, text))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_values_outside_of_the_codes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="period 5 s\\. Must be at most 4 s"):
        read_target(written(tmp_path, EC8), [1.0, 5.0])
    with pytest.raises(ParameterError, match="long_period 0\\.5 s\\. Must be above"):
        read_target(written(tmp_path, ASCE.replace("8.0", "0.5")))
    with pytest.raises(ParameterError, match="ground 'F'"):
        eurocode8_spectrum([1.0], 1.0, "F")
    with pytest.raises(ParameterError, match="Invalid periods"):
        eurocode8_spectrum([-1.0], 1.0, "A")
    with pytest.raises(InputError, match="standard deviation"):
        read_target(written(tmp_path, EC8), given=(1.0, 3.0))


#: The example of the merge request that added ASCE 7-22 to the web service of the USGS (site class
#: C, latitude 34, longitude -118), at ten of its 22 periods.
PERIODS_OF_USGS = (0, 0.01, 0.1, 0.2, 0.5, 0.75, 1, 2, 5, 10)
ORDINATES = (0.65, 0.66, 1.33, 1.62, 1.15, 0.88, 0.7, 0.31, 0.1, 0.042)


def answer(folder: Path, **changes: object) -> Path:
    design = {"periods": [*PERIODS_OF_USGS], "ordinates": [*ORDINATES]} | changes
    mcer = design | {"ordinates": [1.5 * value for value in ORDINATES]}
    data = {"sds": 1.46, "multiPeriodDesignSpectrum": design, "multiPeriodMCErSpectrum": mcer}
    request = {"referenceDocument": "ASCE7-22", "parameters": {"title": "Example"}}
    path = folder / "usgs.json"
    path.write_text(json.dumps({"request": request, "response": {"data": data}}), encoding="utf-8")
    return path


def test_multi_period_spectra_of_the_usgs(tmp_path: Path) -> None:
    """At its periods as stated, and between 0.5 and 0.75 s linear in the period: 1.042 g at 0.6 s,
    by hand.
    """
    path = answer(tmp_path)
    target = read_target(path, [0.2, 0.6, 10.0])
    np.testing.assert_allclose(np.exp(target.log_sa) / GRAVITY, [1.62, 1.042, 0.042], rtol=1e-12)
    assert target.words == "usgs.json, ASCE 7-22 multi-period design spectrum of Example"
    text = '[asce_7]\ndesign_maps = "usgs.json"\nlevel = "mcer"\nscale = 2.0\n'
    named = written(tmp_path, text)
    mcer = read_target(named, [0.6])
    np.testing.assert_allclose(np.exp(mcer.log_sa) / GRAVITY, [2.0 * 1.5 * 1.042], rtol=1e-12)
    assert "2 times ASCE 7-22 multi-period MCE_R spectrum" in mcer.words
    assert target_files(named) == [named, path]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"periods": [0.0, 1.0]}, "no response.data.multiPeriodDesignSpectrum of periods and ordi"),
        (
            {"periods": "none"},
            "no response.data.multiPeriodDesignSpectrum of periods and ordinates",
        ),
        ({"periods": [0, 1, 0.5, *range(2, 9)]}, "invalid multiPeriodDesignSpectrum. Must be incr"),
        ({"ordinates": [65.0, *ORDINATES[1:]]}, "invalid multiPeriodDesignSpectrum. Must be incr"),
        ({"ordinates": [-0.1, *ORDINATES[1:]]}, "invalid multiPeriodDesignSpectrum. Must be incr"),
    ],
)
def test_answers_of_the_usgs_with_a_fault(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError) as refused:
        read_target(answer(tmp_path, **changes), [0.5])
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is no JSON. Must be the answer of the USGS for ASCE 7-22."),
        ('{"response": [1]}', "no response.data.multiPeriodDesignSpectrum"),
        ("[" * 100_000, "is no JSON"),
    ],
)
def test_json_of_another_kind(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "usgs.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_target(tmp_path / "usgs.json")
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('design_maps = "a.json"\nsds_g = 1.0\n', "design_maps has the accelerations. Remove the"),
        ("sds_g = 1.0\n", "sd1_g, long_period_s missing. State them, or design_maps alone"),
        (ASCE[9:] + 'level = "mcer"\n', "level has no effect without design_maps"),
        ('design_maps = "none.json"\n', "none.json: cannot be read: No such file"),
    ],
)
def test_sources_of_asce_7_exclude_each_other(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as refused:
        read_target(written(tmp_path, f"[asce_7]\n{text}"))
    assert message in str(refused.value)


def test_periods_beyond_the_answer_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"covers periods from 0 to 10 s, not 12 s"):
        read_target(answer(tmp_path), [1.0, 12.0])
