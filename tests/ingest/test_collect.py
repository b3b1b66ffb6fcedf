from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.ingest import CatalogueEntry, collect, sorted_out
from rockframe.ingest.catalogue import COLUMNS

TABLE = "time_s,acc_g\n0.00,0.1\n0.01,0.2\n"
HEADER = ",".join(COLUMNS)


def test_every_file_ends_in_one_list(tmp_path: Path, at2: Callable[..., bytes]) -> None:
    (tmp_path / "b.AT2").write_bytes(at2())
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "c.csv").write_text("time_s,acc_g\n0.00,0.1\n0.01,nan\n")
    (tmp_path / "README").write_text("Words.\n")
    (tmp_path / ".hidden").write_text("Words.\n")
    (tmp_path / "deeper").mkdir()
    seen: list[str] = []
    records, rejections = sorted_out(collect([tmp_path], progress=seen.append))
    assert [record.record_id for record in records] == ["a", "b"]
    assert [(r.file, r.line) for r in rejections] == [("README", None), ("c.csv", 3)]
    assert "acceleration 'nan'" in rejections[1].reason
    assert seen == ["README", "a.csv", "b.AT2", "c.csv"]


def test_files_are_read_as_they_are_asked_for(tmp_path: Path) -> None:
    for name in "abc":
        (tmp_path / f"{name}.csv").write_text(TABLE)
    seen: list[str] = []
    outcomes = collect([tmp_path], progress=seen.append)
    next(outcomes)
    assert seen == ["a.csv"]
    outcomes.close()


def test_bundled(bundled_records: Path) -> None:
    records, rejections = sorted_out(collect([bundled_records]))
    assert (len(records), rejections) == (9, [])
    assert {record.magnitude for record in records} == {7.1}


def test_identifiers_that_differ_by_case_only(tmp_path: Path) -> None:
    (tmp_path / "SHAKE.csv").write_text(TABLE)
    (tmp_path / "shake.txt").write_text(TABLE)
    records, [rejection] = sorted_out(collect([tmp_path]))
    assert [record.source_file for record in records] == ["SHAKE.csv"]
    assert rejection.file == "shake.txt"
    assert "identifier 'shake' is already that of a record of 'SHAKE.csv'" in rejection.reason


def test_missing_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"lost: no such file or folder\. Must exist"):
        list(collect([tmp_path / "lost"]))


def test_empty_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a folder without files\. Must hold records"):
        list(collect([tmp_path]))


def test_catalogue_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "catalogue.csv").write_text(f"{HEADER}\na.csv,Kobe,,,6.9,,x\nb.csv,,,,,,\n")
    [record], [rejection] = sorted_out(collect([tmp_path]))
    assert (record.event, record.magnitude) == ("Kobe", 6.9)
    assert (rejection.file, rejection.reason) == ("b.csv", "no such file. Must exist.")


def test_given_catalogue_comes_first(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "catalogue.csv").write_text("nonsense\n")
    entry = CatalogueEntry(file="a.csv", event="Erzincan")
    for path in (tmp_path, tmp_path / "a.csv"):
        [record], [] = sorted_out(collect([path], catalogue={"a.csv": entry}))
        assert record.event == "Erzincan"


def test_damaged_catalogue(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "catalogue.csv").write_text("nonsense\n")
    with pytest.raises(InputError, match=r"catalogue\.csv:1: column 'nonsense' unknown"):
        list(collect([tmp_path]))
