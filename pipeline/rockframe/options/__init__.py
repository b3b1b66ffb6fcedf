"""The stages, each declared once; the modules of this room hold their options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Final

#: File of the records of a run, and file of its structures.
RECORDS_FILE: Final = "records.nc"
STRUCTURES: Final = "structures.toml"


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A stage: what it reads, computes and writes.

    A run of a study calls `function` with the files it reads as ``records_path``,
    ``structures_path`` and so on, with ``output`` and ``options``, and with ``batch`` and
    ``engine`` where they are declared. The function returns the rejected records, if it can reject
    any. Functions and models are named, not imported, so that a command loads only those it uses.

    Parameters
    ----------
    name : str
        The step of a run, and the table of a study.
    function, options : str
        Module and name of the function, and of the model of its options.
    inputs, outputs : tuple of str
        Files of a run. The first output is a netCDF file; its name is that of its kind.
    asked : mapping of str to str
        For a file that is read or written only if it is asked for, the option that asks for it.
    variables : str
        Module in `rockframe.results.schema`, and name of the declaration of the netCDF file.
    figures : str
        Module and name of the function that draws figures of the netCDF file; empty without
        figures. It takes the file and the largest number of figures of single records, and yields
        the name of each figure, what it shows, and the figure.
    command, summary : str
        Module in `rockframe.cli` of the command with the stage's name, and what the command does.
        Empty for a stage that belongs to another command.
    foreseen : str
        Module and name of a function that takes the options and the structures of a study, and
        raises the errors that follow from them alone; a plan calls it. Empty without such errors.
    requested : bool
        True if the stage runs only if the study has its table.
    batches : bool
        True if the stage can compute a batch of the records.
    of_all_records : tuple of str
        Options of results that need all records. The function computes these from the files of the
        batches, its ``shards``; without any, an index of the files is all that is needed.
    engine : bool
        True if the stage computes in several processes.
    progress : bool
        True if the function reports its progress to a callback.
    memory : int
        Memory that the stage may need [MB].
    minutes : int
        Time that the stage may take [min].
    """

    name: str
    function: str
    options: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    asked: Mapping[str, str] = field(default_factory=dict)
    variables: str
    figures: str = ""
    command: str = ""
    summary: str = ""
    foreseen: str = ""
    requested: bool = True
    batches: bool = False
    of_all_records: tuple[str, ...] = ()
    engine: bool = True
    progress: bool = True
    memory: int = 4000
    minutes: int = 720

    @property
    def file(self) -> str:
        """The netCDF file that the stage writes."""
        return self.outputs[0]

    @property
    def kind(self) -> str:
        """The kind of the netCDF file that the stage writes: its name without ``.nc``."""
        return self.file.removesuffix(".nc")

    @property
    def of_records(self) -> bool:
        """True if the stage reads the records."""
        return RECORDS_FILE in self.inputs

    def files(self, names: Sequence[str], options: Mapping[str, Any]) -> tuple[str, ...]:
        """Return those of the inputs or outputs that the options ask for.

        Examples
        --------
        >>> STAGES["respond"].files(STAGES["respond"].inputs, {"pulses": False})
        ('records.nc', 'structures.toml')
        """
        return tuple(n for n in names if n not in self.asked or options[self.asked[n]])


_DECLARED: Final = (
    Stage(
        name="pulse",
        function="stages.pulse.pulse_stage",
        options="options.pulse.PulseOptions",
        inputs=(RECORDS_FILE,),
        outputs=("pulses.nc",),
        variables="response.PULSES_NC",
        command="stages.pulse",
        summary="find the acceleration pulse (a_p, T_p) of each record",
        requested=False,
        batches=True,
        memory=2000,
        minutes=60,
    ),
    Stage(
        name="respond",
        function="stages.respond.respond_stage",
        options="options.respond.RespondOptions",
        inputs=(RECORDS_FILE, STRUCTURES, "pulses.nc"),
        outputs=("response.nc",),
        asked={"pulses.nc": "pulses"},
        foreseen="stages.respond.foresee_respond",
        variables="response.RESPONSE_NC",
        command="stages.respond",
        summary="compute the rocking response of structures to records",
        requested=False,
        batches=True,
        memory=2000,
        minutes=60,
    ),
    Stage(
        name="screen",
        function="stages.screen.screen_stage",
        options="options.respond.ScreenOptions",
        inputs=(RECORDS_FILE, "pulses.nc", STRUCTURES),
        outputs=(
            *("screen.nc", "screen.csv", "scenarios.csv", "fragility.csv"),
            *("pooled.csv", "rates.csv", "design.csv"),
        ),
        asked={"pooled.csv": "pooled", "rates.csv": "hazard", "design.csv": "design"},
        foreseen="stages.screen.foresee_screen",
        variables="response.SCREEN_NC",
        figures="stages.screen.screening_figures",
        command="stages.screen",
        summary="screen structures by many records at many scales",
        batches=True,
        of_all_records=("histories", "fragility_curve", "pooled", "seed", "design"),
    ),
    Stage(
        name="spectrum",
        function="stages.spectrum.spectrum_stage",
        options="options.respond.SpectrumOptions",
        inputs=(),
        outputs=("spectrum.nc",),
        foreseen="stages.spectrum.foresee_spectrum",
        variables="response.SPECTRUM_NC",
        figures="stages.spectrum.spectrum_figures",
        progress=False,
        command="stages.spectrum",
        summary="compute overturning spectra of pulses, or rocking spectra of records",
    ),
    Stage(
        name="rocking_spectrum",
        function="stages.spectrum.rocking_spectrum_stage",
        options="options.respond.RockingSpectrumOptions",
        inputs=(RECORDS_FILE,),
        outputs=("rocking_spectrum.nc",),
        foreseen="stages.spectrum.foresee_rocking_spectrum",
        variables="response.ROCKING_SPECTRUM_NC",
        figures="stages.spectrum.rocking_spectrum_figures",
        progress=False,
    ),
    Stage(
        name="compare",
        function="stages.compare.compare_stage",
        options="study.structures.CompareEntry",
        inputs=(RECORDS_FILE, STRUCTURES),
        outputs=("compare.nc",),
        foreseen="stages.compare.foresee_compare",
        variables="response.COMPARE_NC",
        figures="stages.compare.comparison_figures",
        command="stages.compare",
        summary="compare bridges that rock with restrained, hybrid, isolated and fixed ones",
        batches=True,
        memory=2000,
        minutes=60,
    ),
)
#: All stages by name, in the order of a run.
STAGES: Final[Mapping[str, Stage]] = {stage.name: stage for stage in _DECLARED}


def loaded(name: str) -> Any:
    """Return the function or class of a declaration; its module is imported.

    Examples
    --------
    >>> loaded("options.pulse.PulseOptions").__name__
    'PulseOptions'
    """
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(f"rockframe.{module}"), attribute)
