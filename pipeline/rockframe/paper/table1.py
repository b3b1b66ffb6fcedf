"""Comparison with the paper's Table 1."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from rockframe.results.tables.rows import Row

#: Symbol in Table 1 and unit of each quantity that is compared.
QUANTITIES: Final = {
    "pga_g": ("PGA", "g"),
    "pgv_m_s": ("PGV", "m/s"),
    "a_p_g": ("a_p", "g"),
    "T_p_s": ("T_p", "s"),
}
#: Numbers of Table 1 that records may lack; they are taken from the paper.
_LENT: Final = ("magnitude", "epicentral_distance_km")
#: Relative differences of peaks above which a record, or its processing, is not the same as in the
#: paper [1]. Rounding to two decimals causes up to 1 %; for PGV, integration and baseline add to
#: that.
_SAME: Final = {"pga_g": 0.02, "pgv_m_s": 0.05}
#: The wavelet of the extended wavelet transform, according to section 6 of the paper.
_OF_SECTION_6: Final = "mavroeidis_papageorgiou"
#: Source of metadata that are taken from the paper.
BORROWED: Final = "Makris and Vassiliou (2013), Table 1"
#: The paper's bridge bent, section 8.
_BRIDGE: Final = "bridge-bent"


@dataclass(frozen=True, kw_only=True)
class PaperRecord:
    """A row of Table 1 of Makris and Vassiliou (2013), as printed."""

    event: str
    record: str
    files: tuple[str, ...]
    magnitude: float
    epicentral_distance_km: float
    pga_g: float
    pgv_m_s: float
    a_p_g: float
    T_p_s: float
    printed: Mapping[str, str]  # the numbers, digit by digit


@cache
def paper_records() -> tuple[PaperRecord, ...]:
    """Return the six rows of the paper's Table 1.

    Examples
    --------
    >>> [record.T_p_s for record in paper_records()]
    [0.6, 1.27, 0.8, 0.9, 0.5, 1.1]
    """
    path = Path(__file__).parents[1] / "data" / "table1.toml"
    rows = tomllib.loads(path.read_text(encoding="utf-8"), parse_float=str)["record"]
    return tuple(map(_paper_record, rows))


def _paper_record(row: Mapping[str, Any]) -> PaperRecord:
    printed = {name: row[name] for name in (*_LENT, *QUANTITIES)}
    values = {name: float(text) for name, text in printed.items()}
    return PaperRecord(**{**row, **values, "files": tuple(row["files"]), "printed": printed})


def paper_record_of(source_file: str) -> PaperRecord | None:
    """Return the paper's row for a file, found by the archive's name of the record.

    Examples
    --------
    >>> paper_record_of("RSN77_SFERN_PUL164.AT2").record
    'Pacoima Dam/164'
    >>> paper_record_of("my_own_PUL164.csv") is None
    True
    """
    stem = re.sub(r"^RSN\d+_[A-Z0-9.-]+_", "", Path(source_file).stem.upper())
    for record in paper_records():
        if stem in (name.upper() for name in record.files):
            return record
    return None


def with_paper_facts(row: Row) -> Row:
    """Fill in unknown metadata of the paper's records, and add Table 1 to the sources."""
    paper = paper_record_of(row["source_file"])
    if paper is None:
        return row
    borrowed = {name: getattr(paper, name) for name in _LENT if math.isnan(row[name])}
    if not row["event"]:
        borrowed |= {"event": paper.event, "record": paper.record}
    if not borrowed:
        return row
    sources = (row["facts_source"], BORROWED)
    return row | borrowed | {"facts_source": "; ".join(source for source in sources if source)}


def compare(rows: Sequence[Row], pulses: Iterable[Mapping[str, Any]] = ()) -> list[Row]:
    """Compare PGA, PGV, a_p and T_p of the paper's records with ours.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of any structures; each record is compared once.
    pulses : iterable of mapping, optional
        As returned by `pulse_rows`. If the wavelet of Mavroeidis and Papageorgiou was matched, its
        a_p and T_p are compared too: Table 1 names the extended wavelet transform, which section 6
        attributes to them.

    Returns
    -------
    list of dict
        Rows with the paper's value (as a number, and digit by digit as ``printed``), our value and
        the relative difference of each quantity. a_p and T_p depend on the mother wavelet (T_p by
        up to a third): ``wavelet`` is ours; the paper does not state its own for each record.
    """
    others = {pulse["record_id"]: pulse for pulse in pulses if pulse["wavelet"] == _OF_SECTION_6}
    comparisons: list[Row] = []
    for row in {row["record_id"]: row for row in rows}.values():
        paper = paper_record_of(row["source_file"])
        if paper is None:
            continue
        comparisons += _compared(paper, row, row)
        if row["record_id"] in others and row["wavelet"] != _OF_SECTION_6:
            comparisons += _compared(paper, row, others[row["record_id"]])
    return comparisons


def _compared(paper: PaperRecord, row: Row, values: Mapping[str, Any]) -> Iterator[Row]:
    """Compare the quantities that have values."""
    for quantity in QUANTITIES:
        if quantity not in values:
            continue
        ours, stated = float(values[quantity]), float(getattr(paper, quantity))
        difference = ours / stated - 1.0
        other = abs(difference) > _SAME.get(quantity, math.inf)
        yield {
            "record_id": row["record_id"],
            "record": f"{paper.event}, {paper.record}",
            "quantity": quantity,
            "wavelet": values["wavelet"] if quantity in ("a_p_g", "T_p_s") else "",
            "printed": paper.printed[quantity],
            "paper": stated,
            "ours": ours,
            "relative_difference": difference,
            "remark": "not the paper's record or processing" if other else "",
        }


def bridge_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of the bridge bent under the paper's records, found by name, PGA and PGV."""
    return [row for row in rows if row["structure"] == _BRIDGE and _is_the_papers(row)]


def _is_the_papers(row: Row) -> bool:
    paper = paper_record_of(row["source_file"])
    return paper is not None and not any(c["remark"] for c in _compared(paper, row, row))
