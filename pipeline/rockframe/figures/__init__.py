"""Figures, one in each file. They draw datasets and compute nothing but the limits of axes."""

from rockframe.figures.captioned import Captioned as Captioned
from rockframe.figures.captioned import require_format as require_format
from rockframe.figures.captioned import save as save
from rockframe.figures.captioned import save_captioned as save_captioned
from rockframe.figures.fragility import draw_fragility as draw_fragility
from rockframe.figures.fragility import draw_peak_distribution as draw_peak_distribution
from rockframe.figures.joints import draw_joints as draw_joints
from rockframe.figures.parameters import draw_equivalent_size as draw_equivalent_size
from rockframe.figures.parameters import draw_restitution as draw_restitution
from rockframe.figures.portraits import draw_moment_rotation as draw_moment_rotation
from rockframe.figures.portraits import draw_phase_portrait as draw_phase_portrait
from rockframe.figures.pulse_search import draw_match_curves as draw_match_curves
from rockframe.figures.pulse_search import draw_scalogram as draw_scalogram
from rockframe.figures.record_and_pulse import draw_record_and_pulse as draw_record_and_pulse
from rockframe.figures.response_grid import draw_response_grid as draw_response_grid
from rockframe.figures.response_history import draw_response_history as draw_response_history
from rockframe.figures.spectra import (
    draw_overturning_spectra as draw_overturning_spectra,
)
from rockframe.figures.spectra import draw_rocking_spectrum as draw_rocking_spectrum
from rockframe.figures.stability_map import draw_stability_map as draw_stability_map
