"""The HTML page of a run, which contains all its data and sends no requests."""

from __future__ import annotations

import base64
import io
import math
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.cells import write_table
from rockframe.provenance import source_code_hash
from rockframe.quantities import PEAKS
from rockframe.report.results import ResultTable
from rockframe.results.run import MOST_ENTRIES, Ground, History, Run, concern, rank
from rockframe.results.schema import KINDS, RESPONSE
from rockframe.results.schema.response import FORCES
from rockframe.results.screen_tables import (
    demand_words,
    design_by_share,
    equal_states,
    fragility_curve,
    hazard_words,
    kind_row,
    margin_note,
    members_of,
    overall_rows,
    responses_in_words,
    screen_rows,
    screen_summary,
    site_note,
    title_of_states,
    with_its_limits,
)
from rockframe.results.tables.forces import (
    FORCE_VALUES,
    force_text,
    force_words,
    forces_in_words,
)
from rockframe.results.tables.notes import (
    first_words,
    left_out_motions,
    left_out_words,
    summary_notes,
)
from rockframe.results.tables.rows import (
    LabelledValue,
    band_words,
    in_verb_of,
    peak_words,
    pulse_mark,
    rocks,
    stated_pulse,
    that_count,
)
from rockframe.results.tables.sensitivity import sensitivity_words, spread_words, spreads_of_row
from rockframe.results.tables.sentences import answers
from rockframe.results.tables.summary import summary_columns, summary_legend, summary_title
from rockframe.risk import LimitState, Outcome, measure_of
from rockframe.rocking import SpreadVerdict, VerdictKind
from rockframe.signals.passport import CHECKS
from rockframe.units import GRAVITY
from rockframe.web import (
    PLOT_SIZE,
    Plot,
    bars_svg,
    deck_path,
    drawn_shape,
    plot_path,
    plot_place,
    render_page,
    strip_svg,
    tone,
)

if TYPE_CHECKING:
    import xarray as xr

#: Exponents in CF units become superscripts.
_SUPERSCRIPTS: Final = str.maketrans("-123", "⁻¹²³")
#: Values that the page shows elsewhere, or uses only internally.
_NOT_SHOWN: Final = frozenset(
    ["row_size", "history", "passport", "source_sha256", "samples_sha256", *FORCES]
)
#: Values that say that something was not computed.
_NOT_COMPUTED: Final = frozenset([("sampling_changes", -1)])
#: Values that are not shown for structures that overturn, because they only describe the fall.
_OF_THE_FALL: Final = frozenset(quantity.name for quantity in PEAKS)


#: Level of compression. A table takes 4 % less at level 9, in six times the time.
_LEVEL: Final = 4


def encode(values: ArrayLike) -> str:
    """Encode samples as little-endian float32, deflated (zlib), in base64; NaN stays NaN.

    Examples
    --------
    >>> samples = zlib.decompress(base64.b64decode(encode([0.5, -0.25])))
    >>> np.frombuffer(samples, dtype="<f4").tolist()
    [0.5, -0.25]
    """
    return pack(np.asarray(values, dtype="<f4").tobytes())


def pack(content: bytes) -> str:
    """Deflate bytes (zlib) and encode them in base64.

    Examples
    --------
    >>> zlib.decompress(base64.b64decode(pack(b"a,b")))
    b'a,b'
    """
    return base64.b64encode(zlib.compress(content, _LEVEL)).decode("ascii")


def choose(run: Run, limit: int) -> list[tuple[str, str]]:
    """Return the records and structures whose histories the page shows, in the order of the table.

    The page shows structures that rock; the figures of a run show those of other kinds too.

    Parameters
    ----------
    run : Run
        The run.
    limit : int
        Largest number of histories; if there are more, those that `rank` puts first are chosen.

    Returns
    -------
    list of (str, str)
        Identifiers of records and structures.
    """
    pairs = [(row["record_id"], row["structure"]) for row in run.rows]
    there = [
        i
        for i, pair in enumerate(pairs)
        if rocks(run.rows[i]) and run.pairs.value(pair, "history") == "kept"
    ]
    best = sorted(there, key=lambda i: rank(run.rows[i]))[:limit]
    return [pairs[i] for i in sorted(best)]


def payload(
    run: Run, motions: Iterable[tuple[Ground, Sequence[History]]]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the labelled values and the encoded samples of the histories on the page.

    Parameters
    ----------
    run : Run
        The run.
    motions : iterable of (Ground, sequence of History)
        Motions and histories on the page.

    Returns
    -------
    facts : dict
        JSON values: ``name``, ``gravity``, ``grounds``, ``structures`` and ``pairs``.
    samples : dict of str to str
        ``table``: the rows as CSV, encoded by `pack`. Encoded by `encode`: ``g0`` and ``p0``,
        motion and pulse of the first record; ``theta0``, ``u0``, ``v0``, ``theta_low0`` and
        ``theta_high0``, the first history.
    """
    grounds: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = []
    samples = {"table": pack(_table(run))}
    row_of = {(row["record_id"], row["structure"]): i for i, row in enumerate(run.rows)}
    entry_of = {entry["record_id"]: entry for entry in run.entries}
    for ground, histories in motions:
        i = len(grounds)
        samples[f"g{i}"], samples[f"p{i}"] = encode(ground.acceleration), encode(ground.pulse)
        record = next(iter(ground.components), ground.record)
        grounds.append(_ground(run, ground, record, entry_of.get(record, {})))
        for history in histories:
            pair = (history.record, history.structure)
            for name in ("theta", "u", "v", "theta_low", "theta_high"):
                samples[f"{name}{len(pairs)}"] = encode(getattr(history, name))
            row = run.rows[row_of[pair]]
            verdict = run.verdicts[row_of[pair]]
            grounds[i]["pulse"] = stated_pulse(row)
            pairs.append(
                {
                    "row": row_of[pair],
                    "ground": i,
                    "record": row["record"],
                    "event": row["event"],
                    "structure": history.structure,
                    "tone": tone(verdict),
                    "words": _sentence(row, verdict),
                    "band": _band(row, verdict),
                    "overturns": verdict.overturns,
                    "strip": strip_svg(run.strips[pair]) if pair in run.strips else "",
                    "spreads": _spreads(run.spreads[pair]) if pair in run.spreads else "",
                    "forces": _forces(run.forces.get(pair, ())),
                    "path": _path(run, history) if ground.components else "",
                    "peak": _finite(row["peak_rotation_ratio"]),
                    "facts": _texts(_of_pair(run.pairs[pair], verdict)),
                }
            )
    shown_here = {pair["structure"] for pair in pairs}
    structures = {
        name: drawn_structure(facts) for name, facts in run.structures.items() if name in shown_here
    }
    return {
        "name": run.name,
        "gravity": GRAVITY,
        "grounds": grounds,
        "structures": structures,
        "pairs": pairs,
    }, samples


def _table(run: Run) -> bytes:
    """Return the rows as CSV; all rows are those of the file."""
    if len(run.rows) == sum(run.counts.values()):
        return (run.folder / "table.csv").read_bytes()
    stream = io.StringIO()
    write_table(stream, run.rows)
    return stream.getvalue().encode("utf-8")


def _path(run: Run, history: History) -> str:
    """Return the path of the deck until it falls."""
    alpha = next(
        structure.value
        for structure in run.structures[history.structure]
        if structure.name == "slenderness"
    )
    return deck_path(history.theta, history.u_x, history.u_y, float(alpha))


def _forces(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the cells of the table of forces, and its explanation."""
    return {
        "rows": [
            [force_words(row), *(force_text(row, key) for key in FORCE_VALUES)] for row in rows
        ],
        "words": forces_in_words(rows) if rows else "",
    }


def _sentence(row: Mapping[str, str], verdict: SpreadVerdict) -> str:
    nominally = "nominally " * (verdict.is_nominal and verdict.is_computed)
    sentence = f"{nominally}{verdict.sentence}"
    return "; ".join(filter(None, (sentence, peak_words(row))))


def _band(row: Mapping[str, str], verdict: SpreadVerdict) -> str:
    """Return the band of theta/alpha; empty without an ensemble, or if no member uplifts."""
    still = verdict.kind is VerdictKind.NO_UPLIFT
    return "" if still or verdict.is_nominal else band_words(row, "peak_rotation_ratio_*")


def _of_pair(facts: Iterable[LabelledValue], verdict: SpreadVerdict) -> list[LabelledValue]:
    """Return the values to show, with the nominal verdict in words.

    Beside values of the ensemble, the labels of the others say that they are nominal.
    """

    def label(fact: LabelledValue) -> str:
        source = KINDS[RESPONSE][fact.name].source
        of_members = verdict.is_nominal or source.partition(".")[0] in {"ensemble", "robust"}
        plain = of_members or fact.label.startswith("nominal")
        return fact.label if plain else f"nominal: {fact.label}"

    return [
        replace(
            fact,
            label=label(fact),
            value=verdict.nominal.label if fact.name == "verdict" else fact.value,
        )
        for fact in facts
        if not (fact.name in _OF_THE_FALL and verdict.overturns)
    ]


def _ground(run: Run, ground: Ground, record: str, entry: Mapping[str, str]) -> dict[str, Any]:
    """Return a motion, with the values and checks of its record or first component."""
    both = []
    if ground.components:
        both = [
            ["components", " and ".join(ground.components)],
            ["values below", f"those of {ground.components[0]}"],
        ]
    return {
        "id": ground.record,
        "step": ground.time_step,
        "pulseStart": ground.pulse_start,
        "facts": [*both, *_texts(run.records[record])],
        "checks": checks(entry),
        "passport": entry.get("passport", ""),
    }


def drawn_structure(facts: Sequence[LabelledValue]) -> dict[str, Any]:
    """Return the geometry for the drawing, and the labelled values."""
    values = {
        fact.name.removeprefix("parameter_"): fact.value
        for fact in facts
        # parameters of another kind are unknown, and may have names of this one
        if not (fact.name.startswith("parameter_") and _is_unknown(fact))
    }
    shape, words = drawn_shape(values)
    return {
        **shape,
        "facts": [*([["unusual", words]] if words else []), *_texts(facts)],
    }


def checks(entry: Mapping[str, str]) -> list[list[str]]:
    """Return name, value, limit and verdict of each check in a row of ``records.csv``.

    Examples
    --------
    >>> checks({"clipped_samples": "1.0", "clipped_samples_limit": "4.0",
    ...         "clipped_samples_verdict": "ok"})
    [['clipped samples', '1', '≤ 4', 'ok']]
    """
    names = [key.removesuffix("_verdict") for key in entry if key.endswith("_verdict")]
    return [
        [
            name.replace("_", " ").replace("arias", "Arias"),
            _short(name, entry[name]),
            f"{'≥' if CHECKS[name][1] else '≤'} {_short(name, entry[f'{name}_limit'])}",
            entry[f"{name}_verdict"],
        ]
        for name in names
        if entry[f"{name}_verdict"]
    ]


def _short(check: str, number: str) -> str:
    return (
        with_unit(LabelledValue(check, "", float(number), CHECKS[check][0]))
        if number
        else "not known"
    )


def _finite(number: str) -> float | None:
    return float(number) if number and math.isfinite(float(number)) else None


def _texts(facts: Sequence[LabelledValue]) -> list[list[str]]:
    """Return label and value with unit of each known value."""
    facts_shown = [
        fact
        for fact in facts
        if fact.name not in _NOT_SHOWN
        and not _is_unknown(fact)
        and (fact.name, fact.value) not in _NOT_COMPUTED
    ]
    return [[fact.label, with_unit(fact)] for fact in facts_shown]


def _is_unknown(fact: LabelledValue) -> bool:
    return fact.value == "" or (isinstance(fact.value, float) and math.isnan(fact.value))


def with_unit(fact: LabelledValue) -> str:
    """Return a labelled value with its unit, as text.

    Examples
    --------
    >>> with_unit(LabelledValue("pga", "peak ground acceleration", 5.5346, "m s-2")).split()
    ['5.535', 'm', 's⁻²']
    """
    if isinstance(fact.value, str):
        return fact.value.replace("_", " ") if fact.name == "best_wavelet" else fact.value
    whole = fact.value.is_integer() and abs(fact.value) < 1e9
    number = f"{fact.value:.0f}" if whole else f"{fact.value:.4g}"
    parts = [part.translate(_SUPERSCRIPTS) for part in fact.units.split() if part != "1"]
    return "\N{NO-BREAK SPACE}".join([number.replace("-", "−"), *parts])


#: Largest number of input files that are listed with their hashes.
_MOST_INPUTS: Final = 2000
#: Largest number of records in the grid of verdicts.
_GLANCE: Final = 40
#: Largest number of structures about which the page begins with an answer.
_MOST_ANSWERS: Final = 8


def render(
    run: Run,
    motions: Iterable[tuple[Ground, Sequence[History]]],
    screening: xr.Dataset | None = None,
    comparison: Mapping[str, Any] | None = None,
    members: int = 0,
) -> str:
    """Return the report of a run. The same run gives the same text.

    Parameters
    ----------
    run : Run
        As returned by `read_run`.
    motions : iterable of (Ground, sequence of History)
        As returned by `read_histories` for the histories on the page.
    screening : Dataset, optional
        As returned by `read_screening`, if the run has a screening.
    comparison : mapping, optional
        As returned by `comparison_content`, if the run compares bridges.
    members : int
        Number of members of the ensemble.

    Returns
    -------
    str
        HTML. The security policy forbids all requests, and all scripts except its own.
    """
    facts, samples = payload(run, motions)
    pair_of = {pair["row"]: i for i, pair in enumerate(facts["pairs"])}
    page, _ = render_page(
        Path(__file__).parent,
        ("data", "table", "detail", "main"),
        facts=facts,
        samples=samples,
        pair_of=pair_of,
        screening=None if screening is None else screening_content(screening),
        comparison=comparison,
        answers=_answers(run, members),
        manifest=run.manifest,
        manifest_sha256=run.manifest_sha256,
        source=source_code_hash(),
        **_overview(run, pair_of),
    )
    return page


def _overview(run: Run, history_of: Mapping[int, int]) -> dict[str, Any]:
    table, verdicts = ResultTable.of(run), run.verdicts
    total, count = sum(run.counts.values()), _tally(run)
    records = list(dict.fromkeys((row["record_id"], row["record"]) for row in run.rows))
    structures = list(dict.fromkeys(structure for structure, _ in run.counts))
    place = {(row["record_id"], row["structure"]): i for i, row in enumerate(run.rows)}
    rocking = {row["structure"] for row in run.rows if rocks(row)}
    return {
        "rows": run.rows,
        "columns": table.columns,
        "margin": table.margin,
        "results": table.html(history_of),
        "count": count,
        "others": [
            (name, _texts(run.structures[name])) for name in structures if name not in rocking
        ],
        "tally": [kind for kind in VerdictKind if count[kind] or kind is VerdictKind.OVERTURNS],
        "kinds": [kind for kind in VerdictKind if any(kind == each for _, each in run.counts)],
        "noise_mark": max((pulse_mark(row) for row in run.rows), default=""),
        "strips": table.strips,
        "verdicts": verdicts,
        "peaks": [peak_words(row) for row in run.rows],
        "tones": table.tones,
        "nominal": any(verdict.is_nominal and verdict.is_computed for verdict in verdicts),
        "counts": run.counts,
        "total": total,
        "records_in_all": (computed := total // max(len(structures), 1)),
        "motion": "motion" if any(row.get("components") for row in run.rows) else "record",
        "left_out": run.left_out,
        "left_out_words": left_out_words(run.left_out, computed),
        "records": records,
        "structures": structures,
        "place": place,
        **_over_records(run),
        "glance": len(records) <= _GLANCE and len(run.rows) == total,
        "entries": [(entry, checks(entry)) for entry in _entries_to_list(run)],
        "all_entries": run.listed,
        "most_inputs": _MOST_INPUTS,
    }


def _tally(run: Run) -> Counter[str]:
    """Return the number of verdicts of each kind: of the rows that count, if the run has them."""
    count: Counter[str] = Counter()
    if len(run.rows) == sum(run.counts.values()):
        kinds = {
            (row["record_id"], row["structure"]): verdict.kind
            for row, verdict in zip(run.rows, run.verdicts, strict=True)
        }
        count.update(kinds[row["record_id"], row["structure"]] for row in that_count(run.rows))
    else:
        for (_, kind), number in run.counts.items():
            count[kind] += number
    return count


def _answers(run: Run, members: int) -> dict[str, str]:
    """Return the answer about each structure; none if the page lacks rows, or is of many."""
    whole = len(run.rows) == sum(run.counts.values())
    few = len({structure for structure, _ in run.counts}) <= _MOST_ANSWERS
    return answers(run.rows, members) if whole and few else {}


def _over_records(run: Run) -> dict[str, Any]:
    """Return the content of the summary; its rows are empty for a single record."""
    rows = run.summary if any(int(row["records"]) > 1 for row in run.summary) else ()
    return {
        "summary": rows,
        "summary_title": summary_title(rows),
        "summary_notes": summary_notes(run.summary),
        "implausible": first_words(run.summary, "implausible"),
        "model_ends": sum(int(row.get("model_ends") or 0) for row in run.summary),
        "summary_columns": summary_columns(rows),
        "summary_legend": summary_legend(rows),
        "row_of_worst": {(row["record"], row["structure"]): i for i, row in enumerate(run.rows)},
    }


def _spreads(row: Mapping[str, Any]) -> str:
    """Return the bars of the spreads; empty if no correlation is known."""
    values = {spread_words(name): float(row[name]) for name in spreads_of_row(row)}
    if not any(math.isfinite(value) for value in values.values()):
        return ""
    most = spread_words(row["matters_most"])
    return bars_svg(values, row["by_chance"], most, sensitivity_words(row))


def _entries_to_list(run: Run) -> list[Mapping[str, str]]:
    """Return the records and files to list; rejections and warnings first if there are many."""
    entries = [
        {**entry, "status": "left out", "reason": run.left_out[entry["record_id"]]}
        if entry["record_id"] in run.left_out and entry["status"] == "accepted"
        else entry
        for entry in run.entries
    ]
    first = sorted(range(len(entries)), key=lambda i: concern(entries[i]))[:MOST_ENTRIES]
    return [entries[i] for i in sorted(first)]


#: Number of motions in the ranking, and largest number of structures in the section.
_MOTIONS: Final = 10
_MOST_STRUCTURES: Final = 200


def screening_content(screening: xr.Dataset) -> dict[str, Any]:
    """Return the content of the section on the screening.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`.
    """
    of_all = screening.sizes["structure"]
    screening = screening.isel(structure=slice(_MOST_STRUCTURES))
    structures = [str(name) for name in screening["structure"].values]
    severe = np.argsort(screening["mean_relative_rank"].values, kind="stable")[:_MOTIONS]
    first = screen_rows(screening.isel(record=severe))
    rows = [row | {"demand": demand_words(row)} for row in first]
    width = len(structures)
    return {
        "left_out_words": left_out_motions(screening),
        "motions": screening.sizes["record"],
        "recordings": len(np.unique(screening["cluster"].values)),
        "scales": screening.sizes["scale"],
        "reference": float(screening["reference_scale"]),
        "nominal": members_of(screening) == 1,
        "responses": responses_in_words(screening),
        "sites": site_note(screening),
        "overall": (overall := list(overall_rows(screening))),
        "implausible": first_words(overall, "implausible"),
        "notes": [*summary_notes(overall), *filter(None, [margin_note(screening, overall)])],
        "overall_columns": summary_columns(overall),
        "structures": structures,
        "all_structures": of_all,
        "summary": screen_summary(screening),
        "curve": fragility_curve(screening),
        "hazard": hazard_words(screening),
        "ends": " or ".join(
            dict.fromkeys(
                in_verb_of(kind_row(screening.sel(structure=name)), "overturning")
                for name in structures
            )
        ),
        "fragility": [
            (name, _fragility(with_its_limits(screening.sel(structure=name))))
            for name in structures
        ],
        "ranking": [rows[i : i + width] for i in range(0, len(rows), width)],
        "design": _design(screening) if "design_share" in screening else None,
        "size": PLOT_SIZE,
    }


def _fragility(dataset: xr.Dataset) -> list[tuple[str, list[Plot]]]:
    """Return the title and the plots of each limit state, over each measure that is known."""
    states = equal_states(dataset)
    fits_known = [
        dataset.sel(measure=name)
        for name in dataset["measure"].values
        if int(dataset["fragility_outcome"].sel(measure=name)[0]) != Outcome.UNKNOWN
    ]
    row = kind_row(dataset)
    return [
        (
            in_verb_of(row, title_of_states(state)),
            [_fragility_plot(fits, state[0], states[0][0]) for fits in fits_known],
        )
        for state in states
    ]


def _fragility_plot(fits: xr.Dataset, limit: LimitState, overturning: LimitState) -> Plot:
    """Return the plot of a limit state, with the curve of overturning beside it."""
    measure, state = measure_of(str(fits["measure"].item())), fits.sel(limit_state=limit.name)
    first, *_, last = fits["fragility_intensity"].values
    low, high, median, tried = (
        state[f"fragility_{name}"].values for name in ("low", "high", "median", "intensity")
    )

    def across(intensity: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(np.log(intensity / first) / np.log(last / first))

    outcomes = fits["fragility_outcome"]
    fitted = {
        limit_state: fits["fragility"].sel(limit_state=limit_state.name).values
        for limit_state in dict.fromkeys((limit, overturning))
        if int(outcomes.sel(limit_state=limit_state.name)) == Outcome.FITTED
    }
    undetermined = int(state["fragility_outcome"]) == Outcome.UNDETERMINED
    x, has_curve = across(tried), limit in fitted
    band = plot_path(np.append(x, x[::-1]), np.append(low, high[::-1]))
    shares = zip(across(state["bin_intensity"].values), state["bin_share"].values, strict=True)
    return Plot(
        f"{measure.symbol} [{measure.unit}]"
        + (f", median {median / measure.printed:.3g}" if has_curve else "")
        + (f", {Outcome.UNDETERMINED.sentence}" if undetermined else ""),
        f"{first / measure.printed:.2g}",
        f"{last / measure.printed:.2g}",
        tuple(
            (
                in_verb_of(kind_row(fits), limit_state.words),
                plot_path(x, fitted.get(limit_state, np.full(x.shape, np.nan))),
            )
            for limit_state in dict.fromkeys((limit, overturning))
        ),
        (f"{band}Z" if band else "",),
        (tuple(plot_place(*share) for share in shares if np.isfinite(share).all()),),
        plot_place(float(across(median)), 0.5)[0] if has_curve else None,
    )


def _design(screening: xr.Dataset) -> dict[str, Any]:
    values, unit = screening["design_value"].values, screening["design_value"].attrs["units"]
    across = (values - values[0]) / (values[-1] - values[0])
    quantity, limit = str(screening["design_quantity"].item()), float(screening["design_limit"])
    dimension = str(screening["design_dimension"].item()).replace("_", " ")
    return {
        "what": dimension,
        "unit": "" if unit == "1" else unit,
        "limit": LimitState(quantity, limit).words.replace("≥", "<"),
        "share": float(screening["design_required_share"]),
        "by_share": design_by_share(screening),
        "plot": Plot(
            f"{dimension}{'' if unit == '1' else f' [{unit}]'}",
            f"{values[0]:g}",
            f"{values[-1]:g}",
            tuple(
                (str(name), plot_path(across, share))
                for name, share in zip(
                    screening["structure"].values, screening["design_share"].values, strict=True
                )
            ),
        ),
    }
