"""Laws with memory under a prescribed motion, against closed forms and the published equations in SciPy."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import gamma as gamma_function

from isojax.elements import (
    BoucWen,
    DahlFriction,
    DualChamber,
    FractionalDamping,
    LugreFriction,
    MaxwellBranch,
    Scales,
)


def ramp(t, speed, _):
    """Monotonic motion."""
    return speed * t


def sine(t, size, omega):
    """Harmonic motion."""
    return size * jnp.sin(omega * t)


@eqx.filter_jit
def respond(element, motion, size, omega, times):
    """Force of the element under a motion, its states integrated to 1e-11 by an adaptive solver."""

    def position(t):
        return motion(t, size, omega)

    velocity = jax.grad(position)

    def field(t, s, args):
        return element.state_rate(position(t), velocity(t), s)

    start = tuple(jnp.asarray(0.0) for _ in range(element.internal_states))
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Dopri8(),
        t0=0.0,
        t1=times[-1],
        dt0=1e-4,
        y0=start,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=1e-11, atol=1e-16),
        max_steps=200_000,
    )
    return element.force(jax.vmap(position)(times), jax.vmap(velocity)(times), solution.ys)


def forces(element, motion, size, omega, times):
    """`respond` with every number traced, so that a law compiles once."""
    return np.asarray(respond(element, motion, jnp.asarray(size), jnp.asarray(omega), jnp.asarray(times)))


def published(rate, velocity, times):
    """State of z' = rate(z, v) under the same motion, by SciPy."""
    solution = solve_ivp(
        lambda t, z: [rate(z[0], velocity(t))],
        (0.0, times[-1]),
        [0.0],
        "DOP853",
        times,
        rtol=1e-11,
        atol=1e-16,
        max_step=2e-3,
    )
    return solution.y[0]


def test_dahl_friction_rises_along_the_exponential_of_monotonic_motion():
    times = np.linspace(0.0, 1.0, 21)
    force = forces(DahlFriction(12.0, 4e-4), ramp, 2e-3, 1.0, times)
    np.testing.assert_allclose(force, 12.0 * (1.0 - np.exp(-2e-3 * times / 4e-4)), rtol=1e-8, atol=1e-12)


def test_dahl_friction_follows_the_published_equation_through_reversals():
    level, presliding, size, omega = 12.0, 4e-4, 1.3e-3, 27.0
    sigma = level / presliding
    times = np.linspace(0.0, 0.5, 101)
    force = forces(DahlFriction(level, presliding), sine, size, omega, times)
    expected = published(
        lambda z, v: sigma * (v - abs(v) * z / level),
        lambda t: size * omega * np.cos(omega * t),
        times,
    )
    np.testing.assert_allclose(force, expected, atol=1e-7 * level)


def test_dahl_friction_is_a_spring_at_small_motion():
    times = np.linspace(0.0, 0.2, 21)
    force = forces(DahlFriction(12.0, 4e-4), sine, 1e-8, 27.0, times)
    np.testing.assert_allclose(force, 12.0 / 4e-4 * 1e-8 * np.sin(27.0 * times), atol=2e-4 * 3e-4)


def test_bouc_wen_rises_along_the_exponential_of_monotonic_motion():
    times = np.linspace(0.0, 1.0, 21)
    force = forces(BoucWen(5e4, 800.0, -300.0, 1.0), ramp, 2e-3, 1.0, times)
    np.testing.assert_allclose(
        force, 5e4 / 500.0 * (1.0 - np.exp(-500.0 * 2e-3 * times)), rtol=1e-8, atol=1e-12
    )


@pytest.mark.parametrize("exponent", [1.0, 1.7, 2.0])
@pytest.mark.parametrize("gamma", [-700.0, 400.0])
def test_bouc_wen_follows_the_published_equation_through_reversals(exponent, gamma):
    beta, size, omega = 800.0, 1.3e-3, 27.0
    scale = 1e3 ** (exponent - 1.0)
    times = np.linspace(0.0, 0.5, 101)
    element = BoucWen(5e4, beta * scale, gamma * scale, exponent)
    force = forces(element, sine, size, omega, times)
    expected = published(
        lambda z, v: (
            v
            - beta * scale * abs(v) * abs(z) ** (exponent - 1.0) * z
            - gamma * scale * v * abs(z) ** exponent
        ),
        lambda t: size * omega * np.cos(omega * t),
        times,
    )
    np.testing.assert_allclose(force, 5e4 * expected, atol=1e-7 * 5e4 * size)


@pytest.mark.parametrize("relative", [0.1, 1.0, 7.0])
@pytest.mark.parametrize("size", [1e-5, 4e-3])
def test_maxwell_branch_has_its_dynamic_stiffness_and_damping_at_every_amplitude(relative, size):
    omega, stiffness = 27.0, 3e5
    tau = relative / omega
    cycles = int(np.ceil(40.0 * relative / (2.0 * np.pi))) + 1
    phase = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    times = np.concatenate([[0.0], (2.0 * np.pi * cycles + phase) / omega])
    force = forces(MaxwellBranch(stiffness, tau), sine, size, omega, times)[1:]
    in_phase = 2.0 * np.mean(force * np.sin(phase)) / size
    in_quadrature = 2.0 * np.mean(force * np.cos(phase)) / (size * omega)
    np.testing.assert_allclose(in_phase, stiffness * relative**2 / (1.0 + relative**2), rtol=1e-7)
    np.testing.assert_allclose(in_quadrature, stiffness * tau / (1.0 + relative**2), rtol=1e-7)


SLIDING, BREAKAWAY, PRESLIDING, STRIBECK, BRISTLE = 12.0, 19.0, 4e-4, 8e-3, 2e-3


def lugre() -> LugreFriction:
    return LugreFriction(SLIDING, PRESLIDING, BREAKAWAY / SLIDING - 1.0, STRIBECK, BRISTLE)


@pytest.mark.parametrize("speed", [2e-3, 8e-3, 5e-2])
def test_lugre_friction_slides_along_the_stribeck_curve(speed):
    times = np.array([0.0, 40.0 * PRESLIDING / speed])
    expected = SLIDING + (BREAKAWAY - SLIDING) * np.exp(-((speed / STRIBECK) ** 2))
    np.testing.assert_allclose(forces(lugre(), ramp, speed, 1.0, times)[1], expected, rtol=1e-8)


def test_lugre_friction_follows_the_published_equation_through_reversals():
    size, omega = 1.3e-3, 27.0
    sigma0 = SLIDING / PRESLIDING
    sigma1 = sigma0 * BRISTLE

    def rate(z, v):
        limit = SLIDING + (BREAKAWAY - SLIDING) * np.exp(-((v / STRIBECK) ** 2))
        return v - sigma0 * np.abs(v) / limit * z

    def velocity(t):
        return size * omega * np.cos(omega * t)

    times = np.linspace(0.0, 0.5, 101)
    bristles = published(rate, velocity, times)
    expected = sigma0 * bristles + sigma1 * rate(bristles, velocity(times))
    np.testing.assert_allclose(forces(lugre(), sine, size, omega, times), expected, atol=1e-7 * BREAKAWAY)


def test_lugre_friction_without_its_own_terms_is_dahl_friction():
    times = np.linspace(0.0, 0.4, 81)
    plain = forces(LugreFriction(12.0, 4e-4, 0.0, 0.01, 0.0), sine, 1.3e-3, 27.0, times)
    np.testing.assert_allclose(plain, forces(DahlFriction(12.0, 4e-4), sine, 1.3e-3, 27.0, times), atol=1e-8)


# Two chambers of a small air spring: pressure [Pa], area [m^2], volumes [m^3], exponent, and a line.
P0, AREA, V1, V2, KAPPA = 5e5, 0.02, 2e-3, 5e-3, 1.4
LAMINAR, TURBULENT = 1.1e7, 3e9
LOW = KAPPA * P0 * AREA**2 / (V1 + V2)


def spring(orifice: float) -> DualChamber:
    return DualChamber(
        LOW * V2 / V1,
        LAMINAR * V1 * V2 / (KAPPA * P0 * (V1 + V2)),
        orifice * AREA * V1 * V2**2 / (KAPPA * P0 * (V1 + V2) ** 2),
    )


@pytest.mark.parametrize("size", [2e-4, 4e-3])
def test_dual_chamber_is_the_gas_of_two_volumes_joined_by_a_line(size):
    """Mass balance of both chambers, small pressure changes, and a line dP = R Q + S |Q| Q."""
    omega = 27.0

    def flow(difference):
        reach = abs(difference) / LAMINAR + 1e-12
        return brentq(
            lambda q: LAMINAR * q + TURBULENT * abs(q) * q - difference, -reach, reach, xtol=1e-18, rtol=1e-14
        )

    def rates(t, pressures):
        first, second = pressures
        passing = flow(first - second)
        squeezed = AREA * size * omega * np.cos(omega * t)
        return [KAPPA * P0 / V1 * (squeezed - passing), KAPPA * P0 / V2 * passing]

    times = np.linspace(0.0, 0.8, 81)
    gas = solve_ivp(rates, (0.0, 0.8), [0.0, 0.0], "DOP853", times, rtol=1e-10, atol=1e-9, max_step=2e-3)
    expected = AREA * gas.y[0] - LOW * size * np.sin(omega * times)
    force = forces(spring(TURBULENT), sine, size, omega, times)
    np.testing.assert_allclose(force, expected, atol=1e-6 * np.max(np.abs(expected)))


def test_dual_chamber_gives_back_volumes_and_resistance():
    element = spring(TURBULENT)
    np.testing.assert_allclose(element.volume_ratio(LOW), V2 / V1, rtol=1e-12)
    np.testing.assert_allclose(element.flow_resistance(LOW, P0, V1, KAPPA), LAMINAR, rtol=1e-12)


def test_dual_chamber_without_an_orifice_is_a_maxwell_branch():
    times = np.linspace(0.0, 0.6, 61)
    branch = MaxwellBranch(spring(0.0).stiffness, spring(0.0).time_constant)
    np.testing.assert_allclose(
        forces(spring(0.0), sine, 2e-3, 27.0, times), forces(branch, sine, 2e-3, 27.0, times), rtol=1e-9
    )


CENTRE = 27.0
RUBBER = Scales(800.0, 150.0, 3e-3, 0.08, 2.2, CENTRE, 1e-3, 0.02, 2.2)


def rubber(order: float) -> FractionalDamping:
    """Branches over the band of the guess."""
    guess = FractionalDamping.guess(RUBBER)
    return FractionalDamping(3e4, order, guess.lowest, guess.highest)


def dynamic_stiffness(element, omega):
    """Complex force over displacement of a linear memory: `i w S (i w - A)^-1 B + F_x + i w F_v`."""
    zero = jnp.zeros(())
    rest = (zero,) * element.internal_states
    slope, tilt, mix = jax.jacfwd(element.force, (0, 1, 2))(zero, zero, rest)
    inward = np.array([rate[0] for rate in zip(jax.jacfwd(element.state_rate, 1)(zero, zero, rest))])
    own = np.array(jax.jacfwd(element.state_rate, 2)(zero, zero, rest))
    states = [np.linalg.solve(1j * w * np.eye(len(rest)) - own, inward * 1j * w) for w in omega]
    return slope + 1j * omega * tilt + np.array(states) @ np.array(mix)


@pytest.mark.parametrize("order", [0.1, 0.2, 0.4, 0.6, 0.9])
@pytest.mark.parametrize(("decades", "accuracy"), [(0.6, 9e-3), (1.0, 1.5e-2)])
def test_fractional_damping_has_the_dynamic_stiffness_of_the_fractional_derivative(order, decades, accuracy):
    element = rubber(order)
    omega = CENTRE * np.logspace(-0.5 * decades, 0.5 * decades, 41)
    expected = 3e4 * (1j * omega) ** order
    error = np.abs(dynamic_stiffness(element, omega) / expected - 1.0)
    assert np.max(error) < accuracy


@pytest.mark.parametrize("order", [0.3, 0.7])
def test_fractional_damping_of_a_ramp_is_its_power_law(order):
    times = np.concatenate([[0.0], np.geomspace(0.3, 3.0, 20) / CENTRE])
    force = forces(rubber(order), ramp, 0.02, 1.0, times)[1:]
    expected = 3e4 * 0.02 * times[1:] ** (1.0 - order) / gamma_function(2.0 - order)
    np.testing.assert_allclose(force, expected, rtol=2e-2)
