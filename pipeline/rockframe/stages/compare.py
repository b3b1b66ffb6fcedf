"""Compare bridges that rock with their rivals under each record, and write compare.nc."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path

from rockframe.errors import InputError, ParameterError
from rockframe.figures.captioned import save_captioned
from rockframe.figures.comparison import draw_comparison
from rockframe.frame import RockingFrame
from rockframe.ingest import Rejection
from rockframe.oscillators.comparison import RIVALS, Compared, Rivals, compare
from rockframe.oscillators.models import FixedFrame, IsolatedDeck
from rockframe.provenance import refuse_overwriting
from rockframe.results.compare import pairs_in, read_histories, write_comparison
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


def compare_stage(
    records_path: Path,
    output: Path,
    structures_path: Path,
    *,
    against: Collection[str] = RIVALS,
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
    against : collection of str
        Rivals: restrained, hybrid, isolated, fixed.
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
    bridges = _bridges(structures_path, against, structure)
    left_out: dict[str, str] = {}
    with open_records(records_path) as file:
        names = horizontal(file)

        def answers() -> Iterator[tuple[str, list[list[Compared]]]]:
            for done, name in enumerate(names, 1):
                record = file.read(name)
                try:
                    answer = [compare(rivals, record) for rivals in bridges]
                except ParameterError as error:
                    left_out[name] = str(error)
                else:
                    yield name, answer
                progress(done, len(names))
            if len(left_out) == len(names):
                raise ParameterError(f"record {names[0]!r}: {left_out[names[0]]}")

        write_comparison(
            answers(),
            [rivals.frame for rivals in bridges],
            output,
            input_sha256=input_hash(records_path, structures_path),
            parameters={"against": list(against), "structure": structure},
            left_out=left_out,
        )
    return tuple(Rejection(name, left_out[name]) for name in names if name in left_out)


def _bridges(path: Path, against: Collection[str], chosen: str | None) -> list[Rivals]:
    """The structures of a file that are asked for, each with its rivals."""
    if not against:
        raise ParameterError(f"Missing rivals. Must be one or more of: {', '.join(RIVALS)}.")
    frames, entries, rivals = read_bridges(path)
    pairs = [
        (frame, entry)
        for frame, entry in zip(frames, entries, strict=True)
        if chosen in (None, frame.name)
    ]
    if not pairs:
        names = ", ".join(frame.name for frame in frames)
        raise ParameterError(f"Invalid structure {chosen!r}. Must be one of: {names}.")
    try:
        return [_rivals_of(frame, entry, rivals, against) for frame, entry in pairs]
    except ParameterError as error:
        raise InputError(path, str(error)) from None


def _rivals_of(
    frame: RockingFrame, entry: StructureEntry, stated: CompareEntry, against: Collection[str]
) -> Rivals:
    tendon = frame.tendon
    if stated.restrained is not None:
        tendon = stated.restrained.tendon(frame.height)
    dissipater = frame.dissipater
    if stated.hybrid is not None:
        dissipater = stated.hybrid.dissipater()
    needed = {
        "restrained": tendon,
        "hybrid": dissipater and tendon,
        "isolated": stated.isolated,
        "fixed": stated.fixed,
    }
    tables = {"restrained": "structure.tendon", "hybrid": "structure.dissipater"}
    for name in against:
        if needed[name] is None:
            beside = f"[{tables[name]}] or " if name in tables else ""
            tendons = ", and a tendon" if name == "hybrid" else ""
            raise ParameterError(
                f"{name} bridge of {frame.name!r} not stated. Must be, in "
                f"{beside}[compare.{name}]{tendons}."
            )
    restrained = replace(frame, tendon=tendon, dissipater=None)
    return Rivals(
        frame=frame,
        restrained=restrained if "restrained" in against else None,
        hybrid=replace(frame, tendon=tendon, dissipater=dissipater)
        if "hybrid" in against
        else None,
        isolated=_isolated(stated.isolated) if "isolated" in against else None,
        fixed=_fixed(frame, entry, stated.fixed) if "fixed" in against else None,
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
    if not frame.prismatic and entry.pivot is None:
        raise ParameterError(
            f"Columns of {frame.name!r} are not prismatic. Must be, for the fixed bridge."
        )
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
        strength_ratio=math.inf if stated.strength_ratio is None else stated.strength_ratio,
        post_yield_ratio=stated.post_yield_ratio,
    )


def draw_comparisons(path: Path, folder: Path) -> list[Path]:
    """Draw the models of each structure under each record: a figure and its caption each.

    Parameters
    ----------
    path : Path
        Output of `compare_stage`.
    folder : Path
        Where the figures go, ``RECORD-STRUCTURE.png``.

    Returns
    -------
    list of Path
        The figures.

    Raises
    ------
    InputError
        If the file is not a comparison, or a figure cannot be written.
    """
    drawn = []
    for record, structure in pairs_in(path):
        file = folder / f"{record}-{structure}.png"
        save_captioned(draw_comparison(read_histories(path, record, structure)), file)
        drawn.append(file)
    return drawn
