"""Spectra of codes: their corners, published values, and what files of parameters must state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError, ParameterError
from rockframe.selection.codes import PERIODS, asce7_spectrum, eurocode8_spectrum
from rockframe.selection.target import read_target
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
        (ASCE + EC8, "2 codes. Must be one table, [asce_7] or [eurocode_8]"),
        ("", "0 codes"),
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
