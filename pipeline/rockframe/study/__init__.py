"""The user's TOML files as strict models, and the bundled structures and records."""

from rockframe.study.commented import SCHEMA as SCHEMA
from rockframe.study.commented import commented_study as commented_study
from rockframe.study.commented import schema as schema
from rockframe.study.passport import PassportLimits as PassportLimits
from rockframe.study.passport import read_limits as read_limits
from rockframe.study.structures import SHIPPED_STRUCTURES as SHIPPED_STRUCTURES
from rockframe.study.structures import StructureEntry as StructureEntry
from rockframe.study.structures import bundled_records as bundled_records
from rockframe.study.structures import read_structures as read_structures
from rockframe.study.study import Study as Study
from rockframe.study.study import StudyTables as StudyTables
from rockframe.study.study import read_study as read_study
from rockframe.study.study import structures_text as structures_text
