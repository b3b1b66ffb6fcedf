"""pulse: from records.nc to pulses.nc."""

from __future__ import annotations

from pathlib import Path

from rockframe.errors import ParameterError
from rockframe.ingest import Rejection
from rockframe.matching import LONGEST_PERIOD, SHORTEST_PERIOD, PulseMatch, match_pulse
from rockframe.provenance import refuse_overwriting
from rockframe.record import Record
from rockframe.results import PULSES, input_hash, no_records, open_records, pulses_dataset, write
from rockframe.stages.common import WHOLE, Batch, Progress, horizontal, silent
from rockframe.wavelets import RICKERS


def pulse_stage(
    records_path: Path,
    output: Path,
    *,
    shortest_period: float = SHORTEST_PERIOD,
    longest_period: float = LONGEST_PERIOD,
    batch: Batch = WHOLE,
    progress: Progress = silent,
) -> tuple[Rejection, ...]:
    """Find the best pulse of each wavelet in each horizontal record: ``pulses.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    shortest_period, longest_period : float
        Range of T_p that is searched [s].
    batch : Batch
        Which of the records; `merge_stage` puts the files of all batches together.
    progress : callable
        Called with the number of records done and in all.

    Returns
    -------
    tuple of Rejection
        Records in which no pulse of these periods can be searched; they are left out.

    Raises
    ------
    InputError
        If the records cannot be read or the output not written.
    ParameterError
        If no record is horizontal, or none can be searched.
    """
    refuse_overwriting([output], [records_path])
    matched: dict[str, list[PulseMatch]] = {}
    rejections: list[Rejection] = []
    with open_records(records_path) as records:
        names = batch.of(horizontal(records))
        for i, name in enumerate(names):
            try:
                matched[name] = _matches(records.read(name), shortest_period, longest_period)
            except ParameterError as error:
                rejections.append(Rejection(file=name, reason=str(error)))
            progress(i + 1, len(names))
    if not matched and batch.whole:
        raise ParameterError(f"record {rejections[0].file!r}: {rejections[0].reason}")
    found = pulses_dataset(list(matched), list(matched.values())) if matched else no_records()
    write(
        found,
        output,
        PULSES,
        input_sha256=input_hash(records_path),
        parameters={"periods_s": [shortest_period, longest_period]},
        left_out={rejection.file: rejection.reason for rejection in rejections},
    )
    return tuple(rejections)


def _matches(record: Record, shortest_period: float, longest_period: float) -> list[PulseMatch]:
    return [
        match_pulse(
            record.acceleration,
            record.time_step,
            name,
            shortest_period=shortest_period,
            longest_period=longest_period,
        )
        for name in RICKERS
    ]
