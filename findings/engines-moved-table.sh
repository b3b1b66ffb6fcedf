#!/usr/bin/env bash
# Question: a shaking table is moved by writing its position in each step. Does a block on it follow by friction?
# Guess: yes, like on any table: the contact sees the table move under the block.
# Came (mujoco 4.0.0, pybullet 3.2.7): the table moves 1.0 m, the block -0.0000, 0.0000 and 0.0000 m; if the velocity is
# written beside the position, 0.9905 and 0.9995 m.
# A body that is placed has no velocity for the contact in either engine: to friction, the table stands still.
# Why it hurts: every block survives every earthquake, and the animation shows the table shaking under it.
# This package: puts the ground's acceleration into the equations; a base at constant acceleration is one of its tests.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check mujoco==4.0.0 pybullet==3.2.7 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import mujoco
import pybullet

print("mujoco", version("mujoco"), "pybullet", version("pybullet"))
step, count, acceleration = 0.001, 2000, 0.5
MODEL = """<mujoco><option timestep="0.001"/><worldbody>
<body name="table" {mocap} pos="0 0 -0.1">{joint}<geom type="box" size="5 5 0.1" mass="1e6"/></body>
<body pos="0 0 0.05"><freejoint/><geom type="box" size="0.3 0.3 0.05" mass="100"/></body>
</worldbody></mujoco>"""


def in_mujoco(way):
    """Return where the block is after 2 s [m]."""
    placed = way == "mocap"
    joint = "" if placed else '<joint type="slide" axis="1 0 0"/>'
    model = mujoco.MjModel.from_xml_string(MODEL.format(mocap='mocap="true"' if placed else "", joint=joint))
    data = mujoco.MjData(model)
    for i in range(count):
        t = i * step
        if placed:
            data.mocap_pos[0, 0] = 0.5 * acceleration * t * t
        else:
            data.qpos[0] = 0.5 * acceleration * t * t
            data.qvel[0] = acceleration * t if way == "position and velocity" else 0.0
        mujoco.mj_step(model, data)
    return float(data.qpos[0 if placed else 1])


def in_pybullet(with_velocity):
    """Return where the block is after 2 s [m]."""
    pybullet.resetSimulation()
    pybullet.setGravity(0, 0, -9.81)
    pybullet.setTimeStep(step)
    bodies = []
    for mass, half, height in ((0, [50, 50, 0.1], -0.1), (100, [0.3, 0.3, 0.05], 0.05)):
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
        bodies.append(pybullet.createMultiBody(mass, shape, basePosition=[0, 0, height]))
        pybullet.changeDynamics(bodies[-1], -1, lateralFriction=1.0, linearDamping=0, angularDamping=0)
    for i in range(count):
        t = i * step
        pybullet.resetBasePositionAndOrientation(bodies[0], [0.5 * acceleration * t * t, 0, -0.1], [0, 0, 0, 1])
        if with_velocity:
            pybullet.resetBaseVelocity(bodies[0], [acceleration * t, 0, 0])
        pybullet.stepSimulation()
    return float(pybullet.getBasePositionAndOrientation(bodies[1])[0][0])


pybullet.connect(pybullet.DIRECT)
print("the table moves 1.0 m in 2 s at 0.5 m/s2; friction 1; the block moves [m]:")
moved = {way: in_mujoco(way) for way in ("mocap", "position", "position and velocity")}
for way, distance in moved.items():
    print(f"  MuJoCo, {way}: {distance:.4f}")
placed, carried = in_pybullet(False), in_pybullet(True)
print(f"  PyBullet, resetBasePositionAndOrientation: {placed:.4f}; with resetBaseVelocity beside it: {carried:.4f}")
assert abs(moved["mocap"]) < 0.01 and abs(moved["position"]) < 0.01 and abs(placed) < 0.01
assert moved["position and velocity"] > 0.95 and carried > 0.95
PYTHON
