"""The client's page: one or two printed pages of answers about a site and its structures."""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from markupsafe import Markup

from rockframe.cells import Cells, number
from rockframe.errors import InputError
from rockframe.provenance import source_code_hash
from rockframe.quantities import QUANTITIES
from rockframe.results.return_periods import demand_rows, demand_table
from rockframe.results.screen_tables import screen_summary
from rockframe.results.tables.envelope import ENVELOPE_LEGEND, envelope_columns, force_envelope
from rockframe.results.tables.notes import direction_notes
from rockframe.results.tables.rows import is_computed, that_count
from rockframe.results.tables.sentences import answers
from rockframe.results.tables.summary import left_out_words
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
#: Demands at return periods that the page lists.
_DEMANDS: Final = ("peak_u", "peak_rotation_ratio", "peak_tendon_ratio", "peak_gap_ratio")
#: Largest number of structures and of inputs on the page: more do not fit on two pages.
_MOST_STRUCTURES, _MOST_INPUTS = 8, 12
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
    names = list(said)[:_MOST_STRUCTURES]
    counted = [row for row in that_count(run.rows) if row["structure"] in names]
    in_plane = list(dict.fromkeys(row["structure"] for row in counted if not row.get("components")))
    envelope = _envelope(run, counted)
    study = run.manifest["parameters"].get("study") or run.manifest["parameters"]
    vertical = bool((study.get("respond") or {}).get("vertical"))
    return render_still(
        Path(__file__).parent,
        "client.html",
        title=letterhead.project or run.name,
        company=letterhead.company,
        logo=letterhead.picture,
        question=letterhead.question or _QUESTION,
        answers=[(name, Markup(_unbroken(said[name]))) for name in names],  # noqa: S704
        more=len(said) - len(names),
        members=members,
        motions=motions_that_count(counted),
        in_plane="" if len(in_plane) == len(names) else ", ".join(in_plane),
        some_in_plane=bool(in_plane),
        some_in_both=len(in_plane) < len(names),
        drifts=[_drift(row) for row in run.summary if row["structure"] in names],
        envelope_heads=[column.head.rstrip(">") for column in envelope_columns()],
        envelope=[_cells(envelope_columns(), row) for row in envelope],
        envelope_legend=ENVELOPE_LEGEND,
        per_column=bool(envelope),
        **_at_return_periods(screening, names),
        rates_in_plane=screening is not None
        and "annual_rate" in screening
        and "components" not in screening,
        left_out=_left_out(run),
        friction=_largest_friction(run.rows),
        vertical=vertical,
        inputs=sorted(run.manifest["inputs"].items())[:_MOST_INPUTS],
        more_inputs=max(0, len(run.manifest["inputs"]) - _MOST_INPUTS),
        manifest_sha256=run.manifest_sha256,
        versions=run.manifest["versions"],
        source=str(run.manifest["source_code_hash"]),
        same_source=run.manifest["source_code_hash"] == source_code_hash(),
    )


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


def _envelope(run: Run, counted: Iterable[Cells]) -> list[dict[str, Any]]:
    """Return the envelope of the forces over the motions that count."""
    pairs = {(row["record_id"], row["structure"]) for row in counted}
    forces = (row for pair, rows in run.forces.items() if pair in pairs for row in rows)
    return force_envelope(row for row in forces if row["force"] in _FORCES)


def _unbroken(said: str) -> str:
    """Return a sentence, escaped, in which no line begins with a percent sign."""
    return str(Markup.escape(said.replace(" %", "\N{NO-BREAK SPACE}%")))


def _drift(row: Mapping[str, str]) -> dict[str, str]:
    """Return the bands over all records of drift and rotation of a structure, as text."""
    drift, rotation = QUANTITIES["peak_u"], QUANTITIES["peak_rotation_ratio"]
    cells = {"structure": row["structure"], "records": row["records"]}
    for share, name in ((0.16, "low"), (0.5, "median"), (0.84, "high")):
        cells[name] = drift.outcome(number(row[drift.column(share)]))
        cells[f"{name}_rotation"] = rotation.outcome(number(row[rotation.column(share)]))
    return cells


def _cells(columns: Iterable[Any], row: Mapping[str, Any]) -> list[str]:
    return [str(column.cell(row)) for column in columns]


def _at_return_periods(screening: xr.Dataset | None, names: Sequence[str]) -> dict[str, Any]:
    """Return how rarely each structure overturns, and its demands at return periods."""
    if screening is None or "annual_rate" not in screening:
        return {"rates": [], "demand_heads": [], "demands": []}
    rates = [
        (found["structure"], rate["words"], _years(rate["rate_per_year"]), _bounds(rate))
        for found in screen_summary(screening)
        for rate in found["rates"]
        if found["structure"] in names
    ]
    if "return_period_years" not in screening:
        return {"rates": rates, "demand_heads": [], "demands": []}
    some = (row for row in demand_rows(screening) if row["structure"] in names)
    columns, rows = demand_table([row for row in some if row["quantity"] in _DEMANDS])
    return {
        "rates": rates,
        "demand_heads": [column.head.rstrip(">") for column in columns],
        "demands": [_cells(columns, row) for row in rows],
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
    said = [*direction_notes(run.summary), left_out_words(run.left_out, computed)]
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
