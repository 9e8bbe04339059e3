"""Gas, gaps, quintic spring and the further laws of dry friction, against closed forms."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import dawsn

from isojax import paper
from isojax.elements import (
    AsymmetricFriction,
    CoulombFriction,
    EndStop,
    Freeplay,
    LinearStiffness,
    PolytropicGas,
    QuinticStiffness,
    Scales,
    StribeckFriction,
)
from isojax.excitations import Harmonic
from isojax.models import Isolator, simulate

X, OMEGA = 2.7e-3, 26.0
V = X * OMEGA
SCALES = Scales(
    mass=800.0,
    force=150.0,
    displacement=3e-3,
    velocity=0.08,
    acceleration=2.2,
    angular_frequency=27.0,
    sample_time=1e-3,
    slowest_velocity=0.02,
    reading=2.2,
)


def fourier(element, order: int, shape, corners=()) -> float:
    """Fourier coefficient of the force under x = X sin(phi), by quadrature that knows the corners."""

    def integrand(phi):
        x, v = jnp.asarray(X * np.sin(phi)), jnp.asarray(V * np.cos(phi))
        return float(element.force(x, v, ())) * shape(order * phi) / np.pi

    edges = np.unique([0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi, 2 * np.pi, *(c % (2 * np.pi) for c in corners)])
    return sum(quad(integrand, a, b, epsrel=1e-9, limit=200)[0] for a, b in pairwise(edges))


def test_quintic_spring_has_the_three_harmonics_of_the_fifth_power_of_a_sine():
    element = QuinticStiffness(4e16)
    size = 4e16 * X**5
    np.testing.assert_allclose(fourier(element, 1, np.sin), 0.625 * size, rtol=1e-9)
    np.testing.assert_allclose(fourier(element, 3, np.sin), -0.3125 * size, rtol=1e-9)
    np.testing.assert_allclose(fourier(element, 5, np.sin), 0.0625 * size, rtol=1e-9)


def derivatives(element, place, count):
    """Force and its derivatives by x."""

    def law(x):
        return element.force(x, jnp.asarray(0.0), ())

    found = []
    for _ in range(count):
        found.append(float(law(jnp.asarray(place))))
        law = jax.jacfwd(law)
    return found


@pytest.mark.parametrize("exponent", [1.0, 1.25, 1.4])
def test_curvature_and_hardening_of_gas_are_tied(exponent):
    preload, length, n = 5e4, 0.06, exponent
    stiffness = n * preload / length
    expected = [
        0.0,
        stiffness,
        stiffness * (n + 1) / length,
        stiffness * (n + 1) * (n + 2) / length**2,
        stiffness * (n + 1) * (n + 2) * (n + 3) / length**3,
    ]
    np.testing.assert_allclose(
        derivatives(PolytropicGas(preload, length, n, 1.0), 0.0, 3), expected[:3], rtol=1e-12, atol=1e-9
    )
    x = np.linspace(-0.05, 0.05, 21)
    law = preload * ((1 - x / length) ** -n - 1)
    series = sum(
        expected[order] * x**order / factor for order, factor in zip(range(5), (1, 1, 2, 6, 24), strict=True)
    )
    small = np.abs(x) < 0.011
    force = PolytropicGas(preload, length, n, 1.0).force(jnp.asarray(x), jnp.zeros(21), ())
    np.testing.assert_allclose(force, law, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(np.asarray(force)[small], series[small], rtol=4e-3, atol=1e-9)


def test_a_load_on_isothermal_gas_swings_like_a_pendulum_as_long_as_the_gas():
    # P0 A = m g: the closed volume alone carries the load, omega^2 = n g / L.
    weight, length = 800.0 * 9.81, 0.1
    slope = derivatives(PolytropicGas(weight, length, 1.0, 1.0), 0.0, 2)[1]
    np.testing.assert_allclose(np.sqrt(slope / 800.0), np.sqrt(9.81 / length), rtol=1e-12)


def test_gas_is_mirrored_by_its_side():
    x = jnp.linspace(-0.05, 0.05, 11)
    up, down = (PolytropicGas(5e4, 0.06, 1.3, side) for side in (1.0, -1.0))
    np.testing.assert_allclose(up.force(x, x, ()), -down.force(-x, x, ()), rtol=1e-14)


def test_gas_goes_on_smoothly_beyond_its_length():
    element = PolytropicGas(5e4, 0.06, 1.4, 1.0)
    inside, outside = (derivatives(element, 0.9 * 0.06 * (1 + sign * 1e-9), 3) for sign in (-1, 1))
    np.testing.assert_allclose(inside, outside, rtol=1e-6)
    far = jnp.asarray([0.06, 0.6, -6.0])
    slopes = jax.vmap(jax.jacfwd(lambda x: element.force(x, x, ())))(far)
    assert bool(jnp.all(jnp.isfinite(slopes) & (slopes > 0)))


def saturation(share):
    """Describing function of clip(x, -g, g) at g = share X; Gelb & Vander Velde 1968, appendix B."""
    return 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2))


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_stop_and_play_have_the_describing_functions_of_sharp_corners(share):
    gap, width = share * X, 1e-4 * X
    corners = [sign * np.arcsin(share) + start for sign in (1, -1) for start in (0, np.pi)]
    stop, play = EndStop(2e6, gap, 0.0, width), Freeplay(2e6, gap, width)
    np.testing.assert_allclose(
        fourier(stop, 1, np.sin, corners) / X, 2e6 * (1 - saturation(share)), rtol=1e-5
    )
    np.testing.assert_allclose(fourier(play, 1, np.sin, corners) / X, -2e6 * saturation(share), rtol=1e-5)
    np.testing.assert_allclose(fourier(stop, 0, np.cos, corners), 0.0, atol=1e-7)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_stop_on_one_side_pushes_on_the_mean(side):
    share, width = 0.4, 1e-4 * X
    corners = [sign * np.arcsin(share) + start for sign in (1, -1) for start in (0, np.pi)]
    # The mean of 2e6 N/m there and nothing here.
    element = EndStop(1e6, share * X, side, width)
    mean = side * 2e6 * X / np.pi * (np.sqrt(1 - share**2) - share * np.arccos(share))
    np.testing.assert_allclose(fourier(element, 0, np.cos, corners) / 2, mean, rtol=1e-5)
    half = 0.5 * 2e6 * (1 - saturation(share))
    np.testing.assert_allclose(fourier(element, 1, np.sin, corners) / X, half, rtol=1e-5)


def test_the_rounding_of_a_stop_takes_in_the_documented_energy():
    gap, width, stiffness = 1e-3, 2e-5, 3e6
    element = EndStop(0.5 * stiffness, gap, 1.0, width)

    def force(x):
        return float(element.force(jnp.asarray(x), jnp.asarray(0.0), ()))

    before = quad(force, gap - 40 * width, gap, epsabs=1e-16)[0]
    after = quad(lambda x: force(x) - stiffness * (x - gap), gap, gap + 40 * width, epsabs=1e-16)[0]
    np.testing.assert_allclose([before, after], np.pi**2 / 12 * stiffness * width**2, rtol=1e-6)


def test_play_in_a_spring_is_a_stop_on_a_softer_one():
    base = paper.y_direction()
    k1, lost, gap, width = 1.0805e6, 3e5, 4e-4, 1e-5
    softer = base.replace(linear_stiffness__coefficient=k1 - lost)
    play = simulate(base.with_elements(Freeplay(lost, gap, width)), Harmonic(300.0, 5.0), duration=2.0)
    stop = simulate(softer.with_elements(EndStop(lost, gap, 0.0, width)), Harmonic(300.0, 5.0), duration=2.0)
    assert float(jnp.max(jnp.abs(play.displacement))) > 2.0 * gap
    np.testing.assert_allclose(play.reading, stop.reading, rtol=1e-9, atol=1e-9)


def test_play_of_the_whole_spring_leaves_the_gap_empty():
    model = Isolator(800.0, (LinearStiffness(1e6), Freeplay(1e6, 1e-3, 1e-6)))
    x = jnp.asarray([-3e-3, -0.9e-3, 0.0, 0.9e-3, 3e-3])
    force = model.restoring_force((x, jnp.zeros(5)))
    np.testing.assert_allclose(force, [-2000.0, 0.0, 0.0, 0.0, 2000.0], atol=1e-9)


def test_direction_dependent_friction_is_a_mean_force_less_the_documented_width():
    share = 1e-3
    element = AsymmetricFriction(7.0, share * V)
    mean = fourier(element, 0, np.cos, [0.5 * np.pi + s * 20 * share for s in (1, -1)]) / 2
    np.testing.assert_allclose(mean, 7.0 * (1 - 2 / np.pi * share), rtol=1e-6)


def test_direction_dependent_friction_beside_coulombs_differs_by_direction():
    model = Isolator(800.0, (CoulombFriction(10.0, 1e-4), AsymmetricFriction(3.0, 1e-4)))
    force = model.restoring_force((jnp.zeros(2), jnp.asarray([0.05, -0.05])))
    np.testing.assert_allclose(force, [13.0, -7.0], rtol=1e-12)


@pytest.mark.parametrize("ratio", [0.5, 2.0, 8.0])
def test_equivalent_damping_of_falling_friction_holds_dawsons_integral(ratio):
    # 4 F / (pi V) [1 + r D(a) / a] with a = V / vst: the substitution u = sin(phi) in the first harmonic.
    element = StribeckFriction(12.0, 0.8, V / ratio, 1e-5 * V)
    near = [0.5 * np.pi + s * 2e-4 for s in (1, -1)] + [1.5 * np.pi + s * 2e-4 for s in (1, -1)]
    found = fourier(element, 1, np.cos, near) / V
    expected = 4 * 12.0 / (np.pi * V) * (1 + 0.8 * dawsn(ratio) / ratio)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_falling_friction_takes_the_place_of_coulombs():
    assert StribeckFriction.absorbs == ("coulomb_friction",)
    x, v = jnp.zeros(5), jnp.linspace(-0.1, 0.1, 5)
    one = StribeckFriction(12.0, 0.0, 0.01, 1e-3).force(x, v, ())
    np.testing.assert_array_equal(one, CoulombFriction(12.0, 1e-3).force(x, v, ()))


def test_corners_and_falls_are_no_sharper_than_steps_resolve():
    width = CoulombFriction.guess(SCALES).width
    for element in (StribeckFriction.guess(SCALES), AsymmetricFriction.guess(SCALES)):
        assert float(element.width) == float(width)
    for element in StribeckFriction.grid(SCALES):
        assert float(element.stribeck_velocity) >= 3.0 * float(width)
    way = SCALES.velocity * SCALES.sample_time / EndStop.substeps
    for element in (*EndStop.grid(SCALES), *Freeplay.grid(SCALES)):
        assert float(element.width) >= 0.5 * way
        assert float(element.gap) > 5.0 * float(element.width)
