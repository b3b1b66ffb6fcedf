"""The contract of a kind of structure: what stages ask of it.

A structure is a frozen dataclass of numbers. What can be computed of it belongs to its kind, an
object with the attributes and methods of `StructureKind`; no base class is needed. Stages call the
functions of this module, which hand each structure to its kind, and never a class of structures.

The rules of a kind:

1. The dataclass has a ``name``, and names its kind in the class variable ``kind``. `KINDS` of
   `rockframe.study.kinds` lists each kind once: this object, and the table of its structures in
   files.
2. Results do not depend on which other structures and motions are computed with them, to the last
   bit. All lists of results are in the order of the structures; those over several motions have the
   motion first.
3. `why_not` says which motions the kind cannot compute, in a few words, as for a pair of horizontal
   components and a rectangular column. Stages then write the response as not computed; the other
   methods never receive such a motion.
4. `require_possible` raises a `ParameterError` for a structure that cannot be computed, or for an
   ensemble with an impossible member. It needs no motion, so that a plan finds the error at once.
5. `respond` returns a response to one motion, with its histories and all that the options ask for,
   except the ensemble. A motion that is not possible, such as ground that falls faster than
   gravity, is a `ParameterError`, and rejects the record.
6. A response is a frozen dataclass with the fields ``ensemble`` and ``margin``, which are None if
   they were not computed, and the attributes of `StructureResponse`. Its other attributes have the
   names of the variables of ``response.nc`` and of `rockframe.quantities`. What a structure does
   not have is left out: files have NaN in its place, tables a blank.
7. ``time`` is empty, and the histories with it, unless `Histories` keeps them.
8. Overturning or collapse is a result, `Verdict.OVERTURNS`; peaks then only describe the fall.
   After an event of ``ModelEnd`` the model is no longer valid: its time is an attribute.
9. `ensembles` draws the same members for all motions, from the seed and the spreads of the options
   alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.options import loaded
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.record import Part, Record
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Margin,
    SpreadVerdict,
    Verdict,
    Versions,
)
from rockframe.study.kinds import KINDS
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    from rockframe.wobbling import PairAcceleration

#: A motion in one direction, with or without its vertical component, or in both directions.
Motion: TypeAlias = "Record | Pulse | GroundAcceleration | PairAcceleration"


class Structure(Protocol):
    """A structure: a frozen dataclass with a name and a kind."""

    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """Name in tables."""


class StructureResponse(Protocol):
    """The response of a structure to one motion; its other attributes depend on the kind."""

    @property
    def structure(self) -> Structure:
        """The structure."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Time at the nodes of the histories [s]; empty if they are not kept."""

    @property
    def verdict(self) -> Verdict:
        """Nominal verdict."""

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict, from the ensemble if there is one."""

    @property
    def ensemble(self) -> EnsembleResponse | None:
        """Response of the ensemble."""

    @property
    def margin(self) -> Margin | None:
        """Margin against overturning or collapse."""


@dataclass(frozen=True, eq=False)
class Shaking:
    """A motion, and what is asked about the responses to it.

    Parameters
    ----------
    motion : Record, Pulse, GroundAcceleration or PairAcceleration
        The motion.
    options : RespondOptions
        Histories, margins, forces and ensemble.
    parts : tuple of Part
        Motions of a sequence; empty for other records.
    pulse : Pulse, optional
        The record's pulse: adds the response to it alone.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.
    """

    motion: Motion
    options: RespondOptions
    parts: tuple[Part, ...] = ()
    pulse: Pulse | None = None
    versions: Versions | None = None


class StructureKind(Protocol):
    """A kind of structure; the rules are in the docstring of this module."""

    @property
    def name(self) -> str:
        """Name of the kind in files, and value of ``kind`` in tables of structures."""

    def why_not(self, structure: Any, motion: Motion) -> str:
        """Return why the kind does not compute a structure under a motion; "" if it does."""

    def require_possible(self, structure: Any, ensemble: Ensemble | None) -> None:
        """Raise a `ParameterError` if the structure or a member of its ensemble is impossible."""

    def respond(self, structures: Sequence[Any], shaking: Shaking) -> Sequence[StructureResponse]:
        """Return the response of each structure to a motion, without its ensemble."""

    def ensembles(
        self,
        structures: Sequence[Any],
        motions: Sequence[Motion],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> Sequence[Sequence[EnsembleResponse]]:
        """Return the response of the ensemble of each structure to each motion."""


@dataclass(frozen=True, eq=False)
class NotComputed:
    """In place of a response that the kind of the structure does not compute.

    Parameters
    ----------
    structure : Structure
        The structure.
    reason : str
        What is not computed and why, in a few words.
    """

    structure: Structure
    reason: str
    time: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    ensemble: EnsembleResponse | None = None
    margin: Margin | None = None

    @property
    def verdict(self) -> Verdict:
        """Neither safe nor unsafe."""
        return Verdict.NOT_COMPUTED

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """A verdict that says that nothing was computed."""
        return SpreadVerdict(self.verdict)


@cache
def kind_named(name: str) -> StructureKind:
    """Return the kind of a name; its module is imported when it is first needed.

    Examples
    --------
    >>> kind_named("rocking").name
    'rocking'
    """
    kind: StructureKind = loaded(KINDS[name].contract)
    return kind


def kind_of(structure: Structure) -> StructureKind:
    """Return the kind of a structure.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> kind_of(RockingFrame(height=9.6, width=1.6)).name
    'rocking'
    """
    return kind_named(structure.kind)


def require_possible(structures: Sequence[Structure], ensemble: Ensemble | None) -> None:
    """Require structures, and members of an ensemble of each, that can be computed.

    Raises
    ------
    ParameterError
        If there is another one.
    """
    for structure in structures:
        kind_of(structure).require_possible(structure, ensemble)


def respond_each(structures: Sequence[Structure], shaking: Shaking) -> list[StructureResponse]:
    """Return the response of each structure to a motion, or that it is not computed.

    Raises
    ------
    ParameterError
        If the motion is not possible.

    Examples
    --------
    >>> from rockframe import RespondOptions, RockingFrame
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.5)
    >>> column = RockingFrame(height=3.0, width=0.3)
    >>> frames = [RockingFrame(height=9.6, width=1.6, mass_ratio=4.0), column]
    >>> shaking = Shaking(pulse, RespondOptions(margins="none"))
    >>> [response.verdict.label for response in respond_each(frames, shaking)]
    ['stands', 'overturns']
    """

    def respond(kind: StructureKind, some: Sequence[Structure]) -> Sequence[StructureResponse]:
        return kind.respond(some, shaking)

    def not_computed(structure: Structure, reason: str) -> StructureResponse:
        return NotComputed(structure, reason)

    return _by_kind(structures, shaking.motion, respond, not_computed)


def ensembles_of_each(
    structures: Sequence[Structure],
    motions: Sequence[Motion],
    ensemble: Ensemble,
    versions: Sequence[Versions | None],
) -> list[list[EnsembleResponse | None]]:
    """Return the response of the ensemble of each structure to each motion; None if not computed.

    Parameters
    ----------
    structures, motions : sequence
        The structures as stated, and the motions.
    ensemble : Ensemble
        Number of members, spreads and seed.
    versions : sequence of Versions or None
        For each motion its versions, one of which shakes each member.

    Raises
    ------
    ParameterError
        If a member or a motion is not possible.
    """
    found: list[list[EnsembleResponse | None]] = [[None] * len(structures) for _ in motions]
    for kind, places in _places_of_kinds(structures):
        some = [structures[place] for place in places]
        for those, which in _alike(kind, some, motions):
            answers = kind.ensembles(
                [some[k] for k in which],
                [motions[i] for i in those],
                ensemble,
                [versions[i] for i in those],
            )
            for i, row in zip(those, answers, strict=True):
                for k, answer in zip(which, row, strict=True):
                    found[i][places[k]] = answer
    return found


def _places_of_kinds(
    structures: Sequence[Structure],
) -> Iterator[tuple[StructureKind, list[int]]]:
    """Yield each kind with the places of its structures."""
    for name in dict.fromkeys(structure.kind for structure in structures):
        yield kind_named(name), [k for k, one in enumerate(structures) if one.kind == name]


def _by_kind(
    structures: Sequence[Structure],
    motion: Motion,
    compute: Callable[[StructureKind, Sequence[Structure]], Sequence[StructureResponse]],
    not_computed: Callable[[Structure, str], StructureResponse],
) -> list[StructureResponse]:
    """Return the results of structures in their order, computed together for each kind."""
    found: dict[int, StructureResponse] = {}
    for kind, places in _places_of_kinds(structures):
        reasons = {place: kind.why_not(structures[place], motion) for place in places}
        some = [place for place in places if not reasons[place]]
        for place in places:
            if reasons[place]:
                found[place] = not_computed(structures[place], reasons[place])
        if some:
            found |= zip(some, compute(kind, [structures[k] for k in some]), strict=True)
    return [found[place] for place in range(len(structures))]


def _alike(
    kind: StructureKind, structures: Sequence[Structure], motions: Sequence[Motion]
) -> Iterator[tuple[list[int], list[int]]]:
    """Yield places of motions, with the places of the structures that the kind computes under all
    of them.
    """
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, motion in enumerate(motions):
        which = tuple(k for k, one in enumerate(structures) if not kind.why_not(one, motion))
        groups.setdefault(which, []).append(i)
    for which, those in groups.items():
        if which:
            yield those, list(which)
