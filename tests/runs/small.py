"""A small study of pulses in text files, for the tests of runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rockframe.cli.main import main
from rockframe.wavelets.pulse import Pulse

STUDY = """
name = "small"

[records]
paths = ["motions"]
units = "g"
time_step_s = 0.01

[figures]
most = 1

[respond]
margins = "first"

[batches]
records = 2

[[structure]]
name = "bridge-bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0

[[structure]]
name = "slender-column"
height_m = 2.0
width_m = 0.2
"""
_FURTHER = """
[screen]
scales = [1.0]
margins = "none"

[compare.isolated]
strength_ratio = 0.05
period_s = 3.0
"""
#: The same with a screening and a comparison in batches; a column alone cannot be compared.
FURTHER = STUDY[: STUDY.rindex("[[structure]]")].replace("[figures]", f"{_FURTHER}[figures]")
#: The same without figures, margins and surrogates, with few members, and in one batch.
FEW = (
    STUDY.replace("most = 1", "most = 0")
    .replace("records = 2", "records = 9")
    .replace('margins = "first"', 'margins = "none"\n[respond.ensemble]\nmembers = 16')
    .replace("[figures]", "[pulse]\nsurrogates = 0\n[figures]")
)


def make_study(home: Path, records: int = 5, text: str = STUDY) -> Path:
    """Write records and a study of them; five records make three batches."""
    (home / "motions").mkdir(parents=True)
    for k in range(records):
        pulse = Pulse(wavelet="symmetric_ricker", a_p=0.3 + 0.05 * k, T_p=0.8 + 0.1 * k, time=2.0)
        samples = pulse.acceleration(0.01 * np.arange(401))
        np.savetxt(home / "motions" / f"motion-{k}.csv", samples, fmt="%.8f")
    study = home / "small.toml"
    study.write_text(text, encoding="utf-8")
    return study


def run(study: Path, folder: Path, *words: str) -> int:
    """Run a study in this process, as from the command line; return the exit status."""
    return main(["run", str(study), "--output", str(folder), "--workers", "1", *words])


def contents(folder: Path) -> dict[str, bytes]:
    """Return every output file of a run, without its logs and its `.rockframe` folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] not in {".rockframe", "logs"}
    }
