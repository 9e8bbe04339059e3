"""What the simulated bench does to the exact motion: drive, instruments, filter, noise, drift."""

import numpy as np
import pytest

from isojax import rig
from isojax.rig._sampling import anti_alias_taps

QUIET = rig.Bench(noise=0.0, force_noise=0.0, drift=0.0)
BARE = rig.Bench(noise=0.0, force_noise=0.0, drift=0.0, anti_alias=False, shaker=rig.IDEAL_SHAKER)
SHORT = rig.SteppedSine((60.0,), (5.0, 6.0), 10, ("forward",))


def harmonics(signal, frequency, rate, start, count=3):
    """Complex amplitudes of 1 to `count` times the frequency, with sin(w t) counted as 1."""
    times = start + np.arange(signal.size) / rate
    tones = [np.exp(2j * np.pi * k * frequency * times) for k in range(1, count + 1)]
    columns = np.stack([np.ones_like(times), *(p for tone in tones for p in (tone.imag, tone.real))], axis=1)
    fit = np.linalg.lstsq(columns, signal, rcond=None)[0]
    return fit[1::2] + 1j * fit[2::2]


def test_shaker_distorts_and_drops_out_as_declared():
    plan = rig.SteppedSine((150.0,), (5.0,), 20, ("forward",))
    (record,) = rig.run(rig.y_plant(), plan, 1, QUIET)
    found = harmonics(record.force[1000:3000], 5.0, 1000.0, 1.0)
    first = 150 * (1 - 0.12 * np.exp(-((0.2 / 0.5) ** 2)))
    expected = first * np.array([1, 0.01 * np.exp(0.7j), 0.006 * np.exp(1.9j)])
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_anti_alias_filter_leaves_a_linear_relation_between_the_channels_alone():
    mass, stiffness, damping = 800.0, 1.08e6, 1.0e4
    plant = rig.Plant((rig.LinearStiffness(stiffness), rig.LinearDamping(damping)), mass)
    plan = rig.SteppedSine((100.0,), (5.0,), 40, ("forward",))
    (record,) = rig.run(plant, plan, 1, QUIET)
    force = harmonics(record.force[4000:7900], 5.0, 1000.0, 4.0)
    output = harmonics(record.output[4000:7900], 5.0, 1000.0, 4.0)
    w = 2 * np.pi * 5.0 * np.arange(1, 4)
    np.testing.assert_allclose(
        output / force, -(w**2) / (stiffness - mass * w**2 + 1j * w * damping), rtol=1e-6
    )


def test_anti_alias_filter_passes_what_lies_in_band_and_stops_what_would_fold():
    rate, factor = 1000.0, 16
    taps = anti_alias_taps(rate)
    frequencies = np.array([0.0, 10.0, 200.0, 399.0, 501.0, 900.0, 5000.0])
    times = np.arange(taps.size) / (rate * factor)
    gain = np.abs(np.exp(2j * np.pi * frequencies[:, None] * times) @ taps)
    np.testing.assert_allclose(gain[:4], 1, atol=1e-4)
    assert np.all(gain[4:] < 1e-4)


def test_filtered_record_keeps_the_instants_of_the_exact_one():
    filtered = rig.run(rig.y_plant(), SHORT, 1, QUIET)[0]
    exact = rig.run(
        rig.y_plant(), SHORT, 1, rig.Bench(noise=0.0, force_noise=0.0, drift=0.0, anti_alias=False)
    )[0]
    assert np.std(filtered.output - exact.output) < 1e-3 * np.std(exact.output)
    middle = slice(500, 1900)
    assert np.std(filtered.output[middle] - exact.output[middle]) < 1e-5 * np.std(exact.output)


def test_input_delay_lets_the_force_act_later():
    delay = 2.5e-3
    plain = rig.run(rig.y_plant(), SHORT, 1, BARE)[0]
    late = rig.run(rig.y_plant().plus(rig.InputDelay(delay)), SHORT, 1, BARE)[0]
    np.testing.assert_array_equal(late.force, plain.force)
    trial = SHORT.trials(rig.IDEAL_SHAKER, 1)[0]
    instants = plain.time[10:] - delay
    shifted = rig.response(rig.y_plant(), trial.pieces, instants)
    assert np.std(late.output[10:] - shifted["acceleration"]) < 1e-7 * np.std(plain.output)


@pytest.mark.parametrize("skew", [2e-4, -2e-4])
def test_a_fast_clock_files_the_output_later_and_later(skew):
    plain = rig.run(rig.y_plant(), SHORT, 1, BARE)[0]
    seen = rig.run(rig.y_plant().plus(rig.ClockSkew(skew)), SHORT, 1, BARE)[0]
    np.testing.assert_array_equal(seen.force, plain.force)
    trial = SHORT.trials(rig.IDEAL_SHAKER, 1)[0]
    inner = slice(1, -2)
    wanted = rig.response(rig.y_plant(), trial.pieces, plain.time[inner] / (1 + skew))["acceleration"]
    assert np.std(seen.output[inner] - wanted) < 1e-5 * np.std(wanted)
    assert np.std(plain.output[inner] - wanted) > 1e-4 * np.std(wanted)


@pytest.mark.parametrize(
    ("instrument", "force", "output"),
    [
        (rig.InputGain(0.05), lambda f: f / 1.05, lambda y: y),
        (rig.InputOffset(3.0), lambda f: f - 3, lambda y: y),
        (rig.SensorGain(-0.02), lambda f: f, lambda y: 0.98 * y),
        (rig.SensorOffset(0.1), lambda f: f, lambda y: y + 0.1),
    ],
    ids=["input gain", "input offset", "sensor gain", "sensor offset"],
)
def test_gains_and_offsets_change_the_record_and_not_the_motion(instrument, force, output):
    plain = rig.run(rig.y_plant(), SHORT, 1, BARE)[0]
    seen = rig.run(rig.y_plant().plus(instrument), SHORT, 1, BARE)[0]
    np.testing.assert_allclose(seen.force, force(plain.force), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(seen.output, output(plain.output), rtol=1e-12, atol=1e-12)


def test_noise_is_white_gaussian_and_of_the_declared_size():
    loud = rig.Bench(noise=0.03, force_noise=0.5, drift=0.0)
    plan = rig.SteppedSine((60.0,), (5.0,), 50, ("forward",), repeats=2)
    records = rig.run(rig.y_plant(), plan, 7, loud)
    clean = rig.run(rig.y_plant(), plan, 7, QUIET)
    noises = [record.output - exact.output for record, exact in zip(records, clean, strict=True)]
    for noise in noises:
        assert abs(np.std(noise) / 0.03 - 1) < 4 / np.sqrt(2 * noise.size)
        assert abs(np.mean(noise)) < 4 * 0.03 / np.sqrt(noise.size)
        assert abs(np.mean(noise[1:] * noise[:-1])) < 4 * 0.03**2 / np.sqrt(noise.size)
    assert abs(np.mean(noises[0] * noises[1])) < 4 * 0.03**2 / np.sqrt(noises[0].size)
    assert abs(np.std(records[0].force - clean[0].force) / 0.5 - 1) < 0.03


def test_stiffness_drifts_from_record_to_record_by_the_declared_share():
    plan = rig.Impulse((100.0,), seconds=0.2, repeats=80)
    records = rig.run(rig.y_plant(), plan, 3, rig.Bench(drift=0.002, rate=100.0))
    scales = np.array([record.stiffness_scale for record in records])
    assert abs(np.std(scales) / 0.002 - 1) < 4 / np.sqrt(160)
    assert abs(np.mean(scales) - 1) < 4 * 0.002 / np.sqrt(80)


def test_same_seed_gives_the_same_bits_and_another_seed_does_not():
    one, two, other = (rig.run(rig.y_plant(), SHORT, seed)[0] for seed in (5, 5, 6))
    np.testing.assert_array_equal(one.output, two.output)
    np.testing.assert_array_equal(one.force, two.force)
    assert np.any(one.output != other.output)


def test_multisine_has_its_rms_and_only_its_lines():
    plan = rig.Multisine((40.0,), 2.0, 12.0, period=4.0, periods=3, lines="odd", repeats=2)
    first, second = rig.run(rig.y_plant(), plan, 2, BARE)
    assert (first.period, first.settle) == (4000, 4000)
    lines = np.abs(np.fft.rfft(first.force[4000:8000])) / 2000
    odd = np.arange(9, 48, 2)
    np.testing.assert_allclose(lines[odd], 40 * np.sqrt(2 / odd.size), rtol=1e-9)
    assert np.delete(lines, odd).max() < 1e-9
    assert abs(np.std(first.force[:4000]) - 40) < 1e-9
    assert np.std(first.force - second.force) > 20
    steady = first.output[8000:] - first.output[4000:8000]
    assert np.std(steady) < 1e-6 * np.std(first.output)


def test_paper_plan_is_the_papers():
    plan = rig.paper_plan("y")
    trials = plan.trials(rig.EXAMPLE_SHAKER, 0)
    assert len(trials) == 5 * 2 * 3
    frequencies = [frequency for _, frequency, _ in trials[0].schedule]
    np.testing.assert_allclose(frequencies, np.linspace(4, 7, 31))
    assert {cycles for *_, cycles in trials[0].schedule} == {20.0}
    backward = [frequency for _, frequency, _ in trials[3].schedule]
    assert (trials[3].direction, backward) == ("backward", frequencies[::-1])
    z = rig.paper_plan("z").trials(rig.EXAMPLE_SHAKER, 0)
    np.testing.assert_allclose([f for _, f, _ in z[0].schedule], np.linspace(1.5, 4, 26))


def test_impulse_carries_its_momentum():
    plan = rig.Impulse((500.0,), width=0.04, seconds=2.0)
    (record,) = rig.run(rig.y_plant(), plan, 1, BARE)
    assert abs(np.sum(record.force) / 1000 - 500 * 0.04 * 2 / np.pi) < 0.01
    (velocity,) = rig.run(
        rig.Plant((rig.LinearStiffness(1e-3),)), plan, 1, rig.Bench(output="velocity", noise=0.0, drift=0.0)
    )
    np.testing.assert_allclose(velocity.output[500], 500 * 0.04 * 2 / np.pi / 800, rtol=1e-5)


def test_records_of_one_name_are_refused():
    with pytest.raises(ValueError, match="fit_60N_forward_0"):
        rig.run(rig.y_plant(), (SHORT, SHORT), 1)


@pytest.mark.parametrize(
    "piece",
    [
        rig.Tones(0.0, 9.0, 0.5, (3.0, 1.0), (7.0, 20.0), (0.1, 0.2)),
        rig.EXAMPLE_SHAKER.sweep(5.0, 4.0, 0.1, 0.5, 9.0),
    ],
    ids=["tones", "sweep"],
)
def test_force_of_an_instant_is_that_of_the_record_and_of_its_delayed_twin(piece):
    times = np.linspace(1, 8, 50)
    record = piece.forces(times)
    np.testing.assert_allclose([piece.force(float(t)) for t in times], record, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(piece.delayed(0.25).forces(times + 0.25), record, rtol=1e-9, atol=1e-9)
