from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import read_bytes
from rockframe.record import Orientation

PATH = Path("20170720223109_0921.txt")
Row = tuple[float, float, float]
ROWS: tuple[Row, ...] = ((0.1, -0.2, 0.3), (-0.4, 0.5, -0.6))


def afad(rows: tuple[Row, ...] = ROWS) -> str:
    north, east, up = np.abs(np.array(rows)).max(axis=0)
    return "\r\n".join(
        [
            "STRONG GROUND MOTION RECORDS OF TURKIYE",
            "PLACE                   : AYD\xddN GERMENCIK",
            "EARTHQUAKE DATE         : 2017/07/20 22:31:09 (GMT)",
            "EARTHQUAKE MAGNITUDE    : 6.5 Mw",
            "STATION ID              : 0921",
            "RECORD TIME             : 20/07/2017 22:30:58.000000 (GMT)",
            f"NUMBER OF DATA          : {len(rows)}",
            "SAMPLING INTERVAL (sec) : 0.01",
            f"RAW PGA VALUES (gal)    : (N-S) {north:.6f} (E-W) {east:.6f} (U-D) {up:.6f}",
            "Copyright EARTHQUAKE DEPARTMENT",
            "       N-S          E-W          U-D",
            *(f"{a:12.6f}  {b:12.6f} {c:12.6f}" for a, b, c in rows),
            "",
        ]
    )


def test_facts() -> None:
    records = read_bytes(PATH, afad().encode("latin-1"))
    assert [r.record_id for r in records] == [f"{PATH.stem}-{c}" for c in ("N-S", "E-W", "U-D")]
    assert [r.azimuth for r in records[:2]] == [0.0, 90.0]
    assert records[2].orientation is Orientation.VERTICAL
    assert {(r.station, r.magnitude, r.time_step, r.uncorrected) for r in records} == {
        ("0921", 6.5, 0.01, True)
    }
    assert records[0].start_time == "2017-07-20T22:30:58.000000Z"
    assert records[0].event == "2017/07/20 22:31:09 (GMT)"


@given(
    st.lists(
        st.tuples(*[st.integers(-(10**9), 10**9).map(lambda n: n / 1e6)] * 3),
        min_size=2,
        max_size=20,
    )
)
def test_round_trip(rows: list[Row]) -> None:
    records = read_bytes(PATH, afad(tuple(rows)).encode("latin-1"))
    found = np.column_stack([record.acceleration for record in records])
    assert np.array_equal(found, np.array(rows) * 0.01)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.500000   ", "   ", r":13: 2 columns\. Must be 3"),
        ("-0.400000", "-0.400000 1.0", r":13: 4 columns\. Must be 3"),
        ("-0.400000", "nan", r":13: acceleration 'nan'"),
        ("DATA          : 2", "DATA          : 3", r":7: NUMBER OF DATA 3 in the header, 2 rows"),
        ("DATA          : 2", "DATA          : x", r":7: NUMBER OF DATA 'x'\. Must be a whole"),
        ("DATA          : 2", "DATA          :", r"no 'NUMBER OF DATA' in the header"),
        ("(sec) : 0.01", "(sec) : 10 ms", r":8: SAMPLING INTERVAL \(sec\) '10 ms'\. Must be a num"),
        ("(sec) : 0.01", "(sec) : 0.0", r":8: time step 0\.0 s\. Must be positive"),
        ("(E-W) 0.500000", "(E-W) 0.700000", r":9: peak 0\.7 gal E-W stated, but 0\.5 gal"),
        ("(E-W) 0.500000", "", r":9: RAW PGA VALUES .*Must be three values, one for \(E-W\)"),
        ("N-S          E-W", "E-W          N-S", r"no line 'N-S E-W U-D' above the samples"),
    ],
)
def test_damaged(old: str, new: str, message: str) -> None:
    text = afad()
    before, _, after = text.rpartition(old)
    assert after
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, (before + new + after).encode("latin-1"))


def test_truncated() -> None:
    with pytest.raises(InputError, match=r":7: NUMBER OF DATA 2 in the header, 1 rows"):
        read_bytes(PATH, "\n".join(afad().splitlines()[:12]).encode("latin-1"))
