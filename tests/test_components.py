"""Pairs of horizontal records: how they are found, and what a rotation preserves."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rockframe
from rockframe.components import (
    ALONE,
    Channel,
    HorizontalPair,
    Sweep,
    both_directions,
    fault_components,
    motions_of,
    pair_horizontals,
    recordings_of_channels,
    resolved,
    rotate,
    rotd,
    rotd_spectral_acceleration,
    vertical_beside,
)
from rockframe.errors import ParameterError
from rockframe.options.ingest import IngestOptions
from rockframe.record import Orientation, Record, in_sequence
from rockframe.signals.measures import (
    oscillator_peak,
    oscillator_response,
    spectral_acceleration,
    spectral_acceleration_toward,
)
from rockframe.signals.processing import integrate, peak

angles = st.floats(-720.0, 720.0)


def component(azimuth: float, seed: int = 0, **facts: Any) -> Record:
    samples = np.random.default_rng(seed + int(azimuth)).standard_normal(500)
    known = {"record_id": f"r{azimuth:g}", "station": "CCC", "start_time": "2019-07-06T03:19:40Z"}
    return Record(
        acceleration=samples,
        time_step=0.01,
        azimuth=azimuth,
        orientation=Orientation.HORIZONTAL,
        **(known | facts),
    )


PAIR = HorizontalPair(component(90.0), component(0.0))
UP = replace(component(5.0, record_id="up"), orientation=Orientation.VERTICAL, azimuth=np.nan)


@pytest.mark.parametrize(
    ("azimuth", "source", "sign"),
    [
        (0, "second", 1),
        (90, "first", 1),
        (180, "second", -1),
        (270, "first", -1),
        (360, "second", 1),
    ],
)
def test_toward_its_own_azimuth_a_component_is_itself(
    azimuth: float, source: str, sign: int
) -> None:
    recorded = getattr(PAIR, source).acceleration
    np.testing.assert_array_equal(rotate(PAIR, azimuth).acceleration, sign * recorded)


@pytest.mark.parametrize(("azimuth", "name"), [(450.0, "90"), (-30.0, "330"), (360.0, "0")])
def test_azimuths_are_named_from_0_to_360_degrees(azimuth: float, name: str) -> None:
    turned = rotate(PAIR, azimuth)
    assert turned.record_id.endswith(f"-rotated-{name}")
    assert turned.azimuth == float(name)


def test_azimuth_is_clockwise_from_north_and_positive_in_its_direction() -> None:
    """A motion to the north-east has equal north and east components."""
    north, east = (component(a, record_id=f"c{a:g}") for a in (0.0, 90.0))
    push = np.array([1.0, 0.0, -2.0])
    pair = HorizontalPair(replace(north, acceleration=push), replace(east, acceleration=push))
    root = np.sqrt(2.0)
    np.testing.assert_allclose(rotate(pair, 45.0).acceleration, root * push)
    np.testing.assert_allclose(rotate(pair, 135.0).acceleration, 0.0, atol=1e-15)
    np.testing.assert_allclose(rotate(pair, 225.0).acceleration, -root * push)


@given(azimuth=angles)
def test_energy_is_kept(azimuth: float) -> None:
    one, other = (rotate(PAIR, azimuth + turn).acceleration for turn in (0.0, 90.0))
    recorded = PAIR.first.acceleration**2 + PAIR.second.acceleration**2
    np.testing.assert_allclose(one**2 + other**2, recorded, atol=1e-12)


@given(azimuth=angles, recorded=angles, mirrored=st.booleans())
def test_the_orientation_of_the_sensor_does_not_matter(
    azimuth: float, recorded: float, mirrored: bool
) -> None:
    turn = -90.0 if mirrored else 90.0
    turned = HorizontalPair(rotate(PAIR, recorded), rotate(PAIR, recorded + turn))
    np.testing.assert_allclose(
        rotate(turned, azimuth).acceleration, rotate(PAIR, azimuth).acceleration, atol=1e-11
    )


def test_the_sweep_forgets_how_the_sensor_stood() -> None:
    turned = HorizontalPair(rotate(PAIR, 17.3), rotate(PAIR, 287.3))
    np.testing.assert_allclose(rotd(turned).values, rotd(PAIR).values)


@pytest.mark.parametrize("transform", [None, integrate])
def test_the_largest_is_no_less_than_either_component_and_no_more_than_the_vector(
    transform: Any,
) -> None:
    one, other = (
        r.acceleration if transform is None else transform(r.acceleration, r.time_step)
        for r in (PAIR.first, PAIR.second)
    )
    sweep = rotd(PAIR, transform=transform)
    least, median, largest = (sweep.percentile(share) for share in (0, 50, 100))
    assert max(peak(one), peak(other)) <= largest <= np.hypot(one, other).max()
    assert largest == pytest.approx(np.hypot(one, other).max(), rel=2e-4)
    assert least <= min(peak(one), peak(other))
    assert least <= median <= largest


def test_a_motion_along_one_line_has_the_percentiles_of_a_cosine() -> None:
    line = component(0.0)
    pair = HorizontalPair(line, replace(component(90.0), acceleration=0.0 * line.acceleration))
    sweep = rotd(pair)
    assert sweep.percentile(100) == peak(line.acceleration)
    assert sweep.percentile(0) == 0.0
    assert sweep.percentile(50) == pytest.approx(peak(line.acceleration) / np.sqrt(2), rel=0.02)
    assert sweep.strongest_azimuth == 0.0


def test_any_measure_is_called_with_the_motion_toward_each_azimuth() -> None:
    sweep = rotd(PAIR, measure=lambda series: float(series.max()), azimuths=[0.0, 90.0, 270.0])
    one, other = PAIR.first.acceleration, PAIR.second.acceleration
    np.testing.assert_array_equal(sweep.values, [other.max(), one.max(), (-one).max()])


def test_the_default_measure_is_what_a_plain_loop_gives() -> None:
    loop = [peak(rotate(PAIR, float(azimuth)).acceleration) for azimuth in range(180)]
    np.testing.assert_allclose(rotd(PAIR).values, loop)


@pytest.mark.parametrize("transform", [None, integrate])
def test_samples_that_are_never_largest_are_left_out_without_a_trace(transform: Any) -> None:
    named = rotd(PAIR, transform=transform, measure=peak).values
    np.testing.assert_array_equal(rotd(PAIR, transform=transform).values, named)


def test_a_sweep_needs_an_azimuth() -> None:
    with pytest.raises(ParameterError, match=r"no azimuth to sweep"):
        rotd(PAIR, azimuths=[])


@pytest.mark.parametrize(("strike", "normal"), [(0.0, 90.0), (320.0, 50.0)])
def test_fault_normal_is_strike_and_a_right_angle(strike: float, normal: float) -> None:
    across, along = fault_components(PAIR, strike)
    assert (across.azimuth, along.azimuth) == (normal, strike)
    np.testing.assert_array_equal(across.acceleration, rotate(PAIR, normal).acceleration)


def test_a_rotated_record_says_what_was_done_to_it() -> None:
    turned = rotate(PAIR, 30.0)
    assert (turned.record_id, turned.component, turned.station) == ("r90-rotated-30", "30", "CCC")
    assert turned.processing[-1] == (
        "rotation: toward azimuth 30 degrees, from r90 (90) and r0 (0)"
    )


def test_an_azimuth_that_is_none_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"azimuth nan degrees. Must be finite"):
        rotate(PAIR, float("nan"))


def test_a_pair_keeps_its_vertical() -> None:
    pairs, unpaired = pair_horizontals([UP, component(90.0), component(0.0)])
    assert [(p.first.record_id, p.second.record_id) for p in pairs] == [("r90", "r0")]
    assert pairs[0].vertical is UP
    assert unpaired == ()


def test_a_vertical_of_quite_another_length_is_not_beside_them() -> None:
    short = replace(UP, acceleration=UP.acceleration[:-26])
    records = [component(90.0), component(0.0), short]
    ((pair,), _) = pair_horizontals(records)
    assert pair.vertical is None
    assert vertical_beside(records) == {}


def from_sample(record: Record, first: int, seconds: str) -> Record:
    """Return a record without its first samples, which starts at these seconds."""
    samples = record.acceleration[first:]
    return replace(record, acceleration=samples, start_time=f"2019-07-06T03:19:{seconds}Z")


@pytest.mark.parametrize(
    ("first", "seconds"), [(0, "40.000001"), (0, "39.9996"), (1, "40.01"), (20, "40.2")]
)
def test_a_pair_is_cut_to_the_samples_that_its_channels_share(first: int, seconds: str) -> None:
    """Whole-record answers of data centres start each channel at another time."""
    late = [from_sample(one, first, seconds) for one in (component(0.0), UP)]
    ((pair,), unpaired) = pair_horizontals([component(90.0), *late])
    assert unpaired == ()
    np.testing.assert_array_equal(pair.first.acceleration, component(90.0).acceleration[first:])
    np.testing.assert_array_equal(pair.second.acceleration, component(0.0).acceleration[first:])
    assert pair.vertical is not None
    np.testing.assert_array_equal(pair.vertical.acceleration, UP.acceleration[first:])
    whole = rotd(HorizontalPair(component(90.0), component(0.0)), azimuths=[30.0])
    if first == 0:
        assert rotd(pair, azimuths=[30.0]).values == whole.values
    beside = vertical_beside([component(90.0), *late])
    expected = np.r_[np.zeros(first), UP.acceleration[first:]]
    np.testing.assert_array_equal(beside["r90"].acceleration, expected)


def test_a_pair_is_not_cut_where_the_motion_is_strong() -> None:
    late = from_sample(component(0.0), 300, "43")
    pairs, unpaired = pair_horizontals([component(90.0), late])
    assert pairs == ()
    assert "% of the energy of 'r90' is outside the samples" in unpaired[0].reason


def test_a_pair_is_cut_to_its_common_samples_and_says_what_it_lost() -> None:
    """The energy of a motion that is as strong throughout is cut as its time is."""
    east = replace(component(90.0), acceleration=np.tile([1.0, -1.0], 1500))
    north = replace(east, record_id="n", azimuth=0.0, start_time="2019-07-06T03:19:45Z")
    up = replace(east, record_id="up", azimuth=np.nan, orientation=Orientation.VERTICAL)
    words = "of 'r90' and 'n' is without 5 s and 17 % of the energy of '{}', which are outside"
    with (
        pytest.warns(rockframe.RockframeWarning, match=words.format("r90")),
        pytest.warns(rockframe.RockframeWarning, match=words.format("n")),
    ):
        ((pair,), unpaired) = pair_horizontals([east, north])
    assert unpaired == ()
    for one, since in ((pair.first, " from sample 501 on"), (pair.second, "")):
        assert one.acceleration.size == 2500
        assert one.processing[-1] == (
            f"length: cut to 2500 of 3000 samples{since}, as of the motion: without 5 s and 17 % "
            "of the energy"
        )
    assert set(vertical_beside([east, north, up])) == {"r90"}


def test_time_steps_that_differ_by_round_off_are_one() -> None:
    step = 0.01 * (1.0 + 0.9e-9)
    others = [replace(one, time_step=step) for one in (component(0.0), UP)]
    ((pair,), unpaired) = pair_horizontals([component(90.0), *others])
    assert unpaired == ()
    assert pair.vertical is not None
    assert {one.time_step for one in (pair.first, pair.second, pair.vertical)} == {0.01}
    assert vertical_beside([component(90.0), *others])["r90"].time_step == 0.01
    assert HorizontalPair(component(90.0), others[0]).second.time_step == step


def test_channels_that_overlap_are_of_one_motion_unless_several_instruments_recorded_them() -> None:
    def channels(*seconds: float, azimuths: tuple[float, ...] = (0.0, 90.0)) -> list[Channel]:
        names = [(azimuth, start) for start in seconds for azimuth in azimuths]
        return [
            Channel.of(
                component(azimuth, record_id=f"{k}", start_time=f"2019-07-06T03:19:{s:09.6f}")
            )
            for k, (azimuth, s) in enumerate(names)
        ]

    east, north = channels(40.0)
    apart = north._replace(start_time="2019-07-06T03:19:42.4")  # of 4.99 s, 2.59 s are common
    assert motions_of([east, apart]) == [[0, 1]]
    later = north._replace(start_time="2019-07-06T03:19:42.6")
    assert motions_of([east, later]) == [[0], [1]]
    # the windows of two shocks, and two sensors: each has both of its horizontals
    assert motions_of(channels(40.0, 41.0)) == [[0, 1], [2, 3]]
    # three sensors of one direction: which are of one instrument is unknown
    assert motions_of(channels(40.0, 40.1, 40.2, azimuths=(0.0,))) == [[0], [1], [2]]
    assert motions_of([east, north._replace(station="CLC")]) == [[0], [1]]


def instruments(*codes: str, late: float = 1e-6) -> list[Record]:
    """Return both horizontals of each location and instrument, each a little later."""
    return [
        component(
            azimuth,
            seed=k,
            record_id=f"CI.CCC.{code}{letter}",
            component=f"{code}{letter}"[-3:],
            start_time=f"2019-07-06T03:19:{40.0 + late * (2 * k + n):09.6f}Z",
        )
        for k, code in enumerate(codes)
        for n, (letter, azimuth) in enumerate([("E", 90.0), ("N", 0.0)])
    ]


@pytest.mark.parametrize("codes", [("00.HN", "10.HN"), (".HN", ".BN"), ("00.HN", "00.BN", "10.HN")])
@pytest.mark.parametrize("late", [0.0, 1e-6, 0.01])
def test_each_instrument_of_a_station_has_its_pair_and_all_are_one_recording(
    codes: tuple[str, ...], late: float
) -> None:
    records = instruments(*codes, late=late)
    pairs, unpaired = pair_horizontals(records)
    assert unpaired == ()
    assert [(p.first.record_id, p.second.record_id) for p in pairs] == [
        (f"CI.CCC.{code}E", f"CI.CCC.{code}N") for code in codes
    ]
    channels = [Channel.of(record) for record in records]
    assert len(set(recordings_of_channels(channels, {}))) == 1
    # of one instrument, or of locations that nobody states
    alike = [one._replace(record_id=str(k), component="HNE") for k, one in enumerate(channels)]
    assert len(motions_of(alike)) == (len(alike) if late == 0.01 else 1)
    assert len(set(recordings_of_channels(alike, {}))) == 1


def test_horizontals_of_different_instruments_are_named_and_no_pair() -> None:
    east, _, _, north = instruments("00.HN", "10.HN")
    pairs, unpaired = pair_horizontals([east, north])
    assert pairs == ()
    assert {one.reason for one in unpaired} == {
        "of the horizontals that overlap in time (CI.CCC.00.HNE, CI.CCC.10.HNN), no other is of "
        "the same instrument, window and file format. A pair has two."
    }


def test_a_sequence_is_no_recording_of_its_own() -> None:
    """Its response depends on that to its mainshock and on that to its aftershock."""
    main = [component(a, start_time="2019-07-06T03:19:40Z") for a in (0.0, 90.0)]
    after = [
        component(a, record_id=f"after{a:g}", start_time="2019-07-06T04:00:00Z")
        for a in (0.0, 90.0)
    ]
    other = component(0.0, station="CLC", record_id="other")
    joined = in_sequence([main[0], after[0]], rest=1.0)
    channels = [Channel.of(record) for record in (*main, *after, other, joined)]
    found = recordings_of_channels(channels, {joined.record_id: joined.parts})
    assert [found.index(key) for key in found] == [0, 0, 0, 0, 4, 0]
    assert len(set(recordings_of_channels(channels[:5], {}))) == 3


def shorter(record: Record, count: int) -> Record:
    return replace(record, acceleration=record.acceleration[:count])


def test_a_pair_and_its_vertical_are_cut_to_the_shortest_of_them() -> None:
    records = [component(90.0), shorter(component(0.0), 490), shorter(UP, 495)]
    ((pair,), unpaired) = pair_horizontals(records)
    assert unpaired == ()
    for cut, whole in zip((pair.first, pair.second, pair.vertical), records, strict=True):
        assert cut is not None
        np.testing.assert_array_equal(cut.acceleration, whole.acceleration[:490])
    energy = records[0].acceleration ** 2
    lost = 100.0 * energy[490:].sum() / energy.sum()
    assert pair.first.processing[-1] == (
        "length: cut to 490 of 500 samples, as of the motion: without 0.1 s and "
        f"{lost:.2g} % of the energy"
    )
    assert pair.second.processing == ()


def test_a_vertical_takes_the_length_of_the_record_beside_it() -> None:
    records = [shorter(component(90.0), 490), component(0.0), shorter(UP, 495)]
    beside = vertical_beside(records)
    np.testing.assert_array_equal(beside["r90"].acceleration, UP.acceleration[:490])
    np.testing.assert_array_equal(
        beside["r0"].acceleration, np.r_[UP.acceleration[:495], [0.0] * 5]
    )


def test_a_rotated_pair_finds_its_vertical() -> None:
    records = [component(90.0), shorter(component(0.0), 490), UP]
    ((pair,), _) = pair_horizontals(records)
    assert pair.vertical is not None
    rotated = rotate(pair, 30.0)
    (upward,) = vertical_beside([rotated, pair.vertical]).values()
    assert upward is pair.vertical


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"azimuth_degree": 1.0, "strike_degree": 2.0}, "both stated. State only one of them"),
        ({"azimuth_degree": math.inf}, "azimuth_degree inf. Must be a finite number"),
    ],
)
def test_a_rotation_is_to_one_finite_azimuth_or_strike(
    stated: dict[str, float], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        IngestOptions(**stated)


@pytest.mark.parametrize(
    ("second", "words"),
    [
        (component(45.0), "azimuths 90 and 45 degrees of 'r90' and 'r45'. A pair has two stated"),
        (component(0.0, station="CLC"), ALONE),
        (component(0.0, start_time="later"), ALONE),
        (component(0.0, event="another"), ALONE),
        (
            replace(component(0.0), time_step=0.02),
            "time steps [s] 0.01 and 0.02 of 'r90' and 'r0'. Must be equal.",
        ),
        (
            replace(component(0.0), acceleration=np.ones(3)),
            "of the energy of 'r90' is outside the samples that 'r90' and 'r0' share. Must be at "
            "most 50 %.",
        ),
        (
            component(0.0, start_time="2019-07-06T03:19:40.002Z"),
            "the first samples of 'r90' and 'r0' are 0.002 s apart, 0.2 time steps. Must be whole",
        ),
    ],
)
def test_what_does_not_belong_together_is_named(second: Record, words: str) -> None:
    pairs, unpaired = pair_horizontals([component(90.0), second])
    assert pairs == ()
    assert {u.record_id for u in unpaired} == {"r90", second.record_id}
    assert words in unpaired[0].reason


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_horizontals_are_square_within_a_hundredth_of_a_degree(sign: float) -> None:
    HorizontalPair(component(90.0), component(0.009 * sign))
    with pytest.raises(ParameterError, match="90 degrees apart"):
        HorizontalPair(component(90.0), component(0.011 * sign))


def test_three_horizontals_are_ambiguous() -> None:
    _, unpaired = pair_horizontals([component(a) for a in (0.0, 90.0, 180.0)])
    assert {u.reason for u in unpaired} == {
        "3 horizontals of station 'CCC': r0, r90, r180. A pair has two."
    }


def test_without_a_station_nothing_is_paired() -> None:
    pairs, unpaired = pair_horizontals([component(a, station="") for a in (0.0, 90.0)])
    assert pairs == ()
    assert all(u.reason == ALONE for u in unpaired)


def test_an_unstated_direction_is_no_horizontal() -> None:
    unstated = replace(component(0.0), orientation=Orientation.UNSTATED)
    _, unpaired = pair_horizontals([unstated])
    assert unpaired[0].reason.startswith("direction unstated")


def test_the_bundled_stations_are_pairs_with_verticals(bundled_records: Path) -> None:
    files = sorted(bundled_records.glob("*.V1"))
    pairs, unpaired = pair_horizontals(r for f in files for r in rockframe.read_file(f))
    assert [(p.first.azimuth, p.second.azimuth) for p in pairs] == [(90.0, 360.0)] * 3
    assert all(p.vertical and p.vertical.station == p.first.station for p in pairs)
    assert unpaired == ()


def test_public_names() -> None:
    assert rockframe.rotate is rotate
    assert isinstance(rockframe.rotd(PAIR), Sweep)
    assert rockframe.pair_horizontals([PAIR.first, PAIR.second])[0] == (PAIR,)


def test_rotd_of_a_spectral_acceleration_is_that_of_rotated_records() -> None:
    sweep = rotd_spectral_acceleration(PAIR, 0.3)
    for azimuth in (0, 37, 90):
        one = rotate(PAIR, azimuth)
        expected = spectral_acceleration(one.acceleration, one.time_step, [0.3])[0]
        assert sweep.values[azimuth] == pytest.approx(expected, rel=1e-12)


def test_rotd_of_a_motion_in_one_direction_has_closed_forms() -> None:
    """Toward an azimuth the spectral acceleration is |cos| of the angle between the two."""
    motion = PAIR.first.acceleration
    along = HorizontalPair(
        replace(PAIR.first, acceleration=0.8 * motion),
        replace(PAIR.second, acceleration=0.6 * motion),
    )
    expected = spectral_acceleration(motion, PAIR.first.time_step, [0.3])[0]
    sweep = rotd_spectral_acceleration(along, 0.3)
    assert sweep.percentile(100) == pytest.approx(expected, rel=1e-4)
    assert sweep.percentile(50) == pytest.approx(expected * math.sqrt(0.5), rel=1e-2)


def skewed(azimuth: float) -> list[Record]:
    """Return one component of PAIR, and its motion toward another azimuth."""
    toward = rotate(PAIR, azimuth)
    return [PAIR.first, replace(toward, record_id="skewed", source_format="")]


@pytest.mark.parametrize("azimuth", [0.0, 30.0, 96.0, 150.0, 265.0, 359.0, 180.0])
def test_components_at_any_angle_are_resolved_into_those_at_right_angles(azimuth: float) -> None:
    [motion], unpaired = both_directions(skewed(azimuth))
    assert unpaired == ()
    assert motion.first is PAIR.first
    across = rotate(PAIR, motion.second.azimuth)
    assert (motion.second.azimuth - PAIR.first.azimuth) % 180.0 == pytest.approx(90.0)
    np.testing.assert_allclose(motion.second.acceleration, across.acceleration, atol=2e-13)
    recorded = azimuth % 180.0 == 0.0
    assert recorded == (motion.remark == "")
    assert recorded or "'skewed' resolved at right angles to" in motion.second.processing[-1]


@pytest.mark.parametrize("azimuth", [90.0, 86.0, 94.9, 265.1, 274.0])
def test_components_that_are_nearly_parallel_are_rejected(azimuth: float) -> None:
    motions, unpaired = both_directions(skewed(azimuth))
    assert motions == ()
    assert [one.reason for one in unpaired] == 2 * [unpaired[0].reason]
    assert "degrees from parallel. Must be at least 5." in unpaired[0].reason


def test_components_of_unknown_azimuth_are_taken_as_at_right_angles() -> None:
    one, other = (
        replace(component(azimuth), azimuth=math.nan, orientation=orientation)
        for azimuth, orientation in ((90.0, Orientation.HORIZONTAL), (0.0, Orientation.UNSTATED))
    )
    [motion], _ = both_directions([one, other, UP])
    assert motion.remark == "azimuths of 'r90' and 'r0' unknown: taken as at right angles"
    assert (motion.first, motion.second, motion.vertical) == (one, other, UP)
    assert pair_horizontals([one, other])[0] == ()
    assert "azimuth of 'r0' unknown" in resolved(PAIR.first, other)[1]


def test_components_of_other_steps_and_lone_ones_are_rejected_with_the_reason() -> None:
    coarse = replace(PAIR.second, time_step=0.02)
    motions, unpaired = both_directions([PAIR.first, coarse, UP])
    assert motions == ()
    assert "time steps [s] 0.01 and 0.02 of 'r90' and 'r0'. Must be equal." in unpaired[0].reason
    [alone] = both_directions([PAIR.first])[1]
    assert alone.reason == ALONE
    third = replace(component(45.0), orientation=Orientation.UNSTATED)
    several = both_directions([PAIR.first, PAIR.second, third])[1]
    assert several[0].reason.startswith("3 horizontals of station 'CCC'")


def test_a_cut_pair_is_the_same_in_both_ways() -> None:
    """Both directions are cut as pairs are, with the vertical."""
    later = replace(
        PAIR.second,
        start_time="2019-07-06T03:19:40.05Z",
        acceleration=PAIR.second.acceleration[:-9],
    )
    [pair], _ = pair_horizontals([PAIR.first, later, UP])
    [motion], _ = both_directions([PAIR.first, later, UP])
    for name in ("first", "second", "vertical"):
        np.testing.assert_array_equal(
            getattr(motion, name).acceleration, getattr(pair, name).acceleration
        )


def orbits() -> list[HorizontalPair]:
    """Return noise toward all azimuths alike, along a line, in a narrow band, and a circle."""
    noise, other = PAIR.first.acceleration, PAIR.second.acceleration
    phase = 2.0 * math.pi * 0.01 * np.arange(500) / 0.3
    grown = np.minimum(np.arange(500) / 400.0, 1.0)
    return [
        HorizontalPair(
            replace(PAIR.first, acceleration=one), replace(PAIR.second, acceleration=another)
        )
        for one, another in (
            (noise, other),
            (0.8 * noise, 0.6 * noise),
            (noise, 0.7 * noise + 0.01 * other),
            (grown * np.sin(phase), grown * np.cos(phase)),
        )
    ]


@pytest.mark.parametrize("period", [0.004, 0.05, 0.3, 4.0])
def test_rotd_of_a_spectral_acceleration_is_that_of_all_steps_toward_all_azimuths(
    period: float,
) -> None:
    """Only steps near the hull of the orbit are rotated; this rotates every step."""
    for pair in orbits():
        swept = rotd(
            pair,
            transform=lambda series, step: oscillator_response(series, step, period),
            measure=oscillator_peak,
        )
        found = rotd_spectral_acceleration(pair, period).values
        rounding = 1e-13 * swept.values.max()
        np.testing.assert_allclose(found, swept.values, rtol=1e-11, atol=rounding)


def test_a_steady_orbit_has_one_peak_toward_all_azimuths_between_its_steps() -> None:
    """In resonance with 20 steps a turn, the largest step is up to 1.2 % below the peak."""
    turns = 400
    phase = 2.0 * math.pi * np.arange(turns * 20) / 20.0
    circle = HorizontalPair(
        replace(PAIR.first, acceleration=np.sin(phase)),
        replace(PAIR.second, acceleration=np.cos(phase)),
    )
    values = rotd_spectral_acceleration(circle, 0.2).values
    assert values.max() == pytest.approx(values.min(), rel=1e-4)


def test_rotd_of_samples_that_are_no_numbers_is_none() -> None:
    bad = PAIR.first.acceleration.copy()
    bad[30] = np.nan
    with np.errstate(invalid="ignore"):
        found = spectral_acceleration_toward([bad, bad], 0.01, 0.3, [[1.0, 0.0], [0.0, 1.0]])
        alone = spectral_acceleration(bad, 0.01, [0.3])
    assert np.isnan(found).all()
    assert np.isnan(alone).all()
