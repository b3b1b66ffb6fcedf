"""Rocking structures in OpenSees: stiff bodies on springs without tension.

The model knows neither the equation of motion (26) nor the restitution (43) of the paper. A column
is a body of stiff corotational beams with its mass and inertia at its centre of gravity. Two struts
without tension, inclined by 45 degrees, hold each corner of a joint. A corner carries its load
at any rotation, lifts freely, and does not slide where less than the load pushes it sideways. One
column carries the beam, which may not rotate; with two columns the beam may rotate. Two columns may
differ (`respond_bent`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.validation.cases import Motion

from rockframe.frame import RockingFrame
from rockframe.parts import Dissipater, Tendon
from rockframe.unequal import UnequalBent
from rockframe.units import GRAVITY

try:
    import openseespy.opensees as ops
except ImportError:  # the extra `validation`, or the libraries of the system that it needs
    ops = None

Float: TypeAlias = NDArray[np.float64]

#: Stiffness of the bodies over that of a corner.
STIFFER: Final = 400.0
#: Number of times that a time step is halved where it does not converge.
HALVINGS: Final = 10
#: Damping of columns that bend, over the critical one [1].
COLUMN_DAMPING: Final = 0.05
#: Beyond this rotation [rad] a structure has overturned.
OVERTURNED: Final = 1.2
#: Longest time after the motion [s]: a structure that returns through zero before has stood.
AFTER: Final = 60.0
#: Mass of a column [kg] where the frame states none.
_MASS: Final = 1.0e5
_STRUT, _TENDON, _BAR = 1, 2, 3
_TRANSFORMATION: Final = 1


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Properties of the joints and the columns of a model.

    Parameters
    ----------
    shortening : float
        Shortening of the contact under the weight at rest [m], the same at base and top.
    columns : int
        Number of columns.
    spacing : float
        Distance between two columns [m].
    column_period : float
        Period of the structure with its columns fixed at both ends [s], or 0 for stiff columns.
        Columns that bend have `COLUMN_DAMPING` at this period.
    damping : float
        Damping of the struts, as a share of the critical damping of the structure that oscillates
        vertically on all of them [1]. Lifted corners have none.
    """

    shortening: float = 1.0e-5
    columns: int = 1
    spacing: float = 12.0
    column_period: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A column: place of its axis and level of its base [m], dimensions [m], mass, inertia, load.

    `load` is the vertical force of the beam at rest [N], `inertia` that about its centre [kg m2].
    """

    x: float = 0.0
    level: float = 0.0
    height: float
    width: float
    top_width: float
    centre: float
    mass: float
    inertia: float
    load: float
    bending: float | None = None


@dataclass(frozen=True, kw_only=True)
class _Beam:
    """A beam: its mass [kg], its inertia [kg m2], the place of its centre [m], and if it turns."""

    mass: float
    inertia: float
    x: float
    z: float
    turns: bool


@dataclass(frozen=True, eq=False)
class History:
    """A response: rotation [rad] of the first column over time [s], and the work of the ground.

    `work` is that of the inertia forces on the motion relative to the ground, over the mass of the
    columns [m2 s-2]. A structure that ends at rest has dissipated all of it.
    """

    time: Float
    theta: Float
    work: float
    converged: bool

    @property
    def overturned(self) -> bool:
        """True if the rotation exceeded `OVERTURNED`."""
        return bool(np.abs(self.theta).max() > OVERTURNED)


def require_opensees() -> None:
    """Exit with one line unless OpenSees can be imported."""
    if ops is None:
        raise SystemExit(
            "OpenSees is missing: install the extra `validation` of the package, and on Debian "
            "libblas3 and liblapack3."
        )


def respond(
    frame: RockingFrame,
    motion: Motion,
    contact: Contact | None = None,
    *,
    step: float,
    free_rocking: float = 0.0,
) -> History | None:
    """Return the response of a structure to a motion; None if its weight found no equilibrium.

    Time steps have the length `step` [s]. After the motion the structure rocks freely for
    `free_rocking` [s]. With 0, it is followed until it returns through zero or overturns.
    """
    contact = contact or Contact()
    columns = _columns_of(frame, contact)
    model = _Model(columns, _beam_of(frame, contact), contact, frame)
    return _shaken(model, motion, free_rocking, step)


def respond_bent(
    bent: UnequalBent,
    motion: Motion,
    contact: Contact | None = None,
    *,
    step: float,
    free_rocking: float = 0.0,
) -> History | None:
    """Return the response of two unequal columns; the other arguments are those of `respond`.

    The corners of both columns have the same stiffness: at the base that of the left column.
    """
    masses = np.array(bent.column_masses or np.multiply(bent.heights, bent.widths))
    masses = 2.0 * _MASS * masses / masses.sum()
    beam_mass = 2.0 * _MASS * bent.mass_ratio
    length = bent.spacing + 0.5 * sum(bent.widths)
    columns = [
        _Column(
            x=place,
            level=max(bent.heights) - height,
            height=height,
            width=width,
            top_width=width,
            centre=0.5 * height,
            mass=mass,
            inertia=mass * (height**2 + width**2) / 12.0,
            load=0.5 * beam_mass * GRAVITY,
        )
        for place, height, width, mass in zip(
            (0.0, bent.spacing), bent.heights, bent.widths, masses.tolist(), strict=True
        )
    ]
    beam = _Beam(
        mass=beam_mass,
        inertia=beam_mass * (length**2 + bent.beam_depth**2) / 12.0,
        x=0.5 * bent.spacing + bent.beam_offset,
        z=max(bent.heights) + 0.5 * bent.beam_depth,
        turns=True,
    )
    return _shaken(_Model(columns, beam, contact or Contact()), motion, free_rocking, step)


def _columns_of(frame: RockingFrame, contact: Contact) -> list[_Column]:
    mass = frame.column_mass or _MASS
    prestress = frame.tendon.prestress if frame.tendon else 0.0
    return [
        _Column(
            x=number * contact.spacing,
            height=frame.height,
            width=frame.width,
            top_width=frame.top_contact_width,
            centre=frame.centre_height,
            mass=mass,
            inertia=(frame.inertia_ratio - 1.0) * mass * frame.size**2,
            load=frame.mass_ratio * mass * GRAVITY + prestress,
            bending=_bending(frame, contact, mass),
        )
        for number in range(contact.columns)
    ]


def _bending(frame: RockingFrame, contact: Contact, mass: float) -> float | None:
    """Return E I of a column of which the fixed frame has the stated period."""
    if not contact.column_period:
        return None
    moved = (frame.mass_ratio + 13.0 / 35.0) * mass
    return (2.0 * math.pi / contact.column_period) ** 2 * moved * frame.height**3 / 12.0


def _beam_of(frame: RockingFrame, contact: Contact) -> _Beam | None:
    if not frame.mass_ratio > 0.0:
        return None
    mass = frame.mass_ratio * (frame.column_mass or _MASS) * contact.columns
    span = (contact.columns - 1) * contact.spacing
    inertia = mass * (span**2 + 4.0) / 12.0
    turns = contact.columns > 1
    return _Beam(mass=mass, inertia=inertia, x=0.5 * span, z=frame.height + 1.0, turns=turns)


def _shaken(model: _Model, motion: Motion, free_rocking: float, step: float) -> History | None:
    if not model.stands_at_rest():
        return None
    model.shake(motion)
    return _follow(model, motion, free_rocking, step)


def _follow(model: _Model, motion: Motion, free_rocking: float, step: float) -> History:
    end = motion.time_step * (motion.acceleration.size - 1)
    sampled = motion.time_step * np.arange(motion.acceleration.size)
    last = end + (free_rocking or AFTER)
    times, thetas, work, trial, places = [0.0], [0.0], 0.0, step, model.places()
    while times[-1] < last - 1.0e-9:
        if ops.analyze(1, trial) != 0:
            trial *= 0.5
            if trial < step * 0.5**HALVINGS:
                return History(np.array(times), np.array(thetas), work, converged=False)
            continue
        times.append(ops.getTime())
        thetas.append(model.rotation())
        trial = min(step, 2.0 * trial)
        before, places = places, model.places()
        middle = float(np.interp(0.5 * (times[-2] + times[-1]), sampled, motion.acceleration))
        if times[-1] <= end:
            work -= middle * float(model.masses @ (places - before))
        if abs(thetas[-1]) > OVERTURNED:
            break
        if not free_rocking and times[-1] > end and _returned(thetas):
            break
    return History(np.array(times), np.array(thetas), work, converged=True)


def _returned(thetas: list[float]) -> bool:
    return thetas[-2] * thetas[-1] <= 0.0 or abs(thetas[-1]) < 1.0e-4


@dataclass(eq=False)
class _Model:
    """The current OpenSees model; the program has one at a time."""

    blocks: list[_Column]
    beam: _Beam | None
    contact: Contact
    frame: RockingFrame | None = None
    nodes: int = 0
    elements: int = 0
    moving: list[tuple[int, float]] = field(default_factory=list)
    struts: list[int] = field(default_factory=list)
    columns: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        first, contact = self.blocks[0], self.contact
        self.base_load = first.load + first.mass * GRAVITY
        self.stiff = STIFFER * self.base_load / (2.0 * contact.shortening)
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 3)
        ops.geomTransf("Corotational", _TRANSFORMATION)
        self._materials()
        beam = self._beam(self.beam) if self.beam else 0
        for column in self.blocks:
            self._column(column, beam)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        for node, mass in self.moving:
            ops.load(node, 0.0, -mass * GRAVITY, 0.0)
        whole = sum(column.mass for column in self.blocks)
        self.masses = np.array([mass for _, mass in self.moving]) / whole

    def stands_at_rest(self) -> bool:
        """Return whether the structure finds its equilibrium under gravity."""
        self._analysis()
        ops.integrator("LoadControl", 0.1)
        ops.analysis("Static")
        if ops.analyze(10) != 0:
            return False
        ops.loadConst("-time", 0.0)
        return True

    def shake(self, motion: Motion) -> None:
        """Prepare the response to a motion."""
        values = [float(one) for one in motion.acceleration]
        ops.timeSeries("Path", 2, "-dt", motion.time_step, "-values", *values)
        ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
        if self.contact.damping:
            # Proportional to the committed stiffness, which a lifted corner does not have.
            factor = 2.0 * self.contact.damping * math.sqrt(self.contact.shortening / GRAVITY)
            ops.region(1, "-ele", *self.struts, "-rayleigh", 0.0, 0.0, 0.0, factor)
        if self.contact.column_period:
            factor = COLUMN_DAMPING * self.contact.column_period / math.pi
            ops.region(2, "-ele", *self.columns, "-rayleigh", 0.0, 0.0, 0.0, factor)
        self._analysis()
        ops.integrator("TRBDF2")
        ops.analysis("Transient")

    def rotation(self) -> float:
        """Return the rotation of the first column, positive as the package has it [rad]."""
        return -float(ops.nodeDisp(self.first, 3))

    def places(self) -> Float:
        """Return the horizontal displacement of each mass relative to the ground [m]."""
        return np.array([ops.nodeDisp(node, 1) for node, _ in self.moving])

    def _analysis(self) -> None:
        ops.wipeAnalysis()
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("ProfileSPD")
        ops.test("NormUnbalance", 1.0e-5 * self.base_load, 30)
        ops.algorithm("Newton")

    def _materials(self) -> None:
        # A strut starts compressed, because its tangent without strain would be zero.
        ops.uniaxialMaterial("ENT", 10 + _STRUT, 1.0)
        strain = -0.5 * self.contact.shortening
        ops.uniaxialMaterial("InitStrainMaterial", _STRUT, 10 + _STRUT, strain)
        tendon, bars = self._ties()
        if tendon is not None:
            # Both joints open equally, so each has a spring of twice the stiffness.
            stiffness = 2.0 * tendon.stiffness
            ops.uniaxialMaterial("Elastic", 10 + _TENDON, stiffness)
            strain = tendon.prestress / stiffness
            ops.uniaxialMaterial("InitStrainMaterial", _TENDON, 10 + _TENDON, strain)
        if bars is not None:
            ops.uniaxialMaterial(
                "ElasticPP", _BAR, bars.stiffness, bars.yield_force / bars.stiffness
            )

    def _ties(self) -> tuple[Tendon | None, Dissipater | None]:
        frame = self.frame
        return (None, None) if frame is None else (frame.tendon, frame.dissipater)

    def _node(self, x: float, z: float, *, fixed: bool = False) -> int:
        self.nodes += 1
        ops.node(self.nodes, x, z)
        if fixed:
            ops.fix(self.nodes, 1, 1, 1)
        return self.nodes

    def _element(self, kind: str, first: int, second: int, *properties: Any) -> None:
        self.elements += 1
        ops.element(kind, self.elements, first, second, *properties)

    def _body(self, first: int, second: int, bending: float | None = None) -> None:
        inertia = self.stiff if bending is None else bending
        section = (self.stiff, 1.0, inertia, _TRANSFORMATION)  # area, modulus, second moment
        self._element("elasticBeamColumn", first, second, *section)

    def _beam(self, beam: _Beam) -> int:
        node = self._node(beam.x, beam.z)
        ops.mass(node, beam.mass, beam.mass, beam.inertia)
        if not beam.turns:
            ops.fix(node, 0, 0, 1)
        self.moving.append((node, beam.mass))
        return node

    def _column(self, column: _Column, beam: int) -> None:
        levels = (0.0, column.centre, column.height)
        base, centre, top = (self._node(column.x, column.level + z) for z in levels)
        ops.mass(centre, column.mass, column.mass, column.inertia)
        if not self.moving or (beam and len(self.moving) == 1):
            self.first = centre
        self.moving.append((centre, column.mass))
        for first, second in ((base, centre), (centre, top)):
            self._body(first, second, column.bending)
            self.columns.append(self.elements)
        x, level = column.x, column.level
        self._joint(base, x, level, -1.0, 0.5 * column.width, self.base_load, 0)
        if beam:
            half = 0.5 * column.top_width
            self._joint(top, x, level + column.height, 1.0, half, column.load, beam)

    def _joint(
        self, middle: int, x: float, z: float, up: float, half: float, load: float, beam: int
    ) -> None:
        """Hold the corners of a joint by struts, and its middle by tendons and bars."""
        vertical = load / (2.0 * self.contact.shortening)
        for side in (-half, half):
            corner = self._node(x + side, z)
            self._body(middle, corner)
            for lean in (-1.0, 1.0):
                other = self._other(x + side + lean, z + up, beam)
                # Two struts at 45 degrees have together the vertical stiffness of one.
                area = vertical * math.sqrt(2.0)
                self._element("corotTruss", corner, other, area, _STRUT, "-doRayleigh", 1)
                self.struts.append(self.elements)
        tendon, bars = self._ties()
        for material, tie in ((_TENDON, tendon), (_BAR, bars)):
            if tie is not None:
                other = self._other(x, z + up, beam)
                self._element("corotTruss", middle, other, 1.0, material)

    def _other(self, x: float, z: float, beam: int) -> int:
        """Return a node of the ground, or of the beam."""
        if not beam:
            return self._node(x, z, fixed=True)
        node = self._node(x, z)
        if math.hypot(x - float(ops.nodeCoord(beam)[0]), z - float(ops.nodeCoord(beam)[1])) < 1e-9:
            ops.remove("node", node)
            return beam
        self._body(beam, node)
        return node
