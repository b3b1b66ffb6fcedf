#!/usr/bin/env bash
# Question: which call gives the base shear of a damped oscillator under UniformExcitation: reactions(), with -rayleigh,
# or with -dynamic?
# Guess: -rayleigh: the spring's force and, as the word says, the Rayleigh damping beside it.
# Came (OpenSees 3.7.1), spring 0.5916 and damper 0.2471: reactions() 0.5916, -dynamic 0.8388, -rayleigh 0.2471.
# -rayleigh gives the damping forces alone, and reactions() leaves them out; only -dynamic has both.
# Why it hurts: the plain call is low by the damping, and the natural choice is low by the whole spring: no call
# warns, and each number looks like a base shear.
# This package: forces at the joints follow from momentum; tests/rocking/test_reactions.py balances them with the motion.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check openseespy==3.7.1.2 numpy==2.4.6
export LD_LIBRARY_PATH=$(echo "$work"/venv/lib/python3*/site-packages/openseespylinux/lib)
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import openseespy.opensees as ops

print("openseespy", version("openseespy"), "OpenSees", ops.version())
stiffness, factor = 40.0, 0.05
ops.model("basic", "-ndm", 1, "-ndf", 1)
ops.node(1, 0.0)
ops.node(2, 0.0)
ops.fix(1, 1)
ops.mass(2, 1.0)
ops.uniaxialMaterial("Elastic", 1, stiffness)
ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1, "-doRayleigh", 1)
ops.rayleigh(0.0, 0.0, factor, 0.0)
ops.timeSeries("Constant", 1)
ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
ops.system("FullGeneral")
ops.numberer("Plain")
ops.constraints("Transformation")
ops.algorithm("Linear")
ops.integrator("Newmark", 0.5, 0.25)
ops.analysis("Transient")
ops.analyze(20, 0.01)
spring = -stiffness * ops.nodeDisp(2, 1)
damper = -factor * stiffness * ops.nodeVel(2, 1)
print(f"spring {spring:.4f}, damper {damper:.4f}, both {spring + damper:.4f}, "
      f"mass times absolute acceleration {1.0 + ops.nodeAccel(2, 1):.4f}")
found = {}
for words in ((), ("-dynamic",), ("-rayleigh",)):
    ops.reactions(*words)
    found[words] = ops.nodeReaction(1, 1)
    print("reactions", words, f"{found[words]:.4f}")
assert abs(found[()] - spring) < 1e-6 and abs(found[("-rayleigh",)] - damper) < 1e-6
assert abs(found[("-dynamic",)] - spring - damper) < 1e-6
PYTHON
