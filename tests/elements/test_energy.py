"""Dissipated energy per cycle ~ X^p omega^q: the exponents that tell the effects apart."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax.elements import (
    AbsQuadraticDamping,
    BoucWen,
    CoulombFriction,
    CubicDamping,
    CubicStiffness,
    DahlFriction,
    LinearDamping,
    MaxwellBranch,
    PositionDamping,
)

PARTS = 2048


@jax.jit
def dissipated(element, size, omega):
    """Energy of the fourth cycle of x = size sin(omega t), by trapezoids (exact on smooth periods)."""
    phase = jnp.arange(4 * PARTS + 1) * (2.0 * jnp.pi / PARTS)
    step = 2.0 * jnp.pi / (PARTS * omega)

    def move(phase):
        return size * jnp.sin(phase), size * omega * jnp.cos(phase)

    def body(s, phi):
        def rate(share, states):
            return element.state_rate(*move(phi + share * 2.0 * jnp.pi / PARTS), states)

        k1 = rate(0.0, s)
        k2 = rate(0.5, tuple(a + 0.5 * step * k for a, k in zip(s, k1, strict=True)))
        k3 = rate(0.5, tuple(a + 0.5 * step * k for a, k in zip(s, k2, strict=True)))
        k4 = rate(1.0, tuple(a + step * k for a, k in zip(s, k3, strict=True)))
        x, v = move(phi)
        ends = zip(s, k1, k2, k3, k4, strict=True)
        return tuple(a + step / 6.0 * (b + 2.0 * (c + d) + e) for a, b, c, d, e in ends), element.force(
            x, v, s
        ) * v

    start = tuple(jnp.asarray(0.0) for _ in range(element.internal_states))
    power = jax.lax.scan(body, start, phase)[1][3 * PARTS :]
    return step * (jnp.sum(power) - 0.5 * (power[0] + power[-1]))


def exponents(element, size=2e-3, omega=27.0):
    """Local logarithmic slopes of the energy against amplitude and frequency."""
    ratio = 1.1
    energy = dissipated(element, size, omega)
    p = np.log(dissipated(element, size * ratio, omega) / energy) / np.log(ratio)
    q = np.log(dissipated(element, size, omega * ratio) / energy) / np.log(ratio)
    return float(p), float(q)


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (LinearDamping(1e4), (2.0, 1.0)),
        (AbsQuadraticDamping(4e5), (3.0, 2.0)),
        (CubicDamping(5e6), (4.0, 3.0)),
        (PositionDamping(2e9), (4.0, 1.0)),
        (CoulombFriction(20.0, 1e-4), (1.0, 0.0)),
        (DahlFriction(20.0, 4e-6), (1.0, 0.0)),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_energy_per_cycle_has_the_tabulated_exponents(element, expected):
    tolerance = 1e-2 if isinstance(element, CoulombFriction | DahlFriction) else 1e-6
    np.testing.assert_allclose(exponents(element), expected, atol=tolerance)


def test_energy_of_viscous_and_dry_damping_is_the_closed_form():
    np.testing.assert_allclose(
        dissipated(LinearDamping(1e4), 2e-3, 27.0), np.pi * 1e4 * 27.0 * 2e-3**2, rtol=1e-10
    )
    np.testing.assert_allclose(
        dissipated(CoulombFriction(20.0, 1e-4), 2e-3, 27.0), 4 * 20.0 * 2e-3, rtol=1e-4
    )


def test_a_spring_dissipates_nothing():
    assert abs(float(dissipated(CubicStiffness(2.5e11), 2e-3, 27.0))) < 1e-12


@pytest.mark.parametrize(
    "element", [DahlFriction(20.0, 1e-3), BoucWen(5e4, 500.0, -300.0, 1.0)], ids=lambda e: e.name
)
def test_hysteresis_does_not_depend_on_the_rate(element):
    p, q = exponents(element)
    assert abs(q) < 1e-9
    assert p > 1.0


def test_relaxation_depends_on_the_rate_and_not_on_the_amplitude():
    tau, omega = 0.02, 27.0
    p, q = exponents(MaxwellBranch(3e5, tau), omega=omega)
    ratio = 1.1
    loss = [np.pi * w * tau / (1.0 + (w * tau) ** 2) for w in (omega, ratio * omega)]
    np.testing.assert_allclose((p, q), (2.0, np.log(loss[1] / loss[0]) / np.log(ratio)), atol=1e-6)
