"""Eliminating nuisances gives exactly what a dense least squares over everything gives."""

import numpy as np
import pytest

from isojax import paper
from isojax.identification.fitting._descent import _held_where_promises_fail
from isojax.identification.fitting._elimination import (
    Nuisances,
    Spread,
    eliminate,
    promised_misfits,
    step_nuisances,
)
from isojax.identification.fitting._problem import Point
from isojax.identification.jacobian._unknowns import STIFFNESS_SCALE_UNIT

NOISE, SPREAD, WITHIN = (0.3, 0.8), 2e-3, 1e-3
COLUMNS, STATES, SAMPLES = 3, 2, 40
OWNER = np.array([0, 0, 1, 1, 1, 0])
USED, RECORDS = 5, 2


def _blocks(has_scale):
    """One matrix of columns a lane: coefficients, stiffness scale, states, residual."""
    rng = np.random.default_rng(3)
    width = COLUMNS + has_scale + STATES + 1
    blocks = rng.standard_normal((OWNER.size, SAMPLES, width))
    blocks[:, :, COLUMNS] *= 0.02
    return blocks


def _dense(blocks, has_scale, nuisances):
    """Stack every sample and every prior as a row; unknowns: coefficients, scales, states of each lane."""
    scales = RECORDS if has_scale else 0
    within = USED if nuisances.spread.segments else 0
    unknowns = COLUMNS + scales + USED * STATES + within
    rows, right, owner = [], [], []
    for lane in range(USED):
        block = blocks[lane] / NOISE[OWNER[lane]]
        part = np.zeros((SAMPLES, unknowns))
        part[:, :COLUMNS] = block[:, :COLUMNS]
        if has_scale:
            part[:, COLUMNS + OWNER[lane]] = block[:, COLUMNS]
        first = COLUMNS + scales + lane * STATES
        part[:, first : first + STATES] = block[:, COLUMNS + has_scale : -1]
        rows.append(part)
        right.append(block[:, -1])
        prior = np.zeros((STATES, unknowns))
        prior[:, first : first + STATES] = np.eye(STATES)
        rows.append(prior)
        right.append(-nuisances.states[lane])
        owner += [OWNER[lane]] * (SAMPLES + STATES)
        if within:
            own = unknowns - within + lane
            part[:, own] = block[:, COLUMNS]
            prior = np.zeros((1, unknowns))
            prior[0, own] = STIFFNESS_SCALE_UNIT / WITHIN
            rows.append(prior)
            right.append(-nuisances.segments[[lane]] * STIFFNESS_SCALE_UNIT / WITHIN)
            owner.append(OWNER[lane])
    for record in range(scales):
        prior = np.zeros((1, unknowns))
        prior[0, COLUMNS + record] = STIFFNESS_SCALE_UNIT / SPREAD
        rows.append(prior)
        right.append(-nuisances.stiffness[[record]] * STIFFNESS_SCALE_UNIT / SPREAD)
        owner.append(record)
    return np.concatenate(rows), np.concatenate(right), np.array(owner)


def _nuisances(rng, within=0.0):
    """Deviations of everything; of the segments' own stiffness only where it scatters."""
    states, stiffness = rng.standard_normal((OWNER.size, STATES)), rng.standard_normal(RECORDS)
    segments = rng.standard_normal(OWNER.size) if within else np.zeros(OWNER.size)
    return Nuisances(states, stiffness, segments, Spread(SPREAD, within))


@pytest.fixture(
    params=[(True, 0.0), (False, 0.0), (True, WITHIN)], ids=["spring", "no spring", "scatter within records"]
)
def setting(request):
    has_scale, within = request.param
    rng = np.random.default_rng(8)
    nuisances = _nuisances(rng, within)
    blocks = _blocks(has_scale)
    matrices = np.einsum("lsc,lsd->lcd", blocks, blocks)
    reduced = eliminate(matrices[:USED], NOISE, OWNER[:USED], COLUMNS, nuisances)
    rows, right, owner = _dense(blocks, has_scale, nuisances)
    return reduced, nuisances, has_scale, rows, right, owner


def test_reduced_equations_are_the_schur_complement_of_the_dense_ones(setting):
    reduced, _, _, rows, right, owner = setting
    outer, inner = rows[:, :COLUMNS], rows[:, COLUMNS:]
    table = np.concatenate([outer, right[:, None]], axis=1)
    for record in range(RECORDS):
        mine = owner == record
        part = inner[mine]
        left = table[mine] - part @ np.linalg.lstsq(part, table[mine], rcond=None)[0]
        np.testing.assert_allclose(reduced.by_record[record], left.T @ left, rtol=1e-9, atol=1e-9)


def test_a_lane_that_moves_by_its_start_alone_adds_nothing_to_the_size_of_a_column():
    # What a dwell next to a fold does to every coefficient: a hundredfold of what its initial state does.
    rng = np.random.default_rng(8)
    nuisances = _nuisances(rng)
    blocks = _blocks(True)
    matrices = np.einsum("lsc,lsd->lcd", blocks, blocks)[:USED]
    plain = eliminate(matrices, NOISE, OWNER[:USED], COLUMNS, nuisances)
    blocks[2, :, COLUMNS + 1] *= 100.0
    blocks[2, :, :COLUMNS] = blocks[2, :, [COLUMNS + 1]].T * (50.0, -80.0, 120.0)
    matrices = np.einsum("lsc,lsd->lcd", blocks, blocks)[:USED]
    amplified = eliminate(matrices, NOISE, OWNER[:USED], COLUMNS, nuisances)
    rows = _dense(blocks, True, nuisances)[0]
    # Nothing but states and their priors; the stiffness scales are no part of it.
    states = rows[:, COLUMNS + RECORDS :]
    left = rows[:, :COLUMNS] - states @ np.linalg.lstsq(states, rows[:, :COLUMNS], rcond=None)[0]
    np.testing.assert_allclose(amplified.raw, np.sum(left**2, axis=0), rtol=1e-6)
    assert np.all(amplified.raw < plain.raw + 120.0**2)  # the state moves by so much, against its prior


def test_a_step_of_coefficients_and_nuisances_is_that_of_dense_least_squares(setting):
    reduced, nuisances, has_scale, rows, right, _ = setting
    solution = np.linalg.lstsq(rows, right, rcond=None)[0]
    step = np.linalg.solve(reduced.matrix[:-1, :-1], reduced.matrix[:-1, -1])
    np.testing.assert_allclose(step, solution[:COLUMNS], rtol=1e-9)
    moved = step_nuisances(reduced, OWNER, nuisances, step)
    scales = RECORDS if has_scale else 0
    if has_scale:
        np.testing.assert_allclose(
            moved.stiffness - nuisances.stiffness, solution[COLUMNS : COLUMNS + scales], rtol=1e-9
        )
    states = (moved.states - nuisances.states)[:USED].ravel()
    end = COLUMNS + scales + states.size
    np.testing.assert_allclose(states, solution[COLUMNS + scales : end], rtol=1e-8, atol=1e-10)
    segments = (moved.segments - nuisances.segments)[:USED]
    own = solution[end:] if nuisances.spread.segments else np.zeros(USED)
    np.testing.assert_allclose(segments, own, rtol=1e-8, atol=1e-10)
    np.testing.assert_array_equal(moved.states[USED:], nuisances.states[USED:])


def test_each_segment_is_promised_what_it_leaves_after_a_step_where_all_is_linear(setting):
    reduced, nuisances, has_scale, *_ = setting
    blocks, step = _blocks(has_scale), np.array([0.3, -1.2, 0.7])
    moved = step_nuisances(reduced, OWNER, nuisances, step)
    expected = []
    for lane in range(USED):
        along = list(step)
        if has_scale:
            own = (moved.stiffness - nuisances.stiffness)[OWNER[lane]]
            along.append(own + moved.segments[lane] - nuisances.segments[lane])
        along += list(moved.states[lane] - nuisances.states[lane])
        left = (blocks[lane, :, -1] - blocks[lane, :, :-1] @ along) / NOISE[OWNER[lane]]
        expected.append(left @ left + moved.states[lane] @ moved.states[lane])
    found = promised_misfits(reduced, OWNER, nuisances, moved, step)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_only_a_segment_that_breaks_its_promise_is_held_and_once(setting):
    reduced, nuisances, *_ = setting
    still = np.zeros(COLUMNS)
    moved = step_nuisances(reduced, OWNER, nuisances, still)
    promised = promised_misfits(reduced, OWNER, nuisances, moved, still)

    def held(misfits, known=None):
        before = Point(paper.y_direction(), nuisances._replace(held=known), reduced, np.ones(RECORDS))
        after = before._replace(nuisances=moved, reduced=reduced._replace(misfits=misfits))
        return _held_where_promises_fail(before, after, OWNER, still, 1e-2)

    assert held(promised) is None
    lane = int(np.argmax(reduced.misfits - promised))
    worse, better = promised.copy(), promised.copy()
    worse[lane] = reduced.misfits[lane] + 5.0
    better[lane] = 0.9 * reduced.misfits[lane] + 0.1 * promised[lane]
    for misfits, states in ((worse, nuisances.states), (better, moved.states)):
        found = held(misfits)
        assert np.flatnonzero(found.held).tolist() == [lane]
        np.testing.assert_array_equal(found.states[lane], states[lane])
        np.testing.assert_array_equal(np.delete(found.states, lane, 0), np.delete(nuisances.states, lane, 0))
        assert held(misfits, found.held) is None


def test_states_that_are_held_fast_are_as_good_as_known():
    rng = np.random.default_rng(8)
    nuisances, blocks = _nuisances(rng), _blocks(True)
    matrices = np.einsum("lsc,lsd->lcd", blocks, blocks)[:USED]
    held = np.arange(OWNER.size) == 1
    found = eliminate(matrices, NOISE, OWNER[:USED], COLUMNS, nuisances._replace(held=held))
    blocks[1, :, COLUMNS + 1 : -1] = 0.0
    rows, right, owner = _dense(blocks, True, nuisances)
    known = COLUMNS + RECORDS + STATES + np.arange(STATES)
    rows[:, known] = 0.0
    table = np.concatenate([rows[:, :COLUMNS], right[:, None]], axis=1)
    for record in range(RECORDS):
        part, own = rows[owner == record][:, COLUMNS:], table[owner == record]
        left = own - part @ np.linalg.lstsq(part, own, rcond=None)[0]
        np.testing.assert_allclose(found.by_record[record], left.T @ left, rtol=1e-9, atol=1e-9)
    moved = step_nuisances(found, OWNER, nuisances._replace(held=held), np.ones(COLUMNS))
    np.testing.assert_allclose(moved.states[1], nuisances.states[1], atol=1e-10)
    assert np.all(np.abs(moved.states[0] - nuisances.states[0]) > 1e-3)


def test_a_column_that_is_not_finite_leaves_the_steps_of_the_others_alone():
    rng = np.random.default_rng(8)
    nuisances = _nuisances(rng, WITHIN)
    blocks = _blocks(True)
    matrices = np.einsum("lsc,lsd->lcd", blocks, blocks)
    spoilt = matrices.copy()
    spoilt[:, 1], spoilt[:, :, 1], spoilt[0, 1, 1] = np.inf, np.inf, np.nan

    def moved(matrices, columns):
        with np.errstate(invalid="ignore"):
            reduced = eliminate(matrices[:USED], NOISE, OWNER[:USED], COLUMNS, nuisances)
        step = np.linspace(1.0, 2.0, COLUMNS)
        step[1] = 0.0
        return reduced.without(columns), step_nuisances(reduced.without(columns), OWNER, nuisances, step)

    (whole, expected), (without, found) = moved(matrices, np.array([], int)), moved(spoilt, np.array([1]))
    np.testing.assert_allclose(found.states, expected.states, rtol=1e-12)
    np.testing.assert_allclose(found.stiffness, expected.stiffness, rtol=1e-12)
    np.testing.assert_allclose(found.segments, expected.segments, rtol=1e-12)
    left = np.delete(np.delete(whole.matrix, 1, 0), 1, 1)
    np.testing.assert_allclose(np.delete(np.delete(without.matrix, 1, 0), 1, 1), left, rtol=1e-12)
    assert not without.matrix[1].any()
    assert without.raw[1] == 0.0


def test_eliminated_degrees_of_freedom_are_those_of_the_dense_projection(setting):
    reduced, nuisances, has_scale, rows, _, owner = setting
    inner = rows[:, COLUMNS:]
    own = STATES + bool(nuisances.spread.segments)
    hat = inner @ np.linalg.pinv(inner)
    priors = np.zeros(rows.shape[0], dtype=bool)
    for lane in range(USED):
        first = lane * (SAMPLES + own) + SAMPLES
        priors[first : first + own] = True
    if has_scale:
        priors[-RECORDS:] = True
    for record in range(RECORDS):
        taken = np.diag(hat)[~priors & (owner == record)].sum()
        # The stiffness scale is eliminated after the states, each with what its prior has left of it.
        assert reduced.eliminated[record] == pytest.approx(taken, rel=2e-2)


def test_variance_of_the_stiffness_scale_is_that_of_the_dense_inverse(setting):
    reduced, _, has_scale, rows, _, _ = setting
    if not has_scale:
        assert not reduced.stiffness_variance.any()
        return
    inner = rows[:, COLUMNS:]
    covariance = np.linalg.inv(inner.T @ inner)
    wanted = np.diag(covariance)[:RECORDS] * STIFFNESS_SCALE_UNIT**2
    np.testing.assert_allclose(reduced.stiffness_variance, wanted, rtol=1e-9)
