#!/usr/bin/env bash
# Question: which moments of inertia has a round column in PyBullet, as a cylinder, as a mesh, and from a URDF?
# Guess: those of the shape, and from a URDF those that the file states.
# Came (pybullet 3.2.7), about the axis (exact 0.0312): cylinder 0.0312, mesh 0.0427, capsule 0.0417; a URDF that states
# 0.5, 0.5, 0.06 gives 0.3567, 0.3567, 0.0427.
# Meshes, capsules and cylinders of a URDF get those of their bounding box; numbers in a URDF count only with the flag
# URDF_USE_INERTIA_FROM_FILE. Only GEOM_CYLINDER is right.
# Why it hurts: a column about its axis is a third too heavy, which decides how it wobbles; hollow or eccentric
# bodies, whose inertia a user computed and wrote down, become full boxes.
# This package: inertia follows from the stated section of a column; tests/test_column.py compares it with integrals.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check pybullet==3.2.7 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import math

import pybullet

print("pybullet", version("pybullet"))
pybullet.connect(pybullet.DIRECT)
radius, height = 0.25, 2.0
angles = [2.0 * math.pi * i / 64 for i in range(64)]
hull = [[radius * math.cos(a), radius * math.sin(a), z] for a in angles for z in (-1.0, 1.0)]
exact = (3.0 * radius**2 + height**2) / 12.0, radius**2 / 2.0
shapes = {
    "cylinder": pybullet.createCollisionShape(pybullet.GEOM_CYLINDER, radius=radius, height=height),
    "mesh of 128 points": pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=hull),
    "capsule": pybullet.createCollisionShape(pybullet.GEOM_CAPSULE, radius=radius, height=height - 2.0 * radius),
}
polar = {}
print(f"exact for 1 kg: {exact[0]:.4f} across, {exact[1]:.4f} about the axis")
for name, shape in shapes.items():
    body = pybullet.createMultiBody(1.0, shape, basePosition=[0, 0, 9])
    across, _, about = pybullet.getDynamicsInfo(body, -1)[2]
    polar[name] = about
    print(f"{name}: {across:.4f} across, {about:.4f} about the axis")
with open("column.urdf", "w") as file:
    file.write('<robot name="c"><link name="b"><inertial><mass value="1"/><origin xyz="0 0 0"/>'
               '<inertia ixx="0.5" iyy="0.5" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
               '<cylinder radius="0.25" length="2"/></geometry></collision></link></robot>')
stated = {}
for flag in (0, pybullet.URDF_USE_INERTIA_FROM_FILE):
    body = pybullet.loadURDF("column.urdf", [0, 0, 9], flags=flag)
    stated[flag] = pybullet.getDynamicsInfo(body, -1)[2]
    print(f"URDF that states 0.5, 0.5, 0.06, flag {flag}: {[round(x, 4) for x in stated[flag]]}")
assert abs(polar["cylinder"] / exact[1] - 1.0) < 0.01 and polar["mesh of 128 points"] / exact[1] > 1.3
assert abs(stated[0][0] - 0.5) > 0.1 and abs(stated[pybullet.URDF_USE_INERTIA_FROM_FILE][0] - 0.5) < 1e-6
PYTHON
