"""Run round columns in MuJoCo, a program for contacts: `python -m tests.validation.mujoco`.

A rigid cylinder stands on a plane. The ground does not move: gravity leans, which is the same. Each
response is a line of mujoco.csv; a run that is repeated resumes after the last line. The columns
wobble freely, pass upright, and are shaken by both components of the bundled stations.
"""

from __future__ import annotations

import argparse
import csv
import importlib
import itertools
import math
import random
import time
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray
from tests.benchmarks.wobbling import stations
from tests.validation.cases import ENVELOPE, SHIFTS, STRONG

from rockframe.frame import RockingFrame
from rockframe.units import GRAVITY
from rockframe.wobbling import PairAcceleration

Float: TypeAlias = NDArray[np.float64]

RESULTS: Final = Path(__file__).resolve().parent / "mujoco.csv"
#: Heights and diameters of columns [m]; the first is shaken by all motions.
COLUMNS: Final = {
    "column": (7.5, 1.8),
    "pier": (9.6, 1.6),
    "short": (4.0, 1.0),
    "tall": (10.0, 1.6),
}
#: Multiples of each motion; some make the column stand, some overturn.
SCALES: Final = (0.5, 0.7, 1.0, 1.4, 2.0)
#: Copies of a motion with random phases, the same ones added to both components.
SIMULATED: Final = 4
#: Angle of the turned copies [degree].
TURN: Final = 45.0
#: One in this number of motions is repeated with half the step, turned, and by the pier.
_OTHERS: Final = 3
#: One in this number of motions is repeated with a contact that does not resist spin.
_WITHOUT_SPIN: Final = 2
#: Time step, and time constant of the contact [s].
STEP, SOFTNESS = 2.0e-4, 2.0e-3
#: Tilt at which a column has overturned [rad]; time without motion after a record [s].
_FALLEN, _REST = 1.2, 3.0
#: Released tilt over the slenderness, rates of precession [rad s-1], and duration [s].
FREE: Final = ((0.4, 1.2), (0.3, 0.5), (0.6, 0.2))
FREE_TIME: Final = 10.0
#: Rates of precession of the passes near upright [rad s-1], and time constants of the contact [s].
PRECESSIONS: Final = (0.003, 0.01, 0.05)
SOFTNESSES: Final = (5.0e-4, 2.0e-3, 5.0e-3)
_MODEL: Final = """<mujoco>
<option timestep="{step}" integrator="implicitfast" cone="elliptic"><flag energy="enable"/></option>
<worldbody><geom type="plane" size="50 50 1" friction="2 0.1 0.0001" condim="{kinds}"
solref="{softness} 1"/><body pos="0 0 {half}"><freejoint/><geom type="cylinder"
size="{radius} {half}" density="2500" friction="2 0.1 0.0001" condim="{kinds}"
solref="{softness} 1"/></body></worldbody></mujoco>"""


@dataclass(frozen=True)
class Task:
    """One response: a column, a motion at a scale, a contact, and a start.

    A contact with `spin` 1 resists spin about its normal, which the model excludes.
    """

    column: str
    motion: str
    scale: float = 1.0
    spin: int = 1
    step: float = STEP
    softness: float = SOFTNESS
    turned: float = 0.0
    tilt: float = 0.0
    precession: float = 0.0


@dataclass(frozen=True)
class Result:
    """Numbers that are kept of a response.

    Parameters
    ----------
    peak_ratio : float
        Largest tilt over the slenderness [1].
    overturned : int
        1 if it is so.
    least_ratio : float
        Least tilt over the slenderness [1], of columns that wobble freely.
    energy : float
        Energy at the end over that at the start [1], of columns that wobble freely.
    speed : float
        Speed of the tilt before the least one [rad s-1].
    histories : str
        Tilt over the slenderness at each half second, of columns that wobble freely.
    seconds : float
        Processor time [s].
    """

    peak_ratio: float
    overturned: int
    least_ratio: float
    energy: float
    speed: float
    histories: str
    seconds: float


def frame_of(name: str) -> RockingFrame:
    """Return a column as the package takes it."""
    height, width = COLUMNS[name]
    return RockingFrame(height=height, width=width, section="circular", name=name)


@lru_cache(maxsize=1)
def motions() -> dict[str, PairAcceleration]:
    """Return the motions by name: copies of the strong parts of both components of stations."""
    return {name: copy for part in _strong_parts() for name, copy in _copies(*part)}


def _strong_parts() -> Iterator[tuple[str, PairAcceleration]]:
    for station, pair in stations().items():
        squares = pair.x**2 + pair.y**2
        growth = np.cumsum(squares) / squares.sum()
        first, last = np.searchsorted(growth, STRONG)
        yield station, PairAcceleration(pair.x[first:last], pair.y[first:last], pair.time_step)


def _copies(station: str, pair: PairAcceleration) -> Iterator[tuple[str, PairAcceleration]]:
    """Yield copies whose Fourier phases are shifted alike in both components."""
    both, step = np.array([pair.x, pair.y]), pair.time_step
    size = both.shape[1]
    lines = np.fft.rfft(both)
    for shift in SHIFTS:
        x, y = np.fft.irfft(lines * np.exp(1j * np.deg2rad(shift)), size)
        yield f"{station}/shifted-{shift:g}", PairAcceleration(x, y, step)
    squares = scipy.ndimage.gaussian_filter1d((both**2).sum(axis=0), ENVELOPE / step)
    envelope = np.sqrt(squares)
    lines = np.fft.rfft(both / envelope)
    for number in range(1, SIMULATED + 1):
        rng = np.random.default_rng([*station.encode(), number])
        phases = rng.uniform(0.0, 2.0 * np.pi, lines.shape[1])
        x, y = envelope * np.fft.irfft(lines * np.exp(1j * phases), size)
        yield f"{station}/simulated-{number}", PairAcceleration(x, y, step)


def tasks() -> list[Task]:
    """Return all tasks: free wobbling, passes near upright, then motions in random order."""
    free = [
        Task(name, "free", 0.0, step=step, softness=softness, tilt=tilt, precession=rate)
        for name in COLUMNS
        for tilt, rate in FREE
        for step, softness in ((STEP, SOFTNESS), (0.5 * STEP, SOFTNESS), (STEP, 2.0 * SOFTNESS))
    ]
    passes = [
        Task(name, "pass", 0.0, step=0.05 * softness, softness=softness, tilt=0.3, precession=rate)
        for name in ("column", "short", "tall")
        for softness in SOFTNESSES
        for rate in PRECESSIONS
    ]
    shaken = [(name, scale) for name in sorted(motions()) for scale in SCALES]
    random.Random(1).shuffle(shaken)  # noqa: S311  (an order, not a secret)
    main = [Task("column", *motion) for motion in shaken]
    without = [Task("column", *motion, spin=0) for motion in shaken[::_WITHOUT_SPIN]]
    others = [
        variant
        for motion in shaken[::_OTHERS]
        for variant in (
            Task("column", *motion, step=0.5 * STEP),
            Task("column", *motion, turned=TURN),
            Task("pier", *motion),
        )
    ]
    return [*free, *passes, *main, *without, *others]


def respond(task: Task) -> Result:
    """Return the response of a column in MuJoCo."""
    begun = time.process_time()
    mujoco: Any = importlib.import_module("mujoco")
    frame = frame_of(task.column)
    sizes = {"half": 0.5 * frame.height, "radius": 0.5 * frame.width}
    text = _MODEL.format(
        **sizes, step=task.step, softness=task.softness, kinds=4 if task.spin else 3
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    _start(data, task.tilt * frame.slenderness, task.precession, **sizes)
    if task.scale:
        tilts, energy = _shaken(mujoco, model, data, task), math.nan
    else:
        tilts, energy = _freely(mujoco, model, data, task)
    ratios = tilts / frame.slenderness
    least = int(ratios.argmin())
    speed = float(np.abs(np.diff(tilts[: least + 1])).max(initial=0.0)) / task.step
    every = max(round(0.5 / task.step), 1) if task.motion == "free" else ratios.size
    halves: list[float] = ratios[::every].tolist()
    return Result(
        peak_ratio=float(ratios.max()),
        overturned=int(tilts.max() >= _FALLEN),
        least_ratio=float(ratios[least]),
        energy=energy,
        speed=speed,
        histories=" ".join(f"{ratio:.5f}" for ratio in halves),
        seconds=round(time.process_time() - begun, 2),
    )


def _start(data: Any, tilt: float, precession: float, half: float, radius: float) -> None:
    """Put a column at a tilt along x, rolling on its rim with a rate of precession."""
    sine, cosine = math.sin(tilt), math.cos(tilt)
    axis = np.array([sine, 0.0, cosine])
    turning = precession * (np.array([0.0, 0.0, 1.0]) - axis)
    contact = np.array([radius * cosine - half * sine, 0.0, -radius * sine - half * cosine])
    data.qpos[:] = 0.0, 0.0, -contact[2], math.cos(0.5 * tilt), 0.0, math.sin(0.5 * tilt), 0.0
    data.qvel[:3] = np.cross(turning, -contact)
    # the rates of a free body are in its own axes: turned back about y
    data.qvel[3:] = (
        cosine * turning[0] - sine * turning[2],
        turning[1],
        sine * turning[0] + cosine * turning[2],
    )


def _tilt(data: Any) -> float:
    upright = 1.0 - 2.0 * float(data.qpos[4] ** 2 + data.qpos[5] ** 2)
    return math.acos(min(max(upright, -1.0), 1.0))


def _freely(mujoco: Any, model: Any, data: Any, task: Task) -> tuple[Float, float]:
    """Return the tilts of a column without ground motion [rad], and the energy that is left.

    A column that passes upright is followed until it has risen to half its first tilt, or stops.
    """
    mujoco.mj_forward(model, data)
    weight = GRAVITY * float(model.body_mass[1])
    at_rest = weight * 0.5 * frame_of(task.column).height

    def energy() -> float:
        return float(data.energy.sum()) - at_rest

    first, tilts, passed = energy(), [_tilt(data)], False
    for _ in range(round(FREE_TIME / task.step)):
        mujoco.mj_step(model, data)
        tilts.append(_tilt(data))
        passed |= tilts[-1] < 0.3 * tilts[0]
        if (
            task.motion == "pass"
            and passed
            and tilts[-1] < tilts[-2]
            and tilts[-1] > 0.4 * tilts[0]
        ):
            break
    mujoco.mj_forward(model, data)
    return np.array(tilts), energy() / first


def _shaken(mujoco: Any, model: Any, data: Any, task: Task) -> Float:
    """Return the tilts of a column under a motion and after it, at samples and below [rad]."""
    motion = motions()[task.motion].scaled(task.scale).turned(task.turned)
    each, rest = round(motion.time_step / task.step), round(_REST / motion.time_step)
    samples = np.zeros((motion.x.size + rest, 3))
    samples[: motion.x.size, :2] = -np.column_stack([motion.x, motion.y])
    samples[:, 2] = -GRAVITY
    tilts = []
    for before, after in itertools.pairwise(samples):
        for k in range(each):
            model.opt.gravity[:] = before + (after - before) * ((k + 0.5) / each)
            mujoco.mj_step(model, data)
        tilts.append(_tilt(data))
        if tilts[-1] > _FALLEN:
            break
    return np.array(tilts)


def read() -> dict[Task, Result]:
    """Return the results so far."""
    if not RESULTS.exists():
        return {}
    kinds = {"str": str, "int": int, "float": float}
    with RESULTS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    results = {}
    for row in rows:
        values = [
            kinds[str(field.type)](text)
            for field, text in zip((*fields(Task), *fields(Result)), row, strict=True)
        ]
        size = len(fields(Task))
        results[Task(*values[:size])] = Result(*values[size:])
    return results


def main() -> None:
    """Run the tasks that are not done."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="longest duration [minutes]")
    end = time.monotonic() + 60.0 * parser.parse_args().minutes
    done = read()
    if not done:
        head = [field.name for field in (*fields(Task), *fields(Result))]
        RESULTS.write_text(",".join(head) + "\n", encoding="utf-8")
    for task in tasks():
        if task in done:
            continue
        if time.monotonic() > end:
            break
        with RESULTS.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(
                [*astuple(task), *astuple(respond(task))]
            )
    print(f"{len(read())} responses in {RESULTS.name}")


if __name__ == "__main__":
    main()
