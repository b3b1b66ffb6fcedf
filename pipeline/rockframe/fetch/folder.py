"""The folder of a download: files as received, and `request.json`, which describes them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError
from rockframe.fetch.answers import ServiceReply
from rockframe.provenance import read_json, refuse_obstacles, sha256_of, whole_file

#: File with the request and the SHA-256 of everything received.
REQUEST: Final = "request.json"
#: Files with the event and the list of channels as received; no reader treats them as records.
EVENT: Final = "event.quakeml"
CHANNELS: Final = "channels.stationxml"


@dataclass
class Ledger:
    """The received files of a request, updated after each reply so that a rerun can resume.

    Parameters
    ----------
    folder : Path
        The folder.
    request : dict
        The request as JSON values.
    files : dict
        `url`, `sha256` and `bytes` of each received file, by name.
    received_at : dict
        Time of receipt by name (ISO 8601, UTC). Nothing else in the folder depends on the clock.
    services : dict
        `url` and `version` of each service, by name.
    """

    folder: Path
    request: dict[str, Any]
    files: dict[str, dict[str, Any]] = field(default_factory=dict)
    received_at: dict[str, str] = field(default_factory=dict)
    services: dict[str, dict[str, str]] = field(default_factory=dict)

    def kept(self, name: str) -> bytes | None:
        """Return the contents of a file received earlier, or None if it is missing or changed."""
        stated = self.files.get(name)
        path = self.folder / name
        if stated is None or not path.is_file() or sha256_of(path) != stated["sha256"]:
            return None
        return path.read_bytes()

    def keep(self, name: str, reply: ServiceReply) -> None:
        """Write a file atomically, then the ledger.

        Raises
        ------
        InputError
            If the folder cannot be written to.
        """
        with whole_file(self.folder / name) as partial:
            partial.write_bytes(reply.body)
        self.files[name] = {
            "url": reply.url,
            "sha256": sha256(reply.body).hexdigest(),
            "bytes": len(reply.body),
        }
        self.received_at[name] = datetime.now(UTC).isoformat(timespec="seconds")
        self.write()

    def write(self, **found: Any) -> None:
        """Write `request.json`, with further results.

        Raises
        ------
        InputError
            If the folder cannot be written to.
        """
        document = {
            "request": self.request,
            "services": self.services,
            "files": self.files,
            "received_at": self.received_at,
            "rockframe_version": version("rockframe"),
            **found,
        }
        text = json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n"
        with whole_file(self.folder / REQUEST) as partial:
            partial.write_text(text, encoding="utf-8")


def open_folder(folder: Path, request: dict[str, Any]) -> Ledger:
    """Return the ledger of an earlier run of the same request, or a new one.

    Raises
    ------
    InputError
        If the folder contains another request, or files of unknown origin.

    Examples
    --------
    >>> open_folder(Path("no-such-folder"), {"url": "SCEDC"}).files
    {}
    """
    path = folder / REQUEST
    try:
        if not path.is_file():
            if folder.exists() and any(folder.iterdir()):
                message = (
                    f"contains files but no {REQUEST}. Must be new, empty or an earlier fetch."
                )
                raise InputError(folder, message)
            return Ledger(folder, request)
        document = read_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(folder, f"cannot be opened: {error.strerror}.") from None
    except ValueError as error:
        raise InputError(
            path, f"is not JSON ({error}). Restore the file as `fetch` wrote it."
        ) from None
    return _ledger(path, document, request)


def _ledger(path: Path, document: Any, request: dict[str, Any]) -> Ledger:
    parts = ("request", "files", "received_at", "services")
    tables = document if isinstance(document, dict) else {}
    lacking = next((part for part in parts if not isinstance(tables.get(part), dict)), None)
    if lacking:
        raise InputError(
            path,
            f"{lacking!r} is missing or invalid. Restore the file, or fetch into a new folder.",
        )
    before = document["request"]
    different = sorted(
        key for key in before.keys() | request.keys() if before.get(key) != request.get(key)
    )
    if different:
        key = different[0]
        message = f"contains another request: {key} {before.get(key)!r}, now {request.get(key)!r}."
        raise InputError(path, f"{message} Use the same request, or another folder.")
    refuse_obstacles(path.parent / name for name in (EVENT, CHANNELS, *document["files"]))
    return Ledger(path.parent, request, *(document[part] for part in parts[1:]))
