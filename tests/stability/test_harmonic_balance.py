"""Harmonic balance against the linear answer in closed form and SciPy's Duffing orbits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy_orbits import Law, polynomial, shoot

import isojax as ij
from isojax import Harmonic, harmonic_balance, paper
from isojax._results import is_successful

DUFFING = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(0.2), ij.CubicStiffness(0.5)))
DRIVE = Harmonic(1.5, 1.3 / (2.0 * np.pi))


def test_the_linear_answer_is_exact_with_internal_states_too():
    stiffness, damping, branch, time_constant, mass, frequency = 1e6, 9e3, 3e5, 0.02, 800.0, 4.0
    model = ij.Isolator(
        mass,
        (ij.LinearStiffness(stiffness), ij.LinearDamping(damping), ij.MaxwellBranch(branch, time_constant)),
    )
    found = harmonic_balance(model, Harmonic(120.0, frequency), harmonics=3)
    s = 2j * np.pi * frequency
    pull = s / (s + 1.0 / time_constant)
    x = -1j * 120.0 / (mass * s**2 + damping * s + stiffness + branch * pull)
    assert is_successful(found.result)
    np.testing.assert_allclose(found.coefficients[0], [0.0, x, 0.0, 0.0], atol=1e-12 * abs(x))
    np.testing.assert_allclose(found.coefficients[1], [0.0, pull * x, 0.0, 0.0], atol=1e-12 * abs(x))
    np.testing.assert_allclose(found.y0, [x.real, (s * x).real, (pull * x).real], rtol=1e-9)
    np.testing.assert_allclose(found.amplitude, abs(x), rtol=1e-9)
    times = jnp.linspace(0.0, 1.0, 7)
    np.testing.assert_allclose(found.displacement(times), (x * np.exp(s * times)).real, atol=1e-12 * abs(x))
    np.testing.assert_allclose(found.velocity(times), (s * x * np.exp(s * times)).real, atol=1e-9 * abs(x))


@pytest.mark.slow
def test_a_duffing_orbit_is_that_of_scipy_ever_more_closely():
    law = polynomial(k=(1.0, 0.0, 0.5), c=(0.2, 0.0, 0.0), mass=1.0)
    balances = [harmonic_balance(DUFFING, DRIVE, harmonics=count) for count in (1, 3, 7, 15)]
    reference = shoot(law, 1.5, 1.3 / (2.0 * np.pi), np.asarray(balances[-1].y0))
    errors = [float(np.max(np.abs(np.asarray(found.y0) - reference.y0))) for found in balances]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-9
    assert abs(float(balances[-1].amplitude) - reference.amplitude) < 1e-7


def test_a_law_with_a_mean_answer_is_that_of_scipy():
    model = ij.Isolator(
        1.0,
        (ij.LinearStiffness(1.0), ij.LinearDamping(0.2), ij.CubicStiffness(0.5), ij.QuadraticStiffness(0.3)),
    )
    found = harmonic_balance(model, DRIVE, harmonics=25)
    law = Law(lambda z, sides: z[0] + 0.3 * z[0] ** 2 + 0.5 * z[0] ** 3 + 0.2 * z[1], mass=1.0)
    reference = shoot(law, 1.5, 1.3 / (2.0 * np.pi), np.asarray(found.y0))
    np.testing.assert_allclose(found.y0, reference.y0, atol=1e-9)
    assert float(found.coefficients[0, 0].real) < -1e-2


def test_the_papers_orbit_is_near_and_nearer_with_more_harmonics(y_orbit):
    # |x|x makes harmonics that fall with the third power, so the error falls slowly.
    few, many = (
        harmonic_balance(y_orbit.model, y_orbit.excitation, harmonics=count, samples=512) for count in (3, 31)
    )
    errors = [abs(float(found.amplitude / y_orbit.amplitude) - 1.0) for found in (few, many)]
    assert errors[0] < 2e-3
    assert errors[1] < 1e-5
    assert errors[1] < 0.1 * errors[0]


def test_another_start_gives_another_coexisting_motion(lens_map):
    found = [
        harmonic_balance(lens_map.model, Harmonic(150.0, 4.4), start=lens_map.y0[which, 2, 2]).amplitude
        for which in range(3)
    ]
    np.testing.assert_allclose(found, lens_map.response[:, 2, 2], rtol=2e-3)


def test_derivatives_are_those_of_differences_under_jit_and_vmap_too():
    def amplitude(stiffness):
        model = eqx.tree_at(lambda m: m.elements[2].coefficient, DUFFING, stiffness)
        return harmonic_balance(model, DRIVE).amplitude

    at = jnp.asarray(0.5)
    slope = jax.jit(jax.vmap(jax.jacfwd(amplitude)))(at[None])[0]
    difference = (amplitude(at + 1e-5) - amplitude(at - 1e-5)) / 2e-5
    np.testing.assert_allclose(slope, difference, rtol=1e-6)


def test_a_failed_search_is_nan_and_says_so():
    found = harmonic_balance(DUFFING, Harmonic(jnp.nan, 1.0))
    assert not is_successful(found.result)
    assert bool(jnp.all(jnp.isnan(found.coefficients.real)))
    assert bool(jnp.all(jnp.isnan(found.y0)))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"harmonics": 0}, "Argument `harmonics` must be a positive count, but is 0."),
        ({"samples": 14}, "Argument `samples` must be more than twice the harmonics (7), but is 14."),
        ({"start": [0.0]}, "Argument `start` must hold 2 states, but holds 1."),
    ],
)
def test_bad_arguments_are_refused_with_what_was_expected(arguments, words):
    with pytest.raises(ValueError, match="Argument") as caught:
        harmonic_balance(paper.y_direction(), Harmonic(150.0, 4.3), **arguments)
    assert str(caught.value) == words
