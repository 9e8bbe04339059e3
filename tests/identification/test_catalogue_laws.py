"""Springs with gaps, the quintic spring and falling friction are recovered from the simulated bench."""

import numpy as np
import pytest

from isojax import rig
from isojax._results import RESULTS
from isojax.elements import CATALOGUE, CubicStiffness, LinearDamping, LinearStiffness
from isojax.identification import diagnose, fit, scales
from isojax.identification.diagnosis._refit import refit_candidate
from isojax.identification.diagnosis._score import score_test
from isojax.identification.fitting import Search
from isojax.models import Isolator

PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(1e11), rig.LinearDamping(8e3)))
START = Isolator(800.0, (LinearStiffness(1.05e6), CubicStiffness(1.2e11), LinearDamping(9e3)))
PLAN = rig.Multisine((150.0, 600.0), 2.0, 14.0, period=2.0, periods=2, lines="full")
RIVALS = ("quintic_stiffness", "stribeck_friction", "end_stop", "freeplay", "quadratic_stiffness")


def _measured(simulated, effect, rate=200.0, plan=PLAN):
    """A plant with one effect, on the bench."""
    bench = rig.Bench(rate=rate, noise=5e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
    return simulated(PLANT.plus(effect), plan, 3, bench, stiffness=("linear", "cubic"), damping=("linear",))


def _scored(simulated, effect, rate=200.0):
    """Score test of a few candidates on a plant with one effect."""
    campaign = _measured(simulated, effect, rate)
    found, magnitudes = fit(START, campaign), scales(campaign)
    probes = tuple(probe for name in RIVALS for probe in CATALOGUE[name].grid(magnitudes))
    return score_test(found.estimate, Search(magnitudes), probes), magnitudes


def _refitted(test, magnitudes, name):
    index = next(place for place, score in enumerate(test.scores) if score.element.name == name)
    found = refit_candidate(test, index, Search(magnitudes, max_steps=40))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (rig.QuinticStiffness(3e15), {"quintic_stiffness.coefficient": 3e15}),
        (
            rig.EndStop(2e5, 1e-3),
            {"end_stop.stiffness": 2e5, "end_stop.gap": 1e-3, "end_stop.side": 0.0},
        ),
        (rig.EndStop(2e5, 1e-3, -1.0), {"end_stop.stiffness": 1e5, "end_stop.gap": 1e-3}),
        (rig.Freeplay(1e5, 5e-4), {"freeplay.lost_stiffness": 1e5, "freeplay.gap": 5e-4}),
    ],
    ids=["quintic", "two stops", "one stop", "play"],
)
def test_a_spring_law_is_recovered_with_its_shape(effect, expected, simulated):
    test, magnitudes = _scored(simulated, effect)
    leader = test.scores[0].element.name
    found = _refitted(test, magnitudes, effect.name)
    if leader not in {effect.name, "end_stop", "freeplay"}:
        # A score knows no onset: one stop looks like a square of x until it is refitted.
        assert found.chi2 < _refitted(test, magnitudes, leader).chi2 - 100.0
    assert found.chi2 / found.dof < 1.05
    for name, truth in expected.items():
        error = float(found.uncertainty.standard_error[found.names.index(name)])
        assert abs(float(found.model[name]) - truth) < 4.0 * error, name


@pytest.mark.slow
def test_play_and_a_stop_explain_a_record_alike(simulated):
    test, magnitudes = _scored(simulated, rig.Freeplay(1e5, 5e-4))
    names = [score.element.name for score in test.scores[:2]]
    assert set(names) == {"end_stop", "freeplay"}
    assert test.likeness[0, 1] > 0.9999
    play, stop = (_refitted(test, magnitudes, name) for name in ("freeplay", "end_stop"))
    # One coefficient more, the side, is worth no more than chance.
    assert 0.0 <= play.chi2 - stop.chi2 + 2.0 < 15.0
    np.testing.assert_allclose(
        float(play.model["freeplay.gap"]), float(stop.model["end_stop.gap"]), rtol=0.02
    )


@pytest.mark.slow
def test_play_is_reported_with_the_stop_even_where_the_search_for_the_stop_fails(simulated, monkeypatch):
    def lost(test, index, *others):
        if test.scores[index].element.name == "end_stop":
            return test.fitted._replace(result=RESULTS.outdone)
        return refit_candidate(test, index, *others)

    monkeypatch.setattr("isojax.identification.diagnosis._candidate_refits.refit_candidate", lost)
    # Enough levels that the gap carries over to each from the others.
    plan = rig.Multisine((300.0, 450.0, 600.0), 2.0, 14.0, period=2.0, periods=4, lines="full")
    campaign = _measured(simulated, rig.Freeplay(1e5, 5e-4), plan=plan)
    excluded = tuple(name for name in CATALOGUE if name not in RIVALS)
    verdict = diagnose(fit(START, campaign), excluded=excluded)
    assert verdict.finding is not None
    assert verdict.finding.effect == "freeplay"
    assert verdict.indistinguishable == ("end_stop",)
    (stop,) = verdict.finding.rivals
    assert float(stop.gap) == pytest.approx(5e-4, rel=0.05)
    assert float(stop.stiffness) == pytest.approx(1e5, rel=0.2)
