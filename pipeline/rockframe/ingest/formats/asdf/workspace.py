"""An open ASDF file: its waveforms, events and documents. netCDF's library reads the HDF5."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.catalogue import read_entries
from rockframe.ingest.containers import printable
from rockframe.ingest.parsing.obspy_reader import quakeml_events

#: What netCDF's library raises on corrupted HDF5.
_DAMAGE: Final = (OSError, RuntimeError, ValueError, LookupError, AttributeError, TypeError)
#: Name of a dataset of waveforms: codes, time of the first and the last sample, and tag.
_NAME: Final = re.compile(
    r"(?P<network>\w{1,8})\.(?P<station>\w{1,8})\.(?P<location>[\w-]{0,2})\.(?P<channel>\w{3})"
    r"__(?P<first>[\dT:.-]{19,29})__(?P<last>[\dT:.-]{19,29})__(?P<tag>\w+)"
)
#: Beginning of a global heap of HDF5, and the size of the header of an object in it [bytes].
_HEAP: Final = re.compile(rb"GCOL\x01\0{3}(?P<size>.{8})", re.S)
_OBJECT: Final = 16
#: Prefix of the identifiers of events.
_LOCAL: Final = "smi:local/"


@dataclass(frozen=True)
class Trace:
    """One dataset of waveforms: its codes, tag and event, and the HDF5 variable."""

    network: str
    station: str
    location: str
    channel: str
    first: str
    last: str
    tag: str
    event: str
    variable: Any

    @property
    def place(self) -> str:
        """Network and station: ``CE.68150``."""
        return f"{self.network}.{self.station}"

    @property
    def name(self) -> str:
        """The four codes: ``CE.68150..HNE``."""
        return f"{self.place}.{self.location}.{self.channel}"

    @property
    def stream(self) -> str:
        """The codes of all channels of one instrument: ``CE.68150..HN``."""
        return f"{self.place}.{self.location}.{self.channel[:2]}"

    @property
    def label(self) -> str:
        """The tag without the event that gmprocess puts before it."""
        return self.tag.removeprefix(f"{self.event}_") if self.event else self.tag


@dataclass(frozen=True)
class Workspace:
    """An open ASDF file."""

    path: Path
    file: Any

    def variable(self, *names: str) -> Any | None:
        """Return the dataset with this path, or None."""
        group = self.file
        for name in names[:-1]:
            if name not in group.groups:
                return None
            group = group.groups[name]
        return group.variables.get(names[-1])

    def values(self, variable: Any) -> Any:
        """Return the values of a dataset as an array."""
        with _damage(self.path):
            return np.asarray(variable[...])

    def attribute(self, variable: Any, name: str) -> Any:
        """Return an attribute of a dataset as a number or text; None if it is missing."""
        with _damage(self.path):
            content = variable.getncattr(name) if name in variable.ncattrs() else None
            return content.item() if isinstance(content, np.generic) else content

    def data(self, *names: str) -> bytes:
        """Return the bytes of a dataset that contains a document; empty if it is missing."""
        variable = self.variable(*names)
        if variable is None or getattr(variable.dtype, "itemsize", 0) != 1:
            return b""
        return bytes(self.values(variable).tobytes())

    def text(self, *names: str) -> str:
        """Return a document as text; empty if it is missing."""
        return self.data(*names).decode("utf-8", "replace")

    def auxiliary(self, kind: str, trace: Trace, name: str, tag: str) -> str:
        """Return a document of `AuxiliaryData` on a trace or stream; empty if it is missing."""
        return self.text("AuxiliaryData", kind, trace.place, f"{name}_{tag}")

    def table(self, kind: str, trace: Trace, name: str) -> dict[str, Any]:
        """Return a JSON document of `AuxiliaryData`; empty if it is missing."""
        text = self.auxiliary(kind, trace, name, trace.tag)
        try:
            content = json.loads(text or "{}")
        except ValueError as error:
            raise InputError(self.path, f"{kind} of {name} is not JSON: {error}.") from None
        return content if isinstance(content, dict) else {}

    @cached_property
    def events(self) -> dict[str, tuple[Any, dict[str, Any]]]:
        """Hypocentre, and facts of a record, by the identifier of the event."""
        data = self.data("QuakeML")
        if not data.strip():
            return {}
        entries = read_entries(self.path, "QuakeML", data)
        events_by_id = {}
        for event in quakeml_events(self.path, data):
            entry, name = entries[str(event.resource_id)], local_name(str(event.resource_id))
            facts = {"event": entry.event or name, "magnitude": entry.magnitude}
            origin = event.preferred_origin() or (event.origins or [None])[0]
            events_by_id[name] = origin, facts
        return events_by_id


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Turn the errors of netCDF's library into a rejection."""
    try:
        yield
    except _DAMAGE as error:
        shown = printable(" ".join(str(error).split()))[:100]
        raise InputError(path, f"corrupted HDF5: {shown or type(error).__name__}.") from error


def _require_sound_heaps(path: Path, data: bytes) -> None:
    """Reject heaps of strings that HDF5 2.2 never finishes reading: a gap of size zero."""
    for heap in _HEAP.finditer(data):
        place, end = heap.end(), heap.start() + int.from_bytes(heap["size"], "little")
        while place + _OBJECT <= min(end, len(data)):
            used = int.from_bytes(data[place : place + 2], "little") != 0
            size = int.from_bytes(data[place + 8 : place + _OBJECT], "little")
            if not (used or size):
                raise InputError(path, f"corrupted HDF5: empty gap in the heap at byte {place}.")
            place += _OBJECT + -(-size // 8) * 8 if used else size


@contextmanager
def opened(path: Path, data: bytes) -> Iterator[Workspace]:
    """Yield the open file; reject one that is corrupted or not ASDF."""
    import netCDF4  # few runs read ASDF

    _require_sound_heaps(path, data)
    with _damage(path):
        file = netCDF4.Dataset("asdf", memory=data)
    with closing(file):
        file.set_auto_maskandscale(False)
        workspace = Workspace(path, file)
        if workspace.attribute(file, "file_format") != "ASDF":
            is_output = workspace.attribute(file, "Conventions") is not None
            kind = "netCDF, as outputs of rockframe are" if is_output else "HDF5, but not ASDF"
            raise InputError(path, f"is {kind}. State the record files.")
        yield workspace


def traces_in(workspace: Workspace) -> Iterator[Trace]:
    """Yield the datasets of waveforms."""
    stations = workspace.file.groups.get("Waveforms")
    for station in stations.groups.values() if stations else ():
        for name, variable in station.variables.items():
            if name == "StationXML":
                continue
            codes = _NAME.fullmatch(name)
            if codes is None:
                message = f"waveforms {printable(name)[:60]!r}. Must be named NET.STA.LOC.CHA"
                raise InputError(workspace.path, f"{message}__FIRST__LAST__TAG.")
            event = local_name(str(workspace.attribute(variable, "event_id") or ""))
            yield Trace(**codes.groupdict(), event=event, variable=variable)


def local_name(identifier: str) -> str:
    """Return the identifier of an event without its prefix.

    Examples
    --------
    >>> local_name("smi:local/nc72282711")
    'nc72282711'
    """
    return printable(identifier.split(",")[0].removeprefix(_LOCAL).strip())
