"""The vertical record of a motion, from reading the files to the response of the frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rockframe.cli.main import main
from rockframe.components import vertical_beside
from rockframe.frame import RockingFrame
from rockframe.ingest import read_file
from rockframe.record import Orientation, Record
from rockframe.results.records import read_records, write_records
from rockframe.results.response import open_response
from rockframe.rocking import GroundAcceleration, respond

#: Same as `bridge-bent` of the shipped structures.
BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


@pytest.fixture
def motion(bundled_records: Path) -> list[Record]:
    """Two horizontals and the vertical of one station."""
    return read_file(bundled_records / "Ridgecrest2019-CCC.V1")


def stored(records: list[Record], folder: Path) -> Path:
    made = ((record, None) for record in records)
    write_records(made, folder / "records.nc", input_sha256={}, parameters={})
    return folder / "records.nc"


def peaks(path: Path, *words: str) -> dict[str, float]:
    output = path.with_name("response.nc")
    words = ("--structure", "bridge-bent", "--margins", "none", *words)
    assert main(["respond", str(path), "--output", str(output), *words]) == 0
    with open_response(output) as response:
        found = response.dataset["peak_rotation_ratio"].values[:, 0]
        return dict(zip(response.records, map(float, found), strict=True))


def test_the_frame_feels_the_vertical_of_its_motion(motion: list[Record], tmp_path: Path) -> None:
    path = stored(motion, tmp_path)
    east, _, up = read_records(path)
    across, upwards = (
        GroundAcceleration.from_samples(r.acceleration, r.time_step) for r in (east, up)
    )
    expected = respond(BENT, across.with_vertical(upwards)).peak_rotation_ratio
    assert peaks(path, "--vertical")[east.record_id] == expected
    assert peaks(path)[east.record_id] == respond(BENT, east).peak_rotation_ratio != expected


def test_a_downward_component_is_turned_over(motion: list[Record], tmp_path: Path) -> None:
    down = replace(
        motion[2], acceleration=-motion[2].acceleration, orientation=Orientation.DOWNWARD
    )
    (tmp_path / "down").mkdir()
    turned = peaks(stored([*motion[:2], down], tmp_path / "down"), "--vertical")
    assert turned == peaks(stored(motion, tmp_path), "--vertical")


def test_a_record_without_a_vertical_is_rejected(
    motion: list[Record], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = replace(motion[0], record_id="alone", station="elsewhere")
    path = stored([*motion, alone], tmp_path)
    words = ["respond", str(path), "--output", str(tmp_path / "response.nc"), "--vertical"]
    assert main([*words, "--margins", "none"]) == 1
    assert "rejected: alone: no vertical record of the same event" in capsys.readouterr().err


def test_none_with_a_vertical_is_an_error(
    motion: list[Record], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = stored(motion[:2], tmp_path)
    words = ["respond", str(path), "--output", str(tmp_path / "response.nc"), "--vertical"]
    assert main(words) == 2
    assert "no vertical record" in capsys.readouterr().err
    assert not (tmp_path / "response.nc").exists()


def test_ground_that_falls_faster_than_gravity_is_rejected(
    motion: list[Record], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    falling = replace(motion[2], acceleration=10.0 * motion[2].acceleration)
    path = stored([*motion[:2], falling], tmp_path)
    words = ["respond", str(path), "--output", str(tmp_path / "response.nc"), "--vertical"]
    assert main(words) == 2
    assert "the frame would lose contact with the ground" in capsys.readouterr().err


@pytest.mark.parametrize("change", ["length", "second", "step"])
def test_only_one_vertical_at_the_same_times_is_beside(motion: list[Record], change: str) -> None:
    east, north, up = motion
    others = {
        "length": [replace(up, acceleration=up.acceleration[: up.acceleration.size // 10])],
        "second": [up, replace(up, record_id="again", acceleration=np.roll(up.acceleration, 1))],
        "step": [replace(up, time_step=0.02)],
    }
    assert vertical_beside([east, north, *others[change]]) == {}
