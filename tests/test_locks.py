"""Lock files: every package has hashes, and the extras change no version."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LOCKS = ("requirements.lock", "requirements-extras.lock", "workflows/requirements.lock")


def pinned(lock: str) -> set[tuple[str, str]]:
    """Return pairs of package and version; some packages differ between versions of Python."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    return set(re.findall(r"(?m)^([a-z0-9._-]+)==(\S+)", text))


@pytest.mark.parametrize("lock", LOCKS)
def test_every_package_has_a_version_and_hashes_and_no_address(lock: str) -> None:
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert "://" not in text
    for package in re.split(r"(?m)^(?=[a-z])", text)[1:]:
        assert re.match(r"[a-z0-9._-]+==", package)
        assert "--hash=sha256:" in package


def test_extras_change_no_version_of_the_environment() -> None:
    first, added = pinned("requirements.lock"), pinned("requirements-extras.lock")
    both = {name for name, _ in first} & {name for name, _ in added}
    assert {pin for pin in added if pin[0] in both} <= first


def test_make_installs_nothing_without_hashes() -> None:
    """Only the package itself is installed without hashes, and without its dependencies."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if "echo" not in line]
    installs = [line for line in lines if "pip install" in line or "$(PIP) install" in line]
    assert len(installs) == 6
    for line in installs:
        assert "--require-hashes" in line or "--no-deps" in line
