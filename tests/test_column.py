"""Columns that are not prismatic: their shape, and frames with such columns."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame, crushed
from rockframe.parts import Pivot, hollow, inertia_ratio_of, tapered, volume
from rockframe.rocking import GroundAcceleration, column_forces, impact_impulses, reactions, respond
from rockframe.rocking.design import Design
from rockframe.study.structures import read_structures
from rockframe.units import GRAVITY

SECTION = st.sampled_from(["rectangular", "circular"])
LENGTH = st.floats(0.5, 20.0)
WIDTH = st.floats(0.2, 2.0)
#: Roughly the columns of the temple of Apollo at Bassae, under an epistyle.
TEMPLE = RockingFrame(
    height=5.9,
    width=1.1,
    mass_ratio=0.6,
    inertia_ratio=tapered("circular", 5.9, 1.1, 0.9).inertia_ratio,
    top_width=0.9,
    centre_of_gravity=tapered("circular", 5.9, 1.1, 0.9).centre_of_gravity,
)


@given(section=SECTION, height=LENGTH, width=WIDTH)
def test_a_column_that_does_not_taper_is_prismatic(
    section: str, height: float, width: float
) -> None:
    shape = tapered(section, height, width, width)
    assert shape.centre_of_gravity == pytest.approx(0.5 * height, rel=1e-13)
    assert shape.inertia_ratio == pytest.approx(inertia_ratio_of(section, height, width), rel=1e-13)


@given(section=SECTION, height=LENGTH, width=WIDTH, share=st.floats(0.2, 1.5))
def test_a_tapered_column_is_the_sum_of_its_slices(
    section: str, height: float, width: float, share: float
) -> None:
    top = share * width

    def slices(power_of_z: int, gyration: float) -> float:
        """Integrate the area of slices times z^n, or times their own squared radius of gyration."""

        def of(z: float) -> float:
            across = width + (top - width) * z / height
            area = across if section == "rectangular" else across**2
            return area * (z**power_of_z if gyration == 0.0 else gyration * across**2)

        return float(quad(of, 0.0, height, epsabs=0.0, epsrel=1e-12)[0])

    mass, own = slices(0, 0.0), 1.0 / 12.0 if section == "rectangular" else 1.0 / 16.0
    centre = slices(1, 0.0) / mass
    about_corner = (slices(2, 0.0) + slices(0, own)) / mass + 0.25 * width**2
    shape = tapered(section, height, width, top)
    assert shape.centre_of_gravity == pytest.approx(centre, rel=1e-10)
    expected = about_corner / (centre**2 + 0.25 * width**2)
    assert shape.inertia_ratio == pytest.approx(expected, rel=1e-10)


def test_a_hollow_column_has_the_volume_of_its_walls() -> None:
    """A thin ring is as long as its mean circumference."""
    ring = 9.0 * math.pi * 1.9 * 0.1
    assert volume("circular", 9.0, 2.0, inner_width=1.8) == pytest.approx(ring, rel=1e-12)
    walls = 9.0 * (4.0 * 2.0 - 3.0 * 1.5)
    sizes = {"depth": 4.0, "inner_width": 1.5, "inner_depth": 3.0}
    assert volume("rectangular", 9.0, 2.0, **sizes) == pytest.approx(walls, rel=1e-12)
    assert volume("circular", 9.0, 2.0) == pytest.approx(9.0 * math.pi, rel=1e-12)
    assert volume("rectangular", 9.0, 2.0, depth=4.0) == pytest.approx(72.0, rel=1e-12)


def test_a_hollow_column_is_the_outer_less_the_inner_one() -> None:
    def about_corner(section: str, width: float) -> float:
        """Return the inertia per mass of a solid column about the corner of the outer column."""
        squared = inertia_ratio_of(section, 9.0, width) * (9.0**2 + width**2) / 4.0
        return squared + 0.25 * (2.0**2 - width**2)

    outer, inner = about_corner("circular", 2.0), about_corner("circular", 1.5)
    expected = (outer * 2.0**2 - inner * 1.5**2) / (2.0**2 - 1.5**2)
    found = hollow("circular", 9.0, 2.0, 1.5).inertia_ratio
    assert found * (9.0**2 + 2.0**2) / 4.0 == pytest.approx(expected, rel=1e-14)
    outer, inner = about_corner("rectangular", 2.0), about_corner("rectangular", 1.5)
    expected = (outer * 2.0 * 4.0 - inner * 1.5 * 3.0) / (2.0 * 4.0 - 1.5 * 3.0)
    found = hollow("rectangular", 9.0, 2.0, 1.5, 4.0, 3.0).inertia_ratio
    assert found * (9.0**2 + 2.0**2) / 4.0 == pytest.approx(expected, rel=1e-14)


@given(height=st.floats(3.0, 20.0), width=WIDTH, gamma=st.floats(0.0, 100.0))
def test_the_general_formulas_have_the_papers_as_their_case(
    height: float, width: float, gamma: float
) -> None:
    plain = RockingFrame(height=height, width=width, mass_ratio=gamma)
    stated = RockingFrame(
        height=height, width=width, mass_ratio=gamma, top_width=width, centre_of_gravity=height / 2
    )
    for name in (
        *("slenderness", "size", "frequency_parameter", "effective_frequency_parameter"),
        *("effective_size", "restitution", "uplift_acceleration"),
    ):
        assert getattr(stated, name) == pytest.approx(getattr(plain, name), rel=1e-13), name
    assert stated.beam.length == pytest.approx(plain.beam.length, rel=1e-13)


def test_the_moment_on_still_ground_is_the_slope_of_the_potential_energy() -> None:
    theta, step = np.linspace(0.01, 0.3, 7), 1e-5

    def potential(theta: np.ndarray) -> np.ndarray:
        """Return the potential energy of a column and its share of the beam, per column mass."""
        column = TEMPLE.centre.lift(theta)
        return np.asarray(GRAVITY * (column + TEMPLE.mass_ratio * TEMPLE.beam.lift(theta)))

    slope = (potential(theta + step) - potential(theta - step)) / (2.0 * step)
    inertia = GRAVITY / TEMPLE.effective_frequency_parameter**2 * math.hypot(*TEMPLE._arms)  # noqa: SLF001
    moment = TEMPLE.effective_frequency_parameter**2 * np.sin(TEMPLE.slenderness - theta)
    np.testing.assert_allclose(inertia * moment, slope, rtol=1e-8)


def test_an_impact_keeps_the_angular_momentum_that_the_paper_says() -> None:
    """The angular momentum of a column about its new corner changes only by the beam's impulse."""
    b, top, h = 0.5 * TEMPLE.width, 0.5 * TEMPLE.top_contact_width, TEMPLE.centre_height
    inertia, gamma, height = TEMPLE.inertia_ratio * TEMPLE.size**2, TEMPLE.mass_ratio, TEMPLE.height
    # Before: rotation about the right corner at rate 1 (clockwise). The centre has the velocity
    # (h, -b); the seat of the beam, left of the axis by b_t, has (height, -(b + b_t)). After:
    # rotation about the left corner at rate e, with e (h, b) and e (height, b + b_t); the seat is
    # now right of the axis.
    own = inertia - b**2 - h**2
    before = own + h * h - b * b + gamma * (height * height - (b + top) ** 2)
    after = inertia + gamma * (height**2 + (b + top) ** 2)
    assert TEMPLE.restitution == pytest.approx(before / after, rel=1e-13)


def test_a_tapered_frame_moves_as_lagrange_says() -> None:
    """DOP853 solves the equation from the kinetic and potential energy; no impact occurs."""
    rng = np.random.default_rng(5)
    samples = 6.0 * np.exp(-(((np.arange(200) * 0.01) - 0.4) ** 2) / 0.02)
    samples += rng.normal(0.0, 0.2, samples.size)
    ground = GroundAcceleration.from_samples(samples, 0.01)
    response = respond(TEMPLE, ground)
    start = int(np.flatnonzero(response.theta)[0])
    end = response.time.size
    assert (np.sign(response.theta[start:]) == np.sign(response.theta[start])).all()
    gamma, side = TEMPLE.mass_ratio, math.copysign(1.0, response.theta[start])
    inertia = TEMPLE.inertia_ratio * TEMPLE.size**2 + gamma * TEMPLE.beam.length**2

    def rates(t: float, state: np.ndarray) -> list[float]:
        theta, omega = state
        push = float(np.interp(t, ground.time, samples))
        moment = 0.0
        for lever, mass in ((TEMPLE.centre, 1.0), (TEMPLE.beam, gamma)):
            phi = lever.angle - abs(theta)
            moment -= mass * lever.length * (side * GRAVITY * math.sin(phi) + push * math.cos(phi))
        return [omega, moment / inertia]

    solved = solve_ivp(
        rates,
        (response.time[start], response.time[end - 1]),
        [response.theta[start], response.omega[start]],
        method="DOP853",
        t_eval=response.time[start:end],
        rtol=1e-11,
        atol=1e-13,
        max_step=0.005,
    )
    np.testing.assert_allclose(response.theta[start:end], solved.y[0], rtol=1e-6, atol=1e-9)


def test_forces_of_two_tapered_columns_are_those_of_the_frame() -> None:
    ground = GroundAcceleration.from_samples(4.0 * np.sin(6.0 * np.arange(300) * 0.01), 0.01)
    response = respond(TEMPLE, ground)
    together = reactions(response, ground)
    each = column_forces(response, ground, spacing=3.0, beam_centre=0.4)
    moving = response.theta != 0.0
    for name in ("base_shear", "base_vertical", "top_shear", "top_vertical"):
        both = getattr(each, name).mean(axis=0)[moving]
        np.testing.assert_allclose(both, getattr(together, name)[moving], rtol=1e-9, atol=1e-12)


def test_impulses_stop_what_moves() -> None:
    """The vertical impulse at the base reverses the downward momentum of column and beam."""
    impulses = impact_impulses(TEMPLE, 0.3)
    reach = 0.5 * (TEMPLE.width + TEMPLE.top_contact_width)
    turned = 0.3 * (1.0 + TEMPLE.restitution)
    momentum = 0.5 * TEMPLE.width * turned + TEMPLE.mass_ratio * reach * turned
    assert float(impulses.base_vertical) == pytest.approx(momentum, rel=1e-14)


def written(folder: Path, keys: str) -> Path:
    path = folder / "structures.toml"
    path.write_text(f'[[structure]]\nname = "a"\nheight_m = 5.9\nwidth_m = 1.1\n{keys}\n')
    return path


def test_shapes_are_stated_in_files(tmp_path: Path) -> None:
    [found] = read_structures(
        written(tmp_path, 'section = "circular"\ntop_width_m = 0.9\nmass_ratio = 0.6')
    )
    assert (found.slenderness, found.restitution) == (TEMPLE.slenderness, TEMPLE.restitution)
    [box] = read_structures(
        written(tmp_path, "inner_width_m = 0.7\ndepth_m = 2.0\ninner_depth_m = 1.6")
    )
    assert box.prismatic
    assert box.inertia_ratio > 4.0 / 3.0  # the walls are far from the middle


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("inertia_ratio = 1.3\ninner_width_m = 0.5", "Must be absent where inner_width_m 0.5"),
        ("top_width_m = 0.9\ninner_width_m = 0.5", "Must be absent where inner_width_m 0.5"),
        ("centre_of_gravity_m = 2.0", "Must be stated with inertia_ratio"),
        ("inertia_ratio = 1.3\ntop_width_m = 0.9", "Must be stated with centre_of_gravity_m"),
        ("depth_m = 2.0", "Must be stated with density_kg_m3 .* or with inner_width_m"),
        (
            "inner_width_m = 0.5",
            "key 'depth_m' missing. Must be stated together with an inner width, unless",
        ),
        ("inner_width_m = 1.2\ndepth_m = 2.0\ninner_depth_m = 1.0", "below the outer one, 1.1 m"),
        ("top_width_m = -1.0", "Must be positive"),
        ("inertia_ratio = 1.3\ncentre_of_gravity_m = 6.0", "Must be below the height, 5.9 m"),
    ],
)
def test_shapes_that_contradict_themselves_are_refused(
    tmp_path: Path, keys: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read_structures(written(tmp_path, keys))


def test_a_tapered_column_keeps_its_shape_when_its_size_is_varied() -> None:
    larger = TEMPLE.resized(2.0 * TEMPLE.height, 2.0 * TEMPLE.width)
    assert larger.slenderness == pytest.approx(TEMPLE.slenderness, rel=1e-14)
    assert larger.restitution == pytest.approx(TEMPLE.restitution, rel=1e-14)
    assert larger.effective_size == pytest.approx(2.0 * TEMPLE.effective_size, rel=1e-14)


#: Sections, and what each states about a column of a width: the other widths are in proportion.
SECTIONS_OF_WIDTH = {
    "rectangle": "depth_m = 1.5",
    "circle": 'section = "circular"',
    "frustum": 'section = "circular"\ntop_width_m = {0.8}',
    "trapezoid": "depth_m = 1.5\ntop_width_m = {0.6}",
    "tube": 'section = "circular"\ninner_width_m = {0.7}',
    "box": "inner_width_m = {0.6}\ndepth_m = 2.0\ninner_depth_m = 1.6",
}


def stated_column(folder: Path, section: str, height: float, width: float) -> RockingFrame:
    """Return the frame of a structure that states a section, its dimensions and its density."""
    keys = re.sub(
        r"{(.*)}", lambda ratio: repr(width * float(ratio[1])), SECTIONS_OF_WIDTH[section]
    )
    path = folder / "structures.toml"
    path.write_text(
        f'[[structure]]\nname = "a"\nheight_m = {height!r}\nwidth_m = {width!r}\n'
        f"mass_ratio = 2.0\ndensity_kg_m3 = 2500.0\n{keys}\n"
        "[structure.tendon]\narea_m2 = 1e-3\nmodulus_pa = 195e9\nprestress_n = 1e5\n"
        f"[structure.dissipater]\nstiffness_n_m = 5e7\nyield_force_n = 1e5\n"
        f"lever_arm_m = {0.5 * width!r}\n"
    )
    [frame] = read_structures(path)
    assert isinstance(frame, RockingFrame)
    return frame


@pytest.mark.parametrize("section", SECTIONS_OF_WIDTH)
@pytest.mark.parametrize("size", [(12.0, 2.0), (6.0, 1.1), (7.0, 0.9)])
def test_a_resized_column_is_the_column_stated_with_these_dimensions(
    tmp_path: Path, section: str, size: tuple[float, float]
) -> None:
    resized = stated_column(tmp_path, section, 6.0, 1.0).resized(*size)
    stated = stated_column(tmp_path, section, *size)
    numbers = ("column_mass", "inertia_ratio", "centre_height", "top_contact_width", "restitution")
    for name in (*numbers, "effective_size", "uplift_acceleration"):
        assert getattr(resized, name) == pytest.approx(getattr(stated, name), rel=1e-12), name
    assert (resized.tendon, resized.dissipater) == (stated.tendon, stated.dissipater)


def test_a_search_for_a_width_takes_every_known_section(tmp_path: Path) -> None:
    design = Design(dimension="width", lowest=1.0, highest=1.2, steps=2)
    for section in SECTIONS_OF_WIDTH:
        found = design.candidates(stated_column(tmp_path, section, 6.0, 1.0))[1]
        stated = stated_column(tmp_path, section, 6.0, 1.2)
        assert found.column_mass == pytest.approx(stated.column_mass, rel=1e-12), section
        assert found.restitution == pytest.approx(stated.restitution, rel=1e-12), section


def test_crushed_edges_keep_the_inertia_of_the_column_that_they_carry() -> None:
    """In proportion, the inertia about the centre of gravity is that of the whole column."""
    whole = RockingFrame(height=6.0, width=1.0, column_mass=1e4, section="circular",
                         inertia_ratio=inertia_ratio_of("circular", 6.0, 1.0))  # fmt: skip
    worn = crushed(whole, Pivot(compressive_strength=30e6, depth=0.3))
    wider = worn.resized(6.0, 1.2 * worn.width)
    assert wider.column_mass == pytest.approx(1.44e4, rel=1e-14)
    central = (wider.inertia_ratio - 1.0) * wider.size**2
    assert central == pytest.approx(6.0**2 / 12.0 + 1.2**2 / 16.0, rel=1e-12)


def test_the_section_is_recognised_by_its_inertia_and_else_unknown() -> None:
    def section(inertia_ratio: float) -> str | None:
        return RockingFrame(height=6.0, width=1.0, inertia_ratio=inertia_ratio).column_section

    assert section(4.0 / 3.0) == "rectangular"
    assert section(inertia_ratio_of("circular", 6.0, 1.0)) == "circular"
    assert section(1.3) is None
    with pytest.raises(ParameterError, match="Invalid section 'round'"):
        RockingFrame(height=6.0, width=1.0, section="round")


def test_a_stated_section_sets_the_inertia_unless_that_is_stated() -> None:
    """A solid cylinder has 5 b^2 / 4 + 4 h^2 / 3 over b^2 + h^2, at each size."""
    drum = RockingFrame(height=6.0, width=1.0, section="circular")
    for frame, b in ((drum, 0.5), (drum.resized(6.0, 2.0), 1.0)):
        expected = (1.25 * b**2 + 12.0) / (b**2 + 9.0)
        assert frame.inertia_ratio == pytest.approx(expected, rel=1e-14)
    assert RockingFrame(height=6.0, width=1.0, section="rectangular").inertia_ratio == 4.0 / 3.0
    tube = hollow("circular", 6.0, 1.0, 0.8).inertia_ratio
    assert replace(drum, inertia_ratio=tube).inertia_ratio == tube
    with pytest.raises(ParameterError, match="Invalid inertia_ratio nan"):
        replace(drum, inertia_ratio=math.nan)


def test_other_sections_are_refused() -> None:
    with pytest.raises(ParameterError, match="Invalid section 'octagonal'"):
        tapered("octagonal", 5.0, 1.0, 0.8)
    with pytest.raises(ParameterError, match="Invalid section 'octagonal'"):
        hollow("octagonal", 5.0, 1.0, 0.8)
