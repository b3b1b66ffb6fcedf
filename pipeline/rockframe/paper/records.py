"""Claims about the paper's records: Table 1, and the bridge bent under them, section 8."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from rockframe.paper.claim import Claim, Finding, agrees_to_last_digit, judged
from rockframe.paper.table1 import (
    Comparison,
    bridge_extremes,
    bridge_rows,
    compare,
    paper_records,
)
from rockframe.results import TableRow

_COMMAND: Final = "rockframe table1 --records FOLDER"
#: Decimals that Table 1 prints, and what follows the number.
_PRINTED: Final = {
    "pga_g": ("PGA", ".2f", "g"),
    "pgv_m_s": ("PGV", ".2f", "m/s"),
    "a_p_g": ("a_p", "g", "g"),
    "T_p_s": ("T_p", "g", "s"),
}


def record_claims(rows: Sequence[TableRow]) -> list[Claim]:
    """Return the claims about those of the rows' records that are the paper's.

    Parameters
    ----------
    rows : sequence of TableRow
        What `table_rows` returned for the records at hand.
    """
    comparisons = compare(rows)
    others = {comparison.record_id: comparison.remark for comparison in comparisons
              if comparison.remark}  # fmt: skip
    claims = [_of_table(found, others.get(found.record_id, "")) for found in comparisons]
    own = bridge_rows(rows)
    return claims + (_of_bridge(own) if own else [])


def _of_table(comparison: Comparison, other: str) -> Claim:
    """`other` says that this is not the paper's record, which its PGA tells."""
    label, form, unit = _PRINTED[comparison.quantity]
    printed = format(comparison.paper, form)
    finding = agrees_to_last_digit(printed, comparison.ours)
    remark = f"{100.0 * comparison.relative_difference:+.1f} %"
    if comparison.wavelet:
        remark += f", {comparison.wavelet.replace('_', ' ')}; the paper names no wavelet"
    if other:
        finding, remark = Finding.OPEN, f"{remark}; {other}"
    return Claim(
        name=f"{comparison.record_id}-{comparison.quantity}",
        where="Table 1",
        says=f"{label} of {comparison.record}",
        printed=f"{printed} {unit}",
        ours=f"{comparison.ours:.3f} {unit}",
        finding=finding,
        remark=remark,
        command=_COMMAND,
    )


def _of_bridge(own: Sequence[TableRow]) -> list[Claim]:
    turned, drifts, lifted = bridge_extremes(own)
    of = f"{len(own)} of the paper's {len(paper_records())} records are here with its PGA"
    ratio, lift = turned.peak_rotation_ratio, 100.0 * lifted.v_max_m
    return [
        Claim(
            name="bridge-rotation",
            where="section 8, Figure 11",
            says="θ/α of the bridge under all six records",
            printed="< 0.33",
            ours=f"at most {ratio:.3f} ({turned.record})",
            finding=judged(ratio < 0.33),
            remark=of,
            command=_COMMAND,
        ),
        Claim(
            name="bridge-drift",
            where="section 8, Figure 11",
            says="its largest drifts",
            printed="20 to 50 cm",
            ours=f"{drifts[0]:.1f} to {drifts[-1]:.1f} cm",
            finding=judged(drifts[0] >= 20.0 and drifts[-1] <= 50.0),
            remark=of,
            command=_COMMAND,
        ),
        Claim(
            name="bridge-lift",
            where="section 8, Figure 11",
            says="its largest lift",
            printed="up to 5 cm",
            ours=f"up to {lift:.1f} cm ({lifted.record})",
            finding=judged(lift <= 5.0),
            remark=of,
            command=_COMMAND,
        ),
    ]
