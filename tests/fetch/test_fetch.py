"""Replies of a working data centre are stored as received, and fetched only once."""

from __future__ import annotations

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from rockframe.cli.main import main
from rockframe.errors import InputError, ServiceError
from rockframe.fetch.run import fetch
from rockframe.ingest import collect, read_catalogue, sorted_out
from rockframe.options.fetch import FetchOptions
from rockframe.stages.table import fetch_stage

from .centre import MSEED, ORIGIN, DataCentre, Reply, miniseed, waveform

Make = Callable[..., FetchOptions]
START = "2019-07-06T03:19:43.000000Z"
COMMON = ("--station", "CLC", "--before", "10", "--after", "50")


def ledger(folder: Path) -> dict[str, dict[str, dict[str, object]]]:
    content: dict[str, dict[str, dict[str, object]]] = json.loads(
        (folder / "request.json").read_text()
    )
    return content


def test_all_of_one_station(centre: DataCentre, request_of: Make, output: Path) -> None:
    fetched = fetch(request_of(event="xx1"), output)
    assert fetched.complete
    assert fetched.event is not None
    assert (fetched.event.name, fetched.event.magnitude) == ("Made up, California", 7.1)
    assert sorted(path.name for path in output.iterdir()) == [
        "XX.CLC.--.HNE.mseed",
        "XX.CLC.--.HNN.mseed",
        "XX.CLC.--.HNZ.mseed",
        "XX.CLC.xml",
        "channels.stationxml",
        "event.quakeml",
        "request.json",
    ]
    assert len(centre.queries("dataselect")) == 3


def test_bytes_are_kept_as_received(centre: DataCentre, request_of: Make, output: Path) -> None:
    sent = miniseed(waveform("CLC", "HNE", START, 61.0))
    centre.waveforms["CLC", "HNE"] = [Reply(body=sent, content_type=MSEED)]
    fetch(request_of(), output)
    assert (output / "XX.CLC.--.HNE.mseed").read_bytes() == sent
    document = ledger(output)
    entry = document["files"]["XX.CLC.--.HNE.mseed"]
    assert entry["sha256"] == sha256(sent).hexdigest()
    assert "channel=HNE" in str(entry["url"])
    assert document["services"]["dataselect"] == {"url": centre.url, "version": "1.1.2"}
    assert set(document["received_at"]) == set(document["files"])


def test_two_runs_differ_in_nothing_but_the_clock(request_of: Make, tmp_path: Path) -> None:
    documents = []
    for name in ("one", "two"):
        fetch(request_of(), tmp_path / name)
        documents.append(ledger(tmp_path / name))
        documents[-1].pop("received_at")
    assert documents[0] == documents[1]


def test_a_rerun_asks_nothing(centre: DataCentre, request_of: Make, output: Path) -> None:
    first = fetch(request_of(event="xx1"), output)
    written = (output / "request.json").read_bytes()
    asked = len(centre.asked)
    assert fetch(request_of(event="xx1"), output) == first
    assert len(centre.asked) == asked
    assert (output / "request.json").read_bytes() == written


def test_a_damaged_file_alone_is_fetched_again(
    centre: DataCentre, request_of: Make, output: Path
) -> None:
    fetch(request_of(), output)
    damaged = output / "XX.CLC.--.HNN.mseed"
    sound = damaged.read_bytes()
    damaged.write_bytes(sound[:-1])
    asked = len(centre.asked)
    assert fetch(request_of(), output).complete
    assert damaged.read_bytes() == sound
    (again,) = centre.asked[asked:]
    assert "channel=HNN" in again


def test_an_interrupted_fetch_goes_on(centre: DataCentre, request_of: Make, output: Path) -> None:
    def stop(name: str) -> None:
        if name == "XX.CLC.--.HNZ.mseed":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fetch(request_of(), output, progress=stop)
    asked = len(centre.queries("dataselect"))
    assert fetch(request_of(), output).complete
    assert len(centre.queries("dataselect")) == asked + 1


def test_another_request_is_refused(request_of: Make, output: Path) -> None:
    fetch(request_of(), output)
    with pytest.raises(InputError, match=r"another request: after 50.0, now 60.0. Use the same"):
        fetch(request_of(after=60.0), output)


def test_a_folder_of_something_else_is_refused(request_of: Make, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("chapter one")
    with pytest.raises(
        InputError, match=r"contains files but no request.json. Choose a new or empty"
    ):
        fetch(request_of(), tmp_path)


def test_radius_is_the_geodesic(request_of: Make, output: Path) -> None:
    fetched = fetch(request_of(station="*", radius_km=20.0), output)
    assert {channel.station for channel in fetched.channels} == {"CLC"}
    assert fetched.channels[0].distance == pytest.approx(5.07, abs=0.01)


def test_radius_in_degrees_goes_to_the_service(
    centre: DataCentre, request_of: Make, output: Path
) -> None:
    fetch(request_of(min_radius=0.01, max_radius=0.5), output)
    first = centre.queries("station")[0]
    assert "minradius=0.01" in first
    assert "maxradius=0.5" in first
    assert "latitude=35.77" in first


def test_no_station_near_enough(request_of: Make, output: Path) -> None:
    with pytest.raises(ServiceError, match=r"no channel 'HN\?,HG\?,BN\?' within 1 km. State"):
        fetch(request_of(radius_km=1.0), output)


def test_the_catalogue_is_the_projects(request_of: Make, output: Path) -> None:
    fetch_stage(request_of(event="xx1"), output)
    entry = read_catalogue(output / "catalogue.csv")["XX.CLC.--.HNE.mseed"]
    assert (entry.event, entry.station, entry.network) == ("Made up, California", "CLC", "XX")
    assert (entry.magnitude, entry.epicentral_distance) == (7.1, 5.1)
    assert "magnitude (Mw); distance: WGS84 geodesic" in entry.source


def test_ingest_takes_nothing_but_waveforms_and_stationxml(request_of: Make, output: Path) -> None:
    fetch_stage(request_of(event="xx1"), output)
    records, rejections = sorted_out(collect([output]))
    seen = {record.source_file for record in records} | {row.file for row in rejections}
    assert all(name.endswith((".mseed", "XX.CLC.xml")) for name in seen)


def test_command_prints_json(
    centre: DataCentre, output: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["fetch", "--url", centre.url, "--event", "xx1", *COMMON, "--output", str(output)]
    assert main([*words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["event"]["time"] == ORIGIN
    assert [row["verdict"] for row in document["coverage"]] == ["complete"] * 3
    assert document["coverage"][0]["requested_start"] == START


def test_command_lists_what_is_missing(
    centre: DataCentre, output: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    centre.waveforms["CLC", "HNZ"] = [Reply(204)]
    words = ["fetch", "--url", centre.url, "--event", "xx1", *COMMON, "--output", str(output)]
    assert main(words) == 1
    printed = capsys.readouterr().out
    assert "2 of 3 complete" in printed
    assert "answered 204: no data." in printed


def test_span_without_event(centre: DataCentre, output: Path) -> None:
    span = ("--start", "2019-07-06T03:19:43", "--end", "2019-07-06T03:20:43Z")
    words = ["fetch", "--url", centre.url, *span, "--station", "CLC", "--output", str(output)]
    assert main(words) == 0
    entry = read_catalogue(output / "catalogue.csv")["XX.CLC.--.HNE.mseed"]
    assert (entry.event, entry.source) == ("", "")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ([], "0 of event, origin and start are given. Give exactly one of them."),
        (["--event", "1", "--start", "2019-07-06"], "2 of event, origin and start are given."),
        (
            ["--event", "1"],
            "Invalid station '*' without a radius. Name stations, or state --radius",
        ),
        (["--event", "1", "--latitude", "1"], "latitude is given without origin."),
        (["--origin", "2019-07-06"], "origin is given without latitude."),
        (["--start", "soon", "--end", "later"], "--start 'soon'. Must be a time in ISO 8601"),
        (["--start", "2020-01-01", "--end", "2019-01-01"], "Must be after the start 2020-01-01T"),
        (["--event", "1", "--station", "../x"], "--station '../x'. Must be codes of letters"),
        (["--event", "1", "--radius-km", "-1"], "--radius-km -1.0. Must be zero or positive"),
        (["--event", "1", "--radius-km", "1", "--max-radius", "1"], "Give one or the other."),
        (["--event", "1", "--station", "A", "--before", "-1"], "--before -1.0. Must be zero or"),
        (["--event", "1", "--station", "A", "--timeout", "0"], "--timeout 0.0. Must be above 0"),
        (
            ["--event", "1", "--station", "A", "--url", "moon"],
            "Invalid address 'moon' of the",
        ),
        (["--event", "1", "--station", "A", "--url", "file:///etc"], "address 'file:///etc'"),
    ],
)
def test_mistakes_are_one_line(
    words: list[str], reason: str, output: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url = [] if "--url" in words else ["--url", "http://127.0.0.1:9"]
    assert main(["fetch", *url, "--output", str(output), *words]) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert not output.exists()


def test_what_is_fetched_can_be_ingested(request_of: Make, output: Path) -> None:
    """Counts are divided by the sensitivity from the centre, and the event is stored with them."""
    fetch_stage(request_of(event="xx1"), output)
    records, rejections = sorted_out(collect([output]))
    assert rejections == []
    assert [record.component for record in records] == ["HNE", "HNN", "HNZ"]
    for record in records:
        assert abs(record.acceleration).max() == pytest.approx(1000.0 / 213500.0, rel=1e-3)
        assert (record.event, record.magnitude) == ("Made up, California", 7.1)
        assert record.uncorrected
