"""verify: whether the folder of a run is whole, and its files belong together."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final

from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, sha256_of, source_code_hash
from rockframe.results import (
    PULSES,
    RECORDS,
    RESPONSE,
    ROCKING_SPECTRUM,
    SCREEN,
    SPECTRUM,
    Described,
    describe,
    rows_of,
)

#: The files of a run that hold datasets, in the order of the stages.
_DATASETS: Final = {
    f"{kind}.nc": kind for kind in (RECORDS, PULSES, RESPONSE, SCREEN, SPECTRUM, ROCKING_SPECTRUM)
}
#: What a manifest must have.
_PARTS: Final = ("inputs", "outputs", "parameters", "source_code_hash", "versions")


@dataclass(frozen=True)
class Verification:
    """What was found in the folder of a run.

    Parameters
    ----------
    files : int
        Files that were hashed.
    datasets : mapping of str to Described
        Of each netCDF file that is sound, what it holds.
    faults : tuple of str
        Why the run is not whole, each in one line; empty if it is.
    same_source : bool
        The run was made by this very source code, so that it can be repeated to the last bit.
    """

    files: int
    datasets: Mapping[str, Described]
    faults: tuple[str, ...]
    same_source: bool


def verify_run(folder: Path) -> Verification:
    """Hash the files of a run again, open its datasets, and compare them with each other.

    Parameters
    ----------
    folder : Path
        The folder of a run, with its ``manifest.json``.

    Returns
    -------
    Verification
        What was found; nothing is changed.

    Raises
    ------
    InputError
        If there is no such folder, or it has no manifest that can be read: no run ended there.
    """
    manifest = _manifest(folder)
    outputs: dict[str, str] = manifest["outputs"]
    changed = dict(_changed(folder, outputs))
    faults = list(changed.values())
    datasets: dict[str, Described] = {}
    for name, kind in _DATASETS.items():
        if name not in outputs or name in changed:
            continue
        try:
            datasets[name] = describe(folder / name, kind)
        except InputError as error:
            faults.append(str(error))
    faults += _unrelated(folder, outputs, datasets)
    faults += _miscounted(folder, datasets, set(outputs) - set(changed))
    faults += [
        f"{path}: left by a run that was interrupted. Must be removed."
        for path in sorted(folder.rglob(".*partial*"))
    ]
    same = manifest["source_code_hash"] == source_code_hash()
    return Verification(len(outputs), datasets, tuple(faults), same)


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    if not folder.is_dir():
        raise InputError(folder, "no such folder. Must be the folder of a run.")
    if not path.is_file():
        raise InputError(path, "missing: the run did not end. Must be the folder of a whole run.")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read: {error}. Must be JSON.") from None
    missing = [part for part in _PARTS if not isinstance(content, dict) or part not in content]
    if missing:
        raise InputError(path, f"without {missing[0]!r}. Must have {', '.join(_PARTS)}.")
    outputs = content["outputs"]
    if not isinstance(outputs, dict) or not all(map(_inside, outputs)):
        raise InputError(path, "names outputs outside its folder. Must be names within it.")
    return dict(content)


def _inside(name: str) -> bool:
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts


def _changed(folder: Path, outputs: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Names of the files that are not as the manifest says, and how not."""
    for name, stated in outputs.items():
        path = folder / name
        if not path.is_file():
            yield name, f"{path}: missing. Must be there, as the manifest says."
        elif (found := sha256_of(path)) != stated:
            hashes = f"SHA-256 {found[:12]}…, the manifest says {str(stated)[:12]}…"
            yield name, f"{path}: {hashes}. Must be equal."


def _miscounted(
    folder: Path, datasets: Mapping[str, Described], sound: Collection[str]
) -> Iterator[str]:
    """Lists whose rows are not as many as the datasets say."""
    records = datasets.get("records.nc")
    if records is not None and "records.csv" in sound:
        entries = rows_of(folder / "records.csv")
        listed = [row["record_id"] for row in entries if row["status"] == "accepted"]
        if sorted(listed) != sorted(records.records):
            yield (
                f"{folder / 'records.csv'}: {len(listed)} accepted, {len(records.records)} in "
                "records.nc. Must be the same records."
            )
    response = datasets.get("response.nc")
    if response is not None and "table.csv" in sound:
        rows = len(response.records) * response.structures
        found = len(rows_of(folder / "table.csv"))
        if found != rows:
            yield f"{folder / 'table.csv'}: {found} rows, {rows} responses. Must be equal."


def _unrelated(
    folder: Path, outputs: Mapping[str, str], datasets: Mapping[str, Described]
) -> Iterator[str]:
    """Files of later stages that were made from other records than those of this run."""
    records = datasets.get("records.nc")
    if records is None:
        return
    for name in datasets:
        if name in ("records.nc", "spectrum.nc"):
            continue
        made_from = datasets[name].inputs.get("records.nc")
        if made_from != outputs["records.nc"]:
            yield f"{folder / name}: was made from another records.nc. Must be of the same run."
        if name == "screen.nc":  # its motions may be records that were turned
            continue
        strange = [r for r in datasets[name].records if r not in set(records.records)]
        if strange:
            yield (
                f"{folder / name}: holds {strange[0]!r}, which is not in records.nc. "
                "Must be of the same run."
            )
