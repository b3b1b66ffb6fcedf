"""Units. Inside the package all values are in SI; input and output convert, and never guess."""

from __future__ import annotations

import math
import re
from collections import Counter
from datetime import UTC, datetime
from typing import Final

from rockframe.errors import require_known

#: Acceleration of gravity [m s-2], as in the paper's examples; the standard value is 9.80665. The
#: same value is used for the weight of the frame and for the unit "g" of records, so that it
#: cancels in their ratio, on which rocking depends.
GRAVITY: Final = 9.81

#: Acceleration units in m s-2. `gal` is cm s-2, never the gallon; `mg` is a thousandth of `g`.
ACCELERATION_UNITS: Final = {
    "g": GRAVITY,
    "gal": 0.01,
    "cm/s2": 0.01,
    "mm/s2": 0.001,
    "m/s2": 1.0,
    "mg": GRAVITY / 1000.0,
    "%g": GRAVITY / 100.0,
    "in/s2": 0.0254,
    "ft/s2": 0.3048,
}


_RAISED: Final = str.maketrans("²⁻−", "2--")
_OTHER_NAMES: Final = {"milli-g": "mg", "millig": "mg", "gals": "gal", "g's": "g"}


def plain_units(units: str) -> str:
    """Return the usual spelling of acceleration units, and other texts unchanged.

    Examples
    --------
    >>> plain_units("m/s²"), plain_units("G"), plain_units("cm/sec/sec"), plain_units("km/s2")
    ('m/s2', 'g', 'cm/s2', 'km/s2')
    >>> plain_units("m s-2"), plain_units("cm·s⁻²")
    ('m/s2', 'cm/s2')
    """
    plain = units.lower().translate(_RAISED)
    plain = re.sub(r"[\s^.·]|\*\*", "", plain).replace("sec", "s").replace("inch", "in")
    plain = _OTHER_NAMES.get(plain, plain)
    plain = re.sub(r"/s/s$|/?s-2$", "/s2", plain)
    return plain if plain in ACCELERATION_UNITS else units


def acceleration_factor(units: str) -> float:
    """Return the factor that converts accelerations in `units` to m s-2.

    Parameters
    ----------
    units : str
        One of `ACCELERATION_UNITS`, such as ``g``, ``gal`` or ``m/s2``.

    Raises
    ------
    ParameterError
        If `units` is not one of these.

    Examples
    --------
    >>> acceleration_factor("gal")
    0.01
    """
    require_known("acceleration units", units, ACCELERATION_UNITS)
    return ACCELERATION_UNITS[units]


#: Units in data files: factor and SI unit.
_KNOWN: Final = {
    **{"m": (1.0, "m"), "km": (1000.0, "m"), "cm": (0.01, "m"), "mm": (0.001, "m")},
    **{"s": (1.0, "s"), "ms": (0.001, "s"), "Hz": (1.0, "s-1"), "year": (1.0, "year")},
    **{"g": (GRAVITY, "m s-2"), "gal": (0.01, "m s-2"), "Gal": (0.01, "m s-2")},
    **{"rad": (1.0, "rad"), **dict.fromkeys(("degree", "degrees"), (math.pi / 180.0, "rad"))},
}
_FACTOR: Final = re.compile(r"([A-Za-z]+)(-?[1-9])?")


def conversion_factor(units: str, wanted: str) -> float | None:
    """Return the factor that converts one unit to another, or None if they do not match.

    Parameters
    ----------
    units, wanted : str
        Units as in data files: ``m s-2``, ``m/s2``, ``m/s**2``, ``cm s-2``, ``g``, ``ms``.

    Examples
    --------
    >>> conversion_factor("g", "m s-2"), conversion_factor("cm/s^2", "m s-2")
    (9.81, 0.01)
    >>> conversion_factor("furlong", "m") is None, conversion_factor("s", "m") is None
    (True, True)
    """
    if units == wanted:
        return 1.0
    parsed, sought = _parsed(units), _parsed(wanted)
    if parsed is None or sought is None or parsed[1] != sought[1]:
        return None
    return parsed[0] / sought[0]


def _parsed(units: str) -> tuple[float, dict[str, int]] | None:
    """Return the value of a unit and its powers of base units, or None if it is unknown."""
    value, powers = 1.0, Counter[str]()
    for place, part in enumerate(re.sub(r"\*\*|\^", "", units).replace("*", " ").split("/")):
        for word in part.split():
            match = _FACTOR.fullmatch(word)
            if word == "1":
                continue
            if match is None or match[1] not in _KNOWN:
                return None
            power = int(match[2] or 1) * (-1 if place else 1)
            one, base = _KNOWN[match[1]]
            value *= one**power
            for name in base.split():
                letters, exponent = re.fullmatch(r"([a-z]+)(-?\d)?", name).groups()  # type: ignore[union-attr]
                powers[letters] += power * int(exponent or 1)
    return value, {name: power for name, power in powers.items() if power}


def utc_seconds(time: str) -> float:
    """Return a time (ISO 8601, by default UTC) in seconds since 1970; NaN if there is none.

    Examples
    --------
    >>> utc_seconds("1970-01-01T00:01:00.5Z"), utc_seconds("")
    (60.5, nan)
    """
    try:
        moment = datetime.fromisoformat(time)
    except ValueError:
        return math.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
