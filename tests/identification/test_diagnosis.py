"""From a residual to the missing effect: the score test, the verdict, the loop."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from isojax import rig
from isojax._quantities import CONDITIONS
from isojax._results import RESULTS
from isojax.elements import (
    CATALOGUE,
    AddedMass,
    CubicStiffness,
    InputGain,
    LinearDamping,
    LinearStiffness,
    SensorGain,
)
from isojax.identification import close_loop, diagnose, extend, fit, residual, scales
from isojax.identification.diagnosis._score import absent_effects, score_test
from isojax.identification.fitting import Search
from isojax.models import Integrator, Isolator

LINEAR = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4)))
PLAN = rig.Multisine(
    (40.0, 70.0, 110.0), 2.0, 14.0, period=2.0, periods=4, lines="full", holdout_levels=(90.0,)
)
BENCH = rig.Bench(rate=250.0, noise=5e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
ONE_STEP = Integrator()


def _campaign(simulated, *effects, **changes):
    return simulated(
        LINEAR.plus(*effects), PLAN, 7, BENCH, stiffness=("linear",), damping=("linear",), **changes
    )


def _scores(found):
    magnitudes = scales(found.campaign)
    return score_test(found.estimate, Search(magnitudes), absent_effects(found.model, magnitudes))


@pytest.mark.parametrize(
    "effect",
    [
        rig.CubicStiffness(2.5e11),
        rig.CoulombFriction(3.0),
        rig.MaxwellBranch(8e4, 0.03),
        rig.QuadraticStiffness(6e7),
        rig.InputDelay(3e-4),
        rig.PositionDamping(1.5e10),
    ],
    ids=lambda effect: effect.name,
)
def test_the_true_effect_has_the_largest_score(effect, simulated):
    found = fit(START, _campaign(simulated, effect), integrator=ONE_STEP)
    test = _scores(found)
    likely = {score.element.name for score in test.scores if abs(score.z) > 0.97 * abs(test.scores[0].z)}
    assert effect.name in likely
    mine = next(score for score in test.scores if score.element.name == effect.name)
    assert mine.p_value < 1e-6
    assert mine.admissible


@pytest.fixture(scope="module")
def innocent(simulated):
    """A fit that lacks nothing."""
    return fit(START, _campaign(simulated), integrator=ONE_STEP)


@pytest.mark.slow
def test_scores_of_an_innocent_model_are_standard_normal(simulated, unchecked):
    """New noise on the same motion moves nothing but the residual."""
    exact = simulated(
        LINEAR,
        dataclasses.replace(PLAN, periods=2, holdout_levels=()),
        7,
        dataclasses.replace(BENCH, noise=0.0),
        output={"noise": 5e-3},
        stiffness=("linear",),
        damping=("linear",),
    )
    rng = np.random.default_rng(21)
    values, chances = [], []
    for _ in range(25):
        records = tuple(
            dataclasses.replace(record, output=record.output + 5e-3 * rng.standard_normal(record.output.size))
            for record in exact.records
        )
        found = fit(START, dataclasses.replace(exact, records=records), integrator=ONE_STEP)
        test = _scores(found)
        chosen = [
            s
            for s in test.scores
            if s.element.name in ("quadratic_stiffness", "input_delay", "sensor_offset")
        ]
        values += [score.z for score in chosen]
        chances.append(next(score.p_value for score in test.scores if score.admissible))
    assert stats.kstest(values, "norm").pvalue > 0.01
    assert stats.kstest(chances, "uniform").pvalue > 0.01


def test_an_exactly_degenerate_effect_is_hidden(simulated):
    campaign = _campaign(simulated, mass_free=True)
    found = fit(START, campaign, integrator=ONE_STEP)
    magnitudes = scales(campaign)
    test = score_test(found.estimate, Search(magnitudes), (AddedMass(0.0), InputGain(0.0), SensorGain(0.0)))
    assert {"added_mass", "input_gain", "sensor_gain"} == set(test.hidden)
    assert test.scores == ()


def test_mass_and_gain_errors_look_alike(innocent):
    magnitudes = scales(innocent.campaign)
    test = score_test(
        innocent.estimate, Search(magnitudes), (AddedMass(0.0), InputGain(0.0), SensorGain(0.0))
    )
    assert len(test.scores) == 3
    assert np.abs(test.likeness).min() > 0.999


def test_strength_by_one_linear_step_is_the_true_one_where_the_effect_is_small(simulated):
    found = fit(START, _campaign(simulated, rig.QuadraticStiffness(6e6)), integrator=ONE_STEP)
    score = next(s for s in _scores(found).scores if s.element.name == "quadratic_stiffness")
    assert abs(score.strength - 6e6) < 3.5 * score.error
    # The score is at the fit's own scatter of the stiffness, the error over all that two records allow.
    known = score.strength / score.z * np.sqrt(found.estimate.inflation)
    assert known < score.error < 1.02 * known


def test_an_inadmissible_sign_is_flagged_and_never_found(simulated):
    campaign = _campaign(simulated, rig.PositionDamping(-1.5e10))
    found = fit(START, campaign, integrator=ONE_STEP)
    score = next(s for s in _scores(found).scores if s.element.name == "position_damping")
    assert score.z < -5.0
    assert not score.admissible
    verdict = diagnose(found)
    assert verdict.finding is None or verdict.finding.effect != "position_damping"
    assert not next(c for c in verdict.ranking if c.effect == "position_damping").admissible


def test_nothing_is_found_where_nothing_is_missing(innocent):
    verdict = diagnose(innocent)
    assert verdict.verdict == "none"
    assert verdict.finding is None
    assert verdict.refit is None
    with pytest.raises(ValueError, match="must have found an effect"):
        extend(innocent, verdict)


def test_bounds_of_an_innocent_model_hold_zero_and_carry_units(innocent):
    verdict = diagnose(innocent)
    assert set(verdict.bounds) | set(verdict.hidden) == set(CATALOGUE) - {
        "linear_stiffness",
        "linear_damping",
        # It is a part of dry friction; this drive is no sine; no floor was measured, and no condition stated.
        "asymmetric_friction",
        "drive_harmonics",
        "floor_motion",
        *(name for name, kind in CATALOGUE.items() if set(CONDITIONS).intersection(kind.channels)),
    }
    upper, unit = verdict.bounds["coulomb_friction"]
    assert 0.0 < upper < 2.0
    assert unit == "N"


@pytest.mark.parametrize(
    "effect",
    [
        rig.CoulombFriction(4.0),
        pytest.param(rig.MaxwellBranch(1.5e5, 0.03), marks=pytest.mark.slow),
        pytest.param(rig.QuadraticStiffness(8e7), marks=pytest.mark.slow),
    ],
    ids=lambda effect: effect.name,
)
def test_the_loop_names_what_is_missing_and_the_error_falls(effect, simulated):
    campaign = _campaign(simulated, effect)
    loop = close_loop(campaign)
    names = [finding.effect for finding in loop.findings]
    alike = set(names).union(*(finding.indistinguishable for finding in loop.findings))
    assert effect.name in alike
    assert names[0] == effect.name
    assert loop.verdict in ("found", "partly_explained")
    before, after = loop.before.errors["holdout"], loop.after.errors["holdout"]
    assert after.chi2_per_dof - 1.0 < 0.3 * (before.chi2_per_dof - 1.0)


@pytest.mark.slow
def test_an_effect_outside_the_catalogue_is_not_passed_off_as_another(simulated):
    campaign = _campaign(simulated, rig.QuadraticStiffness(8e7))
    found = fit(START, campaign, integrator=ONE_STEP)
    # A gas spring has a quadratic part, and is this effect by another name.
    verdict = diagnose(found, excluded=("quadratic_stiffness", "polytropic_gas"))
    assert verdict.verdict != "found"
    assert verdict.verdict != "none"


def test_held_out_records_never_move_a_verdict(simulated):
    campaign = _campaign(simulated, rig.CoulombFriction(4.0), output={"noise": None})
    spoiled = tuple(
        dataclasses.replace(record, output=1.3 * record.output) if record.role == "holdout" else record
        for record in campaign.records
    )
    first, second = (
        diagnose(fit(START, one, integrator=ONE_STEP))
        for one in (campaign, dataclasses.replace(campaign, records=spoiled))
    )
    assert first.verdict == second.verdict
    assert [c.z for c in first.ranking] == [c.z for c in second.ranking]
    assert first.refit.chi2 == second.refit.chi2


def test_a_failed_fit_is_not_diagnosed(simulated):
    campaign = _campaign(simulated)
    start = START.with_elements(CubicStiffness(-1e15))
    failed = fit(start, campaign, integrator=ONE_STEP, fixed=("cubic_stiffness.coefficient",))
    assert failed.result == RESULTS.not_finite
    verdict = diagnose(failed)
    assert verdict.verdict == "unexplained"
    assert verdict.finding is None
    assert "fit failed" in verdict.reason


def test_the_residual_of_an_innocent_model_is_white(innocent):
    left = residual(innocent)
    assert np.all(left.noise_floor == 5e-3)
    assert len(left.values) == 3
    assert left.whiteness.min() > 0.9
    # Three bands of fifty lags each, one in a hundred outside.
    outside = np.abs(left.cross_correlation) > left.band[:, None]
    assert outside.mean() < 0.05
    np.testing.assert_allclose(left.autocorrelation[:, 25], 1.0)
    for record, values in zip(innocent.campaign.fit_records, left.values, strict=True):
        assert np.std(values[record.settle :]) == pytest.approx(5e-3, rel=0.1)


def test_the_residual_of_a_model_that_lacks_a_spring_law_is_not_white(simulated):
    found = fit(START, _campaign(simulated, rig.CubicStiffness(2.5e11)), integrator=ONE_STEP)
    assert residual(found).whiteness.min() < 0.7
