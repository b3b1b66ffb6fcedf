"""All outputs of a run show the same verdicts in the same words."""

from __future__ import annotations

import csv
import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commands import run
from tests.screening import sine

from rockframe import GroundAcceleration, open_records, open_response
from rockframe.cli import console
from rockframe.cli.stages.respond import response_columns
from rockframe.explorer.answer import Motion, answer, read_settings
from rockframe.explorer.server import render
from rockframe.figures.histories import draw_response_history
from rockframe.figures.margins import draw_margin_strips
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions
from rockframe.results.records import write_records
from rockframe.results.run import read_run
from rockframe.results.tables.rows import OVERVIEW, robust_scales, spread_verdict
from rockframe.results.tables.table import response_rows, table_rows
from rockframe.rocking import VERDICT_RULE, Margin, SpreadVerdict, Verdict, VerdictKind
from rockframe.stages.pulse import pulse_stage
from rockframe.stages.respond import respond_stage
from rockframe.study.structures import SHIPPED_STRUCTURES

RECORD = "Ridgecrest2019-CCC-360"
#: Verdict of each structure under the record; 0.91 of the record overturns the first structure.
EXPECTED = {
    "doric-5m": (
        VerdictKind.STANDS_LESS_OVERTURNS,
        "stands; 0.91 of the motion would overturn it",
    ),
    "bent": (VerdictKind.SAFE, "safe"),
    "slender-frame": (VerdictKind.UNDECIDED, "undecided, overturned 38.7 s"),
    "slender-column": (VerdictKind.OVERTURNED, "overturned 37.7 s"),
    "squat": (VerdictKind.NO_UPLIFT, "no uplift"),
}
STRUCTURES = (
    ("doric-5m", 5.0, 1.0, 0.0),
    ("bent", 9.6, 1.6, 4.0),
    ("slender-frame", 3.0, 0.4, 1.0),
    ("slender-column", 3.0, 0.4, 0.0),
    ("squat", 3.0, 2.0, 0.0),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("stated")
    structures = home / "structures.toml"
    structures.write_text(
        "".join(
            f'[[structure]]\nname = "{name}"\nheight_m = {h}\nwidth_m = {w}\nmass_ratio = {m}\n'
            for name, h, w, m in STRUCTURES
        )
    )
    record = Path(__file__).parents[2] / "records" / "ridgecrest2019" / "Ridgecrest2019-CCC.V1"
    words = ("--records", record, "--structures", structures, "--margins", "first")
    assert run("table1", *words, "--output", home / "run") == 0
    assert run("report", home / "run") == 0
    return home / "run"


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "table.csv").open(newline="") as stream:
        return [row for row in csv.DictReader(stream) if row["record_id"] == RECORD]


def test_the_table_has_the_stored_verdict_and_its_words(folder: Path) -> None:
    rows = {row["structure"]: row for row in rows_of(folder)}
    assert {name: row["verdict_words"] for name, row in rows.items()} == {
        name: words for name, (_, words) in EXPECTED.items()
    }
    assert rows["doric-5m"]["verdict"] == "safe"  # the stored code does not change
    assert 0.90 < float(rows["doric-5m"]["critical_scale"]) < 0.91


def test_the_terminal_prints_the_same_words(folder: Path) -> None:
    files = (folder / f"{name}.nc" for name in ("records", "pulses", "response"))
    verdict = response_columns({})[-1]
    rows = (row for row in table_rows(*files) if row["record_id"] == RECORD)
    assert {row["structure"]: verdict.cell(row) for row in rows} == {
        name: words for name, (_, words) in EXPECTED.items()
    }


def test_the_verdict_of_a_printed_row_is_stated_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The row states it: its columns use those words, and leave out the peaks of a fall."""
    made: list[Verdict] = []

    def counted(verdict: Verdict, **values: Any) -> SpreadVerdict:
        made.append(verdict)
        return SpreadVerdict(verdict, **values)

    monkeypatch.setattr("rockframe.results.tables.rows.SpreadVerdict", counted)
    rows = list(response_rows(folder / "response.nc"))
    console.show_rows("", response_columns({}), rows)
    assert len(made) == len(rows)


def test_the_legend_of_the_figure_has_the_same_words(folder: Path) -> None:
    with (
        open_records(folder / "records.nc") as records,
        open_response(folder / "response.nc") as response,
    ):
        histories = [response.sel(record=RECORD, structure=name) for name in EXPECTED]
        figure = draw_response_history(records.read(RECORD).acceleration, None, histories, "")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    for name, (_, words) in EXPECTED.items():
        assert any(f"{label};".startswith(f"{name}: {words};") for label in labels), labels


def test_the_report_has_the_same_words_and_a_colour_for_each_kind(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    badges = re.findall(r'<span class="badge ([a-z_]+)">([^<]*)</span>', page)
    for kind, words in EXPECTED.values():
        assert (kind, words) in [(k, html.unescape(w)) for k, w in badges]
        assert f'<option value="{kind}">{kind.label}</option>' in page
        assert f".badge.{kind}" in page
    facts = json.loads(re.findall(r'id="facts">(.*?)</script>', page)[0])
    pairs = [pair for pair in facts["pairs"] if facts["grounds"][pair["ground"]]["id"] == RECORD]
    assert {p["structure"]: (p["kind"], p["words"]) for p in pairs} == EXPECTED
    doric = next(pair for pair in pairs if pair["structure"] == "doric-5m")
    assert ["stability verdict", EXPECTED["doric-5m"][1]] in doric["facts"]


def test_the_report_counts_kinds(folder: Path) -> None:
    counts = read_run(folder).counts
    assert counts["doric-5m", VerdictKind.STANDS_LESS_OVERTURNS] == 1
    assert counts["doric-5m", VerdictKind.SAFE] == 1  # under the other component


def test_the_explorer_does_not_call_safe_what_it_did_not_look_for(folder: Path) -> None:
    with open_records(folder / "records.nc") as records:
        record = records.read(RECORD)
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    stated = {"section": "rectangular", "scale": "1", "vertical": "0", "pulse": "0"}
    stated |= {"from": "0", "to": "99"}
    for name, height, width, mass_ratio in STRUCTURES:
        values = {"height": height, "width": width, "mass_ratio": mass_ratio}
        asked = {key: str(value) for key, value in values.items()}
        settings = read_settings({"record": RECORD, "restitution_factor": "1", **stated, **asked})
        facts = answer({RECORD: Motion(record, ground)}, settings).facts()
        if name in ("doric-5m", "bent"):
            assert (facts["kind"], facts["words"]) == ("stands", "stands")
        elif name != "slender-frame":  # without margins it cannot be undecided
            assert (facts["kind"], facts["words"]) == EXPECTED[name]


def test_without_margins_a_structure_only_stands() -> None:
    row = {"verdict": "safe", "overturning_time_s": "", "critical_scale": "", "largest_scale": ""}
    assert spread_verdict(row).words == "stands"
    # Scales up to 10 were searched, and none overturns the structure.
    assert spread_verdict(row | {"largest_scale": "10.0"}).words == "safe"


@pytest.mark.parametrize(
    ("overturning_time", "words"),
    [(np.nan, "undecided, stands"), (36.8, "undecided, overturned 36.8 s")],
)
def test_an_undecided_verdict_has_its_direction(overturning_time: float, words: str) -> None:
    stated = SpreadVerdict(Verdict.UNDECIDED, overturning_time, critical_scale=0.7)
    assert (stated.kind, stated.words) == (VerdictKind.UNDECIDED, words)


def test_a_pulse_that_could_be_noise_is_marked(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best match of the record at Christmas Canyon could be noise: p is about a third."""
    from rockframe.cli.table1 import show

    rows = rows_of(folder)
    assert {row["pulse_verdict"] for row in rows} == {"noise"}
    p_value = float(rows[0]["pulse_p_value"])
    assert p_value > 0.05
    files = (folder / f"{name}.nc" for name in ("records", "pulses", "response"))
    show(list(table_rows(*files)), [], [])
    printed = capsys.readouterr().out
    assert "antisym†" in printed
    assert "† best match, could be noise" in printed
    words = f"best match, could be noise (p = {p_value:.2f})"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "antisym†" in page
    assert words in page
    assert run("show", folder, RECORD) == 0
    assert words in capsys.readouterr().out


def test_a_damaged_verdict_is_named(folder: Path, tmp_path: Path) -> None:
    from rockframe.errors import InputError

    copy = tmp_path / "run"
    copy.mkdir()
    for file in folder.iterdir():
        if file.is_file():
            (copy / file.name).write_bytes(file.read_bytes())
    table = copy / "table.csv"
    table.write_text(table.read_text().replace(",safe,", ",save,"))
    with pytest.raises(InputError, match=r"table\.csv: invalid verdict or margin 'SAVE'\."):
        read_run(copy)


@pytest.mark.parametrize("page", ["README.md", "docs/theory.md"])
def test_the_rule_is_stated_in_the_same_words_everywhere(page: str) -> None:
    stated = (Path(__file__).parents[2] / page).read_text(encoding="utf-8")
    assert VERDICT_RULE in " ".join(stated.split())
    assert VERDICT_RULE in " ".join(str(Margin.verdict.__doc__).split())


def test_the_pages_state_the_rule(folder: Path) -> None:
    report = (folder / "report.html").read_text(encoding="utf-8")
    explorer, _ = render([], [])
    for page in (report, explorer):
        assert VERDICT_RULE in html.unescape(page)


def test_the_report_has_a_strip_for_each_pair(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    rows = read_run(folder).rows
    assert page.count('<td class="strips"') == len(rows)
    assert "<title>overturns from 0.91</title>" in page  # doric-5m
    facts = json.loads(re.findall(r'id="facts">(.*?)</script>', page)[0])
    assert all(pair["strip"].startswith("<svg") for pair in facts["pairs"])


def test_the_figure_of_margins_has_a_strip_for_each_structure(folder: Path) -> None:
    with open_response(folder / "response.nc") as response:
        strips = response.strips(RECORD)
    assert list(strips) == [name for name, *_ in STRUCTURES]
    drawn = draw_margin_strips(strips, "")
    (axes,) = drawn.figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [*strips]
    falling = axes.collections[1::2]  # every other collection has the safe scales
    for strip, bars in zip(strips.values(), falling, strict=True):
        ends = [path.get_extents().intervalx for path in bars.get_paths()]
        np.testing.assert_allclose(ends, np.reshape(strip.overturning, (-1, 2)))
    assert (folder / "figures" / "margins" / f"{RECORD}.png").is_file()


def test_a_robust_margin_beyond_the_searched_scales_is_not_unknown() -> None:
    """As for the critical scale: beyond 10 if it was searched, and unknown if it was not."""
    row = {f"robust_scale_{share}": "" for share in (10, 25, 50)} | {"largest_scale": "10.0"}
    column = next(one for one in OVERVIEW if one.key == "robust_scale_10")
    assert (robust_scales(row), column.cell(row)) == ("–", "–")
    row["largest_robust_scale"] = "10.0"
    assert (robust_scales(row), column.cell(row)) == ("> 10", "> 10")
    assert robust_scales(row | {"robust_scale_10": "7.3"}) == "7.30 > 10 > 10"


def test_records_of_one_station_and_component_are_named_by_their_record_id(tmp_path: Path) -> None:
    """Two records of one name, such as the V1 and V2 file of a channel, were two equal rows."""
    same, files = {"station": "CCC", "component": "090"}, [tmp_path / f"{n}.nc" for n in "rps"]
    records = [sine("CCC.V1-090", 3.0, **same), sine("CCC.V2-090", 3.0, **same), sine("s", 4.0)]
    write_records(((r, None) for r in records), files[0], input_sha256={}, parameters={})
    pulse_stage(files[0], files[1], PulseOptions(wavelet=("symmetric_ricker",), surrogates=0))
    options = RespondOptions(structure="slender-frame", margins="none")
    respond_stage(files[0], files[2], options, structures_path=SHIPPED_STRUCTURES)
    assert [row["record"] for row in table_rows(*files)] == ["CCC.V1-090", "CCC.V2-090", "s"]
