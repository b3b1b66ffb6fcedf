"""Motions whose peak touches the acceleration of uplift, or exceeds it by round-off.

Such a frame is not uplifted: a peak that exceeds the limit by a few units of the last place rotates
it by less than 1e-30. At 680a7ef6 the vectorised kernel lifted it off and landed it without end.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.conftest import examples
from tests.rocking.motions import BENT, SLENDER, STOCKY

from rockframe import (
    GroundAcceleration,
    IsolatedDeck,
    RockingFrame,
    Verdict,
    respond,
    respond_oscillators,
    respond_scenarios,
)
from rockframe.errors import InternalError
from rockframe.parts import Dissipater, Tendon
from rockframe.rocking.kernels import steps
from rockframe.rocking.scenarios import constants_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

TENDON = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=1e5)
TIED = replace(BENT, column_mass=48e3, tendon=TENDON)
FRAMES = {
    "column": RockingFrame(height=2.0, width=0.3),
    "bent": BENT,
    "stocky": STOCKY,
    "slender": SLENDER,
    "tendon": TIED,
    "yielding": replace(TIED, tendon=replace(TENDON, yield_stress=1.5e9)),
    "dissipater": replace(
        TIED, dissipater=Dissipater(stiffness=5e7, yield_force=2e5, lever_arm=0.8)
    ),
}
#: Units of the last place between the peak and the limit.
BESIDE = range(-3, 4)
#: Strong motion after the peak: the frame rocks and lands once or twice.
ROCKS = (0.5, 1.5, 1.8, 0.5, *[0.0] * 30)


def limit_of(frame: RockingFrame) -> float:
    """Return the ground acceleration that uplifts a frame [g], as the kernels round it."""
    slenderness, _, _, *ties = constants_of(frame)
    return math.tan(slenderness) + (ties[1] + ties[6]) / math.cos(slenderness)


def beside(limit: float) -> Float:
    """Return the neighbours of a limit, BESIDE units of the last place away."""
    return np.array([limit + k * np.spacing(limit) for k in BESIDE])


@st.composite
def peaks(draw: st.DrawFn) -> Float:
    """Draw samples in decimals with one peak of 1, or -1, that no other sample reaches."""
    lower = st.integers(-95, 95).map(lambda percent: percent / 100.0)
    samples = draw(st.lists(lower, min_size=3, max_size=12))
    samples[draw(st.integers(0, len(samples) - 1))] = draw(st.sampled_from([1.0, -1.0]))
    return np.array(samples)


@examples(60)
@given(
    peaks(), st.sampled_from(sorted(FRAMES)), st.sampled_from([0.005, 0.01, 0.02]), st.booleans()
)
@example(np.array([0.0, 0.955, 1.0, 0.5765, 0.0]), "column", 0.01, False)
@example(np.array([-0.5, 0.955, 1.0, 0.5765, 0.0]), "tendon", 0.02, True)
def test_a_peak_that_touches_the_limit_uplifts_nothing(
    samples: Float, name: str, step: float, rocks: bool
) -> None:
    """The scalar kernel and the lanes end, and agree; the frame rocks only if stronger motion
    follows.
    """
    frame = FRAMES[name]
    shape = np.concatenate([samples, ROCKS]) if rocks else samples
    motion = GroundAcceleration.from_samples(GRAVITY * shape, step)
    scales = beside(limit_of(frame))
    zero = np.zeros(scales.size, dtype=np.intp)
    lanes = respond_scenarios([motion], [frame], zero, zero, scales)
    scalar = [respond(frame, motion.scaled(scale)) for scale in scales]
    expected = Verdict.STANDS if rocks else Verdict.NO_UPLIFT
    assert [response.verdict for response in scalar] == [expected] * scales.size
    assert lanes.verdict.tolist() == [expected] * scales.size
    assert [response.impacts for response in scalar] == lanes.impacts.tolist()
    alone = [response.peak_rotation for response in scalar]
    np.testing.assert_allclose(lanes.peak_rotation, alone, rtol=1e-9, atol=1e-30)
    if not rocks:
        assert not np.any(alone)


@examples(30)
@given(
    st.sampled_from(["column", "bent", "tendon"]),
    st.floats(0.1, 1.0),
    st.floats(0.0, math.tau),
    st.sampled_from([0.0, 0.2]),
)
def test_a_smooth_peak_that_touches_the_limit_ends(
    name: str, period: float, phase: float, upwards: float
) -> None:
    """The peak lies within an interval, or where the vertical motion also counts; the polynomials
    hold it to 1e-14.
    """
    frame = FRAMES[name]

    def wave(strength: float) -> GroundAcceleration:
        return GroundAcceleration.from_function(
            lambda t: strength * GRAVITY * np.cos(math.tau * t / period + phase),
            *(0.0, 0.6),
            intervals=60,
            degree=5,
        )

    motion = wave(1.0).with_vertical(wave(-upwards)) if upwards else wave(1.0)
    # on one side, the vertical motion reduces the limit by a share of the horizontal motion
    scales = beside(limit_of(frame) / (1.0 + upwards * math.tan(frame.slenderness)))
    zero = np.zeros(scales.size, dtype=np.intp)
    lanes = respond_scenarios([motion], [frame], zero, zero, scales)
    alone = [respond(frame, motion.scaled(scale)).peak_rotation for scale in scales]
    assert max(alone) < 1e-15
    assert lanes.peak_rotation.max() < 1e-15


@given(peaks(), st.sampled_from([0.1, 0.06, 0.333]), st.sampled_from([0.0, 0.05]))
def test_a_peak_that_touches_the_friction_moves_no_deck(
    samples: Float, strength: float, damping: float
) -> None:
    deck = IsolatedDeck(
        strength_ratio=strength, period=2.0, yield_displacement=0.0, damping_ratio=damping
    )
    motion = GroundAcceleration.from_samples(samples, 0.01)
    peaks = respond_oscillators([deck], [motion], beside(deck.constants[2]))
    assert peaks.peak_displacement.max() < 1e-30


#: A bound, and a call that exceeds it once it is lowered to the value.
BOUNDS = {
    "steps._MOST_BOUNCES = steps._MOST_EVENTS = 0.0": "respond(BENT, PUSH)",
    "steps._MOST_BOUNCES = steps._MOST_EVENTS = -1.0": (
        "respond_scenarios([PUSH], [BENT], [0], [0], [1.0])"
    ),
    "steps._MOST_BOUNCES = 0.0; steps._MOST_EVENTS = -1.0": (
        "respond(TIED, STILL, initial_rotation=0.01)"
    ),
    "steps.ROOT_STEPS = 1": "respond(BENT, PUSH)",
    "tails.ROOT_STEPS = 1": "respond_scenarios([PUSH], [ELASTIC], [0], [0], [1.0])",
    "tails._MAX_TAIL = 1": "respond(BENT, STILL, initial_velocity=0.5)",
    "oscillators._MOST_EVENTS = -100": "respond_oscillator(DECK, PUSH)",
    "oscillators._ROOT_STEPS = 1": "respond_oscillator(DECK, PUSH)",
}
PROGRAM = """
import json, sys
from dataclasses import replace
import numpy as np
from rockframe import *
from rockframe.errors import InternalError
from rockframe.oscillators import kernel as oscillators
from rockframe.rocking.kernels import steps, tails
from tests.rocking.test_touching import BENT, TENDON
ELASTIC = replace(BENT, column_mass=48e3, tendon=TENDON)
TIED = replace(ELASTIC, tendon=replace(TENDON, yield_stress=1.5e9))
PUSH = GroundAcceleration.from_samples(4.0 * np.sin(0.3 * np.arange(60)), 0.02)
STILL = GroundAcceleration.from_samples(np.zeros(3), 0.02)
DECK = IsolatedDeck(strength_ratio=0.06, period=2.0, yield_displacement=0.0)
MODULES = (oscillators, steps, tails)
bounds = [dict(vars(module)) for module in MODULES]
for bound, call in json.loads(sys.argv[1]).items():
    try:
        exec(call)
    except InternalError as error:
        sys.exit("before the bound was lowered: " + str(error))
    exec(bound)
    try:
        exec(call)
    except InternalError as error:
        print(json.dumps([bound, str(error)]))
    for module, names in zip(MODULES, bounds):
        vars(module).update(names)
"""


@pytest.fixture(scope="module")
def reports() -> dict[str, str]:
    """The errors once each bound is lowered, in plain Python: compiled code contains the bounds."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(BOUNDS)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-1000:]
    return dict(json.loads(line) for line in done.stdout.splitlines())


@pytest.mark.parametrize("bound", BOUNDS)
def test_a_loop_that_exceeds_its_bound_is_an_internal_error(
    bound: str, reports: dict[str, str]
) -> None:
    assert reports[bound].startswith("internal error: a loop of the ")
    assert "exceeds its bound. Please report it" in reports[bound]


def test_compiled_code_reports_the_internal_error() -> None:
    with pytest.raises(InternalError, match="exceeds its bound"):
        steps.exceed_bound()
