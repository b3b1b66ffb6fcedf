"""The motions of a screening in the files of its batches."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from rockframe.interruption import raise_if_interrupted
from rockframe.results.schema import SCREEN
from rockframe.results.schema.arrays import Arrays
from rockframe.results.schema.response import SCREEN_NC
from rockframe.results.screen import Scenario, is_of_batch
from rockframe.results.stored import Stored, opened_one

#: Variables of a batch that choose the scenarios whose histories are kept.
_OF_OUTCOMES: Final = ("verdict", "peak_rotation_ratio")
#: Number of numbers of a variable that are in memory together.
_TOGETHER: Final = 2**19


class ScreenedBatches:
    """The motions in the files of batches, which are read once.

    Parameters
    ----------
    paths : sequence of Path
        The files, in order.

    Raises
    ------
    InputError
        If a file is missing, corrupted, or of another kind.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths
        self._facts: list[dict[str, NDArray[Any]]] = []
        self.filtered: list[str] = []

    def rows(self) -> Iterator[Scenario]:
        """Yield the outcomes of each motion by variable, without their first dimension."""
        for path in self._paths:
            raise_if_interrupted()
            with opened_one(path, SCREEN, empty=True) as (attrs, stored):
                self.filtered += json.loads(attrs["filtered"])
                if not stored:
                    continue
                outcomes = {
                    variable.declared.name: variable
                    for variable in stored
                    if variable.declared.name in _OF_OUTCOMES or is_of_batch(variable.declared)
                }
                self._facts.append(
                    {
                        variable.declared.name: variable.values
                        for variable in stored
                        if "structure" not in variable.dims
                    }
                )
                yield from _motion_by_motion(outcomes)

    @property
    def facts(self) -> Arrays:
        """The variables without structures of all motions, after `rows`."""
        joined = SCREEN_NC.joined(self._facts)
        return Arrays(
            {name: SCREEN_NC[name].holding(values) for name, values in joined.items()}, {}
        )


def _motion_by_motion(variables: Mapping[str, Stored]) -> Iterator[Scenario]:
    """Yield the values of each motion; those of some motions are in memory."""
    shapes = [variable.shape for variable in variables.values()]
    together = max(1, _TOGETHER // max(math.prod(shape[1:]) for shape in shapes))
    for start in range(0, shapes[0][0], together):
        some = slice(start, start + together)
        parts = {
            name: variable.read((some, *(slice(None),) * (len(variable.shape) - 1)))
            for name, variable in variables.items()
        }
        for k in range(len(next(iter(parts.values())))):
            yield {name: values[k] for name, values in parts.items()}
