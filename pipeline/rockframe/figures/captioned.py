"""Figures with captions: common sentences of captions, and saving of figure and caption."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rockframe.cells import plain
from rockframe.errors import InputError
from rockframe.frame import RockingFrame
from rockframe.provenance import whole_file
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration, Response
from rockframe.signals.processing import peak
from rockframe.unequal import BentResponse, UnequalBent
from rockframe.units import GRAVITY

#: Metadata to omit; without dates and versions, the same figure has the same bytes.
_METADATA: Final[dict[str, dict[str, None]]] = {
    ".png": {"Software": None},
    ".pdf": {"Creator": None, "Producer": None, "CreationDate": None, "ModDate": None},
    ".svg": {"Creator": None, "Date": None},
}
_CAPTION_KEY: Final = {".png": "Description", ".pdf": "Subject", ".svg": "Description"}
#: Resolution of PNG figures in print [dots per inch].
_PRINT: Final = 300
#: Resolution of all other figures [dots per inch].
_SCREEN: Final = 150


@dataclass(frozen=True, eq=False)
class Captioned:
    """A figure and its caption.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure.
    title : str
        Title, in a few words.
    caption : str
        Sentences that describe the content, the data and the parameters.
    """

    figure: Figure
    title: str
    caption: str


def save_captioned(drawn: Captioned, path: Path) -> Path:
    """Write a figure with its caption in the metadata, and the caption as a text file beside it.

    Parameters
    ----------
    drawn : Captioned
        Figure and caption.
    path : Path
        File that ends in .png, .pdf or .svg. The same figure gives the same bytes.

    Returns
    -------
    Path
        The file of the caption: ``figure.caption.txt`` for ``figure.png``.

    Raises
    ------
    InputError
        If the path has another extension, or cannot be written.
    """
    kind = path.suffix.lower()
    require_format(path)
    title, caption = plain(drawn.title), plain(drawn.caption)
    metadata = {**_METADATA[kind], "Title": title, _CAPTION_KEY[kind]: caption}
    arranged = _arranged(drawn.figure, _PRINT) if kind == ".png" else nullcontext()
    with styled(), arranged, whole_file(path) as partial:
        drawn.figure.savefig(partial, format=kind[1:], dpi=_PRINT, metadata=metadata)
    beside = caption_path(path)
    with whole_file(beside) as partial:
        partial.write_text(f"{title}. {caption}\n", encoding="utf-8")
    return beside


def caption_path(figure: Path) -> Path:
    """Return the file of the caption beside a figure.

    Examples
    --------
    >>> caption_path(Path("figure.png")).name
    'figure.caption.txt'
    """
    return figure.with_suffix(".caption.txt")


def require_format(path: Path) -> None:
    """Raise an error unless figures can be written in the format of a path.

    Raises
    ------
    InputError
        If the path does not end in .png, .pdf or .svg.

    Examples
    --------
    >>> require_format(Path("figure.bmp"))
    Traceback (most recent call last):
    rockframe.errors.InputError: figure.bmp: ends in '.bmp'. Must end in .png, .pdf or .svg.
    """
    if path.suffix.lower() not in _METADATA:
        raise InputError(path, f"ends in {path.suffix!r}. Must end in .png, .pdf or .svg.")


#: Largest number of lines of a label, and of characters in one of them.
_LINES_OF_LABEL: Final = 3
_LONGEST_LABEL: Final = 100


def label_of(text: str) -> str:
    r"""Return a text from outside as a label: `plain`, not too long, and with dollar signs as such.

    Matplotlib would read a text between two dollar signs as a formula.

    Examples
    --------
    >>> label_of("$5 and\x07 $6"), len(label_of(1000 * "a"))
    ('\\$5 and� \\$6', 100)
    """
    lines = [
        line if len(line) <= _LONGEST_LABEL else f"{line[: _LONGEST_LABEL - 1]}…"
        for line in plain(text).splitlines()[:_LINES_OF_LABEL]
    ]
    return "\n".join(lines).replace("$", r"\$")


def of_structure(frame: RockingFrame | UnequalBent) -> str:
    """Return the sentence of a caption about the structure."""
    if isinstance(frame, UnequalBent):
        (left, right), widths = frame.heights, frame.widths
        uplift, kept = frame.uplift_accelerations, frame.restitutions
        return (
            f"Structure {frame.name}: columns {left:g} and {right:g} m tall, {widths[0]:g} and "
            f"{widths[1]:g} m wide, {frame.spacing:g} m apart, mass ratio γ = "
            f"{frame.mass_ratio:g}, uplift to the right and to the left at {uplift[0]:.3f} and "
            f"{uplift[1]:.3f} g, √r = {kept[0]:.3f} and {kept[1]:.3f}; α is "
            "the rotation of the left column at balance."
        )
    return (
        f"Structure {frame.name}: columns {frame.height:g} m tall, {frame.width:g} m wide, "
        f"mass ratio γ = {frame.mass_ratio:g}, slenderness α = {frame.slenderness:.4f} rad, "
        f"p̂ = {frame.effective_frequency_parameter:.3f} rad/s, √r = {frame.restitution:.3f}."
    )


def wavelet_words(names: str) -> str:
    """Return the names of wavelets as captions print them."""
    return names.replace("_", " ").replace("ricker", "Ricker")


def of_record(record: Record, response: Response | BentResponse, ground: GroundAcceleration) -> str:
    """Return the sentence of a caption about the record and the response of the structure."""
    end, impacts = response.overturning_time, f"{response.impacts} impacts, "
    # The time is NaN without overturning. After overturning, the peak only describes the fall.
    peak_ratio = response.peak_rotation_ratio
    fate = f"largest θ/α {peak_ratio:.3f}, {impacts}{response.spread_verdict.words}"
    if math.isfinite(end):
        fate = f"{impacts}it overturns at {end:.2f} s"
    motion = of_motion(record, ground)
    return f"{motion[:1].upper()}{motion[1:]}: {fate}."


def of_motion(record: Record, ground: GroundAcceleration) -> str:
    """Return the words of a caption about a record, and its vertical motion."""
    upwards = "without" if ground.vertical is None else "with"
    return f"record {record.record_id}, {upwards} its vertical motion ({printed_pga(record)})"


def printed_pga(record: Record) -> str:
    """Return the peak ground acceleration as captions print it."""
    return f"PGA {peak(record.acceleration) / GRAVITY:.2f} g"


#: Widths of a printed column and of a page [inch]: 85 mm and 178 mm.
PRINT_WIDTH: Final = 3.35
PAGE_WIDTH: Final = 7.0
#: Line styles: curves must also differ when printed in grey.
LINES: Final = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))

#: Rotations are drawn up to this multiple of the slenderness [1]; a complete fall would flatten the
#: other histories.
DRAWN_TO: Final = 1.3

_TICKS: Final = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
_STYLE: Final = Path(__file__).parent / "style.mplstyle"


@contextmanager
def styled() -> Iterator[None]:
    """Apply the style while a figure is drawn or saved."""
    with mpl.rc_context(fname=_STYLE), warnings.catch_warnings():
        # Letters missing in the font are drawn as boxes; the caption file contains them.
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)
        yield


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, completely or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with styled(), _arranged(figure, _SCREEN), whole_file(path) as partial:
        figure.savefig(partial, format="png", dpi=_SCREEN, metadata={"Software": None})


@contextmanager
def _arranged(figure: Figure, dpi: int) -> Iterator[None]:
    """Compute the layout of a figure for this resolution, and keep it within the block.

    Matplotlib draws a figure that has a layout engine twice, once to find the layout.
    """
    engine, before = figure.get_layout_engine(), figure.dpi
    if engine is None:
        yield
        return
    figure.dpi = dpi
    engine.execute(figure)
    figure.dpi = before
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


def time_limits(
    time: NDArray[np.float64], seen: NDArray[np.bool_], margin: float
) -> tuple[float, float]:
    """Return the ends of a time axis [s], with a margin around the part that is shown.

    The axis is that of the whole record if `seen` is never true.
    """
    shown = np.flatnonzero(seen)
    if not shown.size:
        return float(time[0]), float(time[-1])
    first, last = time[shown[0]] - margin, time[shown[-1]] + margin
    return max(float(time[0]), first), min(float(time[-1]), last)


def plain_ticks(axis: Axis, low: float, high: float) -> None:
    """Set ticks with plain numbers on a logarithmic axis."""
    ticks = [tick for tick in _TICKS if low <= 1.001 * tick and tick <= 1.001 * high]
    axis.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axis.minorticks_off()
