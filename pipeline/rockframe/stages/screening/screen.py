"""Screen structures by all records at many scales, and write screen.nc and its table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rockframe.engines.engine import Engine
from rockframe.errors import ParameterError
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.results.record_metadata import read_metadata
from rockframe.results.records import open_records
from rockframe.results.screening.batches import Batches
from rockframe.results.screening.screen import write_screening
from rockframe.results.screening.tables import (
    refuse_strange_tables,
    screen_table_paths,
    write_screen_tables,
)
from rockframe.results.writing import input_hash
from rockframe.risk import HazardCurve, period_of, read_hazard
from rockframe.stages.common import Progress, silent
from rockframe.stages.respond import choose_structures
from rockframe.stages.screening.motions import Motions
from rockframe.stages.screening.run import ScreeningRequest, ScreeningRun
from rockframe.stages.screening.statistics import statistics
from rockframe.study.structures import SHIPPED_STRUCTURES


@dataclass(frozen=True)
class Screening:
    """Summary of a screening.

    Parameters
    ----------
    motions, scenarios : int
        Number of motions, and of motions times structures times scales.
    rejections : tuple of InputOutcome
        Records without a partner or without a requested vertical.
    left_out : mapping of str to str
        Reasons of the motions that the selection rejects, by identifier.
    tables : mapping of str to Path
        Tables beside the file: ``""`` for motions and structures, ``scenarios``, ``fragility``, and
        if requested ``rates`` and ``design``.
    """

    motions: int
    scenarios: int
    rejections: tuple[InputOutcome, ...]
    left_out: Mapping[str, str]
    tables: Mapping[str, Path]

    @property
    def table(self) -> Path:
        """Table with a row for each motion and structure."""
        return self.tables[""]


def screen_stage(
    records_path: str | Path,
    output: str | Path,
    options: ScreenOptions | None = None,
    *,
    structures_path: str | Path = SHIPPED_STRUCTURES,
    pulses_path: str | Path | None = None,
    filters: Filters | None = None,
    engine: Engine | None = None,
    progress: Progress = silent,
    table_format: str = "csv",
) -> Screening:
    """Screen structures by all records at all scales: ``screen.nc``, and tables beside it.

    An interrupted run leaves its finished batches beside the output; the same call resumes it.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write. The table of motions has the same
        name with another suffix; the other tables are ``fragility.csv`` and so on beside
        ``screen.nc``, and ``NAME-fragility.csv`` beside ``NAME.nc``.
    options : ScreenOptions, optional
        Options for motions, scales and results.
    structures_path : str or Path
        TOML file of ``[[structure]]`` tables; by default the bundled ones.
    pulses_path : str or Path, optional
        Output of `pulse_stage` for the same records; needed for fragility over a_p and L_p, and for
        filters by the pulse.
    filters : Filters, optional
        Filters of records; by default all horizontal records.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    progress : callable
        Called with the number of batches done and in total.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.

    Raises
    ------
    InputError
        If a file cannot be read or written, or if the pulses belong to other records.
    ParameterError
        If no record is left, if pulses are needed but not stated, or if a candidate of the design
        cannot rock.
    EngineError
        If the engine is not available.
    """
    records_path, output = Path(records_path), Path(output)
    options, structures_path = options or ScreenOptions(), Path(structures_path)
    pulses_path = Path(pulses_path) if pulses_path else None
    rates, design = options.hazard is not None, options.design is not None
    tables = screen_table_paths(output, rates=rates, design=design, table_format=table_format)
    read = [records_path, structures_path, *filter(None, (pulses_path, options.hazard))]
    refuse_overwriting([output, *tables.values()], read, beside=output)
    refuse_strange_tables(tables)
    frames = tuple(choose_structures(structures_path, options.structure))
    request = ScreeningRequest.of(options, frames)
    _require_pulses(options, pulses_path)
    hazard = _hazard(options, pulses_path)
    metadata = read_metadata(records_path, pulses_path)
    with open_records(records_path) as file:
        chosen = Motions(file, metadata, options, filters or Filters(), _periods(options, hazard))
        origin = {
            "records": input_hash(records_path),
            "motions": [motion.name for motion in chosen.motions],
            # The names of rotated motions round their azimuths.
            "azimuths": [motion.azimuth for motion in chosen.motions],
            "vertical": options.vertical,
        }
        batches = Batches(output, origin | request.scenarios())
        run = ScreeningRun(chosen, request, batches, engine, progress)
        write_screening(
            run.rows(),
            run.verdicts.shape,
            lambda: statistics(run, metadata, hazard),
            output,
            input_sha256=input_hash(*read),
            parameters=options.stated()
            | {
                "filters": chosen.filters.bounds(),
                "structures": [frame.name for frame in frames],
            },
            left_out={r.file: r.reason for r in chosen.rejections} | chosen.left_out,
            filtered=chosen.left_out,
            histories=None if options.histories == "none" else run.histories(),
        )
    write_screen_tables(output, table_format=table_format)
    batches.sweep()
    rejected = tuple(chosen.rejections)
    return Screening(len(run.verdicts), run.verdicts.size, rejected, chosen.left_out, tables)


def _require_pulses(options: ScreenOptions, pulses_path: Path | None) -> None:
    for name in options.pulse_filters():
        if pulses_path is None:
            raise ParameterError(f"{name} needs pulses. State them with --pulses.")


def _periods(options: ScreenOptions, hazard: HazardCurve | None) -> list[float]:
    """Return the periods of spectral accelerations, including the period of the hazard curve."""
    period = period_of(hazard.measure) if hazard else 0.0
    return sorted({*(options.spectral_periods_s or ()), *([period] if period else [])})


def _hazard(options: ScreenOptions, pulses_path: Path | None) -> HazardCurve | None:
    path = options.hazard
    if path is None:
        return None
    curve = read_hazard(path, options.hazard_site)
    if curve.measure in ("a_p", "L_p"):
        if pulses_path is None:
            raise ParameterError(
                f"{path}: is a hazard curve of {curve.measure}, which is unknown without "
                "pulses. State them with --pulses."
            )
        if options.azimuths_degree:
            raise ParameterError(
                f"{path}: is a hazard curve of {curve.measure}, which is unknown for rotated "
                "motions. Remove azimuths_degree."
            )
    return curve
