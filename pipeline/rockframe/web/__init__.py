"""What the pages share: their plots, the drawn frame, their style; and who may ask them for what.

uPlot, in `vendor`, draws the plots.
"""

from rockframe.web.assets import UPLOT as UPLOT
from rockframe.web.assets import environment as environment
from rockframe.web.assets import policy as policy
from rockframe.web.assets import script as script
from rockframe.web.assets import style as style
