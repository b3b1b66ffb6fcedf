"""Split text files into lines, headers and numbers; errors state the line."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.cells import decimal
from rockframe.errors import InputError, settle
from rockframe.ingest.parsing import Float

_UTF8_MARK: Final = b"\xef\xbb\xbf"
#: End-of-file mark of DOS, which may fill a whole sector.
_END_MARK: Final = b"\x1a"
_UTF16_MARKS: Final = (b"\xff\xfe", b"\xfe\xff")
#: Larger than any acceleration or time in any unit; products of smaller numbers are finite.
_LARGEST: Final = 1e30
#: Letter of an exponent of double precision in Fortran.
_FORTRAN: Final = re.compile(rb"[Dd](?<=[\d.].)(?=[-+]?\d)")
#: Least number of lines that show a fixed width, and number of lines that may deviate.
_FIXED: Final = 20
_ODD: Final = 2
_LONG_EXPONENT: Final = re.compile(rb"[eE][-+]\d{3}")
#: Least number of numbers that are compared with the last one, and the size of their text [bytes].
_ENOUGH: Final = 10
_END: Final = 4096
#: White space and control characters.
_UNSEEN: Final = bytes(range(ord(" ") + 1))
_BLANKS: Final = bytes.maketrans(b",;", b"  ")
#: Size of the blocks in which numbers are parsed, which limits memory [bytes].
_BLOCK: Final = 1 << 22
#: Size of a text whose numbers are read sooner one by one than in columns [bytes].
_SHORT: Final = 1 << 15
#: Number of bytes from which catalogues and StationXML are recognised.
HEAD: Final = 8192


def unreadable(path: Path, error: OSError) -> InputError:
    """Return the error for a file or folder that cannot be opened."""
    reason = error.strerror or type(error).__name__
    return InputError(path, f"cannot be opened: {reason}.")


def read_head(path: Path) -> bytes:
    """Return the first `HEAD` bytes of a file; empty if it cannot be read.

    Examples
    --------
    >>> read_head(Path("lost.xml"))
    b''
    """
    try:
        with path.open("rb") as stream:
            return stream.read(HEAD)
    except OSError:
        return b""


def is_utf16(head: bytes) -> bool:
    r"""Return True if a file begins with the byte order mark of UTF-16.

    Examples
    --------
    >>> is_utf16("NPTS".encode("utf-16")), is_utf16(b"NPTS")
    (True, False)
    """
    return head.startswith(_UTF16_MARKS)


def unify_line_ends(data: bytes) -> bytes:
    r"""Return text with LF line ends, without the byte order mark of UTF-8.

    CR-LF, CR-CR-LF (text converted twice for DOS) and CR are line ends.

    Examples
    --------
    >>> unify_line_ends(b"one\r\r\ntwo\r\nthree\rfour")
    b'one\ntwo\nthree\nfour'
    """
    data = data.removeprefix(_UTF8_MARK)
    if b"\r" in data:
        data = data.replace(b"\r\r\n", b"\n").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def plain_text(path: Path, data: bytes) -> bytes:
    r"""Return the text of a file with LF line ends, without the end-of-file marks of DOS.

    Raises
    ------
    InputError
        If the file is UTF-16 or contains a NUL byte.

    Examples
    --------
    >>> plain_text(Path("motion.csv"), b"time_s,acc_g\r\n0.00,0.1\r\n")
    b'time_s,acc_g\n0.00,0.1\n'
    """
    if is_utf16(data):
        raise InputError(path, "text in UTF-16. Save it as ASCII or UTF-8.")
    data = unify_line_ends(data.rstrip(_END_MARK))
    where = data.find(b"\0")
    if where >= 0:
        line = data.count(b"\n", 0, where) + 1
        raise InputError(path, "NUL byte in a text file.", line=line)
    return data


def rows_below(text: bytes, count: int) -> bytes:
    r"""Return the text below its first lines; empty if it has no more lines.

    Examples
    --------
    >>> rows_below(b"header\n 1 2\n 3 4\n", 1)
    b' 1 2\n 3 4\n'
    """
    rest = text.split(b"\n", count)
    return rest[count] if len(rest) > count else b""


def head_lines(head: bytes) -> tuple[str, ...]:
    r"""Return the lines in the head of a text file (the last may be cut); empty if binary.

    Examples
    --------
    >>> head_lines(b"NPTS= 3, DT= .01 SEC\r\n .1 .2 .3"), head_lines(b"\x00\x01")
    (('NPTS= 3, DT= .01 SEC', ' .1 .2 .3'), ())
    """
    return _head_lines(head)


def first_line(head: bytes) -> str:
    r"""Return the first line in the head of a text file; empty if binary.

    Examples
    --------
    >>> first_line(b"NPTS= 3, DT= .01 SEC\r\n .1 .2 .3")
    'NPTS= 3, DT= .01 SEC'
    """
    return (_head_lines(head) or ("",))[0]


@lru_cache(maxsize=4)  # every format examines the same head
def _head_lines(head: bytes) -> tuple[str, ...]:
    head = head.rstrip(b"\0") or head  # some archives pad files to whole blocks
    if is_utf16(head) or b"\0" in head:
        return ()
    return tuple(unify_line_ends(head).decode("latin-1").split("\n"))


def decoded(line: bytes) -> str:
    r"""Return a line of text in UTF-8 or, if it is none, in Latin-1.

    Examples
    --------
    >>> decoded(b"m/s\xc2\xb2") == decoded(b"m/s\xb2") == "m/s\xb2"
    True
    """
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def is_number(token: bytes | str) -> bool:
    """Return True if a token is a decimal number with an absolute value below 1e30.

    Examples
    --------
    >>> [is_number(token) for token in (b"-.12E-03", b"nan", b"1_0", b"0.1x")]
    [True, False, False, False]
    """
    text = token if isinstance(token, str) else token.decode("latin-1")
    try:
        return abs(decimal(text)) < _LARGEST
    except ValueError:
        return False


def are_finite(values: Float) -> bool:
    """Return True if all absolute values of an array are below 1e30 (and none is NaN).

    Examples
    --------
    >>> are_finite(np.array([0.1, -0.2])), are_finite(np.array([0.1, np.nan]))
    (True, False)
    """
    return bool((np.abs(values) < _LARGEST).all())


def bad_number(path: Path, token: bytes, line: int, quantity: str = "acceleration") -> InputError:
    """Return the error for a token that is not a finite number.

    Examples
    --------
    >>> str(bad_number(Path("motion.csv"), b"nan", 12))
    "motion.csv:12: acceleration 'nan'. Must be a finite number below 1e30."
    """
    shown = decoded(token).strip()[:40]
    return InputError(path, f"{quantity} {shown!r}. Must be a finite number below 1e30.", line=line)


def blocks(body: bytes) -> Iterator[bytes]:
    r"""Yield blocks of a few megabytes that consist of whole lines.

    Examples
    --------
    >>> list(blocks(b"1 2\n3 4\n"))
    [b'1 2\n3 4\n']
    """
    start = 0
    while start < len(body):
        end = body.find(b"\n", start + _BLOCK) + 1 or len(body)
        yield body[start:end]
        start = end


def parse_numbers(path: Path, body: bytes, first_line: int) -> Float:
    r"""Return all numbers of a text, separated by white space.

    Parameters
    ----------
    body : bytes
        Text with LF line ends. Its exponents may have the D of Fortran.
    first_line : int
        Line number of its first line in the file.

    Returns
    -------
    array, shape (numbers,)

    Raises
    ------
    InputError
        If a token is not a finite number, or the text ends within a number.

    Examples
    --------
    >>> parse_numbers(Path("motion.AT2"), b" .1 -.2\n 3E-1\n", 5)
    array([ 0.1, -0.2,  0.3])
    """
    try:
        pieces = [_numbers(block) for block in blocks(body)]
    except ValueError:
        plain, count = _FORTRAN.subn(b"E", body)
        if not 2 * count > len(body.split()):  # a single D is a corrupted digit
            raise _first_bad_number(path, body, first_line) from None
        return parse_numbers(path, plain, first_line)
    values = np.concatenate([np.empty(0), *pieces])
    # float() accepts underscores, as in Python literals; no archive writes them.
    if b"_" in body or not are_finite(values):
        raise _first_bad_number(path, body, first_line)
    require_whole_end(path, body, first_line)
    return values


def _numbers(block: bytes) -> Float:
    from rockframe.ingest.parsing.aligned import numbers_of_columns  # few commands read samples

    aligned = numbers_of_columns(block) if len(block) > _SHORT else None
    return np.array(block.split(), dtype=np.float64) if aligned is None else aligned


def require_even_lines(path: Path, body: bytes, first_line: int) -> None:
    r"""Reject a line that lost or gained a character, unless the user trusts the samples.

    Its numbers may still be numbers, but other ones. One or two lines of another width among lines
    of one width are suspect: where all numbers of a column have the same decimals, if they have
    other decimals; elsewhere, if they are shorter. Otherwise a number has a digit more or fewer
    before its point, as a large one has. The last line may be shorter.

    Parameters
    ----------
    body, first_line
        As in `parse_numbers`.

    Raises
    ------
    InputError
        If a line is suspect.

    Examples
    --------
    >>> require_even_lines(Path("motion.AT2"), b" .12 .34\n" * 30 + b" .2 .34\n .56", 5)
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.AT2:35: 7 characters, where 30 other lines have 8. A numb...
    >>> require_even_lines(Path("motion.AT2"), b" .12 .34\n" * 30 + b" 1.22 .34\n .56", 5)
    """
    if _has_one_width(body) and not _has_long_exponent(body):
        return
    rows = [row.rstrip() for row in body.rstrip().split(b"\n")[:-1]]
    if len({*map(len, rows)}) < 2 and not _has_long_exponent(body):
        return
    # C prints a third digit of an exponent where it needs one, and widens the line.
    widths = [len(row) - len(_LONG_EXPONENT.findall(row)) for row in rows]
    usual, others = Counter(widths).most_common(1)[0] if widths else (0, 0)
    if others < max(_FIXED, len(widths) - _ODD) or others == len(widths):
        return
    forms = {_forms(row) for row, width in zip(rows, widths, strict=True) if width == usual}
    for line, (row, width) in enumerate(zip(rows, widths, strict=True), first_line):
        is_fixed = len(forms) == 1
        if width != usual and (_forms(row) not in forms if is_fixed else width < usual):
            message = f"{width} characters, where {others} other lines have {usual}."
            settle(path, message, {"samples": None}, line, "A number may be corrupted.")


def _has_one_width(body: bytes) -> bool:
    """Return True if all lines but the last have as many characters and end with none of white
    space, or False more often, in a twentieth of the time.
    """
    rows = body.rstrip()
    size = rows.find(b"\n") + 1
    count = int(np.count_nonzero(np.frombuffer(rows, dtype=np.uint8) == ord("\n")))
    if count == 0:
        return True
    ends, before = rows[size - 1 :: size][:count], rows[size - 2 :: size][:count]
    return size > 1 and ends == b"\n" * count and before == before.translate(None, _UNSEEN)


def _has_long_exponent(body: bytes) -> bool:
    """Return what `_LONG_EXPONENT` finds, or True more often, in a tenth of the time."""
    codes = np.frombuffer(body, dtype=np.uint8)
    is_long = (codes[:-4] | 32) == ord("e")  # a letter of either case
    is_long &= codes[4:] - np.uint8(ord("0")) < 10
    return bool(is_long.any())


def _forms(row: bytes) -> tuple[tuple[int, int], ...]:
    """Return the decimals of each number of a line, and the digits of its exponent."""
    forms = (_digits(token)[1:] for token in row.translate(_BLANKS).split())
    # a long exponent is of the same form
    return tuple((decimals, min(exponent, len("-99"))) for decimals, exponent in forms)


def require_whole_end(path: Path, body: bytes, first_line: int, columns: int = 1) -> None:
    r"""Reject a text that was cut within its last number, unless the user trusts the samples.

    The rest of the number would be read as another number. It counts as cut if no line end follows,
    if all numbers before it have the same number of digits, and if it has fewer: a point without
    decimals, an exponent of fewer digits, or fewer decimals than numbers that end in zeros. A
    program that prints as few digits as a number needs writes no such zeros, and its last number
    may be shorter.

    Parameters
    ----------
    body : bytes
        Numbers separated by white space, commas or semicolons.
    first_line : int
        Line number of the first number.
    columns : int
        Number of columns of a table; only the last column is compared.

    Raises
    ------
    InputError
        If the text ends within a number.

    Examples
    --------
    >>> require_whole_end(Path("motion.AT2"), b" 1.25E-02" * 20 + b" 1.25E-0", 5)
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.AT2:5: the file ends within '1.25E-0', which has fewer ...
    """
    if not body or body[-1:].isspace():
        return
    tokens = body[-_END:].translate(_BLANKS).split()[1:][::-columns]
    if len(tokens) > _ENOUGH and _is_cut(*tokens):
        shown = tokens[0].decode("latin-1")
        message = f"the file ends within {shown!r}, which has fewer digits than the numbers before"
        line = first_line + body.count(b"\n")
        settle(path, f"{message} it.", {"samples": None}, line, "A whole file ends its last line.")


def _is_cut(last: bytes, *others: bytes) -> bool:
    """Return True if a number has fewer digits than others, all of which have the same number."""
    (mantissa, decimals, exponent), forms = _digits(last), [_digits(other) for other in others]
    if mantissa.endswith(b".") and all(form[1] for form in forms):
        return True
    if len({form[1:] for form in forms}) > 1:
        return False
    _, usual, longest = forms[0]
    if usual and mantissa.endswith(b"."):
        return True
    if 0 < exponent < longest:
        return longest > len("-9")
    fixed = usual > 1 and any(form[0].endswith(b"0") for form in forms)
    return fixed and (decimals < usual or exponent < longest)


def _digits(token: bytes) -> tuple[bytes, int, int]:
    """Return the digits before the exponent, the number of decimals, and that of the exponent."""
    number, _, exponent = token.lower().partition(b"e")
    return number, len(number.partition(b".")[2]), len(exponent)


def _first_bad_number(path: Path, body: bytes, first_line: int) -> InputError:
    for line, row in enumerate(body.split(b"\n"), first_line):
        for token in row.split():
            if not is_number(token):
                return bad_number(path, token, line)
    raise AssertionError("every token is a number, yet they could not be read together")


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

    def require_count(self, key: str, count: int, what: str) -> None:
        """Reject a header that does not state the number of samples in the file."""
        text = self.get(key)
        if not (re.fullmatch(r"\d{1,9}", text, re.ASCII) and int(text) >= 2):
            raise self.invalid(key, "a whole number of 2 or more")
        if int(text) != count:
            message = f"{key} {text} in the header, {count} {what} in the file."
            settle(self.path, message, {"samples": count}, self.lines[key])

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
    rockframe.errors.InputError: a.smc:1: the file ends after 1 of the 27 lines of the header.
    """
    header = [line.decode("latin-1") for line in lines[top : top + count]]
    if len(header) < count:
        message = f"the file ends after {len(header)} of the {count} lines of {name}."
        raise InputError(path, message, top + len(header))
    return header


def parse_number(path: Path, token: str, line: int, quantity: str) -> float:
    """Return the number in a token of a header.

    Raises
    ------
    InputError
        If the token is not a finite number.

    Examples
    --------
    >>> parse_number(Path("a.dat"), " 0.005", 12, "interval")
    0.005
    """
    printed = token.strip().encode("latin-1", "replace")
    if not is_number(printed):
        raise bad_number(path, printed, line, quantity)
    return float(printed)


def require_sample_count(path: Path, token: str, line: int, count: int) -> int:
    """Return the number of samples that a header states; another number in the file is an error.

    Examples
    --------
    >>> require_sample_count(Path("a.dat"), "12", 3, 11)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.dat:3: 12 samples stated, 11 in the file. Both must be the sa...
    """
    message = f"{token.strip()[:20]} samples stated, {count} in the file."
    must = "Both must be the same, 2 or more."
    if not re.fullmatch(r"\s*\d{1,9}\s*", token, re.ASCII) or count < 2:
        raise InputError(path, f"{message} {must}", line=line)
    if int(token) != count:
        return settle(path, message, {"samples": count}, line, must)
    return count


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
        name, mark, value = line.partition(separator)
        key = name.strip() or (f"{last} (2)" if last else "")
        last = name.strip()
        if mark and key not in values:
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
    match = pattern.match(line)
    if not match:
        message = f"{line.strip()[:60]!r}, where a line such as {example!r} is expected."
        raise InputError(path, message, line=first_line + index)
    return match


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
    groups: dict[str, str] = {}
    for index, pattern, example in expected:
        groups |= required_line(path, lines, index, pattern, example, first_line).groupdict()
    return groups


def numbers_in(pattern: re.Pattern[str] | str, text: str) -> list[float]:
    r"""Return the numbers in the groups of a pattern that occurs in a text; NaN if it does not.

    Examples
    --------
    >>> numbers_in(r"M=(\d\.\d) H=(\d+)", "M=6.6 H=12"), numbers_in(r"M=(\d\.\d)", "")
    ([6.6, 12.0], [nan])
    """
    compiled = re.compile(pattern)
    match = compiled.search(text)
    return [float(group) for group in match.groups()] if match else [math.nan] * compiled.groups
