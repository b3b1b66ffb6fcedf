"""The steps of a study: the one list that `run`, `status`, `verify` and the workflow follow."""

from __future__ import annotations

from typing import Final

from rockframe.provenance import MANIFEST
from rockframe.runs.further import STRUCTURES, THREADS, further_steps, options
from rockframe.runs.step import Step
from rockframe.study import Study

#: The list of the record files and their hashes; written first, it makes the graph static.
INPUTS: Final = "inputs.csv"
#: The page of the run.
PAGE: Final = "report.html"
#: More batches would only cost starts; three stages of so many stay below 500 jobs.
_MOST_BATCHES: Final = 150


def steps_of(study: Study, files: int) -> list[Step]:
    """Return the steps of a study, each behind those that it needs.

    Parameters
    ----------
    study : Study
        What is to be done.
    files : int
        Number of its record files.
    """
    steps: list[Step] = []
    if study.records:
        batches = min(_MOST_BATCHES, -(-files // study.tables.batches.records))
        needs = ["records.nc", STRUCTURES, *(["pulses.nc"] if study.tables.respond.pulses else [])]
        steps += [
            _ingest(study),
            *_in_batches("pulse", "pulses.nc", ("records.nc",), _pulse(study), batches),
            *_in_batches("respond", "response.nc", tuple(needs), _respond(study), batches),
            *further_steps(study),
            *_table(),
        ]
    else:
        steps += further_steps(study)
    steps += _draw(study, steps)
    return [*steps, *_last(study, steps)]


def _ingest(study: Study) -> Step:
    table = study.tables.records
    assert table is not None  # noqa: S101 - a study with records has their table
    command = ["ingest", *map(str, study.records), "--output", "records.nc"]
    command += options(
        {
            "--units": table.units,
            "--time-step": table.time_step_s,
            "--water-level": table.water_level_db,
            "--band-pass": table.band_pass_hz,
            "--uncorrected": table.uncorrected,
            "--strict": table.strict,
            "--azimuth": table.azimuth_degree,
            "--strike": table.strike_degree,
        }
    )
    for option in ("station_xml", "catalogue", "limits"):
        stated = getattr(table, option)
        if stated is not None:
            command += [f"--{option.replace('_', '-')}", str(study.beside(stated))]
    command += options(
        {
            "--magnitude": study.tables.filters.magnitude,
            "--distance-km": study.tables.filters.epicentral_distance_km,
            "--vs30": study.tables.filters.vs30_m_s,
            "--pga-g": study.tables.filters.pga_g,
            "--pgv": study.tables.filters.pgv_m_s,
        }
    )
    outputs = ("records.nc", "records.csv")
    return Step(
        *("ingest", "ingest", tuple(command), (INPUTS,), outputs),
        threads=THREADS,
        workers=True,
        memory=4000,
    )


def _pulse(study: Study) -> list[str]:
    table = study.tables.pulse
    words = ["pulse", "records.nc", *options({"--periods": table.periods_s})]
    words += [word for wavelet in table.wavelet or () for word in ("--wavelet", wavelet)]
    return words + options(
        {
            "--pulse-wavelet": table.pulse_wavelet,
            "--weighting": table.weighting,
            "--most-half-cycles": table.most_half_cycles,
            "--runners-up": table.runners_up,
            "--surrogates": table.surrogates,
            "--scrambling": table.scrambling,
            "--seed": table.seed,
        }
    )


def _respond(study: Study) -> list[str]:
    table = study.tables.respond
    stated: dict[str, object] = {
        "--vertical": table.vertical,
        "--histories": table.histories,
        "--no-margins": not table.margins,
        "--pulses": "pulses.nc" if table.pulses else None,
    }
    return ["respond", "records.nc", "--structures", STRUCTURES, *options(stated)]


def _in_batches(
    rule: str, output: str, inputs: tuple[str, ...], command: list[str], batches: int
) -> list[Step]:
    """A stage on all records at once, or on batches of them, which are then put together."""
    if batches <= 1:
        return [
            Step(
                *(rule, rule, (*command, "--output", output), inputs, (output,)),
                threads=THREADS,
                workers=True,
                memory=2000,
            )
        ]
    parts = [f"batches/{output.removesuffix('.nc')}-{k:03d}.nc" for k in range(1, batches + 1)]
    alone = ("--workers", "1")  # the batches are the parallel part
    steps = [
        Step(
            f"{rule}-{k:03d}",
            rule,
            (*command, "--batch", f"{k}/{batches}", *alone, "--output", part),
            inputs,
            (part,),
            temporary=True,
            memory=2000,
        )
        for k, part in enumerate(parts, 1)
    ]
    words = ("merge", *parts, "--output", output)
    merged = Step(f"merge-{rule}", f"merge_{rule}", words, tuple(parts), (output,), memory=4000)
    return [*steps, merged]


def _table() -> list[Step]:
    files = ("records.nc", "pulses.nc", "response.nc")
    words = ("table", *files, "--output", "table.csv")
    return [Step("table", "table", words, files, ("table.csv",))]


def _draw(study: Study, steps: list[Step]) -> list[Step]:
    """The figures of what the stages give."""
    most = study.tables.figures.most
    made = [name for step in steps for name in step.outputs]
    of_records = study.records and study.tables.respond.histories != "none"
    files = ["records.nc", "pulses.nc", "response.nc"] if of_records else []
    files += [n for n in ("screen.nc", "spectrum.nc", "rocking_spectrum.nc") if n in made]
    if not files or not most:
        return []
    words = ("draw", *files, "--most", str(most), "--output", "figures/")
    return [Step("draw", "draw", words, tuple(files), ("figures/",))]


def _last(study: Study, steps: list[Step]) -> list[Step]:
    """The manifest of all that stays, the page that shows it, and whether all is whole."""
    kept = [name for step in steps if not step.temporary for name in step.outputs]
    manifest = Step("manifest", "manifest", ("manifest", "."), tuple(kept), (MANIFEST,))
    verify = ("verify", ".")
    if not study.records:
        return [manifest, Step("verify", "verify", verify, (MANIFEST,), (), may_reject=False)]
    of_page = study.tables.report
    limits = {"--histories": of_page.histories, "--rows": of_page.rows}
    words = ("report", ".", *options(limits))
    page = Step("report", "report", words, (MANIFEST,), (PAGE,))
    whole = Step("verify", "verify", verify, (MANIFEST, PAGE), (), may_reject=False)
    return [manifest, page, whole]
