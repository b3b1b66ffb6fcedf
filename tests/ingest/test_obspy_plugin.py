from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import entry_points
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import FORMATS
from rockframe.ingest.obspy_plugin import PLUGINS
from rockframe.ingest.registry import Format, sniff_format

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

DETECTORS = [plugin.is_format for plugin in PLUGINS.values()]


def obspy_read(*arguments: object, **options: object) -> Any:
    from obspy import read

    return read(*arguments, **options)


def test_entry_points_are_the_formats() -> None:
    ours = {
        point.name
        for point in entry_points(group="obspy.plugin.waveform")
        if point.value.startswith("rockframe.ingest.")
    }
    named = {known.obspy_name for known in FORMATS if known.obspy_name}
    assert ours == named - {"KNET", "SAC", "MSEED", "ASDF"}


def test_read_by_name(tmp_path: Path, at2: Callable[..., bytes]) -> None:
    (tmp_path / "a.AT2").write_bytes(at2())
    [trace] = obspy_read(str(tmp_path / "a.AT2"), format="PEERAT2")
    assert trace.data.dtype == np.float64
    assert trace.data.tolist() == [0.1 * 9.81, -0.2 * 9.81, 0.3 * 9.81]
    assert (trace.stats.delta, trace.stats.npts, trace.stats.channel) == (0.005, 3, "164")
    # The name of a place is not a station code.
    assert trace.stats.station == ""
    assert trace.stats.peerat2.station == "Pacoima Dam (upper left abut)"
    assert trace.stats.peerat2.units == "m s-2"
    assert trace.stats.peerat2.azimuth == 164.0
    assert trace.stats.peerat2.source_file == "a.AT2"


def test_channels(v1: Callable[..., bytes], channel: Callable[..., list[str]]) -> None:
    stream = obspy_read(BytesIO(v1(channel(), channel("Up"))), format="CSMIPV1")
    assert [trace.id for trace in stream] == ["CI.CCC..090", "CI.CCC..UP"]
    assert str(stream[0].stats.starttime) == "2019-07-06T03:19:40.040000Z"
    assert stream[1].stats.csmipv1.orientation == "vertical"


def test_text_options() -> None:
    stream = obspy_read(BytesIO(b"1.0\n2.0\n"), format="ACCTEXT", units="gal", time_step=0.02)
    assert stream[0].data.tolist() == [0.01, 0.02]
    assert stream[0].stats.delta == 0.02
    assert math.isnan(stream[0].stats.acctext.azimuth)


def test_data_can_be_processed_in_place(v1: Callable[..., bytes]) -> None:
    trace = obspy_read(BytesIO(v1()), format="CSMIPV1")[0]
    trace.detrend("demean").data[0] += 1.0
    assert trace.data.mean() == pytest.approx(1.0 / trace.stats.npts)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("PEERAT2", "peer_at2/RSN77_SFERN_PUL164.AT2"),
        ("CSMIPV1", "csmip/CE89146.V1"),
        ("CSMIPV2", "csmip/CE89146.V2"),
        ("COSMOS", "cosmos/NP1795-n.305.v0c"),
        ("SMC", "smc/0111a.smc"),
    ],
)
def test_headonly(shared_records: Path, name: str, file: str) -> None:
    path = shared_records / "formats" / file
    heads, whole = (obspy_read(str(path), format=name, headonly=only) for only in (True, False))
    for head, trace in zip(heads, whole, strict=True):
        assert (len(head.data), head.stats.npts) == (0, len(trace.data))
        assert head.stats[name.lower()] == trace.stats[name.lower()]


def test_headonly_of_text() -> None:
    [trace] = obspy_read(BytesIO(b"t,acc_g\n0.0,0.1\n0.5,0.2\n"), format="ACCTEXT", headonly=True)
    assert (trace.stats.npts, len(trace.data), trace.stats.delta) == (2, 0, 0.5)


def test_our_errors_come_through() -> None:
    with pytest.raises(InputError, match="acceleration units unstated"):
        obspy_read(BytesIO(b"1.0\n2.0\n"), format="ACCTEXT")


@pytest.mark.parametrize("name", ["peerat2", "csmipv1", "acctext"])
def test_detection(
    tmp_path: Path, at2: Callable[..., bytes], bundled_records: Path, name: str
) -> None:
    data = {
        "peerat2": at2(),
        "csmipv1": (bundled_records / "Ridgecrest2019-CCC.V1").read_bytes(),
        "acctext": b"t,acc_g\n0.0,0.1\n0.5,0.2\n",
    }[name]
    path = tmp_path / "record"
    path.write_bytes(data)
    for source in (path, BytesIO(data)):
        stream = obspy_read(source)
        assert stream[0].stats["_format"] == name.upper()


def registered() -> list[str]:
    return [
        known.obspy_name
        for known in FORMATS
        if known.obspy_name and known.name not in {"knet", "sac", "miniseed", "asdf"}
    ]


def test_no_file_of_obspy_is_claimed() -> None:
    """obspy offers each file to all plug-ins: a claim on a file of another program misleads it."""
    import obspy

    files = [
        path for path in Path(obspy.__file__).parent.rglob("tests/data/**/*") if path.is_file()
    ]
    if len(files) < 500:
        pytest.skip("obspy is installed without its test data")
    claims = [
        (name, path.name)
        for path in files
        for name in registered()
        if PLUGINS[name].is_format(path)
    ]
    assert claims == []


@pytest.mark.parametrize(
    ("head", "claimed"),
    [
        (b"0.0 0.1\n0.5 0.2\n", False),
        (b"time,acc\n0.0,0.1\n0.5,0.2\n", False),
        (b"time,vel_cm_s\n0.0,0.1\n0.5,0.2\n", False),
        (b"# recorded at PUL\n0.0 0.1\n0.5 0.2\n", False),
        (b"# acceleration in cm/s2\n0.0 0.1\n0.5 0.2\n", True),
        (b"Time NS[g] EW[g]\n0.0 0.1 0.3\n0.5 0.2 0.3\n", True),
        (b"acc_g\n0.1\n0.2\n", True),
    ],
)
def test_only_tables_with_units_of_acceleration_are_claimed(head: bytes, claimed: bool) -> None:
    assert PLUGINS["ACCTEXT"].is_format(BytesIO(head)) == claimed
    # `ingest` takes a table for one whether or not it states units, which the user may add.
    assert sniff_format(head).name == "acceleration_text"


def test_a_plugin_asks_the_other_formats_only_about_its_own_files(
    monkeypatch: pytest.MonkeyPatch, at2: Callable[..., bytes]
) -> None:
    """obspy runs each plug-in on each file: if all ask all formats, the work is their product."""
    asked: list[bytes] = []

    def counted(head: bytes) -> Format:
        asked.append(head)
        return sniff_format(head)

    monkeypatch.setattr("rockframe.ingest.obspy_plugin.sniff_format", counted)
    assert [name for name in registered() if PLUGINS[name].is_format(BytesIO(at2()))] == ["PEERAT2"]
    assert len(asked) == 1


@pytest.mark.parametrize(
    ("name", "expected", "traces"),
    [
        ("csmip/CE89146.V2", "CSMIPV2", 3),
        ("cosmos/NP1795-n.305.v0c", "COSMOS", 3),
        ("smc/0111a.smc", "SMC", 1),
    ],
)
def test_archives(shared_records: Path, name: str, expected: str, traces: int) -> None:
    stream = obspy_read(BytesIO((shared_records / "formats" / name).read_bytes()))
    assert len(stream) == traces
    assert stream[0].stats["_format"] == expected
    assert stream[0].stats[expected.lower()].units == "m s-2"


def test_processing_is_told(shared_records: Path) -> None:
    path = shared_records / "formats" / "csmip" / "CE89146.V2"
    [trace, *_] = obspy_read(str(path), format="CSMIPV2", headonly=True)
    assert (trace.stats.npts, len(trace.data)) == (12000, 0)
    assert "archive: band-pass 0.3 to 40 Hz (3 dB)" in trace.stats.csmipv2.processing


def test_detection_restores_the_position(at2: Callable[..., bytes]) -> None:
    stream = BytesIO(b"skipped " + at2())
    stream.seek(8)
    assert PLUGINS["PEERAT2"].is_format(stream)
    assert stream.tell() == 8


@pytest.mark.parametrize(
    "source", ["lost.AT2", ".", "", "a\0b", None, 3, BytesIO(), StringIO("0.1\n0.2\n"), b"0.1\n"]
)
def test_detection_never_raises(source: object) -> None:
    assert not any(detect(cast("Any", source)) for detect in DETECTORS)


def test_other_formats_stay_theirs(shared_records: Path) -> None:
    found = {}
    for name in ("knet/AOM0170806140843.EW", "miniseed/CI.CLC..HNE.mseed"):
        path = shared_records / "formats" / name
        found[name] = obspy_read(BytesIO(path.read_bytes()))[0].stats["_format"]
    assert list(found.values()) == ["KNET", "MSEED"]
