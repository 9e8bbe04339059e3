"""A declared filter leaves correlated noise: chi-square and error bars must know it."""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.signal

from isojax import rig
from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import fit
from isojax.models import Integrator, Isolator
from isojax.records import Filter

STIFFNESS, DAMPING, SIGMA, RATE = 1.1e6, 1.0e4, 0.02, 250.0
SEEDS = 100
PLANT = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)))
PLAN = rig.Multisine((60.0,), 2.0, 9.0, period=4.0, periods=6)
BENCH = rig.Bench(rate=RATE, noise=0.0, force_noise=0.0, drift=0.0, anti_alias=False, tolerance=1e-7)


@functools.cache
def clean() -> rig.SimulatedRecord:
    """The record of a linear isolator without noise, simulated once."""
    return rig.run(PLANT, PLAN, 1, BENCH)[0]


def low_passed(signal: np.ndarray, low: Filter) -> np.ndarray:
    """The bench's filter, forwards only; the reader's, forwards and backwards, by SciPy."""
    sections = scipy.signal.butter(low.order, low.cutoff_hz, fs=RATE, output="sos")
    return (scipy.signal.sosfilt if low.applied else scipy.signal.sosfiltfilt)(sections, signal)


def fitted(seed: int, low: Filter, periodic: bool, simulated_campaign, declared: float | None = None):
    """Fit of the two coefficients to one draw of the noise, which both channels' filter has shaped."""
    one = clean()
    noisy = one.output + SIGMA * np.random.default_rng(seed).standard_normal(one.output.size)
    drive, output = low_passed(one.force, low), low_passed(noisy, low)
    kept = dataclasses.replace(one, force=drive, output=output, period=one.period if periodic else None)
    campaign = simulated_campaign(kept, low, declared)
    start = Isolator(800.0, (LinearStiffness(1.01 * STIFFNESS), LinearDamping(0.98 * DAMPING)))
    # Whether the records are right is asked elsewhere, and takes a quarter of such a fit.
    return fit(start, campaign, integrator=Integrator(), anyway=True)


@pytest.fixture
def simulated_campaign(campaign_of, as_record):
    """Gives the function that puts one record into a campaign with a filter."""

    def make(one: rig.SimulatedRecord, low: Filter, declared: float | None):
        record = as_record(one)
        channel = {"quantity": "acceleration", "noise": declared}
        return campaign_of((record,), output=channel, filter=low, stiffness=("linear",), damping=("linear",))

    return make


@pytest.mark.slow
@pytest.mark.parametrize("periodic", [True, False], ids=["periods", "floor"])
@pytest.mark.parametrize(
    "low",
    [Filter("butterworth", 4, 30.0, applied=False), Filter("butterworth", 4, 30.0, applied=True)],
    ids=["reader", "bench"],
)
def test_intervals_cover_and_chi2_is_one_under_filtered_noise(
    low, periodic, simulated_campaign, unchecked
) -> None:
    chi2, pulls = [], []
    for seed in range(SEEDS):
        found = fitted(seed, low, periodic, simulated_campaign)
        errors = np.array(list(found.standard_errors.values()))
        values = np.array([float(found.model[name]) for name in found.free])
        pulls.append((values - [STIFFNESS, DAMPING]) / errors)
        chi2.append(found.stats.chi2 / found.stats.dof)
    pulls = np.array(pulls)
    covered = np.mean(np.abs(pulls) < 1.96, axis=0)
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.015)
    assert np.all(covered >= 0.89)
    assert np.all(np.std(pulls, axis=0) > 0.8)


def test_declared_noise_is_that_of_the_column_in_the_file(simulated_campaign) -> None:
    reader = fitted(3, Filter("butterworth", 4, 30.0, applied=False), True, simulated_campaign, SIGMA)
    assert reader.stats.chi2 / reader.stats.dof == pytest.approx(1.0, abs=0.1)
    assert reader.noise.white == pytest.approx(SIGMA)
