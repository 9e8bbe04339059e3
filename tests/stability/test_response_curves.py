"""Backbone, frequency response and transmissibility against closed forms and SciPy."""

import dataclasses
import math
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from scipy.stats import norm

import isojax as ij
from isojax.stability import find_periodic_orbit

TURN = 2.0 * math.pi
LINEAR = ij.Isolator(2.0, (ij.LinearStiffness(50.0), ij.LinearDamping(0.8)))
DUFFING = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.CubicStiffness(0.7), ij.LinearDamping(0.05)))
SIZES = np.array([0.01, 0.5, 1.0, 2.0, 5.0])


def linear_ratio(frequency: np.ndarray) -> np.ndarray:
    """(k + i omega c) / (k - m omega^2 + i omega c) of `LINEAR`."""
    omega = TURN * frequency
    return (50.0 + 0.8j * omega) / (50.0 - 2.0 * omega**2 + 0.8j * omega)


def spring_y(x):
    """Spring of the paper's y direction."""
    return 1.0805e6 * x - 6.974e8 * np.abs(x) * x + 2.51667e11 * x**3


def damper_y(v):
    """Damper of the paper's y direction."""
    return 1.027e4 * v - 3.6880e5 * np.abs(v) * v + 5.3753e6 * v**3


def free_frequency(pull, mass: float, amplitude: float, guess: float) -> float:
    """Frequency of free vibration by DOP853: from one largest displacement to the next."""

    def stop(t, y):
        return y[1]

    stop.direction = -1.0
    run = solve_ivp(
        lambda t, y: [y[1], -pull(y[0]) / mass], (0.0, 2.5 / guess), [amplitude, -1e-30], method="DOP853",
        events=stop, rtol=1e-12, atol=1e-16, max_step=0.01 / guess,
    )  # fmt: skip
    return 1.0 / run.t_events[0][run.t_events[0] > 0.4 / guess][0]


def test_free_vibration_of_the_duffing_oscillator_is_the_elliptic_integral():
    natural = ij.backbone_curve(DUFFING, SIZES).natural_frequency
    stiff = 1.0 + 0.7 * SIZES**2
    exact = math.pi * np.sqrt(stiff) / (2.0 * ellipk(0.7 * SIZES**2 / (2.0 * stiff))) / TURN
    np.testing.assert_allclose(natural, exact, rtol=1e-12)


def test_derivative_of_free_vibration_is_that_of_the_elliptic_integral():
    slope = jax.jacfwd(lambda model: ij.backbone_curve(model, SIZES).natural_frequency)(DUFFING)

    def exact(cubic):
        stiff = 1.0 + cubic * SIZES**2
        return math.pi * np.sqrt(stiff) / (2.0 * ellipk(cubic * SIZES**2 / (2.0 * stiff))) / TURN

    h = 1e-4
    numeric = (8 * (exact(0.7 + h) - exact(0.7 - h)) - exact(0.7 + 2 * h) + exact(0.7 - 2 * h)) / (12 * h)
    np.testing.assert_allclose(slope.elements[1].coefficient, numeric, rtol=1e-8, atol=1e-12)


@pytest.mark.slow
def test_free_vibration_with_kinks_and_without_symmetry_is_that_of_scipy():
    sizes = [3e-4, 1.2e-3]
    kinked = ij.backbone_curve(ij.paper.y_direction(), sizes).natural_frequency
    for size, found in zip(sizes, kinked, strict=True):
        assert float(found) == pytest.approx(free_frequency(spring_y, 800.0, size, float(found)), rel=1e-9)
    lopsided = ij.Isolator(2.0, (ij.LinearStiffness(50.0), ij.QuadraticStiffness(20.0)))
    found = float(ij.backbone_curve(lopsided, [1.0]).natural_frequency[0])
    reference = free_frequency(lambda x: 50.0 * x + 20.0 * x * x, 2.0, 1.0, found)
    assert found == pytest.approx(reference, rel=1e-9)


def test_free_vibration_is_nan_where_the_spring_does_not_hold():
    softening = DUFFING.replace(cubic_stiffness__coefficient=-1.0)
    natural = ij.backbone_curve(softening, [0.5, 0.9, 0.99, 1.01, 3.0]).natural_frequency
    assert np.isfinite(natural).tolist() == [True, True, True, False, False]


def test_phase_resonance_of_a_linear_isolator_is_at_its_natural_frequency():
    curve = ij.backbone_curve(LINEAR, [0.01, 0.1, 1.0])
    np.testing.assert_allclose(TURN * curve.frequency, 5.0, rtol=1e-7)
    np.testing.assert_allclose(curve.force, 0.8 * 5.0 * curve.displacements, rtol=1e-6)


def test_phase_resonance_with_relaxation_is_the_closed_form():
    # K p, p' = v - p / tau adds K (w tau)^2 / (1 + (w tau)^2) to the stiffness, K tau / (1 + (w tau)^2) to
    # the damping; the resonance is a quadratic in w^2.
    tau, branch, stiffness, damping = 0.3, 20.0, 50.0, 0.8
    model = ij.Isolator(
        2.0, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping), ij.MaxwellBranch(branch, tau))
    )
    curve = ij.backbone_curve(model, [0.2])
    square = np.roots([-2.0 * tau**2, (stiffness + branch) * tau**2 - 2.0, stiffness]).max()
    omega = math.sqrt(square)
    assert TURN * float(curve.frequency[0]) == pytest.approx(omega, rel=1e-6)
    force = 0.2 * omega * (damping + branch * tau / (1.0 + square * tau**2))
    assert float(curve.force[0]) == pytest.approx(force, rel=1e-6)


def test_phase_resonance_beside_a_quick_relaxation_is_that_with_its_damper():
    # The branch tends to a damper of k tau where it relaxes within a step of 256 a period.
    laws, sizes = (ij.LinearStiffness(1e6), ij.LinearDamping(4e3)), np.array([1e-4, 1e-3])
    relaxation, damper = 1e-4, 500.0
    quick = ij.Isolator(800.0, (*laws, ij.elements.MaxwellBranch(damper / relaxation, relaxation)))
    found = ij.backbone_curve(quick, sizes)
    omega = math.sqrt(1e6 / 800.0)
    np.testing.assert_allclose(found.force, (4e3 + damper) * omega * sizes, rtol=2e-4)
    np.testing.assert_allclose(found.frequency, omega / (2.0 * math.pi), rtol=1e-4)
    stiff = ij.Isolator(800.0, (*laws, ij.elements.MaxwellBranch(damper / 1e-7, 1e-7)))
    beyond = ij.backbone_curve(stiff, sizes)
    assert np.all(np.isnan(beyond.force))
    assert bool(np.all(beyond.result == ij.RESULTS.stiff))
    with pytest.raises(ValueError, match="no state that follows the motion within less than a step"):
        ij.fold_curve(stiff, amplitude_range=(1.0, 100.0), frequency_range=(4.0, 8.0))


def test_transmissibility_beside_a_quick_relaxation_is_the_textbooks_with_its_damper():
    relaxation = 5e-4
    laws = ij.LinearStiffness(1e6), ij.LinearDamping(4e3), ij.elements.MaxwellBranch(1e6, relaxation)
    frequencies = np.array([3.0, 5.5, 9.0])
    ratio = ij.transmissibility(ij.Isolator(800.0, laws), 10.0, frequencies).ratio
    omega = 2.0 * math.pi * frequencies
    passed = 1e6 + 1j * omega * (4e3 + 1e6 * relaxation / (1.0 + 1j * omega * relaxation))
    np.testing.assert_allclose(ratio, passed / (passed - 800.0 * omega**2), rtol=1e-6)


def test_phase_resonance_is_an_orbit_of_that_size_in_quadrature():
    model = ij.paper.y_direction()
    curve = ij.backbone_curve(model, [4e-4, 1.5e-3])
    for place in range(2):
        drive = ij.Harmonic(curve.force[place], curve.frequency[place])
        orbit = find_periodic_orbit(model, drive, start=curve.y0[place])
        assert float(orbit.amplitude) == pytest.approx(float(curve.displacements[place]), rel=1e-4)
        # Behind a sine by a quarter of a period: minus a cosine.
        assert math.cos(np.angle(orbit.harmonics[1])) == pytest.approx(-1.0, abs=1e-6)


def test_linear_response_is_the_receptance():
    response = ij.frequency_response(LINEAR, 1.0, (0.2, 2.0), periods=())
    omega = TURN * np.asarray(response.frequency)
    exact = 1.0 / (50.0 - 2.0 * omega**2 + 0.8j * omega)
    np.testing.assert_allclose(response.receptance, exact, rtol=1e-6)
    np.testing.assert_allclose(response.amplitude, np.abs(exact), rtol=1e-6)
    np.testing.assert_allclose(response.phase, np.angle(exact), atol=1e-6)
    assert np.all(response.stable)
    assert response.special_points == ()


@pytest.mark.slow
def test_an_event_of_the_response_is_where_the_receptance_has_it():
    model = ij.Isolator(1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(0.2)))
    two = ij.BranchEvent("two metres", lambda orbit: orbit.response - 2.0)
    response = ij.frequency_response(model, 1.0, (0.05, 0.3), events=(two,), periods=())
    # (1 - w^2)^2 + (0.2 w)^2 = 1 / 4.
    squares = np.sort(np.roots([1.0, 0.04 - 2.0, 1.0 - 0.25]))
    assert [point.kind for point in response.special_points] == ["two metres"] * 2
    found = [float(point.frequency) for point in response.special_points]
    np.testing.assert_allclose(found, np.sqrt(squares) / (2.0 * math.pi), rtol=1e-5)


def test_response_folds_where_the_force_is_a_fold_force():
    # 144.52 N is the lower fold at 4.4 Hz and 150.66 N the upper, by an independent shooting code.
    response = ij.frequency_response(
        ij.paper.y_direction(), [144.52, 150.66], np.linspace(4.2, 4.6, 5), periods=()
    )
    for place in range(2):
        folds = [
            float(point.frequency)
            for point in response.special_points
            if point.kind == "fold" and point.branch == place
        ]
        assert len(folds) == 2
        assert min(abs(fold - 4.4) for fold in folds) < 2e-4
        found = np.isfinite(response.frequency[place])
        unstable = np.asarray(response.frequency[place])[found & ~np.asarray(response.stable[place])]
        assert unstable.size
        assert min(folds) - 1e-3 < unstable.min()
        assert unstable.max() < max(folds) + 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("excitation", ["force", "base_acceleration"])
def test_transmissibility_of_a_linear_isolator_is_the_textbooks(excitation):
    model = ij.Isolator(LINEAR.mass, LINEAR.elements, excitation)
    band = np.array([0.2, 0.8, 2.0])
    found = ij.transmissibility(model, 1.5, band)
    exact = linear_ratio(band)
    np.testing.assert_allclose(found.ratio, exact, rtol=3e-6)
    np.testing.assert_allclose(found.magnitude, np.abs(exact), rtol=3e-6)
    np.testing.assert_allclose(found.peak, np.abs(exact), rtol=3e-6)
    assert np.all(found.stable)


@pytest.mark.slow
def test_derivative_of_transmissibility_is_the_textbooks():
    band = np.array([0.5, 0.9, 1.6])
    slope = jax.jacfwd(lambda model: ij.transmissibility(model, 1.5, band).magnitude)(LINEAR)
    omega = TURN * band
    ratio, below = linear_ratio(band), 50.0 - 2.0 * omega**2 + 0.8j * omega
    by_damping = 1j * omega / below * (1.0 - ratio)
    exact = np.real(np.conj(ratio) * by_damping) / np.abs(ratio)
    np.testing.assert_allclose(slope.elements[1].coefficient, exact, rtol=1e-5)


@pytest.mark.slow
def test_found_again_it_is_the_textbooks_under_vmap():
    band, dampers = np.array([0.5, 0.9, 1.6]), jnp.array([0.6, 1.0])
    known = ij.transmissibility(LINEAR, 1.5, band)

    def again(damper):
        return ij.find_again(known, LINEAR.replace(linear_damping__coefficient=damper), amplitude=3.0).ratio

    omega = TURN * band
    through = 50.0 + 1j * omega * np.asarray(dampers)[:, None]
    expected = through / (through - 2.0 * omega**2)
    np.testing.assert_allclose(jax.jit(jax.vmap(again))(dampers), expected, rtol=3e-6)
    with pytest.raises(ValueError, match=r"`frequency` must be omitted for a transmissibility, but is 1\.0"):
        ij.find_again(known, LINEAR, frequency=1.0)


def test_derivatives_of_transmissibility_at_resonance_are_those_of_differences():
    band, model = np.array([4.9, 5.0, 5.1]), ij.paper.y_direction()

    def numbers(coefficient):
        changed = model.replace(linear_stiffness__coefficient=coefficient)
        found = ij.transmissibility(changed, 60.0, band)
        return jnp.stack([found.magnitude, found.phase, found.peak])

    at = model["linear_stiffness.coefficient"]
    slope = np.asarray(jax.jacfwd(numbers)(at))
    step = 5e-5 * at
    near, far = (numbers(at + k * step) - numbers(at - k * step) for k in (1.0, 2.0))
    differences = np.asarray((8.0 * near - far) / (12.0 * step))
    largest = np.abs(differences).max(axis=1, keepdims=True)
    apart = np.abs(slope - differences) / largest
    np.testing.assert_array_less(apart[:2], 1e-6)
    # At 4.9 Hz the sample nearest to the peak changes between the differences, and with it the parabola.
    np.testing.assert_array_less(apart[2, 1:], 1e-6)


def steady_y(force: float, frequency: float, base: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One settled period of the y model by DOP853: phase, displacement, velocity."""
    omega = TURN * frequency

    def rates(t, y):
        push = -force if base else force / 800.0
        return [y[1], push * math.sin(omega * t) - (spring_y(y[0]) + damper_y(y[1])) / 800.0]

    phase = TURN * np.arange(512) / 512
    times = (40 * TURN + phase) / omega
    run = solve_ivp(
        rates, (0.0, times[-1]), [0.0, 0.0], method="DOP853", t_eval=times, rtol=1e-10, atol=1e-14
    )
    return phase, run.y[0], run.y[1]


def half_range(values: np.ndarray) -> float:
    return 0.5 * (values.max() - values.min())


@pytest.mark.slow
def test_force_on_the_ground_is_that_of_scipys_motion():
    frequencies = [3.0, 4.9, 5.5]
    found = ij.transmissibility(ij.paper.y_direction(), 300.0, frequencies)
    for place, frequency in enumerate(frequencies):
        phase, x, v = steady_y(300.0, frequency, base=False)
        passed = spring_y(x) + damper_y(v)
        ratio = 2.0 * np.mean(passed * np.exp(-1j * phase)) / (-1j * 300.0)
        assert complex(found.ratio[place]) == pytest.approx(ratio, rel=2e-5)
        assert float(found.peak[place]) == pytest.approx(half_range(passed) / 300.0, rel=2e-4)


@pytest.mark.slow
def test_motion_over_the_bases_is_that_of_scipys_motion():
    model = ij.Isolator(800.0, ij.paper.y_direction().elements, "base_acceleration")
    found = ij.transmissibility(model, 0.3, [3.0, 6.0])
    for place, frequency in enumerate((3.0, 6.0)):
        omega = TURN * frequency
        phase, x, _ = steady_y(0.3, frequency, base=True)
        base = -0.3 / omega**2 * np.sin(phase)
        ratio = np.mean((x + base) * np.exp(-1j * phase)) / np.mean(base * np.exp(-1j * phase))
        assert complex(found.ratio[place]) == pytest.approx(ratio, rel=2e-5)
        assert float(found.peak[place]) == pytest.approx(half_range(x + base) / half_range(base), rel=2e-4)


def test_coexisting_orbits_each_have_their_transmissibility():
    found = ij.transmissibility(ij.paper.y_direction(), 175.0, [4.2], coexisting=True)
    assert found.ratio.shape == (3, 1)
    assert np.asarray(found.stable)[:, 0].tolist() == [True, False, True]
    assert "at 1 of 1 frequencies, 4.2 to 4.2 Hz, several orbits coexist;" in " ".join(repr(found).split())
    own = {name: getattr(found, name)[0] for name in ("ratio", "peak", "spectral_radius")}
    smallest = dataclasses.replace(found, result=found.result[0], **own)
    assert "this is the one of the smallest motion: `coexisting=True` gives all" in " ".join(
        repr(smallest).split()
    )


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match="one positive number"):
        ij.transmissibility(LINEAR, -1.0, [1.0])
    with pytest.raises(ValueError, match="must ascend"):
        ij.transmissibility(LINEAR, 1.0, [1.0, 0.5])
    with pytest.raises(ValueError, match="must be positive"):
        ij.backbone_curve(LINEAR, [0.0])
    with pytest.raises(ValueError, match="positive number or a list"):
        ij.frequency_response(LINEAR, 0.0, (1.0, 2.0))
    with pytest.raises(ValueError, match="end at another"):
        ij.frequency_response(LINEAR, 1.0, (1.0, 1.0))


class Fitted(NamedTuple):
    """What a band asks of a fit."""

    model: ij.Isolator
    free: tuple[str, ...]
    covariance: np.ndarray
    result: ij.RESULTS


def uncertain(model, **errors):
    """A fit of a model with independent standard errors, by name with __ for the dot."""
    free = tuple(name.replace("__", ".") for name in errors)
    return Fitted(model, free, np.diag(np.square(list(errors.values()))), SUCCESS)


SUCCESS = ij.RESULTS.promote(diffrax.RESULTS.successful)
LOOSE = uncertain(LINEAR, linear_stiffness__coefficient=0.05, linear_damping__coefficient=0.01)


def test_the_band_of_a_linear_transmissibility_is_that_of_its_closed_form():
    frequency = np.array([0.4, 0.79, 1.5])
    band = ij.transmissibility(LINEAR, 3.0, frequency, fit=LOOSE).band
    k, c = jax.numpy.array(50.0), jax.numpy.array(0.8)

    def size(k, c):
        omega = TURN * frequency
        return jax.numpy.abs((k + 1j * c * omega) / (k - 2.0 * omega**2 + 1j * c * omega))

    slopes = jax.jacfwd(size, (0, 1))(k, c)
    expected = np.hypot(0.05 * slopes[0], 0.01 * slopes[1])
    np.testing.assert_allclose(band.standard_error["magnitude"], expected, rtol=1e-6)
    width = np.asarray(band.upper["magnitude"] - band.lower["magnitude"])
    np.testing.assert_allclose(width, 2.0 * norm.ppf(0.975) * expected, rtol=1e-6)


def test_the_band_of_a_transmissibility_at_its_peak_is_curved():
    """At resonance it falls whichever way the stiffness goes: its slope says nothing."""
    fit = uncertain(LINEAR, linear_stiffness__coefficient=1.0)
    band = ij.transmissibility(LINEAR, 3.0, np.array([0.4, 5.0 / TURN, 1.5]), fit=fit).band
    assert np.asarray(band.curved["magnitude"]).tolist() == [False, True, False]
    assert "curved at 1 of 3 points" in str(band)
    springs = np.random.default_rng(3).normal(50.0, 1.0, 100_000)
    exact = np.abs(springs + 4j) / np.abs(springs - 50.0 + 4j)
    ends = [float(np.asarray(end["magnitude"])[1]) for end in (band.lower, band.upper)]
    np.testing.assert_allclose(ends, np.quantile(exact, [0.025, 0.975]), rtol=0.02)


def test_the_band_of_a_backbone_is_that_of_free_vibration():
    backbone = ij.backbone_curve(LINEAR, SIZES[:3], fit=LOOSE)
    expected = 0.05 / (2.0 * math.sqrt(50.0 * 2.0) * TURN)
    np.testing.assert_allclose(backbone.band.standard_error["natural_frequency"], expected, rtol=1e-8)
    assert ij.plot.backbone(backbone).axes[0].patches
    assert not np.any(backbone.band.curved["natural_frequency"])
    # Of a stiffness known to 35 % the frequency, its root, is not normal.
    loose = uncertain(LINEAR, linear_stiffness__coefficient=17.5)
    wide = ij.backbone_curve(LINEAR, SIZES[:3], fit=loose).band
    assert np.all(wide.curved["natural_frequency"])
    ends = [np.asarray(end["natural_frequency"])[0] for end in (wide.lower, wide.upper)]
    stiffness = norm.ppf([0.025, 0.975], 50.0, 17.5)
    np.testing.assert_allclose(ends, np.sqrt(stiffness / 2.0) / TURN, rtol=0.04)


@pytest.mark.slow
def test_the_ends_of_a_response_band_lie_on_the_curves_of_moved_models():
    stiff = uncertain(LINEAR, linear_stiffness__coefficient=0.05)
    response = ij.frequency_response(LINEAR, 3.0, (0.5, 1.2), periods=(), fit=stiff)
    width, ends = norm.ppf(0.975) * 0.05, (response.band.lower, response.band.upper)
    moved = []
    for end in ends:
        omega, size = TURN * np.asarray(end["frequency"]), np.asarray(end["amplitude"])
        # k of the curve through each point: |k - m w^2 + i c w| = F / X.
        root = np.sqrt((3.0 / size) ** 2 - (0.8 * omega) ** 2 + 0j).real
        moved.append(
            2.0 * omega**2 + np.where(TURN * response.frequency < math.sqrt(25.0), root, -root) - 50.0
        )
    away = np.abs(np.asarray(response.frequency) * TURN / 5.0 - 1.0) > 0.03
    for one, other in zip(*moved, strict=True):
        assert one * other < 0.0
    np.testing.assert_allclose(np.abs(np.array(moved))[:, away], width, rtol=0.02)
    # One end lies below the peak all along: of the stiffer model on one flank, of the softer on the other.
    assert np.count_nonzero(np.diff(np.sign(moved[0][away]))) == 1
    axes = ij.plot.frequency_response(response).axes[0]
    assert axes.patches
    assert "95 % band" in [one.get_text() for one in axes.get_legend().get_texts()]


def test_a_band_asks_for_the_model_of_the_fit():
    with pytest.raises(ValueError, match=r"differs in linear_damping\.coefficient"):
        ij.transmissibility(LINEAR.replace(linear_damping__coefficient=0.9), 3.0, [0.4, 0.5], fit=LOOSE)
    lost = LOOSE._replace(covariance=np.full((2, 2), np.nan))
    with pytest.raises(ValueError, match="do not determine linear_stiffness"):
        ij.transmissibility(LINEAR, 3.0, [0.4, 0.5], fit=lost)
