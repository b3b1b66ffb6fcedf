"""screen: from records.nc and a file of structures to screen.nc and its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.bounds import LARGEST_SCALE
from rockframe.engines import Engine
from rockframe.errors import ParameterError
from rockframe.ingest import Rejection
from rockframe.provenance import refuse_overwriting
from rockframe.results import (
    Batches,
    input_hash,
    open_records,
    read_facts,
    refuse_strange_table,
    write_screen_table,
    write_screening,
)
from rockframe.risk import HazardCurve, read_hazard
from rockframe.rocking import Design, Histories
from rockframe.stages.common import Progress, silent
from rockframe.stages.respond import choose_structures
from rockframe.stages.screen_motions import Motions, Selection
from rockframe.stages.screen_run import Asked, Run
from rockframe.stages.screen_statistics import statistics
from rockframe.study import SHIPPED_STRUCTURES

#: Multiples of the motions by default [1].
SCALES: Final = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)


@dataclass(frozen=True)
class Screening:
    """What a screening took and what it left out.

    Parameters
    ----------
    motions, scenarios : int
        Motions; motions times structures times scales.
    rejections : tuple of Rejection
        Records without a partner or a vertical that was asked for.
    left_out : mapping of str to str
        Why motions are left out by the selection, by identifier.
    table : Path
        The summary: a row for each motion and structure.
    """

    motions: int
    scenarios: int
    rejections: tuple[Rejection, ...]
    left_out: Mapping[str, str]
    table: Path


def screen_stage(
    records_path: Path,
    output: Path,
    *,
    structures_path: Path = SHIPPED_STRUCTURES,
    structure: str | None = None,
    pulses_path: Path | None = None,
    selection: Selection | None = None,
    azimuths: Sequence[float] = (),
    vertical: bool = False,
    scales: ArrayLike = SCALES,
    margins: bool = True,
    histories: Histories = Histories.NONE,
    hazard_path: Path | None = None,
    design: Design | None = None,
    seed: int = 0,
    engine: Engine | None = None,
    progress: Progress = silent,
) -> Screening:
    """Screen structures by all records at all scales: ``screen.nc``, and a table beside it.

    An interrupted run leaves its complete batches beside the output; the same call goes on.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write; the table has its name and ``.csv``.
    structures_path : Path
        TOML file of ``[[structure]]`` tables; by default the shipped ones.
    structure : str, optional
        Only the structure of this name.
    pulses_path : Path, optional
        Output of `pulse_stage` for the same records: for fragility over a_p and L_p, and to select.
    selection : Selection, optional
        Which records; by default all that are horizontal.
    azimuths : sequence of float
        Directions [degree] toward which each pair of horizontals is turned; by default none is.
    vertical : bool
        Let the ground move vertically too, as the vertical record of the same motion says.
    scales : array_like, shape (scales,)
        Multiples of the motions [1], increasing.
    margins : bool
        Find critical scales and safe islands too; they take most of the time.
    histories : Histories
        Which scenarios' histories are kept in the file; `read_screen_history` reads them.
    hazard_path : Path, optional
        CSV of the site's hazard curve, as `read_hazard` takes it.
    design : Design, optional
        What to look for besides.
    seed : int
        Of the draws of the bands.
    engine : Engine, optional
        Where responses are computed; the file is the same.
    progress : callable
        Called with the number of batches done and in all.

    Raises
    ------
    InputError
        If a file cannot be read or written, or the pulses are of other records.
    ParameterError
        If the scales do not increase, an azimuth is stated twice, the seed is negative, no record
        is left, or a candidate of the design cannot rock.
    EngineError
        If the engine is not there.
    """
    table = output.with_suffix(".csv")
    read = [records_path, structures_path, *filter(None, (pulses_path, hazard_path))]
    refuse_overwriting([output, table], read, beside=output)
    refuse_strange_table(table)
    if seed < 0:
        raise ParameterError(f"Invalid seed {seed}. Must be zero or positive.")
    frames = tuple(choose_structures(structures_path, structure))
    candidates = tuple(c for one in frames for c in (design.candidates(one) if design else ()))
    factors = _require_increasing(scales)
    asked = Asked(frames, candidates, factors, margins, Histories(histories), design, seed)
    wanted = selection or Selection()
    _require_pulses(wanted, pulses_path, azimuths)
    hazard = _hazard(hazard_path, pulses_path, azimuths)
    facts = read_facts(records_path, pulses_path)
    chosen_by = {
        "azimuths": [float(azimuth) for azimuth in azimuths],
        "selection": wanted.stated(),
        "vertical": vertical,
    }
    with open_records(records_path) as file:
        chosen = Motions(file, facts, vertical=vertical)
        chosen.choose(wanted, azimuths, float(asked.scales[-1]))
        origin = {"records": input_hash(records_path), **_identity(chosen), "vertical": vertical}
        batches = Batches(output, origin | asked.scenarios())
        run = Run(chosen, asked, batches, engine, progress)
        write_screening(
            run.rows(),
            run.verdicts.shape,
            lambda: statistics(run.screened(facts, hazard)),
            output,
            input_sha256=input_hash(*read),
            parameters=asked.stated() | chosen_by,
            left_out={r.file: r.reason for r in chosen.rejections} | chosen.left_out,
            filtered=chosen.left_out,
            histories=None if asked.histories is Histories.NONE else run.histories(),
        )
    write_screen_table(output, table)
    batches.sweep()
    rejected = tuple(chosen.rejections)
    return Screening(len(run.verdicts), run.verdicts.size, rejected, chosen.left_out, table)


def _identity(chosen: Motions) -> dict[str, Any]:
    """What tells motions from others: names, and azimuths, which names round."""
    return {
        "motions": [motion.name for motion in chosen.motions],
        "azimuths": [motion.azimuth for motion in chosen.motions],
    }


def _require_increasing(scales: ArrayLike) -> NDArray[np.float64]:
    factors = np.atleast_1d(np.asarray(scales, dtype=np.float64))
    if factors.ndim != 1 or factors.size == 0:
        raise ParameterError("no scale to screen at. Must be one or more.")
    wrong = np.flatnonzero(~((factors > 0.0) & (factors <= LARGEST_SCALE)))
    if wrong.size:
        raise ParameterError(
            f"Invalid scale {factors[wrong[0]]:g}. Must be positive and at most {LARGEST_SCALE:g}."
        )
    falls = np.flatnonzero(np.diff(factors) <= 0.0)
    if falls.size:
        one, other = factors[falls[0] : falls[0] + 2]
        raise ParameterError(f"Invalid scales, {other:g} after {one:g}. Must increase.")
    return factors


def _require_pulses(
    selection: Selection, pulses_path: Path | None, azimuths: Sequence[float]
) -> None:
    for name in selection.of_pulses():
        if pulses_path is None:
            raise ParameterError(
                f"Invalid filter {name} where no pulse is known. Must be given with --pulses."
            )
        if len(azimuths):
            raise ParameterError(
                f"Invalid filter {name} of pairs that are turned: their pulses are not known. "
                "Must be given without --azimuths."
            )


def _hazard(
    path: Path | None, pulses_path: Path | None, azimuths: Sequence[float]
) -> HazardCurve | None:
    if path is None:
        return None
    curve = read_hazard(path)
    if curve.measure in ("a_p", "L_p") and pulses_path is None:
        raise ParameterError(
            f"{path}: is a hazard curve of {curve.measure}, which is not known without pulses. "
            "Must be given with --pulses."
        )
    if curve.measure in ("a_p", "L_p") and len(azimuths):
        raise ParameterError(
            f"{path}: is a hazard curve of {curve.measure}, which is not known of pairs that are "
            "turned. Must be given without --azimuths."
        )
    return curve
