"""Where doublings turn from stable to unstable: SciPy's doubled orbits on both sides of the point."""

from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy_map

import isojax as ij

ONE = 1.0 / (2.0 * np.pi)


def law(x, v):
    return x + x * x + 0.1 * v, 1.0 + 2.0 * x, 0.1


def oscillator(damping=0.1):
    """A spring with a quadratic term: driven near twice its frequency its motion doubles."""
    return ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(damping), ij.QuadraticStiffness(1.0)))


def doublings(model, fit=None):
    window = {"amplitude_range": (0.2, 0.4), "frequency_range": (1.88 * ONE, 2.06 * ONE)}
    return ij.period_doubling_curve(model, **window, search=3, step=0.2, fit=fit)


class Fitted(NamedTuple):
    """What a band asks of a fit: a standard error of 1 % of the quadratic term."""

    model: ij.Isolator
    free: tuple[str, ...] = ("quadratic_stiffness.coefficient",)
    covariance: np.ndarray = np.array([[1e-4]])
    result: ij.RESULTS = ij.RESULTS.promote(diffrax.RESULTS.successful)


@pytest.fixture(scope="module")
def curve():
    return doublings(oscillator(), Fitted(oscillator()))


def after(state, force, frequency, turns):
    end, matrix, _ = scipy_map.after(law, 1.0, float(force), float(frequency), np.asarray(state), turns)
    return end, matrix


def doubled_force(y0, force, frequency, size):
    """Give the force under which an orbit of two periods passes a state `size` off the critical one."""
    _, matrix = after(y0, force, frequency, 1.0)
    direction = np.linalg.svd(matrix + np.eye(2))[2][-1]
    unknown = np.r_[y0 + size * direction, force]
    for _ in range(8):
        end, slope = after(unknown[:2], unknown[2], frequency, 2.0)
        ahead, behind = (after(unknown[:2], unknown[2] + h, frequency, 2.0)[0] for h in (1e-6, -1e-6))
        gap = np.r_[end - unknown[:2], direction @ (unknown[:2] - y0) - size]
        by_force = (ahead - behind) / 2e-6
        rows = np.vstack([np.c_[slope - np.eye(2), by_force], np.r_[direction, 0.0]])
        step = np.linalg.solve(rows, gap)
        unknown = unknown - step
        if np.abs(step).max() < 1e-10:
            break
    assert np.abs(after(unknown[:2], unknown[2], frequency, 1.0)[0] - unknown[:2]).max() > 0.5 * size
    return unknown[2]


@pytest.mark.slow
def test_doubled_orbits_of_scipy_change_sides_at_the_point(curve):
    (point,) = (one for one in curve.special_points if one.kind == "generalised_doubling")
    assert ij.is_successful(point.result)
    end, matrix = after(point.y0, point.amplitude, point.frequency, 1.0)
    np.testing.assert_allclose(end, point.y0, atol=1e-9)
    assert abs(np.linalg.det(matrix + np.eye(2))) < 1e-8
    # At the point the force of a small doubled orbit goes with the fourth power of its size, not the square.
    at = [doubled_force(point.y0, float(point.amplitude), point.frequency, size) for size in (0.04, 0.08)]
    fourth = (at[1] - float(point.amplitude)) / (at[0] - float(point.amplitude))
    assert fourth == pytest.approx(16.0, rel=0.1)
    # Beside it the doubled orbits stand on the side where the orbit is unstable, or where it is stable.
    shares = np.linspace(0.0, 1.0, curve.frequency.size)
    order = np.argsort(np.asarray(curve.frequency))
    frequencies = np.asarray(curve.frequency)[order]
    near = np.searchsorted(frequencies, float(point.frequency))
    assert 2 <= near < shares.size - 1
    stable = []
    for place in order[[near - 2, near + 1]]:
        y0, force, frequency = (
            np.asarray(own[place]) for own in (curve.y0, curve.amplitude, curve.frequency)
        )
        beyond = doubled_force(y0, float(force), frequency, 0.02) > float(force)
        stable.append(beyond)
    assert stable == [False, True]


@pytest.mark.slow
def test_the_point_moves_with_the_damping_as_differences_say(curve):
    def of(points):
        point = next(one for one in points if one.kind == "generalised_doubling")
        return jnp.stack([point.amplitude, point.frequency])

    def place(damping):
        return of(doublings(oscillator(damping)).special_points)

    exact = jax.jacfwd(place)(0.1)
    high, low = np.asarray(place(0.1 + 1e-4)), np.asarray(place(0.1 - 1e-4))
    np.testing.assert_allclose(exact, (high - low) / 2e-4, rtol=1e-4)
    # Found again by itself it lies where its curve says.
    known = next(one for one in curve.special_points if one.kind == "generalised_doubling")
    again = of((ij.find_again(known, oscillator(0.1 + 1e-4)),))
    np.testing.assert_allclose(again, high, atol=1e-3 * np.abs(high - low).min())


@pytest.mark.slow
def test_the_errors_of_the_forces_are_those_of_their_scaling(curve):
    # Motion and force of x'' + c x' + x + q x^2 = F sin(w t) go with 1 / q at the same frequency.
    point = next(one for one in curve.special_points if one.kind == "generalised_doubling")
    error = {name: float(value) for name, value in point.band.standard_error.items()}
    assert error["amplitude"] == pytest.approx(0.01 * float(point.amplitude), rel=1e-4)
    assert error["frequency"] < 1e-6 * float(point.frequency)
    assert " ± " in str(point)
    middle = slice(2, -2)
    force, low, high = (
        np.asarray(one)[middle]
        for one in (curve.amplitude, curve.band.lower["amplitude"], curve.band.upper["amplitude"])
    )
    assert np.all((low - force) * (high - force) < 0.0)
    assert ij.plot.bifurcation_curve(curve).axes[0].patches
