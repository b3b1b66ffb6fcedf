"""Wavelets and the acceleration pulses that they describe, in closed form."""

from rockframe.wavelets.family import RICKERS as RICKERS
from rockframe.wavelets.family import WAVELETS as WAVELETS
from rockframe.wavelets.family import Family as Family
from rockframe.wavelets.family import phase_and_amplitude as phase_and_amplitude
from rockframe.wavelets.mother import MotherWavelet as MotherWavelet
from rockframe.wavelets.pulse import Pulse as Pulse
from rockframe.wavelets.ricker import ANTISYMMETRIC_RICKER as ANTISYMMETRIC_RICKER
from rockframe.wavelets.ricker import BETA as BETA
from rockframe.wavelets.ricker import SYMMETRIC_RICKER as SYMMETRIC_RICKER
