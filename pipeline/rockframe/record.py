"""One component of a strong-motion record, with what is known of its origin."""

from __future__ import annotations

import math
import unicodedata
from dataclasses import dataclass
from enum import IntEnum
from hashlib import sha256
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError

#: Most characters of a record identifier.
LONGEST_ID: Final = 64


def is_record_id(name: str) -> bool:
    """Return whether a text is a record identifier: safe in file names, URLs and shells.

    Parameters
    ----------
    name : str
        1 to 64 letters and digits of any script, points, hyphens and underscores, of which the
        first is a letter or digit. Letters may have marks of their own, as vowel signs.

    Examples
    --------
    >>> is_record_id("Αθήνα_1"), is_record_id("../a"), is_record_id("-a")
    (True, False, False)
    """
    kinds = [unicodedata.category(character) for character in name]
    return (
        0 < len(name) <= LONGEST_ID
        and (kinds[0][0] == "L" or kinds[0] == "Nd")
        and all(
            kind[0] in "LM" or kind == "Nd" or character in "._-"
            for kind, character in zip(kinds, name, strict=True)
        )
    )


class Orientation(IntEnum):
    """Direction of a component; the values of the flag variable `orientation`.

    ``VERTICAL`` is positive upwards, ``DOWNWARD`` is a vertical that is positive downwards.
    """

    HORIZONTAL = 0
    VERTICAL = 1
    UNSTATED = 2
    DOWNWARD = 3

    @property
    def upright(self) -> bool:
        """Whether the component is a vertical one, upwards or downwards."""
        return self in (Orientation.VERTICAL, Orientation.DOWNWARD)


class SiteType(IntEnum):
    """Where the sensor stood, as far as the header says; the values of the flag `site_type`."""

    UNKNOWN = 0
    FREE_FIELD = 1
    STRUCTURE = 2
    BOREHOLE = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """One component of ground acceleration, evenly sampled. Unknown is NaN or an empty string.

    Parameters
    ----------
    record_id : str
        Identifier, as `is_record_id` has it.
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2]; kept as a read-only copy.
    time_step : float
        Interval between samples [s].
    uncorrected : bool
        Whether the archive hands it out without baseline correction.
    component : str
        The archive's name of the component.
    orientation : Orientation
        Horizontal, vertical, or unstated.
    azimuth : float
        Direction of positive acceleration, clockwise from north [degree].
    site_type : SiteType
        Free field, in a structure, in a borehole, or unknown.
    event, station, network, start_time : str
        Names as given, and the time of the first sample (ISO 8601, UTC).
    magnitude : float
        Magnitude of the event [1].
    epicentral_distance : float
        Distance to the epicentre [km].
    vs30 : float
        Mean velocity of shear waves in the uppermost 30 m of the ground [m s-1].
    facts_source : str
        Where event, magnitude and distance are from.
    source_file, source_format, source_sha256 : str
        Name of the file, its format, and its SHA-256.
    instrument_file, instrument_sha256 : str
        Name of the StationXML file that turned counts into acceleration, and its SHA-256.
    peak_ratio : float
        Peak of the samples of the file over the peak that its header states [1]; negative if the
        header's has a sign, and it is another one.
    filter_low, filter_high : float
        Corners of the filters that were applied, by the archive as it states them and here [Hz].
    processing : tuple of str
        What was done to the samples after reading, in order.

    Raises
    ------
    ParameterError
        If the identifier, the samples or the time step are not as said above.

    Examples
    --------
    >>> Record(record_id="shake", acceleration=np.array([0.0, 1.0, 0.0]), time_step=0.01).duration
    0.02
    """

    record_id: str
    acceleration: NDArray[np.float64]
    time_step: float
    uncorrected: bool = False
    component: str = ""
    orientation: Orientation = Orientation.UNSTATED
    azimuth: float = math.nan
    site_type: SiteType = SiteType.UNKNOWN
    event: str = ""
    station: str = ""
    network: str = ""
    start_time: str = ""
    magnitude: float = math.nan
    epicentral_distance: float = math.nan
    vs30: float = math.nan
    facts_source: str = ""
    source_file: str = ""
    source_format: str = ""
    source_sha256: str = ""
    instrument_file: str = ""
    instrument_sha256: str = ""
    peak_ratio: float = math.nan
    filter_low: float = math.nan
    filter_high: float = math.nan
    processing: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not is_record_id(self.record_id):
            raise ParameterError(
                f"Invalid record identifier {self.record_id!r}. Must be 1 to {LONGEST_ID} letters, "
                "digits, points, hyphens or underscores, and begin with a letter or digit."
            )
        samples = np.array(self.acceleration, dtype=np.float64)
        if samples.ndim != 1 or samples.size < 2:
            raise ParameterError(
                f"Invalid acceleration of shape {samples.shape} in record {self.record_id!r}. "
                "Must be one row of two samples or more."
            )
        if not np.isfinite(samples).all():
            where = int(np.flatnonzero(~np.isfinite(samples))[0])
            raise ParameterError(
                f"Invalid acceleration {samples[where]} at sample {where} of record "
                f"{self.record_id!r}. Must be finite."
            )
        if not (math.isfinite(self.time_step) and self.time_step > 0.0):
            raise ParameterError(
                f"Invalid time step {self.time_step!r} s of record {self.record_id!r}. "
                "Must be positive and finite."
            )
        samples.flags.writeable = False
        object.__setattr__(self, "acceleration", samples)

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the samples since the first one [s], shape (samples,)."""
        return self.time_step * np.arange(self.acceleration.size, dtype=np.float64)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.time_step * (self.acceleration.size - 1)

    @property
    def samples_sha256(self) -> str:
        """SHA-256 of time step and samples: what was computed from them can tell them again."""
        step = np.array([self.time_step], dtype="<f8")
        return sha256(step.tobytes() + self.acceleration.astype("<f8").tobytes()).hexdigest()
