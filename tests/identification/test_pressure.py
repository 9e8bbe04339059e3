"""Coefficients that follow the chamber pressure of a record, on the simulated bench."""

import dataclasses
import tomllib

import numpy as np
import pytest
from scipy import stats

from isojax import inference, rig
from isojax.elements import CATALOGUE, CubicStiffness, LinearDamping, LinearStiffness
from isojax.health import DwellStability, dwell_stability
from isojax.identification import diagnose, extend, fit, load_fit, next_test, scales
from isojax.identification.experiment._candidate_experiments import repeated_campaign
from isojax.identification.experiment._simulated_records import blank_records
from isojax.identification.experiment._test_outline import find_test_outline
from isojax.identification.fitting._estimate import stiffness_scatter
from isojax.identification.jacobian import STIFFNESS_SCALE_UNIT
from isojax.identification.jacobian._channels import channel_table, effects_without_signal
from isojax.inference import design, next_record
from isojax.models import Isolator, fit_at
from isojax.records.noise._repeats import repeat_groups

REFERENCE = 2e5
TRUTH = {"pressure_stiffness": 5e5, "pressure_damping": 3e3, "pressure_cubic_stiffness": 6e10}
LAWS = {
    "pressure_stiffness": rig.PressureStiffness,
    "pressure_damping": rig.PressureDamping,
    "pressure_cubic_stiffness": rig.PressureCubicStiffness,
}
PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(1e11), rig.LinearDamping(8e3)))
START = Isolator(800.0, (LinearStiffness(1.05e6), CubicStiffness(1.2e11), LinearDamping(9e3)))
DECLARED = {"stiffness": ("linear", "cubic"), "damping": ("linear",)}
BENCH = rig.Bench(rate=200.0, noise=5e-3, drift=5e-4, force_noise=0.0, anti_alias=False, tolerance=1e-7)
RIVALS = ("pressure_stiffness", "pressure_damping", "stiffness_drift")
PLANS = tuple(
    rig.AtPressure(rig.Multisine((150.0, 600.0), 2.0, 14.0, period=2.0, periods=2, lines="full"), pressure)
    for pressure in (2e5, 2.4e5, 1.7e5)
)
OTHERS = tuple(name for name in CATALOGUE if name not in RIVALS)


def campaign_of_pressures(simulated, *hidden: str, seed: int = 4, bench: rig.Bench = BENCH):
    """Two levels at each of three pressures, which rise and fall in the course of the test."""
    plant = PLANT.plus(*(LAWS[name](TRUTH[name], REFERENCE) for name in hidden))
    return simulated(plant, PLANS, seed, bench, **DECLARED)


def test_changes_that_are_declared_are_recovered_within_their_errors(simulated):
    campaign = campaign_of_pressures(simulated, *LAWS)
    magnitudes = scales(campaign)
    assert magnitudes.pressure == pytest.approx(np.mean((1.7e5, 2e5, 2.4e5)))
    at_zero = (CATALOGUE[name].guess(dataclasses.replace(magnitudes, pressure=REFERENCE)) for name in LAWS)
    found = fit(START.with_elements(*at_zero), campaign)
    assert found.errors["fit"].chi2_per_dof < 1.05
    for name, truth in TRUTH.items():
        entry = found.parameters[f"{name}.change"]
        assert abs(entry.value - truth) < 3.0 * entry.standard_error
        assert entry.standard_error < 0.2 * truth


def test_a_change_that_is_not_declared_is_named(simulated):
    verdict = diagnose(fit(START, campaign_of_pressures(simulated, "pressure_stiffness")), excluded=OTHERS)
    assert verdict.verdict == "found"
    assert verdict.finding.effect == "pressure_stiffness"
    assert verdict.finding.indistinguishable in ((), ("pressure_stiffness",))


def test_a_change_that_is_no_straight_line_is_named_with_its_curvature(simulated):
    # (p/pr)^2 = (p0/pr)^2 (1 + 2 r + r^2) with r = p/p0 - 1: curvature a half, whatever the reference.
    plant = PLANT.plus(rig.PressureStiffness(5e5, REFERENCE, power=2.0))
    campaign = simulated(plant, PLANS, 4, BENCH, **DECLARED)
    fitted = fit(START, campaign)
    entries = extend(fitted, diagnose(fitted, excluded=OTHERS)).after.parameters
    mean = scales(campaign).pressure
    for name, truth in (("change", 2.0 * 5e5 * (mean / REFERENCE) ** 2), ("curvature", 0.5)):
        entry = entries[f"pressure_stiffness.{name}"]
        assert abs(entry.value - truth) < 3.0 * entry.standard_error
        assert entry.standard_error < 0.1 * truth


def test_pressure_that_changes_nothing_is_not_named(simulated):
    verdict = diagnose(fit(START, campaign_of_pressures(simulated)), excluded=OTHERS)
    assert verdict.verdict == "none"
    upper, _ = verdict.bounds["pressure_stiffness"]
    assert upper < 0.05 * 1.08e6


@pytest.mark.parametrize("seed", [4, 5])
def test_error_of_an_absent_change_allows_for_a_scatter_known_from_six_records(simulated, seed):
    campaign = campaign_of_pressures(simulated, seed=seed, bench=dataclasses.replace(BENCH, drift=3e-3))
    fitted = fit(START, campaign)
    verdict = diagnose(fitted, excluded=OTHERS)
    entry = next(one for one in verdict.ranking if one.effect == "pressure_stiffness")
    shares = [record.pressure / scales(campaign).pressure - 1.0 for record in campaign.records]
    own = fitted.estimate.point.nuisances.stiffness * STIFFNESS_SCALE_UNIT
    line = stats.linregress(shares, own)
    stiffness = float(fitted.model["linear_stiffness.coefficient"])
    student = stats.t.ppf(0.975, 4) * line.stderr * stiffness
    # The half-Cauchy prior makes the interval shorter; a scatter that counts as known, by a third.
    assert 0.8 < 1.96 * entry.strength_error / student < 1.0


def test_records_at_different_pressures_are_no_repeats_and_show_no_scatter(simulated):
    campaign = campaign_of_pressures(simulated, "pressure_stiffness")
    assert not any(repeat_groups(campaign.records).values())
    found = fit(START, campaign).estimate
    scatter = stiffness_scatter(campaign.records, found.point, 1.0)
    # The stiffness differs by a tenth between the pressures, and by 5e-4 at one of them.
    assert scatter < 5e-3
    unstated = tuple(dataclasses.replace(record, pressure=None) for record in campaign.records)
    assert stiffness_scatter(unstated, found.point, 1.0) > 0.02


def test_a_pressure_is_followed_only_where_it_is_stated_and_differs(simulated):
    records = campaign_of_pressures(simulated).records
    assert not {*LAWS} & {*effects_without_signal(records)}
    assert {*LAWS} <= {*effects_without_signal(records[:2])}
    np.testing.assert_array_equal(channel_table("pressure", records[2], "linear", 1, 0.0), 2.4e5)
    with pytest.raises(ValueError, match="must state its pressure"):
        channel_table("pressure", dataclasses.replace(records[0], pressure=None), "linear", 1, 0.0)


def test_dwells_are_compared_with_orbits_at_their_own_pressure(simulated, monkeypatch):
    plan = rig.SteppedSine((150.0,), (4.5, 6.5), 12, ("forward",))
    plans = tuple(rig.AtPressure(plan, pressure) for pressure in (2.4e5, 1.7e5, 2.4e5))
    records = [one for part in plans for one in simulated(PLANT, part, 4, BENCH, **DECLARED).records]
    campaign = dataclasses.replace(simulated(PLANT, plan, 4, BENCH, **DECLARED), records=tuple(records))
    follows = START.with_elements(CATALOGUE["pressure_stiffness"](5e5, REFERENCE))

    def held(model, measured):
        stiffness = float(model["linear_stiffness.coefficient"])
        return [DwellStability(m.record.name, None, m.dwell, 1.0, stiffness, 0.0, 0.0) for m in measured]

    monkeypatch.setattr("isojax.health._dwell_stability._held_against_orbits", held)
    high, low = 1.05e6 + 0.2 * 5e5, 1.05e6 - 0.15 * 5e5
    seen = [one.spectral_radius for one in dwell_stability(follows, campaign)]
    np.testing.assert_allclose(seen, [high] * 2 + [low] * 2 + [high] * 2)
    assert {one.spectral_radius for one in dwell_stability(START, campaign)} == {1.05e6}


def test_the_next_record_is_planned_at_a_pressure_and_shrinks_the_error_as_predicted(simulated, tmp_path):
    """On the rig: a multisine at a pressure beyond the others', measured and fitted beside them."""
    pressure, seconds, level = 2.8e5, 4.0, 600.0
    campaign = campaign_of_pressures(simulated, "pressure_stiffness")
    change = CATALOGUE["pressure_stiffness"].guess(dataclasses.replace(scales(campaign), pressure=REFERENCE))
    found = fit(START.with_elements(change), campaign)
    plan = next_test(
        found,
        lambda model: model["pressure_stiffness.change"],
        seconds=seconds,
        levels=level,
        bands=(2.0, 14.0),
        conditions=[{"pressure": REFERENCE}, {"pressure": pressure}],
        farthest=3.0,
    )
    # What is asked at a pressure says where that lies beyond those of the records, also of a saved fit.
    found.save(tmp_path / "fit.json")
    for known in (found, load_fit(tmp_path / "fit.json"), next_record(found)):
        assert fit_at(known, pressure=2.4e5).untested == ""
        words = str(fit_at(known, pressure=2.8e5))
        assert "pressure 2.8e+05 Pa lies beyond the 1.7e+05 to 2.4e+05 Pa" in words
    stiff = inference.at_least(lambda model: model["linear_stiffness.coefficient"], 1.25e6)
    stiffer = design(found, None, stiff, free={"pressure": (1.7e5, 4e5)}, scan=2)
    assert "lies beyond the 1.7e+05 to 2.4e+05 Pa" in str(stiffer)
    # The farther from the others, the more a record tells of a slope.
    assert [one.experiment.conditions for one in plan.proposals[:3]] == [((("pressure", pressure),),)] * 3
    best = next(one for one in plan.proposals if one.experiment.waveform == "multisine")
    record = tomllib.loads(best.declaration)["record"][0]
    assert record["pressure"] == pressure
    errors = []
    for seed in range(3):
        further = rig.AtPressure(
            rig.Multisine((level,), 2.0, 14.0, period=2.0, periods=2, lines="full"), pressure
        )
        plant = PLANT.plus(rig.PressureStiffness(TRUTH["pressure_stiffness"], REFERENCE))
        own = simulated(plant, further, 30 + seed, BENCH, **DECLARED)
        records = (*campaign.records, *own.records)
        refit = fit(found.model, dataclasses.replace(campaign, records=records))
        errors.append(refit.parameters["pressure_stiffness.change"].standard_error)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(float(best.quantity_errors[0]), rel=0.2)
    assert best.shrinkage < 0.9


def test_a_repetition_of_the_campaign_has_all_its_levels_at_each_of_its_pressures(simulated):
    campaign = campaign_of_pressures(simulated)
    outline = find_test_outline(campaign, 1, every_sample=True)
    records = blank_records(repeated_campaign(campaign, outline))
    pairs = [(round(record.level), record.pressure) for record in records]
    assert pairs == [(level, pressure) for pressure in (1.7e5, 2e5, 2.4e5) for level in (150, 600)]
