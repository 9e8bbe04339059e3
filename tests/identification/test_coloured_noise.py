"""Fits and score tests under coloured noise against generalised least squares by SciPy."""

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from diffrax import Dopri8
from jaxtyping import Float
from scipy.linalg import toeplitz
from scipy.signal import lfilter, lsim

from isojax.elements import CubicStiffness, LinearDamping, LinearStiffness, SensorOffset
from isojax.identification.fitting._build_problem import build_problem
from isojax.identification.fitting._elimination import Spread
from isojax.identification.fitting._fit import simulator_for
from isojax.identification.fitting._problem import one_hot
from isojax.identification.fitting._simulator import Simulator
from isojax.identification.jacobian import find_whitening, whiten
from isojax.models import Integrator, Isolator
from isojax.records import Campaign, Dwell, InputChannel, OutputChannel, Record, estimate_noise

RATE, SIGMA, SHARE, REPEATS = 250.0, 0.004, 0.9, 60
STIFFNESS, DAMPING, MASS = 1.0e6, 1.0e4, 800.0
MODEL = Isolator(MASS, (LinearStiffness(STIFFNESS), LinearDamping(DAMPING)))
ABSENT = (CubicStiffness(0.0), SensorOffset(0.0))


def correlation(law: tuple[float, ...], count: int) -> Float[np.ndarray, " lag"]:
    """Autocorrelation of noise with innovations of variance 1, from its impulse response."""
    response = np.asarray(lfilter([1.0], [1.0, *law], np.r_[1.0, np.zeros(4000)]))
    return np.array([response[: response.size - lag] @ response[lag:] for lag in range(count)])


@pytest.mark.parametrize("law", [(-0.9,), (-1.2, 0.5, -0.1), tuple(0.7 ** np.arange(1, 25) * 0.3)])
@pytest.mark.parametrize(("length", "first", "counted"), [(90, 7, 70), (90, 0, 90), (6, 1, 4)])
def test_whitened_products_are_those_of_the_inverse_covariance(law, length, first, counted):
    draw = np.random.default_rng(4)
    weight = np.zeros((length, 2))
    weight[first : first + counted, 0] = weight[: counted - 1, 1] = 1.0
    rows = draw.standard_normal((length, 3, 2)) * weight[:, None]
    filters = find_whitening(law)
    assert filters is not None
    found = np.asarray(whiten(jnp.asarray(rows), jnp.asarray(weight), filters))
    for lane in range(2):
        own = rows[weight[:, lane] > 0.0, :, lane]
        covariance = toeplitz(correlation(law, own.shape[0]))
        wanted = own.T @ np.linalg.solve(covariance, own)
        np.testing.assert_allclose(found[:, :, lane].T @ found[:, :, lane], wanted, rtol=1e-9, atol=1e-9)


def made_record() -> Record:
    """A linear isolator under dwells, its drive straight between samples: SciPy's answer is exact."""
    drive, dwells, start = [], [], 0
    for frequency in (4.2, 5.1, 6.0):
        size = round(18 * RATE / frequency)
        drive.append(60.0 * np.sin(2.0 * np.pi * frequency * np.arange(size) / RATE))
        dwells.append(Dwell(start, start + size, frequency, 18.0))
        start += size
    force = np.concatenate(drive)
    time = np.arange(force.size) / RATE
    system = (
        [[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]],
        [[0.0], [1.0 / MASS]],
        [[-STIFFNESS / MASS, -DAMPING / MASS]],
        [[1.0 / MASS]],
    )
    output = lsim(system, force, time)[1]
    held = force, output, force, output
    return Record("a", Path("a"), time, RATE, *held, dwells=tuple(dwells), kind="stepped_sine")


def noise_of(seed: int, count: int) -> Float[np.ndarray, " time"]:
    white = np.random.default_rng(seed).standard_normal(count + 500) * np.sqrt(1.0 - SHARE**2)
    return SIGMA * np.asarray(lfilter([1.0], [1.0, -SHARE], white))[500:]


def made_campaign(noise: list[Float[np.ndarray, " time"]]) -> Campaign:
    record = made_record()
    return Campaign(
        title="made",
        file=Path("campaign.toml"),
        mass=MASS,
        mass_free=False,
        input=InputChannel("force", "f", "N"),
        output=OutputChannel("acceleration", "a", "m/s^2"),
        filter=None,
        rate=RATE,
        stiffness=(),
        damping=(),
        elements=(),
        records=tuple(replace(record, output=record.output + one) for one in noise),
    )


def over_repeats(
    whitening: tuple[float, ...], noise: float, share: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deviations of the coefficients and scores of absent effects, over standard errors, and chi2/dof."""
    record = made_record()
    clean = record.output.copy()
    problem = build_problem(
        (record,),
        MODEL,
        quantity="acceleration",
        hold="linear",
        noise=(noise,),
        integrator=Integrator(substeps=2),
        whitening=whitening,
        share=share,
    )
    full = MODEL.with_elements(*ABSENT)
    # Mass first; then one strength an element.
    directions = one_hot(full, (1, 2, 3, 4), (1e3, 10.0, 1e9, 1e-3))
    coefficients, scores, fits = [], [], []
    for seed in range(REPEATS):
        record.output[:] = clean + noise_of(seed, clean.size)
        simulator = Simulator(problem)
        start = simulator.settle(None, full, 2, Spread(1e-9))
        point = simulator.evaluate(full, directions, start, carried=2)
        matrix = point.reduced.matrix
        known, right = matrix[:2, :2], matrix[:2, -1]
        step = np.linalg.solve(known, right)
        coefficients.append(step / np.sqrt(np.diag(np.linalg.inv(known))))
        own = matrix[2:4, -1] - matrix[2:4, :2] @ step
        size = matrix[2:4, 2:4] - matrix[2:4, :2] @ np.linalg.solve(known, matrix[:2, 2:4])
        scores.append(own / np.sqrt(np.diag(size)))
        fits.append((point.chi2 - right @ step) / (point.free_samples - 2))
    return np.array(coefficients), np.array(scores), np.array(fits)


def test_intervals_and_scores_under_coloured_noise_are_right_where_it_is_whitened():
    coefficients, scores, fits = over_repeats((-SHARE,), SIGMA * np.sqrt(1.0 - SHARE**2))
    # 95 % of 120, and the 99.9 % interval of a mean square of 60 normal numbers.
    assert 105 <= np.sum(np.abs(coefficients) < 1.96) <= 120
    assert np.all((np.mean(scores**2, axis=0) > 0.5) & (np.mean(scores**2, axis=0) < 1.65))
    assert np.mean(fits) == pytest.approx(1.0, abs=0.02)


def test_they_stay_right_where_the_quiet_band_is_trusted_no_more_than_under_white_noise():
    noise = estimate_noise(made_campaign([noise_of(1000 + k, made_record().output.size) for k in range(8)]))
    coefficients, scores, fits = over_repeats(noise.whitening, noise.white, noise.share)
    assert 105 <= np.sum(np.abs(coefficients) < 1.96) <= 120
    assert np.all((np.mean(scores**2, axis=0) > 0.4) & (np.mean(scores**2, axis=0) < 1.65))
    assert np.mean(fits) == pytest.approx(1.0, abs=0.1)


def test_they_are_wrong_where_it_counts_as_white():
    coefficients, scores, _ = over_repeats((), SIGMA)
    assert np.sum(np.abs(coefficients) < 1.96) < 100
    assert np.all(np.mean(scores**2, axis=0) > 2.0)


@pytest.mark.parametrize("integrator", [Integrator(substeps=2), Integrator(Dopri8(), rtol=1e-9, atol=1e-12)])
def test_columns_of_absent_effects_are_weighed_as_exact_derivatives_are(integrator):
    record = made_record()
    record.output[:] += noise_of(1, record.output.size)
    problem = build_problem(
        (record,),
        MODEL,
        quantity="acceleration",
        hold="linear",
        noise=(SIGMA,),
        integrator=integrator,
        whitening=(-1.1, 0.3),
    )
    full, simulator = MODEL.with_elements(*ABSENT), Simulator(problem)
    directions = one_hot(full, (1, 2, 3, 4), (1e3, 10.0, 1e9, 1e-3))
    exact, found = (
        simulator.evaluate(full, directions, simulator.settle(None, full, 4, Spread(1e-9)), carried=carried)
        for carried in (4, 2)
    )
    size = np.sqrt(np.diag(exact.reduced.matrix))
    difference = (found.reduced.matrix - exact.reduced.matrix) / np.outer(size, size)
    assert np.max(np.abs(difference)) < 1e-3


def test_each_record_counts_by_its_own_noise_where_one_is_louder():
    size, draw = made_record().output.size, np.random.default_rng(3)
    factors = (1.0, 3.0, 1.0)
    campaign = made_campaign([SIGMA * factor * draw.standard_normal(size) for factor in factors])
    campaign = replace(campaign, input=replace(campaign.input, hold="linear"))
    simulator = simulator_for(MODEL, campaign, estimate_noise(campaign), Integrator(substeps=2))
    assert np.array(simulator.problem.noise) == pytest.approx(SIGMA * np.array(factors), rel=0.1)
    start = simulator.settle(None, MODEL, 2, Spread(1e-9))
    point = simulator.evaluate(MODEL, one_hot(MODEL, (1, 2), (1e3, 10.0)), start)
    count = point.samples - point.reduced.eliminated
    np.testing.assert_allclose(point.reduced.by_record[:, -1, -1] / count, 1.0, atol=0.15)
