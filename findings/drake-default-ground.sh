#!/usr/bin/env bash
# Question: a block of 1.8 m x 1.8 m x 7.5 m of stone (61 t) stands on the ground of Drake's multibody plant, with nothing
# said of the contact but its friction. How far does it sink?
# Guess: a millimetre, the plant's penetration allowance.
# Came (drake 1.51.1): 340 mm; a block of 200 kg by 3.9 mm. The stiffness of points is 10^6 N/m for each shape, whatever
# rests on them; a stiffness of 10^9 N/m gives 1.2 mm. MuJoCo 4.0.0 and PyBullet 3.2.7 have less than 1 mm by default.
# Why it hurts: a column that is sunk into the ground by a fifth of its width rocks on other edges, and much later.
# This package: bodies and ground are rigid; docs/validation.md says for which contacts that is good enough.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check drake==1.51.1 mujoco==4.0.0 pybullet==3.2.7 \
    numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - 2> drake.txt <<'PYTHON' || { cat drake.txt; exit 1; }
from importlib.metadata import version

import mujoco
import numpy as np
import pybullet
from pydrake import all as drake

print(*(f"{name} {version(name)}" for name in ("drake", "mujoco", "pybullet")))
STEP, SECONDS, DENSITY, GRAVITY = 0.001, 3.0, 2500.0, 9.81


def in_drake(width, height, stiffness=None):
    """Return how far a block sinks [m]."""
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, STEP)
    mass = DENSITY * width**2 * height
    block = plant.AddRigidBody("block", drake.SpatialInertia.SolidBoxWithMass(mass, width, width, height))
    for body, shape in ((block, drake.Box(width, width, height)), (plant.world_body(), drake.HalfSpace())):
        contact = drake.ProximityProperties()
        drake.AddContactMaterial(None, stiffness, drake.CoulombFriction(1.0, 1.0), contact)
        plant.RegisterCollisionGeometry(body, drake.RigidTransform(), shape, "shape", contact)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -GRAVITY])
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, block, drake.RigidTransform([0.0, 0.0, height / 2]))
    simulator.AdvanceTo(SECONDS)
    return height / 2 - plant.EvalBodyPoseInWorld(context, block).translation()[2]


def in_mujoco(width, height):
    """Return how far a block sinks [m]."""
    size = f"{width / 2} {width / 2} {height / 2}"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 {height / 2}"><freejoint/>'
        f'<geom type="box" size="{size}" density="{DENSITY}"/></body></worldbody></mujoco>')
    data = mujoco.MjData(model)
    for _ in range(round(SECONDS / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return height / 2 - float(data.qpos[2])


def in_pybullet(width, height):
    """Return how far a block sinks [m]."""
    pybullet.resetSimulation()
    pybullet.setGravity(0.0, 0.0, -GRAVITY)
    pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[width / 2, width / 2, height / 2])
    block = pybullet.createMultiBody(DENSITY * width**2 * height, shape, basePosition=[0.0, 0.0, height / 2])
    for _ in range(round(240 * SECONDS)):
        pybullet.stepSimulation()
    return height / 2 - pybullet.getBasePositionAndOrientation(block)[0][2]


pybullet.connect(pybullet.DIRECT)
sunk = {}
for width, height in ((1.8, 7.5), (0.2, 2.0)):
    mass = DENSITY * width**2 * height
    sunk[width] = [1000.0 * value for value in (
        in_drake(width, height), in_drake(width, height, 1e9), in_mujoco(width, height), in_pybullet(width, height))]
    print(f"{mass:.0f} kg: Drake {sunk[width][0]:.1f} mm, with 1e9 N/m {sunk[width][1]:.2f} mm, "
          f"MuJoCo {sunk[width][2]:.2f} mm, PyBullet {sunk[width][3]:.2f} mm")
assert 200.0 < sunk[1.8][0] < 500.0 and 2.0 < sunk[0.2][0] < 6.0
assert max(abs(value) for several in sunk.values() for value in several[2:]) < 1.0
PYTHON
