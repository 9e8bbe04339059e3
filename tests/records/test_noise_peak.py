"""A resonance in the scatter is told from white noise and from transients."""

from pathlib import Path

import numpy as np
import pytest

from isojax import read_campaign, rig
from isojax.records import data_health, noise_peak

EXAMPLES = ["quiet", "friction", "relaxation", "asymmetry"]
STIFFNESS, MASS = 1.0805e6, 800.0
RESONANCE = np.sqrt(STIFFNESS / MASS) / (2 * np.pi)
STEPPED = rig.SteppedSine((60.0, 120.0), tuple(np.arange(4.0, 6.6, 0.4).tolist()), 20)
RANDOM = rig.Multisine((60.0,), 2.0, 12.0, 1.0, 24)
BENCH = rig.Bench(rate=250.0, noise=0.005)


def plant(damping: float = 8e3) -> rig.Plant:
    return rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(damping)), MASS)


def campaign(folder: Path, what: rig.Plant, plan: rig.Plan, seed: int = 1, bench: rig.Bench = BENCH):
    return read_campaign(rig.write_campaign(folder, what, plan, seed, "peak", bench))


@pytest.mark.slow
@pytest.mark.parametrize("plan", [STEPPED, RANDOM], ids=["stepped sine", "multisine"])
def test_a_floor_that_moves_unmeasured_shows_as_a_peak_at_the_resonance(plan, tmp_path):
    floor = rig.FloorMotion(1.0, 0.02, 0.5, 40.0, measured=False)
    peak = noise_peak(campaign(tmp_path, plant().plus(floor), plan))
    assert peak is not None
    assert peak.frequency == pytest.approx(RESONANCE, rel=0.15)
    # Density of the tones times the squared transmissibility there, over that of white noise.
    zeta = 8e3 / (2 * np.sqrt(STIFFNESS * MASS))
    expected = 0.02**2 / 39.5 * (1 + 1 / (4 * zeta**2)) / (BENCH.noise**2 / 125.0)
    assert 0.4 < peak.height / expected < 2.5
    # Half the power of a resonance lies within its half-power band: pi / 2 times width times height.
    power = expected * BENCH.noise**2 / 125.0 * 0.5 * np.pi * 2 * zeta * RESONANCE
    assert 0.5 < peak.rms / np.sqrt(power) < 1.5


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("plan", [STEPPED, RANDOM], ids=["stepped sine", "multisine"])
def test_white_noise_is_silent(plan, seed, tmp_path):
    assert noise_peak(campaign(tmp_path, plant(), plan, seed)) is None


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_examples_are_silent(example, shared_data):
    assert data_health(read_campaign(shared_data / "examples" / example)).noise_peak is None


def test_dwells_that_still_ring_are_no_noise(tmp_path):
    assert noise_peak(campaign(tmp_path, plant(damping=1.2e3), STEPPED)) is None


@pytest.mark.slow
def test_a_measured_floor_is_left_to_the_diagnosis(tmp_path):
    floor = rig.FloorMotion(1.0, 0.02, 0.5, 40.0)
    held = campaign(tmp_path, plant().plus(floor), STEPPED)
    assert noise_peak(held) is not None
    assert data_health(held).noise_peak is None
