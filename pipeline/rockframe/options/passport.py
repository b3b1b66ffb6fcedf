"""Limits of the checks in a record's passport."""

from __future__ import annotations

import math
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from rockframe.options.model import Options, rule
from rockframe.units import GRAVITY

#: Zero or positive. Infinity disables an upper limit, and 0 a lower one.
_Limit = Annotated[float, Field(ge=0.0)]


#: Checks with a lower limit; all others have an upper one.
_AT_LEAST: Final = frozenset(
    ["signal_to_noise", "usable_period_longest", "significant_duration", "arias_intensity"]
)


class PassportLimits(Options):
    """Limits of the record passport: the ``[passport]`` table.

    Each check has a limit that warns and one that rejects. By default only faults that no sound
    record of ground motion has lead to rejection: flat tops, filled gaps, a peak of 10 g or one
    that does not rise above the noise, a time step above 1 s. Other faults may be acceptable, for
    example in old records and mathematical pulses, so they only warn. Most complete and well
    processed records pass the warning limits.

    Parameters
    ----------
    peak_acceleration_warn, peak_acceleration_reject : float
        Largest peak after processing [m s-2]. Few records exceed 2 g, and no record in the archives
        exceeds 5 g; 10 g means that values in gal were read as g, or that the file contains no
        ground motion.
    time_step_warn, time_step_reject : float
        Largest interval between samples [s]. Accelerographs take ten samples per second or more;
        a step of seconds is a misread number of milliseconds, or of samples per second.
    not_free_field_warn, not_free_field_reject : float
        Largest value of the flag [1]: 1 if the header says that the sensor stood in a structure or
        a borehole, 0 on free ground. A motion amplified by a structure, or recorded at depth, is
        not the base motion of another structure. Never rejects by default; the limit 0 does.
    azimuth_warn, azimuth_reject : float
        Largest azimuth stated by the header or by the name of the component [degree]. An azimuth
        above 360 in a header is taken modulo 360; a name above 360 is not taken as an azimuth.
    stated_peak_warn, stated_peak_reject : float
        Largest difference between the peak of the samples and the peak that the header states,
        relative to the stated peak [1]; signs are compared if the header states one. Readers
        already reject a difference beyond the last printed digit. One percent more means a coarse
        header, and half means that the header belongs to another record.
    clipped_samples_warn, clipped_samples_reject : float
        Longest run of equal samples at an extreme [1]. Three or four result from rounding (few
        digits, many samples per period); a run of 25 is a flat top.
    constant_time_warn, constant_time_reject : float
        Longest time without any change within the strong motion [s]. Ground motion above the
        resolution changes with each sample; a gap of half a second can hide a whole cycle that
        matters for rocking.
    opening_share_warn, opening_share_reject : float
        Largest ratio of the peak in the first 0.1 s to the peak [1]. Above 0.1 the trigger was
        late. Never rejects by default, because most analogue records start late, and mathematical
        pulses start at once.
    closing_share_warn, closing_share_reject : float
        Largest ratio of the peak in the last 0.1 s to the peak [1]. Above 0.1 the record was cut
        or lost its end. Never rejects by default, because a record cut late is still useful.
    end_velocity_share_warn, end_velocity_share_reject : float
        Largest ratio of the final velocity to its peak [1]. The ground ends at rest; 0.1 indicates
        a drifting baseline. Never rejects by default, because a half-sine pulse ends moving.
    end_displacement_share_warn, end_displacement_share_reject : float
        Largest ratio of the final displacement to its peak [1]. Records near a fault may keep a
        true offset, so the limit is wide: above 0.9 the displacement consists only of drift, or
        only of fling. Never rejects by default.
    signal_to_noise_warn, signal_to_noise_reject : float
        Smallest ratio of the peak to the root mean square of the noise before the event [1]. Noise
        alone peaks at about 4 times its root mean square; at 20, a fifth of the peak is noise.
    usable_period_longest_warn, usable_period_longest_reject : float
        Smallest longest usable period [s]. Pulses that overturn structures of some metres have
        periods from 0.5 s to 2 s and more.
    significant_duration_warn, significant_duration_reject : float
        Smallest D5-95 [s]. A shorter record is a spike or a fragment.
    arias_intensity_warn, arias_intensity_reject : float
        Smallest Arias intensity [m s-1]. One second at 0.003 g gives 1e-4 m/s; weaker motion is
        recorded, but not felt.
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
    azimuth_warn: _Limit = 360.0
    azimuth_reject: _Limit = math.inf
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
        """Return the limits as JSON values, with None for a limit disabled by infinity."""
        return {
            name: value if math.isfinite(value) else None
            for name, value in self.model_dump().items()
        }

    @model_validator(mode="after")
    def _warns_first(self) -> Self:
        """Require that every value that is rejected would also warn."""
        for name in type(self).model_fields:
            check, _, kind = name.rpartition("_")
            if kind != "warn":
                continue
            warn, reject = getattr(self, name), getattr(self, f"{check}_reject")
            at_least = check in _AT_LEAST
            if (reject > warn) if at_least else (reject < warn):
                bound = "at most" if at_least else "at least"
                raise rule(
                    f"{check}_reject {reject:g}. Must be {bound} {check}_warn, {warn:g}",
                )
        return self
