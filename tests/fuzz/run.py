"""`make fuzz`: feed each reader of `FORMATS`, and the archives, for a while; print the findings.

Seeds are good files: made here, bundled, and those of the shared folder if it is present. What a
target failed on is kept in `outputs/fuzz/NAME-*`; to repeat it, give it as the only argument.
"""

from __future__ import annotations

import argparse
import gzip
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from rockframe.ingest import FORMATS

ROOT = Path(__file__).resolve().parents[2]
#: Larger seeds are used only for a format that has no smaller one [bytes].
LARGEST_SEED = 40_000


def good_files() -> Iterator[bytes]:
    """Yield good files of many formats."""
    damage = import_module("damage")
    v1 = "\r\n".join(import_module("conftest").v1_channel()).encode()
    yield from (damage.good_at2(), damage.good_table(), b"0.1\n-0.2\n0.3\n", v1)
    yield from small_files()
    shared = ROOT.parent / "shared"
    folders = (
        ROOT / "records" / "ridgecrest2019",
        shared / "records" / "formats",
        shared / "more_formats",
    )
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                yield path.read_bytes()


def small_files() -> Iterator[bytes]:
    """Yield files of the archives' formats with few samples: small files are fed more often."""
    names = ("afad", "asdf", "cosmos", "csmip_v2", "esm", "geonet", "knet", "sac", "smc")
    tests = {name: import_module(f"test_{name}") for name in names}
    yield tests["afad"].afad().encode("latin-1")
    yield tests["asdf"].asdf(documents=tests["asdf"].GOOD)
    yield tests["cosmos"].cosmos(tests["cosmos"].channel())
    counts = tests["cosmos"].channel((1.0, -3.0), stage=0, units="counts (50)", reals={34: 0.005})
    yield tests["cosmos"].cosmos(counts)
    yield tests["csmip_v2"].v2(tests["csmip_v2"].channel())
    yield tests["esm"].esm().encode()
    yield tests["geonet"].geonet()
    yield tests["knet"].knet().encode()
    yield tests["sac"].sac()
    yield tests["smc"].joined(tests["smc"].smc())


def seeds(target: str) -> list[bytes]:
    """Return a target's seeds: files that its format recognises, or archives of small files."""
    files = sorted(good_files(), key=len)
    known = next((known for known in FORMATS if known.name == target), None)
    if known is None:
        small = files[:6]
        archives = [
            *map(gzip.compress, small),
            *(import_module("damage").zipped("seed.AT2", data) for data in small),
        ]
        return archives if target == "containers" else [*archives, *small]
    own = [data for data in files if known.sniff(data[:4096])]
    return [data for data in own if len(data) <= LARGEST_SEED] or own[:1]


def fuzz(target: str, seconds: int, findings: Path) -> tuple[int, str]:
    """Return the number of executions of a target, and the last line of its finding, if any."""
    with tempfile.TemporaryDirectory() as corpus:
        own = seeds(target)
        for number, seed in enumerate(own):
            Path(corpus, f"seed{number}").write_bytes(seed)
        flags = {
            "max_total_time": seconds,
            "max_len": max(map(len, own), default=4096) + 4096,
            "timeout": 20,
            "rss_limit_mb": 4096,
            "print_final_stats": 1,
            "artifact_prefix": f"{findings}/{target}-",
        }
        words = [f"-{flag}={value}" for flag, value in flags.items()]
        script = str(Path(__file__).with_name("target.py"))
        done = subprocess.run(
            [sys.executable, script, target, corpus, *words],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    count = re.search(r"number_of_executed_units:\s*(\d+)", done.stderr)
    raised = re.findall(r"^(?:\w+\.)*\w*(?:Error|Exception)\b.*$", done.stdout + done.stderr, re.M)
    failure = (raised or done.stderr.splitlines() or ["died"])[-1] if done.returncode else ""
    return int(count[1]) if count else 0, failure


def main() -> int:
    """Run every target and print a line for each; return 1 if one failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=30)
    parser.add_argument("targets", nargs="*", help="by default all")
    options = parser.parse_args()
    sys.path.insert(0, str(ROOT / "tests" / "ingest"))
    findings = ROOT / "outputs" / "fuzz"
    findings.mkdir(parents=True, exist_ok=True)
    failed = False
    print(f"{'target':24s} {'executions':>10s}  finding")
    for name in options.targets or [*(known.name for known in FORMATS), "containers", "any"]:
        count, failure = fuzz(name, options.seconds, findings)
        print(f"{name:24s} {count:10d}  {failure or 'none'}", flush=True)
        failed = failed or bool(failure)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
