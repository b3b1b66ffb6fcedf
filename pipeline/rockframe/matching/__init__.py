"""The extended wavelet transform, which finds the pulse that explains most of a record."""

from rockframe.matching.curve import match_curve as match_curve
from rockframe.matching.found import RecordPulses as RecordPulses
from rockframe.matching.found import RunnerUp as RunnerUp
from rockframe.matching.found import find_pulses as find_pulses
from rockframe.matching.likeness import LEVEL as LEVEL
from rockframe.matching.likeness import Likeness as Likeness
from rockframe.matching.likeness import PulseVerdict as PulseVerdict
from rockframe.matching.likeness import likeness as likeness
from rockframe.matching.likeness import pulse_words as pulse_words
from rockframe.matching.match import PulseMatch as PulseMatch
from rockframe.matching.match import best_match as best_match
from rockframe.matching.match import best_ricker as best_ricker
from rockframe.matching.match import match_pulse as match_pulse
from rockframe.matching.match import match_pulses as match_pulses
from rockframe.matching.scalogram import scalogram as scalogram
from rockframe.matching.velocity import VelocityPulse as VelocityPulse
from rockframe.matching.velocity import velocity_pulse as velocity_pulse
from rockframe.matching.weighting import Weighting as Weighting
