"""What several tests need: the expected values, and where the shared material is."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
SHARED = REPOSITORY.parent / "shared"  # beside the repository; absent in a plain clone
EXPECTED = Path(__file__).resolve().parent / "expected"


@pytest.fixture(scope="session")
def expected() -> Callable[[str], Any]:
    """Load tests/expected/NAME.json."""

    def load(name: str) -> Any:
        return json.loads((EXPECTED / f"{name}.json").read_text(encoding="utf-8"))

    return load


@pytest.fixture(scope="session")
def bundled_records() -> Path:
    """The records that come with the repository."""
    return REPOSITORY / "records" / "ridgecrest2019"


@pytest.fixture(scope="session")
def peer_records() -> Path:
    """The paper's own records, which may not be redistributed."""
    beside = SHARED / "records" / "table1"
    folder = Path(os.environ.get("ROCKFRAME_PEER_RECORDS", beside))
    if not folder.is_dir():
        pytest.skip("no PEER records: set ROCKFRAME_PEER_RECORDS to the folder that holds them")
    return folder
