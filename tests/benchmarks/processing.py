"""Other processing of raw records: `python -m tests.benchmarks.processing`.

The records are the bundled ones and all raw horizontal ones of `../shared` of at least LEAST_PGA
that stood on the ground, each once. Each is processed as a run does it, and scaled to the least of
SCALES times its PGV at which at least half of 64 members of a shipped structure overturn. There the
share of 256 members is computed again under each version of the record: other corners, other
filters, turned. The drift is the median of the members' peaks at half that scale, where the
structure stands. The corner is not varied within the ensemble. Another seed shows what sampling
does.

It takes two minutes of processor time. More records are more folders in FOLDERS.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt
from tests.benchmarks.size import sized
from tests.conftest import SHARED

from rockframe import Ensemble, IngestOptions, RockingFrame, bundled_records, read_structures
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.record import SiteType
from rockframe.results.records import open_records
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.rocking import GroundAcceleration
from rockframe.rocking.margins.ensemble import member_peaks, quantiles
from rockframe.signals.processing import AsRead, BandPass, correct, integrate
from rockframe.stages.common import horizontal
from rockframe.stages.ingest import ingest_stage
from rockframe.units import GRAVITY

Float: TypeAlias = NDArray[np.float64]

#: Folders of `../shared` with raw records; the Ridgecrest records there are the bundled ones.
FOLDERS: Final = (
    *(f"records/formats/{name}" for name in ("afad", "csmip", "knet", "smc")),
    "more_formats",
    "asdf",
)
#: Least peak of a record that is taken [m s-2].
LEAST_PGA: Final = 0.01 * GRAVITY
#: Values of PGV to which records are scaled [m s-1].
SCALES: Final = np.geomspace(0.2, 8.0, sized(60, 3))
#: Lower corners that archives state [Hz], tried for records whose own one is not above the first.
CORNERS: Final = (0.1, 0.2, 0.3, 0.4, 0.8)
#: Members by which the scale is found, and by which versions are compared.
FEW, MANY = 64, sized(256, 16)


def raw_records() -> Iterator[tuple[str, Uncertain]]:
    """Yield the records that this package corrects, with their samples as read."""
    folders = [SHARED / name for name in sized(FOLDERS, ()) if SHARED.is_dir()]
    with tempfile.TemporaryDirectory() as temporary, warnings.catch_warnings():
        warnings.simplefilter("ignore", RockframeWarning)  # of records that cannot be turned
        path = Path(temporary) / "records.nc"
        ingest_stage([bundled_records(), *folders], path, IngestOptions(streams="raw"))
        turned = Ensemble(orientation_degree=1.0)
        with open_records(path) as file:
            names = horizontal(file)
            sources = VersionSources.of(file, turned, names)
            for name in sized(names, names[:1]):
                uncertain = sources.uncertain(file.read(name))
                if uncertain is not None and uncertain.as_read is not None:
                    record = uncertain.record
                    strong = np.abs(record.acceleration).max() >= LEAST_PGA
                    if strong and record.site_type is not SiteType.STRUCTURE:
                        yield name, uncertain


def corrected(as_read: AsRead, time_step: float, low: float, high: float) -> Float | None:
    """Return the samples with other corners [Hz]; None if the record is too short for them."""
    try:
        return correct(as_read.samples, time_step, BandPass(low, high))[0]
    except ParameterError:
        return None


def causal(as_read: AsRead, time_step: float) -> Float:
    """Return the samples filtered forwards alone, by the same corners and order."""
    band = as_read.band
    high = min(band.high, 0.4 / time_step)
    sections = butter(4, [band.low, high], "bandpass", fs=1.0 / time_step, output="sos")
    samples = as_read.samples
    return np.asarray(sosfilt(sections, samples - np.polyval(_line(samples), _times(samples))))


def unfiltered(as_read: AsRead, time_step: float) -> Float:
    """Return the samples without the slope of the parabola that fits their velocity best."""
    samples = as_read.samples
    velocity = integrate(samples, time_step)
    times = _times(samples)
    linear, square = np.linalg.lstsq(np.stack([times, times**2], axis=1), velocity, rcond=None)[0]
    slope = (linear + 2.0 * square * times) / (time_step * (samples.size - 1))
    return np.asarray(samples - slope)


def _times(samples: Float) -> Float:
    return np.linspace(0.0, 1.0, samples.size)


def _line(samples: Float) -> Float:
    return np.polyfit(_times(samples), samples, 1)


def versions_of(uncertain: Uncertain) -> Iterator[tuple[str, Float | None]]:
    """Yield names and samples [m s-2] of all versions; None for those that a record lacks."""
    record, as_read, step = uncertain.record, uncertain.as_read, uncertain.record.time_step
    assert as_read is not None
    low, high = as_read.band.low, as_read.band.high
    yield "as in a run", record.acceleration
    yield "the same, another seed", record.acceleration
    for name, factor in (("1/2", 0.5), ("1/√2", 0.5**0.5), ("√2", 2.0**0.5), ("2", 2.0)):
        yield f"lower corner times {name}", corrected(as_read, step, factor * low, high)
    for corner in CORNERS:
        lower = corrected(as_read, step, corner, high) if low <= CORNERS[0] else None
        yield f"lower corner {corner:g} Hz, of those up to {CORNERS[0]:g}", lower
    yield "upper corner 20 Hz instead of 40", corrected(as_read, step, low, 20.0)
    yield "filtered forwards only", causal(as_read, step)
    yield "not filtered, baseline fitted to the velocity", unfiltered(as_read, step)
    for degrees in (3.0, 10.0, 30.0):
        toward = None
        if uncertain.pair is not None:
            [toward] = uncertain.pair.toward([record.azimuth + degrees])
        yield f"turned by {degrees:g}°", toward


def shares_of(grounds: Sequence[GroundAcceleration], frame: RockingFrame, seed: int) -> Float:
    """Return the shares of MANY members that overturn."""
    ensemble = Ensemble(members=MANY, seed=seed, corner=1.0)
    peaks = member_peaks(grounds, [frame], ensemble).peaks["peak_rotation_ratio"]
    return np.asarray(np.isinf(peaks[:, 0]).mean(axis=1))


def drifts_of(grounds: Sequence[GroundAcceleration], frame: RockingFrame, seed: int) -> Float:
    """Return the median peak displacements of MANY members [m]."""
    ensemble = Ensemble(members=MANY, seed=seed, corner=1.0)
    return np.asarray(quantiles(member_peaks(grounds, [frame], ensemble).peaks["peak_u"])[:, 0, 1])


def changes(
    uncertain: Uncertain, frames: Sequence[RockingFrame]
) -> Iterator[Mapping[str, tuple[float, float, float]]]:
    """Yield, for each structure, shares, drifts [m] and drifts in a run [m] of all versions."""
    record = uncertain.record
    pgv = np.abs(integrate(record.acceleration, record.time_step)).max()
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    scaled = [ground.scaled(scale / pgv) for scale in SCALES]
    few = member_peaks(scaled, frames, Ensemble(members=FEW, seed=7, corner=1.0))
    fall = np.isinf(few.peaks["peak_rotation_ratio"]).mean(axis=2) >= sized(0.5, 1.0 / FEW)
    grounds = {
        name: GroundAcceleration.from_samples(samples, record.time_step)
        for name, samples in versions_of(uncertain)
        if samples is not None
    }
    for k in np.flatnonzero(fall.any(axis=0)).tolist():
        scale = SCALES[fall[:, k].argmax()] / pgv
        half = [each.scaled(0.5 * scale) for each in grounds.values()]
        whole = [each.scaled(scale) for each in grounds.values()]
        shares, drifts = shares_of(whole, frames[k], 0), drifts_of(half, frames[k], 0)
        shares[1], drifts[1] = (
            function(several[:1], frames[k], 1)[0]
            for function, several in ((shares_of, whole), (drifts_of, half))
        )
        yield {
            name: (float(share), float(drift / drifts[0]), float(shares[0]))
            for name, share, drift in zip(grounds, shares, drifts, strict=True)
            if np.isfinite([drift, drifts[0]]).all() and drifts[0] > 0.0
        }


def row_of(name: str, values: Float) -> str:
    """Return the row of shares, ratios of drifts and shares in a run, shape (scenarios, 3)."""
    share, ratio, before = values.T
    change = share - before
    middle, most = np.quantile(np.abs(change), [0.5, 0.9])
    decided = 100.0 * ((share <= 0.05) | (share >= 0.95)).mean()
    low, central, high = np.quantile(ratio, [0.05, 0.5, 0.95])
    return (
        f"| {name} | {share.size} | {middle:.2f} | {most:.2f} | {change.mean():+.2f} | "
        f"{decided:.0f} % | {central:.2f} | {low:.2f} to {high:.2f} |"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    frames = sized(read_structures(), read_structures()[:1])
    values: dict[str, list[tuple[float, float, float]]] = {}
    for number, (name, uncertain) in enumerate(raw_records(), start=1):
        each = [*changes(uncertain, frames)]
        low = uncertain.as_read.band.low if uncertain.as_read else np.nan
        print(f"{number}: {name}, from {low:g} Hz, {len(each)} structures overturn", flush=True)
        for scenario in each:
            for version, numbers in scenario.items():
                values.setdefault(version, []).append(numbers)
    head = (
        "version of the record",
        "scenarios",
        "change of share, median",
        "90 %",
        "mean, with its sign",
        "decided then",
        "drift over that in a run, median",
        "5 and 95 %",
    )
    print("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for version, several in list(values.items())[1:]:
        print(row_of(version, np.array(several)))


if __name__ == "__main__":
    main()
