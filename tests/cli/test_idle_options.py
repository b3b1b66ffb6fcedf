"""Each pair of command and option is declared, and refused where it has no effect."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Final

import pytest
from tests.commands import commands, run

from rockframe.cli.options import flag
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.options.fetch import FetchOptions
from rockframe.options.ingest import IngestOptions, SelectOptions
from rockframe.options.model import Options
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import DesignOptions, RespondOptions, ScreenOptions
from rockframe.stages.ingest import ingest_stage

#: All pairs of command and option, with what the option needs to have an effect: nothing (always),
#: files of some kind (a warning says so if there are none), a figure, or other options.
DECLARED: Final = Path(__file__).with_name("effects.csv")
#: Values of options that have a condition; they differ from the defaults.
VALUES: Final = {
    **{"rest_s": "60", "hazard_site_within_km": "5", "before": "3", "after": "30"},
    **{"scrambling": "plain", "seed": "3", "most_half_cycles": "4", "share": "0.5"},
    **{"members": "32", "height": "0.02", "width": "0.02", "impact_loss": "3", "corner": "3"},
    **{"amplitude": "0.02", "orientation_degree": "3", "record": "A", "figures": "drawn"},
    **{"output": "elsewhere", "grid": "20", "catalogue_columns": "station=STA"},
    "contact_shortening": "3",
}
#: Models of the options of commands, and words without which their options are not read, with those
#: that take the effect of conditions away.
COMMANDS: Final[dict[str, tuple[str, tuple[type[Options], ...]]]] = {
    "fetch": (
        "--url X --start 2019-01-01 --end 2019-01-02 --station A --output f",
        (FetchOptions,),
    ),
    "ingest": ("a.csv --output r.nc", (IngestOptions,)),
    "select": ("r.nc --target t.csv --output s.nc", (SelectOptions,)),
    "pulse": ("r.nc --surrogates 0 --wavelet symmetric_ricker --output p.nc", (PulseOptions,)),
    "respond": ("r.nc --ensemble-members 0 --output x.nc", (RespondOptions,)),
    "screen": ("r.nc --output x.nc", (ScreenOptions,)),
}
DESIGN: Final = (
    *("--design-dimension", "height", "--design-range", "6", "12"),
    *("--design-statistic", "quantile_84"),
)


def declared() -> dict[tuple[str, str], str]:
    """Return what each pair of command and option needs, as the file declares it."""
    with DECLARED.open(encoding="utf-8", newline="") as lines:
        return {
            (command, row["option"]): row["needs"]
            for row in csv.DictReader(lines)
            for command in row["commands"].split()
        }


def conditions() -> dict[tuple[str, str], str]:
    """Return what pairs of command and option need, as the models of the options state it."""
    found = {}
    for command, (_, models) in COMMANDS.items():
        for model in models:
            for name, (words, _) in model.conditions.items():
                found[command, flag(name.replace(".", "-"))] = words
    for name, (words, _) in DesignOptions.conditions.items():
        found["screen", flag(f"design-{name}")] = words
    return found


def pairs() -> list[tuple[str, str]]:
    """Return all pairs of command and option, as the parsers state them."""
    return [
        (command, max(action.option_strings, key=len))
        for command, parser in commands().items()
        for action in parser._actions  # noqa: SLF001
        if action.option_strings and action.dest not in ("help", "json")
    ]


def test_each_pair_of_command_and_option_is_declared() -> None:
    """A new option states in the file what it needs, and in its model, if these are options."""
    stated = declared()
    assert sorted(stated) == sorted(pairs()), "tests/cli/effects.csv must list each option"
    assert conditions().items() <= stated.items()
    of_options = {pair for pair, needs in stated.items() if not needs.startswith(FREE)}
    assert of_options == {*conditions(), *OF_COMMANDS}


#: Beginnings of needs that are not other options.
FREE: Final = ("always", "files", "figure", "resources")
#: Options that are in no model, with words without what they need.
OF_COMMANDS: Final = {
    ("respond", "--record"): "r.nc --output x.nc --record A",
    ("respond", "--figures"): "r.nc --output x.nc --figures drawn",
    ("figure", "--beam-centre"): "joints --output a.png --beam-centre 1",
    **{
        ("report", f"--{name}"): f"run --{name} words"
        for name in ("company", "project", "question", "logo")
    },
}


@pytest.mark.parametrize(("command", "option"), [*conditions(), *OF_COMMANDS])
def test_an_option_without_effect_is_refused_in_one_line(
    command: str,
    option: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    if (command, option) in OF_COMMANDS:
        words = OF_COMMANDS[command, option].split()
    else:
        name = option[2:].replace("-", "_").removeprefix("ensemble_").removeprefix("design_")
        words = [*COMMANDS[command][0].split(), option, VALUES[name]]
        words += list(DESIGN) if option.startswith("--design") else []
    assert run(command, *words) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"rockframe: error: {option}")
    assert "has no effect without" in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_conditions_are_of_options_of_their_model_and_the_default_is_allowed() -> None:
    for model in (RespondOptions, ScreenOptions, PulseOptions, IngestOptions, DesignOptions):
        for name in model.conditions:
            assert name.split(".")[0] in model.model_fields
    assert ScreenOptions(scenario_members=16, ensemble={"corner": 3.0}).ensemble.corner == 3.0
    assert PulseOptions(surrogates=0, seed=0).seed == 0
    with pytest.raises(ParameterError, match="seed has no effect without surrogates"):
        PulseOptions(surrogates=0, seed=1)


@pytest.mark.parametrize(
    "words",
    [("--grid", "20"), ("--output", "elsewhere"), ("--records", "a.csv")],
)
def test_a_claim_alone_takes_no_other_options(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("paper", "--claim", "temple-p", *words) == 2
    assert f"{words[0]} has no effect with --claim" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"band_pass_hz": (0.1, 20.0)}, "band_pass_hz has no effect: all records count as corr"),
        ({"water_level_db": 60.0}, "none of the 1 records is of miniseed"),
        ({"streams": "raw"}, "streams has no effect: none of the 1 records is of asdf"),
    ],
)
def test_options_of_reading_that_concern_no_record_cause_a_warning(
    tmp_path: Path, stated: dict[str, object], said: str
) -> None:
    file = tmp_path / "motion.csv"
    file.write_text("time_s,acc_g\n0.00,0.0\n0.01,0.1\n0.02,-0.1\n0.03,0.05\n0.04,0.0\n")
    options = IngestOptions(**stated)
    with pytest.warns(RockframeWarning, match=said):
        ingest_stage([file], tmp_path / "records.nc", options, workers=0)
