"""Options of how a verb computes: where, which part of the records, which histories it keeps."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rockframe.engines import Engine
    from rockframe.stages import Batch


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Options of where batches are computed."""
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="most processes that compute at once; one alone shares its cores among threads, as "
        "many as OMP_NUM_THREADS says; the result is the same for any number (default: one for "
        "each core)",
    )
    add_scheduler(parser)


def add_scheduler(parser: argparse.ArgumentParser) -> None:
    """The option of computing elsewhere."""
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="compute on the Dask cluster of this scheduler instead, tcp://HOST:PORT "
        "(needs the extra `dask`)",
    )


def engine(options: argparse.Namespace) -> Engine:
    """Return where batches are to be computed."""
    from rockframe.engines import choose_engine

    # 0 is said of reading: without the protection of a worker process
    return choose_engine(1 if options.workers == 0 else options.workers, options.scheduler)


def add_histories(parser: argparse.ArgumentParser, default: str) -> None:
    """The option of which histories are kept."""
    parser.add_argument(
        "--histories",
        choices=("none", "selected", "all"),
        default=default,
        help="whose histories are kept: selected are those that overturn or turn by half the "
        f"slenderness and more (default: {default})",
    )


def add_batch(parser: argparse.ArgumentParser) -> None:
    """The option of doing a part of the records."""
    parser.add_argument(
        "--batch",
        type=_batch,
        default=(1, 1),
        metavar="K/N",
        help="only the K-th of N parts of the records; `rockframe merge` puts them together",
    )


def chosen_batch(options: argparse.Namespace) -> Batch:
    """Return the part of the records that is asked for."""
    from rockframe.stages import Batch

    return Batch(*options.batch)


def _batch(text: str) -> tuple[int, int]:
    number, _, count = text.partition("/")
    if not (number.isdecimal() and count.isdecimal()):
        raise argparse.ArgumentTypeError(f"Invalid batch {text!r}. Must be like 2/10")
    return int(number), int(count)
