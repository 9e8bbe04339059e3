"""The paper's models: its table, its resonance, and the jump that its sweeps show."""

import jax.numpy as jnp
import jaxtyping
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from isojax import paper
from isojax.excitations import Harmonic
from isojax.models import simulate

# Polynomials of the equivalent coefficients, forward and backward sweep.
STIFFNESS = {
    "y": [(1.087e6, -5.724e8, 1.817e11), (1.074e6, -6.115e8, 1.958e11)],
    "z": [(1.424e5, -3.817e5, -3.016e6), (1.404e5, -3.189e5, -3.418e6)],
}
DAMPING = {
    "y": [(1.009e4, -3.212e5, 4.166e6), (1.045e4, -3.049e5, 3.897e6)],
    "z": [(2656.0, -1252.0, 526.1), (2620.0, -1114.0, 592.2)],
}
MODELS = {"y": paper.y_direction, "z": paper.z_direction}


@pytest.mark.parametrize("direction", ["y", "z"])
def test_the_coefficients_invert_the_equivalent_polynomials(direction):
    model = MODELS[direction]()
    inverse = np.array([1.0, 3.0 * np.pi / 8.0, 4.0 / 3.0])
    for table, laws in ((STIFFNESS, "stiffness"), (DAMPING, "damping")):
        expected = np.mean(table[direction], axis=0) * inverse
        found = [float(model[f"{kind}_{laws}.coefficient"]) for kind in ("linear", "abs_quadratic", "cubic")]
        np.testing.assert_allclose(found, expected, rtol=2e-3)
    assert float(model["mass"]) == 800.0


def test_the_printed_coefficients_are_kept_to_the_last_digit():
    y, z = paper.y_direction(), paper.z_direction()
    assert [float(entry.value) for entry in y.parameters] == [
        *(800.0, 1.0805e6, -6.974e8, 2.51667e11),
        *(1.027e4, -3.688e5, 5.3753e6),
    ]
    assert [float(entry.value) for entry in z.parameters] == [
        *(800.0, 1.414e5, -4.126e5, -4.289e6),
        *(2638.0, -1393.0, 745.533),
    ]


def test_the_modified_damping_is_the_one_printed():
    model = paper.y_direction(mass=750.0, damping="eq36")
    assert float(model["mass"]) == 750.0
    assert float(model["abs_quadratic_damping.coefficient"]) == -3.688e3
    assert model.element("cubic_damping") is None


def test_an_unknown_damping_is_refused():
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        with pytest.raises(ValueError, match=r'`damping` must be "eq18" or "eq36", but is \'eq30\''):
            paper.y_direction(damping="eq30")
    finally:
        jaxtyping.config.update("jaxtyping_disable", False)


def balance(model, amplitude, frequency):
    """Force that one-term harmonic balance, eqs. (7) and (8), needs for a displacement amplitude."""
    omega, factors = 2.0 * np.pi * frequency, np.array([1.0, 8.0 / (3.0 * np.pi), 0.75])
    powers = np.array([0, 1, 2])

    def equivalent(laws, size):
        kinds = ("linear", "abs_quadratic", "cubic")
        return sum(factors * size**powers * [float(model[f"{kind}_{laws}.coefficient"]) for kind in kinds])

    stiffness, damping = equivalent("stiffness", amplitude), equivalent("damping", amplitude * omega)
    return amplitude * np.hypot(stiffness - 800.0 * omega**2, omega * damping)


def peak(model, force, low, high, largest):
    """Frequency and height of the displacement peak by harmonic balance."""

    def amplitude(frequency):
        return brentq(lambda size: balance(model, size, frequency) - force, 1e-9, largest, xtol=1e-14)

    found = minimize_scalar(
        lambda f: -amplitude(f), bounds=(low, high), method="bounded", options={"xatol": 1e-7}
    )
    return found.x, -found.fun


@pytest.mark.parametrize(("force", "frequency"), [(450.5, 2.0470), (494.5892, 2.0426)])
def test_the_harmonic_balance_of_the_vertical_model_peaks_where_the_papers_figure_does(force, frequency):
    # The paper's Fig. 21. Below the amplitude where the printed stiffness is lost there is one root.
    found, _ = peak(paper.z_direction(), force, 1.8, 2.3, 0.045)
    np.testing.assert_allclose(found, frequency, atol=1e-3)


def steady(model, force, frequency, start=(0.0, 0.0), duration=20.0):
    """Displacement of the last five cycles."""
    record = simulate(model, Harmonic(force, frequency), duration=duration, initial_state=start)
    return np.asarray(record.displacement)[-round(5000.0 / frequency) :]


def test_the_simulated_vertical_response_peaks_there_too():
    model = paper.z_direction()
    frequency, height = peak(model, 450.5, 1.8, 2.3, 0.045)
    at, below, above = (
        np.max(steady(model, 450.5, f)) for f in (frequency, frequency - 0.06, frequency + 0.06)
    )
    np.testing.assert_allclose(at, height, rtol=5e-3)
    assert below < at
    assert above < at


@pytest.mark.parametrize(
    ("model", "force", "frequency", "start"),
    [
        (paper.y_direction(), 419.8, 3.8831, (1e-3, 0.02)),
        (paper.y_direction(), 459.9, 3.739, (1e-3, 0.02)),
        (paper.z_direction(), 450.5, 2.0470, (5e-3, -0.05)),
        (paper.z_direction(), 494.5892, 2.0426, (5e-3, -0.05)),
    ],
)
def test_a_perturbed_orbit_returns_to_the_steady_state(model, force, frequency, start):
    undisturbed, disturbed = (steady(model, force, frequency, state) for state in ((0.0, 0.0), start))
    np.testing.assert_allclose(disturbed, undisturbed, atol=1e-8 * np.max(undisturbed))


def test_two_stable_orbits_coexist_inside_the_lens_of_folds_and_one_outside():
    model = paper.y_direction()

    def heights(force, frequency):
        starts = [(0.0, 0.0), (3e-3, 0.0), (0.0, 0.08), (0.0, -0.08), (-2e-3, 0.05)]
        return np.array([np.max(steady(model, force, frequency, start, 40.0)) for start in starts])

    inside, outside = heights(175.0, 4.2), heights(175.0, 4.8)
    assert np.ptp(inside) > 0.1 * np.max(inside)
    assert np.ptp(outside) < 1e-6 * np.max(outside)
    assert bool(jnp.all(jnp.isfinite(inside)))
