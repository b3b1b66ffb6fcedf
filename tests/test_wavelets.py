"""Pulse wavelets: identities of eqs (44) and (45), values computed independently, all shapes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from rockframe.errors import ParameterError
from rockframe.wavelets.family import (
    BETA,
    RICKERS,
    WAVELETS,
    MotherWavelet,
    spectra,
    spectra_of_lines,
)
from rockframe.wavelets.pulse import Pulse

Expected = Callable[[str], Any]

both = pytest.mark.parametrize("name", list(RICKERS))


def pulse(name: str, **given_values: float) -> Pulse:
    return Pulse(wavelet=name, **{"a_p": 3.0, "T_p": 1.25, "time": 0.4, **given_values})


def integral(function: Callable[[float], float], start: float, end: float) -> float:
    return float(quad(function, start, end, epsabs=1e-13, epsrel=1e-13, limit=400)[0])


def moment(mother: MotherWavelet, frequency: float) -> float:
    """Return the magnitude of the Fourier spectrum of a pulse of unit amplitude and period."""
    tau = np.linspace(-5.0, 5.0, 4001)  # spectrally accurate: the pulse is zero at both ends
    wave = mother.acceleration(tau) * np.exp(-1j * frequency * tau)
    return float(abs(wave.sum()) * (tau[1] - tau[0]))


# Identities


def test_beta_normalises_the_antisymmetric_pulse() -> None:
    x = math.sqrt(3.0 - math.sqrt(6.0))  # where d/dx (x^2 - 3) x exp(-x^2/2) vanishes
    assert_allclose(BETA, (3.0 - x**2) * x * math.exp(-0.5 * x**2), rtol=1e-15)
    assert round(BETA, 4) == 1.3801


@both
def test_amplitude_is_the_largest_acceleration(name: str) -> None:
    tau = np.linspace(-3.0, 3.0, 600_001)
    assert_allclose(np.abs(RICKERS[name].acceleration(tau)).max(), 1.0, rtol=1e-9)


@both
@pytest.mark.parametrize("t", [-0.9, -0.3, 0.0, 0.4, 0.75, 1.6])
def test_velocity_is_the_integral_of_acceleration(name: str, t: float) -> None:
    wave = pulse(name)
    area = integral(lambda x: float(wave.acceleration(x)), wave.time - 6.0, t)
    assert_allclose(wave.velocity(t), area, rtol=0, atol=1e-12)


@both
@pytest.mark.parametrize("t", [-0.9, -0.3, 0.0, 0.4, 0.75, 1.6])
def test_displacement_is_the_integral_of_velocity(name: str, t: float) -> None:
    wave = pulse(name)
    area = integral(lambda x: float(wave.velocity(x)), wave.time - 6.0, t)
    assert_allclose(wave.displacement(t), area, rtol=0, atol=1e-12)


@both
@pytest.mark.parametrize("end", [-3.0, 3.0])
def test_the_ground_is_at_rest_at_both_ends(name: str, end: float) -> None:
    wave = pulse(name)
    t = wave.time + end * wave.T_p
    assert abs(float(wave.acceleration(t))) < 1e-15
    assert abs(float(wave.velocity(t))) < 1e-15
    assert abs(float(wave.displacement(t))) < 1e-15


@both
def test_the_net_area_is_zero(name: str) -> None:
    mother = RICKERS[name]
    assert moment(mother, 0.0) < 1e-14


@both
def test_beyond_its_reach_a_pulse_is_below_round_off(name: str) -> None:
    mother = RICKERS[name]
    tau = np.linspace(mother.reach, 10.0, 1001)
    assert np.abs(mother.acceleration(tau)).max() < 1e-16
    assert np.abs(mother.acceleration(-tau)).max() < 1e-16


@both
def test_spectrum_peaks_at_the_period(name: str) -> None:
    frequencies = 2.0 * math.pi * np.linspace(0.5, 2.0, 1501)
    spectrum = [moment(RICKERS[name], f) for f in frequencies]
    assert_allclose(frequencies[int(np.argmax(spectrum))], 2.0 * math.pi, rtol=1e-12)


@both
def test_energy_is_the_integral_of_the_square(name: str) -> None:
    mother = RICKERS[name]
    square = integral(lambda x: float(mother.acceleration(np.asarray(x))) ** 2, -5.0, 5.0)
    assert_allclose(mother.energy, square, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "parity"), [("symmetric_ricker", 1), ("antisymmetric_ricker", -1)]
)
def test_parity(name: str, parity: int) -> None:
    mother = RICKERS[name]
    tau = np.linspace(0.0, 3.0, 301)
    assert_allclose(mother.acceleration(-tau), parity * mother.acceleration(tau), rtol=1e-15)
    assert_allclose(mother.velocity(-tau), -parity * mother.velocity(tau), rtol=1e-15)
    assert_allclose(mother.displacement(-tau), parity * mother.displacement(tau), rtol=1e-15)


@both
def test_phase_pi_reverses_the_pulse(name: str) -> None:
    t = np.linspace(-3.0, 3.0, 61)
    wave, reverse = pulse(name), pulse(name, phase=math.pi)
    assert np.array_equal(reverse.acceleration(t), -wave.acceleration(t))
    assert np.array_equal(reverse.velocity(t), -wave.velocity(t))
    assert np.array_equal(reverse.displacement(t), -wave.displacement(t))


@both
@given(
    a_p=st.floats(0.01, 30.0),
    T_p=st.floats(0.05, 10.0),
    tau=st.floats(-3.0, 3.0),
)
def test_scaling(name: str, a_p: float, T_p: float, tau: float) -> None:  # noqa: N803
    wave, mother = Pulse(wavelet=name, a_p=a_p, T_p=T_p), RICKERS[name]
    x = np.asarray(tau)
    t = tau * T_p
    atol = 1e-12 * a_p * max(1.0, T_p**2)
    assert_allclose(wave.acceleration(t), a_p * mother.acceleration(x), rtol=1e-9, atol=atol)
    assert_allclose(wave.velocity(t), a_p * T_p * mother.velocity(x), rtol=1e-9, atol=atol)
    assert_allclose(
        wave.displacement(t), a_p * T_p**2 * mother.displacement(x), rtol=1e-9, atol=atol
    )
    assert wave.length_scale == a_p * T_p**2


@both
def test_a_pulse_is_centred_at_its_time(name: str) -> None:
    tau = np.linspace(-2.0, 2.0, 41)
    moved = pulse(name, time=100.0).acceleration(100.0 + tau)
    assert_allclose(moved, pulse(name, time=0.0).acceleration(tau), rtol=0, atol=1e-12)


# Values computed independently


@pytest.fixture
def pulses(expected: Expected) -> dict[str, Any]:
    values: dict[str, Any] = expected("pulses")
    return values


def test_antisymmetric_normalisation(pulses: dict[str, Any]) -> None:
    assert_allclose(BETA, float(pulses["antisymmetric"]["beta"]), rtol=1e-15)


def test_extremes_of_the_symmetric_pulse(pulses: dict[str, Any]) -> None:
    mother, values = RICKERS["symmetric_ricker"], pulses["symmetric"]
    trough = np.asarray(float(values["t_min_over_Tp"]))
    assert mother.acceleration(np.zeros(1))[0] == 1.0
    assert_allclose(mother.acceleration(trough), float(values["min_over_ap"]), rtol=1e-14)
    zero = mother.acceleration(np.asarray(float(values["zero_over_Tp"])))
    assert_allclose(zero, 0.0, atol=1e-15)


def test_extremes_of_the_antisymmetric_pulse(pulses: dict[str, Any]) -> None:
    mother, values = RICKERS["antisymmetric_ricker"], pulses["antisymmetric"]
    first = np.asarray(float(values["t_peak_over_Tp"]))
    second = np.asarray(float(values["t_second_peak_over_Tp"]))
    # printed polarity: positive before the centre, negative after it
    assert_allclose(mother.acceleration(-first), 1.0, rtol=1e-15)
    assert_allclose(mother.acceleration(first), -1.0, rtol=1e-15)
    assert_allclose(mother.acceleration(second), float(values["second_peak_over_ap"]), rtol=1e-14)
    zero = mother.acceleration(np.asarray(float(values["zero_over_Tp"])))
    assert_allclose(zero, 0.0, atol=1e-15)


@both
def test_peak_velocity_displacement_and_energy(name: str, pulses: dict[str, Any]) -> None:
    mother, values = RICKERS[name], pulses[name.removesuffix("_ricker")]
    tau = np.linspace(-1.0, 1.0, 200_001)
    velocity = np.abs(mother.velocity(tau)).max()
    displacement = np.abs(mother.displacement(tau)).max()
    assert_allclose(velocity, float(values["PGV_over_apTp"]), rtol=1e-9)
    assert_allclose(displacement, float(values["PGD_over_apTp2"]), rtol=1e-9)
    assert_allclose(mother.energy, float(values["int_psi2_over_ap2Tp"]), rtol=1e-15)


@both
def test_spectral_peak(name: str, pulses: dict[str, Any]) -> None:
    value = float(pulses[name.removesuffix("_ricker")]["abs_FT_at_2pi_over_Tp_over_apTp"])
    assert_allclose(moment(RICKERS[name], 2.0 * math.pi), value, rtol=1e-12)


@pytest.mark.parametrize(
    ("mother", "other", "key"),
    [
        ("symmetric_ricker", "antisymmetric_ricker", "sym_mother_on_antisym_pulse"),
        ("antisymmetric_ricker", "symmetric_ricker", "antisym_mother_on_sym_pulse"),
    ],
)
def test_one_mother_on_the_other(mother: str, other: str, key: str, expected: Expected) -> None:
    values = expected("f_wavelet")[key]
    best = Pulse(wavelet=mother, a_p=1.0, T_p=values["s_over_Tp"], time=values["xi_over_Tp"])
    record = Pulse(wavelet=other, a_p=1.0, T_p=1.0)
    t = np.linspace(-6.0, 6.0, 4001)
    product = float((best.acceleration(t) * record.acceleration(t)).sum() * (t[1] - t[0]))
    index = abs(product) / math.sqrt(best.T_p * best.mother.energy * record.mother.energy)
    assert_allclose(index, values["matching_index"], rtol=1e-10)


# Bad input


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wavelet": "ricker"}, "Invalid wavelet 'ricker'. Must be one of: symmetric_ricker"),
        ({"a_p": -1.0}, "Invalid a_p -1.0. Must be zero or positive"),
        ({"a_p": math.nan}, "Invalid a_p nan"),
        ({"T_p": 0.0}, "Invalid T_p 0.0. Must be positive"),
        ({"T_p": -1.0}, "Invalid T_p -1.0. Must be positive"),
        ({"T_p": math.inf}, "Invalid T_p inf"),
        ({"phase": 1.0}, "Invalid phase 1.0. Must be 0 or pi"),
        ({"phase": math.nan}, "Invalid phase nan"),
    ],
)
def test_invalid_pulses(changes: dict[str, Any], words: str) -> None:
    arguments: dict[str, Any] = {"wavelet": "symmetric_ricker", "a_p": 1.0, "T_p": 1.0}
    with pytest.raises(ParameterError) as error:
        Pulse(**{**arguments, **changes})
    assert words in str(error.value)


# Every phase, every number of half cycles

SHAPES = [
    ("symmetric_ricker", math.pi, None),
    ("ricker_any_phase", 0.7, None),
    ("ricker_any_phase", 4.0, None),
    *(
        ("mavroeidis_papageorgiou", phase, half_cycles)
        for phase in (0.0, 0.7, 0.5 * math.pi, 4.0)
        for half_cycles in (1.0, 1.3, 2.0, 3.0)
    ),
]
every = pytest.mark.parametrize(("name", "phase", "half_cycles"), SHAPES)


def shaped(name: str, phase: float, half_cycles: float | None, **values: float) -> Pulse:
    given_values: dict[str, Any] = {"a_p": 1.0, "T_p": 1.0, **values}
    return Pulse(wavelet=name, phase=phase, half_cycles=half_cycles, **given_values)


@every
def test_kinematics_of_every_shape(name: str, phase: float, half_cycles: float | None) -> None:
    """The amplitude is 1; velocity, displacement, energy and spectrum match numerical integrals."""
    mother = shaped(name, phase, half_cycles).mother
    tau = np.linspace(-mother.extent, mother.extent, 40_001)
    step = tau[1] - tau[0]
    acceleration = mother.acceleration(tau)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])

    assert_allclose(np.abs(acceleration).max(), 1.0, rtol=1e-7)
    assert_allclose(summed(acceleration), mother.velocity(tau), rtol=0, atol=2e-8)
    assert_allclose(summed(mother.velocity(tau)), mother.displacement(tau), rtol=0, atol=2e-8)
    assert_allclose((acceleration**2).sum() * step, mother.energy, rtol=1e-8)
    for nu in (0.0, 0.2, 1.0, 1.0 + 1.0 / (half_cycles or 2.0), 1.7, 3.0):
        integral = (acceleration * np.exp(-2j * math.pi * nu * tau)).sum() * step
        assert_allclose(mother.spectrum(np.array([nu]))[0], integral, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("name", "half_cycles"),
    [
        ("half_sine", None),
        ("full_sine", None),
        ("full_cosine", None),
        ("mavroeidis_papageorgiou", 1.3),
    ],
)
def test_outside_a_pulse_that_ends_the_velocity_stays(name: str, half_cycles: float | None) -> None:
    """Before it the ground is at rest; after it the displacement grows at the last velocity."""
    mother = shaped(name, 0.7 if half_cycles else 0.0, half_cycles).mother
    assert mother.finite
    beyond = np.linspace(1e-9, 2.0, 50)
    before, after = -mother.reach - beyond, mother.reach + beyond
    speed = float(mother.velocity(np.array(mother.reach)))
    grown = float(mother.displacement(np.array(mother.reach))) + speed * beyond
    assert not mother.acceleration(np.concatenate([before, after])).any()
    assert_allclose(mother.velocity(before), 0.0, rtol=0, atol=1e-15)
    assert_allclose(mother.displacement(before), 0.0, rtol=0, atol=1e-15)
    assert_allclose(mother.velocity(after), speed, rtol=0, atol=1e-15)
    assert_allclose(mother.displacement(after), grown, rtol=0, atol=1e-14)


@every
def test_no_net_area_and_no_end_velocity(
    name: str, phase: float, half_cycles: float | None
) -> None:
    mother = shaped(name, phase, half_cycles).mother
    assert abs(mother.spectrum(np.zeros(1))[0]) < 1e-15
    assert abs(float(mother.velocity(np.array(mother.extent)))) < 1e-15


@pytest.mark.parametrize("half_cycles", [1.2, 1.5, 2.0, 2.5, 3.0])
@pytest.mark.parametrize("phase", [0.0, 0.4, 0.5 * math.pi])
def test_final_displacement_of_mavroeidis_papageorgiou(half_cycles: float, phase: float) -> None:
    """The final displacement is zero only for whole numbers of half cycles or phase pi / 2."""
    pulse = shaped("mavroeidis_papageorgiou", phase, half_cycles)
    formula = math.cos(phase) * math.sin(math.pi * half_cycles)
    formula /= 2.0 * math.pi * (1.0 - half_cycles**2)
    final = float(pulse.displacement(10.0))
    if phase < 1.0:  # the velocity at the centre is A cos(phi)
        size = float(pulse.velocity(0.0)) / math.cos(phase)
        assert_allclose(final, size * formula, rtol=1e-9, atol=1e-15)
    assert (abs(final) < 1e-15) == (abs(formula) < 1e-15)


@pytest.mark.parametrize("half_cycles", [1.0, 1.4, 2.0, 3.0])
def test_mavroeidis_papageorgiou_is_the_published_velocity(half_cycles: float) -> None:
    pulse = shaped("mavroeidis_papageorgiou", 0.6, half_cycles, a_p=2.0, T_p=1.5)
    t = np.linspace(-0.7 * half_cycles, 0.7 * half_cycles, 201)
    envelope = 1.0 + np.cos(2.0 * math.pi * t / (1.5 * half_cycles))
    published = 0.5 * envelope * np.cos(2.0 * math.pi * t / 1.5 + 0.6)
    ratio = pulse.velocity(0.0) / (math.cos(0.6))
    assert_allclose(pulse.velocity(t), ratio * published, rtol=0, atol=1e-14)
    assert ratio > 0.0


def test_any_phase_holds_both_rickers() -> None:
    t = np.linspace(-3.0, 3.0, 601)
    for phase, name in ((0.0, "symmetric_ricker"), (0.5 * math.pi, "antisymmetric_ricker")):
        shape = shaped("ricker_any_phase", phase, None).acceleration(t)
        assert_allclose(shape, shaped(name, 0.0, None).acceleration(t), rtol=0, atol=2e-10)


@pytest.mark.parametrize("name", WAVELETS)
def test_parts_are_even_and_odd(name: str) -> None:
    """The parts are orthogonal, so the projection on their span has no cross term."""
    tau = np.linspace(-3.0, 3.0, 2001)
    parts = WAVELETS[name].parts(1.7)
    assert len(parts) == (2 if WAVELETS[name].free_phase else 1)
    if len(parts) == 2:
        first, other = (part.acceleration(tau) for part in parts)
        assert abs(first @ other) < 1e-12 * math.sqrt((first @ first) * (other @ other))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"wavelet": "ricker_any_phase", "phase": 7.0}, "Invalid phase 7.0. Must be from 0 to 2"),
        ({"wavelet": "symmetric_ricker", "half_cycles": 2.0}, "Must be None for symmetric_ricker"),
        ({"wavelet": "mavroeidis_papageorgiou"}, "Invalid half_cycles None of mavroeidis"),
        ({"wavelet": "mavroeidis_papageorgiou", "half_cycles": 0.9}, "Must be a number, 1 or more"),
        (
            {"wavelet": "mavroeidis_papageorgiou", "half_cycles": math.nan},
            "Must be a number, 1 or more",
        ),
    ],
)
def test_shapes_that_are_none(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Pulse(a_p=1.0, T_p=1.0, **values)


@pytest.mark.parametrize("gamma", [1.0, 1.5, 2.0, 2.7183, 10.0])
def test_spectra_at_equal_steps_are_those_at_any_frequencies(gamma: float) -> None:
    line, count = 1.0 / 64.0, 3000
    nu = line * np.arange(count, dtype=np.float64)
    parts = zip(spectra_of_lines(line, count, gamma), spectra(nu, gamma), strict=True)
    for stepped, free in parts:
        np.testing.assert_allclose(stepped, free, rtol=0.0, atol=1e-11)
