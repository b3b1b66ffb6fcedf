"""Limits of the record passport: the ``[passport]`` table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rockframe.options.model import RULE, Options
from rockframe.study.toml import parse, read_text
from rockframe.units import GRAVITY

#: Not below zero, and a number; infinity switches a limit of what must be at most off, and 0 a
#: limit of what must be at least.
_Limit = Annotated[float, Field(ge=0.0)]


#: Checks whose value must be at least the limit; of all others it must be at most that.
_AT_LEAST: Final = frozenset(
    ["signal_to_noise", "usable_period_longest", "significant_duration", "arias_intensity"]
)


class PassportLimits(Options):
    """Limits of the record passport: the ``[passport]`` table.

    Of each check there is a limit that warns and one that rejects. Rejected by default is only what
    no whole record of ground motion shows: flat tops, filled gaps, a peak of 10 g or one that does
    not rise above the noise, a time step above 1 s. The rest depends on the use,
    and old records and mathematical pulses are used with it knowingly: it warns. Each warning limit
    lies where the real records at hand that are whole and well processed mostly pass.

    Parameters
    ----------
    peak_acceleration_warn, peak_acceleration_reject : float
        Peak after processing [m s-2], at most. Few records pass 2 g and none in the archives 5 g;
        10 g are gal taken for g, or no ground motion.
    time_step_warn, time_step_reject : float
        Interval between samples [s], at most. Accelerographs take ten samples a second and more;
        steps of seconds are milliseconds, or samples a second, taken for seconds.
    not_free_field_warn, not_free_field_reject : float
        1 if the header says that the sensor stood in a structure or a borehole, 0 if on free ground
        [1], at most. What a structure amplifies, or the ground above a borehole, is no motion of
        the base of another structure. Never rejects by default; 0 does.
    stated_peak_warn, stated_peak_reject : float
        Difference between the peak in the file, with its sign where the header's has one, and the
        peak that the header states, over the latter [1], at most. Readers refuse what goes beyond
        the last printed digit; a hundredth more is a coarse header, and half is another record.
    clipped_samples_warn, clipped_samples_reject : float
        Longest run of equal samples at an extreme [1], at most. Three or four come from rounding
        (few digits, many samples a period); a run of 25 is a flat top.
    constant_time_warn, constant_time_reject : float
        Longest time without any change within the strong motion [s], at most. Ground motion above
        the resolution changes with each sample; half a second of none takes out a whole cycle of
        what rocks a structure.
    opening_share_warn, opening_share_reject : float
        Peak of the first 0.1 s over the peak [1], at most. A tenth is no longer the first arrival:
        the trigger was late. Never rejects by default, for most analogue records are so, and
        pulses in closed form begin at once.
    closing_share_warn, closing_share_reject : float
        Peak of the last 0.1 s over the peak [1], at most. A tenth is no coda: the record was cut,
        or lost its end. Never rejects by default, as one that is cut late is of use.
    end_velocity_share_warn, end_velocity_share_reject : float
        Absolute velocity at the end over the peak [1], at most. The ground ends at rest; a tenth of
        the peak shows a baseline that drifts. Never rejects by default: a half-sine ends moving.
    end_displacement_share_warn, end_displacement_share_reject : float
        Absolute displacement at the end over the peak [1], at most. A record near a fault may keep
        a true offset, so the limit is wide: above 0.9 the displacement is all drift, or all fling.
        Never rejects by default.
    signal_to_noise_warn, signal_to_noise_reject : float
        Peak over the root mean square of the noise before the event [1], at least. Noise itself
        peaks at about 4 times its root mean square; at 20 times, a fifth of the peak is noise.
    usable_period_longest_warn, usable_period_longest_reject : float
        Longest usable period [s], at least. Periods of pulses that overturn structures of some
        metres are 0.5 s to 2 s and more.
    significant_duration_warn, significant_duration_reject : float
        D5-95 [s], at least. What is over sooner is a spike or the cut of a record.
    arias_intensity_warn, arias_intensity_reject : float
        Arias intensity [m s-1], at least. A second at 0.003 g makes 1e-4 m/s: only instruments
        feel less.
    signal_to_noise_ratio : float
        Ratio of Fourier amplitudes above which a frequency is usable [1]; 3 is usual.

    References
    ----------
    Boore and Bommer (2005), Processing of strong-motion accelerograms, SDEE 25(2), 93-115: drift,
    corners, and the signal-to-noise ratio.

    Examples
    --------
    >>> PassportLimits(opening_share_reject=0.5).opening_share_reject
    0.5
    """

    peak_acceleration_warn: _Limit = 2.0 * GRAVITY
    peak_acceleration_reject: _Limit = 10.0 * GRAVITY
    time_step_warn: _Limit = 0.1
    time_step_reject: _Limit = 1.0
    not_free_field_warn: _Limit = 0.0
    not_free_field_reject: _Limit = math.inf
    stated_peak_warn: _Limit = 0.01
    stated_peak_reject: _Limit = 0.5
    clipped_samples_warn: _Limit = 4.0
    clipped_samples_reject: _Limit = 24.0
    constant_time_warn: _Limit = 0.1
    constant_time_reject: _Limit = 0.5
    opening_share_warn: _Limit = 0.1
    opening_share_reject: _Limit = math.inf
    closing_share_warn: _Limit = 0.1
    closing_share_reject: _Limit = math.inf
    end_velocity_share_warn: _Limit = 0.1
    end_velocity_share_reject: _Limit = math.inf
    end_displacement_share_warn: _Limit = 0.9
    end_displacement_share_reject: _Limit = math.inf
    signal_to_noise_warn: _Limit = 20.0
    signal_to_noise_reject: _Limit = 4.0
    usable_period_longest_warn: _Limit = 2.0
    usable_period_longest_reject: _Limit = 0.0
    significant_duration_warn: _Limit = 0.5
    significant_duration_reject: _Limit = 0.0
    arias_intensity_warn: _Limit = 1e-4
    arias_intensity_reject: _Limit = 0.0
    signal_to_noise_ratio: Annotated[float, Field(gt=1.0)] = 3.0

    def stated(self) -> dict[str, float | None]:
        """Return the limits as JSON has them: None for a limit that is switched off by infinity."""
        return {
            name: value if math.isfinite(value) else None
            for name, value in self.model_dump().items()
        }

    @model_validator(mode="after")
    def _warns_first(self) -> Self:
        """A value that is rejected must be one that would warn."""
        for name in type(self).model_fields:
            check, _, kind = name.rpartition("_")
            if kind != "warn":
                continue
            warn, reject = getattr(self, name), getattr(self, f"{check}_reject")
            at_least = check in _AT_LEAST
            if (reject > warn) if at_least else (reject < warn):
                bound = "at most" if at_least else "at least"
                raise PydanticCustomError(
                    RULE,
                    f"{check}_reject {reject:g}. Must be {bound} {check}_warn, {warn:g}",
                )
        return self


class _LimitsFile(Options):
    passport: PassportLimits = PassportLimits()


def read_limits(path: Path) -> PassportLimits:
    r"""Read the limits of the record passport.

    Parameters
    ----------
    path : Path
        A TOML file with a ``[passport]`` table; what it does not state keeps its default.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or a wrong value, or a limit of
        rejection that is passed before that of the warning.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "limits.toml")
    ...     _ = path.write_text("[passport]\nend_velocity_share_reject = 0.5\n")
    ...     read_limits(path).end_velocity_share_reject
    0.5
    """
    return parse(path, read_text(path), _LimitsFile).passport
