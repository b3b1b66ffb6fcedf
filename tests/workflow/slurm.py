"""A Slurm cluster of one node on loopback, started for a test and stopped after it."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

#: Programs of Debian's packages slurm-wlm and munge.
PROGRAMS: Final = ("munged", "slurmctld", "slurmd", "sbatch", "sinfo")
_START: Final = 60.0
#: Configuration that jobs read, since their environment differs; an existing one is not touched.
_SYSTEM: Final = Path("/etc/slurm/slurm.conf")
_CONFIGURATION: Final = """\
ClusterName=rockframe
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/munge
AuthInfo=socket={home}/munge.socket
CryptoType=crypto/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SlurmUser=root
SlurmdUser=root
StateSaveLocation={home}/state
SlurmdSpoolDir={home}/spool
SlurmctldPidFile={home}/slurmctld.pid
SlurmdPidFile={home}/slurmd.pid
SlurmctldLogFile={home}/slurmctld.log
SlurmdLogFile={home}/slurmd.log
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory} State=UNKNOWN
PartitionName=local Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def is_installed() -> bool:
    """Return True if the programs are installed, the user may start them, and no cluster exists."""
    there = all(shutil.which(name) for name in PROGRAMS)
    return there and os.geteuid() == 0 and not _SYSTEM.exists()


@contextmanager
def one_node(home: Path) -> Iterator[dict[str, str]]:
    """Start munge, controller and node; yield the environment for `sbatch`; stop them all."""
    host = socket.gethostname().split(".")[0]
    for name in ("state", "spool"):
        (home / name).mkdir(parents=True)
    home.chmod(0o755)
    key = home / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // (1 << 20)
    (home / "slurm.conf").write_text(
        _CONFIGURATION.format(
            host=host,
            home=home,
            controller=_free_port(),
            node=_free_port(),
            cpus=os.cpu_count(),
            memory=memory,
        )
    )
    _SYSTEM.parent.mkdir(exist_ok=True)
    _SYSTEM.symlink_to(home / "slurm.conf")
    env = {**os.environ, "SLURM_CONF": str(home / "slurm.conf")}
    socket_of_munge = f"--socket={home}/munge.socket"
    commands = [
        ["munged", "--foreground", "--force", f"--key-file={key}", socket_of_munge]
        + [f"--{kind}-file={home}/munge.{kind}" for kind in ("pid", "log", "seed")],
        ["slurmctld", "-D", "-f", str(home / "slurm.conf")],
        ["slurmd", "-D", "-f", str(home / "slurm.conf"), "-N", host],
    ]
    started: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            log = (home / f"{command[0]}.out").open("wb")
            started.append(subprocess.Popen(command, env=env, stdout=log, stderr=log))
            log.close()
            time.sleep(1.0)
        _wait_for_node(env)
        yield env
    finally:
        _SYSTEM.unlink()
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(timeout=30)


def _wait_for_node(env: dict[str, str]) -> None:
    until = time.monotonic() + _START
    said = ""
    while time.monotonic() < until:
        shown = subprocess.run(
            ["sinfo", "--noheader", "--format=%T"], env=env, capture_output=True, text=True
        )
        said = shown.stdout + shown.stderr
        if shown.stdout.strip() == "idle":
            return
        time.sleep(0.5)
    raise TimeoutError(f"the node does not come up: {said}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
