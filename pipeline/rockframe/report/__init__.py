"""The report of a run: one page that works from disk. It lays out what results give; no physics.

Template, style and script are beside this file; what other pages share is in `web`.
"""

from rockframe.report.page import render as render
from rockframe.report.payload import choose as choose
from rockframe.report.seal import is_whole as is_whole
from rockframe.report.seal import sealed as sealed
