#!/usr/bin/env bash
# Question: two bodies have friction 0.3 and 1.0 in their descriptions. What is the friction between them?
# Guess: the smaller, since the smoother face decides, or some mean; and the same in both engines.
# Came (mujoco 4.0.0, pybullet 3.2.7): 1.0 on 0.3 gives 1.055 and 0.300; 0.3 on 0.3: 0.291 and 0.090.
# MuJoCo takes the larger of both, and its default is 1; PyBullet takes the product: 0.3 on 0.3 is 0.09 there.
# Why it hurts: a column with friction 0.3 on a floor of which nothing was said does not slide in MuJoCo at all, and
# the same two numbers, moved to the other engine, give a third of the friction.
# This package: friction belongs to a joint, as one number, and is compared with the demand.
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
MODEL = """<mujoco><option timestep="0.001" cone="elliptic"/><worldbody>
<geom type="box" size="50 50 0.1" pos="0 0 -0.1" friction="{floor} 0.005 0.0001"/>
<body pos="0 0 0.05"><freejoint/><geom type="box" size="0.3 0.3 0.05" mass="100" friction="{block} 0.005 0.0001"/></body>
</worldbody></mujoco>"""


def in_mujoco(floor, block):
    """Return the friction that stops a sliding block."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(floor=floor, block=block))
    data = mujoco.MjData(model)
    for i in range(600):
        if i == 500:
            data.qvel[0] = 2.0
        mujoco.mj_step(model, data)
    return float((2.0 - data.qvel[0]) / 0.1 / 9.81)


def in_pybullet(floor, block):
    """Return the friction that stops a sliding block."""
    pybullet.resetSimulation()
    pybullet.setGravity(0, 0, -9.81)
    pybullet.setTimeStep(0.001)
    for mass, half, height, friction in ((0, [50, 50, 0.1], -0.1, floor), (100, [0.3, 0.3, 0.05], 0.05, block)):
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
        body = pybullet.createMultiBody(mass, shape, basePosition=[0, 0, height])
        pybullet.changeDynamics(body, -1, lateralFriction=friction, linearDamping=0, angularDamping=0)
    for i in range(300):
        if i == 200:
            pybullet.resetBaseVelocity(body, [2.0, 0, 0])
        pybullet.stepSimulation()
    return float((2.0 - pybullet.getBaseVelocity(body)[0][0]) / 0.1 / 9.81)


pybullet.connect(pybullet.DIRECT)
for floor, block in ((1.0, 0.3), (0.3, 0.3), (0.2, 0.6)):
    larger, product = in_mujoco(floor, block), in_pybullet(floor, block)
    print(f"floor {floor}, block {block}: MuJoCo {larger:.3f}, PyBullet {product:.3f}")
    assert abs(larger - max(floor, block)) < 0.08 and abs(product - floor * block) < 0.02
PYTHON
