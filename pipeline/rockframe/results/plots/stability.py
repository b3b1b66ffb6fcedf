"""The stability map of a record, for its figure."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.declare import flags, texts, variable
from rockframe.rocking import GroundAcceleration, Verdict, respond_many
from rockframe.rocking.spectra.overturning import increasing


def stability_dataset(
    record: Record,
    frame: RockingFrame,
    heights: ArrayLike,
    scales: ArrayLike,
    motion: GroundAcceleration | None = None,
) -> xr.Dataset:
    """Return what becomes of frames of each size at each scale of a motion.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        Its slenderness, mass ratio, section and losses are those of all.
    heights : array_like, shape (column_height,)
        Heights of the columns [m].
    scales : array_like, shape (scale,)
        What the motion is multiplied by [1].
    motion : GroundAcceleration, optional
        What moves them, if that is more than the record: with vertical acceleration.

    Raises
    ------
    ParameterError
        If heights or scales are not increasing and positive, a column is not between 1 mm and 1 km,
        or a vertical acceleration at its scale falls faster than gravity.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=np.sin(np.arange(60.0)), time_step=0.1)
    >>> frame = RockingFrame(height=4.0, width=0.3)
    >>> stability_dataset(record, frame, [0.4, 40.0], [0.5, 2.0])["verdict"].values.tolist()
    [[0, 2], [0, 1]]
    """
    tall = increasing("height", heights)
    strong = increasing("scale", scales)
    frames = [frame.resized(height, height * frame.width / frame.height) for height in tall]
    verdict = respond_many([motion or record], frames, strong).verdict[0]
    held = RESPONSE_NC.dataset(RESPONSE_NC.filled("frame", [frame]))
    known = held.isel(structure=0).variables
    return xr.Dataset(
        {
            "verdict": flags(("column_height", "scale"), verdict, Verdict, "stability verdict"),
            "pga": variable(
                (), np.abs(record.acceleration).max(), "m s-2", "peak ground acceleration"
            ),
            "record_id": texts("record", [record.record_id], "record identifier").isel(record=0),
            **known,
        },
        coords={
            "structure": texts("structure", [frame.name], "name of the structure").isel(
                structure=0
            ),
            "column_height": variable("column_height", tall, "m", "height of a column"),
            "scale": variable("scale", strong, "1", "what the motion is multiplied by"),
        },
        attrs={"title": "Stability map of a record"},
    )
