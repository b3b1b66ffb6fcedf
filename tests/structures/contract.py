"""The rules of `rockframe.structures.contract`, as checks that any kind can be put through."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rockframe import PairAcceleration, ParameterError, Pulse, Record, RespondOptions, RockingFrame
from rockframe.options.respond import BridgeEnsemble
from rockframe.quantities import LIMITED, OF_SCENARIO
from rockframe.results.reading import opened
from rockframe.results.response import write_responses
from rockframe.results.schema.response import OF_KIND
from rockframe.rocking import DIMENSIONS, Verdict, as_ground, draws, quantiles
from rockframe.structures.contract import (
    PEAKS,
    NotComputed,
    Shaking,
    Structure,
    ensembles_of_each,
    kind_of,
    respond_each,
)
from rockframe.structures.screening import (
    ScreeningTask,
    has_quantity,
    member_peaks_of,
    peaks_of,
    quantities_of,
)
from rockframe.study.kinds import KINDS

#: A few members, to be quick; without versions of the motion.
FEW = BridgeEnsemble(members=16, corner=1.0)
ALL = RespondOptions(ensemble=FEW)
#: Verdicts, peaks and histories alone.
PLAIN = RespondOptions(margins="none", ensemble=BridgeEnsemble(members=0))
PULSE = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.2, time=3.0)
SHAKE = Record(
    record_id="shake", acceleration=PULSE.acceleration(0.02 * np.arange(400)), time_step=0.02
)
WEAK = replace(SHAKE, record_id="weak", acceleration=0.6 * SHAKE.acceleration)
#: A structure of another kind, with which lists are mixed.
OTHER = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="other")


def keeps_the_rules(structures: Sequence[Any], folder: Path) -> None:
    """Check the rules of the kind of these structures, which are several of one kind."""
    is_declared_once(structures)
    does_not_depend_on_the_others(structures)
    has_the_peaks_of_its_histories(structures)
    drops_histories_and_nothing_else(structures)
    has_ensembles_that_are_its_members(structures)
    has_margins_at_which_the_outcome_changes(structures)
    has_peaks_of_many_scenarios_that_are_those_of_histories(structures)
    has_peaks_of_members_that_are_those_of_histories(structures)
    is_resized_in_proportion(structures)
    has_sliders_that_make_it_again(structures)
    says_what_it_does_not_compute(structures)
    has_its_quantities_in_files_and_no_others(structures, folder)


def is_declared_once(structures: Sequence[Any]) -> None:
    """Rule 1."""
    for structure in structures:
        assert hash(structure) == hash(replace(structure))  # only dataclasses can be replaced
        assert structure.kind in KINDS
        assert kind_of(structure).name == structure.kind
    assert len({structure.name for structure in structures}) == len(structures)


def does_not_depend_on_the_others(structures: Sequence[Structure]) -> None:
    """Rule 2: the same bits alone and in a mixed list, in the order of the list."""
    mixed = [OTHER, *structures, replace(OTHER, name="another")]
    together = respond_each(mixed, Shaking(SHAKE, ALL))
    assert [one.structure for one in together] == mixed
    rows = ensembles_of_each(mixed, [WEAK, SHAKE], FEW, [None, None])
    for k, structure in enumerate(mixed):
        [alone] = respond_each([structure], Shaking(SHAKE, ALL))
        assert same(alone, together[k])
        for motion, row in zip((WEAK, SHAKE), rows, strict=True):
            [[ensemble]] = ensembles_of_each([structure], [motion], FEW, [None])
            assert same(ensemble, row[k])


def has_the_peaks_of_its_histories(structures: Sequence[Structure]) -> None:
    """Rule 6: a peak is at least the largest value at the nodes, and hardly more."""
    for response in respond_each(structures, Shaking(SHAKE, PLAIN)):
        found: Any = response
        if found.verdict is Verdict.OVERTURNS:
            continue
        largest = float(np.abs(found.u).max())
        assert largest * (1.0 - 1e-9) <= found.peak_u <= 1.02 * largest + 1e-9


def drops_histories_and_nothing_else(structures: Sequence[Structure]) -> None:
    """Rule 8."""
    none = Shaking(SHAKE, ALL.replaced(histories="none"))
    for kept, dropped in zip(
        respond_each(structures, Shaking(SHAKE, ALL)), respond_each(structures, none), strict=True
    ):
        assert kept.time.size == SHAKE.acceleration.size
        assert dropped.time.size == 0
        assert same(kept.verdict, dropped.verdict)
        assert same(kept.margin, dropped.margin)
        assert same(kept.spread_verdict, dropped.spread_verdict)


def has_ensembles_that_are_its_members(structures: Sequence[Structure]) -> None:
    """Rule 11: shares and bands of `ensembles` are those of the responses of `members`."""
    scales = draws(FEW)[:, 3].tolist()
    for structure in structures:
        kind = kind_of(structure)
        members = kind.members(structure, FEW)
        assert kind.members(structure, FEW.replaced(seed=1)) != members
        responses: list[Any] = [
            respond_each([member], Shaking(as_ground(SHAKE).scaled(scale), PLAIN))[0]
            for member, scale in zip(members, scales, strict=True)
        ]
        [[ensemble]] = ensembles_of_each([structure], [SHAKE], FEW, [None])
        assert ensemble is not None
        fallen = [one.verdict is Verdict.OVERTURNS for one in responses]
        assert (ensemble.members, ensemble.overturned) == (len(members), sum(fallen))
        peaks = np.where(fallen, math.inf, [one.peak_u for one in responses])
        np.testing.assert_allclose(ensemble.bands["peak_u"], quantiles(peaks), rtol=1e-9)
        assert ensemble.rank_correlations
        for name in ensemble.rank_correlations:
            assert hasattr(FEW, name)


def has_margins_at_which_the_outcome_changes(structures: Sequence[Structure]) -> None:
    """Rule 5: the critical scale separates the outcomes; without one, the largest scale stands."""
    for response in respond_each(structures, Shaking(SHAKE, ALL)):
        margin = response.margin
        assert margin is not None
        assert margin.robust is not None
        scale = margin.critical_scale
        lower = margin.largest_scale if math.isnan(scale) else 0.9999 * scale
        above = [] if math.isnan(scale) else [1.0001 * scale]
        outcomes = [
            respond_each([response.structure], Shaking(as_ground(SHAKE).scaled(one), PLAIN))[0]
            for one in (lower, *above)
        ]
        fell = [one.verdict is Verdict.OVERTURNS for one in outcomes]
        assert fell == [False, True][: len(fell)]


def has_peaks_of_many_scenarios_that_are_those_of_histories(structures: Sequence[Any]) -> None:
    """Rule 12: verdicts are equal, and so are the quantities, in any company."""
    mixed, scales = (OTHER, *structures), (0.5, 1.0, 2.0)
    peaks = peaks_of(ScreeningTask((WEAK, SHAKE), mixed, scales))
    found = quantities_of(mixed, *(peaks[name][1] for name in PEAKS))
    for k, structure in enumerate(mixed):
        alone = peaks_of(ScreeningTask((SHAKE,), (structure,), scales))
        assert all(same(alone[name][0, 0], peaks[name][1, k]) for name in PEAKS)
        for j, scale in enumerate(scales):
            response = kind_of(structure).history(structure, as_ground(SHAKE).scaled(scale))
            is_the_peak_of(response, {name: values[k, j] for name, values in found.items()})


def has_peaks_of_members_that_are_those_of_histories(structures: Sequence[Any]) -> None:
    """Rule 12, for the members of an ensemble."""
    every, factors = (OTHER, *structures), draws(FEW)[:, 3].tolist()
    peaks = member_peaks_of(ScreeningTask((SHAKE,), every, (1.5,), FEW))
    for k, structure in enumerate(every):
        family = kind_of(structure).members(structure, FEW)
        found = quantities_of(family, *(peaks[name][0, k].T for name in PEAKS))
        for m in (0, len(family) - 1):
            ground = as_ground(SHAKE).scaled(1.5 * factors[m])
            response = kind_of(structure).history(family[m], ground)
            is_the_peak_of(response, {name: values[m, 0] for name, values in found.items()})


def is_the_peak_of(response: Any, found: Mapping[str, Any]) -> None:
    """Check quantities of a scenario that a structure has against those of its history."""
    assert found["verdict"] == response.verdict
    if response.verdict is not Verdict.OVERTURNS:
        for name in (one.name for one in (*OF_SCENARIO, *LIMITED) if hasattr(response, one.name)):
            value = pytest.approx(getattr(response, name), rel=1e-6, abs=1e-12, nan_ok=True)
            assert found[name] == value, name
    for name in (one.name for one in LIMITED):
        if has_quantity(response.structure, name):
            assert np.isfinite(found[name]) or response.verdict is Verdict.OVERTURNS, name


def is_resized_in_proportion(structures: Sequence[Any]) -> None:
    """Rule 13: there and back gives the same structure, unless it has no such dimension."""
    for structure in structures:
        kind = kind_of(structure)
        for dimension in DIMENSIONS:
            if not hasattr(structure, dimension) or kind.quantities:
                with pytest.raises(ParameterError, match=f"no {dimension}"):
                    kind.resized(structure, dimension, 1.0)
                continue
            value = getattr(structure, dimension)
            larger: Any = kind.resized(structure, dimension, 1.25 * value + 0.5)
            assert getattr(larger, dimension) == 1.25 * value + 0.5
            back = kind.resized(larger, dimension, value)
            numbers = [
                (one, getattr(back, name))
                for name, one in vars(structure).items()
                if isinstance(one, float)
            ]
            assert all(one == pytest.approx(other, rel=1e-12) for one, other in numbers)
            assert (back.kind, back.name) == (structure.kind, structure.name)


def has_sliders_that_make_it_again(structures: Sequence[Any]) -> None:
    """Rule 15: numbers are those of the structure; kinds that do not rock have none."""
    for structure in structures:
        kind: Any = kind_of(structure)
        sliders = kind.sliders(structure)
        assert not sliders or KINDS[structure.kind].rocks
        if sliders:
            assert [*sliders] == [*kind.slider_names]
            again = kind.of_sliders(sliders)
            assert again.kind == structure.kind
            assert kind.sliders(again) == sliders


def says_what_it_does_not_compute(structures: Sequence[Structure]) -> None:
    """Rule 3."""
    both = PairAcceleration.from_pulses(PULSE, PULSE)
    for response in respond_each(structures, Shaking(both, ALL)):
        reason = kind_of(response.structure).why_not(response.structure, both)
        assert isinstance(response, NotComputed) == bool(reason)
        if isinstance(response, NotComputed):
            assert response.reason == reason


def has_its_quantities_in_files_and_no_others(
    structures: Sequence[Structure], folder: Path
) -> None:
    """Rules 6 and 7: what a kind names is in the file; what only others name is NaN or left out."""
    mixed, path = [*structures, OTHER], folder / "response.nc"
    responses = respond_each(mixed, Shaking(SHAKE, ALL.replaced(margins="none")))
    write_responses([("shake", responses)], mixed, path, input_sha256={}, parameters={})
    own = kind_of(structures[0]).quantities
    with opened(path, "response") as file:
        for name in (one.name for one in OF_KIND):
            assert (name in file) == (name in own)
            if name in own:
                assert np.isfinite(file[name].values[0, :-1]).any() or name.endswith("_time"), name
                assert np.isnan(file[name].values[0, -1]), name
        parameters = {one.name for of in structures for one in kind_of(of).parameters(of)}
        if structures[0].kind != OTHER.kind:
            assert file["kind"].values.tolist() == [one.kind for one in mixed]
            assert set(file["parameter"].values.tolist()) == parameters
            assert np.isnan(file["parameter_value"].values[-1]).all()


def same(one: Any, other: Any) -> bool:
    """Return True if two results have the same values, to the last bit, in all fields."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, name), getattr(other, name)) for name in vars(one)
        )
    if isinstance(one, np.ndarray):
        assert_array_equal(one, other)
        return True
    if isinstance(one, float) and math.isnan(one):
        return math.isnan(other)
    if hasattr(one, "items"):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)
