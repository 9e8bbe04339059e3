"""Periodic orbits against SciPy and closed forms, their derivatives, and what happens where there is none."""

import math

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy_orbits import EQ_36, Y_DIRECTION, Z_DIRECTION, Law, polynomial, shoot

import isojax as ij
from isojax import Harmonic, find_periodic_orbit, paper
from isojax._parameters import list_parameters, replace_parameters
from isojax._results import RESULTS, is_successful
from isojax.stability.orbit._half_range import half_range
from isojax.stability.orbit._sine import recorded_sine

FORCE, FREQUENCY = 150.0, 4.3

STARTS = ([-4.36e-4, 1.192e-2], [-5.79e-4, 1.291e-2], [-1.2e-3, 6.86e-3])
"""Near the three orbits of the y model at 150 N and 4.4 Hz, inside the lens of its folds."""


def y_law(**changes):
    """The paper's y model for SciPy, with other coefficients or further effects."""
    return polynomial(**{**Y_DIRECTION, **changes})


def assert_equal_to(reference, orbit, tolerance=1e-7):
    """State and multipliers of an orbit against SciPy's, relative to the size of the motion."""
    omega = 2.0 * math.pi * float(orbit.excitation.frequency)
    swing = np.hypot(reference.y0[0], reference.y0[1] / omega)
    scale = np.array([swing, omega * swing, *np.maximum(np.abs(reference.y0[2:]), 0.01 * swing)])
    assert is_successful(orbit.result)
    np.testing.assert_array_less(np.abs(np.asarray(orbit.y0) - reference.y0) / scale, tolerance)
    theirs = np.sort_complex(reference.multipliers)
    np.testing.assert_allclose(np.sort_complex(orbit.floquet.multipliers), theirs, atol=tolerance)
    assert abs(float(orbit.floquet.spectral_radius) - reference.spectral_radius) < tolerance


def test_an_orbit_of_the_papers_model_is_that_of_scipy(y_orbit):
    reference = shoot(y_law(), FORCE, FREQUENCY, [-2e-4, 0.0])
    assert_equal_to(reference, y_orbit)
    assert abs(float(y_orbit.amplitude) - reference.amplitude) < 1e-6 * reference.amplitude
    assert float(y_orbit.error) < 1e-10


@pytest.mark.slow
def test_random_orbits_of_the_papers_models_are_those_of_scipy(y_orbit):
    random = np.random.default_rng(7)
    y, z = paper.y_direction(), paper.z_direction()
    eq36 = y.replace(abs_quadratic_damping__coefficient=-3.6880e3, cubic_damping__coefficient=0.0)
    cases = [(y, y_law()), (z, polynomial(**Z_DIRECTION)), (eq36, polynomial(**EQ_36))]
    for place in range(12):
        model, law = cases[place % 3]
        force, frequency = random.uniform(1.0, 450.0), random.uniform(1.0, 8.0)
        drive = Harmonic(force, frequency)
        orbit = find_periodic_orbit(model, drive, start=find_periodic_orbit(model, drive).y0)
        reference = shoot(law, force, frequency, np.asarray(orbit.y0))
        omega = 2.0 * math.pi * frequency
        scale = np.hypot(reference.y0[0], reference.y0[1] / omega) * np.array([1.0, omega])
        np.testing.assert_array_less(np.abs(np.asarray(orbit.y0) - reference.y0) / scale, 1e-7)
        # Trace and determinant: they do not magnify errors where the multipliers nearly coincide.
        assert abs(np.trace(orbit.floquet.monodromy) - np.trace(reference.monodromy)) < 1e-7
        assert abs(np.linalg.det(orbit.floquet.monodromy) - np.linalg.det(reference.monodromy)) < 1e-7


def test_a_symmetric_orbit_repeats_with_the_opposite_sign_and_its_multipliers_are_squares(
    y_orbit, y_orbit_full
):
    assert bool(y_orbit.symmetric)
    assert bool(y_orbit_full.symmetric)
    half = y_orbit.floquet.half_period_multipliers
    np.testing.assert_allclose(y_orbit.floquet.multipliers, half**2, rtol=1e-12)
    np.testing.assert_allclose(y_orbit.floquet.multipliers, y_orbit_full.floquet.multipliers, atol=1e-9)
    np.testing.assert_allclose(y_orbit.floquet.monodromy, y_orbit_full.floquet.monodromy, rtol=1e-8)
    np.testing.assert_allclose(y_orbit.y0, y_orbit_full.y0, rtol=1e-9)
    assert bool(jnp.all(jnp.isnan(y_orbit_full.floquet.half_period_multipliers)))


@pytest.mark.slow
def test_two_periods_of_an_orbit_have_the_squares_of_its_multipliers(y_orbit):
    twice = find_periodic_orbit(y_orbit.model, y_orbit.excitation, start=y_orbit.y0, periods=2)
    np.testing.assert_allclose(twice.y0, y_orbit.y0, rtol=1e-9)
    squares = np.sort_complex(np.asarray(y_orbit.floquet.multipliers) ** 2)
    np.testing.assert_allclose(np.sort_complex(twice.floquet.multipliers), squares, atol=1e-9)


def test_all_three_orbits_inside_the_lens_are_those_of_scipy(y_orbit):
    radii = []
    for start in STARTS:
        orbit = find_periodic_orbit(y_orbit.model, Harmonic(FORCE, 4.4), start=start)
        assert_equal_to(shoot(y_law(), FORCE, 4.4, start), orbit)
        radii.append(float(orbit.floquet.spectral_radius))
    assert radii[1] > 1.0 > max(radii[0], radii[2])


@pytest.mark.slow
def test_derivatives_by_every_coefficient_are_those_of_differences(y_orbit):
    model = y_orbit.model
    values = [entry.value for entry in list_parameters(model)]
    law = ("mass", "k1", "k2", "k3", "c1", "c2", "c3")

    def numbers(model):
        orbit = find_periodic_orbit(model, y_orbit.excitation)
        return jnp.stack([orbit.floquet.spectral_radius, orbit.amplitude, *orbit.y0])

    slopes = jax.jacfwd(numbers)(model)
    exact = jnp.stack(jax.tree.leaves(slopes), axis=-1)
    # jax.tree orders the leaves as the fields stand, so does `list_parameters`.
    assert exact.shape == (4, len(values))
    typical = np.array([float(value) for value in values])
    size = np.max(np.abs(np.asarray(exact) * typical), axis=1)
    for place, name in enumerate(law):
        step = 2e-5 * typical[place]
        ends, theirs = [], []
        for sign in (1.0, -1.0):
            moved = [*values]
            moved[place] = values[place] + sign * step
            ends.append(numbers(replace_parameters(model, moved)))
            plain = [float(value) for value in moved]
            reference = shoot(
                polynomial(k=plain[1:4], c=plain[4:7], mass=plain[0]),
                FORCE,
                FREQUENCY,
                np.asarray(y_orbit.y0),
            )
            theirs.append([reference.spectral_radius, reference.amplitude, *reference.y0])
        for pair, tolerance in ((ends, 1e-6), (theirs, 1e-6)):
            difference = (np.asarray(pair[0]) - np.asarray(pair[1])) / (2.0 * step)
            off = np.abs(difference - np.asarray(exact[:, place])) * abs(typical[place]) / size
            np.testing.assert_array_less(off, tolerance, err_msg=name)


@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_an_amplitude_read_off_samples_has_the_derivatives_of_the_closed_form(turns):
    # The forced linear isolator, sampled: its extremes lie between two samples.
    mass, damping, drive = 2.0, 8.0, Harmonic(30.0, 2.9)
    omega = 2.0 * math.pi * drive.frequency

    def closed_form(stiffness):
        return drive.amplitude / (stiffness - mass * omega**2 + 1j * damping * omega)

    def read(stiffness):
        model = ij.Isolator(
            mass, (ij.elements.LinearStiffness(stiffness), ij.elements.LinearDamping(damping))
        )
        turned = closed_form(stiffness) * np.exp(2j * math.pi * turns * np.linspace(0.0, 1.0, 65))
        path = jnp.imag(turned), omega * jnp.real(turned)
        return half_range(model, recorded_sine(model, drive.amplitude, drive.frequency), path, turns)

    stiffness = jnp.asarray(800.0)
    value, slope = jax.value_and_grad(read)(stiffness)
    exact, exact_slope = jax.value_and_grad(lambda k: jnp.abs(closed_form(k)))(stiffness)
    assert float(value) == pytest.approx(float(exact), rel=1e-9)
    assert float(slope) == pytest.approx(float(exact_slope), rel=1e-7)


@pytest.mark.slow
def test_second_derivatives_are_those_of_differences(y_orbit):
    def slope(force):
        return jax.jacfwd(
            lambda force: (
                find_periodic_orbit(y_orbit.model, Harmonic(force, FREQUENCY)).floquet.spectral_radius
            )
        )(force)

    force = jnp.asarray(FORCE)
    difference = (slope(force + 0.05) - slope(force - 0.05)) / 0.1
    np.testing.assert_allclose(jax.jacfwd(slope)(force), difference, rtol=1e-4)


@pytest.mark.slow
def test_jit_and_vmap_give_the_numbers_of_single_orbits_and_a_failure_stays_alone(y_orbit):
    # Negative cubic damping: 100 N it bears, but nothing holds the other.
    model = y_orbit.model.replace(cubic_damping__coefficient=-1e5)

    def numbers(force):
        orbit = find_periodic_orbit(model, Harmonic(force, FREQUENCY))
        return jnp.append(orbit.y0, orbit.floquet.spectral_radius)

    values, slopes = jax.jit(jax.vmap(lambda force: jax.jvp(numbers, (force,), (1.0,))))(
        jnp.array([100.0, 1e9])
    )
    single = numbers(100.0)
    assert bool(jnp.all(jnp.isfinite(single)))
    np.testing.assert_allclose(values[0], single, rtol=1e-9)
    difference = (numbers(100.01) - numbers(99.99)) / 0.02
    np.testing.assert_allclose(slopes[0], difference, rtol=1e-5)
    assert not bool(jnp.any(jnp.isfinite(values[1])))
    assert not bool(jnp.any(jnp.isfinite(slopes[1])))


def oscillator(mass, damping, linear, cubic):
    """Springs and a damper without kinks. One structure, so that it is compiled once."""
    springs = (ij.LinearStiffness(linear), ij.CubicStiffness(cubic))
    return ij.Isolator(mass, (ij.LinearDamping(damping), *springs))


def test_a_motion_that_runs_away_is_nan_and_says_why():
    # A softening spring: nothing holds so large a force.
    orbit = find_periodic_orbit(oscillator(1.0, 0.1, 1.0, -1.0), Harmonic(1e9, 0.1))
    assert orbit.result in (RESULTS.not_finite, RESULTS.not_converged)
    for numbers in (orbit.y0, orbit.floquet.multipliers, orbit.states, orbit.amplitude, orbit.error):
        assert not np.any(np.isfinite(numbers))
    assert not bool(orbit.symmetric)
    assert not bool(orbit.floquet.stable)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"start": [0.0, 0.0, 0.0]}, "Argument `start` must hold 2 states, but holds 3."),
        ({"periods": 0}, "Argument `periods` must be a positive count, but is 0."),
        (
            {"excitation": Harmonic(1.0, 0.0)},
            "Argument `excitation` must have a positive frequency, but it is 0.0",
        ),
        (
            {"model": paper.y_direction().with_elements(ij.InputOffset(1.0)), "symmetric": True},
            "Argument `symmetric` must be False for a model that is not odd, but is True.",
        ),
        ({"integrator": ij.Integrator(diffrax.Dopri8(), rtol=1e-8)}, "must be an Integrator with RK4"),
    ],
)
def test_bad_arguments_are_refused_with_what_was_expected(arguments, words):
    default = {"model": paper.y_direction(), "excitation": Harmonic(FORCE, FREQUENCY)}
    with pytest.raises(ValueError, match="Argument") as caught:
        find_periodic_orbit(**{**default, **arguments})
    assert words in str(caught.value)


def test_a_delay_of_the_drive_turns_the_phase_and_nothing_else(y_orbit):
    delay = 3.7e-3
    model = y_orbit.model.with_elements(ij.InputDelay(delay))
    orbit = find_periodic_orbit(model, y_orbit.excitation)
    turn = np.exp(-2j * np.pi * FREQUENCY * delay * np.arange(9))
    np.testing.assert_allclose(
        orbit.harmonics[:9], np.asarray(y_orbit.harmonics[:9]) * turn, atol=1e-5 * abs(y_orbit.harmonics[1])
    )
    ours, theirs = orbit.floquet.multipliers, y_orbit.floquet.multipliers
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(theirs), atol=1e-9)
    assert_equal_to(shoot(y_law(delay=delay), FORCE, FREQUENCY, np.asarray(orbit.y0)), orbit)


def test_an_offset_of_the_drive_breaks_the_symmetry_as_scipy_has_it(y_orbit):
    model = y_orbit.model.with_elements(ij.InputOffset(20.0))
    orbit = find_periodic_orbit(model, y_orbit.excitation)
    reference = shoot(y_law(offset=20.0), FORCE, FREQUENCY, np.asarray(y_orbit.y0))
    assert_equal_to(reference, orbit)
    assert not bool(orbit.symmetric)
    assert float(orbit.harmonics[0].real) > 1e-6


def with_memory(rates):
    """The paper's y model with one internal state of stiffness 2e5 N/m, for SciPy."""
    plain = y_law()
    return Law(
        lambda z, sides: plain.force(z, sides) + 2e5 * z[2],
        kinks=lambda z: [z[0], z[1], z[2]],
        internal=lambda z, sides: [rates(z[1], z[2], sides[1], sides[2])],
        states=3,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "rates"),
    [
        (ij.MaxwellBranch(2e5, 0.03), lambda v, z, forth, out: v - z / 0.03),
        (ij.DahlFriction(2e5 * 3e-4, 3e-4), lambda v, z, forth, out: v - forth * v * z / 3e-4),
        (
            ij.BoucWen(2e5, 900.0, -300.0, 1.0),
            lambda v, z, forth, out: v - (900.0 * forth * out - 300.0) * v * out * z,
        ),
    ],
    ids=["maxwell", "dahl", "bouc_wen"],
)
def test_orbits_with_memory_are_those_of_scipy(element, rates, y_orbit):
    model = y_orbit.model.with_elements(element)
    orbit = find_periodic_orbit(model, y_orbit.excitation)
    scale = np.array([1.0, 1.0, element.presliding if isinstance(element, ij.DahlFriction) else 1.0])
    reference = shoot(with_memory(rates), FORCE, FREQUENCY, np.asarray(orbit.y0) * scale)
    np.testing.assert_allclose(np.asarray(orbit.y0) * scale, reference.y0, rtol=1e-7, atol=1e-12)
    ours = np.sort_complex(orbit.floquet.multipliers)
    np.testing.assert_allclose(ours, np.sort_complex(reference.multipliers), atol=1e-7)


@pytest.mark.slow
def test_a_drive_far_below_resonance_moves_a_linear_isolator_by_its_closed_form():
    # 1200 times below resonance fixed steps of the drive's period are too long for the free vibration.
    omega = 2.0 * np.pi * 5e-3
    orbit = find_periodic_orbit(oscillator(800.0, damping=4e3, linear=1e6, cubic=0.0), Harmonic(100.0, 5e-3))
    moved = 100.0 / abs(1e6 - 800.0 * omega**2 + 4e3j * omega)
    assert float(orbit.amplitude) == pytest.approx(moved, rel=1e-9)


@pytest.mark.slow
def test_several_harmonics_start_an_orbit_that_one_does_not_reach():
    # A hard spring without a linear part (Ueda's oscillator) has strong harmonics.
    model = oscillator(1.0, damping=0.1, linear=0.0, cubic=1.0)
    force, frequency = 10.634091609644013, 0.10971399768525407
    orbit = find_periodic_orbit(model, Harmonic(force, frequency))
    law = polynomial(k=(0.0, 0.0, 1.0), c=(0.1, 0.0, 0.0), mass=1.0)
    reference = shoot(law, force, frequency, np.asarray(orbit.y0))
    assert_equal_to(reference, orbit)
