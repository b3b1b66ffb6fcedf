"""The quantities of responses, each declared once.

Variables of files, columns of tables, limits, matrices and designs derive from `QUANTITIES`. A
quantity has one name: in Python, in files, and, with its unit as suffix, in tables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from rockframe.cells import in_digits

#: Endings of columns in a unit of files.
_SUFFIXES: Final = MappingProxyType(
    {"1": "", "m": "_m", "m s-1": "_m_s", "N": "_n", "kN": "_kn", "s": "_s"}
)
#: Quantiles of the members' peaks that are stored and printed [1].
QUANTILES: Final = (0.16, 0.50, 0.84)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity of the response of a structure to a motion.

    Parameters
    ----------
    name : str
        Name in Python and of the variable in files.
    units : str
        Unit as CF writes it.
    long_name : str
        Description of the variable.
    symbol : str
        Symbol, or a short name, in tables and on axes.
    kind : {"peak", "force", "impulse", "tie", "ratio"}
        A peak of the motion of the structure; a force over the weight of a column with its share of
        the beam [1], an impulse over it [s], or a force of a tendon or dissipaters [N]; or a peak
        over what a part of the structure allows.
    of_joints : bool
        It is computed with the forces at the joints only, because it needs the whole history.
    shown_unit : str
        Unit for people; empty for numbers without a unit.
    factor : float
        Conversion from `units` to `shown_unit`.
    form : str
        Format of numbers in `shown_unit`.
    priority : int
        Where a table is too narrow, columns of larger numbers are left out first.
    comment : str
        What the values leave out, and when they are unknown.
    taken : str
        Object that has the value in a response to one motion: ``response``, ``restraint``,
        ``forces``, or ``column_forces`` of structures whose columns differ; ``kind`` if it is the
        response, of some kinds of structures only; empty if only ensembles have it.
    banded : bool
        Ensembles have its 16, 50 and 84 % quantiles.
    limited : bool
        Limits of it define damage states, and designs can keep it below a limit.
    matrix : bool
        Tables show it as a matrix of records and structures, and summaries over all records.
    later : bool
        Files of earlier releases lack it, and still open: it is NaN in their tables. True for each
        quantity that is added after 1.0.

    Examples
    --------
    >>> u = QUANTITIES["peak_u"]
    >>> u.column(), u.column(0.84), u.heading, u.text(0.135)
    ('peak_u_m', 'peak_u_84_m', 'u [cm]', '13.5')
    """

    name: str
    units: str
    long_name: str
    symbol: str
    kind: Literal["peak", "force", "impulse", "tie", "ratio"] = "peak"
    of_joints: bool = False
    shown_unit: str = ""
    factor: float = 1.0
    form: str = ".3f"
    priority: int = 3
    comment: str = ""
    taken: str = ""
    banded: bool = False
    limited: bool = False
    matrix: bool = False
    later: bool = False

    @property
    def suffix(self) -> str:
        """The ending of its columns in the unit of files."""
        return _SUFFIXES[self.units]

    def column(self, part: float | str = "") -> str:
        """Return the column of the value, of a quantile [1], or with a word such as ``worst``."""
        words = f"{100.0 * part:.0f}" if isinstance(part, float) else part
        return f"{self.name}{f'_{words}' if words else ''}{self.suffix}"

    @property
    def band(self) -> str:
        """The variable of its bands."""
        return f"{self.name}_band"

    @property
    def band_columns(self) -> dict[str, str]:
        """The column of each quantile, with its variable and place."""
        return {self.column(share): f"{self.band}.{place}" for place, share in enumerate(QUANTILES)}

    @property
    def si_unit(self) -> str:
        """The unit of files as people write it; empty for numbers without a unit."""
        return self.units.replace(" s-1", "/s").removeprefix("1")

    @property
    def heading(self) -> str:
        """Symbol and unit for people."""
        return f"{self.symbol} [{self.shown_unit}]" if self.shown_unit else self.symbol

    def text(self, value: float) -> str:
        """Return a value in the unit for people; a dash if it is unknown."""
        return in_digits(self.factor * value, self.form)

    def outcome(self, value: float) -> str:
        """Return a value in the unit for people; an infinite one means that it overturns."""
        return "overturns" if value == math.inf else self.text(value)


#: Time over which forces are averaged while round columns move in both directions [s].
FORCE_DURATION: Final = 0.01
#: What forces are divided by.
_OVER_WEIGHT: Final = "over the weight of a column with its share of the beam"
#: When forces are taken.
_AT_SAMPLES: Final = f"at the samples; in both directions, in motion, means over {FORCE_DURATION} s"


def _at_joint(place: str, joint: str, more: str) -> tuple[Quantity, ...]:
    """Declare the forces and the impulses in the joints at one end of the columns."""
    at_samples = f"{_AT_SAMPLES}; the mean of all columns"
    key = (
        "largest horizontal force less friction_coefficient times the vertical force of the same "
        "instant; where no coefficient is stated, nothing is subtracted"
    )
    lifts = f"if it is not positive, the joint would lift off; {at_samples}"
    forces = (
        ("joint_horizontal", "largest horizontal force", "horizontal", at_samples),
        ("joint_vertical", "largest vertical force", "vertical, largest", at_samples),
        ("joint_vertical_least", "least vertical force", "vertical, least", lifts),
        ("key_force", "force of a shear key", "shear key", key),
    )
    return (
        *(
            Quantity(
                name=f"{place}_{name}",
                units="1",
                long_name=f"{words} in {joint} {_OVER_WEIGHT}",
                symbol=f"{place} joint, {symbol}",
                kind="force",
                shown_unit="W",
                of_joints=True,
                taken="forces",
                comment=f"{comment}{more}",
                banded=True,
            )
            for name, words, symbol, comment in forces
        ),
        *(
            Quantity(
                name=f"{place}_impulse_{direction}",
                units="s",
                long_name=f"{direction} impulse in {joint} of the strongest impact {_OVER_WEIGHT}",
                symbol=f"{place} joint, impact, {direction}",
                kind="impulse",
                shown_unit="W s",
                of_joints=True,
                taken="forces",
                comment=f"0 without impacts{more}",
                banded=True,
            )
            for direction in ("horizontal", "vertical")
        ),
    )


def _of_column(side: str, place: str, joint: str) -> tuple[Quantity, ...]:
    """Declare forces and impulses in the joint at one end of one of two columns that differ."""
    at_samples = "at the samples, while the structure rocks"
    lifts = f"{at_samples}; if it is not positive, the joint would lift off"
    forces = (
        ("horizontal", "largest horizontal force", "horizontal", at_samples),
        ("vertical", "largest vertical force", "vertical, largest", at_samples),
        ("vertical_least", "least vertical force", "vertical, least", lifts),
        *(
            (
                f"impulse_{direction}",
                f"largest {direction} impulse of impacts",
                f"impact, {direction}",
                "0 without impacts",
            )
            for direction in ("horizontal", "vertical")
        ),
    )
    return tuple(
        Quantity(
            name=f"{side}_{place}_{name}",
            units="s" if name.startswith("impulse") else "1",
            long_name=f"{words} in {joint} of the {side} column over half the weight of columns "
            "and beam",
            symbol=f"{side} column, {place} joint, {symbol}",
            kind="impulse" if name.startswith("impulse") else "force",
            shown_unit="W s" if name.startswith("impulse") else "W",
            of_joints=True,
            taken="column_forces",
            comment=f"{comment}; of an ensemble, those of the members that uplift",
            banded=True,
        )
        for name, words, symbol, comment in forces
    )


_DECLARED: Final = (
    Quantity(
        name="peak_rotation_ratio",
        units="1",
        long_name="largest |theta| / slenderness",
        symbol="θ/α",
        priority=2,
        taken="response",
        banded=True,
        limited=True,
        matrix=True,
    ),
    Quantity(
        name="peak_u",
        units="m",
        long_name="largest |u|",
        symbol="u",
        priority=1,
        taken="response",
        shown_unit="cm",
        factor=100.0,
        form=".1f",
        banded=True,
        limited=True,
        matrix=True,
    ),
    Quantity(
        name="peak_v",
        units="m",
        long_name="largest v",
        symbol="v",
        taken="response",
        shown_unit="cm",
        factor=100.0,
        form=".2f",
        banded=True,
        limited=True,
    ),
    Quantity(
        name="peak_impact_velocity",
        units="m s-1",
        long_name="largest velocity at which the base of a column hits the ground",
        symbol="impact velocity",
        shown_unit="m/s",
        form=".2f",
        banded=True,
        limited=True,
    ),
    Quantity(
        name="friction_demand",
        units="1",
        long_name="largest coefficient of friction that base and top joints need",
        symbol="friction",
        form=".2f",
        comment="at the samples, and in impacts",
        banded=True,
    ),
    Quantity(
        name="peak_base_shear",
        units="1",
        long_name="largest force of the ground over the weight of columns and beam",
        symbol="base shear",
        priority=2,
        taken="forces",
        kind="force",
        shown_unit="W",
        comment=f"through contact and tendons; {_AT_SAMPLES}, without the impulses of impacts",
        banded=True,
    ),
    *_at_joint("base", "the joint at the base", ""),
    *_at_joint("top", "the joint under the beam", "; NaN without a beam"),
    *(
        force
        for side in ("left", "right")
        for place, joint in (("base", "the base joint"), ("top", "the joint under the beam"))
        for force in _of_column(side, place, joint)
    ),
    Quantity(
        name="peak_tendon_force",
        units="N",
        long_name="largest force of a tendon",
        symbol="tendon",
        taken="restraint",
        kind="tie",
        shown_unit="kN",
        factor=1e-3,
        form=".0f",
        comment="NaN without tendons",
        banded=True,
    ),
    Quantity(
        name="peak_dissipater_force",
        units="N",
        long_name="largest force of the dissipaters across one joint",
        symbol="dissipaters of a joint",
        taken="restraint",
        kind="tie",
        shown_unit="kN",
        factor=1e-3,
        form=".0f",
        comment="NaN without dissipaters",
        banded=True,
    ),
    Quantity(
        name="residual_u",
        units="m",
        long_name="residual drift, after the motion has decayed",
        symbol="residual u",
        priority=2,
        taken="kind",
        shown_unit="cm",
        factor=100.0,
        form=".1f",
    ),
    Quantity(
        name="ductility",
        units="1",
        long_name="largest drift over the yield drift",
        symbol="ductility",
        form=".2f",
        taken="kind",
        limited=True,
        comment="NaN for models that do not yield",
    ),
    Quantity(
        name="peak_level_difference",
        units="m",
        long_name="largest difference of level between both ends of the span",
        symbol="level difference",
        shown_unit="cm",
        factor=100.0,
        form=".1f",
        taken="kind",
        comment="the beam over columns of unequal height turns",
    ),
    Quantity(
        name="peak_force_ratio",
        units="1",
        long_name="largest force of isolators or columns over the weight that they carry",
        symbol="force / weight",
        taken="kind",
    ),
    Quantity(
        name="peak_tendon_ratio",
        units="1",
        long_name="largest force of a tendon over its yield force",
        symbol="tendon / yield force",
        kind="ratio",
        limited=True,
    ),
    Quantity(
        name="peak_gap_ratio",
        units="1",
        long_name="largest |u| over the gap at the abutment",
        symbol="u / gap",
        kind="ratio",
        limited=True,
    ),
)
#: All quantities by name.
QUANTITIES: Final = MappingProxyType({quantity.name: quantity for quantity in _DECLARED})
#: Peaks of the response to one motion.
PEAKS: Final = tuple(quantity for quantity in _DECLARED if quantity.taken == "response")
#: Quantities of the response to one motion that only some kinds of structures have.
OF_KINDS: Final = tuple(quantity for quantity in _DECLARED if quantity.taken == "kind")
#: Peaks of a scenario of a screening.
OF_SCENARIO: Final = (
    *PEAKS,
    *(quantity for quantity in _DECLARED if quantity.name == "peak_impact_velocity"),
)
#: Those with bands in each ensemble, and the forces, in the order of tables.
BANDED: Final = tuple(
    quantity for quantity in _DECLARED if quantity.banded and not quantity.of_joints
)
FORCES: Final = tuple(
    quantity for quantity in _DECLARED if quantity.kind in ("force", "impulse", "tie")
)
#: Those that limits define damage states of.
LIMITED: Final = tuple(quantity for quantity in _DECLARED if quantity.limited)
#: Those of summaries and matrices, and the names of all matrices.
IN_MATRICES: Final = tuple(quantity for quantity in _DECLARED if quantity.matrix)
MATRICES: Final = ("share_overturned", *(quantity.name for quantity in IN_MATRICES), "margin")
