"""Pictures compared with reviewed ones, on the platform on which these were drawn.

Fonts and rasterisers differ on other platforms. After an intended change, draw the pictures again
with ROCKFRAME_PICTURES=draw and review each of them.
"""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

#: Largest root mean square difference of all pixels and colours, on a scale to 255.
TOLERANCE: Final = 1.0
_DRAWN_BY: Final = Path(__file__).parent / "figures" / "pictures" / "drawn-by.txt"
_HERE: Final = f"{platform.system()} {platform.machine()}, matplotlib {version('matplotlib')}\n"
_DRAW: Final = os.environ.get("ROCKFRAME_PICTURES") == "draw"
#: Largest width [pixels] and number of colours of a picture in the documentation, and the number of
#: the most frequent colours among these.
_PAGE_WIDTH: Final = 800
_PAGE_COLOURS: Final = 256
_FREQUENT: Final = 64


def comparable() -> bool:
    """Return True if pictures that are drawn here can be compared with the reviewed ones."""
    return _DRAW or _DRAWN_BY.read_text(encoding="utf-8") == _HERE


def difference(known: Path, drawn: Path) -> float:
    """Return the root mean square difference of two pictures, infinite if their sizes differ.

    With ROCKFRAME_PICTURES=draw, the drawn picture first replaces the known one.
    """
    if _DRAW:
        known.write_bytes(drawn.read_bytes())
        _DRAWN_BY.write_text(_HERE, encoding="utf-8")
    wanted, found = pixels_of(known), pixels_of(drawn)
    if found.shape != wanted.shape:
        return float("inf")
    return float(np.sqrt(np.mean(np.square(found - wanted))))


def pixels_of(path: Path) -> NDArray[np.int32]:
    """Return the colours of all pixels, on a scale to 255."""
    with Image.open(path) as picture:
        colours = picture.convert("RGBA") if picture.mode == "P" else picture
        return np.asarray(colours, dtype=np.int32)


def for_page(drawn: Path, page: Path) -> Path:
    """Write a picture for the documentation: not wider than a page, with the colours that it needs.

    A palette of the most frequent colours would merge those of thin lines. Beside some of these, it
    has the colours that are furthest from all others, so that no pixel changes visibly.
    """
    with Image.open(drawn) as picture:
        whole = picture.convert("RGB")
    width = min(_PAGE_WIDTH, whole.width)
    small = whole.resize(
        (width, round(whole.height * width / whole.width)), Image.Resampling.LANCZOS
    )
    parts = np.asarray(small, dtype=np.int32).reshape(-1, 3)
    whole_colours = parts @ (65536, 256, 1)
    _, first, place, count = np.unique(
        whole_colours, return_index=True, return_inverse=True, return_counts=True
    )
    colours = parts[first]
    palette = [*np.argsort(-count, kind="stable")[:_FREQUENT]]
    nearest = np.argmin(distance := _distances(colours, colours[palette]), axis=1)
    apart = distance.min(axis=1)
    while len(palette) < min(_PAGE_COLOURS, len(colours)):
        palette.append(furthest := np.argmax(apart))
        beside = _distances(colours, colours[[furthest]])[:, 0]
        nearest[beside < apart] = len(palette) - 1
        apart = np.minimum(apart, beside)
    few = Image.fromarray(nearest[place].reshape(small.height, width).astype(np.uint8))
    few.putpalette(colours[palette].astype(np.uint8).tobytes())
    few.save(page, optimize=True)
    return page


def _distances(some: NDArray[np.int32], others: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the largest difference of the parts of each pair of colours."""
    found: NDArray[np.int32] = np.abs(some[:, None, :] - others[None, :, :]).max(axis=2)
    return found
