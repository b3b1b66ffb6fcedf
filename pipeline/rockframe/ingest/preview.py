"""Preview of a file of records: its first lines, how it is read, and what the user must state."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from rockframe.errors import TRUSTED, RockframeError
from rockframe.ingest.containers import ARCHIVE_HEAD, contents, is_archive, load, printable
from rockframe.ingest.files import companions, note_of_member, read_content, with_archived
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import decoded, is_utf16, unify_line_ends
from rockframe.ingest.registry import identified
from rockframe.record import Record
from rockframe.units import ACCELERATION_UNITS

#: Number of lines and of characters of a line that are shown.
_LINES, _WIDTH = 8, 76
#: Largest number of missing options, and of columns that are tried.
_MOST: Final = 5
_COLUMNS: Final = 8
#: Beginning of the note of a record on the layout of its table.
NOTE: Final = "table: "


@dataclass(frozen=True)
class Missing:
    """An option that a file needs, its placeholder in the command, and what is allowed."""

    option: str
    value: str
    allowed: str


@dataclass(frozen=True)
class Preview:
    """First lines of a file, how it is read, and what the user must state.

    Parameters
    ----------
    file : str
        Name of the file.
    lines : tuple of str
        Its first lines; empty if it is no text.
    format : str
        Name of the format that recognises it; empty if none does.
    recognised : str
        Layout of the table, in words; empty if there is nothing to say.
    records : tuple of Record
        Records in the file, read with the options given; empty if something is missing.
    missing : tuple of Missing
        Options without which the file cannot be read.
    refusal : str
        Reason why the file cannot be read, beside the options that are missing; or "".
    """

    file: str
    lines: tuple[str, ...]
    format: str = ""
    recognised: str = ""
    records: tuple[Record, ...] = ()
    missing: tuple[Missing, ...] = ()
    refusal: str = ""


def preview(path: str | Path, options: ReadOptions = NO_OPTIONS) -> Preview:
    r"""Return the first lines of a file, how it is read, and what the user must state.

    Of an archive the first file that is no document is shown.

    Parameters
    ----------
    path : str or Path
        The file.
    options : ReadOptions
        What the user states already.

    Raises
    ------
    InputError
        If the file cannot be opened.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "shake.txt")
    ...     _ = path.write_text("A site in Ridgecrest\n" + "0.1\n-0.2\n" * 3)
    ...     shown = preview(path)
    >>> shown.recognised, [missing.option for missing in shown.missing]
    ('1 title line', ['--units', '--time-step-s'])
    """
    path = Path(path)
    data = load(path)
    options = with_archived(options, path, companions(path, data))
    inside = is_archive(data[:ARCHIVE_HEAD])
    members = [content for content in contents(path, data) if not note_of_member(content)]
    content = members[0] if members else next(iter(contents(path, data)))
    name = content.name if inside else printable(path.name)
    lines = _first_lines(content.data)
    try:
        chosen, _ = identified(content.path, content.data, options=options)
    except RockframeError as error:
        return Preview(name, lines, refusal=_reason(error))
    records, missing, refusal = _tried(
        lambda trial: [reading.completed() for reading in read_content(content, trial)], options
    )
    notes = [note.removeprefix(NOTE) for record in records[:1] for note in record.processing]
    words = ", ".join(notes).split(", ") if records and records[0].processing else []
    named = {lack.option for lack in missing}
    unstated = 2 if named & {"--units", "--time-step-s"} else 0
    return Preview(
        name,
        lines,
        chosen.name,
        ", ".join(words[: len(words) - unstated]),
        tuple(records) if not missing else (),
        tuple(missing),
        refusal,
    )


#: Records that were read with values of the missing options, these options, and a refusal.
_Outcome = tuple[list[Record], list[Missing], str]


def _tried(
    read: Callable[[ReadOptions], list[Record]],
    options: ReadOptions,
    missing: tuple[Missing, ...] = (),
) -> _Outcome:
    """Read a file; while its refusal names an option, note that and try values of it.

    Of several values, such as columns, those that need the fewest other options are shown.
    """
    try:
        return read(options), [*missing], ""
    except RockframeError as error:
        reason = _reason(error)
    trial = _trial(reason, {option.option for option in missing}, options)
    if trial is None or len(missing) >= _MOST:
        return [], [*missing], reason
    option, changes = trial
    outcomes: dict[str, _Outcome] = {}
    for word, fields in changes.items():
        try:
            changed = replace(options, **fields)
        except RockframeError as error:
            outcomes[word] = [], [*missing, option], str(error)
        else:
            outcomes[word] = _tried(read, changed, (*missing, option))
    best = min(map(_difficulty, outcomes.values()))
    words = [word for word, outcome in outcomes.items() if _difficulty(outcome) == best]
    records, others, refusal = outcomes[words[0]]
    if len(outcomes) > 1 and not refusal:
        value = words[0] if len(words) == 1 else option.value
        allowed = ", ".join(words) if option.value == "NAME" else option.allowed
        others[len(missing)] = replace(option, value=value, allowed=allowed)
    return records, others, refusal


def _difficulty(outcome: _Outcome) -> tuple[bool, bool, bool, int]:
    """Return what is worse in an outcome: a refusal, a contradiction, no times, another option."""
    _, missing, refusal = outcome
    options = [lack.option for lack in missing]
    return bool(refusal), "--trust" in options, "--time-step-s" in options, len(missing)


def _trial(
    reason: str, named: set[str], options: ReadOptions
) -> tuple[Missing, dict[str, dict[str, Any]]] | None:
    """Return the option that a refusal names, with values to try; None if it names no other."""
    units = re.search(r"--units (\S+?)\.?(?:\s|$)", reason)
    if "--units" in reason and "--units" not in named:
        word = units[1] if units and units[1] in ACCELERATION_UNITS else ""
        option = Missing("--units", word or "UNITS", ", ".join(ACCELERATION_UNITS))
        return option, {"": {"units": word or "g"}}
    times = re.search(r"Column '(.*)' rises like times: state it with --time-column", reason)
    if times and "--time-column" not in named:
        layout = replace(options.layout, time_column=times[1])
        option = Missing("--time-column", times[1], "a column of seconds, or none")
        return option, {"": {"layout": layout}}
    if "--time-step-s" in reason and "--time-column" not in reason and "--time-step-s" not in named:
        stated = re.search(r"--time-step-s (\d\S*?)\.?$", reason)
        value = stated[1] if stated else "SECONDS"
        option = Missing("--time-step-s", value, "interval between samples [s]")
        return option, {"": {"time_step": float(stated[1]) if stated else 0.01}}
    if "--column" not in named and (column := _columns(reason)):
        return column
    trust = re.search(r"--trust (\S+?)(?:\.|\s|$)", reason)
    if trust and "--trust" not in named and trust[1] in TRUSTED:
        words = re.findall(r"--trust (\S+?)(?:\.|\s|$)", reason)
        return Missing("--trust", words[0], " or ".join(words)), {"": {"trust": (words[0],)}}
    return None


def _columns(reason: str) -> tuple[Missing, dict[str, dict[str, Any]]] | None:
    """Return the option of a column by its number or name, with the columns to try."""
    number = re.search(r"--column NUMBER, of 1 to (\d+)", reason)
    names = re.search(r"columns '(.*)'[:.].*--column NAME", reason)
    if number:
        series = "--column all" in reason
        allowed = f"1 to {number[1]}, several with --channels" + (", or all" if series else "")
        allowed += "; or --decimal comma instead" if "--decimal comma" in reason else ""
        words = [str(k) for k in range(int(number[1]), 0, -1)][:_COLUMNS] + ["all"] * series
        return Missing("--column", "NUMBER", allowed), {word: {"column": word} for word in words}
    if names:
        columns = names[1].split(",")
        likely = sorted(columns, key=lambda name: "acc" not in name.lower())[:_COLUMNS]
        allowed = ", ".join(columns)
        return Missing("--column", "NAME", allowed), {word: {"column": word} for word in likely}
    return None


def _reason(error: RockframeError) -> str:
    line, reason = getattr(error, "line", None), getattr(error, "reason", str(error))
    return f"line {line}: {reason}" if line else reason


def _first_lines(data: bytes) -> tuple[str, ...]:
    head = data[: 64 * _LINES * _WIDTH]
    if is_utf16(head) or b"\0" in head.rstrip(b"\0"):
        return ()
    lines = unify_line_ends(head).split(b"\n")[:_LINES]
    shown = (printable(decoded(line).expandtabs(4)) for line in lines)
    return tuple(line if len(line) <= _WIDTH else f"{line[: _WIDTH - 3]}..." for line in shown)
