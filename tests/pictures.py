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
from matplotlib.image import imread

#: Largest root mean square difference of all pixels and colours, on a scale to 255.
TOLERANCE: Final = 1.0
_DRAWN_BY: Final = Path(__file__).parent / "figures" / "pictures" / "drawn-by.txt"
_HERE: Final = f"{platform.system()} {platform.machine()}, matplotlib {version('matplotlib')}\n"
_DRAW: Final = os.environ.get("ROCKFRAME_PICTURES") == "draw"


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
    wanted, found = (np.asarray(imread(path), dtype=np.float64) for path in (known, drawn))
    if found.shape != wanted.shape:
        return float("inf")
    return float(255.0 * np.sqrt(np.mean((found - wanted) ** 2)))
