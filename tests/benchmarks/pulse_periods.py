"""Periods T_p of one record by different wavelets: `python -m tests.benchmarks.pulse_periods`.

The records are the bundled ones and all horizontal ones of `../shared`, each once. A pulse of each
wavelet is matched, as `rockframe pulse` does. The table compares T_p of the other wavelets with
that of the selected pulse, the Ricker wavelet of fixed phase that explains more of the record: it
has quantiles of the ratio, and how many records differ by more than FACTORS, up or down. The last
row of each table compares velocities. Pulses whose period is at a bound of the search are left out.
The second table has the records of which the noise test calls the selected pulse a pulse.

It takes 20 s of processor time. More records are more folders in FOLDERS.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tests.benchmarks.size import sized
from tests.conftest import SHARED

from rockframe import RICKERS, PulseOptions, bundled_records, ingest_stage, pulse_stage
from rockframe.matching.verdict import PulseVerdict

Float: TypeAlias = NDArray[np.float64]

#: Folders of `../shared`; the Ridgecrest records there are the bundled ones.
FOLDERS: Final = ("records/formats", "records/table1", "more_formats", "asdf")
#: The same record as a bundled one, in another format.
AGAIN: Final = ("CI.CLC..HNE", "CI.CLC..HNN")
#: Ratios of two periods, up or down.
FACTORS: Final = (1.05, 1.1, 1.2, 1.5, 2.0)
#: The rows of the tables.
ROWS: Final = {
    "other": "the other Ricker of fixed phase",
    "ricker_any_phase": "Ricker of any phase",
    "mavroeidis_papageorgiou": "Mavroeidis and Papageorgiou",
    "velocity": "Ricker, matched to the velocity",
}


def pulses_of(sources: Sequence[Path]) -> Any:
    """Return the dataset of the pulses of all horizontal records."""
    options = PulseOptions(surrogates=sized(99, 0))
    with tempfile.TemporaryDirectory() as folder:
        records, pulses = Path(folder) / "records.nc", Path(folder) / "pulses.nc"
        ingest_stage(sources, records)
        pulse_stage(records, pulses, options)
        with xr.open_dataset(pulses) as dataset:
            names = dataset["record_id"].values
            return dataset.isel(record=np.isin(names, AGAIN, invert=True)).load()


def selected_of(dataset: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the place of the selected wavelet of each record, and that of the other Ricker."""
    names = dataset["wavelet"].values.tolist()
    rickers = np.array([names.index(name) for name in RICKERS])
    best = dataset["match_index"].values[:, rickers].argmax(axis=1)
    return rickers[best], rickers[1 - best]


def periods_of(dataset: Any) -> tuple[Float, dict[str, Float]]:
    """Return T_p of the selected pulses, and of the rows of the tables; NaN at a bound [s]."""
    free = dataset["at_period_bound"].values == 0
    periods = np.where(free, dataset["T_p"].values, np.nan)
    velocity = dataset["velocity_T_p"].values
    within = (velocity > 1.001 * dataset["shortest_period"].values) & (
        velocity < 0.999 * dataset["longest_period"].values
    )
    selected, other = selected_of(dataset)
    each = np.arange(selected.size)
    columns = {name: periods[:, k] for k, name in enumerate(dataset["wavelet"].values)}
    columns["other"] = periods[each, other]
    columns["velocity"] = np.where(within, velocity, np.nan)
    return periods[each, selected], columns


def table(selected: Float, columns: dict[str, Float]) -> Iterator[str]:
    """Yield the lines of a table."""
    head = ("T_p of", "records", "over that selected, median", "5 and 95 %")
    beyond = [f"by more than {factor:g}" for factor in FACTORS]
    yield "| " + " | ".join((*head, *beyond)) + " |"
    yield "|---" * (len(head) + len(FACTORS)) + "|"
    for name, title in ROWS.items():
        ratio = columns[name] / selected
        ratio = ratio[np.isfinite(ratio)]
        if ratio.size:
            low, middle, high = np.quantile(ratio, [0.05, 0.5, 0.95])
            apart = np.maximum(ratio, 1.0 / ratio)
            several = " | ".join(f"{100.0 * (apart > each).mean():.0f} %" for each in FACTORS)
            yield f"| {title} | {ratio.size} | {middle:.2f} | {low:.2f} to {high:.2f} | {several} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print both tables."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    shared = [SHARED / name for name in sized(FOLDERS, ()) if SHARED.is_dir()]
    dataset = pulses_of([bundled_records(), *shared])
    selected, columns = periods_of(dataset)
    print(f"{selected.size} records")
    print(*table(selected, columns), sep="\n")
    each = np.arange(selected.size)
    verdicts = dataset["pulse_verdict"].values[each, selected_of(dataset)[0]]
    pulse = verdicts == PulseVerdict.PULSE
    print(f"\n{pulse.sum()} of them with a pulse")
    print(*table(selected[pulse], {name: each[pulse] for name, each in columns.items()}), sep="\n")


if __name__ == "__main__":
    main()
