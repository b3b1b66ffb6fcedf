"""Write the manifest of a run as its last file, and read it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError
from rockframe.provenance import (
    DAMAGED,
    MANIFEST,
    is_sealed,
    is_within,
    processor,
    read_json,
    sealed,
    sha256_of,
    source_code_hash,
    versions,
    whole_file,
)

#: Required keys of a manifest, and the types of their values.
_PARTS: Final = {
    "inputs": dict,
    "outputs": dict,
    "parameters": dict,
    "source_code_hash": str,
    "versions": dict,
}


def write_manifest(
    folder: Path,
    *,
    inputs: Mapping[str, str],
    parameters: Mapping[str, Any],
    outputs: Sequence[Path],
    steps: Mapping[str, str] | None = None,
) -> None:
    """Write ``manifest.json``, the last file of a run: hashes of all inputs and outputs.

    Parameters
    ----------
    folder : Path
        The run's folder.
    inputs : mapping
        Name and SHA-256 of each input.
    parameters : mapping
        Options of the run; JSON values.
    outputs : sequence of Path
        The files of the run, inside the folder.
    steps : mapping of str to str, optional
        For the run of a study, the hash of everything that each step depended on.

    Raises
    ------
    InputError
        If an output is missing or the manifest cannot be written.
    """
    content: dict[str, Any] = {
        "inputs": dict(inputs),
        "outputs": {path.relative_to(folder).as_posix(): sha256_of(path) for path in outputs},
        "parameters": dict(parameters),
        "processor": processor(),
        "source_code_hash": source_code_hash(),
        "versions": versions(),
    }
    if steps is not None:
        content["steps"] = dict(steps)
    with whole_file(folder / MANIFEST) as partial:
        partial.write_bytes(sealed(content))


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of the run in a folder.

    Parameters
    ----------
    folder : Path
        Folder of a complete run.

    Returns
    -------
    dict of str to Any
        The manifest, with ``inputs``, ``outputs``, ``parameters``, ``source_code_hash`` and
        ``versions``. Each output lies within the folder.

    Raises
    ------
    InputError
        If the manifest is missing, invalid or corrupted.

    Examples
    --------
    >>> read_manifest(Path("no-such-folder"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-folder: no such folder. Must be the folder of a run.
    """
    path = folder / MANIFEST
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "no such folder"
        raise InputError(folder, f"{what}. Must be the folder of a run.")
    if not path.is_file():
        raise InputError(
            path, "missing: the run is not complete. State the folder of a complete run."
        )
    try:
        text = path.read_bytes()
        content = read_json(text)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read: {error}. Must be JSON.") from None
    stated: dict[str, Any] = content if isinstance(content, dict) else {}
    wrong = next((p for p, kind in _PARTS.items() if not isinstance(stated.get(p), kind)), "")
    if wrong:
        what = "another" if wrong in stated else "no"
        raise InputError(path, f"contains {what} {wrong!r}. Restore the file as the run wrote it.")
    if not all(map(is_within, stated["outputs"])):
        raise InputError(path, "names outputs outside its folder. Must be names within it.")
    if not is_sealed(text):  # its hashes cannot be trusted
        raise InputError(path, f"{DAMAGED}. Repeat the command that made the run.")
    return dict(stated)
