from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from rockframe.ingest import read_file

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

FILES = {
    "ESMDYNA": ("esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC", ["HI.ARS1..HNE"]),
    "GEONET": (
        "geonet/20180212_211557_WPWS_20.V2A",
        [".WPWS..S16W", ".WPWS..S74E", ".WPWS..UP"],
    ),
    "AFAD": ("afad/20170720223109_0921.txt", [".0921..N-S", ".0921..E-W", ".0921..U-D"]),
}


def obspy_read(*arguments: object, **options: object) -> Any:
    from obspy import read

    return read(*arguments, **options)


@pytest.mark.parametrize("name", FILES)
def test_read_by_name(shared_records: Path, name: str) -> None:
    file, ids = FILES[name]
    path = shared_records / "formats" / file
    stream = obspy_read(BytesIO(path.read_bytes()), format=name)
    records = read_file(path)
    assert [trace.id for trace in stream] == ids
    for trace, record in zip(stream, records, strict=True):
        assert trace.data.tolist() == record.acceleration.tolist()
        assert trace.stats[name.lower()].units == "m s-2"


@pytest.mark.parametrize("name", FILES)
def test_detection_and_header_alone(shared_records: Path, name: str) -> None:
    path = shared_records / "formats" / FILES[name][0]
    stream = obspy_read(str(path), headonly=True)
    assert {trace.stats["_format"] for trace in stream} == {name}
    assert {len(trace.data) for trace in stream} == {0}
    assert all(trace.stats.npts > 1000 for trace in stream)
