"""Records that are left out are stated first, wherever results of the others are."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tests.screening import sine, stored, three
from tests.stages.test_rotation import peer
from tests.stages.test_rotation import three as written

from rockframe.cli.main import main

#: `CCC` has a vertical record, `strongest` has none.
WORDS = "1 of 3 records left out: strongest: no vertical record of the same event"
FEW = ("--ensemble-members", "16", "--margins", "none")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the run of three horizontals with the vertical motion, of which one is missing."""
    home = tmp_path_factory.mktemp("left-out")
    samples = 0.4 * np.random.default_rng(9).standard_normal(4000)
    peer(written(home / "in") / "strongest.AT2", "090", samples, "elsewhere")
    words = ("--structure", "slender-column", "--surrogates", "0", "--histories", "none")
    command = ("table1", "--records", home / "in", "--output", home / "run", "--vertical")
    assert main([str(word) for word in (*command, *words, *FEW, "--format", "xlsx")]) == 1
    return home / "run"


def test_tables_state_it(run: Path) -> None:
    from openpyxl import load_workbook

    head, row = (run / "summary.csv").read_text().splitlines()[:2]
    assert "records,left_out,left_out_words," in head
    assert f",2,1,{WORDS}" in row.replace('"', "")
    sheet = load_workbook(run / "table.xlsx").worksheets[0]
    heads, values = ([cell.value for cell in line] for line in list(sheet.rows)[:2])
    assert dict(zip(heads, values, strict=True))["left_out_words"].startswith(WORDS)


def test_the_page_of_a_run_states_it_before_its_verdicts(run: Path) -> None:
    assert main(["report", str(run)]) == 0
    page = (run / "report.html").read_text()
    assert (
        0 < page.index(WORDS) < page.index("2 records on 1 structure") < page.index('class="tally"')
    )
    assert "Over 2 of 3 records" in page
    assert "Over all records" not in page
    listed = page[page.index("Records and their passports") :]
    (row,) = re.findall(r">strongest</th>.*?</tr>", listed, re.DOTALL)
    assert "left out</span>" in row
    assert "accepted" not in row


def test_respond_and_its_json_state_it(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = ("--output", str(run.parent / "response.nc"), "--structure", "slender-column")
    command = ("respond", str(run / "records.nc"), "--vertical", *output, *FEW)
    capsys.readouterr()
    assert main(command) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert said.startswith(WORDS)
    assert "Over 2 of 3 records" in said
    assert main([*command, "--json"]) == 1
    (row,) = json.loads(capsys.readouterr().out)["summary"]
    assert (row["records"], row["left_out"]) == (2, 1)
    assert row["left_out_words"].startswith(WORDS)


def test_a_screening_and_its_captions_state_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = stored([*three("a"), sine("strongest", 9.0, azimuth=0.0)], tmp_path)
    words = ("--vertical", "--structure", "slender-column", "--scales", "1:2:2")
    output = ("--output", str(tmp_path / "screen.nc"), "--margins", "none")
    assert main(["screen", str(records), *words, *output]) == 1
    expected = WORDS.replace("records left", "motions left")
    assert " ".join(capsys.readouterr().out.split()).startswith(expected)
    assert main(["figure", str(tmp_path / "screen.nc"), "--output", str(tmp_path / "drawn")]) == 0
    captions = [path.read_text() for path in (tmp_path / "drawn" / "screen").glob("*.caption.txt")]
    captions = [" ".join(caption.split()) for caption in captions]
    assert captions
    assert all(expected in caption for caption in captions)
