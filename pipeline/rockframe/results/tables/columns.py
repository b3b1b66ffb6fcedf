"""Columns of printed tables, and the format of their values, in the terminal and on pages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from rockframe.cells import DASH, Cells, Column, number
from rockframe.rocking.stated_verdict import MODEL_ENDS, StatedVerdict, Verdict

#: Short names of wavelets.
_SHORT: Final = {
    "symmetric_ricker": "sym",
    "antisymmetric_ricker": "antisym",
    "ricker_any_phase": "any phase",
    "": DASH,
}


def stated_verdict(row: Cells) -> StatedVerdict:
    """Return the verdict of a row, computed or read from ``table.csv``.

    Examples
    --------
    >>> row = {"verdict": "undecided", "overturning_time_s": "31.2"}
    >>> stated_verdict(row).words
    'undecided, overturned 31.2 s'
    """
    searched = math.isfinite(number(row.get("largest_scale")))
    return StatedVerdict(
        Verdict[row["verdict"].upper()],
        overturning_time=number(row.get("overturning_time_s")),
        critical_scale=number(row.get("critical_scale")) if searched else None,
        model_ends={name: number(row.get(f"{name}_s")) for name in MODEL_ENDS},
    )


def verdict_words(row: Cells, _key: str = "") -> str:
    """Return the verdict of a row in words."""
    return stated_verdict(row).words


def standing(row: Cells, key: str) -> float | str:
    """Return a peak, or a dash for structures that overturn, whose peak only describes the fall."""
    return DASH if stated_verdict(row).overturns else number(row[key])


def critical_scale(row: Cells, key: str = "critical_scale") -> float | str:
    """Return a critical or robust scale, or its lower bound as text if none was found.

    Examples
    --------
    >>> critical_scale({"critical_scale": "", "largest_scale": 10.0})
    '> 10'
    """
    searched = "largest_scale" if key == "critical_scale" else "largest_robust_scale"
    found, largest = number(row.get(key)), number(row.get(searched))
    return f"> {largest:.3g}" if math.isnan(found) and math.isfinite(largest) else found


def robust_scales(row: Cells, _key: str = "") -> str:
    """Return the scales at which 10, 25 and 50 % of the ensemble overturn, to two decimals.

    Examples
    --------
    >>> robust_scales({f"robust_scale_{share}": 0.1043 * share for share in (10, 25)}
    ...     | {"largest_robust_scale": 10.0})
    '1.04 2.61 > 10'
    """
    parts = [_BY_KEY[f"robust_scale_{share}"].cell(row) for share in (10, 25, 50)]
    return parts[0] if parts[0] == DASH or parts[0].startswith(">") else " ".join(parts)


def wavelet_name(row: Cells, key: str = "wavelet") -> str:
    """Return the short name of the wavelet, marked if the match could be noise.

    Examples
    --------
    >>> wavelet_name({"wavelet": "symmetric_ricker", "pulse_verdict": "noise"})
    'sym†'
    """
    name = str(row[key])
    return _SHORT.get(name, name) + pulse_mark(row)


def stated_pulse(row: Cells) -> str:
    """Return the result of the test against noise for the pulse of a row; "" without a pulse.

    Examples
    --------
    >>> stated_pulse({"pulse_verdict": "noise", "pulse_p_value": "0.32"})
    'best match, could be noise (p = 0.32)'
    """
    if not row.get("pulse_verdict"):
        return ""
    from rockframe.matching.likeness import PulseVerdict, pulse_words  # verdicts need none

    p_value = number(row.get("pulse_p_value"))
    return pulse_words(PulseVerdict[row["pulse_verdict"].upper()], p_value)


def pulse_mark(row: Cells) -> str:
    """Return the mark of a pulse that does not pass the test against noise; "" for other pulses.

    Examples
    --------
    >>> pulse_mark({"pulse_verdict": "noise"}), pulse_mark({"pulse_verdict": "pulse"})
    ('†', '')
    """
    return "†" if row.get("pulse_verdict") == "noise" else ""


#: Columns of the overview of a run in the order of the page, results first.
OVERVIEW: Final = (
    Column("Record", "record", wraps=True),
    Column("Structure", "structure"),
    Column("Verdict", "verdict", rule=verdict_words, wraps=True),
    Column("Critical scale", "critical_scale", ".2f", rule=critical_scale),
    Column("10 % overturn", "robust_scale_10", ".2f", rule=critical_scale),
    Column("25 %", "robust_scale_25", ".2f", rule=critical_scale),
    Column("50 %", "robust_scale_50", ".2f", rule=critical_scale),
    Column("θ/α", "peak_rotation_ratio", ".3f", rule=standing),
    Column("u", "u_max_m", ".1f", 100.0, rule=standing, unit="cm", minor=True),
    Column("v", "v_max_m", ".2f", 100.0, rule=standing, unit="cm", minor=True),
    Column("Earthquake", "event", minor=True, wraps=True),
    Column("M", "magnitude", ".1f", minor=True),
    Column("Repi", "epicentral_distance_km", ".1f", unit="km", minor=True),
    Column("PGA", "pga_g", ".2f", unit="g", minor=True),
    Column("PGV", "pgv_m_s", ".2f", unit="m/s", minor=True),
    Column("a_p", "a_p_g", ".2f", unit="g", minor=True),
    Column("T_p", "T_p_s", ".2f", unit="s", minor=True),
    Column("Pulse", "wavelet", rule=wavelet_name, minor=True),
)
_BY_KEY: Final = {
    column.key: column
    for column in (
        *OVERVIEW,
        Column("record", "record_id"),
        Column("10 25 50 % overturn", "robust_scales", rule=robust_scales),
    )
}


def titled(heads: Mapping[str, str], **changes: Any) -> list[Column]:
    """Return columns of the overview by key, with new headings and other changes.

    Examples
    --------
    >>> titled({"u_max_m": "u_max [cm]>"})[0].cell({"u_max_m": 0.135, "verdict": "safe"})
    '13.5'
    """
    return [replace(_BY_KEY[key], head=head, **changes) for key, head in heads.items()]
