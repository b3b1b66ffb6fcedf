"""rockframe fetch: records of an event from an FDSN data centre, verified, into a folder."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.outputs import folder_to_write
from rockframe.errors import ParameterError

if TYPE_CHECKING:
    from rockframe.fetch import Coverage, Request


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Data centre, event, stations, span, folder."""
    parser.epilog = (
        "Exit status: 0 all came in; 1 something is missing (it is listed); 2 nothing came in, or "
        "something for you to mend, said in one line. The same command again goes on where it "
        "stopped. Archives that need a login (PEER NGA, ESM, CESMD, K-NET): download by hand, "
        "then rockframe ingest."
    )
    parser.add_argument(
        "--url",
        required=True,
        help="data centre: an address, or a short name that obspy knows (SCEDC, INGV, GEONET...)",
    )
    parser.add_argument(
        "--event-url", default="", metavar="URL", help="event service, if elsewhere"
    )
    parser.add_argument(
        "--station-url", default="", metavar="URL", help="station service, if elsewhere"
    )
    _add_event(parser)
    _add_stations(parser)
    for name, seconds in (("before", 30.0), ("after", 300.0)):
        parser.add_argument(
            f"--{name}",
            type=float,
            default=seconds,
            metavar="SECONDS",
            help=f"span of the records {name} the origin time (default: {seconds:g})",
        )
    parser.add_argument(
        "--timeout",
        type=float,
        default=120.0,
        metavar="SECONDS",
        help="longest wait for one answer (default: 120)",
    )
    parser.add_argument(
        "--output", type=folder_to_write, required=True, metavar="FOLDER", help="folder to write"
    )


def _add_event(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--event", default="", metavar="ID", help="identifier in the event service")
    parser.add_argument(
        "--origin",
        metavar="TIME",
        help="instead of --event: its origin time, UTC, as in 2019-07-06T03:19:53, with "
        "--latitude and --longitude",
    )
    for name in ("--latitude", "--longitude"):
        parser.add_argument(
            name, type=float, metavar="DEGREES", help="of the epicentre, with --origin"
        )
    parser.add_argument(
        "--magnitude", type=float, default=math.nan, help="of the event, with --origin"
    )
    parser.add_argument(
        "--event-name", default="", metavar="NAME", help="of the event, with --origin"
    )
    parser.add_argument(
        "--start",
        default="",
        metavar="TIME",
        help="instead of an event: the first of a span of time, UTC",
    )
    parser.add_argument("--end", default="", metavar="TIME", help="the last of that span, UTC")


def _add_stations(parser: argparse.ArgumentParser) -> None:
    for name in ("--network", "--station", "--location"):
        parser.add_argument(
            name, default="*", metavar="CODES", help="with ? and *, by commas (default: all)"
        )
    parser.add_argument(
        "--channel",
        default="HN?,HG?,BN?",
        metavar="CODES",
        help="with ? and *, by commas (default: those of accelerometers, HN?,HG?,BN?)",
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
    """Fetch, and print what came in against what was asked for."""
    from rockframe.cli.console import progress_names, show_json
    from rockframe.stages import fetch_stage

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
    from rockframe.fetch import Event, Request

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
    """Facts of an event that would go unused are a mistake."""
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
