"""Rocking: what shakes the frame, the kernel, and the response around it."""

from rockframe.rocking.batch import Peaks as Peaks
from rockframe.rocking.batch import Scenarios as Scenarios
from rockframe.rocking.batch import respond_many as respond_many
from rockframe.rocking.batch import respond_scenarios as respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration as GroundAcceleration
from rockframe.rocking.histories import Histories as Histories
from rockframe.rocking.impulses import Impulses as Impulses
from rockframe.rocking.impulses import impact_friction_demand as impact_friction_demand
from rockframe.rocking.impulses import impact_impulses as impact_impulses
from rockframe.rocking.impulses import least_spacing as least_spacing
from rockframe.rocking.margins import Margin as Margin
from rockframe.rocking.margins import margins as margins
from rockframe.rocking.perturbed import Sensitivity as Sensitivity
from rockframe.rocking.portrait import barrier_rate as barrier_rate
from rockframe.rocking.portrait import restoring_moment as restoring_moment
from rockframe.rocking.portrait import trajectory as trajectory
from rockframe.rocking.reactions import ColumnForces as ColumnForces
from rockframe.rocking.reactions import Reactions as Reactions
from rockframe.rocking.reactions import angular_acceleration as angular_acceleration
from rockframe.rocking.reactions import column_forces as column_forces
from rockframe.rocking.reactions import reactions as reactions
from rockframe.rocking.response import Response as Response
from rockframe.rocking.response import Verdict as Verdict
from rockframe.rocking.response import respond as respond
from rockframe.rocking.spectra import OverturningSpectrum as OverturningSpectrum
from rockframe.rocking.spectra import overturning_spectrum as overturning_spectrum
