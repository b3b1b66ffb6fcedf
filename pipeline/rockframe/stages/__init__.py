"""The stages: functions that read files, compute, and write files."""

from rockframe.stages.common import Batch as Batch
from rockframe.stages.fetch import fetch_stage as fetch_stage
from rockframe.stages.figures import draw_records as draw_records
from rockframe.stages.figures import figures_stage as figures_stage
from rockframe.stages.ingest import ingest_stage as ingest_stage
from rockframe.stages.intake import Ingested as Ingested
from rockframe.stages.merge import merge_stage as merge_stage
from rockframe.stages.pulse import pulse_stage as pulse_stage
from rockframe.stages.pulse import usable as usable
from rockframe.stages.report import PAGE as PAGE
from rockframe.stages.report import report_stage as report_stage
from rockframe.stages.report import require_whole as require_whole
from rockframe.stages.report import strange_report as strange_report
from rockframe.stages.respond import choose_structures as choose_structures
from rockframe.stages.respond import respond_stage as respond_stage
from rockframe.stages.respond import with_vertical as with_vertical
from rockframe.stages.screening.screen import Screening as Screening
from rockframe.stages.screening.screen import screen_stage as screen_stage
from rockframe.stages.spectrum import rocking_spectrum_stage as rocking_spectrum_stage
from rockframe.stages.spectrum import spectrum_stage as spectrum_stage
from rockframe.stages.table import table_rows_of as table_rows_of
from rockframe.stages.table import table_stage as table_stage
from rockframe.stages.table import write_table as write_table
from rockframe.stages.verify import Verification as Verification
from rockframe.stages.verify import verify_run as verify_run
