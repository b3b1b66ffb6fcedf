"""Units: SI inside, conversion only on the way in and on the way out, nothing guessed."""

from __future__ import annotations

from typing import Final

from rockframe.errors import ParameterError

#: Acceleration of gravity [m s-2]. The one value for the weight of the frame and for the unit "g"
#: of a record, so that the ratio of the two, on which rocking depends, is free of it. It is the
#: value of the paper's examples, not the conventional 9.80665.
GRAVITY: Final = 9.81

#: One of each acceleration unit in m s-2. `gal` is cm s-2, never the gallon.
ACCELERATION_UNITS: Final = {
    "g": GRAVITY,
    "gal": 0.01,
    "cm/s2": 0.01,
    "mm/s2": 0.001,
    "m/s2": 1.0,
}


def acceleration_factor(units: str) -> float:
    """Return the factor that turns accelerations in `units` into m s-2.

    Parameters
    ----------
    units : str
        One of ``g``, ``gal``, ``cm/s2``, ``mm/s2``, ``m/s2``.

    Raises
    ------
    ParameterError
        If `units` is none of these.

    Examples
    --------
    >>> acceleration_factor("gal")
    0.01
    """
    try:
        return ACCELERATION_UNITS[units]
    except KeyError:
        known = ", ".join(ACCELERATION_UNITS)
        message = f"Invalid acceleration units {units!r}. Must be one of: {known}."
        raise ParameterError(message) from None
