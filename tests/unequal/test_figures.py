"""Figures of two unequal columns: outlines that fit the linkage, and the forces of each joint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import coarse

from rockframe import Pulse, Record, bent_forces, bent_positions, respond_bent
from rockframe.cli.main import main
from rockframe.errors import ParameterError
from rockframe.figures.joints import draw_any_joints, draw_bent_joints
from rockframe.figures.moving import bent_outlines, draw_animation, outlines
from rockframe.units import GRAVITY

from .cases import BENT, random_bent
from .test_equal_columns import BENT as EQUAL
from .test_equal_columns import FRAME
from .test_kind import TABLE, file_of

PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.2, time=3.0)
RECORD = Record(record_id="ricker", acceleration=PULSE.acceleration(0.01 * np.arange(800)),
                time_step=0.01)  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("side", [0, 1])
def test_outlines_are_rigid_and_touch_where_the_bent_stands(seed: int, side: int) -> None:
    """One corner of each column is on its ground, one carries the beam, whose centre moves by u and
    v of the equations.
    """
    bent = replace(random_bent(np.random.default_rng(seed)), beam_depth=1.2)
    theta = (1.0, -1.0)[side] * 0.6 * bent.balance_rotations[side]
    columns, beam = bent_outlines(bent, theta)
    at = bent_positions(bent, theta)
    along = beam[1] - beam[0]
    for k, corners in enumerate(columns):
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        assert_allclose(edges, [bent.heights[k], bent.widths[k]] * 2, rtol=1e-12)
        assert_allclose(corners[:, 1].min(), max(bent.heights) - bent.heights[k], atol=1e-12)
        loaded = corners[3 - side]
        across = along[0] * (loaded - beam[0])[1] - along[1] * (loaded - beam[0])[0]
        assert_allclose(across, 0.0, atol=1e-12)
    rest = bent_outlines(bent, 0.0)[1]
    centre = np.array([bent.beam_offset, 0.5 * bent.beam_depth + max(bent.heights)])
    weights, *_ = np.linalg.lstsq(np.vstack([rest.T, np.ones(4)]), [*centre, 1.0], rcond=None)
    assert_allclose(weights @ beam - centre, [at.u, at.v], atol=1e-12)


def test_outlines_of_equal_columns_are_those_of_the_frame() -> None:
    columns, beam = bent_outlines(replace(EQUAL, beam_depth=0.0), -0.1)
    frame_columns, frame_beam = outlines(FRAME, -0.1, EQUAL.spacing)
    assert_allclose(columns, frame_columns, atol=1e-12)
    assert frame_beam is not None
    assert_allclose(beam, frame_beam, atol=1e-12)


def test_the_animation_shows_the_beam_that_turns() -> None:
    with coarse():
        drawn = draw_animation(RECORD, BENT)
    assert "Both columns and the beam, which turns," in drawn.caption
    assert "9 and 7 m tall" in drawn.caption
    assert "largest θ/α 0.38" in drawn.caption
    drawn.move(3.5)
    scene = drawn.figure.axes[0]
    beam = np.asarray(scene.patches[2].get_xy())[:4]  # type: ignore[attr-defined]
    turned = np.arctan2(*(beam[1] - beam[0])[::-1])
    response = respond_bent(BENT, RECORD)
    theta = np.interp(3.5, response.time, response.theta)
    assert_allclose(turned, -bent_positions(BENT, theta).psi, atol=1e-9)
    assert abs(turned) > 1e-4


def test_the_figure_of_joints_has_the_forces_of_each_column() -> None:
    heavy = replace(BENT, column_masses=(5e4, 4e4))
    with coarse():
        drawn = draw_bent_joints(RECORD, heavy)
    forces = bent_forces(respond_bent(heavy, RECORD), RECORD)
    unit = heavy.weight / (1.0 + heavy.mass_ratio) / 1000.0
    for k, name in enumerate(("left", "right")):
        least, most = (unit * end(forces.base_vertical[k]) for end in (np.nanmin, np.nanmax))
        assert f"{name} base {least:.0f} to {most:.0f}" in drawn.caption
        assert f"{name} top {np.nanmax(forces.top_friction_demand[k]):.3f}" in drawn.caption
    with pytest.raises(ParameterError, match="no effect on bent 'bent': it has its own"):
        draw_any_joints(RECORD, BENT, spacing=9.0)
    still = replace(RECORD, acceleration=0.1 * RECORD.acceleration)
    with coarse():
        assert "does not rock at any sample" in draw_bent_joints(still, BENT).caption


def test_figures_that_are_not_of_two_columns_refuse_them_and_both_directions(
    tmp_path: Path, bundled_records: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--structures", f"{file_of(tmp_path, TABLE)}", "--output", f"{tmp_path}/figure.png"]
    words += ["--records", f"{bundled_records / 'Ridgecrest2019-CLC.V1'}"]
    assert main(["figure", "phase-portrait", *words]) == 2
    assert "Invalid kind unequal of structure 'piers'" in capsys.readouterr().err
    assert main(["figure", "animation", "--record", "Ridgecrest2019-CLC-both", *words]) == 2
    assert "columns that differ rock in one plane" in capsys.readouterr().err
