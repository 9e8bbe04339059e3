"""Dwells and kinds are found in the input alone, as a schedule would give them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from isojax import read_campaign
from isojax.records import detect_kind, segment_dwells

RATE = 1000.0


def stepped_sine(
    frequencies: np.ndarray, cycles: int, noise: float, seed: int, jump: float = 0.0
) -> tuple[np.ndarray, list[float]]:
    """A stepped sine with second and third harmonics, a falling amplitude, and its true starts in seconds."""
    random = np.random.default_rng(seed)
    starts = np.concatenate([[0.0], np.cumsum(cycles / frequencies)])
    time = np.arange(int(starts[-1] * RATE)) / RATE
    which = np.searchsorted(starts, time, side="right") - 1
    phase = 2.0 * np.pi * frequencies[which] * (time - starts[which]) + jump * which
    amplitude = 1.0 - 0.3 * np.sin(np.pi * time / time[-1])
    signal = amplitude * (np.sin(phase) + 0.04 * np.sin(2 * phase + 1.0) + 0.06 * np.sin(3 * phase))
    return signal + noise * random.normal(size=time.size), list(starts[:-1])


@pytest.mark.parametrize(
    "frequencies", [np.arange(4.0, 7.01, 0.2), np.arange(7.0, 3.99, -0.2), np.arange(20.0, 22.01, 0.25)]
)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_dwells_of_a_stepped_sine_are_found(frequencies: np.ndarray, noise: float) -> None:
    signal, starts = stepped_sine(frequencies, 20, noise, seed=3)
    dwells = segment_dwells(signal, RATE)
    np.testing.assert_allclose([dwell.frequency for dwell in dwells], frequencies, atol=0.005)
    late = np.array([dwell.start / RATE for dwell in dwells]) - starts
    assert np.max(np.abs(late) * frequencies) < 1.05
    assert dwells[-1].stop == signal.size


def test_a_phase_jump_between_dwells_does_no_harm() -> None:
    signal, _ = stepped_sine(np.array([5.0, 5.5, 6.0]), 20, 0.01, seed=4, jump=2.0)
    found = [dwell.frequency for dwell in segment_dwells(signal, RATE)]
    np.testing.assert_allclose(found, [5.0, 5.5, 6.0], atol=0.002)


def test_a_pause_between_dwells_belongs_to_none() -> None:
    time = np.arange(4000) / RATE
    pause = np.zeros(2500)
    signal = np.concatenate([np.sin(2 * np.pi * 5 * time), pause, np.sin(2 * np.pi * 8 * time)])
    first, second = segment_dwells(signal + 1e-3 * np.random.default_rng(0).normal(size=signal.size), RATE)
    assert first.frequency == pytest.approx(5.0, abs=0.002)
    assert second.frequency == pytest.approx(8.0, abs=0.002)
    assert first.stop == pytest.approx(4000, abs=130)
    assert second.start == pytest.approx(6500, abs=130)


@pytest.mark.parametrize("example", ["quiet", "friction", "relaxation", "asymmetry"])
def test_the_examples_are_segmented_as_their_schedules_say(example: str, shared_data: Path) -> None:
    campaign = read_campaign(shared_data / "examples" / example)
    for record in campaign.records:
        dwells, kind = detect_kind(record.input, record.output, record.rate, campaign.mass)
        assert kind == "stepped_sine"
        assert len(dwells) == len(record.dwells) == 16
        for found, scheduled in zip(dwells, record.dwells, strict=True):
            assert abs(found.frequency - scheduled.frequency) < 0.001
            assert abs(found.start - scheduled.start) * scheduled.frequency / record.rate < 0.1
            assert abs(found.stop - scheduled.stop) * scheduled.frequency / record.rate < 0.1


def test_the_reader_segments_where_there_is_no_schedule(shared_data: Path, tmp_path: Path) -> None:
    source = shared_data / "examples" / "quiet"
    text = (source / "campaign.toml").read_text().split("[[record]]")
    (tmp_path / "campaign.toml").write_text(
        text[0] + f'[[record]]\nfile = "{source}/fit_60N_forward_0.npz"\nrole = "fit"\n'
    )
    record = read_campaign(tmp_path).records[0]
    assert record.kind == "stepped_sine"
    np.testing.assert_allclose([d.frequency for d in record.dwells], np.arange(4.0, 7.01, 0.2), atol=0.001)


def oscillator(force: np.ndarray, frequency: float = 6.0, damping: float = 0.03) -> np.ndarray:
    """Displacement of a linear oscillator of mass 1 under a force, by SciPy."""
    w = 2.0 * np.pi * frequency
    system = scipy.signal.StateSpace([[0, 1], [-w * w, -2 * damping * w]], [[0], [1]], [[1, 0]], [[0]])
    return scipy.signal.lsim(system, force, np.arange(force.size) / RATE)[1]


def impulse(size: int) -> np.ndarray:
    force = np.zeros(size)
    force[100:110] = np.hanning(10) * 500.0
    return force


def chirp(size: int, method: str) -> np.ndarray:
    return scipy.signal.chirp(np.arange(size) / RATE, 2.0, size / RATE, 15.0, method=method)


KINDS: dict[str, tuple[str, Callable[[int], np.ndarray]]] = {
    "linear sweep": ("swept", lambda size: chirp(size, "linear")),
    "logarithmic sweep": ("swept", lambda size: chirp(size, "logarithmic")),
    "downward sweep": ("swept", lambda size: chirp(size, "linear")[::-1].copy()),
    "random": ("broadband", lambda size: np.random.default_rng(1).normal(size=size)),
    "filtered random": (
        "broadband",
        lambda size: np.convolve(np.random.default_rng(1).normal(size=size), np.hanning(60), mode="same"),
    ),
    "hammer": ("impulse", impulse),
    "one sine": ("stepped_sine", lambda size: np.sin(2 * np.pi * 5.0 * np.arange(size) / RATE)),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_kind_of_an_excitation_is_told(name: str) -> None:
    kind, force = KINDS[name]
    drive = force(20000)
    response = oscillator(drive)
    noise = 0.002 * np.random.default_rng(2).normal(size=(2, drive.size))
    drive = drive + noise[0] * np.max(np.abs(drive))
    response = response + noise[1] * np.std(response)
    assert detect_kind(drive, response, RATE)[1] == kind


def test_a_release_under_no_force_is_a_free_decay() -> None:
    time = np.arange(20000) / RATE
    response = np.exp(-0.8 * time) * np.cos(2 * np.pi * 6 * time)
    assert detect_kind(np.zeros(time.size), response, RATE)[1] == "free_decay"
    noise = 1e-3 * np.random.default_rng(0).normal(size=time.size)
    assert detect_kind(noise, response, RATE, inertia=2.0)[1] == "free_decay"


def test_a_schedule_is_cut_to_the_samples_of_its_record(shared_data: Path, tmp_path: Path) -> None:
    source = shared_data / "examples" / "quiet"
    text = (source / "campaign.toml").read_text().split("[[record]]")
    entry = f"""[[record]]
        file = "{source}/fit_60N_forward_0.npz"
        schedule = "{source}/fit_60N_forward_0_schedule.csv"
        role = "fit"
        start = 4000
        stop = 12000
        """
    (tmp_path / "campaign.toml").write_text(text[0] + entry)
    dwells = read_campaign(tmp_path).records[0].dwells
    assert [(d.start, d.stop, d.frequency) for d in dwells] == [
        (0, 1000, 4.0),
        (1000, 5762, 4.2),
        (5762, 8000, 4.4),
    ]
    assert dwells[0].cycles == pytest.approx(4.0)


@pytest.mark.parametrize("order", [0, 2])
def test_a_small_release_under_a_noisy_force_channel_is_a_free_decay(order: int) -> None:
    """The noise of the channel is a twentieth of the inertia; a drive in the band of the motion is none."""
    time = np.arange(5000) / RATE
    pole = complex(-1.5, 2.0 * np.pi * 6.0)
    response = (1e-4 * pole**order * np.exp(pole * time)).real
    inertia = 800.0 * abs(pole) ** (2 - order)
    random = np.random.default_rng(3)
    noise = 0.05 * inertia * np.std(response) * random.normal(size=time.size)
    assert detect_kind(noise, response, RATE, inertia)[1] == "free_decay"
    heard = np.convolve(random.normal(size=time.size), np.hanning(80), mode="same")
    heard *= np.std(noise) / np.std(heard)
    assert detect_kind(heard, response, RATE, inertia)[1] == "broadband"


def test_a_light_blow_in_noise_is_an_impulse_and_noise_alone_is_none() -> None:
    drive = impulse(20000)
    noise = 0.02 * np.max(drive) * np.random.default_rng(4).normal(size=drive.size)
    response = oscillator(drive)
    assert detect_kind(drive + noise, response, RATE, inertia=39.5)[1] == "impulse"
    assert detect_kind(noise, response, RATE)[1] == "free_decay"
