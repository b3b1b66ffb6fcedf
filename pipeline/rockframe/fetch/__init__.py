"""Records from FDSN data centres: asked for, verified, and kept as received."""

from rockframe.fetch.coverage import Break as Break
from rockframe.fetch.coverage import Coverage as Coverage
from rockframe.fetch.facts import Channel as Channel
from rockframe.fetch.fetched import Fetched as Fetched
from rockframe.fetch.request import ACCELEROMETERS as ACCELEROMETERS
from rockframe.fetch.request import Event as Event
from rockframe.fetch.request import Request as Request
from rockframe.fetch.run import fetch as fetch
from rockframe.fetch.service import TIMEOUT as TIMEOUT
