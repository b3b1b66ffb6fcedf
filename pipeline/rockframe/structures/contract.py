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
   ensemble with an impossible member. It needs no motion, so that a plan finds the error at once;
   `most_critical` says which of many structures are worth the time.
5. `respond` returns a response to one motion, with its histories and all that the options ask for,
   except the ensemble. A motion that is not possible, such as ground that falls faster than
   gravity, is a `ParameterError`, and rejects the record.
6. A response is a frozen dataclass with the fields ``ensemble`` and ``margin``, which are None if
   they were not computed, and the attributes of `StructureResponse`. Its other attributes have the
   names of the variables of ``response.nc`` and of `rockframe.quantities`. What a structure does
   not have is left out: files have NaN in its place, tables a blank.
7. `quantities` names those of them that only some kinds have, such as the ductility. `parameters`
   are the properties of a structure, with their units, that files and pages state; those of rocking
   frames have variables of their own. A quantity of rocking frames that needs a history must also
   be computed by their kernel of many lanes (`nominal`): without histories only that one answers.
8. ``time`` is empty, and the histories with it, unless `Histories` keeps them.
9. Overturning or collapse is a result, `Verdict.OVERTURNS`; peaks then only describe the fall.
   After an event of ``ModelEnd`` the model is no longer valid: its time is an attribute.
10. `compared` is for bridges only: a response in the quantities of `Compared`, for the
    compare stage.
11. `members` are plausible structures of the same kind, drawn from the seed and the spreads of the
    ensemble alone; `ensembles` are their responses. Names of spreads are options of the ensemble.
12. `peaks` and `member_peaks` are for many scenarios, without histories: two numbers of each
    (`PEAKS`; a third one changes all kinds), from which `quantities_of` computes the quantities
    that the kind has, for structures and members alike. They agree with the responses of `history`.
    All motions of a call are in one plane, or all in both directions.
13. `resized` keeps the proportions that the dimension leaves free, and raises a `ParameterError` if
    the structure has no such dimension.
14. A kind may have the method ``nominal(structures, motions, pulses)``: nominal responses to many
    motions at once, as `NominalResponses` has them, or None. They agree with those of `respond`.
15. `sliders` are the values that the explorer lets people change, and from which its page draws the
    structure; empty for structures that it cannot show. A kind that has some also has their names,
    ``slider_names``, and the method ``of_sliders(values)``, which returns the structure of the
    values that the page states.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.record import Part, Record
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Margin,
    NominalResponses,
    SpreadVerdict,
    Verdict,
    Versions,
)
from rockframe.rocking.response import require_some
from rockframe.rocking.verdict import ModelEnd
from rockframe.study.kinds import KINDS
from rockframe.study.kinds import Structure as Structure
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    from rockframe.wobbling import PairAcceleration

#: Results of a scenario, from which all quantities follow; see `StructureKind.peaks`.
PEAKS: Final = ("verdict", "peak", "speed")
#: A motion in one direction, with or without its vertical component, or in both directions.
Motion: TypeAlias = "Record | Pulse | GroundAcceleration | PairAcceleration"


def in_one_plane(motion: Motion) -> bool:
    """Return True if a motion has one horizontal direction."""
    return isinstance(motion, Record | Pulse | GroundAcceleration)


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


@dataclass(frozen=True, eq=False)
class Compared:
    """The response of one model of a bridge, in the quantities that all kinds of bridges have.

    Parameters
    ----------
    model : str
        Name of the model: free, restrained, hybrid, isolated or fixed.
    time, u, v : array, shape (nodes,)
        Time [s], drift and lift of the deck [m]; NaN after overturning or collapse.
    base_shear : array, shape (nodes,)
        Force of the ground to the right, including that of tendons, over the weight of deck and
        columns [1].
    peak_u, peak_v, residual_u : float
        Largest drift, largest lift, and residual drift [m]; infinite if the frame overturns or
        collapses.
    peak_base_shear : float
        Largest base shear at the nodes [1], until the validity ends; without the impulses of
        impacts, which are instantaneous in the model.
    peak_rotation_ratio, ductility : float
        Largest |theta| / alpha of rocking frames; largest drift over yield drift of others [1].
    peak_tendon_force : float
        Largest force of a tendon [N]; NaN without tendons.
    friction_demand : float
        Coefficient of friction that base and top joints of a rocking frame need, also during
        impacts [1].
    model_end : ModelEnd
        Event that first ends the model; overturning is one.
    valid_until : float
        Time of this event [s]. NaN if there is none, or if it occurs after the end of the motion or
        between two nodes.
    gap_closed_time, closing_velocity : float
        Time [s] and velocity [m s-1] at which the deck first closes the gap of an abutment; NaN if
        never.
    ensemble : EnsembleResponse, optional
        Response of the ensemble of the model, if one was requested.
    """

    model: str
    time: NDArray[np.float64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    base_shear: NDArray[np.float64]
    peak_u: float
    peak_v: float
    residual_u: float
    peak_base_shear: float
    model_end: ModelEnd
    valid_until: float
    gap_closed_time: float
    closing_velocity: float
    peak_rotation_ratio: float = math.nan
    ductility: float = math.nan
    peak_tendon_force: float = math.nan
    friction_demand: float = math.nan
    ensemble: EnsembleResponse | None = None


@dataclass(frozen=True)
class Parameter:
    """A property of a structure that files and pages state.

    Parameters
    ----------
    name, label : str
        Name and description.
    value : float
        Value.
    units : str
        Unit as CF writes it; ``1`` for a ratio.
    """

    name: str
    label: str
    value: float
    units: str = "1"


class StructureKind(Protocol):
    """A kind of structure; the rules are in the docstring of this module."""

    @property
    def name(self) -> str:
        """Name of the kind in files, and value of ``kind`` in tables of structures."""

    @property
    def quantities(self) -> Sequence[str]:
        """Variables of ``response.nc`` that its responses have beyond those that all files have."""

    def parameters(self, structure: Any) -> Sequence[Parameter]:
        """Return the properties of a structure that are no variables of ``response.nc``."""

    def why_not(self, structure: Any, motion: Motion) -> str:
        """Return why the kind does not compute a structure under a motion; "" if it does."""

    def require_possible(self, structure: Any, ensemble: Ensemble | None) -> None:
        """Raise a `ParameterError` if the structure or a member of its ensemble is impossible."""

    def members(self, structure: Any, ensemble: Ensemble) -> Sequence[Structure]:
        """Return each member of the ensemble of a structure."""

    def most_critical(self, structures: Sequence[Any], count: int) -> Sequence[Structure]:
        """Return about `count` structures: of all, their members are the first to be impossible."""

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

    def history(self, structure: Any, motion: Motion) -> StructureResponse:
        """Return the bare response to a motion, with its histories."""

    def peaks(
        self,
        structures: Sequence[Any],
        motions: Sequence[Motion],
        scales: Sequence[float],
    ) -> dict[str, NDArray[Any]]:
        """Return ``verdict``, ``peak`` and ``speed``, shape (motions, structures, scales).

        They are the two numbers from which `quantities_of` computes all quantities: the largest
        rotation or displacement, and the speed of impacts or NaN.
        """

    def member_peaks(
        self,
        structures: Sequence[Any],
        motions: Sequence[Motion],
        scales: Sequence[float],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> dict[str, NDArray[Any]]:
        """Return the same of each member, shape (motions, structures, scales, members)."""

    def quantities_of(
        self,
        structures: Sequence[Any],
        peak: NDArray[np.float64],
        speed: NDArray[np.float64],
    ) -> dict[str, NDArray[Any]]:
        """Return the quantities of scenarios by name, shape (structures, scales)."""

    def has(self, structure: Any, quantity: str) -> bool:
        """Return True if limits of a quantity apply to a structure."""

    def margins(
        self,
        structures: Sequence[Any],
        motions: Sequence[Motion],
        ensemble: Ensemble | None,
    ) -> Sequence[Sequence[Margin]]:
        """Return the margin of each structure under each motion."""

    def resized(self, structure: Any, dimension: str, value: float) -> Structure:
        """Return a structure with another value of a dimension of `Design`."""

    def sliders(self, structure: Any) -> Mapping[str, float | str]:
        """Return the values of a structure that the explorer varies; empty if it shows none."""

    def compared(self, structure: Any, motion: Motion) -> Compared:
        """Return the response of a bridge in the quantities that all bridges have."""


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
    kind: StructureKind = resolve_name(KINDS[name].contract)
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


def require_structures(structures: Sequence[Structure]) -> None:
    """Raise an error if a sequence of structures is none, empty, or of anything else.

    Examples
    --------
    >>> require_structures([])
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid number of structures, 0. Must be one or more.
    """
    require_some(structures=structures)
    for structure in structures:
        if getattr(structure, "kind", None) not in KINDS:
            raise ParameterError(
                f"Invalid structure of type {type(structure).__name__}. Must be a RockingFrame, "
                "IsolatedDeck, FixedFrame or another kind of structure."
            )


def most_critical(structures: Sequence[Structure], count: int) -> list[Structure]:
    """Return the structures of each kind whose members are impossible before those of others.

    Parameters
    ----------
    structures : sequence of Structure
        The structures.
    count : int
        Number that is enough.
    """
    return [
        structure
        for kind, places in places_of_kinds(structures)
        for structure in kind.most_critical([structures[place] for place in places], count)
    ]


def require_possible(structures: Sequence[Structure], ensemble: Ensemble | None) -> None:
    """Raise an error if a structure, or a member of its ensemble, cannot be computed.

    Raises
    ------
    ParameterError
        For the first that cannot be computed.
    """
    for structure in structures:
        kind_of(structure).require_possible(structure, ensemble)


def computed_in_both_directions(structures: Sequence[Structure]) -> bool:
    """Return whether a structure is computed for both horizontal directions of a motion.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> computed_in_both_directions([RockingFrame(height=9.6, width=1.6)])
    False
    """
    return not all(map(why_not_both, structures))


def why_not_both(structure: Structure) -> str:
    """Return why a structure is not computed for both directions of a motion; "" if it is.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> why_not_both(RockingFrame(height=9.6, width=1.6))
    'not computed for both directions: columns not circular'
    """
    from rockframe.wobbling import PairAcceleration  # not needed for motions in one plane

    still = PairAcceleration(np.zeros(2), np.zeros(2), 1.0)
    return kind_of(structure).why_not(structure, still)


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


def nominal_of_each(
    structures: Sequence[Structure], motions: Sequence[Motion], pulses: Sequence[Pulse | None]
) -> Sequence[NominalResponses] | None:
    """Return the nominal responses to each motion as arrays, without histories.

    None if the structures are of several kinds, or their kind does not compute them so.

    Parameters
    ----------
    structures, motions : sequence
        The structures, and motions in one plane.
    pulses : sequence of Pulse or None
        The pulse of each motion, to which the responses are added; None for none.

    Raises
    ------
    ParameterError
        If a motion is not possible.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> shake = GroundAcceleration.from_samples([0.0, 3.0, -3.0, 0.0], 0.2)
    >>> [found] = nominal_of_each([RockingFrame(height=9.6, width=1.6)], [shake], [None])
    >>> found.impacts.tolist()
    [1]
    """
    (kind, _), *others = places_of_kinds(structures)
    nominal = None if others else getattr(kind, "nominal", None)
    return nominal and nominal(structures, motions, pulses)


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
    ensembles: list[list[EnsembleResponse | None]] = [[None] * len(structures) for _ in motions]
    for kind, places in places_of_kinds(structures):
        some = [structures[place] for place in places]
        for those, which in alike(kind, some, motions):
            answers = kind.ensembles(
                [some[k] for k in which],
                [motions[i] for i in those],
                ensemble,
                [versions[i] for i in those],
            )
            for i, row in zip(those, answers, strict=True):
                for k, answer in zip(which, row, strict=True):
                    ensembles[i][places[k]] = answer
    return ensembles


def places_of_kinds(
    structures: Sequence[Structure],
) -> Iterator[tuple[StructureKind, list[int]]]:
    """Yield each kind with the places of its structures."""
    for name in dict.fromkeys(structure.kind for structure in structures):
        yield (
            kind_named(name),
            [k for k, structure in enumerate(structures) if structure.kind == name],
        )


def _by_kind(
    structures: Sequence[Structure],
    motion: Motion,
    compute: Callable[[StructureKind, Sequence[Structure]], Sequence[StructureResponse]],
    not_computed: Callable[[Structure, str], StructureResponse],
) -> list[StructureResponse]:
    """Return the results of structures in their order, computed together for each kind."""
    responses: dict[int, StructureResponse] = {}
    for kind, places in places_of_kinds(structures):
        reasons = {place: kind.why_not(structures[place], motion) for place in places}
        some = [place for place in places if not reasons[place]]
        for place in places:
            if reasons[place]:
                responses[place] = not_computed(structures[place], reasons[place])
        if some:
            responses |= zip(some, compute(kind, [structures[k] for k in some]), strict=True)
    return [responses[place] for place in range(len(structures))]


def alike(
    kind: StructureKind, structures: Sequence[Structure], motions: Sequence[Motion]
) -> Iterator[tuple[list[int], list[int]]]:
    """Yield places of motions, with the places of the structures that the kind computes under all
    of them.
    """
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, motion in enumerate(motions):
        which = tuple(
            k for k, structure in enumerate(structures) if not kind.why_not(structure, motion)
        )
        groups.setdefault(which, []).append(i)
    for which, those in groups.items():
        if which:
            yield those, list(which)
