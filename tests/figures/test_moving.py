"""The structure that moves: its outlines are those of the equations, and the file has frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from PIL import Image

import rockframe
from rockframe.cli.main import main
from rockframe.figures.moving import outlines
from rockframe.figures.rolling import outline, rims
from rockframe.signals.measures import significant_duration

BENT = rockframe.RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
PULSE = rockframe.Pulse(wavelet="antisymmetric_ricker", a_p=0.45, T_p=1.0, time=1.0)


@pytest.mark.parametrize("theta", [0.12, -0.12, 0.4])
def test_the_beam_moves_by_u_and_v_and_rests_on_the_columns(theta: float) -> None:
    """As in (7) and (10): u = 2b (1 - cos) + 2h sin, and v = 2b sin - 2h (1 - cos)."""
    columns, beam = outlines(BENT, theta, 7.0)
    assert beam is not None
    still = outlines(BENT, 0.0, 7.0)[1]
    assert still is not None
    turn, lift = abs(theta), BENT.width * math.sin(abs(theta))
    u = BENT.width * (1.0 - math.cos(turn)) + BENT.height * math.sin(turn)
    v = lift - BENT.height * (1.0 - math.cos(turn))
    np.testing.assert_allclose(beam - still, np.tile([math.copysign(u, theta), v], (4, 1)))
    for corners in columns:
        assert corners[:, 1].min() == pytest.approx(0.0, abs=1e-12)  # one corner on the ground
        assert corners[:, 1].max() == pytest.approx(beam[:, 1].min())
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        np.testing.assert_allclose(sorted(sides), [1.6, 1.6, 9.6, 9.6])  # it is rigid


def test_a_column_alone_has_no_beam() -> None:
    columns, beam = outlines(rockframe.RockingFrame(height=6.0, width=1.0), 0.1, 3.0)
    assert (len(columns), beam) == (1, None)


def test_as_many_columns_are_drawn_as_there_are() -> None:
    """They stand in the same place under the same beam, which rests on all of them."""
    six = rockframe.RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, columns=6)
    columns, beam = outlines(six, 0.1, 7.0)
    assert len(columns) == 6
    assert beam is not None
    np.testing.assert_allclose(np.diff([corners[0, 0] for corners in columns]), 7.0)
    assert beam[:, 0].min() < columns[0][3, 0]
    assert columns[-1][3, 0] < beam[:, 0].max()


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("moving")
    np.savetxt(home / "motion.csv", PULSE.acceleration(0.01 * np.arange(301)), fmt="%.8f")
    words = ["--units", "g", "--time-step", "0.01", "--workers", "0"]
    assert main(["ingest", str(home / "motion.csv"), *words, "--output", f"{home}/records.nc"]) == 0
    return home / "records.nc"


def drawn(records: Path, output: Path, figure: str = "animation") -> int:
    return main(["figure", figure, "--records", str(records), "--output", str(output)])


@pytest.mark.parametrize("ending", [".gif", ".apng"])
def test_the_file_has_frames_that_differ_and_a_caption(
    ending: str, records: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rockframe.figures.moving._MOST_FRAMES", 12)
    path = tmp_path / f"bent{ending}"
    assert drawn(records, path) == 0
    with Image.open(path) as picture:
        count = int(getattr(picture, "n_frames", 1))
        picture.seek(0)
        first = np.asarray(picture.convert("RGB"), dtype=float)
        picture.seek(count // 2)
        middle = np.asarray(picture.convert("RGB"), dtype=float)
    assert count == 12
    assert np.abs(first - middle).max() > 50.0
    assert "to scale" in path.with_suffix(".caption.txt").read_text("utf-8")


def test_the_same_figure_is_a_still_at_the_largest_rotation(records: Path, tmp_path: Path) -> None:
    assert drawn(records, tmp_path / "bent.png") == 0
    assert imread(tmp_path / "bent.png").shape[0] > 400


def test_other_figures_do_not_move(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert drawn(records, tmp_path / "joints.gif", "joints") == 2
    assert "figure joints does not move. Must end in .png, .pdf or .svg" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_without_ffmpeg_another_format_is_named(
    records: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("rockframe.figures.moving.FFMpegWriter.isAvailable", lambda: False)
    assert drawn(records, tmp_path / "bent.mp4") == 2
    assert "cannot be written without ffmpeg. Install it, or write .gif" in capsys.readouterr().err


def test_the_figure_of_a_record_states_its_peaks(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert drawn(records, tmp_path / "record.png", "record") == 0
    caption = capsys.readouterr().out
    record = rockframe.read(records)[0]
    begin, end = significant_duration(record.acceleration, record.time_step)
    assert f"5 to 95 % of it, {end - begin:.1f} s" in caption
    assert "response spectrum with 5 % damping" in caption


@given(theta=st.floats(0.0, 1.5), phi=st.floats(-math.pi, math.pi), top=st.floats(0.5, 2.0))
def test_a_column_that_rolls_touches_its_circle_and_carries_the_beam(
    theta: float, phi: float, top: float
) -> None:
    """The contact is on the circle of the base at rest; the highest point of the top has moved by u
    and v of the frame; the column is rigid.
    """
    frame = rockframe.RockingFrame(height=6.0, width=1.0, top_width=top, mass_ratio=1.0)
    base, upper = rims(frame, theta, phi)
    contact = 0.5 * np.array([math.cos(phi), math.sin(phi), 0.0])
    assert np.linalg.norm(base - contact, axis=1).min() < 0.04  # between two points of the rim
    assert base[:, 2].min() >= -1e-3
    middle = upper.mean(axis=0) - base.mean(axis=0)
    assert np.linalg.norm(middle) == pytest.approx(6.0)
    assert middle[2] == pytest.approx(6.0 * math.cos(theta))
    along, up = contact / 0.5, np.array([0.0, 0.0, 1.0])
    tilted = math.cos(theta) * along - math.sin(theta) * up
    edge, at_rest = upper.mean(axis=0) - 0.5 * top * tilted, 6.0 * up - 0.5 * top * along
    u = float(frame.horizontal_displacement(theta))
    v = float(frame.vertical_displacement(theta))
    np.testing.assert_allclose(edge - at_rest, u * along + [0.0, 0.0, v], atol=1e-9)


def test_a_column_that_rolls_in_one_plane_has_the_outline_of_one_that_rocks() -> None:
    frame = rockframe.RockingFrame(height=6.0, width=1.0)
    [rocking], _ = outlines(frame, 0.1, 3.0)
    rolling = outline(rims(frame, 0.1, 0.0), 0)
    for corner in rocking:
        assert np.linalg.norm(rolling - corner, axis=1).min() < 1e-6


def test_both_directions_are_drawn_by_the_name_of_the_motion(
    bundled_records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two sides, the path in plan, and both accelerations."""
    command = ["figure", "animation", "--structure", "apollo-column", "--records"]
    command += [str(bundled_records / "Ridgecrest2019-CLC.V1"), "--record"]
    still = str(tmp_path / "still.png")
    assert main([*command, "Ridgecrest2019-CLC-both", "--output", still]) == 0
    assert "seen along y and along x" in capsys.readouterr().out
    assert imread(still).shape[1] > 1000
    assert main([*command, "Ridgecrest2019-CCC-both", "--output", still]) == 2
    assert "Ridgecrest2019-CCC-both" in capsys.readouterr().err
    square = [word.replace("apollo", "slender") for word in command]
    assert main([*square, "Ridgecrest2019-CLC-both", "--output", still]) == 2
    assert "Must be circular" in capsys.readouterr().err
