"""Columns with circular ends, shaken in both horizontal directions: they tilt and roll (wobble)."""

from rockframe.wobbling.ensemble import wobbling_ensemble as wobbling_ensemble
from rockframe.wobbling.margins import wobbling_margins as wobbling_margins
from rockframe.wobbling.motion import PairAcceleration as PairAcceleration
from rockframe.wobbling.reactions import wobbling_reactions as wobbling_reactions
from rockframe.wobbling.response import WobblingResponse as WobblingResponse
from rockframe.wobbling.response import wobble as wobble
from rockframe.wobbling.spectrum import wobbling_spectrum as wobbling_spectrum
