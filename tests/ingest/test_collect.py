from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rockframe.errors import InputError
from rockframe.ingest import CatalogueEntry, collect, sorted_out
from rockframe.ingest.catalogue import COLUMNS
from rockframe.outcome import InputOutcome

TABLE = "time_s,acc_g\n0.00,0.1\n0.01,0.2\n"
HEADER = ",".join(COLUMNS)


def test_every_file_ends_in_one_list(tmp_path: Path, at2: Callable[..., bytes]) -> None:
    (tmp_path / "b.AT2").write_bytes(at2())
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "c.csv").write_text("time_s,acc_g\n0.00,0.1\n0.01,nan\n")
    (tmp_path / "MEMO").write_text("Words.\n")
    (tmp_path / ".hidden").write_text("Words.\n")
    (tmp_path / "request.json").write_text("{}")
    (tmp_path / "map.PNG").write_bytes(b"picture")
    (tmp_path / "old.csv").write_text("file,record_id,status,line,reason\n")
    (tmp_path / "screen.csv").write_text("record_id,structure,scale,verdict\n")
    (tmp_path / "deeper" / "still").mkdir(parents=True)
    (tmp_path / "deeper" / "still" / "d.AT2").write_bytes(at2())
    (tmp_path / "lost").symlink_to(tmp_path / "nowhere")
    (tmp_path / "way").symlink_to(tmp_path / "deeper")
    seen: list[str] = []
    outcomes = list(collect([tmp_path], progress=seen.append))
    records, rejections = sorted_out(outcomes)
    assert [record.record_id for record in records] == ["a", "b", "d"]
    assert [record.source_file for record in records] == ["a.csv", "b.AT2", "deeper/still/d.AT2"]
    reasons = {rejection.file: rejection.reason for rejection in rejections}
    assert list(reasons) == ["MEMO", "c.csv", "lost", "way"]
    assert "acceleration 'nan'" in reasons["c.csv"]
    assert reasons["lost"] == "not a regular file."
    assert reasons["way"].startswith("a link to a folder")
    unread = [o.file for o in outcomes if isinstance(o, InputOutcome) and o.status == "unread"]
    assert unread == [".hidden", "map.PNG", "old.csv", "request.json", "screen.csv"]
    assert seen == ["MEMO", "a.csv", "b.AT2", "c.csv", "deeper/still/d.AT2"]


def test_a_link_to_itself_costs_one_row(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "loop.nc").symlink_to("loop.nc")
    records, rejections = sorted_out(collect([tmp_path]))
    assert [record.record_id for record in records] == ["a"]
    assert [rejection.file for rejection in rejections] == ["loop", "loop.nc"]
    assert rejections[0].reason.startswith("cannot be opened: Too many levels of symbolic links")


@pytest.mark.parametrize("forbidden", ["list", "enter"])
def test_a_closed_folder_costs_one_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forbidden: str
) -> None:
    # Root may open every folder, so the test raises the system's error itself.
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "closed").mkdir()
    (tmp_path / "closed" / "catalogue.csv").write_text(HEADER)
    closed = tmp_path / "closed"

    def deny(real: Callable[..., Any], inside: bool) -> Callable[..., Any]:
        def call(path: Any, *arguments: Any, **options: Any) -> Any:
            if (Path(path).parent if inside else Path(path)) == closed:
                raise PermissionError(13, "Permission denied", str(path))
            return real(path, *arguments, **options)

        return call

    if forbidden == "list":
        monkeypatch.setattr("os.listdir", deny(os.listdir, inside=False))
        monkeypatch.setattr("os.scandir", deny(os.scandir, inside=False))
    else:
        monkeypatch.setattr("os.stat", deny(os.stat, inside=True))
    records, [rejection] = sorted_out(collect([tmp_path]))
    assert [record.record_id for record in records] == ["a"]
    assert rejection.file == ("closed" if forbidden == "list" else "closed/catalogue.csv")
    assert rejection.reason == "cannot be opened: Permission denied."


def test_several_folders_are_told_apart(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.csv").write_text(TABLE + f"0.02,0.{ord(folder[0])}\n")
    records, rejections = sorted_out(collect([tmp_path / "one", tmp_path / "two"]))
    assert [record.source_file for record in records] == ["one/a.csv", "two/a.csv"]
    assert ([record.record_id for record in records], rejections) == (["a", "two-a"], [])


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


def test_files_that_differ_by_their_endings_keep_both(tmp_path: Path) -> None:
    (tmp_path / "SHAKE.csv").write_text(TABLE)
    (tmp_path / "shake.txt").write_text(TABLE + "0.02,0.3\n")
    records, rejections = sorted_out(collect([tmp_path]))
    assert ([record.record_id for record in records], rejections) == (["SHAKE", "shake.txt"], [])


def test_identifiers_that_differ_by_case_only(tmp_path: Path) -> None:
    (tmp_path / "SHAKE.csv").write_text(TABLE)
    (tmp_path / "shake.CSV").write_text(TABLE + "0.02,0.3\n")
    records, [rejection] = sorted_out(collect([tmp_path]))
    assert [record.source_file for record in records] == ["SHAKE.csv"]
    assert rejection.file == "shake.CSV"
    assert "identifier 'shake' is in use by 'SHAKE.csv'" in rejection.reason
    assert rejection.reason.endswith("Rename one of the files.")


def test_a_copy_is_refused_as_one(tmp_path: Path) -> None:
    (tmp_path / "deeper").mkdir()
    for name in ("shake.csv", "shake.txt", "deeper/shake.csv"):
        (tmp_path / name).write_text(TABLE)
    records, rejections = sorted_out(collect([tmp_path]))
    assert len(records) == 1
    assert [rejection.file for rejection in rejections] == ["shake.txt", "deeper/shake.csv"]
    assert all(r.reason.endswith("This file is a copy of it.") for r in rejections)


def test_raw_and_corrected_of_one_record_keep_all_channels(shared_records: Path) -> None:
    folder = shared_records / "formats" / "csmip"
    records, rejections = sorted_out(collect([folder / "CE89146.V1", folder / "CE89146.V2"]))
    assert rejections == []
    names = [f"CE89146{kind}-{channel}" for kind in ("", ".V2") for channel in ("360", "UP", "090")]
    assert [record.record_id for record in records] == names


def test_missing_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"lost: no such file or folder\."):
        list(collect([tmp_path / "lost"]))


def test_empty_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the folder contains no record files\."):
        list(collect([tmp_path]))


def test_catalogue_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "catalogue.csv").write_text(f"{HEADER}\na.csv,Kobe,,,6.9,,x\nb.csv,,,,,,\n")
    [record], [rejection] = sorted_out(collect([tmp_path]))
    assert (record.event, record.magnitude) == ("Kobe", 6.9)
    assert (rejection.file, rejection.reason) == ("b.csv", "no such file.")


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
