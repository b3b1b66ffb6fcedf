"""Options of the search for pulses."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from rockframe.matching import FindOptions

#: Names on the command line; importing them would make --help wait for the scientific stack.
WAVELETS: Final = (
    *("symmetric_ricker", "antisymmetric_ricker"),
    *("ricker_any_phase", "mavroeidis_papageorgiou"),
)
WEIGHTINGS: Final = ("energy", "area", "none", "velocity")
_SCRAMBLINGS: Final = ("envelope", "plain")


def add_pulse_wavelet(parser: argparse.ArgumentParser) -> None:
    """Options of which pulse is used, and of the test whether it is one."""
    parser.add_argument(
        "--pulse-wavelet",
        choices=WAVELETS,
        metavar="WAVELET",
        help="wavelet of the pulse that is used (default: symmetric_ricker or "
        "antisymmetric_ricker, whichever explains more): one of " + ", ".join(WAVELETS),
    )
    parser.add_argument(
        "--surrogates",
        type=int,
        default=99,
        metavar="N",
        help="most surrogates that a record is compared with, 0 for no comparison (default: 99)",
    )


def add_pulse_search(parser: argparse.ArgumentParser) -> None:
    """Further options of the method."""
    parser.add_argument(
        "--wavelet",
        action="append",
        choices=WAVELETS,
        metavar="WAVELET",
        help="match this wavelet; may be repeated (default: all four)",
    )
    parser.add_argument(
        "--weighting",
        choices=WEIGHTINGS,
        default="energy",
        help="power of the period before the inner product (default: energy, the paper's)",
    )
    parser.add_argument(
        "--most-half-cycles",
        type=float,
        default=3.0,
        metavar="N",
        help="half cycles of mavroeidis_papageorgiou are searched from 1 to this (default: 3)",
    )
    parser.add_argument(
        "--runners-up",
        type=int,
        default=2,
        metavar="N",
        help="further pulses of the wavelet that is used, each in what is left (default: 2)",
    )
    parser.add_argument(
        "--scrambling",
        choices=_SCRAMBLINGS,
        default="envelope",
        help="surrogates keep the record's envelope, or shake evenly (default: envelope)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the surrogates (default: 0)"
    )


def find_options(options: argparse.Namespace) -> FindOptions:
    """Return what the user stated; what a verb has no option for is the default."""
    from rockframe.matching import FindOptions, LikenessOptions, MatchOptions, Scrambling, Weighting

    stated = vars(options)
    known = {"most_half_cycles", "weighting"} & stated.keys()
    matching = {name: stated[name] for name in known}
    if "weighting" in matching:
        matching["weighting"] = Weighting(matching["weighting"])
    if stated.get("wavelet"):
        matching["wavelets"] = tuple(name for name in WAVELETS if name in stated["wavelet"])
    drawing: dict[str, Any] = {
        name: stated[name] for name in ("surrogates", "seed") if name in stated
    }
    if "scrambling" in stated:
        drawing["scrambling"] = Scrambling(stated["scrambling"])
    further = {"runners_up": stated["runners_up"]} if "runners_up" in stated else {}
    return FindOptions(
        matching=MatchOptions(
            shortest_period=options.periods[0], longest_period=options.periods[1], **matching
        ),
        drawing=LikenessOptions(**drawing),
        wavelet=stated.get("pulse_wavelet"),
        **further,
    )
