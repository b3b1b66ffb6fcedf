"""The comparisons with OpenSees and with the plain integrator (tests/validation), and the page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.validation import bents, compare, independent, invariants, mujoco, round_columns
from tests.validation.cases import STRUCTURES, motions, ricker
from tests.validation.compliant import acceleration, peak_ratio
from tests.validation.opensees import History
from tests.validation.page import DOCS, table
from tests.validation.plain import Rocker, rock
from tests.validation.random_cases import KINDS, case_of
from tests.validation.run import DAMPING, PULSES, Task, free_rocking, motion_of, read

from rockframe.frame import RockingFrame
from rockframe.rocking import Response, Verdict, respond
from rockframe.unequal import bent_ensemble, respond_bent


def test_a_contact_that_hardly_gives_is_rigid() -> None:
    # In the limit the simplest model is eqs (26) and (43), here with another integrator.
    bent, pulse = STRUCTURES["bent"], ricker(0.5, 1.5)
    rigid = respond(bent, pulse.ground).peak_rotation_ratio
    assert peak_ratio(bent, pulse, 1e-7) == pytest.approx(rigid, rel=2e-4)
    assert peak_ratio(bent, pulse, 1e-3) > 1.1 * rigid


def test_the_simplest_model_of_a_damped_contact_has_the_peaks_of_opensees() -> None:
    results, bent = read(), STRUCTURES["bent"]
    for motion in compare.pulses_of("bent"):
        found = results[Task("bent", motion, 1.0, 1e-3, damping=DAMPING)].peak_ratio
        pulse = motion_of(Task("bent", motion, 1.0), {})
        assert peak_ratio(bent, pulse, 1e-3) == pytest.approx(found, rel=0.02)


def test_period_of_sway_is_that_of_the_slope_of_the_moment() -> None:
    # Without ground motion, theta'' = -(2 pi / T)^2 theta at small rotations.
    bent, tiny = STRUCTURES["bent"], 1e-9
    squared = bent.effective_frequency_parameter**2
    slope = acceleration(tiny, 0.0, bent.slenderness, squared, 1e-4 / 0.8) / tiny
    assert compare.sway_period(bent, 1e-4) == pytest.approx(2.0 * np.pi / np.sqrt(-slope))


def test_restitution_and_period_of_free_rocking_are_measured_right() -> None:
    # The package's own histories after a pulse have the restitution (43) and its half period.
    bent, pulse = STRUCTURES["bent"], ricker(0.5, 1.5)
    response = respond(bent, pulse.ground.followed_by_rest(12.0))
    history = History(response.time, response.theta, 0.0, converged=True)
    peak, period, kept = free_rocking(bent, history, end=6.0)
    assert kept == pytest.approx(bent.restitution, abs=2e-4)
    assert period == pytest.approx(compare.half_period("bent", peak), rel=1e-3)


def test_equal_programs_pass_the_exchange_test_and_shifted_ones_fail_it() -> None:
    peaks = np.random.default_rng(3).lognormal(size=200)
    assert compare.exchange_test(peaks, peaks) == (0.0, 1.0)
    distance, chance = compare.exchange_test(peaks, 1.3 * peaks)
    assert distance > 0.05
    assert chance < 0.01


def test_the_page_has_the_peaks_of_this_package_and_of_the_kept_results() -> None:
    results = read()
    pulses = sum(len(some) for some in PULSES.values())
    rows = compare.pulse_rows(results)
    assert len(rows) == pulses
    page = (DOCS / "validation.md").read_text(encoding="utf-8")
    for row in rows:
        assert "| " + " | ".join(row) + " |" in page


@pytest.mark.parametrize("name", PULSES)
def test_opensees_has_the_peaks_and_the_restitution_of_rigid_bodies(name: str) -> None:
    # No input of OpenSees states either; a contact of 0.001 mm is almost rigid.
    found = {
        task.motion: result
        for task, result in read().items()
        if task.structure == name and task.shortening == 1e-6
    }
    assert found.keys() == set(compare.pulses_of(name))
    for motion, result in found.items():
        assert result.peak_ratio == pytest.approx(compare.rigid_peak(name, motion), rel=0.012)
    kept = np.median([result.restitution for result in found.values()])
    assert kept == pytest.approx(STRUCTURES[name].restitution, abs=0.0015)


@pytest.mark.parametrize("kind", KINDS)
def test_the_plain_integrator_agrees(kind: str) -> None:
    # It shares no code with the package, and starts from the geometry.
    case = case_of(kind, 1)
    found = independent.compared(kind, 1, case)
    assert found.history < 1e-7
    assert found.impacts >= 0
    assert found.verdict == found.plain_verdict
    assert not found.broken


def test_the_plain_integrator_notices_another_restitution() -> None:
    case = case_of("free", 3)
    assert isinstance(case.plain, Rocker)
    other = replace(case, plain=replace(case.plain, restitution=0.999 * case.plain.restitution))
    assert independent.compared("free", 3, other).history > 1e-5


def test_a_plain_frame_released_by_its_motion_keeps_its_energy() -> None:
    # Under a constant acceleration, which acts like a tilted gravity, until it overturns.
    lean = Rocker(across=0.8, upwards=4.8, inertia=30.0, restitution=0.9)
    history = rock(lean, 0.1, np.full(60, 1.7), None, 1e-11)
    size, rate = np.abs(history.place), history.rate
    up = 9.81 * (0.8 * np.sin(size) - 4.8 * (1.0 - np.cos(size)))
    moved = -1.7 * (4.8 * np.sin(size) + 0.8 * (1.0 - np.cos(size)))
    energy = (15.0 * rate**2 + up + moved)[np.isfinite(size)]
    assert np.nanmax(size) > 1.0
    assert np.abs(energy).max() < 1e-9 * np.nanmax(15.0 * rate**2)


def history_of(kind: str, seed: int) -> tuple[Rocker, Response]:
    case = case_of(kind, seed)
    assert isinstance(case.ours, RockingFrame)
    assert isinstance(case.plain, Rocker)
    return case.plain, respond(case.ours, invariants.ground_of(case, held=True))


def test_a_broken_history_is_noticed() -> None:
    """Each invariant fails on a history that is right but for one fault."""
    plain, response = history_of("free", 3)
    ground = invariants.ground_of(case_of("free", 3), held=True)
    moved, faster = response.theta.copy(), response.omega.copy()
    moved[50] += 0.5 * response.peak_rotation
    faster[50] *= 1.01
    assert not invariants.jumps(plain, response, ground)
    assert invariants.jumps(plain, replace(response, theta=moved), ground)
    assert invariants.rise(plain, response, ground) < 1e-12
    assert invariants.rise(plain, replace(response, omega=faster), ground) > 1e-6
    backwards = replace(response, impact_times=response.impact_times[::-1])
    assert not invariants.impacts_follow(backwards)
    lower = replace(response, peak_rotation=0.9 * response.peak_rotation)
    assert invariants.verdict_fits(response, response)
    assert not invariants.verdict_fits(lower, lower)


def test_the_page_has_the_table_of_the_plain_integrator() -> None:
    results = independent.read().values()
    rows = independent.rows_of(results)
    assert [row[:2] for row in rows] == [[kind, str(independent.CASES)] for kind in KINDS]
    page = (DOCS / "validation.md").read_text(encoding="utf-8")
    assert table(independent.HEAD, rows) in page
    assert not any(one.broken for one in results)
    assert all(one.sensitive or one.verdict == one.plain_verdict for one in results)


def test_shares_of_round_columns_are_the_frequencies_in_a_contact_engine() -> None:
    """Every fourth motion of the page: the sum of shares is within two standard deviations, and
    motions that overturn none or all of 64 members do so in MuJoCo, too.
    """
    results = mujoco.read()
    tasks = round_columns.shaken("column, spin resisted", results)
    assert len(tasks) == 120
    assert sum(results[task].overturned for task in tasks) == 38
    fell = np.array([results[task].overturned for task in tasks[::4]])
    shares = np.array([round_columns.answer(t.column, t.motion, t.scale).share for t in tasks[::4]])
    assert abs(shares.sum() - fell.sum()) <= 2.0 * np.sqrt((shares * (1.0 - shares)).sum()) + 0.5
    assert not fell[shares == 0.0].any()
    assert fell[shares == 1.0].all()
    assert compare.brier(shares, fell) < 0.5 * compare.brier([fell.mean()] * fell.size, fell)


def test_two_unequal_columns_have_the_peaks_and_the_losses_of_opensees() -> None:
    """Its model knows neither the linkage nor the ratio of speeds at impacts."""
    results = {task: result for task, result in bents.read().items() if task.is_pulse}
    assert len(results) == 2 * 2 * len(bents.PULSES)
    page = (DOCS / "validation.md").read_text(encoding="utf-8")
    for row in bents.pulse_rows(results):
        assert "| " + " | ".join(row) + " |" in page
    for task, result in results.items():
        bent = bents.BENTS[task.bent]
        ours = respond_bent(bent, bents.motion_of(task, {}).ground)
        assert (ours.verdict, result.overturned, result.converged) == (Verdict.STANDS, 0, 1)
        assert result.peak_ratio == pytest.approx(ours.peak_rotation_ratio, rel=0.012)
        assert result.restitution == pytest.approx(np.prod(bent.restitutions) ** 0.5, abs=0.004)


def test_sure_outcomes_of_two_unequal_columns_are_those_of_opensees() -> None:
    """Every ninth motion: where none of 64 plausible bents overturns, OpenSees's stands, and where
    all do, it overturns, or is brought back from beyond the balance, as under two of 54 motions.
    """
    every, results = motions(), bents.read()
    tasks = [task for task in results if not task.is_pulse and task.step == bents.STEP]
    assert len(tasks) == len(every) == 54
    sure = 0
    for task in sorted(tasks, key=lambda task: task.motion)[::9]:
        ground = bents.motion_of(task, every).ground
        share = bent_ensemble(bents.BENTS[task.bent], ground).share_overturned
        if share in (0.0, 1.0):
            assert (results[task].peak_ratio > 1.0) == share
            assert results[task].overturned <= share
            sure += 1
    assert sure > 1


def test_the_pages_of_round_columns_state_what_the_commands_print() -> None:
    """Free wobbling and losses, of which no ensemble is needed."""
    results, page = mujoco.read(), (DOCS / "validation.md").read_text(encoding="utf-8")
    for row in round_columns.free(results):
        assert f"| {' | '.join(row)} |" in page
    losses = [(float(row[3]), float(row[5])) for row in round_columns.losses(results)]
    large = [ratio for lost, ratio in losses if lost > 0.04]
    small = [ratio for lost, ratio in losses if lost < 0.01]
    assert (len(large), min(large), max(large)) == (14, 0.75, 0.97)
    assert (len(small), round(min(small), 1), round(max(small), 1)) == (6, 1.1, 1.9)
