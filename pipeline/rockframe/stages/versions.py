"""Versions of the records of a file, made from the samples as they were read."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.results.records import RecordsFile
from rockframe.rocking import GroundAcceleration, Versions, as_ground, corner_factors
from rockframe.signals.processing import AsRead


@dataclass(frozen=True, eq=False)
class Uncertain:
    """A record with what its versions are made of.

    Parameters
    ----------
    record : Record
        The record as the file has it.
    as_read : AsRead
        Its samples before this package corrected it.
    """

    record: Record
    as_read: AsRead

    def versions(self, ensemble: Ensemble, motion: Record | GroundAcceleration) -> Versions:
        """Return the versions of the record that the members need.

        Parameters
        ----------
        ensemble : Ensemble
            The ensemble.
        motion : Record or GroundAcceleration
            The record, or its motion with a vertical component, which is the same in all versions.
        """
        factors = corner_factors(ensemble).tolist()
        values = sorted(set(factors))
        return Versions(
            tuple(self._ground(factor, motion) for factor in values),
            np.array([values.index(factor) for factor in factors]),
            ("corner",),
        )

    def _ground(self, factor: float, motion: Record | GroundAcceleration) -> GroundAcceleration:
        if factor == 1.0:
            return as_ground(motion)
        samples = self.as_read.corrected(self.record.time_step, factor)
        ground = as_ground(replace(self.record, acceleration=samples))
        if isinstance(motion, Record):
            return ground
        return replace(ground, vertical=motion.vertical)


def uncertain(file: RecordsFile, record: Record, ensemble: Ensemble) -> Uncertain | None:
    """Return a record with what its versions are made of; None if there is only one version.

    Parameters
    ----------
    file : RecordsFile
        The file of the record.
    record : Record
        A record of the file.
    ensemble : Ensemble
        The ensemble.
    """
    if not ensemble.members or ensemble.corner == 1.0:
        return None
    as_read = file.as_read(record.record_id)
    return None if as_read is None else Uncertain(record, as_read)
