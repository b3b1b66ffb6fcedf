"""The vectorised kernel compared with the scalar one, on ten thousand scenarios of every kind.

Small bounces magnify differences from one to the next, up to a billionfold in rough motions. The
two kernels then differ although both are right. Therefore the difference between the kernels is
compared with the change of the scalar kernel's result when the scale changes by 1e-13.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe import (
    GroundAcceleration,
    Pulse,
    RockingFrame,
    Scenarios,
    inertia_ratio_of,
    respond,
    respond_many,
    respond_scenarios,
)
from rockframe.parts import Tendon
from rockframe.rocking import scenarios
from rockframe.rocking.kernels import kernel, steps, vectors
from rockframe.rocking.response import as_ground, vertical_in_g
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Index = NDArray[np.intp]

FRAMES = (
    RockingFrame(height=9.6, width=1.6, mass_ratio=4.0),
    RockingFrame(height=9.6, width=1.6),
    RockingFrame(height=2.0, width=0.4),
    RockingFrame(height=0.3, width=0.1, mass_ratio=1.0),
    RockingFrame(height=20.0, width=2.0, restitution_factor=0.8),
    RockingFrame(height=2.0, width=1.5),
    RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, restitution_factor=1.03),
    RockingFrame(height=4.0, width=0.6, inertia_ratio=inertia_ratio_of("circular", 4.0, 0.6)),
)
TIED = replace(
    FRAMES[0],
    column_mass=48e3,
    tendon=Tendon(area=1e-4, modulus=195e9, length=9.6, prestress=1e5),
)
FREE = (FRAMES[0], FRAMES[3])
TIMES = ("uplift_time", "overturning_time")
COUNT = 10_000


def noise(seed: int, samples: int, step: float, window: int) -> GroundAcceleration:
    """Return white noise of 1 g, smoothed over a window of samples."""
    white = np.random.default_rng(seed).normal(size=samples)
    smooth = np.convolve(white, np.hanning(window + 2)[1:-1], "same")
    return GroundAcceleration.from_samples(GRAVITY * smooth / np.abs(smooth).max(), step)


def motions() -> list[GroundAcceleration]:
    """Return rough and smooth records of four time steps, and pulses; some are also vertical."""
    steps, windows = (0.0025, 0.005, 0.01, 0.02), (1, 5, 21)
    found = [noise(k, 400, steps[k % 4], windows[k % 3]) for k in range(12)]
    found += [
        noise(50 + k, 300, 0.01, 9).with_vertical(noise(70 + k, 300, 0.01, 5).scaled(0.25))
        for k in range(4)
    ]
    pulses = [
        as_ground(Pulse(wavelet=wavelet, a_p=GRAVITY, T_p=period))
        for wavelet in ("symmetric_ricker", "antisymmetric_ricker")
        for period in (0.4, 1.0, 2.5)
    ]
    return [*found, *pulses, pulses[1].with_vertical(pulses[4].scaled(0.25))]


@dataclass(frozen=True)
class Asked:
    """The scenarios, and their results with both kernels."""

    ground: Index
    frame: Index
    scale: Float
    lanes: Scenarios
    found: dict[float, tuple[NDArray[np.int8], Float]] = field(default_factory=dict)

    def scalar(self, factor: float = 1.0) -> tuple[NDArray[np.int8], Float]:
        """Return verdicts and summaries of the scalar kernel at the scales times a factor."""
        if factor not in self.found:
            self.found[factor] = self._computed(factor)
        return self.found[factor]

    def _computed(self, factor: float) -> tuple[NDArray[np.int8], Float]:
        verdicts = np.empty(COUNT, dtype=np.int8)
        summaries = np.empty((COUNT, kernel.SUMMARY_SIZE))
        constants = np.array(
            [(f.slenderness, f.effective_frequency_parameter, f.restitution) for f in FRAMES]
        )
        for k, motion in enumerate(motions()):
            some = np.flatnonzero(self.ground == k)
            verdict = np.empty(some.size, dtype=np.int8)
            summary = np.empty((some.size, kernel.SUMMARY_SIZE))
            slenderness, frequency, restitution = np.ascontiguousarray(
                constants[self.frame[some]].T
            )
            kernel.integrate_many(
                np.ascontiguousarray(motion.coefficients / GRAVITY),
                np.ascontiguousarray(vertical_in_g(motion)),
                motion.time_step,
                motion.start_time,
                factor * self.scale[some],
                slenderness,
                frequency,
                restitution,
                verdict,
                summary,
                (),
                np.empty((0, 10)),
            )
            verdicts[some], summaries[some] = verdict, summary
        return verdicts, summaries


@pytest.fixture(scope="module")
def asked() -> Asked:
    rng = np.random.default_rng(20)
    ground = rng.integers(0, len(motions()), COUNT)
    frame = rng.integers(0, len(FRAMES), COUNT)
    slenderness = np.array([f.slenderness for f in FRAMES])
    scale = np.minimum(slenderness[frame] * rng.uniform(0.8, 4.0, COUNT), 3.5)
    return Asked(ground, frame, scale, respond_scenarios(motions(), FRAMES, ground, frame, scale))


def test_sine_and_cosine_of_the_lanes_are_exact_to_round_off() -> None:
    angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 201)
    found = np.array([vectors._sine_cosine(x) for x in angles.tolist()])  # noqa: SLF001
    np.testing.assert_allclose(found[:, 0], np.sin(angles), rtol=0, atol=4e-16)
    np.testing.assert_allclose(found[:, 1], np.cos(angles), rtol=0, atol=4e-16)


def hopped(
    theta: float, rates: Float, alpha: float, p2: float, peak: float, across: tuple[float, ...]
) -> Callable[[int], Float]:
    """Return the rows of a pack after a hop, in which only the rates differ."""
    pack = np.zeros(vectors.PACK_SIZE)
    rows = pack.reshape(-1, vectors.WIDTH)
    for slot, value in (
        (vectors.THETA, theta),
        (vectors.OMEGA, rates),
        (vectors.ALPHA, alpha),
        (vectors.P2, p2),
        (vectors.PEAK, peak),
        (vectors.A, p2 * across[0]),
        (vectors.A + vectors.WIDTH, p2 * across[1]),
    ):
        rows[slot // vectors.WIDTH] = value
    vectors.hop(pack, steps.NO, steps.NO, steps.NO)
    return lambda slot: np.asarray(rows[slot // vectors.WIDTH])


def test_no_hop_lands_before_or_after_its_landing() -> None:
    """Against a pull that is nearly zero at first, the slowest bounces are not located in the few
    steps of Newton's method, and remain for the scalar kernel.
    """
    alpha, p2, peak = 0.15, 1e-4, 0.1
    across = (-math.tan(alpha) * (1.0 - 1e-6), 1.0, *(0.0,) * 8)
    rates = np.geomspace(1e-10, 1e-6, vectors.WIDTH)
    row = hopped(0.0, rates, alpha, p2, peak, across)
    located = row(vectors.KIND) == vectors.HOP_LANDED
    assert 3 < located.sum() < vectors.WIDTH - 3
    none = (0.0,) * 10
    for k in np.flatnonzero(located).tolist():
        c = steps.taylor(0.0, rates[k], 1.0, across, none, alpha, p2, steps.MOVING, ())
        _, t, _, omega, *_ = steps.flight(c, 1.0, 1.0, steps.MOVING, peak)
        assert row(vectors.TAU)[k] == pytest.approx(t, rel=1e-12)
        assert row(vectors.OMEGA_AFTER)[k] == pytest.approx(omega, rel=1e-12)


def test_only_lanes_that_turn_in_a_hop_have_a_new_peak() -> None:
    """The others still rise at its end; where they turn, the peak is that of a parabola."""
    theta, alpha, p2, before = 0.01, 0.15, 1e-4, 0.005
    rates = np.geomspace(1e-6, 1e-3, vectors.WIDTH)
    row = hopped(theta, rates, alpha, p2, before, (0.0, 0.0))
    turned = row(vectors.OMEGA_AFTER) < 0.0
    assert 3 < turned.sum() < vectors.WIDTH - 3
    crest = theta + rates**2 / (2.0 * p2 * math.sin(alpha - theta))
    expected = np.where(turned, crest, before)
    np.testing.assert_allclose(row(vectors.PEAK), expected, rtol=1e-7)


def relative(ours: Float, theirs: Float) -> Float:
    return np.abs(ours - theirs) / np.maximum(np.abs(theirs), np.finfo(np.float64).tiny)


def test_closing_a_block_keeps_its_scenarios_and_those_that_wait() -> None:
    block, who = 3 * vectors.WIDTH, 2 * vectors.WIDTH
    pool = np.random.default_rng(2).uniform(size=(3, 3, vectors.WIDTH))
    scenario = pool[:, 2]
    scenario[:] = np.arange(3 * vectors.WIDTH).reshape(3, -1)
    scenario[:2, 3::4] = scenario[2, ::2] = -1.0
    seated = {lane[2]: tuple(lane) for lane in pool.transpose(0, 2, 1).reshape(-1, 3)} | {-1.0: ()}
    waiting = np.array([2 * block + 1, 4, 2 * block + 15, 2 * block + 1], dtype=np.uint32)
    awaited = pool.ravel()[waiting[:3] + who]
    close = cast("Any", vectors.close_block).py_func
    close(pool.reshape(-1), 2 * block, block, who, waiting, 3)
    left = {lane[2]: tuple(lane) for lane in pool[:2].transpose(0, 2, 1).reshape(-1, 3)}
    assert left | {-1.0: ()} == seated
    np.testing.assert_array_equal(pool.ravel()[waiting[:3] + who], awaited)
    assert max(waiting[:3]) < 2 * block
    assert waiting[3] == 2 * block + 1  # no lane waits there


def test_vectors_of_the_lanes_lie_on_one_cache_line_each() -> None:
    in_python = cast("Any", vectors.zeros).py_func
    arrays = [zeros(count) for zeros in (in_python, vectors.zeros) for count in (3, 40, 700)]
    assert [(array.size, array.any()) for array in arrays] == [
        (3, False),
        (40, False),
        (700, False),
    ] * 2
    assert {array.ctypes.data % 64 for array in arrays} == {0}


def test_same_verdicts_and_times(asked: Asked) -> None:
    verdict, summary = asked.scalar()
    nearby, _ = asked.scalar(1.0 + 1e-13)
    counts = np.bincount(verdict)
    assert counts.min() > 500, "too few of one kind to tell anything"
    np.testing.assert_array_equal(
        asked.lanes.verdict[verdict == nearby], verdict[verdict == nearby]
    )
    np.testing.assert_allclose(
        asked.lanes.uplift_time, summary[:, kernel.UPLIFT_TIME], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        asked.lanes.overturning_time, summary[:, kernel.OVERTURNING_TIME], rtol=0, atol=1e-6
    )


@pytest.mark.parametrize(
    ("field", "slot"), [("peak_rotation", 0), ("peak_velocity", 5), ("impact_velocity", 6)]
)
def test_same_peaks(asked: Asked, field: str, slot: int) -> None:
    _, summary = asked.scalar()
    widths = np.array([f.width for f in FRAMES])[asked.frame] if slot == 6 else 1.0
    difference = relative(getattr(asked.lanes, field) / widths, summary[:, slot])
    others = np.array(
        [
            relative(asked.scalar(factor)[1][:, slot], summary[:, slot])
            for factor in (1.0 + 1e-13, 1.0 - 1e-13, 1.0 + 3e-13)
        ]
    )
    well_posed = others.max(axis=0) < 1e-11
    assert well_posed.sum() > 0.75 * COUNT
    assert difference[well_posed].max() < 1e-10
    assert np.median(difference) < 1e-12
    assert (difference > 1e-9).sum() < 1.5 * (others[2] > 1e-9).sum()


def test_same_impacts(asked: Asked) -> None:
    _, summary = asked.scalar()
    same = asked.lanes.impacts == summary[:, kernel.IMPACTS]
    assert same.mean() > 0.998


def test_bounces_that_die_out_are_counted_as_if_followed() -> None:
    """Under a weak constant push the frame bounces hundreds of times until it rests."""
    column = FRAMES[2]
    push = np.full((1500, 1), 0.1 * column.uplift_acceleration)
    push[:10] = 2.0 * column.uplift_acceleration
    ground = GroundAcceleration(push, 0.01)
    scale = np.linspace(0.7, 1.3, 32)
    zero = np.zeros(scale.size, dtype=np.intp)
    found = respond_scenarios([ground], [column], zero, zero, scale)
    followed = [respond(column, ground.scaled(s)).impacts for s in scale.tolist()]
    assert found.impacts.min() > 200
    np.testing.assert_array_equal(found.impacts, followed)


def test_a_bounce_that_is_summed_up_may_be_the_highest() -> None:
    """After a tiny uplift, the ground pushes almost enough to uplift the other side."""
    column = FRAMES[2]
    push = np.full((40, 1), -0.999 * column.uplift_acceleration)
    push[0] = (1.0 + 1e-9) * column.uplift_acceleration
    ground = GroundAcceleration(push, 0.01)
    found = respond_scenarios([ground], [column], [0], [0], [1.0])
    assert found.peak_rotation[0] == pytest.approx(respond(column, ground).peak_rotation, rel=1e-6)


def test_bounces_that_the_next_push_interrupts_are_followed() -> None:
    """Without the push, the frame would rest a hundredth of an interval after its start."""
    column, step = FRAMES[2], 0.005
    push = np.zeros((1200, 1))
    push[:20] = 2.0 * column.uplift_acceleration
    alone = GroundAcceleration(push, step)
    scales = 1.0, 1.001
    rests = [respond(column, alone.scaled(s)).impact_times[-1] / step for s in scales]
    start = math.ceil(rests[0])
    assert rests[0] < start + 0.01 < rests[1]
    scale = float(np.interp(start + 0.01, rests, scales))
    push[start] = 1.3 * column.uplift_acceleration
    ground = GroundAcceleration(push, step)
    found = respond_scenarios([ground], [column], [0], [0], [scale])
    assert found.impacts[0] == respond(column, ground.scaled(scale)).impacts


def few(degree: int, vertical: bool) -> GroundAcceleration:
    """Return a motion of 60 intervals."""

    def made(strength: float, period: float) -> GroundAcceleration:
        return GroundAcceleration.from_function(
            lambda t: strength * np.sin(math.tau * t / period) * np.exp(-(((t - 1.0) / 0.6) ** 2)),
            *(0.0, 2.4),
            intervals=60,
            degree=degree,
        )

    return made(2.0, 0.9).with_vertical(made(0.6, 0.35)) if vertical else made(2.0, 0.9)


@pytest.mark.parametrize(
    ("frames", "degree", "vertical"),
    [
        *((FREE, degree, vertical) for degree in (1, 5) for vertical in (False, True)),
        *(((TIED,), 1, False), ((TIED,), 1, True), ((TIED,), 5, False)),
    ],
)
def test_each_form_of_the_vectorised_kernel(
    frames: tuple[RockingFrame, ...],
    degree: int,
    vertical: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So few scenarios that the test also runs without compilation, in half a second."""
    scales = np.array([0.5, -1.0, 1.6, -2.5, 4.0, -9.0])
    _assert_same_as_followed(few(degree, vertical), frames, scales, monkeypatch)


def test_bounces_in_the_interval_of_the_uplift(monkeypatch: pytest.MonkeyPatch) -> None:
    """The ground exceeds the uplift acceleration for a part of one interval, and falls to zero."""
    crest = FRAMES[0].uplift_acceleration
    brief = GroundAcceleration.from_function(
        lambda t: crest * (1.0 - ((t - 0.016) / 0.02) ** 2), 0.0, 0.04, intervals=1, degree=5
    )
    scales = 1.0 + np.geomspace(1e-3, 0.3, 15)
    _assert_same_as_followed(brief.followed_by_rest(0.12), FRAMES[:1], scales, monkeypatch)


def _assert_same_as_followed(
    ground: GroundAcceleration,
    frames: tuple[RockingFrame, ...],
    scales: Float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Compare with the scalar kernel, which computes all when no piece is left for the other."""
    ours = respond_many([ground], frames, scales)
    monkeypatch.setattr(scenarios, "_MOST_PIECES", 0)
    theirs = respond_many([ground], frames, scales)
    for name in ("verdict", "impacts"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    for name in ("peak_rotation", "peak_velocity", "impact_velocity", *TIMES):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-10)
