"""Basins of attraction and the return to an orbit against symmetry, SciPy and the multipliers."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isojax as ij
from isojax.stability import find_periodic_orbit, stability_map

TURN = 2.0 * math.pi


def two_wells() -> ij.Isolator:
    """x'' + 0.1 x' - x + x^3 = F."""
    return ij.Isolator(1.0, (ij.LinearStiffness(-1.0), ij.CubicStiffness(1.0), ij.LinearDamping(0.1)))


def settled(x: float, v: float, force: float, sign: float, periods: int) -> np.ndarray:
    """State of the two wells by DOP853 after some periods of `sign force sin(t)`."""

    def rates(t, y):
        return [y[1], sign * force * math.sin(t) - 0.1 * y[1] + y[0] - y[0] ** 3]

    return solve_ivp(rates, (0.0, periods * TURN), [x, v], method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1]


def test_two_wells_are_told_apart_as_by_scipy():
    axis = np.linspace(-2.0, 2.0, 21)
    basins = ij.basins_of_attraction(two_wells(), ij.Harmonic(0.05, 1.0 / TURN), axis, axis)
    assert np.asarray(basins.periods).tolist() == [1, 1]
    centre = np.asarray(basins.attractors[:, 0, 0])
    assert sorted(np.sign(centre)) == [-1.0, 1.0]
    random = np.random.default_rng(5)
    for i, j in random.integers(0, 21, size=(8, 2)):
        end = settled(axis[i], axis[j], 0.05, 1.0, 60)
        assert np.sign(end[0]) == np.sign(centre[int(basins.index[i, j])])
    # Without a preferred side the two basins are alike in size, though not mirror images at one phase.
    assert float(basins.shares.sum()) == pytest.approx(1.0)
    assert abs(float(basins.shares[0]) - 0.5) < 0.05


def test_basins_of_the_turned_drive_are_the_basins_seen_through_the_centre():
    # (x, v, F) -> (-x, -v, -F) leaves the equation as it is.
    axis = np.linspace(-1.5, 1.5, 13)
    forth = ij.basins_of_attraction(two_wells(), ij.Harmonic(0.1, 1.0 / TURN), axis, axis)
    back = ij.basins_of_attraction(two_wells(), ij.Harmonic(-0.1, 1.0 / TURN), axis, axis)
    ends = np.nanmean(forth.attractors, axis=1)[np.asarray(forth.index)]
    turned = np.nanmean(back.attractors, axis=1)[np.asarray(back.index)]
    np.testing.assert_allclose(ends, -turned[::-1, ::-1], atol=1e-3)


@pytest.mark.slow
def test_attractors_between_the_folds_are_the_stable_orbits_of_the_map():
    model, force, frequency = ij.paper.y_direction(), 175.0, 4.2
    basins = ij.basins_of_attraction(
        model, ij.Harmonic(force, frequency), np.linspace(-1e-3, 1e-3, 9), np.linspace(-0.03, 0.03, 9)
    )
    orbits = stability_map(model, [force], [frequency], coexisting=True)
    stable = np.asarray(orbits.y0)[np.asarray(orbits.stable)]
    assert stable.shape == (2, 2)
    found = np.asarray(basins.attractors[:, 0])
    np.testing.assert_allclose(found[np.argsort(found[:, 0])], stable[np.argsort(stable[:, 0])], rtol=1e-3)


def test_what_runs_away_has_no_attractor():
    model = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.CubicStiffness(-1.0), ij.LinearDamping(0.2)))
    basins = ij.basins_of_attraction(model, ij.Harmonic(0.05, 0.1), [-2.0, 0.0, 2.0], [0.0])
    assert np.asarray(basins.index).ravel().tolist() == [-1, 0, -1]
    assert np.asarray(basins.result == ij.RESULTS.not_finite).ravel().tolist() == [True, False, True]
    assert float(basins.shares[0]) == pytest.approx(1 / 3)


def test_a_motion_that_never_repeats_counts_as_period_zero_and_doubled_ones_as_two():
    model = ij.Isolator(1.0, (ij.LinearStiffness(-1.0), ij.CubicStiffness(1.0), ij.LinearDamping(0.3)))
    chaos = ij.basins_of_attraction(model, ij.Harmonic(0.5, 1.2 / TURN), [0.0, 1.0], [0.0], most=300)
    assert np.asarray(chaos.periods).tolist() == [0]
    doubled = ij.basins_of_attraction(model, ij.Harmonic(0.28, 1.2 / TURN), [-1.0, -0.5, 0.5, 1.0], [0.0])
    assert np.asarray(doubled.periods).tolist() == [2, 2]


@pytest.mark.parametrize(
    ("direction", "force", "frequency"),
    [("y", 419.8, 3.8831), ("y", 459.9, 3.739), ("z", 450.5, 2.0470), ("z", 494.5892, 2.0426)],
)
def test_motions_of_figures_20_and_21_return_at_the_rate_of_their_multipliers(direction, force, frequency):
    model = ij.paper.y_direction() if direction == "y" else ij.paper.z_direction()
    orbit = find_periodic_orbit(model, ij.Harmonic(force, frequency))
    back = ij.return_to_orbit(model, orbit, 0.3 * np.max(np.abs(orbit.states), axis=0))
    assert bool(back.returned)
    assert float(back.distance[0]) == pytest.approx(0.3 * math.sqrt(2.0))
    assert float(back.rate) == pytest.approx(float(orbit.floquet.spectral_radius), rel=2e-3)


def test_the_way_back_is_that_of_scipy():
    model = ij.paper.z_direction()
    orbit = find_periodic_orbit(model, ij.Harmonic(450.5, 2.047))
    kick = np.array([5e-3, -0.1])
    back = ij.return_to_orbit(model, orbit, kick, periods=3)

    def rates(t, y):
        x, v = y
        spring = 1.414e5 * x - 4.126e5 * abs(x) * x - 4.289e6 * x**3
        damper = 2638.0 * v - 1393.0 * abs(v) * v + 745.533 * v**3
        return [v, (450.5 * math.sin(TURN * 2.047 * t) - spring - damper) / 800.0]

    times = np.arange(4) / 2.047
    span, begin = (0.0, times[-1]), np.asarray(orbit.y0) + kick
    reference = solve_ivp(rates, span, begin, method="DOP853", t_eval=times, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(back.states, reference.y.T, rtol=1e-4, atol=1e-6)


def test_a_disturbed_saddle_is_left_at_the_rate_of_its_multiplier():
    model = ij.paper.y_direction()
    orbits = stability_map(model, [175.0], [4.2], coexisting=True)
    saddle = np.asarray(orbits.y0)[np.asarray(orbits.spectral_radius) > 1.0]
    assert saddle.shape == (1, 2)
    orbit = find_periodic_orbit(model, ij.Harmonic(175.0, 4.2), start=tuple(saddle[0]), symmetric=False)
    away = ij.return_to_orbit(model, orbit, 1e-6 * np.max(np.abs(orbit.states), axis=0))
    assert not bool(away.returned)
    assert float(orbit.floquet.spectral_radius) > 1.05
    assert float(away.rate) == pytest.approx(float(orbit.floquet.spectral_radius), rel=2e-3)


def test_bad_perturbations_and_grids_are_refused():
    model = ij.paper.z_direction()
    drive = ij.Harmonic(100.0, 3.0)
    orbit = find_periodic_orbit(model, drive)
    with pytest.raises(ValueError, match="2 states"):
        ij.return_to_orbit(model, orbit, (1.0,))
    with pytest.raises(ValueError, match="not zero"):
        ij.return_to_orbit(model, orbit, (0.0, 0.0))
    with pytest.raises(ValueError, match="must ascend"):
        ij.basins_of_attraction(model, drive, [0.0, -1.0], [0.0])
    with pytest.raises(ValueError, match="must be finite"):
        ij.basins_of_attraction(model, drive, [math.nan], [0.0])
