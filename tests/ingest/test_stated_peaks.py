"""A peak stated in a header must have the size, sign and time of the samples' peak."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.ingest.imitations import records_of

from rockframe.errors import InputError
from rockframe.ingest import read_bytes, read_file
from rockframe.record import Record

from .test_esm import esm

TITLE = "ACCELERATION TIME HISTORY IN UNITS OF G,  "
AT2, V1, ESM = Path("E04-140.AT2"), Path("CCC.V1"), Path("ARS1.ASC")
Lines = list[str]


@pytest.mark.parametrize(
    "stated", ["PGA=   .30000 G", "PGA= -.3 G, PGV= 39.62 CM/SEC", "PGA=.3001 G"]
)
def test_at2(at2: Callable[..., bytes], stated: str) -> None:
    [record] = read_bytes(AT2, at2((".1", ".2", "-.3"), units=TITLE + stated))
    assert record.peak_ratio == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ("PGA=   .48431 G", r"AT2:3: peak 0.48431 g stated, but -0.3 g in the file"),
        ("PGA= 294.2 CM/SEC2", r"AT2:3: PGA in units of 'CM/SEC2'. Must be g."),
        ("PGA= .3.0 G", r"AT2:3: peak acceleration '.3.0'. Must be a finite number"),
        ("PGA= nan G", r"AT2:3: peak acceleration 'nan'"),
    ],
)
def test_at2_of_another_peak(at2: Callable[..., bytes], stated: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_bytes(AT2, at2((".1", ".2", "-.3"), units=TITLE + stated))


def test_a_minus_is_a_statement_where_a_plus_is_none(at2: Callable[..., bytes]) -> None:
    with pytest.raises(InputError, match=r"peak -0.3 g stated, but 0.3 g in the file"):
        read_bytes(AT2, at2(units=TITLE + "PGA= -.30000 G"))


def test_no_peak_stated_is_no_peak_compared(at2: Callable[..., bytes]) -> None:
    assert math.isnan(read_bytes(AT2, at2())[0].peak_ratio)


def with_peak(lines: Lines, peak: str, real: str = "") -> bytes:
    """Return a channel of 0.1, -0.2, 0.3 g with peaks in the text and in the real header."""
    lines = [*lines]
    lines[11] = f"Units of uncor data are sec and g.         Max  = {peak}"
    lines[20] = "  .0050000" * 6 + (real or "  .0000000  .0000000")
    return "\n".join([*lines, ""]).encode()


@pytest.mark.parametrize(
    ("peak", "real"),
    [
        (".300 g, at   .020 sec.", ""),
        (".300 g , at .020 sec.", "  .3000000  .0200000"),
        ("", "-999.00000-999.00000"),
    ],
)
def test_csmip_v1(channel: Callable[..., Lines], peak: str, real: str) -> None:
    [record] = read_bytes(V1, with_peak(channel(), peak, real))
    assert record.peak_ratio == pytest.approx(1.0) or not peak


@pytest.mark.parametrize(
    ("peak", "real", "words"),
    [
        ("-.300 g, at .020 sec.", "", r"V1:12: peak -0.3 g stated, but 0.3 g"),
        (".400 g, at .020 sec.", "", r"V1:12: peak 0.4 g stated"),
        (".300 g, at 2.000 sec.", "", r"V1:12: peak stated at 2 s, but at 0.02 s in the file"),
        ("", "  .3010000  .0200000", r"V1:21: peak 0.301 g stated"),
        ("", "  .3000000  .5000000", r"V1:21: peak stated at 0.5 s"),
    ],
)
def test_csmip_v1_of_another_peak(
    channel: Callable[..., Lines], peak: str, real: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        read_bytes(V1, with_peak(channel(), peak, real))


def timed(stated: str, time: str) -> bytes:
    text = esm().replace("PGA_CM/S^2: 0.300022", f"PGA_CM/S^2: {stated}\nTIME_PGA_S: {time}")
    return text.encode()


def test_esm_states_sign_and_time() -> None:
    assert read_bytes(ESM, timed("0.300022", "0.010000"))[0].peak_ratio == 1.0
    assert read_bytes(ESM, timed("0.300022", ""))[0].peak_ratio == 1.0
    for stated, time, words in (
        ("-0.300022", "0.010000", "peak -0.300022 cm/s2 stated, but 0.300022 cm/s2"),
        ("0.300022", "1.000000", "peak stated at 1 s, but at 0.01 s in the file"),
        ("0.300022", "late", "time of the peak 'late'. Must be a finite number"),
    ):
        with pytest.raises(InputError, match=words):
            read_bytes(ESM, timed(stated, time))


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("peer_at2/A-BPL160.AT2", 0.1, 40.0),
        ("peer_at2/IMPVALL_E04-140_example1.AT2", 0.05, math.nan),
        ("csmip/CE89146.V2", 0.3, 40.0),
        ("csmip/ce36456p_CE36456.V2", 0.1, 23.0),
        ("geonet/20180212_211557_WPWS_20.V2A", 0.25, 24.5),
        ("esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC", 0.1, 30.0),
        ("smc/0111a.smc", 0.1, math.nan),
        ("cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c", 0.03, 20.0),
        ("smc/0165a_u.smc", math.nan, math.nan),
        ("csmip/CE89146.V1", math.nan, math.nan),
    ],
)
def test_the_archives_filters(name: str, low: float, high: float) -> None:
    for record in records_of(name):
        assert (record.filter_low, record.filter_high) == pytest.approx((low, high), nan_ok=True)


def test_every_channel_of_ridgecrest_has_the_peak_that_its_header_states(
    shared_records: Path,
) -> None:
    records: list[Record] = []
    for name in ("CICCC.RAW", "CICLC.v1", "CITOW2.RAW"):
        records += read_file(shared_records / "ridgecrest2019" / name)
    assert len(records) == 9
    assert all(record.peak_ratio == pytest.approx(1.0, abs=2e-5) for record in records)
