"""Curves of folds and doublings against an independent table, and SciPy at their points and cusps."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy_map
from scipy.interpolate import CubicSpline

import isojax as ij

MODEL = ij.paper.y_direction()
LAW = scipy_map.paper_y_law()
WINDOW = {"amplitude_range": (1.0, 500.0), "frequency_range": (3.0, 8.0)}
UEDA = ij.Isolator(1.0, (ij.LinearDamping(0.1), ij.CubicStiffness(1.0)))
ONE = 1.0 / (2.0 * np.pi)

TABLE = {4.0: (211.67, 211.31), 4.1: (194.01, 190.62), 4.2: (178.12, 171.89), 4.4: (150.66, 144.52)}
"""Frequency [Hz] to upper and lower fold [N], found by others to 0.01 N."""


@pytest.fixture(scope="module")
def lens():
    return ij.fold_curve(MODEL, **WINDOW)


def half_map(amplitude, frequency, y0, mass=800.0):
    end, matrix, _ = scipy_map.after(LAW, mass, float(amplitude), float(frequency), np.asarray(y0), 0.5)
    return -end, -matrix


def bend(amplitude, frequency, y0, mass=800.0):
    """Give the quadratic coefficient of the half-period map by differences of SciPy's derivative."""
    scale = np.array([1e-3, 3e-2])
    _, matrix = half_map(amplitude, frequency, y0, mass)
    matrix = matrix / scale[:, None] * scale[None]
    right, left = np.linalg.svd(matrix - np.eye(2))[2][-1], np.linalg.svd((matrix - np.eye(2)).T)[2][-1]
    moved = []
    for sign in (1.0, -1.0):
        _, there = half_map(amplitude, frequency, np.asarray(y0) + sign * 1e-3 * right * scale, mass)
        moved.append(there / scale[:, None] * scale[None])
    return left @ ((moved[0] - moved[1]) / 2e-3) @ right / (left @ right)


@pytest.mark.slow
def test_the_lens_is_closed_with_two_cusps_where_the_table_leaves_room(lens):
    assert ij.is_successful(lens.result)
    assert bool(lens.closed)
    assert len(lens.cusps) == 2
    low, high = sorted(lens.cusps, key=lambda cusp: float(cusp.frequency))
    # "From just below 4.0 Hz to about 4.65 Hz".
    assert 3.9 < float(low.frequency) < 4.0
    assert float(high.frequency) == pytest.approx(4.65, abs=0.01)
    assert float(lens.frequency.min()) == pytest.approx(float(low.frequency), abs=1e-4)
    assert float(lens.frequency.max()) == pytest.approx(float(high.frequency), abs=1e-4)


@pytest.mark.slow
def test_the_lens_passes_through_the_table(lens):
    frequency, amplitude = np.asarray(lens.frequency), np.asarray(lens.amplitude)
    for wanted, folds in TABLE.items():
        found = []
        for place in np.nonzero((frequency[:-1] < wanted) != (frequency[1:] < wanted))[0]:
            # Six points around the crossing, along which the frequency is monotone away from a cusp.
            near = np.arange(place - 2, place + 4) % (frequency.size - 1)
            order = np.argsort(frequency[near])
            found.append(float(CubicSpline(frequency[near][order], amplitude[near][order])(wanted)))
        assert sorted(found, reverse=True) == pytest.approx(folds, abs=0.015)


@pytest.mark.slow
def test_points_of_the_lens_carry_the_multiplier_one_by_scipy(lens):
    for place in range(0, lens.amplitude.size, 20):
        y0 = np.asarray(lens.y0[place])
        end, matrix = half_map(lens.amplitude[place], lens.frequency[place], y0)
        np.testing.assert_allclose(end, y0, atol=1e-8 * np.abs(y0).max())
        assert abs(np.linalg.det(matrix - np.eye(2))) < 1e-7


@pytest.mark.slow
def test_the_quadratic_coefficient_vanishes_at_the_cusps_by_scipy(lens):
    usual = max(
        abs(bend(lens.amplitude[place], lens.frequency[place], lens.y0[place])) for place in range(0, 160, 20)
    )
    for cusp in lens.cusps:
        y0 = np.asarray(cusp.y0)
        end, matrix = half_map(cusp.amplitude, cusp.frequency, y0)
        np.testing.assert_allclose(end, y0, atol=1e-8 * np.abs(y0).max())
        assert abs(np.linalg.det(matrix - np.eye(2))) < 1e-7
        assert abs(bend(cusp.amplitude, cusp.frequency, y0)) < 1e-3 * usual


DAMPER = float(MODEL["cubic_damping.coefficient"])
MASSES = np.array([800.0, 780.0, 824.0])
STEPS = np.array([2e-3, -2e-3, 1e-3, -1e-3])
"""Relative, of differences."""


@pytest.fixture(scope="module")
def cusps_again(lens):
    """The cusps of other models, found again: amplitudes, frequencies and states of both.

    Models with other masses first; then those of differences by the mass and by the cubic damper.
    """
    known = lens.cusps

    def again(mass, damper):
        model = MODEL.replace(mass=mass, cubic_damping__coefficient=damper)
        found = [ij.find_again(cusp, model) for cusp in known]
        return [(one.amplitude, one.frequency, one.y0) for one in found]

    masses = np.concatenate([MASSES, 800.0 * (1.0 + STEPS), np.full(4, 800.0)])
    dampers = np.concatenate([np.full(7, DAMPER), DAMPER * (1.0 + STEPS)])
    found = jax.jit(jax.vmap(again))(jnp.asarray(masses), jnp.asarray(dampers))
    return [[np.asarray(one) for one in cusp] for cusp in found]


@pytest.mark.slow
def test_a_cusp_is_found_again_for_other_models_by_scipy(lens, cusps_again):
    usual = max(abs(bend(lens.amplitude[place], lens.frequency[place], lens.y0[place])) for place in (0, 60))
    cusp, found = lens.cusps[0], [one[:3] for one in cusps_again[0]]
    for mass, amplitude, frequency, y0 in zip(MASSES, *found, strict=True):
        end, matrix = half_map(amplitude, frequency, y0, mass)
        np.testing.assert_allclose(end, y0, atol=1e-8 * np.abs(y0).max())
        assert abs(np.linalg.det(matrix - np.eye(2))) < 1e-7
        assert abs(bend(amplitude, frequency, y0, mass)) < 1e-4 * usual
    np.testing.assert_allclose(found[0][0], cusp.amplitude, rtol=1e-9)
    with pytest.raises(ValueError, match="`frequency` must be omitted for a cusp"):
        ij.find_again(cusp, MODEL, frequency=4.0)


@pytest.mark.slow
def test_derivatives_of_the_cusps_are_central_differences(cusps_again):
    def cusps(mass, damper):
        model = MODEL.replace(mass=mass, cubic_damping__coefficient=damper)
        curve = ij.fold_curve(model, **WINDOW, step=0.08)  # cusps do not depend on the points between
        return jnp.stack([number for cusp in curve.cusps for number in (cusp.amplitude, cusp.frequency)])

    moved = np.stack([number for cusp in cusps_again for number in cusp[:2]])
    slopes = jax.jacfwd(cusps, (0, 1))(800.0, DAMPER)
    for value, exact, ends in zip((800.0, DAMPER), slopes, (moved[:, 3:7], moved[:, 7:]), strict=True):
        spans = STEPS[::2] - STEPS[1::2]
        coarse, fine = ((ends[:, ::2] - ends[:, 1::2]) / (spans * value)).T
        np.testing.assert_allclose(exact, (4 * fine - coarse) / 3, rtol=1e-6)


@pytest.mark.slow
def test_doublings_along_the_curve_carry_minus_one_by_scipy():
    curve = ij.period_doubling_curve(
        UEDA, amplitude_range=(1.0, 15.0), frequency_range=(0.8 * ONE, 1.3 * ONE), search=3
    )
    assert ij.is_successful(curve.result)
    assert not bool(curve.closed)
    # From edge to edge of the window.
    assert float(curve.frequency.min()) == pytest.approx(0.8 * ONE, rel=1e-6)
    law = scipy_map.polynomial_law(k3=1.0, c1=0.1)
    for place in range(0, curve.amplitude.size, 10):
        y0, force = np.asarray(curve.y0[place]), float(curve.amplitude[place])
        end, matrix, _ = scipy_map.after(law, 1.0, force, float(curve.frequency[place]), y0, 1.0)
        np.testing.assert_allclose(end, y0, atol=1e-7)
        assert abs(np.linalg.det(matrix + np.eye(2))) < 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"amplitude_range": (5.0, 1.0)}, "`amplitude_range` must be two positive ascending numbers"),
        ({"frequency_range": (0.0, 1.0)}, "`frequency_range` must be two positive ascending numbers"),
        ({"search": 0}, "`search` must be positive"),
        ({"step": -1.0}, "`step` must be positive"),
        ({"most": 0}, "`most` must be positive"),
    ],
)
@pytest.mark.parametrize("follow", [ij.fold_curve, ij.period_doubling_curve, ij.neimark_sacker_curve])
def test_bad_arguments_are_refused(follow, options, words):
    with pytest.raises(ValueError, match=words):
        follow(MODEL, **{**WINDOW, **options})


@pytest.mark.slow
def test_a_window_without_folds_is_refused_with_what_was_searched():
    linear = ij.Isolator(2.0, (ij.LinearDamping(3.0), ij.LinearStiffness(800.0)))
    with pytest.raises(ValueError, match=r"`start` must be given .* meet no fold"):
        ij.fold_curve(linear, amplitude_range=(1.0, 5.0), frequency_range=(2.0, 4.0), search=2)
