"""The kinds of structures, each declared once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final, Protocol


class Structure(Protocol):
    """A structure: a frozen dataclass with a name and a kind."""

    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """Name in tables."""


@dataclass(frozen=True, kw_only=True)
class DeclaredKind:
    """A kind of structure. What it names is not imported until it is needed.

    Parameters
    ----------
    contract : str
        Module and name, separated by a colon, of the object that keeps the rules of
        `rockframe.structures.contract`.
    table : str
        Module and name of the model of a ``[[structure]]`` table of this kind.
    rocks : bool
        Its structures uplift, and have joints; their largest rotation is theta / alpha. Pages draw
        them from ``height``, ``width``, ``top_contact_width``, ``mass_ratio`` and ``slenderness``,
        or from the parameters of unequal bents.
    frames : bool
        Its structures have all properties of `RockingFrame`, so that a file without one is damaged.
    columns_differ : bool
        Forces at the joints of its structures are those of each of two columns.
    fails : str
        Verb for the end of its structures in tables: overturn or collapse.
    """

    contract: str
    table: str
    rocks: bool = False
    frames: bool = False
    columns_differ: bool = False
    fails: str = "overturn"

    def in_its_verb(self, words: str) -> str:
        """Return words about overturning in the verb of the kind.

        Examples
        --------
        >>> KINDS["fixed"].in_its_verb("overturning: no motion overturns it, 3 of 64 may overturn")
        'collapse: no motion collapses it, 3 of 64 may collapse'
        """
        if self.fails == "overturn":
            return words
        return words.replace("overturning", self.fails).replace("overturn", self.fails)


#: Each kind by its name, the value of ``kind`` in ``[[structure]]`` tables.
KINDS: Final[Mapping[str, DeclaredKind]] = {
    "rocking": DeclaredKind(
        contract="rockframe.structures.rocking:ROCKING",
        table="rockframe.study.frames:StructureEntry",
        rocks=True,
        frames=True,
    ),
    "unequal": DeclaredKind(
        contract="rockframe.structures.unequal:UNEQUAL",
        table="rockframe.unequal.table:UnequalStructure",
        rocks=True,
        columns_differ=True,
    ),
    "isolated": DeclaredKind(
        contract="rockframe.structures.oscillators:ISOLATED",
        table="rockframe.study.structures:IsolatedStructure",
        fails="collapse",
    ),
    "fixed": DeclaredKind(
        contract="rockframe.structures.oscillators:FIXED",
        table="rockframe.study.structures:FixedStructure",
        fails="collapse",
    ),
}


def declared_kind(name: str) -> DeclaredKind:
    """Return the declaration of the kind that a file states; "" is that of rocking frames.

    Examples
    --------
    >>> declared_kind("").rocks, declared_kind("fixed").fails
    (True, 'collapse')
    """
    return KINDS.get(name or "rocking", DeclaredKind(contract="", table=""))
