"""Compare bridges that rock with their rivals under each record, and write compare.nc."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rockframe.errors import InputError, ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.ingest import Rejection
from rockframe.oscillators.comparison import Compared, Rivals, compare
from rockframe.oscillators.models import COLUMN_SHARE, FixedFrame, IsolatedDeck
from rockframe.provenance import refuse_overwriting
from rockframe.results.compare import write_comparison
from rockframe.results.records import open_records
from rockframe.results.writing import input_hash
from rockframe.stages.common import Progress, horizontal, silent
from rockframe.study.structures import (
    CompareEntry,
    FixedEntry,
    IsolatedEntry,
    StructureEntry,
    read_bridges,
)
from rockframe.units import GRAVITY


def compare_stage(
    records_path: Path,
    output: Path,
    structures_path: Path,
    stated: CompareEntry | None = None,
    *,
    against: Collection[str] | None = None,
    structure: str | None = None,
    progress: Progress = silent,
) -> tuple[Rejection, ...]:
    """Compute each structure and its rivals under each horizontal record: ``compare.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    structures_path : Path
        TOML file of ``[[structure]]`` tables, and of ``[compare]`` tables of the rivals.
    stated : CompareEntry, optional
        The rivals, instead of the tables of the file.
    against : collection of str, optional
        Only these rivals: restrained, hybrid, isolated, fixed.
    structure : str, optional
        Only the structure of this name.
    progress : callable
        Called with the number of records done and in total.

    Returns
    -------
    tuple of Rejection
        Records that could not be computed.

    Raises
    ------
    InputError
        If records or structures cannot be read, the output cannot be written, or a rival is not
        stated.
    ParameterError
        If there is no structure of that name or no rival, a structure is a column alone, or no
        record is left.
    """
    refuse_overwriting([output], [records_path, structures_path])
    entries, of_file = read_bridges(structures_path)
    stated = stated or of_file
    against = against or stated.against or ()
    if structure is not None:
        require_known("structure", structure, [one.name for one in entries])
    try:
        compared = [
            _rivals_of(entry, stated, against)
            for entry in entries
            if structure in (None, entry.name)
        ]
        _require_alike(compared)
    except ParameterError as error:
        raise InputError(structures_path, str(error)) from None
    left_out: dict[str, str] = {}
    with open_records(records_path) as file:
        names = horizontal(file)

        def answers() -> Iterator[tuple[str, list[list[Compared]]]]:
            for done, name in enumerate(names, 1):
                record = file.read(name)
                try:
                    answer = [compare(rivals, record) for rivals in compared]
                except ParameterError as error:
                    left_out[name] = str(error)
                else:
                    yield name, answer
                progress(done, len(names))
            if len(left_out) == len(names):
                raise ParameterError(f"record {names[0]!r}: {left_out[names[0]]}")

        write_comparison(
            answers(),
            [rivals.frame for rivals in compared],
            output,
            input_sha256=input_hash(records_path, structures_path),
            parameters={"against": list(compared[0].models)[1:], "structure": structure},
            left_out=left_out,
        )
    return tuple(Rejection(name, left_out[name]) for name in names if name in left_out)


def _rivals_of(entry: StructureEntry, stated: CompareEntry, against: Collection[str]) -> Rivals:
    """The rivals of a structure: those asked for, or else all that are stated."""
    whole = entry.frame(crushed=False)
    tendon, dissipater = whole.tendon, whole.dissipater
    if tendon is None and stated.restrained is not None:
        tendon = stated.restrained.tendon(whole.height)
    if dissipater is None and stated.hybrid is not None:
        dissipater = stated.hybrid.dissipater()
    free = replace(whole, tendon=None, dissipater=None)
    made: dict[str, Callable[[], RockingFrame | IsolatedDeck | FixedFrame | None]] = {
        "restrained": lambda: entry.on_pivots(replace(free, tendon=tendon)) if tendon else None,
        "hybrid": lambda: (
            entry.on_pivots(replace(free, tendon=tendon, dissipater=dissipater))
            if tendon and dissipater
            else None
        ),
        "isolated": lambda: _isolated(entry.isolated or stated.isolated),
        "fixed": lambda: _fixed(free, entry, entry.fixed or stated.fixed),
    }
    if dissipater is not None and tendon is None and (not against or "hybrid" in against):
        raise ParameterError(
            f"Dissipaters of {whole.name!r} without a tendon. Must be beside one, in "
            "[structure.tendon] or [compare.restrained]."
        )
    rivals = {name: make() for name, make in made.items() if not against or name in against}
    tables = {"restrained": "tendon", "hybrid": "dissipater"}
    for name in against:
        if rivals[name] is None:
            raise ParameterError(
                f"{name} bridge of {whole.name!r} not stated. Must be, in "
                f"[structure.{tables.get(name, name)}] or [compare.{name}]."
            )
    if not any(rivals.values()):
        raise ParameterError(
            f"No rival of {whole.name!r} stated. Must be, in [compare.isolated], [compare.fixed], "
            "[compare.restrained] or [compare.hybrid]."
        )
    return Rivals(entry.on_pivots(free), **rivals)  # type: ignore[arg-type]


def _require_alike(compared: Sequence[Rivals]) -> None:
    """Refuse structures with other rivals: the file has one list of models."""
    first = compared[0]
    for rivals in compared[1:]:
        if list(rivals.models) != list(first.models):
            here, there = (", ".join(one.models) for one in (rivals, first))
            raise ParameterError(
                f"{rivals.frame.name!r} has the models {here}, and {first.frame.name!r} {there}. "
                "Must be the same: state `against`, or one structure."
            )


def _isolated(stated: IsolatedEntry | None) -> IsolatedDeck | None:
    if stated is None:
        return None
    of_lead = (stated.period_s, stated.effective_period_s, stated.strength_ratio)
    if stated.radius_m is not None and stated.friction is not None:
        if any(value is not None for value in of_lead):
            raise ParameterError(
                "compare.isolated states radius_m and friction beside a period or a strength. Must "
                "be either."
            )
        return IsolatedDeck.friction_pendulum(
            radius=stated.radius_m, friction=stated.friction, damping_ratio=stated.damping_ratio
        )
    if stated.strength_ratio is None or stated.radius_m or stated.friction:
        raise ParameterError(
            "compare.isolated is incomplete. Must state period_s and strength_ratio, or radius_m "
            "and friction."
        )
    return IsolatedDeck.lead_rubber(
        strength_ratio=stated.strength_ratio,
        period=stated.period_s,
        effective_period=stated.effective_period_s,
        design_displacement=stated.design_displacement_m,
        yield_displacement=stated.yield_displacement_m,
        damping_ratio=stated.damping_ratio,
    )


def _fixed(
    frame: RockingFrame, entry: StructureEntry, stated: FixedEntry | None
) -> FixedFrame | None:
    if stated is None:
        return None
    circular = entry.section == "circular"
    if frame.column_mass is None or not (circular or entry.depth_m):
        raise ParameterError(
            f"Missing {'mass' if frame.column_mass is None else 'depth_m'} of the columns of "
            f"{frame.name!r}. Must be stated, for the stiffness and mass of the fixed bridge."
        )
    shaped = ("top_width_m", "inner_width_m", "inertia_ratio", "centre_of_gravity_m")
    for key in shaped:
        if getattr(entry, key) is not None:
            raise ParameterError(
                f"Columns of {frame.name!r} with {key}. Must be solid and prismatic, for the fixed "
                "bridge."
            )
    strength = math.inf if stated.strength_ratio is None else stated.strength_ratio
    if stated.moment_capacity_nm is not None:
        if stated.strength_ratio is not None:
            raise ParameterError(
                "fixed bridge with moment_capacity_nm beside strength_ratio. Must be one of them."
            )
        moving = (frame.mass_ratio + COLUMN_SHARE) * frame.column_mass * GRAVITY
        strength = 2.0 * stated.moment_capacity_nm / (entry.height_m * moving)
    return FixedFrame.from_columns(
        columns=1,
        height=entry.height_m,
        width=entry.width_m,
        depth=None if circular else entry.depth_m,
        modulus=stated.modulus_pa,
        column_mass=frame.column_mass,
        deck_mass=frame.mass_ratio * frame.column_mass,
        cracked_stiffness_ratio=stated.cracked_stiffness_ratio,
        damping_ratio=stated.damping_ratio,
        strength_ratio=strength,
        post_yield_ratio=stated.post_yield_ratio,
    )
