"""records.nc: the samples of the records and what is known of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rockframe.record import Record
from rockframe.results.files import named, put
from rockframe.results.growing import growing
from rockframe.results.recorded import RecordsFile, open_records
from rockframe.results.schema import RECORDS, RECORDS_NC
from rockframe.signals import Passport, integrate, peak


def write_records(
    records: Iterable[tuple[Record, Passport | None]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    sweep: Callable[[RecordsFile], Mapping[str, Sequence[float]]] | None = None,
) -> dict[str, str]:
    """Write the output of the ingest stage, whole or not at all; holds one record at a time.

    The same inputs give the same bytes.

    Parameters
    ----------
    records : iterable of (Record, Passport or None)
        At least one; if one has no passport, none must have one: then there are no measures. An
        error that it raises leaves no file.
    path : Path
        Where it goes; an older file there is replaced.
    input_sha256 : mapping
        Name and SHA-256 of each input besides the files that held the records.
    parameters : mapping
        The options of the stage; JSON values.
    sweep : callable, optional
        Called with the records before they are put in their place; gives numbers of both
        horizontals of each record, by variable.

    Returns
    -------
    dict of str to str
        Name and SHA-256 of each input, the files of the records among them.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    columns: dict[str, list[Any]] = defaultdict(list)
    source = iter(records)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    with named(path) as partial:
        with growing(partial, {"acceleration": RECORDS_NC["acceleration"].holding([])}) as append:
            for record, passport in chain(first, source):
                append({"acceleration": record.acceleration})
                for name, value in _known(record, passport).items():
                    columns[name].append(value)
        held = dict(zip(columns["source_file"], columns["source_sha256"], strict=True))
        held |= zip(columns["instrument_file"], columns["instrument_sha256"], strict=True)
        inputs = {**{name: digest for name, digest in held.items() if digest}, **input_sha256}
        origin = {"input_sha256": inputs, "parameters": parameters}
        put(RECORDS_NC.dataset(columns), partial, RECORDS, mode="a", **origin)
        if sweep is not None:
            put(_swept(partial, sweep), partial, RECORDS, mode="a", **origin)
    return inputs


def _swept(
    partial: Path, sweep: Callable[[RecordsFile], Mapping[str, Sequence[float]]]
) -> xr.Dataset:
    with open_records(partial) as records:
        found, unknown = sweep(records), np.full(len(records.names), np.nan)
    group = RECORDS_NC["azimuth_rotd100"].group
    names = [one.name for one in RECORDS_NC.variables if one.group == group]
    return RECORDS_NC.dataset({name: found.get(name, unknown) for name in names})


def _known(record: Record, passport: Passport | None) -> dict[str, Any]:
    """What is known of a record, by variable."""
    known = {
        "row_size": record.acceleration.size,
        "pga": peak(record.acceleration),
        "pgv": peak(integrate(record.acceleration, record.time_step)),
        **RECORDS_NC.filled("record", record),
        "processing": "; ".join(record.processing),
    }
    if passport is not None:
        known |= RECORDS_NC.filled("measures", passport.measures)
        known |= RECORDS_NC.filled("passport", passport)
    return known
