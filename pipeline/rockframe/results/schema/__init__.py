"""Declarations of the variables of each kind of file, for writing and reading."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Final

from rockframe.results.schema.declare import FileKind as FileKind
from rockframe.results.schema.declare import Variable as Variable

#: Module and name of the declaration of each kind of file, in the order of the stages.
_DECLARATIONS: Final = {
    "records": ("records", "RECORDS_NC"),
    "pulses": ("response", "PULSES_NC"),
    "response": ("response", "RESPONSE_NC"),
    "screen": ("response", "SCREEN_NC"),
    "spectrum": ("response", "SPECTRUM_NC"),
    "rocking_spectrum": ("response", "ROCKING_SPECTRUM_NC"),
    "compare": ("response", "COMPARE_NC"),
}
RECORDS, PULSES, RESPONSE, SCREEN, SPECTRUM, ROCKING_SPECTRUM, COMPARE = _DECLARATIONS


class _Kinds(Mapping[str, FileKind]):
    """All kinds of files, by name.

    A kind is imported when it is first used: it imports the code whose results it declares.
    """

    def __getitem__(self, name: str) -> FileKind:
        module, declaration = _DECLARATIONS[name]
        kind: FileKind = getattr(import_module(f"{__name__}.{module}"), declaration)
        return kind

    def __iter__(self) -> Iterator[str]:
        return iter(_DECLARATIONS)

    def __len__(self) -> int:
        return len(_DECLARATIONS)


KINDS: Final = _Kinds()
