"""Flatfiles in their layouts: spectra, names of files and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import SHARED

from rockframe.errors import InputError
from rockframe.selection.flatfile import Flatfile, read_flatfile
from rockframe.units import GRAVITY

#: Sa = 0.2 g / T, so that between the periods of a file it is known exactly.
PERIODS = (0.01, 0.1, 1.0, 10.0)
WANTED = np.array([0.1, 0.37, 5.0])
PEER = (
    "Record Sequence Number,EQID,Earthquake Name,YEAR,Station Name,Earthquake Magnitude,EpiD (km),"
    "Joyner-Boore Dist. (km),ClstD (km),Vs30 (m/s) selected for analysis,File Name (Horizontal 1),"
    "File Name (Horizontal 2),File Name (Vertical),Lowest Usable Freq - Ave. Component (Hz),"
    "PGA (g),PGV (cm/sec),T0.010S,T0.100S,T1.000S,T10.000S,RotD percentile\n"
    "864,125,Landers,1992,Joshua Tree,7.28,13.7,11.03,11.03,379.32,LANDERS\\JOS000.AT2,"
    "LANDERS\\JOS090.AT2,LANDERS\\JOS-UP.AT2,0.07,20,43.0,20,2,0.2,0.02,50\n"
)
SUB = (
    "NGAsubRSN,NGAsubEQID,NGAsubSSN,Station_Name,Earthquake_Magnitude,ClstD_km,Rjb_km,"
    "Vs30_Selected_for_Analysis_m_s,accFilePathH1,accFilePathH2,accFilePathV,"
    "Longest_Usable_Period_for_PSa_Ave_Component_sec,PGA_g,T0pt010S,T0pt100S,T1pt000S,T10pt000S\n"
    "4000001,E1,S1,Iwanuma,9.1,60,40,300,a/b/IWANE.AT2,a/b/IWANN.AT2,a/b/IWANZ.AT2,12,20,20,2,0.2,"
    "0.02\n"
)
ESM = (
    "event_id;event_time;Mw;network_code;station_code;location_code;instrument_code;epi_dist;"
    "vs30_m_sec;U_channel_code;V_channel_code;W_channel_code;U_hp;V_hp;rotD50_pga;rotD50_pgv;"
    "U_T0_010;V_T0_010;rotD50_T0_010;rotD50_T0_100;rotD50_T1_000;rotD50_T10_000;"
    "U_T0_100;U_T1_000;U_T10_000;V_T0_100;V_T1_000;V_T10_000\n"
    "IT-2009-0009;2009-04-06 01:32:40;6.1;IT;AQK;00;HN;1.8;717;E;N;Z;0.08;0.1;19620;30;"
    "39240;9810;19620;1962;196.2;19.62;3924;392.4;39.24;981;98.1;9.81\n"
)
TABLE = "Site;Mw;R;Tmin;S0.1;S1;S10\nCLC;7.1;4.2;0.1;2;0.2;0.02\n"
WORDS = ("record_id=Site", "magnitude=Mw", "distance_rjb_km=R", "lowest_usable_frequency_hz=Tmin")


def read(folder: Path, text: str, periods: Any = WANTED, **options: Any) -> Flatfile:
    path = folder / "flat.csv"
    path.write_text(text, encoding="utf-8")
    return read_flatfile(path, np.asarray(periods), **options)


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (PEER, {}),
        (SUB, {}),
        (ESM, {}),
        (ESM, {"pairs": "geometric-mean"}),
        (TABLE, {"columns": (*WORDS, "sa_g=S{}")}),
    ],
    ids=["nga-west2", "nga-sub", "esm", "esm, geometric mean", "words"],
)
def test_a_power_law_is_read_exactly(tmp_path: Path, text: str, options: Any) -> None:
    """Sa = 0.2 g / T in every layout, at its periods and between them; components U and V are
    twice and half of it.
    """
    flatfile = read(tmp_path, text, **options)
    assert_allclose(np.exp(flatfile.log_sa[0]) / GRAVITY, 0.2 / WANTED, rtol=1e-9)


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("words", [True, False], ids=["words", "esm"])
def test_decimal_commas_are_points(tmp_path: Path, separator: str, words: bool) -> None:
    """The same table with the other decimal mark is the same: periods, facts and spectra."""
    text = TABLE.replace("S10", "S5.0;S10").replace(";0.02", ";0.04;0.02") if words else ESM
    options: Any = {"columns": (*WORDS, "sa_g=S{}")} if words else {}
    expected = read(tmp_path, text, **options)
    flatfile = read(tmp_path, text.replace(".", ",").replace(";", separator), **options)
    assert repr(flatfile.recordings) == repr(expected.recordings)  # NaN does not equal itself
    assert flatfile.recordings[0].numbers["magnitude"] == (7.1 if words else 6.1)
    assert np.array_equal(flatfile.log_sa, expected.log_sa)
    assert_allclose(np.exp(flatfile.log_sa[0]) / GRAVITY, 0.2 / WANTED, rtol=1e-9)


def test_facts_and_files_are_those_of_the_archive(tmp_path: Path) -> None:
    """PEER names a downloaded file by record number and path, ESM by channel and time of event."""
    [landers] = read(tmp_path, PEER).recordings
    assert (landers.name, landers.event) == ("RSN864", "Landers 1992")
    assert landers.files[0] == "RSN864_LANDERS_JOS000.AT2"
    assert_allclose(landers.longest, 1.0 / 0.07)
    numbers = landers.numbers
    assert (numbers["magnitude"], numbers["distance_rrup"], numbers["vs30"]) == (
        7.28,
        11.03,
        379.32,
    )
    assert_allclose([numbers["pga"], numbers["pgv"]], [20.0 * GRAVITY, 0.43])
    [iwanuma] = read(tmp_path, SUB).recordings
    assert (iwanuma.name, iwanuma.files[2]) == ("NGAsubRSN4000001", "NGAsubRSN4000001_IWANZ.AT2")
    assert (iwanuma.longest, iwanuma.numbers["distance_rrup"]) == (12.0, 60.0)
    [aquila] = read(tmp_path, ESM).recordings
    assert aquila.files[1] == "IT.AQK.00.HNN.D.20090406.013240.C.ACC.ASC"
    assert_allclose(aquila.longest, 1.0 / (1.25 * 0.1))  # the higher corner, as PEER's factor
    assert (aquila.network, aquila.station, aquila.event) == ("IT", "AQK", "IT-2009-0009")
    [own] = read(tmp_path, TABLE, columns=(*WORDS, "sa_g=S{}")).recordings
    assert (own.name, own.longest, own.numbers["distance_rjb"]) == ("CLC", 10.0, 4.2)


@pytest.mark.parametrize("how", ["xlsx", "pandas", "quoted"])
def test_flatfiles_that_were_saved_again(tmp_path: Path, how: str) -> None:
    import pandas as pd

    expected = read(tmp_path, PEER + PEER.splitlines()[1].replace("864", "865"))
    frame = pd.read_csv(tmp_path / "flat.csv")
    path = tmp_path / ("again.xlsx" if how == "xlsx" else "again.csv")
    if how == "xlsx":
        frame.to_excel(path, index=False)
    else:
        frame.to_csv(path, index=how == "pandas", quoting=int(how == "quoted"))
    again = read_flatfile(path, WANTED)
    assert again.recordings == expected.recordings
    assert_allclose(again.log_sa, expected.log_sa, rtol=1e-12)


@pytest.mark.parametrize("unknown", ["-999", "", "-", "nan", "#N/A"])
def test_a_value_that_is_not_stated_is_unknown(tmp_path: Path, unknown: str) -> None:
    flatfile = read(tmp_path, PEER.replace(",0.2,0.02,", f",{unknown},0.02,"))
    assert np.isnan(flatfile.log_sa[0]).tolist() == [False, True, True]


def test_spectra_of_gmprocess_are_those_of_its_table() -> None:
    path = SHARED / "gmprocess_exports" / "default_metrics_rotd(percentile=50.0).csv"
    if not path.is_file():
        pytest.skip("no tables of gmprocess beside the repository")
    flatfile = read_flatfile(path, np.array([0.1, 1.0]))
    assert flatfile.spectrum == "rotd50"
    # its first row: 123.11843 and 52.794667 per cent of g
    assert_allclose(np.exp(flatfile.log_sa[0]) / GRAVITY, [1.2311843, 0.52794667], rtol=1e-8)


def test_the_sample_of_nga_west2() -> None:
    path = SHARED / "catalogues" / "ngawest2_flatfile_sample.csv"
    if not path.is_file():
        pytest.skip("no catalogues beside the repository")
    flatfile = read_flatfile(path, np.array([1.0]))
    assert flatfile.recordings[0].files[0] == "RSN1_HELENA.A_A-HMC180.AT2"
    assert len(flatfile.recordings) == 11
    assert np.isfinite(flatfile.log_sa).all()


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("a;b\n1;2\n", {}, "no columns of spectra, such as T1.000S or rotD50_T1_000. Name them"),
        ("", {}, "no recordings. Must have one or more."),
        ('c,"a\nb"\n1,2\n', {"columns": ("record_id=x",)}, "'x'. Must be one of: c, a b."),
        ("a;b\n", {}, "no recordings. Must have one or more."),
        (PEER, {"pairs": "rotd100"}, "states rotd50. Must be rotd100, as --pairs states."),
        (ESM, {"pairs": "rotd100"}, "no spectra for --pairs rotd100. It has those of"),
        (PEER, {"periods": [20.0]}, "covers periods from 0.01 to 10 s, not 20 s."),
        (PEER + PEER.splitlines()[1], {}, ":3: recording 'RSN864' is stated twice."),
        (PEER.replace(",0.07,20,", ",0.07,0.02,"), {}, "Sa at 0.01 s is 1e+03 times PGA (median)."),
        (PEER.replace(",7.28,", ",large,"), {}, ":2: earthquake magnitude 'large'. Must be a num"),
        (PEER.replace(",0.2,0.02,", ',"0,2",0.02,'), {}, ":2: t1.000s '0,2'. Must be a number."),
        (PEER.replace(",43.0,", ",fast,"), {}, ":2: pgv (cm/sec) 'fast'. Must be a number."),
        (ESM.replace(";0.1;", ";0.1 Hz;"), {}, ":2: v_hp '0.1 Hz'. Must be a number."),
        (
            TABLE + "B;6;1;1;1,5;1;1 g\n",
            {"columns": (*WORDS, "sa_g=S{}")},
            ":3: s10 '1 g'. Must be a number.",
        ),
        (
            TABLE,
            {"columns": ("record_id=Site",)},
            "flatfile_columns need record_id and one of sa_g",
        ),
        (TABLE, {"columns": ("name=Site",)}, "column 'name' unknown. Must be one of: record_id"),
        (TABLE, {"columns": ("record_id=ID",)}, "no column 'ID'. Must be one of: site, mw"),
        (TABLE, {"columns": ("record_id=Site", "sa_g=S")}, "sa_g 'S'. Must contain {} once"),
        (TABLE, {"columns": ("record_id=Site", "sa_g=X{}")}, "fewer than two columns of spectra"),
        (TABLE.replace("CLC", ""), {"columns": (*WORDS, "sa_g=S{}")}, "no name of the recording"),
    ],
)
def test_a_flatfile_with_a_fault_is_one_line(
    tmp_path: Path, text: str, options: Any, message: str
) -> None:
    with pytest.raises(InputError) as error:
        read(tmp_path, text, **options)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_flatfile_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_flatfile(tmp_path / "none.csv", WANTED)
    (tmp_path / "bad.xlsx").write_bytes(b"PK\x03\x04" + bytes(40))
    with pytest.raises(InputError):
        read_flatfile(tmp_path / "bad.xlsx", WANTED)
