"""Answers about a further record: its own stiffness, and the calibration of its force."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import isojax as ij
from isojax._cli import main
from isojax.demo import campaign_folder

FORCE, FREQUENCY = 60.0, 5.0
STIFFNESS = "linear_stiffness.coefficient"


@pytest.fixture(scope="module")
def fit():
    campaign = ij.read_campaign(campaign_folder())
    return ij.fit(ij.classical_guess(campaign).model, campaign)


def variance_of(fit, name):
    return fit.covariance[fit.free.index(name), fit.free.index(name)]


def test_the_stiffness_of_a_further_record_deviates_by_its_scatter(fit):
    found = ij.next_record(fit)
    own = variance_of(found, STIFFNESS) - variance_of(fit, STIFFNESS)
    assert np.sqrt(own) == pytest.approx(found.scatter * float(fit.model[STIFFNESS]), rel=1e-9)
    # Few records show the scatter badly: a further one may deviate by more than their own rms.
    assert found.scatter > fit.stats.stiffness_scatter
    others = [name for name in fit.free if name != STIFFNESS]
    assert [variance_of(found, name) for name in others] == [variance_of(fit, name) for name in others]


def test_intervals_of_any_confidence_are_those_of_the_scatters_that_the_records_allow(fit):
    law, found = fit.mixture, ij.next_record(fit)
    place, value = fit.free.index(STIFFNESS), float(fit.model[STIFFNESS])
    spread = np.sqrt(law.covariances[:, place, place] + (law.scatters * value) ** 2)

    def beyond(width, level):
        sides = [norm.sf(width, sign * law.means[:, place], spread) for sign in (1.0, -1.0)]
        return float(law.weights @ (sides[0] + sides[1])) - (1.0 - level)

    for level in (0.8, 0.95, 0.99):
        answer = ij.uncertainty(found, lambda model: model[STIFFNESS], confidence=level)
        exact = brentq(beyond, 0.0, 0.5 * value, args=(level,))
        np.testing.assert_allclose(answer.interval - value, [-exact, exact], rtol=0.03)


def test_where_nothing_follows_a_condition_the_errors_are_as_given(fit):
    found = ij.next_record(fit)
    np.testing.assert_array_equal(ij.models.fit_at(found).covariance, found.covariance)


def test_a_force_known_to_a_per_cent_is_a_linear_amplitude_known_to_a_per_cent(fit):
    omega = 2.0 * np.pi * FREQUENCY

    def amplitude(model):
        stiffness = model[STIFFNESS] - model.mass * omega**2
        return FORCE / jnp.hypot(stiffness, omega * model["linear_damping.coefficient"])

    plain, calibrated = (
        ij.uncertainty(ij.next_record(fit, calibration=share), amplitude) for share in (0.0, 0.01)
    )
    added = np.sqrt(float(calibrated.standard_error) ** 2 - float(plain.standard_error) ** 2)
    assert added == pytest.approx(0.01 * float(plain.value), rel=1e-9)


def test_a_saved_fit_knows_the_scatter_too(fit, tmp_path):
    fit.save(tmp_path / "fit.json")
    again, found = ij.next_record(ij.load_fit(tmp_path / "fit.json")), ij.next_record(fit)
    np.testing.assert_array_equal(again.covariance, found.covariance)
    content = json.loads((tmp_path / "fit.json").read_text())
    del content["statistics"]["next_stiffness_scatter"]
    (tmp_path / "old.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match="older version does not hold the scatter"):
        ij.next_record(ij.load_fit(tmp_path / "old.json"))


def test_the_map_of_the_command_line_takes_its_chances_from_a_further_record(
    fit, tmp_path, monkeypatch, capsys
):
    fit.save(tmp_path / "fit.json")
    ij.save_model(fit.model, tmp_path / "model.json")
    taken = []

    def keep(model, *axes, fit, **named):
        taken.append(fit)
        raise ValueError("enough")

    monkeypatch.setattr("isojax.stability.stability_map", keep)
    command = [
        "map",
        str(tmp_path / "model.json"),
        *"--amplitudes 1 9 --frequencies 4 6 --quiet --out".split(),
    ]
    for words in ([], ["--next-record"], ["--next-record", "0.01"]):
        assert main([*command, str(tmp_path / "map"), *words]) == 2
    assert "enough" in capsys.readouterr().err
    plain, stiff, calibrated = (variance_of(one, STIFFNESS) for one in taken)
    assert stiff == variance_of(ij.next_record(fit), STIFFNESS)
    assert plain < stiff < calibrated


def test_it_says_what_it_holds(fit):
    words = str(ij.next_record(fit, calibration=0.01))
    assert "of a further record: stiffness scatters by" in words
    assert "force known to 1 %" in words
    assert "mass" in words


def test_one_record_shows_no_scatter(fit):
    single = fit.campaign.fit_records[:1]
    alone = ij.fit(fit.model, dataclasses.replace(fit.campaign, records=single), max_steps=8)
    with pytest.raises(ValueError, match="must rest on two records or more"):
        ij.next_record(alone)


def test_an_operating_condition_comes_last(fit):
    held = ij.models.FitAt(fit.model, fit.free, fit.covariance, fit.result)
    with pytest.raises(ValueError, match=r"Ask for the condition last: `fit_at\(next_record\(fit\), ...\)`"):
        ij.next_record(held)


@pytest.mark.parametrize("calibration", [-0.01, float("nan"), 5.0])
def test_a_calibration_is_a_share(fit, calibration):
    with pytest.raises(ValueError, match="`calibration` must be a share from 0 to below 1, but is "):
        ij.next_record(fit, calibration=calibration)
