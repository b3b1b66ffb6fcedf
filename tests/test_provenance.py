"""A file is hashed once while it stays the same, and never keeps the hash of former contents."""

from __future__ import annotations

import hashlib
import os
import time
from collections import Counter
from pathlib import Path

import pytest
from tests.runs.small import FEW, make_study, run

from rockframe import provenance
from rockframe.errors import InputError
from rockframe.provenance import sha256_of


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Count how often each file is read for its hash; all files count as old ones."""
    counts: Counter[str] = Counter()
    digest = hashlib.file_digest

    def counted(stream: object, algorithm: str) -> object:
        counts[Path(stream.name).name] += 1  # type: ignore[attr-defined]
        return digest(stream, algorithm)  # type: ignore[arg-type]

    monkeypatch.setattr(hashlib, "file_digest", counted)
    monkeypatch.setattr(provenance, "_SETTLED", 0)
    return counts


def test_a_change_at_once_that_keeps_size_and_time_gets_another_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock of a file system may not have ticked between two changes."""
    path = tmp_path / "note.txt"
    path.write_bytes(b"safe")
    first = path.stat()
    monkeypatch.setattr(os, "fstat", lambda _descriptor: first)
    assert sha256_of(path) == hashlib.sha256(b"safe").hexdigest()
    path.write_bytes(b"fell")
    assert sha256_of(path) == hashlib.sha256(b"fell").hexdigest()


def test_a_later_change_that_keeps_size_and_time_gets_another_hash(
    tmp_path: Path, read: Counter[str]
) -> None:
    """No program can set the time of the change of status back."""
    path = tmp_path / "note.txt"
    for text in (b"safe", b"fell"):
        path.write_bytes(text)
        os.utime(path, ns=(10**18, 10**18))
        time.sleep(0.05)  # the clock of the file system ticks
        assert [sha256_of(path)] * 2 == [hashlib.sha256(text).hexdigest(), sha256_of(path)]
    assert read == {"note.txt": 2}


def test_a_resumed_run_reads_each_kept_file_once_for_its_hash(
    tmp_path: Path, read: Counter[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The state of the run, the manifest, the page and the verification use one hash.

    So does a run with nothing to do, even of files that have just been written.
    """
    study = make_study(tmp_path, 2, FEW)
    assert run(study, tmp_path / "run") == 0
    (tmp_path / "run" / "table.csv").unlink()
    provenance._digest.cache_clear()  # noqa: SLF001 -- as in a new process
    read.clear()
    assert run(study, tmp_path / "run") == 0
    kept = ("records.nc", "records.csv", "pulses.nc", "response.nc", "inputs.csv")
    assert {name: read[name] for name in kept} == dict.fromkeys(kept, 1)
    monkeypatch.setattr(provenance, "_SETTLED", 10**15)
    read.clear()
    assert run(study, tmp_path / "run") == 0
    assert read["manifest.json"] == 1
    assert set(read.values()) == {1}


def test_a_folder_that_is_renamed_while_files_are_written_is_not_made_anew(tmp_path: Path) -> None:
    """Results would be in two places, and no message would say so."""
    folder, elsewhere = tmp_path / "results", tmp_path / "elsewhere"
    folder.mkdir()

    def write_one(path: Path) -> None:
        with provenance.whole_file(path):
            folder.rename(elsewhere)

    def write_several() -> None:
        with provenance.replaced_folder(folder / "figures") as partial:
            folder.rename(elsewhere)
            with provenance.whole_file(partial / "a.txt"):
                pass

    with pytest.raises(InputError, match="written: its folder was renamed or removed meanwhile"):
        write_one(folder / "a.txt")
    elsewhere.rename(folder)
    with pytest.raises(InputError, match="was renamed or removed during this command"):
        write_several()
    assert [path.name for path in tmp_path.iterdir()] == ["elsewhere"]
