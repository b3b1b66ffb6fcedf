"""Numbers that a study lists one by one, or states as evenly spaced."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from rockframe.bounds import MOST_NUMBERS
from rockframe.study.toml import VALUE

#: Far beyond what anything is measured in; what is between two such numbers can be computed.
_HUGE: Final = 1e300
_SPAN: Final = (
    f"Must be a list of numbers, or {{ from = NUMBER, to = NUMBER, count = 2 to {MOST_NUMBERS} }}"
)


def evenly(first: float, last: float, count: int) -> list[float]:
    """Return evenly spaced numbers: both ends to the last bit, and 0.1 to 3 by 30 holds 1.

    Parameters
    ----------
    first, last : float
        The ends.
    count : int
        How many numbers, at least 2.

    Examples
    --------
    >>> evenly(1.0, 2.0, 5)
    [1.0, 1.25, 1.5, 1.75, 2.0]
    """
    within = [(first * (count - 1 - k) + last * k) / (count - 1) for k in range(1, count - 1)]
    return [first, *within, last]


def _listed(stated: Any) -> Any:
    """The list that a table of ends and count stands for; anything else as it is."""
    if not isinstance(stated, dict):
        return stated
    match stated:
        case {"from": int() | float() as first, "to": int() | float() as last, "count": int(count)}:
            whole = len(stated) == 3 and bool not in map(type, stated.values())
            sound = -_HUGE < first < _HUGE and -_HUGE < last < _HUGE and 2 <= count <= MOST_NUMBERS
            if whole and sound:
                return evenly(float(first), float(last), count)
    raise PydanticCustomError(VALUE, "{stated}. {must}", {"stated": str(stated), "must": _SPAN})


def _ascending(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if len(numbers) > MOST_NUMBERS:
        raise PydanticCustomError(
            VALUE, f"of {len(numbers)} numbers. Must be at most {MOST_NUMBERS}"
        )
    for number, following in itertools.pairwise(numbers):
        if not number < following:
            raise PydanticCustomError(VALUE, f"{following:g} after {number:g}. Must increase")
    if not all(map(math.isfinite, numbers)):
        raise PydanticCustomError(VALUE, "with an infinite number. Must be finite")
    return numbers


def _from_zero(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if numbers[0] < 0.0:
        raise PydanticCustomError(VALUE, f"with {numbers[0]:g}. Must be zero or positive")
    return numbers


def _above_zero(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if numbers[0] <= 0.0:
        raise PydanticCustomError(VALUE, f"with {numbers[0]:g}. Must be above 0")
    return numbers


#: At least one number, increasing; or ``{ from = 1.0, to = 8.0, count = 71 }``.
Numbers = Annotated[
    tuple[float, ...],
    Field(strict=False, min_length=1),
    BeforeValidator(_listed),
    AfterValidator(_ascending),
    WithJsonSchema(
        {
            "anyOf": [
                {
                    "type": "array",
                    "items": {"type": "number"},
                    "minItems": 1,
                    "maxItems": MOST_NUMBERS,
                },
                {
                    "type": "object",
                    "properties": {
                        "from": {"type": "number"},
                        "to": {"type": "number"},
                        "count": {"type": "integer", "minimum": 2, "maximum": MOST_NUMBERS},
                    },
                    "required": ["from", "to", "count"],
                    "additionalProperties": False,
                },
            ]
        }
    ),
]
#: The same of numbers that are zero or positive, and of positive ones.
NumbersFromZero = Annotated[Numbers, AfterValidator(_from_zero)]
PositiveNumbers = Annotated[Numbers, AfterValidator(_above_zero)]
