"""The figures that have names: what each shows, and the function that draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rockframe.figures.captioned import Captioned
    from rockframe.stages.named_figures.shown import FigureRequest


@dataclass(frozen=True)
class Drawing:
    """A figure: its summary, the function that draws it, and what this function takes.

    Parameters
    ----------
    summary : str
        The figure in a few words, for the help.
    place : str
        Module in `rockframe.figures`, and function.
    shows : str
        Function of `rockframe.stages.named_figures.shown` that returns its positional arguments.
    options : tuple of str
        Fields of `FigureRequest` that it takes as keywords.
    """

    summary: str
    place: str
    shows: str = "nothing"
    options: tuple[str, ...] = ()

    def takes(self, option: str) -> bool:
        """Return True if an option of the command changes the figure."""
        if option in OF_REQUEST:
            return option in (*self.options, *_TAKEN[self.shows])
        if option == "structures":
            return "structure" in _TAKEN[self.shows]
        return option == "records" and self.shows != "nothing"

    def draw(self, request: FigureRequest) -> tuple[Captioned, int]:
        """Return the figure and the exit status."""
        from rockframe.stages.named_figures import shown

        module, _, function = self.place.partition(".")
        draw = getattr(import_module(f"rockframe.figures.{module}"), function)
        values, status = getattr(shown, self.shows)(request)
        return draw(*values, **{name: getattr(request, name) for name in self.options}), status


_OF_JOINTS: Final = ("friction", "spacing", "beam_centre")
#: Options of the command that are fields of `FigureRequest`.
OF_REQUEST: Final = ("record", "structure", "vertical", "grid", *_OF_JOINTS)
_SHAKEN: Final = ("record", "structure", "vertical")
#: The fields that the functions of `rockframe.stages.named_figures.shown` read.
_TAKEN: Final[Mapping[str, tuple[str, ...]]] = {
    "nothing": (),
    **dict.fromkeys(("one_record", "one_of_any", "one_or_both", "records", "responses"), _SHAKEN),
    "unequal": ("record", "structure", "spacing"),
    **dict.fromkeys(("best_matched", "pulses", "one_recorded"), ("record",)),
}
#: All figures, by name on the command line, in the order of the help.
FIGURES: Final[Mapping[str, Drawing]] = {
    "5": Drawing("size of the equivalent column", "parameters.draw_equivalent_size"),
    "7": Drawing("largest restitution", "parameters.draw_restitution"),
    "8": Drawing("records and the pulses in them", "pulses.draw_record_and_pulse", "pulses"),
    "9": Drawing(
        "minimum overturning acceleration spectra", "spectra.draw_figure_9", options=("grid",)
    ),
    "11": Drawing(
        "histories under records", "histories.draw_response_grid", "responses", ("vertical",)
    ),
    "animation": Drawing(
        "the structure as it rocks or wobbles", "rolling.draw_either", "one_or_both"
    ),
    "record": Drawing(
        "a record: motion, build-up, response spectrum", "recorded.draw_record", "one_recorded"
    ),
    "moment-rotation": Drawing(
        "restoring moment and the part reached", "joints.draw_moment_rotation", "one_record"
    ),
    "phase-portrait": Drawing(
        "rate over rotation, impacts, barrier", "joints.draw_phase_portrait", "one_record"
    ),
    "scalogram": Drawing("wavelet transform of a record", "pulses.draw_scalogram", "best_matched"),
    "match-index": Drawing(
        "match index against period", "pulses.draw_match_curves", "best_matched"
    ),
    "joints": Drawing(
        "friction demand and vertical forces", "joints.draw_any_joints", "one_of_any", _OF_JOINTS
    ),
    "rocking-spectrum": Drawing(
        "peak rotation and rate over 2 pi / p", "spectra.draw_record_spectrum", "one_record"
    ),
    "drift-by-size": Drawing(
        "median drift over the height of columns", "spectra.draw_drift_by_size", "records"
    ),
    "unequal-columns": Drawing(
        "peak and share over the ratio of two heights",
        "parameters.draw_unequal_columns",
        "unequal",
    ),
    "stability-map": Drawing(
        "verdict over size and scale", "margins.draw_stability_map", "one_record", ("grid",)
    ),
}
