"""A flame graph of an archive run: `python -m tests.benchmarks.flame RAW PICTURE`.

py-spy writes RAW during a run:

    py-spy record --subprocesses --function --format raw --output RAW -- \
        python -m tests.benchmarks.archive --records 300

Each bar is a function of the package, above the function that calls it; its width is its share of
all samples. Functions of other packages count for their callers.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure
from tests.benchmarks.size import sized

#: Patterns of the process of a step, and of a function of the package, in py-spy's frames.
_STEP: Final = re.compile(r"rockframe\S* step \S+ (\w+)")
_OWN: Final = re.compile(r"(.+) \(rockframe/([\w/]+)\.py:\d+\)$")
#: Folders that are left out because every step uses them, and the narrowest bar that is drawn.
_HIDDEN: Final = ("cli/", "runs/", "engines/")
_LEAST: Final = 0.008
#: Number of characters that fit into a bar as wide as the picture.
_ROOM: Final = 190


def read(path: Path) -> dict[tuple[str, ...], int]:
    """Count the samples of each stack of functions: the step, then the package's own functions."""
    stacks: dict[tuple[str, ...], int] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        frames, count = line.rsplit(" ", 1)
        step = _STEP.search(frames)
        if step is None:
            continue
        own = [found for frame in frames.split(";") if (found := _OWN.match(frame))]
        named = [
            name.rsplit(".", 1)[-1]
            for name, place in (found.groups() for found in own)
            if not place.startswith(_HIDDEN)
        ]
        key = (step[1], *(name for name in named if not name.startswith("<")))
        stacks[key] = stacks.get(key, 0) + int(count)
    return stacks


def draw(stacks: dict[tuple[str, ...], int], path: Path) -> None:
    """Draw the bars, each above its caller."""
    total = sum(stacks.values())
    figure = Figure(figsize=(11.0, 5.6), layout="constrained")
    axes = figure.subplots()

    def bars(prefix: tuple[str, ...], start: float) -> None:
        depth = len(prefix)
        inside = {stack: n for stack, n in stacks.items() if stack[:depth] == prefix}
        shares: dict[str, float] = {}
        for stack, count in inside.items():
            if len(stack) > depth:
                shares[stack[depth]] = shares.get(stack[depth], 0.0) + count / total
        for name, share in sorted(shares.items(), key=lambda one: -one[1]):
            if share >= _LEAST:
                axes.barh(
                    depth,
                    share,
                    0.92,
                    start,
                    color=f"C{(depth + len(name)) % 10}",
                    alpha=0.45,
                    ec="white",
                )
                shown = name if len(name) <= _ROOM * share else ""
                axes.text(start + 0.5 * share, depth, shown, ha="center", va="center", fontsize=6.5)
                bars((*prefix, name), start)
                start += share

    bars((), 0.0)
    axes.set(xlim=(0.0, 1.0), yticks=[], xlabel="share of the processor time of a run")
    axes.spines[["left", "right", "top"]].set_visible(False)
    figure.savefig(path, dpi=110)


#: A recording of one sample, for the smallest size.
_ONE_SAMPLE: Final = "rockframe step site pulse;pulse_stage (rockframe/stages/pulse.py:40) 1\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the flame graph of a recording."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("raw", type=Path, nargs=sized(None, "?"), help="recording of py-spy")
    parser.add_argument("picture", type=Path, nargs=sized(None, "?"), help="file to write")
    options = parser.parse_args(arguments)
    if options.picture:
        draw(read(options.raw), options.picture)
        return
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder, "recording.txt")
        raw.write_text(_ONE_SAMPLE, encoding="utf-8")
        draw(read(raw), Path(folder, "flame.png"))


if __name__ == "__main__":
    main()
