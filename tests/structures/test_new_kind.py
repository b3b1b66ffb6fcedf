"""A kind that the package does not have passes through all stages: two files, and one declaration.

The files are ``sliding.py`` (structure, equation, table) and ``sliding_kind.py`` (the contract).
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from tests.runs.small import FEW, make_study, run
from tests.structures.contract import SHAKE, keeps_the_rules
from tests.structures.sliding import SlidingDeck

from rockframe import (
    IngestOptions,
    RespondOptions,
    ScreenOptions,
    assess,
    ingest_stage,
    read_screening,
    read_structures,
    respond_stage,
    screen_stage,
)
from rockframe.errors import InputError
from rockframe.figures.fragility import draw_fragility
from rockframe.options.respond import Ensemble
from rockframe.report.page import screening_content
from rockframe.results.reading import opened
from rockframe.results.screen_tables import screen_summary
from rockframe.results.tables.rows import verdict_words
from rockframe.results.tables.sentences import answer
from rockframe.results.tables.summary import summary_rows
from rockframe.results.tables.table import response_rows
from rockframe.structures.contract import kind_named
from rockframe.study.kinds import KINDS, DeclaredKind
from rockframe.study.study import schema

TEXT = """
[[structure]]
name = "sliding-deck"
kind = "sliding"
friction = 0.1

[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
"""


@pytest.fixture(autouse=True)
def _declared(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Declare the kind: the only change outside its two files."""
    declared = DeclaredKind(
        contract="tests.structures.sliding_kind:SLIDING",
        table="tests.structures.sliding:SlidingTable",
        fails="fall",
    )
    monkeypatch.setitem(KINDS, "sliding", declared)
    yield
    kind_named.cache_clear()


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Return records.nc and the file of structures."""
    samples = tmp_path / "shake.csv"
    np.savetxt(samples, SHAKE.acceleration)
    options = IngestOptions(time_step_s=0.02, units="m/s2")
    ingest_stage([samples], tmp_path / "records.nc", options, workers=0)
    (tmp_path / "structures.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "records.nc", tmp_path / "structures.toml"


def test_it_keeps_the_rules(tmp_path: Path) -> None:
    decks = [SlidingDeck(0.1, "smooth"), SlidingDeck(0.2, "rough")]
    keeps_the_rules(decks, tmp_path)


def test_files_of_structures_and_the_schema_of_studies_have_it(tmp_path: Path) -> None:
    path = tmp_path / "structures.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert read_structures(path)[0] == SlidingDeck(0.1, "sliding-deck")
    path.write_text(TEXT.replace("friction = 0.1", "friction = -0.1"), encoding="utf-8")
    with pytest.raises(InputError, match=r"friction -0\.1. Must be positive and finite"):
        read_structures(path)
    path.write_text(TEXT.replace('"sliding"', '"slding"'), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"slding'\. Must be rocking, unequal, isolated, fixed, sliding"
    ):
        read_structures(path)


def test_responses_tables_and_summaries_have_it(files: tuple[Path, Path], tmp_path: Path) -> None:
    records, structures = files
    options = RespondOptions(ensemble=Ensemble(members=16))
    output = tmp_path / "response.nc"
    assert not respond_stage(records, output, options, structures_path=structures)
    [deck, bent] = response_rows(output)
    assert deck["kind"] == "sliding"
    assert deck["peak_u_m"] > deck["residual_u_m"] > 0.0
    assert math.isnan(deck["peak_rotation_ratio"])
    assert math.isnan(bent["residual_u_m"])
    assert deck["share_overturned"] == 0.0
    assert verdict_words(deck) == "stands"
    assert answer(deck, 16) == "stands; none of 16 plausible structures falls; " + (
        "fewer than 10 % fall at up to 10 times the motion"
    )
    with opened(output, "response") as response:
        assert response["parameter_value"].values[0].tolist() == [0.1]
    [of_deck, _] = summary_rows([deck, bent])
    assert of_deck["peak_u_50_m"] == deck["peak_u_50_m"]


def test_screenings_and_fragilities_have_it(files: tuple[Path, Path], tmp_path: Path) -> None:
    records, structures = files
    output = tmp_path / "screen.nc"
    options = ScreenOptions(
        scales=[0.5, 1.0, 2.0], limit_peak_u_m=(0.02,), margins="first", histories="all"
    )
    screen_stage(records, output, options, structures_path=structures)
    screening = read_screening(output)
    deck = screening["peak_u"].sel(structure="sliding-deck").values.ravel()
    assert (np.diff(deck) > 0.0).all()
    assert np.isnan(screening["peak_rotation_ratio"].sel(structure="sliding-deck")).all()
    with (tmp_path / "fragility.csv").open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["structure"] == "sliding-deck"]
    assert {row["limit_state"] for row in rows} == {"overturning", "peak_u_0.02m"}
    words = {row["structure"]: row["fragility"][0]["words"] for row in screen_summary(screening)}
    assert words == {"sliding-deck": "fall", "bent": "overturning"}
    caption = draw_fragility(screening.sel(structure="sliding-deck")).caption
    assert "overturn" not in caption
    assert screening_content(screening)["ends"] == "fall or overturning"


def test_only_kinds_that_lack_a_property_may_leave_it_out(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    """A frame without a slenderness is a damaged file; a deck that slides has none."""
    records, structures = files
    output = tmp_path / "response.nc"
    respond_stage(records, output, RespondOptions(margins="none"), structures_path=structures)
    with netCDF4.Dataset(output, "a") as file:
        file.set_auto_mask(False)
        names = [str(name) for name in file["structure"][:]]
        assert np.isnan(file["slenderness"][names.index("sliding-deck")])
        file["slenderness"][names.index("bent")] = np.nan
    with pytest.raises(InputError, match=r"slenderness nan of structure 'bent'\. Must be finite"):
        list(response_rows(output))


def test_an_assessment_has_it() -> None:
    found = assess(SlidingDeck(0.1, "deck"), SHAKE, RespondOptions(ensemble=Ensemble(members=16)))
    assert "stands (0 of 16" in repr(found)
    peaks = found.to_xarray()["peak_u"].sel(record="shake", structure="deck")
    assert peaks.item() == found.sel().peak_u


def test_the_schema_has_its_keys() -> None:
    assert '"sliding"' in schema()


def test_a_run_draws_and_reports_it(tmp_path: Path) -> None:
    """The run is in this process, because the kind is declared here only."""
    words = FEW[: FEW.index("[[structure]]")].replace("most = 0", "most = 1") + TEXT
    study = make_study(tmp_path, 1, words)
    assert run(study, tmp_path / "run") == 0
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    (others,) = re.findall(r'id="others-title".*?</table>', page, re.DOTALL)
    assert "sliding-deck" in others
    assert "coefficient of friction: 0.1" in others
    assert "bent" not in others
    assert list((tmp_path / "run" / "figures").glob("*.png"))
