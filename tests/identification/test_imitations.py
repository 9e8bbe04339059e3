"""Two effects at once: neither an imitation of both nor a name given too early may stand."""

import dataclasses
import math

import numpy as np
import pytest

from isojax import rig
from isojax._results import RESULTS
from isojax.elements import CoulombFriction, CubicStiffness, LinearDamping, LinearStiffness, MaxwellBranch
from isojax.identification import (
    Extension,
    Finding,
    Rules,
    Verdict,
    _close_loop,
    close_loop,
    diagnose,
    fit,
    scales,
)
from isojax.identification.diagnosis import Diagnosis, findings_in
from isojax.identification.diagnosis._imitations import find_simpler_pair, find_superfluous
from isojax.identification.diagnosis._refit import Refit, refit_candidate
from isojax.identification.diagnosis._score import absent_effects, score_test
from isojax.identification.fitting import Rival, Search, _descent
from isojax.models import Integrator, Isolator

LINEAR = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4)))
PLAN = rig.Multisine(
    (20.0, 40.0, 60.0, 80.0, 100.0, 120.0),
    2.0,
    14.0,
    period=1.0,
    periods=3,
    lines="full",
    holdout_levels=(90.0,),
)
BENCH = rig.Bench(rate=250.0, noise=1e-2, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
BOTH = (rig.CubicStiffness(2.5e11), rig.CoulombFriction(4.0))


@pytest.fixture(scope="module")
def thin(simulated):
    """Six records of three seconds each, of a plant with two effects that the declared model lacks."""
    return simulated(LINEAR.plus(*BOTH), PLAN, 2, BENCH, stiffness=("linear",), damping=("linear",))


def _superfluous(campaign, start, *names):
    found = fit(start, campaign, integrator=Integrator())
    doubtful = find_superfluous(found.estimate, names, Search(scales(campaign)))
    return None if doubtful is None else doubtful.effect


@pytest.mark.slow
def test_both_effects_are_named_although_the_first_makes_the_fit_good(thin):
    loop = close_loop(thin)
    first = loop.extensions[0].after.estimate
    assert first.chi2 / first.dof < Rules.good
    assert {finding.effect for finding in loop.findings} == {"coulomb_friction", "cubic_stiffness"}
    assert loop.verdict == "found"
    found = {entry.name: float(entry.value) for entry in loop.after.model.parameters}
    errors = loop.after.standard_errors
    for name, truth in (("coulomb_friction.force_level", 4.0), ("cubic_stiffness.coefficient", 2.5e11)):
        assert abs(found[name] - truth) < 3.5 * errors[name]


def test_what_the_plant_has_is_not_superfluous(thin):
    start = START.with_elements(CoulombFriction(3.0, 2e-4), CubicStiffness(1e11))
    assert _superfluous(thin, start, "coulomb_friction", "cubic_stiffness") is None


def test_what_the_plant_lacks_is_superfluous(thin):
    start = START.with_elements(MaxwellBranch(5e3, 0.03), CoulombFriction(3.0, 2e-4), CubicStiffness(1e11))
    assert _superfluous(thin, start, "maxwell_branch", "coulomb_friction") == "maxwell_branch"


@pytest.mark.slow
def test_a_superfluous_finding_is_dropped_where_the_search_without_it_finds_nothing_better(thin, monkeypatch):
    def step(before, name, *added):
        after = fit(START.with_elements(MaxwellBranch(5e3, 0.03), *added), thin, integrator=Integrator())
        finding = Finding(name, (), 1e-9, 0.9, math.nan, (), "")
        return Extension(before, after, Verdict("found", finding, (), (), 0.0, (), {}, after, "It fits."))

    before = fit(START, thin, integrator=Integrator())
    first = step(before, "maxwell_branch")
    second = step(first.after, "cubic_stiffness", CoulombFriction(3.0, 2e-4), CubicStiffness(1e11))
    last = Verdict("none", None, (), (), 1.0, (), {}, None, "Nothing more.")
    verdicts = (((first, second), second.verdict), ((), first.verdict), ((), last))
    answers, asked = [(steps, Diagnosis(one)) for steps, one in verdicts], []

    def grow(*given):
        asked.append(given)
        return answers.pop(0)

    monkeypatch.setattr(_close_loop, "_grow", grow)
    extensions, (verdict, _) = _close_loop.search_effects(before, Search(scales(thin)), 3)
    # The last diagnosis is that of the smaller model.
    assert verdict is last
    assert asked[-1][0] is extensions[-1].after
    assert asked[-1][2:] == (2, ("maxwell_branch",))
    final = extensions[-1].after
    assert [one.effect for one in findings_in(final.model, extensions)] == ["cubic_stiffness"]
    assert final.stats.chi2 < second.after.stats.chi2 + 10.0
    assert float(final.model["coulomb_friction.force_level"]) == pytest.approx(4.0, rel=0.05)


@pytest.mark.slow
def test_a_refit_that_does_not_promise_to_catch_up_is_given_up_and_one_that_does_is_not(thin, monkeypatch):
    found = fit(START, thin, integrator=Integrator())
    search = Search(scales(thin), max_steps=40)
    test = score_test(found.estimate, search, absent_effects(found.model, search.scales))
    place = next(index for index, score in enumerate(test.scores) if score.element.name == "bouc_wen")

    def refitted(rival):
        return refit_candidate(test, place, search._replace(rival=rival))

    alone = refitted(None)
    assert alone.result == RESULTS.successful
    near = refitted(Rival(alone.chi2, 10.0))
    assert near.result == RESULTS.successful
    assert near.chi2 == pytest.approx(alone.chi2, abs=1.0)
    far = refitted(Rival(0.5 * alone.chi2, 10.0))
    assert far.result == RESULTS.outdone
    monkeypatch.setattr(_descent, "UNPROMISING", search.max_steps)
    assert far.steps < min(alone.steps, refitted(Rival(0.5 * alone.chi2, 10.0)).steps)


def _outdone(campaign, law, rival):
    """Which two effects outdo a law that a rival candidate stands behind."""
    found = fit(START, campaign, integrator=Integrator())
    search = Search(scales(campaign), max_steps=40)
    test = score_test(found.estimate, search, absent_effects(found.model, search.scales))
    place = {score.element.name: index for index, score in enumerate(test.scores)}
    usable = [
        Refit(
            test.scores[place[name]],
            refit_candidate(test, place[name], search),
            None,
        )
        for name in (law, rival)
    ]
    return find_simpler_pair(found.estimate, usable, search)


@pytest.mark.slow
def test_a_law_of_three_coefficients_has_to_beat_two_simple_effects(thin):
    words = _outdone(thin, "bouc_wen", "coulomb_friction")
    assert words is not None
    assert words.startswith(CoulombFriction.words)


@pytest.mark.slow
def test_a_true_law_of_three_coefficients_stands_against_two_simple_effects(simulated):
    law = rig.BoucWen(4e5, 4e3, -1.2e3)
    campaign = simulated(LINEAR.plus(law), PLAN, 4, BENCH, stiffness=("linear",), damping=("linear",))
    assert _outdone(campaign, "bouc_wen", "dahl_friction") is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "bench"),
    [
        (PLAN, BENCH),
        (
            rig.SteppedSine((50.0, 90.0, 140.0), (5.0, 5.4, 5.8, 6.2, 6.6, 7.0), cycles=8),
            dataclasses.replace(BENCH, noise=1e-5, output="displacement"),
        ),
    ],
    ids=["multisine", "stepped_sine"],
)
def test_a_spring_that_the_declared_model_lacks_is_found_from_afar(plan, bench, simulated):
    campaign = simulated(LINEAR, plan, 1, bench, stiffness=(), damping=("linear",))
    far = fit(Isolator(800.0, (LinearDamping(1.1e4),)), campaign, integrator=Integrator())
    assert far.estimate.chi2 / far.estimate.dof > 50.0
    verdict = diagnose(far)
    assert verdict.verdict == "found"
    assert verdict.finding.effect == "linear_stiffness"
    assert verdict.ranking[0].admissible
    best = verdict.ranking[0]
    assert abs(best.strength - 1.08e6) < 3.5 * best.strength_error
    assert verdict.refit.chi2 / verdict.refit.dof == pytest.approx(1.0, abs=Rules.good - 1.0)


@pytest.mark.slow
def test_no_bound_is_given_beside_a_fit_that_is_not_good(simulated):
    campaign = simulated(
        LINEAR.plus(rig.CoulombFriction(8.0)), PLAN, 3, BENCH, stiffness=("linear",), damping=("linear",)
    )
    found = fit(START, campaign, integrator=Integrator())
    assert found.estimate.chi2 / found.estimate.dof > Rules.good
    verdict = diagnose(found, excluded=("coulomb_friction", "dahl_friction", "bouc_wen"))
    assert verdict.bounds == {}
    assert np.isfinite(verdict.unexplained)
