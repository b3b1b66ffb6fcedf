"""Place and time of an earthquake."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rockframe.errors import ParameterError
from rockframe.options.fetch import utc


@dataclass(frozen=True, kw_only=True)
class Event:
    """Place and time of an earthquake. Unknown values are NaN or empty.

    Parameters
    ----------
    time : str
        Origin time (ISO 8601, UTC).
    latitude, longitude : float
        Epicentre [degree], north and east positive.
    magnitude : float
        Magnitude [1].
    name : str
        Name of the earthquake.
    source : str
        Source of these values.

    Raises
    ------
    ParameterError
        If the time or the coordinates are invalid.

    Examples
    --------
    >>> Event(time="2019-07-06T03:19:53", latitude=35.77, longitude=-117.599).time
    '2019-07-06T03:19:53.000000Z'
    """

    time: str
    latitude: float
    longitude: float
    magnitude: float = math.nan
    name: str = ""
    source: str = "as given"

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "time", utc(self.time))
        except ValueError:
            raise ParameterError(f"Invalid origin time {self.time!r}.") from None
        for what, value, limit in (
            ("latitude", self.latitude, 90.0),
            ("longitude", self.longitude, 180.0),
            ("magnitude", 0.0 if math.isnan(self.magnitude) else self.magnitude, 100.0),
        ):
            if not abs(value) <= limit:
                raise ParameterError(
                    f"Invalid {what} {value!r}. Must be from {-limit:g} to {limit:g}."
                )


def known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with None in place of NaN.

    Examples
    --------
    >>> known({"magnitude": math.nan, "name": "Ridgecrest"})
    {'magnitude': None, 'name': 'Ridgecrest'}
    """
    return {
        key: None if isinstance(value, float) and math.isnan(value) else value
        for key, value in values.items()
    }
