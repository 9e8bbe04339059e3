"""Orbits of imposed displacement on a grid, with their change by each step of a fit's covariance.

Over displacement and frequency the orbits do not fold, so that one grid holds the response at every drive
amplitude. One compiled loop closes all of them by Newton's method on the drive, and the same derivatives give
their multipliers and how they move with the coefficients.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ...models import CoefficientErrors, Integrator, Isolator
from ..orbit import Sine, imposed_balance, rest_displacement, trajectory, value_and_jacobian
from ._frequency_response import fundamental

_TRIED = np.logspace(-9.0, 1.0, 241)
"""Displacement amplitudes of which some become the grid [m]: 24 a decade."""

_MARGIN = (0.6, 1.4)
"""Ends of the grid, over the least and the largest displacement that the drive amplitudes need."""

_MOST_STEPS = 12
"""Steps of Newton's method at most, each of at most a third of the unknown."""

_CLOSED_TO = 1e-6
"""Last relative step after which an orbit counts as closed: its error is of the order of the square."""

FUNDAMENTALS = ("drive", "acted", "displacement", "passed")
"""Whose fundamentals a node has: the recorded drive, the one that acted, the displacement, and what passes
through the isolator: the force on the ground, or the absolute acceleration under base excitation."""


class ImposedMotions(NamedTuple):
    """Orbits of imposed displacement, frequency first.

    Attributes:
        frequencies: [Hz].
        displacements: largest displacement over rest [m].
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
    """

    rest: Float[Array, ""]
    drive: tuple[Float[Array, "displacement frequency"], Float[Array, "displacement frequency"]]
    internal: tuple[Float[Array, "displacement frequency"], ...]


def impose_motions(
    errors: CoefficientErrors,
    amplitudes: Sequence[float],
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
    errors = errors._replace(values=jnp.asarray(errors.values), root=jnp.asarray(errors.root))
    starts = jax.tree.map(np.asarray, _balances(errors.model, jnp.asarray(frequencies)))
    needed = np.hypot(*starts.drive)
    rows = _rows(needed, min(amplitudes), max(amplitudes))
    drive, internal = ([part[rows].ravel() for part in parts] for parts in (starts.drive, starts.internal))
    shape = rows.size, frequencies.size
    found = _closed(
        errors.model,
        errors,
        integrator,
        jnp.asarray(starts.rest),
        jnp.asarray(np.repeat(_TRIED[rows], shape[1])),
        jnp.asarray(np.tile(frequencies, shape[0])),
        jnp.asarray(np.stack([*drive, *internal], axis=-1)),
    )
    values, changes, matrices, closed = (np.asarray(one) for one in found)
    roots = np.linalg.eigvals(np.where(closed[:, None, None], matrices, 0.0))

    def gridded(one: np.ndarray) -> np.ndarray:
        return np.swapaxes(one.reshape(*shape, *one.shape[1:]), 0, 1)

    return ImposedMotions(
        frequencies,
        _TRIED[rows],
        np.moveaxis(gridded(values), -1, 0),
        np.moveaxis(gridded(changes), (-2, -1), (0, 1)),
        gridded(roots).astype(complex),
        gridded(closed),
    )


@eqx.filter_jit
def _balances(model: Isolator, frequencies: Float[Array, " frequency"]) -> _Starts:
    """Give the one-harmonic answers at all displacements that are tried."""
    rest = rest_displacement(model)

    def at(amplitude: Array) -> tuple[Sine, tuple[Array, ...]]:
        return imposed_balance(model, amplitude + 0.0 * frequencies, frequencies, rest)

    drive, internal = jax.vmap(at)(jnp.asarray(_TRIED))
    return _Starts(rest, (drive.sine, jnp.asarray(drive.cosine)), tuple(one[:, 0] for one in internal))


def _rows(
    needed: Float[np.ndarray, "displacement frequency"], least: float, most: float
) -> np.ndarray:
    """Give which displacements make the grid: from below the least motion to above the largest from rest."""
    beyond = np.maximum.accumulate(needed >= most, axis=0)
    reached = np.where(beyond.any(axis=0), beyond.argmax(axis=0), len(_TRIED) - 1)
    below = np.minimum.accumulate(needed < least, axis=0).sum(axis=0)
    ends = _MARGIN[0] * _TRIED[max(int(below.min()) - 1, 0)], _MARGIN[1] * _TRIED[reached.max()]
    first, last = np.searchsorted(_TRIED, ends)
    return np.arange(first, min(last + 1, len(_TRIED)))


@eqx.filter_jit
def _closed(
    model: Isolator,
    errors: CoefficientErrors,
    integrator: Integrator,
    rest: Float[Array, ""],
    displacement: Float[Array, " node"],
    frequency: Float[Array, " node"],
    start: Float[Array, "node unknown"],
) -> tuple[Complex[Array, "node 4"], Complex[Array, "node 4 step"], Float[Array, "node state state"], Array]:
    states = 2 + model.internal_states

    def scales(a: Array, f: Array, begin: Array) -> tuple[Array, Array]:
        """Give the sizes of the unknowns, the drive and the internal states, and of the states."""
        push, inner = jnp.full(2, jnp.hypot(begin[0], begin[1])), jnp.abs(begin[2:])
        inner = jnp.where(inner == 0.0, a, inner)
        return jnp.concatenate([push, inner]), jnp.concatenate([jnp.stack([a, a * 2.0 * np.pi * f]), inner])

    def ends(a: Array, f: Array, begin: Array, moved: Array) -> tuple[Array, Array]:
        """Give what an orbit leaves open, over the size of its states, and its fundamentals over a."""
        sizes, own = scales(a, f, begin)
        unknown, shift, steps = jnp.split(moved, [states, 2 * states])
        isolator, unknown = errors.moved(steps), unknown * sizes
        state = jnp.concatenate([jnp.stack([rest + a, 0.0 * a]), unknown[2:]]) + shift * own
        drive = Sine(unknown[0], unknown[1], f)
        path = trajectory(isolator, integrator, drive, tuple(state))
        left = (jnp.stack([along[-1] for along in path]) - state) / own
        turn = 2.0 * np.pi / (path[0].shape[0] - 1) * np.arange(path[0].shape[0])
        at = drive.at(jnp.asarray(np.sin(turn)), jnp.asarray(np.cos(turn)))
        acted, _ = isolator.drive(at)
        if isolator.excitation == "base_acceleration":
            passed = isolator.motion(path, at, "acceleration")
        else:
            passed = isolator.restoring_force(path)
        signals = (at.drive, acted, path[0], passed)
        return left, jnp.stack([fundamental(jnp.asarray(signal)) for signal in signals]) / a

    def evaluated(a: Array, f: Array, begin: Array, unknown: Array) -> tuple[Array, ...]:
        still = jnp.zeros(states + errors.steps)
        (left, values), (slope, change) = value_and_jacobian(
            lambda moved: ends(a, f, begin, moved), jnp.concatenate([unknown, still])
        )
        by_unknown, by_state, by_step = jnp.split(slope, [states, 2 * states], axis=1)
        follow = jnp.linalg.solve(by_unknown, jnp.concatenate([left[:, None], by_step], axis=1))
        step, moves = follow[:, 0], follow[:, 1:]
        values = values - change[:, :states] @ step
        changes = change[:, 2 * states :] - change[:, :states] @ moves
        return step, values, changes, by_state + jnp.eye(states)

    def body(carry: tuple) -> tuple:
        unknown, _, count = carry
        found = jax.vmap(evaluated)(displacement, frequency, start, unknown)
        size = jnp.max(jnp.abs(found[0]), axis=1)
        # Far from the balance of one harmonic a full step may leave the basin.
        damping = jnp.minimum(1.0, 0.3 / size)[:, None]
        return unknown - damping * found[0], (size, *found[1:]), count + 1

    def unfinished(carry: tuple) -> Array:
        _, (size, *_), count = carry
        return jnp.any(size > _CLOSED_TO) & (count < _MOST_STEPS)

    nodes = displacement.size
    begin = start / jax.vmap(lambda *node: scales(*node)[0])(displacement, frequency, start)
    none = (
        jnp.full(nodes, jnp.inf),
        jnp.zeros((nodes, len(FUNDAMENTALS)), complex),
        jnp.zeros((nodes, len(FUNDAMENTALS), errors.steps), complex),
        jnp.zeros((nodes, states, states)),
    )
    _, (size, values, changes, matrices), _ = jax.lax.while_loop(unfinished, body, (begin, none, 0))
    return values, changes, matrices, size <= _CLOSED_TO
