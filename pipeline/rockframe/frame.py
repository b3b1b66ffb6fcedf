"""The rocking frame: N free-standing columns of equal size, capped with a rigid beam.

Equation numbers are those of Makris and Vassiliou (2013), COMPDYN 2013. The frame rocks like one
free-standing column of the same slenderness and a larger size, but loses more at impacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.units import GRAVITY

#: I_o / (m_c R^2) of a rectangular column about its base corner.
RECTANGULAR: Final = 4.0 / 3.0

#: Column sections accepted by `inertia_ratio_of`.
SECTIONS: Final = ("rectangular", "circular")

#: Smallest and largest dimension of a free-standing structure [m].
_SMALLEST: Final = 0.001
_LARGEST: Final = 1000.0
#: I_o / (m_c R^2) is 1 for a point mass; no column exceeds the upper bound.
_LEAST_INERTIA: Final = 1.0
_LARGEST_INERTIA: Final = 100.0
#: Largest mass ratio: the frame is at the limit of eq (28) to round-off.
_HEAVIEST: Final = 1e15


def inertia_ratio_of(section: str, height: float, width: float) -> float:
    """Return I_o / (m_c R^2) of a prismatic column about its base edge [1].

    Parameters
    ----------
    section : str
        ``rectangular``, or ``circular`` for a solid cylinder, which rocks on a point of its rim.
    height, width : float
        Height and width (diameter) of the column [m].

    Raises
    ------
    ParameterError
        If the section is neither.

    Notes
    -----
    4/3 for the rectangle; 4/3 - sin(alpha)^2 / 12 for the cylinder, from
    I_o / m_c = 5 b^2 / 4 + 4 h^2 / 3 (re-derived).

    Examples
    --------
    >>> round(inertia_ratio_of("circular", 9.6, 1.6), 6)
    1.331081
    """
    if section not in SECTIONS:
        raise ParameterError(f"Invalid section {section!r}. Must be one of: {', '.join(SECTIONS)}.")
    if section == "rectangular":
        return RECTANGULAR
    return RECTANGULAR - width**2 / (width**2 + height**2) / 12.0


@dataclass(frozen=True, kw_only=True)
class RockingFrame:
    """A rocking frame, or with ``mass_ratio=0`` a single free-standing column.

    Parameters
    ----------
    height, width : float
        Height 2h and width 2b of a column [m].
    mass_ratio : float
        Mass of the cap beam over the mass of all columns, gamma = m_b / (N m_c) [1].
    name : str
        Name in tables.
    inertia_ratio : float
        I_o / (m_c R^2) of a column about its base corner [1]: 4/3 for a rectangular one; use
        `inertia_ratio_of` for other sections.
    restitution_factor : float
        Factor on the velocity ratio of eq (43) [1]; 1 is the smallest possible loss of rigid
        bodies.

    Raises
    ------
    ParameterError
        If a dimension is not between 1 mm and 1 km, the inertia ratio not above 1 and at most 100,
        the mass ratio not between 0 and 1e15, the restitution factor not above 0 and at most 1, or
        the column so stocky that the restitution of eq (43) is not positive: such a frame does not
        rock.

    Notes
    -----
    Makris and Vassiliou (2013); for `inertia_ratio` other than 4/3 the equations are re-derived.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(bent.frequency_parameter, 2), round(bent.effective_frequency_parameter, 3)
    (1.23, 1.023)
    >>> round(bent.restitution, 3)
    0.947
    """

    height: float
    width: float
    mass_ratio: float = 0.0
    name: str = "frame"
    inertia_ratio: float = RECTANGULAR
    restitution_factor: float = 1.0

    def __post_init__(self) -> None:
        for label in ("height", "width"):
            value = getattr(self, label)
            if not _SMALLEST <= value <= _LARGEST:
                raise ParameterError(
                    f"Invalid {label} {value!r} of frame {self.name!r}. "
                    f"Must be between {_SMALLEST:g} and {_LARGEST:g} m."
                )
        if not _LEAST_INERTIA < self.inertia_ratio <= _LARGEST_INERTIA:
            raise ParameterError(
                f"Invalid inertia_ratio {self.inertia_ratio!r} of frame {self.name!r}. Must be "
                f"above {_LEAST_INERTIA:g} and at most {_LARGEST_INERTIA:g}: about the corner it "
                "is 1 for a mass in one point, and 4/3 for a rectangle."
            )
        if not 0.0 <= self.mass_ratio <= _HEAVIEST:
            raise ParameterError(
                f"Invalid mass_ratio {self.mass_ratio!r} of frame {self.name!r}. "
                f"Must be between 0 and {_HEAVIEST:g}."
            )
        if not 0.0 < self.restitution_factor <= 1.0:
            raise ParameterError(
                f"Invalid restitution_factor {self.restitution_factor!r} of frame {self.name!r}. "
                "Must be above 0 and at most 1."
            )
        if self.restitution <= 0.0:
            raise ParameterError(
                f"Invalid slenderness {math.degrees(self.slenderness):.2f} degrees of frame "
                f"{self.name!r} (height {self.height:g} m, width {self.width:g} m). Must be below "
                f"{math.degrees(self.slenderness_limit):.2f} degrees for mass_ratio "
                f"{self.mass_ratio:g}: the restitution (eq 43) would be {self.restitution:.3f}, "
                "and a frame that loses all speed at an impact does not rock."
            )

    @property
    def size(self) -> float:
        """Semi-diagonal of a column, R [m]."""
        return 0.5 * math.hypot(self.height, self.width)

    @property
    def slenderness(self) -> float:
        """Slenderness, alpha = atan(b / h) [rad]."""
        return math.atan2(self.width, self.height)

    @property
    def slenderness_limit(self) -> float:
        """Slenderness at which the restitution of eq (43) vanishes [rad], at most 54.74 degrees."""
        gamma = self.mass_ratio
        return math.asin(
            min(1.0, math.sqrt((self.inertia_ratio + 4.0 * gamma) / (2.0 + 8.0 * gamma)))
        )

    @property
    def frequency_parameter(self) -> float:
        """Frequency parameter of one column, p = sqrt(3 g / 4 R) if rectangular [rad s-1]."""
        return math.sqrt(GRAVITY / (self.inertia_ratio * self.size))

    @property
    def effective_size(self) -> float:
        """Semi-diagonal of the column that rocks like the frame, R-hat of eq (29) [m]."""
        gamma = self.mass_ratio
        return self.size * (1.0 + 4.0 * gamma / self.inertia_ratio) / (1.0 + 2.0 * gamma)

    @property
    def effective_frequency_parameter(self) -> float:
        """Frequency parameter of the frame, p-hat of eq (27) [rad s-1]."""
        return math.sqrt(GRAVITY / (self.inertia_ratio * self.effective_size))

    @property
    def restitution(self) -> float:
        """Ratio of the angular velocity after an impact to that before it [1].

        sqrt(r) of eq (43), times the restitution factor.
        """
        gamma = self.mass_ratio
        loss = 2.0 * math.sin(self.slenderness) ** 2 * (1.0 + 4.0 * gamma)
        return self.restitution_factor * (1.0 - loss / (self.inertia_ratio + 4.0 * gamma))

    @property
    def uplift_acceleration(self) -> float:
        """Ground acceleration at which the frame uplifts, g tan(alpha) of eq (36) [m s-2]."""
        return GRAVITY * self.width / self.height

    def horizontal_displacement(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Return the horizontal displacement u of the beam relative to the ground [m], eq (7).

        Parameters
        ----------
        theta : array_like
            Rotation of the columns [rad], any shape.

        Examples
        --------
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
        >>> float(bent.horizontal_displacement(bent.slenderness).round(9))
        1.6
        """
        theta = np.asarray(theta, dtype=np.float64)
        # 2R [sin(alpha) - sin(alpha - |theta|)] without cancellation at small theta
        half = 0.5 * np.abs(theta)
        u: NDArray[np.float64] = np.sign(theta) * np.sin(half) * np.cos(self.slenderness - half)
        return 4.0 * self.size * u

    def vertical_displacement(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Return the vertical lift v of the beam [m], eq (10).

        Parameters
        ----------
        theta : array_like
            Rotation of the columns [rad], any shape.

        Examples
        --------
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
        >>> float(bent.vertical_displacement(0.0))
        0.0
        """
        half = 0.5 * np.abs(np.asarray(theta, dtype=np.float64))
        v: NDArray[np.float64] = np.sin(half) * np.sin(self.slenderness - half)
        return 4.0 * self.size * v

    def horizontal_velocity(self, theta: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
        """Return the rate of u [m s-1], eq (8), at `theta` [rad] and its rate `omega` [rad s-1]."""
        phi = self.slenderness - np.abs(np.asarray(theta, dtype=np.float64))
        rate: NDArray[np.float64] = 2.0 * self.size * np.cos(phi) * np.asarray(omega)
        return rate

    def vertical_velocity(self, theta: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
        """Return the rate of v [m s-1], eq (11), at `theta` [rad] and its rate `omega` [rad s-1].

        At theta = 0, where the rate jumps, it is the value just after the impact.
        """
        theta = np.asarray(theta, dtype=np.float64)
        omega = np.asarray(omega, dtype=np.float64)
        rate: NDArray[np.float64] = (
            2.0 * self.size * _side(theta, omega) * np.sin(self.slenderness - np.abs(theta)) * omega
        )
        return rate

    def horizontal_acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> NDArray[np.float64]:
        """Return the second rate of u [m s-2], eq (9); `omega_rate` is that of theta [rad s-2]."""
        theta = np.asarray(theta, dtype=np.float64)
        omega = np.asarray(omega, dtype=np.float64)
        phi = self.slenderness - np.abs(theta)
        rate: NDArray[np.float64] = (
            2.0
            * self.size
            * (
                np.cos(phi) * np.asarray(omega_rate, dtype=np.float64)
                + _side(theta, omega) * np.sin(phi) * omega**2
            )
        )
        return rate

    def vertical_acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> NDArray[np.float64]:
        """Return the second rate of v [m s-2], eq (12); `omega_rate` is that of theta [rad s-2]."""
        theta = np.asarray(theta, dtype=np.float64)
        omega = np.asarray(omega, dtype=np.float64)
        phi = self.slenderness - np.abs(theta)
        rate: NDArray[np.float64] = (
            2.0
            * self.size
            * (
                _side(theta, omega) * np.sin(phi) * np.asarray(omega_rate, dtype=np.float64)
                - np.cos(phi) * omega**2
            )
        )
        return rate


def _side(theta: NDArray[np.float64], omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sgn(theta), or at theta = 0 the side to which the frame starts to rotate."""
    return np.where(theta == 0.0, np.sign(omega), np.sign(theta))
