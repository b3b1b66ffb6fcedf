"""The check of the paper: its findings, compared with expected values, and its page."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from rockframe.cells import rows_of_columns
from rockframe.paper import derivation
from rockframe.paper.claim import Claim, Finding, agrees_to_last_digit
from rockframe.paper.claims import all_claims, checked_page
from rockframe.paper.derivation import derivation_checks
from rockframe.paper.pulses import (
    BORROWED,
    paper_records,
    pulse_checks,
    record_claims,
    with_paper_columns,
    with_paper_facts,
)
from rockframe.results.tables.rows import Row
from rockframe.wavelets.family import BETA

Expected = Callable[[str], Any]


@pytest.fixture(scope="module")
def listed() -> list[Claim]:
    return all_claims()


@pytest.fixture(scope="module")
def claims(listed: list[Claim]) -> dict[str, Claim]:
    return {claim.name: claim for claim in listed}


def row(number: int, **changed: Any) -> Row:
    """Return a row of the paper's own values for its bridge, with changes."""
    paper = paper_records()[number]
    values: dict[str, Any] = {
        "event": paper.event, "record": paper.record, "magnitude": paper.magnitude,
        "epicentral_distance_km": paper.epicentral_distance_km, "pga_g": paper.pga_g,
        "pgv_m_s": paper.pgv_m_s, "a_p_g": paper.a_p_g, "T_p_s": paper.T_p_s,
        "wavelet": "symmetric_ricker", "match_index": 0.8, "L_p_m": 1.0, "at_period_bound": False,
        "structure": "bridge-bent", "peak_rotation_ratio": 0.3, "peak_u_m": 0.4, "peak_v_m": 0.04,
        "impacts": 9, "verdict": "safe", "uplift_time_s": 1.0, "overturning_time_s": math.nan,
        "record_id": f"r{number}", "source_file": f"{paper.files[0]}.AT2",
    }  # fmt: skip
    return values | {"facts_source": BORROWED} | changed


@pytest.mark.parametrize(
    ("printed", "ours", "finding"),
    [
        ("1.4", 1.381, Finding.AGREES),
        ("1.40", 1.381, Finding.DIFFERS),
        ("54.73", 54.7356, Finding.AGREES),
        ("5", 6.01, Finding.DIFFERS),
        ("5", 4.0, Finding.DIFFERS),
        ("5", 4.51, Finding.AGREES),
        ("0.9", 0.949, Finding.AGREES),
        ("0.9", 0.951, Finding.DIFFERS),
        ("-20", -20.9, Finding.AGREES),
        ("-20", -21.1, Finding.DIFFERS),
    ],
)
def test_agreement_is_rounding_or_a_unit_of_the_last_digit_within_five_percent(
    printed: str, ours: float, finding: Finding
) -> None:
    """One unit of the last digit may be 20 % of a number, so 5 % is the limit beyond rounding."""
    assert agrees_to_last_digit(printed, ours) is finding


def test_numbers_are_the_expected_ones(claims: dict[str, Claim], expected: Expected) -> None:
    constants = expected("constants")
    temple, bridge = constants["apollo_corinth"], constants["bridge"]
    assert claims["temple-p"].ours == f"{float(temple['p']):.3f} rad/s"
    assert claims["temple-slenderness"].ours == f"{float(temple['alpha_deg']):.3f} degrees"
    assert claims["bridge-p"].ours == f"{float(bridge['p_rect']):.4f} rad/s"
    assert f"{float(bridge['p_cyl']):.4f}" in claims["bridge-p"].remark
    drift = constants["geometry_check_fig11"]
    assert f"v = {100.0 * float(drift['v_at_u_0p50']):.2f} cm" in claims["drift-and-lift"].ours
    assert f"u = {100.0 * float(drift['u_at_v_0p05']):.1f} cm" in claims["drift-and-lift"].ours


def test_the_misprinted_equations_are_found_as_misprints(claims: dict[str, Claim]) -> None:
    misprinted = {n for n, c in claims.items() if c.finding is Finding.MISPRINT}
    assert {name for name in misprinted if name.startswith("eq-")} == {
        "eq-12", "eq-23", "eq-24", "eq-34", "eq-45",
    }  # fmt: skip


def test_eq_12_as_printed_does_not_follow_from_eq_11(claims: dict[str, Claim]) -> None:
    """For theta > 0, (12) is off by 4 R sin(alpha - theta) theta''; (8), (9), (11) are right."""
    alpha, size, rate = math.atan(1.6 / 9.6), math.hypot(0.8, 4.8), -0.8
    printed, ours = (float(t.split()[0]) for t in (claims["eq-12"].printed, claims["eq-12"].ours))
    off = 4.0 * size * math.sin(alpha - 0.05) * rate
    assert ours - printed == pytest.approx(off, abs=1e-4)
    sine, cosine = math.sin(alpha - 0.05), math.cos(alpha - 0.05)
    assert ours == pytest.approx(2.0 * size * (sine * rate - cosine * 0.3**2), abs=1e-4)
    assert claims["eq-7-11"].finding is Finding.AGREES


def test_eq_45_as_printed_falls_short_by_its_missing_factor(claims: dict[str, Claim]) -> None:
    factor = math.sqrt(3.0) * 1.27 / math.tau
    assert claims["eq-45"].printed.startswith(f"maximum {factor:.4f} s")


@pytest.mark.parametrize("factor", [1.0 - 1.3e-6, 1.0 + 1.3e-6])
def test_a_wrong_beta_would_be_found(monkeypatch: pytest.MonkeyPatch, factor: float) -> None:
    """With another beta, the largest acceleration of eq (45) is not a_p."""
    monkeypatch.setattr("rockframe.paper.pulses.BETA", factor * BETA)
    assert pulse_checks()["eq-45"].finding is Finding.DIFFERS


def test_what_is_said_of_overturning(claims: dict[str, Claim]) -> None:
    """Three other integrators give the first edges 3.265 and 4.340 at omega_p / p = 4."""
    assert "+33 %" in claims["marginal"].ours
    assert claims["marginal"].finding is Finding.DIFFERS
    assert claims["every-amplitude"].finding is Finding.DIFFERS
    assert claims["heavier"].finding is Finding.AGREES
    assert claims["temple-column-stands"].ours == "no pulse up to 60 g tan α overturns"
    assert claims["temple-frame-stands"].ours == "5.7565 (symmetric), 6.8945 (antisymmetric)"
    assert claims["enhanced"].finding is Finding.AGREES


def test_a_frame_is_one_column_but_for_its_losses(claims: dict[str, Claim]) -> None:
    assert claims["one-column"].finding is Finding.DIFFERS
    assert claims["one-column-losses"].finding is Finding.AGREES


def test_what_differs_is_known(claims: dict[str, Claim]) -> None:
    differing = {n for n, c in claims.items() if c.finding is Finding.DIFFERS}
    expected = {"marginal", "every-amplitude", "drift-and-lift", "one-column"}
    assert differing == expected | {"scale-every-amplitude"}


def test_each_of_equations_13_to_21_holds(claims: dict[str, Claim]) -> None:
    """The bodies' own energy and work, and the computed response, agree with the printed forms."""
    for number in range(13, 22):
        assert claims[f"eq-{number}"].finding is Finding.AGREES


def test_an_equation_with_a_wrong_factor_would_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    """The factor of (23) as printed, N m_c instead of N m_c / 2, in place of that of (18)."""
    monkeypatch.setattr(derivation, "_factor", lambda: 4.0 * 3.0 + 3.0)
    differing = {
        name for name, checked in derivation_checks().items() if checked.finding is Finding.DIFFERS
    }
    assert differing == {"eq-13", "eq-15", "eq-18"}


def test_scale_effects_hold_for_the_least_amplitude_only(claims: dict[str, Claim]) -> None:
    assert claims["larger-block"].finding is claims["longer-pulse"].finding is Finding.AGREES
    assert claims["scale-every-amplitude"].finding is Finding.DIFFERS
    assert claims["safe-region"].ours.startswith("in 4 of 4 panels")


def test_gamma_of_the_temple_needs_an_epistyle_of_its_size(claims: dict[str, Claim]) -> None:
    """0.3 times the column's volume, pi / 4 1.8^2 7.5 m3 = 19.1 m3."""
    assert claims["temple-gamma"].ours.startswith("an epistyle of 5.7 m³ for each column of 19.1")
    assert claims["temple-gamma"].finding is Finding.OPEN


def test_magnitudes_and_distances_that_records_state_are_judged() -> None:
    """The paper prints 0.1 km for Parkfield, which is no epicentral distance of some 30 km."""
    complete = row(0, magnitude=6.19, epicentral_distance_km=31.0, facts_source="catalogue.csv")
    claims = {claim.name: claim for claim in record_claims([complete])}
    assert claims["r0-magnitude"].finding is Finding.AGREES
    assert claims["r0-epicentral_distance_km"].finding is Finding.DIFFERS
    assert claims["r0-epicentral_distance_km"].printed == "0.1 km"
    borrowed = record_claims([row(0)])
    assert not any("magnitude" in claim.name for claim in borrowed)


def test_names_are_unique(listed: list[Claim], claims: dict[str, Claim]) -> None:
    assert len(claims) == len(listed)


@pytest.mark.parametrize(("ours", "finding"), [(1.279, Finding.AGREES), (1.282, Finding.DIFFERS)])
def test_a_unit_of_the_last_digit_is_forgiven(ours: float, finding: Finding) -> None:
    """The paper prints 1.27 s as T_p of the second record, and four numbers for each record."""
    claims = {claim.name: claim for claim in record_claims([row(1, T_p_s=ours)])}
    assert sum(name.startswith("r1-") for name in claims) == 4
    assert claims["r1-T_p_s"].printed == "1.27 s"
    assert claims["r1-T_p_s"].finding is finding


@pytest.mark.parametrize("number", range(len(paper_records())))
def test_only_what_a_record_lacks_is_taken_from_table_1(number: int) -> None:
    whole = row(number, magnitude=5.5, epicentral_distance_km=99.0, facts_source="file")
    assert with_paper_facts(whole) == whole
    bare = whole | dict.fromkeys(("magnitude", "epicentral_distance_km"), math.nan)
    paper = paper_records()[number]
    assert with_paper_facts(bare) == whole | {
        "magnitude": paper.magnitude,
        "epicentral_distance_km": paper.epicentral_distance_km,
        "facts_source": f"file; {BORROWED}",
    }
    assert with_paper_facts(bare | {"source_file": "mine.csv"})["facts_source"] == "file"
    for given in (whole, bare, bare | {"source_file": "mine.csv"}):
        columns = with_paper_columns({key: [value, value] for key, value in given.items()})
        assert [*rows_of_columns([columns])] == 2 * [with_paper_facts(given)]


def test_a_record_of_another_processing_is_not_judged() -> None:
    claims = record_claims([row(2, pga_g=0.421, pgv_m_s=0.62)])
    assert {claim.finding for claim in claims} == {Finding.OPEN}


def test_pgv_tells_another_processing_too() -> None:
    """Erzincan has the paper's PGA but a PGV 22 % higher, so it was processed differently."""
    claims = record_claims([row(3, pgv_m_s=0.782, a_p_g=0.522, T_p_s=0.374)])
    assert len(claims) == 4  # no claim about the bridge
    assert {claim.finding for claim in claims} == {Finding.OPEN}


def test_the_last_printed_digit_counts_if_it_is_zero() -> None:
    """The paper prints Kobe's a_p as 0.50; 0.536 would agree with a printed 0.5."""
    claims = {claim.name: claim for claim in record_claims([row(5, a_p_g=0.536)])}
    assert claims["r5-a_p_g"].printed == "0.50 g"
    assert claims["r5-a_p_g"].finding is Finding.DIFFERS


def test_the_wavelet_of_mavroeidis_and_papageorgiou_is_compared_too() -> None:
    """Table 1 names the extended wavelet transform, which section 6 attributes to them."""
    pulse = {
        "record_id": "r5",
        "wavelet": "mavroeidis_papageorgiou",
        "a_p_g": 0.490,
        "T_p_s": 1.147,
    }
    other = pulse | {"wavelet": "ricker_any_phase", "a_p_g": 9.0}
    claims = record_claims([row(5, a_p_g=0.536, T_p_s=0.806)], [pulse, other])
    findings = {claim.name: claim.finding for claim in claims}
    assert len(findings) == len(claims) == 9
    assert findings["r5-a_p_g"] is findings["r5-T_p_s"] is Finding.DIFFERS
    assert findings["r5-a_p_g-mavroeidis_papageorgiou"] is Finding.AGREES
    assert findings["r5-T_p_s-mavroeidis_papageorgiou"] is Finding.AGREES


def test_a_bridge_that_turns_further_differs() -> None:
    claims = {c.name: c for c in record_claims([row(4, peak_rotation_ratio=0.366, peak_v_m=0.079)])}
    assert claims["bridge-rotation"].finding is Finding.DIFFERS
    assert "0.366" in claims["bridge-rotation"].ours
    assert claims["bridge-lift"].finding is Finding.DIFFERS
    assert claims["bridge-drift"].finding is Finding.AGREES


def test_other_records_claim_nothing() -> None:
    assert record_claims([row(0, source_file="mine.csv")]) == []


def test_the_page_has_each_claim_its_command_and_the_figures(claims: dict[str, Claim]) -> None:
    page = checked_page(list(claims.values()), {"figures/a.png": "A title. Words."}, "No records.")
    for name in claims:
        assert f"\n| `{name}` |" in page
        assert page.count(name) >= 2
    assert "![A title](figures/a.png)" in page
    assert f"{len(claims)} claims" in page


def test_the_page_is_a_table_whatever_is_in_it() -> None:
    claim = Claim(
        name="odd", where="|", says="<script>", printed="|a|", ours="b", finding=Finding.OPEN
    )
    page = checked_page([claim], {}, "")
    (line,) = (line for line in page.splitlines() if line.startswith("| `odd`"))
    assert "<script>" not in line
    assert line.replace("\\|", "").count("|") == 7
