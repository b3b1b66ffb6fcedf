"""The site of a sensor is taken from the header; it is unknown if the header is silent."""

from __future__ import annotations

import pytest
from tests.ingest.imitations import records_of

from rockframe.ingest.identify import (
    site_of_cosmos,
    site_of_depth,
    site_of_location,
    site_of_smc,
    site_of_station,
)
from rockframe.record import SiteType

FREE, BUILT, BORED, UNKNOWN = (
    SiteType.FREE_FIELD,
    SiteType.STRUCTURE,
    SiteType.BOREHOLE,
    SiteType.UNKNOWN,
)


@pytest.mark.parametrize(
    ("name", "site"),
    [
        ("CA:Alhambra;LACPW, 12th Fl", BUILT),
        ("Hotel, 3rd floor", BUILT),
        ("Bay Bridge - Deck", BUILT),
        ("LA - Hollywood Stor FF", FREE),
        ("Bear Valley #12 downhole", BORED),
        ("Roof and free-field of Hospital", UNKNOWN),  # names both
        ("Santa Monica Pier", UNKNOWN),  # the name of a place
        ("Angeles Crest Hwy", UNKNOWN),
        ("Pacoima Dam (upper left abut)", UNKNOWN),  # rock beside the dam
        ("El Centro Array #4", UNKNOWN),
        ("", UNKNOWN),
    ],
)
def test_the_name_of_a_station(name: str, site: SiteType) -> None:
    assert site_of_station(name) is site


@pytest.mark.parametrize(
    ("location", "site"),
    [
        ("Abutment 1", BUILT),
        ("Deck: Span 3, North", BUILT),
        ("Ground Floor: Center", BUILT),
        ("8th Floor: Center", BUILT),
        ("Ground", FREE),
        ("Free Field", FREE),
        ("Downhole 30 m", BORED),
        ("North side", UNKNOWN),
    ],
)
def test_the_place_of_a_channel(location: str, site: SiteType) -> None:
    assert site_of_location(location) is site


def test_the_place_of_a_channel_prevails_over_the_type_of_its_station() -> None:
    assert site_of_cosmos("Free Field", "", 11) is FREE
    assert site_of_cosmos("Roof", "", 4) is BUILT
    assert [site_of_cosmos("", "", code) for code in (4, 11, 50, None)] == [
        FREE, BUILT, UNKNOWN, UNKNOWN,
    ]  # fmt: skip


def test_the_place_on_a_bridge_or_dam_prevails_over_the_kind_of_structure() -> None:
    codes = [(None, None, None), (1, None, None), (2, 0, None), (2, 3, None), (3, None, 2)]
    sites = [UNKNOWN, BUILT, FREE, BUILT, BUILT]
    assert [site_of_smc("", *code) for code in codes] == sites


def test_a_vault_near_the_surface_is_no_borehole() -> None:
    depths = (0.0, 2.0, 3.0, 100.0, float("nan"))
    assert [site_of_depth(d) for d in depths] == [UNKNOWN, UNKNOWN, BORED, BORED, UNKNOWN]


@pytest.mark.parametrize(
    ("file", "site"),
    [
        ("cosmos/NP1795-n.305.v0c", FREE),
        ("csmip/chan001.v2", BUILT),  # on an abutment of a bridge
        ("csmip/CE89146.V2", UNKNOWN),
        ("smc/0165a_u.smc", BUILT),  # on the twelfth floor
        ("smc/0111a.smc", UNKNOWN),
        ("knet/NGNH311106302345.EW1", BORED),
        ("knet/NGNH311106302345.EW2", FREE),
        ("esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC", UNKNOWN),
        ("peer_at2/RSN77_SFERN_PUL164.AT2", UNKNOWN),
        ("miniseed/CI.CLC..HNE.mseed", UNKNOWN),
    ],
)
def test_real_files(file: str, site: SiteType) -> None:
    assert {record.site_type for record in records_of(file)} == {site}
