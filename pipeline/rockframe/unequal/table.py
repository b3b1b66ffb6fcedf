"""The ``[[structure]]`` table of a bent of two unequal columns."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import Field, model_validator

from rockframe.frame import unusual
from rockframe.options.model import rule
from rockframe.study.structures import StructureTable
from rockframe.unequal.bent import UnequalBent

#: Tables of rocking frames that bents of unequal columns do not have.
_ABSENT: Final = ("tendon", "dissipater", "pivot", "abutment", "isolated", "fixed")
_Two = Annotated[tuple[float, ...], Field(strict=False)]


class UnequalStructure(StructureTable):
    """A ``[[structure]]`` of two rectangular columns of unequal size under one rigid beam."""

    kind: Literal["unequal"] = "unequal"
    """Kind of the structure."""
    heights_m: _Two
    """Heights of the left and the right column [m]."""
    widths_m: _Two
    """Widths of the left and the right column along the motion [m]."""
    spacing_m: float
    """Distance between the axes of the columns [m]."""
    mass_ratio: float = 0.0
    """Mass of the beam over that of both columns."""
    beam_depth_m: float = 0.0
    """Depth of the beam [m]; its centre of mass is at half the depth."""
    beam_offset_m: float = 0.0
    """Distance of the beam's centre of mass from the middle between the axes, to the right [m]."""
    column_masses_kg: Annotated[
        tuple[float, ...] | None, Field(strict=False, examples=[[49000.0, 38000.0]])
    ] = None
    """Masses of the columns [kg]; by default both have the same density and depth."""
    restitution_factor: float = 1.0
    """Factor on the velocity ratio of both impacts."""

    @model_validator(mode="before")
    @classmethod
    def _without_restraints(cls, value: Any) -> Any:
        for key in _ABSENT if isinstance(value, dict) else ():
            if key in value:
                raise rule(f"{key} is not modelled for unequal columns. Must be absent")
        return value

    def made(self) -> UnequalBent:
        """Return the bent that the table describes."""
        return UnequalBent(
            name=self.name,
            heights=self.heights_m,
            widths=self.widths_m,
            spacing=self.spacing_m,
            mass_ratio=self.mass_ratio,
            beam_depth=self.beam_depth_m,
            beam_offset=self.beam_offset_m,
            column_masses=self.column_masses_kg,
            restitution_factor=self.restitution_factor,
        )

    def unusual(self) -> str:
        """Return which values are unusual, in words; "" if none is."""
        bent = self.made()
        each = [
            unusual(height, self.mass_ratio, min(bent.balance_rotations))
            for height in self.heights_m
        ]
        return "; ".join(dict.fromkeys(words for words in each if words))
