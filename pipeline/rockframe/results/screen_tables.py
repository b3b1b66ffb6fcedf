"""The tables of a screening: motions, scenarios, fragility, rates and design."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import TABLE_FORMATS, block_lines, in_digits, rows_of_columns
from rockframe.engines.engine import Engine, map_tasks
from rockframe.provenance import whole_file
from rockframe.quantities import IN_MATRICES, OF_SCENARIO, PEAKS
from rockframe.record import SiteType
from rockframe.results.return_periods import DEMAND_COLUMNS, demand_rows
from rockframe.results.schema import SCREEN
from rockframe.results.schema.arrays import Arrays, arrays_of
from rockframe.results.schema.response import ROBUST
from rockframe.results.screen import pooled_fits, read_screening
from rockframe.results.tables.entries import (
    beside,
    parameter_rows,
    refuse_other_table,
    write_rows_as,
)
from rockframe.results.tables.notes import left_out_reasons, with_directions
from rockframe.results.tables.rows import (
    columns_along,
    columns_of,
    in_verb_of,
    rows_along,
)
from rockframe.results.tables.summary import SUMMARY_COLUMNS, Summary, summary_rows, tables_of
from rockframe.results.tables.workbook import write_workbook
from rockframe.risk import FURTHER, OVERTURNING, LimitState, Measure, Outcome, measure_of, spectral
from rockframe.risk.fragility import why_undetermined
from rockframe.rocking.verdict import SpreadVerdict, Verdict
from rockframe.study.kinds import declared_kind

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.schema.arrays import Dataset

Rows = Iterator[dict[str, Any]]
#: Tables one after the other, as columns with their values.
Blocks = Iterator[dict[str, list[Any]]]

#: Number of motions whose rows are made together.
_MOTIONS: Final = 1024
#: Number of scenarios that are read together.
_TOGETHER: Final = 2**16
#: Columns of a row with their variables; margins only if the file has them.
_OF_PAIR: Final = columns_of(
    "record_id structure scale=reference_scale verdict",
    *(f"{quantity.column()}={quantity.name}" for quantity in PEAKS),
    "demand_rank",
)
_MARGINS: Final = ("critical_scale", "safe_islands", *ROBUST)
#: Columns of the bands of scenarios, with their variables.
_OF_BANDS: Final = {
    column: variable
    for quantity in OF_SCENARIO
    for column, variable in quantity.band_columns.items()
}
_OF_MOTION: Final = columns_of(
    "event station azimuth_degree=azimuth magnitude epicentral_distance_km=epicentral_distance",
    "vs30_m_s=vs30 pga_g=pga pgv_m_s=pgv a_p_g=a_p T_p_s=T_p L_p_m=L_p mean_relative_rank",
)
_OF_FRAME: Final = columns_of(
    "height_m=height width_m=width mass_ratio slenderness_deg=slenderness"
)
#: Numbers of a fit, in the unit of the measure and without a unit.
_INTENSITIES: Final = (
    *("median", "median_low", "median_high"),
    *("lowest", "highest", "safe_to", "overturned_from"),
)
_RATIOS: Final = (
    *("lognormal_beta", "lognormal_beta_low", "lognormal_beta_high", "logistic_scale"),
    *("pseudo_r2", "concordance", "brier"),
)
#: Those of the curve itself.
_OF_CURVE: Final = (*_INTENSITIES[:3], *_RATIOS[:4])


def screen_rows(screening: xr.Dataset) -> Rows:
    """Return the rows of `screen_columns`: one for each motion and structure."""
    return rows_of_columns(screen_columns(screening))


def screen_columns(screening: xr.Dataset) -> Blocks:
    """Yield the columns of each motion, a value for each structure, at the scale nearest to 1.

    The names of columns end in units. Motions are ordered by mean relative rank, the most
    severe first, and those that count for no structure last. `screening` is that of
    `read_screening`.
    """
    listed, columns = _listed_pairs(screening)
    for motions in _in_order_of_rank(listed):
        yield from _pair_columns(motions, columns)


def _listed_pairs(screening: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
    """Return what a screening has at the scale nearest to 1, and the variable of each column."""
    if "scale" in screening["verdict"].dims:
        reference = float(screening["reference_scale"])
        at = int(np.flatnonzero(screening["scale"].values == reference)[0])
        screening = screening.isel(scale=at)
    columns = _OF_PAIR | _of_members(screening)
    columns |= {name: name for name in _MARGINS if name in screening} | _OF_MOTION | _OF_FRAME
    columns |= {quantity.column: name for name, quantity in FURTHER.items() if name in screening}
    columns |= {name: name for name in ("kind", "components") if name in screening}
    for end in ("", "rotd50", "rotd100"):
        variable = "spectral_acceleration" + (end and f"_{end}")
        periods = screening["spectral_period"].values if variable in screening else ()
        for k, period in enumerate(periods):
            column = spectral(float(period), end).column
            screening = screening.assign({column: screening[variable].isel(spectral_period=k)})
            columns[column] = column
    names = {variable.partition(".")[0] for variable in columns.values()} | {*columns}
    return screening[[name for name in screening.variables if name in names]], columns


def _in_order_of_rank(screening: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield some motions of a screening after the other, the most severe first."""
    order = _places_by_rank(screening)
    together = max(1, min(_MOTIONS, _TOGETHER // screening.sizes["structure"]))
    for some in np.split(order, range(together, len(order), together)):
        in_file = np.sort(some)  # a file is read faster in its own order
        block = screening.isel(record=in_file).load()
        yield block.isel(record=np.searchsorted(in_file, some))


def _places_by_rank(screening: xr.Dataset) -> NDArray[np.intp]:
    return np.argsort(screening["mean_relative_rank"].values, kind="stable")


def _pair_columns(motions: Dataset, columns: Mapping[str, str]) -> Blocks:
    """Yield the columns of each motion, a value for each structure."""
    for block in columns_along(motions, "record structure", columns):
        block |= {"verdict_words": _words(block)}
        if "safe_islands" in block:
            block["safe_islands"] = [math.nan if n < 0 else n for n in block["safe_islands"]]
        yield block


def _of_members(screening: xr.Dataset) -> dict[str, str]:
    """Return the columns of the shares of members that reach each limit, and of their peaks."""
    if "share_reached" not in screening:
        return {}
    limits = enumerate(screening["limit_state"].values)
    shares = {_share_column(str(limit)): f"share_reached.{place}" for place, limit in limits}
    return {
        **shares,
        "share_uplifted": "share_uplifted",
        **_OF_BANDS,
    }


def _share_column(limit: str) -> str:
    return "share_overturned" if limit == OVERTURNING.name else f"share_{limit}"


def members_of(screening: xr.Dataset) -> int:
    """Return the number of members that respond in each scenario; with 1, results are nominal."""
    return int(screening["members"]) if "members" in screening else 1


def responses_in_words(screening: xr.Dataset) -> str:
    """Return what the shares over a screening are of.

    Examples
    --------
    >>> import xarray as xr
    >>> responses_in_words(xr.Dataset({"members": 16}, {"record": ["a", "b"]}))
    '32 responses (2 motions, 16 members each)'
    >>> responses_in_words(xr.Dataset({"members": 1}, {"record": ["a", "b"]}))
    '2 motions'
    """
    counts, members = motions_that_count(screening), members_of(screening)
    motions = f"{_listed(counts)} motions"
    if members == 1:
        return motions
    responses = _listed(members * count for count in counts)
    return f"{responses} responses ({motions}, {members} members each)"


def motions_that_count(screening: xr.Dataset) -> list[int]:
    """Return the different numbers of motions that count for the structures.

    For structures of round columns, these are the motions in both directions.

    Examples
    --------
    >>> import xarray as xr
    >>> outcomes = (("structure", "scale", "outcome"), [[[3, 0, 0]], [[4, 1, 1]], [[2, 0, 1]]])
    >>> motions_that_count(xr.Dataset({"verdict_count": outcomes}))
    [3, 6]
    """
    if "verdict_count" not in screening:
        return [screening.sizes["record"]]
    of_each = screening["verdict_count"].sum("outcome")
    if "scale" in of_each.dims:
        of_each = of_each.isel(scale=0)
    return sorted({*of_each.values.ravel().tolist()})


def _listed(numbers: Iterable[int]) -> str:
    return " or ".join(map(str, numbers))


def site_note(screening: xr.Dataset) -> str:
    """Return a sentence if motions of structures or boreholes are among those of a site, else "".

    Examples
    --------
    >>> import xarray as xr
    >>> named = {"record_id": ("record", ["a", "b", "c"]), "site_type": ("record", [1, 2, 3])}
    >>> site_note(xr.Dataset(named))[:49]
    '2 of 3 motions are not of free ground: b (structu'
    """
    if "site_type" not in screening:
        return ""
    kinds = [SiteType(int(flag)) for flag in screening["site_type"].values]
    names = [str(name) for name in screening["record_id"].values]
    apart = [
        f"{name} ({kind.words})"
        for name, kind in zip(names, kinds, strict=True)
        if kind in (SiteType.STRUCTURE, SiteType.BOREHOLE)
    ]
    if not apart:
        return ""
    more = f" and {len(apart) - _NAMED} more" if len(apart) > _NAMED else ""
    return (
        f"{len(apart)} of {len(names)} motions are not of free ground: "
        f"{', '.join(apart[:_NAMED])}{more}. --not-site structure borehole (not_site in a study) "
        "leaves them out."
    )


#: Largest number of motions that are named in a note.
_NAMED: Final = 5


def _words(block: Mapping[str, Sequence[Any]]) -> list[str]:
    """Return the verdicts at the scale of rows, in words; the nominal ones without an ensemble."""
    verdicts, unknown = block["verdict"], [math.nan] * len(block["verdict"])
    kinds = block.get("kind", [""] * len(verdicts))
    shares = (block.get(name, unknown) for name in ("share_overturned", "share_uplifted"))
    return list(map(_words_of, verdicts, kinds, *shares))


@lru_cache(maxsize=4096)  # rows of a screening have few different shares
def _words_of(verdict: str, kind: str, share_overturned: float, share_uplifted: float) -> str:
    return SpreadVerdict(
        Verdict[verdict.upper()],
        share_overturned=share_overturned,
        share_uplifted=share_uplifted,
        fails=declared_kind(kind).fails,
    ).words


def overall_rows(screening: xr.Dataset) -> Rows:
    """Yield a row of `summary_rows` for each structure, at the scale nearest to 1; no rows for
    files of older versions.

    The quantiles of rotation and drift are those over all motions and members.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    if "members" not in screening:
        return
    at_reference = screening.sel(scale=float(screening["reference_scale"]))
    ends = ("", "_low", "_high")
    shares = (f"share_overturned{end}=overall_share_overturned{end}" for end in ends)
    peaks = (
        f"{column}=overall_{variable}"
        for quantity in IN_MATRICES
        for column, variable in quantity.band_columns.items()
    )
    pooled = rows_along(at_reference, "structure", columns_of(*shares, *peaks))
    summary = Summary(_temporary_folder())
    summary.include(screen_columns(screening))
    rows = summary.rows(left_out=left_out_reasons(screening.attrs))
    rows = with_directions(rows, screening.attrs)
    for row, over_members in zip(rows, pooled, strict=True):
        yield row | over_members


def _temporary_folder() -> Path | None:
    """Return the folder of the system for temporary files; None if it has none."""
    try:
        return Path(gettempdir())
    except FileNotFoundError:
        return None


def margin_note(screening: xr.Dataset, overall: Iterable[Mapping[str, Any]]) -> str:
    """Return for which structures no motion that counts has a margin; "" for none.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    overall : iterable of mapping
        Its `overall_rows`.

    Examples
    --------
    >>> import xarray as xr
    >>> searched = xr.Dataset({"critical_scale": ("record", [0.8])})
    >>> margin_note(searched, [{"structure": "bent", "directions": 2}])[:49]
    'bent: no critical scale is searched in both direc'
    """
    if "critical_scale" not in screening or ROBUST[0] in screening:
        return ""
    names = ", ".join(str(row["structure"]) for row in overall if row.get("directions") == 2)
    return names and (
        f"{names}: no critical scale is searched in both directions, so the motions that count "
        "have no margin. --margins robust finds the scales at which 10, 25 and 50 % overturn."
    )


def finite_or_overturns(row: Mapping[str, Any], key: str) -> float | str:
    """Return a peak; where it is infinite, the outcome: it overturns.

    Examples
    --------
    >>> finite_or_overturns({"u": 0.2}, "u"), finite_or_overturns({"u": math.inf}, "u")
    (0.2, 'overturns')
    """
    return Verdict.OVERTURNS.label if row[key] == math.inf else float(row[key])


def demand_words(row: Mapping[str, Any]) -> str:
    """Return the peak rotation ratio of a row of `screen_rows`, or that it overturns.

    With an ensemble it is the median of the members, with the share that overturns if any does.

    Examples
    --------
    >>> demand_words({"verdict": "overturns", "peak_rotation_ratio": 9.2})
    'overturns'
    >>> demand_words({"verdict": "not_computed", "peak_rotation_ratio": math.nan})
    '–'
    >>> demand_words({"share_overturned": 0.25, "peak_rotation_ratio_50": 0.4})
    '0.400 (25 %)'
    """
    if "share_overturned" not in row:
        fell = row["verdict"] == Verdict.OVERTURNS.name.lower()
        return Verdict.OVERTURNS.label if fell else in_digits(row["peak_rotation_ratio"], ".3f")
    share, median = row["share_overturned"], row["peak_rotation_ratio_50"]
    words = Verdict.OVERTURNS.label if median == math.inf else in_digits(median, ".3f")
    return f"{words} ({100.0 * share:.0f} %)" if share > 0.0 else words


def fragility_curve(screening: xr.Dataset) -> str:
    """Return the form of the fragility curves; files of older versions have logistic ones."""
    return (
        str(screening["fragility_curve"].item()) if "fragility_curve" in screening else "logistic"
    )


def design_by_share(screening: xr.Dataset) -> bool:
    """Return True if a share must keep the limit of the design, False if the 84 % quantile must."""
    name = "design_statistic"
    return name not in screening or str(screening[name].item()) == "share"


def with_its_limits(dataset: xr.Dataset) -> xr.Dataset:
    """Return one structure of a screening, without limits of restraints that it does not have."""
    has = (dataset["fragility_outcome"] != Outcome.ABSENT).all("measure")
    return dataset.isel(limit_state=np.flatnonzero(has))


def kind_row(dataset: xr.Dataset) -> dict[str, str]:
    """Return the kind of the structure of a screening of one structure, as a row for words.

    Examples
    --------
    >>> import xarray as xr
    >>> in_verb_of(kind_row(xr.Dataset({"kind": "fixed"})), "overturning")
    'collapse'
    """
    return {"kind": str(dataset["kind"].item()) if "kind" in dataset else ""}


def equal_states(screening: xr.Dataset) -> list[list[LimitState]]:
    """Return the limit states in groups of equal curves and shares, overturning first."""
    groups: list[tuple[xr.Dataset, list[LimitState]]] = []
    variables = ["bin_share", "fragility", "fragility_outcome"]
    for name in screening["limit_state"].values:
        fits = screening[variables].sel(limit_state=name).drop_vars("limit_state")
        alike = next((states for curves, states in groups if curves.equals(fits)), None)
        if alike is None:
            groups.append((fits, [LimitState.named(str(name))]))
        else:
            alike.append(LimitState.named(str(name)))
    return [states for _, states in groups]


def title_of_states(state: Sequence[LimitState]) -> str:
    """Return the title of a row: its limit state, and those with the same curves.

    Examples
    --------
    >>> title_of_states([LimitState("", 0.0), LimitState("peak_u", 0.2)])
    'overturning; u ≥ 0.2 m has the same curves'
    """
    first, *others = (limit.words for limit in state)
    if not others:
        return first
    return f"{first}; {', '.join(others)} {'has' if len(others) == 1 else 'have'} the same curves"


#: Results of a design, one for each structure.
_OF_DESIGN: Final = ("design_smallest", "design_sure_from")


def screen_summary(screening: xr.Dataset) -> list[dict[str, Any]]:
    """Return the results of each structure: fragility, better measure, rate, design.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    summary = []
    screening = screening.drop_dims("record", errors="ignore")  # selecting in all takes long
    fits = _fits_of_each(screening)
    of_structure = {
        name: screening[name].values
        for name in ("structure", "better_measure", "better_measure_reason", *_OF_DESIGN, "kind")
        if name in screening
    }
    for k, structure in enumerate(of_structure["structure"]):
        said: dict[str, Any] = {
            "structure": str(structure),
            "fragility": fits[k],
            "better_measure": str(of_structure["better_measure"][k]),
            "better_measure_reason": str(of_structure["better_measure_reason"][k]),
        }
        if "annual_rate" in screening:
            screened = with_its_limits(screening.isel(structure=k))
            said["rates"] = [
                _rate(screened, str(limit)) for limit in screened["limit_state"].values
            ]
        row = {"kind": str(of_structure["kind"][k]) if "kind" in of_structure else ""}
        for entry in (*said["fragility"], *said.get("rates", ())):
            for key in {"words", "said", "note"} & entry.keys():
                entry[key] = in_verb_of(row, entry[key])
        said |= {name: float(of_structure[name][k]) for name in _OF_DESIGN if name in of_structure}
        summary.append(said)
    return summary


def _fits_of_each(screening: xr.Dataset) -> list[list[dict[str, Any]]]:
    """Return the fits of each structure, without limits of restraints that it does not have."""
    along = ("structure", "limit_state", "measure")
    fits = {
        str(name): values.transpose(*along).values
        for name, values in screening.items()
        if {*values.dims} == {*along}
    }
    limits, measures = (
        [str(name) for name in screening[dimension].values] for dimension in along[1:]
    )
    has = (fits["fragility_outcome"] != Outcome.ABSENT).all(axis=2)
    return [
        [
            _fit({name: values[k, i, j] for name, values in fits.items()}, limit, measure)
            for i, limit in enumerate(limits)
            for j, measure in enumerate(map(measure_of, measures))
            if has[k, i]
        ]
        for k in range(len(has))
    ]


def pooled_summary(screening: xr.Dataset) -> dict[str, Any]:
    """Return the fragilities of all free-standing structures together, and how much better the
    measure p PGV / (g tan alpha) predicts than PGA; empty if they were not asked for.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    together = pooled_fits(screening)
    if together is None:
        return {}
    (said,) = screen_summary(together)
    del said["structure"]
    likelihood = together.squeeze("structure")["log_likelihood"]
    for fit in said["fragility"]:
        at = {"limit_state": fit["limit_state"]}
        fit["log_likelihood"] = float(likelihood.sel(measure=fit["measure"], **at))
        # Both curves have two parameters, so the criteria of Akaike and Bayes differ equally.
        gain = fit["log_likelihood"] - float(likelihood.sel(measure="pga", **at))
        fit["aic_below_pga"] = 2.0 * gain
    names, free = screening["structure"].values, screening["pooled"].values == 1
    return said | {
        "structures": [str(name) for name in names[free]],
        "restrained": [str(name) for name in names[~free]],
    }


def _fit(fit: Mapping[str, Any], limit: str, measure: Measure) -> dict[str, Any]:
    outcome = Outcome(int(fit["fragility_outcome"]))
    state = LimitState.named(limit)
    numbers = {name: float(fit[f"fragility_{name}"]) / measure.printed for name in _INTENSITIES}
    numbers |= {name: float(fit[f"fragility_{name}"]) for name in _RATIOS}
    if outcome is Outcome.UNDETERMINED:
        numbers |= dict.fromkeys(_OF_CURVE, math.nan)
    return {
        "limit_state": limit,
        "words": state.words,
        "measure": measure.name,
        "symbol": measure.symbol,
        "unit": measure.unit,
        "outcome": outcome.name.lower(),
        "said": result_in_words(fit, state, measure),
        **numbers,
        "recordings": int(fit["fragility_motions"]),
        **{name: int(fit[f"fragility_{name}"]) for name in ("observations", "overturned")},
    }


def result_in_words(
    fit: xr.Dataset | Mapping[str, Any], limit: LimitState, measure: Measure
) -> str:
    """Return why a fit of a screening has no curve, or no determined one; "" if it has one."""
    outcome = Outcome(int(fit["fragility_outcome"]))
    words = limit.words if limit.quantity else ""
    names = ("median", "lowest", "highest", "safe_to", "overturned_from")
    median, lowest, highest, safe, fell = (
        float(fit[f"fragility_{name}"]) / measure.printed for name in names
    )
    if outcome is Outcome.UNDETERMINED:
        return why_undetermined(median, lowest, highest, measure.unit)
    step = f" ({safe:.3g} to {fell:.3g} {measure.unit})" if outcome is Outcome.SEPARATED else ""
    return "" if outcome is Outcome.FITTED else outcome.sentence_of(words) + step


#: Shares of a rate above this one, from where data are missing, are stated in its note [1].
_NOTED: Final = 0.1


def _rate(structure: xr.Dataset, limit: str) -> dict[str, Any]:
    limited = structure.sel(limit_state=limit)
    measure = measure_of(str(limited["hazard_measure"].item()))
    rate = float(limited["annual_rate"])
    intensity = limited["hazard_intensity"].values / measure.printed
    parts = limited["disaggregation"].values
    main = "" if np.isnan(parts).any() else _range(intensity, int(parts.argmax()), measure)
    return {
        "limit_state": limit,
        "words": LimitState.named(limit).words,
        "rate_per_year": rate,
        "rate_low_per_year": float(limited["annual_rate_low"]),
        "rate_high_per_year": float(limited["annual_rate_high"]),
        "return_period_years": 1.0 / rate if rate > 0.0 else math.nan,
        "extrapolated_share": float(limited["annual_rate_extrapolated"]),
        "main_intensity": main,
        "note": _note(limited, measure),
        "disaggregation": [
            {"intensity": _range(intensity, k, measure), "rate_per_year": float(part)}
            for k, part in enumerate(parts)
        ],
    }


def _note(dataset: xr.Dataset, measure: Measure) -> str:
    """Return in words why a rate is uncertain, or "".

    Its fragility curve may be undetermined, or much of the rate may come from intensities at which
    there are no data.
    """
    fit, unit = dataset.sel(measure=measure.name), measure.unit
    least = float(fit["fragility_lowest"]) / measure.printed
    most = float(fit["fragility_highest"]) / measure.printed
    last = float(dataset["hazard_intensity"][-1]) / measure.printed
    rate, above = float(dataset["annual_rate"]), float(dataset["disaggregation"][-1])
    shares = (
        (
            float(dataset["annual_rate_extrapolated"]),
            f"outside the range tried, {least:.3g} to {most:.3g} {unit}",
        ),
        (
            above / rate if rate > 0.0 else 0.0,
            f"above {last:.3g} {unit}, the last point of the hazard curve",
        ),
    )
    undetermined = int(fit["fragility_outcome"]) == Outcome.UNDETERMINED
    return "; ".join(
        [
            *["its fragility is not determined by these data"] * undetermined,
            *(
                f"{100.0 * share:.0f} % of it is from intensities {where}"
                for share, where in shares
                if share > _NOTED
            ),
        ]
    )


def hazard_words(screening: xr.Dataset) -> list[str]:
    """Return sentences about the hazard curve of a screening: its site, and its bounded points.

    Examples
    --------
    >>> import xarray as xr
    >>> hazard_words(xr.Dataset({"hazard_site": "site there", "hazard_note": ""}))
    ['The hazard curve is that of site there.']
    """
    starts = {
        "hazard_site": "The hazard curve is that of",
        "hazard_note": "Ends of the hazard curve:",
    }
    texts = {name: str(screening[name].item()) for name in starts if name in screening}
    return [f"{starts[name]} {text}." for name, text in texts.items() if text]


def _range(intensity: NDArray[np.float64], k: int, measure: Measure) -> str:
    if k + 1 == intensity.size:
        return f"above {intensity[k]:.3g} {measure.unit}"
    return f"{intensity[k]:.3g} to {intensity[k + 1]:.3g} {measure.unit}"


def fragility_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each structure, limit state and known measure.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`.
    """
    for structure in screen_summary(screening):
        for fit in structure["fragility"]:
            if fit["outcome"] != "unknown":
                yield _row_of_fit({"structure": structure["structure"]}, fit)


def _row_of_fit(of_what: dict[str, Any], fit: Mapping[str, Any]) -> dict[str, Any]:
    left = ("words", "symbol", "said")
    said = {name: value for name, value in fit.items() if name not in left}
    said["reached"] = said.pop("overturned")
    said["reached_from"] = said.pop("overturned_from")
    return {**of_what, **said, "note": fit["said"]}


def pooled_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each limit state and measure of the pooled fragility."""
    for fit in pooled_summary(screening)["fragility"]:
        yield _row_of_fit({"structures": int(screening["pooled"].sum())}, fit)


def rate_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each structure and limit state, with its rate and return period."""
    for structure in screen_summary(screening):
        for rate in structure["rates"]:
            left = ("words", "disaggregation")
            said = {name: value for name, value in rate.items() if name not in left}
            measure = measure_of(str(screening["hazard_measure"].item())).name
            yield {"structure": structure["structure"], "measure": measure, **said}


def design_rows(screening: xr.Dataset) -> Rows:
    """Return a row for each structure and value tried in the design."""
    unit = screening["design_value"].attrs["units"]
    columns = columns_of(
        "structure dimension=design_dimension value=design_value unit quantity=design_quantity",
        "limit=design_limit share_below=design_share required_share=design_required_share",
        "smallest=design_smallest sure_from=design_sure_from",
        "statistic=design_statistic quantile_84=design_quantile_84",
    )
    return rows_along(screening.assign(unit=unit), "structure design_step", columns)


def _of_scenario(screening: xr.Dataset) -> dict[str, str]:
    """Return the columns of the table of scenarios, with their variables."""
    columns = columns_of(
        "record_id structure scale verdict",
        *(f"{quantity.column()}={quantity.name}" for quantity in OF_SCENARIO),
        "pga_g=pga pgv_m_s=pgv",
    )
    return columns | _of_members(screening)


def scenario_rows(screening: xr.Dataset) -> Rows:
    """Return the rows of `scenario_columns`: one for each motion, structure and scale."""
    return rows_of_columns(scenario_columns(screening))


def scenario_columns(screening: xr.Dataset) -> Blocks:
    """Yield the columns of each motion for structures and scales, with intensities."""
    yield from _scenario_columns(screening, _of_scenario(screening))


def _scenario_columns(motions: Dataset, columns: Mapping[str, str]) -> Blocks:
    for block in columns_along(motions, "record structure scale", columns):
        yield block | {
            name: [value * scale for value, scale in zip(block[name], block["scale"], strict=True)]
            for name in ("pga_g", "pgv_m_s")
        }


def _listed_scenarios(dataset: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
    """Return what the table of scenarios needs, and the variable of each column."""
    columns = _of_scenario(dataset)
    names = {name.partition(".")[0] for name in columns.values()}
    return dataset[[name for name in dataset.variables if name in names]], columns


def _in_order_of_file(listed: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield some motions of a screening after the other."""
    each = math.prod(n for name, n in listed.sizes.items() if name in ("structure", "scale"))
    together = max(1, _TOGETHER // each)
    for first in range(0, listed.sizes["record"], together):
        yield listed.isel(record=slice(first, first + together)).load()


def _scenarios(path: Path) -> Blocks:
    """Yield the columns of all scenarios; only some motions are in memory at a time."""
    from rockframe.results.reading import opened  # loads xarray

    with opened(path, SCREEN) as dataset:
        listed, columns = _listed_scenarios(dataset)
        for motions in _in_order_of_file(listed):
            yield from _scenario_columns(motions, columns)


class _Motions(NamedTuple):
    """Some motions, the variables of the columns of their rows, and what makes the columns."""

    motions: Arrays
    columns: Mapping[str, str]
    columns_of: Callable[[Arrays, Mapping[str, str]], Blocks]


def _in_csv(part: _Motions) -> tuple[bytes, list[bytes]]:
    """Return the header of a table, and the lines of each motion."""
    header, *lines = (
        text.encode() for text in block_lines(part.columns_of(part.motions, part.columns))
    )
    return header, lines


def _write_motions(path: Path, screening: Path | xr.Dataset, engine: Engine | None) -> None:
    """Write the table of scenarios of a file, or that of motions of a dataset, as CSV.

    An engine makes the lines in the order of the file, which is the fastest to read.
    """
    from rockframe.results.reading import opened  # loads xarray

    with ExitStack() as stack:
        if isinstance(screening, Path):
            listed, columns = _listed_scenarios(stack.enter_context(opened(screening, SCREEN)))
            order, columns_of = range(listed.sizes["record"]), _scenario_columns
        else:
            listed, columns = _listed_pairs(screening)
            order, columns_of = _places_by_rank(screening).tolist(), _pair_columns
        partial = stack.enter_context(whole_file(path))
        kept = stack.enter_context(TemporaryFile(dir=partial.parent))
        parts = (
            _Motions(arrays_of(motions), columns, columns_of)
            for motions in _in_order_of_file(listed)
        )
        ends = [0]
        with partial.open("wb") as stream:
            for header, lines in map_tasks(_in_csv, parts, engine=engine):
                if len(ends) == 1:
                    stream.write(header)
                for of_motion in lines:
                    ends.append(ends[-1] + kept.write(of_motion))
            for place in order:
                kept.seek(ends[place])
                stream.write(kept.read(ends[place + 1] - ends[place]))


_SCENARIO: Final = ("record_id", "structure", "scale", "verdict")
#: For each table, by the end of its name: the function that makes its rows, and its first columns,
#: by which an earlier table is recognised.
_TABLES: Final[Mapping[str, tuple[Callable[[xr.Dataset], Rows], tuple[str, ...]]]] = {
    "": (screen_rows, _SCENARIO),
    "scenarios": (scenario_rows, _SCENARIO),
    "fragility": (fragility_rows, ("structure", "limit_state", "measure")),
    "pooled": (pooled_rows, ("structures", "limit_state", "measure")),
    "rates": (rate_rows, ("structure", "measure", "limit_state")),
    "demands": (demand_rows, DEMAND_COLUMNS),
    "design": (design_rows, ("structure", "dimension", "value")),
}


def screen_table_paths(
    output: Path,
    *,
    rates: bool,
    design: bool,
    pooled: bool = False,
    demands: bool = False,
    table_format: str = "csv",
) -> dict[str, Path]:
    """Return the paths of the tables beside a screening, by kind; the table of motions has kind "".

    Examples
    --------
    >>> [p.name for p in screen_table_paths(Path("screen.nc"), rates=True, design=False).values()]
    ['screen.csv', 'scenarios.csv', 'fragility.csv', 'rates.csv']
    >>> screen_table_paths(Path("site.nc"), rates=False, design=False)["fragility"].name
    'site-fragility.csv'
    >>> screen_table_paths(Path("design.nc"), rates=False, design=True)["design"].name
    'design-table.csv'
    """
    table = output.with_suffix(TABLE_FORMATS[table_format])
    asked = _asked_kinds(rates=rates, design=design, pooled=pooled, demands=demands)
    kinds = ["scenarios", "fragility", *asked]
    if table_format == "xlsx":  # the others are sheets of the workbook
        kinds = ["scenarios"]
    return {"": table} | {kind: beside(table, kind, plain="screen") for kind in kinds}


def _asked_kinds(**asked: bool) -> list[str]:
    return [kind for kind in ("pooled", "rates", "demands", "design") if asked[kind]]


def _asked_of(screening: xr.Dataset) -> dict[str, bool]:
    marks = {"rates": "annual_rate", "design": "design_share", "pooled": "pooled"}
    marks["demands"] = "return_period_years"
    return {kind: mark in screening for kind, mark in marks.items()}


def write_screen_tables(
    screen_path: Path,
    output: Path | None = None,
    table_format: str = "csv",
    screening: xr.Dataset | None = None,
    *,
    engine: Engine | None = None,
) -> dict[str, Path]:
    """Write the tables of a screening, and return their paths by kind.

    Parameters
    ----------
    screen_path : Path
        Output of the screen stage.
    output : Path, optional
        Path beside which the tables are written (default: `screen_path`).
    table_format : str
        One of `TABLE_FORMATS`.
    screening : Dataset, optional
        What `write_screening` returned (default: read from the file). Only the scenarios are read
        from the file, some motions at a time.
    engine : Engine, optional
        Engine that makes the lines of CSV of single motions; by default a `ProcessPool`. Every
        engine gives the same bytes.

    Raises
    ------
    InputError
        If the screening cannot be read, or a table cannot be written.
    """
    if screening is None:
        screening = read_screening(screen_path, every_scale=False)
    beside = output or screen_path
    paths = screen_table_paths(beside, **_asked_of(screening), table_format=table_format)
    for kind, path in paths.items():
        if table_format == "xlsx" and not kind:
            write_workbook(path, _sheets(screen_path, screening))
            continue
        if kind in ("", "scenarios") and table_format == "csv":
            _write_motions(path, screen_path if kind else screening, engine)
        elif kind in ("", "scenarios"):
            blocks = _scenarios(screen_path) if kind else screen_columns(screening)
            write_rows_as(path, rows_of_columns(blocks), table_format)
        else:
            write_rows_as(path, _TABLES[kind][0](screening), table_format)
    return paths


def _sheets(path: Path, screening: xr.Dataset) -> dict[str, Any]:
    """Return the sheets of the workbook of a screening."""
    rows = list(screen_rows(screening))
    left_out = left_out_reasons(screening.attrs)
    overall = list(overall_rows(screening)) or summary_rows(rows, left_out=left_out)
    kinds = ["fragility", *_asked_kinds(**_asked_of(screening))]
    others = {kind: _TABLES[kind][0](screening) for kind in kinds}
    parameters = parameter_rows((path, SCREEN))
    return {**tables_of(rows, overall, "motions"), **others, "parameters": parameters}


def refuse_strange_tables(paths: Mapping[str, Path]) -> None:
    """Raise an error if a file has the name of a table but other contents.

    Raises
    ------
    InputError
        If there is such a file.
    """
    for kind, path in paths.items():
        workbook = not kind and path.suffix == TABLE_FORMATS["xlsx"]
        first = SUMMARY_COLUMNS if workbook else _TABLES[kind][1]
        refuse_other_table(path, first, "the table of the screening")
