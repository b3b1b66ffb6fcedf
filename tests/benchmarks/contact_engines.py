"""Blocks and round columns in rigid-body engines: `python -m tests.benchmarks.contact_engines`.

Three programs follow a free block and a free cylinder on a plane, with several contacts and steps:
MuJoCo, PyBullet and Drake (points, or hydroelastic contact of a stated modulus). The table has, for
each size of SIZES,

- the loss of an impact, -ln of the velocity ratio, over that of equation (43): the mean of the
  impacts between the first peaks of a block that is released at half its slenderness; the ratio
  follows from the heights of two peaks, so what the motion between them loses is in it;
- the time in which a block falls from 1.02 times its slenderness to 1 rad, over the exact one;
- the energy that a cylinder has left after 10 s of wobbling, released at half its slenderness with
  a precession of 0.4 and of 0.04 p: the second passes upright at about 0.02 of the slenderness.
  Rolling loses nothing, so it should be 1.

Friction is 2, and no program adds damping of free motion. It takes three minutes of processor time,
and needs `pip install mujoco==4.0.0 pybullet==3.2.7 drake==1.51.1`; what is absent is left out. A
finer table has more rows in CASES.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from tests.benchmarks.size import sized

from rockframe import RockingFrame
from rockframe.units import GRAVITY

Float: TypeAlias = NDArray[np.float64]
#: Height of the centre [m], axis, velocity of the centre and rotation of a body.
State: TypeAlias = tuple[float, Float, Float, Float]
#: Functions that take one step, and that return the state.
Program: TypeAlias = tuple[Callable[[], Any], Callable[[], State]]

#: Widths and heights [m]: the Apollo column, and a slender one.
SIZES: Final = ((1.8, 7.5), (0.2, 2.0))
DENSITY: Final = 2500.0
#: Largest number of impacts, rates of precession over p, duration of wobbling [s].
IMPACTS: Final = 4
PRECESSIONS: Final = (0.4, 0.04)
WOBBLING: Final = sized(10.0, 0.5)


@dataclass(frozen=True)
class Body:
    """A block, or a cylinder if it is round, leaning and rolling on its rim.

    Parameters
    ----------
    width, height : float
        Size [m].
    round : bool
        True for a cylinder.
    tilt : float
        First tilt [rad].
    precession : float
        First rate of precession [rad s-1].
    """

    width: float
    height: float
    round: bool
    tilt: float
    precession: float = 0.0

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        share = 0.25 * math.pi if self.round else 1.0
        return share * DENSITY * self.width**2 * self.height

    @property
    def inertia(self) -> tuple[float, float]:
        """Inertia about a transverse axis and about the axis [kg m2]."""
        if self.round:
            squares = (self.width**2 / 16.0 + self.height**2 / 12.0, self.width**2 / 8.0)
        else:
            squares = ((self.width**2 + self.height**2) / 12.0, self.width**2 / 6.0)
        return self.mass * squares[0], self.mass * squares[1]

    @property
    def start(self) -> tuple[float, Float, Float]:
        """Height of the centre [m], its velocity [m s-1] and the rotation [rad s-1]."""
        sine, cosine = math.sin(self.tilt), math.cos(self.tilt)
        b, h = 0.5 * self.width, 0.5 * self.height
        turning = self.precession * np.array([-sine, 0.0, 1.0 - cosine])
        contact = np.array([b * cosine - h * sine, 0.0, -b * sine - h * cosine])
        return -float(contact[2]), np.cross(turning, -contact), turning

    def energy(self, state: State) -> float:
        """Return the energy over that upright at rest [J]."""
        height, axis, velocity, turning = state
        across, along = self.inertia
        spin = turning @ axis
        moving = self.mass * (velocity @ velocity) + across * (turning @ turning - spin**2)
        rise = height - 0.5 * self.height
        return float(0.5 * (moving + along * spin**2) + self.mass * GRAVITY * rise)


def mujoco(body: Body, step: float, softness: float, points: int = 4) -> Program:
    """Return a body in MuJoCo, on a contact of this time constant [s]."""
    engine: Any = importlib.import_module("mujoco")
    b, h = 0.5 * body.width, 0.5 * body.height
    shape = f'type="cylinder" size="{b} {h}"' if body.round else f'type="box" size="{b} {b} {h}"'
    contact = f'friction="2 0.1 0.0001" condim="{points}" solref="{softness} 1"'
    model = engine.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" cone="elliptic" gravity="0 0 -{GRAVITY}"/><worldbody>'
        f'<geom type="plane" size="50 50 1" {contact}/><body><freejoint/>'
        f'<geom {shape} density="{DENSITY}" {contact}/></body></worldbody></mujoco>'
    )
    data = engine.MjData(model)
    half = 0.5 * body.tilt
    centre, velocity, turning = body.start
    data.qpos[:] = 0.0, 0.0, centre, math.cos(half), 0.0, math.sin(half), 0.0
    matrix = np.zeros(9)
    engine.mju_quat2Mat(matrix, data.qpos[3:])
    data.qvel[:3], data.qvel[3:] = velocity, matrix.reshape(3, 3).T @ turning

    def state() -> State:
        engine.mju_quat2Mat(matrix, data.qpos[3:])
        axes = matrix.reshape(3, 3)
        return data.qpos[2], axes[:, 2].copy(), data.qvel[:3].copy(), axes @ data.qvel[3:]

    return lambda: engine.mj_step(model, data), state


def pybullet(body: Body, step: float, stiffness: float = 0.0) -> Program:
    """Return a body in PyBullet, on its own contact or one of this stiffness [N/m]."""
    engine: Any = importlib.import_module("pybullet")
    if not engine.isConnected():
        engine.connect(engine.DIRECT)
    engine.resetSimulation()
    engine.setGravity(0.0, 0.0, -GRAVITY)
    engine.setPhysicsEngineParameter(fixedTimeStep=step)
    b, h = 0.5 * body.width, 0.5 * body.height
    shape = (
        engine.createCollisionShape(engine.GEOM_CYLINDER, radius=b, height=2.0 * h)
        if body.round
        else engine.createCollisionShape(engine.GEOM_BOX, halfExtents=[b, b, h])
    )
    floor = engine.createMultiBody(0, engine.createCollisionShape(engine.GEOM_PLANE))
    half = 0.5 * body.tilt
    centre, velocity, turning = body.start
    turned = [0.0, math.sin(half), 0.0, math.cos(half)]
    solid = engine.createMultiBody(
        body.mass, shape, basePosition=[0, 0, centre], baseOrientation=turned
    )
    damping = {"linearDamping": 0.0, "angularDamping": 0.0}
    for part in (floor, solid):
        engine.changeDynamics(part, -1, lateralFriction=math.sqrt(2.0), restitution=0.0, **damping)
        if stiffness:
            contact = {"contactStiffness": stiffness, "contactDamping": 1e-3 * stiffness}
            engine.changeDynamics(part, -1, **contact)
    engine.changeDynamics(solid, -1, activationState=engine.ACTIVATION_STATE_DISABLE_SLEEPING)
    engine.resetBaseVelocity(solid, velocity.tolist(), turning.tolist())

    def state() -> State:
        place, turned = engine.getBasePositionAndOrientation(solid)
        axes = np.array(engine.getMatrixFromQuaternion(turned)).reshape(3, 3)
        moving, turning = engine.getBaseVelocity(solid)
        return place[2], axes[:, 2], np.array(moving), np.array(turning)

    return engine.stepSimulation, state


def drake(
    body: Body,
    step: float,
    modulus: float = 0.0,
    stiffness: float | None = None,
    dissipation: float | None = None,
) -> Program:
    """Return a body in Drake, of this hydroelastic modulus [Pa], or on points of this stiffness.

    The stiffness [N m-1] and the dissipation [s m-1] are Drake's defaults unless they are stated.
    """
    engine: Any = importlib.import_module("pydrake.all")
    builder = engine.DiagramBuilder()
    plant, _ = engine.AddMultibodyPlantSceneGraph(builder, step)
    across, along = (value / body.mass for value in body.inertia)
    unit = engine.UnitInertia(across, across, along)
    solid = plant.AddRigidBody("solid", engine.SpatialInertia(body.mass, np.zeros(3), unit))
    b, h = 0.5 * body.width, 0.5 * body.height
    shapes = (
        (solid, engine.Cylinder(b, 2.0 * h) if body.round else engine.Box(2 * b, 2 * b, 2 * h)),
        (plant.world_body(), engine.HalfSpace()),
    )
    friction = engine.CoulombFriction(2.0, 2.0)
    for part, shape in shapes:
        contact = engine.ProximityProperties()
        engine.AddContactMaterial(dissipation, stiffness, friction, contact)
        if modulus and part is solid:
            engine.AddCompliantHydroelasticProperties(0.05 * b, modulus, contact)
        elif modulus:
            engine.AddRigidHydroelasticProperties(contact)
        plant.RegisterCollisionGeometry(part, engine.RigidTransform(), shape, "shape", contact)
    models = engine.ContactModel
    plant.set_contact_model(models.kHydroelastic if modulus else models.kPoint)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -GRAVITY])
    plant.Finalize()
    simulator = engine.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    centre, velocity, turning = body.start
    turned = engine.RotationMatrix.MakeYRotation(body.tilt)
    pose = engine.RigidTransform(turned, [0.0, 0.0, centre])
    plant.SetFreeBodyPose(context, solid, pose)
    plant.SetFreeBodySpatialVelocity(context, solid, engine.SpatialVelocity(turning, velocity))
    simulator.Initialize()

    def state() -> State:
        place = plant.EvalBodyPoseInWorld(context, solid)
        moving = plant.EvalBodySpatialVelocityInWorld(context, solid)
        axis = place.rotation().matrix()[:, 2]
        return place.translation()[2], axis, moving.translational(), moving.rotational()

    return lambda: simulator.AdvanceTo(context.get_time() + step), state


_UNDAMPED: Final[dict[str, Any]] = {"dissipation": 0.0}
#: Rows of the table: module, function, words, keywords, and steps [s].
CASES: Final[Sequence[tuple[str, Callable[..., Program], str, Mapping[str, Any], Any]]] = (
    ("mujoco", mujoco, "20 ms, the default", {"softness": 0.02}, (0.01, 0.002, 1e-4)),
    ("mujoco", mujoco, "4 ms", {"softness": 0.004}, (0.002, 5e-4, 1e-4)),
    ("mujoco", mujoco, "1 ms", {"softness": 0.001}, (5e-4, 1e-4)),
    ("pybullet", pybullet, "the default", {}, (1.0 / 60.0, 1.0 / 240.0, 0.001, 1e-4)),
    ("pybullet", pybullet, "10⁹ N/m, damped", {"stiffness": 1e9}, (0.001, 1e-4)),
    ("pydrake", drake, "points, the default", {}, (0.001, 1e-4)),
    ("pydrake", drake, "points, 10⁹ N/m, undamped", _UNDAMPED | {"stiffness": 1e9}, (0.001, 1e-4)),
    ("pydrake", drake, "10⁸ Pa, undamped", _UNDAMPED | {"modulus": 1e8}, (0.001,)),
    ("pydrake", drake, "10¹⁰ Pa, undamped", _UNDAMPED | {"modulus": 1e10}, (0.001,)),
    ("pydrake", drake, "10¹⁰ Pa, 50 s/m", {"modulus": 1e10, "dissipation": 50.0}, (0.001,)),
)


def tilts(program: Program, seconds: float, step: float) -> Iterator[float]:
    """Yield the tilt towards x after each step [rad]."""
    advance, state = program
    for _ in range(round(seconds / step)):
        advance()
        axis = state()[1]
        yield math.atan2(axis[0], axis[2])


def loss_of(program: Callable[[Body], Program], step: float, size: tuple[float, float]) -> float:
    """Return the mean loss of the first impacts of a block over that of equation (43) [1]."""
    frame = RockingFrame(height=size[1], width=size[0])
    alpha = frame.slenderness
    peaks, side, highest = [0.5 * alpha], 1.0, 0.0
    for tilt in tilts(program(Body(*size, round=False, tilt=peaks[0])), sized(30.0, 1.0), step):
        if side * tilt < 0.0:
            if highest > 0.02 * alpha:
                peaks.append(highest)
            if len(peaks) > IMPACTS:
                break
            side, highest = -side, 0.0
        elif len(peaks) > 1 or side < 0.0:
            highest = max(highest, abs(tilt))
    if len(peaks) == 1:
        return math.nan
    first, last = (math.cos(alpha - each) - math.cos(alpha) for each in (peaks[0], peaks[-1]))
    kept = (last / first) ** (0.5 / (len(peaks) - 1))
    return math.log(kept) / math.log(frame.restitution)


def fall_of(program: Callable[[Body], Program], step: float, size: tuple[float, float]) -> float:
    """Return the time in which a block falls over the exact one [1]."""
    frame = RockingFrame(height=size[1], width=size[0])
    alpha, p = frame.slenderness, frame.effective_frequency_parameter
    first, end = 1.02 * alpha, 1.0

    def lies(_: float, y: Float) -> float:
        return float(y[0] - end)

    lies.terminal = True  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda _, y: [y[1], -(p**2) * math.sin(alpha - y[0])],
        (0.0, 60.0),
        [first, 0.0],
        events=lies,
        rtol=1e-9,
        atol=1e-12,
    )
    falling = tilts(program(Body(*size, round=False, tilt=first)), sized(20.0, 0.1), step)
    number = next((k for k, tilt in enumerate(falling, start=1) if abs(tilt) > end), math.nan)
    return number * step / float(motion.t[-1])


def kept_of(
    program: Callable[[Body], Program], step: float, size: tuple[float, float], precession: float
) -> float:
    """Return the share of its energy that a cylinder has left after wobbling [1]."""
    frame = RockingFrame(height=size[1], width=size[0], section="circular")
    rate = precession * frame.effective_frequency_parameter
    body = Body(*size, round=True, tilt=0.5 * frame.slenderness, precession=rate)
    advance, state = program(body)
    first = body.energy(state())
    for _ in range(round(WOBBLING / step)):
        advance()
    return body.energy(state()) / first


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    warnings.simplefilter("ignore", DeprecationWarning)  # of the programs
    titles = ("loss over (43)", "time to fall", "energy left, 0.4 p", "energy left, 0.04 p")
    columns = [f"{title}, {height:g} m" for title in titles for _, height in SIZES]
    print("| program | contact | step | " + " | ".join(columns) + " |")
    print("|---" * (3 + len(columns)) + "|")
    for name, build, words, keywords, steps in CASES:
        if importlib.util.find_spec(name) is None:
            continue
        for step in sized(steps, steps[:1]):

            def program(body: Body) -> Program:
                return build(body, step, **keywords)  # noqa: B023  (called within this turn)

            numbers = [
                *(f"{loss_of(program, step, size):.2f}" for size in SIZES),
                *(f"{fall_of(program, step, size):.3f}" for size in SIZES),
                *(
                    f"{kept_of(program, step, size, rate):.2f}"
                    for rate in PRECESSIONS
                    for size in SIZES
                ),
            ]
            title = f"| {name.removeprefix('py')} | {words} | {1e3 * step:.3g} ms | "
            print(title + " | ".join(numbers) + " |", flush=True)


if __name__ == "__main__":
    main()
