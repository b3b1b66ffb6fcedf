"""Why records did not come through: no reason hides another one."""

from __future__ import annotations

from pathlib import Path

from rockframe.results.tables.entries import Entry, rejections_of, write_entries


def test_each_record_of_a_file_keeps_its_reason(tmp_path: Path) -> None:
    names = ("CCC-090", "CCC-360")
    rows = [Entry("CCC.V1", name, reason=f"record {name!r}: clipped.") for name in names]
    write_entries([*rows, Entry("ok.csv", "ok")], tmp_path / "records.csv")
    assert rejections_of(tmp_path) == {
        "CCC.V1": "record 'CCC-090': clipped. record 'CCC-360': clipped."
    }
