"""Where searches start: a lost one from the measured states, a candidate from the step of its score."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import isojax as ij
from isojax._parameters import list_parameters
from isojax._results import is_successful
from isojax.elements import CoulombFriction, DriveHarmonics, FractionalDamping, StribeckFriction
from isojax.identification import Rules, classical_guess, read_campaign
from isojax.identification.diagnosis._refit import extended_model, is_determined, trace_error
from isojax.identification.diagnosis._score import Score
from isojax.identification.fitting import Estimate
from isojax.identification.fitting._covariance import invert_information

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_campaign import sketch
from _trial_run import simulated as filed


@pytest.mark.slow
def test_a_search_whose_states_run_away_goes_on_from_the_measured_ones(tmp_path):
    """Of a spring that softens beyond its declared law the steps of the states lead where motions escape."""
    _, folder, _ = filed(sketch(12189, "two"), tmp_path)
    campaign = read_campaign(folder)
    lines: list[str] = []
    fitted = ij.fit(classical_guess(campaign), campaign, progress=lines.append)
    assert is_successful(fitted.result)
    assert any("measured states" in line for line in lines)
    assert fitted.errors["fit"].chi2_per_dof < 1.3


def test_a_step_moves_the_coefficients_that_it_is_of_where_an_element_makes_room():
    base = (ij.LinearStiffness(1e6), ij.LinearDamping(1e4))
    model = ij.Isolator(800.0, (*base, CoulombFriction(5.0, 1e-4), DriveHarmonics(0.01, 0.3, 2.0)))
    listed = list_parameters(model)
    places = tuple(place for place, one in enumerate(listed) if one.spec.fitted and one.name != "mass")
    nothing: Any = None
    fitted = Estimate(model, places, nothing, nothing, nothing, nothing, 0)
    step = np.array([0.1 * float(listed[place].value) for place in places])
    moved = extended_model(fitted, StribeckFriction(0.0, 0.5, 0.01, 1e-4), 1.0, step)
    expected = {"linear_stiffness.coefficient": 1.1e6, "linear_damping.coefficient": 1.1e4}
    expected |= {"drive_harmonics.share": 0.011, "drive_harmonics.phase": 0.33, "drive_harmonics.order": 2.0}
    # Coulomb friction is part of the new law, which keeps its force and has its own step on top.
    expected["stribeck_friction.force_level"] = 6.0
    for name, number in expected.items():
        assert float(moved[name]) == pytest.approx(number, rel=1e-12), name


def test_the_trace_of_an_effect_is_as_sure_however_the_effect_is_written():
    draw = np.random.default_rng(5)
    columns = draw.normal(size=(40, 3))  # of the strength and two shapes
    others = draw.normal(size=(40, 2))  # of the rest of the model
    strength, shapes = 3.0, np.array([0.5, 2.0])

    def covariance(own: np.ndarray) -> np.ndarray:
        whole = np.hstack([own, others])
        return np.linalg.inv(whole.T @ whole)[:3, :3]

    error = trace_error(covariance(columns), 0)
    # Another strength = s exp(-w shapes), with w of any numbers: the derivatives follow from the chain rule.
    rates = np.array([3.7, -1.2])
    factor = float(np.exp(rates @ shapes))
    other = columns.copy()
    other[:, 0] *= factor
    other[:, 1:] += strength * columns[:, :1] * rates
    assert (strength / factor) / trace_error(covariance(other), 0) == pytest.approx(
        strength / error, rel=1e-12
    )
    # The size of what least squares on the other columns leave of the trace, in units of the noise.
    trace = strength * columns[:, 0]
    left = trace - others @ np.linalg.lstsq(others, trace, rcond=None)[0]
    assert strength / error == pytest.approx(float(np.linalg.norm(left)), rel=1e-12)


@pytest.mark.parametrize(("strength", "said"), [(2e4, True), (2e3, False)])
def test_a_fractional_law_is_as_sure_as_its_force_whatever_the_unit_of_its_coefficient(strength, said):
    """C of `C (i w)^alpha` is uncertain by half, because alpha is, where the force of 2e4 is not."""
    order, frequencies = 0.3, np.linspace(25.0, 40.0, 60)
    law = FractionalDamping(strength, order, 1.0, 400.0)
    model = ij.Isolator(800.0, (ij.LinearStiffness(1e6), ij.LinearDamping(1e4), law))
    listed = list_parameters(model)
    places = tuple(place for place, one in enumerate(listed) if one.spec.fitted and one.name != "mass")
    power = (1j * frequencies) ** order
    derivatives = (1.0 + 0.0 * power, 1j * frequencies, power, strength * np.log(1j * frequencies) * power)
    stiffness = np.stack(derivatives, axis=1) / 1e3  # of 1000 N/m of noise at each frequency
    columns = np.vstack([stiffness.real, stiffness.imag])
    matrix = np.zeros((5, 5))  # the last of the residual, which nobody asks
    matrix[:4, :4] = columns.T @ columns
    nothing: Any = None
    point: Any = SimpleNamespace(reduced=SimpleNamespace(matrix=matrix))
    found = Estimate(model, places, nothing, point, invert_information(matrix[:4, :4]), nothing, 0)
    assert found.names[2:] == ("fractional_damping.coefficient", "fractional_damping.order")
    assert found.uncertainty.standard_error[2] > 0.5 * strength
    score = Score(law, *([nothing] * (len(Score._fields) - 1)))
    assert is_determined(found, score, Rules()) == said
