"""Catalogues of archives fill in metadata that the records do not contain."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import collect, is_catalogue, read_catalogue, sorted_out
from rockframe.ingest.catalogue import facts_for_record, stated_facts
from rockframe.outcome import InputOutcome
from rockframe.record import Record

from .test_containers import tarred, zipped

HERE = "RSN864_LANDERS_JOS000.AT2"
At2 = Callable[..., bytes]


@pytest.fixture
def catalogues(shared_records: Path) -> Path:
    folder = shared_records.parent / "catalogues"
    if not folder.is_dir():
        pytest.skip("the folder of catalogues is absent")
    return folder


def as_delivered(text: str) -> str:
    """Return the table as PEER writes it: names in plain quotes, comma and blank as separator."""
    lines = [line.rstrip(",") for line in text.split("\n")]
    return "\n".join(lines).replace('" ""', ' "').replace('"""', '"').replace(",", ", ")


SPELLINGS: dict[str, Callable[[str], bytes]] = {
    "re-saved by a spreadsheet": str.encode,
    "as delivered": lambda text: as_delivered(text).encode(),
    "BOM": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_peer_search_results(catalogues: Path, tmp_path: Path, spelling: str) -> None:
    text = (catalogues / "peer_SearchResults.csv").read_text()
    path = tmp_path / "_SearchResults.csv"
    path.write_bytes(SPELLINGS[spelling](text))
    entries = read_catalogue(path)
    assert len(entries) == 40  # ten records of three components, and by record number
    entry = entries[HERE]
    assert (entry.event, entry.station, entry.mechanism) == (
        "Landers 1992", "Joshua Tree", "strike slip",
    )  # fmt: skip
    assert (entry.magnitude, entry.distance_rjb, entry.distance_rrup) == (7.28, 11.03, 11.03)
    assert (entry.vs30, entry.lowest_usable_frequency) == (379.32, 0.07)
    assert np.isnan(entry.archive_pulse_period)  # printed as -
    assert entries["RSN1614_DUZCE_1061-V.AT2"].event == "Duzce, Turkey 1999"
    assert entry.source == "PEER search results"


@pytest.mark.parametrize("packed", ["", "zip", "zip in zip", "tar", "tar.gz", "tgz", "tar.bz2"])
def test_a_download_of_peer_keeps_its_metadata(
    catalogues: Path, tmp_path: Path, at2: At2, packed: str
) -> None:
    table = (catalogues / "peer_SearchResults.csv").read_bytes()
    members = ((HERE, at2()), ("_SearchResults.csv", table))
    if packed.startswith("zip"):
        data = zipped(*members)
        (tmp_path / "a.zip").write_bytes(zipped(("b/a.zip", data)) if "in" in packed else data)
    elif packed:
        how = {"tar": "w:", "tar.bz2": "w:bz2"}.get(packed, "w:gz")
        (tmp_path / f"a.{packed}").write_bytes(tarred(*members, how=how))
    else:
        for name, data in members:
            (tmp_path / name).write_bytes(data)
    [record], rejections = sorted_out(collect([tmp_path]))
    assert not rejections
    assert (record.magnitude, record.distance_rrup, record.vs30) == (7.28, 11.03, 379.32)


def test_catalogues_in_an_archive_apply_to_their_folder(tmp_path: Path, at2: At2) -> None:
    """A `catalogue.csv` outside the archive overrides those inside, which name no folders."""
    header, path = "file,magnitude,station\n", tmp_path / "a.zip"
    members = {"p/catalogue.csv": f"{header}x.AT2,5,P\n", "q/catalogue.csv": "file\nx.AT2,7\n"}
    samples = {
        "p/x.AT2": at2(),
        "p/in/x.AT2": at2(["1", "2", "3"]),
        "q/x.AT2": at2(["3", "2", "1"]),
    }
    packed = {name: text.encode() for name, text in members.items()} | samples
    path.write_bytes(zipped(*packed.items()))
    (tmp_path / "catalogue.csv").write_text(f"{header}a.zip,6,\n")
    records, [rejection] = sorted_out(collect([path]))
    assert [(r.station, r.magnitude) for r in records][:2] == [("P", 5.0), ("P", 5.0)]
    assert np.isnan(records[2].magnitude)
    assert "2 columns, but 1 in the header." in rejection.reason
    records, _ = sorted_out(collect([tmp_path]))
    assert [r.magnitude for r in records] == [6.0, 6.0, 6.0]


@pytest.mark.parametrize("packed", [False, True])
def test_own_catalogues_override_the_others_wherever_they_are(
    tmp_path: Path, at2: At2, *, packed: bool
) -> None:
    """Values of `catalogue.csv` override the other catalogues, which fill in its empty fields."""
    others = (
        f"Result ID,Earthquake Name,Magnitude,Horizontal-1 Acc. Filename\n1,Landers,7.28,{HERE}\n"
    )
    (tmp_path / "_SearchResults.csv").write_text(others)
    own = {"catalogue.csv": b"file,magnitude\n%b,5\n" % HERE.encode(), HERE: at2()}
    if packed:
        own = {"a.zip": zipped(*own.items())}
    for name, data in own.items():
        (tmp_path / name).write_bytes(data)
    [record], rejections = sorted_out(collect([tmp_path]))
    assert not rejections
    assert (record.magnitude, record.event) == (5.0, "Landers")


@pytest.mark.parametrize("packed", [False, True])
def test_a_misspelt_name_in_a_catalogue_is_not_lost(
    tmp_path: Path, at2: At2, *, packed: bool
) -> None:
    files = {"catalogue.csv": b"file,magnitude\nx.AT2,5\ny.AT2,6\n", "x.AT2": at2()}
    if packed:
        files = {"a.zip": zipped(*files.items())}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    [record], rejections = sorted_out(collect([tmp_path]))
    assert record.magnitude == 5.0
    assert rejections == [InputOutcome("a.zip:y.AT2" if packed else "y.AT2", "no such file.")]


def test_nga_west2_flatfile(catalogues: Path) -> None:
    entries = read_catalogue(catalogues / "ngawest2_flatfile_sample.csv")
    entry = entries["RSN1"]
    assert (entry.event, entry.magnitude, entry.vs30) == ("Helena, Montana-01 1935", 6.0, 593.35)
    assert (entry.epicentral_distance, entry.distance_hypocentral) == (6.31, 8.71)
    assert (entry.distance_rjb, entry.distance_rrup) == (2.07, 2.86)
    assert (entry.mechanism, entry.lowest_usable_frequency) == ("strike slip", 0.1625)
    # Other databases name the files without the record number.
    assert entries["A-HMC180.AT2"].magnitude == 6.0
    record = Record(record_id="a", acceleration=np.zeros(2), time_step=0.01)
    assert (
        facts_for_record(entries, record, ["RSN1_HELENA.A_A-HMC180.AT2"])["distance_rrup"] == 2.86
    )
    assert facts_for_record(entries, record, ["RSN999_X.AT2"]) == {}


def test_esm_flatfile_by_station_and_time(catalogues: Path) -> None:
    entries = read_catalogue(catalogues / "esm_flatfile_2018_sample.csv")
    record = Record(
        record_id="a", acceleration=np.zeros(2), time_step=0.01,
        network="AC", station="FIER", start_time="2014-01-20T14:40:41.5Z",
    )  # fmt: skip
    facts = facts_for_record(entries, record, ["a.asc"])
    assert (facts["magnitude"], facts["epicentral_distance"], facts["vs30"]) == (4.07, 65.3, 374.0)
    assert facts_for_record(entries, replace(record, station="KKS2"), ["a.asc"]) == {}
    assert (
        facts_for_record(entries, replace(record, start_time="2014-01-21T14:40:41Z"), ["a"]) == {}
    )


QUAKEML = """<?xml version="1.0"?>
<q:quakeml xmlns="http://quakeml.org/xmlns/bed/1.2" xmlns:q="http://quakeml.org/xmlns/quakeml/1.2">
<eventParameters publicID="quakeml:a/b"><event publicID="quakeml:a/c">
<description><text>Ridgecrest</text></description>
<origin publicID="quakeml:a/o"><time><value>2019-07-06T03:19:53.040Z</value></time>
<latitude><value>35.77</value></latitude><longitude><value>-117.6</value></longitude></origin>
<magnitude publicID="quakeml:a/m"><mag><value>7.1</value></mag></magnitude>
</event></eventParameters></q:quakeml>"""


@pytest.mark.parametrize("kind", ["comcat", "quakeml"])
def test_an_event_applies_to_the_records_of_its_time(
    catalogues: Path, tmp_path: Path, kind: str
) -> None:
    path = catalogues / "comcat_event_ci38457511.json"
    if kind == "quakeml":
        path = tmp_path / "event.xml"
        path.write_text(QUAKEML)
    entries = read_catalogue(path)
    record = Record(record_id="a", acceleration=np.zeros(2), time_step=0.01)
    during = replace(record, start_time="2019-07-06T03:19:40.04Z")
    facts = facts_for_record(entries, during, ["a"])
    assert facts["magnitude"] == 7.1
    assert "Ridgecrest" in facts["event"]
    assert facts_for_record(entries, record, ["a"]) == {}
    assert (
        facts_for_record(entries, replace(record, start_time="2019-07-06T02:19:40Z"), ["a"]) == {}
    )


COMCAT = """{"type": "Feature", "id": "a", "properties": {"mag": 7.1, "place": "",
 "title": "b", "url": "https://earthquake.usgs.gov", "time": %d}}"""


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("_SearchResults.csv", "Result ID,Earthquake Name\n", "without records or events"),
        ("_SearchResults.csv", "nothing\n", "without records or events"),
        ("a.csv", "Record Sequence Number,EQID\n1,1\n", "cannot be read as NGA-West2 flatfile"),
        ("a.csv", "event_id;event_time;Mw\nA;B;x\n", "cannot be read as ESM flatfile|number"),
        ("a.json", '{"type": "Feature", "u": "earthquake.usgs.gov"}', "cannot be read as ComCat"),
        ("a.json", COMCAT % 10**17, "cannot be read as ComCat event"),
        ("a.xml", "<q:quakeml><broken", "cannot be read as QuakeML"),
        ("a.xml", "<!DOCTYPE a><q:quakeml/>", "XML with a document type"),
    ],
)
def test_corrupted_catalogues_say_so(tmp_path: Path, name: str, text: str, message: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message):
        read_catalogue(tmp_path / name)


def test_other_json_is_no_catalogue(tmp_path: Path, at2: At2) -> None:
    (tmp_path / "notes.json").write_text(json.dumps({"type": "Feature"}))
    (tmp_path / "a.AT2").write_bytes(at2())
    records, _ = sorted_out(collect([tmp_path]))
    assert np.isnan(records[0].magnitude)


@pytest.fixture
def exports(shared_records: Path) -> Path:
    folder = shared_records.parent / "gmprocess_exports"
    if not folder.is_dir():
        pytest.skip("the folder of gmprocess's tables is absent")
    return folder


GMPROCESS = "default_metrics_channels(component=h1).csv"


def test_the_flatfile_of_gmprocess_describes_the_bundled_records(
    exports: Path, bundled_records: Path
) -> None:
    """It was made from the same event; its distances are those to the rupture."""
    catalogue = read_catalogue(exports / GMPROCESS)
    records, _ = sorted_out(
        collect([bundled_records / "Ridgecrest2019-CCC.V1"], catalogue=catalogue)
    )
    assert {(one.magnitude, one.distance_rrup, one.distance_rjb) for one in records} == {
        (7.1, 26.19, 22.97)
    }
    assert {(one.event, one.facts_source) for one in records} == {
        ("ci38457511", "gmprocess flatfile")
    }


def test_the_events_of_gmprocess_are_found_by_their_time(
    exports: Path, bundled_records: Path
) -> None:
    catalogue = read_catalogue(exports / "default_events.csv")
    records, _ = sorted_out(
        collect([bundled_records / "Ridgecrest2019-CCC.V1"], catalogue=catalogue)
    )
    assert {(one.event, one.magnitude) for one in records} == {("ci38457511", 7.1)}


def test_the_other_tables_of_gmprocess_are_no_records(exports: Path, tmp_path: Path) -> None:
    for path in exports.glob("*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "shake.csv").write_text("time_s,acc_g\n0.00,0.0\n0.01,0.2\n")
    outcomes = [one for one in collect([tmp_path]) if isinstance(one, InputOutcome)]
    assert {one.status for one in outcomes} == {"unread"}
    assert len(outcomes) == 6


def test_a_distance_of_gmprocess_that_is_no_number_is_one_line(
    exports: Path, tmp_path: Path
) -> None:
    path = tmp_path / "flat.csv"
    path.write_text((exports / GMPROCESS).read_text().replace(",26.19,", ",far,"))
    with pytest.raises(InputError, match=r"flat\.csv:2: rupturedistance 'far'\. Must be a number"):
        read_catalogue(path)


def test_a_flatfile_of_esm_saved_again_by_pandas(catalogues: Path, tmp_path: Path) -> None:
    """Commas, quotes and a column of row numbers change no value."""
    import pandas as pd

    source = catalogues / "esm_flatfile_2018_sample.csv"
    pd.read_csv(source, sep=";").to_csv(tmp_path / "esm.csv")
    first, again = read_catalogue(source), read_catalogue(tmp_path / "esm.csv")
    assert len(first) == len(again)
    for name, entry in first.items():
        facts, others = stated_facts(entry), stated_facts(again[name])
        assert facts == others, name


TABLE = (
    "STA,NET,M_w,R_jb,VS30,Origin\n"
    "CLC,CI,7.1,4.2,600,2019-07-06 03:19:53\n"
    "CCC,CI,7.1,N/A,-999,2019-07-06 03:19:53\n"
)
STATIONS = ("station=STA", "network=NET", "vs30_m_s=VS30", "distance_rjb_km=R_jb")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("timed", [False, True])
def test_any_table_by_the_names_of_its_columns(tmp_path: Path, separator: str, timed: bool) -> None:
    path = tmp_path / "stations.txt"
    path.write_text(TABLE.replace(",", separator))
    columns = (*STATIONS, "magnitude=m_w", *(["origin_time=Origin"] if timed else []))
    entries = read_catalogue(path, columns=columns)
    record = Record(
        record_id="a",
        acceleration=np.array([0.0, 1.0]),
        time_step=0.01,
        station="CLC",
        network="CI",
        start_time="2019-07-06T03:19:40Z",
    )
    facts = facts_for_record(entries, record, ["a.mseed"])
    assert (facts["vs30"], facts["distance_rjb"], facts["magnitude"]) == (600.0, 4.2, 7.1)
    other = replace(record, station="CCC")
    assert "vs30" not in facts_for_record(entries, other, ["a.mseed"])
    later = replace(record, start_time="2019-07-07T03:19:40Z")
    assert ("vs30" in facts_for_record(entries, later, ["a.mseed"])) is not timed
    assert not facts_for_record(entries, replace(record, station="XYZ"), ["a.mseed"])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (("station=STATION",), r":1: no column 'STATION'\. Must be one of: sta, net, m_w"),
        (("stat=STA",), r"column 'stat' unknown\. Must be one of: file, event, station"),
        (("magnitude=M_w",), r"no column says to which records a row belongs"),
        (("station=STA", "magnitude=NET"), r":2: magnitude 'CI'\. Must be from -2 to 10"),
    ],
)
def test_columns_of_a_table_that_are_refused(
    tmp_path: Path, columns: tuple[str, ...], message: str
) -> None:
    (tmp_path / "stations.csv").write_text(TABLE)
    with pytest.raises(InputError, match=message):
        read_catalogue(tmp_path / "stations.csv", columns=columns)


def test_stations_of_a_shakemap(tmp_path: Path) -> None:
    properties = {
        "code": "CI.CLC", "network": "CI", "commType": "UNK", "station_type": "seismic",
        "vs30": 600.0, "distances": {"rrup": 3.1, "rjb": 0.0, "repi": 5.2, "rhypo": "null"},
    }  # fmt: skip
    felt = {"code": "UTM:1", "network": "DYFI", "station_type": "macroseismic", "vs30": 300.0}
    features = [{"type": "Feature", "properties": one} for one in (properties, felt)]
    path = tmp_path / "stationlist.json"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    assert is_catalogue(path)
    entries = read_catalogue(path)
    record = Record(
        record_id="a",
        acceleration=np.array([0.0, 1.0]),
        time_step=0.01,
        station="CLC",
        network="CI",
    )
    facts = facts_for_record(entries, record, [])
    assert (facts["distance_rrup"], facts["distance_rjb"], facts["vs30"]) == (3.1, 0.0, 600.0)
    assert "distance_hypocentral" not in facts
    assert len(entries) == 1


PEER_FLATFILE = (
    "Record Sequence Number,EQID,Earthquake Name,YEAR,Earthquake Magnitude,EpiD (km),HypD (km),"
    "Joyner-Boore Dist. (km),ClstD (km),Vs30 (m/s) selected for analysis,File Name (Horizontal 1)\n"
    '864,125,"Landers",1992,7.28,13.7,15.3,11.03,11.03,379.32,LANDERS\\JOS000.AT2\n'
)
NGA_SUB = (
    "NGAsubRSN,NGAsubEQID,Earthquake_Magnitude,ClstD_km,Rjb_km,Vs30_Selected_for_Analysis_m_s\n"
    "4000001,E1,9.1,60,40,-999\n"
)
ESM_SERVICE = (
    "esm_event_id;event_time;mw;network_code;station_code;hyp_dist;vs30_m_s\n"
    "EMSC-1;2011-07-02 21:30:44;6.2;GE;IMMV;262.8;600\n"
)


def test_flatfiles_with_other_names_of_columns(tmp_path: Path) -> None:
    """NGA-West2 as PEER delivers it, NGA-Subduction, and the web service of ESM."""
    record = Record(record_id="a", acceleration=np.zeros(2), time_step=0.01)

    def facts_of(text: str, name: str, of: Record = record) -> dict[str, object]:
        (tmp_path / "flat.csv").write_text(text, encoding="utf-8")
        return facts_for_record(read_catalogue(tmp_path / "flat.csv"), of, [name])

    landers = facts_of(PEER_FLATFILE, "RSN864_LANDERS_JOS000.AT2")
    distances = [f"distance_{kind}" for kind in ("hypocentral", "rjb", "rrup")]
    assert [landers[name] for name in distances] == [15.3, 11.03, 11.03]
    assert (landers["event"], landers["magnitude"]) == ("Landers 1992", 7.28)
    assert (landers["epicentral_distance"], landers["vs30"]) == (13.7, 379.32)
    tohoku = facts_of(NGA_SUB, "NGAsubRSN4000001_IWANE.AT2")
    assert (tohoku["magnitude"], tohoku["distance_rrup"], tohoku["distance_rjb"]) == (9.1, 60, 40)
    assert "vs30" not in tohoku
    assert facts_of(NGA_SUB, "RSN4000001_X.AT2") == {}  # another database
    begun = replace(record, network="GE", station="IMMV", start_time="2011-07-02T21:30:40Z")
    crete = facts_of(ESM_SERVICE, "a.asc", begun)
    assert (crete["magnitude"], crete["distance_hypocentral"], crete["vs30"]) == (6.2, 262.8, 600)


def test_times_that_a_spreadsheet_changed_are_refused(tmp_path: Path) -> None:
    """The entry of `1/7/1988 7:41` would apply to no record, without a word."""
    path = tmp_path / "flat.csv"
    path.write_text(ESM_SERVICE.replace("2011-07-02 21:30:44", "7/2/2011 21:30"), encoding="utf-8")
    with pytest.raises(InputError, match=r":2: event_time '7/2/2011 21:30'\. Must be year-month"):
        read_catalogue(path)
