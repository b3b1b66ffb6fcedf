"""Quality checks of a record: names, units, limits and verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Final

#: The checks in order: unit, and True if the limit is a lower limit, False if it is an upper one.
CHECKS: Final[Mapping[str, tuple[str, bool]]] = MappingProxyType(
    {
        "peak_acceleration": ("m s-2", False),
        "time_step": ("s", False),
        "not_free_field": ("1", False),
        "azimuth": ("degree", False),
        "stated_peak": ("1", False),
        "clipped_samples": ("1", False),
        "constant_time": ("s", False),
        "opening_share": ("1", False),
        "closing_share": ("1", False),
        "end_velocity_share": ("1", False),
        "end_displacement_share": ("1", False),
        "signal_to_noise": ("1", True),
        "usable_period_longest": ("s", True),
        "significant_duration": ("s", True),
        "arias_intensity": ("m s-1", True),
    }
)


class CheckVerdict(IntEnum):
    """Verdict of a check; the values of the flag variable `passport`."""

    OK = 0
    WARN = 1
    REJECT = 2
    NOT_MEASURED = 3


@dataclass(frozen=True)
class Check:
    """Result of one check of a record.

    Parameters
    ----------
    name : str
        Name of the measured quantity.
        value : float
        Measured value; NaN if it cannot be measured on this record.
    limit : float
        The limit that decided the verdict: the rejection limit if the value is beyond it, else the
        warning limit.
    verdict : CheckVerdict
        ``OK``, ``WARN``, ``REJECT``, or ``NOT_MEASURED``, which does not affect the verdict on the
        record.
    unit : str
        Unit of value and limit.
    at_least : bool
        True if the limit is a lower limit, False if it is an upper limit.

    Examples
    --------
    >>> print(Check("clipped_samples", 40.0, 25.0, CheckVerdict.REJECT, "1"))
    clipped_samples 40. Must be at most 25.
    """

    name: str
    value: float
    limit: float
    verdict: CheckVerdict
    unit: str
    at_least: bool = False

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        bound = "at least" if self.at_least else "at most"
        return f"{self.name} {self.value:.4g}{unit}. Must be {bound} {self.limit:.4g}{unit}."
