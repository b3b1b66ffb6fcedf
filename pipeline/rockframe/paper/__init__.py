"""Comparison with the paper: its Table 1, numbers, equations and claims. Nothing is tuned."""

from rockframe.paper.claim import Claim as Claim
from rockframe.paper.claim import Finding as Finding
from rockframe.paper.claims import all_claims as all_claims
from rockframe.paper.page import checked_page as checked_page
from rockframe.paper.pulse_table import PaperPulse as PaperPulse
from rockframe.paper.pulse_table import overall_distances as overall_distances
from rockframe.paper.pulse_table import paper_pulses as paper_pulses
from rockframe.paper.records import record_claims as record_claims
from rockframe.paper.table1 import BORROWED as BORROWED
from rockframe.paper.table1 import Comparison as Comparison
from rockframe.paper.table1 import PaperRecord as PaperRecord
from rockframe.paper.table1 import compare as compare
from rockframe.paper.table1 import paper_record_of as paper_record_of
from rockframe.paper.table1 import paper_records as paper_records
from rockframe.paper.table1 import statements as statements
from rockframe.paper.table1 import with_paper_facts as with_paper_facts
