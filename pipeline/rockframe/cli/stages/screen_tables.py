"""The tables that `rockframe screen` prints from the file it wrote."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli.console import number, show_json, show_table

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.stages.screening.screen import Screening

#: Largest number of scales, motions and recordings in a table; the CSV file has all motions.
_SHOWN: Final = 10


def show(output: Path, done: Screening, *, as_json: bool) -> None:
    """Print the screening as tables, or as JSON."""
    from rockframe.results.screening.screen import read_screening
    from rockframe.results.screening.table import screen_rows, screen_summary

    screening = read_screening(output, every_scale=False)
    summary = screen_summary(screening)
    if as_json:
        show_json(
            {
                "motions": done.motions,
                "scenarios": done.scenarios,
                "left_out": dict(done.left_out),
                "rejected": [vars(rejection) for rejection in done.rejections],
                "structures": summary,
                "rows": list(screen_rows(screening)),
                "output": str(output),
                "table": str(done.table),
                "tables": [str(path) for path in done.tables.values()],
            }
        )
        return
    _show_verdicts(screening)
    _show_ranking(screening)
    _show_azimuths(screening)
    _show_fragility(summary)
    _show_rates(summary)
    _show_design(screening, summary)
    _show_notes(screening, done)
    for path in (output, *done.tables.values()):
        print(path)


def _show_verdicts(screening: xr.Dataset) -> None:
    scales = [f"{scale:g}" for scale in screening["scale"].values]
    shown = list(range(len(scales)))
    if len(shown) > _SHOWN:  # show the first, the last and some between
        step = (len(scales) - 1) / (_SHOWN - 1)
        shown = [round(step * k) for k in range(_SHOWN)]
    counts = screening["verdict_count"].values
    rows = [
        [str(structure), *(f"{counts[k, s, 2]}/{counts[k, s].sum()}" for s in shown)]
        for k, structure in enumerate(screening["structure"].values)
    ]
    columns = ["structure", *(f"{scales[s]}>" for s in shown)]
    show_table("Overturned of the motions, by scale", columns, rows)


def _show_ranking(screening: xr.Dataset) -> None:
    from rockframe.results.screening.table import screen_rows

    structures = [str(name) for name in screening["structure"].values]
    width = len(structures)
    rows = list(islice(screen_rows(screening), _SHOWN * width))
    motions = [rows[i : i + width] for i in range(0, len(rows), width)]
    scale = float(screening["reference_scale"])
    cells = [
        [
            motion[0]["record_id"],
            number(motion[0]["mean_rank"], 1),
            *(_ratio(row) for row in motion),
        ]
        for motion in motions
    ]
    show_table(
        f"Motions by demand: θ/α at scale {scale:g}",
        ["record", "mean rank>", *(f"{name}>" for name in structures)],
        cells,
    )


def _show_azimuths(screening: xr.Dataset) -> None:
    if "recording" not in screening:
        return
    parts = [screening[f"rotd{part}_peak_rotation_ratio"].values for part in ("00", "50", "100")]
    rows = []
    for i, recording in enumerate(screening["recording"].values[:_SHOWN]):
        for k, structure in enumerate(screening["structure"].values):
            name = str(recording) if k == 0 else ""
            rows.append([name, str(structure), *(_turned(float(p[i, k])) for p in parts)])
    show_table(
        "θ/α over the azimuths of a recording: least, median, largest",
        ["first motion of it", "structure", "RotD00>", "RotD50>", "RotD100>"],
        rows,
    )


def _turned(ratio: float) -> str:
    return "overturned" if ratio == float("inf") else number(ratio, 3)


def _ratio(row: dict[str, Any]) -> str:
    if row["verdict"] == "overturned":
        return "overturned"
    return number(row["peak_rotation_ratio"], 3)


def _show_fragility(summary: Sequence[dict[str, Any]]) -> None:
    rows = []
    for structure in summary:
        rows += [
            [
                structure["structure"],
                fit["words"],
                fit["symbol"],
                number(fit["median"], 3),
                fit["unit"],
                number(fit["lognormal_beta"], 3),
                number(fit["logistic_scale"], 3),
                number(fit["pseudo_r2"], 2),
                number(fit["concordance"], 2),
                fit["said"],
            ]
            for fit in structure["fragility"]
            if fit["outcome"] != "unknown"
        ]
        rows.append([])
    show_table(
        "Fragility",
        [
            *("structure", "limit state", "over", "median>", "", "lognormal β>", "logistic scale>"),
            *("pseudo R²>", "concordance>", ""),
        ],
        rows[:-1],
    )
    for told, structures in _told(summary).items():
        print(f"{', '.join(structures)}: {told}.")
    print()


def _told(summary: Sequence[dict[str, Any]]) -> dict[str, list[str]]:
    """Return the sentences on the better measure, with the structures each applies to."""
    told: dict[str, list[str]] = {}
    for structure in summary:
        better = structure["better_measure"]
        named = f"the better measure is {better}" if better else "no better measure is named"
        words = f"{named}; {structure['better_measure_reason']}"
        told.setdefault(words, []).append(structure["structure"])
    return told


def _show_rates(summary: Sequence[dict[str, Any]]) -> None:
    if "rates" not in summary[0]:
        return
    rows = [
        [
            structure["structure"],
            one["words"],
            number(one["return_period_years"], 0),
            _scientific(one["rate_per_year"]),
            _scientific(one["rate_low_per_year"]),
            _scientific(one["rate_high_per_year"]),
            one["main_intensity"],
            number(100.0 * one["extrapolated_share"], 0),
        ]
        for structure in summary
        for one in structure["rates"]
    ]
    show_table(
        "Mean annual rates",
        [
            *("structure", "limit state", "return period [years]>", "rate [1/year]>", "from>"),
            *("to>", "mostly from", "extrapolated [%]>"),
        ],
        rows,
    )
    print("Motions weaker than the first point of the hazard curve are not counted.\n")


def _scientific(value: float) -> str:
    return "–" if value != value else f"{value:.2e}"


def _show_design(screening: xr.Dataset, summary: Sequence[dict[str, Any]]) -> None:
    if "design_smallest" not in screening:
        return
    from rockframe.risk import LimitState

    quantity, value = str(screening["design_quantity"].item()), float(screening["design_limit"])
    limit = LimitState(quantity, value).words.replace("≥", "<")
    what = str(screening["design_dimension"].item()).replace("_", " ")
    share = 100.0 * float(screening["design_required_share"])
    scale = float(screening["reference_scale"])
    tried = screening["design_value"].values
    unit = " [m]" if screening["design_value"].attrs["units"] == "m" else ""
    parts = ("smallest", "sure_from")
    show_table(
        f"Smallest {what} with {limit} for {share:g} %, at scale {scale:g}",
        ["structure", f"smallest that does{unit}>", f"from which on all do{unit}>"],
        [
            [one["structure"], *(number(one[f"design_{part}"], 3) for part in parts)]
            for one in summary
        ],
    )
    print(
        f"{tried.size} values from {tried[0]:g} to {tried[-1]:g} were tried: demand is not "
        f"monotone in the {what}.\n"
    )


def _show_notes(screening: xr.Dataset, done: Screening) -> None:
    from rockframe.risk.comparison import FEWEST_MOTIONS

    recordings = len(set(screening["cluster"].values.tolist()))
    print(
        f"{done.motions} motions of {recordings} recordings, {done.scenarios} scenarios. "
        "Scales and components of one recording are not independent: bands count recordings."
    )
    if recordings < FEWEST_MOTIONS:
        print(f"{recordings} recordings are few: fragility, bands and rates are rough.")
    if "undecided" in screening:
        undecided = screening["undecided"].values
        print(
            f"{undecided.sum()} of {undecided.size} verdicts on the motions as recorded are "
            "undecided: they change with small perturbations."
        )
    for name, reason in islice(done.left_out.items(), _SHOWN):
        print(f"left out: {name}: {reason}")
    more = len(done.left_out) - _SHOWN
    if more > 0:
        print(f"left out: {more} more; the file's attribute left_out has all")
