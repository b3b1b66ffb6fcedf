"""Data for the script of the page: histories as compressed float32, labelled values as text."""

from __future__ import annotations

import base64
import io
import math
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rockframe.cells import write_table
from rockframe.frame import unusual
from rockframe.results.run import Ground, History, Run, rank
from rockframe.results.tables.columns import stated_pulse, stated_verdict
from rockframe.results.tables.rows import LabelledValue
from rockframe.rocking import StatedVerdict
from rockframe.signals.passport import CHECKS
from rockframe.units import GRAVITY
from rockframe.web import strip_svg

#: Exponents in CF units become superscripts.
_SUPERSCRIPTS: Final = str.maketrans("-123", "⁻¹²³")
#: Values that the page shows elsewhere, or uses only internally.
_NOT_SHOWN: Final = frozenset(
    ["row_size", "history", "passport", "source_sha256", "samples_sha256"]
)
#: Values that are not shown for structures that overturn, because they only describe the fall.
_OF_THE_FALL: Final = frozenset(["peak_rotation_ratio", "peak_u", "peak_v"])


def encode(values: ArrayLike) -> str:
    """Encode samples as little-endian float32, deflated (zlib), in base64; NaN stays NaN.

    Examples
    --------
    >>> samples = zlib.decompress(base64.b64decode(encode([0.5, -0.25])))
    >>> np.frombuffer(samples, dtype="<f4").tolist()
    [0.5, -0.25]
    """
    return pack(np.asarray(values, dtype="<f4").tobytes())


def pack(content: bytes) -> str:
    """Deflate bytes (zlib) and encode them in base64.

    Examples
    --------
    >>> zlib.decompress(base64.b64decode(pack(b"a,b")))
    b'a,b'
    """
    return base64.b64encode(zlib.compress(content, 9)).decode("ascii")


def choose(run: Run, limit: int) -> list[tuple[str, str]]:
    """Return the records and structures whose histories the page shows, in the order of the table.

    Parameters
    ----------
    run : Run
        The run.
    limit : int
        Largest number of histories; if there are more, those that `rank` puts first are chosen.

    Returns
    -------
    list of (str, str)
        Identifiers of records and structures.
    """
    pairs = [(row["record_id"], row["structure"]) for row in run.rows]
    there = [i for i, pair in enumerate(pairs) if _has_history(run.pairs[pair])]
    best = sorted(there, key=lambda i: rank(run.rows[i]))[:limit]
    return [pairs[i] for i in sorted(best)]


def _has_history(facts: Iterable[LabelledValue]) -> bool:
    return any(fact.name == "history" and fact.value == "kept" for fact in facts)


def payload(
    run: Run, motions: Iterable[tuple[Ground, Sequence[History]]]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the labelled values and the encoded samples of the histories on the page.

    Parameters
    ----------
    run : Run
        The run.
    motions : iterable of (Ground, sequence of History)
        Motions and histories on the page.

    Returns
    -------
    facts : dict
        JSON values: ``name``, ``gravity``, ``grounds``, ``structures`` and ``pairs``.
    samples : dict of str to str
        ``table``: the rows as CSV, encoded by `pack`. Encoded by `encode`: ``g0`` and ``p0``,
        motion and pulse of the first record; ``theta0``, ``u0`` and ``v0``, the first history.
    """
    grounds: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = []
    table = io.StringIO()
    write_table(table, run.rows)
    samples = {"table": pack(table.getvalue().encode("utf-8"))}
    row_of = {(row["record_id"], row["structure"]): i for i, row in enumerate(run.rows)}
    entry_of = {entry["record_id"]: entry for entry in run.entries}
    for ground, histories in motions:
        i = len(grounds)
        samples[f"g{i}"], samples[f"p{i}"] = encode(ground.acceleration), encode(ground.pulse)
        grounds.append(_ground(run, ground, entry_of.get(ground.record, {})))
        for history in histories:
            pair = (history.record, history.structure)
            for name in ("theta", "u", "v"):
                samples[f"{name}{len(pairs)}"] = encode(getattr(history, name))
            row = run.rows[row_of[pair]]
            stated = stated_verdict(row)
            grounds[i]["pulse"] = stated_pulse(row)
            pairs.append(
                {
                    "row": row_of[pair],
                    "ground": i,
                    "record": row["record"],
                    "event": row["event"],
                    "structure": history.structure,
                    "kind": stated.kind,
                    "words": stated.words,
                    "overturns": stated.overturns,
                    "strip": strip_svg(run.strips[pair]) if pair in run.strips else "",
                    "peak": _finite(row["peak_rotation_ratio"]),
                    "facts": _texts(_of_pair(run.pairs[pair], stated)),
                }
            )
    structures = {name: _structure(facts) for name, facts in run.structures.items()}
    return {
        "name": run.name,
        "gravity": GRAVITY,
        "grounds": grounds,
        "structures": structures,
        "pairs": pairs,
    }, samples


def _of_pair(facts: Iterable[LabelledValue], stated: StatedVerdict) -> list[LabelledValue]:
    """Return the values to show, with the verdict in the words of the table."""
    return [
        replace(fact, value=stated.words) if fact.name == "verdict" else fact
        for fact in facts
        if not (fact.name in _OF_THE_FALL and stated.overturns)
    ]


def _ground(run: Run, ground: Ground, entry: Mapping[str, str]) -> dict[str, Any]:
    return {
        "id": ground.record,
        "step": ground.time_step,
        "pulseStart": ground.pulse_start,
        "facts": _texts(run.records[ground.record]),
        "checks": checks(entry),
        "passport": entry.get("passport", ""),
    }


def _structure(facts: Sequence[LabelledValue]) -> dict[str, Any]:
    """Return the geometry for the drawing, and the labelled values."""
    wanted = ("height", "width", "top_contact_width", "mass_ratio", "slenderness")
    known: dict[str, Any] = {fact.name: fact.value for fact in facts if fact.name in wanted}
    words = unusual(*(known[name] for name in ("height", "mass_ratio", "slenderness")))
    return {
        **known,
        "facts": [*([["unusual", words]] if words else []), *_texts(facts)],
    }


def checks(entry: Mapping[str, str]) -> list[list[str]]:
    """Return name, value, limit and verdict of each check in a row of ``records.csv``.

    Examples
    --------
    >>> checks({"clipped_samples": "1.0", "clipped_samples_limit": "4.0",
    ...         "clipped_samples_verdict": "ok"})
    [['clipped samples', '1', '≤ 4', 'ok']]
    """
    names = [key.removesuffix("_verdict") for key in entry if key.endswith("_verdict")]
    return [
        [
            name.replace("_", " ").replace("arias", "Arias"),
            _short(name, entry[name]),
            f"{'≥' if CHECKS[name][1] else '≤'} {_short(name, entry[f'{name}_limit'])}",
            entry[f"{name}_verdict"],
        ]
        for name in names
        if entry[f"{name}_verdict"]
    ]


def _short(check: str, number: str) -> str:
    return (
        with_unit(LabelledValue(check, "", float(number), CHECKS[check][0]))
        if number
        else "not known"
    )


def _finite(number: str) -> float | None:
    return float(number) if number and math.isfinite(float(number)) else None


def _texts(facts: Sequence[LabelledValue]) -> list[list[str]]:
    """Return label and value with unit of each known value."""
    known = [
        fact
        for fact in facts
        if fact.name not in _NOT_SHOWN
        and not (isinstance(fact.value, float) and math.isnan(fact.value))
        and fact.value != ""
    ]
    return [[fact.label, with_unit(fact)] for fact in known]


def with_unit(fact: LabelledValue) -> str:
    """Return a labelled value with its unit, as text.

    Examples
    --------
    >>> with_unit(LabelledValue("pga", "peak ground acceleration", 5.5346, "m s-2")).split()
    ['5.535', 'm', 's⁻²']
    """
    if isinstance(fact.value, str):
        return fact.value.replace("_", " ") if fact.name == "best_wavelet" else fact.value
    whole = fact.value.is_integer() and abs(fact.value) < 1e9
    number = f"{fact.value:.0f}" if whole else f"{fact.value:.4g}"
    parts = [part.translate(_SUPERSCRIPTS) for part in fact.units.split() if part != "1"]
    return "\N{NO-BREAK SPACE}".join([number.replace("-", "−"), *parts])
