"""Files of structures: strict, and each mistake named with where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.study import bundled_records, read_structures

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


def test_bundled_records_are_there() -> None:
    assert sorted(path.suffix for path in bundled_records().iterdir()) == [".V1"] * 3 + [".csv"]


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    (frame,) = read_structures(written(tmp_path, GOOD.replace("4.0", "4")))
    assert frame.mass_ratio == 4.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "mass_ratio",
            "mass",
            r"unknown key 'structure\[0\].mass'. Must be one of: name, height_m",
        ),
        ('name = "bent"', "", r"missing key 'structure\[0\].name'"),
        ("9.6", '"9.6"', r"structure\[0\].height_m '9.6': input should be a valid number"),
        ("9.6", "-9.6", r"structure\[0\]: Invalid height -9.6 of frame 'bent'. Must be positive"),
        ("9.6", "0.0", r"Invalid height 0.0"),
        ("9.6", "nan", r"Invalid height nan"),
        ("4.0", "-1.0", r"Invalid mass_ratio -1.0"),
        ("1.6", "10.0", r"Invalid slenderness 46.17 degrees .* Must be below 45.56 degrees"),
        ("bent", "a bent", r"structure\[0\].name 'a bent'"),
        ("[[structure]]", "[structure]", r"structure "),
        ("[[structure]]", "[[structures]]", r"unknown key 'structures'|missing key 'structure'"),
        ("9.6", "9.6.1", r"is not TOML"),
    ],
)
def test_each_mistake_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(InputError, match=words) as caught:
        read_structures(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_a_name_stated_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"structure\[1\].name 'bent'. Must not be stated twice"):
        read_structures(written(tmp_path, GOOD + GOOD))


def test_no_structure_at_all_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="structure"):
        read_structures(written(tmp_path, "structure = []"))


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_structures(tmp_path / "none.toml")
