"""Claims about the paper's records: Table 1, and the bridge bent under them, section 8."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from rockframe.paper.claim import Claim, Finding, agrees_to_last_digit, judged
from rockframe.paper.table1 import (
    Comparison,
    bridge_extremes,
    bridge_rows,
    compare,
    paper_records,
)
from rockframe.results.tables.table import TableRow

_COMMAND: Final = "rockframe table1 --records FOLDER"
#: Symbol in Table 1 and unit of each quantity.
_PRINTED: Final = {
    "pga_g": ("PGA", "g"),
    "pgv_m_s": ("PGV", "m/s"),
    "a_p_g": ("a_p", "g"),
    "T_p_s": ("T_p", "s"),
}


def record_claims(
    rows: Sequence[TableRow], pulses: Iterable[Mapping[str, Any]] = ()
) -> list[Claim]:
    """Return the claims about the paper's records among the rows.

    Parameters
    ----------
    rows : sequence of TableRow
        As returned by `table_rows`.
    pulses : iterable of mapping, optional
        As returned by `pulse_rows` for these records; see `compare`.
    """
    comparisons = compare(rows, pulses)
    others = {comparison.record_id: comparison.remark for comparison in comparisons
              if comparison.remark}  # fmt: skip
    names: set[str] = set()
    claims = []
    for found in comparisons:
        name = f"{found.record_id}-{found.quantity}"
        if name in names:  # by a wavelet other than the selected one
            name = f"{name}-{found.wavelet}"
        names.add(name)
        claims.append(_of_table(name, found, others.get(found.record_id, "")))
    own = bridge_rows(rows)
    return claims + (_of_bridge(own) if own else [])


def _of_table(name: str, comparison: Comparison, other: str) -> Claim:
    """Return the claim of one comparison; `other` is set if PGA or PGV is not the paper's."""
    label, unit = _PRINTED[comparison.quantity]
    printed = comparison.printed
    finding = agrees_to_last_digit(printed, comparison.ours)
    remark = f"{100.0 * comparison.relative_difference:+.1f} %"
    if comparison.wavelet:
        remark += f", {comparison.wavelet.replace('_', ' ')}; the paper names no wavelet"
    if other:
        finding, remark = Finding.OPEN, f"{remark}; {other}"
    return Claim(
        name=name,
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
    of = f"{len(own)} of the paper's {len(paper_records())} records are here with its PGA and PGV"
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
