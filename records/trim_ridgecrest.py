"""Cut the three Ridgecrest 2019 accelerograms in this folder from the files of the archive.

Every channel keeps the same 100 s; lines of samples are copied, never rewritten.
"""

import argparse
import re
from pathlib import Path

FILES = {
    "CICCC.RAW": "Ridgecrest2019-CCC.V1",
    "CICLC.v1": "Ridgecrest2019-CLC.V1",
    "CITOW2.RAW": "Ridgecrest2019-TOW2.V1",
}
WINDOW_START_MS = ((3 * 60 + 19) * 60 + 40) * 1000  # 03:19:40 UTC, as milliseconds of the day
WINDOW_LINES = 1250
PER_LINE = 8
STEP_MS = 10
WIDTH = 9
TEXT_ROWS, INTEGER_ROWS, HEADER_ROWS = 13, 7, 28
CLOCK = re.compile(r"(\d\d):\d\d:[ \d]\d\.\d (PDT|UTC \(GPS\)) ")


def read_item(header: list[str], item: int) -> int:
    """Return one item, counted from 1, of the integer header."""
    row, column = divmod(item - 1, 16)
    return int(header[TEXT_ROWS + row][5 * column : 5 * column + 5])


def write_item(header: list[str], item: int, value: float) -> None:
    """Write an int into the integer header, or a float into the real header; items count from 1."""
    whole = isinstance(value, int)
    first, per_row, width = (TEXT_ROWS, 16, 5) if whole else (TEXT_ROWS + INTEGER_ROWS, 8, 10)
    row, column = divmod(item - 1, per_row)
    line, start = header[first + row], width * column
    field = (str(value) if whole else f"{value:#.8g}").rjust(width)
    header[first + row] = line[:start] + field + line[start + width :]


def refill(header: list[str], row: int, pattern: str, value: str) -> None:
    """Replace the pattern's only group by the value, right-justified in the same columns."""
    found = re.search(pattern, header[row])
    if found is None:
        raise ValueError(f"header line {row + 1} has no {pattern!r}: {header[row]!r}")
    begin, end = found.span(1)
    header[row] = header[row][:begin] + value.rjust(end - begin) + header[row][end:]


def restart_clock(header: list[str], start_ms: int) -> None:
    """State the new start in the text lines and in the integer header."""
    seconds, milliseconds = divmod(start_ms, 1000)
    minutes, second = divmod(seconds, 60)
    hour, minute = divmod(minutes, 60)
    if hour != read_item(header, 17):
        raise ValueError("the window begins in another hour than the file")
    # The archive prints tenths; the second decimal replaces the blank that follows.
    clock = rf"\g<1>:{minute:02d}:{second:02d}.{milliseconds // 10:02d} \g<2>"
    for row in (1, 3, 7):
        header[row] = CLOCK.sub(clock, header[row])
    for item, value in ((18, minute), (19, second), (20, milliseconds)):
        write_item(header, item, value)
    # Items 29 and 31 state the positions where the two local times in line 8 end.
    write_item(header, 29, header[7].index("PDT") + 3)
    write_item(header, 31, header[7].rindex("PDT") + 3)


def peak_index(sample_lines: list[str]) -> tuple[int, float]:
    """Return the index and value of the sample with the largest absolute value."""
    text = "".join(sample_lines)
    samples = [float(text[i : i + WIDTH]) for i in range(0, len(text), WIDTH)]
    place = max(range(len(samples)), key=lambda i: abs(samples[i]))
    return place, samples[place]


def trim_channel(header: list[str], sample_lines: list[str]) -> list[str]:
    """Return the corrected header and the sample lines of the window."""
    header = list(header)
    widths = [len(line) for line in header]
    hour, minute, second, fraction = (read_item(header, item) for item in range(17, 21))
    start_ms = ((hour * 60 + minute) * 60 + second) * 1000 + fraction
    skip = -(-(WINDOW_START_MS - start_ms) // (PER_LINE * STEP_MS))
    kept = sample_lines[skip : skip + WINDOW_LINES]
    points = WINDOW_LINES * PER_LINE
    if skip < 0 or any(len(line) != PER_LINE * WIDTH for line in kept) or len(kept) < WINDOW_LINES:
        raise ValueError("the file does not cover the window")
    if peak_index(kept)[0] + skip * PER_LINE != peak_index(sample_lines)[0]:
        raise ValueError("the record's peak is outside the window")
    restart_clock(header, start_ms + skip * PER_LINE * STEP_MS)
    length = points * STEP_MS / 1000
    peak_time = peak_index(kept)[0] * STEP_MS / 1000
    refill(header, 10, r"No\. of Points =([ \d]+\d)", str(points))
    refill(header, 10, r"Record Length =([ .\d]{7}) sec", f"{length:.3f}")
    refill(header, 11, r" at([ .\d]{9}) sec", f"{peak_time:.3f}")
    refill(header, 27, r"^([ \d]{6}) Accelerogram points", str(points))
    for item, value in ((28, points), (33, points), (3, length), (8, peak_time)):
        write_item(header, item, value)
    if [len(line) for line in header] != widths:
        raise ValueError("a header line changed its width")
    return header + kept


def trim(text: str) -> str:
    """Return a whole V1 file with every channel cut to the window."""
    lines = text.split("\r\n")
    out: list[str] = []
    top = 0
    while lines[top].startswith("Uncorrected Accelerogram"):
        data = top + HEADER_ROWS
        end = data - (-int(lines[data - 1].split()[0]) // PER_LINE)
        if not lines[end].startswith("/&"):
            raise ValueError(f"line {end + 1} should end the channel: {lines[end]!r}")
        out += [*trim_channel(lines[top:data], lines[data:end]), lines[end]]
        top = end + 1
    return "\r\n".join(out + lines[top:])


def main() -> None:
    """Trim the three files of the source folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, help="folder with " + ", ".join(FILES))
    default = Path(__file__).parent / "ridgecrest2019"
    parser.add_argument("--output", type=Path, default=default, help="default: %(default)s")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    for source, name in FILES.items():
        # Bytes, because text mode would turn the archive's CRLF into LF.
        text = trim((arguments.source / source).read_bytes().decode("ascii"))
        (arguments.output / name).write_bytes(text.encode("ascii"))
        print(f"{source} -> {arguments.output / name}: {len(text)} bytes")


if __name__ == "__main__":
    main()
