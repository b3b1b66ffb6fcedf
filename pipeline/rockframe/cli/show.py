"""rockframe show: show what happened to one record, from its file to its verdicts."""

from __future__ import annotations

import argparse
import math
import unicodedata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import console
from rockframe.cli.options import path
from rockframe.errors import ParameterError
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rockframe.results.run import Run


#: Filters of sites, which are no ranges.
_SITES: Final = ("site", "not_site")


def add_show(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, and one of its records."""
    parser.add_argument("folder", type=path, help="folder of a run")
    parser.add_argument("record", help="identifier of a record, or the name of its file")


def run_show(options: argparse.Namespace) -> None:
    """Find the record and print what happened to it."""
    from rockframe.provenance import read_manifest
    from rockframe.results.run import motions_of, read_run
    from rockframe.results.schema import RESPONSE
    from rockframe.results.shards import opened_arrays
    from rockframe.stages.table import table_rows_of

    read_manifest(options.folder)
    records, pulses = (options.folder / f"{kind}.nc" for kind in ("records", "pulses"))
    with opened_arrays(options.folder / "response.nc", RESPONSE, empty=True) as response:
        motions = motions_of(response)
        first = (motions.get(options.record) or [options.record])[0]  # of both, the first component
        entry = _entry(options.folder, first)
        name = entry["record_id"]
        own = [k for k, (motion, of) in enumerate(motions.items()) if name in (motion, *of)]
        rows = list(table_rows_of(records, pulses, response.isel(record=own)) if own else ())
    history = _record_history(read_run(options.folder, record=name), entry)
    if options.json:
        console.show_json(history)
    else:
        _show(history, rows)


def _show_rows(rows: Sequence[Mapping[str, str]]) -> None:
    """Print the responses to a record, and to both components of its station."""
    from rockframe.results.tables.rows import response_columns

    for title, both in (("", False), ("In both directions", True)):
        chosen = [row for row in rows if bool(row.get("components")) is both]
        if chosen:
            console.show_rows(title, response_columns(chosen[0], {}), chosen)


def _entry(folder: Path, text: str) -> Mapping[str, str]:
    """Return the row of a record in the list of inputs; the record must be unique."""
    from rockframe.results.tables.entries import rows_of

    listed = list(rows_of(folder / "records.csv"))
    composed = unicodedata.normalize("NFC", text)  # identifiers are in this form
    entries = [row for row in listed if row["record_id"] == composed]
    entries = entries or [row for row in listed if row["file"] == text]
    if len(entries) > 1:
        names = ", ".join(row["record_id"] or f"{row['file']} ({row['reason']})" for row in entries)
        raise ParameterError(
            f"{text!r} is a file of {len(entries)} records. Choose one of them: {names}."
        )
    if not entries:
        allowed = ", ".join(row["record_id"] for row in listed if row["record_id"])
        raise ParameterError(
            f"Invalid record {text!r}. Must be the name of a file of the run, or one of: {allowed}."
        )
    return entries[0]


def _record_history(run: Run, entry: Mapping[str, str]) -> dict[str, Any]:
    """Return everything in the run about the record, in the order of the stages."""
    from rockframe.results.tables.entries import left_out_of

    name = entry["record_id"]
    facts = {fact.name: fact.value for fact in run.records.get(name, ())}
    checks = [
        {
            "check": key.removesuffix("_verdict"),
            "verdict": verdict,
            "value": entry[key.removesuffix("_verdict")],
            "limit": entry[f"{key.removesuffix('_verdict')}_limit"],
        }
        for key, verdict in entry.items()
        if key.endswith("_verdict")
    ]
    figure = Path("figures") / f"{name}.png"
    rejected = left_out_of(run.folder).items()
    motions = _motions(run.folder / "response.nc", name)
    study = run.manifest["parameters"].get("study", {})
    return {
        "record_id": name,
        "file": entry["file"],
        "status": entry["status"],
        "reason": entry["reason"],
        "passport": {"verdict": entry["passport"], "checks": checks},
        "filters": study.get("filters", {}),
        "facts": facts,
        "responses": {
            structure: {fact.name: fact.value for fact in run.pairs[record, structure]}
            for record, structure in run.pairs
            if record == name
        },
        **({"motions": motions} if motions else {}),
        "screening": _screening(run.folder / "screen.nc", name) if name else [],
        "left_out": {stage: reasons[name] for stage, reasons in rejected if name in reasons},
        "figure": figure.as_posix() if name and (run.folder / figure).is_file() else "",
    }


def _screening(path: Path, name: str) -> list[dict[str, Any]]:
    """Return the rows of a record in a screening; empty without a screening."""
    if not path.is_file():
        return []
    from rockframe.results.screen import screening_of  # loads xarray

    return screening_of(path, name)


def _motions(path: Path, name: str) -> list[Mapping[str, Any]]:
    """Return the rows of the motions of a record that is a sequence; empty for other records."""
    from rockframe.results.schema import RESPONSE
    from rockframe.results.shards import opened_arrays
    from rockframe.results.tables.table import part_rows

    if not path.is_file():
        return []
    with opened_arrays(path, RESPONSE) as response:
        return [row for row in part_rows(response) if row["record_id"] == name]


def _show(history: Mapping[str, Any], rows: Sequence[Mapping[str, str]]) -> None:
    facts = history["facts"]
    print(history["record_id"] or history["file"])
    for label, text in (
        ("file", _of_file(history)),
        ("processing", facts.get("processing", "")),
        ("trusted", facts.get("trusted", "")),
        ("passport", _of_passport(history["passport"])),
        ("filters", _of_filters(history)),
        (history["status"], history["reason"]),
        ("event", _of_event(facts)),
        ("motion", _of_motion(facts)),
        ("pulse", _of_pulse(facts)),
        *((f"not in {stage}", reason) for stage, reason in history["left_out"].items()),
        ("figure", history["figure"]),
    ):
        if text or label == "accepted":
            print(f"  {label:<10} {text}".rstrip())
    _show_rows(rows)
    if motions := history.get("motions"):
        from rockframe.results.tables.table import part_columns

        console.show_rows("Motions of the sequence", part_columns(motions), motions)
    if history["screening"]:
        _show_screening(history["screening"])


def _show_screening(rows: list[dict[str, Any]]) -> None:
    def at_scales(values: Mapping[str, str]) -> str:
        runs: dict[str, list[str]] = {}
        for scale, value in values.items():
            runs.setdefault(value, []).append(scale)
        return "; ".join(f"{value} at {', '.join(at)}" for value, at in runs.items())

    def outcomes(row: Mapping[str, Any], key: str) -> str:
        return at_scales({scale: word.replace("_", " ") for scale, word in row[key].items()})

    def shares(row: Mapping[str, Any], key: str) -> str:
        return at_scales({scale: f"{100.0 * share:.0f} %" for scale, share in row[key].items()})

    members = any("shares_overturned" in row for row in rows)
    overturn = console.column(
        "overturn at multiples of the record", "shares_overturned", rule=shares
    )
    columns = [
        console.column("structure", "structure"),
        console.column("azimuth>", "azimuth_degree", ".0f"),
        *([overturn] if members else []),
        console.column("critical scale>", "critical_scale", ".3f"),
        console.column("nominal outcome at multiples of the record", "verdicts", rule=outcomes),
    ]
    console.show_rows("Screening", columns, rows)


def _of_file(history: Mapping[str, Any]) -> str:
    facts = history["facts"]
    if not facts:
        return str(history["file"])
    return f"{history['file']} ({facts['source_format']}), SHA-256 {facts['source_sha256']}"


def _of_passport(passport: Mapping[str, Any]) -> str:
    if not passport["verdict"]:
        return ""
    faults = [
        f"{check['check']} {float(check['value'] or 'nan'):.3g} ({check['verdict']})"
        for check in passport["checks"]
        if check["verdict"] in {"warn", "reject"}
    ]
    return str(passport["verdict"]) + (": " if faults else "") + ", ".join(faults)


def _of_filters(history: Mapping[str, Any]) -> str:
    """Return the stated filters in words.

    Examples
    --------
    >>> _of_filters({"filters": {"pga_g": [0.1, None], "site": None, "not_site": ["borehole"]}})
    'pga_g from 0.1; not_site borehole'
    """
    filters = {name: bounds for name, bounds in history["filters"].items() if bounds is not None}
    sites = {name: " " + " or ".join(filters.pop(name)) for name in _SITES if name in filters}
    bounds = {name: _of_bounds(*bounds) for name, bounds in filters.items()}
    return "; ".join(f"{name}{words}" for name, words in (bounds | sites).items())


def _of_bounds(low: float | None, high: float | None) -> str:
    """Return the bounds as text; None is an open bound (infinity, null in JSON)."""
    least = "" if low is None else f" from {low:g}"
    return least + ("" if high is None else f" to {high:g}")


def _of_event(facts: Mapping[str, Any]) -> str:
    """Return event, magnitude, distances and site, as far as they are known.

    Examples
    --------
    >>> _of_event({"event": "2019 Ridgecrest", "magnitude": 7.1, "station": "CCC",
    ...     "epicentral_distance": 34.5, "distance_rrup": math.nan, "site_type": "free field"})
    '2019 Ridgecrest, M 7.1, station CCC, Repi 34.5 km, free field'
    """
    from rockframe.results.tables.rows import DISTANCES, magnitude_words

    def known(name: str) -> bool:
        return not math.isnan(facts.get(name, math.nan))

    parts = [str(facts.get("event", ""))]
    parts += [f"M {magnitude_words(facts, 'magnitude')}"] if known("magnitude") else []
    parts += [f"station {facts['station']}"] if facts.get("station") else []
    parts += [f"{head} {facts[name]:g} km" for name, head in DISTANCES.items() if known(name)]
    parts += [str(facts["site_type"])] if facts.get("site_type", "unknown") != "unknown" else []
    return ", ".join(part for part in parts if part)


def _of_motion(facts: Mapping[str, Any]) -> str:
    if not facts:
        return ""
    return (
        f"PGA {facts['pga'] / GRAVITY:.3f} g, PGV {facts['pgv']:.3f} m/s, "
        f"time step {facts['time_step']:g} s"
    )


def _of_pulse(facts: Mapping[str, Any]) -> str:
    from rockframe.matching.verdict import PulseVerdict, pulse_words

    if "a_p_best" not in facts:
        return ""
    tested = PulseVerdict[str(facts["pulse_verdict_best"]).upper().replace(" ", "_")]
    return (
        f"a_p {facts['a_p_best'] / GRAVITY:.3f} g, T_p {facts['T_p_best']:.3f} s, "
        f"{facts['best_wavelet']}; {pulse_words(tested, facts['p_value_best'])}"
    )
