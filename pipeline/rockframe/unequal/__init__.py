"""Two columns of unequal size under one rigid beam."""

from rockframe.unequal.bent import BentPositions as BentPositions
from rockframe.unequal.bent import UnequalBent as UnequalBent
from rockframe.unequal.bent import bent_positions as bent_positions
from rockframe.unequal.ensemble import bent_ensemble as bent_ensemble
from rockframe.unequal.forces import bent_forces as bent_forces
from rockframe.unequal.margins import bent_margin as bent_margin
from rockframe.unequal.response import BentResponse as BentResponse
from rockframe.unequal.response import respond_bent as respond_bent
from rockframe.unequal.scenarios import BentPeaks as BentPeaks
from rockframe.unequal.scenarios import respond_bents as respond_bents
