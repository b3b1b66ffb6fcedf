"""Find the pulses of records.nc and write pulses.nc."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Final

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import ParameterError
from rockframe.matching.record_pulses import pulses_or_reasons
from rockframe.options.pulse import PulseOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.record import Record
from rockframe.results.pulses import write_pulses
from rockframe.results.records import RecordsFile, open_records
from rockframe.results.writing import input_hash
from rockframe.stages.common import (
    WHOLE,
    Batch,
    Counted,
    Progress,
    WrittenArrays,
    accepted,
    horizontal,
    silent,
    unseen,
)

#: Records per task.
_TOGETHER: Final = 8


def pulse_stage(
    records_path: str | Path,
    output: str | Path,
    options: PulseOptions | None = None,
    *,
    batch: Batch = WHOLE,
    engine: Engine | None = None,
    progress: Progress = silent,
    written: WrittenArrays = unseen,
) -> tuple[InputOutcome, ...]:
    """Find the pulses of each horizontal record: ``pulses.nc``.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write.
    options : PulseOptions, optional
        Options of the search. The range of periods is reduced to the usable range of each record.
    batch : Batch
        Part of the records; `index_stage` joins the files of all batches.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    progress : callable
        Called with the number of records done and in total.
    written : callable
        Called with the `Arrays` of the written file, without its series.

    Returns
    -------
    tuple of InputOutcome
        Rejected records, in which no period of the range is usable.

    Raises
    ------
    InputError
        If the records cannot be read or the output not written.
    ParameterError
        If no record is horizontal, or none can be searched.
    EngineError
        If the engine is not available.

    Examples
    --------
    >>> import tempfile, rockframe
    >>> motion = rockframe.bundled_records() / "Ridgecrest2019-CLC.V1"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     records, output = Path(folder, "records.nc"), Path(folder, "pulses.nc")
    ...     _ = rockframe.ingest_stage([motion], records, workers=0)
    ...     rejected = pulse_stage(records, output)
    ...     output.is_file(), rejected
    (True, ())
    """
    records_path, output = Path(records_path), Path(output)
    refuse_overwriting([output], [records_path])
    wanted = options or PulseOptions()
    left_out: dict[str, str] = {}
    with open_records(records_path) as file:
        names = batch.of(horizontal(file))
        waiting: dict[str, Record] = {}
        tasks = Counted(
            _tasks(file, names, wanted, left_out, waiting), math.ceil(len(names) / _TOGETHER)
        )
        results = chain.from_iterable(map_tasks(pulses_or_reasons, tasks, engine=engine))
        pulses = accepted(results, names, batch, left_out, progress)
        dataset = write_pulses(
            ((waiting.pop(name), pulse) for name, pulse in pulses),
            output,
            input_sha256=input_hash(records_path),
            parameters=wanted.stated(),
            left_out=left_out,
            batch=batch.stated,
        )
    written(dataset)
    return tuple(InputOutcome(name, left_out[name]) for name in names if name in left_out)


def usable(record: str, file: RecordsFile, options: PulseOptions) -> PulseOptions:
    """Return the options with the range of periods reduced to the usable range of a record.

    Raises
    ------
    ParameterError
        If no period of the range is usable.
    """
    shortest, longest = file.usable_periods(record)
    first, last = options.periods_s
    low, high = max(first, shortest), min(last, longest)
    if high <= low:
        raise ParameterError(
            f"Invalid range of periods from {first:g} to {last:g} s. Must overlap with the usable "
            "periods of the record, "
            + (f"{shortest:.3g} to {longest:.3g} s." if longest > 0.0 else "of which it has none.")
        )
    return options.replaced(periods_s=(low, high))


def _tasks(
    file: RecordsFile,
    names: Sequence[str],
    options: PulseOptions,
    left_out: dict[str, str],
    waiting: dict[str, Record],
) -> Iterator[Sequence[tuple[Record, PulseOptions]]]:
    """Yield the tasks; only the records of unfinished tasks are in memory."""
    held: list[tuple[Record, PulseOptions]] = []
    for name in names:
        try:
            held.append((record := file.read(name), usable(name, file, options)))
            waiting[name] = record
        except ParameterError as error:
            left_out[name] = str(error)
        if len(held) == _TOGETHER:
            yield held
            held = []
            for rejected in waiting.keys() & left_out.keys():
                del waiting[rejected]
    if held:
        yield held
