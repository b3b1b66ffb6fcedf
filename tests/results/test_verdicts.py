"""All outputs of a run show the same verdicts in the same words."""

from __future__ import annotations

import csv
import html
import json
import re
import shutil
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba_array
from tests.commands import run
from tests.screening import sine

from rockframe import GroundAcceleration, open_records, open_response
from rockframe.cli import console
from rockframe.explorer.answer import ExploredMotion, answer, margin, read_settings
from rockframe.explorer.server import render
from rockframe.figures.histories import draw_response_history
from rockframe.figures.margins import draw_margin_strips
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.results.records import write_records
from rockframe.results.run import rank, read_run
from rockframe.results.tables.rows import OVERVIEW, response_columns, spread_verdict
from rockframe.results.tables.table import response_rows, table_rows
from rockframe.results.versions import VersionSources
from rockframe.rocking import VERDICT_RULE, SpreadVerdict, Verdict
from rockframe.stages.pulse import pulse_stage
from rockframe.stages.respond import respond_stage
from rockframe.study.structures import SHIPPED_STRUCTURES
from rockframe.web import tone

RECORD = "Ridgecrest2019-CCC-360"
#: Verdict of each structure under the record.
EXPECTED = {
    "doric-5m": "may overturn (20 %); 10 % overturn at 0.87",
    "bent": "stands; 10 % overturn at 1.22",
    "slender-frame": "overturns; 10 % overturn at 0.51",
    "slender-column": "overturns; 10 % overturn at 0.46",
    "squat": "no uplift; 10 % overturn at 4.63",
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
    whole = Path(__file__).parents[2] / "records" / "ridgecrest2019" / "Ridgecrest2019-CCC.V1"
    channels = whole.read_bytes().split(b"Uncorrected Accelerogram Data")
    record = home / f"{RECORD}.V1"  # only its channel at 360 degrees
    alone = channels[2].replace(b"(3 Chns of  3 at Sta)", b"(1 Chns of  3 at Sta)")
    record.write_bytes(b"Uncorrected Accelerogram Data" + alone)
    words = ("--records", record, "--structures", structures)
    assert run("table1", *words, "--output", home / "run") == 0
    assert run("report", home / "run") == 0
    return home / "run"


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "table.csv").open(newline="") as stream:
        return [row for row in csv.DictReader(stream) if row["record_id"] == RECORD]


def test_the_table_has_the_verdict_and_the_nominal_one(folder: Path) -> None:
    rows = {row["structure"]: row for row in rows_of(folder)}
    assert {name: spread_verdict(row).sentence for name, row in rows.items()} == EXPECTED
    for row in rows.values():
        assert row["verdict_words"] == spread_verdict(row).words
        assert (row["verdict"] == "overturns") == (row["overturning_time_s"] != "")


def test_the_terminal_prints_the_same_words(folder: Path) -> None:
    files = (folder / f"{name}.nc" for name in ("records", "pulses", "response"))
    rows = [row for row in table_rows(*files) if row["record_id"] == RECORD]
    columns = {column.key: column for column in response_columns(rows[0], {})}
    for row in rows:
        expected, _, margin = EXPECTED[row["structure"]].partition("; 10 % overturn at ")
        assert columns["verdict"].cell(row) == expected
        assert columns["robust_scale_10"].cell(row) == margin


def test_the_columns_of_a_printed_row_make_no_verdict(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The row states it in words, which its columns print; they leave out the peaks of a fall."""
    made: list[Verdict] = []

    def counted(verdict: Verdict, **values: Any) -> SpreadVerdict:
        made.append(verdict)
        return SpreadVerdict(verdict, **values)

    rows = list(response_rows(folder / "response.nc"))
    monkeypatch.setattr("rockframe.results.tables.rows.SpreadVerdict", counted)
    console.show_rows("", response_columns(rows[0], {}), rows)
    assert rows
    assert made == []


def test_the_legend_of_the_figure_has_the_same_words(folder: Path) -> None:
    with (
        open_records(folder / "records.nc") as records,
        open_response(folder / "response.nc") as response,
    ):
        histories = [response.sel(record=RECORD, structure=name) for name in EXPECTED]
        figure = draw_response_history(records.read(RECORD).acceleration, None, histories, "")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[: len(EXPECTED)] == [f"{name}: {words}" for name, words in EXPECTED.items()]
    assert labels[-1].startswith("lines: nominal; shaded: 16 to 84 % of the ensemble")


def test_the_report_has_the_same_words_and_the_colour_of_the_verdict(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    rows = {row["structure"]: spread_verdict(row) for row in rows_of(folder)}
    badges = re.findall(r'<span class="badge (tone-[0-9]+)">([^<]*)</span>', page)
    for verdict in rows.values():
        assert (tone(verdict), verdict.words) in [(k, html.unescape(w)) for k, w in badges]
        assert f'<option value="{verdict.kind}">{verdict.kind.label}</option>' in page
        assert f".{tone(verdict)} " in page
    facts = json.loads(re.findall(r'id="facts">(.*?)</script>', page)[0])
    pairs = [pair for pair in facts["pairs"] if facts["grounds"][pair["ground"]]["id"] == RECORD]
    assert {pair["structure"]: pair["words"] for pair in pairs} == EXPECTED
    assert {pair["structure"]: pair["tone"] for pair in pairs} == {
        name: tone(verdict) for name, verdict in rows.items()
    }


def test_the_report_counts_kinds(folder: Path) -> None:
    run_ = read_run(folder)
    for (structure, kind), count in run_.counts.items():
        rows = [row for row in run_.rows if row["structure"] == structure]
        assert count == sum(spread_verdict(row).kind == kind for row in rows)
    assert sum(run_.counts.values()) == len(run_.rows)


def test_the_explorer_calls_a_verdict_without_an_ensemble_nominal(folder: Path) -> None:
    with open_records(folder / "records.nc") as records:
        record = records.read(RECORD)
        made_of = VersionSources.of(records, Ensemble(), [RECORD]).uncertain(record)
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    stated = {"section": "rectangular", "scale": "1", "vertical": "0", "pulse": "0"}
    stated |= {"from": "0", "to": "99"}
    for name, height, width, mass_ratio in STRUCTURES[::2]:  # may overturn, overturns, no uplift
        values = {"height": height, "width": width, "mass_ratio": mass_ratio}
        asked = {key: str(value) for key, value in values.items()}
        settings = read_settings({"record": RECORD, "restitution_factor": "1", **stated, **asked})
        motions = {RECORD: ExploredMotion(record, ground, uncertain=made_of)}
        assert answer(motions, settings).facts()["words"].startswith("nominally ")
        assert margin(motions, settings)["words"] == EXPECTED[name]


def test_a_pulse_that_could_be_noise_is_marked(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best match of the record at Christmas Canyon could be noise: p is about a third."""
    from rockframe.cli.shipped import show

    rows = rows_of(folder)
    assert {row["pulse_verdict"] for row in rows} == {"noise"}
    p_value = float(rows[0]["pulse_p_value"])
    assert p_value > 0.05
    files = (folder / f"{name}.nc" for name in ("records", "pulses", "response"))
    show(list(table_rows(*files)), [], [], [])
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
    table.write_text(table.read_text().replace(",stands,", ",standing,"))
    with pytest.raises(InputError, match=r"table\.csv: invalid verdict or margin 'STANDING'\."):
        read_run(copy)


@pytest.mark.parametrize("most", [1, 4])
@pytest.mark.parametrize("lines", [1, 2])
def test_a_report_of_few_rows_has_those_of_most_interest(
    folder: Path, tmp_path: Path, most: int, lines: int
) -> None:
    """They are chosen by response.nc and read from table.csv, also if a text has several lines."""
    whole = read_run(folder)
    some = Path(shutil.copytree(folder, tmp_path / "run"))
    if lines == 2:
        with (some / "table.csv").open(newline="") as stream:
            rows = list(csv.reader(stream))
        rows[1][rows[0].index("event")] = "one\ntwo"
        with (some / "table.csv").open("w", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows(rows)
    first = sorted(whole.rows, key=rank)[:most]
    run_ = read_run(some, most=most)
    assert [row["structure"] for row in run_.rows] == [
        row["structure"] for row in whole.rows if row in first
    ]
    assert {row["record_id"] for row in run_.rows} == {row["record_id"] for row in first}
    assert run_.counts == whole.counts
    assert len(run_.rows) == most < len(whole.rows)


def test_rows_whose_motions_do_not_fit_in_memory_are_the_last_ones(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read_run(folder)
    structures = len({row["structure"] for row in whole.rows})
    monkeypatch.setattr("rockframe.results.run._MOST_PAIRS", structures)  # one motion
    rows = read_run(folder, most=len(whole.rows) - 1).rows
    ranked = sorted(whole.rows, key=rank)[:-1]
    first = list(takewhile(lambda row: row["record_id"] == ranked[0]["record_id"], ranked))
    assert 0 < len(rows) == len(first)
    assert all(row in first for row in rows)


@pytest.mark.parametrize("page", ["README.md", "docs/theory.md"])
def test_the_rule_is_stated_in_the_same_words_everywhere(page: str) -> None:
    stated = (Path(__file__).parents[2] / page).read_text(encoding="utf-8")
    assert VERDICT_RULE in " ".join(stated.split())


def test_the_pages_state_the_rule(folder: Path) -> None:
    report = (folder / "report.html").read_text(encoding="utf-8")
    explorer, _ = render([], [])
    for page in (report, explorer):
        assert VERDICT_RULE in html.unescape(page)


def test_the_report_has_a_strip_for_each_pair(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    rows = read_run(folder).rows
    assert page.count('<td class="strips"') == len(rows)
    titles = re.findall("<title>(10, 25, 50 % overturn at [^<]*)</title>", page)
    assert len(titles) == len(rows)
    facts = json.loads(re.findall(r'id="facts">(.*?)</script>', page)[0])
    assert all(pair["strip"].startswith("<svg") for pair in facts["pairs"])


def test_the_figure_of_margins_has_a_strip_for_each_structure(folder: Path) -> None:
    with open_response(folder / "response.nc") as response:
        strips = response.strips(RECORD)
    assert list(strips) == [name for name, *_ in STRUCTURES]
    drawn = draw_margin_strips(strips, "")
    (axes,) = drawn.figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [*strips]
    nominal = [
        one for one in axes.collections if np.sum(to_rgba_array(one.get_facecolor())[0, :3]) == 0.0
    ]
    overturned = [strip for strip in strips.values() if strip.overturning]
    for strip, bars in zip(overturned, nominal, strict=True):
        ends = [path.get_extents().intervalx for path in bars.get_paths()]
        np.testing.assert_allclose(ends, strip.overturning)
    assert (folder / "figures" / "margins" / f"{RECORD}.png").is_file()


def test_a_robust_margin_beyond_the_searched_scales_is_not_unknown() -> None:
    """As for the critical scale: beyond 10 if it was searched, and unknown if it was not."""
    row = {f"robust_scale_{share}": "" for share in (10, 25, 50)} | {"largest_scale": "10.0"}
    column = next(one for one in OVERVIEW if one.key == "robust_scale_10")
    assert column.cell(row) == "–"
    row["largest_robust_scale"] = "10.0"
    assert column.cell(row) == "> 10"
    assert column.cell(row | {"robust_scale_10": "7.3"}) == "7.30"


def test_records_of_one_station_and_component_are_named_by_their_record_id(tmp_path: Path) -> None:
    """Two records of one name, such as the V1 and V2 file of a channel, were two equal rows."""
    same, files = {"station": "CCC", "component": "090"}, [tmp_path / f"{n}.nc" for n in "rps"]
    records = [sine("CCC.V1-090", 3.0, **same), sine("CCC.V2-090", 3.0, **same), sine("s", 4.0)]
    write_records(((r, None) for r in records), files[0], input_sha256={}, parameters={})
    pulse_stage(files[0], files[1], PulseOptions(wavelet=("symmetric_ricker",), surrogates=0))
    options = RespondOptions(structure="slender-frame", margins="none")
    respond_stage(files[0], files[2], options, structures_path=SHIPPED_STRUCTURES)
    assert [row["record"] for row in table_rows(*files)] == ["CCC.V1-090", "CCC.V2-090", "s"]
