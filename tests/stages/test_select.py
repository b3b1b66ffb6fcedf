"""Selected records: their spectra, factors and constraints, and the list that ingest reads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from tests.screening import sine, site, stored, three

from rockframe.cli.main import main
from rockframe.errors import InputError, ParameterError
from rockframe.options.ingest import Filters, IngestOptions, SelectOptions
from rockframe.record import Record
from rockframe.results.records import open_records
from rockframe.signals.measures import spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.select import Selection, read_selection, select_stage
from rockframe.study.structures import bundled_records
from rockframe.units import GRAVITY

TARGET = "period_s,sa_g,sigma_ln_sa\n0.2,0.5,0.5\n0.5,0.6,0.5\n1,0.4,0.5\n2,0.2,0.6\n"


@pytest.fixture(scope="module")
def real(bundled_records: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two uncorrected recordings, each of two horizontals and a vertical, as ingest wrote them."""
    home = tmp_path_factory.mktemp("select")
    options = IngestOptions(spectral_periods_s=(0.5,))
    ingest_stage(recordings(bundled_records), home / "records.nc", options, workers=0)
    (home / "target.csv").write_text(TARGET, encoding="utf-8")
    return home


def recordings(folder: Path) -> list[Path]:
    return [folder / f"Ridgecrest2019-{name}.V1" for name in ("CLC", "CCC")]


def selected(
    home: Path, filters: Filters | None = None, output: str = "selected.nc", **options: Any
) -> Selection:
    """Select from the records of a folder, without a spread of the target unless stated."""
    target = home / "target.csv"
    if not target.exists():
        target.write_text(TARGET, encoding="utf-8")
    wanted = SelectOptions(**{"target": target, "motions": 2, **options})
    return select_stage(home / "records.nc", home / output, wanted, filters=filters)


def of_selected(home: Path) -> dict[str, Record]:
    with open_records(home / "selected.nc") as file:
        return {record.record_id: record for record in file}


def test_selected_motions_have_the_target_where_they_are_scaled(real: Path) -> None:
    """Sa of the written samples, computed again, is that of the target at this period."""
    at_period: dict[str, Any] = {"scale_period_s": 0.7}
    given: dict[str, Any] = {"conditioning_period_s": 0.7, "conditioning_sa_g": 0.6}
    for options in (at_period, given):
        found = selected(real, **options)
        aim = np.exp(found.target.log_sa_at(0.7))
        for row in found.motions:
            record = of_selected(real)[row["record_id"]]
            sa = spectral_acceleration(record.acceleration, record.time_step, [0.7])
            assert_allclose(sa, aim, rtol=5e-6)  # scales have six digits
            assert float(record.processing[-1].removeprefix("scaled by ")) == row["scale"]


def test_selected_motions_are_not_selected_again(real: Path, tmp_path: Path) -> None:
    """The second list would not have the first factor, so it would not make the same motions."""
    selected(real)
    again = SelectOptions(target=real / "target.csv", motions=1)
    with pytest.raises(
        ParameterError, match=r"is scaled by \d.* already\. Select from the records"
    ):
        select_stage(real / "selected.nc", tmp_path / "again.nc", again)
    assert not list(tmp_path.iterdir())


def test_motions_scaled_by_pgv_have_this_pgv(real: Path) -> None:
    for row in selected(real, scale_pgv_m_s=0.4).motions:
        record = of_selected(real)[row["record_id"]]
        assert_allclose(peak(integrate(record.acceleration, record.time_step)), 0.4, rtol=5e-6)
        assert_allclose(row["pgv_m_s"], 0.4, rtol=5e-6)


def test_the_table_of_spectra_is_of_the_written_samples(real: Path) -> None:
    found = selected(real)
    records = of_selected(real)
    heading, *lines = found.tables[1].read_text(encoding="utf-8").splitlines()
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines]).T
    columns = dict(zip(heading.split(","), table, strict=True))
    sa = [
        spectral_acceleration(records[name].acceleration, records[name].time_step, table[0])
        for name in (row["record_id"] for row in found.motions)
    ]
    logs = np.log(sa) - np.log(GRAVITY)
    assert_allclose(np.log([columns[row["record_id"]] for row in found.motions]), logs, rtol=1e-8)
    assert_allclose(columns["median_sa_g"], np.exp(logs.mean(axis=0)), rtol=1e-9)
    assert_allclose(columns["sigma_ln_sa"], logs.std(axis=0, ddof=1), rtol=1e-8)


def test_ingest_makes_the_same_records_from_the_list(real: Path, bundled_records: Path) -> None:
    """Both scale every sample and measure alike, whichever measures there are; only RotD differs,
    because ingest does not know the other horizontals.
    """
    selected(real)
    options = IngestOptions(selection=real / "selected.csv", spectral_periods_s=(0.5,))
    ingest_stage(recordings(bundled_records), real / "again.nc", options, workers=0)
    with xr.open_dataset(real / "selected.nc") as one, xr.open_dataset(real / "again.nc") as other:
        assert one.sizes == other.sizes
        assert one.sizes["record"] == 4
        order = [one["record_id"].values.tolist().index(n) for n in other["record_id"].values]
        unknown = [n for n in one.data_vars if "rotd" in str(n) or n == "unpaired"]
        here = one.drop_dims("obs").drop_vars(unknown).isel(record=order)
        xr.testing.assert_allclose(here, other.drop_dims("obs").drop_vars(unknown), rtol=1e-9)
    with open_records(real / "selected.nc") as made, open_records(real / "again.nc") as again:
        for name in made.names:
            assert_allclose(made.read(name).acceleration, again.read(name).acceleration, rtol=1e-12)
            before, after = made.as_read(name), again.as_read(name)
            assert before is not None
            assert after is not None
            assert_allclose(before.samples, after.samples, rtol=1e-12)


def test_the_vertical_goes_with_a_selected_horizontal(tmp_path: Path) -> None:
    """Two selected components of a recording have two factors, so its vertical has neither."""
    stored([*three("a"), *three("b")], tmp_path)
    found = selected(tmp_path)
    verticals = {row["vertical_of"]: row for row in found.rows if row["vertical_of"]}
    assert set(verticals) == {row["record_id"] for row in found.motions}
    for row in found.motions:
        vertical = verticals[row["record_id"]]
        assert vertical["scale"] == row["scale"]
        record = of_selected(tmp_path)[vertical["record_id"]]
        assert_allclose(record.pga, 0.5 * row["scale"], rtol=1e-12)
    both = selected(tmp_path, motions=4, most_per_station=2)
    assert len(both.rows) == len(both.motions) == 4


def test_one_motion_of_a_station_is_selected_by_default(tmp_path: Path) -> None:
    stored([sine(f"{s}{k}", 2.0 + k, station=s) for s in "abc" for k in range(3)], tmp_path)
    assert sorted(row["station"] for row in selected(tmp_path, motions=3).motions) == [*"abc"]
    two = selected(tmp_path, motions=6, most_per_station=2)
    assert sorted(row["station"] for row in two.motions) == [*"aabbcc"]


def test_motions_of_one_event_can_be_limited(tmp_path: Path) -> None:
    """Records without an event are events of their own."""
    events = ["one", "one", "one", "two", "", ""]
    records = [sine(f"s{k}", 2.0 + k, event=event) for k, event in enumerate(events)]
    stored(records, tmp_path)
    found = selected(tmp_path, motions=4, most_per_event=1)
    assert sorted(row["event"] for row in found.motions) == ["", "", "one", "two"]
    with pytest.raises(ParameterError, match="2 by most_per_station or most_per_event"):
        selected(tmp_path, motions=5, most_per_event=1)


def test_filters_are_those_of_ingest_and_screen(tmp_path: Path) -> None:
    stored(site(8), tmp_path)
    found = selected(tmp_path, Filters(magnitude=(5.2, 5.4)))
    assert found.candidates == 3
    assert {row["record_id"] for row in found.motions} < {"s02", "s03", "s04"}
    assert found.left_out["s07"] == "magnitude 5.7. Must be from 5.2 to 5.4"


def test_a_selection_that_cannot_reach_its_number_says_why(tmp_path: Path) -> None:
    """Five of 8 sines have other magnitudes; no factor up to 4 gives a PGV of 1 km/s."""
    stored(site(8), tmp_path)
    with pytest.raises(ParameterError) as error:
        selected(tmp_path, Filters(magnitude=(5.2, 5.4)), motions=5)
    assert str(error.value) == (
        "5 motions wanted, but only 3 can be selected of 8 horizontal records. "
        "Filtered out: 5 by magnitude. Allow more, add records, or state fewer motions."
    )
    with pytest.raises(ParameterError, match=r"only 0 can .* Filtered out: 8 by scale_bounds\."):
        selected(tmp_path, scale_pgv_m_s=1e3)


def test_records_are_usable_at_all_periods(real: Path) -> None:
    """Records that were filtered at 0.06 to 0.08 Hz say nothing about 20 s."""
    text = "period_s,sa_g\n0.5,0.4\n20,0.01\n"
    (real / "long.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError, match="Filtered out: 4 by usable_period_longest"):
        selected(real, target=real / "long.csv")


def test_pulse_likeness_needs_pulses(tmp_path: Path) -> None:
    stored(site(3), tmp_path)
    with pytest.raises(ParameterError, match=r"pulse_like needs pulses\. State them with --pulses"):
        selected(tmp_path, pulse_like=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"conditioning_period_s": 1.0}, "Of conditioning_period_s and conditioning_sa_g only one"),
        ({"scale_period_s": 1.0, "scale_pgv_m_s": 1.0}, "both stated: each scales the motions"),
        ({"scale_bounds": (2.0, 1.0)}, r"scale_bounds \[2, 1\]\. Must be two numbers from"),
        ({"scale_bounds": (1.0, 1e300)}, r"Must be two numbers from 0\.001 to 1000, the smaller"),
        ({"hazard_site": (200.0, 95.0)}, r"hazard_site 200 95\. Must be longitude, then latitude"),
    ],
)
def test_contradicting_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        SelectOptions(**{"target": Path("t.csv"), **options})


def test_a_period_of_scaling_outside_the_target_is_refused(tmp_path: Path) -> None:
    stored(site(3), tmp_path)
    with pytest.raises(ParameterError, match=r"scale_period_s 3\. Must be within .* 0\.2 to 2 s"):
        selected(tmp_path, scale_period_s=3.0)


def test_an_input_is_not_replaced(tmp_path: Path) -> None:
    stored(site(3), tmp_path)
    with pytest.raises(InputError, match="is an input of this command"):
        selected(tmp_path, output="records.nc")
    with pytest.raises(InputError, match=r"The table beside target\.nc would replace it"):
        selected(tmp_path, output="target.nc")
    for name, begins, what in (
        ("selected-spectra", "period_s", "the table of their spectra"),
        ("selected", "record_id", "the list of selected motions"),
    ):
        (tmp_path / f"{name}.csv").write_text(f"{begins},mine\n", encoding="utf-8")
        with pytest.raises(InputError, match=f"is in the place of {what}"):
            selected(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("record_id\na\n", ":1: columns record_id. Must include record_id and scale"),
        ("record_id,scale\n", ": states no record."),
        ("record_id,scale\na,1\na,2\n", ":3: record_id 'a' is stated twice."),
        ("record_id,scale\n../a,1\n", ":2: record_id '../a'. Must be a record"),
        ("record_id,scale\na,0\n", ":2: scale '0'. Must be a number from 0.001 to 1000."),
        ("record_id,scale\na,1e300\n", ":2: scale '1e300'. Must be a number from 0.001"),
        ("record_id,scale\na\n", ":2: scale ''. Must be a number from 0.001 to 1000."),
    ],
)
def test_a_list_with_a_fault_is_named(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_selection(path)
    assert str(error.value).startswith(f"{path}{message}")


@pytest.mark.parametrize(
    ("line", "filters", "message"),
    [
        ("nothing,1\n", None, "record 'nothing' of the selection is not in the files"),
        (
            "Ridgecrest2019-CLC-UP,1\n",
            Filters(pgv_m_s=(0.2, 9.0)),
            r"record 'Ridgecrest2019-CLC-UP' of the selection was not accepted: pgv_m_s 0\.185",
        ),
    ],
)
def test_a_selected_record_that_ingest_does_not_accept_is_an_error(
    line: str, filters: Filters | None, message: str, bundled_records: Path, tmp_path: Path
) -> None:
    """Nothing is written: the set would no longer match its target."""
    path = tmp_path / "list.csv"
    path.write_text(f"record_id,scale\nRidgecrest2019-CLC-360,0.5\n{line}", encoding="utf-8")
    file, options = recordings(bundled_records)[0], IngestOptions(selection=path)
    with pytest.raises(ParameterError, match=message):
        ingest_stage([file], tmp_path / "made.nc", options, filters=filters, workers=0)
    assert not (tmp_path / "made.nc").exists()


def test_the_command_prints_the_motions_and_the_largest_differences(
    real: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["select", f"{real}/records.nc", "--target", f"{real}/target.csv", "--motions", "2"]
    words += ["--output", f"{real}/selected.nc"]
    assert main([*words, "--scale-period-s", "1"]) == 0
    assert " +0.0 " in capsys.readouterr().out  # not -0.0
    assert main([*words, "--figure", f"{real}/figure.png"]) == 0
    printed = capsys.readouterr().out
    assert "2 motions for target.csv" in printed
    assert "Largest difference of the median: " in printed
    assert "Of the standard deviation: " in printed
    assert "4 of 4 horizontal records were candidates. " in printed
    assert (real / "figure.caption.txt").is_file()
    assert main([*words, "--json"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert [row["record_id"] for row in known["motions"]] == [
        row["record_id"] for row in selected(real).motions
    ]
    assert len(known["periods"]) == 4


@pytest.mark.parametrize("stated", [["--uncorrected"], ["--trust", "samples"]])
def test_options_of_reading_belong_to_ingest(
    stated: list[str], real: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The records of a netCDF file are read already, so such an option would change nothing."""
    words = ["select", f"{real}/records.nc", "--target", f"{real}/target.csv", "--motions", "2"]
    with pytest.raises(SystemExit, match="2"):
        main([*words, *stated, "--output", f"{real}/read.nc"])
    said = capsys.readouterr().err
    assert f"unknown option {stated[0]}. It is one of `rockframe ingest`: give its" in said
    assert said.count("\n") == 1
    assert not list(real.glob("read*"))


def test_a_file_that_needs_options_points_to_ingest(
    real: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`select` reads files that state their units; the others are rejected or, alone, an error."""
    (tmp_path / "bare.csv").write_text("0.0\n0.1\n-0.1\n0.05\n0.0\n", encoding="utf-8")
    words = ["--target", f"{real}/target.csv", "--motions", "2", "--output", f"{tmp_path}/s.nc"]
    assert main(["select", f"{tmp_path}/bare.csv", *words]) == 2
    said = capsys.readouterr().err
    assert "--units. State such options to `rockframe ingest`, and give its records.nc" in said
    assert main(["select", f"{tmp_path}/bare.csv", str(bundled_records()), *words]) == 1
    *_, rejected, pointed = capsys.readouterr().err.splitlines()
    assert "rejected: bare.csv" in rejected
    assert pointed.startswith("rockframe: State such options to `rockframe ingest`")
