"""Errors of a fit at branches and special points, against how the solutions of two oscillators scale."""

import dataclasses
import functools
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.stats import norm

import isojax as ij
from isojax._implicit import frozen
from isojax.models import coefficient_errors
from isojax.stability.branch._possible_points import find_possible_points

TURN = 2.0 * np.pi
HALF = norm.ppf(0.975)
SHARE = 0.005
"""Relative standard error of the only coefficient that is uncertain."""

SUCCESS = ij.RESULTS.promote(diffrax.RESULTS.successful)


class Fitted(NamedTuple):
    """What a band asks of a fit."""

    model: ij.Isolator
    free: tuple[str, ...]
    covariance: np.ndarray
    result: ij.RESULTS


def uncertain(model, name):
    return Fitted(model, (name,), np.array([[(SHARE * float(model[name])) ** 2]]), SUCCESS)


LINEAR = ij.Isolator(2.0, (ij.LinearStiffness(50.0), ij.LinearDamping(0.8)))
DUFFING = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(0.2), ij.CubicStiffness(1.0)))
STIFF = uncertain(DUFFING, "cubic_stiffness.coefficient")
"""Motion and force of x'' + c x' + x + k x^3 = F sin(w t) go with k^(-1/2) at the same frequency: so the
standard error of every amplitude is half of SHARE, and that of a frequency at which something happens is
none where the force is free."""


COARSE = ij.Integrator(steps_per_period=64)
"""Steps with which forces of orbits without kinks are good to 1e-5."""


@pytest.fixture(scope="module")
def branch():
    with pytest.MonkeyPatch.context() as few:
        # Its bands are straight, so that draws say little; a thousand of them take seconds a point.
        few.setattr("isojax.models._band._DRAWS", 100)
        return ij.continue_branch(
            DUFFING,
            parameter="amplitude",
            frequency=1.6 / TURN,
            start=0.05,
            stop=2.0,
            integrator=COARSE,
            other_periods=(),
            fit=STIFF,
        )


@pytest.mark.slow
def test_folds_of_a_branch_have_the_error_of_their_scaling(branch):
    assert [point.kind for point in branch.special_points] == ["fold", "fold"]
    for point in branch.special_points:
        wanted = 0.5 * SHARE * float(point.amplitude)
        assert float(point.band.standard_error["amplitude"]) == pytest.approx(wanted, rel=1e-7)
        assert float(point.band.standard_error["frequency"]) == 0.0
        assert float(point.band.upper["value"] - point.value) == pytest.approx(HALF * wanted, rel=1e-7)
        assert " ± " in str(point)
        assert " N, " in str(point)
    moved = dataclasses.replace(DUFFING, excitation="base_acceleration")
    point = dataclasses.replace(point, family=dataclasses.replace(point.family, model=moved))
    assert " m/s², " in str(point)


@pytest.mark.slow
def test_the_ends_of_a_branch_band_lie_on_the_scaled_branch(branch):
    known = np.stack([np.asarray(branch.points.value), np.asarray(branch.points.response)])
    shift, scale = 0.5 * SHARE * HALF, np.ptp(known, axis=1)[:, None]
    places = np.arange(known.shape[1])
    fine = CubicSpline(places, known / scale, axis=1)(np.arange(0.0, places[-1], 0.02))
    along, here = np.gradient(known / scale, axis=1), known / scale
    along, here = along / np.hypot(*along), here / np.hypot(*here)
    # Where the branch runs towards the origin, scaling shifts it along itself.
    across = np.abs(along[0] * here[1] - along[1] * here[0]) > 0.6
    sides = []
    for band in (branch.band.lower, branch.band.upper):
        ends = np.stack([np.asarray(band["value"]), np.asarray(band["response"])]) / scale
        scales = np.linspace(1.0 - 2.0 * shift, 1.0 + 2.0 * shift, 401)
        best = []
        for place in places[across][::12]:
            near = fine[:, max(0, 50 * place - 250) : 50 * place + 250]
            away = scales[:, None, None] * near[None] - ends[:, place][None, :, None]
            best.append(scales[np.argmin(np.min(np.sum(away**2, axis=1), axis=1))] - 1.0)
        sides.append(np.array(best))
    assert len(sides[0]) > 5
    # Their mean is free of the second order, by which the branch bends within the band.
    np.testing.assert_allclose(np.mean(np.abs(sides), axis=0), shift, rtol=0.05)
    assert np.all(sides[0] * sides[1] < 0.0)
    ax = ij.plot.branch(branch).axes[0]
    assert ax.patches
    assert len(ax.containers) == 2


@pytest.mark.slow
def test_cusps_have_the_error_of_their_scaling(branch):
    window = {"amplitude_range": (0.05, 1.0), "frequency_range": (1.1 / TURN, 1.7 / TURN)}
    folds = ij.fold_curve(DUFFING, **window, start=branch.special_points[0], step=0.1, fit=STIFF)
    (cusp,) = folds.cusps
    wanted = 0.5 * SHARE * float(cusp.amplitude)
    assert float(cusp.band.standard_error["amplitude"]) == pytest.approx(wanted, rel=1e-6)
    assert abs(float(cusp.band.standard_error["frequency"])) < 1e-6 * SHARE * float(cusp.frequency)
    assert " ± " in str(cusp)
    assert not any(bool(one) for one in cusp.band.curved.values())
    np.testing.assert_allclose(float(cusp.band.upper["amplitude"] - cusp.amplitude), HALF * wanted, rtol=1e-6)
    assert ij.plot.fold_curve(folds).axes[0].containers


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.05, 0.1])
def test_the_one_cusp_is_found_whatever_the_step(branch, step):
    window = {"amplitude_range": (0.05, 1.0), "frequency_range": (1.1 / TURN, 1.7 / TURN)}
    folds = ij.fold_curve(DUFFING, **window, start=branch.special_points[0], step=step)
    (cusp,) = folds.special_points
    # Of one harmonic: w^2 - 1 = sqrt(3) c w and F^2 = 32 (w^2 - 1)^3 / 81.
    rate = 0.1 * np.sqrt(3.0) + np.sqrt(0.03 + 1.0)
    assert TURN * float(cusp.frequency) == pytest.approx(rate, rel=2e-3)
    assert float(cusp.amplitude) == pytest.approx(np.sqrt(32.0 * (rate**2 - 1.0) ** 3 / 81.0), rel=0.01)
    # And where the curve turns back in both.
    assert float(cusp.amplitude) <= float(np.min(folds.amplitude)) * (1.0 + 1e-9)
    assert float(cusp.frequency) <= float(np.min(folds.frequency)) * (1.0 + 1e-9)


def test_an_event_of_a_linear_branch_has_the_error_of_its_closed_form():
    event = ij.BranchEvent("5 cm", lambda orbit: orbit.response - 0.05)
    branch = ij.continue_branch(
        LINEAR,
        parameter="amplitude",
        frequency=0.7,
        start=0.5,
        stop=3.0,
        other_periods=(),
        events=(event,),
        fit=uncertain(LINEAR, "linear_stiffness.coefficient"),
    )
    omega = TURN * 0.7
    spring, damper = 50.0 - 2.0 * omega**2, 0.8 * omega
    (point,) = branch.special_points
    force = 0.05 * np.hypot(spring, damper)
    assert float(point.value) == pytest.approx(force, rel=1e-6)
    wanted = 0.05**2 * abs(spring) / force * SHARE * 50.0
    assert float(point.band.standard_error["value"]) == pytest.approx(wanted, rel=1e-6)
    # The response at a point moves across the line X = F / |Z|: all of the error is in its slope.
    upper, lower = (
        np.asarray(end["response"]) / np.asarray(end["value"])
        for end in (branch.band.upper, branch.band.lower)
    )
    shift = HALF * SHARE * 50.0 * abs(spring) / (spring**2 + damper**2) ** 1.5
    np.testing.assert_allclose(0.5 * np.abs(upper - lower), shift, rtol=0.02)


def test_a_branch_asks_for_the_model_of_the_fit():
    stiffer = DUFFING.replace(cubic_stiffness__coefficient=2.0)
    with pytest.raises(ValueError, match=r"differs in cubic_stiffness\.coefficient"):
        ij.continue_branch(stiffer, parameter="amplitude", frequency=0.2, start=0.1, stop=1.0, fit=STIFF)


OMEGA = 1.1
TURNING = (OMEGA**2 - 1.0) / (np.sqrt(3.0) * OMEGA)
"""Damping from which on x'' + c x' + x + x^3 = F sin(OMEGA t) does not fold along F, by one harmonic: the
square of the force, `4 y / 3 ((y - d)^2 + (c OMEGA)^2)` with y = 3 a^2 / 4 and d = OMEGA^2 - 1, rises
throughout."""


def lightly_damped(share, error=0.03):
    """A hardening spring with so much of the damping from which on it does not fold, and its fit."""
    model = DUFFING.replace(linear_damping__coefficient=share * TURNING)
    covariance = np.array([[(error * TURNING) ** 2]])
    return Fitted(model, ("linear_damping.coefficient",), covariance, SUCCESS)


def force_at_folds(damping):
    """Of the one-harmonic solution, in the order of the branch."""
    return force_at_folds_of(OMEGA, damping)


def force_at_folds_of(omega, damping):
    d, loss = omega**2 - 1.0, (damping * omega) ** 2
    y = (2.0 * d + np.array([[-1.0], [1.0]]) * np.sqrt(d**2 - 3.0 * loss)) / 3.0
    return np.sqrt(4.0 * y / 3.0 * ((y - d) ** 2 + loss))


@functools.cache
def along_force(share):
    fit = lightly_damped(share)
    return ij.continue_branch(
        fit.model,
        parameter="amplitude",
        frequency=OMEGA / TURN,
        start=0.01,
        stop=0.2,
        integrator=COARSE,
        other_periods=(),
        step=0.008,  # as many points as the branch above has room for, so that nothing is compiled anew
        fit=fit,
    )


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_fold_beside_its_cusp_has_the_probability_and_the_force_of_the_closed_form(share):
    branch = along_force(share)
    own, points = branch.special_points, (*branch.special_points, *branch.possible_points)
    assert len(own) == (2 if share < 1.0 else 0)
    assert [point.kind for point in points] == ["fold", "fold"]
    z = (1.0 - share) / 0.03
    folding = share * TURNING + 0.03 * TURNING * norm.ppf(np.linspace(0.0, norm.cdf(z), 4003)[1:-1])
    for point, forces in zip(points, force_at_folds(folding), strict=True):
        # One harmonic puts the cusp within a thousandth, 0.03 standard errors.
        assert point.probability == pytest.approx(norm.cdf(z), abs=4.0 * point.probability_error + 0.012)
        ends = np.array([float(end["amplitude"]) for end in (point.band.lower, point.band.upper)])
        np.testing.assert_allclose(ends, np.quantile(forces, [0.025, 0.975]), rtol=5e-3)
        assert bool(point.band.curved["amplitude"])
    words = str(branch)
    assert ("no bifurcation of its own" in words) == (share > 1.0)
    assert ("possible fold: probability 0.2" in words) == (share > 1.0)
    assert (" at 0.17507 Hz; where there is one, 95% of its amplitude lies in" in words) == (share > 1.0)
    assert ("exists with probability 0.7" in words) == (share < 1.0)


@pytest.mark.slow
def test_a_fold_is_found_again_on_its_own_branch_or_nowhere():
    """Newton's method alone went to folds of other motions, or missed one whose pair had moved apart."""
    first, second = along_force(0.98).special_points
    for share in (0.7, 0.95):
        found = [float(ij.find_again(point, _damped(share)).amplitude) for point in (first, second)]
        np.testing.assert_allclose(found, force_at_folds(share * TURNING)[:, 0], rtol=5e-3)
    for share in (1.01, 1.3):
        assert np.isnan(float(ij.find_again(first, _damped(share)).amplitude))


@pytest.mark.slow
def test_an_orbit_is_found_again_on_its_own_piece_of_the_branch_or_nowhere(branch):
    """Newton's method alone went past the fold to the motion of twice the size."""
    fold, rest = float(branch.special_points[0].amplitude), float(branch.special_points[1].amplitude)
    # By one harmonic the lower fold force is within a few parts in a thousand.
    lower, upper = np.sort(force_at_folds_of(1.6, 0.2).ravel())
    assert (rest, fold) == pytest.approx((lower, upper), rel=0.02)
    force = 0.99 * fold
    orbit = ij.find_periodic_orbit(DUFFING, ij.Harmonic(force, 1.6 / TURN))
    limit = (fold / force) ** 2  # the fold force goes with k^(-1/2)
    springs = limit * np.array([0.9, 0.97, 0.998, 1.002, 1.03, 1.1])

    def again(spring):
        return ij.find_again(orbit, DUFFING.replace(cubic_stiffness__coefficient=spring))

    orbits = jax.vmap(again)(jnp.asarray(springs))
    found = np.asarray(jax.vmap(lambda one: one.amplitude)(orbits))
    assert np.isfinite(found).tolist() == [True] * 3 + [False] * 3
    # By one harmonic k F^2 = 4 y / 3 ((y - d)^2 + (c w)^2) with y = 3 k a^2 / 4, and the least y is of the
    # piece. Beside the fold it moves with the root of the distance, so that one harmonic is too coarse there.
    d, loss = 1.6**2 - 1.0, 0.32**2
    for spring, size in zip(springs[:2], found, strict=False):
        roots = np.roots([1.0, -2.0 * d, d**2 + loss, -0.75 * spring * force**2])
        least = np.min(roots.real[np.abs(roots.imag) < 1e-9])
        assert size == pytest.approx(np.sqrt(4.0 * least / 3.0 / spring), rel=0.02)
    gone = jax.tree.map(lambda numbers: numbers[3], orbits)
    assert gone.result == ij.RESULTS.gone
    assert np.isnan(np.asarray(gone.floquet.multipliers)).all()
    assert "turns back at a fold" in " ".join(str(gone).split())


@pytest.mark.slow
def test_an_unstable_orbit_under_another_drive_is_the_unstable_one_or_gone(branch):
    """In shares of the drive it went to the larger motion."""
    values, states = np.asarray(branch.points.value), np.asarray(branch.points.y0)
    fold, rest = (float(point.amplitude) for point in branch.special_points)
    falling = np.flatnonzero(np.diff(values) < 0.0)
    place = falling[falling.size // 2]
    drive = ij.Harmonic(values[place], 1.6 / TURN)
    orbit = ij.find_periodic_orbit(DUFFING, drive, start=states[place].tolist())
    assert float(orbit.floquet.spectral_radius) > 1.0
    forces = np.array([1.15 * rest, 0.5 * (rest + fold), 0.9 * fold, 1.3 * fold, 3.0 * fold])
    found = np.asarray(
        jax.vmap(lambda force: ij.find_again(orbit, DUFFING, amplitude=force).amplitude)(forces)
    )
    d, loss = 1.6**2 - 1.0, 0.32**2
    for force, size in zip(forces[:3], found, strict=False):
        _, middle, _ = np.sort(np.roots([1.0, -2.0 * d, d**2 + loss, -0.75 * force**2]).real)
        assert size == pytest.approx(np.sqrt(4.0 * middle / 3.0), rel=0.03)
    assert np.isnan(found[3:]).all()


def test_an_orbit_is_found_again_far_away_where_there_is_but_one():
    """The receptance of a linear isolator, from and to its resonance and under drives of other sizes."""
    known = ij.find_periodic_orbit(LINEAR, ij.Harmonic(1.0, 5.0 / TURN))
    for spring, force, rate in ((50.0, 1.0, 5.0), (80.0, 0.01, 5.0), (50.0, 1.0, 8.0), (45.0, -30.0, 4.0)):
        model = LINEAR.replace(linear_stiffness__coefficient=spring)
        found = ij.find_again(known, model, amplitude=force, frequency=rate / TURN)
        wanted = abs(force) / abs(spring - 2.0 * rate**2 + 0.8j * rate)
        assert float(found.amplitude) == pytest.approx(wanted, rel=1e-6)


def _damped(share):
    return DUFFING.replace(linear_damping__coefficient=share * TURNING)


@pytest.mark.slow
def test_a_fold_that_no_model_within_the_errors_has_is_not_possible():
    branch = along_force(1.2)
    assert not branch.special_points
    assert not branch.possible_points
    assert "; no bifurcation" in str(branch)
    assert "of its own" not in str(branch)


@pytest.mark.slow
def test_a_search_that_fails_does_not_read_as_no_bifurcation():
    known, fit = along_force(1.02), lightly_damped(1.02)
    errors = coefficient_errors(fit)
    # The branch of every other model is that of the fitted one, so that none of them has the folds.
    points, undecided = find_possible_points(frozen(known), errors, lambda _: known)
    assert not points
    assert undecided > 0
    words = str(dataclasses.replace(known, possible_points=points, undecided=undecided))
    assert "no bifurcation of its own" in words
    assert "whether isolators within the errors have bifurcations was not found out at" in words
