"""Single samples that stand alone are counted; noise, jumps and coarse converters are not."""

import dataclasses

import numpy as np
import pytest

from isojax import read_campaign
from isojax.records import Campaign, data_health, find_suspicions
from isojax.records._spikes import find_spikes

COUNT = 20_000
NUMBER = np.arange(COUNT)
TONE = np.sin(0.12 * NUMBER)


def noise(seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(COUNT)


def scattered(seed: int, count: int) -> np.ndarray:
    """Places at least a hundred samples apart."""
    return 50 + 100 * np.random.default_rng(seed).choice(COUNT // 100, count, replace=False)


def test_every_spike_is_found_where_it_is_and_as_large_as_it_is():
    places, size = np.sort(scattered(1, 6)), 0.3
    signal = TONE + 3e-3 * noise()
    signal[places] += size
    found, sizes = find_spikes(signal)
    np.testing.assert_array_equal(found, places)
    # Six numbers of the noise weigh into each, the sample itself with weight one.
    np.testing.assert_allclose(sizes, size, atol=4.0 * 3e-3 * np.sqrt(70.0) / 6.0)


@pytest.mark.parametrize(
    "signal",
    [
        noise(),
        TONE + 3e-3 * noise(),
        np.round(0.4 * noise()),
        np.round(50.0 * np.sin(1.3e-3 * NUMBER)),
        TONE + 0.3 * np.sign(np.cos(0.1203 * NUMBER)) + 3e-3 * noise(),
        TONE + 0.3 * np.sign(np.cos(0.1203 * NUMBER)),
        np.abs(np.arctan(np.tan(0.0601 * NUMBER))) + 1e-4 * noise(),
        np.repeat(np.sign(noise()[: COUNT // 8]), 8),
        np.sign(noise()),
        np.where(NUMBER < COUNT // 2, 1.0, 1e-3) * TONE + 1e-3 * noise(),
        np.random.default_rng(4).laplace(size=COUNT),
        np.zeros(COUNT),
        np.ones(3),
    ],
    ids=[
        "noise",
        "tone",
        "coarse noise",
        "coarse tone",
        "friction",
        "friction without noise",
        "triangles",
        "held steps",
        "random signs",
        "fading tone",
        "heavy tails",
        "nothing",
        "three samples",
    ],
)
def test_what_is_no_spike_is_not_called_one(signal):
    assert find_spikes(signal)[0].size == 0


@pytest.fixture
def spiked(tiny, channels) -> Campaign:
    """The tiny campaign with three bad samples of its response."""
    channels["acceleration"][[500, 900, 1500]] += 20.0 * np.std(channels["acceleration"])
    return read_campaign(tiny(channels=channels))


def test_data_health_counts_them_with_their_share_of_samples_and_of_the_rms(spiked, channels):
    (found,) = data_health(spiked).spikes
    assert (found.record, found.channel, found.count) == ("run", "output", 3)
    assert found.share == 3.0 / channels["time"].size
    spoiled = channels["acceleration"]
    places = [500, 900, 1500]
    clean = 0.5 * (spoiled[np.array(places) - 1] + spoiled[np.array(places) + 1])
    alone = np.sqrt(np.sum((spoiled[places] - clean) ** 2) / spoiled.size)
    assert found.rms_share == pytest.approx(alone / np.std(spoiled), rel=0.05)


def test_a_campaign_without_spikes_has_none(tiny):
    assert not data_health(read_campaign(tiny())).spikes


def test_a_blow_is_not_a_spike(spiked):
    hit = tuple(dataclasses.replace(record, kind="impulse") for record in spiked.records)
    assert not data_health(dataclasses.replace(spiked, records=hit)).spikes


def test_spikes_are_replaced_where_the_declaration_asks_for_it(tiny, channels):
    places = np.array([500, 900, 1500])
    step = channels["time"][1] - channels["time"][0]
    smooth = np.sin(2.0 * np.pi * 0.02 * channels["time"] / step)
    noisy = smooth + 1e-3 * np.random.default_rng(2).normal(size=smooth.size)
    channels["acceleration"] = noisy.copy()
    channels["acceleration"][places] += 3.0
    (record,) = read_campaign(
        tiny((r"^\[output\]", "[output]\nremove_spikes = true"), channels=channels)
    ).records
    assert record.removed_spikes == 3
    others = np.delete(np.arange(smooth.size), places)
    np.testing.assert_allclose(record.output[others], noisy[others], rtol=1e-8)
    # The cubic through noisy neighbours: their weights are -1/6, 4/6, 4/6 and -1/6.
    np.testing.assert_allclose(record.output[places], smooth[places], atol=4.0 * 1e-3 * np.sqrt(34.0) / 6.0)


def test_they_are_a_doubt_with_the_line_that_removes_them(spiked, tiny):
    (doubt,) = [one for one in find_suspicions(spiked) if one.check == "single samples"]
    assert not doubt.contradicts
    assert "3 single samples in 1 records" in doubt.figure
    assert doubt.causes[0].line == "[output] remove_spikes = true"
