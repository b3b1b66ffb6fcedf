"""Datasets of the figures of frames: their parameters, and the stability map."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.declare import flags, texts, variable
from rockframe.rocking import GroundAcceleration, Verdict, respond_many
from rockframe.rocking.spectra.overturning import increasing

Float = NDArray[np.float64]

#: Ratios of size, of frequency and the restitution do not depend on the height of the columns [m].
_HEIGHT: Final = 10.0
#: Heavy enough to be the limit of eq (28) to round-off.
_LIMIT: Final = 1e15


def size_dataset(mass_ratios: ArrayLike) -> xr.Dataset:
    """Return R-hat / R and p-hat / p over the mass ratio: Figure 5 of the paper, eqs (27), (29).

    Parameters
    ----------
    mass_ratios : array_like, shape (mass_ratio,)
        Mass of the beam over that of all columns [1].

    Raises
    ------
    ParameterError
        If a mass ratio is negative or not finite.

    Examples
    --------
    >>> size_dataset([0.0, 4.0])["size_ratio"].values.round(4)
    array([1.    , 1.4444])
    """
    gammas = np.asarray(mass_ratios, dtype=np.float64)
    frames = [_frame(0.1, float(gamma)) for gamma in gammas]
    heavy = _frame(0.1, _LIMIT)
    size = np.array([frame.effective_size / frame.size for frame in frames])
    frequency = np.array(
        [frame.effective_frequency_parameter / frame.frequency_parameter for frame in frames]
    )
    of_gamma = "mass_ratio"
    return xr.Dataset(
        {
            "size_ratio": variable(of_gamma, size, "1", "R-hat / R"),
            "frequency_ratio": variable(of_gamma, frequency, "1", "p-hat / p"),
            "size_limit": variable(
                (), heavy.effective_size / heavy.size, "1", "R-hat / R under a very heavy beam"
            ),
            "frequency_limit": variable(
                (),
                heavy.effective_frequency_parameter / heavy.frequency_parameter,
                "1",
                "p-hat / p under a very heavy beam",
            ),
        },
        coords={"mass_ratio": variable(of_gamma, gammas, "1", "m_b / (N m_c)")},
    )


def restitution_dataset(slendernesses: ArrayLike, mass_ratios: ArrayLike) -> xr.Dataset:
    """Return sqrt(r) over slenderness for mass ratios: Figure 7 of the paper, eq (43).

    Parameters
    ----------
    slendernesses : array_like, shape (slenderness,)
        Slenderness of the columns [rad], above 0.
    mass_ratios : array_like, shape (mass_ratio,)
        Mass of the beam over that of all columns [1]; infinity is the limit.

    Returns
    -------
    xarray.Dataset
        ``restitution``, NaN where such a frame does not rock, and the slenderness at which it
        ends.

    Raises
    ------
    ParameterError
        If a mass ratio is negative, or a slenderness too small.

    Examples
    --------
    >>> curves = restitution_dataset([0.1651486774], [0.0, 4.0])
    >>> curves["restitution"].values.ravel().round(4)
    array([0.9595, 0.947 ])
    """
    alphas = np.asarray(slendernesses, dtype=np.float64)
    gammas = np.asarray(mass_ratios, dtype=np.float64)
    finite = np.where(np.isinf(gammas), _LIMIT, gammas)
    limits = np.array([_frame(0.1, float(gamma)).slenderness_limit for gamma in finite])
    restitution = np.array(
        [
            [
                _frame(float(alpha), float(gamma)).restitution if alpha < limit else math.nan
                for alpha in alphas
            ]
            for gamma, limit in zip(finite, limits, strict=True)
        ]
    )
    return xr.Dataset(
        {
            "restitution": variable(
                ("mass_ratio", "slenderness"),
                restitution,
                "1",
                "angular velocity after an impact over that before, sqrt(r)",
            ),
            "slenderness_limit": variable(
                "mass_ratio", limits, "rad", "slenderness at which the restitution vanishes"
            ),
        },
        coords={
            "mass_ratio": variable("mass_ratio", gammas, "1", "m_b / (N m_c)"),
            "slenderness": variable("slenderness", alphas, "rad", "slenderness of a column"),
        },
    )


def _frame(slenderness: float, mass_ratio: float) -> RockingFrame:
    return RockingFrame(
        height=_HEIGHT, width=_HEIGHT * math.tan(slenderness), mass_ratio=mass_ratio
    )


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
