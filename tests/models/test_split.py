"""Records of laws that jump or bend: the event-exact bench, a closed form, and central differences."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import rig
from isojax.elements import (
    AbstractElement,
    AsymmetricFriction,
    CoulombFriction,
    EndStop,
    Freeplay,
    LinearDamping,
    LinearStiffness,
    MaxwellBranch,
    StribeckFriction,
)
from isojax.excitations import tabulate
from isojax.models import (
    RK4,
    Instant,
    Integrator,
    Isolator,
    State,
    add_ringing,
    advance,
    advance_record,
    find_regime,
    read_record,
    scan_records,
    split_stages,
)
from isojax.rig._sampling import anti_alias_taps, decimated, oversampling

RATE, COUNT, MASS = 250.0, 1200, 800.0
NOISE = 0.01
TONES = ((110.0, 40.0), (2.0 * np.pi * 5.3, 2.0 * np.pi * 8.1), (0.3, 1.0))
SPRING, BENCH = LinearStiffness(1.08e6), rig.LinearStiffness(1.08e6)
DAMPER, DASHPOT = LinearDamping(1e4), rig.LinearDamping(1e4)


class Case(NamedTuple):
    """Effects of the bench and of the model, how long the mass is held, and the largest error over noise."""

    bench: tuple[rig.Law, ...]
    elements: tuple[AbstractElement, ...]
    held: tuple[float, float]
    error: float


WIDTH, CORNER = 2e-4, 2e-6
CASES = {
    "reversals": Case((rig.CoulombFriction(8.0),), (CoulombFriction(8.0, WIDTH),), (0.0, 0.0), 2e-3),
    "sticking": Case((rig.CoulombFriction(60.0),), (CoulombFriction(60.0, WIDTH),), (0.01, 0.1), 2e-3),
    "long holds": Case((rig.CoulombFriction(100.0),), (CoulombFriction(100.0, WIDTH),), (0.2, 0.9), 1e-2),
    "two directions": Case(
        (rig.CoulombFriction(40.0), rig.AsymmetricFriction(15.0)),
        (CoulombFriction(40.0, WIDTH), AsymmetricFriction(15.0, WIDTH)),
        (0.0, 0.1),
        4e-2,
    ),
    "falling": Case(
        (rig.StribeckFriction(30.0, 0.8, 0.01),),
        (StribeckFriction(30.0, 0.8, 0.01, WIDTH),),
        (0.0, 0.1),
        1e-1,
    ),
    "memory": Case(
        (rig.MaxwellBranch(2e5, 0.04), rig.CoulombFriction(60.0)),
        (MaxwellBranch(2e5, 0.04), CoulombFriction(60.0, WIDTH)),
        (0.01, 0.2),
        3e-2,
    ),
    "stop": Case((rig.EndStop(1e6, 2e-4),), (EndStop(1e6, 2e-4, 0.0, CORNER),), (0.0, 0.0), 5e-3),
    "play": Case((rig.Freeplay(5e5, 2e-4),), (Freeplay(5e5, 2e-4, CORNER),), (0.0, 0.0), 5e-3),
    "stop and friction": Case(
        (rig.EndStop(1e6, 2e-4), rig.CoulombFriction(30.0)),
        (EndStop(1e6, 2e-4, 0.0, CORNER), CoulombFriction(30.0, WIDTH)),
        (0.0, 0.1),
        5e-3,
    ),
}


def table(piece: rig.Tones, substeps: int, count: int = COUNT) -> jax.Array:
    """The acting force at the stages of each sample's steps, one lane."""
    share = np.arange(2 * substeps + 1) / (2.0 * substeps)
    times = (np.arange(count)[:, None] + share) / RATE
    return jnp.asarray(piece.forces(times.ravel()).reshape(times.shape))[..., None]


def still(drive: jax.Array) -> Instant:
    """A drive whose rate nothing asks for."""
    return Instant(drive, jnp.zeros_like(drive))


@eqx.filter_jit
def split(model: Isolator, drive: jax.Array, start: State) -> tuple[State, jax.Array]:
    """States and readings at the samples."""

    def observe(state, at):
        return state, read_record(model, state, at, "acceleration")

    return scan_records(model, RK4(), "acceleration", 1.0 / RATE, start, still(drive), observe)[1]


@eqx.filter_jit
def as_recorded(model: Isolator, drive: jax.Array, start: State) -> tuple[jax.Array, jax.Array]:
    """Readings of the motion at the samples, and as they are in a band-limited record."""

    def observe(state, at):
        return read_record(model, state, at, "acceleration")

    record = still(drive)
    _, sharp, ringing = scan_records(model, RK4(), "acceleration", 1.0 / RATE, start, record, observe)
    assert ringing is not None
    return sharp, add_ringing(sharp, ringing)


@eqx.filter_jit
def rounded(model: Isolator, drive: jax.Array, start: State) -> jax.Array:
    """Readings of the laws as they are rounded over their widths."""

    def body(state, record):
        stages = split_stages(record)
        reading = model.reading(state, stages[0], "acceleration")
        return advance(model, RK4(), "acceleration", 1.0 / RATE, state, stages), reading

    return jax.lax.scan(body, start, still(drive))[1]


@pytest.mark.parametrize("name", CASES)
def test_a_record_is_that_of_the_exact_bench_with_one_step_a_sample(name):
    case = CASES[name]
    piece = rig.Tones(0.0, COUNT / RATE + 1.0, 0.0, *TONES)
    plant = rig.Plant((BENCH, DASHPOT, *case.bench))
    exact = rig.response(plant, [piece], np.arange(COUNT) / RATE, displacement=5e-4, tolerance=1e-10)
    model = Isolator(MASS, (SPRING, DAMPER, *case.elements))
    start = (jnp.full(1, 5e-4), *(jnp.zeros(1),) * (1 + model.internal_states))
    assert Integrator().record_steps(model) == 1 < model.substeps
    states, reading = split(model, table(piece, 1), start)
    held = np.mean(np.asarray(states[1])[1:] == 0.0)
    assert case.held[0] <= held <= case.held[1]
    # Held or sliding at the same samples, so that no reading is off by the jump.
    error = np.max(np.abs(np.asarray(reading[:, 0]) - exact["acceleration"])) / NOISE
    before = np.asarray(rounded(model, table(piece, 4), start)[:, 0]) - exact["acceleration"]
    assert error < case.error
    assert error < 0.1 * np.max(np.abs(before)) / NOISE


@pytest.mark.parametrize(("limit", "steps", "share"), [(8.0, 1, 0.4), (8.0, 3, 0.4), (60.0, 1, 0.45)])
def test_jumps_are_read_as_an_anti_alias_filter_passes_them(limit, steps, share):
    piece = rig.Tones(0.0, COUNT / RATE + 1.0, 0.0, *TONES)
    plant = rig.Plant((BENCH, DASHPOT, rig.CoulombFriction(limit)))
    factor, taps = oversampling(RATE), anti_alias_taps(RATE)
    reach = (taps.size - 1) // (2 * factor)
    times = np.arange(factor * (COUNT - 1) + 1) / (RATE * factor)
    fine = rig.response(plant, [piece], times, displacement=5e-4)["acceleration"]
    wanted = decimated(fine, taps, factor)
    model = Isolator(MASS, (SPRING, DAMPER, CoulombFriction(limit, WIDTH)))
    start = (jnp.full(1, 5e-4), jnp.zeros(1))
    sharp, band_limited = (
        np.asarray(values)[reach : COUNT - reach, 0]
        for values in as_recorded(model, table(piece, steps), start)
    )
    before, after = (np.sqrt(np.mean((values - wanted) ** 2)) for values in (sharp, band_limited))
    # A sampled step differs from a band-limited one by 1/pi^2 of its square (Parseval), beyond the nearest
    # two samples by 1/pi^4; that a mass breaks loose, which is no jump, is sampled as it is.
    assert after < share * before


def test_free_decay_loses_four_fc_over_k_a_cycle_and_stops_in_the_dead_band():
    k, limit, first = 1.08e6, 60.0, 2e-3
    model = Isolator(MASS, (LinearStiffness(k), CoulombFriction(limit, WIDTH)))
    states, reading = split(model, jnp.zeros((COUNT, 3, 1)), (jnp.full(1, first), jnp.zeros(1)))
    x, v = np.asarray(states[0])[:, 0], np.asarray(states[1])[:, 0]
    # Half a cycle is a sine about -+Fc/k, at the natural frequency.
    omega, shift = np.sqrt(k / MASS), limit / k
    times = np.arange(COUNT) / RATE
    turns = np.floor(times * omega / np.pi)
    swings = int(np.ceil((first / shift - 1.0) / 2.0))
    sign = (-1.0) ** turns
    expected = sign * (first - (2.0 * turns + 1.0) * shift) * np.cos(omega * times - turns * np.pi)
    expected += sign * shift
    final = (-1.0) ** swings * (first - 2.0 * swings * shift)
    expected = np.where(turns < swings, expected, final)
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=1e-4 * first)
    assert abs(final) < shift
    rest = turns >= swings + 1
    assert np.all(v[rest] == 0.0)
    assert np.all(np.asarray(reading)[rest] == 0.0)
    assert np.ptp(x[rest]) == 0.0


SPLIT_MODELS = {
    "reversals": (
        ("k", "Fc"),
        lambda k, limit: (LinearStiffness(k), CoulombFriction(limit, WIDTH)),
        8.0,
        1e-7,
    ),
    "sticking": (
        ("k", "Fc"),
        lambda k, limit: (LinearStiffness(k), CoulombFriction(limit, WIDTH)),
        60.0,
        2e-4,
    ),
    "stop": (("k", "g"), lambda k, gap: (LinearStiffness(k), EndStop(1e6, gap, 0.3, CORNER)), 2e-4, 1e-7),
    "play": (("k", "g"), lambda k, gap: (LinearStiffness(k), Freeplay(5e5, gap, CORNER)), 2e-4, 1e-7),
}


@pytest.mark.parametrize("name", SPLIT_MODELS)
def test_derivatives_jump_at_events_as_central_differences_do(name):
    _, build, value, tolerance = SPLIT_MODELS[name]
    drive = table(rig.Tones(0.0, COUNT / RATE + 1.0, 0.0, *TONES), 1, 600)
    sizes = np.array([1.08e6, value, 1e-3, 1e-2])
    at = jnp.asarray([1.08e6, value, 1e-4, 3e-3])

    @jax.jit
    def readings(p):
        model = Isolator(MASS, (*build(p[0], p[1]), DAMPER))
        states, reading = split(model, drive, (jnp.full(1, p[2]), jnp.full(1, p[3])))
        return jnp.stack([*states, reading])[..., 0]

    slopes = np.asarray(jax.jit(jax.jacfwd(readings))(at)) * sizes
    for place, size in enumerate(sizes):
        step = 1e-6 * size * np.eye(4)[place]
        wanted = (np.asarray(readings(at + step)) - np.asarray(readings(at - step))) / 2e-6
        found = slopes[..., place]
        for row in range(3):
            largest = np.max(np.abs(wanted[row]))
            assert np.max(np.abs(found[row] - wanted[row])) < tolerance * largest


def test_what_friction_holds_knows_nothing_of_its_velocity_before():
    model = Isolator(MASS, (SPRING, CoulombFriction(60.0, WIDTH)))
    nothing = jnp.zeros((100, 3, 1))

    def last(v):
        return split(model, nothing, (jnp.zeros(1), jnp.full(1, v)))[0][1][-1, 0]

    value, slope = jax.jvp(last, (jnp.asarray(3e-4),), (jnp.asarray(1.0),))
    assert float(value) == 0.0
    assert float(slope) == 0.0


def test_a_mass_at_rest_is_held_until_the_drive_exceeds_friction():
    model = Isolator(MASS, (SPRING, CoulombFriction(60.0, WIDTH), AsymmetricFriction(20.0, WIDTH)))
    rest = (jnp.zeros(4), jnp.zeros(4))
    regime = find_regime(model, rest, Instant(jnp.asarray([79.0, 81.0, -39.0, -41.0])))
    np.testing.assert_array_equal(regime.direction, [0.0, 1.0, 0.0, -1.0])


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_a_model_without_jumps_moves_as_without_splitting(substeps):
    model = Isolator(MASS, (SPRING, DAMPER, MaxwellBranch(2e5, 0.04)))
    drive = table(rig.Tones(0.0, COUNT / RATE + 1.0, 0.0, *TONES), substeps)
    start = (jnp.full(1, 1e-4), jnp.zeros(1), jnp.zeros(1))
    # But for the last digits: one loop is a kernel, and the other is not.
    whole = rounded(model, drive, start)
    size = np.max(np.abs(whole))
    np.testing.assert_allclose(split(model, drive, start)[1], whole, rtol=0.0, atol=1e-13 * size)


def test_a_held_drive_acts_on_both_pieces_of_a_split_step():
    # Constant between samples: the closed form of each piece is a sine, found by the exact bench.
    rng = np.random.default_rng(2)
    values = 150.0 * np.repeat(rng.standard_normal(60), 10)
    lines = [rig.Line(i / RATE, (i + 1) / RATE, i / RATE, float(f)) for i, f in enumerate(values)]
    plant = rig.Plant((BENCH, DASHPOT, rig.CoulombFriction(40.0)))
    exact = rig.response(plant, lines, np.arange(values.size) / RATE, tolerance=1e-10)
    model = Isolator(MASS, (SPRING, DAMPER, CoulombFriction(40.0, WIDTH)))
    drive = jnp.asarray(tabulate(values, RATE, "zero_order", 1)[0])[..., None]
    states, _ = split(model, drive, (jnp.zeros(1), jnp.zeros(1)))
    assert np.any(np.asarray(states[1])[50:] == 0.0)
    size = np.max(np.abs(exact["velocity"]))
    np.testing.assert_allclose(states[1][:, 0], exact["velocity"], rtol=0.0, atol=1e-3 * size)


def test_many_steps_a_sample_are_split_one_by_one():
    model = Isolator(MASS, (SPRING, DAMPER, CoulombFriction(60.0, WIDTH)))
    piece = rig.Tones(0.0, COUNT / RATE + 1.0, 0.0, *TONES)
    coarse, fine = (table(piece, steps, 50)[:, :, 0] for steps in (1, 3))
    start = (jnp.asarray(1e-4), jnp.asarray(3e-3))

    @jax.jit
    def last(rows):
        def body(state, row):
            stages = split_stages(still(row))
            return advance_record(model, RK4(), "acceleration", 1.0 / RATE, state, stages)

        return jax.lax.scan(body, start, rows)[0][1]

    np.testing.assert_allclose(last(coarse), last(fine), rtol=0.0, atol=1e-6)
