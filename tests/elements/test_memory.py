"""Laws with memory under a prescribed motion, against closed forms and the published equations in SciPy."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isojax.elements import BoucWen, DahlFriction, MaxwellBranch


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
