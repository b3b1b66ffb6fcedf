"""Misprints in the text of the paper, which cannot be checked by computing a number."""

from __future__ import annotations

from typing import Final

from rockframe.paper.claim import Claim, Finding

#: Name, place, printed text, correct text.
_TEXTS: Final = (
    ("text-uplift", "section 2", "uplift where the ground acceleration exceeds g tan α",
     "its magnitude does"),
    ("text-work", "eqs (13) to (15)", "W is called the work of the forces",
     "with Q = -dW/dθ it is a potential"),
    ("text-5.6", "section 5", "Equation (5.6)", "eq (43)"),
    ("text-minimum", "section 5", "minimum coefficient of restitution",
     "maximum, as the caption of Figure 7 says: eq (43) is the least loss"),
    ("text-figure-8", "section 6", "Figure 7 (Bottom)", "Figure 8 (Bottom)"),
    ("text-gaussian", "section 6", "exp(t²/2)", "exp(-t²/2)"),
    ("text-26", "references", "[26] stands for two papers", "Loh et al., and Ricker"),
)  # fmt: skip


def text_claims() -> list[Claim]:
    """Return the misprints that were found by reading.

    Examples
    --------
    >>> {claim.finding.value for claim in text_claims()}
    {'misprint'}
    """
    return [
        Claim(
            name=name,
            where=where,
            says="in words",
            printed=printed,
            ours=meant,
            finding=Finding.MISPRINT,
            remark="found by reading",
        )
        for name, where, printed, meant in _TEXTS
    ]
