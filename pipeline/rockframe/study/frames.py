"""The ``[[structure]]`` of a file of structures that is a rocking frame."""

from __future__ import annotations

import math
from typing import Final, Literal

from rockframe.errors import invalid
from rockframe.frame import RockingFrame, crushed, unusual
from rockframe.parts import (
    Abutment,
    ColumnShape,
    Dissipater,
    Pivot,
    Tendon,
    hollow,
    inertia_ratio_of,
    tapered,
    volume,
)
from rockframe.study.structures import FixedEntry, IsolatedEntry, StructureTable


class StructureEntry(StructureTable):
    """One ``[[structure]]`` of a file of structures that is a rocking frame.

    Parameters
    ----------
    name : str
        Name in tables: letters and digits of any script, points, hyphens, underscores.
    kind : str
        Kind of the structure.
    height_m, width_m : float
        Height and width of a column [m].
    mass_ratio : float
        Mass of the beam over that of all columns [1]; 0 is a column alone.
    section : str
        Section of the columns: rectangular or circular.
    section_both : str, optional
        Section for both directions of the ground motion, circular, if the plane takes solid
        prismatic rectangles instead.
    top_width_m : float, optional
        Width at the top, on which the beam rests, of columns that taper linearly [m].
    inner_width_m : float, optional
        Inner width (diameter) of hollow columns [m].
    depth_m, inner_depth_m : float, optional
        Outer and inner depth, out of the plane of rocking, of hollow rectangular columns [m].
    inertia_ratio : float, optional
        I_o / (m_c R^2) of a column of another shape about its corner, above 1 and at most 100 [1],
        instead of the section.
    centre_of_gravity_m : float, optional
        Height of the centre of gravity of such a column above its base [m]; by default half the
        height.
    restitution_factor : float
        Factor on the restitution of eq (43) [1].
    beam_depth_m : float, optional
        Depth of the beam [m], for the least spacing of two columns.
    columns : int, optional
        Number of columns, for the mass of the beam and for drawings; by default two are drawn.
    beam_mass_kg : float, optional
        Mass of the whole beam [kg], in place of the mass ratio; needs the number of columns and
        their mass.
    beam_length_m, beam_width_m : float, optional
        Length and width of a solid beam [m], which with its depth and the density of the columns
        give its mass.
    column_mass_kg, density_kg_m3 : float, optional
        Mass of one column [kg], or its density; restraints and pivots need one of them, and the
        density of rectangular columns the depth. Without a mass, forces are stated over the weight.
    friction_coefficient : float, optional
        Coefficient of friction available at the joints [1], which reduces the forces of shear keys.
    tendon, dissipater, pivot, abutment : table, optional
        Restraints of the frame.
    isolated, fixed : table, optional
        Rivals for comparison: the same deck on isolators, and on monolithic columns.
    """

    kind: Literal["rocking"] = "rocking"
    height_m: float
    width_m: float
    mass_ratio: float = 0.0
    section: Literal["rectangular", "circular"] | None = None
    section_both: Literal["circular"] | None = None
    top_width_m: float | None = None
    inner_width_m: float | None = None
    depth_m: float | None = None
    inner_depth_m: float | None = None
    inertia_ratio: float | None = None
    centre_of_gravity_m: float | None = None
    restitution_factor: float = 1.0
    beam_depth_m: float | None = None
    columns: int | None = None
    beam_mass_kg: float | None = None
    beam_length_m: float | None = None
    beam_width_m: float | None = None
    column_mass_kg: float | None = None
    density_kg_m3: float | None = None
    friction_coefficient: float | None = None
    tendon: Tendon | None = None
    dissipater: Dissipater | None = None
    pivot: Pivot | None = None
    abutment: Abutment | None = None
    isolated: IsolatedEntry | None = None
    fixed: FixedEntry | None = None

    def made(self) -> RockingFrame:
        """Return the frame that the entry describes; its edges crush if the entry states a pivot.

        Raises
        ------
        ParameterError
            If the frame does not rock, or if keys exclude each other.
        """
        return self.on_pivots(self.whole())

    def unusual(self) -> str:
        """Return what is unusual about height, mass ratio or slenderness; "" if nothing is."""
        frame = self.made()
        return unusual(frame.height, frame.mass_ratio, frame.slenderness)

    def whole(self) -> RockingFrame:
        """Return the frame with intact edges."""
        self._reject_contradictions()
        shape = self._shape()
        stated = self.top_width_m is not None or self.centre_of_gravity_m is not None
        return RockingFrame(
            height=self.height_m,
            width=self.width_m,
            mass_ratio=self._mass_ratio(),
            name=self.name,
            inertia_ratio=shape.inertia_ratio,
            restitution_factor=self.restitution_factor,
            top_width=self.top_width_m,
            centre_of_gravity=shape.centre_of_gravity if stated else None,
            beam_depth=self.beam_depth_m,
            columns=self.columns,
            column_mass=self._mass(),
            section=self._section(),
            section_both=self.section_both,
            friction_coefficient=self.friction_coefficient,
            tendon=self.tendon,
            dissipater=self.dissipater,
            abutment=self.abutment,
        )

    def on_pivots(self, frame: RockingFrame) -> RockingFrame:
        """Return the frame with crushed edges, if the entry states a pivot."""
        return frame if self.pivot is None else crushed(frame, self.pivot)

    def _mass(self) -> float | None:
        """Return the mass of a column, stated or from its density [kg]."""
        if self.density_kg_m3 is None:
            return self.column_mass_kg
        if not 0.0 < self.density_kg_m3 < math.inf:
            raise invalid("density", self.density_kg_m3, f"frame {self.name!r}", "positive")
        return self.density_kg_m3 * volume(
            self.section or "rectangular",
            *(self.height_m, self.width_m),
            top_width=self.top_width_m,
            inner_width=self.inner_width_m,
            depth=self.depth_m,
            inner_depth=self.inner_depth_m,
        )

    def _mass_ratio(self) -> float:
        """Return the mass of the beam over that of all columns [1]."""
        beam = self.beam_mass_kg
        owner = f"frame {self.name!r}"
        if self.beam_length_m is not None:
            sides = (self.beam_length_m, self.beam_width_m, self.beam_depth_m, self.density_kg_m3)
            if None in sides:
                allowed = "stated with beam_width_m, beam_depth_m and density_kg_m3"
                raise invalid("beam_length", self.beam_length_m, owner, allowed)
            for key in ("beam_length", "beam_width"):
                side = getattr(self, f"{key}_m")
                if not 0.0 < side < math.inf:
                    raise invalid(key, side, owner, "positive")
            beam = math.prod(side or 0.0 for side in sides)
        if beam is None:
            return self.mass_ratio
        if not 0.0 < beam < math.inf:
            raise invalid("beam_mass", beam, owner, "positive")
        if self.mass_ratio != 0.0:
            raise invalid("mass_ratio", self.mass_ratio, owner, "absent: the beam's mass gives it")
        column = self._mass()
        if column is None or self.columns is None:
            allowed = "stated with columns, their number, and with column_mass_kg or density_kg_m3"
            raise invalid("beam_mass", beam, owner, allowed)
        if not 0.0 < column < math.inf:
            raise invalid("column_mass", column, owner, "positive")
        return beam / (max(self.columns, 1) * column)

    def _section(self) -> str | None:
        """Return the section of the columns; None if their inertia is stated instead."""
        return None if self.inertia_ratio is not None else self.section or "rectangular"

    def _shape(self) -> ColumnShape:
        section = self.section or "rectangular"
        size = (self.height_m, self.width_m)
        if self.inertia_ratio is not None:
            centre = self.centre_of_gravity_m
            return ColumnShape(self.inertia_ratio, 0.5 * size[0] if centre is None else centre)
        if self.top_width_m is not None:
            return tapered(section, *size, self.top_width_m)
        if self.inner_width_m is not None:
            return hollow(section, *size, self.inner_width_m, self.depth_m, self.inner_depth_m)
        return ColumnShape(inertia_ratio_of(section, *size), 0.5 * size[0])

    def _reject_contradictions(self) -> None:
        """Reject keys that exclude each other, and keys that need a missing key."""
        excluded = {
            "inertia_ratio": ("section", "inner_width_m", "depth_m", "inner_depth_m"),
            "top_width_m": ("inner_width_m", "inner_depth_m"),
            "density_kg_m3": ("column_mass_kg", "inertia_ratio"),
            "beam_mass_kg": ("beam_length_m", "beam_width_m"),
        }
        needed = {
            "centre_of_gravity_m": "inertia_ratio",
            "inner_depth_m": "inner_width_m",
            "beam_width_m": "beam_length_m",
        }
        if self.density_kg_m3 is None and self.column_mass_kg is None:
            needed["depth_m"] = "inner_width_m"
        if self.inertia_ratio is not None and self.top_width_m is not None:
            needed["inertia_ratio"] = "centre_of_gravity_m"
        for key, others in excluded.items():
            for other in others:
                if None not in (getattr(self, key), getattr(self, other)):
                    allowed = f"absent where {other} {getattr(self, other)!r} is stated"
                    raise invalid(key, getattr(self, key), f"frame {self.name!r}", allowed)
        for key, other in needed.items():
            if getattr(self, key) is not None and getattr(self, other) is None:
                allowed = f"stated with {_CURES.get(key, other)}"
                raise invalid(key, getattr(self, key), f"frame {self.name!r}", allowed)


#: What to state with a key that needs another one, if there is a choice.
_CURES: Final = {
    "depth_m": "density_kg_m3 (a solid column needs its depth for its mass alone), or with "
    "inner_width_m (a hollow column)",
}
