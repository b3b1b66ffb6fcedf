"""The result of a fragility fit, in words."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class Outcome(IntEnum):
    """Result of a fit: the values of the flag variable `fragility_outcome`.

    Here, overturning means reaching the limit state of the fit.
    """

    FITTED = 0
    NONE_OVERTURN = 1
    ALL_OVERTURN = 2
    SEPARATED = 3
    NOT_RISING = 4
    UNKNOWN = 5
    ABSENT = 6

    @property
    def sentence(self) -> str:
        """Outcome in words, for overturning."""
        return self.sentence_of("")

    def sentence_of(self, limit: str) -> str:
        """Return the outcome in words for a limit such as ``u ≥ 0.2 m``; "" for overturning."""
        words = {"reaches": "overturns it", "reach": "overturn", "state": "overturning"}
        if limit:
            words = {"reaches": f"reaches {limit}", "reach": f"reach {limit}", "state": limit}
        return _SENTENCES[self].format(**words)


_SENTENCES: Final = {
    Outcome.FITTED: "fitted by maximum likelihood",
    Outcome.NONE_OVERTURN: "no motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.ALL_OVERTURN: "every motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.SEPARATED: "all that {reach} are stronger than all that do not: the likelihood has no "
    "maximum, and the curve is a step somewhere between the two",
    Outcome.NOT_RISING: "{state} does not become more frequent with this measure",
    Outcome.UNKNOWN: "the measure is not known, or is the same for all motions",
    Outcome.ABSENT: "the structure has no such restraint",
}
