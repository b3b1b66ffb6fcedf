"""The live page: what its sliders state is answered by the same kernel as everything else.

`answer` and the page need nothing but the base; the server needs the extra ``explorer``.
"""

from rockframe.explorer.answer import Answer as Answer
from rockframe.explorer.answer import Shaking as Shaking
from rockframe.explorer.answer import answer as answer
from rockframe.explorer.settings import Settings as Settings
from rockframe.explorer.settings import read_settings as read_settings
