"""The client's page: one or two printed pages of answers about a site and its structures."""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from markupsafe import Markup

from rockframe.cells import DASH, Cells, number
from rockframe.errors import InputError
from rockframe.provenance import source_code_hash
from rockframe.quantities import QUANTILES, QUANTITIES
from rockframe.results.return_periods import demand_rows, demand_words
from rockframe.results.screen_tables import members_of, screen_summary
from rockframe.results.tables.envelope import (
    ENVELOPE_LEGEND,
    Row,
    envelope_columns,
    force_envelope,
)
from rockframe.results.tables.forces import ROLLING_LEGEND
from rockframe.results.tables.notes import alone_note, left_out_words
from rockframe.results.tables.outcomes import severity
from rockframe.results.tables.rows import is_computed, that_count
from rockframe.results.tables.sentences import answers
from rockframe.results.tables.summary import OF_STRUCTURE
from rockframe.web import render_still

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.run import Run

#: Forces that the page lists; the others are in the report and the tables.
_FORCES: Final = (
    *("peak_base_shear", "base_joint_horizontal", "base_joint_vertical"),
    *("base_joint_vertical_least", "base_key_force", "top_joint_horizontal", "top_key_force"),
    *("peak_tendon_force", "peak_dissipater_force"),
)
#: Demands at return periods that the page lists, in words without symbols.
_DEMANDS: Final = {
    "peak_u": "drift [cm]",
    "peak_rotation_ratio": "rotation over slenderness",
    "peak_tendon_ratio": "tendon force over its yield force",
    "peak_gap_ratio": "drift over the gap at the abutment",
}
#: Largest number of structures and of inputs on the page: more do not fit on two pages.
_MOST_STRUCTURES, _MOST_INPUTS = 6, 12
#: Beginnings of the files of logos, and their media types.
_LOGOS: Final = (
    (b"\x89PNG\r\n", "image/png"),
    (b"\xff\xd8\xff", "image/jpeg"),
    (b"<svg", "image/svg+xml"),
    (b"<?xml", "image/svg+xml"),
)
#: Largest size of a logo [bytes].
_MOST_BYTES: Final = 500_000
#: Question on the page unless the user states another.
_QUESTION: Final = "Do the structures stand under the motions of this site, and how sure is that?"


@dataclass(frozen=True)
class Letterhead:
    """The words and the picture at the top of the client's page.

    Parameters
    ----------
    company, project, question : str
        Name of the company, of the project, and the question that the page answers; empty texts
        are left out, or replaced by the name of the run and a general question.
    logo : Path, optional
        A PNG, JPEG or SVG of at most 0.5 MB, which the page contains.

    Raises
    ------
    InputError
        If the logo cannot be read, or is of another kind or too large.
    """

    company: str = ""
    project: str = ""
    question: str = ""
    logo: Path | None = None

    @property
    def picture(self) -> str:
        """Address of the logo that contains all its bytes, or ""."""
        if self.logo is None:
            return ""
        try:
            content = self.logo.read_bytes()
        except OSError as error:
            raise InputError(self.logo, f"cannot be read: {error.strerror}.") from None
        kind = next((kind for start, kind in _LOGOS if content.startswith(start)), "")
        if not kind or len(content) > _MOST_BYTES:
            raise InputError(self.logo, "is no logo. Must be PNG, JPEG or SVG of at most 0.5 MB.")
        return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def client_page(
    run: Run, letterhead: Letterhead, members: int, screening: xr.Dataset | None = None
) -> str:
    """Return the client's page of a run as HTML made to print. The same run gives the same text.

    Parameters
    ----------
    run : Run
        As returned by `read_run`, with all rows.
    letterhead : Letterhead
        Company, project, question and logo.
    members : int
        Number of members of the ensemble.
    screening : Dataset, optional
        As returned by `read_screening`, if the run has a screening.

    Raises
    ------
    InputError
        If the logo cannot be used.
    """
    said = answers(run.rows, members)
    names = _shown(run, said)
    counted = [row for row in that_count(run.rows) if row["structure"] in names]
    in_both = {row["structure"] for row in counted if row.get("components")}
    study = run.manifest["parameters"].get("study") or run.manifest["parameters"]
    envelope = _envelope(run, counted)
    vertical = bool((study.get("respond") or {}).get("vertical"))
    sizes = {row["structure"]: _size(row) for row in run.summary}
    return render_still(
        Path(__file__).parent,
        "client.html",
        title=letterhead.project or run.name,
        company=letterhead.company,
        logo=letterhead.picture,
        question=letterhead.question or _QUESTION,
        answers=[(name, Markup(_unbroken(said[name])), sizes.get(name, "")) for name in names],  # noqa: S704
        more=len(said) - len(names),
        members=members,
        motions=motions_that_count(counted),
        shaking=_shaking(run.rows),
        in_both=", ".join(name for name in names if name in in_both),
        names=names,
        drifts=_drifts([row for row in run.summary if row["structure"] in names], names),
        forces=_forces(envelope, names, _short_names(counted)),
        lacking=_lacking(envelope),
        legends=(ENVELOPE_LEGEND, ROLLING_LEGEND),
        **_at_return_periods(screening, names),
        left_out=[*_plane_notes(run.summary, names, in_both), *_left_out(run)],
        friction=_largest_friction(run.rows),
        vertical=vertical,
        inputs=sorted(run.manifest["inputs"].items())[:_MOST_INPUTS],
        more_inputs=max(0, len(run.manifest["inputs"]) - _MOST_INPUTS),
        manifest_sha256=run.manifest_sha256,
        versions=run.manifest["versions"],
        source=str(run.manifest["source_code_hash"]),
        same_source=run.manifest["source_code_hash"] == source_code_hash(),
    )


def _shown(run: Run, said: Collection[str]) -> list[str]:
    """Return the structures that the page shows, in the order of the study: those in most danger,
    if there are more than fit.
    """
    worst: dict[str, Any] = {}
    for row in filter(is_computed, that_count(run.rows)):
        name = row["structure"]
        worst[name] = min(severity(row), worst.get(name, severity(row)))
    in_danger = sorted(said, key=lambda name: (name not in worst, worst.get(name)))
    shown = in_danger[:_MOST_STRUCTURES]
    of_summary = [row["structure"] for row in run.summary]
    return sorted(shown, key=lambda name: of_summary.index(name) if name in of_summary else -1)


def motions_that_count(rows: Iterable[Cells]) -> str:
    """Return how many motions the numbers of the page count, and in which directions.

    Parameters
    ----------
    rows : iterable of mapping
        The rows that `that_count` selects.

    Examples
    --------
    >>> bent = {"structure": "bent", "components": "A-1 A-2", "verdict": "stands"}
    >>> pier = {"structure": "pier", "verdict": "stands"}
    >>> motions_that_count([bent, bent])
    '2 motions in both horizontal directions'
    >>> motions_that_count([bent, pier, pier])
    'bent: 1 motion in both horizontal directions; pier: 2 records, each in one plane'
    """
    counts: dict[str, Counter[bool]] = {}
    for row in rows:
        computed = counts.setdefault(row["structure"], Counter())
        computed[bool(row.get("components"))] += is_computed(row)
    groups: dict[str, list[str]] = {}
    for structure, ((both, count),) in ((name, each.items()) for name, each in counts.items()):
        ending = "" if count == 1 else "s"
        words = f"{count} motion{ending} in both horizontal directions"
        if not both:
            plane = "in one plane" if count == 1 else "each in one plane"
            words = f"{count} record{ending}, {plane}"
        groups.setdefault(words, []).append(structure)
    if len(groups) == 1:
        return next(iter(groups))
    return "; ".join(f"{', '.join(names)}: {words}" for words, names in groups.items())


def _size(row: Cells) -> str:
    """Return the size of a structure in words, or "" if it has not one height and width."""
    height, width, ratio = (number(row.get(key)) for key in OF_STRUCTURE[:3])
    if not (math.isfinite(height) and math.isfinite(width)):
        return ""
    size = f"{height:g} m high and {width:g} m wide"
    return f"Columns {size}, beam {ratio:g} times their mass." if ratio > 0.0 else f"Column {size}."


def _shaking(rows: Iterable[Cells]) -> str:
    """Return the records of the page in words: their number, events, magnitudes and PGA."""
    records = {row["record_id"]: row for row in rows if not row.get("components")}
    events = sorted({row["event"] for row in records.values() if row.get("event")})
    said = [f"{len(records)} record{'s' * (len(records) != 1)}"]
    if events:
        said[0] += f" of {events[0] if len(events) == 1 else f'{len(events)} events'}"
    for words, key, form in (("M ", "magnitude", ".1f"), ("PGA ", "pga_g", ".2f")):
        values = [number(row.get(key)) for row in records.values()]
        texts = [format(value, form) for value in sorted(values) if math.isfinite(value)]
        span = " to ".join(dict.fromkeys([*texts[:1], *texts[-1:]]))
        said += [f"{words}{span}{' g' * (key == 'pga_g')}"] * bool(texts)
    return ", ".join(said)


def _envelope(run: Run, counted: Iterable[Cells]) -> list[Row]:
    """Return the envelope of the forces over the motions that count."""
    pairs = {(row["record_id"], row["structure"]) for row in counted}
    forces = (row for pair, rows in run.forces.items() if pair in pairs for row in rows)
    return force_envelope(row for row in forces if row["force"] in _FORCES)


def _by_structure(
    rows: Iterable[tuple[str, str, tuple[str, str]]], names: Sequence[str]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return lines of a table whose columns are structures, from labels, structures and cells.

    A cell is a text and a smaller text below it.
    """
    lines: dict[str, dict[str, tuple[str, str]]] = {}
    for label, name, cell in rows:
        lines.setdefault(label, {})[name] = cell
    return [
        (label, [cells.get(name, (DASH, "")) for name in names]) for label, cells in lines.items()
    ]


def _short_names(rows: Iterable[Cells]) -> dict[str, str]:
    """Return the short names of records by identifier, or the long ones if two have the same."""
    short = {row["record_id"]: row.get("record") or row["record_id"] for row in rows}
    return short if len({*short.values()}) == len(short) else {name: name for name in short}


def _forces(
    envelope: Iterable[Row], names: Sequence[str], short: Mapping[str, str]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the envelope: each force of each structure, and the record that governs it."""
    _, force, value, *_ = envelope_columns()
    cells = (
        (
            str(force.cell(row)),
            row["structure"],
            (str(value.cell(row)), short.get(row["record_id"], row["record_id"])),
        )
        for row in envelope
    )
    return _by_structure(cells, names)


def _lacking(envelope: Iterable[Row]) -> list[str]:
    """Return under how many motions a structure has no force, in words."""
    most: dict[str, Row] = {}
    for row in envelope:
        worse = most.get(row["structure"], row)
        most[row["structure"]] = max(worse, row, key=lambda each: int(each["overturns"]))
    words: dict[str, list[str]] = {}
    for name, row in most.items():
        if row["overturns"]:
            said = f"no force under {row['overturns']} of {row['records']} motions"
            words.setdefault(said, []).append(name)
    ending = ", where the 84 % quantile overturns."
    return [f"{', '.join(names)}: {said}{ending}" for said, names in words.items()]


def _plane_notes(
    summary: Sequence[Cells], names: Sequence[str], in_both: Collection[str]
) -> list[str]:
    """Return what the answers of structures in one plane leave out."""
    in_plane = [name for name in names if name not in in_both]
    reasons: dict[str, list[str]] = {}
    for row in summary:
        if row["structure"] in in_plane:
            reasons.setdefault(str(row.get("not_both") or ""), []).append(row["structure"])
    notes = [
        f"{', '.join(structures)}: motion in one plane{f'; {reason}' * bool(reason)}."
        f"{_of_other_direction(reason)}"
        for reason, structures in (reasons or {"": in_plane}).items()
        if structures
    ]
    alone = alone_note(summary)
    return [*notes, alone] if alone else notes


def _of_other_direction(reason: str) -> str:
    """Return what the other direction may do to structures that are in one plane for a reason.

    Examples
    --------
    >>> _of_other_direction("not computed for both directions: columns not circular")
    ' The other horizontal direction of the ground is left out.'
    """
    if reason.endswith("columns not circular"):
        return " The other horizontal direction of the ground is left out."
    if "round columns" in reason:  # which says it itself
        return ""
    return (
        " Round columns shaken in both horizontal directions may overturn where they stand in a "
        "plane."
    )


def _unbroken(said: str) -> str:
    """Return a sentence, escaped, in which no line begins with a percent sign."""
    return str(Markup.escape(said.replace(" %", "\N{NO-BREAK SPACE}%")))


def _drifts(
    summary: Iterable[Cells], names: Sequence[str]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return median and band over all motions of drift and rotation of each structure."""
    cells = []
    for row in summary:
        for name in ("peak_u", "peak_rotation_ratio"):
            quantity = QUANTITIES[name]
            low, median, high = (
                quantity.outcome(number(row[quantity.column(share)])) for share in QUANTILES
            )
            band = "" if low == high else f"({low} to {high})"
            cells.append((_DEMANDS[name], row["structure"], (median, band)))
    return _by_structure(cells, names)


def _at_return_periods(screening: xr.Dataset | None, names: Sequence[str]) -> dict[str, Any]:
    """Return how rarely each structure overturns, its demands at return periods, and whether these
    are of motions in one plane, and of the stated structures alone.
    """
    if screening is None or "annual_rate" not in screening:
        return {"rates": [], "demands": []}
    rates = [
        (
            f"return period of {rate['words']} [years]",
            summary["structure"],
            (_years(rate["rate_per_year"]), f"({_bounds(rate)})"),
        )
        for summary in screen_summary(screening)
        for rate in summary["rates"]
    ]
    demands = []
    for row in demand_rows(screening) if "return_period_years" in screening else ():
        if row["quantity"] in _DEMANDS:
            label = f"{_DEMANDS[row['quantity']]} in {row['return_period_years']:g} years"
            value, _, bounds = demand_words(row).partition(" (")
            demands.append((label, row["structure"], (value, f"({bounds}" if bounds else "")))
    return {
        "rates": _by_structure(rates, names),
        "demands": _by_structure(demands, names),
        "rates_in_plane": "components" not in screening,
        "rates_nominal": members_of(screening) == 1,
    }


def _years(rate: float) -> str:
    """Return the return period of a rate as text."""
    if not rate > 0.0 or math.isnan(rate):
        return "not determined" if math.isnan(rate) else "never in these data"
    return f"{1.0 / rate:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def _bounds(rate: Mapping[str, Any]) -> str:
    low, high = rate["rate_high_per_year"], rate["rate_low_per_year"]
    longest = _years(high) if high > 0.0 else "any longer"
    return f"{_years(low)} to {longest}"


def _records(run: Run) -> int:
    """Return the number of records with responses."""
    return len({row["record_id"] for row in run.rows if not row.get("components")})


def _left_out(run: Run) -> list[str]:
    """Return what the numbers of the page do not include, in words."""
    computed = _records(run)
    said = [left_out_words(run.left_out, computed)]
    rejected = sum(entry["status"] == "rejected" for entry in run.entries)
    if rejected:
        files = "file or record was" if rejected == 1 else "files or records were"
        said.append(f"{rejected} {files} rejected; records.csv has the reasons.")
    if not run.forces:
        said.append("Forces were not computed (`forces = true` of [respond], or `--forces`).")
    return [words for words in said if words]


def _largest_friction(rows: Iterable[Mapping[str, str]]) -> str:
    """Return the largest friction that a joint needs in an ensemble (84 %), or nominally."""
    for column in ("friction_demand_84", "base_friction_demand"):
        values = [number(row.get(column)) for row in rows]
        finite = [value for value in values if math.isfinite(value)]
        if finite:
            return f"{max(finite):.2f}"
    return ""
