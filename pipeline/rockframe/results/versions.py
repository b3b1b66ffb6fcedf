"""Versions of the records of a file: corrected with other corners, and turned."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from rockframe.components import HorizontalPair, pair_with, placed, steps_between
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.options.respond import Ensemble
from rockframe.record import Orientation, Record
from rockframe.results.records import RecordsFile
from rockframe.rocking import (
    GroundAcceleration,
    Versions,
    as_ground,
    corner_factors,
    turned_degrees,
)
from rockframe.signals.processing import AsRead

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Uncertain:
    """A record, and the data from which its other versions are computed.

    Parameters
    ----------
    record : Record
        The record as the file has it.
    as_read : AsRead, optional
        Its samples before this package corrected it; without them, its corner is not varied.
    pair : HorizontalPair, optional
        The record, and the other horizontal of its motion; without it, the record is not turned.
    other_as_read : AsRead, optional
        Samples of the other horizontal before this package corrected it.
    later : int
        Time steps from the first sample of the record to the first of ``other_as_read``.
    """

    record: Record
    as_read: AsRead | None
    pair: HorizontalPair | None = None
    other_as_read: AsRead | None = None
    later: int = 0

    def versions(self, ensemble: Ensemble, motion: Record | GroundAcceleration) -> Versions:
        """Return the versions of the record that the members need.

        Parameters
        ----------
        ensemble : Ensemble
            The ensemble.
        motion : Record or GroundAcceleration
            The record, or its motion with a vertical component, which is the same in all versions.
        """
        varied = {"corner": self.as_read, "orientation_degree": self.pair}
        unvaried = np.ones(ensemble.members), np.zeros(ensemble.members)
        factors = unvaried[0] if self.as_read is None else corner_factors(ensemble)
        degrees = unvaried[1] if self.pair is None else turned_degrees(ensemble)
        chosen = list(zip(factors.tolist(), degrees.tolist(), strict=True))
        values = sorted(set(chosen))
        return Versions(
            tuple(self._ground(*value, motion) for value in values),
            np.array([values.index(version) for version in chosen]),
            tuple(name for name, made_of in varied.items() if made_of is not None),
        )

    def _ground(
        self, factor: float, degrees: float, motion: Record | GroundAcceleration
    ) -> GroundAcceleration:
        if factor == 1.0 and degrees == 0.0:
            return as_ground(motion)
        samples = _corrected(self.record, self.as_read, factor)
        if self.pair is not None and degrees != 0.0:
            other = self.pair.second.acceleration
            if factor != 1.0 and self.other_as_read is not None:
                corrected = self.other_as_read.corrected(self.record.time_step, factor)
                other = placed(corrected, -self.later, samples.size)
            series = samples, other
            samples = self.pair.toward([self.record.azimuth + degrees], series)[0]
        ground = as_ground(replace(self.record, acceleration=samples))
        if isinstance(motion, Record):
            return ground
        return replace(ground, vertical=motion.vertical)


def _corrected(record: Record, as_read: AsRead | None, factor: float) -> Float:
    if factor == 1.0 or as_read is None:
        return record.acceleration
    return as_read.corrected(record.time_step, factor)


@dataclass(frozen=True)
class VersionSources:
    """The file that versions of records are made from.

    Parameters
    ----------
    file : RecordsFile
        The file.
    ensemble : Ensemble
        The ensemble.
    others : mapping of str to str
        The other horizontal of the motion of each record that is turned.
    """

    file: RecordsFile
    ensemble: Ensemble
    others: Mapping[str, str]

    @classmethod
    def of(cls, file: RecordsFile, ensemble: Ensemble, names: Sequence[str]) -> Self:
        """Return the sources of the records with these names.

        If records should be turned that have no other horizontal, one warning names them.
        """
        if not (ensemble.members and ensemble.orientation_degree):
            return cls(file, ensemble, {})
        others = _other_horizontals(file)
        alone = [name for name in names if name not in others]
        if alone:
            some = ", ".join(alone[:5]) + (", ..." if len(alone) > 5 else "")
            warnings.warn(
                f"orientation_degree {ensemble.orientation_degree:g} of the ensemble does not "
                f"concern {len(alone)} of {len(names)} records, whose motion has no other "
                f"horizontal at a right angle: {some}.",
                RockframeWarning,
                stacklevel=2,
            )
        return cls(file, ensemble, others)

    def uncertain(self, record: Record) -> Uncertain | None:
        """Return a record and the data of its versions; None if it has only one version."""
        ensemble, file = self.ensemble, self.file
        name = self.others.get(record.record_id)
        other = None if name is None else file.read(name)
        pair = None if other is None else _paired(record, other)
        if not ensemble.members or (ensemble.corner == 1.0 and pair is None):
            return None
        as_read = None if ensemble.corner == 1.0 else file.as_read(record.record_id)
        if pair is None or other is None:
            return None if as_read is None else Uncertain(record, as_read)
        beside = None if as_read is None else file.as_read(other.record_id)
        return Uncertain(record, as_read, pair, beside, steps_between(record, other))


def _paired(record: Record, other: Record) -> HorizontalPair | None:
    """Return a record with the other horizontal of its motion; warn if they cannot be a pair."""
    try:
        return pair_with(record, other)
    except ParameterError as error:
        message = f"orientation_degree of the ensemble does not concern {record.record_id!r}"
        warnings.warn(f"{message}: {error}", RockframeWarning, stacklevel=3)
        return None


def _other_horizontals(file: RecordsFile) -> dict[str, str]:
    """Return the record at a right angle to each horizontal record, if its motion has one."""
    azimuth = dict(zip(file.names, file.azimuths, strict=True))
    across = dict(zip(file.names, file.orientations, strict=True))
    others = {}
    for motion in file.motions:
        level = [name for name in motion if across[name] is Orientation.HORIZONTAL]
        for name in level:
            turned = [math.fmod(abs(azimuth[name] - azimuth[other]), 180.0) for other in level]
            square = [k for k, angle in enumerate(turned) if abs(angle - 90.0) < 0.01]
            if len(square) == 1:
                others[name] = level[square[0]]
    return others
