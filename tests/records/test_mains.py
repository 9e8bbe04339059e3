"""Hum of the mains in made records: seen, kept out of noise and harmonics, and told where it hides."""

from pathlib import Path

import numpy as np
import pytest

from isojax.records import (
    Campaign,
    Dwell,
    InputChannel,
    OutputChannel,
    Record,
    dwell_harmonics,
    estimate_noise,
    hum_lines,
    mains_collisions,
)

RATE, SIGMA = 400.0, 0.01
FREQUENCIES = (4.5, 5.0, 5.6, 6.25, 6.7)


def record_of(frequencies=FREQUENCIES, hum=0.0, line=50.0, seed=0, harmonics=((1, 1.0), (3, 0.1)), cycles=40):
    """Settled dwells of a periodic motion, white noise, and hum whose phase knows nothing of them."""
    rng = np.random.default_rng(seed)
    dwells, output, drive, start = [], [], [], 0
    for frequency in frequencies:
        size = round(cycles / frequency * RATE)
        phase = 2.0 * np.pi * frequency * np.arange(size) / RATE
        output.append(sum(a * np.cos(k * phase + 0.3 * k) for k, a in harmonics))
        drive.append(100.0 * np.sin(phase))
        dwells.append(Dwell(start, start + size, frequency, float(cycles)))
        start += size
    time = np.arange(start) / RATE
    measured = np.concatenate(output) + SIGMA * rng.normal(size=start)
    measured += hum * np.cos(2.0 * np.pi * line * time + 1.0)
    force = np.concatenate(drive)
    return Record(
        "made",
        Path("made"),
        time,
        RATE,
        force,
        measured,
        force,
        measured,
        dwells=tuple(dwells),
        kind="stepped_sine",
    )


def noise_of(record):
    channels = InputChannel("force", "f", "N"), OutputChannel("acceleration", "a", "m/s^2")
    return estimate_noise(
        Campaign("made", Path("made"), 1.0, False, *channels, None, RATE, (), (), (), (record,))
    ).sigma


@pytest.mark.parametrize("line", [50.0, 60.0])
def test_hum_is_seen_with_its_amplitude_and_is_no_noise(line):
    record = record_of(hum=0.02, line=line)
    (found,) = hum_lines(record)
    assert found.frequency == line
    assert found.amplitude == pytest.approx(0.02, rel=0.05)
    # Taken for noise it would show 0.0173.
    assert noise_of(record) == pytest.approx(SIGMA, rel=0.04)


def test_hum_far_below_the_noise_of_a_sample_is_seen_over_many_samples():
    # 600 samples a window: its power is 600 (0.004 / 2)^2 / 0.01^2 = 24 times that of the noise there.
    assert [one.frequency for one in hum_lines(record_of(hum=0.004))] == [50.0]


def test_without_hum_none_is_seen():
    dry = tuple((order, 0.5 / order) for order in range(1, 80, 2))
    assert sum(len(hum_lines(record_of(seed=seed))) for seed in range(40)) == 0
    assert sum(len(hum_lines(record_of(seed=seed, harmonics=dry))) for seed in range(10)) == 0
    assert noise_of(record_of()) == pytest.approx(SIGMA, rel=0.04)


def test_hum_under_a_harmonic_of_every_dwell_cannot_be_seen():
    assert hum_lines(record_of((5.0, 6.25), hum=0.02)) == ()


def test_collisions_are_those_of_arithmetic():
    found = mains_collisions((record_of(),))
    where = [(one.dwell.frequency, one.order, one.mains) for one in found]
    assert where == [(5.0, 10, 50.0), (5.0, 12, 60.0), (6.25, 8, 50.0)]
    seen = mains_collisions((record_of(hum=0.02),))
    assert [(one.dwell.frequency, one.order) for one in seen] == [(5.0, 10), (6.25, 8)]


def test_the_harmonic_under_hum_is_masked_and_no_other():
    frequencies, harmonics = (9.0, 10.0, 11.0), ((1, 1.0), (3, 0.1), (5, 0.05))
    humming = record_of(frequencies, hum=0.03, harmonics=harmonics)
    found = [dwell_harmonics(humming, dwell) for dwell in humming.dwells]
    assert [one.masked for one in found] == [(), (5,), ()]
    assert found[1].output[5] == 0.0
    for one in found:
        assert abs(one.output[3]) == pytest.approx(0.1, abs=0.005)
    quiet = record_of(frequencies, harmonics=harmonics)
    assert dwell_harmonics(quiet, quiet.dwells[1]).masked == ()
    assert abs(dwell_harmonics(quiet, quiet.dwells[1]).output[5]) == pytest.approx(0.05, abs=0.003)


def test_scatter_of_a_dwell_beside_a_collision_is_noise_too():
    # 5.02 Hz: the tenth harmonic passes the hum's phase by a fifth of a turn in the window.
    frequencies = (4.5, 5.02, 5.6)
    assert noise_of(record_of(frequencies, hum=0.02)) == pytest.approx(SIGMA, rel=0.04)
