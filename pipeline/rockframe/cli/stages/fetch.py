"""rockframe fetch: download and verify records of an event from an FDSN data centre."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.options import folder_to_write
from rockframe.errors import ParameterError

if TYPE_CHECKING:
    from rockframe.fetch.coverage import Coverage
    from rockframe.fetch.request import Request


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: data centre, event, stations, time span, folder."""
    parser.epilog = (
        "Exit status: 0 everything was received; 1 something is missing (it is listed); 2 nothing "
        "was received, or an error that you can correct. The same command resumes an interrupted "
        "download. From archives that need a login (PEER NGA, ESM, CESMD, K-NET), download by "
        "hand, then use rockframe ingest."
    )
    parser.add_argument(
        "--url",
        required=True,
        help="data centre: URL, or a short name known to obspy (SCEDC, INGV, GEONET...)",
    )
    parser.add_argument(
        "--event-url", default="", metavar="URL", help="URL of the event service, if different"
    )
    parser.add_argument(
        "--station-url", default="", metavar="URL", help="URL of the station service, if different"
    )
    _add_event(parser)
    _add_stations(parser)
    for name, seconds in (("before", 30.0), ("after", 300.0)):
        parser.add_argument(
            f"--{name}",
            type=float,
            default=seconds,
            metavar="SECONDS",
            help=f"time {name} the origin time that is requested (default: {seconds:g})",
        )
    parser.add_argument(
        "--timeout",
        type=float,
        default=120.0,
        metavar="SECONDS",
        help="longest wait for one response (default: 120)",
    )
    parser.add_argument(
        "--output", type=folder_to_write, required=True, metavar="FOLDER", help="folder to write"
    )


def _add_event(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--event", default="", metavar="ID", help="event identifier of the service")
    parser.add_argument(
        "--origin",
        metavar="TIME",
        help="instead of --event: origin time (UTC), such as 2019-07-06T03:19:53, with "
        "--latitude and --longitude",
    )
    for name in ("--latitude", "--longitude"):
        parser.add_argument(
            name,
            type=float,
            metavar="DEGREES",
            help=f"{name.removeprefix('--')} of the epicentre, with --origin",
        )
    parser.add_argument(
        "--magnitude",
        type=float,
        default=math.nan,
        help="magnitude of the event, with --origin",
    )
    parser.add_argument(
        "--event-name", default="", metavar="NAME", help="name of the event, with --origin"
    )
    parser.add_argument(
        "--start",
        default="",
        metavar="TIME",
        help="instead of an event: start of a time span (UTC)",
    )
    parser.add_argument("--end", default="", metavar="TIME", help="end of the time span (UTC)")


def _add_stations(parser: argparse.ArgumentParser) -> None:
    for name in ("--network", "--station", "--location"):
        parser.add_argument(
            name,
            default="*",
            metavar="CODES",
            help="codes with ? and *, separated by commas (default: all)",
        )
    parser.add_argument(
        "--channel",
        default="HN?,HG?,BN?",
        metavar="CODES",
        help="codes with ? and *, separated by commas (default: accelerometers, HN?,HG?,BN?)",
    )
    parser.add_argument(
        "--radius-km",
        type=float,
        default=math.nan,
        metavar="KM",
        help="largest epicentral distance",
    )
    for name, which in (("--min-radius", "least"), ("--max-radius", "largest")):
        parser.add_argument(
            name,
            type=float,
            default=math.nan,
            metavar="DEGREES",
            help=f"instead of --radius-km: {which} epicentral distance, in degrees of arc",
        )


def run(options: argparse.Namespace) -> int:
    """Download, and print what was requested and received."""
    from rockframe.cli.console import progress_names, show_json
    from rockframe.stages.fetch import fetch_stage

    if not (math.isfinite(options.timeout) and options.timeout > 0.0):
        raise ParameterError(f"Invalid timeout {options.timeout!r} s. Must be positive and finite.")
    with progress_names("fetching") as progress:
        fetched = fetch_stage(
            _request(options), options.output, timeout=options.timeout, progress=progress
        )
    if options.json:
        rows = [asdict(row) | {"verdict": row.verdict} for row in fetched.coverage]
        event = None if fetched.event is None else asdict(fetched.event)
        show_json({"event": event, "coverage": rows, "output": str(options.output)})
    else:
        _show(fetched.coverage, options.output)
    return 0 if fetched.complete else 1


def _request(options: argparse.Namespace) -> Request:
    from rockframe.fetch.request import Event, Request

    event = None
    if options.origin is not None:
        for name in ("latitude", "longitude"):
            if getattr(options, name) is None:
                raise ParameterError(f"--origin given without --{name}. Must be given with it.")
        event = Event(
            time=options.origin,
            latitude=options.latitude,
            longitude=options.longitude,
            magnitude=options.magnitude,
            name=options.event_name,
        )
    else:
        _refuse_facts(options)
    return Request(
        url=options.url,
        event_url=options.event_url,
        station_url=options.station_url,
        event_id=options.event,
        event=event,
        start=options.start,
        end=options.end,
        network=options.network,
        station=options.station,
        location=options.location,
        channel=options.channel,
        radius_km=options.radius_km,
        min_radius=options.min_radius,
        max_radius=options.max_radius,
        before=options.before,
        after=options.after,
    )


def _refuse_facts(options: argparse.Namespace) -> None:
    """Raise an error for facts of an event that would be unused."""
    stated = {
        "--latitude": options.latitude is not None,
        "--longitude": options.longitude is not None,
        "--magnitude": not math.isnan(options.magnitude),
        "--event-name": bool(options.event_name),
    }
    for name, given in stated.items():
        if given:
            raise ParameterError(f"{name} given without --origin. Must be given with it.")


def _show(coverage: tuple[Coverage, ...], folder: Path) -> None:
    from rockframe.cli.console import number, show_table

    rows = [
        [
            row.what,
            number(math.nan if row.distance is None else row.distance, 1),
            row.requested_start[:19],
            row.requested_end[11:19],
            row.received_start[11:22],
            row.received_end[11:22],
            str(row.samples or "–"),
            row.verdict,
        ]
        for row in coverage
    ]
    complete = sum(row.complete for row in coverage)
    show_table(
        f"{complete} of {len(coverage)} complete in {folder}",
        ["channel", "R [km]>", "asked from", "to", "received from", "to", "samples>", "coverage"],
        rows,
    )
