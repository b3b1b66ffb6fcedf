"""Compare rocking bridges with alternative systems under each record, and write compare.nc."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rockframe.errors import InputError, ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.oscillators.comparison import Compared, Rivals, compare
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.results.records import open_records
from rockframe.results.response import furthest_pairs, read_histories, write_comparison
from rockframe.results.writing import input_hash
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.stages.common import (
    WHOLE,
    NamedFigure,
    Progress,
    Written,
    accepted,
    horizontal,
    silent,
    unseen,
)
from rockframe.stages.versions import VersionSources
from rockframe.study.structures import CompareEntry, FixedEntry, StructureEntry, read_bridges
from rockframe.study.toml import line_of, read_text


def compare_stage(
    records_path: str | Path,
    output: str | Path,
    structures_path: str | Path,
    options: CompareEntry | None = None,
    *,
    against: Collection[str] | None = None,
    structure: str | None = None,
    progress: Progress = silent,
    written: Written = unseen,
) -> tuple[InputOutcome, ...]:
    """Compute each structure and its alternatives under each horizontal record: ``compare.nc``.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write.
    structures_path : str or Path
        TOML file of ``[[structure]]`` tables, and of ``[compare]`` tables of the alternatives.
    options : CompareEntry, optional
        The alternatives; replaces the tables of the file.
    against : collection of str, optional
        Only these alternatives: restrained, hybrid, isolated, fixed.
    structure : str, optional
        Only the structure of this name.
    progress : callable
        Called with the number of records done and in total.
    written : callable
        Called with the dataset of the written file, without its histories.

    Returns
    -------
    tuple of InputOutcome
        Records that could not be computed.

    Raises
    ------
    InputError
        If records or structures cannot be read, the output cannot be written, or an
        alternative is not stated.
    ParameterError
        If there is no structure of that name or no alternative, a structure is a column alone, or
        no record is left.
    """
    records_path, output = Path(records_path), Path(output)
    structures_path = Path(structures_path)
    refuse_overwriting([output], [records_path, structures_path])
    entries, of_file = read_bridges(structures_path)
    stated = options or of_file
    against = against or stated.against or ()
    if structure is not None:
        require_known("structure", structure, [one.name for one in entries])
    compared = []
    for i, entry in enumerate(entries):
        if structure not in (None, entry.name):
            continue
        try:
            compared.append(_rivals_of(entry, stated, against))
            _require_same_rivals(compared)
        except ParameterError as error:
            line = line_of(read_text(structures_path), ("structure", i))
            raise InputError(structures_path, str(error), line) from None
    left_out: dict[str, str] = {}
    with open_records(records_path) as file:
        names = horizontal(file)
        sources = VersionSources.of(file, stated.ensemble, names)

        def answer(name: str) -> tuple[str, list[list[Compared]] | None, str]:
            record, ensemble = file.read(name), stated.ensemble
            made_of = sources.uncertain(record)
            versions = None if made_of is None else made_of.versions(ensemble, record)
            try:
                return name, [compare(one, record, ensemble, versions) for one in compared], ""
            except ParameterError as error:
                return name, None, str(error)

        made = write_comparison(
            accepted(map(answer, names), names, WHOLE, left_out, progress),
            [rivals.frame for rivals in compared],
            output,
            input_sha256=input_hash(records_path, structures_path),
            parameters={"against": list(compared[0].models)[1:], "structure": structure}
            | {"ensemble": stated.ensemble.stated()},
            left_out=left_out,
        )
    written(made)
    return tuple(InputOutcome(name, left_out[name]) for name in names if name in left_out)


def _rivals_of(entry: StructureEntry, stated: CompareEntry, against: Collection[str]) -> Rivals:
    """Return the requested alternatives of a structure; by default all that are stated."""
    whole = entry.whole()
    tendon, dissipater = whole.tendon or stated.restrained, whole.dissipater or stated.hybrid
    free, isolated = replace(whole, tendon=None, dissipater=None), entry.isolated or stated.isolated
    made: dict[str, Callable[[], RockingFrame | IsolatedDeck | FixedFrame | None]] = {
        "restrained": lambda: entry.on_pivots(replace(free, tendon=tendon)) if tendon else None,
        "hybrid": lambda: (
            entry.on_pivots(replace(free, tendon=tendon, dissipater=dissipater))
            if tendon and dissipater
            else None
        ),
        "isolated": lambda: None if isolated is None else isolated.made(),
        "fixed": lambda: _fixed(free, entry, entry.fixed or stated.fixed),
    }
    if dissipater is not None and tendon is None and (not against or "hybrid" in against):
        raise ParameterError(
            f"Dissipaters of {whole.name!r} without a tendon. State a tendon in "
            "[structure.tendon] or [compare.restrained]."
        )
    rivals = {name: make() for name, make in made.items() if not against or name in against}
    tables = {"restrained": "tendon", "hybrid": "dissipater"}
    for name in against:
        if rivals[name] is None:
            raise ParameterError(
                f"{name} bridge of {whole.name!r} not stated. State it in "
                f"[structure.{tables.get(name, name)}] or [compare.{name}]."
            )
    if not any(rivals.values()):
        raise ParameterError(
            f"No bridge to compare with {whole.name!r}. State one in [compare.isolated], "
            "[compare.fixed], [compare.restrained] or [compare.hybrid]."
        )
    return Rivals(entry.on_pivots(free), **rivals)  # type: ignore[arg-type]


def _require_same_rivals(compared: Sequence[Rivals]) -> None:
    """Reject structures with different alternatives, because the file has one list of models."""
    first, last = compared[0], compared[-1]
    if list(last.models) != list(first.models):
        here, there = (", ".join(one.models) for one in (last, first))
        raise ParameterError(
            f"{last.frame.name!r} has the models {here}, and {first.frame.name!r} {there}. "
            "Must be the same: state `against`, or one structure."
        )


def _fixed(
    frame: RockingFrame, entry: StructureEntry, stated: FixedEntry | None
) -> FixedFrame | None:
    if stated is None:
        return None
    circular = entry.section == "circular"
    needed = f"stated for the stiffness and mass of the fixed bridge of {frame.name!r}"
    if frame.column_mass is None:
        raise ParameterError(f"key 'column_mass_kg' or 'density_kg_m3' missing. Must be {needed}.")
    if not (circular or entry.depth_m):
        raise ParameterError(f"key 'depth_m' missing. Must be {needed}.")
    for key in ("top_width_m", "inner_width_m", "inertia_ratio", "centre_of_gravity_m"):
        if getattr(entry, key) is not None:
            raise ParameterError(
                f"{key} {getattr(entry, key)!r} of {frame.name!r}. Must be absent: columns of the "
                "fixed bridge are solid and prismatic."
            )
    return stated.of_columns(
        height=entry.height_m,
        width=entry.width_m,
        depth=None if circular else entry.depth_m,
        column_mass=frame.column_mass,
        deck_mass=frame.mass_ratio * frame.column_mass,
    )


def comparison_figures(path: Path, most: int) -> Iterator[NamedFigure]:
    """Yield a figure of each structure under the `most` records with the largest drifts."""
    from rockframe.figures.histories import draw_comparison

    for record, structure in furthest_pairs(path, most):
        one = read_histories(path, record, structure)
        yield f"{record}-{structure}", f"{record} {structure}", draw_comparison(one)
