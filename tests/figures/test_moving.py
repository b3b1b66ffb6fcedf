"""The structure that moves: its outlines are those of the equations, and the file has frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

import rockframe
from rockframe.cli.main import main
from rockframe.figures.moving import outlines
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
