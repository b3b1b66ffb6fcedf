"""Horizontal components of a station: pairing, rotation, and measures over all azimuths."""

from rockframe.components.pair import HorizontalPair as HorizontalPair
from rockframe.components.pairing import Unpaired as Unpaired
from rockframe.components.pairing import motion_of as motion_of
from rockframe.components.pairing import pair_horizontals as pair_horizontals
from rockframe.components.pairing import vertical_beside as vertical_beside
from rockframe.components.rotation import fault_components as fault_components
from rockframe.components.rotation import rotate as rotate
from rockframe.components.sweep import Sweep as Sweep
from rockframe.components.sweep import rotd as rotd
