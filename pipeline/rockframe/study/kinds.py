"""The kinds of structures, each declared once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, kw_only=True)
class DeclaredKind:
    """A kind of structure. What it names is not imported until it is needed.

    Parameters
    ----------
    contract : str
        Module and name of the object that keeps the rules of `rockframe.structures.contract`.
    table : str
        Module and name of the model of a ``[[structure]]`` table of this kind.
    """

    contract: str
    table: str


#: Each kind by its name, the value of ``kind`` in ``[[structure]]`` tables.
KINDS: Final[Mapping[str, DeclaredKind]] = {
    "rocking": DeclaredKind(
        contract="structures.rocking.ROCKING", table="study.structures.StructureEntry"
    ),
}
