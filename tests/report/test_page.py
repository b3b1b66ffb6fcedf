"""The report as a file: its contents, escaped names, reproducible bytes."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import zlib
from dataclasses import replace
from html import escape, unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from markupsafe import Markup
from numpy.typing import NDArray

import rockframe
from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.provenance import is_whole_page, read_manifest, sealed_page, sha256_of
from rockframe.provenance import sealed as sealed_json
from rockframe.report.page import choose, encode, render
from rockframe.report.results import ResultTable, shown
from rockframe.results.run import read_histories, read_run
from rockframe.results.tables.entries import rows_of
from rockframe.results.tables.rows import that_count
from rockframe.rocking import SpreadVerdict, Verdict
from rockframe.stages.report import report_stage

from .conftest import EVENT, FILE, REJECTED, STATION

VENDORED = Path(rockframe.__file__).parent / "web" / "vendor"


def unpack(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))


def decode(text: str) -> NDArray[np.float32]:
    """Decode samples as the script of the page does."""
    return np.frombuffer(unpack(text), dtype="<f4")


class Parsed(HTMLParser):
    """The tags, attributes and texts of a page, as a browser reads them."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self.words: list[str] = []
        self._inside = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if tag in {"script", "style"}:
            self._inside = attributes.get("id") or tag
            self.texts[self._inside] = ""

    def handle_endtag(self, tag: str) -> None:
        if tag in {"script", "style"}:
            self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.texts[self._inside] += data
        else:
            self.words.append(data.strip())


def report(run: Path, *words: str) -> str:
    output = run.parent / "page.html"
    assert main(["report", str(run), "--output", str(output), *words]) == 0
    return output.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(hostile_run: Path) -> str:
    """The report of the hostile run, with default options."""
    return report(hostile_run)


@given(arrays("<f4", st.integers(0, 40), elements=st.floats(width=32)))
def test_samples_survive_to_the_last_bit(values: NDArray[np.float32]) -> None:
    np.testing.assert_array_equal(decode(encode(values)), values)


def test_samples_are_those_of_the_files(hostile_run: Path, page: str) -> None:
    texts = Parsed(page).texts
    pairs = json.loads(texts["facts"])["pairs"]
    assert [pair["structure"] for pair in pairs] == ["bent", "thin", "squat"]
    (record,) = rockframe.read_records(hostile_run / "records.nc")
    np.testing.assert_array_equal(decode(texts["data-g0"]), record.acceleration.astype("f4"))
    with rockframe.open_response(hostile_run / "response.nc") as response:
        for i, pair in enumerate(pairs):
            history = response.sel(record=record.record_id, structure=pair["structure"])
            for name in ("theta", "u", "v"):
                expected = history[name].values.astype("f4")
                np.testing.assert_array_equal(decode(texts[f"data-{name}{i}"]), expected)


def test_of_a_fall_no_rotation_is_told_and_checks_have_units(page: str) -> None:
    facts = json.loads(Parsed(page).texts["facts"])
    told = {pair["structure"]: dict(pair["facts"]) for pair in facts["pairs"]}
    assert [name for name, of in told.items() if "nominal: largest v" in of] == ["bent", "squat"]
    assert facts["grounds"][0]["checks"][0][2].replace("\N{NO-BREAK SPACE}", " ") == "≤ 19.62 m s⁻²"


def test_responses_that_are_not_computed_do_not_make_a_page_nominal(bundled_run: Path) -> None:
    """Rectangular columns have no response in both directions, beside an ensemble of all others."""
    rows = list(rows_of(bundled_run / "table.csv"))
    assert {row["verdict"] for row in rows if not row["share_overturned"]} == {"not_computed"}
    page = (bundled_run / "report.html").read_text(encoding="utf-8")
    assert "there is no ensemble" not in page
    assert " nominally</dt>" not in page


def test_labels_say_which_values_are_nominal_and_which_of_the_ensemble(page: str) -> None:
    """All but the shares and the robust margins are of the structure as given."""
    facts = json.loads(Parsed(page).texts["facts"])
    for pair in facts["pairs"]:
        plain = [label for label, _ in pair["facts"] if not label.startswith("nominal")]
        assert len(plain) > 5
        assert all("ensemble" in label or "share" in label or "%" in label for label in plain)
        assert "nominal: number of impacts" in dict(pair["facts"])


def test_the_pulse_is_that_of_the_pulse_file(page: str) -> None:
    texts = Parsed(page).texts
    (ground,) = json.loads(texts["facts"])["grounds"]
    pulse = decode(texts["data-p0"])
    time = ground["step"] * (ground["pulseStart"] + np.arange(pulse.size))
    exact = rockframe.Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.0, time=3.0)
    np.testing.assert_allclose(pulse, exact.acceleration(time), atol=1e-3)


def test_of_many_results_those_to_look_at_first_are_listed_and_all_are_counted(
    hostile_run: Path,
) -> None:
    html = report(hostile_run, "--rows", "1")
    page = Parsed(html)
    assert "These are 1 of 3 results" in html
    assert "1 record on 3 structures" in html
    assert [a["data-verdict"] for _, a in page.tags if "data-verdict" in a] == ["stands"]
    counts = html.split("Verdicts on each structure")[1].split("</table>")[0]
    cells = [re.sub(r"<.*?>", " ", row).split() for row in counts.split("<tr>")[2:]]
    assert cells == [["bent", "0", "1", "0"], ["thin", "0", "0", "1"], ["squat", "1", "0", "0"]]
    table = unpack(page.texts["data-table"]).decode()
    header, first = (hostile_run / "table.csv").read_text(encoding="utf-8").splitlines()[:2]
    assert table == f"{header}\n{first}\n"


def test_a_page_that_would_be_too_large_has_fewer_histories_and_says_so(
    hostile_run: Path, tmp_path: Path, page: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = len(page.encode()) - 1
    monkeypatch.setattr("rockframe.stages.report._MOST_BYTES", most)
    shown = report_stage(hostile_run, tmp_path / "small.html")
    small = (tmp_path / "small.html").read_text(encoding="utf-8")
    total = shown["histories"] + shown["left_out"]
    assert len(small.encode()) <= most
    assert 0 < shown["left_out"] < total
    assert f"Of {total} histories this page holds {shown['histories']}" in small


def test_long_lists_are_cut_with_rejections_first_and_say_so(
    hostile_run: Path, page: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The histories of the page do not change."""
    monkeypatch.setattr("rockframe.results.run.MOST_ENTRIES", 1)
    monkeypatch.setattr("rockframe.report.page.MOST_ENTRIES", 1)
    monkeypatch.setattr("rockframe.report.page._MOST_INPUTS", 1)
    few, inputs = report(hostile_run), read_manifest(hostile_run)["inputs"]
    entries = [row["status"] for row in rows_of(hostile_run / "records.csv")]
    assert "accepted" in entries
    assert f"These are 1 of {len(entries)}, with rejections" in few
    assert '<span class="badge accepted">' not in few
    assert f"These are the first 1 of {len(inputs)}" in few
    assert Parsed(few).texts["facts"] == Parsed(page).texts["facts"]


def test_the_summary_is_first_and_links_to_the_worst_record(hostile_run: Path) -> None:
    """A single record has no summary, so the number of records is changed."""
    run = read_run(hostile_run)
    histories = list(read_histories(hostile_run, choose(run, 9)))
    assert 'id="summary"' not in render(run, histories)
    several = replace(run, summary=tuple({**row, "records": "2"} for row in run.summary))
    html = render(several, histories)
    section = html.split('<section id="summary"')[1].split("</section>")[0]
    assert html.index('id="summary"') < html.index('id="glance-title"')
    assert re.findall(r'<th scope="row">(\w+)</th>', section) == ["bent", "thin", "squat"]
    assert re.findall(r'href="(#history-\d)"', section) == [
        "#history-0",
        "#history-1",
        "#history-2",
    ]
    assert "Overturn over all records" in section
    assert STATION not in section


def test_names_stay_text(page: str) -> None:
    parsed = Parsed(page)
    names = [tag for tag, _ in parsed.tags]
    histories, grounds = 3, 1
    assert names.count("script") == 5 * histories + 2 * grounds + 3  # facts, table, the script
    assert not {"img", "b"} & {tag for tag, attributes in parsed.tags if attributes}
    assert not [key for _, attributes in parsed.tags for key in attributes if key.startswith("on")]
    for text in (FILE, REJECTED, f"{STATION}"):
        assert any(text in word for word in parsed.words)
    assert json.loads(parsed.texts["facts"])["pairs"][0]["event"] == EVENT


def test_no_request_can_leave(page: str) -> None:
    parsed = Parsed(page)
    links = [a.get("href") or a.get("src") or "#" for _, a in parsed.tags]
    assert all(link.startswith("#") for link in links)
    (policy,) = (a["content"] for _, a in parsed.tags if a.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert not re.search(r"unsafe|https?:|\*|data:|blob:", policy)
    for name in ("script", "style"):
        digest = hashlib.sha256(parsed.texts[name].encode()).digest()
        assert f"'sha256-{base64.b64encode(digest).decode()}'" in policy


def test_the_table_is_carried_as_it_is(hostile_run: Path, page: str) -> None:
    carried = unpack(Parsed(page).texts["data-table"])
    assert carried == (hostile_run / "table.csv").read_bytes()


def test_the_same_run_gives_the_same_bytes(hostile_run: Path, page: str) -> None:
    assert report(hostile_run) == page


def test_what_is_left_out_is_said(hostile_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = Parsed(report(hostile_run, "--histories", "1", "--json"))
    said = json.loads(capsys.readouterr().out)
    assert (said["histories"], said["left_out"]) == (1, 2)
    (kept,) = json.loads(page.texts["facts"])["pairs"]
    assert kept["words"].startswith("stands")  # those that stand come first
    assert any("Of 3 histories this page holds 1" in word for word in page.words)
    assert sum(attributes.get("data-history") is not None for _, attributes in page.tags) == 1


@pytest.mark.parametrize(
    ("critical", "cell", "order"), [("1.25", "1.25", "1.25"), ("", "> 10", "Infinity")]
)
def test_a_critical_scale_is_shown_where_the_table_has_one(
    critical: str, cell: str, order: str
) -> None:
    row = {"record": "A", "verdict": "stands", "critical_scale": critical, "largest_scale": "10.0"}
    columns = shown([row], verdicts := [SpreadVerdict(Verdict.STANDS)])
    (column,) = (column for column in columns if column.head == "Critical scale")
    html = ResultTable([row], verdicts, [""], [column], []).html({})
    assert f'data-order="{order}">{escape(cell)}</td>' in html


def test_a_row_of_the_table_of_results_is_this_html() -> None:
    """Names are escaped, numbers have sort keys, and verdicts and links are those of the row."""
    rows = [
        {"record": '<a"', "structure": "b&", "critical_scale": "1.25", "magnitude": "6.1"},
        {"record": 'c"', "structure": "d", "critical_scale": "", "magnitude": ""},
    ]
    rows = [{**row, "verdict": "stands", "largest_scale": "10.0"} for row in rows]
    verdicts = [SpreadVerdict(Verdict.STANDS), SpreadVerdict(Verdict.OVERTURNS)]
    strips = [Markup("<svg/>"), Markup("")]
    table = ResultTable(rows, verdicts, ["calm", "fell"], shown(rows, verdicts), strips)
    first, second = (re.sub(" +<t", "<t", line) for line in table.html({1: 4}).splitlines())
    assert first == (
        '<tr data-verdict="stands"><td class=" text">&lt;a&#34;</td><td class=" ">b&amp;</td>'
        '<td class=" text"><span class="badge calm">stands</span></td>'
        '<td class="strips" data-order="1.25"><svg/></td>'
        '<td class=" number" data-order="1.25">1.25</td>'
        '<td class="minor number" data-order="6.1">6.1</td></tr>'
    )
    link = '<a href="#history-4" aria-label="c&#34;, d">d</a>'
    assert second == (
        '<tr data-verdict="overturns" data-history="4"><td class=" text">c&#34;</td>'
        f'<td class=" ">{link}</td><td class=" text"><span class="badge fell">stands</span></td>'
        '<td class="strips" data-order="Infinity"></td>'
        '<td class=" number" data-order="Infinity">&gt; 10</td>'
        '<td class="minor number" data-order="-Infinity">–</td></tr>'
    )


def test_the_cells_of_the_table_of_results_are_those_of_its_columns(bundled_run: Path) -> None:
    """They are made column by column, equal numbers once."""
    run = read_run(bundled_run)
    table = ResultTable.of(run)
    html = table.html({3: 0})
    assert re.findall(r'data-history="(\d+)"', html.splitlines()[3]) == ["0"]
    cells = re.findall(r'<td class="(?!strips)[^>]*>(.*?)</td>', html)
    texts = [unescape(re.sub("<[^>]*>", "", cell)) for cell in cells]
    assert texts == [column.cell(row) or "–" for row in run.rows for column in table.columns]


def test_the_vendored_script_is_what_its_readme_says() -> None:
    stated = re.findall(r"^([0-9a-f]{64})  (\S+)$", (VENDORED / "README.md").read_text(), re.M)
    assert len(stated) == 3
    for digest, name in stated:
        assert hashlib.sha256((VENDORED / name).read_bytes()).hexdigest() == digest


def test_its_licence_goes_with_each_page(page: str) -> None:
    assert (VENDORED / "uPlot.LICENSE").read_text() in Parsed(page).texts["script"]


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    capsys.readouterr()
    assert main(["report", *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_only_a_whole_run_is_reported(
    hostile_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "no such folder" in refusal(capsys, str(tmp_path / "nowhere"))
    (tmp_path / "file").touch()
    assert "file: is a file. Must be a folder" in refusal(capsys, str(tmp_path / "file"))
    assert "the run is not complete" in refusal(capsys, str(tmp_path))
    damaged = Path(shutil.copytree(hostile_run, tmp_path / "run"))
    (damaged / "table.csv").write_text("event\n")
    error = refusal(capsys, str(damaged))
    assert "is not a complete run" in error
    assert "table.csv" in error
    assert not (damaged / "report.html").exists()


def test_a_table_of_another_version_is_refused(
    hostile_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Path(shutil.copytree(hostile_run, tmp_path / "run"))
    table = run / "table.csv"
    table.write_text(table.read_text().replace(",verdict,", ",fate,", 1))
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["outputs"]["table.csv"] = sha256_of(table)
    (run / "manifest.json").write_bytes(sealed_json(manifest))
    assert "table.csv: without column 'verdict'. Use a file that" in refusal(capsys, str(run))


def test_a_page_of_another_run_is_a_fault(
    hostile_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Path(shutil.copytree(hostile_run, tmp_path / "run"))
    assert main(["report", str(run)]) == main(["verify", str(run)]) == 0
    manifest = json.loads((run / "manifest.json").read_text())
    (run / "manifest.json").write_bytes(sealed_json(manifest | {"versions": {}}))
    assert main(["verify", str(run)]) == 1
    assert "report.html: shows another run" in capsys.readouterr().err


@given(st.binary(min_size=1, max_size=80), st.data())
def test_a_flipped_bit_of_a_page_is_found(text: bytes, data: st.DataObject) -> None:
    whole = bytearray(sealed_page(text.decode("latin-1")))
    assert is_whole_page(bytes(whole))
    whole[data.draw(st.integers(0, len(whole) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    assert not is_whole_page(bytes(whole))


def test_a_damaged_page_is_a_fault(
    hostile_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Path(shutil.copytree(hostile_run, tmp_path / "run"))
    assert main(["report", str(run)]) == 0
    page = run / "report.html"
    page.write_bytes(page.read_bytes().replace(b"</h1>", b"</h2>", 1))
    assert main(["verify", str(run)]) == 1
    assert "report.html: is corrupted. Write it again" in capsys.readouterr().err


def test_no_file_of_the_run_is_written_over(hostile_run: Path) -> None:
    with pytest.raises(InputError, match="Choose another file"):
        report_stage(hostile_run, hostile_run / "table.csv")


def test_a_page_without_histories_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "run", "--histories", "0"]) == 2
    assert "--histories 0. Must be at least 1" in capsys.readouterr().err


ANSWERS = re.compile(r'<ul class="answers">(.*?)</ul>', re.DOTALL)


def test_the_page_begins_with_an_answer_about_each_structure(bundled_run: Path) -> None:
    """Its numbers are those of the table: members that overturn, and the smallest margin."""
    (found,) = ANSWERS.findall((bundled_run / "report.html").read_text("utf-8"))
    found = found.replace("\N{NO-BREAK SPACE}", " ")
    said = dict(re.findall(r"<li><strong>(.*?)</strong> (.*?)\.</li>", found))
    rows = that_count(rows_of(bundled_run / "table.csv"))
    assert [*said] == list(dict.fromkeys(row["structure"] for row in rows))
    for name, words in said.items():
        own = [row for row in rows if row["structure"] == name]
        most = max(round(64 * float(row["share_overturned"])) for row in own)
        assert f"{most or 'none'} of 64 plausible structures" in words
        nearest = min(own, key=lambda row: float(row["robust_scale_10"] or "inf"))
        scale = float(nearest["robust_scale_10"])
        assert f"10 % overturn at {scale:.2f} times {nearest['record_id']}" in words


def test_a_page_of_the_files_of_single_stages_is_that_of_their_run(
    bundled_run: Path, tmp_path: Path
) -> None:
    names = ("response", "records", "pulses")  # in any order
    files = [str(shutil.copy(bundled_run / f"{name}.nc", tmp_path)) for name in names]
    assert main(["report", *files]) == 2  # records.csv is missing
    shutil.copy(bundled_run / "records.csv", tmp_path)
    assert main(["report", *files]) == 0
    page, of_run = (
        (folder / "report.html").read_text("utf-8") for folder in (tmp_path, bundled_run)
    )
    facts = re.compile(r'<script type="application/json" id="facts">(.*?)</script>', re.DOTALL)
    assert ANSWERS.findall(page) == ANSWERS.findall(of_run) != []
    ours, theirs = (json.loads(*facts.findall(text)) for text in (page, of_run))
    assert ours | {"name": theirs["name"]} == theirs
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["report.html", "records.csv", *(f"{name}.nc" for name in names)]
    )


def test_files_of_a_page_are_one_of_each_kind(
    bundled_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    response, records = str(bundled_run / "response.nc"), str(bundled_run / "records.nc")
    for words, said in (
        ([response, records], "No pulses file named. Name the outputs of"),
        ([response, response], "is a second response file. A page shows one file of each of"),
        ([response, str(bundled_run)], "Must be the output of a stage"),
    ):
        assert main(["report", *words]) == 2
        assert said in capsys.readouterr().err
