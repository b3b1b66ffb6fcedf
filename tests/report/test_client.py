"""The client's page: answers, bands, letterhead, names that are HTML, and PDF."""

from __future__ import annotations

import math
import re
import shutil
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, sha256_of
from rockframe.report.client import Letterhead, client_page
from rockframe.results.run import read_run
from rockframe.results.screen import read_screening
from rockframe.results.tables.entries import rows_of
from rockframe.stages import report as stage

LOGO = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><circle r="4"/></svg>'


def page_of(folder: Path, *words: str) -> str:
    """Write the client's page of a run with these options, and return it as plain text."""
    output = folder / "page.html"
    assert main(["report", str(folder), "--client", "--output", str(output), *words]) == 0
    return output.read_text(encoding="utf-8")


def test_the_page_has_the_answers_and_the_bands_of_the_summary(bundled_run: Path) -> None:
    page = unescape(page_of(bundled_run)).replace("\N{NO-BREAK SPACE}", " ")
    rows = list(rows_of(bundled_run / "summary.csv"))
    assert len(rows) == 5
    # in the order of the study, which the tables of the page keep too
    assert re.findall("<li><strong>(.*?)</strong>", page) == [row["structure"] for row in rows]
    for row in rows:
        size = f"{float(row['height_m']):g} m high and {float(row['width_m']):g} m wide"
        assert size in page
        assert f"<strong>{row['structure']}</strong> " in page
        if row["peak_u_84_m"] != "inf":
            assert f" to {100 * float(row['peak_u_84_m']):.1f})</small>" in page
    assert page.count("of 64 plausible structures overturn") == 5
    assert "Forces were not computed" in page
    assert sha256_of(bundled_run / MANIFEST)[:12] in page


def test_the_page_counts_the_motions_of_its_answers_and_tables(bundled_run: Path) -> None:
    """Round columns answer for motions in both directions, so nothing there is of one plane."""
    page = unescape(page_of(bundled_run)).replace("\N{NO-BREAK SPACE}", " ")
    rows = list(rows_of(bundled_run / "summary.csv"))
    both = {row["structure"] for row in rows if row["directions"] == "2"}
    assert 0 < len(both) < len(rows)
    (note,) = re.findall(r'<p class="note">.*?PGA .*? g\. (.*?)\. Each answer', page)
    counted: dict[str, str] = {}
    for group in note.split("; "):
        names, _, words = group.partition(": ")
        counted |= dict.fromkeys(names.split(", "), words)
    assert {*counted} == {row["structure"] for row in rows}
    for row in rows:
        name, records = row["structure"], row["records"]
        if name in both:
            assert counted[name] == f"{records} motions in both horizontal directions"
        else:
            assert counted[name] == f"{records} records, each in one plane"
        (answer,) = re.findall(f"<strong>{name}</strong> (.*?)<small>", page)
        assert (" in both directions" in answer) is (name in both)
    ((limit, reason),) = re.findall(r"<li>(.*?): motion in one plane; (.*?)</li>", page)
    assert {*limit.split(", ")} == {*counted} - both
    assert "columns not circular. The other horizontal direction" in reason
    assert "Round columns" not in reason


def test_return_periods_may_not_be_determined_or_be_of_one_plane(
    bundled_run: Path, tmp_path: Path
) -> None:
    """Without motions in both directions, the page says that return periods have none."""
    hazard, output = tmp_path / "hazard.csv", tmp_path / "screen.nc"
    hazard.write_text("pga_g,annual_rate\n0.05,0.05\n0.3,0.002\n3,0.000002\n", encoding="utf-8")
    words = ["--structure", "bridge-bent", "--scales", "1", "2", "--margins", "none"]
    words += ["--hazard", str(hazard), "--return-period-years", "10", "--output", str(output)]
    assert main(["screen", str(bundled_run / "records.nc"), *words]) == 0
    page = client_page(read_run(bundled_run), Letterhead(), 64, read_screening(output))
    assert re.search(r">drift \[cm\] in 10 years</th><td class=\"number\">–", page)
    assert "A dash: these motions, or the hazard curve, do not determine the demand." in page
    assert "Return periods are" not in page
    nominal = "Return periods and demands here are of the structures exactly as given"
    assert nominal in page
    screening = read_screening(output)
    spread = client_page(
        read_run(bundled_run), Letterhead(), 64, screening.assign(members=((), 16))
    )
    assert nominal not in spread
    words.append("--no-both-directions")
    assert main(["screen", str(bundled_run / "records.nc"), *words]) == 0
    page = client_page(read_run(bundled_run), Letterhead(), 64, read_screening(output))
    (caution,) = re.findall(r'<p class="caution">(.*?)</p>', page)
    assert "Return periods are of motions in one plane" in caution
    assert "bridge-bent" in caution
    assert "θ/α" not in page
    assert "Return periods are" not in client_page(read_run(bundled_run), Letterhead(), 64)


def test_forces_to_design_for_are_those_of_the_motions_that_count(bundled_run: Path) -> None:
    run = read_run(bundled_run)
    pairs = {(row["record_id"], row["structure"]): bool(row["components"]) for row in run.rows}
    round_columns = {row["structure"] for row in run.summary if row["directions"] == "2"}
    row = {"force": "peak_base_shear", "words": "base shear", "unit": "W", "value_84": math.nan}
    forces = {
        (record, structure): [
            {**row, "record_id": record, "structure": structure, "value": 0.123 if both else 0.987}
        ]
        for (record, structure), both in pairs.items()
        if structure in round_columns
    }
    fallen = next(pair for pair in forces if pairs[pair])
    forces[fallen][0]["value_84"] = math.inf
    page = client_page(replace(run, forces=forces), Letterhead(), 64)
    assert page.count("no force under 1 of 3 motions, where the 84 % quantile overturns") == 1
    (line,) = re.findall(r">base shear \[W\]</th>(.*?)</tr>", page)
    assert line.count(">0.123 <small>") == len(round_columns) > 0
    assert "0.987" not in page
    assert page.count("means over 0.01 s, not bounds for an instant") == 1


def test_the_same_run_gives_the_same_page_and_no_script_or_request(hostile_run: Path) -> None:
    page = page_of(hostile_run)
    assert page == page_of(hostile_run)
    assert "<script" not in page
    assert "<b onclick" not in page
    assert "&lt;b onclick" in page
    assert not re.search(r"(?:src|href)=\"(?!data:|#)", page)
    assert "1 file or record was rejected" in page


def test_the_letterhead_is_that_of_the_command(hostile_run: Path, tmp_path: Path) -> None:
    logo = tmp_path / "logo.svg"
    logo.write_bytes(LOGO)
    words = ("--company", "A & B", "--project", "Pier <4>", "--question", "Does it stand?")
    page = page_of(hostile_run, *words, "--logo", str(logo))
    assert "<h1>Pier &lt;4&gt;</h1>" in page
    assert '<p class="eyebrow">A &amp; B</p>' in page
    assert "Does it stand?" in page
    assert 'src="data:image/svg+xml;base64,' in page


@pytest.mark.parametrize("content", [None, b"GIF89a", LOGO + b" " * 500_000])
def test_a_logo_that_no_page_can_show_is_an_error(content: bytes | None, tmp_path: Path) -> None:
    logo = tmp_path / "logo.png"
    if content is not None:
        logo.write_bytes(content)
    said = "cannot be read" if content is None else "Must be PNG, JPEG or SVG of at most 0.5 MB"
    with pytest.raises(InputError, match=said):
        _ = Letterhead(logo=logo).picture


@pytest.mark.skipif(
    not any(map(shutil.which, stage._BROWSERS)),  # noqa: SLF001 -- the programs that are tried
    reason="no Chromium, which prints the page",
)
def test_a_pdf_is_printed_and_has_two_pages_at_most(bundled_run: Path, tmp_path: Path) -> None:
    output = tmp_path / "page.pdf"
    assert main(["report", str(bundled_run), "--client", "--output", str(output)]) == 0
    content = output.read_bytes()
    assert content.startswith(b"%PDF-")
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", content)) <= 2
    sides = re.findall(rb"/MediaBox\s*\[0 0 ([\d.]+) ([\d.]+)\]", content)
    a4 = pytest.approx([210.0 / 25.4 * 72.0, 297.0 / 25.4 * 72.0], abs=1.0)
    assert [float(side) for side in sides[0]] == a4


def test_without_a_program_that_prints_html_is_written_and_pdf_refused(
    hostile_run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(stage, "_BROWSERS", ())
    monkeypatch.setitem(__import__("sys").modules, "weasyprint", None)
    output = tmp_path / "page.pdf"
    assert main(["report", str(hostile_run), "--client", "--output", str(output)]) == 2
    assert "neither Chromium nor WeasyPrint is present. Write .html" in capsys.readouterr().err
    assert not output.exists()
    assert main(["report", str(hostile_run), "--output", str(output)]) == 2
    assert "Only the page of --client can be a .pdf" in capsys.readouterr().err
