"""Options that several verbs share, spelled once."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rockframe.components import Rotation
    from rockframe.ingest import ReadOptions
    from rockframe.signals import BandPass
    from rockframe.study import Filters, PassportLimits


def path(text: str) -> Path:
    """Return the path that a word of the command line states."""
    if not text:
        raise argparse.ArgumentTypeError("empty path. Must name a file or folder.")
    return Path(text)


def add_reading(parser: argparse.ArgumentParser, then: str = "") -> None:
    """Options of reading record files; `then` says what else ``--workers`` holds for."""
    _add_of_files(parser)
    _add_of_records(parser)
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="most processes that read files at once, each file apart from the rest; "
        f"0 reads without that protection (default: one for each core){then}",
    )
    parser.add_argument(
        "--strict", action="store_true", help="stop at the first rejected file; write nothing"
    )


def _add_of_files(parser: argparse.ArgumentParser) -> None:
    """What files do not say of themselves."""
    parser.add_argument(
        "--units",
        metavar="UNITS",
        help="acceleration units of files that do not state them: g, gal, cm/s2, mm/s2 or m/s2 "
        "(a file that states others is rejected)",
    )
    parser.add_argument(
        "--time-step",
        type=float,
        metavar="SECONDS",
        help="time step of text files that do not state it "
        "(a file that states another is rejected)",
    )
    parser.add_argument(
        "--station-xml",
        type=Path,
        metavar="FILE",
        help="StationXML of miniSEED files (default: the *.xml beside each file)",
    )
    parser.add_argument(
        "--water-level",
        type=float,
        metavar="DECIBEL",
        help="take the full response out of miniSEED files, with this water level "
        "(default: divide by the sensitivity)",
    )
    parser.add_argument(
        "--catalogue",
        type=path,
        metavar="FILE",
        help="CSV of event, station, magnitude and distance of each file "
        "(default: catalogue.csv of the folder)",
    )


def _add_of_records(parser: argparse.ArgumentParser) -> None:
    """What is done to each record, and what it is held to."""
    parser.add_argument(
        "--band-pass",
        type=float,
        nargs=2,
        metavar=("LOW", "HIGH"),
        default=(0.1, 40.0),
        help="corner frequencies in Hz for uncorrected records (default: 0.1 40)",
    )
    parser.add_argument(
        "--uncorrected",
        action="store_true",
        help="take every record for uncorrected; text and AT2 are else taken as they are",
    )
    parser.add_argument(
        "--limits",
        type=path,
        metavar="FILE",
        help="TOML file with a [passport] table: limits of the checks of each record",
    )


#: Options of filters: field of Filters, and what it is.
_FILTERS = {
    "--magnitude": ("magnitude", "magnitude of the earthquake"),
    "--distance-km": ("epicentral_distance_km", "epicentral distance [km]"),
    "--vs30": ("vs30_m_s", "shear-wave velocity of the upper 30 m [m/s]"),
    "--pga-g": ("pga_g", "peak ground acceleration [g]"),
    "--pgv": ("pgv_m_s", "peak ground velocity [m/s]"),
}


def add_filters(parser: argparse.ArgumentParser) -> None:
    """Options of which records go on."""
    group = parser.add_argument_group("filters", "others stand in the list as filtered out")
    for option, (field, what) in _FILTERS.items():
        group.add_argument(
            option, dest=field, type=float, nargs=2, metavar=("FROM", "TO"), help=f"only {what}"
        )


def filters(options: argparse.Namespace) -> Filters:
    """Return which records go on."""
    from rockframe.errors import ParameterError
    from rockframe.study import Filters

    stated = {}
    for option, (field, _) in _FILTERS.items():
        bounds = getattr(options, field)
        if bounds is None:
            continue
        if not bounds[0] <= bounds[1]:
            raise ParameterError(
                f"Invalid {option} {bounds[0]:g} {bounds[1]:g}. Must be the lower bound first."
            )
        stated[field] = tuple(bounds)
    return Filters(**stated)


def add_rotation(parser: argparse.ArgumentParser) -> None:
    """Options of rotating the horizontals of a station."""
    toward = parser.add_mutually_exclusive_group()
    toward.add_argument(
        "--azimuth",
        type=float,
        metavar="DEGREES",
        help="put the motion toward this azimuth in the place of the two horizontals of each "
        "station",
    )
    toward.add_argument(
        "--strike",
        type=float,
        metavar="DEGREES",
        help="put the motions normal and parallel to a fault of this strike in their place",
    )


def rotation(options: argparse.Namespace) -> Rotation | None:
    """Return where the horizontals are rotated to, if anywhere."""
    from rockframe.components import Rotation

    if options.azimuth is None and options.strike is None:
        return None
    return Rotation(options.azimuth, options.strike)


def read_options(options: argparse.Namespace) -> ReadOptions:
    """Return what the user stated about the files."""
    from rockframe.ingest import ReadOptions

    return ReadOptions(
        units=options.units,
        time_step=options.time_step,
        station_xml=options.station_xml,
        water_level=options.water_level,
    )


def band_pass(options: argparse.Namespace) -> BandPass:
    """Return the corners for uncorrected records."""
    from rockframe.signals import BandPass

    return BandPass(*options.band_pass)


def passport_limits(options: argparse.Namespace) -> PassportLimits:
    """Return the limits of the checks, the user's or the default ones."""
    from rockframe.study import PassportLimits, read_limits

    return read_limits(options.limits) if options.limits else PassportLimits()


@contextmanager
def records_file(options: argparse.Namespace) -> Iterator[tuple[Path, int]]:
    """Give the records.nc that was stated, or one made of the files; and the exit status."""
    from rockframe.cli.console import show_rejections
    from rockframe.stages import ingest_stage
    from rockframe.study import bundled_records

    given: list[Path] = options.records or [bundled_records()]
    if len(given) == 1 and given[0].suffix == ".nc":
        yield given[0], 0
        return
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "records.nc"
        ingested = ingest_stage(
            given,
            made,
            options=read_options(options),
            catalogue=options.catalogue,
            band=band_pass(options),
            all_uncorrected=options.uncorrected,
            passport_limits=passport_limits(options),
            workers=options.workers,
            strict=options.strict,
        )
        show_rejections(ingested.rejections)
        yield made, 1 if ingested.rejections else 0


def refuse_folder_of_records(options: argparse.Namespace) -> None:
    """Refuse to write a run into the folder that its records are read from."""
    from rockframe.errors import InputError

    for source in options.records or []:
        home = source if source.is_dir() else source.parent
        if home.resolve() == options.output.resolve():
            raise InputError(options.output, "holds the records. Must be another folder.")


def add_structures(parser: argparse.ArgumentParser) -> None:
    """Options of choosing structures."""
    parser.add_argument(
        "--structures",
        type=path,
        metavar="FILE",
        help="TOML file of [[structure]] tables with name, height_m, width_m, mass_ratio "
        "(default: the shipped ones)",
    )
    parser.add_argument(
        "--structure", metavar="NAME", action=_Once, help="only the structure of this name"
    )


class _Once(argparse.Action):
    """An option of one value, of which a second would silently take the place of the first."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002 -- as argparse calls it
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,  # noqa: ARG002
    ) -> None:
        """Keep the value, unless there is one."""
        if getattr(namespace, self.dest) is not None:
            raise argparse.ArgumentError(
                self, "given twice. Must name one; several go into a file for --structures"
            )
        setattr(namespace, self.dest, values)


def add_margins(parser: argparse.ArgumentParser) -> None:
    """The option of leaving out margins."""
    parser.add_argument(
        "--no-margins",
        dest="margins",
        action="store_false",
        help="leave out critical scales and undecided verdicts, which take most of the time",
    )


def add_vertical(parser: argparse.ArgumentParser) -> None:
    """The option of vertical ground motion."""
    parser.add_argument(
        "--vertical",
        action="store_true",
        help="let the ground move vertically too, as the vertical record of each motion says",
    )


def add_periods(parser: argparse.ArgumentParser) -> None:
    """Options of the search for pulses."""
    parser.add_argument(
        "--periods",
        type=float,
        nargs=2,
        metavar=("SHORTEST", "LONGEST"),
        default=(0.2, 5.0),
        help="range of pulse periods searched, in s (default: 0.2 5)",
    )
