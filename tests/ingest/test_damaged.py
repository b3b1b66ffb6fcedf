"""Each damaged file reads with exactly the samples of the good one, or is rejected with a reason.

Damage that no reader can detect is left out: another digit in a number, or a table without a
stated count that ends with a complete row. test_isolation covers crashes and hangs of a reader.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.ingest import (
    ReadOptions,
    collect,
    read_bytes,
    read_file,
    sorted_out,
)
from rockframe.ingest.files import read_outcomes
from rockframe.outcome import InputOutcome
from rockframe.record import Record

from .damage import Case, at2_cases, good_at2, good_table, table_cases, v1_cases

V1_FILE = Path(__file__).resolve().parents[2] / "records/ridgecrest2019/Ridgecrest2019-CCC.V1"
GOOD = {"AT2": good_at2(), "V1": V1_FILE.read_bytes(), "csv": good_table()}
CASES = [*at2_cases(), *v1_cases(GOOD["V1"]), *table_cases()]


def samples(records: list[Record]) -> list[tuple[float, bytes]]:
    return [(record.time_step, record.acceleration.tobytes()) for record in records]


GOOD_SAMPLES = {kind: samples(read_bytes(f"good.{kind}", data)) for kind, data in GOOD.items()}


def test_there_are_enough() -> None:
    assert len(CASES) >= 60


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.name}: {case.damage}")
def test_reads_right_or_is_refused(case: Case, tmp_path: Path) -> None:
    path = tmp_path / case.name
    path.write_bytes(case.data)
    [outcome] = read_outcomes(path, ReadOptions())
    if case.words:
        assert isinstance(outcome, InputOutcome), "read, but must be refused"
        where = outcome.reason if outcome.line is None else f"{outcome.line}: {outcome.reason}"
        assert re.search(case.words, where), where
        assert len(outcome.reason.split()) > 1
        assert "\n" not in outcome.reason
    else:
        assert isinstance(outcome, list), outcome
        [kind] = [kind for kind in GOOD if kind in case.name]
        assert samples([one.record for one in outcome]) == GOOD_SAMPLES[kind]


def test_all_in_one_folder_through_a_worker(tmp_path: Path) -> None:
    for number, case in enumerate(CASES):
        (tmp_path / f"{number:03d} {case.name}").write_bytes(case.data)
    outcomes = list(collect([tmp_path]))
    alone = sorted_out(outcomes)
    apart = sorted_out(collect([tmp_path], workers=1))
    assert [r.record_id for r in alone[0]] == [r.record_id for r in apart[0]]
    assert samples(alone[0]) == samples(apart[0])
    assert alone[1] == apart[1]
    rows = {r.source_file.split(":")[0] for r in alone[0]} | {
        r.file.split(":")[0] for r in outcomes if not isinstance(r, Record)
    }
    assert len(rows) == len(CASES)


def damaged_copies(data: bytes) -> Iterator[tuple[str, bytes]]:
    lines = data.split(b"\n")
    for number in {1, 2, 3, 4, 5, len(lines) // 2, len(lines) - 2, len(lines) - 1}:
        yield f"without line {number}", b"\n".join(lines[: number - 1] + lines[number:])
    for share in (0.1, 0.5, 0.9):
        yield f"{share} of it", data[: int(share * len(data))]
    for cut in (1, 2, 3, 5, 8):
        yield f"{cut} bytes less", data[:-cut]
    yield "NaN", re.sub(rb"\d\s+$", b"NaN", data)


@pytest.mark.parametrize(
    "name", ["A-BPL160", "IMPVALL_E04-140_example1", "NIS090", "RSN77_SFERN_PUL164", "elCentro"]
)
def test_real_at2(name: str, shared_records: Path) -> None:
    path = shared_records / "formats" / "peer_at2" / f"{name}.AT2"
    good = samples(read_file(path))
    for damage, copy in damaged_copies(path.read_bytes()):
        try:
            found = samples(read_bytes("damaged.AT2", copy))
        except InputError as error:
            found = good if len(error.reason.split()) > 1 else []
        assert found == good, damage
