"""Stroboscopic diagrams, Lyapunov exponents and Poincaré sections against SciPy and the literature."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isojax as ij

TURN = 2.0 * math.pi


def two_wells(damping: float) -> ij.Isolator:
    """x'' + damping x' - x + x^3 = F."""
    return ij.Isolator(1.0, (ij.LinearStiffness(-1.0), ij.CubicStiffness(1.0), ij.LinearDamping(damping)))


def ueda(damping: float) -> ij.Isolator:
    """x'' + damping x' + x^3 = F."""
    return ij.Isolator(1.0, (ij.CubicStiffness(1.0), ij.LinearDamping(damping)))


def test_periods_of_the_duffing_oscillator_of_jordan_and_smith():
    # x'' + 0.3 x' - x + x^3 = g cos(1.2 t): Jordan & Smith 2007, Nonlinear Ordinary Differential Equations.
    forces = [0.20, 0.28, 0.29, 0.37, 0.50, 0.65]
    diagram = ij.bifurcation_diagram(
        two_wells(0.3), forces, frequency=1.2 / TURN, direction="anew", starts=(1.0, 0.0), settle=600
    )
    assert np.asarray(diagram.period).tolist() == [1, 2, 4, 5, 0, 2]
    assert np.asarray(diagram.chaotic).tolist() == [False, False, False, False, True, False]
    assert np.all((np.asarray(diagram.lyapunov) > 0.0) == np.asarray(diagram.chaotic))


def test_samples_of_a_doubled_motion_are_those_of_scipy():
    diagram = ij.bifurcation_diagram(
        two_wells(0.3), [0.28], frequency=1.2 / TURN, starts=(1.0, 0.0), settle=400
    )

    def rates(t, y):
        return [y[1], 0.28 * np.sin(1.2 * t) - 0.3 * y[1] + y[0] - y[0] ** 3]

    times = np.arange(401, 405) * TURN / 1.2
    reference = solve_ivp(
        rates, (0.0, times[-1]), [1.0, 0.0], method="DOP853", t_eval=times, rtol=1e-10, atol=1e-12
    )
    np.testing.assert_allclose(diagram.samples[0, :4], reference.y.T, atol=1e-6)
    assert int(diagram.period[0]) == 2


def test_exponent_of_a_linear_isolator_is_minus_half_its_damping_over_its_mass():
    model = ij.Isolator(2.0, (ij.LinearStiffness(50.0), ij.LinearDamping(0.8)))
    found = ij.largest_lyapunov_exponent(model, ij.Harmonic(3.0, 0.7), settle=50, periods=4000)
    assert float(found.value) == pytest.approx(-0.8 / (2 * 2.0), abs=3e-4)


def variational_exponent(damping: float, force: float, periods: int) -> float:
    """Largest exponent by DOP853 with the variational equation, on its own."""

    def rates(t, y):
        return [
            y[1],
            force * math.sin(t) - damping * y[1] - y[0] ** 3,
            y[3],
            -damping * y[3] - 3 * y[0] ** 2 * y[2],
        ]

    y, total = np.array([2.5, 0.0, 1.0, 0.0]), 0.0
    for period in range(periods):
        y = solve_ivp(rates, (0.0, TURN), y, method="DOP853", rtol=1e-7, atol=1e-9).y[:, -1]
        size = np.hypot(y[2], y[3])
        total += math.log(size) * (period >= 50)
        y[2:] /= size
    return total / (periods - 50) / TURN


@pytest.mark.slow
def test_exponent_of_uedas_attractor_is_the_published_one_and_scipys():
    # Sprott 2003, Chaos and Time-Series Analysis, appendix A: 0.1034 at damping 0.05 and force 7.5.
    found = ij.largest_lyapunov_exponent(
        ueda(0.05), ij.Harmonic(7.5, 1.0 / TURN), start=(2.5, 0.0), periods=4000
    )
    error = float(found.standard_error)
    assert error < 0.004
    assert float(found.value) == pytest.approx(0.1034, abs=3.0 * error)
    assert variational_exponent(0.05, 7.5, 1000) == pytest.approx(float(found.value), abs=0.012)


def test_uedas_second_attractor_is_chaotic_and_its_exponent_agrees_with_scipy():
    diagram = ij.bifurcation_diagram(ueda(0.1), [12.0], frequency=1.0 / TURN, starts=(2.5, 0.0), samples=1000)
    assert bool(diagram.chaotic[0])
    assert int(diagram.period[0]) == 0
    assert float(diagram.lyapunov[0]) == pytest.approx(variational_exponent(0.1, 12.0, 500), abs=0.02)


def test_up_and_down_part_between_the_folds_and_nowhere_else():
    # Folds of the y model at 4.2 Hz: 171.89 N and 178.12 N, by an independent shooting code.
    forces = np.array([165.0, 170.0, 174.0, 177.0, 180.0, 185.0])
    diagram = ij.bifurcation_diagram(ij.paper.y_direction(), forces, 4.2, direction="both")
    assert diagram.runs == ("up", "down")
    apart = np.abs(diagram.displacement[0, :, -1] - diagram.displacement[1, :, -1])
    between = (forces > 171.89) & (forces < 178.12)
    assert np.all(apart[between] > 1e-4)
    assert np.all(apart[~between] < 1e-8)
    assert np.all(np.asarray(diagram.period) == 1)


def test_along_frequency_up_alone_is_the_first_run_of_both():
    bands = np.array([4.0, 4.3, 4.8])
    up = ij.bifurcation_diagram(
        ij.paper.y_direction(), amplitude=150.0, frequencies=bands, settle=60, samples=32
    )
    both = ij.bifurcation_diagram(
        ij.paper.y_direction(), amplitude=150.0, frequencies=bands, direction="both", settle=60, samples=32
    )
    assert up.samples.shape == (3, 32, 2)
    np.testing.assert_allclose(up.samples, both.samples[0], rtol=0, atol=1e-12)


def test_a_motion_that_runs_away_is_nan_and_says_so():
    # Past its stiffness: the softening cubic spring cannot hold this force.
    model = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.CubicStiffness(-1.0), ij.LinearDamping(0.1)))
    diagram = ij.bifurcation_diagram(model, [0.01, 5.0], 0.1, settle=20, samples=32)
    assert np.all(np.isfinite(diagram.samples[0]))
    assert np.all(np.isnan(diagram.samples[1]))
    assert np.isnan(diagram.lyapunov[1])
    assert int(diagram.period[1]) == 0
    assert not bool(diagram.chaotic[1])
    assert np.asarray(diagram.result == ij.RESULTS.not_finite).tolist() == [False, True]


def test_sections_at_any_phase_lie_on_the_motion_of_scipy():
    model, drive = ueda(0.2), ij.Harmonic(0.5, 0.2)
    phases = (0.0, 0.3, math.pi / 2, 4.0)
    section = ij.poincare_section(
        model,
        drive,
        phases=phases,
        start=(0.3, 0.1),
        settle=3,
        periods=2,
        integrator=ij.Integrator(steps_per_period=512),
    )

    def rates(t, y):
        return [y[1], 0.5 * math.sin(TURN * 0.2 * t) - 0.2 * y[1] - y[0] ** 3]

    times = ((3 + np.arange(2)) + np.array(phases)[:, None] / TURN) / 0.2
    reference = solve_ivp(
        rates,
        (0.0, times.max()),
        [0.3, 0.1],
        method="DOP853",
        t_eval=np.sort(times.ravel()),
        rtol=1e-11,
        atol=1e-12,
    )
    order = np.argsort(np.argsort(times.ravel()))
    np.testing.assert_allclose(section.states.reshape(-1, 2), reference.y.T[order], atol=1e-7)


def test_the_portrait_of_a_settled_linear_motion_is_its_ellipse():
    model = ij.Isolator(2.0, (ij.LinearStiffness(50.0), ij.LinearDamping(0.8)))
    portrait = ij.phase_portrait(model, ij.Harmonic(3.0, 0.7), settle=150, periods=2)
    omega = TURN * 0.7
    size = 3.0 / math.hypot(50.0 - 2.0 * omega**2, 0.8 * omega)
    radius = np.hypot(portrait.displacement, portrait.velocity / omega)
    np.testing.assert_allclose(radius, size, rtol=1e-6)
    assert float(portrait.time[-1]) == pytest.approx(2 / 0.7)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"amplitudes": [1.0]}, "must be given"),
        ({"amplitudes": [1.0], "frequencies": [1.0]}, "must be given"),
        ({"amplitudes": [2.0, 1.0], "frequency": 1.0}, "must ascend"),
        ({"amplitudes": [1.0], "frequency": -1.0}, "one positive number"),
        ({"amplitudes": [1.0], "frequency": 1.0, "direction": "sideways"}, "one of"),
        ({"amplitudes": [1.0], "frequency": 1.0, "starts": (1.0,)}, "2 numbers a state"),
        ({"amplitudes": [1.0], "frequency": 1.0, "samples": 8}, "at most half"),
        ({"amplitudes": [1.0], "frequency": 1.0, "settle": 0}, "positive count"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ij.bifurcation_diagram(ueda(0.1), **arguments)


def test_bad_phases_and_short_means_are_refused():
    with pytest.raises(ValueError, match="must lie in"):
        ij.poincare_section(ueda(0.1), ij.Harmonic(1.0, 1.0), phases=(7.0,))
    with pytest.raises(ValueError, match="at least 20"):
        ij.largest_lyapunov_exponent(ueda(0.1), ij.Harmonic(1.0, 1.0), periods=3)


def test_many_starts_are_as_each_alone():
    model, starts = two_wells(0.3), jnp.array([[1.0, 0.0], [-1.0, 0.0], [0.2, 0.5]])
    together = ij.bifurcation_diagram(
        model, [0.1, 0.2], 1.2 / TURN, direction="anew", starts=starts, settle=40, samples=32
    )
    alone = ij.bifurcation_diagram(
        model, [0.1, 0.2], 1.2 / TURN, direction="anew", starts=starts[1], settle=40, samples=32
    )
    assert together.samples.shape == (3, 2, 32, 2)
    np.testing.assert_allclose(together.samples[1], alone.samples, atol=1e-12)


def test_a_transient_of_light_damping_is_no_torus():
    # Linear: after n periods the free part is exp(-n c T / 2 m) of its size, whatever the drive.
    model = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(4e-4)))
    diagram = ij.bifurcation_diagram(model, [1.0], frequency=0.1, settle=100)
    assert int(diagram.period[0]) == 0
    assert bool(diagram.settling[0])
    assert not bool(diagram.quasi_periodic[0])
    assert np.isnan(float(diagram.rotation_number[0]))
    assert "1 not settled yet" in str(diagram)


def test_quasi_periodic_motion_turns_as_often_as_the_two_frequencies_say():
    # x'' - e (1 - x^2) x' + x = F sin(w t), far from its lock: the free motion has the frequency 1 - e^2/16
    # of van der Pol's equation (Nayfeh & Mook 1979, sec. 3.3.4), little changed by a weak drive.
    strength, omega = 0.1, 1.37
    spring = (ij.LinearDamping(-strength), ij.PositionDamping(strength), ij.LinearStiffness(1.0))
    diagram = ij.bifurcation_diagram(
        ij.Isolator(1.0, spring), [0.02], frequency=omega / TURN, starts=(2.0, 0.0), settle=100, samples=512
    )
    assert bool(diagram.quasi_periodic[0])
    turns = (1.0 - strength**2 / 16.0) / omega
    assert float(diagram.rotation_number[0]) == pytest.approx(1.0 - turns, abs=3e-3)
    assert "1 quasi-periodic" in str(diagram)
