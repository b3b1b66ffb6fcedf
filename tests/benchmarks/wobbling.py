"""Round columns under both components of the bundled stations, beside a plain solver.

The rival is what a careful user would compile: the Runge-Kutta method of order 4 with theta cos phi
and theta sin phi as variables, and steps that are a share of the time in which the tilt could
vanish. A smaller share is slower and more accurate. Errors are compared in free wobbling, where
energy is conserved exactly: under real motions both differ mostly by how chaos magnifies their
first digits. Times are the least processor time of several repeats.

``--table`` prints the shares that overturn instead: in one plane, and under both components
without loss and for three contacts. ``--margins`` compares robust margins found in steps of 4 and
of 1 %. ``--ratios`` prints the least ratios of times only, with MuJoCo (on PyPI) if it is
installed, and what both directions add to `table1`.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.kernels import processor_time
from tests.benchmarks.size import sized

from rockframe import (
    Ensemble,
    PairAcceleration,
    Pulse,
    RockingFrame,
    bundled_records,
    inertia_ratio_of,
    ingest_stage,
    pair_horizontals,
    read_records,
)
from rockframe.rocking import draws, ensemble_responses, members, quantiles
from rockframe.rocking.margins.robust import IN_ONE_PLANE
from rockframe.wobbling import kernel, wobbling_margins
from rockframe.wobbling.ensemble import family_of
from rockframe.wobbling.response import axial_inertia, constants, integrated, wobble

Float = NDArray[np.float64]

#: Height, width and mass ratio of the structures.
STRUCTURES = {
    "bent": (9.6, 1.6, 4.0),
    "Apollo column": (7.5, 1.8, 0.0),
    "Apollo frame": (7.5, 1.8, 0.3),
}
#: Steps of the rival over the time in which the tilt could vanish.
SHARES = (0.1, 0.02, 0.005)


@numba.njit(error_model="numpy")
def slopes(
    x: float, y: float, vx: float, vy: float, ax: float, ay: float, c: tuple[float, ...]
) -> tuple[float, float, float, float]:
    b, z, h, gamma, i1, i3, a = c
    theta = math.sqrt(x * x + y * y)
    ex, ey = x / theta, y / theta
    sine, cosine = math.sin(theta), math.cos(theta)
    one = 1.0 - cosine
    rate, turn = ex * vx + ey * vy, (ex * vy - ey * vx) / theta
    rho, u = b * one + z * sine, 2.0 * b * one + h * sine
    rho_1, u_1 = b * sine + z * cosine, 2.0 * b * sine + h * cosine
    inertia = rho * rho + gamma * u * u + i1 * sine * sine + i3 * one * one
    half = rho * rho_1 + gamma * u * u_1 + i1 * sine * cosine + i3 * one * sine
    falling = b * cosine - z * sine + gamma * (2.0 * b * cosine - h * sine)
    ar, at = ax * ex + ay * ey, ay * ex - ax * ey
    growth = (half * turn * turn - 9.81 * falling - ar * (rho_1 + gamma * u_1)) / a
    swing = (-at * (rho + gamma * u) - 2.0 * half * rate * turn) / inertia
    outward, sideways = growth - theta * turn * turn, theta * swing + 2.0 * rate * turn
    return vx, vy, ex * outward - ey * sideways, ey * outward + ex * sideways


@numba.njit(error_model="numpy")
def rk4(
    ground: Float, step: float, scale: float, c: tuple[float, ...], share: float, state: Float
) -> float:
    """Return the largest theta, infinite after overturning; `state` is changed to the last one."""
    b, z, h, gamma, _, _, a = c
    limit = 9.81 * (b + 2.0 * gamma * b) / (z + gamma * h)
    fall = 9.81 * (b + 2.0 * gamma * b) / a
    x, y, vx, vy = state
    peak = 0.0
    rest = 0.5e-8 * fall * limit / 9.81  # of the energy at which the frame overturns
    for i in range(ground.shape[0] - 1):
        t = 0.0
        dx, dy = scale * (ground[i + 1] - ground[i]) / step
        while t < step:
            ax, ay = scale * ground[i, 0] + t * dx, scale * ground[i, 1] + t * dy
            if x == 0.0 and y == 0.0:
                strong = math.sqrt(ax * ax + ay * ay)
                if strong <= limit:
                    t += 0.1 * step
                    continue
                x, y = -1e-9 * ax / strong, -1e-9 * ay / strong
            theta, speed = math.sqrt(x * x + y * y), math.sqrt(vx * vx + vy * vy)
            d = min(step - t, share * theta / math.sqrt(speed * speed + 0.5 * fall * theta) + 1e-8)
            q = 0.5 * d
            k1 = slopes(x, y, vx, vy, ax, ay, c)
            mx, my = ax + q * dx, ay + q * dy
            k2 = slopes(x + q * k1[0], y + q * k1[1], vx + q * k1[2], vy + q * k1[3], mx, my, c)
            k3 = slopes(x + q * k2[0], y + q * k2[1], vx + q * k2[2], vy + q * k2[3], mx, my, c)
            mx, my = ax + d * dx, ay + d * dy
            k4 = slopes(x + d * k3[0], y + d * k3[1], vx + d * k3[2], vy + d * k3[3], mx, my, c)
            x += d / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0])
            y += d / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1])
            vx += d / 6.0 * (k1[2] + 2.0 * k2[2] + 2.0 * k3[2] + k4[2])
            vy += d / 6.0 * (k1[3] + 2.0 * k2[3] + 2.0 * k3[3] + k4[3])
            t = step if d == step - t else t + d
            theta = math.sqrt(x * x + y * y)
            peak = max(peak, theta)
            held = ax * ax + ay * ay < limit * limit
            if held and 0.5 * (vx * vx + vy * vy) + fall * theta < rest:
                x = y = vx = vy = 0.0
            if theta > 0.5 * math.pi:
                return math.inf
    state[0], state[1], state[2], state[3] = x, y, vx, vy
    return peak


def frame_of(name: str) -> RockingFrame:
    """Return a structure with solid round columns."""
    height, width, mass_ratio = STRUCTURES[name]
    inertia = inertia_ratio_of("circular", height, width)
    return RockingFrame(
        height=height,
        width=width,
        mass_ratio=mass_ratio,
        inertia_ratio=inertia,
        section="circular",
        name=name,
    )


def numbers(frame: RockingFrame) -> tuple[float, ...]:
    """Return what the rival needs of a frame of cylinders."""
    b, z, gamma = 0.5 * frame.width, frame.centre_height, frame.mass_ratio
    i1 = (frame.inertia_ratio - 1.0) * frame.size**2
    a = b**2 + z**2 + i1 + gamma * (frame.width**2 + frame.height**2)
    return b, z, frame.height, gamma, i1, axial_inertia(frame), a


def energy(c: tuple[float, ...], x: float, y: float, vx: float, vy: float) -> float:
    """Return the energy per mass of a column, of the tilt's components and their rates."""
    b, z, h, gamma, i1, i3, a = c
    theta = math.hypot(x, y)
    rate, turn = (x * vx + y * vy) / theta, (x * vy - y * vx) / theta**2
    sine, one = math.sin(theta), 1.0 - math.cos(theta)
    inertia = (b * one + z * sine) ** 2 + gamma * (2.0 * b * one + h * sine) ** 2
    inertia += i1 * sine**2 + i3 * one**2
    lift = b * sine - z * one + gamma * (2.0 * b * sine - h * one)
    return 0.5 * a * rate**2 + 0.5 * inertia * turn**2 + 9.81 * lift


def stations() -> dict[str, PairAcceleration]:
    """Return both horizontal components of the bundled stations, corrected."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "records.nc")
        ingest_stage([bundled_records()], path)
        pairs, _ = pair_horizontals(read_records(path))
    return {pair.first.station: PairAcceleration.from_pair(pair) for pair in pairs}


def drifts(frame: RockingFrame) -> dict[str, float]:
    """Return the largest change of energy in 10 s of free wobbling, of the kernel and the rival."""
    c, rng = numbers(frame), np.random.default_rng(0)
    still = PairAcceleration(np.zeros(1001), np.zeros(1001), 0.01)
    found: dict[str, list[float]] = {}
    for _ in range(sized(24, 2)):
        theta, turn = rng.uniform(0.1, 0.5) * frame.slenderness, rng.uniform(0.1, 1.0)
        own = wobble(frame, still, contact_shortening=0.0, start=(theta, 0.0, 0.0, turn))
        first = energy(c, theta, 0.0, 0.0, theta * turn)
        last, rate = float(own.theta[-1]), float(own.theta_rate[-1])
        end = energy(c, last, 0.0, rate, last * float(own.phi_rate[-1]))
        found.setdefault("kernel", []).append(abs(end / first - 1.0))
        for share in SHARES:
            state = np.array([theta, 0.0, 0.0, theta * turn])
            rk4(np.zeros((1001, 2)), 0.01, 1.0, c, share, state)
            error = abs(energy(c, *state.tolist()) / first - 1.0)
            found.setdefault(f"rk4_{share}", []).append(error)
    return {name: max(errors) for name, errors in found.items()}


def measure() -> dict[str, float]:
    """Measure the time of 64 members under each station, and the ratio of the rival's to it."""
    results = {}
    for name, error in drifts(frame_of("Apollo column")).items():
        results[f"wobbling_energy_drift_{name}"] = error
    ensemble = Ensemble(members=sized(64, 16))
    scales = draws(ensemble)[:, 3].tolist()
    for station, motion in list(stations().items())[: sized(None, 1)]:
        ground = np.column_stack([motion.x, motion.y])
        for name in list(STRUCTURES)[: sized(None, 1)]:
            family = members(ensemble, frame_of(name))
            pairs = list(zip(family, scales, strict=True))
            rows = [constants(one, contact_shortening=0.0, scale=scale) for one, scale in pairs]
            integrated(motion, rows[:1])  # compile
            own = processor_time(partial(integrated, motion, rows), repeats=3)
            label = f"wobbling_{station}_{name.replace(' ', '_')}"
            results[f"{label}_s"] = own

            def rival(
                share: float,
                ground: Float = ground,
                step: float = motion.time_step,
                pairs: list[tuple[RockingFrame, float]] = pairs,
            ) -> None:
                for one, scale in pairs:
                    rk4(ground, step, scale, numbers(one), share, np.zeros(4))

            for share in SHARES:
                took = processor_time(partial(rival, share), repeats=1)
                results[f"{label}_rk4_{share}_over_kernel"] = took / own
    return results


#: A rigid cylinder on a plane, in MuJoCo: friction 2, stiff contact, resistance to spin.
CYLINDER = """<mujoco><option timestep="{step}" integrator="implicitfast" cone="elliptic"/>
<worldbody>
<geom type="plane" size="50 50 1" friction="2 0.1 0.0001" condim="4" solref="0.002 1"/>
<body pos="0 0 {half}"><freejoint/><geom type="cylinder" size="{radius} {half}" density="2500"
friction="2 0.1 0.0001" condim="4" solref="0.002 1"/></body></worldbody></mujoco>"""


def by_mujoco(frame: RockingFrame, motion: PairAcceleration, step: float = 2e-4) -> float:
    """Return the largest tilt of a column in MuJoCo [rad]; gravity leans as the ground moves."""
    mujoco = importlib.import_module("mujoco")
    sizes = {"half": 0.5 * frame.height, "radius": 0.5 * frame.width, "step": step}
    model = mujoco.MjModel.from_xml_string(CYLINDER.format(**sizes))
    data, peak = mujoco.MjData(model), 0.0
    each = round(motion.time_step / step)
    for i in range(sized(motion.x.size - 1, 20)):
        for k in range(each):
            share = k / each
            lean = [-(1.0 - share) * a[i] - share * a[i + 1] for a in (motion.x, motion.y)]
            model.opt.gravity[:] = (*lean, -9.81)
            mujoco.mj_step(model, data)
        upright = 1.0 - 2.0 * float(data.qpos[4] ** 2 + data.qpos[5] ** 2)
        peak = max(peak, math.acos(min(max(upright, -1.0), 1.0)))
    return peak


#: Options of `table1`, without and with both directions.
DIRECTIONS = ("no-both-directions", "both-directions")


def table1(output: Path, option: str) -> float:
    """Return the processor time of `rockframe table1` [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [sys.executable, "-m", "rockframe", "table1", option, "--output", str(output)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def ratios() -> dict[str, float]:
    """Return the least ratios of times: plain solver of equal error, and MuJoCo where it is there.

    The error of the plain solver with the smallest steps is that of the kernel, within a factor of
    5.
    """
    rivals = [value for name, value in measure().items() if f"rk4_{SHARES[-1]}_over" in name]
    found = {"wobbling_least_rk4_of_equal_error_over_kernel": min(rivals)}
    with tempfile.TemporaryDirectory() as folder:
        plane, both = (table1(Path(folder, name), f"--{name}") for name in DIRECTIONS)
    found["wobbling_table1_both_over_one_plane"] = both / plane
    if importlib.util.find_spec("mujoco") is None:
        return found
    frame, ensemble, least = frame_of("Apollo column"), Ensemble(members=sized(64, 16)), math.inf
    family = family_of(frame, ensemble)
    rows = family.at(np.arange(ensemble.members), draws(ensemble)[:, 3])
    for motion in list(stations().values())[: sized(None, 1)]:
        own = processor_time(partial(integrated, motion, rows), repeats=3) / ensemble.members
        least = min(least, processor_time(partial(by_mujoco, frame, motion), repeats=1) / own)
    return found | {"wobbling_least_mujoco_over_kernel": least}


def table() -> None:
    """Print shares that overturn and quantiles of theta/alpha, in one plane and in both."""
    ensemble = Ensemble(members=sized(400, 16), impact_loss=1.0, corner=1.0)
    scales = draws(ensemble)[:, 3].tolist()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "records.nc")
        ingest_stage([bundled_records()], path)
        pairs, _ = pair_horizontals(read_records(path))
    for pair in pairs[: sized(None, 1)]:
        motion = PairAcceleration.from_pair(pair)
        for name in list(STRUCTURES)[: sized(None, 1)]:
            frame = frame_of(name)
            print(f"{pair.first.station} {name}")
            for record in (pair.first, pair.second):
                [[planar]] = ensemble_responses([record], [frame], ensemble)
                band = " ".join(f"{one:.2f}" for one in planar.bands.peak_rotation_ratio)
                print(f"  {record.component}: {planar.share_overturned:.2f}; {band}")
            for softness in (0.0, 1e-5, 1e-4, 1e-3):
                family = members(ensemble, frame)
                rows = [
                    constants(one, contact_shortening=softness, scale=scale)
                    for one, scale in zip(family, scales, strict=True)
                ]
                verdicts, summaries = integrated(motion, rows)
                peaks = np.where(verdicts == 2, math.inf, summaries[:, kernel.PEAK])
                ratios = peaks / np.array([one.slenderness for one in family])
                band = " ".join(f"{one:.2f}" for one in quantiles(ratios))
                share = float((verdicts == 2).mean())
                print(f"  both, {1e3 * softness:g} mm: {share:.2f}; {band}")


def fewer_scales() -> dict[str, float]:
    """Compare robust margins in steps of 4 and of 1 %, of all stations and structures."""
    changes, times, finer_times = [], 0.0, 0.0
    short = PairAcceleration.from_pulses(*2 * [Pulse(wavelet="full_sine", a_p=3.0, T_p=1.0)])
    wobbling_margins([short], [frame_of("bent")], Ensemble(members=16))  # compile
    for motion in list(stations().values())[: sized(None, 1)]:
        for name in list(STRUCTURES)[: sized(None, 1)]:
            frame, ensemble = frame_of(name), Ensemble(members=sized(64, 16))
            begun = time.process_time()
            [[few]] = wobbling_margins([motion], [frame], ensemble)
            middle = time.process_time()
            [[many]] = wobbling_margins([motion], [frame], ensemble, grid=IN_ONE_PLANE)
            times, finer_times = (
                times + middle - begun,
                finer_times + time.process_time() - middle,
            )
            changes += [
                abs(getattr(few, scale) / getattr(many, scale) - 1.0)
                for scale in ("s10", "s25", "s50")
            ]
    return {
        "wobbling_margins_s": times,
        "wobbling_margins_1_percent_over_4_percent": finer_times / times,
        **{f"wobbling_margins_change_{k}": float(np.quantile(changes, k)) for k in (0.5, 0.9, 1.0)},
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--margins", action="store_true")
    parser.add_argument("--ratios", action="store_true")
    chosen = parser.parse_args(arguments)
    if chosen.table:
        table()
    elif chosen.ratios:
        print(json.dumps(ratios(), indent=2))
    elif chosen.margins:
        print(json.dumps(fewer_scales(), indent=2))
    else:
        print(json.dumps(measure(), indent=2))


if __name__ == "__main__":
    main()
