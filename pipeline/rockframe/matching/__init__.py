"""The extended wavelet transform: the pulse that explains most of a record."""

from rockframe.matching.curve import match_curve as match_curve
from rockframe.matching.found import RUNNERS_UP as RUNNERS_UP
from rockframe.matching.found import FindOptions as FindOptions
from rockframe.matching.found import RecordPulses as RecordPulses
from rockframe.matching.found import RunnerUp as RunnerUp
from rockframe.matching.found import find_pulses as find_pulses
from rockframe.matching.likeness import LEVEL as LEVEL
from rockframe.matching.likeness import Likeness as Likeness
from rockframe.matching.likeness import LikenessOptions as LikenessOptions
from rockframe.matching.likeness import PulseVerdict as PulseVerdict
from rockframe.matching.likeness import Scrambling as Scrambling
from rockframe.matching.likeness import likeness as likeness
from rockframe.matching.likeness import pulse_words as pulse_words
from rockframe.matching.match import PulseMatch as PulseMatch
from rockframe.matching.match import best_match as best_match
from rockframe.matching.match import best_ricker as best_ricker
from rockframe.matching.match import match_pulse as match_pulse
from rockframe.matching.match import match_pulses as match_pulses
from rockframe.matching.options import LONGEST_PERIOD as LONGEST_PERIOD
from rockframe.matching.options import MOST_HALF_CYCLES as MOST_HALF_CYCLES
from rockframe.matching.options import SHORTEST_PERIOD as SHORTEST_PERIOD
from rockframe.matching.options import MatchOptions as MatchOptions
from rockframe.matching.scalogram import scalogram as scalogram
from rockframe.matching.velocity import VelocityPulse as VelocityPulse
from rockframe.matching.velocity import velocity_pulse as velocity_pulse
from rockframe.matching.weighting import Weighting as Weighting
