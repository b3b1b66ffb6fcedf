"""Designs over all records of a comparison, the best of them, and their page."""

from __future__ import annotations

import math
from typing import Any

import pytest

from rockframe.results.tables.designs import (
    BEST,
    DESIGN_LEGEND,
    DESIGN_QUANTITIES,
    best_rows,
    design_columns,
    design_rows,
)

NAN = math.nan
INF = math.inf


def row(record: str, model: str, u: float, shear: float, **others: Any) -> dict[str, Any]:
    """Return a row of a comparison with an ensemble, whose nominal drift must not matter."""
    unknown = [one.column(part) for one in DESIGN_QUANTITIES for part in ("", 0.5)]
    return {
        **dict.fromkeys(unknown, NAN),
        **{"record_id": record, "structure": "bent", "model": model, "peak_u_m": 9.9},
        **{"peak_u_50_m": u, "residual_u_m": 0.5 * u, "peak_base_shear_50": shear},
        **{"peak_base_shear_50_kn": 1000.0 * shear, "weight_kn": 1000.0, "validity": "holds"},
        **{"share_overturned": 0.0, "share_model_ends": 0.0, "peak_v_m": 0.0},
        **{"ductility": NAN, "peak_rotation_ratio": NAN, "valid_until_s": NAN},
        **others,
    }


@pytest.fixture
def rows() -> list[dict[str, Any]]:
    free = [
        row(f"r{k}", "free", *both) for k, both in enumerate(((0.1, 0.2), (0.5, 0.1), (0.3, 0.3)))
    ]
    fixed = [row(f"r{k}", "fixed", 0.05, 0.4, share_model_ends=0.5) for k in range(3)]
    return [*free, *fixed]


def test_quantiles_and_worst_records_of_a_design(rows: Any) -> None:
    free, fixed = design_rows(rows)
    assert (free["structure"], free["design"], free["records"]) == ("bent", "free", 3)
    assert free["peak_u_50_m"] == 0.3
    # 84 % of two steps is 0.68 of the second
    assert free["peak_u_84_m"] == pytest.approx(0.3 + 0.68 * 0.2)
    assert (free["peak_u_worst_m"], free["peak_u_record"]) == (0.5, "r1")
    assert (free["peak_base_shear_worst"], free["peak_base_shear_record"]) == (0.3, "r2")
    assert free["peak_base_shear_worst_kn"] == 300.0
    assert free["residual_u_worst_m"] == 0.25
    assert (free["share_model_ends"], fixed["share_model_ends"]) == (0.0, 0.5)
    assert math.isnan(free["peak_tendon_force_84_n"])
    assert free["peak_tendon_force_record"] == ""


def test_a_design_that_overturns_is_infinite_and_never_the_best(rows: Any) -> None:
    fallen = [row(f"r{k}", "fallen", INF, 0.2, share_overturned=1.0) for k in range(3)]
    designs = design_rows([*rows, *fallen])
    drift = next(one for one in best_rows(designs) if one["quantity"] == "peak_u_84_m")
    assert (drift["best"], drift["second"]) == ("fixed", "free")
    assert drift["best_value"] == 0.05
    assert drift["best_model_ends"] == 0.5
    columns = {column.key: column for column in design_columns(designs)}
    assert columns["peak_u_*_m"].cell(designs[2]) == "overturns overturns overturns"
    assert columns["peak_u_*_m"].cell(designs[1]) == "5.0 5.0 5.0"


def test_a_nominal_residual_is_not_the_best_where_half_of_the_ensemble_overturns(rows: Any) -> None:
    """The free frame comes to rest at 0 if it stands, and half of the plausible ones do not."""
    zero = {"residual_u_m": 0.0, "share_overturned": 0.5}
    free = [row(f"r{k}", "half", INF, 0.2, **zero) for k in range(3)]
    designs = design_rows([*rows, *free])
    left = next(one for one in best_rows(designs) if one["quantity"] == "residual_u_84_m")
    assert (left["best"], left["second"]) == ("fixed", "free")
    assert designs[2]["residual_u_50_m"] == designs[2]["residual_u_worst_m"] == INF
    standing = design_rows([{**one, "peak_u_50_m": 0.1} for one in free])
    assert standing[0]["residual_u_50_m"] == 0.0


def test_equal_designs_share_their_rank(rows: Any) -> None:
    ends = {one["quantity"]: one for one in best_rows(design_rows(rows))}
    assert ends["share_overturned"]["best"] == "free, fixed"
    assert ends["share_overturned"]["second"] == ""
    assert (ends["peak_base_shear_84"]["best"], ends["peak_base_shear_84"]["second"]) == (
        "free",
        "fixed",
    )
    assert "peak_tendon_force_84_n" not in ends  # no design has tendons


@pytest.mark.parametrize(("count", "printed"), [(3, "m0, m1, m2"), (4, "4 designs")])
def test_of_many_equal_designs_the_number_is_printed(count: int, printed: str) -> None:
    designs = design_rows([row("r", f"m{k}", 0.1, 0.2) for k in range(count)])
    drift = next(one for one in best_rows(designs) if one["quantity"] == "peak_u_84_m")
    assert BEST[1].cell(drift) == printed


def test_designs_of_several_structures_are_named_with_them(rows: Any) -> None:
    other = [{**one, "structure": "pier", "peak_u_50_m": 0.01} for one in rows]
    best = best_rows(design_rows([*rows, *other]))
    drift = next(one for one in best if one["quantity"] == "peak_u_84_m")
    assert drift["best"] == "pier free, pier fixed"


def test_without_an_ensemble_shares_are_those_of_the_records(rows: Any) -> None:
    nominal = [
        {**one, "share_overturned": NAN, "share_model_ends": NAN, "peak_u_m": u, "validity": ends}
        for one, u, ends in zip(
            rows, (0.1, INF, 0.2), ("holds", "overturns", "holds"), strict=False
        )
    ]
    (free,) = design_rows(nominal)
    assert free["share_overturned"] == free["share_model_ends"] == 1 / 3
    assert (free["peak_u_50_m"], free["peak_u_worst_m"]) == (0.2, INF)


def test_the_legend_explains_residual_drifts_by_the_word_of_their_heading(rows: Any) -> None:
    heads = " ".join(column.head for column in design_columns(design_rows(rows)))
    assert "residual u" in heads
    assert "Residual u:" in DESIGN_LEGEND
