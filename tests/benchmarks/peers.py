"""Measures of motions beside those of eqsig and pystrata: ``python -m tests.benchmarks.peers``.

Writes the table of docs/validation.md if both programs are installed (extra ``bench``).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.size import sized

from rockframe.components import HorizontalPair, pair_horizontals, rotd
from rockframe.ingest import read_file
from rockframe.record import Orientation, Record
from rockframe.signals.measures import (
    arias_intensity,
    cumulative_absolute_velocity,
    housner_intensity,
    oscillator_peak,
    oscillator_response,
    significant_duration,
    spectral_acceleration,
)
from rockframe.study.structures import bundled_records

Float: TypeAlias = NDArray[np.float64]
#: Samples [m s-2] and time step [s].
Motion: TypeAlias = tuple[Float, float]
#: Function that returns the values of all rows for a motion, by the name of the row.
Measured: TypeAlias = Callable[[Motion], dict[str, float]]

PERIODS: Final = sized((0.05, 0.1, 0.2, 0.5, 1.0, 2.0), (0.1, 1.0))
AZIMUTHS: Final = np.arange(0.0, 180.0, sized(5.0, 90.0))
#: How many times as dense the samples of the same motion are, straight between those of the record.
DENSE: Final = 10
DOCS: Final = Path(__file__).resolve().parents[2] / "docs"

ARIAS, CAV, D595, D575, HOUSNER = (
    "Arias intensity",
    "CAV",
    "D5-95",
    "D5-75",
    "Housner intensity",
)
#: Reason of the differences, by the beginning of the row.
REASONS: Final = {
    ARIAS: "equal: the trapezoidal rule on the samples",
    CAV: "equal: the trapezoidal rule on the samples",
    "D5": "eqsig takes the nearest samples inside, rockframe interpolates",
    HOUSNER: "eqsig has 241 periods, rockframe 121; peaks at samples, as below",
    "RotD": "peaks at samples, as above",
    "SA(0.05 s)": "as below; and below 6 time steps eqsig returns PGA",
    "SA": "peaks at samples only; pystrata's motion is not straight between samples",
}


def ours(motion: Motion) -> dict[str, float]:
    """Return the measures of this package."""
    start, end = significant_duration(*motion)
    return {
        ARIAS: arias_intensity(*motion),
        CAV: cumulative_absolute_velocity(*motion),
        D595: end - start,
        D575: significant_duration(*motion, 0.05, 0.75)[1] - start,
        HOUSNER: housner_intensity(*motion),
        **_spectrum(spectral_acceleration(*motion, PERIODS)),
    }


def of_eqsig(motion: Motion) -> dict[str, float]:
    """Return the measures of eqsig."""
    eqsig, im = (import_module(f"eqsig{part}") for part in ("", ".im"))
    signal = eqsig.AccSignal(*motion)
    durations = [im.calc_sig_dur_vals(*motion, 0.05, share) for share in (0.95, 0.75)]
    return {
        ARIAS: im.calc_arias_intensity(signal)[-1],
        CAV: im.calc_cav(signal)[-1],
        **dict(zip((D595, D575), durations, strict=True)),
        HOUSNER: im.calc_vsi(signal),
        **spectrum_of_eqsig(motion),
    }


def spectrum_of_eqsig(motion: Motion) -> dict[str, float]:
    """Return the spectral accelerations of eqsig."""
    sdof = import_module("eqsig.sdof")
    return _spectrum(sdof.pseudo_response_spectra(*motion, PERIODS, 0.05)[2])


def of_pystrata(motion: Motion) -> dict[str, float]:
    """Return the spectral accelerations of pystrata."""
    known = import_module("pystrata.motion").TimeSeriesMotion("", "", motion[1], motion[0])
    return _spectrum(known.calc_osc_accels(1.0 / np.array(PERIODS)))


def _spectrum(values: Sequence[float] | Float) -> dict[str, float]:
    return {f"SA({period:g} s)": float(v) for period, v in zip(PERIODS, values, strict=True)}


#: The programs, and their measures of a motion and of one with denser samples.
PEERS: Final[Mapping[str, tuple[Measured, Measured]]] = {
    "eqsig": (of_eqsig, spectrum_of_eqsig),
    "pystrata": (of_pystrata, of_pystrata),
}


def denser(motion: Motion) -> Motion:
    """Return the same motion with more samples: it is straight between those of the record."""
    samples, step = motion
    at = np.arange(DENSE * (samples.size - 1) + 1) / DENSE
    return np.interp(at, np.arange(samples.size), samples), step / DENSE


def rotated_by_eqsig(pair: HorizontalPair) -> dict[str, tuple[float, float]]:
    """Return RotD50 and RotD100 of spectral accelerations: by eqsig's spectra of rotated samples,
    and ours.
    """
    sdof, step = import_module("eqsig.sdof"), pair.first.time_step
    theirs = np.array(
        [
            sdof.pseudo_response_spectra(one, step, PERIODS, 0.05)[2]
            for one in pair.toward(AZIMUTHS.tolist())
        ]
    )
    found = {}
    for k, period in enumerate(PERIODS):
        if period < 0.5 and len(PERIODS) > 2:
            continue
        response = partial(oscillator_response, period=period)
        sweep = rotd(pair, transform=response, measure=oscillator_peak, azimuths=AZIMUTHS.tolist())
        for share in (50, 100):
            stated = float(np.percentile(theirs[:, k], share)), sweep.percentile(share)
            found[f"RotD{share} SA({period:g} s)"] = stated
    return found


def rows(records: Sequence[Record], installed: Sequence[str]) -> list[list[str]]:
    """Return a row for each measure: the least and the largest difference from each program."""
    motions = [(record.acceleration, record.time_step) for record in records]
    known = [ours(motion) for motion in motions]
    columns: list[dict[str, str]] = []
    for name in installed:
        measures, spectra = PEERS[name]
        columns.append(_differences([measures(one) for one in motions], known))
        columns.append(_differences([spectra(denser(one)) for one in motions], known))
    if "eqsig" in installed:
        pairs = [rotated_by_eqsig(pair) for pair in pair_horizontals(records)[0]]
        theirs, own = ([{n: v[k] for n, v in one.items()} for one in pairs] for k in (0, 1))
        columns[installed.index("eqsig") * 2] |= _differences(theirs, own)
    names = dict.fromkeys(name for column in columns for name in column)
    return [[name, *(one.get(name, "") for one in columns), _reason(name)] for name in names]


def _differences(
    theirs: Sequence[Mapping[str, float]], own: Sequence[Mapping[str, float]]
) -> dict[str, str]:
    found = {}
    for name in theirs[0]:
        values = [100.0 * (a[name] / b[name] - 1.0) for a, b in zip(theirs, own, strict=True)]
        ends = [f"{value:+.2f}".replace("-", "−") for value in (min(values), max(values))]
        found[name] = f"{ends[0]} %" if ends[0] == ends[1] else f"{ends[0]} to {ends[1]} %"
    return found


def _reason(name: str) -> str:
    return next(reason for start, reason in REASONS.items() if name.startswith(start))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and write it to the documentation."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    installed = [name for name in PEERS if find_spec(name) is not None]
    for name in PEERS:
        if name not in installed:
            print(f"{name} is not installed, and is left out. It is in the extra bench.")
    if not installed:
        return
    paths = sorted(bundled_records().glob("*.V1"))
    records = [
        record
        for path in paths[: sized(None, 1)]
        for record in read_file(path)
        if record.orientation is Orientation.HORIZONTAL
    ]
    head = ["measure", *(f"{name}{end}" for name in installed for end in ("", ", dense")), "reason"]
    lines: list[list[Any]] = [head, ["---"] * len(head), *rows(records, installed)]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    print(table)
    if len(installed) == len(PEERS) and sized(True, False):
        from tests.validation.page import write_page

        write_page({"measures": table}, DOCS / "validation.md")


if __name__ == "__main__":
    main()
