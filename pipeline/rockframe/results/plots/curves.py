"""Datasets of the figures of frames: parameters of frames, and the stability map."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.schema.plots import RESTITUTION, SIZE, STABILITY
from rockframe.results.schema.response import RESPONSE_NC
from rockframe.rocking import GroundAcceleration, respond_many
from rockframe.rocking.spectra.overturning import increasing

Float = NDArray[np.float64]

#: Height of the columns [m], arbitrary: size ratio, frequency ratio and restitution do not depend
#: on it.
_HEIGHT: Final = 10.0
#: Mass ratio that reaches the limit of eq (28) to round-off.
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
    return SIZE.dataset(
        {
            "size_ratio": size,
            "frequency_ratio": frequency,
            "size_limit": heavy.effective_size / heavy.size,
            "frequency_limit": heavy.effective_frequency_parameter / heavy.frequency_parameter,
            "mass_ratio": gammas,
        }
    )


def restitution_dataset(slendernesses: ArrayLike, mass_ratios: ArrayLike) -> xr.Dataset:
    """Return sqrt(r) over slenderness for each mass ratio: Figure 7 of the paper, eq (43).

    Parameters
    ----------
    slendernesses : array_like, shape (slenderness,)
        Slenderness of the columns [rad], above 0.
    mass_ratios : array_like, shape (mass_ratio,)
        Mass of the beam over that of all columns [1]; infinity gives the limit.

    Returns
    -------
    xarray.Dataset
        ``restitution``, NaN where such a frame does not rock, and the slenderness at which it
        vanishes.

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
    return RESTITUTION.dataset(
        {
            "restitution": restitution,
            "slenderness_limit": limits,
            "mass_ratio": gammas,
            "slenderness": alphas,
        }
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
    """Return the verdicts on frames of each size at each scale of a motion.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame; all sizes have its slenderness, mass ratio, section and restitution factor.
    heights : array_like, shape (column_height,)
        Heights of the columns [m].
    scales : array_like, shape (scale,)
        Factors on the motion [1].
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.

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
    drawn = STABILITY.dataset(
        {
            "verdict": verdict,
            "pga": np.abs(record.acceleration).max(),
            "record_id": record.record_id,
            "structure": frame.name,
            "column_height": tall,
            "scale": strong,
        }
    )
    return drawn.assign(held.isel(structure=0).variables).set_coords("structure")
