"""Free-standing frames over arrays of their dimensions, in one call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rockframe.errors import ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.quantities import OF_SCENARIO
from rockframe.record import Record
from rockframe.results.schema.response import SCREEN_NC
from rockframe.rocking import GroundAcceleration, respond_scenarios
from rockframe.structures.screening import quantities_of
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr

#: Arguments of a frame that can be arrays, with their units.
_UNITS: Final = {
    **dict.fromkeys(("height", "width", "top_width", "centre_of_gravity"), "m"),
    **dict.fromkeys(("mass_ratio", "inertia_ratio", "restitution_factor"), "1"),
}


def sweep(
    motion: Record | Pulse | GroundAcceleration,
    *,
    scale: ArrayLike | xr.DataArray = 1.0,
    **parameters: Any,
) -> xr.Dataset:
    """Return the nominal peaks of frames over arrays of their dimensions under one motion.

    Parameters
    ----------
    motion : Record, Pulse or GroundAcceleration
        The motion.
    scale : float, sequence of float or DataArray
        Multiples of the motion [1].
    **parameters
        Arguments of `RockingFrame`. ``height``, ``width``, ``top_width``, ``centre_of_gravity``,
        ``mass_ratio``, ``inertia_ratio`` and ``restitution_factor`` can each be a number, a
        sequence, which becomes a dimension of that name, or a DataArray, whose dimensions are
        kept: two that share a dimension vary together.

    Returns
    -------
    Dataset
        ``verdict``, ``peak_rotation_ratio``, ``peak_u``, ``peak_v`` and ``peak_impact_velocity``,
        with units, over the dimensions of the parameters and of `scale`.

    Raises
    ------
    ParameterError
        If an argument is unknown or has more than one dimension without names, if dimensions
        differ in size, or if one of the frames is invalid; the message states its dimensions.

    Examples
    --------
    Sizes and slendernesses of columns under a pulse:

    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> peaks = sweep(pulse, height=[3.0, 6.0, 9.0], width=[0.5, 1.0], scale=[0.5, 1.0])
    >>> dict(peaks.sizes)
    {'height': 3, 'width': 2, 'scale': 2}
    >>> peaks["peak_rotation_ratio"].sel(height=9.0, width=1.0).round(3).values.tolist()
    [0.482, 14.195]
    """
    import xarray as xr  # the command line does not need it

    arrays = dict(_arrays({**parameters, "scale": scale}))
    try:
        spread = dict(zip(arrays, xr.broadcast(*arrays.values()), strict=True))
    except ValueError as error:
        raise ParameterError(f"Invalid dimensions of the parameters: {error}.") from None
    like = spread.pop("scale")
    constant = {name: value for name, value in parameters.items() if name not in spread}
    cells = {name: values.to_numpy().ravel() for name, values in spread.items()}
    frames, place = _different(cells, constant, like.size)
    results = respond_scenarios(
        [motion], frames, np.zeros(like.size, dtype=int), place, like.to_numpy().ravel()
    )
    peaks = quantities_of(
        [frames[k] for k in place],
        results.verdict[:, None],
        results.peak_rotation[:, None],
        results.impact_velocity[:, None],
    )
    variables = {
        name: (like.dims, peaks[name].reshape(like.shape), SCREEN_NC[name].described())
        for name in ("verdict", *(quantity.name for quantity in OF_SCENARIO))
    }
    return xr.Dataset(variables, coords={**like.coords})


def _arrays(parameters: Mapping[str, Any]) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield the numbers among the parameters as arrays with named dimensions."""
    import xarray as xr

    names = [field.name for field in fields(RockingFrame)]
    for name, value in parameters.items():
        require_known("parameter", name, [*names, "scale"])
        if isinstance(value, xr.DataArray):
            array = value
        elif name in _UNITS or name == "scale":
            numbers = np.asarray(value)
            if numbers.ndim > 1:
                raise ParameterError(
                    f"Invalid {name} of shape {numbers.shape}. Must be a number, a row of numbers, "
                    "or a DataArray, which names its dimensions."
                )
            attrs = {"units": _UNITS.get(name, "1")}
            coords = {name: (name, numbers, attrs)} if numbers.ndim else {}
            array = xr.DataArray(numbers, coords, [name] if numbers.ndim else [])
        else:
            continue
        if name not in (*_UNITS, "scale"):
            raise ParameterError(
                f"Invalid {name} of type DataArray. Must be one value; arrays are allowed for "
                f"{', '.join((*_UNITS, 'scale'))}."
            )
        if array.dtype.kind not in "iuf":
            raise ParameterError(f"Invalid {name} of type {array.dtype}. Must be numbers.")
        yield name, array


def _different(
    cells: Mapping[str, Any], constant: Mapping[str, Any], count: int
) -> tuple[list[RockingFrame], np.ndarray[Any, np.dtype[np.intp]]]:
    """Return the frames that differ, and which of them each cell has."""
    rows = np.column_stack([*cells.values()]) if cells else np.zeros((count, 0))
    different, place = np.unique(rows, axis=0, return_inverse=True)
    frames = []
    for row in different:
        dimensions = dict(zip(cells, row.tolist(), strict=True))
        try:
            frames.append(RockingFrame(**{"name": "swept", **constant, **dimensions}))
        except ParameterError as error:
            label = ", ".join(f"{name} {value:g}" for name, value in dimensions.items())
            raise ParameterError(f"{label}: {error}") from None
    return frames, place.ravel()
