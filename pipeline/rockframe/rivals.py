"""Models to compare with the rocking frame: its deck on isolators, and a monolithic frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final, Self, TypeAlias

from rockframe.errors import ParameterError, invalid
from rockframe.parts import Abutment
from rockframe.units import GRAVITY

#: k [s-2], k_z [s-2], q [m s-2] and c [s-1] of the equation of motion.
Constants: TypeAlias = tuple[float, float, float, float]
#: Kinetic energy of a column fixed at both ends, over that of its mass moving with the deck: the
#: mean square of its shape 3 x^2 - 2 x^3.
COLUMN_SHARE: Final = 13.0 / 35.0
#: Default largest ductility for which a monolithic frame is valid: the displacement ductility that
#: Caltrans, Seismic Design Criteria 1.7 (2013), section 2.2.4, allows in bents of several columns.
LIMIT_DUCTILITY: Final = 5.0
#: Default yield displacement of a lead-rubber bearing [m].
YIELD_DISPLACEMENT: Final = 0.01


@dataclass(frozen=True, kw_only=True)
class IsolatedDeck:
    """A deck on isolators and rigid piers, moving along one axis.

    The mass cancels. The vertical acceleration of the ground is ignored: the weight on the
    isolators, and therefore their strength, is that at rest. Friction does not depend on velocity,
    pressure or temperature, and the drift of the deck excludes that of flexible piers.

    Parameters
    ----------
    strength_ratio : float
        Force of the isolators at zero displacement over the weight of the deck [1]: the
        characteristic strength of lead-rubber bearings, the coefficient of friction of pendulums.
    period : float
        Period of the deck [s] with the stiffness of the isolators after yielding or while sliding.
    yield_displacement : float
        Displacement at which the isolators first yield [m]; 0 if they stick until they slide.
    damping_ratio : float
        Viscous damping over the critical damping of the stiffness after yielding [1].
    mass_ratio : float
        Mass of the deck over that of the piers [1], for the base shear; infinite without piers.
    abutment : Abutment, optional
        Gap at the ends of the deck, which ends the model where it closes.
    name : str
        Name in tables.

    Raises
    ------
    ParameterError
        Unless strength, period and mass ratio are positive, the yield displacement zero or
        positive, and the damping ratio at least 0 and below 1.

    See Also
    --------
    lead_rubber, friction_pendulum : Isolators from the quantities that engineers state.

    Notes
    -----
    u'' + 2 zeta w u' + w^2 u + z = -a with w = 2 pi / period, where z is elastic-perfectly plastic
    with the strength g ``strength_ratio``. The sum w^2 u + z is a bilinear spring with kinematic
    hardening.
    """

    kind: ClassVar[str] = "isolated"

    strength_ratio: float
    period: float
    yield_displacement: float
    damping_ratio: float = 0.0
    mass_ratio: float = math.inf
    abutment: Abutment | None = None
    name: str = "isolated"

    def __post_init__(self) -> None:
        _require_positive(self.name, strength_ratio=self.strength_ratio, period=self.period)
        _require_mass_ratio(self.name, self.mass_ratio)
        if not 0.0 <= self.yield_displacement < math.inf:
            raise invalid(
                "yield_displacement", self.yield_displacement, repr(self.name), "0 or above"
            )
        _require_ratio(self.name, "damping_ratio", self.damping_ratio)

    @classmethod
    def lead_rubber(
        cls,
        *,
        strength_ratio: float,
        period: float | None = None,
        effective_period: float | None = None,
        design_displacement: float | None = None,
        yield_displacement: float = YIELD_DISPLACEMENT,
        damping_ratio: float = 0.0,
        name: str = "isolated",
    ) -> Self:
        """Return a deck on lead-rubber bearings.

        Parameters
        ----------
        strength_ratio : float
            Characteristic strength over the weight of the deck [1].
        period : float, optional
            Period of the stiffness after yielding [s].
        effective_period, design_displacement : float, optional
            Instead of ``period``: the period [s] of the secant stiffness at a displacement [m].
        yield_displacement, damping_ratio, name
            See `IsolatedDeck`.

        Raises
        ------
        ParameterError
            Unless either ``period`` or both others are stated; or if the strength alone makes the
            secant period shorter than the effective period.

        Examples
        --------
        >>> deck = IsolatedDeck.lead_rubber(
        ...     strength_ratio=0.05, effective_period=2.5, design_displacement=0.25
        ... )
        >>> round(deck.period, 3)
        3.011
        """
        if effective_period is None or design_displacement is None:
            if period is None or not (effective_period is None and design_displacement is None):
                raise ParameterError(
                    f"Invalid periods of {name!r}. State period, or both effective_period and "
                    "design_displacement."
                )
        elif period is not None:
            raise invalid("period", period, repr(name), "absent where effective_period is stated")
        else:
            _require_positive(
                name,
                strength_ratio=strength_ratio,
                effective_period=effective_period,
                design_displacement=design_displacement,
            )
            if design_displacement < yield_displacement:
                least = f"at least the yield_displacement, {yield_displacement:g} m"
                raise invalid("design_displacement", design_displacement, repr(name), least)
            strength = strength_ratio * GRAVITY / design_displacement
            stiffness = (math.tau / effective_period) ** 2 - strength
            if stiffness <= 0.0:
                longest = (
                    f"below {math.tau / math.sqrt(strength):.4g} s, that of the strength alone at "
                    f"{design_displacement:g} m"
                )
                raise invalid("effective_period", effective_period, repr(name), longest)
            period = math.tau / math.sqrt(stiffness)
        return cls(
            strength_ratio=strength_ratio,
            period=period,
            yield_displacement=yield_displacement,
            damping_ratio=damping_ratio,
            name=name,
        )

    @classmethod
    def friction_pendulum(
        cls, *, radius: float, friction: float, damping_ratio: float = 0.0, name: str = "isolated"
    ) -> Self:
        """Return a deck on friction pendulums, which are rigid until they slide.

        Parameters
        ----------
        radius : float
            Effective radius of the sliding surfaces [m]; the stiffness over the mass is g / radius.
        friction : float
            Coefficient of friction, the same at rest and in motion [1].
        damping_ratio, name
            See `IsolatedDeck`.

        Examples
        --------
        >>> round(IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06).period, 3)
        2.837
        """
        _require_positive(name, radius=radius, friction=friction)
        return cls(
            strength_ratio=friction,
            period=math.tau * math.sqrt(radius / GRAVITY),
            yield_displacement=0.0,
            damping_ratio=damping_ratio,
            name=name,
        )

    @property
    def limit_ductility(self) -> float:
        """Largest ductility for which the model is valid [1]: isolators have no limit."""
        return math.inf

    @property
    def constants(self) -> Constants:
        """k, k_z [s-2], q [m s-2] and c [s-1] of the kernel."""
        rate = math.tau / self.period
        strength = self.strength_ratio * GRAVITY
        rigid = self.yield_displacement == 0.0
        stiffness = math.inf if rigid else strength / self.yield_displacement
        return rate**2, stiffness, strength, 2.0 * self.damping_ratio * rate


@dataclass(frozen=True, kw_only=True)
class FixedFrame:
    """A frame whose columns are fixed to the ground and to the deck, moving along one axis.

    The mass cancels. The vertical acceleration of the ground is ignored.

    Parameters
    ----------
    period : float
        Natural period of the elastic frame without P-delta [s].
    damping_ratio : float
        Viscous damping over the critical damping of the elastic frame [1]; it does not change with
        yielding.
    strength_ratio : float
        Force of the columns at first yield over the weight of the effective mass [1]; infinite if
        elastic.
    post_yield_ratio : float
        Stiffness of the columns after yielding over the elastic one (hardening) [1].
    stability_coefficient : float
        Moment of the weight on the displaced columns (P-delta) over that of their elastic shear
        [1]; 0 without P-delta.
    limit_ductility : float
        Largest displacement over the yield displacement for which the model is valid [1].
    mass_ratio : float
        Mass of the deck over that of all columns [1], for the base shear; infinite if the columns
        have no mass.
    abutment : Abutment, optional
        Gap at the ends of the deck, which ends the model where it closes.
    name : str
        Name in tables.

    Raises
    ------
    ParameterError
        Unless period, strength and mass ratio are positive, the limit of ductility is at least 1,
        and the ratios are at least 0 and below 1.

    See Also
    --------
    from_columns : Frame from dimensions, modulus and masses.

    Notes
    -----
    u'' + 2 zeta w u' + f(u) - theta w^2 u = -a with w = 2 pi / period, theta the stability
    coefficient, and f elastic or bilinear with kinematic hardening. If theta exceeds the post-yield
    ratio r, the stiffness after yielding is negative. Beyond a ductility of (1 - r) / (theta - r)
    the frame then collapses, unless the ground pushes it back.
    """

    kind: ClassVar[str] = "fixed"

    period: float
    damping_ratio: float = 0.05
    strength_ratio: float = math.inf
    post_yield_ratio: float = 0.0
    stability_coefficient: float = 0.0
    limit_ductility: float = LIMIT_DUCTILITY
    mass_ratio: float = math.inf
    abutment: Abutment | None = None
    name: str = "fixed"

    def __post_init__(self) -> None:
        _require_positive(self.name, period=self.period)
        _require_mass_ratio(self.name, self.mass_ratio)
        if not self.strength_ratio > 0.0:
            raise invalid("strength_ratio", self.strength_ratio, repr(self.name), "above 0")
        for key in ("damping_ratio", "post_yield_ratio", "stability_coefficient"):
            _require_ratio(self.name, key, getattr(self, key))
        if not self.limit_ductility >= 1.0:
            raise invalid("limit_ductility", self.limit_ductility, repr(self.name), "at least 1")

    @classmethod
    def from_columns(
        cls,
        *,
        columns: int,
        height: float,
        width: float,
        depth: float | None = None,
        modulus: float,
        column_mass: float,
        deck_mass: float,
        cracked_stiffness_ratio: float = 1.0,
        damping_ratio: float = 0.05,
        strength_ratio: float = math.inf,
        post_yield_ratio: float = 0.0,
        p_delta: bool = True,
        limit_ductility: float = LIMIT_DUCTILITY,
        name: str = "fixed",
    ) -> Self:
        """Return the frame of equal columns under a rigid deck.

        Parameters
        ----------
        columns : int
            Number of columns.
        height, width : float
            Clear height, and width along the motion [m].
        depth : float, optional
            Depth across the motion [m]; by default the columns are circular.
        modulus : float
            Young's modulus [Pa].
        column_mass, deck_mass : float
            Mass of one column and of the deck [kg].
        cracked_stiffness_ratio : float
            Stiffness of the cracked section over that of the whole one [1].
        p_delta : bool
            If true, the weight of the deck and half that of the columns act on the drift.
        damping_ratio, strength_ratio, post_yield_ratio, limit_ductility, name
            See `FixedFrame`.

        Notes
        -----
        Each column has the stiffness 12 E I / H^3. The effective mass is the mass of the deck and
        13/35 of that of the columns. This share is the integral of (3 x^2 - 2 x^3)^2, the squared
        shape of a column whose ends do not rotate. The ground motion is assumed to load the same
        mass.

        P-delta reduces the stiffness by W / H, with the weight W of the deck and half the columns:
        the weight of a column acts at mid-height, which moves by half the drift. The columns count
        as straight between their ends (an elastic column bends, which makes the reduction a fifth
        larger).

        Examples
        --------
        >>> frame = FixedFrame.from_columns(
        ...     columns=2, height=9.6, width=1.6, depth=1.6, modulus=30e9, column_mass=61440.0,
        ...     deck_mass=491520.0, cracked_stiffness_ratio=0.5,
        ... )
        >>> round(frame.period, 3)
        0.309
        """
        depths = {"depth": depth} if depth is not None else {}
        _require_positive(
            name,
            columns=columns,
            height=height,
            width=width,
            modulus=modulus,
            deck_mass=deck_mass,
            cracked_stiffness_ratio=cracked_stiffness_ratio,
            **depths,
        )
        if not 0.0 <= column_mass < math.inf:
            raise invalid("column_mass", column_mass, repr(name), "0 or above")
        inertia = math.pi * width**4 / 64.0 if depth is None else depth * width**3 / 12.0
        stiffness = 12.0 * columns * cracked_stiffness_ratio * modulus * inertia / height**3
        mass = deck_mass + COLUMN_SHARE * columns * column_mass
        geometric = (deck_mass + 0.5 * columns * column_mass) * GRAVITY / height
        if p_delta and geometric >= stiffness:
            least = f"above {modulus * geometric / stiffness:.4g} Pa; the columns buckle below it"
            raise invalid("modulus", modulus, repr(name), least)
        return cls(
            period=math.tau * math.sqrt(mass / stiffness),
            damping_ratio=damping_ratio,
            strength_ratio=strength_ratio,
            post_yield_ratio=post_yield_ratio,
            stability_coefficient=geometric / stiffness if p_delta else 0.0,
            limit_ductility=limit_ductility,
            mass_ratio=deck_mass / (columns * column_mass) if column_mass > 0.0 else math.inf,
            name=name,
        )

    @property
    def yield_displacement(self) -> float:
        """Displacement at first yield [m]; infinite if elastic."""
        return self.strength_ratio * GRAVITY * (self.period / math.tau) ** 2

    @property
    def constants(self) -> Constants:
        """k, k_z [s-2], q [m s-2] and c [s-1] of the kernel."""
        rate = math.tau / self.period
        damping = 2.0 * self.damping_ratio * rate
        if math.isinf(self.strength_ratio):
            return (1.0 - self.stability_coefficient) * rate**2, 0.0, math.inf, damping
        after, yielding = self.post_yield_ratio, 1.0 - self.post_yield_ratio
        strength = yielding * self.strength_ratio * GRAVITY
        stiffness = (after - self.stability_coefficient) * rate**2
        return stiffness, yielding * rate**2, strength, damping


def _require_positive(name: str, **values: float) -> None:
    for key, value in values.items():
        if not 0.0 < value < math.inf:
            raise invalid(key, value, repr(name), "positive and finite")


def _require_mass_ratio(name: str, ratio: float) -> None:
    if not ratio > 0.0:
        raise invalid("mass_ratio", ratio, repr(name), "positive")


def _require_ratio(name: str, key: str, ratio: float) -> None:
    if not 0.0 <= ratio < 1.0:
        raise invalid(key, ratio, repr(name), "at least 0 and below 1")
