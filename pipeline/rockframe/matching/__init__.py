"""The extended wavelet transform: the pulse that explains most of a record."""

from rockframe.matching.match import LONGEST_PERIOD as LONGEST_PERIOD
from rockframe.matching.match import SHORTEST_PERIOD as SHORTEST_PERIOD
from rockframe.matching.match import PulseMatch as PulseMatch
from rockframe.matching.match import best_match as best_match
from rockframe.matching.match import match_pulse as match_pulse
from rockframe.matching.match import scalogram as scalogram
