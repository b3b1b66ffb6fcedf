"""Batches of work in one process, in a pool of them, or on a Dask cluster: the same results."""

from rockframe.engines.choice import choose_engine as choose_engine
from rockframe.engines.engine import Engine as Engine
from rockframe.engines.engine import OneProcess as OneProcess
from rockframe.engines.engine import ProcessPool as ProcessPool
from rockframe.engines.engine import map_batches as map_batches
from rockframe.engines.scheduler import DaskScheduler as DaskScheduler
from rockframe.engines.threads import cores as cores
from rockframe.engines.threads import on_threads as on_threads
from rockframe.engines.threads import threads as threads
