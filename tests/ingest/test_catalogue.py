from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import CatalogueEntry, read_catalogue
from rockframe.ingest.catalogue import COLUMNS, VS30, stated_facts, write_catalogue
from rockframe.record import Record, SiteType

HEADER = ",".join(COLUMNS)


def read(folder: Path, text: str) -> dict[str, CatalogueEntry]:
    path = folder / "catalogue.csv"
    path.write_bytes(text.encode())
    return read_catalogue(path)


def test_bundled(bundled_records: Path) -> None:
    entries = read_catalogue(bundled_records / "catalogue.csv")
    assert entries["Ridgecrest2019-CLC.V1"].epicentral_distance == 5.1
    assert {entry.magnitude for entry in entries.values()} == {7.1}


def test_empty_is_unknown(tmp_path: Path) -> None:
    entry = read(tmp_path, f"{HEADER}\r\nA.V1,,,,,,\r\n\r\n")["A.V1"]
    assert entry.event == ""
    assert math.isnan(entry.magnitude)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r":1: column 'file' missing"),
        ("event,magnitude\n", r":1: column 'file' missing"),
        (HEADER + ",notes\n", r":1: column 'notes' unknown or repeated"),
        (HEADER + ",file\n", r":1: column 'file' unknown or repeated"),
        (f"{HEADER}\nA.V1,,,,7.1\n", r":2: 5 columns, but 7 in the header"),
        (f"{HEADER}\nA.V1,,,,,,\nA.V1,,,,,,\n", r":3: file 'A\.V1' is named twice"),
        (f"{HEADER}\n,,,,,,\n", r":2: file ''\. Must be the name of a file"),
        (f"{HEADER}\n../A.V1,,,,,,\n", r":2: file '\.\./A\.V1'\. Must be the name of a file"),
        (f"{HEADER}\nA.V1,,,,big,,\n", r":2: magnitude 'big'\. Must be from -2 to 10, or empty"),
        (f"{HEADER}\nA.V1,,,,6_5,,\n", r":2: magnitude '6_5'\. Must be from -2 to 10, or empty"),
        (f"{HEADER}\nA.V1,,,,６,,\n", r":2: magnitude '６'\. Must be from -2 to 10, or empty"),
        (f"{HEADER}\nA.V1,,,,nan,,\n", r":2: magnitude 'nan'\. Must be from -2 to 10, or empty"),
        (f"{HEADER}\nA.V1,,,,69,,\n", r":2: magnitude '69'\. Must be from -2 to 10, or empty"),
        (f"{HEADER}\nA.V1,,,,,-3,\n", r":2: epicentral_distance_km '-3'\. Must be from 0 to 20050"),
        ("file,vs30_m_s\nA.V1,76e3\n", r":2: vs30_m_s '76e3'\. Must be from 0 to 10000, or"),
        ("file,lowest_usable_frequency_hz\nA.V1,-1\n", "'-1'. Must be zero or positive, or"),
        (f'{HEADER}\n"A.V1,,,,,,\n', r"not a table \(.*\)\. Save it as CSV in UTF-8"),
    ],
)
def test_damaged(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)


def test_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be opened"):
        read_catalogue(tmp_path / "lost.csv")


def test_facts_fill_and_override() -> None:
    record = Record(
        record_id="a", acceleration=np.zeros(2), time_step=0.01, station="89146", event="given"
    )
    known = replace(record, **stated_facts(CatalogueEntry(file="a", station="CLC", magnitude=7.1)))
    assert (known.station, known.event, known.magnitude) == ("CLC", "given", 7.1)
    assert math.isnan(known.epicentral_distance)


def test_velocity_of_shear_waves_may_be_stated(tmp_path: Path) -> None:
    entries = read(tmp_path, f"{HEADER},{VS30}\nA.V1,,,,,,,362\nB.V1,,,,,,,\n")
    record = Record(record_id="a", acceleration=np.zeros(2), time_step=0.01)
    assert replace(record, **stated_facts(entries["A.V1"])).vs30 == 362.0
    assert math.isnan(replace(record, **stated_facts(entries["B.V1"])).vs30)
    write_catalogue(tmp_path / "again.csv", entries.values())
    assert read_catalogue(tmp_path / "again.csv")["A.V1"].vs30 == 362.0


def test_own_catalogues_may_leave_out_columns(tmp_path: Path) -> None:
    entry = read(tmp_path, "file,magnitude,distance_rrup_km\nA.V1,7.1,3.2\n")["A.V1"]
    assert (entry.magnitude, entry.distance_rrup, entry.event) == (7.1, 3.2, "")


def test_the_site_may_be_stated(tmp_path: Path) -> None:
    entries = read(tmp_path, "file,site\nA.V1,free-field\nB.V1,Structure\nC.V1,\n")
    record = Record(record_id="a", acceleration=np.zeros(2), time_step=0.01)
    kept = replace(record, site_type=SiteType.BOREHOLE)
    known = [stated_facts(entries[name]) for name in ("A.V1", "B.V1", "C.V1")]
    found = [replace(kept, **facts).site_type for facts in known]
    assert found == [SiteType.FREE_FIELD, SiteType.STRUCTURE, SiteType.BOREHOLE]
    write_catalogue(tmp_path / "again.csv", entries.values())
    assert read_catalogue(tmp_path / "again.csv")["B.V1"].site_type is SiteType.STRUCTURE
    with pytest.raises(InputError, match=r":2: site 'roof'\. Must be one of: unknown, free-field"):
        read(tmp_path, "file,site\nA.V1,roof\n")


def test_a_foreign_file_of_one_long_line_has_a_short_message(tmp_path: Path) -> None:
    path = tmp_path / "catalogue.csv"
    path.write_text("x" * 100_000, encoding="utf-8")
    with pytest.raises(InputError, match=r"column 'xxx.* \.\.\. ") as caught:
        read_catalogue(path)
    assert len(caught.value.reason) < 700
