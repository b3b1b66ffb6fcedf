"""Statistics of responses: fragility, overturning rates, peak distributions, ranks of records."""

from .distribution import Band as Band
from .distribution import demand_ranks as demand_ranks
from .distribution import mean_share as mean_share
from .distribution import observed_shares as observed_shares
from .distribution import over_azimuths as over_azimuths
from .distribution import peak_distribution as peak_distribution
from .distribution import wilson as wilson
from .fitting import fit_fragility as fit_fragility
from .fragility import OVERTURNING as OVERTURNING
from .fragility import Fragility as Fragility
from .fragility import LimitState as LimitState
from .fragility import Outcome as Outcome
from .hazard import HazardCurve as HazardCurve
from .hazard import LognormalFragility as LognormalFragility
from .hazard import OverturningRate as OverturningRate
from .hazard import overturning_rate as overturning_rate
from .hazard import read_hazard as read_hazard
from .measures import MEASURES as MEASURES
from .measures import Measure as Measure
from .measures import Preference as Preference
from .measures import better_measure as better_measure
from .measures import compared_motions as compared_motions
from .measures import measure_of as measure_of
from .measures import period_of as period_of
from .measures import spectral as spectral
