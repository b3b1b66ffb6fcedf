"""Elastic spectra of design codes, from the parameters that the codes ask for."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from rockframe.errors import InputError, ParameterError, require_known
from rockframe.options.model import Options
from rockframe.study.toml import parse, read_text
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Soil factor S and corner periods T_B, T_C, T_D [s] of ground types: EN 1998-1:2004, Table 3.2.
_TYPE_1: Final = {
    "A": (1.0, 0.15, 0.4, 2.0),
    "B": (1.2, 0.15, 0.5, 2.0),
    "C": (1.15, 0.2, 0.6, 2.0),
    "D": (1.35, 0.2, 0.8, 2.0),
    "E": (1.4, 0.15, 0.5, 2.0),
}
#: The same, Table 3.3: for earthquakes with surface-wave magnitudes up to 5.5.
_TYPE_2: Final = {
    "A": (1.0, 0.05, 0.25, 1.2),
    "B": (1.35, 0.05, 0.25, 1.2),
    "C": (1.5, 0.1, 0.25, 1.2),
    "D": (1.8, 0.1, 0.3, 1.2),
    "E": (1.6, 0.05, 0.25, 1.2),
}
#: Periods of a target from a code, if none are stated [s]: from 0.05 s to the 4 s of Eurocode 8.
PERIODS: Final = tuple(round(float(p), 4) for p in np.geomspace(0.05, 4.0, 40))


def asce7_spectrum(periods: ArrayLike, sds: float, sd1: float, long_period: float) -> Float:
    """Return the two-period design response spectrum of ASCE 7 [m s-2].

    Parameters
    ----------
    periods : array_like, shape (periods,)
        Periods [s].
    sds, sd1 : float
        Design spectral accelerations S_DS at short periods and S_D1 at 1 s [m s-2].
    long_period : float
        Long-period transition period T_L [s].

    Raises
    ------
    ParameterError
        Unless all are positive, and the corner S_D1 / S_DS is below T_L.

    Notes
    -----
    ASCE/SEI 7-22, 11.4.5.2, as in 11.4.6 of ASCE/SEI 7-16. The accelerations are those of the
    direction in which they are largest.

    Examples
    --------
    >>> asce7_spectrum([0.0, 0.1, 0.3, 1.0, 16.0], 10.0, 6.0, 8.0).round(3).tolist()
    [4.0, 9.0, 10.0, 6.0, 0.188]
    """
    t = _valid(periods)
    _require_positive(sds=sds, sd1=sd1, long_period=long_period)
    corner = sd1 / sds
    if corner >= long_period:
        raise ParameterError(
            f"Invalid long_period {long_period:g} s. Must be above S_D1 / S_DS, {corner:.3g} s."
        )
    rising = sds * (0.4 + 0.6 * t / (0.2 * corner))
    later = np.maximum(t, corner)
    falling = sd1 / later * np.minimum(1.0, long_period / later)
    return np.where(t < 0.2 * corner, rising, np.minimum(sds, falling))


def eurocode8_spectrum(
    periods: ArrayLike, ground_acceleration: float, ground: str, spectrum_type: int = 1
) -> Float:
    """Return the horizontal elastic response spectrum of Eurocode 8 for 5 % damping [m s-2].

    Parameters
    ----------
    periods : array_like, shape (periods,)
        Periods, up to 4 s.
    ground_acceleration : float
        Design ground acceleration a_g on ground of type A [m s-2], with the importance factor.
    ground : {"A", "B", "C", "D", "E"}
        Ground type.
    spectrum_type : {1, 2}
        Type of the spectrum; 2 is for earthquakes with surface-wave magnitudes up to 5.5.

    Raises
    ------
    ParameterError
        Unless the acceleration is positive, periods are at most 4 s, and type and ground are known.

    Notes
    -----
    EN 1998-1:2004, 3.2.2.2, equations (3.2) to (3.5), with the recommended values of Tables 3.2
    and 3.3; national annexes may state others.

    Examples
    --------
    >>> eurocode8_spectrum([0.0, 0.3, 1.0, 4.0], 2.5, "B").round(4).tolist()
    [3.0, 7.5, 3.75, 0.4688]
    """
    t = _valid(periods)
    _require_positive(ground_acceleration=ground_acceleration)
    require_known("ground", ground, _TYPE_1)
    require_known("spectrum_type", spectrum_type, {1: _TYPE_1, 2: _TYPE_2})
    if t.size and t.max() > 4.0:
        raise ParameterError(
            f"Invalid period {t.max():g} s. Must be at most 4 s for the spectrum of Eurocode 8."
        )
    soil, t_b, t_c, t_d = (_TYPE_1 if spectrum_type == 1 else _TYPE_2)[ground]
    later = np.maximum(t, t_c)
    shape = 2.5 * t_c / later * np.minimum(1.0, t_d / later)
    return ground_acceleration * soil * np.where(t < t_b, 1.0 + 1.5 * t / t_b, shape)


def _valid(periods: ArrayLike) -> Float:
    t = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    if not (np.isfinite(t).all() and (t >= 0.0).all()):
        raise ParameterError("Invalid periods. Must be zero or positive, in seconds.")
    return t


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < np.inf:
            raise ParameterError(f"Invalid {name} {value!r}. Must be positive.")


_Positive = Annotated[float, Field(gt=0.0, lt=100.0)]


class _Asce7(Options):
    """The spectrum of ASCE 7, from the two accelerations that its maps give for a site."""

    sds_g: _Positive
    sd1_g: _Positive
    long_period_s: _Positive
    scale: _Positive = 1.0

    def at(self, periods: ArrayLike) -> Float:
        """Return the spectrum [m s-2]."""
        values = (self.sds_g * GRAVITY, self.sd1_g * GRAVITY, self.long_period_s)
        return self.scale * asce7_spectrum(periods, *values)


class _Eurocode8(Options):
    """The elastic spectrum of Eurocode 8, from the acceleration and the type of the ground."""

    ground_acceleration_g: _Positive
    ground: Literal["A", "B", "C", "D", "E"]
    spectrum_type: Literal[1, 2] = 1
    scale: _Positive = 1.0

    def at(self, periods: ArrayLike) -> Float:
        """Return the spectrum [m s-2]."""
        acceleration = self.ground_acceleration_g * GRAVITY
        return self.scale * eurocode8_spectrum(
            periods, acceleration, self.ground, self.spectrum_type
        )


class _CodeFile(Options):
    asce_7: _Asce7 | None = None
    eurocode_8: _Eurocode8 | None = None


def read_code_spectrum(path: Path, periods: ArrayLike) -> tuple[Float, str]:
    r"""Read the parameters of a code's spectrum, and return it at some periods.

    Parameters
    ----------
    path : Path
        TOML file with one table: ``[asce_7]`` with ``sds_g``, ``sd1_g`` and ``long_period_s``, or
        ``[eurocode_8]`` with ``ground_acceleration_g``, ``ground`` and ``spectrum_type``; ``scale``
        multiplies the spectrum, such as 1.5 for MCE_R.
    periods : array_like, shape (periods,)
        Periods [s].

    Returns
    -------
    sa : array, shape (periods,)
        Pseudo-spectral acceleration [m s-2].
    words : str
        The code in words.

    Raises
    ------
    InputError
        If the file cannot be read, has no code or two, an unknown key, or an invalid value.
    ParameterError
        If the code has no value at a period.

    Examples
    --------
    >>> import tempfile
    >>> text = '[asce_7]\nsds_g = 1.0\nsd1_g = 0.6\nlong_period_s = 8.0\n'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.toml")
    ...     _ = path.write_text(text)
    ...     sa, words = read_code_spectrum(path, [1.0])
    >>> (sa / GRAVITY).round(3).tolist(), words
    ([0.6], 'ASCE 7')
    """
    codes = parse(path, read_text(path), _CodeFile)
    tables = {"ASCE 7": codes.asce_7, "Eurocode 8": codes.eurocode_8}
    stated = {name: table for name, table in tables.items() if table is not None}
    if len(stated) != 1:
        raise InputError(path, f"{len(stated)} codes. Must be one table, [asce_7] or [eurocode_8].")
    [(name, table)] = stated.items()
    words = name if table.scale == 1.0 else f"{table.scale:g} times {name}"
    return table.at(periods), words
