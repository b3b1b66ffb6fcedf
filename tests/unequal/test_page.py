"""The drawing of two unequal columns on pages: its geometry, and its four-bar linkage."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose

import rockframe
from rockframe import Pulse, RespondOptions, RockingFrame, assess, bent_positions
from rockframe.report.page import drawn_structure
from rockframe.results.response import responses_arrays
from rockframe.results.run import with_parameters
from rockframe.results.tables.rows import LabelledValue, LabelledValuesOf
from rockframe.structures.contract import Shaking, respond_each

from .cases import BENT, random_bent

SCRIPT = Path(rockframe.__file__).parent / "web" / "script" / "frame.js"
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2, time=3.0)


def test_the_page_has_the_geometry_of_both_columns() -> None:
    structures: list[Any] = [
        BENT,
        RockingFrame(name="frame", height=8.0, width=1.4, mass_ratio=3.6),
    ]
    responses = respond_each(structures, Shaking(PULSE, RespondOptions(margins="none")))
    file = responses_arrays({"pulse": responses}, structures)
    facts: Any = LabelledValuesOf(with_parameters(file), keys=["structure"])
    own, frame = (drawn_structure(facts[structure.name]) for structure in structures)
    json.dumps([own, frame], allow_nan=False)
    assert (own["heights"], own["widths"], own["spacing"]) == ([9.0, 7.0], [1.4, 1.4], 12.0)
    assert own["balance"] == [*BENT.balance_rotations]
    assert "heights" not in frame
    assert frame["height"] == 8.0


def test_parameters_of_another_kind_do_not_hide_those_of_a_frame() -> None:
    """In files they are NaN for it, whatever their names are."""
    own = LabelledValue("height", "height of the columns", 8.0, "m")
    foreign = LabelledValue("parameter_height", "height of a block", math.nan, "m")
    shape = [LabelledValue(name, name, 1.0, "m") for name in ("width", "top_contact_width")]
    rest = [LabelledValue(name, name, 0.2, "1") for name in ("mass_ratio", "slenderness")]
    assert drawn_structure([own, *shape, *rest, foreign])["height"] == 8.0


def test_a_plot_of_verdicts_shows_displacements_of_bents() -> None:
    figure = plt.figure()
    axes = figure.add_subplot()
    assess(BENT, PULSE, RespondOptions(margins="none")).draw(axes)
    assert axes.get_ylabel() == "u [m]"
    assert len(axes.lines) == 1
    plt.close(figure)


def test_the_script_places_columns_and_beam_where_they_are() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("no program node, which runs the script of the page")
    asked, expected = [], []
    for seed in range(8):
        bent = random_bent(np.random.default_rng(seed))
        right, left = bent.balance_rotations
        for theta in (0.9 * right, -0.9 * left, 0.02, -0.02):
            at = bent_positions(bent, theta)
            shape = {"heights": bent.heights, "widths": bent.widths, "spacing": bent.spacing}
            asked.append([shape, theta])
            expected.append([float(at.theta_2), float(at.psi)])
    code = (
        f"{SCRIPT.read_text(encoding='utf-8')}\nconst poses = {json.dumps(asked)}.map(([shape, "
        "theta]) => linkagePose(shape, theta));\n"
        "console.log(JSON.stringify(poses.map((pose) => [pose.thetas[1], pose.turn])));"
    )
    answer = subprocess.run([node, "-e", code], capture_output=True, text=True, check=True)
    assert_allclose(json.loads(answer.stdout), expected, rtol=0.0, atol=1e-13)
