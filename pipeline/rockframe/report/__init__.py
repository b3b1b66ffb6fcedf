"""The report of a run: one page that works from disk. It lays out what results give; no physics.

Template, style and script are beside this file; uPlot, in `vendor`, draws the plots.
"""

from rockframe.report.page import render as render
from rockframe.report.payload import choose as choose
