"""Fixtures: the folder of shared records, and small PEER and CSMIP V1 files of given samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import pytest

from rockframe.ingest import collection

ROOT = Path(__file__).resolve().parents[2]

At2 = Callable[..., bytes]
V1 = Callable[..., bytes]


#: Before the other tests replace it.
_WORKER_COUNT = collection.worker_count


@pytest.fixture(autouse=True)
def readers_in_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read files in worker processes, as users do."""
    monkeypatch.setattr(collection, "worker_count", _WORKER_COUNT)


@pytest.fixture(scope="session")
def shared_records() -> Path:
    """Return the folder of real files, which may not be redistributed; skip if it is absent."""
    folder = ROOT.parent / "shared" / "records"
    if not folder.is_dir():
        pytest.skip("no folder 'shared/records' beside the repository")
    return folder


@pytest.fixture(scope="session")
def shared_reports() -> Path:
    """Return the folder of inputs that failed; skip if it is absent."""
    folder = ROOT.parent / "shared" / "reports"
    if not folder.is_dir():
        pytest.skip("no folder 'shared/reports' beside the repository")
    return folder


def _at2(
    values: Iterable[str] = (".1", "-.2", ".3"),
    sizes: str = "NPTS= 3, DT= .0050 SEC",
    title: str = "San Fernando, 2/9/1971, Pacoima Dam (upper left abut), 164",
    units: str = "ACCELERATION TIME SERIES IN UNITS OF G",
    columns: int = 5,
    end: str = "\n",
) -> bytes:
    tokens = list(values)
    rows = [
        "  ".join(["", *tokens[start : start + columns]])
        for start in range(0, len(tokens), columns)
    ]
    return end.join(["PEER NGA STRONG MOTION DATABASE RECORD", title, units, sizes, *rows]).encode()


@pytest.fixture(scope="session")
def at2() -> At2:
    """Return a function that makes a PEER AT2 file (default: three samples, on line 5)."""
    return _at2


def v1_channel(label: str = " 90 Deg", samples: Sequence[float] = (0.1, -0.2, 0.3)) -> list[str]:
    """Return the lines of one channel of a CSMIP V1 file."""
    count = len(samples)
    text = "".join(f"{sample:9.6f}" for sample in samples)
    integers = [0] * 100
    integers[16:24] = [3, 19, 40, 48, 187, 7, 6, 2019]
    integers[27] = integers[32] = count
    return [
        "Uncorrected Accelerogram Data             Processed: 07/06/19, CGS",
        "Rcrd of Fri Jul  5, 2019 20:19:40.04 PDT",
        "                                        (Origin:  To be determined)",
        "38457511.CI.CCC.--.HN                Start time:  7/06/19, 03:19:40.04 UTC (GPS)",
        "Station Id. CCC     35.525N, 117.365W    Q330    s/n 4114",
        "China Lake NWC, Christmas Canyon Rd.     SCSN   Data: Acceleration",
        f"Chan  1: {label}",
        "",
        "Hypocenter:  To be determined.               ML:  To be determined.",
        "Instr Period =  .0050 sec",
        f"No. of Points ={count:7d}  Record Length = {count / 100:.3f} sec   at 100 Samples/sec",
        "Units of uncor data are sec and g.",
        "RMS calc for complete record =        .",
        *("".join(f"{item:5d}" for item in integers[row : row + 16]) for row in range(0, 100, 16)),
        *["  .0050000"] * 7,
        f"{count:6d} Accelerogram points at 100 pts/sec in units of g.       Format: (8f9.6)",
        *(text[start : start + 72] for start in range(0, len(text), 72)),
        "/&  ----------  End of Data for Station Channel   1  ----------",
    ]


def _v1(*channels: list[str], end: str = "\r\n") -> bytes:
    lines = [line for channel in channels or (v1_channel(),) for line in channel]
    return end.join([*lines, ""]).encode()


@pytest.fixture(scope="session")
def v1() -> V1:
    """Return a function that makes a CSMIP V1 file (default: one with 3 samples, on line 29)."""
    return _v1


@pytest.fixture(scope="session")
def channel() -> Callable[..., list[str]]:
    """Return the function that makes the lines of one channel, so that tests can damage them."""
    return v1_channel
