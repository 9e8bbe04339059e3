"""Searches among effects on thinned records: as much evidence, and in the end a fit on all samples."""

import diffrax
import numpy as np
import pytest

import isojax as ij
from isojax import rig
from isojax._results import RESULTS
from isojax.elements import CoulombFriction, QuadraticStiffness
from isojax.identification import Rules, diagnose, fit
from isojax.identification.diagnosis import _diagnose
from isojax.identification.fitting import (
    DEFAULT_SOLVER,
    chi2_per_dof_of_all,
    on_all_samples,
    search_of,
    thinned,
)
from isojax.identification.fitting._thinned import thinning

DECLARED = (ij.LinearStiffness(1.05e6), ij.CubicStiffness(2.4e11), ij.LinearDamping(1e4))
PLANT = rig.Plant(rig.base_laws(1.08e6, 0.0, 2.5e11, 1.03e4, 0.0, 0.0))
PLAN = rig.SteppedSine((60.0, 150.0), (4.0, 4.8, 5.4, 6.0, 6.9), 10, ("forward",))


def _bench(**changes) -> rig.Bench:
    fields = {"rate": 1000.0, "noise": 0.01, "drift": 0.0, "force_noise": 0.0, "tolerance": 1e-8}
    return rig.Bench(**{**fields, **changes})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "effect", "within"),
    [
        (rig.QuadraticStiffness(2.5e7), QuadraticStiffness(1e7), 0.03),
        # Of the jumps of dry friction some lies above half the new rate.
        (rig.CoulombFriction(4.0), CoulombFriction(1.0, 1e-4), 0.10),
    ],
    ids=["quadratic", "friction"],
)
def test_thinned_records_hold_as_much_evidence(simulated, hidden, effect, within):
    campaign = simulated(PLANT.plus(hidden), PLAN, bench=_bench())
    search = search_of(campaign, Rules(), DEFAULT_SOLVER, lambda line: None)
    gains, errors = [], []
    plain = fit(ij.Isolator(800.0, DECLARED), campaign)
    full = fit(ij.Isolator(800.0, (*DECLARED, effect)), campaign)
    assert thinning(plain.estimate.problem) == 3
    for pair in (
        (plain.estimate, full.estimate),
        tuple(thinned(f.estimate, search)[0] for f in (plain, full)),
    ):
        gains.append(pair[0].chi2 - pair[1].chi2)
        errors.append(pair[1])
    assert gains[0] > 100.0
    assert gains[1] == pytest.approx(gains[0], rel=within)
    whole, thin = errors
    np.testing.assert_allclose(thin.uncertainty.standard_error, whole.uncertainty.standard_error, rtol=0.08)
    moved = np.array([float(thin.model[name]) - float(whole.model[name]) for name in whole.names])
    assert np.all(np.abs(moved) < 0.5 * whole.uncertainty.standard_error)
    assert thin.chi2 / thin.dof == pytest.approx(1.0, abs=0.05)
    # On all samples again: where the whole fit is.
    again = on_all_samples(thin, plain.estimate, search, search)
    assert again.dof == pytest.approx(whole.dof, rel=1e-3)
    moved = np.array([float(again.model[name]) - float(whole.model[name]) for name in whole.names])
    assert np.all(np.abs(moved) < 0.2 * whole.uncertainty.standard_error)
    known = chi2_per_dof_of_all(thin.chi2 / thin.dof, thinned(plain.estimate, search)[0], plain.estimate)
    assert known == pytest.approx(whole.chi2 / whole.dof, abs=within * gains[0] / whole.dof + 1e-4)


@pytest.mark.slow
def test_a_finding_on_thinned_records_is_fitted_to_all_samples(simulated):
    campaign = simulated(PLANT.plus(rig.CoulombFriction(4.0)), PLAN, bench=_bench())
    lines: list[str] = []
    before = fit(ij.Isolator(800.0, DECLARED), campaign)
    verdict = diagnose(before, progress=lines.append)
    assert verdict.finding is not None
    assert verdict.finding.effect == "coulomb_friction"
    assert any("1 sample of 3" in line for line in lines)
    after = verdict.after
    assert after.stats.samples == sum(record.output.size for record in campaign.records)
    known = fit(after.model, campaign)
    assert after.stats.chi2 == pytest.approx(known.stats.chi2, abs=1.0)
    assert float(after.model["coulomb_friction.force_level"]) == pytest.approx(4.0, rel=0.05)
    # The corner of the law is that of the measured samples, not that of the thinned ones.
    expected = CoulombFriction.guess(search_of(campaign, Rules(), DEFAULT_SOLVER, lambda line: None).scales)
    assert float(after.model["coulomb_friction.width"]) == pytest.approx(float(expected.width), rel=1e-12)
    # Errors of the ranking are per degree of freedom of all samples; the jumps have a little above the band.
    ratios = [one.stats.chi2 / one.stats.dof for one in (before, after)]
    assert verdict.ranking[0].chi2_per_dof == pytest.approx(ratios[1], abs=0.1 * (ratios[0] - ratios[1]))


@pytest.mark.slow
def test_what_fits_no_more_on_all_samples_is_not_named(simulated, monkeypatch):
    def fails(found, whole, coarser, search):
        return whole._replace(result=RESULTS.not_finite)

    campaign = simulated(PLANT.plus(rig.QuadraticStiffness(2.5e7)), PLAN, bench=_bench())
    monkeypatch.setattr(_diagnose, "on_all_samples", fails)
    verdict = diagnose(fit(ij.Isolator(800.0, DECLARED), campaign))
    assert verdict.finding is None
    assert verdict.after is None
    assert "its refit to all samples did not converge" in verdict.reason


def test_what_would_lose_by_it_keeps_every_sample(simulated):
    campaign = simulated(PLANT, PLAN, bench=_bench())
    problem = fit(ij.Isolator(800.0, DECLARED), campaign).estimate.problem
    assert thinning(problem) == 3
    assert thinning(problem._replace(hold="zero_order")) == 1
    assert thinning(problem._replace(whitening=(1.0, -0.5))) == 1
    other = ij.Integrator(diffrax.Dopri8(), rtol=1e-6)
    assert thinning(problem._replace(integrator=other)) == 1
    slow = simulated(PLANT, PLAN, bench=_bench(rate=250.0))
    found = fit(ij.Isolator(800.0, DECLARED), slow)
    search = search_of(slow, Rules(), DEFAULT_SOLVER, lambda line: None)
    assert thinned(found.estimate, search) == (found.estimate, search)
