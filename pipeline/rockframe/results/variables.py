"""Variables as CF-1.11 wants them: units and a long name on each, flags with their meanings."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
import xarray as xr


def variable(
    dims: str | tuple[str, ...], data: Any, units: str, long_name: str, **attrs: Any
) -> xr.Variable:
    """Return a variable with its unit and long name."""
    return xr.Variable(dims, data, {"units": units, "long_name": long_name, **attrs})


def flags(
    dims: str | tuple[str, ...],
    data: Any,
    kind: type[IntEnum | IntFlag],
    long_name: str,
    **attrs: Any,
) -> xr.Variable:
    """Return a flag variable whose values, or bits, and meanings are those of an enumeration."""
    members = list(kind)
    numbers = np.array([member.value for member in members], dtype=np.int8)
    return variable(
        dims,
        np.asarray(data, dtype=np.int8),
        "1",
        long_name,
        **{"flag_masks" if issubclass(kind, IntFlag) else "flag_values": numbers},
        flag_meanings=" ".join(str(member.name).lower() for member in members),
        **attrs,
    )


def texts(
    dims: str | tuple[str, ...], values: Sequence[str], long_name: str, **attrs: Any
) -> xr.Variable:
    """Return a variable of texts; of one text if there are no dimensions."""
    data = np.array([str(value) for value in values] if dims else values, dtype=object)
    return variable(dims, data, "1", long_name, **attrs)
