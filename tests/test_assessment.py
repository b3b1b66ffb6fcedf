"""`assess` returns in memory what the respond stage writes, and refuses what needs a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe import (
    Ensemble,
    ParameterError,
    Pulse,
    Record,
    RespondOptions,
    RockingFrame,
    assess,
    respond_stage,
    with_pulse,
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
        ([], PULSE, None, "Invalid number of frames, 0"),
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
