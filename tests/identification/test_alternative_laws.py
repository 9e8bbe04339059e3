"""Force laws in the place of a finding, compared with the rig's truth and with fits of the same laws."""

import numpy as np
import pytest
from strange_laws import BASE, Grip

from isojax import Rules, elements, rig
from isojax.identification import DEFAULT_SOLVER, Alternatives, classical_guess, fit, scales
from isojax.identification.fitting import search_of
from isojax.identification.remainder import find_alternatives
from isojax.identification.traces import trace_free_laws

PLAN = rig.SteppedSine((40.0, 80.0, 130.0), tuple(np.arange(4.0, 6.6, 0.25)), directions=("forward",))


@pytest.fixture(scope="module")
def range_of(simulated):
    """Gives the function that fits c x^2 v where another law may act, and the laws that would do as well."""

    def run(*hidden: rig.Law):
        campaign = simulated(rig.Plant(BASE).plus(*hidden), PLAN)
        guess = classical_guess(campaign).model.with_elements(
            elements.PositionDamping.guess(scales(campaign))
        )
        found = fit(guess, campaign)
        beside = trace_free_laws(found.estimate, search_of(campaign, Rules(), DEFAULT_SOLVER, print))
        (alternatives,) = find_alternatives(beside, ("position_damping",), Rules())
        return found, alternatives

    return run


@pytest.mark.slow
def test_the_true_law_does_better_than_a_wrong_name_and_has_its_coefficient(range_of):
    found, alternatives = range_of(Grip(5e6))
    best = alternatives.better
    assert best is not None
    assert best.formula == "|x| v"
    assert abs(best.coefficient - 5e6) < 3.0 * best.error
    assert best.unit == "N s/m^2"
    # A fit of the same law, of all coefficients at once, comes to the same chi2 and to the same numbers.
    refitted = fit(best.model, found.campaign)
    inflation = max(1.0, found.stats.chi2 / found.stats.dof)
    assert (refitted.stats.chi2 - found.stats.chi2) / inflation == pytest.approx(best.delta_chi2, rel=0.05)
    linear = "linear_damping.coefficient"
    assert abs(float(refitted.model[linear]) - float(best.model[linear])) < refitted.standard_errors[linear]


@pytest.mark.slow
def test_a_right_name_is_beaten_by_none_and_is_one_of_them(range_of):
    _, alternatives = range_of(rig.PositionDamping(4e8))
    assert alternatives.better is None
    same = [law for law in alternatives.laws if law.is_the_same]
    assert [law.formula for law in same] == ["x^2 v"]
    assert same[0].delta_chi2 == pytest.approx(0.0, abs=0.1)
    assert abs(same[0].coefficient - 4e8) < 4.0 * same[0].error
    assert all(abs(law.delta_chi2) <= alternatives.margin for law in alternatives.laws)


def test_without_a_law_nothing_does_better():
    assert Alternatives(("coulomb_friction",), (), 137, 16.0).better is None
