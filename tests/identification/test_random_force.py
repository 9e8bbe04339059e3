"""A random force that reaches down to nothing, with an acceleration output; the response by SciPy."""

import numpy as np
import pytest
from scipy.signal import lsim

import isojax as ij

MASS, STIFFNESS, DAMPING, RATE, SECONDS, NOISE = 10.0, 9870.0, 40.0, 100.0, 20.0, 0.01

CAMPAIGN = """
[campaign]
title = "random force"
mass = 10.0
[input]
quantity = "force"
column = "force"
unit = "N"
[output]
quantity = "acceleration"
column = "acceleration"
unit = "m/s^2"
[sampling]
rate = 100.0
[[record]]
file = "first.npz"
role = "fit"
[[record]]
file = "second.npz"
role = "fit"
[[record]]
file = "third.npz"
role = "holdout"
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> ij.Campaign:
    folder = tmp_path_factory.mktemp("random")
    random = np.random.default_rng(11)
    count, finer = round(SECONDS * RATE), 16
    time = np.arange(count * finer) / (RATE * finer)
    for name in ("first", "second", "third"):
        # Lines of twice the length, so that the record is a cut of something longer, up to 20 Hz.
        lines = np.arange(1, round(20.0 * 2.0 * SECONDS)) / (2.0 * SECONDS)
        phases = random.uniform(0.0, 2.0 * np.pi, lines.size)
        spectrum = np.zeros(time.size + 1, complex)
        spectrum[1 : lines.size + 1] = np.exp(1j * phases)
        force = np.fft.irfft(spectrum, 2 * time.size)[: time.size]
        force *= 30.0 / np.std(force)
        plant = ([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]], [[0.0], [1.0 / MASS]])
        _, acceleration, _ = lsim((*plant, [plant[0][1]], [plant[1][1]]), force, time)
        noise = NOISE * random.standard_normal(count)
        np.savez(folder / f"{name}.npz", force=force[::finer], acceleration=acceleration[::finer] + noise)
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return ij.read_campaign(folder / "campaign.toml")


def test_the_start_is_not_swamped_by_the_ends_of_the_record(campaign: ij.Campaign):
    assert {record.kind for record in campaign.records} == {"broadband"}
    model = ij.classical_guess(campaign).model
    assert float(model["linear_stiffness.coefficient"]) == pytest.approx(STIFFNESS, rel=0.02)
    assert float(model["linear_damping.coefficient"]) == pytest.approx(DAMPING, rel=0.1)


@pytest.mark.slow
def test_the_loop_comes_to_none(campaign: ij.Campaign):
    loop = ij.close_loop(campaign)
    assert loop.verdict == "none"
    errors = loop.after.standard_errors
    found = float(loop.after.model["linear_stiffness.coefficient"])
    assert abs(found - STIFFNESS) < 4.0 * errors["linear_stiffness.coefficient"] + 1e-4 * STIFFNESS
    assert loop.after.errors["holdout"].chi2_per_dof == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_fit_that_went_astray_is_diagnosed_without_a_finding(campaign: ij.Campaign):
    # A twelfth of the stiffness: the search stops far off, and what rides along may run away.
    start = ij.classical_guess(campaign).model.replace(linear_stiffness__coefficient=STIFFNESS / 12.0)
    astray = ij.fit(start, campaign, max_steps=1)
    verdict = ij.diagnose(astray)
    assert verdict.verdict in ("found", "unexplained", "partly_explained")
