"""The drift budget against dense generalised least squares, in which the scatter is part of the noise."""

import numpy as np
import pytest

import isojax as ij
from isojax import rig
from isojax.identification import drift_budget
from isojax.identification.fitting._drift_budget import noise_and_scatter_errors
from isojax.identification.fitting._elimination import Nuisances, Spread, eliminate
from isojax.identification.fitting._problem import one_hot

SPREAD, RECORDS, SAMPLES, COEFFICIENTS = 3e-3, 5, 60, 3
OWNER = np.repeat(np.arange(RECORDS), 2)  # two segments a record
UNIT = 1e-3  # one unit of the scale's column: a tenth of a percent


@pytest.fixture(scope="module")
def dense():
    """Whitened columns of five records: three coefficients and the stiffness scale."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(RECORDS, SAMPLES, COEFFICIENTS)) * np.array([1.0, 1e3, 1e-4])
    scale = 0.2 * rng.normal(size=(RECORDS, SAMPLES)) + 0.1 * columns[:, :, 0]
    return columns, scale, rng.normal(size=(RECORDS, SAMPLES))


@pytest.fixture(params=[0.0, 4e-3], ids=["between records", "within them, too"])
def spread(request):
    return Spread(SPREAD, request.param)


def reduced_of(dense, spread):
    columns, scale, residual = dense
    # A state that no sample sees costs nothing and changes nothing.
    states = np.zeros((RECORDS, SAMPLES, 2))
    whole = np.concatenate([columns, scale[..., None], states, residual[..., None]], axis=2)
    whole = whole.reshape(OWNER.size, SAMPLES // 2, -1)
    matrices = np.einsum("rti,rtj->rij", whole, whole)
    lanes = OWNER.size
    nuisances = Nuisances(np.zeros((lanes, 2)), np.zeros(RECORDS), np.zeros(lanes), spread)
    return eliminate(matrices, (1.0,) * (max(OWNER) + 1), OWNER, COEFFICIENTS, nuisances)


def test_noise_alone_is_ordinary_least_squares(dense, spread):
    columns = dense[0].reshape(-1, COEFFICIENTS)
    expected = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    np.testing.assert_allclose(
        noise_and_scatter_errors(reduced_of(dense, spread), OWNER, spread)[0], expected, rtol=1e-9
    )


def test_noise_and_scatter_together_are_generalised_least_squares(dense, spread):
    columns, scale, _ = dense
    information = np.zeros((COEFFICIENTS, COEFFICIENTS))
    for own, stiffness in zip(columns, scale, strict=True):
        noise = np.eye(SAMPLES) + (spread.records / UNIT) ** 2 * np.outer(stiffness, stiffness)
        for half in np.split(np.arange(SAMPLES), 2):
            alone = np.where(np.isin(np.arange(SAMPLES), half), stiffness, 0.0)
            noise += (spread.segments / UNIT) ** 2 * np.outer(alone, alone)
        information += own.T @ np.linalg.solve(noise, own)
    np.testing.assert_allclose(reduced_of(dense, spread).matrix[:-1, :-1], information, rtol=1e-9)


def test_what_the_scatter_pretends_is_what_ordinary_least_squares_makes_of_it(dense, spread):
    columns, scale, _ = dense
    draw = np.random.default_rng(8)
    drawn = draw.normal(size=(4000, RECORDS, 1)) * spread.records
    drawn = drawn + draw.normal(size=(4000, RECORDS, 2)) * spread.segments
    seen = (np.repeat(drawn, SAMPLES // 2, axis=2) / UNIT * scale).reshape(4000, -1)
    fitted = np.linalg.lstsq(columns.reshape(-1, COEFFICIENTS), seen.T, rcond=None)[0]
    if_ignored = noise_and_scatter_errors(reduced_of(dense, spread), OWNER, spread)[1]
    np.testing.assert_allclose(if_ignored, fitted.std(axis=1), rtol=0.04)


@pytest.fixture(scope="module")
def drifting(simulated):
    """A fit of a linear bench whose stiffness differs by a percent from record to record."""
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
    plan = rig.SteppedSine((20.0,), (4.5, 5.5, 6.5), 12, repeats=4)
    bench = rig.Bench(rate=250.0, drift=0.01, force_noise=0.0, anti_alias=False, tolerance=1e-7)
    start = ij.Isolator(800.0, (ij.LinearStiffness(1.0e6), ij.LinearDamping(1.3e4)))
    return ij.fit(start, simulated(plant, plan, bench=bench))


def test_parts_add_up_and_a_loose_stiffness_limits_itself(drifting):
    budget = drift_budget(drifting)
    assert [share.name for share in budget.shares] == list(drifting.free)
    for share in budget.shares:
        assert share.noise**2 + share.repeatability**2 == pytest.approx(share.standard_error**2)
    stiffness = budget.of("linear_stiffness.coefficient")
    assert stiffness is not None
    # The mean of eight draws, next to which the noise is small.
    expected = budget.scatter * stiffness.value / np.sqrt(8.0)
    assert stiffness.repeatability == pytest.approx(expected, rel=0.2)
    assert 0.0 < stiffness.noise < 0.5 * stiffness.repeatability
    assert budget.of("nothing") is None
    # A fit that knows of no scatter weighs the records alike, which are alike.
    assert stiffness.if_ignored == pytest.approx(expected, rel=0.1)


def test_noise_alone_is_what_a_fit_leaves_that_knows_of_no_scatter(drifting):
    steady = drifting.estimate.point.nuisances._replace(spread=Spread(1e-9))
    bench, places = drifting.estimate.simulator, drifting.estimate.places
    directions = one_hot(drifting.model, places, [1.0] * len(places))
    point = bench.evaluate(drifting.model, directions, steady._replace(stiffness=0.0 * steady.stiffness))
    errors = np.sqrt(np.diag(np.linalg.inv(point.reduced.matrix[:-1, :-1])))
    inflation = np.sqrt(max(1.0, drifting.stats.chi2 / drifting.stats.dof))
    found = [share.noise for share in drift_budget(drifting).shares]
    np.testing.assert_allclose(found, inflation * errors, rtol=0.05)
