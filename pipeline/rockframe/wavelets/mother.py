"""Mother wavelets and their weighted sums."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class MotherWavelet:
    """A pulse of unit period, centred at tau = 0.

    Parameters
    ----------
    name : str
        Name in datasets and on the command line.
    acceleration, velocity, displacement : callable
        Functions of tau = time / T_p [1], in units of a_p, a_p T_p and a_p T_p^2.
    spectrum : callable
        Fourier integral of the acceleration with exp(-2 pi i nu tau), a function of
        nu = frequency times T_p [1].
    energy : float
        Integral of the squared acceleration over all tau [1].
    reach : float
        |tau| beyond which the acceleration is below 1e-16.
    finite : bool
        True if the pulse ends at its reach with a kink; False if it decays smoothly.
    """

    name: str
    acceleration: Callable[[Float], Float]
    velocity: Callable[[Float], Float]
    displacement: Callable[[Float], Float]
    spectrum: Callable[[Float], Complex]
    energy: float
    reach: float
    finite: bool = False

    @property
    def extent(self) -> int | float:
        """Half-length of the pulse: its reach, in whole periods if the pulse decays smoothly."""
        return self.reach if self.finite else math.ceil(self.reach)

    @property
    def core(self) -> float:
        """The |tau| beyond which less than 1e-6 of the energy lies."""
        return self.reach if self.finite else 0.5 * self.reach


def combined(parts: Sequence[MotherWavelet], weights: Sequence[float]) -> MotherWavelet:
    """Return the weighted sum of an even and an odd wavelet, or one wavelet times its weight.

    Parameters
    ----------
    parts : sequence of MotherWavelet
        One wavelet, or an even and an odd one. The integral of the product of these is zero, so
        their energies add up.
    weights : sequence of float
        Factor of each wavelet.
    """

    def total(quantity: str) -> Callable[[Float], Any]:
        functions = [getattr(part, quantity) for part in parts]
        return lambda x: sum(w * f(x) for w, f in zip(weights, functions, strict=True))

    return MotherWavelet(
        name=parts[0].name,
        acceleration=total("acceleration"),
        velocity=total("velocity"),
        displacement=total("displacement"),
        spectrum=total("spectrum"),
        energy=sum(w**2 * part.energy for w, part in zip(weights, parts, strict=True)),
        reach=max(part.reach for part in parts),
        finite=parts[0].finite,
    )
