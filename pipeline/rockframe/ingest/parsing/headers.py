"""Read headers: lines with a key and a value, numbers, numbers of samples."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rockframe.errors import InputError
from rockframe.ingest.parsing.lines import bad_number, is_number


@dataclass(frozen=True)
class KeyedHeader:
    """Header of keys and values: values as printed, line numbers, and the number of lines."""

    path: Path
    values: Mapping[str, str]
    lines: Mapping[str, int]
    count: int

    def get(self, key: str) -> str:
        """Return a value, or an empty string if it is missing."""
        return self.values.get(key, "")

    def number(self, key: str) -> float:
        """Return a number; NaN if it is missing or empty."""
        token = self.get(key)
        if token and not is_number(token):
            raise self.invalid(key, "a number")
        return float(token or math.nan)

    def required(self, key: str) -> str:
        """Return a value; a missing value is an error."""
        if not self.get(key):
            raise InputError(self.path, f"no {key!r} in the header.")
        return self.values[key]

    def required_number(self, key: str) -> float:
        """Return a number; a missing value is an error."""
        self.required(key)
        return self.number(key)

    def require_count(self, key: str, found: int, what: str) -> None:
        """Reject a header that does not state the number of samples in the file."""
        stated = self.get(key)
        if not (re.fullmatch(r"\d{1,9}", stated, re.ASCII) and int(stated) >= 2):
            raise self.invalid(key, "a whole number of 2 or more")
        if int(stated) != found:
            message = f"{key} {stated} in the header, {found} {what} in the file. Must be equal."
            raise InputError(self.path, message, self.lines[key])

    def invalid(self, key: str, must: str) -> InputError:
        """Return the error for an invalid value."""
        message = f"{key} {self.values[key]!r}. Must be {must}."
        return InputError(self.path, message, line=self.lines[key])


def header_lines(
    path: Path, lines: Sequence[bytes], top: int, count: int, name: str = "the header"
) -> list[str]:
    """Return the lines of a header that begins at index `top`; a shorter file is an error.

    Examples
    --------
    >>> header_lines(Path("a.smc"), [b"2 CORRECTED ACCELEROGRAM"], 0, 27)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.smc:1: the file ends after 1 lines of the header. Must be 27 ...
    """
    header = [line.decode("latin-1") for line in lines[top : top + count]]
    if len(header) < count:
        message = f"the file ends after {len(header)} lines of {name}. Must be {count} lines."
        raise InputError(path, message, top + len(header))
    return header


def number_of(path: Path, token: str, line: int, quantity: str) -> float:
    """Return the number in a token of a header.

    Raises
    ------
    InputError
        If the token is not a finite number.

    Examples
    --------
    >>> number_of(Path("a.dat"), " 0.005", 12, "interval")
    0.005
    """
    printed = token.strip().encode("latin-1", "replace")
    if not is_number(printed):
        raise bad_number(path, printed, line, quantity)
    return float(printed)


def count_of(path: Path, token: str, line: int, found: int) -> int:
    """Return the number of samples that a header states; another number in the file is an error.

    Examples
    --------
    >>> count_of(Path("a.dat"), "12", 3, 11)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.dat:3: 12 samples stated, 11 in the file. Must be equal, 2 or ...
    """
    if not re.fullmatch(r"\s*\d{1,9}\s*", token, re.ASCII) or int(token) != found or found < 2:
        message = (
            f"{token.strip()[:20]} samples stated, {found} in the file. Must be equal, 2 or more."
        )
        raise InputError(path, message, line=line)
    return found


def keyed_header(path: Path, lines: Sequence[str], separator: str = ":") -> KeyedHeader:
    """Parse header lines with a key and a value.

    Of two equal keys the first one is used. A line without a key continues the line before: its
    value gets the key of that line with `(2)` appended.

    Examples
    --------
    >>> keyed_header(Path("a.dat"), ["RATE : 100 Hz", "words"]).get("RATE")
    '100 Hz'
    """
    values: dict[str, str] = {}
    places: dict[str, int] = {}
    last = ""
    for number, line in enumerate(lines, 1):
        name, found, value = line.partition(separator)
        key = name.strip() or (f"{last} (2)" if last else "")
        last = name.strip()
        if found and key not in values:
            values[key] = value.strip()
            places[key] = number
    return KeyedHeader(path, values, places, len(lines))


def required_line(
    path: Path,
    lines: Sequence[str],
    index: int,
    pattern: re.Pattern[str],
    example: str,
    first_line: int = 1,
) -> re.Match[str]:
    r"""Match the beginning of a header line with a pattern; no match is an error.

    `first_line` is the number of the first given line, counted in the whole file.

    Examples
    --------
    >>> required_line(Path("a.dat"), ["COMP. EW"], 0, re.compile(r"COMP\. (\w+)"), "COMP. NS")[1]
    'EW'
    """
    line = lines[index] if index < len(lines) else ""
    found = pattern.match(line)
    if not found:
        message = f"{line.strip()[:60]!r}. Must be as in {example!r}."
        raise InputError(path, message, line=first_line + index)
    return found


def required_lines(
    path: Path,
    lines: Sequence[str],
    expected: Iterable[tuple[int, re.Pattern[str], str]],
    first_line: int = 1,
) -> dict[str, str]:
    """Return the named groups of header lines, each given by its index, pattern and example.

    Examples
    --------
    >>> expected = [(0, re.compile("COMP (?P<name>.*)"), "COMP NS")]
    >>> required_lines(Path("a.dat"), ["COMP EW"], expected)
    {'name': 'EW'}
    """
    found: dict[str, str] = {}
    for index, pattern, example in expected:
        found |= required_line(path, lines, index, pattern, example, first_line).groupdict()
    return found


def numbers_in(pattern: re.Pattern[str] | str, text: str) -> list[float]:
    r"""Return the numbers in the groups of a pattern that occurs in a text; NaN if it does not.

    Examples
    --------
    >>> numbers_in(r"M=(\d\.\d) H=(\d+)", "M=6.6 H=12"), numbers_in(r"M=(\d\.\d)", "")
    ([6.6, 12.0], [nan])
    """
    compiled = re.compile(pattern)
    found = compiled.search(text)
    return [float(one) for one in found.groups()] if found else [math.nan] * compiled.groups
