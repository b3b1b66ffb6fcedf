"""Declarations of the variables of each kind of file, for writing and reading."""

from typing import Final

from rockframe.results.schema.declare import FileKind as FileKind
from rockframe.results.schema.declare import Variable as Variable
from rockframe.results.schema.records import PULSES_NC as PULSES_NC
from rockframe.results.schema.records import RECORDS_NC as RECORDS_NC
from rockframe.results.schema.response import COMPARE_NC as COMPARE_NC
from rockframe.results.schema.response import RESPONSE_NC as RESPONSE_NC
from rockframe.results.schema.response import ROCKING_SPECTRUM_NC as ROCKING_SPECTRUM_NC
from rockframe.results.schema.response import SPECTRUM_NC as SPECTRUM_NC
from rockframe.results.schema.screen import SCREEN_NC as SCREEN_NC

#: All kinds of files, by name, in the order of the stages.
KINDS: Final = {
    kind.name: kind
    for kind in (
        *(RECORDS_NC, PULSES_NC, RESPONSE_NC),
        *(SCREEN_NC, SPECTRUM_NC, ROCKING_SPECTRUM_NC, COMPARE_NC),
    )
}
RECORDS, PULSES, RESPONSE, SCREEN, SPECTRUM, ROCKING_SPECTRUM, COMPARE = KINDS
