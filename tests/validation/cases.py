"""The structures and the motions on which the two programs are compared.

The motions are the six bundled horizontal records, cut to their strong part. Four copies of each
have all Fourier phases shifted by the same angle, and five copies have random phases within the
envelope of the record: 54 motions, each at six scales.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.ingest import read_file
from rockframe.parts import Dissipater, Tendon, tapered
from rockframe.record import Orientation
from rockframe.rocking import GroundAcceleration
from rockframe.study.structures import bundled_records
from rockframe.wavelets.pulse import Pulse

Float: TypeAlias = NDArray[np.float64]

#: Phase shifts of a record [degrees], and number of its copies with random phases.
SHIFTS: Final = (0.0, 45.0, 90.0, 135.0)
SIMULATED: Final = 5
#: Multiples of each motion; they make the bridge bent stand, lift and overturn.
SCALES: Final = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
#: The strong part holds the squared acceleration between these shares of the whole.
STRONG: Final = (0.01, 0.98)
#: Standard deviation of the Gaussian that smooths the squared record into its envelope [s].
ENVELOPE: Final = 1.0

_DRUM = tapered("circular", 7.5, 1.8, 1.4)
_BENT: Final = RockingFrame(name="bent", height=9.6, width=1.6, mass_ratio=4.0)
STRUCTURES: Final = {
    frame.name: frame
    for frame in (
        _BENT,
        RockingFrame(name="column", height=7.5, width=1.8),
        RockingFrame(
            name="tapered-frame",
            height=7.5,
            width=1.8,
            top_width=1.4,
            mass_ratio=0.3,
            inertia_ratio=_DRUM.inertia_ratio,
            centre_of_gravity=_DRUM.centre_of_gravity,
        ),
        replace(
            _BENT,
            name="bent-tendons",
            column_mass=6.0e4,
            tendon=Tendon(area=2.0e-3, modulus=195.0e9, prestress=3.0e5),
        ),
        replace(
            _BENT,
            name="bent-dissipaters",
            column_mass=6.0e4,
            dissipater=Dissipater(stiffness=5.0e7, yield_force=1.0e5, lever_arm=0.8),
        ),
    )
}
#: These two are shaken by every motion, the others by every fourth.
MAIN: Final = ("bent", "column")


@dataclass(frozen=True, eq=False)
class Motion:
    """A horizontal ground acceleration [m s-2] at equal steps [s]."""

    name: str
    acceleration: Float
    time_step: float

    def scaled(self, scale: float) -> Motion:
        """Return the motion times a factor."""
        return Motion(self.name, scale * self.acceleration, self.time_step)

    @property
    def ground(self) -> GroundAcceleration:
        """The motion as the package takes it: samples joined by straight lines."""
        return GroundAcceleration.from_samples(self.acceleration, self.time_step)


def motions() -> dict[str, Motion]:
    """Return the 54 motions by name."""
    found = (copy for record in _strong_parts() for copy in _copies(record))
    return {motion.name: motion for motion in found}


def ricker(acceleration_g: float, period: float) -> Motion:
    """Return a symmetric Ricker pulse, sampled every 5 ms."""
    pulse = Pulse(
        wavelet="symmetric_ricker", a_p=acceleration_g * 9.81, T_p=period, time=2.0 * period
    )
    time = 0.005 * np.arange(round(4.0 * period / 0.005) + 1)
    return Motion(f"ricker-{acceleration_g:g}-{period:g}", pulse.acceleration(time), 0.005)


def _strong_parts() -> Iterator[Motion]:
    for path in sorted(bundled_records().glob("*.V1")):
        for record in read_file(path):
            if record.orientation is Orientation.VERTICAL:
                continue
            samples = np.asarray(record.acceleration, dtype=np.float64)
            samples = samples - samples.mean()
            growth = np.cumsum(samples**2) / (samples**2).sum()
            first, last = np.searchsorted(growth, STRONG)
            name = record.record_id.removeprefix("Ridgecrest2019-")
            yield Motion(name, samples[first:last], record.time_step)


def _copies(record: Motion) -> Iterator[Motion]:
    lines = np.fft.rfft(record.acceleration)
    size = record.acceleration.size
    for shift in SHIFTS:
        turned = np.fft.irfft(lines * np.exp(1j * np.deg2rad(shift)), size)
        yield Motion(f"{record.name}/shifted-{shift:g}", turned, record.time_step)
    width = ENVELOPE / record.time_step
    envelope = np.sqrt(scipy.ndimage.gaussian_filter1d(record.acceleration**2, width))
    spectrum = np.abs(np.fft.rfft(record.acceleration / envelope))
    seed = int.from_bytes(hashlib.sha256(record.name.encode()).digest()[:8], "little")
    random = np.random.default_rng(seed)
    for number in range(1, SIMULATED + 1):
        phases = random.uniform(0.0, 2.0 * np.pi, spectrum.size)
        drawn = envelope * np.fft.irfft(spectrum * np.exp(1j * phases), size)
        yield Motion(f"{record.name}/simulated-{number}", drawn, record.time_step)
