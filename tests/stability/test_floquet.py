"""Multipliers against closed forms: the linear isolator, Mathieu's chart, Liouville's theorem."""

import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.special

import isojax as ij
from isojax import Harmonic, find_periodic_orbit
from isojax._parameters import parameter
from isojax.stability.orbit._floquet import modulus, multipliers


@jax.jit  # which compiles once for all numbers; equinox would for each
def linear(stiffness, damping, frequency):
    model = ij.Isolator(800.0, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping)))
    return find_periodic_orbit(model, Harmonic(100.0, frequency)).floquet


@pytest.mark.parametrize(
    ("damping_ratio", "frequency"),
    [(0.05, 3.0), (0.17, 4.6), (0.999, 2.0), (1.7, 6.0), (0.0, 5.0), (-0.01, 4.0)],
)
def test_linear_multipliers_are_exact(damping_ratio, frequency):
    mass, stiffness = 800.0, 1.0805e6
    damping = 2.0 * damping_ratio * math.sqrt(mass * stiffness)
    floquet = linear(stiffness, damping, frequency)
    roots = np.roots([mass, damping, stiffness]).astype(complex)
    exact = np.exp(roots / frequency)
    np.testing.assert_allclose(np.sort_complex(floquet.multipliers), np.sort_complex(exact), atol=1e-10)
    assert abs(float(floquet.spectral_radius) - np.abs(exact).max()) < 1e-10
    assert abs(float(floquet.margin) - (1.0 - np.abs(exact).max())) < 1e-10
    if damping_ratio != 0.0:
        assert bool(floquet.stable) == (damping_ratio > 0.0)


def test_the_determinant_of_the_monodromy_is_that_of_liouville(y_orbit):
    # det = exp(-integral of (c1 + 2 c2 |v| + 3 c3 v^2) / m over a period), the trace of the Jacobian.
    v = np.asarray(y_orbit.velocity)[:-1]
    slope = 1.027e4 + 2.0 * -3.6880e5 * np.abs(v) + 3.0 * 5.3753e6 * v**2
    exact = math.exp(-slope.mean() / 800.0 / 4.3)
    # The mean of |v| over 128 samples is good to a few 1e-4 of its part.
    assert abs(float(jnp.linalg.det(y_orbit.floquet.monodromy)) / exact - 1.0) < 1e-3
    product = complex(jnp.prod(y_orbit.floquet.multipliers))
    assert abs(product - complex(jnp.linalg.det(y_orbit.floquet.monodromy))) < 1e-12


@pytest.mark.parametrize("size", [2, 3, 5])
def test_multipliers_are_the_eigenvalues_in_falling_modulus(size):
    random = np.random.default_rng(size)
    matrices = random.standard_normal((40, size, size))
    ours = np.asarray(multipliers(jnp.asarray(matrices)))
    assert np.all(np.diff(np.abs(ours), axis=1) <= 1e-12)
    theirs = np.linalg.eigvals(matrices).astype(complex)
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(theirs), atol=1e-10)


def test_nearly_equal_multipliers_keep_half_of_the_digits():
    # Eigenvalues 0.5 and 0.5 + 1e-9, which trace^2 / 4 - det would lose.
    matrix = jnp.array([[0.5, 1.0], [0.0, 0.5 + 1e-9]])
    np.testing.assert_allclose(np.sort(np.real(multipliers(matrix))), [0.5, 0.5 + 1e-9], rtol=1e-15)


def test_multipliers_of_a_matrix_that_is_not_finite_are_nan():
    for size in (2, 3):
        assert bool(jnp.all(jnp.isnan(multipliers(jnp.full((size, size), jnp.nan)))))


def test_the_derivative_of_the_modulus_is_finite_on_the_real_axis_and_off_it():
    for point in (0.3 + 0.4j, -0.7 + 0j, 1.2 + 0j):
        slope = jax.jacfwd(lambda t, point=point: modulus(point * (1.0 + t)))(0.0)
        assert abs(float(slope) - abs(point)) < 1e-14
    assert float(modulus(jnp.asarray(0j))) == 0.0


class MathieuPair(ij.AbstractElement):
    """p'' + (rate + depth x) p = 0 in two internal states that push nothing."""

    name: ClassVar[str] = "mathieu_pair"
    words: ClassVar[str] = "parametrically excited pair"
    strength: ClassVar[str] = "depth"
    internal_states: ClassVar[int] = 2

    rate: jax.Array = parameter(symbol="alpha", unit="1/s^2")
    depth: jax.Array = parameter(symbol="beta", unit="1/(m s^2)")

    @classmethod
    def guess(cls, scales):
        return cls(1.0, 0.0)

    @classmethod
    def typical_strength(cls, scales):
        return 1.0

    def state_rate(self, x, v, s):
        return s[1], -(self.rate + self.depth * x) * s[0]


@pytest.mark.slow
def test_the_edges_of_mathieus_chart_are_where_the_trace_is_two():
    # A linear isolator moves in a sine, so that the pair obeys y'' + (a - 2 q cos 2 tau) y = 0.
    frequency, stiffness, damping = 2.0, 400.0, 2.0
    omega = 2.0 * math.pi * frequency
    size = 1.0 / abs(stiffness - omega**2 + 1j * omega * damping)

    @eqx.filter_jit
    def block(a, q):
        pair = MathieuPair((omega / 2) ** 2 * a, (omega / 2) ** 2 * 2.0 * q / size)
        model = ij.Isolator(1.0, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping), pair))
        floquet = find_periodic_orbit(model, Harmonic(1.0, frequency)).floquet
        return floquet.monodromy[2:, 2:], floquet.stable

    for order, value in (
        (0, scipy.special.mathieu_a),
        (1, scipy.special.mathieu_a),
        (2, scipy.special.mathieu_b),
    ):
        edge = value(order, 2.0)
        matrix, _ = block(edge, 2.0)
        assert abs(float(jnp.trace(matrix)) - 2.0 * (-1.0) ** order) < 1e-8
        # a0 and a1 are lower edges of a stable band, b2 the upper one of that above a1.
        inwards = -1.0 if order == 2 else 1.0
        radii = [
            jnp.max(jnp.abs(jnp.linalg.eigvals(block(edge + s * 1e-3, 2.0)[0]))) for s in (inwards, -inwards)
        ]
        assert abs(float(radii[0]) - 1.0) < 1e-8
        assert float(radii[1]) > 1.01
