"""A response that a kind does not compute is neither safe nor unsafe, in files and in tables."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from rockframe import PairAcceleration, Pulse, Record, RespondOptions, RockingFrame
from rockframe.results.reading import opened
from rockframe.results.response import open_response, write_responses
from rockframe.results.tables.notes import summary_notes
from rockframe.results.tables.outcomes import severity
from rockframe.results.tables.rows import critical_scale, spread_verdict, verdict_words
from rockframe.results.tables.summary import matrix_rows, summary_rows
from rockframe.results.tables.table import response_rows
from rockframe.rocking import Verdict, VerdictKind
from rockframe.stages.respond import ResponseTask, answer_task
from rockframe.structures.contract import NotComputed, StructureResponse
from rockframe.web import tone

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
PULSE = Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.5, time=3.0)
SHAKE = Record(
    record_id="plane", acceleration=PULSE.acceleration(0.02 * np.arange(400)), time_step=0.02
)


def answers() -> list[tuple[str, list[StructureResponse]]]:
    """Return the responses to a record in one plane, and to both directions of a motion."""
    both = PairAcceleration.from_pulses(PULSE, PULSE)
    task = ResponseTask(
        motions={"plane": SHAKE, "both": both},
        uncertain={},
        parts={},
        pulses={},
        structures=(BENT,),
        options=RespondOptions(),
    )
    return [(name, responses or []) for name, responses, _ in answer_task(task)]


def written(folder: Path) -> Path:
    path = folder / "response.nc"
    stated = {"margins": "robust", "ensemble": {"members": 64}}
    write_responses(answers(), [BENT], path, input_sha256={}, parameters=stated)
    return path


def test_a_motion_that_the_kind_does_not_compute_has_a_reason_and_no_number() -> None:
    (_, [plane]), (_, [both]) = answers()
    assert plane.verdict is Verdict.STANDS
    assert isinstance(both, NotComputed)
    assert both.reason
    assert both.ensemble is None
    assert both.margin is None
    assert both.spread_verdict.kind is VerdictKind.NOT_COMPUTED
    assert both.spread_verdict.sentence == "not computed"
    assert math.isnan(both.spread_verdict.danger)
    assert tone(both.spread_verdict) != tone(plane.spread_verdict)


def test_the_file_has_the_reason_and_nan_beside_a_computed_response(tmp_path: Path) -> None:
    path = written(tmp_path)
    with opened(path, "response") as response:
        assert response["verdict"].values.tolist() == [[Verdict.STANDS], [Verdict.NOT_COMPUTED]]
        assert response["not_computed"].values.tolist() == [
            [""],
            ["not computed for both directions: columns not circular"],
        ]
        numbers = [
            name
            for name, one in response.items()
            if one.dims[:2] == ("record", "structure") and one.dtype.kind == "f"
        ]
        assert "share_overturned" in numbers
        assert "critical_scale" in numbers
        for name in numbers:
            assert np.isnan(response[name].values[1]).all(), name
        assert math.isfinite(response["peak_u"].values[0, 0])
    with open_response(path) as file:
        assert file.strips("plane")
        assert not file.strips("both")  # a strip would show scales at which it stands


def test_tables_say_not_computed_and_show_no_lower_bound_of_a_margin(tmp_path: Path) -> None:
    plane, both = response_rows(written(tmp_path))
    assert verdict_words(both) == "not computed"
    assert spread_verdict(both).margin == ""
    assert math.isnan(float(critical_scale(both)))
    assert math.isnan(float(critical_scale(both, "robust_scale_10")))
    assert critical_scale(plane) != critical_scale(both)
    [first, second] = matrix_rows([plane, both], "share_overturned")
    assert math.isfinite(first["bent share_overturned"])
    assert math.isnan(second["bent share_overturned"])
    assert max([plane, both], key=severity) is both


def test_summaries_count_only_what_was_computed_and_say_so(tmp_path: Path) -> None:
    plane, both = response_rows(written(tmp_path))
    [alone], [together] = summary_rows([plane]), summary_rows([plane, both])
    assert together.pop("not_computed") == 1
    assert together == alone
    [nothing] = summary_rows([both])
    assert nothing["records"] == 0
    assert math.isnan(nothing["share_overturned"])
    assert any("not computed under 1 of 1 records" in note for note in summary_notes([nothing]))
