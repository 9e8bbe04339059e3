"""Noise that differs from record to record, against noise that was put in and SciPy's test."""

from dataclasses import replace

import numpy as np
import pytest
from made_campaign import campaign_of
from scipy import stats
from test_noise_colour import SIGMA, noise_of, periodic, stepped

from isojax.records import Record, estimate_noise
from isojax.records.noise._levels import bartlett
from isojax.records.noise._scatter import Scatter


def louder(record: Record, factor: float) -> Record:
    """The same record with so many times the noise."""
    return replace(record, output=record.input + factor * (record.output - record.input))


def records_of(count: int, share: float = 0.0) -> list[Record]:
    return [stepped(f"r{place}", place, share) for place in range(count)]


def test_the_chance_is_that_of_scipy() -> None:
    draw = np.random.default_rng(1)
    samples = [scale * draw.standard_normal(size) for scale, size in ((1.0, 40), (1.2, 25), (0.8, 60))]
    found = bartlett([Scatter(float(np.var(one, ddof=1)), one.size - 1.0) for one in samples])
    assert found == pytest.approx(stats.bartlett(*samples).pvalue, rel=1e-9)


@pytest.mark.parametrize(("count", "share"), [(3, 0.0), (7, 0.0), (3, 0.9)])
def test_a_louder_record_weighs_with_its_own_noise(count: int, share: float) -> None:
    records = records_of(count, share)
    records[1] = louder(records[1], 3.0)
    noise = estimate_noise(campaign_of(*records))
    truth = np.where(np.arange(count) == 1, 3.0, 1.0)
    levels = np.array(noise.levels) / SIGMA
    np.testing.assert_allclose(levels / levels[0], truth, rtol=0.1)
    np.testing.assert_allclose(levels, truth, rtol=0.3 if share else 0.1)
    np.testing.assert_allclose(np.array(noise.whites) / noise.white, np.array(noise.levels) / noise.sigma)
    assert "differs from record to record" in noise.note
    assert "rms in r1: each record weighs" in noise.note
    assert "by record" in repr(noise)
    if share:
        # The law is that of all records, and not that of the loudest.
        quiet = estimate_noise(campaign_of(*records_of(count, share)))
        np.testing.assert_allclose(noise.law[0], quiet.law[0], atol=0.1)


def test_equal_records_weigh_alike_and_are_rarely_taken_for_different_ones() -> None:
    found = [
        estimate_noise(campaign_of(*(stepped(f"r{k}", 10 * seed + k, 0.0) for k in range(3))))
        for seed in range(12)
    ]
    assert all(set(noise.levels) == {noise.sigma} and noise.note == "" for noise in found)
    coloured = estimate_noise(campaign_of(*records_of(4, 0.9)))
    assert coloured.colour is not None
    assert set(coloured.levels) == {coloured.sigma}


def test_periods_show_a_louder_record_too() -> None:
    records = [replace(periodic(seed, 0.0), name=f"p{seed}") for seed in range(3)]
    more = noise_of(np.random.default_rng(7), records[2].output.size, 0.0)
    records[2] = replace(records[2], output=records[2].output + np.sqrt(8.0) * more)
    noise = estimate_noise(campaign_of(*records))
    np.testing.assert_allclose(noise.levels, np.array([1.0, 1.0, 3.0]) * SIGMA, rtol=0.1)


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_a_held_out_record_weighs_by_itself_and_changes_no_other(factor: float) -> None:
    records = records_of(3)
    alone = estimate_noise(campaign_of(*records[:2]))
    held = replace(louder(records[2], factor), role="holdout")
    noise = estimate_noise(campaign_of(*records[:2], held))
    assert (noise.sigma, noise.levels[:2], noise.method) == (alone.sigma, alone.levels, alone.method)
    assert noise.levels[2] == (noise.sigma if factor == 1.0 else pytest.approx(3.0 * SIGMA, rel=0.1))


def test_declared_noise_stays_one_number() -> None:
    records = records_of(3)
    noise = estimate_noise(campaign_of(louder(records[0], 3.0), *records[1:], noise=0.02))
    assert noise.levels == (0.02,) * 3
