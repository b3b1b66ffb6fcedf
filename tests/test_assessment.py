"""`assess` returns in memory what the respond stage writes, and refuses what needs a file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from rockframe import (
    Ensemble,
    PairAcceleration,
    ParameterError,
    Pulse,
    Record,
    RespondOptions,
    RockingFrame,
    assess,
    respond_many,
    respond_stage,
    sweep,
    with_pulse,
    wobble,
    wobbling_ensemble,
)
from rockframe.results.records import write_records

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
COLUMN = RockingFrame(height=6.0, width=0.8, name="column")
PULSE = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.2, time=3.0)
RECORD = Record(
    record_id="shake", acceleration=PULSE.acceleration(0.01 * np.arange(800)), time_step=0.01
)
#: The corner of the band-pass is known only for records of files.
OPTIONS = RespondOptions(margins="first", forces=True, ensemble=Ensemble(members=16, corner=1.0))
STRUCTURES = """
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
[[structure]]
name = "column"
height_m = 6.0
width_m = 0.8
"""


def test_a_file_of_the_same_motion_holds_the_same_values(tmp_path: Path) -> None:
    records, output = tmp_path / "records.nc", tmp_path / "response.nc"
    structures = tmp_path / "structures.toml"
    structures.write_text(STRUCTURES, encoding="utf-8")
    write_records([(RECORD, None)], records, input_sha256={}, parameters={})
    respond_stage(records, output, OPTIONS, structures_path=structures)
    found = assess([BENT, COLUMN], RECORD, OPTIONS).to_xarray()
    with xr.open_dataset(output, engine="rockframe") as written:
        assert written.sel(record="shake", structure="bent").sizes["quantile"] == 3
        in_memory = [name for name in written.variables if name in found]
        missing = {name for name in written.data_vars if name not in found}
        assert missing == {"theta", "u", "v"}
        for name in in_memory:
            xr.testing.assert_identical(found[name].variable, written[name].variable.load())


def test_motions_have_names_and_responses_are_selected_by_them() -> None:
    options = RespondOptions(margins="none", ensemble=Ensemble(members=0))
    found = assess([BENT, COLUMN], [RECORD, PULSE], options)
    assert [(name, one.frame.name) for name, one in found] == [
        ("shake", "bent"),
        ("shake", "column"),
        ("motion-2", "bent"),
        ("motion-2", "column"),
    ]
    assert found.sel(record="motion-2", structure="column").frame == COLUMN
    assert assess(BENT, {"strong": PULSE}, options).sel().frame == BENT
    with pytest.raises(ParameterError, match=r"Missing record\. Must be one of shake, motion-2"):
        found.sel(structure="bent")
    with pytest.raises(ParameterError, match="structure"):
        found.sel(record="shake", structure="bend")


def test_the_printed_line_states_verdict_share_and_margin() -> None:
    found = assess(COLUMN, {"weak": Pulse(wavelet="symmetric_ricker", a_p=0.5, T_p=1.0)}, OPTIONS)
    first, line = repr(found).splitlines()
    assert first == "<Assessment of 1 responses>"
    assert line.startswith("weak")
    assert "no uplift; nominal critical scale" in line
    assert line.endswith("(0 of 16 overturn)")


def test_pulses_are_added_by_name() -> None:
    options = RespondOptions(margins="none", ensemble=Ensemble(members=0))
    found = assess(COLUMN, RECORD, options, pulses={"shake": PULSE})
    response = found.sel()
    assert response.to_pulse == with_pulse(response, PULSE).to_pulse
    assert "verdict_to_pulse" in found.to_xarray()
    with pytest.raises(ParameterError, match="shake"):
        assess(COLUMN, RECORD, options, pulses={"other": PULSE})


@pytest.mark.parametrize(
    ("structures", "motions", "options", "words"),
    [
        ([], PULSE, None, "Invalid number of structures, 0"),
        (BENT, [], None, "Invalid number of motions, 0"),
        ([BENT, BENT], PULSE, None, "2 structures have the name 'bent'"),
        (BENT, [RECORD, RECORD], None, "2 motions have the name 'shake'"),
        (BENT, PULSE, RespondOptions(vertical=True), "option vertical of assess"),
        (BENT, PULSE, RespondOptions(structure="bent"), "option structure of assess"),
        (BENT, [[1.0, 2.0]], None, "Invalid motion of type list"),
    ],
)
def test_what_cannot_be_assessed_is_refused(structures, motions, options, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ParameterError, match=words):
        assess(structures, motions, options)


def test_a_sweep_has_the_values_of_each_frame_alone() -> None:
    """Dimensions are those of the arguments, and every cell is the frame with its dimensions."""
    peaks = sweep(PULSE, height=[3.0, 6.0], width=[0.6, 0.9, 1.2], mass_ratio=4.0, scale=[0.5, 1.0])
    assert dict(peaks.sizes) == {"height": 2, "width": 3, "scale": 2}
    assert peaks["height"].attrs["units"] == peaks["peak_u"].attrs["units"] == "m"
    for height in (3.0, 6.0):
        for width in (0.6, 0.9, 1.2):
            frame = RockingFrame(height=height, width=width, mass_ratio=4.0)
            alone = respond_many([PULSE], [frame], [0.5, 1.0])
            cells = peaks.sel(height=height, width=width)
            assert cells["verdict"].values.tolist() == alone.verdict[0, 0].tolist()
            ratio = cells["peak_rotation_ratio"].values
            assert ratio.tolist() == alone.peak_rotation_ratio[0, 0].tolist()
            peak_u = frame.horizontal_displacement(alone.peak_rotation[0, 0])
            assert cells["peak_u"].values.tolist() == peak_u.tolist()


def test_frames_scaled_like_length_and_time_squared_respond_alike() -> None:
    """Four times as large under a pulse twice as long: equal rotations; a shared dimension."""
    size = xr.DataArray([1.0, 4.0], dims="size")
    ratios = [
        sweep(
            Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.2 * factor),
            height=3.0 * size,
            width=0.5 * size,
        )["peak_rotation_ratio"].values
        for factor in (1.0, 2.0)
    ]
    assert ratios[0].shape == (2,)
    assert ratios[1][1] == pytest.approx(ratios[0][0], rel=1e-11)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"height": [3.0, 6.0], "width": [0.5, 9.0]}, "height 3, width 9: Invalid slenderness"),
        ({"height": 3.0, "widht": 0.5}, "Invalid parameter .widht."),
        ({"height": [[3.0]], "width": 0.5}, r"Invalid height of shape \(1, 1\)"),
        ({"height": ["high"], "width": 0.5}, "Must be numbers"),
        ({"height": 3.0, "width": 0.5, "name": xr.DataArray(["a"])}, "Invalid name of type Data"),
        ({"height": 3.0, "width": 0.5, "scale": [math.inf]}, "Must be finite"),
        (
            {"height": xr.DataArray([3.0, 4.0], dims="k"), "width": xr.DataArray([1.0], dims="k")},
            "Invalid dimensions of the parameters",
        ),
    ],
)
def test_a_sweep_refuses_what_is_no_frame(parameters: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        sweep(PULSE, **parameters)


def test_a_pair_of_components_is_assessed_in_both_directions() -> None:
    """It is the response of `wobble`; rectangular columns are not computed, and are not safe."""
    frames = [
        RockingFrame(height=3.0, width=0.5, section=section, name=section)
        for section in ("circular", "rectangular")
    ]
    motion = PairAcceleration.from_pulses(PULSE, replace(PULSE, time=0.3))
    options = RespondOptions(margins="none")
    found = assess(frames, {"both": motion, "plane": PULSE}, options)
    both = found.sel(record="both", structure="circular")
    assert both.peak_rotation == wobble(frames[0], motion).peak_rotation
    assert both.ensemble == wobbling_ensemble(frames[0], motion)
    assert not found.sel(record="both", structure="rectangular").spread_verdict.is_computed
    assert found.structures == tuple(frames)
    values = found.to_xarray()["peak_u"].sel(record="both")
    assert math.isnan(values.sel(structure="rectangular"))
    assert values.sel(structure="circular") == both.peak_u > 0.0
