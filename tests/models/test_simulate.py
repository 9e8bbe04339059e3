"""Simulated records against closed forms and SciPy's DOP853."""

import os
import subprocess
import sys

import diffrax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from isojax import paper
from isojax._results import RESULTS, is_successful
from isojax.elements import CubicStiffness, DahlFriction, LinearDamping, LinearStiffness, MaxwellBranch
from isojax.excitations import Harmonic, Sampled
from isojax.models import Integrator, Isolator, simulate

M, K, C = 800.0, 1.08e6, 1.0e4
F0, F = 150.0, 4.3
OMEGA = 2.0 * np.pi * F
DRIVE = Harmonic(F0, F)


def linear() -> Isolator:
    return Isolator(M, (LinearStiffness(K), LinearDamping(C)))


def linear_response(t, x0, v0):
    """Displacement and velocity of the linear isolator: steady state and decay of the difference to it."""
    steady = F0 / (K - M * OMEGA**2 + 1j * C * OMEGA) / 1j
    decay, natural = C / (2.0 * M), np.sqrt(K / M - (C / (2.0 * M)) ** 2)
    # Half of steady exp(i omega t) + conjugate, and likewise for the free part with its complex pole.
    start_x, start_v = x0 - steady.real, v0 - (1j * OMEGA * steady).real
    pole = -decay + 1j * natural
    free = start_x - 1j * (start_v + decay * start_x) / natural
    x = (steady * np.exp(1j * OMEGA * t)).real + (free * np.exp(pole * t)).real
    v = (1j * OMEGA * steady * np.exp(1j * OMEGA * t)).real + (pole * free * np.exp(pole * t)).real
    return x, v


def reference(field, times, start):
    """DOP853 at the tightest tolerance that SciPy allows."""
    return solve_ivp(field, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-15).y


@pytest.mark.parametrize(("x0", "v0"), [(0.0, 0.0), (2e-3, -0.05)])
def test_a_linear_isolator_follows_its_closed_form(x0, v0):
    record = simulate(linear(), DRIVE, duration=2.0, initial_state=(x0, v0))
    x, v = linear_response(np.asarray(record.time), x0, v0)
    np.testing.assert_allclose(record.displacement, x, atol=5e-8 * np.max(np.abs(x)))
    np.testing.assert_allclose(record.velocity, v, atol=5e-8 * np.max(np.abs(v)))
    acceleration = (F0 * np.sin(OMEGA * np.asarray(record.time)) - K * x - C * v) / M
    np.testing.assert_allclose(record.acceleration, acceleration, atol=1e-7 * np.max(np.abs(acceleration)))
    np.testing.assert_array_equal(record.reading, record.acceleration)
    assert is_successful(record.result)


def test_the_papers_model_follows_dop853():
    def field(t, y):
        x, v = y
        spring = 1.0805e6 * x - 6.974e8 * abs(x) * x + 2.51667e11 * x**3
        damper = 1.027e4 * v - 3.688e5 * abs(v) * v + 5.3753e6 * v**3
        return [v, (420.0 * np.sin(2 * np.pi * 4.4 * t) - spring - damper) / 800.0]

    expected = reference(field, np.arange(3001) / 1000.0, [0.0, 0.0])
    for substeps, tolerance in ((1, 2e-6), (4, 2e-8)):
        record = simulate(
            paper.y_direction(), Harmonic(420.0, 4.4), duration=3.0, integrator=Integrator(substeps=substeps)
        )
        found = (record.displacement, record.velocity)
        for values, wanted in zip(found, expected, strict=True):
            np.testing.assert_allclose(values, wanted, rtol=0.0, atol=tolerance * np.max(np.abs(wanted)))


def test_adaptive_steps_reach_the_tolerance_asked_for():
    record = simulate(
        linear(), DRIVE, duration=1.0, integrator=Integrator(diffrax.Dopri8(), rtol=1e-10, atol=1e-14)
    )
    x, _ = linear_response(np.asarray(record.time), 0.0, 0.0)
    np.testing.assert_allclose(record.displacement, x, atol=1e-8 * np.max(np.abs(x)))


def test_halving_the_step_divides_the_error_of_a_smooth_model_by_sixteen():
    model = Isolator(M, (LinearStiffness(K), LinearDamping(C), CubicStiffness(2e11)))
    times = np.arange(101) / 100.0
    expected = reference(
        lambda t, y: [y[1], (F0 * np.sin(OMEGA * t) - K * y[0] - C * y[1] - 2e11 * y[0] ** 3) / M],
        times,
        [0.0, 0.0],
    )[0]
    errors = []
    for substeps in (2, 4):
        record = simulate(model, DRIVE, duration=1.0, rate=100.0, integrator=Integrator(substeps=substeps))
        errors.append(np.max(np.abs(record.displacement - expected)))
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 4.0, atol=0.2)


def test_internal_states_start_where_they_are_told_and_follow_scipy():
    tau, level, presliding = 0.02, 30.0, 1e-3
    model = Isolator(
        M, (LinearStiffness(K), MaxwellBranch(3e5, tau), LinearDamping(C), DahlFriction(level, presliding))
    )
    start = (1e-3, 0.02, -4e-4, 0.3)

    def field(t, y):
        x, v, p, w = y
        force = K * x + 3e5 * p + C * v + level * w
        return [v, (F0 * np.sin(OMEGA * t) - force) / M, v - p / tau, (v - abs(v) * w) / presliding]

    record = simulate(model, DRIVE, duration=1.0, initial_state=start)
    expected = reference(field, np.arange(1001) / 1000.0, start)
    assert len(record.internal) == 2
    for found, wanted in zip((record.displacement, record.velocity, *record.internal), expected, strict=True):
        assert float(found[0]) == wanted[0]
        np.testing.assert_allclose(found, wanted, atol=2e-5 * np.max(np.abs(wanted)))


def test_a_zero_order_hold_keeps_its_force_through_the_step():
    rate, count = 200.0, 200
    forces = F0 * np.random.default_rng(7).standard_normal(count + 1)
    # The exact step of a linear system under a constant force: exp of the augmented matrix.
    matrix = np.array([[0.0, 1.0, 0.0], [-K / M, -C / M, 1.0 / M], [0.0, 0.0, 0.0]])
    step = expm(matrix / rate)
    state, expected = np.zeros(2), []
    for force in forces:
        expected.append(state[0])
        state = (step @ np.append(state, force))[:2]
    fine = simulate(
        linear(),
        Sampled(forces, rate, "zero_order"),
        duration=count / rate,
        rate=rate,
        integrator=Integrator(substeps=8),
    )
    np.testing.assert_allclose(fine.displacement, expected, atol=1e-7 * np.max(np.abs(expected)))


def test_a_record_has_one_sample_more_than_steps_and_names_its_drive():
    record = simulate(linear(), DRIVE, duration=0.05)
    np.testing.assert_allclose(record.time, np.arange(51) / 1000.0, rtol=1e-14)
    np.testing.assert_allclose(record.drive, F0 * np.sin(OMEGA * np.arange(51) / 1000.0), atol=1e-10)


def test_a_run_that_leaves_every_bound_is_nan_and_says_so():
    runaway = Isolator(M, (LinearStiffness(K), LinearDamping(C), CubicStiffness(-1e14)))
    record = simulate(runaway, Harmonic(1e4, F), duration=1.0)
    assert bool(record.result == RESULTS.not_finite)
    assert not is_successful(record.result)
    for values in (record.displacement, record.velocity, record.acceleration, record.reading):
        assert bool(jnp.all(jnp.isnan(values)))


def test_a_run_out_of_steps_is_nan_and_says_so():
    record = simulate(linear(), DRIVE, duration=0.5, integrator=Integrator(max_steps=100))
    assert bool(record.result == RESULTS.max_steps_reached)
    assert bool(jnp.all(jnp.isnan(record.reading)))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"duration": 0.0}, r"`duration` must be positive and finite, but is 0.0"),
        ({"duration": float("nan")}, r"`duration` must be positive and finite, but is nan"),
        ({"rate": -5.0}, r"`rate` must be positive and finite, but is -5.0"),
        ({"duration": 1e-5}, r"`duration` must be at least one sample of 0.001 s, but is 1e-05"),
        ({"initial_state": (0.0, 0.0, 0.0)}, r"`initial_state` must hold 2 states, but holds 3"),
        ({"quantity": "position"}, r"`quantity` must be one of .*, but is 'position'"),
    ],
)
def test_bad_arguments_are_refused(unchecked, changed, message):
    with pytest.raises(ValueError, match=message):
        simulate(linear(), DRIVE, **({"duration": 0.1} | changed))


def test_adaptive_steps_without_an_error_estimate_are_refused():
    with pytest.raises(ValueError, match=r"`solver` must estimate its error where `rtol` is given.*RK4"):
        Integrator(rtol=1e-8)


@pytest.mark.slow
def test_single_precision_is_refused_and_the_message_says_what_to_write(tmp_path):
    script = """
from isojax import paper
from isojax.excitations import Harmonic
from isojax.models import load_model, simulate

model, drive = paper.y_direction(), Harmonic(1.0, 4.0)
for call in (lambda: simulate(model, drive, duration=0.1), lambda: load_model("m")):
    try:
        call()
    except RuntimeError as error:
        print(error)
"""
    environment = {key: value for key, value in os.environ.items() if key != "JAX_ENABLE_X64"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        env=environment,
        cwd=tmp_path,
        check=True,
    )
    assert done.stdout.count('jax.config.update("jax_enable_x64", True)') == 2
