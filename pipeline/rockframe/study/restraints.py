"""Tables of restraints and of alternative systems, in files of structures and studies."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from rockframe.errors import invalid
from rockframe.options.model import Options, rule
from rockframe.restraint import Abutment, Dissipater, Pivot, Tendon
from rockframe.rivals import COLUMN_SHARE, LIMIT_DUCTILITY, FixedFrame, IsolatedDeck
from rockframe.units import GRAVITY


def _for_example(value: float) -> Any:
    return Field(examples=[value])


class TableEntry(Options):
    """A table that is checked by building the object that it describes."""

    @model_validator(mode="after")
    def _checked(self) -> Self:
        try:
            self.made()
        except ArithmeticError:
            message = "a value of this table is too large or too small to compute with"
            raise rule(f"{message}. Check units and values") from None
        return self

    @abstractmethod
    def made(self) -> Any:
        """Return the object that the table describes."""


class TendonEntry(TableEntry):
    """A tendon through the axis of each column, from the foundation to the beam."""

    area_m2: Annotated[float, _for_example(1.0e-3)]
    """Cross-section [m2]."""
    modulus_pa: Annotated[float, _for_example(195.0e9)]
    """Young's modulus [Pa]."""
    length_m: Annotated[float | None, _for_example(9.6)] = None
    """Free length [m]; by default the height of the column."""
    prestress_n: float = 0.0
    """Force at rest [N]."""
    yield_stress_pa: Annotated[float | None, _for_example(1.6e9)] = None
    """Yield stress [Pa]; by default the tendon never yields."""
    loses_prestress: bool = False
    """Model the loss of prestress when the tendon yields; otherwise only the time of yielding is
    reported."""

    def made(self, height: float = 1.0) -> Tendon:
        """Return the tendon; by default as long as the column is high."""
        return Tendon(
            area=self.area_m2,
            modulus=self.modulus_pa,
            length=height if self.length_m is None else self.length_m,
            prestress=self.prestress_n,
            yield_stress=math.inf if self.yield_stress_pa is None else self.yield_stress_pa,
            loses_prestress=self.loses_prestress,
        )


class DissipaterEntry(TableEntry):
    """Bars that yield across each joint of a column."""

    stiffness_n_m: Annotated[float, _for_example(5.0e7)]
    """Stiffness of all bars across one joint [N/m]."""
    yield_force_n: Annotated[float, _for_example(1.0e5)]
    """Yield force of all bars across one joint [N]."""
    lever_arm_m: Annotated[float, _for_example(0.8)]
    """Distance from the pivot to the bars, before its edge crushes [m]; the same for rocking to
    either side, as of bars on the axis."""

    def made(self) -> Dissipater:
        """Return the dissipater."""
        return Dissipater(
            stiffness=self.stiffness_n_m,
            yield_force=self.yield_force_n,
            lever_arm=self.lever_arm_m,
        )


class IsolatedEntry(TableEntry):
    """Isolators under the deck: lead-rubber bearings, or friction pendulums."""

    strength_ratio: Annotated[float | None, _for_example(0.05)] = None
    """Characteristic strength of lead-rubber bearings over the weight of the deck."""
    period_s: Annotated[float | None, _for_example(3.0)] = None
    """Period from the stiffness of lead-rubber bearings after yielding [s]."""
    effective_period_s: Annotated[float | None, _for_example(2.5)] = None
    """Period from the secant stiffness at the design displacement [s]; replaces period_s."""
    design_displacement_m: Annotated[float | None, _for_example(0.25)] = None
    """Design displacement [m]."""
    yield_displacement_m: float = 0.01
    """Yield displacement of lead-rubber bearings [m]."""
    radius_m: Annotated[float | None, _for_example(2.5)] = None
    """Radius of friction pendulums [m]."""
    friction: Annotated[float | None, _for_example(0.05)] = None
    """Coefficient of friction of friction pendulums."""
    damping_ratio: float = 0.0
    """Viscous damping, as a fraction of critical damping."""

    def made(self) -> IsolatedDeck:
        """Return the deck on its isolators."""
        if self.radius_m is not None or self.friction is not None:
            pair = ("radius_m", "friction")
            for key, field in type(self).model_fields.items():
                value = getattr(self, key)
                if key not in (*pair, "damping_ratio") and value != field.default:
                    raise invalid(key, value, "isolators", "absent where a pendulum is stated")
            for key, other in (pair, pair[::-1]):
                if getattr(self, key) is None:
                    raise invalid(key, None, "friction pendulums", f"stated together with {other}")
            return IsolatedDeck.friction_pendulum(
                radius=self.radius_m,  # type: ignore[arg-type]
                friction=self.friction,  # type: ignore[arg-type]
                damping_ratio=self.damping_ratio,
            )
        if self.strength_ratio is None:
            pendulum = "stated, or radius_m and friction of a pendulum"
            raise invalid("strength_ratio", None, "lead-rubber bearings", pendulum)
        pair = ("effective_period_s", "design_displacement_m")
        stated = [key for key in pair if getattr(self, key) is not None]
        if self.period_s is None and len(stated) < len(pair):
            raise invalid("period_s", None, "bearings", f"stated, or {' and '.join(pair)}")
        if self.period_s is not None and stated:
            raise invalid(
                "period_s", self.period_s, "bearings", f"absent where {stated[0]} is stated"
            )
        return IsolatedDeck.lead_rubber(
            strength_ratio=self.strength_ratio,
            period=self.period_s,
            effective_period=self.effective_period_s,
            design_displacement=self.design_displacement_m,
            yield_displacement=self.yield_displacement_m,
            damping_ratio=self.damping_ratio,
        )


class FixedEntry(TableEntry):
    """Columns that are monolithic with ground and deck."""

    modulus_pa: Annotated[float, _for_example(30.0e9)]
    """Young's modulus of the columns [Pa]."""
    cracked_stiffness_ratio: float = 1.0
    """Stiffness of the cracked section over that of the uncracked section."""
    damping_ratio: float = 0.05
    """Viscous damping, as a fraction of critical damping."""
    strength_ratio: Annotated[float | None, _for_example(0.2)] = None
    """Force at first yield over the weight of the deck and of 13/35 of the columns; by default the
    columns do not yield."""
    moment_capacity_nm: Annotated[float | None, _for_example(4.0e6)] = None
    """Moment at which both ends of a column yield [N m]; replaces strength_ratio."""
    post_yield_ratio: float = 0.0
    """Ratio of the stiffness after yielding to the elastic stiffness (hardening)."""
    p_delta: bool = True
    """Include P-delta: the moment of the weight of the deck and half the columns on the drift."""
    limit_ductility: float = LIMIT_DUCTILITY
    """Largest drift over the yield drift for which the model is valid; by default that of Caltrans,
    Seismic Design Criteria 1.7, section 2.2.4, for bents of several columns."""

    def made(
        self,
        *,
        height: float = 1.0,
        width: float = 1.0,
        depth: float | None = None,
        column_mass: float = 0.0,
        deck_mass: float = 1.0,
    ) -> FixedFrame:
        """Return the frame of one column with these dimensions [m] and masses [kg]."""
        strength = math.inf if self.strength_ratio is None else self.strength_ratio
        if self.moment_capacity_nm is not None:
            if self.strength_ratio is not None:
                ratio = f"absent where strength_ratio {self.strength_ratio:g} is stated"
                raise invalid("moment_capacity", self.moment_capacity_nm, "columns", ratio)
            if not self.moment_capacity_nm > 0.0:
                raise invalid("moment_capacity", self.moment_capacity_nm, "columns", "positive")
            moving = (deck_mass + COLUMN_SHARE * column_mass) * GRAVITY
            strength = 2.0 * self.moment_capacity_nm / (height * moving)
        return FixedFrame.from_columns(
            columns=1,
            height=height,
            width=width,
            depth=depth,
            modulus=self.modulus_pa,
            column_mass=column_mass,
            deck_mass=deck_mass,
            cracked_stiffness_ratio=self.cracked_stiffness_ratio,
            damping_ratio=self.damping_ratio,
            strength_ratio=strength,
            post_yield_ratio=self.post_yield_ratio,
            p_delta=self.p_delta,
            limit_ductility=self.limit_ductility,
        )


class PivotEntry(TableEntry):
    """``[structure.pivot]``: the edges on which columns rock; the edges crush."""

    compressive_strength_pa: float
    depth_m: float

    def made(self) -> Pivot:
        """Return the pivot."""
        return Pivot(compressive_strength=self.compressive_strength_pa, depth=self.depth_m)


class AbutmentEntry(TableEntry):
    """``[structure.abutment]``: the joints at the ends of the deck."""

    gap_m: float
    uplift_allowance_m: float | None = None

    def made(self) -> Abutment:
        """Return the joint; without an allowance the lift of the deck is unlimited."""
        allowance = math.inf if self.uplift_allowance_m is None else self.uplift_allowance_m
        return Abutment(gap=self.gap_m, uplift_allowance=allowance)
