"""Batches, progress and record selection shared by several stages."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rockframe.errors import ParameterError, RockframeWarning, require_known
from rockframe.options.ingest import Filters
from rockframe.options.respond import Ensemble
from rockframe.results.records import RecordsFile
from rockframe.results.schema.arrays import Arrays
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.figures.captioned import Captioned
    from rockframe.frame import RockingFrame
    from rockframe.results.schema.arrays import Dataset
    from rockframe.structures.contract import Structure
    from rockframe.study.structures import StructureTable

Task = TypeVar("Task")
Item = TypeVar("Item")
Answer = TypeVar("Answer")

#: Callback that takes the number of items done and the total.
Progress = Callable[[int, int], None]
#: Callbacks that take the content of the written file, without its series.
Written = Callable[["xr.Dataset"], None]
WrittenArrays = Callable[[Arrays], None]
#: Name of a figure (without suffix), its description, and the figure.
NamedFigure = tuple[str, str, "Captioned"]


@dataclass(frozen=True)
class Batch:
    """One of several batches of the records; a stage can compute a single batch.

    Parameters
    ----------
    number, count : int
        Number of the batch, from 1, and number of batches.

    Raises
    ------
    ParameterError
        If there is no such batch.

    Examples
    --------
    >>> Batch(2, 3).of(["a", "b", "c", "d"])
    ['b']
    """

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise ParameterError(
                f"Invalid batch {self.number}/{self.count}. Must be from 1/{max(self.count, 1)} on."
            )

    def of(self, names: Sequence[Item]) -> list[Item]:
        """Return the names in this batch; empty if there are more batches than names."""
        start, stop = (len(names) * k // self.count for k in (self.number - 1, self.number))
        return list(names[start:stop])

    @property
    def stated(self) -> str:
        """The batch as on the command line; empty for all records."""
        return "" if self.whole else f"{self.number}/{self.count}"

    @property
    def whole(self) -> bool:
        """True if this is the only batch."""
        return self.count == 1


#: All records at once.
WHOLE = Batch()


@dataclass(frozen=True)
class Counted(Generic[Task]):
    """Tasks created on demand, with an estimate of their number.

    Parameters
    ----------
    tasks : iterable
        The tasks.
    number : int
        Upper bound of the number of tasks: tasks of rejected records are counted too.

    Examples
    --------
    >>> tasks = Counted(iter("ab"), 3)
    >>> len(tasks), list(tasks)
    (3, ['a', 'b'])
    """

    tasks: Iterable[Task]
    number: int

    def __iter__(self) -> Iterator[Task]:
        return iter(self.tasks)

    def __len__(self) -> int:
        return self.number


def accepted(
    answers: Iterable[tuple[str, Answer | None, str]],
    names: Sequence[str],
    batch: Batch,
    left_out: dict[str, str],
    progress: Progress,
) -> Iterator[tuple[str, Answer]]:
    """Yield the answers by record; note the reasons for records without an answer.

    Raises
    ------
    ParameterError
        If no record of all records has an answer; the message states the first reason.
    """
    done = 0
    for name, answer, reason in answers:
        if answer is None:
            left_out[name] = reason
        else:
            yield name, answer
            done += 1
        progress(done + len(left_out), len(names))
    if not done and batch.whole:
        name = next(name for name in names if name in left_out)
        raise ParameterError(f"record {name!r}: {left_out[name]}")


def silent(_done: int, _total: int) -> None:
    """Ignore progress."""


def unseen(_content: Dataset) -> None:
    """Ignore what was written."""


def horizontal(records: RecordsFile) -> list[str]:
    """Return the identifiers of the records that are not vertical.

    Raises
    ------
    ParameterError
        If all records are vertical.
    """
    named = zip(records.names, records.orientations, strict=True)
    chosen = [name for name, orientation in named if not orientation.upright]
    if not chosen:
        raise ParameterError(
            f"{records.path}: all {len(records.names)} records are vertical. "
            "At least one must be horizontal."
        )
    return chosen


def filtered_by(filters: Filters, numbers: Mapping[str, float], site: str) -> str:
    """Return the reason why a record is filtered out, or "".

    Parameters
    ----------
    filters : Filters
        The filters.
    numbers : mapping of str to float
        `rockframe.results.pulses.NUMBERS` of the record, in SI units.
    site : str
        Site of its sensor.
    """
    return filters.refusal(
        site=site,
        magnitude=numbers["magnitude"],
        epicentral_distance_km=numbers["epicentral_distance"],
        distance_rrup_km=numbers["distance_rrup"],
        distance_rjb_km=numbers["distance_rjb"],
        distance_hypocentral_km=numbers["distance_hypocentral"],
        vs30_m_s=numbers["vs30"],
        pga_g=numbers["pga"] / GRAVITY,
        pgv_m_s=numbers["pgv"],
    )


def filtered_by_pulse(wanted: bool | None, known: bool | None) -> str:
    """Return the reason why a record is filtered out by the test of its pulse, or "".

    Examples
    --------
    >>> filtered_by_pulse(True, None)
    'pulse_like unknown. Must be yes'
    """
    if wanted is None or known is wanted:
        return ""
    words = "unknown" if known is None else "yes" if known else "no"
    return f"pulse_like {words}. Must be {'yes' if wanted else 'no'}"


def choose_structures(path: Path, name: str | None) -> list[Any]:
    """Return the structures of a file, or only the one with this name.

    Raises
    ------
    InputError
        If the file cannot be read.
    ParameterError
        If there is no structure of that name.

    Examples
    --------
    >>> from rockframe.study.structures import SHIPPED_STRUCTURES
    >>> [one.name for one in choose_structures(SHIPPED_STRUCTURES, "apollo-frame")]
    ['apollo-frame']
    """
    from rockframe.study.structures import read_structures  # stages without structures need none

    return _named(read_structures(path), name)


def made_structures(entries: Iterable[StructureTable], name: str | None) -> tuple[Structure, ...]:
    """Return the structures of a study, or only the one with this name."""
    return tuple(_named([entry.made() for entry in entries], name))


def _named(structures: list[Structure], name: str | None) -> list[Structure]:
    if name is None:
        return structures
    require_known("structure", name, [structure.name for structure in structures])
    return [structure for structure in structures if structure.name == name]


def only_frames(structures: Iterable[Structure], what: str) -> list[RockingFrame]:
    """Return structures that have to be rocking structures.

    Raises
    ------
    ParameterError
        If one is of another kind; the message names it and `what` needs frames.
    """
    from rockframe.frame import RockingFrame

    frames = []
    for structure in structures:
        if not isinstance(structure, RockingFrame):
            raise ParameterError(
                f"Invalid kind {structure.kind} of structure {structure.name!r} for {what}. "
                "Must be rocking: choose another structure."
            )
        frames.append(structure)
    return frames


def warn_of_idle_contact(ensemble: Ensemble, pairs: bool) -> None:
    """Warn of a stated shortening of the contact if no motion in both directions is computed."""
    default = Ensemble.model_fields["contact_shortening"].default
    if ensemble.contact_shortening != default and not pairs:
        words = "contact_shortening of the ensemble has no effect: no structure has round columns, "
        words += "or no motion both horizontal components."
        warnings.warn(words, RockframeWarning, stacklevel=3)


def in_one_plane_alone(structures: Sequence[Structure], wanted: bool) -> dict[str, list[str]]:
    """Return the parameter of a file that names the structures that could be computed in both
    directions, if that is wanted and no motion is; else nothing.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular", name="column")
    >>> in_one_plane_alone([column], wanted=True), in_one_plane_alone([column], wanted=False)
    ({'in_one_plane': ['column']}, {})
    """
    from rockframe.structures.contract import why_not_both

    if not wanted:
        return {}
    names = [structure.name for structure in structures if not why_not_both(structure)]
    return {"in_one_plane": names} if names else {}
