"""Download records from FDSN data centres, check them, and keep them as received."""

from rockframe.fetch.coverage import Break as Break
from rockframe.fetch.coverage import Coverage as Coverage
from rockframe.fetch.coverage import Fetched as Fetched
from rockframe.fetch.metadata import Channel as Channel
from rockframe.fetch.request import ACCELEROMETERS as ACCELEROMETERS
from rockframe.fetch.request import Event as Event
from rockframe.fetch.request import Request as Request
from rockframe.fetch.run import fetch as fetch
from rockframe.fetch.service import TIMEOUT as TIMEOUT
