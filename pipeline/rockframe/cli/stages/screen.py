"""rockframe screen: screen structures by many records at many scales."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen
from rockframe.cli.stages.respond import matrices, show_responses
from rockframe.interruption import keeping
from rockframe.options.ingest import Filters
from rockframe.options.model import ExecutionOptions
from rockframe.options.respond import ScreenOptions

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.stages.screen import Screening

_RESUMES: Final = "finished batches are kept; the same command resumes"


def add_screen(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, scales, filters, and the file to write."""
    arguments.add_motions(parser)
    arguments.add_format(parser)
    arguments.add_matrix(parser)
    arguments.add_structures(parser, one=False)
    add_options(parser, ScreenOptions)
    add_options(parser, Filters, title=arguments.FILTERS)
    add_options(parser, ExecutionOptions)


def run_screen(options: argparse.Namespace) -> int:
    """Run the stage and print the tables."""
    from rockframe.stages.screen import screen_stage

    screening, filters = chosen(options, ScreenOptions), chosen(options, Filters)
    written: list[xr.Dataset] = []
    engine, workers = arguments.chosen_engine(options), chosen(options, ExecutionOptions).workers
    given = arguments.records_file(options.records, workers)
    bar = console.progress_bar("screening")
    with keeping(_RESUMES), given as (records, status), bar as progress:
        done = screen_stage(
            records,
            options.output,
            screening,
            structures_path=arguments.chosen_structures(options),
            pulses_path=options.pulses,
            filters=filters,
            engine=engine,
            progress=progress,
            table_format=options.format,
            written=written.append,
        )
    show(options.output, done, written[0], options.matrix, as_json=options.json)
    return console.show_rejections(done.rejections) or status


#: Largest number of scales, motions and recordings in a table; the CSV file has all motions.
_SHOWN: Final = 10


def show(
    output: Path,
    done: Screening,
    screening: xr.Dataset,
    quantities: Sequence[str] = (),
    *,
    as_json: bool,
) -> None:
    """Print the screening as tables, or as JSON."""
    from rockframe.results.screen_tables import (
        members_of,
        overall_rows,
        pooled_summary,
        screen_rows,
        screen_summary,
    )

    summary, pooled = screen_summary(screening), pooled_summary(screening)
    overall = list(overall_rows(screening))
    if as_json:
        console.show_json(
            {
                "motions": done.motions,
                "scenarios": done.scenarios,
                "members": members_of(screening),
                "overall": overall,
                "left_out": dict(done.left_out),
                "rejected": [vars(rejection) for rejection in done.rejections],
                "structures": summary,
                **({"pooled": pooled} if pooled else {}),
                **_demands(screening),
                "rows": list(screen_rows(screening)),
                "output": str(output),
                "table": str(done.table),
                "tables": [str(path) for path in done.tables.values()],
            }
            | matrices(list(screen_rows(screening)) if quantities else [], quantities)
        )
        return
    _show_tables(screening, overall, summary, pooled, quantities)
    _show_notes(screening, overall, done)
    for file in (output, *done.tables.values()):
        print(file)


def _show_tables(
    screening: xr.Dataset,
    overall: Sequence[dict[str, Any]],
    summary: Sequence[dict[str, Any]],
    pooled: dict[str, Any],
    quantities: Sequence[str],
) -> None:
    from rockframe.results.screen_tables import screen_rows
    from rockframe.results.tables.notes import left_out_motions

    if words := left_out_motions(screening):
        print(f"{console.filled(words)}\n")
    console.show_first([{"implausible": row["implausible"]} for row in overall])
    _show_overall(screening, overall)
    if quantities:
        at = f" at scale {float(screening['reference_scale']):g}{_nominal(screening)}"
        show_responses(at, (), list(screen_rows(screening)), quantities)
    _show_shares(screening)
    _show_ranking(screening)
    _show_azimuths(screening)
    _show_fragility(screening, summary)
    _show_pooled(screening, pooled)
    _show_rates(screening, summary)
    _show_demands(screening)
    _show_design(screening, summary)


def _nominal(screening: xr.Dataset) -> str:
    """Return the end of headings of results of the stated structures alone, without an ensemble."""
    from rockframe.results.screen_tables import members_of

    return " (nominal)" if members_of(screening) == 1 else ""


def _show_overall(screening: xr.Dataset, overall: Sequence[dict[str, Any]]) -> None:
    """Print the share that overturns and the drift over all motions and members."""
    from rockframe.results.screen_tables import responses_in_words
    from rockframe.results.tables.summary import summary_columns

    at = f"at scale {float(screening['reference_scale']):g}{_nominal(screening)}"
    title = f"Over all {responses_in_words(screening)} {at}"
    console.show_rows(title, summary_columns(overall), overall)


def _show_shares(screening: xr.Dataset) -> None:
    """Print how many motions overturn each structure, or which share of all members under them, at
    the scales nearest to 1.
    """
    from rockframe.results.screen_tables import responses_in_words

    scales = screening["scale"].values
    nearest = console.nearest_to_one(scales.tolist(), _SHOWN)
    shown = sorted(nearest)
    nominal = _nominal(screening)
    motions = screening["verdict_count"].sum("outcome").isel(scale=0).values
    shares = screening["overall_share_overturned"].values
    rows = [
        [
            str(structure),
            *(
                f"{shares[k, s] * motions[k]:.0f}/{motions[k]}"
                if nominal
                else f"{100 * shares[k, s]:.0f}"
                for s in shown
            ),
        ]
        for k, structure in enumerate(screening["structure"].values)
    ]
    columns = ["structure", *(f"{scales[s]:g}>" for s in shown)]
    order = [1 + shown.index(s) for s in nearest]
    heading = "Motions" if nominal else f"Share [%] of {responses_in_words(screening)}"
    console.show_table(f"{heading} that overturn, by scale{nominal}", columns, rows, order=order)
    if len(shown) < scales.size:
        print(f"The {_SHOWN} of {scales.size} scales that are nearest to 1; the files have all.\n")


def _show_ranking(screening: xr.Dataset) -> None:
    from rockframe.results.screen_tables import demand_words, screen_rows

    structures = [str(name) for name in screening["structure"].values]
    rows = list(islice(screen_rows(screening), _SHOWN * len(structures)))
    motions: dict[str, dict[str, Any]] = {}
    for row in rows:
        motions.setdefault(row["record_id"], dict(row))[f"of {row['structure']}"] = demand_words(
            row
        )
    columns = [
        console.column("record", "record_id"),
        console.column("relative rank>", "mean_relative_rank", ".2f"),
        *(console.column(f"{name}>", f"of {name}") for name in structures),
    ]
    scale, nominal = float(screening["reference_scale"]), _nominal(screening)
    quantity = f"θ/α at scale {scale:g}{nominal}"
    if not nominal:
        quantity = f"median θ/α at scale {scale:g} (share of members that overturns)"
    console.show_rows(f"Motions by demand: {quantity}", columns, motions.values())


def _show_azimuths(screening: xr.Dataset) -> None:
    if "recording" not in screening:
        return
    from rockframe.results.screen_tables import finite_or_overturns
    from rockframe.results.tables.rows import columns_of, rows_along

    parts = {f"RotD{part}>": f"rotd{part}_peak_rotation_ratio" for part in ("00", "50", "100")}
    rows = rows_along(
        screening.isel(recording=slice(_SHOWN)),
        "recording structure",
        columns_of("recording structure", *parts.values()),
    )
    columns = [
        console.column("first motion", "recording", once=True),
        console.column("structure", "structure"),
        *(
            console.column(head, key, ".3f", rule=finite_or_overturns)
            for head, key in parts.items()
        ),
    ]
    title = "θ/α over the azimuths of a recording: least, median, largest"
    console.show_rows(title, columns, rows, group="recording", rules=False)


def _each(summary: Sequence[dict[str, Any]], part: str) -> Iterator[dict[str, Any]]:
    """Yield the fits or rates of all structures, each with the name of its structure."""
    for structure in summary:
        for row in structure[part]:
            yield {"structure": structure["structure"], **row}


def _show_fragility(screening: xr.Dataset, summary: Sequence[dict[str, Any]]) -> None:
    from rockframe.results.screen_tables import fragility_curve

    logistic = [console.column("logistic scale>", "logistic_scale", ".3f")]
    form = fragility_curve(screening)
    columns = (
        console.column("structure", "structure"),
        console.column("limit state", "words"),
        console.column("over", "symbol"),
        console.column("median>", "median", ".3f"),
        console.column("", "unit"),
        console.column("lognormal β>", "lognormal_beta", ".3f"),
        *(logistic if form == "logistic" else ()),
        console.column("pseudo R²>", "pseudo_r2", ".2f"),
        console.column("concordance>", "concordance", ".2f"),
    )
    fits = [fit for fit in _each(summary, "fragility") if fit["outcome"] != "unknown"]
    console.show_rows(f"Fragility ({form} curves)", columns, fits, group="structure")
    for fit in fits:
        if fit["said"]:
            print(f"{fit['structure']}, {fit['words']}, {fit['symbol']}: {fit['said']}.")
    for sentence, structures in _better_measures_in_words(summary).items():
        print(f"{', '.join(structures)}: {sentence}.")
    print()


def _show_pooled(screening: xr.Dataset, pooled: dict[str, Any]) -> None:
    """Print the fragility of all free-standing structures together, and which measure is best."""
    if not pooled:
        return
    from rockframe.results.screen_tables import fragility_curve

    columns = (
        console.column("limit state", "words", once=True),
        console.column("over", "symbol"),
        console.column("median>", "median", ".3f"),
        console.column("", "unit"),
        console.column("lognormal β>", "lognormal_beta", ".3f"),
        console.column("ln L>", "log_likelihood", ".1f"),
        console.column("AIC below PGA's by>", "aic_below_pga", ".1f"),
        console.column("pseudo R²>", "pseudo_r2", ".2f"),
        console.column("concordance>", "concordance", ".2f"),
    )
    many, form = len(pooled["structures"]), fragility_curve(screening)
    title = f"One fragility for {many} structures ({form} curves)"
    console.show_rows(title, columns, pooled["fragility"], group="words")
    for fit in pooled["fragility"]:
        if fit["said"]:
            print(f"{many} structures, {fit['words']}, {fit['symbol']}: {fit['said']}.")
    print(_gain_in_words(pooled["fragility"]))
    better = pooled["better_measure"]
    named = f"the better measure is {better}" if better else "no better measure is named"
    print(f"Counted by recordings, {named}; {pooled['better_measure_reason']}.")
    if pooled["restrained"]:
        print(
            f"Not among them: {', '.join(pooled['restrained'])}. With tendons or dissipaters, "
            "rocking depends on more than p PGV/(g tan α)."
        )
    print()


def _gain_in_words(fits: Sequence[dict[str, Any]]) -> str:
    """Return how much better p PGV/(g tan α) predicts overturning than PGA, in a sentence."""
    of_pga, own = (
        next(fit for fit in fits if fit["measure"] == name) for name in ("pga", "dimensionless_pgv")
    )
    if not {of_pga["outcome"], own["outcome"]} <= {"fitted"}:
        return "p PGV/(g tan α) and PGA cannot be compared: one of them has no determined curve."
    gain = own["aic_below_pga"]
    return (
        f"Over p PGV/(g tan α), the lognormal β of overturning is {own['lognormal_beta']:.3g}, "
        f"over PGA {of_pga['lognormal_beta']:.3g}. The AIC of p PGV/(g tan α) is "
        f"{abs(gain):.3g} {'below' if gain >= 0.0 else 'above'} that of PGA, with all scenarios "
        "counted as independent."
    )


def _better_measures_in_words(summary: Sequence[dict[str, Any]]) -> dict[str, list[str]]:
    """Return the sentences about the better measure, each with the structures it applies to."""
    sentences: dict[str, list[str]] = {}
    for structure in summary:
        better = structure["better_measure"]
        named = f"the better measure is {better}" if better else "no better measure is named"
        words = f"{named}; {structure['better_measure_reason']}"
        sentences.setdefault(words, []).append(structure["structure"])
    return sentences


def _demands(screening: xr.Dataset) -> dict[str, Any]:
    """Return the key ``demands`` of JSON, if there are return periods."""
    from rockframe.results.return_periods import demand_rows

    has_demands = "return_period_years" in screening
    return {"demands": list(demand_rows(screening))} if has_demands else {}


def _show_demands(screening: xr.Dataset) -> None:
    """Print the demands at return periods, if there are any."""
    from rockframe.results.return_periods import demand_rows, demand_table

    if "return_period_years" not in screening:
        return
    rows = list(demand_rows(screening))
    title = f"Demand that is exceeded once in the return period{_nominal(screening)}"
    console.show_rows(title, *demand_table(rows))
    for row in rows:
        if row["note"]:
            where = f"{row['structure']}, {row['quantity']}, {row['return_period_years']:g} years"
            print(f"{where}: {row['note']}.")
    print(console.filled(_DEMAND_LEGEND) + "\n")


#: Meaning of demands at return periods.
_DEMAND_LEGEND: Final = (
    "In brackets: 90 % confidence from the recordings. 0: the structure uplifts more rarely; "
    "overturns: it overturns more often; a dash: not determined, see the note."
)


def _show_rates(screening: xr.Dataset, summary: Sequence[dict[str, Any]]) -> None:
    if "rates" not in summary[0]:
        return
    from rockframe.results.screen_tables import hazard_words

    columns = (
        console.column("structure", "structure"),
        console.column("limit state", "words"),
        console.column("return period [years]>", "return_period_years", ".0f"),
        console.column("rate [1/year]>", "rate_per_year", ".2e"),
        console.column("from>", "rate_low_per_year", ".2e"),
        console.column("to>", "rate_high_per_year", ".2e"),
        console.column("mainly from", "main_intensity"),
        console.column("extrapolated [%]>", "extrapolated_share", ".0f", 100.0),
    )
    console.show_rows("Mean annual rates", columns, _each(summary, "rates"))
    for rate in _each(summary, "rates"):
        if rate["note"]:
            print(f"Rate of {rate['structure']}, {rate['words']}: {rate['note']}.")
    for sentence in hazard_words(screening):
        print(sentence)
    print("Motions weaker than the first point of the hazard curve are not counted.\n")


def _show_design(screening: xr.Dataset, summary: Sequence[dict[str, Any]]) -> None:
    if "design_smallest" not in screening:
        return
    from rockframe.results.screen_tables import design_by_share, responses_in_words
    from rockframe.risk import LimitState

    quantity, value = str(screening["design_quantity"].item()), float(screening["design_limit"])
    limit = LimitState(quantity, value).words.replace("≥", "<")
    dimension = str(screening["design_dimension"].item()).replace("_", " ")
    share = 100.0 * float(screening["design_required_share"])
    for_what = f"for {share:g} %" if design_by_share(screening) else "in the 84 % quantile"
    scale = float(screening["reference_scale"])
    tried = screening["design_value"].values
    unit = " [m]" if screening["design_value"].attrs["units"] == "m" else ""
    columns = [
        console.column("structure", "structure"),
        console.column(f"smallest that suffices{unit}>", "design_smallest", ".3f"),
        console.column(f"all suffice from{unit}>", "design_sure_from", ".3f"),
    ]
    of_what = f"{for_what} of {responses_in_words(screening)}"
    at = f"at scale {scale:g}{_nominal(screening)}"
    title = f"Smallest {dimension} with {limit} {of_what}, {at}"
    console.show_rows(title, columns, summary)
    print(
        f"{tried.size} values from {tried[0]:g} to {tried[-1]:g} were tried: demand is not "
        f"monotone in the {dimension}.\n"
    )


def _show_notes(screening: xr.Dataset, overall: Sequence[dict[str, Any]], done: Screening) -> None:
    from rockframe.results.screen_tables import margin_note, members_of, site_note
    from rockframe.results.tables.notes import summary_notes
    from rockframe.risk.measures import FEWEST_MOTIONS

    recordings = len(set(screening["cluster"].values.tolist()))
    members = members_of(screening)
    if members == 1:
        print("Nominal results are those of the stated structures alone: see --scenario-members.")
    else:
        print(
            f"Each scenario has {members} plausible structures; the stated structure is not one of "
            "them. Its own results are in the files, under the names without a share or quantile."
        )
    print(
        f"{done.motions} motions of {recordings} recordings, {done.scenarios} scenarios. "
        "Scales, components and members of one recording are not independent: bands are based on "
        "recordings."
    )
    for note in summary_notes(overall):
        print(note)
    for note in filter(None, (margin_note(screening, overall), site_note(screening))):
        print(note)
    if recordings < FEWEST_MOTIONS:
        print(f"{recordings} recordings are few: fragility, bands and rates are uncertain.")
    for name, reason in islice(done.left_out.items(), _SHOWN):
        print(f"not screened: {name}: {reason}")
    more = len(done.left_out) - _SHOWN
    if more > 0:
        print(f"not screened: {more} more; the file's attribute left_out lists all")
