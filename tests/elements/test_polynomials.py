"""Equivalent stiffness and damping of the polynomial laws, by quadrature, against the closed forms."""

from itertools import pairwise

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from isojax.elements import (
    AbsQuadraticDamping,
    AbsQuadraticStiffness,
    CubicDamping,
    CubicStiffness,
    LinearDamping,
    LinearStiffness,
    PositionDamping,
    QuadraticStiffness,
)

X, OMEGA = 2.7e-3, 26.0
V = X * OMEGA


def fourier(element, order: int, shape) -> float:
    """Fourier coefficient of the force under x = X sin(phi), by adaptive quadrature split at the kinks."""

    def integrand(phi):
        x, v = jnp.asarray(X * np.sin(phi)), jnp.asarray(V * np.cos(phi))
        return float(element.force(x, v, ())) * shape(order * phi) / np.pi

    quarters = np.linspace(0.0, 2.0 * np.pi, 5)
    return sum(quad(integrand, a, b, epsrel=1e-11)[0] for a, b in pairwise(quarters))


@pytest.mark.parametrize(
    ("element", "stiffness"),
    [
        (LinearStiffness(1.1e6), 1.1e6),
        (AbsQuadraticStiffness(-7e8), 8 / (3 * np.pi) * -7e8 * X),
        (CubicStiffness(2.5e11), 0.75 * 2.5e11 * X**2),
        (QuadraticStiffness(3e8), 0.0),
        (LinearDamping(1e4), 0.0),
        (AbsQuadraticDamping(-3.7e5), 0.0),
        (CubicDamping(5.4e6), 0.0),
        (PositionDamping(2e9), 0.0),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_equivalent_stiffness_is_the_closed_form(element, stiffness):
    np.testing.assert_allclose(fourier(element, 1, np.sin) / X, stiffness, rtol=1e-10, atol=1e-5)


@pytest.mark.parametrize(
    ("element", "damping"),
    [
        (LinearStiffness(1.1e6), 0.0),
        (AbsQuadraticStiffness(-7e8), 0.0),
        (CubicStiffness(2.5e11), 0.0),
        (QuadraticStiffness(3e8), 0.0),
        (LinearDamping(1e4), 1e4),
        (AbsQuadraticDamping(-3.7e5), 8 / (3 * np.pi) * -3.7e5 * V),
        (CubicDamping(5.4e6), 0.75 * 5.4e6 * V**2),
        (PositionDamping(2e9), 0.25 * 2e9 * X**2),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_equivalent_damping_is_the_closed_form(element, damping):
    np.testing.assert_allclose(fourier(element, 1, np.cos) / V, damping, rtol=1e-10, atol=1e-6)


def test_quadratic_stiffness_gives_a_mean_force_and_a_second_harmonic():
    element = QuadraticStiffness(3e8)
    np.testing.assert_allclose(fourier(element, 0, np.cos) / 2.0, 0.5 * 3e8 * X**2, rtol=1e-10)
    np.testing.assert_allclose(fourier(element, 2, np.cos), -0.5 * 3e8 * X**2, rtol=1e-10)


def test_cubic_stiffness_gives_a_third_harmonic():
    np.testing.assert_allclose(fourier(CubicStiffness(2.5e11), 3, np.sin), -0.25 * 2.5e11 * X**3, rtol=1e-10)
