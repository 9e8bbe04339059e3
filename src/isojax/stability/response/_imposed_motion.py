"""Orbits of imposed displacement on a grid, with their change by each step of a fit's covariance.

Over displacement and frequency the orbits do not fold, so that one grid holds the response at every drive
amplitude. One compiled loop closes all of them by Newton's method on the drive, and the same derivatives give
their multipliers and how they move with the coefficients.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._quick_jit import quick_jit
from ..._small_systems import solve
from ...models import CoefficientErrors, Integrator, Isolator
from ..orbit import (
    Sine,
    imposed_balance,
    is_odd,
    overtone_response,
    rest_displacement,
    trajectory,
    value_and_jacobian,
    with_overtones,
)
from ._frequency_response import fundamental

_TRIED = np.logspace(-9.0, 1.0, 241)
"""Displacement amplitudes whose one-harmonic balances bound the grid and start its orbits [m]."""

_DISPLACEMENTS = 40
"""Displacements of the grid, at equal ratios: one count, so that one compiled loop serves every grid."""

_EXTENSIONS = 2
"""Times that the grid is made higher at most, until a drive amplitude holds no more motion beyond."""

_MARGIN = (0.6, 1.4)
"""Ends of the grid, over the least and the largest displacement that the drive amplitudes need."""

_MOST_DRIVE_STEPS = 12
"""Steps of Newton's method at most, each of at most a third of the unknown."""

_CLOSED_TO = 1e-6
"""Last relative step after which an orbit counts as closed: its error is of the order of the square."""

_RUNS_AWAY = 1.5
"""Growth of an internal state from one displacement that is tried to the next, which is a tenth larger, that
no law has."""

_LARGEST = 2.0
"""Fundamental of the displacement over its largest value beyond which a motion did not close."""

FUNDAMENTALS = ("drive", "acted", "displacement", "passed")
"""Whose fundamentals a node has: the recorded drive, the one that acted, the displacement, and what passes
through the isolator: the force on the ground, or the absolute acceleration under base excitation."""


_DISPLACEMENT = FUNDAMENTALS.index("displacement")


class ImposedMotions(NamedTuple):
    """Orbits of imposed displacement, frequency first.

    Attributes:
        frequencies: [Hz].
        displacements: largest over rest [m]; under a drive with harmonics that of the fundamental alone.
        fundamentals: complex amplitudes of `FUNDAMENTALS`, over the displacement.
        changes: of these by each independent step, at the same displacement and frequency.
        multipliers: Floquet multipliers over one drive period.
        closed: whether each orbit was found.
    """

    frequencies: Float[np.ndarray, " frequency"]
    displacements: Float[np.ndarray, " displacement"]
    fundamentals: Complex[np.ndarray, "4 frequency displacement"]
    changes: Complex[np.ndarray, "4 step frequency displacement"]
    multipliers: Complex[np.ndarray, "frequency displacement state"]
    closed: Bool[np.ndarray, "frequency displacement"]


class _Starts(NamedTuple):
    """One-harmonic answers, displacement first.

    Attributes:
        rest: displacement at rest [m].
        drive: sine and cosine part of the drive.
        internal: internal states at the largest displacement.
        sizes: largest of each along the cycle.
    """

    rest: Float[Array, ""]
    drive: tuple[Float[Array, "displacement frequency"], Float[Array, "displacement frequency"]]
    internal: tuple[Float[Array, "displacement frequency"], ...]
    sizes: tuple[Float[Array, "displacement frequency"], ...]


def impose_motions(
    errors: CoefficientErrors,
    amplitudes: Float[np.ndarray, " amplitude"],
    frequencies: Float[np.ndarray, " frequency"],
    integrator: Integrator,
) -> ImposedMotions:
    """Find the orbits over displacement and frequency that some drive amplitudes can hold.

    Args:
        errors: of the coefficients of the model.
        amplitudes: of the drive [N, or m/s^2 for base excitation].
        frequencies: of the grid [Hz].
        integrator: steps a period.

    Returns:
        The orbits, at displacements of equal ratio.
    """
    states = 2 + errors.model.internal_states
    errors = errors._replace(values=jnp.asarray(errors.values), root=jnp.asarray(errors.root))
    rest, *parts = jax.tree.map(np.asarray, _balances(errors.model, jnp.asarray(frequencies)))
    balances = _as_far_as_known(np.stack([one for part in parts for one in part]), states)
    low, high = _ends(np.hypot(*balances[:2]), float(np.min(amplitudes)), float(np.max(amplitudes)))
    most = float(np.max(amplitudes))

    def grid(high: float) -> ImposedMotions:
        places = np.geomspace(low, high, _DISPLACEMENTS)
        return _grid(errors, integrator, rest, balances, places, frequencies)

    motions = grid(high)
    for _ in range(_EXTENSIONS):
        drive = motions.displacements[-1] * np.abs(motions.fundamentals[0, :, -1])
        if not np.any(drive[motions.closed[:, -1]] < most):
            break
        high *= _MARGIN[1]
        motions = grid(high)
    return motions


def _grid(
    errors: CoefficientErrors,
    integrator: Integrator,
    rest: Float[np.ndarray, ""],
    balances: Float[np.ndarray, "number tried frequency"],
    displacements: Float[np.ndarray, " displacement"],
    frequencies: Float[np.ndarray, " frequency"],
) -> ImposedMotions:
    """Find the orbits of a grid, from the balances of the displacements that were tried."""
    states, shape = 2 + errors.model.internal_states, (displacements.size, frequencies.size)
    rows = np.searchsorted(_TRIED, displacements).clip(max=_TRIED.size - 1)
    begin = balances[:, rows] * (displacements / _TRIED[rows])[:, None]
    start, sizes = np.split(begin.reshape(begin.shape[0], -1).T, [states], axis=1)
    sizes = np.concatenate([np.repeat(np.hypot(*start.T[:2])[:, None], 2, axis=1), sizes], axis=1)
    half = is_odd(errors.model, float(displacements.max()))
    if errors.model.harmonics:
        start, sizes = _with_begin(errors.model, displacements, frequencies, rest, start, sizes)
    found = _closed(
        errors,
        integrator,
        jnp.asarray(rest),
        jnp.asarray(np.repeat(displacements, shape[1])),
        jnp.asarray(np.tile(frequencies, shape[0])),
        jnp.asarray(start),
        jnp.asarray(sizes),
        half,
    )
    values, changes, matrices, closed = (np.asarray(one) for one in found)
    closed = closed & (np.abs(values[:, _DISPLACEMENT]) < _LARGEST)
    roots = np.linalg.eigvals(np.where(closed[:, None, None], matrices, 0.0)).astype(complex)
    roots = roots**2 if half else roots

    def gridded(one: np.ndarray) -> np.ndarray:
        return np.swapaxes(one.reshape(*shape, *one.shape[1:]), 0, 1)

    return ImposedMotions(
        frequencies,
        displacements,
        np.moveaxis(gridded(values), -1, 0),
        np.moveaxis(gridded(changes), (-2, -1), (0, 1)),
        gridded(roots),
        gridded(closed),
    )


def _with_begin(
    model: Isolator,
    displacements: Float[np.ndarray, " displacement"],
    frequencies: Float[np.ndarray, " frequency"],
    rest: Float[np.ndarray, ""],
    start: Float[np.ndarray, "node unknown"],
    sizes: Float[np.ndarray, "node unknown"],
) -> tuple[Float[np.ndarray, "node more"], Float[np.ndarray, "node more"]]:
    """Add what displacement and velocity at tau = 0 have beside the fundamental, and their sizes.

    With harmonics of the drive a node imposes the fundamental of the displacement: the largest displacement
    hangs on the phases of all of them, and goes from one maximum to another.
    """
    a, f = np.repeat(displacements, frequencies.size), np.tile(frequencies, displacements.size)
    beside = _beside_fundamental(model, *(jnp.asarray(one) for one in (a, f, rest, start[:, :2])))
    own = np.stack([a, 2.0 * np.pi * f * a], axis=1)
    return np.concatenate([start, np.asarray(beside).T], axis=1), np.concatenate([sizes, own], axis=1)


@quick_jit
def _beside_fundamental(
    model: Isolator, amplitude: Array, frequency: Array, rest: Array, drive: Float[Array, "node 2"]
) -> Float[Array, "2 node"]:
    acting = with_overtones(model, Sine(drive[:, 0], drive[:, 1], frequency))
    return jnp.stack(overtone_response(model, acting, amplitude, rest))


@quick_jit
def _balances(model: Isolator, frequencies: Float[Array, " frequency"]) -> _Starts:
    """Give the one-harmonic answers at all displacements that are tried."""
    rest = rest_displacement(model)

    def at(amplitude: Array) -> tuple[Sine, tuple[Array, ...]]:
        return imposed_balance(model, amplitude + 0.0 * frequencies, frequencies, rest)

    drive, internal = jax.vmap(at)(jnp.asarray(_TRIED))
    sizes = tuple(jnp.max(jnp.abs(one), axis=1) for one in internal)
    return _Starts(rest, (drive.sine, jnp.asarray(drive.cosine)), tuple(one[:, 0] for one in internal), sizes)


def _as_far_as_known(
    balances: Float[np.ndarray, "number tried frequency"], states: int
) -> Float[np.ndarray, "number tried frequency"]:
    """Put in place of balances that ran away the last one before, made as much larger as its displacement.

    A stiff law with internal states may need shorter steps than a balance takes: they grow without bound.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        growth = balances[states:, 1:] / balances[states:, :-1]
        away = np.concatenate([[False], np.any(growth > _RUNS_AWAY, axis=(0, 2))])
        calm = np.all(np.isfinite(balances), axis=(0, 2)) & ~away
    last = np.arange(calm.size).clip(max=max(int(np.logical_and.accumulate(calm).sum()) - 1, 0))
    return balances[:, last] * (_TRIED / _TRIED[last])[:, None]


def _ends(needed: Float[np.ndarray, "tried frequency"], least: float, most: float) -> tuple[float, float]:
    """Give the ends of the grid: below the least motion, and above the largest that grows from rest."""
    beyond = np.maximum.accumulate(needed >= most, axis=0)
    reached = np.where(beyond.any(axis=0), beyond.argmax(axis=0), len(_TRIED) - 1)
    below = np.minimum.accumulate(needed < least, axis=0).sum(axis=0)
    low, high = _TRIED[max(int(below.min()) - 1, 0)], _TRIED[int(reached.max())]
    return _MARGIN[0] * float(low), _MARGIN[1] * float(high)


@quick_jit
def _closed(
    errors: CoefficientErrors,
    integrator: Integrator,
    rest: Float[Array, ""],
    displacement: Float[Array, " node"],
    frequency: Float[Array, " node"],
    start: Float[Array, "node unknown"],
    sizes: Float[Array, "node unknown"],
    half: bool,
) -> tuple[Complex[Array, "node 4"], Complex[Array, "node 4 step"], Float[Array, "node state state"], Array]:
    states = 2 + errors.model.internal_states
    count = start.shape[1]
    turns, sign = (0.5, -1.0) if half else (1.0, 1.0)
    sizes = jnp.where(sizes == 0.0, displacement[:, None], sizes)

    def ends(a: Array, f: Array, size: Array, moved: Array) -> tuple[Array, Array]:
        """Give what an orbit leaves open, over the size of its states, and its fundamentals over a."""
        unknown, shift, steps = jnp.split(moved, [count, count + states])
        isolator, unknown = errors.moved(steps), unknown * size
        own = jnp.concatenate([jnp.stack([a, a * 2.0 * np.pi * f]), size[2:states]])
        begin = jnp.concatenate([jnp.stack([rest + a, 0.0 * a]), unknown[2:states]])
        if count > states:
            begin = begin.at[:2].add(unknown[states:])
        state = begin + shift * own
        drive = with_overtones(isolator, Sine(unknown[0], unknown[1], f))
        path = trajectory(isolator, integrator, drive, tuple(state), turns=turns, rounded=True)
        left = (sign * jnp.stack([along[-1] for along in path]) - state) / own
        phase = 2.0 * np.pi * turns / (path[0].shape[0] - 1) * np.arange(path[0].shape[0])
        at = drive.at(drive.waves(phase))
        acted, _ = isolator.drive(at)
        if isolator.excitation == "base_acceleration":
            passed = isolator.motion(path, at, "acceleration")
        else:
            passed = isolator.restoring_force(path)
        signals = (at.drive, acted, path[0], passed)
        found = jnp.stack([fundamental(jnp.asarray(signal), turns) for signal in signals]) / a
        if count > states:
            off = found[_DISPLACEMENT] - 1.0
            left = jnp.concatenate([left, jnp.stack([jnp.real(off), jnp.imag(off)])])
        return left, found

    def evaluated(a: Array, f: Array, size: Array, unknown: Array) -> tuple[Array, ...]:
        still = jnp.zeros(states + errors.steps)
        (left, values), (slope, change) = value_and_jacobian(
            lambda moved: ends(a, f, size, moved), jnp.concatenate([unknown, still])
        )
        by_unknown, by_state, by_step = jnp.split(slope, [count, count + states], axis=1)
        follow = solve(by_unknown, jnp.concatenate([left[:, None], by_step], axis=1))
        step, moves = follow[:, 0], follow[:, 1:]
        values = values - change[:, :count] @ step
        changes = change[:, count + states :] - change[:, :count] @ moves
        return step, values, changes, by_state[:states] + jnp.eye(states)

    def body(carry: tuple) -> tuple:
        unknown, _, count = carry
        found = jax.vmap(evaluated)(displacement, frequency, sizes, unknown)
        size = jnp.max(jnp.abs(found[0]), axis=1)
        # Far from the balance of one harmonic a full step may leave the basin.
        damping = jnp.minimum(1.0, 0.3 / size)[:, None]
        return unknown - damping * found[0], (size, *found[1:]), count + 1

    def unfinished(carry: tuple) -> Array:
        _, (size, *_), count = carry
        return jnp.any(size > _CLOSED_TO) & (count < _MOST_DRIVE_STEPS)

    nodes = displacement.size
    none = (
        jnp.full(nodes, jnp.inf),
        jnp.zeros((nodes, len(FUNDAMENTALS)), complex),
        jnp.zeros((nodes, len(FUNDAMENTALS), errors.steps), complex),
        jnp.zeros((nodes, states, states)),
    )
    _, (size, values, changes, matrices), _ = jax.lax.while_loop(unfinished, body, (start / sizes, none, 0))
    return values, changes, matrices, size <= _CLOSED_TO
