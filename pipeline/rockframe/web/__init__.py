"""Parts that all pages share: plots, the drawing of the frame, style and security policy.

uPlot, in `vendor`, draws the plots.
"""

from rockframe.web.assets import UPLOT as UPLOT
from rockframe.web.assets import environment as environment
from rockframe.web.assets import policy as policy
from rockframe.web.assets import script as script
from rockframe.web.assets import style as style
