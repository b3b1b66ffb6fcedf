"""Records for the tests of screening: sines of known amplitude at made-up stations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from rockframe.options.respond import DesignOptions, ScreenOptions
from rockframe.record import Orientation, Record
from rockframe.results.records import write_records

STEP = 0.01


def sine(name: str, amplitude: float, **facts: object) -> Record:
    """Return a record of four cycles at 1 Hz after 1 s of rest."""
    time = STEP * np.arange(600)
    shape = np.where((time > 1.0) & (time < 5.0), np.sin(2.0 * np.pi * time), 0.0)
    return Record(
        **{
            "record_id": name,
            "acceleration": amplitude * shape,
            "time_step": STEP,
            "orientation": Orientation.HORIZONTAL,
            "azimuth": 0.0,
            "station": name,
            "event": "made",
            **facts,
        }  # type: ignore[arg-type]
    )


def site(count: int) -> list[Record]:
    """Return sines of increasing amplitude, magnitude and vs30."""
    return [
        sine(f"s{n:02d}", 0.5 + 0.4 * n, magnitude=5.0 + 0.1 * n, vs30=200.0 + 20.0 * n)
        for n in range(count)
    ]


def three(name: str, upward: float = 0.5) -> list[Record]:
    """Return two horizontals and a vertical of one station."""
    east = sine(f"{name}-e", 3.0, station=name, azimuth=90.0)
    north = sine(f"{name}-n", 4.0, station=name, azimuth=0.0)
    up = sine(f"{name}-z", upward, station=name, orientation=Orientation.VERTICAL)
    return [east, north, up]


def stored(records: Iterable[Record], folder: Path) -> Path:
    """Write the records as the ingest stage does; return the path of the file."""
    path = folder / "records.nc"
    write_records(((r, None) for r in records), path, input_sha256={}, parameters={})
    return path


STRUCTURES = """
[[structure]]
name = "stout"
height_m = 6.0
width_m = 1.2
mass_ratio = 2.0

[[structure]]
name = "slender"
height_m = 3.0
width_m = 0.45
"""
#: A column with a tendon.
RESTRAINED = """
[[structure]]
name = "held"
height_m = 3.0
width_m = 0.45
column_mass_kg = 1.0e3

[structure.tendon]
area_m2 = 1.0e-4
prestress_n = 1.0e4
modulus_pa = 2.0e11
yield_stress_pa = 1.6e9
"""
#: A column that rolls in both directions, and one that does not.
ROUND = """
[[structure]]
name = "round"
height_m = 3.0
width_m = 0.5
section_both = "circular"

[[structure]]
name = "square"
height_m = 3.0
width_m = 0.5
"""


def structures(folder: Path, text: str = STRUCTURES) -> Path:
    """Write a file of structures, by default two; return its path."""
    path = folder / "structures.toml"
    path.write_text(text, encoding="utf-8")
    return path


def names(records: Sequence[Record]) -> list[str]:
    """Return the identifiers of the records."""
    return [record.record_id for record in records]


#: Scales of screenings that are compared with each other.
SCALES = (0.5, 1.0, 2.0)


def all_results(folder: Path) -> ScreenOptions:
    """Write a hazard curve; return options of all results of the stated structures but margins."""
    hazard = folder / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    return ScreenOptions(
        scales=SCALES,
        margins="none",
        limit_peak_u_m=(0.1,),
        limit_peak_tendon_ratio=(0.5,),
        hazard=hazard,
        return_period_years=(475.0,),
        pooled=True,
        design=DesignOptions(dimension="height", range=(2.0, 30.0), steps=3),
    )
