"""Files of structures: strict reading, and error messages that give the place of a mistake."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.conftest import REPOSITORY

from rockframe.cli.main import main
from rockframe.errors import InputError, RockframeWarning
from rockframe.study.structures import bundled_records, read_structures

GOOD = """
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "structures.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_shipped_structures_are_those_of_the_paper_and_two_slender_ones() -> None:
    frames = {frame.name: frame for frame in read_structures()}
    bent = frames["bridge-bent"]
    assert (bent.height, bent.width, bent.mass_ratio) == (9.6, 1.6, 4.0)
    assert frames["apollo-column"].mass_ratio == 0.0
    assert frames["apollo-frame"].mass_ratio == 0.3
    assert len(frames) == 5
    round_ones = {name for name, frame in frames.items() if frame.section_both == "circular"}
    assert round_ones == {"bridge-bent", "apollo-column", "apollo-frame"}
    for frame in frames.values():
        assert frame.inertia_ratio == 4.0 / 3.0  # in one plane, the paper's rectangles


def test_bundled_records_are_there() -> None:
    assert sorted(path.suffix for path in bundled_records().iterdir()) == [".V1"] * 3 + [".csv"]


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    (frame,) = read_structures(written(tmp_path, GOOD.replace("4.0", "4")))
    assert frame.mass_ratio == 4.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass_ratio", "mass", r":6: unknown key 'mass'. Must be one of: name, kind, height_m"),
        ('name = "bent"', "", r":2: key 'name' missing. State it in each \[\[structure\]\]"),
        ("9.6", '"9.6"', r":4: height_m '9.6'. Must be a number"),
        ("9.6", "true", r":4: height_m True. Must be a number"),
        (
            "9.6",
            "-9.6",
            r":4: height_m -9.6. Must be between 0.001 and 1000 m",
        ),
        ("9.6", "0.0", r":4: height_m 0.0. Must"),
        ("mass_ratio", 'section_both = "square"\nmass_ratio', ":6: section_both 'square'. Must be"),
        (
            "mass_ratio",
            'section = "circular"\nsection_both = "circular"\nmass_ratio',
            "section_both 'circular'.*Must be absent unless the columns are solid, prismatic",
        ),
        ("9.6", "1e300", r":4: height_m 1e\+300. Must"),
        ("9.6", "nan", r":4: height_m nan. Must"),
        ("4.0", "-1.0", r":6: mass_ratio -1.0. Must"),
        ("1.6", "10.0", r"Invalid slenderness 46.17 degrees.*Must be below 45.56 degrees"),
        ('"bent"', '"a bent"', r":3: name 'a bent'. Must be 1 to 64 letters"),
        ('"bent"', "7", r":3: name 7. Must be text"),
        ("[[structure]]", "[structure]", r":2: no \[\[structure\]\] table. State at least one"),
        ("[[structure]]", "[[structures]]", r":2: unknown key 'structures'. Must be one of"),
        ("[[structure]]", "x = 3\n[[structure]]", r":2: unknown key 'x'. Must be one of"),
        ("9.6", "9.6.1", r"is not TOML"),
    ],
)
def test_each_mistake_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(InputError, match=words) as caught:
        read_structures(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("stated", "name"),
    [("Κίων_1", "Κίων_1"), ("柱", "柱"), ("e\u0301tai", "\xe9tai")],  # composed, so it can be found
)
def test_names_keep_letters_of_any_script(tmp_path: Path, stated: str, name: str) -> None:
    path = tmp_path / "structures.toml"
    path.write_text(GOOD.replace("bent", stated), encoding="utf-8")
    assert [frame.name for frame in read_structures(path)] == [name]


def test_sound_structures_are_looked_for_in_no_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Finding a line reads the whole file, so one search per structure would be quadratic."""
    from rockframe.study import structures

    monkeypatch.delattr(structures, "line_of")
    tables = (f'[[structure]]\nname = "s{k}"\nheight_m = 2.0\nwidth_m = 0.2\n' for k in range(3))
    (tmp_path / "three.toml").write_text("".join(tables))
    assert [frame.name for frame in read_structures(tmp_path / "three.toml")] == ["s0", "s1", "s2"]


def test_a_name_stated_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r":9: name 'bent' is stated twice"):
        read_structures(written(tmp_path, GOOD + GOOD))


@pytest.mark.parametrize("text", ["structure = []", "", "structure = 3"])
def test_no_structure_at_all_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"no \[\[structure\]\] table. State at least one"):
        read_structures(written(tmp_path, text))


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "structures.toml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert [frame.name for frame in read_structures(path)] == ["bent"]


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_structures(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("keys", "inertia_ratio", "restitution_over_rectangular"),
    [
        ('section = "rectangular"', 4.0 / 3.0, 1.0),
        ('section = "circular"', 4.0 / 3.0 - 1.6**2 / (1.6**2 + 9.6**2) / 12.0, None),
        ("inertia_ratio = 1.25", 1.25, None),
        ("restitution_factor = 0.9", 4.0 / 3.0, 0.9),
    ],
)
def test_sections_and_restitution(
    tmp_path: Path, keys: str, inertia_ratio: float, restitution_over_rectangular: float | None
) -> None:
    [frame] = read_structures(written(tmp_path, GOOD + keys + "\n"))
    [rectangular] = read_structures(written(tmp_path, GOOD))
    assert frame.inertia_ratio == pytest.approx(inertia_ratio, rel=1e-15)
    size, alpha, kappa, gamma = frame.size, frame.slenderness, inertia_ratio, 4.0
    p2 = 9.81 / (kappa * size) * (1.0 + 2.0 * gamma) / (1.0 + 4.0 * gamma / kappa)
    assert frame.effective_frequency_parameter == pytest.approx(math.sqrt(p2), rel=1e-14)
    loss = 2.0 * math.sin(alpha) ** 2 * (1.0 + 4.0 * gamma) / (kappa + 4.0 * gamma)
    factor = restitution_over_rectangular or 1.0
    assert frame.restitution == pytest.approx(factor * (1.0 - loss), rel=1e-14)
    if restitution_over_rectangular is not None:
        assert frame.restitution == pytest.approx(factor * rectangular.restitution, rel=1e-15)


def test_a_section_beside_an_inertia_ratio_is_refused(tmp_path: Path) -> None:
    both = 'section = "circular"\ninertia_ratio = 1.3\n'
    with pytest.raises(InputError, match="Must be absent where section 'circular' is stated"):
        read_structures(written(tmp_path, GOOD + both))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("4.0", "400.0", r":2: structure 'bent': mass_ratio 400 is above 50. Check units"),
        ("9.6\nwidth_m = 1.6", "960\nwidth_m = 160", r"height 960 m is above 100\. Check"),
        ("9.6\nwidth_m = 1.6", "0.096\nwidth_m = 0.016", r"height 0\.096 m is below 0\.2\. Check"),
        ("1.6", "0.16", r":2: structure 'bent': slenderness 0.95 degrees is below 2. Check"),
        ("1.6", "7.0", r":2: structure 'bent': slenderness 36.10 degrees is above 35. Check"),
    ],
)
def test_what_is_unusual_warns_and_is_computed(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    """Such a value is usually a mistake, but the theory holds for it."""
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.warns(RockframeWarning, match=words):
        (frame,) = read_structures(path)
    assert frame.name == "bent"


def test_a_command_warns_in_one_line_and_goes_on(
    tmp_path: Path, motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, GOOD.replace("4.0", "400.0"))
    words = ["--units", "g", "--time-step", "0.01", "--output", str(tmp_path / "run")]
    words += ["--structures", str(path), "--margins", "none", "--surrogates", "0"]
    words += ["--histories", "none", "--ensemble-members", "0"]
    assert main(["table1", "--records", str(motion), *words]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert lines == [
        f"rockframe: warning: {path}:2: structure 'bent': mass_ratio 400 is above 50. "
        "Check units and values."
    ]


def test_a_depth_of_a_solid_column_names_what_it_is_for(tmp_path: Path) -> None:
    cure = r"depth_m 0.8. Must be stated with density_kg_m3 .* or with inner_width_m"
    with pytest.raises(InputError, match=cure):
        read_structures(written(tmp_path, GOOD + "depth_m = 0.8\n"))
    [frame] = read_structures(written(tmp_path, GOOD + "depth_m = 0.8\ndensity_kg_m3 = 2500.0\n"))
    assert frame.column_mass == pytest.approx(2500.0 * frame.height * frame.width * 0.8)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            "height_m = [7, 9]\nwidth_m = 1.6",
            "height_m [7, 9]. Must be a number. Columns are equal. Two columns of unequal size are "
            'kind = "unequal", with heights_m, widths_m and spacing_m. See',
        ),
        ("height_m = [7, 9, 8]\nwidth_m = 1.6", "Must be a number. Columns are equal. See"),
        ("height_m = 7.0\ndrums = 6", "unknown key 'drums'. Not modelled: drums. See"),
        ("[structure.soil]\nstiffness_n_m = 1e9", "unknown key 'soil'. Not modelled: soil and"),
        ("height_m = 7.0\nsupport = 'frame'", "unknown key 'support'. Not modelled: pedestals."),
    ],
)
def test_a_structure_that_is_not_modelled_is_told_which_page_names_another_program(
    lines: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "structures.toml"
    path.write_text(f'[[structure]]\nname = "a"\n{lines}\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"What it cannot do, and what to use instead") as error:
        read_structures(path)
    assert said in str(error.value)
    page = (REPOSITORY / "docs" / "limits.md").read_text("utf-8")
    assert page.startswith("# What it cannot do, and what to use instead\n")


def test_a_misspelt_key_is_not_taken_for_a_structure_that_is_not_modelled(tmp_path: Path) -> None:
    path = tmp_path / "structures.toml"
    path.write_text('[[structure]]\nname = "a"\nhieght_m = 7.0\n', encoding="utf-8")
    with pytest.raises(InputError, match="Did you mean height_m"):
        read_structures(path)


MASSES = """
[[structure]]
name = "stoa"
height_m = 6.0
width_m = 1.0
section = "circular"
density_kg_m3 = 2500.0
columns = 6
"""
SOLID = "beam_length_m = 15.0\nbeam_width_m = 0.9\nbeam_depth_m = 0.8\n"


def test_masses_of_beam_and_columns_give_their_ratio(tmp_path: Path) -> None:
    """The ratio is that of the masses: 640 t on six columns, or a solid beam of the same stone."""
    column = 0.25 * math.pi * 6.0  # m3
    (stated,) = read_structures(written(tmp_path, MASSES + "beam_mass_kg = 640e3\n"))
    assert stated.mass_ratio == pytest.approx(640e3 / (6.0 * 2500.0 * column))
    (solid,) = read_structures(written(tmp_path, MASSES + SOLID))
    assert solid.mass_ratio == pytest.approx(15.0 * 0.9 * 0.8 / (6.0 * column))  # any density
    assert (solid.columns, solid.beam_depth) == (6, 0.8)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MASSES + "beam_mass_kg = -1.0\n", r"beam_mass_kg -1.0.*Must be positive"),
        (MASSES + "beam_mass_kg = 1e5\nmass_ratio = 4.0\n", r"mass_ratio 4.0.*Must be absent"),
        (MASSES + SOLID + "beam_mass_kg = 1e5\n", "beam_mass_kg.*absent where beam_length_m"),
        (
            MASSES.replace("columns = 6", "") + "beam_mass_kg = 1e5\n",
            "beam_mass_kg.*stated with columns, their number",
        ),
        (
            MASSES.replace("density_kg_m3 = 2500.0", "") + "beam_mass_kg = 1e5\n",
            "stated with columns, their number, and with column_mass_kg or density_kg_m3",
        ),
        (MASSES + SOLID.replace("beam_depth_m = 0.8", ""), "beam_length_m 15.0.*beam_depth_m and"),
        (MASSES + SOLID.replace("= 15.0", "= -15.0"), "beam_length_m -15.0.*Must be positive"),
        (MASSES + SOLID.replace("= 0.9", "= -0.9"), "beam_width_m -0.9.*Must be positive"),
        (
            MASSES.replace("density_kg_m3 = 2500.0", "column_mass_kg = 0.0")
            + "beam_mass_kg = 1e5\n",
            ":7: column_mass_kg 0.0.*Must be positive",
        ),
        (MASSES + "beam_width_m = 0.9\n", "beam_width_m 0.9.*stated with beam_length_m"),
        (MASSES + "mass_ratio = 0.0\n", "columns 6.*Must be 1: without a beam"),
        (
            MASSES.replace("columns = 6", "columns = 0") + "beam_mass_kg = 1e5\n",
            "columns 0.*Must be an integer from 1 to 1000",
        ),
    ],
)
def test_masses_that_do_not_give_a_ratio_are_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_structures(written(tmp_path, text))
