"""Motion split at kinks: instants and states against the closed form of a piecewise solution."""

import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy_orbits import Y_DIRECTION, flow, polynomial

from isojax import Harmonic, Integrator, Isolator, elements, find_periodic_orbit, paper
from isojax.stability.orbit._event_path import follow_events
from isojax.stability.orbit._kink_crossings import advance_across_kinks
from isojax.stability.orbit._period_map import period_map
from isojax.stability.orbit._sine import recorded_sine


def crossings_of(model, drive, state, steps=512, places=8):
    return follow_events(model, drive, state, 2.0 * math.pi, steps, places).crossings


def test_crossings_are_those_of_a_free_sine():
    # Kinks of laws that have no strength: the rest moves as a sine, one cycle a period of the drive.
    model = Isolator(
        1.0,
        (
            elements.LinearStiffness((2.0 * math.pi) ** 2),
            elements.AbsQuadraticStiffness(0.0),
            elements.AbsQuadraticDamping(0.0),
        ),
    )
    drive = recorded_sine(model, 0.0, 1.0)
    start = (jnp.sin(0.3), 2.0 * math.pi * jnp.cos(0.3))
    crossings = crossings_of(model, drive, start, 128, 6)
    # v = cos passes zero at pi/2 - 0.3 and 3 pi/2 - 0.3, x = sin at pi - 0.3 and 2 pi - 0.3.
    expected = np.array([0.5, 1.0, 1.5, 2.0]) * math.pi - 0.3
    np.testing.assert_allclose(crossings.phases[:4], expected, atol=1e-6)
    np.testing.assert_array_equal(crossings.phases[4:], 2.0 * math.pi)
    np.testing.assert_array_equal(crossings.kinks, [1, 0, 1, 0, -1, -1])
    expected_sides = [[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1], [1, 1], [1, 1]]
    np.testing.assert_array_equal(crossings.sides, expected_sides)
    assert bool(crossings.complete)
    short = follow_events(model, drive, start, 2.0 * math.pi, 128, 3)
    assert not bool(short.crossings.complete)
    assert not np.any(np.isfinite(short.end))


def test_split_at_its_kinks_a_motion_converges_with_fourth_order_to_that_of_scipy():
    model = paper.y_direction()
    drive = recorded_sine(model, 150.0, 4.3)
    start = (jnp.asarray(2e-4), jnp.asarray(5e-3))
    end, matrix, pieces = flow(polynomial(**Y_DIRECTION), 150.0, 4.3, np.array([2e-4, 5e-3]), 1.0 / 4.3)
    instants = [piece.t[-1] for piece in pieces[:-1]]
    crossings = crossings_of(model, drive, start)
    found = crossings.phases[crossings.kinks >= 0] / (2.0 * math.pi * 4.3)
    np.testing.assert_allclose(found, instants, atol=1e-4 / 4.3)
    exact = crossings._replace(
        phases=jnp.full(8, 2.0 * math.pi).at[: len(instants)].set(2.0 * math.pi * 4.3 * jnp.asarray(instants))
    )

    def moved(state, steps):
        there, reached = advance_across_kinks(model, Integrator(), drive, state, exact, 2.0 * math.pi, steps)
        return jnp.stack(there), reached

    scale = np.abs(end)
    errors = []
    for steps in (16, 32, 64, 128):
        after, reached = moved(start, steps)
        errors.append(float(np.max(np.abs(np.asarray(after) - end) / scale)))
    assert errors[3] < 1e-8
    assert min(a / b for a, b in itertools.pairwise(errors)) > 11.0
    assert float(jnp.max(jnp.abs(reached[: len(instants)]))) < 1e-8
    # The law is continuous at its kinks, so the derivative needs no jump there.
    slopes = jnp.stack(
        [jnp.stack(row) for row in jax.jacfwd(lambda *s: tuple(moved(s, 512)[0]), (0, 1))(*start)]
    )
    np.testing.assert_allclose(slopes, matrix, rtol=1e-8)


def test_unsplit_steps_lose_their_order_which_is_why_single_orbits_are_split():
    model = paper.y_direction()
    drive = recorded_sine(model, 150.0, 4.3)
    start = (jnp.asarray(2e-4), jnp.asarray(5e-3))
    _, matrix, _ = flow(polynomial(**Y_DIRECTION), 150.0, 4.3, np.array([2e-4, 5e-3]), 1.0 / 4.3)

    def error(steps):
        def moved(*state):
            return period_map(model, Integrator(steps_per_period=steps), drive, state)

        slopes = jnp.stack([jnp.stack(row) for row in jax.jacfwd(moved, (0, 1))(*start)])
        return float(np.max(np.abs(np.asarray(slopes) / matrix - 1.0)))

    # Four doublings would divide the error of a smooth law by 65 536.
    assert error(128) / error(2048) < 3000.0
    assert error(2048) > 1e-9


@pytest.mark.slow
def test_an_orbit_that_passes_more_kinks_than_there_was_room_for_is_split_at_all():
    # A third harmonic as strong as the first makes the velocity turn six times a period.
    model = paper.y_direction().replace(linear_damping__coefficient=300.0)
    frequency = math.sqrt(1.0805e6 / 800.0) / (2.0 * math.pi) / 3.0
    orbit = find_periodic_orbit(model, Harmonic(60.0, frequency))
    finer = find_periodic_orbit(model, Harmonic(60.0, frequency), integrator=Integrator(steps_per_period=256))
    np.testing.assert_allclose(orbit.floquet.multipliers, finer.floquet.multipliers, atol=1e-9)
    assert float(orbit.error) < 1e-9
