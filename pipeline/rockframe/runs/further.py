"""The steps of a study that are done only if it asks for them: screening and spectra."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from rockframe.runs.step import Step
from rockframe.study import Study

#: The structures of the study, as the stages read them.
STRUCTURES: Final = "structures.toml"
#: Most processes of a step that computes in a pool of its own.
THREADS: Final = 8


def further_steps(study: Study) -> list[Step]:
    """Return the steps of the tables ``[screen]``, ``[spectrum]``, ``[rocking_spectrum]``.

    Parameters
    ----------
    study : Study
        What is to be done.
    """
    steps = (_screen(study), _spectrum(study), _rocking_spectrum(study))
    return [step for step in steps if step is not None]


def _screen(study: Study) -> Step | None:
    table = study.tables.screen
    if table is None:
        return None
    like = None if table.pulse_like is None else "yes" if table.pulse_like else "no"
    stated: dict[str, object] = {
        "--scales": table.scales,
        "--azimuths": table.azimuths_degree,
        "--vertical": table.vertical,
        "--histories": table.histories,
        "--no-margins": not table.margins,
        "--pulse-period-s": table.pulse_period_s,
        "--pulse-length-m": table.pulse_length_m,
        "--pulse-like": like,
        "--hazard": None if table.hazard is None else str(study.beside(table.hazard)),
        "--seed": table.seed,
    }
    if table.design is not None:
        stated |= {
            "--design": table.design.dimension,
            "--design-range": table.design.range,
            "--design-limit": table.design.limit,
            "--design-share": table.design.share,
            "--design-steps": table.design.steps,
        }
    inputs = ("records.nc", "pulses.nc", STRUCTURES)
    words = ("screen", "records.nc", "--pulses", "pulses.nc", "--structures", STRUCTURES)
    return _step("screen", (*words, *options(stated)), inputs, ("screen.nc", "screen.csv"))


def _spectrum(study: Study) -> Step | None:
    table = study.tables.spectrum
    if table is None:
        return None
    stated = {
        "--wavelet": table.wavelet,
        "--slenderness-deg": table.slenderness_degree,
        "--mass-ratio": table.mass_ratio,
        "--frequency-ratio": table.frequency_ratio,
        "--max-amplitude": table.max_amplitude,
        "--amplitude-step": table.amplitude_step,
        "--phase-deg": table.phase_degree,
        "--half-cycles": table.half_cycles,
    }
    return _step("spectrum", ("spectrum", *options(stated)), (), ("spectrum.nc",))


def _rocking_spectrum(study: Study) -> Step | None:
    table = study.tables.rocking_spectrum
    if table is None:
        return None
    stated = {
        "--slenderness-deg": table.slenderness_degree,
        "--mass-ratio": table.mass_ratio,
        "--column-period": table.column_period_s,
    }
    words = ("spectrum", "--records", "records.nc", *options(stated))
    return _step("rocking_spectrum", words, ("records.nc",), ("rocking_spectrum.nc",))


def _step(
    name: str, words: tuple[str, ...], inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> Step:
    command = (*words, "--output", outputs[0])
    return Step(
        *(name, name, command, inputs, outputs),
        threads=THREADS,
        workers=True,
        memory=4000,
        minutes=720,
    )


def options(stated: Mapping[str, object]) -> list[str]:
    """Return words of options: nothing for what is not stated or false, no value for true.

    Examples
    --------
    >>> options({"--vertical": True, "--limit": None, "--range": (0.5, 2.0)})
    ['--vertical', '--range', '0.5', '2.0']
    """
    words: list[str] = []
    for option, value in stated.items():
        if value is None or value is False:
            continue
        words.append(option)
        if isinstance(value, tuple):
            words += [str(part) for part in value]
        elif value is not True:
            words.append(str(value))
    return words
