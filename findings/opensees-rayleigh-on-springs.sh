#!/usr/bin/env bash
# Question: on which elements does OpenSees' rayleigh act, if 5 % is asked through stiffness-proportional damping?
# Guess: on all that have stiffness; or, for those who know zeroLength, on all but zeroLength.
# Came (OpenSees 3.7.1): zeroLength, twoNodeLink, truss, corotTruss 0.0 each; zeroLengthSection, beam 0.0501.
# Springs, links and trusses are left out unless -doRayleigh 1 is given; zeroLengthSection and beams are not.
# Why it hurts: restrainers, isolators and contact springs of a model that "has 5 %" have none, and no message says so;
# a spring replaced by a section of the same stiffness changes the answer.
# This package: damping belongs to each part by name, and none is hidden; it has no Rayleigh damping.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check openseespy==3.7.1.2 numpy==2.4.6
export LD_LIBRARY_PATH=$(echo "$work"/venv/lib/python3*/site-packages/openseespylinux/lib)
cd "$work"
"$work/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import openseespy.opensees as ops

print("openseespy", version("openseespy"), "OpenSees", ops.version())
mass, period, asked = 1.0, 1.0, 0.05
stiffness = (2.0 * np.pi / period) ** 2 * mass


def element(kind):
    """Build one horizontal element of the same stiffness between the nodes."""
    if kind == "zeroLength":
        ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)
    elif kind == "zeroLength -doRayleigh 1":
        ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1, "-doRayleigh", 1)
    elif kind == "zeroLengthSection":
        ops.uniaxialMaterial("Elastic", 2, 1.0)
        ops.section("Aggregator", 1, 1, "P", 2, "Mz")
        ops.element("zeroLengthSection", 1, 1, 2, 1)
    elif kind in ("truss", "corotTruss"):
        ops.element(kind, 1, 1, 2, 1.0, 1)
    elif kind == "twoNodeLink":
        ops.element("twoNodeLink", 1, 1, 2, "-mat", 1, "-dir", 1)
    else:
        ops.geomTransf("Linear", 1)
        ops.element("elasticBeamColumn", 1, 1, 2, 1.0, stiffness, 1.0, 1)


def damping(kind):
    """Return the damping ratio of the free vibration."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.node(1, 0.0, 0.0)
    ops.node(2, 0.0 if kind.startswith("zero") else 1.0, 0.0)
    ops.fix(1, 1, 1, 1)
    ops.fix(2, 0, 1, 1)
    ops.mass(2, mass, 1e-9, 1e-9)
    ops.uniaxialMaterial("Elastic", 1, stiffness)
    element(kind)
    ops.rayleigh(0.0, 0.0, asked * period / np.pi, 0.0)
    ops.setNodeDisp(2, 1, 1.0, "-commit")
    for command, arguments in (("system", ["FullGeneral"]), ("numberer", ["Plain"]), ("constraints", ["Plain"]),
                               ("algorithm", ["Linear"]), ("integrator", ["Newmark", 0.5, 0.25]),
                               ("analysis", ["Transient"])):
        getattr(ops, command)(*arguments)
    u = []
    for _ in range(2000):
        ops.analyze(1, 0.005)
        u.append(ops.nodeDisp(2, 1))
    peaks = [u[i] for i in range(1, len(u) - 1) if u[i - 1] < u[i] > u[i + 1]]
    return abs(float(np.log(peaks[0] / peaks[4]) / 4.0 / (2.0 * np.pi)))


without = [damping(kind) for kind in ("zeroLength", "twoNodeLink", "truss", "corotTruss")]
having = [damping(kind) for kind in ("zeroLength -doRayleigh 1", "zeroLengthSection", "elasticBeamColumn")]
print("asked", asked)
print("zeroLength, twoNodeLink, truss, corotTruss:", [round(x, 4) for x in without])
print("zeroLength -doRayleigh 1, zeroLengthSection, elasticBeamColumn:", [round(x, 4) for x in having])
assert max(without) < 1e-3 and all(abs(x - asked) < 0.002 for x in having)
PYTHON
