"""Claims about pulses and about the records of Table 1, and the comparison with Table 1."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.match import match_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.paper.claim import (
    Claim,
    Finding,
    Judgement,
    agrees_to_last_digit,
    judged,
    judgement,
    number,
)
from rockframe.record import Record
from rockframe.results.tables.rows import Row
from rockframe.units import GRAVITY
from rockframe.wavelets.family import BETA, RICKERS
from rockframe.wavelets.pulse import Pulse

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


def find_paper_record(source_file: str) -> PaperRecord | None:
    """Return the paper's row for a file, found by the archive's name of the record.

    Examples
    --------
    >>> find_paper_record("RSN77_SFERN_PUL164.AT2").record
    'Pacoima Dam/164'
    >>> find_paper_record("my_own_PUL164.csv") is None
    True
    """
    stem = re.sub(r"^RSN\d+_[A-Z0-9.-]+_", "", Path(source_file).stem.upper())
    for record in paper_records():
        if stem in (name.upper() for name in record.files):
            return record
    return None


def with_paper_facts(row: Row) -> Row:
    """Fill in unknown metadata of the paper's records, and add Table 1 to the sources."""
    paper = find_paper_record(row["source_file"])
    if paper is None:
        return row
    borrowed = {name: getattr(paper, name) for name in _LENT if math.isnan(row[name])}
    if not row["event"]:
        borrowed |= {"event": paper.event, "record": paper.record}
    if not borrowed:
        return row
    sources = (row["facts_source"], BORROWED)
    return row | borrowed | {"facts_source": "; ".join(source for source in sources if source)}


def with_paper_columns(columns: Mapping[str, list[Any]]) -> Mapping[str, list[Any]]:
    """Return the columns of the rows of one record, with what `with_paper_facts` adds to them."""
    first = {key: values[0] for key, values in columns.items()}
    filled = with_paper_facts(first)
    if filled is first:
        return columns
    count = len(next(iter(columns.values())))
    return {
        key: columns[key] if value is first[key] else count * [value]
        for key, value in filled.items()
    }


#: Columns of `paper_comparisons`.
COMPARED: Final = (
    *("record_id", "record", "quantity", "wavelet", "printed", "paper", "ours"),
    *("relative_difference", "remark"),
)


def paper_comparisons(rows: Sequence[Row], pulses: Iterable[Mapping[str, Any]] = ()) -> list[Row]:
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
    section_6 = {pulse["record_id"]: pulse for pulse in pulses if pulse["wavelet"] == _OF_SECTION_6}
    comparisons: list[Row] = []
    for row in {row["record_id"]: row for row in rows}.values():
        paper = find_paper_record(row["source_file"])
        if paper is None:
            continue
        comparisons += _compared(paper, row, row)
        if row["record_id"] in section_6 and row["wavelet"] != _OF_SECTION_6:
            comparisons += _compared(paper, row, section_6[row["record_id"]])
    return comparisons


def _compared(paper: PaperRecord, row: Row, values: Mapping[str, Any]) -> Iterator[Row]:
    """Compare the quantities that have values."""
    for quantity in QUANTITIES:
        if quantity not in values:
            continue
        ours, printed = float(values[quantity]), float(getattr(paper, quantity))
        difference = ours / printed - 1.0
        other = abs(difference) > _SAME.get(quantity, math.inf)
        yield {
            "record_id": row["record_id"],
            "record": f"{paper.event}, {paper.record}",
            "quantity": quantity,
            "wavelet": values["wavelet"] if quantity in ("a_p_g", "T_p_s") else "",
            "printed": paper.printed[quantity],
            "paper": printed,
            "ours": ours,
            "relative_difference": difference,
            "remark": "not the paper's record or processing" if other else "",
        }


def bridge_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of the bridge bent under the paper's records, found by name, PGA and PGV."""
    return [row for row in rows if row["structure"] == _BRIDGE and _is_the_papers(row)]


def _is_the_papers(row: Row) -> bool:
    paper = find_paper_record(row["source_file"])
    return paper is not None and not any(c["remark"] for c in _compared(paper, row, row))


Float = NDArray[np.float64]

#: Period of the paper's Pacoima Dam pulse, at which eq (45) is evaluated [s].
_PERIOD: Final = 1.27
_TIME: Final = np.linspace(-3.0, 3.0, 60_001) * _PERIOD


def pulse_checks() -> dict[str, Judgement]:
    """Check the claims about the two pulses.

    Examples
    --------
    >>> [str(found.finding) for found in pulse_checks().values()]
    ['agrees', 'misprint', 'None', 'agrees']
    """
    symmetric = _symmetric_difference()
    return {
        "eq-44": judgement(symmetric < 1e-14, worst=symmetric),
        "eq-45": _antisymmetric_check(),
        "beta": number(BETA),
        "spectrum": _spectrum_check(),
    }


def _symmetric_difference() -> float:
    y = (math.pi * _TIME / _PERIOD) ** 2
    ours = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=_PERIOD).acceleration(_TIME)
    return float(np.abs((1.0 - 2.0 * y) * np.exp(-y) - ours).max())


def _antisymmetric_check() -> Judgement:
    """Check eq (45), which is printed with t in place of 2 pi t / (sqrt(3) T_p)."""
    x = math.tau * _TIME / (math.sqrt(3.0) * _PERIOD)
    printed = np.abs((x**2 - 3.0) * _TIME * np.exp(-0.5 * x**2) / BETA).max()
    meant = np.abs((x**2 - 3.0) * x * np.exp(-0.5 * x**2) / BETA).max()
    ours = np.abs(Pulse(wavelet="antisymmetric_ricker", a_p=1.0, T_p=_PERIOD).acceleration(_TIME))
    sound = all(math.isclose(largest, 1.0, rel_tol=1e-6) for largest in (meant, ours.max()))
    misprint = sound and not math.isclose(printed, 1.0, rel_tol=0.01)
    finding = Finding.MISPRINT if misprint else judged(sound)
    return judgement(finding, printed=printed, T_p=_PERIOD, maximum=ours.max())


def _spectrum_check() -> Judgement:
    """Find the peak of the Fourier spectrum on a grid of frequencies around 2 pi / T_p."""
    ratio = np.linspace(0.8, 1.2, 401)
    time = _TIME[::10]
    waves = np.exp(-1j * np.outer(math.tau / _PERIOD * ratio, time))
    periods = []
    for name in RICKERS:
        samples = Pulse(wavelet=name, a_p=1.0, T_p=_PERIOD).acceleration(time)
        spectrum = np.abs(waves @ samples)
        periods.append(float(1.0 / ratio[int(np.argmax(spectrum))]))
    near = all(abs(period - 1.0) < 1.5e-3 for period in periods)
    return judgement(near, symmetric=periods[0], antisymmetric=periods[1])


_COMMAND: Final = "rockframe table1 --records FOLDER"


def record_claims(rows: Sequence[Row], pulses: Iterable[Mapping[str, Any]] = ()) -> list[Claim]:
    """Return the claims about the paper's records among the rows.

    Parameters
    ----------
    rows : sequence of mapping
        As returned by `table_rows`.
    pulses : iterable of mapping, optional
        As returned by `pulse_rows` for these records; see `paper_comparisons`.
    """
    comparisons = paper_comparisons(rows, pulses)
    remarks = {row["record_id"]: row["remark"] for row in comparisons if row["remark"]}
    names: set[str] = set()
    claims = []
    for row in comparisons:
        name = f"{row['record_id']}-{row['quantity']}"
        if name in names:  # with another wavelet than the selected one
            name = f"{name}-{row['wavelet']}"
        names.add(name)
        claims.append(_of_table(name, row, remarks.get(row["record_id"], "")))
    own = bridge_rows(rows)
    return claims + _of_events(rows) + (_of_bridge(own) if own else [])


def _of_events(rows: Sequence[Row]) -> list[Claim]:
    """Return the claims about magnitudes and distances that files or catalogues state."""
    claims = {}
    for row in rows:
        paper = find_paper_record(row["source_file"])
        if paper is None or BORROWED in row["facts_source"]:
            continue
        for quantity, unit in zip(_LENT, ("", " km"), strict=True):
            name, ours = f"{row['record_id']}-{quantity}", float(row[quantity])
            if math.isfinite(ours):
                printed = paper.printed[quantity]
                claims[name] = Claim(
                    name=name,
                    where="Table 1",
                    says=f"{quantity.removesuffix('_km').replace('_', ' ')} of {paper.record}",
                    printed=f"{printed}{unit}",
                    ours=f"{ours:g}{unit}",
                    finding=agrees_to_last_digit(printed, ours),
                    remark=f"ours is from {row['facts_source'] or 'the file'}",
                    command=_COMMAND,
                )
    return list(claims.values())


def _of_table(name: str, comparison: Row, other: str) -> Claim:
    """Return the claim of one comparison; `other` is set if PGA or PGV is not the paper's."""
    label, unit = QUANTITIES[comparison["quantity"]]
    printed, wavelet = comparison["printed"], comparison["wavelet"].replace("_", " ")
    finding = agrees_to_last_digit(printed, comparison["ours"])
    remark = f"{100.0 * comparison['relative_difference']:+.1f} %"
    if wavelet:
        remark += f", {wavelet}; the paper names no wavelet"
    if other:
        finding, remark = Finding.OPEN, f"{remark}; {other}"
    return Claim(
        name=name,
        where="Table 1",
        says=f"{label} of {comparison['record']}",
        printed=f"{printed} {unit}",
        ours=f"{comparison['ours']:.3f} {unit}",
        finding=finding,
        remark=remark,
        command=_COMMAND,
    )


def statements(rows: Sequence[Row]) -> list[str]:
    """Return sentences that compare our results with section 8 of the paper, on the bridge bent.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of any structures and records. Only the bridge bent is compared, under the paper's
        records with the paper's PGA and PGV.
    """
    own = bridge_rows(rows)
    if not own:
        return []
    turned, drift, lift = _of_bridge(own)
    return [
        f"{turned.remark}; of its bridge bent:",
        f"theta/alpha: the paper says below 0.33; ours is {turned.ours}: {turned.finding}.",
        f"u_max: the paper says {drift.printed}; ours is {drift.ours}: {drift.finding}.",
        f"v_max: the paper says {lift.printed}; ours is {lift.ours}: {lift.finding}. "
        "By eqs (7) and (10) a drift of 50 cm comes with a lift of 7.0 cm: the paper's two numbers "
        "do not fit each other.",
    ]


def _of_bridge(own: Sequence[Row]) -> list[Claim]:
    """Return the claims about the largest rotation, the drifts and the largest lift."""
    turned = max(own, key=lambda row: row["peak_rotation_ratio"])
    lifted = max(own, key=lambda row: row["peak_v_m"])
    drifts = sorted(100.0 * row["peak_u_m"] for row in own)
    of = f"{len(own)} of the paper's {len(paper_records())} records are here with its PGA and PGV"
    ratio, lift = turned["peak_rotation_ratio"], 100.0 * lifted["peak_v_m"]
    least, most = drifts[0], drifts[-1]
    texts = (
        ("rotation", "θ/α of the bridge under all six records", "< 0.33",
         f"at most {ratio:.3f} ({turned['record']})", ratio < 0.33),
        ("drift", "its largest drifts", "20 to 50 cm",
         f"{least:.1f} to {most:.1f} cm", least >= 20.0 and most <= 50.0),
        ("lift", "its largest lift", "up to 5 cm",
         f"up to {lift:.1f} cm ({lifted['record']})", lift <= 5.0),
    )  # fmt: skip
    return [
        Claim(
            name=f"bridge-{name}",
            where="section 8, Figure 11",
            says=says,
            printed=printed,
            ours=ours,
            finding=judged(holds),
            remark=of,
            command=_COMMAND,
        )
        for name, says, printed, ours, holds in texts
    ]


def paper_pulses(
    records: Iterable[tuple[Record, PulseOptions]], weightings: Sequence[str]
) -> list[dict[str, Any]]:
    """Match the paper's records, found by their file names, with all wavelets and weightings.

    Parameters
    ----------
    records : iterable of (Record, PulseOptions)
        Records, each with the wavelets and the range of periods to search.
    weightings : sequence of str
        Weightings to use.

    Returns
    -------
    list of dict
        The paper's values and ours for each record, weighting and wavelet; ``distance`` is the root
        mean square of ln(ours / paper) of a_p and T_p [1].
    """
    pulses: list[dict[str, Any]] = []
    for record, options in records:
        printed = find_paper_record(record.source_file)
        if printed is not None:
            for weighting in weightings:
                pulses += _matched(record, printed, options.replaced(weighting=weighting))
    return pulses


def _matched(
    record: Record, printed: PaperRecord, options: PulseOptions
) -> Iterator[dict[str, Any]]:
    matches = match_pulses(record.acceleration, record.time_step, options)
    for wavelet, match in matches.items():
        a_p, T_p = match.pulse.a_p / GRAVITY, match.pulse.T_p  # noqa: N806 -- as in the paper
        apart = math.log(a_p / printed.a_p_g), math.log(T_p / printed.T_p_s)
        yield {
            "record": printed.record,
            "wavelet": wavelet,
            "weighting": options.weighting,
            "printed_a_p_g": printed.a_p_g,
            "printed_period_s": printed.T_p_s,
            "a_p_g": a_p,
            "T_p_s": T_p,
            "at_period_bound": match.at_period_bound,
            "distance": math.sqrt((apart[0] ** 2 + apart[1] ** 2) / 2.0),
        }


def overall_distances(pulses: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return wavelet, weighting and distance over all records, smallest distance first.

    Examples
    --------
    >>> pulses = [{"wavelet": "w", "weighting": "energy", "distance": d} for d in (0.1, 0.7)]
    >>> [round(way["distance"], 4) for way in overall_distances(pulses)]
    [0.5]
    """
    ways: dict[tuple[str, str], list[float]] = {}
    for pulse in pulses:
        ways.setdefault((pulse["wavelet"], pulse["weighting"]), []).append(pulse["distance"] ** 2)
    rows: list[dict[str, Any]] = [
        {"wavelet": wavelet, "weighting": other, "distance": math.sqrt(sum(squares) / len(squares))}
        for (wavelet, other), squares in ways.items()
    ]
    return sorted(rows, key=lambda way: float(way["distance"]))
