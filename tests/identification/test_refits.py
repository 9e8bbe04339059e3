"""Where searches start: a lost one from the measured states, a candidate from the step of its score."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isojax as ij
from isojax._parameters import list_parameters
from isojax._results import is_successful
from isojax.elements import CoulombFriction, DriveHarmonics, StribeckFriction
from isojax.identification import classical_guess, read_campaign
from isojax.identification.diagnosis._refit import _extended
from isojax.identification.fitting import Estimate

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
    moved = _extended(fitted, StribeckFriction(0.0, 0.5, 0.01, 1e-4), 1.0, step)
    expected = {"linear_stiffness.coefficient": 1.1e6, "linear_damping.coefficient": 1.1e4}
    expected |= {"drive_harmonics.share": 0.011, "drive_harmonics.phase": 0.33, "drive_harmonics.order": 2.0}
    # Coulomb friction is part of the new law, which keeps its force and has its own step on top.
    expected["stribeck_friction.force_level"] = 6.0
    for name, number in expected.items():
        assert float(moved[name]) == pytest.approx(number, rel=1e-12), name
