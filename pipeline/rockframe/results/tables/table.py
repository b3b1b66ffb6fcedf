"""Rows of a table like the paper's Table 1, from the files of three stages."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rockframe.cells import Column, rows_of_columns
from rockframe.errors import InputError
from rockframe.quantities import OF_KINDS, PEAKS
from rockframe.record import Part
from rockframe.results.pulses import pulse_rows
from rockframe.results.schema import PULSES, RECORDS, RESPONSE
from rockframe.results.schema.arrays import Arrays, arrays_of
from rockframe.results.schema.response import CONTACT, ROBUST
from rockframe.results.shards import opened_arrays
from rockframe.results.tables.forces import FORCE_CELLS, OF_FORCES, force_cells
from rockframe.results.tables.rows import (
    OF_BANDS,
    SHARES,
    Row,
    blocks,
    columns_along,
    columns_of,
    rows_along,
    spread_verdict,
)
from rockframe.results.tables.summary import OF_STRUCTURE
from rockframe.rocking.verdict import MODEL_ENDS

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: The values of some rows, by column.
Columns = dict[str, list[Any]]

#: Columns that only some files have, with their variables.
_SOME: Final = {
    "kind": "kind",
    **{quantity.column(): quantity.name for quantity in OF_KINDS},
    "first_yield_time_s": "first_yield_time",
    "ductility_exceeded_time_s": "ductility_exceeded_time",
    "not_computed": "not_computed",
    "components": "components",
}
#: Events that end the model, of rocking frames.
_MODEL_ENDS: Final = tuple(name for name in MODEL_ENDS if f"{name}_s" not in _SOME)
#: Columns of ``table.csv`` in order. Units are in the names; unknown values are NaN or empty. Those
#: of `force_cells` follow if the responses have forces.
_COLUMNS: Final = (
    *("event", "record", "magnitude", "epicentral_distance_km"),
    *("distance_rrup_km", "distance_rjb_km", "pga_g", "pgv_m_s", "a_p_g"),
    *("T_p_s", "wavelet", "match_index", "L_p_m", "at_period_bound", "structure"),
    *(quantity.column() for quantity in PEAKS),
    *("impacts", "verdict", "verdict_words"),
    *("critical_scale", "largest_scale", "safe_islands", "largest_robust_scale"),
    *(f"robust_{what}_{share}" for what in ("scale", "error") for share in (10, 25, 50)),
    *("uplift_time_s", "overturning_time_s", "record_id", "source_file", "facts_source"),
    *("pulse_verdict", "pulse_p_value", "verdict_to_pulse", "peak_rotation_ratio_to_pulse"),
    *("surrogate_error", *CONTACT, *OF_STRUCTURE, "slenderness_before_crushing_deg"),
    *("restitution", "restitution_before_crushing", *(f"{name}_s" for name in _MODEL_ENDS)),
    *SHARES,
    "model_end",
    *OF_BANDS,
)
#: Columns of a record and columns of a response, with their variables.
_OF_RECORD: Final = columns_of(
    "record_id event station component source_file facts_source magnitude",
    "epicentral_distance_km=epicentral_distance distance_rrup_km=distance_rrup",
    "distance_rjb_km=distance_rjb pga_g=pga pgv_m_s=pgv",
    "pga_rotd100_g=pga_rotd100 pgv_rotd100_m_s=pgv_rotd100",
)
_OF_NAME: Final = columns_of("record_id station component")
_OF_RESPONSE: Final = columns_of(
    "record_id structure",
    *(f"{quantity.column()}={quantity.name}" for quantity in PEAKS),
    "impacts verdict critical_scale largest_scale safe_islands",
    *ROBUST,
    "uplift_time_s=uplift_time overturning_time_s=overturning_time",
    "verdict_to_pulse peak_rotation_ratio_to_pulse surrogate_error",
    *CONTACT,
    "height_m=height width_m=width mass_ratio slenderness_deg=slenderness",
    "slenderness_before_crushing_deg=slenderness_before_crushing",
    "restitution restitution_before_crushing",
    *(f"{name}_s={name}" for name in _MODEL_ENDS),
    *SHARES,
    "model_end",
    *(f"{column}={name}" for column, name in _SOME.items()),
    *(f"{column}={variable}" for column, variable in OF_BANDS.items()),
)
_OF_ANSWER: Final = {**_OF_RESPONSE, **OF_FORCES}
_NO_PULSE: Final[Row] = {
    "wavelet": "",
    "pulse_verdict": "",
    "at_period_bound": False,
    **dict.fromkeys(("a_p_g", "T_p_s", "match_index", "L_p_m", "p_value"), math.nan),
}


def table_rows(
    records: Path | Dataset, pulses: Path | Dataset, response: Path | Dataset
) -> Iterator[Row]:
    """Yield a row for each record and structure; rows of one record follow each other.

    ``record`` is the station and component where they name only one record, else the record_id.

    Parameters
    ----------
    records, pulses, response : Path or Dataset
        Outputs of the ingest, pulse and respond stages for the same records, or what they wrote.

    Raises
    ------
    InputError
        If a file is missing, corrupted or of another kind, or if the responses belong to other
        records.
    """
    for block in table_blocks(records, pulses, response):
        yield from rows_of_columns(block.columns())


@dataclass(frozen=True)
class TableBlock:
    """Some motions with all that their rows need, in memory.

    Parameters
    ----------
    records, pulses, response : Arrays
        The motions, and the records from the first to the last of them.
    shared_names : frozenset of str
        Stations and components that name several records.
    """

    records: Arrays
    pulses: Arrays
    response: Arrays
    shared_names: frozenset[str]

    def columns(self) -> Iterator[Columns]:
        """Yield the columns of the rows of each motion."""
        return _table_columns(self.records, self.pulses, self.response, self.shared_names)


def table_blocks(
    records: Path | Dataset, pulses: Path | Dataset, response: Path | Dataset
) -> Iterator[TableBlock]:
    """Yield the motions of `table_rows` in blocks, so that not all have to be in memory.

    The parameters and errors are those of `table_rows`.
    """
    with ExitStack() as stack:
        record_rows, pulse_rows_of, answers = (
            stack.enter_context(_dataset(one, kind))
            for one, kind in ((records, RECORDS), (pulses, PULSES), (response, RESPONSE))
        )
        if "record_id" not in answers:  # a batch without accepted records
            return
        named = Counter(map(_short_name, rows_along(record_rows, "record", _OF_NAME)))
        shared_names = frozenset(name for name, count in named.items() if count > 1)
        of_records, of_pulses = _places(record_rows), _places(pulse_rows_of)
        record_rows, answers = _needed(record_rows, _OF_RECORD), _needed(answers, _OF_ANSWER)
        pulse_rows_of = arrays_of(pulse_rows_of).without("obs")
        for part in map(arrays_of, blocks(answers)):
            names = [str(name) for name in part["record_id"].values]
            names = [*chain(*map(str.split, _records_of(part, names)))]
            for name in names:
                if name not in of_records:
                    must_be = f"which {_file(records)} does not. Must be of the same records."
                    raise InputError(_file(response), f"holds {name!r}, {must_be}")
            beside = _some(record_rows, of_records, names), _some(pulse_rows_of, of_pulses, names)
            in_records, in_pulses = (arrays_of(some).loaded() for some in beside)
            yield TableBlock(in_records, in_pulses, part.loaded(), shared_names)


def _needed(dataset: Dataset, columns: Mapping[str, str]) -> Arrays:
    """Return only the variables of some columns."""
    names = dict.fromkeys(
        name for column in columns.values() for name in (column, column.partition(".")[0])
    )
    arrays = arrays_of(dataset)
    return arrays.with_variables({name: arrays[name] for name in names if name in arrays})


def _table_columns(
    records: Dataset, pulses: Dataset, response: Dataset, shared_names: Container[str]
) -> Iterator[Columns]:
    """Yield the columns of the rows of each motion of a block of records."""
    rows_of_records = {row["record_id"]: row for row in rows_along(records, "record", _OF_RECORD)}
    best = {row["record_id"]: row for row in pulse_rows(pulses) if row["best"]}
    further = [column for column, name in _SOME.items() if name in response]
    for answers in _response_columns(response):
        answer = {key: answers[key][0] for key in ("record_id", "components")}
        name = answer["record_id"]
        record, pulse = _of_motion(answer, rows_of_records), best.get(name, _NO_PULSE)
        short = _short_name(record)
        of_motion = {
            **pulse,
            **record,
            "record": name
            if _short_name(rows_of_records[_first_of(answer)]) in shared_names
            else short,
            "pulse_p_value": pulse["p_value"],
        }
        forces = FORCE_CELLS if FORCE_CELLS[0] in answers else ()
        count = len(answers["structure"])
        yield {
            column: answers[column] if column in answers else count * [of_motion[column]]
            for column in (*_COLUMNS, *further, *forces)
        }


def _records_of(response: Dataset, names: Sequence[str]) -> list[str]:
    """Return the records of each motion, with spaces between them."""
    if "components" not in response:
        return [*names]
    texts = map(str, response["components"].values)
    return [records or name for records, name in zip(texts, names, strict=True)]


def _first_of(answer: Row) -> str:
    """Return the record of a motion, or of its first component."""
    return str(answer["components"] or answer["record_id"]).split()[0]


def _of_motion(answer: Row, records: Mapping[str, Row]) -> Row:
    """Return the columns of the record of a motion; of both components, those that they share, and
    the peaks of their vector.
    """
    if not answer["components"]:
        return records[answer["record_id"]]
    first = records[_first_of(answer)]
    peaks = {"pga_g": first["pga_rotd100_g"], "pgv_m_s": first["pgv_rotd100_m_s"]}
    return first | {"record_id": answer["record_id"], "component": "both", **peaks}


@contextmanager
def _dataset(content: Path | Dataset, kind: str) -> Iterator[Dataset]:
    """Yield the dataset of a file, or the dataset itself."""
    if isinstance(content, Path):
        with opened_arrays(content, kind, empty=True) as dataset:
            yield dataset
    else:
        yield content


def _file(content: Path | Dataset) -> Path:
    return content if isinstance(content, Path) else Path(f"{content.attrs['rockframe_kind']}.nc")


def _places(dataset: Dataset) -> dict[str, int]:
    """Return the place of each record in a dataset."""
    names = dataset["record_id"].values if "record_id" in dataset else ()
    return {str(name): place for place, name in enumerate(names)}


def _some(dataset: Dataset, places: Mapping[str, int], names: Sequence[str]) -> Dataset:
    """Return the part of a dataset from the first to the last of the named records."""
    present = [places[name] for name in names if name in places]
    first, last = (min(present), max(present)) if present else (0, -1)
    return dataset.isel(record=slice(first, last + 1)) if "record_id" in dataset else dataset


def _short_name(record: Row) -> str:
    """Return the station and component of a record; without both, its record_id."""
    parts = (record["station"], record["component"])
    return "/".join(part for part in parts if part) or str(record["record_id"])


def response_rows(responses: Path | Dataset) -> Iterator[Row]:
    """Yield a row for each record and structure; units are in the names.

    Parameters
    ----------
    responses : Path or Dataset
        Output of the respond stage, or what `write_responses` returned.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with _dataset(responses, RESPONSE) as dataset:
        if "record_id" in dataset:  # not a batch without accepted records
            for part in blocks(dataset):
                yield from rows_of_columns(_response_columns(part))


def _response_columns(responses: Dataset) -> Iterator[Columns]:
    """Yield the columns of the rows of each motion of a block of records."""
    forces, robust = force_cells(responses), ROBUST[0] in responses
    for columns in columns_along(responses, "record structure", _OF_RESPONSE):
        count = len(columns["structure"])
        unknown = count * [math.nan]
        # NaN does not equal itself, so that no verdict would be found again
        given = ([None if v != v else v for v in columns[key]] for key in _OF_VERDICT)
        verdicts = [*map(_words_of_verdict, *given)]
        for key in ("largest_scale", "safe_islands"):  # not searched if nothing is computed
            pairs = zip(columns[key], verdicts, strict=True)
            columns[key] = [value if computed else math.nan for value, (_, computed) in pairs]
        columns["largest_robust_scale"] = columns["largest_scale"] if robust else unknown
        if columns["components"][0]:  # no critical scale of the structures as given was searched
            columns |= {"largest_scale": unknown, "safe_islands": unknown}
        columns["verdict_words"] = [words for words, _ in verdicts]
        further = [*islice(forces, count)]
        yield columns | {key: [row[key] for row in further] for key in further[0]}


#: Columns that the words of a verdict follow from.
_OF_VERDICT: Final = (
    *("verdict", "overturning_time_s", "share_overturned", "share_uplifted", "share_model_ends"),
    *(f"{name}_s" for name in MODEL_ENDS),
    *("model_end", "kind"),
)


@lru_cache(maxsize=4096)
def _words_of_verdict(*values: str | float | None) -> tuple[str, bool]:
    """Return the words of a verdict, and False if the response was not computed."""
    verdict = spread_verdict(dict(zip(_OF_VERDICT, values, strict=True)))
    return verdict.words, verdict.is_computed


#: Variable of each column of `part_rows`.
_OF_PART: Final = columns_of(
    "record_id structure start_rotation_ratio=part_start_rotation_ratio",
    "peak_rotation_ratio=part_peak_rotation_ratio peak_u_m=part_peak_u",
    "tendon_force_n=part_tendon_force dissipater_force_n=part_dissipater_force",
)


def part_rows(response: Dataset) -> list[Row]:
    """Return a row for each structure and motion of each sequence; units in the names of columns.

    `motion` counts the motions of a sequence from 1, and `motion_id` is the record of each. The
    forces are those when the motion begins.

    Parameters
    ----------
    response : Dataset
        Output of the respond stage.
    """
    if "parts" not in response:
        return []
    part_texts = [text.split("; ") if text else [] for text in map(str, response["parts"].values)]
    sequences = [list(map(Part.of, texts)) for texts in part_texts]
    rows = rows_along(response, "record structure part", _OF_PART)
    listed: list[Row] = []
    for parts in sequences:
        for _, k in np.ndindex(response.sizes["structure"], response.sizes["part"]):
            row = next(rows)
            if k < len(parts):
                times = {"start_s": parts[k].start, "end_s": parts[k].end}
                listed.append({**row, "motion": k + 1, "motion_id": parts[k].record_id, **times})
    return listed


def part_columns(rows: Sequence[Row]) -> list[Column]:
    """Return the columns of `part_rows` that a terminal prints; forces only if there are any."""
    forces = {"Tendon [kN]>": "tendon_force_n", "Dissipater [kN]>": "dissipater_force_n"}
    return [
        Column("Record", "record_id"),
        Column("Structure", "structure"),
        Column("Motion", rule=lambda row, _: f"{row['motion']} {row['motion_id']}"),
        Column("from [s]>", "start_s", ".6g"),
        Column("to [s]>", "end_s", ".6g", priority=2),
        Column("θ/α before>", "start_rotation_ratio", ".3f"),
        Column("largest θ/α>", "peak_rotation_ratio", ".3f"),
        Column("u [cm]>", "peak_u_m", ".1f", 100.0),
        *(
            Column(head, key, ".1f", 1e-3)
            for head, key in forces.items()
            if any(not math.isnan(row[key]) for row in rows)
        ),
    ]
