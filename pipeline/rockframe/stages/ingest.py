"""ingest: from files to records.nc and the table of all inputs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rockframe.components import Rotation
from rockframe.errors import InputError
from rockframe.ingest import (
    CATALOGUE,
    Limits,
    ReadOptions,
    Rejection,
    Source,
    collect_sources,
    read_catalogue,
    sources_of,
)
from rockframe.provenance import refuse_overwriting, sha256_of
from rockframe.results import (
    Entry,
    is_netcdf,
    open_records,
    refuse_strange_entries,
    require_ending,
    write_records,
)
from rockframe.signals import BandPass
from rockframe.stages.intake import Ingested, Intake
from rockframe.stages.rotation import rotated, sweeps
from rockframe.study import Filters, PassportLimits


def ingest_stage(
    paths: Sequence[Path],
    output: Path,
    *,
    options: ReadOptions | None = None,
    catalogue: Path | None = None,
    band: BandPass | None = None,
    all_uncorrected: bool = False,
    passport_limits: PassportLimits | None = None,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    strict: bool = False,
    rotation: Rotation | None = None,
    listed: Callable[[Sequence[Entry]], None] | None = None,
    filters: Filters | None = None,
) -> Ingested:
    """Read record files into ``records.nc``; uncorrected ones get baseline and band-pass.

    Each record gets a passport, and one with a verdict of rejection is rejected. Beside it goes a
    CSV file of the same name: every input, accepted, rejected or unread, with the reason and the
    checks; it is written even if no record of several files went through.

    Parameters
    ----------
    paths : sequence of Path
        Files and folders.
    output : Path
        The netCDF file to write.
    options : ReadOptions, optional
        Units and time step of text files that do not state them.
    catalogue : Path, optional
        CSV of facts about the files; otherwise each folder's own ``catalogue.csv``.
    band : BandPass, optional
        Corner frequencies for uncorrected records.
    all_uncorrected : bool
        Take every record for uncorrected, whatever its format says.
    passport_limits : PassportLimits, optional
        Limits of the checks of each record.
    progress : callable, optional
        Called with the name of each file.
    workers : int, optional
        Most processes that read files, by default one for each core; 0 reads in this one, where a
        crash of a reader is a crash of the run. The output is the same.
    limits : Limits, optional
        Time and memory that reading a file may take.
    strict : bool
        Write nothing if a file is rejected.
    rotation : Rotation, optional
        Put the motion of each station toward these azimuths in the place of its horizontals.
    listed : callable, optional
        Called with the rows of the table once it is written, also if no record went through.
    filters : Filters, optional
        Which of the accepted records go on; the others stand in the table as filtered out.

    Returns
    -------
    Ingested
        Records, rejections, and the rows of the table.

    Raises
    ------
    InputError
        If a path does not exist, or an output would replace an input or a list that is not ours;
        if one was rejected and `strict`, with nothing written; or no record went through.

    Examples
    --------
    >>> import tempfile, rockframe
    >>> motion = rockframe.bundled_records() / "Ridgecrest2019-CLC.V1"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = ingest_stage([motion], Path(folder, "records.nc"), workers=0)
    >>> [record.record_id for record in done.accepted]
    ['Ridgecrest2019-CLC-090', 'Ridgecrest2019-CLC-360', 'Ridgecrest2019-CLC-UP']
    """
    band, options = band or BandPass(), options or ReadOptions()
    checks, outputs = passport_limits or PassportLimits(), (output, output.with_suffix(".csv"))
    sources = sources_of(paths, read_catalogue(catalogue) if catalogue else None, outputs)
    catalogues = _catalogues(sources, catalogue)
    _refuse(outputs, sources, catalogues.values())
    chosen = filters or Filters()
    intake = Intake(band, checks, all_uncorrected, strict, outputs[1], listed, chosen)
    # What is to be rotated must not lose its partner to a filter of peaks.
    first = replace(intake, filters=Filters()) if rotation else intake
    parameters = {**_stated(intake, rotation), **options.stated()}
    with (
        closing(
            collect_sources(
                sources, options, progress, workers=workers, limits=limits, strict=strict
            )
        ) as outcomes,
        _place(output, rotation) as place,
    ):
        inputs = write_records(
            first.inspected(outcomes),
            place,
            input_sha256={name: sha256_of(path) for name, path in catalogues.items()},
            parameters=parameters,
            sweep=None if rotation else sweeps,
        )
        if rotation:
            with open_records(place) as recorded:
                write_records(
                    rotated(recorded, rotation, intake),
                    output,
                    input_sha256=inputs,
                    parameters=parameters,
                    sweep=partial(sweeps, recorded=recorded),
                )
    entries = intake.publish()
    rejections = tuple(Rejection(e.file, e.reason, e.line) for e in entries if e.reason)
    return Ingested(tuple(intake.accepted), rejections, entries, inputs)


def _stated(intake: Intake, rotation: Rotation | None) -> dict[str, Any]:
    """What was asked of the records, as the file keeps it."""
    return {
        "all_uncorrected": intake.all_uncorrected,
        "azimuth_degree": rotation.azimuth if rotation else None,
        "band_pass_hz": [intake.band.low, intake.band.high],
        "filters": intake.filters.stated(),
        "passport": intake.limits.stated(),
        "strike_degree": rotation.strike if rotation else None,
    }


@contextmanager
def _place(output: Path, rotation: Rotation | None) -> Iterator[Path]:
    """Where the records go as they are recorded: a folder that vanishes if they are rotated."""
    if rotation is None:
        yield output
        return
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        folder = tempfile.TemporaryDirectory(  # after a kill it is known by this name
            prefix=f".{output.stem}-", suffix=f".partial{output.suffix}", dir=output.parent
        )
    except OSError as error:
        raise InputError(output, f"cannot be written: {error.strerror}.") from None
    with folder as name:
        yield Path(name, "recorded.nc")


def _catalogues(sources: Sequence[Source], given: Path | None) -> dict[str, Path]:
    """The catalogues that state facts, by name."""
    if given:
        return {given.name: given}
    return {s.name: s.path for s in sources if s.path.name == CATALOGUE and s.note}


def _refuse(outputs: Sequence[Path], sources: Sequence[Source], used: Iterable[Path]) -> None:
    """Refuse outputs that would replace an input; what this command wrote before is none."""
    strange = [s.path for s in sources if s.path.suffix == ".nc" and not is_netcdf(s.path)]
    read = [*used, *strange, *(s.path for s in sources if s.is_read)]
    refuse_overwriting(outputs, read, beside=outputs[0])
    refuse_strange_entries(outputs[1])
    require_ending(outputs[0])
