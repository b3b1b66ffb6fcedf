"""The options of each stage, one frozen model each, from which all interfaces are derived."""

from rockframe.options.execution import BatchOptions as BatchOptions
from rockframe.options.execution import ExecutionOptions as ExecutionOptions
from rockframe.options.execution import ReadingOptions as ReadingOptions
from rockframe.options.fields import evenly as evenly
from rockframe.options.ingest import Filters as Filters
from rockframe.options.ingest import IngestOptions as IngestOptions
from rockframe.options.model import Options as Options
from rockframe.options.pulse import PulseOptions as PulseOptions
from rockframe.options.respond import DesignOptions as DesignOptions
from rockframe.options.respond import RespondOptions as RespondOptions
from rockframe.options.respond import ScreenOptions as ScreenOptions
from rockframe.options.showing import FigureOptions as FigureOptions
from rockframe.options.showing import ReportOptions as ReportOptions
from rockframe.options.spectrum import RockingSpectrumOptions as RockingSpectrumOptions
from rockframe.options.spectrum import SpectrumOptions as SpectrumOptions
