"""What a user states in TOML, as strict models, and what the package ships."""

from rockframe.study.passport import PassportLimits as PassportLimits
from rockframe.study.passport import read_limits as read_limits
from rockframe.study.structures import SHIPPED_STRUCTURES as SHIPPED_STRUCTURES
from rockframe.study.structures import StructureEntry as StructureEntry
from rockframe.study.structures import bundled_records as bundled_records
from rockframe.study.structures import read_structures as read_structures
