"""Motions near folds against the paper's table, Duffing's equation to one harmonic, and closed forms."""

import jax
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import isojax as ij
from isojax.stability import NearestFolds, find_nearest_folds

MODEL = ij.paper.y_direction()

TABLE = {4.0: (211.67, 211.31), 4.1: (194.01, 190.62), 4.2: (178.12, 171.89), 4.4: (150.66, 144.52)}
"""Frequency [Hz] to upper and lower fold [N], found by others to 0.01 N."""


K1, K2, K3 = 1.0805e6, -6.974e8, 2.51667e11
C1, C2, C3 = 1.027e4, -3.6880e5, 5.3753e6


def one_harmonic(force, frequency, largest):
    """Give the state at t = 0 by the paper's eqs. (7) and (8): of several answers the smallest or largest."""
    omega, size = 2.0 * np.pi * frequency, np.linspace(1e-6, 3e-3, 6000)
    stiffness = K1 + 8.0 / (3.0 * np.pi) * K2 * size + 0.75 * K3 * size**2 - 800.0 * omega**2
    speed = omega * size
    damping = omega * (C1 + 8.0 / (3.0 * np.pi) * C2 * speed + 0.75 * C3 * speed**2)
    answers = np.flatnonzero(np.diff(np.sign(size * np.hypot(stiffness, damping) - force)))
    place = answers[-1 if largest else 0]
    lag = np.arctan2(damping[place], stiffness[place])
    return size[place] * np.array([-np.sin(lag), omega * np.cos(lag)])


@pytest.fixture(scope="module")
def beside_the_lens() -> NearestFolds:
    """Small motions 5 N below the upper folds, large ones 5 N above them."""
    frequencies = np.repeat(list(TABLE), 2)
    amplitudes = np.concatenate([[upper - 5.0, upper + 5.0] for upper, _ in TABLE.values()])
    starts = [
        one_harmonic(force, frequency, place % 2 == 1)
        for place, (force, frequency) in enumerate(zip(amplitudes, frequencies, strict=True))
    ]
    return find_nearest_folds(MODEL, amplitudes, frequencies, np.stack(starts))


def test_small_motions_end_at_the_upper_fold_of_the_table(beside_the_lens):
    found = np.asarray(beside_the_lens.fold_amplitude)[0::2]
    np.testing.assert_allclose(found[:, 1], [upper for upper, _ in TABLE.values()], atol=0.02)
    assert np.all(np.isneginf(found[:, 0]))
    distance = np.asarray(beside_the_lens.amplitude_distance)[0::2]
    np.testing.assert_allclose(distance, 5.0, atol=0.02)


def test_large_motions_end_at_the_lower_fold_of_the_table(beside_the_lens):
    found = np.asarray(beside_the_lens.fold_amplitude)[1::2]
    np.testing.assert_allclose(found[:, 0], [lower for _, lower in TABLE.values()], atol=0.02)
    assert np.all(np.isposinf(found[:, 1]))


@pytest.mark.slow
def test_multipliers_are_those_of_single_orbits(beside_the_lens):
    for place in range(8):
        drive = ij.Harmonic(beside_the_lens.amplitude[place], beside_the_lens.frequency[place])
        alone = ij.find_periodic_orbit(MODEL, drive, start=beside_the_lens.y0[place])
        radius = float(alone.floquet.spectral_radius)
        assert float(beside_the_lens.spectral_radius[place]) == pytest.approx(radius, abs=2e-4)
        assert float(beside_the_lens.response[place]) == pytest.approx(float(alone.amplitude), rel=1e-3)


def test_a_start_beside_the_motion_leads_to_the_same_folds(beside_the_lens):
    few = slice(4, 6)
    starts = 1.03 * np.asarray(beside_the_lens.y0)[few]
    again = find_nearest_folds(MODEL, beside_the_lens.amplitude[few], beside_the_lens.frequency[few], starts)
    np.testing.assert_allclose(again.fold_amplitude, beside_the_lens.fold_amplitude[few], atol=1e-3)


def test_folds_along_the_frequency_are_those_of_duffing_to_one_harmonic():
    damping, cubic, force = 0.02, 5e-3, 0.1
    model = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(damping), ij.CubicStiffness(cubic)))

    def omega(size, sign):
        """Angular frequency at which the amplitude answers, from the balance of the first harmonic."""
        centre = 1.0 + 0.75 * cubic * size**2 - 0.5 * damping**2
        root = centre**2 - (1.0 + 0.75 * cubic * size**2) ** 2 + (force / size) ** 2
        return np.sqrt(centre + sign * np.sqrt(max(root, 0.0)))

    sizes = np.linspace(1.0, 4.9, 40000)
    right = np.array([omega(size, 1.0) for size in sizes])
    # Along falling amplitude above resonance the frequency first falls (saddle), then rises (small motion).
    turning = np.argmin(right)
    assert 0 < turning < sizes.size - 1
    fold, small = right[turning], 1.01 * right[turning]
    size = brentq(lambda x: omega(x, 1.0) - small, 0.5, sizes[turning])
    phase = np.arctan2(damping * small, 1.0 + 0.75 * cubic * size**2 - small**2)
    start = size * np.array([-np.sin(phase), small * np.cos(phase)])
    found = find_nearest_folds(model, [force], [small / (2.0 * np.pi)], start[None])
    assert ij.is_successful(jax.tree.map(lambda it: it[0], found.result))
    assert float(found.fold_frequency[0, 0]) * 2.0 * np.pi == pytest.approx(fold, abs=5e-4)
    assert float(found.frequency_distance[0]) * 2.0 * np.pi == pytest.approx(small - fold, abs=5e-4)


def test_linear_radius_is_the_closed_form_and_there_is_no_fold():
    mass, damping, stiffness = 800.0, 1e4, 1e6
    model = ij.Isolator(mass, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping)))
    frequency = np.array([3.0, 5.0, 7.0])
    found = find_nearest_folds(model, [100.0, 200.0, 50.0], frequency, np.zeros((3, 2)))
    np.testing.assert_allclose(found.spectral_radius, np.exp(-damping / (2.0 * mass * frequency)), atol=1e-5)
    assert np.all(np.isinf(np.asarray(found.fold_amplitude)))
    assert np.all(np.isinf(np.asarray(found.amplitude_distance)))
    assert np.all(np.isinf(np.asarray(found.frequency_distance)))


def test_memories_have_multipliers_too():
    mass, stiffness, damping, branch, tau = 800.0, 1e6, 3e3, 2e5, 0.03
    model = ij.Isolator(
        mass, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping), ij.MaxwellBranch(branch, tau))
    )
    found = find_nearest_folds(model, [100.0], [5.0], np.zeros((1, 3)))
    # p' = v - p/tau, force K p.
    matrix = np.array(
        [[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, -branch / mass], [0.0, 1.0, -1.0 / tau]]
    )
    expected = np.max(np.abs(np.linalg.eigvals(expm(matrix / 5.0))))
    assert float(found.spectral_radius[0]) == pytest.approx(expected, rel=1e-6)


def test_a_motion_that_runs_away_is_nothing():
    model = ij.Isolator(800.0, (ij.LinearStiffness(1e6), ij.LinearDamping(1e4), ij.CubicStiffness(-1e12)))
    found = find_nearest_folds(model, [100.0, 5e4], [5.0, 5.0], np.zeros((2, 2)))
    results = [jax.tree.map(lambda it, at=place: it[at], found.result) for place in range(2)]
    assert ij.is_successful(results[0])
    assert not ij.is_successful(results[1])
    numbers = (found.y0[1], found.spectral_radius[1], found.fold_amplitude[1], found.fold_frequency[1])
    assert all(np.all(np.isnan(np.asarray(number))) for number in numbers)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (([0.0], [5.0], np.zeros((1, 2))), "positive"),
        (([1.0], [-5.0], np.zeros((1, 2))), "positive"),
        (([1.0], [5.0], np.zeros((1, 3))), "shape"),
    ],
)
def test_bad_motions_are_refused(arguments, word):
    with pytest.raises(ValueError, match=word):
        find_nearest_folds(MODEL, *arguments)


def test_a_reach_beyond_the_drive_is_refused():
    with pytest.raises(ValueError, match="reach"):
        find_nearest_folds(MODEL, [1.0], [5.0], np.zeros((1, 2)), reach=(1.5, 0.1))
