"""Fragilities of a screening for other programs: OpenQuake (NRML 0.5), oq-vmtk and Pelicun."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, Final

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from rockframe.cells import write_table
from rockframe.errors import InputError, ParameterError, require_known
from rockframe.options.respond import ExportOptions
from rockframe.provenance import refuse_overwriting, whole_file
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import fragility_curve, result_in_words
from rockframe.risk import LimitState, Outcome, measure_of, period_of

Float = NDArray[np.float64]

#: Measures of OpenQuake and of Pelicun, and their unit there over that of the measure's column:
#: OpenQuake has velocities in cm/s.
_KNOWN: Final = {
    "pga": ("PGA", 1.0, "Peak Ground Acceleration", "g"),
    "pgv": ("PGV", 100.0, "Peak Ground Velocity", "mps"),
}
#: Standard deviation of the logistic distribution of scale 1 over that of the normal one.
_UNIT: Final = np.pi / np.sqrt(3.0)
#: Characters that OpenQuake forbids in taxonomies, and those that it accepts in limit states.
_FORBIDDEN: Final = frozenset("#'\"")
_PLAIN: Final = re.compile(r"[^A-Za-z0-9_-]")
_LONGEST: Final = 100


@dataclass(frozen=True, eq=False)
class FragilityModel:
    """Fragilities of structures over one measure, at levels within the intensities tried.

    Parameters
    ----------
    measure : str
        Name of the measure.
    imt : str
        Its name in OpenQuake.
    curve : str
        Form of the fitted curves: lognormal or logistic.
    states : tuple of str
        Names of the limit states, the mildest first.
    taxonomies : tuple of str
        Name of each structure in the model.
    levels : array, shape (structures, levels)
        Intensities in the unit of OpenQuake (g or cm/s).
    probability : array, shape (structures, states, levels)
        Probability of reaching the limit state [1]; a milder state is at least as likely.
    median, beta : array, shape (structures, states)
        Parameters of the fitted curves, the median in g or m/s.
    notes : mapping of (str, str) to str
        Reasons why data do not determine a curve, by taxonomy and limit state.
    """

    measure: str
    imt: str
    curve: str
    states: tuple[str, ...]
    taxonomies: tuple[str, ...]
    levels: Float
    probability: Float
    median: Float
    beta: Float
    notes: Mapping[tuple[str, str], str] = field(default_factory=dict)


def fragility_model(screening: xr.Dataset, options: ExportOptions) -> FragilityModel:
    """Return the fitted fragilities of a screening as a model for other programs.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    options : ExportOptions
        Measure, structure, limit states, taxonomies, number of levels, and whether curves that the
        data do not determine are included.

    Raises
    ------
    ParameterError
        If a name is unknown, OpenQuake lacks the measure, limit states are of several quantities,
        a curve was not fitted or is not determined, or taxonomies are invalid.
    """
    imt, factor = _imt(screening, options.measure)
    structures = [str(name) for name in screening["structure"].values]
    if options.structure is not None:
        require_known("structure", options.structure, structures)
        structures = [options.structure]
    limits = _limit_states(screening, options.limit_state)
    chosen = screening.sel(
        structure=structures, limit_state=[limit.name for limit in limits], measure=options.measure
    )
    reasons = _undetermined(chosen, limits, allowed=options.undetermined)
    printed = measure_of(options.measure).printed
    median = chosen["fragility_median"].transpose("structure", "limit_state").values / printed
    beta = chosen["fragility_lognormal_beta"].transpose("structure", "limit_state").values
    tried = chosen.isel(limit_state=-1)
    levels = np.geomspace(
        tried["fragility_lowest"].values / printed,
        tried["fragility_highest"].values / printed,
        options.levels,
        axis=-1,
    )
    curve = fragility_curve(screening)
    argument = np.log(levels[:, None] / median[:, :, None]) / beta[:, :, None]
    probability = (
        scipy.special.ndtr(argument)
        if curve == "lognormal"
        else scipy.special.expit(argument * _UNIT)
    )
    # Fitted curves may cross, but whoever reaches a severe state has reached the milder ones.
    nested = np.maximum.accumulate(probability[:, ::-1], axis=1)[:, ::-1]
    taxonomies = _taxonomies(structures, options.taxonomy)
    named = dict(zip(structures, taxonomies, strict=True))
    return FragilityModel(
        measure=options.measure,
        imt=imt,
        curve=curve,
        states=tuple(_state(limit) for limit in limits),
        taxonomies=taxonomies,
        levels=levels * factor,
        probability=nested,
        median=median,
        beta=beta,
        notes={(named[name], _state(limit)): why for (name, limit), why in reasons.items()},
    )


def _state(limit: LimitState) -> str:
    """Return the name of a limit state in OpenQuake."""
    return _PLAIN.sub("_", limit.name)


def _imt(screening: xr.Dataset, name: str) -> tuple[str, float]:
    """Return the name of a measure in OpenQuake, and the size of its unit there."""
    require_known("measure", name, [str(measure) for measure in screening["measure"].values])
    if name in _KNOWN:
        return _KNOWN[name][:2]
    if not (period := period_of(name)):
        message = f"Invalid measure {name!r}: OpenQuake does not know it. "
        raise ParameterError(f"{message}Must be pga, pgv or a spectral acceleration.")
    return f"SA({period:g})", 1.0


def _limit_states(screening: xr.Dataset, stated: Sequence[str] | None) -> list[LimitState]:
    """Return the limit states, the mildest first and overturning last."""
    names = [str(name) for name in screening["limit_state"].values]
    for name in stated or ():
        require_known("limit state", name, names)
    limits = [LimitState.named(name) for name in dict.fromkeys(stated or names)]
    quantities = sorted({limit.quantity for limit in limits if limit.quantity})
    if len(quantities) > 1:
        listed = ", ".join(names)
        raise ParameterError(
            f"Invalid limit states of {len(quantities)} quantities ({', '.join(quantities)}): none "
            f"includes the other. Choose those of one with --limit-state: {listed}."
        )
    return sorted(limits, key=lambda limit: (not limit.quantity, limit.value))


def _undetermined(
    chosen: xr.Dataset, limits: Sequence[LimitState], *, allowed: bool
) -> dict[tuple[str, LimitState], str]:
    """Return the reasons of the curves that data do not determine, if these are allowed; require
    all others to be fitted.
    """
    measure, reasons = measure_of(str(chosen["measure"].item())), {}
    for structure in map(str, chosen["structure"].values):
        for limit in limits:
            fit = chosen.sel(structure=structure, limit_state=limit.name)
            said = result_in_words(fit, limit, measure)
            undetermined = int(fit["fragility_outcome"]) == Outcome.UNDETERMINED
            finite = 0.0 < float(fit["fragility_median"]) < np.inf
            if said and not (allowed and undetermined and finite):
                do = "Choose others with --structure or --limit-state"
                also = ", or export it with --undetermined" if undetermined and finite else ""
                message = f"No curve of {structure!r}, {limit.words}: {said}. {do}{also}."
                raise ParameterError(message)
            if said:
                reasons[structure, limit] = said
    return reasons


def _taxonomies(structures: Sequence[str], names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the taxonomy of each structure: as stated, otherwise its name."""
    named = dict.fromkeys(structures, "")
    for text in names or ():
        name, equals, taxonomy = text.partition("=")
        if len(structures) == 1 and name not in named:
            name, taxonomy = structures[0], text
        elif not equals or name not in named:
            allowed = ", ".join(structures)
            raise ParameterError(
                f"Invalid taxonomy {text!r}. Must be STRUCTURE=TAXONOMY, with one of: {allowed}."
            )
        named[name] = taxonomy
    taxonomies = tuple(taxonomy or name for name, taxonomy in named.items())
    for taxonomy in taxonomies:
        plain = taxonomy.isascii() and taxonomy.isprintable() and not _FORBIDDEN & {*taxonomy}
        if not plain or len(taxonomy) > _LONGEST or taxonomies.count(taxonomy) > 1:
            must = f"at most {_LONGEST} ASCII characters without # and quotes, and different ones"
            raise ParameterError(f"Invalid taxonomy {taxonomy!r}. Must be {must}.")
    return taxonomies


def as_nrml(model: FragilityModel) -> str:
    """Return a model as NRML 0.5: discrete functions, zero at zero, constant above the levels."""
    states = " ".join(model.states)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">',
        '<fragilityModel id="rockframe" assetCategory="structures" lossCategory="structural">',
        "<description>Rocking frames, by rockframe: levels within the intensities tried, "
        f"{model.curve} curves{escape(''.join(f'; {note}' for note in all_notes(model)))}"
        "</description>",
        f"<limitStates>{escape(states)}</limitStates>",
    ]
    for k, taxonomy in enumerate(model.taxonomies):
        lines += [
            f'<fragilityFunction id="{escape(taxonomy)}" format="discrete">',
            f'<imls imt="{model.imt}">{_numbers(model.levels[k])}</imls>',
            *(
                f'<poes ls="{state}">{_numbers(model.probability[k, place])}</poes>'
                for place, state in enumerate(model.states)
            ),
            "</fragilityFunction>",
        ]
    return "\n".join([*lines, "</fragilityModel>", "</nrml>", ""])


def _numbers(values: Float) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def all_notes(model: FragilityModel) -> list[str]:
    """Return a sentence for each curve of a model that its data do not determine."""
    return [f"{taxonomy}, {state}: {why}" for (taxonomy, state), why in model.notes.items()]


def _note(model: FragilityModel, taxonomy: str) -> dict[str, str]:
    """Return the last column of the tables if data do not determine all curves of the model."""
    notes = [f"{state}: {why}" for (name, state), why in model.notes.items() if name == taxonomy]
    return {"Note": "; ".join(notes)} if model.notes else {}


def curve_rows(model: FragilityModel) -> Iterator[dict[str, Any]]:
    """Yield a row for each structure and level: intensity, and the probability of each state.

    The columns are the arguments `intensities` and `poes` of oq-vmtk.
    """
    for k, taxonomy in enumerate(model.taxonomies):
        note = _note(model, taxonomy)
        for place, level in enumerate(model.levels[k]):
            reached = dict(zip(model.states, model.probability[k, :, place], strict=True))
            yield {"taxonomy": taxonomy, "imt": model.imt, "iml": level, **reached, **note}


def pelicun_rows(model: FragilityModel) -> Iterator[dict[str, Any]]:
    """Yield a row for each structure, as in the damage databases of Pelicun."""
    if model.measure in _KNOWN:
        demand, unit = _KNOWN[model.measure][2:]
    else:
        demand, unit = f"Peak Spectral Acceleration|{period_of(model.measure):g}", "g"
    for k, taxonomy in enumerate(model.taxonomies):
        row: dict[str, Any] = {
            "ID": taxonomy,
            "Incomplete": 0,
            "Demand-Type": demand,
            "Demand-Unit": unit,
            "Demand-Offset": 0,
            "Demand-Directional": 1,
        }
        for number, (median, beta) in enumerate(zip(model.median[k], model.beta[k], strict=True)):
            row |= {
                f"LS{number + 1}-Family": "lognormal",
                f"LS{number + 1}-Theta_0": median,
                f"LS{number + 1}-Theta_1": beta,
                f"LS{number + 1}-DamageStateWeights": "",
            }
        yield row | _note(model, taxonomy)


def export_paths(output: Path, curve: str = "lognormal") -> dict[str, Path]:
    """Return the paths of the files of a model, by kind.

    Pelicun's table needs lognormal curves.

    Examples
    --------
    >>> [path.name for path in export_paths(Path("site.xml")).values()]
    ['site.xml', 'site-curves.csv', 'site-pelicun.csv']
    """
    kinds = ["curves", *["pelicun"] * (curve == "lognormal")]
    return {"nrml": output} | {
        kind: output.with_name(f"{output.stem}-{kind}.csv") for kind in kinds
    }


def export_fragility(
    screen_path: Path, output: Path, options: ExportOptions
) -> tuple[FragilityModel, Mapping[str, Path]]:
    """Write the fragilities of a screening for OpenQuake, oq-vmtk and Pelicun.

    Parameters
    ----------
    screen_path : Path
        Output of the screen stage.
    output : Path
        The NRML file to write; the tables are written beside it.
    options : ExportOptions
        Measure, structure, limit states, taxonomies and number of levels.

    Returns
    -------
    FragilityModel, mapping of str to Path
        The model, and the written files by kind.

    Raises
    ------
    InputError
        If the screening cannot be read, or a file cannot be written.
    ParameterError
        As `fragility_model`.
    """
    screening = read_screening(screen_path, every_scale=False)
    model = fragility_model(screening, options)
    paths = export_paths(output, model.curve)
    refuse_overwriting(paths.values(), [screen_path], beside=output)
    if output.suffix.lower() != ".xml":
        raise InputError(output, "must end in .xml.")
    with whole_file(paths["nrml"]) as partial:
        partial.write_text(as_nrml(model), encoding="utf-8")
    for kind, rows in (("curves", curve_rows), ("pelicun", pelicun_rows)):
        if kind in paths:
            with (
                whole_file(paths[kind]) as partial,
                partial.open("w", encoding="utf-8", newline="") as stream,
            ):
                write_table(stream, rows(model))
    return model, paths
