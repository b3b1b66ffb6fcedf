"""records.nc: samples and metadata of the records."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.record import Orientation, SiteType
from rockframe.results.schema.declare import FileKind, Variable, optional
from rockframe.signals.corner import CornerSource
from rockframe.signals.passport import CheckVerdict


class _Trigger(IntEnum):
    IN_TIME = 0
    LATE = 1


# fmt: off
RECORDS_NC: Final = FileKind(
    "records", "ingest", "Strong-motion records",
    (
        Variable("acceleration", "obs", float, "m s-2", "ground acceleration, all records one after the other"),
        Variable("record_id", "record", str, "1", "record identifier", "record", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("time_step", "record", float, "s", "interval between samples", "record", valid="positive"),
        Variable("azimuth", "record", float, "degree", "direction of positive acceleration, clockwise from north", "record"),
        Variable("magnitude", "record", float, "1", "magnitude of the earthquake", "record"),
        Variable("epicentral_distance", "record", float, "km", "distance to the epicentre", "record"),
        Variable("distance_rrup", "record", float, "km", "shortest distance to the rupture", "record"),
        Variable("distance_rjb", "record", float, "km", "Joyner-Boore distance: to the surface projection of the rupture", "record"),
        Variable("distance_hypocentral", "record", float, "km", "distance to the hypocentre", "record"),
        Variable("vs30", "record", float, "m s-1", "mean velocity of shear waves in the uppermost 30 m", "record"),
        Variable("lowest_usable_frequency", "record", float, "Hz", "lowest usable frequency, as the archive states", "record"),
        Variable("archive_pulse_period", "record", float, "s", "period of the velocity pulse, as the archive states", "record"),
        Variable("peak_ratio", "record", float, "1", "peak in the file over the peak that its header states, before processing", "record"),
        Variable("filter_low", "record", float, "Hz", "highest lower corner of the stated filters", "record"),
        Variable("filter_high", "record", float, "Hz", "lowest upper corner of the stated filters", "record"),
        Variable("pga", "record", float, "m s-2", "peak ground acceleration", valid="finite"),
        Variable("pgv", "record", float, "m s-1", "peak ground velocity, with the ground at rest before the record", valid="finite"),
        *optional("passport",
            Variable("arias_intensity", "record", float, "m s-1", "Arias intensity", "measures"),
            Variable("significant_duration", "record", float, "s", "significant duration, 5 to 95 % of the Arias intensity", "measures"),
            Variable("significant_duration_75", "record", float, "s", "significant duration, 5 to 75 % of the Arias intensity", "measures"),
            Variable("strong_start", "record", float, "s", "time of 5 % of the Arias intensity, since the first sample", "measures"),
            Variable("usable_period_shortest", "record", float, "s", "shortest usable period; 0 if none is usable", "measures"),
            Variable("usable_period_longest", "record", float, "s", "longest usable period; 0 if none is usable", "measures"),
            Variable("end_velocity", "record", float, "m s-1", "velocity at the end of the record", "measures"),
            Variable("end_displacement", "record", float, "m", "displacement at the end of the record", "measures"),
            Variable("noise_level", "record", float, "m s-2", "root mean square of the acceleration before the event, as recorded", "measures"),
        ),
        *optional("cav",
            Variable("cav", "record", float, "m s-1", "cumulative absolute velocity, the integral of |acceleration|", "measures.cumulative_absolute_velocity"),
        ),
        *optional("spectra",
            Variable("housner_intensity", "record", float, "m", "Housner intensity: integral of the pseudo-spectral velocity, 5 % damped, over periods from 0.1 to 2.5 s"),
            Variable("spectral_acceleration", "record spectral_period", float, "m s-2", "pseudo-spectral acceleration, 5 % damped"),
            Variable("spectral_acceleration_rotd50", "record spectral_period", float, "m s-2", "RotD50 of the pseudo-spectral acceleration of both horizontals"),
            Variable("spectral_acceleration_rotd100", "record spectral_period", float, "m s-2", "RotD100 of the pseudo-spectral acceleration of both horizontals"),
            Variable("spectral_period", "spectral_period", float, "s", "period of the oscillator", key=True),
        ),
        Variable("event", "record", str, "1", "name of the earthquake", "record"),
        Variable("station", "record", str, "1", "code or name of the station", "record"),
        Variable("network", "record", str, "1", "code of the network", "record"),
        Variable("mechanism", "record", str, "1", "mechanism of the earthquake", "record"),
        Variable("component", "record", str, "1", "name of the component in the archive", "record"),
        Variable("start_time", "record", str, "1", "time of the first sample, UTC", "record"),
        Variable("facts_source", "record", str, "1", "source of event, magnitude and distance, from the catalogue", "record"),
        Variable("source_file", "record", str, "1", "name of the file that held the record", "record"),
        Variable("source_format", "record", str, "1", "format of that file", "record"),
        Variable("source_sha256", "record", str, "1", "SHA-256 of that file", "record"),
        Variable("instrument_file", "record", str, "1", "name of the StationXML file that turned counts into acceleration", "record"),
        Variable("instrument_sha256", "record", str, "1", "SHA-256 of that StationXML file", "record"),
        Variable("orientation", "record", Orientation, "1", "direction of the component", "record"),
        Variable("site_type", "record", SiteType, "1", "site of the sensor, if the header states it", "record"),
        *optional("passport",
            Variable("late_trigger", "record", _Trigger, "1", "trigger of the recording", "passport"),
            Variable("passport", "record", CheckVerdict, "1", "verdict of the record passport", "passport.verdict"),
        ),
        *optional("corner",
            Variable("corner_frequency", "record", float, "Hz", "lower corner of the band-pass of this package", "passport.corner.frequency"),
            Variable("corner_source", "record", CornerSource, "1", "source of the lower corner of the band-pass of this package", "passport.corner.source"),
        ),
        *optional("as read",
            Variable("acceleration_as_read", "obs", float, "m s-2", "ground acceleration before the correction of this package", comment="NaN for records that this package did not correct"),
            Variable("corner_frequency_high", "record", float, "Hz", "upper corner of the band-pass of this package"),
        ),
        Variable("processing", "record", str, "1", "processing after reading"),
        *optional("sequences",
            Variable("parts", "record", str, "1", "motions of a sequence: record, start and end in seconds, separated by semicolons"),
        ),
        *optional("trusted",
            Variable("trusted", "record", str, "1", "contradictions in the file that the user settled: the trusted word, and both statements"),
        ),
        *optional("both horizontals",
            Variable("pga_rotd50", "record", float, "m s-2", "RotD50 of the peak ground acceleration of both horizontals"),
            Variable("pga_rotd100", "record", float, "m s-2", "RotD100 of the peak ground acceleration of both horizontals"),
            Variable("pgv_rotd50", "record", float, "m s-1", "RotD50 of the peak ground velocity of both horizontals"),
            Variable("pgv_rotd100", "record", float, "m s-1", "RotD100 of the peak ground velocity of both horizontals"),
            Variable("azimuth_rotd100", "record", float, "degree", "azimuth of the largest acceleration, clockwise from north"),
        ),
        *optional("unpaired",
            Variable("unpaired", "record", str, "1", "reason why the record has no RotD; empty for pairs and verticals"),
        ),
    ),
)
# fmt: on
