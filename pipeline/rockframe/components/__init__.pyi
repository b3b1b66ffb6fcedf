"""Horizontal components of a motion: pairing, rotation, and measures over all azimuths."""

from .motions import ALONE as ALONE
from .motions import Channel as Channel
from .motions import motions_of as motions_of
from .motions import reasons_alone as reasons_alone
from .motions import recordings_of_channels as recordings_of_channels
from .pairing import BothDirections as BothDirections
from .pairing import HorizontalPair as HorizontalPair
from .pairing import both_directions as both_directions
from .pairing import on_common_samples as on_common_samples
from .pairing import pair_horizontals as pair_horizontals
from .pairing import pair_with as pair_with
from .pairing import placed as placed
from .pairing import resolved as resolved
from .pairing import steps_between as steps_between
from .pairing import vertical_beside as vertical_beside
from .rotation import HALF_TURN as HALF_TURN
from .rotation import Sweep as Sweep
from .rotation import fault_components as fault_components
from .rotation import rotate as rotate
from .rotation import rotd as rotd
from .rotation import rotd_spectral_acceleration as rotd_spectral_acceleration
