"""response.nc: histories and verdicts, records by structures."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.results.margins import margin_values, strips_of
from rockframe.results.merging import no_records
from rockframe.results.reading import opened
from rockframe.results.schema import RESPONSE, RESPONSE_NC
from rockframe.results.schema.response import FateUnderPulse
from rockframe.results.writing import growing, named, put
from rockframe.rocking import ToPulse
from rockframe.rocking.margins.strip import Strip
from rockframe.rocking.response import Response

_HISTORIES: Final = ("theta", "u", "v")
#: Parts of a response that it may not have.
_PARTS: Final = ("to_pulse", "margin", "contact")


def write_responses(
    answers: Iterable[tuple[str, Sequence[Response]]],
    frames: Sequence[RockingFrame],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str] | None = None,
    batch: str = "",
) -> None:
    """Write the output of the respond stage, whole or not at all; holds one record at a time.

    The same inputs give the same bytes.

    Parameters
    ----------
    answers : iterable of (str, sequence of Response)
        The identifier of a record, and the responses of the frames, in their order. Those whose
        nodes are left out have no history in the file. An error that it raises leaves no file.
    frames : sequence of RockingFrame
        At least one, with different names.
    path : Path
        Where it goes; an older file there is replaced.
    input_sha256 : mapping
        Name and SHA-256 of each input.
    parameters : mapping
        The options of the stage; JSON values. If ``pulses`` is true, what the records' pulses alone
        do goes into the file.
    left_out : mapping of str to str, optional
        Why records that went in did not come out, by identifier; read after the answers.
    batch : str
        Of the batch of which it is, ``2/3``; empty for all records.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    columns: dict[str, list[Any]] = defaultdict(list)
    source = iter(answers)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    with named(path) as partial:
        with growing(partial, _series(len(frames))) as append:
            for name, responses in chain(first, source):
                append(_histories(responses))
                columns["record_id"].append(name)
                columns["row_size"].append(max(response.time.size for response in responses))
                columns["history"].append([response.time.size > 0 for response in responses])
                for name, values in RESPONSE_NC.filled("response", list(responses)).items():
                    columns[name].append(values)
                columns["to_pulse"].append([response.to_pulse for response in responses])
                columns["margin"].append([response.margin for response in responses])
                columns["contact"].append([response.contact for response in responses])
        made = _dataset(columns, frames, parameters) if columns else no_records()
        put(
            made.assign_attrs(batch=batch) if batch else made,
            partial,
            RESPONSE,
            input_sha256=input_sha256,
            parameters=parameters,
            left_out=left_out,
            mode="a" if columns else "w",
        )


def _series(structures: int) -> dict[str, xr.Variable]:
    """What histories are like."""
    empty = np.empty((structures, 0))
    return {
        "time": RESPONSE_NC["time"].holding([]),
        **{name: RESPONSE_NC[name].holding(empty) for name in _HISTORIES},
    }


def _histories(responses: Sequence[Response]) -> dict[str, NDArray[np.float64]]:
    """Histories of the frames under one record; NaN where they are not kept."""
    time = max((response.time for response in responses), key=len)
    series = {"time": time}
    for name in _HISTORIES:
        series[name] = np.full((len(responses), time.size), np.nan)
        for row, response in zip(series[name], responses, strict=True):
            if response.time.size:
                row[:] = getattr(response, name)
    return series


def _dataset(
    columns: Mapping[str, list[Any]],
    frames: Sequence[RockingFrame],
    parameters: Mapping[str, Any],
) -> xr.Dataset:
    """Return all variables but the histories."""
    values = {name: column for name, column in columns.items() if name not in _PARTS}
    values |= RESPONSE_NC.filled("frame", list(frames))
    values["structure"] = [frame.name for frame in frames]
    if parameters.get("pulses"):
        values |= to_pulse_values(columns["to_pulse"])
    if all(margin is not None for row in columns["margin"] for margin in row):
        values |= margin_values(columns["margin"])
    if all(contact is not None for row in columns["contact"] for contact in row):
        values |= RESPONSE_NC.filled("contact", columns["contact"])
    return RESPONSE_NC.dataset(values)


class ResponseFile:
    """A response file, open for selecting histories; closes at the end of a ``with`` block.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe respond``.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._context = opened(self.path, RESPONSE)
        self.dataset = self._context.__enter__()
        self._ends = np.cumsum(self.dataset["row_size"].values)

    def __enter__(self) -> ResponseFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._context.__exit__(None, None, None)

    @cached_property
    def records(self) -> list[str]:
        """Identifiers of the records."""
        return [str(name) for name in self.dataset["record_id"].values]

    @cached_property
    def structures(self) -> list[str]:
        """Names of the structures."""
        return [str(name) for name in self.dataset["structure"].values]

    def kept(self, record: str) -> list[str]:
        """Return the names of the structures whose histories under a record are in the file."""
        kept = self.dataset["history"].values[_position(self.records, record, "record")]
        return [name for name, there in zip(self.structures, kept, strict=True) if there]

    def strips(self, record: str) -> dict[str, Strip]:
        """Return the strip of each structure under a record; none without margins."""
        return {
            structure: strip for (_, structure), strip in strips_of(self.dataset, [record]).items()
        }

    def sel(self, *, record: str, structure: str) -> xr.Dataset:
        """Return the histories of one record and structure on ``time``, with their verdict.

        Raises
        ------
        ParameterError
            If there is no such record or structure, or its history was not kept.
        """
        i = _position(self.records, record, "record")
        k = _position(self.structures, structure, "structure")
        if not self.dataset["history"].values[i, k]:
            raise ParameterError(
                f"no history of {structure!r} under {record!r} was kept. Must be computed with "
                "--histories all."
            )
        end = int(self._ends[i])
        rows = slice(end - int(self.dataset["row_size"].values[i]), end)
        chosen = self.dataset.isel(record=i, structure=k, obs=rows).drop_vars("row_size")
        return chosen.load().swap_dims(obs="time").set_coords("record_id")


def open_response(path: str | Path) -> ResponseFile:
    """Open the output of the respond stage.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.

    Examples
    --------
    >>> import tempfile
    >>> from rockframe import Record, respond
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> frame = RockingFrame(height=9.6, width=1.6, name="bent")
    >>> answers = [("shake", [respond(frame, record)])]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "response.nc")
    ...     write_responses(answers, [frame], path, input_sha256={}, parameters={})
    ...     with open_response(path) as response:
    ...         history = response.sel(record="shake", structure="bent")
    >>> history["theta"].dims, bool(history["theta"][-1] < 0.0)
    (('time',), True)
    """
    return ResponseFile(path)


def _position(names: list[str], name: str, what: str) -> int:
    try:
        return names.index(name)
    except ValueError:
        message = f"Invalid {what} {name!r}. Must be one of: {', '.join(names)}."
        raise ParameterError(message) from None


def to_pulse_values(rows: list[list[ToPulse | None]]) -> dict[str, Any]:
    """Return the values, records by structures, by variable; None where a record has no pulse."""
    values = RESPONSE_NC.filled("to_pulse", rows)
    values["verdict_to_pulse"] = [
        [FateUnderPulse.NO_PULSE if fate is None else fate for fate in row]
        for row in values["verdict_to_pulse"]
    ]
    return values
