"""Resonance against the closed form of the linear isolator, forwards and backwards."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import isojax as ij

MASS, STIFFNESS, DAMPING, FORCE = 800.0, 1.0e6, 8.0e3, 100.0


def peak(k, c, m=MASS):
    """Give frequency and size of the largest response: `w^2 = k/m - c^2/(2 m^2)`."""
    omega = jnp.sqrt(k / m - c**2 / (2.0 * m**2))
    return jnp.stack([omega / (2.0 * jnp.pi), FORCE / jnp.abs(k - m * omega**2 + 1j * omega * c)])


def linear(k, c) -> ij.Isolator:
    return ij.Isolator(MASS, (ij.LinearStiffness(k), ij.LinearDamping(c)))


@pytest.fixture(scope="module")
def resonance() -> ij.stability.Resonance:
    return ij.find_resonance(linear(STIFFNESS, DAMPING), FORCE, (4.0, 7.0), step=0.1)


def again(resonance, k, c):
    found = ij.find_again(resonance, linear(k, c))
    return jnp.stack([found.frequency, found.amplitude])


def test_resonance_of_the_linear_isolator_is_that_of_its_receptance(resonance):
    assert ij.is_successful(resonance.result)
    expected = peak(STIFFNESS, DAMPING)
    # The size is read by a parabola through the sample next to it, exact to the fourth power of its distance.
    assert float(resonance.frequency) == pytest.approx(float(expected[0]), rel=1e-6)
    assert float(resonance.amplitude) == pytest.approx(float(expected[1]), rel=1e-7)


@pytest.mark.slow
def test_derivatives_at_resonance_are_those_of_the_closed_form_in_both_modes(resonance):
    at = (jnp.asarray(STIFFNESS), jnp.asarray(DAMPING))
    expected = jax.jacfwd(peak, (0, 1))(*at)
    for mode in (jax.jacfwd, jax.jacrev):
        for found, wanted in zip(mode(lambda *x: again(resonance, *x), (0, 1))(*at), expected, strict=True):
            # The frequency is where that parabola is largest.
            assert float(found[0]) == pytest.approx(float(wanted[0]), rel=2e-5)
            assert float(found[1]) == pytest.approx(float(wanted[1]), rel=1e-6)


def test_a_window_beside_the_resonance_is_refused():
    with pytest.raises(ValueError, match=r"from 2\.0 to 3\.0 Hz the response is largest at an end"):
        ij.find_resonance(linear(STIFFNESS, DAMPING), FORCE, (2.0, 3.0), step=0.1)


def test_a_frequency_that_a_resonance_solves_for_is_refused(resonance):
    with pytest.raises(ValueError, match="`frequency` must be omitted for a resonance"):
        ij.find_again(resonance, linear(STIFFNESS, DAMPING), frequency=5.0)


def test_an_answer_that_is_traced_is_refused(resonance):
    model = linear(STIFFNESS, DAMPING)
    with pytest.raises(ValueError, match="`answer` must hold known numbers"):
        eqx.filter_jit(lambda known: ij.find_again(known, model).frequency)(resonance)


@pytest.mark.slow
def test_the_largest_response_may_lie_on_an_isola():
    """Damping that rises, falls and rises again: of three amplitudes at resonance the largest is detached."""
    model = ij.Isolator(
        1.0,
        (
            ij.LinearStiffness(1.0),
            ij.CubicStiffness(0.0),  # as the isola of other branches has it, so that it is compiled once
            ij.LinearDamping(0.25),
            ij.elements.AbsQuadraticDamping(-0.2),
            ij.elements.CubicDamping(0.045),
        ),
    )
    resonance = ij.find_resonance(model, 0.105, (0.12, 0.2))
    # One harmonic, x = a cos: the damper takes all of the force where the spring balances the mass.
    speeds = np.roots([0.75 * 0.045, -0.2 * 8.0 / (3.0 * np.pi), 0.25, -0.105])
    assert float(resonance.amplitude) == pytest.approx(float(np.max(speeds.real)), rel=0.02)
    words = " ".join(repr(resonance).split())
    assert "the curve from the smallest motion reaches 0.728" in words
    assert "beside it detached, a closed curve" in words
    # With more damping one amplitude is left, the smallest: the isola is gone.
    damping = 0.3
    assert np.sum(np.isreal(np.roots([0.75 * 0.045, -0.2 * 8.0 / (3.0 * np.pi), damping, -0.105]))) == 1
    gone = ij.find_again(resonance, model.replace(linear_damping__coefficient=damping))
    assert ij.RESULTS.gone == gone.result
    assert np.isnan([gone.frequency, gone.amplitude, gone.orbit.floquet.spectral_radius]).all()
    assert "none found under a drive of 0.105. Followed from" in " ".join(repr(gone).split())
