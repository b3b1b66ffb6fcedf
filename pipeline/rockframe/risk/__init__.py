"""Statistics of responses: fragility, overturning rates, peak distributions, ranks of records."""

from rockframe.risk.distribution import Band as Band
from rockframe.risk.distribution import demand_ranks as demand_ranks
from rockframe.risk.distribution import observed_shares as observed_shares
from rockframe.risk.distribution import over_azimuths as over_azimuths
from rockframe.risk.distribution import peak_distribution as peak_distribution
from rockframe.risk.distribution import wilson as wilson
from rockframe.risk.fitting import fit_fragility as fit_fragility
from rockframe.risk.fragility import Fragility as Fragility
from rockframe.risk.hazard import HazardCurve as HazardCurve
from rockframe.risk.hazard import LognormalFragility as LognormalFragility
from rockframe.risk.hazard import OverturningRate as OverturningRate
from rockframe.risk.hazard import overturning_rate as overturning_rate
from rockframe.risk.hazard_files import read_hazard as read_hazard
from rockframe.risk.limits import OVERTURNING as OVERTURNING
from rockframe.risk.limits import LimitState as LimitState
from rockframe.risk.limits import Outcome as Outcome
from rockframe.risk.measures import MEASURES as MEASURES
from rockframe.risk.measures import Measure as Measure
from rockframe.risk.measures import Preference as Preference
from rockframe.risk.measures import better_measure as better_measure
from rockframe.risk.measures import compared_motions as compared_motions
from rockframe.risk.measures import measure_of as measure_of
from rockframe.risk.measures import period_of as period_of
from rockframe.risk.measures import spectral as spectral
