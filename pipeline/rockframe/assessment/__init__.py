"""Assess structures under motions in memory: what `respond_stage` computes, without files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import ParameterError, require_known
from rockframe.notebook import Shown
from rockframe.options.respond import RespondOptions
from rockframe.record import Record
from rockframe.results.reading import indexed
from rockframe.results.response import responses_arrays
from rockframe.rocking import GroundAcceleration, as_ground
from rockframe.rocking.response import require_some
from rockframe.stages.respond import ResponseTask, answer_task
from rockframe.structures.contract import Structure, require_structures
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from rockframe.components import BothDirections, HorizontalPair
    from rockframe.wobbling import PairAcceleration

Motion: TypeAlias = (
    "Record | Pulse | GroundAcceleration | PairAcceleration | HorizontalPair | BothDirections"
)


@dataclass(frozen=True, eq=False, repr=False)
class Assessment(Shown):
    """The responses of structures to motions, with their ensembles and margins.

    Printed, it shows a line for each motion and structure; notebooks show a table and the
    histories.

    Parameters
    ----------
    motions : mapping of str to Record, Pulse, GroundAcceleration or PairAcceleration
        The motions by name.
    responses : mapping of str to tuple of responses
        Responses to each motion, in the order of the structures.
    options : RespondOptions
        What was computed.
    """

    motions: Mapping[str, Motion]
    responses: Mapping[str, tuple[Any, ...]]
    options: RespondOptions

    @property
    def structures(self) -> tuple[Structure, ...]:
        """The structures."""
        return tuple(response.structure for response in next(iter(self.responses.values())))

    def sel(self, *, record: str | None = None, structure: str | None = None) -> Any:
        """Return the response of a structure to a motion.

        Parameters
        ----------
        record, structure : str, optional
            Names of the motion and the structure. A name may be left out if there is only one.

        Raises
        ------
        ParameterError
            If there is no such motion or structure, or if a name of several is left out.
        """
        names = [frame.name for frame in self.structures]
        motion = _only("record", record, list(self.responses))
        return self.responses[motion][names.index(_only("structure", structure, names))]

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        """Yield the name of the motion and the response, structures of a motion in their order."""
        return (
            (name, response) for name, responses in self.responses.items() for response in responses
        )

    def __len__(self) -> int:
        """Return the number of motions times that of structures."""
        return len(self.responses) * len(self.structures)

    def __repr__(self) -> str:
        lines = [
            f"{name:{self._width}}  {label:.<32} {value}" for name, label, value in self._lines()
        ]
        return "\n".join([f"<Assessment of {len(self)} responses>", *lines])

    @property
    def _width(self) -> int:
        return max(map(len, self.responses))

    def _lines(self) -> Iterator[tuple[str, str, str]]:
        """Yield motion, structure, and the verdict in words with its share and margin."""
        for name, response in self:
            ensemble, verdict = response.ensemble, response.spread_verdict
            settings = (
                f"{ensemble.overturned} of {ensemble.members} overturn" if ensemble else "nominal"
            )
            words = f"{verdict.sentence} ({settings})" if verdict.is_computed else verdict.sentence
            yield name, f"{response.structure.name} ", words

    def facts(self) -> dict[str, str]:
        """Return the verdict of each motion and structure, for the table in notebooks."""
        return {f"{name}, {label.strip()}": value for name, label, value in self._lines()}

    def draw(self, axes: Axes) -> None:
        """Draw theta / alpha of all responses over time, or u if one of them is of no frame."""
        rocks = all(
            hasattr(response, "theta") and hasattr(response, "frame") for _, response in self
        )
        for name, response in self:
            if response.time.size:
                values = response.theta / response.frame.slenderness if rocks else response.u
                label = f"{name}, {response.structure.name}"
                axes.plot(response.time, values, linewidth=0.9, label=label)
        axes.set(xlabel="time [s]", ylabel="θ/α" if rocks else "u [m]")
        if rocks:
            axes.set_ylim(-1.5, 1.5)
        axes.legend(fontsize="small")

    def to_xarray(self) -> xr.Dataset:
        """Return verdicts, shares, bands, margins, peaks and properties by record and structure.

        The variables are those of ``response.nc``, with their units; `record` and `structure` are
        indexes. Histories are those of `Response.to_xarray`.
        """
        arrays = responses_arrays(
            self.responses,
            self.structures,
            pulses=all(getattr(assessment, "to_pulse", None) is not None for _, assessment in self),
        )
        return indexed(arrays.dataset())


def assess(
    structures: Structure | Sequence[Structure],
    motions: Motion | Sequence[Motion] | Mapping[str, Motion],
    options: RespondOptions | None = None,
    *,
    pulses: Mapping[str, Pulse] | None = None,
    engine: Engine | None = None,
) -> Assessment:
    """Return how surely structures stand under motions, without reading or writing files.

    For each motion and structure it computes the nominal response, the share of plausible
    structures that overturn with its 90 % interval, the bands of their peaks, and the margin.
    `respond_stage` computes the same for the records of a file; there, an ensemble also varies the
    corner and the orientation of records that this package corrected.

    Parameters
    ----------
    structures : RockingFrame, IsolatedDeck, FixedFrame or another kind, or a sequence of them
        Structures with different names.
    motions : Record, Pulse, GroundAcceleration or PairAcceleration, or a sequence or mapping
        Motions. A record has the name of its ``record_id``; other motions are numbered, unless a
        mapping names them. A `PairAcceleration`, `HorizontalPair` or `BothDirections` moves the
        ground in both horizontal directions, which is computed for frames with round columns.
    options : RespondOptions, optional
        Ensemble, margins, forces and histories. ``vertical`` is not one of them: state the vertical
        motion with `GroundAcceleration.with_vertical`.
    pulses : mapping of str to Pulse, optional
        Pulse of each motion by name: adds the response to the pulse alone.
    engine : Engine, optional
        Engine of the computation; the result does not depend on it.

    Raises
    ------
    ParameterError
        If there is no motion or structure, if two have one name, if a member of the ensemble does
        not rock, if an option needs a file, or if a vertical acceleration exceeds gravity
        downwards.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> assess(bent, pulse)
    <Assessment of 1 responses>
    motion  bent ........................... stands; 10 % overturn at 1.06 (0 of 64 overturn)
    >>> found = assess(bent, {"pulse": pulse}).to_xarray()
    >>> found["share_overturned"].sel(record="pulse", structure="bent").item()
    0.0
    """
    options = options or RespondOptions()
    if options.vertical or options.structure is not None:
        word = "vertical" if options.vertical else "structure"
        raise ParameterError(
            f"Invalid option {word} of assess. Must be left out: it chooses from a file."
        )
    several: Any = [structures] if hasattr(structures, "kind") else structures
    require_structures(several)
    _require_different("structures", [item.name for item in several])
    named = _named(motions)
    for name in pulses or {}:
        require_known("record", name, [*named])
    tasks = [
        ResponseTask(
            motions={name: _shaking(motion)},
            uncertain={},
            parts={name: motion.parts} if isinstance(motion, Record) and motion.parts else {},
            pulses={name: pulses[name]} if pulses and name in pulses else {},
            structures=tuple(several),
            options=options,
        )
        for name, motion in named.items()
    ]
    values: dict[str, tuple[Any, ...]] = {}
    for answers in map_tasks(answer_task, tasks, engine=engine):
        for name, responses, reason in answers:
            if responses is None:
                raise ParameterError(f"{name}: {reason}")
            values[name] = tuple(responses)
    return Assessment(named, values, options)


def _is_motion(given: object) -> bool:
    from rockframe.components import BothDirections, HorizontalPair
    from rockframe.wobbling import PairAcceleration  # not needed to import the package

    in_both = PairAcceleration | HorizontalPair | BothDirections
    return isinstance(given, Record | Pulse | GroundAcceleration | in_both)


def _shaking(motion: Motion) -> Record | GroundAcceleration | PairAcceleration:
    """Return a motion in the form of tasks."""
    if isinstance(motion, Record):
        return motion
    if isinstance(motion, Pulse | GroundAcceleration):
        return as_ground(motion)
    from rockframe.wobbling.motion import as_pair  # not needed to import the package

    return as_pair(motion)


def _named(motions: Motion | Sequence[Motion] | Mapping[str, Motion]) -> dict[str, Motion]:
    """Return motions by name."""
    if isinstance(motions, Mapping):
        named = dict(motions)
    else:
        several: list[Any] = [motions] if _is_motion(motions) else list(motions)  # type: ignore[arg-type]
        labels = (
            ["motion"] if len(several) == 1 else [f"motion-{k + 1}" for k in range(len(several))]
        )
        names = [
            motion.record_id if isinstance(motion, Record) else label
            for motion, label in zip(several, labels, strict=True)
        ]
        _require_different("motions", names)
        named = dict(zip(names, several, strict=True))
    require_some(motions=[*named])
    return named


def _require_different(label: str, names: Sequence[str]) -> None:
    """Raise an error if a name occurs twice."""
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(
                f"{names.count(name)} {label} have the name {name!r}. Must differ."
            )


def _only(label: str, name: str | None, names: Sequence[str]) -> str:
    """Return a name that is known, or the only one."""
    if name is None and len(names) > 1:
        raise ParameterError(f"Missing {label}. Must be one of {', '.join(names)}.")
    chosen = names[0] if name is None else name
    require_known(label, chosen, list(names))
    return chosen
