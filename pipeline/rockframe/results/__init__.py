"""What flows between the stages: netCDF files that explain themselves (CF-1.11, ragged arrays).

The only room that knows the datasets' variables, dimensions, units and attributes. Each dataset is
built by one function, written whole by `write`, and read back by one function.
"""

from rockframe.results.curves import restitution_dataset as restitution_dataset
from rockframe.results.curves import size_dataset as size_dataset
from rockframe.results.entries import Entry as Entry
from rockframe.results.entries import refuse_strange_entries as refuse_strange_entries
from rockframe.results.entries import write_entries as write_entries
from rockframe.results.files import PULSES as PULSES
from rockframe.results.files import RECORDS as RECORDS
from rockframe.results.files import RESPONSE as RESPONSE
from rockframe.results.files import ROCKING_SPECTRUM as ROCKING_SPECTRUM
from rockframe.results.files import SPECTRUM as SPECTRUM
from rockframe.results.files import Described as Described
from rockframe.results.files import describe as describe
from rockframe.results.files import input_hash as input_hash
from rockframe.results.files import is_netcdf as is_netcdf
from rockframe.results.files import kind_of as kind_of
from rockframe.results.files import opened as opened
from rockframe.results.files import require_ending as require_ending
from rockframe.results.files import write as write
from rockframe.results.joints import joints_dataset as joints_dataset
from rockframe.results.joints import portrait_dataset as portrait_dataset
from rockframe.results.merging import merge as merge
from rockframe.results.merging import no_records as no_records
from rockframe.results.pulse_rows import pulse_rows as pulse_rows
from rockframe.results.pulses import write_pulses as write_pulses
from rockframe.results.recorded import RecordsFile as RecordsFile
from rockframe.results.recorded import open_records as open_records
from rockframe.results.recorded import read_records as read_records
from rockframe.results.records import write_records as write_records
from rockframe.results.rejections import left_out_of as left_out_of
from rockframe.results.rejections import rejections_of as rejections_of
from rockframe.results.rejections import rows_of as rows_of
from rockframe.results.response import ResponseFile as ResponseFile
from rockframe.results.response import open_response as open_response
from rockframe.results.response import write_responses as write_responses
from rockframe.results.run import Fact as Fact
from rockframe.results.run import Ground as Ground
from rockframe.results.run import History as History
from rockframe.results.run import Run as Run
from rockframe.results.run import read_histories as read_histories
from rockframe.results.run import read_run as read_run
from rockframe.results.spectra import Overturning as Overturning
from rockframe.results.spectra import read_rocking_spectrum as read_rocking_spectrum
from rockframe.results.spectra import read_spectrum as read_spectrum
from rockframe.results.spectra import rocking_spectrum_dataset as rocking_spectrum_dataset
from rockframe.results.spectra import spectrum_dataset as spectrum_dataset
from rockframe.results.table import TableRow as TableRow
from rockframe.results.table import response_rows as response_rows
from rockframe.results.table import table_rows as table_rows
from rockframe.results.used_pulses import best_pulses as best_pulses
from rockframe.results.used_pulses import pulses_of as pulses_of
