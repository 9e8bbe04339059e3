"""A tone that is not locked to the drive: found where there is one, not found in noise of any colour."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy import signal
from test_lack_of_fit import RATE, periodic, stepped, swept

import isojax as ij
from isojax import rig
from isojax.identification.fitting._unlocked_tone import strongest_tone
from isojax.reporting.page import result_dict
from isojax.reporting.words import verdict_sentence

FREQUENCY = 12.397
"""No multiple of any dwell's frequency, and between two lines."""


def resonant(rng, size):
    """Floor noise through an isolator at 4.9 Hz with 6 % of critical damping, and sensor noise."""
    turn, decay = 2 * np.pi * 4.9 / RATE, np.exp(-2 * np.pi * 4.9 * 0.06 / RATE)
    poles = [1.0, -2.0 * decay * np.cos(turn), decay**2]
    slow = signal.lfilter([1.0], poles, rng.standard_normal(size + 2000))[2000:]
    return 0.01 * (slow / np.std(slow) + 0.3 * rng.standard_normal(size))


COLOURS = {
    "white": lambda rng, size: 0.01 * rng.standard_normal(size),
    "AR(0.9)": lambda rng, size: 0.01 * signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal(size)),
    "resonant": resonant,
}


@pytest.mark.parametrize("excitation", [stepped, swept, periodic])
@pytest.mark.parametrize("colour", COLOURS.values(), ids=COLOURS)
def test_noise_of_no_colour_passes_for_a_tone(excitation, colour, unchecked):
    rng = np.random.default_rng(11)
    chances = [
        strongest_tone([excitation(lambda size: colour(rng, size), lambda _: 0.0) for _ in range(3)]).p_value
        for _ in range(100)
    ]
    assert np.mean(np.array(chances) < 0.05) < 0.15
    assert np.mean(np.array(chances) < 0.01) < 0.06


@pytest.mark.parametrize("excitation", [stepped, swept, periodic])
def test_a_tone_is_found_with_its_frequency_and_size(excitation, unchecked):
    rng = np.random.default_rng(12)
    runs = []
    for phase in (0.3, 2.0, 4.0):

        def noisy(size, phase=phase):
            tone = np.sin(2.0 * np.pi * FREQUENCY * np.arange(size) / RATE + phase)
            return 0.01 * rng.standard_normal(size) + 0.004 * tone

        runs.append(excitation(noisy, lambda _: 0.0))
    tone = strongest_tone(runs)
    assert tone.p_value < 1e-6
    assert tone.frequency == pytest.approx(FREQUENCY, abs=RATE / max(run.record.output.size for run in runs))
    assert tone.rms == pytest.approx(0.004 / np.sqrt(2.0), rel=0.2)


@pytest.mark.parametrize("excitation", [stepped, periodic])
def test_what_repeats_with_the_drive_is_no_tone(excitation):
    rng = np.random.default_rng(13)
    run = excitation(lambda size: 0.01 * rng.standard_normal(size), lambda drive: 0.01 * drive**3)
    assert strongest_tone([run]).p_value > 0.01


@dataclass(frozen=True)
class Machine(rig.Law):
    """A machine that shakes the mass and is recorded nowhere."""

    name: ClassVar[str] = "machine"
    level: float

    def force(self, t, x, v, z, s):
        """Force in N."""
        return self.level * np.sin(2.0 * np.pi * FREQUENCY * t)


def diagnosed(folder, *laws):
    plant = rig.Plant((rig.LinearStiffness(8e5), rig.LinearDamping(4e3), *laws))
    plan = rig.SteppedSine((30.0, 60.0), (4.6, 4.9, 5.2), 20, ("forward",))
    declared = ("linear_stiffness", "linear_damping")
    return ij.close_loop(
        rig.write_campaign(folder, plant, plan, 1, "shaken", rig.Bench(rate=250.0), declared=declared)
    ).loop


@pytest.mark.slow
def test_a_machine_nearby_is_reported(tmp_path):
    loop = diagnosed(tmp_path, Machine(25.0))
    assert loop.verdict == "unexplained"
    assert not loop.findings
    assert loop.last.tone.frequency == pytest.approx(FREQUENCY, abs=0.05)
    assert "12.39 Hz" in loop.last.reason
    sentence = verdict_sentence(loop)
    assert "tone at 12.39 Hz" in sentence
    assert "not locked to the drive" in sentence
    assert result_dict(loop)["tone"]["frequency"] == loop.last.tone.frequency
    # Off resonance the mass follows the force: m a = F / |1 - (f0 / f)^2|.
    spring = 8e5 / (2.0 * np.pi * FREQUENCY) ** 2
    assert loop.last.tone.rms == pytest.approx(25.0 / (800.0 - spring) / np.sqrt(2.0), rel=0.2)


@pytest.mark.slow
def test_nothing_is_reported_without_it(tmp_path):
    loop = diagnosed(tmp_path)
    assert loop.verdict == "none"
    assert loop.last.tone is None
