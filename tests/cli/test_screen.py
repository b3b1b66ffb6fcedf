"""`rockframe screen` as a user types it: what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tests.screening import site, stored

from rockframe.cli.main import main
from rockframe.cli.options import numbers
from rockframe.results.screen import read_screening


@pytest.fixture(scope="module")
def bundled(tmp_path_factory: pytest.TempPathFactory, bundled_records: Path) -> Path:
    """The folder of a screening of the bundled records, with its figures."""
    folder = tmp_path_factory.mktemp("bundled")
    words = ["screen", str(bundled_records), "--output", str(folder / "screen.nc")]
    assert main([*words, "--structure", "slender-frame", "--margins", "none"]) == 0
    assert main(["figure", str(folder / "screen.nc"), "--output", str(folder / "figures")]) == 0
    return folder


def test_command_on_the_bundled_records(bundled: Path) -> None:
    found = read_screening(bundled / "screen.nc")
    assert found.sizes["record"] == 6
    rows = (bundled / "screen.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("record_id,structure,scale,verdict,peak_rotation_ratio")
    assert len(rows) == 7
    captions = list((bundled / "figures" / "screen").glob("*.caption.txt"))
    assert len(captions) == 2
    assert all("3 recordings" in caption.read_text(encoding="utf-8") for caption in captions)


def test_a_hazard_curve_that_ends_early_is_noted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hazard, records = tmp_path / "hazard.csv", str(stored(site(12), tmp_path))
    hazard.write_text("pga_g,annual_rate\n0.05,0.01\n0.3,0.004\n", encoding="utf-8")
    words = ["screen", records, "--output", str(tmp_path / "s.nc"), "--margins", "none"]
    words += ["--structure", "slender-frame", "--scales", "0.5:2:6", "--hazard", str(hazard)]
    assert main(words) == 0
    note = re.search(
        r"(\d+) % of it is from intensities above 0\.3 g, the last point of the hazard curve\.",
        capsys.readouterr().out,
    )
    part = read_screening(tmp_path / "s.nc").sel(limit_state="overturning")
    share = part["disaggregation"].values[0, -1] / part["annual_rate"].values[0]
    assert note is not None
    assert int(note[1]) == round(100.0 * share) > 10


def test_the_site_of_the_hazard_curve_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0.05 degrees of latitude are 5.56 km; a file without sites names none."""
    one, other = tmp_path / "PGA.csv", tmp_path / "plain.csv"
    one.write_text("name,lon,lat,0.05,0.3\nhere,24.0,38.0,0.01,0.004\n")
    other.write_text("pga_g,annual_rate\n0.05,0.01\n0.3,0.004\n")
    records = str(stored(site(4), tmp_path))
    words = ["screen", records, "--output", str(tmp_path / "s.nc"), "--margins", "none"]
    words += ["--structure", "slender-frame", "--scales", "1", "--hazard"]
    assert main([*words, str(one), "--hazard-site", "24", "38.05"]) == 0
    line = (
        "The hazard curve is that of the nearest site, at 24 38, 5.56 km from the requested place."
    )
    assert line in capsys.readouterr().out.splitlines()
    assert main([*words, str(other)]) == 0
    assert "The hazard curve is that of" not in capsys.readouterr().out


def test_few_recordings_are_said_to_be_few(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = stored(site(3), tmp_path)
    words = ["screen", str(records), "--output", str(tmp_path / "s.nc"), "--margins", "none"]
    assert main(words) == 0
    assert "3 recordings are few" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["motions"] == 3
    assert len(told["structures"]) == 5
    reason = told["structures"][0]["better_measure_reason"]
    assert "too few" in reason or "two are needed for a comparison" in reason


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scales", "1", "0.5"], "--scales 0.5 after 1. Must increase"),
        (["--magnitude", "8", "9"], "no record is left to screen"),
        (["--azimuths", "45"], "no other horizontal of the same event"),
        (["--azimuths", "10", "10"], "--azimuths-degree 10 after 10. Must increase"),
        (["--azimuths", "10", "370"], "--azimuths-degree states 10 twice, or 360 apart"),
        (["--seed", "-1"], "--seed -1. Must be zero or positive"),
        (["--scales", "1e4"], "--scales with 10000. Must be at most 1000"),
        (["--scales", "1:2:1500", "3:4:1500"], "--scales of 3000 numbers. Must be at most 2000"),
        (["--vertical"], "no vertical record"),
        (["--scheduler", "tcp://127.0.0.1:1"], "ask"),
        (["--hazard", "no.csv"], "no.csv: cannot be read"),
        (["--design-dimension", "height"], "--design-range is missing"),
        (
            ["--design-dimension", "height", "--design-range", "3", "2"],
            "range [3, 2]. Must be positive, and increase",
        ),
        (["--design-dimension", "width", "--design-range", "1", "50"], "Invalid slenderness"),
        (
            [
                "--design-dimension",
                "height",
                "--design-range",
                "2",
                "3",
                "--design-steps",
                "1000000000000",
            ],
            "--design-steps 1000000000000. Must be at most 10000",
        ),
        (["--workers", "-1"], "--workers -1. Must be at least 1"),
        (["--structure", "none"], "Invalid structure 'none'"),
        (["--pulses", "no.nc"], "no.nc: no such file"),
    ],
)
def test_mistakes_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    records = stored(site(2), tmp_path)
    output = tmp_path / "s.nc"
    status = main(["screen", str(records), "--output", str(output), "--margins", "none", *words])
    told = capsys.readouterr().err
    assert status == 2
    assert told.count("\n") == 1
    if message != "ask":  # the message for --scheduler differs where Dask is not installed
        assert message in told
    assert not output.exists()


@pytest.mark.parametrize(
    "word", ["a", "nan", "6_5", "1:2", "1:2:1", "1:2:2.5", "1:2:2001", "1:2:3:4", "::"]
)
def test_values_that_are_none(
    tmp_path: Path, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["screen", str(tmp_path), "--output", "s.nc", "--scales", word])
    assert caught.value.code == 2
    assert f"Invalid value {word!r}. Must be a number, or FROM:TO:COUNT" in capsys.readouterr().err


def test_values_meet_both_ends_and_one() -> None:
    """With rounding errors, a scale of 1 would not be found in the file."""
    assert numbers("0.1:3:30")[9] == 1.0
    assert all(numbers(f"0.2:2:{count}")[-1] == 2.0 for count in range(2, 50))
    assert numbers("2.5") == [2.5]


@pytest.mark.parametrize(
    ("scales", "columns", "heads"),
    [
        ("0.95:1.05:11", "150", "0.96 0.97 0.98 0.99 1 1.01 1.02 1.03 1.04 1.05"),
        ("0.25:3:12", "150", "0.5 0.75 1 1.25 1.5 1.75 2 2.25 2.5 2.75"),
        ("0.25:3:12", "44", "0.5 0.75 1 1.25 1.5 1.75"),
        ("0.25:3:12", "36", "0.75 1 1.25 1.5"),
    ],
)
def test_the_scales_that_a_table_leaves_out_are_those_far_from_1(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    scales: str,
    columns: str,
    heads: str,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    words = ["screen", str(stored(site(3), tmp_path)), "--output", str(tmp_path / "s.nc")]
    words += ["--margins", "none", "--structure", "slender-frame", "--scales", scales]
    assert main(words) == 0
    printed = capsys.readouterr().out.splitlines()
    title = next(n for n, line in enumerate(printed) if line.startswith("Motions that overturn"))
    table = printed[title:]
    head = next(line for line in table if line.strip().startswith("structure"))
    assert head.split()[1:] == heads.split()
    count = scales.split(":")[-1]
    assert f"The 10 of {count} scales that are nearest to 1; the files have all." in table
