"""Helpers that start runs as separate processes, kill them and find what is left of them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

DRIVER = Path(__file__).with_name("driver.py")
#: Longest time to wait for a run on a busy machine [s].
PATIENCE = 300.0
_STEP_DONE = re.compile(r"rockframe: \d+/\d+ \S+, [\d.]+ s$")


def command(study: Path, folder: Path, pool: bool) -> list[str]:
    """Return the command line of a run in one process or in a pool."""
    words = ["run", str(study), "--output", str(folder)]
    if pool:
        return [sys.executable, str(DRIVER), *words]
    return [sys.executable, "-m", "rockframe.cli.main", *words, "--workers", "1"]


def start(study: Path, folder: Path, *, pool: bool = False, **env: str) -> subprocess.Popen[str]:
    """Start a run in a process group of its own."""
    return subprocess.Popen(
        command(study, folder, pool),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, **env},
    )


def finished(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Wait for a run; return its exit status and its standard error without progress lines."""
    said = process.communicate(timeout=PATIENCE)[1]
    lines = said.splitlines(keepends=True)
    # Without a terminal, a run prints a line for each finished step.
    return process.returncode, "".join(one for one in lines if not _STEP_DONE.match(one))


def stamps(folder: Path) -> int:
    """Return the number of finished steps."""
    return len(list((folder / ".rockframe" / "steps").glob("[a-z]*.json")))


def wait_until(met: Callable[[], bool], process: subprocess.Popen[str]) -> bool:
    """Wait until a condition is met; return False if the run ended before."""
    until = time.monotonic() + PATIENCE
    while process.poll() is None:
        if met():
            return True
        if time.monotonic() > until:
            raise TimeoutError("the run stands still")
        time.sleep(0.002)
    return False


def wait_for_stamps(folder: Path, count: int, process: subprocess.Popen[str]) -> bool:
    """Wait until `count` steps are finished; return False if the run ended before."""
    return wait_until(lambda: stamps(folder) >= count, process)


def children(pid: int) -> dict[int, str]:
    """Return all descendants of a process, with their command lines."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int(
                    (entry / "stat").read_text().rsplit(")", 1)[1].split()[1]
                )
            except (OSError, IndexError):
                continue
    found: dict[int, str] = {}
    near = {pid}
    while near:
        near = {child for child, parent in parents.items() if parent in near} - set(found)
        for child in near:
            try:
                found[child] = Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ")
            except OSError:
                found[child] = ""
    return found


def is_alive(pid: int) -> bool:
    """Return True if the process exists and is not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def all_gone(pids: Iterator[int] | list[int]) -> bool:
    """Wait for the processes to end; return False if some have not ended within PATIENCE."""
    until = time.monotonic() + PATIENCE
    waiting = list(pids)
    while waiting and time.monotonic() < until:
        waiting = [pid for pid in waiting if is_alive(pid)]
        time.sleep(0.01)
    return not waiting


def kill(process: subprocess.Popen[str], *, group: bool) -> list[int]:
    """Kill a run, or its whole process group; return its descendants."""
    below = list(children(process.pid))
    if group:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.communicate()
    return below


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Callable[[str], None]]:
    """Mount a disk of this size; yield a function that remounts it with other options."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)

    def remount(options: str) -> None:
        subprocess.run(["mount", "-o", f"remount,{options}", folder], check=True)

    try:
        yield remount
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def can_mount(folder: Path) -> bool:
    """Return True if this user may mount a disk."""
    try:
        with small_disk(folder, "64k"):
            return True
    except (OSError, subprocess.CalledProcessError):
        return False
