"""Matching pursuit over free force laws, on plants with hidden laws outside the catalogue."""

import numpy as np
import pytest
from strange_laws import BASE, Detent, Governor, Grip

from isojax import rig
from isojax.elements import CATALOGUE, CoulombFriction
from isojax.identification import classical_guess, diagnose, explain_remainder, fit, scales
from isojax.identification.traces import free_laws
from isojax.identification.traces._free_traces import _forces, _is_same_law
from isojax.reporting.words._remainder_words import selected_laws_words

PLAN = rig.SteppedSine(
    (40.0, 80.0, 130.0), tuple(np.arange(4.0, 6.6, 0.25)), directions=("forward",), holdout_levels=(100.0,)
)


@pytest.fixture(scope="module")
def left_by(simulated):
    """Gives the function that fits the declared model to a plant with hidden laws, and its pursuit."""

    def describe(*hidden):
        campaign = simulated(rig.Plant(BASE).plus(*hidden), PLAN)
        return explain_remainder(fit(classical_guess(campaign).model, campaign), refit=False).pursuit

    return describe


@pytest.mark.slow
@pytest.mark.parametrize(("law", "formula"), [(Grip(3e6), "|x| v"), (Governor(6e6), "x |v|")])
def test_a_law_outside_the_catalogue_is_described_with_its_coefficient(left_by, law, formula):
    pursuit = left_by(law)
    assert [one.formula for one in pursuit.laws] == [formula]
    (one,) = pursuit.laws
    assert one.unit == "N s/m^2"
    assert abs(one.coefficient - law.coefficient) < 4.0 * one.error + 0.03 * law.coefficient
    assert one.share > 0.9
    assert pursuit.chi2_per_dof > 1.1
    assert pursuit.linear < 1.03


@pytest.mark.slow
def test_relaxation_is_described_as_a_force_that_relaxes(left_by):
    pursuit = left_by(rig.MaxwellBranch(4e4, 0.03))
    first = pursuit.laws[0]
    assert first.formula.startswith("fade(x; ")
    assert abs(first.coefficient - 4e4) < 3.0 * first.error
    assert first.z > 20.0
    # It is so small that chance would explain the excess, of which there is no share then.
    assert np.isnan(first.share)


@pytest.mark.slow
def test_nothing_is_selected_in_noise(left_by):
    pursuit = left_by()
    assert pursuit.laws == ()
    assert pursuit.linear == pursuit.chi2_per_dof


@pytest.mark.slow
def test_a_law_outside_the_catalogue_is_owned_up_to_beside_a_good_fit(simulated):
    """A detent of 0.5 N hides in chi2/dof; what could imitate it is no candidate here."""
    campaign = simulated(rig.Plant(BASE).plus(Detent(0.5, 5e-5)), PLAN)
    fitted = fit(classical_guess(campaign).model, campaign)
    assert fitted.stats.chi2 / fitted.stats.dof < 1.0
    verdict = diagnose(fitted, excluded=("freeplay", "end_stop"))
    assert verdict.verdict == "unexplained"
    assert verdict.law is not None
    assert verdict.law.formula.startswith("sin(x / 0.0")
    assert verdict.law.z > 6.0
    assert abs(verdict.law.coefficient - 0.5) < 3.0 * verdict.law.error
    assert f"a force {verdict.law.formula} stands out" in verdict.reason


def test_of_noise_that_was_declared_too_small_no_law_is_sought(simulated):
    plan = rig.SteppedSine((60.0, 120.0), (4.0, 4.8, 5.6), directions=("forward",))
    bench = rig.Bench(rate=250.0, drift=0.0, force_noise=0.0, anti_alias=False, noise=5e-3)
    campaign = simulated(rig.Plant(BASE), plan, bench=bench, output={"noise": 2e-3})
    fitted = fit(classical_guess(campaign).model, campaign)
    assert fitted.stats.chi2 / fitted.stats.dof > 4.0
    pursuit = explain_remainder(fitted, refit=False).pursuit
    assert pursuit.tried == 0
    assert pursuit.laws == ()
    assert "Nothing of it comes back with the drive" in selected_laws_words(pursuit)


def test_beside_dry_friction_only_its_own_law_is_no_other(simulated):
    magnitudes = scales(simulated(rig.Plant(BASE), PLAN))
    laws = free_laws(magnitudes)
    friction = _forces([CoulombFriction.guess(magnitudes)], magnitudes)[0]
    same = [
        law
        for law, force in zip(laws, _forces(laws, magnitudes), strict=True)
        if _is_same_law(force, friction)
    ]
    assert [law.wording().formula for law in same] == ["sgn(v)"]


def test_free_laws_are_no_effects(simulated):
    laws = free_laws(scales(simulated(rig.Plant(BASE), PLAN)))
    assert len(laws) > 100
    assert not {law.name for law in laws} & set(CATALOGUE)
    assert len({law.wording().formula for law in laws}) == len(laws)
