"""A summary says what its medians hide, and a wrong unit is said beside the verdict."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.screening import sine, stored

from rockframe.cli.main import main
from rockframe.results.tables.notes import summary_notes
from rockframe.results.tables.rows import verdict_words
from rockframe.results.tables.summary import summary_rows
from rockframe.rocking import SpreadVerdict, Verdict


def test_drifts_of_records_without_uplift_do_not_hide_the_others() -> None:
    """Four weak motions make the median 0; the other two have drifts of 3 and 5 cm."""
    rows = [
        {"structure": "bent", "record_id": f"r{k}", "verdict": verdict, "peak_u_m": drift}
        for k, (verdict, drift) in enumerate(
            [("no_uplift", 0.0)] * 4 + [("stands", 0.03), ("stands", 0.05)]
        )
    ]
    (row,) = summary_rows(rows)
    assert (row["peak_u_50_m"], row["uplifted"]) == (0.0, 2)
    assert 0.03 <= row["uplifted_peak_u_50_m"] <= 0.05
    (note,) = summary_notes([row])
    assert note.startswith("bent uplifts under 2 of 6 records, with a median drift of ")
    assert summary_notes(summary_rows(rows[4:])) == []


def test_models_that_end_are_said_beside_a_structure_that_stands() -> None:
    rows = [
        {
            "structure": "bent",
            "record_id": name,
            "verdict": "stands",
            "share_overturned": 0.0,
            "share_uplifted": 1.0,
            "share_model_ends": share,
            "model_end": "gap_closes",
        }
        for name, share in (("a", 0.98), ("b", 0.0))
    ]
    (row,) = summary_rows(rows)
    assert (row["model_ends"], row["largest_share_model_ends"]) == (1, 0.98)
    assert "bent: the model ends under 1 of 2 records, for up to 98 %." in summary_notes([row])[0]
    nominal = SpreadVerdict(Verdict.STANDS, model_ends={"gap_closed_time": 5.8})
    assert nominal.share_ends == 1.0


@pytest.mark.parametrize(
    ("pga", "words"),
    [
        (3.4, "stands; PGA 3.4 g: check the units"),  # m/s2 read as g
        (0.0003, "stands; PGA 0.0003 g: check the units"),  # g read as gal
        (0.3, "stands"),
        (2.0, "stands"),
        (0.0021, "stands"),
        (float("nan"), "stands"),
    ],
)
def test_an_implausible_peak_is_beside_the_verdict(pga: float, words: str) -> None:
    assert verdict_words({"verdict": "stands", "pga_g": pga}) == words


@pytest.mark.parametrize("units", ["gal", "g"])
def test_a_wrong_unit_is_said_where_the_verdict_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], units: str
) -> None:
    """A record in g that is read as gal, and one in m/s2 that is read as g."""
    samples = (0.3 if units == "gal" else 3.4) * np.sin(np.linspace(0.0, 40.0, 2000))
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in" / "motion.csv", samples * np.hanning(2000), fmt="%.6f")
    words = ("--units", units, "--time-step-s", "0.01", "--surrogates", "0", "--margins", "none")
    folder = ("--records", str(tmp_path / "in"), "--output", str(tmp_path / "run"))
    few = ("--ensemble-members", "16", "--structure", "bridge-bent", "--histories", "none")
    assert main(["table1", *folder, *words, *few]) == 0
    said = "0.00031 g: check the units" if units == "gal" else "3.4 g: check the units"
    assert f"PGA {said}" in " ".join(capsys.readouterr().out.split())
    assert main(["report", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "report.html").read_text()
    assert page.count(f"PGA {said}") >= 3  # above the verdicts, in the grid and in the table


def test_nominal_outcomes_of_a_screening_with_members_are_called_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rockframe.cli.show import _show_screening
    from rockframe.results.screen import screening_of

    records = stored([sine("a", 4.0), sine("b", 5.0)], tmp_path)
    words = ("--structure", "slender-column", "--scales", "1:2:2", "--scenario-members", "16")
    output = ("--output", str(tmp_path / "screen.nc"), "--margins", "none", "--json")
    assert main(["screen", str(records), *words, *output]) == 0
    assert json.loads(capsys.readouterr().out)["members"] == 16
    rows = screening_of(tmp_path / "screen.nc", "a")
    _show_screening(rows)
    printed = " ".join(capsys.readouterr().out.split())
    assert "nominal outcome at multiples" in printed
    assert "overturn at multiples of the record" in printed
    share = rows[0]["shares_overturned"]["1"]
    assert f"{100.0 * share:.0f} % at 1" in printed
