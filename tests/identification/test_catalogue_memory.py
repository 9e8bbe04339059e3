"""Effects with memory and of the response channel, put into the simulated bench and recovered."""

from typing import NamedTuple

import numpy as np
import pytest

from isojax import rig
from isojax._parameters import list_parameters
from isojax.elements import CATALOGUE, CubicStiffness, LinearDamping, LinearStiffness
from isojax.identification import fit, scales
from isojax.identification.diagnosis._admissibility import find_violation
from isojax.identification.diagnosis._refit import refit_candidate
from isojax.identification.diagnosis._score import score_test
from isojax.identification.fitting import Search
from isojax.models import Integrator, Isolator

LINEAR = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4)))
PLAN = rig.Multisine((40.0, 70.0, 110.0), 2.0, 14.0, period=2.0, periods=4, lines="full")
BENCH = rig.Bench(rate=250.0, noise=5e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)

ASKED = (
    "lugre_friction",
    "dual_chamber",
    "fractional_damping",
    "second_mode",
    "ac_coupling",
    "clipping",
    "maxwell_branch",
    "dahl_friction",
    "coulomb_friction",
    "input_delay",
    "added_mass",
    "cubic_stiffness",
)
"""Effects that compete: each one's look-alikes among them."""


class Case(NamedTuple):
    """An effect of the bench, and the coefficients by which the model knows it.

    Attributes:
        effect: of the bench.
        truth: values by the name of the field [SI].
    """

    effect: rig.Law | rig.Instrument
    truth: dict[str, float]


CASES = (
    Case(
        rig.LugreFriction(4.0, 8.0, 2e-3, 4.0 / 3e-5),
        {"force_level": 4.0, "presliding": 3e-5, "excess": 1.0, "stribeck_velocity": 2e-3},
    ),
    Case(
        # kappa P0 A^2 = 280 N m, K = 280 V2 / (V1 (V1 + V2)), tau and o as on the page of the effect.
        rig.DualChamber(0.02, 2e-3, 5e-3, 4.9e6, 8.6e10),
        {
            "stiffness": 280.0 * 5e-3 / (2e-3 * 7e-3),
            "time_constant": 4.9e6 * 1e-5 / (7e5 * 7e-3),
            "orifice": 8.6e10 * 0.02 * 2e-3 * 5e-3**2 / (7e5 * 7e-3**2),
        },
    ),
    Case(rig.FractionalDamping(1e5, 0.4), {"coefficient": 1e5, "order": 0.4}),
    Case(
        rig.SecondMode(15.0, 6.5, 0.03),
        {"mass": 15.0, "angular_frequency": 2 * np.pi * 6.5, "damping_ratio": 0.03},
    ),
    Case(rig.AcCoupling(0.06), {"corner": 0.06}),
    Case(rig.Clipping(0.45), {"share": 1.0, "upper": 0.45, "lower": 0.45}),
    Case(rig.Clipping(0.45, 0.5), {"share": 1.0, "upper": 0.45, "lower": 0.5}),
)

every_case = pytest.mark.parametrize("case", CASES, ids=lambda case: case.effect.name)


def scored(simulated, case):
    """The score test of a campaign with the effect, under the linear model."""
    campaign = simulated(LINEAR.plus(case.effect), PLAN, 7, BENCH, stiffness=("linear",), damping=("linear",))
    magnitudes = scales(campaign)
    found = fit(START, campaign, integrator=Integrator())
    probes = tuple(probe for name in ASKED for probe in CATALOGUE[name].grid(magnitudes))
    return score_test(found.estimate, Search(magnitudes), probes), magnitudes, campaign


@every_case
def test_the_effect_has_the_largest_score_and_the_sign_of_matter(case, simulated):
    test, _, _ = scored(simulated, case)
    assert test.scores[0].element.name == case.effect.name
    assert test.scores[0].admissible
    assert test.scores[0].p_value < 1e-6


@pytest.mark.slow
@every_case
def test_its_coefficients_come_back_within_their_errors(case, simulated):
    test, magnitudes, campaign = scored(simulated, case)
    found = refit_candidate(test, 0, Search(magnitudes, max_steps=40))
    assert found.chi2 / found.dof == pytest.approx(1.0, abs=0.03)
    assert find_violation(found.model, campaign.fit_records, "acceleration") is None
    listed = list_parameters(found.model)
    values = {
        listed[place].name.split(".")[1]: (float(listed[place].value), float(error))
        for place, error in zip(found.places, found.uncertainty.standard_error, strict=True)
        if listed[place].name.startswith(case.effect.name)
    }
    assert set(values) == set(case.truth)
    for field, truth in case.truth.items():
        value, error = values[field]
        assert abs(value - truth) < 3.5 * error
        assert error < 0.3 * truth


@pytest.mark.slow
def test_a_coupled_channel_leaves_the_springs_as_they_are(simulated):
    """The leak that makes the absent effect computable must not show in what is fitted beside it."""
    laws = rig.LinearStiffness(1.08e6), rig.CubicStiffness(2.5e11), rig.LinearDamping(1e4)
    plant = rig.Plant(laws).plus(rig.AcCoupling(0.05))
    plan = rig.SteppedSine((60.0, 150.0), (4.5, 5.0, 5.5, 6.0), 20, ("forward",))
    quiet = rig.Bench(rate=250.0, noise=1e-5, drift=0.0, force_noise=0.0, tolerance=1e-9)
    campaign = simulated(plant, plan, 3, quiet, stiffness=("linear", "cubic"), damping=("linear",))
    springs = LinearStiffness(1.08e6), CubicStiffness(2.5e11), LinearDamping(1e4)
    start = Isolator(800.0, (*springs, CATALOGUE["ac_coupling"].guess(scales(campaign))))
    found = fit(start.replace(ac_coupling__corner=0.05), campaign).model
    assert float(found["ac_coupling.corner"]) == pytest.approx(0.05, rel=2e-3)
    assert float(found["cubic_stiffness.coefficient"]) == pytest.approx(2.5e11, rel=2e-3)
