"""The settings of the page. Invalid values raise errors and are never corrected."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from rockframe.cells import decimal
from rockframe.column import inertia_ratio_of
from rockframe.errors import ParameterError, require_known
from rockframe.frame import RockingFrame

#: Largest scale of the ground motion [1].
_LARGEST_SCALE: Final = 100.0
_NUMBERS: Final = ("height", "width", "mass_ratio", "restitution_factor", "scale", "from", "to")
_SWITCHES: Final = ("vertical", "pulse")
_NAMES: Final = ("record", *_SWITCHES, "section", *_NUMBERS)


@dataclass(frozen=True)
class Settings:
    """A frame, a motion, and the window of time that is shown.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    record : str
        Identifier of the record.
    scale : float
        Factor on the accelerations of the record [1].
    vertical : bool
        True if the vertical component is included.
    pulse : bool
        True if only the record's pulse shakes the frame horizontally.
    window : (float, float)
        Start and end of the time that is drawn in full detail [s].
    """

    frame: RockingFrame
    record: str
    scale: float
    vertical: bool
    pulse: bool
    window: tuple[float, float]


def read_settings(stated: Mapping[str, str]) -> Settings:
    """Return the settings that a request states.

    Parameters
    ----------
    stated : mapping of str to str
        ``record``; ``height`` and ``width`` of a column [m]; ``mass_ratio``,
        ``restitution_factor``, ``scale`` [1]; ``section``: rectangular, circular, or an inertia
        ratio [1]; ``vertical`` and ``pulse``: 0 or 1; ``from`` and ``to`` [s].

    Raises
    ------
    ParameterError
        If a setting is missing, unknown, not a number, or out of range.

    Examples
    --------
    >>> wide = {"record": "A", "height": "9.6", "width": "1.6", "mass_ratio": "4", "scale": "1",
    ...         "restitution_factor": "1", "section": "rectangular", "vertical": "0",
    ...         "pulse": "0", "from": "0", "to": "60"}
    >>> read_settings(wide).frame.mass_ratio
    4.0
    >>> read_settings({**wide, "scale": "nought"})
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid scale 'nought'. Must be a finite number.
    """
    for name in _NAMES:
        if name not in stated:
            raise ParameterError(
                f"Invalid settings without {name!r}. Must state each setting once."
            )
    for name in stated:
        require_known("setting", name, _NAMES)
    numbers = {name: _number(name, stated[name]) for name in _NUMBERS}
    scale = numbers["scale"]
    if not 0.0 < scale <= _LARGEST_SCALE:
        raise ParameterError(
            f"Invalid scale {scale!r}. Must be above 0 and at most {_LARGEST_SCALE:g}."
        )
    for name in _SWITCHES:
        if stated[name] not in ("0", "1"):
            raise ParameterError(f"Invalid {name} {stated[name]!r}. Must be 0 or 1.")
    height, width, section = numbers["height"], numbers["width"], stated["section"]
    # The dimensions are checked before an inertia is computed from them.
    frame = RockingFrame(height=height, width=width, name="own")
    known = section[:1].isdigit()
    ratio = _number("section", section) if known else inertia_ratio_of(section, height, width)
    return Settings(
        frame=replace(
            frame,
            mass_ratio=numbers["mass_ratio"],
            inertia_ratio=ratio,
            restitution_factor=numbers["restitution_factor"],
        ),
        record=stated["record"],
        scale=scale,
        vertical=stated["vertical"] == "1",
        pulse=stated["pulse"] == "1",
        window=(numbers["from"], numbers["to"]),
    )


def _number(name: str, text: str) -> float:
    try:
        return decimal(text)
    except ValueError:
        raise ParameterError(f"Invalid {name} {text!r}. Must be a finite number.") from None
