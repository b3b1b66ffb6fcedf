"""response.nc: histories and verdicts, records by structures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.files import RESPONSE, opened
from rockframe.results.variables import flags, record_ids, row_sizes, texts, variable
from rockframe.rocking.kernel import REST_VELOCITY_RATIO
from rockframe.rocking.response import Response, Verdict


def response_dataset(
    records: Sequence[Record],
    frames: Sequence[RockingFrame],
    responses: Sequence[Sequence[Response]],
    *,
    histories: bool = True,
) -> xr.Dataset:
    """Return the dataset of the respond stage: histories and verdicts, records by structures.

    Parameters
    ----------
    records : sequence of Record
        At least one.
    frames : sequence of RockingFrame
        At least one, with different names.
    responses : sequence of sequence of Response
        For each record the responses of the frames, in their order.
    histories : bool
        With ``theta``, ``u`` and ``v`` at each sample; without, the file does not grow with the
        length of the records.
    """
    pairs = ("record", "structure")

    def of_frame(quantity: str, units: str, long_name: str) -> xr.Variable:
        data = np.array([getattr(frame, quantity) for frame in frames])
        return variable("structure", data, units, long_name)

    def of_pair(quantity: str, units: str, long_name: str) -> xr.Variable:
        data = [[getattr(response, quantity) for response in row] for row in responses]
        return variable(pairs, np.array(data, dtype=np.float64), units, long_name)

    def history(quantity: str, units: str, long_name: str) -> xr.Variable:
        data = np.stack(
            [
                np.concatenate([getattr(row[k], quantity) for row in responses])
                for k in range(len(frames))
            ]
        )
        return variable(
            ("structure", "obs"), data, units, long_name, comment="NaN after overturning"
        )

    impacts = [[response.impacts for response in row] for row in responses]
    variables = {
        "record_id": record_ids([record.record_id for record in records]),
        "row_size": row_sizes([record.acceleration.size for record in records]),
        "verdict": flags(
            pairs, [[r.verdict for r in row] for row in responses], Verdict, "stability verdict"
        ),
        "peak_rotation_ratio": of_pair(
            "peak_rotation_ratio",
            "1",
            "largest |theta| / slenderness, free rocking after the record included",
        ),
        "peak_u": of_pair("peak_u", "m", "largest |u|, at the same rotation"),
        "peak_v": of_pair("peak_v", "m", "largest v"),
        "uplift_time": of_pair("uplift_time", "s", "first uplift"),
        "overturning_time": of_pair("overturning_time", "s", "when |theta| reaches pi/2"),
        "impacts": variable(
            pairs,
            np.array(impacts, dtype=np.int32),
            "1",
            "number of impacts",
            comment=f"the last before rest, slower than {REST_VELOCITY_RATIO:g} "
            "effective_frequency_parameter, are not counted",
        ),
        "height": of_frame("height", "m", "height of a column"),
        "width": of_frame("width", "m", "width of a column"),
        "slenderness": of_frame("slenderness", "rad", "slenderness of a column, alpha"),
        "size": of_frame("size", "m", "semi-diagonal of a column, R"),
        "mass_ratio": of_frame("mass_ratio", "1", "mass of the beam over that of all columns"),
        "frequency_parameter": of_frame(
            "frequency_parameter", "rad s-1", "frequency parameter of a column, p"
        ),
        "effective_frequency_parameter": of_frame(
            "effective_frequency_parameter", "rad s-1", "frequency parameter of the frame, p-hat"
        ),
        "restitution": of_frame(
            "restitution", "1", "angular velocity after an impact over that before, sqrt(r)"
        ),
        "uplift_acceleration": of_frame(
            "uplift_acceleration", "m s-2", "ground acceleration that starts uplift"
        ),
    }
    coords = {
        "structure": texts("structure", [frame.name for frame in frames], "name of the structure")
    }
    if histories:
        coords["time"] = variable(
            "obs",
            np.concatenate([row[0].time for row in responses]),
            "s",
            "time since the record's first sample",
        )
        variables |= {
            "theta": history("theta", "rad", "rotation of the columns"),
            "u": history("u", "m", "horizontal displacement of the beam relative to the ground"),
            "v": history("v", "m", "vertical lift of the beam"),
        }
    return xr.Dataset(
        variables,
        coords=coords,
        attrs={"title": "Rocking response of free-standing frames to records"},
    )


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

    @property
    def records(self) -> list[str]:
        """Identifiers of the records."""
        return [str(name) for name in self.dataset["record_id"].values]

    @property
    def structures(self) -> list[str]:
        """Names of the structures."""
        return [str(name) for name in self.dataset["structure"].values]

    def sel(self, *, record: str, structure: str) -> xr.Dataset:
        """Return the histories of one record and structure on ``time``, with their verdict.

        Raises
        ------
        ParameterError
            If there is no such record or structure, or the file holds no histories.
        """
        if "theta" not in self.dataset:
            raise ParameterError(
                f"{self.path}: holds no histories. Must be made with --histories all."
            )
        i = _position(self.records, record, "record")
        k = _position(self.structures, structure, "structure")
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
    >>> from rockframe.results import write
    >>> from rockframe.rocking import respond
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> frame = RockingFrame(height=9.6, width=1.6, name="bent")
    >>> dataset = response_dataset([record], [frame], [[respond(frame, record)]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "response.nc")
    ...     write(dataset, path, RESPONSE, input_sha256={}, parameters={})
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
