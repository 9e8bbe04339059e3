"""Equivalent stiffness and damping around a cycle, against closed forms."""

import numpy as np

from isojax import (
    BoucWen,
    CoulombFriction,
    CubicDamping,
    CubicStiffness,
    InputDelay,
    Isolator,
    LinearDamping,
    LinearStiffness,
    MaxwellBranch,
)
from isojax.reporting.plots._force_cycles import equivalent_curves, trace_cycles

AMPLITUDES = np.array([1e-4, 5e-4, 1e-3])
FREQUENCY = 5.0
OMEGA = 2.0 * np.pi * FREQUENCY


def test_polynomial_laws_give_their_harmonic_balance():
    model = Isolator(
        800.0, (LinearStiffness(1e6), CubicStiffness(2e11), LinearDamping(1e4), CubicDamping(5e6))
    )
    stiffness, damping = equivalent_curves(model, AMPLITUDES, FREQUENCY)
    np.testing.assert_allclose(stiffness, 1e6 + 0.75 * 2e11 * AMPLITUDES**2, rtol=1e-10)
    np.testing.assert_allclose(damping, 1e4 + 0.75 * 5e6 * (OMEGA * AMPLITUDES) ** 2, rtol=1e-10)


def test_dry_friction_gives_den_hartogs_damping():
    model = Isolator(800.0, (CoulombFriction(4.0, 1e-6),))
    stiffness, damping = equivalent_curves(model, AMPLITUDES, FREQUENCY)
    np.testing.assert_allclose(stiffness, 0.0, atol=1e-6)
    np.testing.assert_allclose(damping, 4.0 * 4.0 / (np.pi * OMEGA * AMPLITUDES), rtol=1e-3)


def test_relaxation_gives_storage_and_loss_of_a_maxwell_branch():
    stiffness, time_constant = 1e5, 0.03
    model = Isolator(800.0, (MaxwellBranch(stiffness, time_constant),))
    storage, loss = equivalent_curves(model, AMPLITUDES, FREQUENCY)
    square = (OMEGA * time_constant) ** 2
    np.testing.assert_allclose(storage, stiffness * square / (1.0 + square), rtol=1e-6)
    np.testing.assert_allclose(loss, stiffness * time_constant / (1.0 + square), rtol=1e-6)


def test_hysteresis_closes_its_loop():
    model = Isolator(800.0, (BoucWen(1e5, 800.0, 500.0, 1.0),))
    cycles = trace_cycles(model, AMPLITUDES[1:], FREQUENCY)
    half = cycles.phase.size // 2
    np.testing.assert_allclose(cycles.force[:half], -cycles.force[half:], rtol=1e-3, atol=1e-3)


def test_an_instrument_exerts_no_force():
    cycles = trace_cycles(Isolator(800.0, (InputDelay(1e-3),)), AMPLITUDES, FREQUENCY)
    assert not np.any(cycles.force)
