"""Bifurcations and the branches that leave there: SciPy at the located points, and averaging theory."""

import jax
import numpy as np
import pytest
import scipy_map
from scipy.integrate import solve_ivp

import isojax as ij

UEDA = ij.Isolator(1.0, (ij.LinearDamping(0.1), ij.CubicStiffness(1.0)))
"""x'' + 0.1 x' + x^3 = B sin t. Source: Ueda 1979, J. Stat. Phys. 20:181."""

UEDA_LAW = scipy_map.polynomial_law(k3=1.0, c1=0.1)
ONE = 1.0 / (2.0 * np.pi)
"""Frequency of sin t [Hz]."""


pytestmark = pytest.mark.slow


def van_der_pol(strength):
    return ij.Isolator(
        1.0, (ij.LinearDamping(-strength), ij.PositionDamping(strength), ij.LinearStiffness(1.0))
    )


def only(points, kind):
    (point,) = [point for point in points if point.kind == kind]
    assert ij.is_successful(point.result)
    return point


@pytest.fixture(scope="module")
def symmetric():
    fine = ij.Integrator(steps_per_period=512)
    return ij.continue_branch(
        UEDA, parameter="amplitude", frequency=ONE, start=0.05, stop=15.0, integrator=fine, other_periods=()
    )


@pytest.fixture(scope="module")
def broken(symmetric):
    return ij.switch_branch(symmetric, only(symmetric.special_points, "symmetry_breaking"))


@pytest.fixture(scope="module")
def doubled(broken):
    return ij.switch_branch(broken, only(broken.special_points, "period_doubling"))


def reference(law, point, turns):
    end, matrix, _ = scipy_map.after(
        law, 1.0, float(point.amplitude), float(point.frequency), point.y0, turns
    )
    return end, scipy_map.eigenvalues(matrix)


@pytest.mark.slow
def test_symmetry_breaks_at_minus_one_of_the_half_period_map_by_scipy(symmetric):
    point = only(symmetric.special_points, "symmetry_breaking")
    end, values = reference(UEDA_LAW, point, 0.5)
    np.testing.assert_allclose(-end, point.y0, atol=1e-8)
    # The half-period map is minus the state after half a period.
    np.testing.assert_allclose(-values, point.half_period_multipliers, atol=1e-8)
    assert complex(point.half_period_multipliers[0]) == pytest.approx(-1.0, abs=1e-9)
    assert complex(point.multipliers[0]) == pytest.approx(1.0, abs=1e-9)


def test_the_symmetric_branch_never_doubles(symmetric):
    kinds = [point.kind for point in symmetric.special_points]
    assert kinds == ["fold", "fold", "symmetry_breaking"]


@pytest.mark.slow
def test_the_broken_branch_holds_asymmetric_orbits_of_period_one_by_scipy(broken):
    assert ij.is_successful(broken.result)
    assert broken.periods == 1
    assert not broken.symmetric
    value = np.asarray(broken.points.value)
    for place in (value.size // 4, value.size // 2, value.size - 1):
        y0 = np.asarray(broken.points.y0[place])
        half, _, _ = scipy_map.after(UEDA_LAW, 1.0, float(value[place]), ONE, y0, 0.5)
        whole, matrix, path = scipy_map.after(UEDA_LAW, 1.0, float(value[place]), ONE, y0, 1.0)
        # 512 steps a period leave 3e-6.
        np.testing.assert_allclose(whole, y0, atol=1e-5)
        assert np.abs(half + y0).max() > 0.1
        np.testing.assert_allclose(scipy_map.eigenvalues(matrix), broken.points.multipliers[place], atol=1e-4)
        assert float(broken.points.response[place]) == pytest.approx(np.ptp(path[0]) / 2, rel=1e-3)


def test_the_broken_orbit_doubles_at_minus_one_by_scipy(broken):
    point = only(broken.special_points, "period_doubling")
    end, values = reference(UEDA_LAW, point, 1.0)
    np.testing.assert_allclose(end, point.y0, atol=1e-8)
    np.testing.assert_allclose(values, point.multipliers, atol=1e-7)
    assert complex(point.multipliers[0]) == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.slow
def test_the_doubled_branch_repeats_after_two_periods_by_scipy(doubled):
    assert doubled.periods == 2
    assert ij.is_successful(doubled.result)
    # Near its start; far along it the orbits are so unstable that the error of the steps grows tenfold.
    place = int(np.argmin(np.abs(np.asarray(doubled.points.value) - 6.0)))
    y0, force = np.asarray(doubled.points.y0[place]), float(doubled.points.value[place])
    once, _, _ = scipy_map.after(UEDA_LAW, 1.0, force, ONE, y0, 1.0)
    twice, _, _ = scipy_map.after(UEDA_LAW, 1.0, force, ONE, y0, 2.0)
    np.testing.assert_allclose(twice, y0, atol=1e-5)
    assert np.abs(once - y0).max() > 0.05


def test_the_doubled_orbit_doubles_again_by_scipy(doubled):
    point = only(doubled.special_points, "period_doubling")
    assert point.periods == 2
    end, values = reference(UEDA_LAW, point, 2.0)
    # Over two periods as good as over one.
    np.testing.assert_allclose(end, point.y0, atol=3e-10)
    assert values[0] == pytest.approx(-1.0, abs=2e-9)


@pytest.mark.slow
def test_what_the_located_points_say_is_what_the_motion_does(symmetric, broken):
    # Steady motion by SciPy from a start off the symmetric orbit, either side of each point.
    def settled(force):
        def rates(t, y):
            return y[1], force * np.sin(t) - UEDA_LAW(*y)[0]

        y0 = solve_ivp(rates, (0.0, 150.0 / ONE), [0.1, 0.2], "DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
        half, _, _ = scipy_map.after(UEDA_LAW, 1.0, force, ONE, y0, 0.5)
        once, _, _ = scipy_map.after(UEDA_LAW, 1.0, force, ONE, y0, 1.0)
        return np.abs(half + y0).max(), np.abs(once - y0).max()

    breaks = float(only(symmetric.special_points, "symmetry_breaking").value)
    doubles = float(only(broken.special_points, "period_doubling").value)
    asymmetry, repeat = settled(0.9 * breaks)
    assert max(asymmetry, repeat) < 1e-6
    asymmetry, repeat = settled(0.97 * doubles)
    assert asymmetry > 0.05
    assert repeat < 1e-6
    _, repeat = settled(1.03 * doubles)
    assert repeat > 0.05


@pytest.mark.slow
def test_forced_van_der_pol_loses_its_lock_where_averaging_says():
    # x'' - e (1 - x^2) x' + x = F sin(w t), x = 2 r cos(.): to first order in e the torus leaves at
    # r^2 = 1/2, and (1 - r^2)^2 + s^2 = (F / (2 e r w))^2 with s = (1 - w^2) / (e w).
    # Source: Guckenheimer & Holmes 1983, sec. 2.1; Nayfeh & Mook 1979, sec. 4.3.
    strength, omega = 0.02, 1.03
    detuned = (1.0 - omega**2) / (strength * omega)
    force = 2.0 * strength * omega * np.sqrt(0.5) * np.hypot(0.5, detuned)
    model = van_der_pol(strength)
    branch = ij.continue_branch(
        model,
        parameter="amplitude",
        frequency=omega * ONE,
        start=0.005,
        stop=0.3,
        step=0.01,
        other_periods=(),
    )
    point = only(branch.special_points, "neimark_sacker")
    assert float(point.amplitude) == pytest.approx(force, rel=5e-3)
    law = scipy_map.van_der_pol_law(strength)
    end, matrix, path = scipy_map.after(law, 1.0, float(point.amplitude), omega * ONE, point.y0, 1.0)
    np.testing.assert_allclose(end, point.y0, atol=1e-8)
    values = scipy_map.eigenvalues(matrix)
    assert np.abs(values) == pytest.approx(1.0, abs=1e-8)
    assert np.abs(values.imag).min() > 1e-3
    assert np.ptp(path[0]) / 2 == pytest.approx(np.sqrt(2.0), rel=5e-3)
    radius = np.asarray(branch.points.spectral_radius)
    value = np.asarray(branch.points.value)
    assert np.all(radius[value < float(point.value)] > 1.0)
    assert np.all(radius[value > float(point.value)] < 1.0)


@pytest.mark.slow
def test_a_saddle_with_reciprocal_multipliers_is_no_torus():
    branch = ij.continue_branch(
        van_der_pol(0.1),
        parameter="frequency",
        amplitude=0.1,
        start=0.8 * ONE,
        stop=1.2 * ONE,
        other_periods=(),
    )
    values = np.asarray(branch.points.multipliers)
    product = np.real(values[:, 0] * values[:, 1])
    passes = np.nonzero(np.sign(product[:-1] - 1.0) != np.sign(product[1:] - 1.0))[0]
    # A saddle just before: the pair turns complex only after the fold that follows.
    real = [place for place in passes if np.all(values[place].imag == 0.0)]
    assert real, "the case must hold what it is about"
    tori = [point for point in branch.special_points if point.kind == "neimark_sacker"]
    assert len(tori) == len(passes) - len(real)
    assert all(np.abs(np.asarray(point.multipliers).imag).min() > 1e-3 for point in tori)


@pytest.mark.slow
def test_an_asymmetric_spring_doubles_without_breaking_a_symmetry():
    spring = (ij.LinearDamping(0.1), ij.LinearStiffness(1.0), ij.QuadraticStiffness(1.0))
    branch = ij.continue_branch(
        ij.Isolator(1.0, spring),
        parameter="amplitude",
        frequency=0.85 * ONE,
        start=0.001,
        stop=0.15,
        other_periods=(),
    )
    assert not branch.symmetric
    assert [point.kind for point in branch.special_points] == ["fold", "fold", "period_doubling"]

    def law(x, v):
        return x + x * x + 0.1 * v, 1.0 + 2.0 * x, 0.1

    for point, value in zip(branch.special_points, (1.0, 1.0, -1.0), strict=True):
        end, values = reference(law, point, 1.0)
        np.testing.assert_allclose(end, point.y0, atol=1e-8)
        assert abs((values[0] - value) * (values[1] - value)) < 1e-8


@pytest.mark.slow
def test_a_broken_branch_that_comes_back_meets_no_fold_where_it_crosses(monkeypatch):
    # There the search for the point is singular; badly located, it must still be told for what it is.
    branch = ij.continue_branch(
        UEDA, parameter="amplitude", frequency=0.3 * ONE, start=0.05, stop=1.0, step=0.05, other_periods=()
    )
    breaks = [point for point in branch.special_points if point.kind == "symmetry_breaking"][:2]
    monkeypatch.setattr("isojax.stability.branch._locating._BISECTIONS", 3)
    loop = ij.switch_branch(branch, breaks[0])
    assert bool(loop.closed)
    kinds = [point.kind for point in loop.special_points]
    doublings = ["period_doubling"] * 2
    assert kinds == [*doublings, "symmetry_breaking", *doublings, "symmetry_breaking"]
    met = [float(point.value) for point in loop.special_points if point.kind == "symmetry_breaking"]
    np.testing.assert_allclose(met, [float(point.value) for point in breaks[::-1]], rtol=1e-9)


@pytest.mark.slow
def test_derivatives_of_a_doubling_are_central_differences(broken):
    start = broken.points.y0[-40]
    force = float(broken.points.value[-40])

    def doubling(model):
        ends = {"start": force, "stop": 3.6, "start_state": start}
        branch = ij.continue_branch(model, parameter="amplitude", frequency=ONE, **ends, other_periods=())
        return only(branch.special_points, "period_doubling").amplitude

    name = "linear_damping.coefficient"
    slope = float(jax.jacfwd(doubling)(UEDA)[name])

    def moved(share):
        return float(doubling(UEDA.replace(linear_damping__coefficient=0.1 * (1.0 + share))))

    coarse, fine = ((moved(h) - moved(-h)) / (2 * h * 0.1) for h in (2e-3, 1e-3))
    assert slope == pytest.approx((4 * fine - coarse) / 3, rel=1e-6)


def test_only_doublings_and_broken_symmetries_can_be_switched_at(symmetric):
    fold = symmetric.special_points[0]
    with pytest.raises(ValueError, match="`special_point` must be of kind period_doubling or symmetry_bre"):
        ij.switch_branch(symmetric, fold)
    point = only(symmetric.special_points, "symmetry_breaking")
    with pytest.raises(ValueError, match="`step` must be positive, but is -1"):
        ij.switch_branch(symmetric, point, step=-1.0)
