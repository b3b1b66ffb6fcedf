"""Coverage: the received samples are compared with the requested span."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from obspy import UTCDateTime
from tests.conftest import examples

from rockframe.errors import InputError
from rockframe.fetch.coverage import Coverage, measure, read_whole

from .centre import miniseed, waveform

START = UTCDateTime("2019-07-06T03:19:43Z")


def measured(*pieces: tuple[float, float], channel: str = "HNE") -> Coverage:
    """Return the coverage of one minute by pieces, each given by its start and duration [s]."""
    traces = [waveform("CLC", channel, str(START + begin), last) for begin, last in pieces]
    span = (str(START), str(START + 60.0))
    return measure("XX.CLC.--.HNE", span, read_whole("x", miniseed(*traces)))


def test_whole() -> None:
    row = measured((0.0, 60.0))
    assert row.complete
    assert (row.received_start, row.received_end) == (str(START), str(START + 60.0))
    assert row.samples == 6001


def test_more_than_asked_is_whole() -> None:
    assert measured((-5.0, 75.0)).complete


def test_one_sample_is_forgiven() -> None:
    assert measured((0.01, 59.98)).complete


def test_late_and_early() -> None:
    assert measured((12.0, 40.0)).verdict == "starts 12 s late; ends 8 s early"


def test_gap() -> None:
    row = measured((0.0, 20.0), (25.0, 35.0))
    assert row.verdict == f"gap of 4.99 s before {START + 25.0}"
    assert not row.complete


def test_overlap() -> None:
    row = measured((0.0, 30.0), (20.0, 40.0))
    assert row.verdict == f"overlap of 10.01 s at {START + 20.0}"


@pytest.mark.parametrize(
    ("begin", "verdict"),
    [(30.01, "complete"), (30.02, "gap of 0.01 s before"), (30.0, "overlap of 0.01 s at")],
)
def test_one_sample_that_is_lost_or_received_twice_is_named(begin: float, verdict: str) -> None:
    """At 100 Hz the sample after that of 30 s is that of 30.01 s."""
    assert measured((0.0, 30.0), (begin, 60.0 - begin)).verdict.startswith(verdict)


def test_adjoining_pieces_are_whole() -> None:
    assert measured((0.0, 29.99), (30.0, 30.0)).complete


def test_another_channel() -> None:
    row = measured((0.0, 60.0), channel="BHE")
    assert row.verdict == "XX.CLC.--.BHE received, but XX.CLC.--.HNE alone was requested"


def test_sampling_rate_that_changes() -> None:
    slow = waveform("CLC", "HNE", str(START + 30.0), 30.0)
    slow.decimate(2, no_filter=True)
    slow.data = slow.data.astype("int32")
    fast = waveform("CLC", "HNE", str(START), 29.99)
    row = measure(
        "XX.CLC.--.HNE", (str(START), str(START + 60.0)), read_whole("x", miniseed(fast, slow))
    )
    assert "2 sampling rates: [50.0, 100.0] Hz" in row.verdict


@given(begin=st.integers(2, 3000), length=st.integers(100, 2000))
@examples(20)
def test_missing_ends_add_up(begin: int, length: int) -> None:
    row = measured((begin / 100.0, length / 100.0))
    assert row.missing_start + row.missing_end == pytest.approx(60.0 - length / 100.0, abs=1e-6)


@given(cut=st.integers(1, 4000))
@examples(40)
def test_no_cut_is_read(cut: int) -> None:
    body = miniseed(waveform("CLC", "HNE", str(START), 60.0))
    cut %= len(body)
    if cut % 512 == 0:
        return
    with pytest.raises(
        InputError, match=r"truncated: the last record|no valid miniSEED record at byte"
    ):
        read_whole("x", body[:cut])


def test_damaged_samples_are_refused() -> None:
    body = bytearray(miniseed(waveform("CLC", "HNE", str(START), 60.0)))
    body[600] ^= 0xFF
    body[700] ^= 0xFF
    with pytest.raises(InputError, match=r"samples cannot be unpacked \("):
        read_whole("x", bytes(body))


@given(place=st.integers(0, 511), value=st.integers(0, 255))
@examples(60)
def test_a_damaged_record_is_read_or_refused(place: int, value: int) -> None:
    body = bytearray(miniseed(waveform("CLC", "HNE", str(START), 5.0)))
    body[place] = value
    with suppress(InputError):  # no other error or warning may escape
        stream = read_whole("x", bytes(body))
        assert measure("XX.CLC.--.HNE", (str(START), str(START + 5.0)), stream).verdict
