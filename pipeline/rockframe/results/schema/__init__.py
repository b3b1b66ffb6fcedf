"""Declarations of the variables of each kind of file, for writing and reading."""

from collections.abc import Iterator, Mapping
from typing import Final

from rockframe.options import STAGES, loaded
from rockframe.results.schema.declare import FileKind as FileKind
from rockframe.results.schema.declare import Variable as Variable

#: Module and name of the declaration of each kind of file, in the order of the stages.
_DECLARATIONS: Final = {
    "records": "records.RECORDS_NC",  # of ingest, which reads no file of a run
    **{stage.kind: stage.variables for stage in STAGES.values()},
}
RECORDS: Final = "records"
PULSES: Final = "pulses"
RESPONSE: Final = "response"
SCREEN: Final = "screen"


class _Kinds(Mapping[str, FileKind]):
    """All kinds of files, by name.

    A kind is imported when it is first used: it imports the code whose results it declares.
    """

    def __getitem__(self, name: str) -> FileKind:
        kind: FileKind = loaded(f"results.schema.{_DECLARATIONS[name]}")
        return kind

    def __iter__(self) -> Iterator[str]:
        return iter(_DECLARATIONS)

    def __len__(self) -> int:
        return len(_DECLARATIONS)


KINDS: Final = _Kinds()
