"""Bents of unequal columns in files of structures, in responses, and their margins."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    Ensemble,
    Pulse,
    Record,
    RespondOptions,
    RockingFrame,
    UnequalBent,
    Verdict,
    margins,
    read_structures,
    respond_bent,
    respond_bents,
)
from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.structures.contract import Shaking, respond_each
from rockframe.unequal.ensemble import bent_members
from rockframe.unequal.margins import bent_margin
from rockframe.unequal.scenarios import quantities_of

from .cases import BENT

TABLE = """
[[structure]]
name = "piers"
kind = "unequal"
heights_m = [9.0, 7.0]
widths_m = [1.4, 1.4]
spacing_m = 12.0
mass_ratio = 3.6
"""
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2, time=3.0)
EQUAL = UnequalBent(heights=(9.6, 9.6), widths=(1.6, 1.6), spacing=12.0, mass_ratio=4.0)
FRAME = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


def file_of(folder: Path, text: str) -> Path:
    path = folder / "structures.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_is_read(tmp_path: Path) -> None:
    more = "beam_depth_m = 1.5\nbeam_offset_m = 0.3\ncolumn_masses_kg = [4e4, 3e4]\n"
    [bent] = read_structures(file_of(tmp_path, TABLE + more))
    assert bent == UnequalBent(
        heights=(9.0, 7.0),
        widths=(1.4, 1.4),
        spacing=12.0,
        mass_ratio=3.6,
        beam_depth=1.5,
        beam_offset=0.3,
        column_masses=(4e4, 3e4),
        name="piers",
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[9.0, 7.0]", "[9.0, 7.0, 8.0]", "of 3 columns. Must be two: three or more unequal"),
        ("[9.0, 7.0]", "9.0", "heights_m"),
        ("spacing_m = 12.0", "spacing_m = 1.0", "Must be above 1.4 m, or the columns touch"),
        ("mass_ratio = 3.6", "[structure.tendon]", "tendon is not modelled for unequal columns"),
        ("mass_ratio = 3.6", "[structure.abutment]", "abutment is not modelled for unequal"),
        ("spacing_m", "spacing", "Did you mean spacing_m"),
    ],
)
def test_what_is_not_modelled_is_refused_by_name(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words) as raised:
        read_structures(file_of(tmp_path, TABLE.replace(old, new)))
    assert "\n" not in str(raised.value)


def test_members_have_the_spreads_of_frames() -> None:
    spreads = Ensemble(members=16, height=0.02, width=0.03, impact_loss=1.5)
    members = bent_members(spreads, BENT)
    ratios = np.array([np.divide(member.heights, BENT.heights) for member in members])
    assert_allclose(ratios[:, 0], ratios[:, 1])
    assert 0.015 < np.abs(ratios - 1.0).max() < 0.02
    losses = [
        np.log(np.prod(member.restitutions)) / np.log(np.prod(BENT.resized(*ratio).restitutions))
        for member, ratio in zip(
            members,
            [(m.heights[0] / 9.0, m.widths[0] / 1.4) for m in members],
            strict=True,
        )
    ]
    assert 1.0 / 1.5 <= min(losses) < 0.75
    assert 1.35 < max(losses) <= 1.5


def test_margins_of_equal_columns_are_those_of_the_frame() -> None:
    """The frame's search also looks for thin intervals; under this pulse there are none."""
    spreads = Ensemble(members=16, corner=1.0)
    own, frame = bent_margin(EQUAL, PULSE, spreads), margins(PULSE, FRAME, ensemble=spreads)
    assert_allclose(own.critical_scale, frame.critical_scale, rtol=2e-6)
    assert own.robust is not None
    assert frame.robust is not None
    for share in ("s10", "s25", "s50"):
        assert_allclose(getattr(own.robust, share), getattr(frame.robust, share), rtol=1e-9)


def test_the_critical_scale_separates_the_outcomes() -> None:
    margin = bent_margin(BENT, PULSE)
    below, above = respond_bents(
        [PULSE], [BENT], [0.99999 * margin.critical_scale, 1.00001 * margin.critical_scale]
    ).verdict[0, 0]
    assert (below, above) == (Verdict.STANDS, Verdict.OVERTURNS)


def test_quantities_of_scenarios_are_those_of_responses() -> None:
    response = respond_bent(BENT, PULSE)
    right, left = response.peaks
    quantities = quantities_of([BENT], np.array([[right]]), np.array([[left]]))
    for name, value in quantities.items():
        assert_allclose(value[0, 0], getattr(response, name), rtol=1e-12)
    assert response.peak_u >= np.abs(response.u).max() * (1.0 - 1e-12)
    assert response.peak_level_difference > 0.01


def test_a_kind_responds_with_pulse_margin_and_ensemble() -> None:
    samples = PULSE.acceleration(0.005 * np.arange(1600))
    record = Record(record_id="pulse", acceleration=samples, time_step=0.005)
    options = RespondOptions(ensemble=Ensemble(members=16))
    [response] = respond_each([BENT], Shaking(record, options, pulse=PULSE))
    assert response.to_pulse is not None  # type: ignore[attr-defined]
    assert abs(response.to_pulse.error) < 1e-3  # type: ignore[attr-defined]
    assert response.margin is not None
    assert response.margin.robust is not None
    assert "10 % overturn at" in response.spread_verdict.margin


def test_ratios_of_heights_keep_the_mean_height() -> None:
    for bent in (BENT, UnequalBent(heights=(7.0, 9.0), widths=(1.4, 1.4), spacing=12.0)):
        other = bent.with_height_ratio(0.6)
        assert_allclose(sum(other.heights), 16.0)
        assert_allclose(other.height_ratio, 0.6)
        assert (other.heights[0] > other.heights[1]) == (bent.heights[0] > bent.heights[1])


def test_one_command_answers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], bundled_records: Path
) -> None:
    structures, output = file_of(tmp_path, TABLE), tmp_path / "response.nc"
    file = bundled_records / "Ridgecrest2019-CCC.V1"
    words = ["--structures", f"{structures}", "--margins", "none", "--output", f"{output}"]
    assert main(["ingest", f"{file}", "--output", f"{tmp_path}/records.nc", "--workers", "0"]) == 0
    capsys.readouterr()
    assert main(["respond", f"{tmp_path}/records.nc", *words, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert "piers" in json.dumps(rows)
