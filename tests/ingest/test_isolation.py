from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from rockframe.engines.pool import Limits
from rockframe.errors import InputError, ParameterError
from rockframe.ingest import ReadOptions, collect, sorted_out
from rockframe.ingest.collection import serve, worker_count
from rockframe.ingest.files import read_outcomes
from rockframe.options.ingest import IngestOptions
from rockframe.outcome import InputOutcome
from rockframe.stages.ingest import ingest_stage

TABLE = "time_s,acc_g\n0.00,0.1\n0.01,0.2\n0.02,-0.1\n"
#: A reader that behaves as the file's name says; workers import it from the test's folder.
READER = """
import os, time
from rockframe.ingest import files as real

def read_outcomes(path, options):
    if "crash" in path.name:
        os.abort()
    if "hang" in path.name:
        time.sleep(60)
    if "bug" in path.name:
        raise IndexError("list index out of range")
    if "print" in path.name:
        print("a reader that prints")
    yield from real.read_outcomes(path, options)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "records").mkdir()
    for name in "abcdef":
        (tmp_path / "records" / f"{name}.csv").write_text(TABLE)
    return tmp_path / "records"


@pytest.fixture
def bad_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bad_reader.py").write_text(READER)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    import bad_reader  # type: ignore[import-not-found]

    # Collecting now sends the bad reader to the workers.
    monkeypatch.setattr(
        sys.modules["rockframe.ingest.collection"], "read_outcomes", bad_reader.read_outcomes
    )


@pytest.fixture
def many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use several workers even for small inputs."""
    monkeypatch.setattr("rockframe.ingest.collection._BYTES_A_WORKER", 1)


@pytest.mark.usefixtures("bad_reader", "many")
def test_a_bad_file_is_a_row_and_the_others_are_read(folder: Path) -> None:
    for name in ("bug", "crash", "print"):
        (folder / f"c-{name}.csv").write_text(TABLE)
    records, rejections = sorted_out(collect([folder], workers=2))
    assert [r.record_id for r in records] == ["a", "b", "c-print", "c", "d", "e", "f"]
    assert [(r.file, r.reason) for r in rejections] == [
        (
            "c-bug.csv",
            "the reader crashed (IndexError: list index out of range).",
        ),
        ("c-crash.csv", "the reader crashed (signal 6, Aborted)."),
    ]


@pytest.mark.usefixtures("bad_reader", "many")
def test_a_file_that_takes_too_long_is_a_row_and_the_next_has_its_turn(tmp_path: Path) -> None:
    """All files hang, because even a good file might exceed the limit on a busy machine."""
    files = [tmp_path / f"hang-{number}.csv" for number in range(2)]
    for file in files:
        file.write_text(TABLE)
    records, rejections = sorted_out(collect(files, workers=1, limits=Limits(seconds=0.5)))
    assert not records
    assert [(r.file, r.reason) for r in rejections] == [
        (file.name, "timed out after 0.5 s while reading.") for file in files
    ]


def test_memory(folder: Path) -> None:
    rows = "".join(f"{i / 100:.2f},0.1\n" for i in range(400_000))
    (folder / "large.csv").write_text("time_s,acc_g\n" + rows)
    records, [rejection] = sorted_out(collect([folder], workers=1, limits=Limits(memory=24 << 20)))
    assert len(records) == 6
    assert rejection.reason == "ran out of memory (24 MB) while reading."


@pytest.mark.usefixtures("many")
def test_the_same_bytes_however_many_workers(
    folder: Path, bundled_records: Path, tmp_path: Path
) -> None:
    shutil.copy(bundled_records / "Ridgecrest2019-CLC.V1", folder)
    outputs = []
    for workers in (0, 2):
        path = tmp_path / f"{workers}.nc"
        ingest_stage([folder], path, workers=workers)
        outputs.append((path.read_bytes(), path.with_suffix(".csv").read_bytes()))
    assert outputs[0] == outputs[1]


def test_samples_stay_read_only(folder: Path) -> None:
    records, _ = sorted_out(collect([folder], workers=1))
    assert not records[0].acceleration.flags.writeable


def test_strict(folder: Path, tmp_path: Path) -> None:
    (folder / "b.csv").write_text("time_s,acc_g\n0.00,nan\n0.01,0.1\n")
    for workers in (0, 1):
        with pytest.raises(InputError, match=r"b\.csv:2: acceleration 'nan'"):
            ingest_stage(
                [folder], tmp_path / "out.nc", workers=workers, options=IngestOptions(strict=True)
            )
    assert not (tmp_path / "out.nc").exists()
    assert not (tmp_path / "out.csv").exists()


def test_strict_minds_records_that_cannot_be_processed(folder: Path, tmp_path: Path) -> None:
    (folder / "still.csv").write_text("time_s,acc_g\n0.00,0.0\n0.01,0.0\n")
    with pytest.raises(InputError, match=r"still\.csv: all 2 samples"):
        ingest_stage([folder], tmp_path / "out.nc", workers=0, options=IngestOptions(strict=True))


def test_values_before_a_crash_are_kept() -> None:
    with closing(serve(os.walk, [("/proc/self/task",)], 1, Limits())) as served:
        assert next(served).failure == ""
    with closing(serve(map, [(os._exit, [7])], 1, Limits())) as served:
        assert next(served).failure == "the reader crashed (exit status 7)."


def test_a_dead_worker_is_replaced() -> None:
    calls = [(abs, [-2]), (os._exit, [3]), (abs, [-1])]
    with closing(serve(map, calls, 1, Limits())) as served:
        assert [(list(s.values), bool(s.failure)) for s in served] == [
            ([2], False),
            ([], True),
            ([1], False),
        ]


def test_workers_do_not_run_far_ahead(tmp_path: Path) -> None:
    calls = [(Path.touch, [tmp_path / str(number)]) for number in range(20)]
    with closing(serve(map, calls, 1, Limits())) as served:
        next(served)
        assert len(list(tmp_path.iterdir())) <= 5
        assert len(list(served)) == 19
    assert len(list(tmp_path.iterdir())) == 20


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads /proc")
def test_closing_ends_the_workers() -> None:
    before = children()
    with closing(serve(map, [(abs, [-1]), (time.sleep, [60])], 2, Limits())) as served:
        assert list(next(served).values) == [1]
        assert children() > before
    assert children() == before


def children() -> set[str]:
    lists = [path.read_text().split() for path in Path("/proc/self/task").glob("*/children")]
    return {child for of_thread in lists for child in of_thread}


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes on this system")
def test_interrupt_leaves_no_orphan() -> None:
    program = (
        "import time\n"
        "from contextlib import closing\n"
        "from rockframe.ingest.collection import Limits, serve\n"
        "calls = [(abs, [-1]), (time.sleep, [60])]\n"
        "with closing(serve(map, calls, 1, Limits())) as served:\n"
        "    next(served)\n"
        "    print('up', flush=True)\n"
        "    next(served)\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    assert parent.stdout is not None
    parent.stdout.readline()
    os.killpg(parent.pid, signal.SIGINT)  # as a terminal does on Ctrl+C
    parent.wait(10)
    parent.stdout.close()
    with pytest.raises(ProcessLookupError):
        os.killpg(parent.pid, 0)


def test_limits_must_be_positive() -> None:
    with pytest.raises(ParameterError, match=r"Invalid limits 0 s.*Must be positive"):
        Limits(seconds=0)


def test_number_of_workers(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = sorted(folder.iterdir())
    assert worker_count(0, files) == 0
    assert worker_count(None, files) == 1
    monkeypatch.setattr("rockframe.ingest.collection._BYTES_A_WORKER", 1)
    assert worker_count(4, files) == 4
    assert worker_count(9, files) == 6
    with pytest.raises(ParameterError, match=r"Invalid number of workers -1\. Must be 0 or more"):
        worker_count(-1, files)


def test_attempt_is_what_workers_import() -> None:
    [outcome] = read_outcomes(Path("lost.AT2"), ReadOptions())
    assert outcome == InputOutcome("lost.AT2", "no such file.")


def test_killed_worker_is_no_fault_of_the_file(tmp_path: Path) -> None:
    """A file whose worker was killed from outside is read again."""
    marks = [tmp_path / f"killed-{k}" for k in range(2)]
    dies = (
        "[open({0!r}, 'x').close(), __import__('os').kill(__import__('os').getpid(), 9)] "
        "if not __import__('os').path.exists({0!r}) else {1}"
    )
    calls = [(dies.format(str(mark), [k, k]),) for k, mark in enumerate(marks)]
    with closing(serve(eval, calls, 1, Limits())) as served:
        assert [list(of_file.values) for of_file in served] == [[0, 0], [1, 1]]


def test_worker_that_is_killed_each_time_is_said() -> None:
    calls = [("__import__('os').kill(__import__('os').getpid(), 9)",)]
    with closing(serve(eval, calls, 1, Limits())) as served:
        assert next(served).failure.startswith("the reader crashed (signal 9, Killed)")
