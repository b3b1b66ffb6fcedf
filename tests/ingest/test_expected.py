"""Every real file reads with the numbers of the shared table, or is rejected."""

from __future__ import annotations

import csv
import zipfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.ingest.imitations import content
from tests.ingest.shared import CLAIMED

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, read_bytes, read_file
from rockframe.record import Orientation, Record


def signed_peak(record: Record) -> float:
    """Return the sample of largest absolute value [g]."""
    return float(record.acceleration[np.abs(record.acceleration).argmax()]) / 9.81


def facts(records: list[Record]) -> list[tuple[int, float, float]]:
    return [(r.acceleration.size, r.time_step, signed_peak(r)) for r in records]


def close(rows: list[tuple[int, float, float]]) -> list[Any]:
    """Return rows with peaks that may differ by 1e-6, because the table prints six decimals."""
    return [(samples, step, pytest.approx(peak, abs=1e-6)) for samples, step, peak in rows]


@pytest.fixture(scope="module")
def table(shared_records: Path) -> dict[str, list[tuple[int, float, float]]]:
    found = defaultdict(list)
    with (shared_records / "EXPECTED.tsv").open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream, delimiter="\t"):
            if row["samples"]:
                fact = int(row["samples"]), float(row["time_step_s"]), float(row["pga"])
                found[row["file"]].append(fact)
    return found


@pytest.mark.parametrize(
    "name",
    [
        "A-BPL160",
        "IMPVALL_E04-140_example1",
        "NIS090",
        "RSN1_HELENA.A_A-HMC180",
        "RSN77_SFERN_PUL164",
        "elCentro",
    ],
)
def test_peer_at2(
    name: str, shared_records: Path, table: dict[str, list[tuple[int, float, float]]]
) -> None:
    path = shared_records / "formats" / "peer_at2" / f"{name}.AT2"
    assert facts(read_file(path)) == close(table[path.name])


def test_csmip_v1(shared_records: Path, table: dict[str, list[tuple[int, float, float]]]) -> None:
    path = shared_records / "formats" / "csmip" / "CE89146.V1"
    assert facts(read_file(path)) == close(table[path.name])


def of_standard_gravity(facts_in_g: list[tuple[int, float, float]]) -> list[Any]:
    """Convert peaks of files in cm/s2: the table uses the conventional g, 980.665 cm/s2."""
    return close([(samples, step, peak * 9.80665 / 9.81) for samples, step, peak in facts_in_g])


@pytest.mark.parametrize(
    "name",
    [
        "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c",
        "csmip/CE89146.V2",
        "csmip/ce36456p_CE36456.V2",
        "csmip/chan001.v2",
        "smc/0111a.smc",
        "smc/0165a_u.smc",
        "smc/np01002p_4225a_a.smc",
    ],
)
def test_centimetres(
    name: str, shared_records: Path, table: dict[str, list[tuple[int, float, float]]]
) -> None:
    path = shared_records / "formats" / name
    assert facts(read_file(path)) == of_standard_gravity(table[path.name])


def test_csmip_v2_in_an_archive(
    shared_records: Path, table: dict[str, list[tuple[int, float, float]]]
) -> None:
    path = shared_records / "formats" / "csmip" / "ce14196p.zip"
    with zipfile.ZipFile(path) as archive:
        [name] = [member for member in archive.namelist() if member.endswith(".V2")]
        records = read_bytes(name, archive.read(name))
    assert facts(records) == of_standard_gravity(table[path.name])


def test_cosmos_counts(
    shared_records: Path, table: dict[str, list[tuple[int, float, float]]]
) -> None:
    path = shared_records / "formats" / "cosmos" / "NP1795-n.305.v0c"
    records = read_file(path)
    # 0.794729 microvolts a count and 1.2 V/g are items 22 and 42 of the real header.
    per_count = 0.794729e-6 / 1.2
    assert facts(records) == close(
        [(samples, step, per_count * counts) for samples, step, counts in table[path.name]]
    )
    assert [record.component for record in records] == ["090", "360", "UP"]
    assert all("counts converted" in record.processing[0] for record in records)


@pytest.mark.parametrize(
    ("name", "component", "station", "start"),
    [
        ("csmip/chan001.v2", "UP", "58658", "2021-04-26T17:09:54.0Z"),
        ("csmip/CE89146.V2", "360", "89146", "2012-02-13T21:06:45.0Z"),
        ("csmip/ce36456p_CE36456.V2", "090", "36456", ""),
        ("cosmos/NP1795-n.305.v0c", "090", "1795", "2019-05-05T06:47:39.932Z"),
        ("smc/0165a_u.smc", "090", "CA:Alhambra;LACPW, 12th Fl", ""),
    ],
)
def test_identity(
    name: str, component: str, station: str, start: str, shared_records: Path
) -> None:
    record = read_file(shared_records / "formats" / name)[0]
    assert (record.component, record.station, record.start_time) == (component, station, start)


@pytest.mark.parametrize(
    ("name", "processing"),
    [
        ("csmip/CE89146.V2", "archive: band-pass 0.3 to 40 Hz (3 dB)"),
        ("csmip/ce36456p_CE36456.V2", "archive: band-pass, ramps 0.05 to 0.1 and 23 to 25 Hz"),
        (
            "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c",
            "archive: band-pass 0.03 to 20 Hz",
        ),
    ],
)
def test_stated_processing(name: str, processing: str, shared_records: Path) -> None:
    assert processing in read_file(shared_records / "formats" / name)[0].processing


@pytest.mark.parametrize(
    ("name", "samples", "step", "peak"),
    [
        ("erzincan1992_EW", 4156, 0.005, -0.496185),
        ("kobe1995_Takarazuka-000", 3930, 0.01, -0.693442),
        ("northridge1994_Jensen-022", 5713, 0.005, 0.570622),
        ("parkfield1966_CO2-065", 4166, 0.01, 0.475852),
        ("sanfernando1971_PacoimaDam-164", 4098, 0.01, 1.22591),
        ("sansalvador1986_GIC-180", 1805, 0.005, 0.420834),
    ],
)
def test_table1(peer_records: Path, name: str, samples: int, step: float, peak: float) -> None:
    [record] = read_file(peer_records / f"{name}.csv")
    assert (record.record_id, record.acceleration.size) == (name, samples)
    assert record.time_step == step
    assert signed_peak(record) == pytest.approx(peak, abs=1e-6)


@pytest.mark.parametrize(
    ("station", "peaks"),
    [
        ("CCC", (-0.566659, -0.471006, -0.361179)),
        ("CLC", (0.34425, 0.510799, 0.347089)),
        ("TOW2", (0.437307, 0.386348, 0.359919)),
    ],
)
def test_bundled(bundled_records: Path, station: str, peaks: tuple[float, ...]) -> None:
    records = read_file(bundled_records / f"Ridgecrest2019-{station}.V1")
    assert facts(records) == close([(10000, 0.01, peak) for peak in peaks])
    assert [r.record_id.rsplit("-", 1)[1] for r in records] == ["090", "360", "UP"]
    assert [r.azimuth for r in records[:2]] == [90.0, 360.0]
    assert records[2].orientation is Orientation.VERTICAL
    assert {(r.network, r.station, r.uncorrected) for r in records} == {("CI", station, True)}


@pytest.mark.parametrize(
    ("name", "samples"),
    [
        ("CICCC.RAW", [35430, 35402, 35406]),
        ("CICLC.v1", [31932, 32080, 32190]),
        ("CITOW2.RAW", [35562, 35540, 35710]),
    ],
)
def test_untrimmed(shared_records: Path, name: str, samples: list[int]) -> None:
    records = read_file(shared_records / "ridgecrest2019" / name)
    assert [record.acceleration.size for record in records] == samples


def test_trimmed_is_part_of_untrimmed(shared_records: Path, bundled_records: Path) -> None:
    whole = read_file(shared_records / "ridgecrest2019" / "CICLC.v1")[1].acceleration
    part = read_file(bundled_records / "Ridgecrest2019-CLC.V1")[1].acceleration
    assert np.array_equal(whole[2650 * 8 :][:10000], part)


@pytest.mark.parametrize(("name", "known"), CLAIMED.items())
def test_each_file_is_claimed_rightly(name: str, known: str) -> None:
    head = content(name)[:4096]
    assert [entry.name for entry in FORMATS if entry.sniff(head)] == [known] * bool(known)


def test_velocity_is_refused(shared_records: Path) -> None:
    path = shared_records / "formats" / "peer_at2" / "RSN88_SFERN_FSD172.VT2"
    with pytest.raises(InputError, match=r"VT2:3: is a velocity time series, not an accel"):
        read_file(path)


@pytest.mark.parametrize("name", ["CHV1-20140203E.txt", "tabasFN.txt"])
def test_unstated_units_are_refused(shared_records: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"acceleration units unstated.*--units"):
        read_file(shared_records / "formats" / "text" / name)


def test_spectra_are_refused(shared_records: Path) -> None:
    with pytest.raises(InputError, match=r"V3:1: response and Fourier spectra \(CSMIP volume 3\)"):
        read_file(shared_records / "formats" / "csmip" / "CE89146.V3")
