"""Branches beside the one that is followed, against closed forms, perturbation theory and SciPy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import isojax as ij
from isojax.stability.branch._other_branches import Curve
from isojax.stability.orbit import ShootingMethod

TURN = 2.0 * math.pi


def after(rates, state, seconds: float) -> np.ndarray:
    """The state some time later, by DOP853."""
    run = solve_ivp(rates, (0.0, seconds), np.asarray(state), method="DOP853", rtol=1e-11, atol=1e-13)
    return run.y[:, -1]


def oscillator(cubic: float, *damping: float) -> ij.Isolator:
    """Unit mass and stiffness; damping in v, |v| v and v^3. One structure, so that it is compiled once."""
    linear, quadratic, third = damping
    laws = (
        ij.elements.LinearDamping(linear),
        ij.elements.AbsQuadraticDamping(quadratic),
        ij.elements.CubicDamping(third),
    )
    springs = (ij.elements.LinearStiffness(1.0), ij.elements.CubicStiffness(cubic))
    return ij.Isolator(1.0, (*springs, *laws))


@pytest.fixture(scope="module")
def beside_isola():
    """A damper that rises, falls and rises again: 0.105 N holds three amplitudes at resonance."""
    return ij.frequency_response(oscillator(0.0, 0.25, -0.2, 0.045), 0.105, (0.12, 0.2))


def test_an_isola_is_found_unasked_where_the_balance_of_one_harmonic_has_it(beside_isola):
    isola = beside_isola.others[0]
    assert len(beside_isola.others) == 1
    assert beside_isola.branch.searched.periods == (1, 2, 3)
    assert bool(isola.branch.closed)
    assert isola.branch.connection == "none"

    # F^2 = a^2 (1 - w^2)^2 + D(w a)^2: at w near 1 the isola lies between the two larger roots of D = F.
    def left(speed):
        return 0.25 * speed - 0.2 * 8.0 / (3.0 * math.pi) * speed**2 + 0.75 * 0.045 * speed**3 - 0.105

    small, inner, outer = (brentq(left, *ends) for ends in ((0.0, 1.09), (1.09, 2.26), (2.26, 4.0)))
    sizes = np.asarray(isola.amplitude)
    assert float(np.max(np.asarray(beside_isola.amplitude))) == pytest.approx(small, rel=0.02)
    assert sizes.max() == pytest.approx(outer, rel=0.02)
    assert sizes.min() == pytest.approx(inner, rel=0.02)
    assert [point.kind for point in isola.special_points] == ["fold", "fold"]


def test_an_isola_is_found_beside_an_internal_state_that_coarse_steps_cannot_follow(beside_isola):
    beside = oscillator(0.0, 0.25, -0.2, 0.045).with_elements(ij.elements.MaxwellBranch(1e-3, 0.02))
    response = ij.frequency_response(beside, 0.105, (0.14, 0.18), periods=(1,))
    assert [bool(one.branch.closed) for one in response.others] == [True]
    # Beside the damper of 0.25 N s/m the branch is one of 2e-5 N s/m more.
    ours, plain = (np.asarray(one.others[0].amplitude).max() for one in (response, beside_isola))
    assert ours == pytest.approx(plain, rel=5e-3)


def test_starts_that_lead_nowhere_are_counted(beside_isola):
    searched = beside_isola.branch.searched
    assert 0 < searched.unsettled < 0.1 * searched.starts
    assert f"{searched.unsettled} of {searched.starts} starts did not settle" in " ".join(
        repr(beside_isola).split()
    )


def test_a_small_orbit_is_not_taken_for_one_of_a_branch_of_large_ones():
    # A straight branch along the displacement, and an orbit of a hundredth of its size as far away.
    shares = np.linspace(0.0, 1.0, 51)
    unknowns = np.stack([0.0 * shares, 0.0 * shares, shares], axis=1)
    method = ShootingMethod(ij.Integrator(), 1, False)
    curve = Curve(method, np.ones(2), unknowns, np.tile([0.0, 0.0, 1.0], (51, 1)), 0)
    # What is smaller than a fifth of the branch counts as a fifth: its points are no closer than that allows.
    assert curve.distance(0.513, np.array([0.006, 0.008])) == pytest.approx(0.05)
    assert curve.distance(0.513, np.array([3.0, 4.0])) == pytest.approx(1.0)


def test_an_orbit_far_off_a_sharp_resonance_lies_on_the_branch_that_holds_it():
    """The receptance of a linear isolator with Q = 200, its points as far apart as those of a branch."""

    def unknown(share):
        omega = 0.314 + 2.2 * share
        motion = 0.005 / (1.0 - omega**2 + 0.005j * omega)
        return np.stack([motion.real, -omega * motion.imag, share], axis=-1)

    fine = np.linspace(0.0, 1.0, 2_000_001)
    along = unknown(fine)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(along, axis=0), axis=1))])
    shares = np.interp(np.arange(0.0, arc[-1], 0.02), arc, fine)
    tangents = (unknown(shares + 1e-7) - unknown(shares - 1e-7)) / 2e-7
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    method = ShootingMethod(ij.Integrator(), 1, False)
    curve = Curve(method, np.ones(2), unknown(shares), tangents, 0)
    between = np.random.default_rng(0).uniform(0.0, shares[-1], 300)
    assert max(curve.distance(share, unknown(share)[:2]) for share in between) < 1e-3


def test_the_motions_of_an_isola_return_under_scipy(beside_isola):
    points = beside_isola.others[0].branch.points
    for place in np.linspace(0, points.frequency.size - 1, 4).astype(int):
        omega, state = TURN * float(points.frequency[place]), np.asarray(points.y0[place])

        def rates(t, y, omega=omega):
            v = y[1]
            return [v, 0.105 * math.sin(omega * t) - y[0] - 0.25 * v + 0.2 * abs(v) * v - 0.045 * v**3]

        np.testing.assert_allclose(after(rates, state, TURN / omega), state, atol=2e-5)


def test_print_and_picture_show_the_isola(beside_isola):
    assert "beside it detached, a closed curve: frequency 0.157" in repr(beside_isola)
    axes = ij.plot.frequency_response(beside_isola).axes[0]
    assert "detached" in [text.get_text() for text in axes.get_legend().get_texts()]
    drawn = max(np.nanmax(line.get_ydata()) for line in axes.lines if line.get_label() == "detached")
    assert drawn == pytest.approx(1e3 * np.asarray(beside_isola.others[0].amplitude).max())


def test_a_subharmonic_of_order_one_third_is_found_where_perturbation_has_it():
    cubic, half_damping, force = 0.01, 0.002, 8.0
    duffing = oscillator(cubic, 2.0 * half_damping, 0.0, 0.0)
    response = ij.frequency_response(duffing, force, (0.49, 0.51), periods=(3,))
    curves = [one for one in response.others if one.branch.periods == 3]
    # Of the two, stable and unstable, each passes through this band.
    assert len(curves) == 2

    def squares(omega):
        """Squared amplitudes a^2 of the subharmonic, by Nayfeh & Mook's first-order expansion."""
        pushed, detuning = force / (2.0 * (1.0 - omega**2)), omega - 3.0
        p = 8.0 * detuning / (9.0 * cubic) - 6.0 * pushed**2
        q = (64.0 / (81.0 * cubic**2)) * (9.0 * half_damping**2 + (detuning - 9.0 * cubic * pushed**2) ** 2)
        return p - math.sqrt(p * p - q), p + math.sqrt(p * p - q)

    found = []
    for curve in curves:
        points = curve.branch.points
        place = int(np.argmin(np.abs(np.asarray(points.frequency) - 0.5)))
        own = TURN * float(points.frequency[place])

        def rates(t, y, own=own):
            return [
                y[1],
                force * math.sin(own * t) - y[0] - cubic * y[0] ** 3 - 2.0 * half_damping * y[1],
            ]

        times = 3.0 * TURN / own * np.arange(384) / 384
        run = solve_ivp(rates, (0.0, 3.0 * TURN / own), np.asarray(points.y0[place]), method="DOP853",
                        t_eval=[*times, 3.0 * TURN / own], rtol=1e-11, atol=1e-13)  # fmt: skip
        size = np.abs(run.y[0]).max()
        np.testing.assert_allclose(run.y[:, -1], run.y[:, 0], atol=1e-5 * size)
        assert np.max(np.abs(run.y[:, 128] - run.y[:, 0])) > 0.1 * size
        amplitude = 2.0 * abs(np.mean(run.y[0, :-1] * np.exp(-1j * own / 3.0 * times)))
        found.append([amplitude / math.sqrt(square) - 1.0 for square in squares(own)])
    # One curve has the smaller amplitude of the expansion, the other the larger.
    assert np.abs(found).argmin(axis=1).tolist() in ([0, 1], [1, 0])
    np.testing.assert_array_less(np.abs(found).min(axis=1), 0.02)


def test_periods_that_are_no_counts_are_refused():
    model = ij.Isolator(1.0, (ij.elements.LinearStiffness(1.0), ij.elements.LinearDamping(0.1)))
    with pytest.raises(ValueError, match="`periods` must hold positive counts"):
        ij.frequency_response(model, 1.0, (0.1, 0.2), periods=(0,))
    with pytest.raises(ValueError, match="`other_periods` must hold positive counts"):
        ij.continue_branch(
            model, parameter="amplitude", frequency=1.0, start=1.0, stop=2.0, other_periods=(-1,)
        )
