"""The report of a run: one HTML page that works from disk. It computes no physics.

Template, style and script are in this folder; `web` holds the parts that pages share.
"""

from rockframe.report.page import render as render
from rockframe.report.payload import choose as choose
from rockframe.report.seal import is_whole as is_whole
from rockframe.report.seal import sealed as sealed
