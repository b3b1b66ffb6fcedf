"""Members of screenings: `python -m tests.benchmarks.scenario_members`.

The bundled records and shipped structures are screened with several numbers of members in each
scenario, and several seeds. Printed are the fragility over PGV of one structure, and by how much
fragilities and rates of all structures differ between seeds (standard deviation over mean); then
processor time relative to that of the stated structures alone, at many scales.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from tests.benchmarks.size import sized

from rockframe.engines.engine import OneProcess
from rockframe.options.respond import Ensemble, ScreenOptions
from rockframe.results.screen import read_screening
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.screen import screen_stage
from rockframe.study.structures import bundled_records

#: Structure whose fragility is printed.
_SHOWN: Final = "slender-frame"
_HAZARD: Final = "pga_g,annual_rate\n0.05,0.05\n0.1,0.02\n0.2,0.006\n0.4,0.0012\n0.8,0.00015\n"
_NUMBERS: Final = ("fragility_median", "fragility_lognormal_beta", "annual_rate")


def screened(folder: Path, members: int, seed: int, **options: object) -> xr.Dataset:
    """Return a screening of the records in a folder."""
    asked = ScreenOptions(
        margins="none", scenario_members=members, ensemble=Ensemble(seed=seed), **options
    )
    screen_stage(folder / "records.nc", folder / "screen.nc", asked, engine=OneProcess())
    return read_screening(folder / "screen.nc", every_scale=False)


def print_fragilities(folder: Path, numbers: Sequence[int], seeds: int) -> None:
    """Print a fragility, and the differences between seeds, for each number of members."""
    (folder / "hazard.csv").write_text(_HAZARD)
    print(f"members  {_SHOWN}: median [m/s], beta  seeds differ by: median   beta   rate [%]")
    for members in numbers:
        rows = []
        for seed in range(seeds if members > 1 else 1):
            found = screened(folder, members, seed, hazard=folder / "hazard.csv")
            over_pgv = found.sel(limit_state="overturning", measure="pgv")
            rows.append([over_pgv[name].values for name in _NUMBERS])
        values = np.array(rows)
        apart = 100.0 * (values.std(axis=0) / values.mean(axis=0)).mean(axis=1)
        at = found["structure"].values.tolist().index(_SHOWN)
        median, beta = values[:, :2, at].mean(axis=0)
        differ = "".join(f"{one:7.1f}" for one in apart)
        print(f"{members:7d} {median:28.3f} {beta:6.3f} {differ:>40}")


def print_cost(folder: Path, numbers: Sequence[int], scales: int) -> None:
    """Print the processor time for each number of members over that of the first."""
    times = []
    for members in (numbers[0], *numbers):  # the first call also loads the kernels
        begin = time.process_time()
        screened(folder, members, 0, scales=np.linspace(0.25, 3.0, scales))
        times.append(time.process_time() - begin)
    for members, taken in zip(numbers, times[1:], strict=True):
        ratio = taken / times[1]
        print(f"{members:7d} members at {scales} scales: {ratio:.1f} times the processor time")


def main(arguments: Sequence[str] | None = None) -> None:
    """Screen, and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    numbers, seeds, scales = sized(((1, 4, 16, 64), 6, 200), ((1, 2), 2, 2))
    with tempfile.TemporaryDirectory() as name:
        ingest_stage([bundled_records()], Path(name, "records.nc"))
        print_fragilities(Path(name), numbers, seeds)
        print_cost(Path(name), numbers, scales)


if __name__ == "__main__":
    main()
