"""The live page: a server computes the response for the settings of its sliders.

Only the server needs the extra ``explorer``.
"""

from rockframe.explorer.answer import Answer as Answer
from rockframe.explorer.answer import Motion as Motion
from rockframe.explorer.answer import answer as answer
from rockframe.explorer.settings import Settings as Settings
from rockframe.explorer.settings import read_settings as read_settings
