"""Processing of accelerograms, intensity measures, and the quality checks of a record."""

from rockframe.signals.checks import CHECKS as CHECKS
from rockframe.signals.checks import Check as Check
from rockframe.signals.checks import CheckVerdict as CheckVerdict
from rockframe.signals.measures import arias_intensity as arias_intensity
from rockframe.signals.measures import clipped_samples as clipped_samples
from rockframe.signals.measures import closing_share as closing_share
from rockframe.signals.measures import longest_constant as longest_constant
from rockframe.signals.measures import opening_share as opening_share
from rockframe.signals.measures import significant_duration as significant_duration
from rockframe.signals.noise import pre_event as pre_event
from rockframe.signals.noise import signal_to_noise_band as signal_to_noise_band
from rockframe.signals.noise import usable_periods as usable_periods
from rockframe.signals.passport import Measures as Measures
from rockframe.signals.passport import Passport as Passport
from rockframe.signals.passport import passport as passport
from rockframe.signals.processing import BandPass as BandPass
from rockframe.signals.processing import correct as correct
from rockframe.signals.processing import integrate as integrate
from rockframe.signals.processing import peak as peak
from rockframe.signals.response_spectrum import spectral_acceleration as spectral_acceleration
