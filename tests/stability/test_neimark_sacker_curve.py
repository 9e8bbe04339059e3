"""Curves of Neimark-Sacker bifurcations and their resonances: SciPy at their points, and averaging theory."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy_map

import isojax as ij
from isojax.stability.branch._criticality import criticality, null_direction, pair_cosine

ONE = 1.0 / (2.0 * np.pi)
STRENGTH, SKEW = 0.3, 0.1


def van_der_pol(strength, skew=0.0):
    spring = (ij.LinearDamping(-strength), ij.PositionDamping(strength), ij.LinearStiffness(1.0))
    return ij.Isolator(1.0, (*spring, ij.QuadraticStiffness(skew)) if skew else spring)


def law(x, v):
    force, by_x, by_v = scipy_map.van_der_pol_law(STRENGTH)(x, v)
    return force + SKEW * x * x, by_x + 2.0 * SKEW * x, by_v


@pytest.fixture(scope="module")
def curve():
    return ij.neimark_sacker_curve(
        van_der_pol(STRENGTH, SKEW),
        amplitude_range=(0.05, 8.0),
        frequency_range=(1.02 * ONE, 2.4 * ONE),
        search=3,
        step=0.06,
    )


@pytest.mark.slow
def test_points_of_the_curve_carry_a_pair_on_the_unit_circle_by_scipy(curve):
    assert ij.is_successful(curve.result)
    assert not bool(curve.closed)
    for place in range(0, curve.amplitude.size, 5):
        y0, push, frequency = (np.asarray(own[place]) for own in (curve.y0, curve.amplitude, curve.frequency))
        end, matrix, _ = scipy_map.after(law, 1.0, float(push), float(frequency), y0, 1.0)
        np.testing.assert_allclose(end, y0, atol=1e-8)
        values = scipy_map.eigenvalues(matrix)
        np.testing.assert_allclose(np.abs(values), 1.0, atol=1e-8)
        assert abs(np.angle(values[0])) == pytest.approx(float(curve.angle[place]), abs=1e-7)
        turns = abs(np.angle(values[0])) / (2.0 * np.pi)
        assert turns == pytest.approx(float(curve.rotation_number[place]), abs=1e-7)


@pytest.mark.slow
def test_the_curve_ends_at_the_resonances_where_the_pair_meets_and_names_the_others_by_scipy(curve):
    cosines = {"resonance_1_1": 1.0, "resonance_1_4": 0.0, "resonance_1_3": -0.5, "resonance_1_2": -1.0}
    assert [point.kind for point in curve.special_points] == list(cosines)
    # The strongest is found again by itself too: by its cosine, where two multipliers meet.
    again = ij.find_again(curve.special_points[2], van_der_pol(STRENGTH, SKEW))
    for point in (*curve.special_points, again):
        assert ij.is_successful(point.result)
        y0 = np.asarray(point.y0)
        end, matrix, _ = scipy_map.after(law, 1.0, float(point.amplitude), float(point.frequency), y0, 1.0)
        np.testing.assert_allclose(end, y0, atol=1e-8)
        assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-8)
        assert 0.5 * np.trace(matrix) == pytest.approx(cosines[point.kind], abs=1e-8)
    ends = [curve.special_points[0], curve.special_points[-1]]
    low, high = sorted(float(end.frequency) for end in ends)
    assert low <= float(curve.frequency.min()) < float(curve.frequency.max()) <= high


@pytest.mark.slow
def test_the_curve_of_a_weak_oscillator_is_that_of_the_averaged_equations():
    # To first order in e the torus is left at r^2 = 1/2, where (1 - r^2)^2 + s^2 = (F / (2 e r w))^2 and s =
    # (1 - w^2) / (e w), up to |s| = 1/2: there the pair meets at one, and F = e w.
    # Source: Guckenheimer & Holmes 1983, sec. 2.1; Holmes & Rand 1978, Q. Appl. Math. 35:495.
    strength = 0.02
    curve = ij.neimark_sacker_curve(
        van_der_pol(strength),
        amplitude_range=(0.005, 0.06),
        frequency_range=(1.002 * ONE, 1.02 * ONE),
        search=2,
        step=0.1,
    )
    (meets,) = curve.special_points
    assert meets.kind == "resonance_1_1"
    omega = float(meets.frequency) / ONE
    assert (omega**2 - 1.0) / (strength * omega) == pytest.approx(0.5, abs=2.0 * strength)
    assert float(meets.amplitude) == pytest.approx(strength * omega, rel=strength)
    omega = np.asarray(curve.frequency) / ONE
    detuned = (1.0 - omega**2) / (strength * omega)
    averaged = 2.0 * strength * omega * np.sqrt(0.5) * np.hypot(0.5, detuned)
    np.testing.assert_allclose(curve.amplitude, averaged, rtol=0.5 * strength)


def test_what_vanishes_of_a_matrix_is_what_its_eigenvalues_say():
    random = np.random.default_rng(7)
    for size in (2, 3, 5):
        matrix = random.standard_normal((size, size))
        values = np.linalg.eigvals(matrix)
        first, second = np.triu_indices(size, 1)
        expected = {
            "fold": np.prod(values - 1.0),
            "period_doubling": np.prod(values + 1.0),
            "neimark_sacker": np.prod(values[first] * values[second] - 1.0),
        }
        for kind, value in expected.items():
            assert float(criticality(kind, jnp.asarray(matrix))) == pytest.approx(value.real, rel=1e-9)
        angle = 0.7
        turned = np.diag(np.r_[0.0, 0.0, random.uniform(-0.5, 0.5, size - 2)])
        turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        basis = np.linalg.qr(matrix)[0] @ np.diag(np.linspace(1.0, 2.0, size))
        turned = jnp.asarray(basis @ turned @ np.linalg.inv(basis))
        assert abs(float(criticality("neimark_sacker", turned))) < 1e-12
        assert float(pair_cosine(turned)) == pytest.approx(np.cos(angle), rel=1e-10)
    singular = matrix - values[np.argmin(np.abs(values.imag))].real * np.eye(size)
    vector = null_direction(jnp.asarray(singular))
    assert np.abs(singular @ np.asarray(vector)).max() < 1e-10


@pytest.mark.slow
def test_a_branch_says_where_quasi_periodic_motion_begins_and_where_its_events_are():
    response = ij.BranchEvent("response 1.5", lambda orbit: orbit.response - 1.5)
    omega = 1.25

    def branch(model):
        return ij.continue_branch(
            model,
            parameter="amplitude",
            frequency=omega * ONE,
            start=0.3,
            stop=1.5,
            other_periods=(),
            events=(response,),
        )

    model = van_der_pol(STRENGTH)
    followed = branch(model)
    event, torus = (
        next(point for point in followed.special_points if point.kind == kind)
        for kind in ("response 1.5", "neimark_sacker")
    )
    scipys = scipy_map.van_der_pol_law(STRENGTH)
    y0 = np.asarray(torus.y0)
    _, matrix, _ = scipy_map.after(scipys, 1.0, float(torus.amplitude), omega * ONE, y0, 1.0)
    turns = abs(np.angle(np.linalg.eigvals(matrix)[0])) / (2.0 * np.pi)
    assert float(torus.rotation_number) == pytest.approx(turns, abs=1e-7)
    assert np.isnan(float(event.rotation_number))
    assert "quasi-periodic motion begins here" in str(followed)
    assert "response 1.5" in str(followed)
    assert ij.is_successful(event.result)
    y0 = np.asarray(event.y0)
    end, _, path = scipy_map.after(scipys, 1.0, float(event.amplitude), omega * ONE, y0, 1.0)
    np.testing.assert_allclose(end, y0, atol=1e-6)
    assert 0.5 * np.ptp(path[0]) == pytest.approx(1.5, abs=2e-3)

    def force(mass):
        points = branch(model.replace(mass=mass)).special_points
        return next(point for point in points if point.kind == "response 1.5").amplitude

    slope = float(jax.jacfwd(force)(jnp.asarray(1.0)))
    coarse, fine = ((float(force(1.0 + h)) - float(force(1.0 - h))) / (2.0 * h) for h in (2e-3, 1e-3))
    assert slope == pytest.approx((4.0 * fine - coarse) / 3.0, rel=1e-5)


@pytest.mark.parametrize("names", [("fold",), ("a", "a")])
def test_events_need_names_of_their_own(names):
    events = [ij.BranchEvent(name, lambda orbit: orbit.response) for name in names]
    with pytest.raises(ValueError, match="`events` must have names of their own"):
        ij.continue_branch(
            van_der_pol(0.1), parameter="amplitude", frequency=0.2, start=0.1, stop=1.0, events=events
        )
