"""`python -m tests.examples.downloads`: archives and catalogues as data centres lay them out.

Their samples are synthetic, except those of the bundled records.
"""

from __future__ import annotations

import io
import tarfile
import zipfile
from pathlib import Path

import numpy as np
from tests.ingest.test_asdf import asdf, provenance
from tests.ingest.test_esm import esm
from tests.ingest.test_knet import knet

from rockframe.wavelets.pulse import Pulse

#: Accelerations every 0.01 s with a peak of 0.4.
_MOTION = Pulse(wavelet="symmetric_ricker", a_p=0.4, T_p=1.2, time=6.0).acceleration(
    0.01 * np.arange(1500)
)
_PEER = """PEER Ground Motion Database, Time Series Search Report

Result ID, Record Sequence Number, Earthquake Name, Year, Station Name, Magnitude, Mechanism, \
Rrup (km), Horizontal-1 Acc. Filename, Horizontal-2 Acc. Filename
1, 1001, "Made", 2001, "Nowhere", 7.1, strike slip, 12.5, RSN1001_MADE_NOW000.AT2, \
RSN1001_MADE_NOW090.AT2
"""
_NGA = """\
Record Sequence Number,EQID,Earthquake Name,Year,Magnitude,"Style-of-Faulting (S, R, N, U)"
1001,1,Made,2001,7.1,S
"""
_ESM = """event_id;event_time;network_code;station_code;Mw;rup_dist
EMSC-20190728_0000106;2019-07-28 16:08:58;HI;ARS1;4.5;82.0
"""
_COMCAT = """\
{"type": "Feature", "id": "ci38457511", "properties": {"mag": 7.1, "time": 1562383193040,
 "place": "Ridgecrest", "url": "https://earthquake.usgs.gov/earthquakes/eventpage/ci38457511"}}"""


def main() -> None:
    """Write the files into the current folder."""
    horizontals = {f"RSN1001_MADE_NOW{name}.AT2": _at2(name) for name in ("000", "090")}
    _zip("PEERNGARecords_Unscaled.zip", {**horizontals, "_SearchResults.csv": _PEER})
    Path("ngawest2").mkdir()
    for name, text in horizontals.items():
        Path("ngawest2", name).write_text(text)
    counts = tuple(int(value) for value in 9.81e5 * _MOTION)
    japan = {
        f"AOM0170806140843.{end}": knet(counts, direction)
        .replace("2Hz", "100Hz")
        .replace(f" {len(counts) / 2:g}\n", f" {len(counts) / 100:g}\n")
        for end, direction in (("EW", "E-W"), ("NS", "N-S"), ("UD", "U-D"))
    }
    with tarfile.open("20080614084300.tar.gz", "w:gz") as archive:
        for name, text in japan.items():
            member = tarfile.TarInfo(f"20080614084300/{name}")
            member.size = len(text)
            archive.addfile(member, io.BytesIO(text.encode()))
    record = Path("records/ridgecrest2019/Ridgecrest2019-TOW2.V1").read_text(encoding="latin-1")
    _zip("CITOW2.ZIP", {"CITOW2.V1": record})
    _zip("cesmd.zip", {"Ridgecrest/CITOW2.ZIP": Path("CITOW2.ZIP").read_bytes()})
    gal = tuple(f"{981.0 * value:.6f}" for value in _MOTION)
    name = "HI.ARS1..{}.D.20190728.160908.C.ACC.ASC"
    streams = {name.format(one): esm(gal).replace("HNE", one) for one in ("HNE", "HNN", "HNZ")}
    _zip("esm.zip", streams)
    waves = {channel: tuple(981.0 * _MOTION) for channel in ("HNE", "HNN", "HNZ")}
    documents = provenance(*waves)
    Path("workspace.h5").write_bytes(asdf(waves, documents, last="2020-01-01T00:00:25"))
    for name, text in (
        ("NGA_West2_flatfile.csv", _NGA),
        ("ESM_flatfile_2018_SA.csv", _ESM),
        ("ci38457511.geojson", _COMCAT),
    ):
        Path(name).write_text(text)


def _at2(component: str) -> str:
    rows = "".join(f"{value:16.7E}" for value in _MOTION)
    header = f"Made, 1/1/2001, Nowhere, {component}\nACCELERATION TIME SERIES IN UNITS OF G\n"
    lines = [rows[start : start + 80] for start in range(0, len(rows), 80)]
    size = f"NPTS=   {len(_MOTION)}, DT=   .0100 SEC"
    return "\n".join(["PEER NGA STRONG MOTION DATABASE RECORD", header + size, *lines, ""])


def _zip(name: str, members: dict[str, str] | dict[str, bytes]) -> None:
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in members.items():
            archive.writestr(member, content)


if __name__ == "__main__":
    main()
