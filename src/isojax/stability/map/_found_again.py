"""The cells of a map found again for another model: pure JAX, so that every transformation goes through."""

import dataclasses
import functools
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._small_systems import solve
from ...models import Isolator
from ..orbit import (
    ShootingMethod,
    Sine,
    half_range,
    has_continuous_slopes,
    modulus,
    multipliers,
    trajectory,
    value_and_jacobian,
    with_overtones,
)
from ._batched_newton import FOUND
from ._map_method import Lane, MapMethod, kinks_between
from ._single_orbits import single_orbit
from ._stability_map import StabilityMap

_CELL_CLOSED_TO, _MOST_CELL_STEPS = 1e-9, 12
"""Largest last step of Newton's method, over the size of the motion, and steps after which a cell fails."""

_CELLS_AT_ONCE, _SINGLE_ORBITS_AT_ONCE = 8192, 256
"""Cells computed at once, so that they stay in the cache: by one integration each, or as single orbits."""


class FoundCells(NamedTuple):
    """Orbits of some cells, cell first: see `StabilityMap`."""

    start: Float[Array, "cell state"]
    direction: Float[Array, "cell 2"]
    phases: Float[Array, "cell crossing"]
    multipliers: Array
    response: Float[Array, " cell"]
    found: Bool[Array, " cell"]


class _Way(NamedTuple):
    """How cells are found again; constant to JAX."""

    method: MapMethod
    kinks: Int[Array, " crossing"]
    sizes: Float[Array, " unknown"]


def found_again(
    smap: StabilityMap,
    model: Isolator,
    more_force: Float[Array, ""] | float = 0.0,
    more_frequency: Float[Array, ""] | float = 0.0,
) -> StabilityMap:
    """Find the orbits of a map again for another model, each from the one that the map holds.

    Args:
        smap: the map, of known numbers.
        model: the isolator; traced or not.
        more_force: by how much the drive of every cell is larger [N, or m/s^2 for base excitation].
        more_frequency: by how much its frequency is larger [Hz].

    Returns:
        The map. An orbit that the map lacks is not looked for.
    """
    shape, states = smap.spectral_radius.shape, smap.start.shape[-1]
    held = np.isfinite(np.asarray(smap.spectral_radius).ravel())
    found = cells_again(smap, model, np.arange(held.size), more_force, more_frequency)
    radius = modulus(found.multipliers[:, 0]).reshape(shape)
    good = found.found.reshape(shape)
    # A place that held no orbit holds none now.
    ending = functools.partial(_ending, len(shape) == 3)
    for _ in shape:
        ending = jax.vmap(ending)
    return dataclasses.replace(
        smap,
        model=model,
        amplitudes=smap.amplitudes + more_force,
        frequencies=smap.frequencies + more_frequency,
        spectral_radius=radius,
        multipliers=found.multipliers.reshape(*shape, states),
        start=found.start.reshape(smap.start.shape),
        direction=found.direction.reshape(smap.direction.shape),
        phases=found.phases.reshape(smap.phases.shape),
        response=found.response.reshape(shape),
        count=jnp.sum(good, axis=0) if len(shape) == 3 else good.astype(int),
        result=ending(good, jnp.asarray(held).reshape(shape)),
        probability_stable=None,
        probability_coexisting=None,
        standard_errors=None,
        chance_error=None,
    )


def found_together(smap: StabilityMap) -> Bool[np.ndarray, " cell"]:
    """Say of which cells of a map, flattened, the orbits are found again by one compiled step for all.

    Args:
        smap: the map.

    Returns:
        True there; the others are found as single orbits, or hold none.
    """
    with jax.ensure_compile_time_eval():
        smooth = has_continuous_slopes(smap.model)
    held = np.isfinite(np.asarray(smap.spectral_radius))
    return (held & np.asarray(smap.split) & smooth).ravel()


def cells_again(
    smap: StabilityMap,
    model: Isolator,
    cells: Int[np.ndarray, " cell"],
    more_force: Float[Array, ""] | float,
    more_frequency: Float[Array, ""] | float,
) -> FoundCells:
    """Find the orbits of some cells again; see `found_again`.

    Args:
        smap: the map.
        model: the isolator; traced or not.
        cells: their places in the flattened map.
        more_force: by how much the drive is larger [N, or m/s^2 for base excitation].
        more_frequency: by how much its frequency is larger [Hz].

    Returns:
        The orbits; not found where the map holds none.
    """
    shape, states = smap.spectral_radius.shape, smap.start.shape[-1]
    force = jnp.broadcast_to(smap.amplitudes[:, None], shape).ravel()[cells] + more_force
    frequency = jnp.broadcast_to(smap.frequencies, shape).ravel()[cells] + more_frequency
    held = np.isfinite(np.asarray(smap.spectral_radius).ravel())[cells]
    together = found_together(smap)[cells]
    start, direction = smap.start.reshape(-1, states)[cells], smap.direction.reshape(-1, 2)[cells]
    phases = smap.phases.reshape(smap.spectral_radius.size, smap.phases.shape[-1])[cells]
    steps = jnp.asarray(smap.integrator.steps_a_period(smap.model))
    method = MapMethod(smap.integrator, smap.symmetric, smap.sides, steps)
    kinks = kinks_between(smap.sides)
    if together.all():
        return _close(model, method, kinks, start, direction, phases, force, frequency)
    found = FoundCells(
        jnp.full(start.shape, jnp.nan),
        jnp.full(direction.shape, jnp.nan),
        jnp.full(phases.shape, jnp.nan),
        jnp.full((cells.size, states), jnp.nan + 0j),
        jnp.full(cells.size, jnp.nan),
        jnp.zeros(cells.size, bool),
    )
    places = np.flatnonzero(together)
    if places.size:
        own = (start[places], direction[places], phases[places], force[places], frequency[places])
        found = _put(found, places, _close(model, method, kinks, *own))
    places = np.flatnonzero(held & ~together)
    if places.size:
        # With the steps of the map: fewer may follow no state that is faster than the motion.
        own = ShootingMethod(smap.integrator, 1, smap.symmetric)
        single = _single(model, own, smap.states_at_zero(cells[places]), force[places], frequency[places])
        # Where kinks are passed is of no interest: they are not split at.
        found = _put(found, places, single._replace(phases=phases[places]))
    return found


def _ending(coexisting: bool, good: Bool[Array, ""], held: Bool[Array, ""]) -> RESULTS:
    failed = RESULTS.not_converged
    if coexisting:
        failed = RESULTS.where(held, failed, RESULTS.no_further_orbit)
    return RESULTS.where(good, RESULTS.promote(diffrax.RESULTS.successful), failed)


def _put(cells: FoundCells, places: np.ndarray, found: FoundCells) -> FoundCells:
    return jax.tree.map(lambda all_of, some: all_of.at[places].set(some), cells, found)


@quick_jit
def _close(
    model: Isolator,
    method: MapMethod,
    kinks: Int[Array, " crossing"],
    start: Float[Array, "cell state"],
    direction: Float[Array, "cell 2"],
    phases: Float[Array, "cell crossing"],
    force: Float[Array, " cell"],
    frequency: Float[Array, " cell"],
) -> FoundCells:
    states = start.shape[1]

    def one(cell: tuple[Array, ...]) -> FoundCells:
        start, direction, phases, push, rate = cell
        size = jnp.abs(start[0])
        inner = jnp.where(start[2:] == 0.0, size, jnp.abs(start[2:]))
        sizes = jnp.concatenate([size[None], jnp.ones(1), inner, jnp.ones(phases.size)])
        way = _Way(method, kinks, sizes)
        turn = jnp.arctan2(direction[1], direction[0])
        begin = jnp.concatenate([start[:1], turn[None], start[2:], phases]) / sizes
        live = model, push, rate
        still = frozen(live)

        def newton(carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            root, _, count = carry
            left, slope = value_and_jacobian(lambda at: _gap(at, still, way)[0], root)
            step = solve(slope, left)
            size = jnp.max(jnp.abs(step))
            # Far off, a full step may leave the basin of the orbit.
            return root - step * jnp.minimum(1.0, 0.3 / size), size, count + 1

        def unfinished(carry: tuple[Array, Array, Array]) -> Array:
            _, size, count = carry
            return ~(size <= _CELL_CLOSED_TO) & ~jnp.isnan(size) & (count < _MOST_CELL_STEPS)

        first = (begin, jnp.asarray(jnp.inf), jnp.asarray(0))
        root, size, _ = jax.lax.while_loop(unfinished, newton, first)
        _, (real, matrix) = _gap_and_matrix(root, still, way)
        real, matrix = with_derivatives((real, matrix), _gap_and_matrix, root, live, way)
        state, drive = _state_and_drive(real, live, states)
        # A motion starts at its largest displacement; the rest of one that is symmetric adds nothing to it.
        response = jnp.abs(state[0])
        if not method.half or model.harmonics:
            acting, turns = with_overtones(model, drive), 0.5 if method.half else 1.0
            path = trajectory(model, method.integrator, acting, tuple(state), turns=turns)
            response = half_range(model, acting, path, turns)
        roots = multipliers(matrix)
        roots = roots * roots if method.half else roots
        found = (size <= method.integrator.map_tolerance) & jnp.all(jnp.isfinite(matrix))
        blank = jnp.where(found, 1.0, jnp.nan)
        way_of_drive = jnp.stack([jnp.cos(real[1]), jnp.sin(real[1])])
        return FoundCells(
            state * blank,
            way_of_drive * blank,
            real[states:] * blank,
            roots * blank,
            response * blank,
            found,
        )

    return jax.lax.map(one, (start, direction, phases, force, frequency), batch_size=_CELLS_AT_ONCE)


def _state_and_drive(
    real: Float[Array, " unknown"],
    live: tuple[Isolator, Float[Array, ""], Float[Array, ""]],
    states: int,
) -> tuple[Float[Array, " state"], Sine]:
    """Give the start, at which the velocity is zero, and the drive, whose phase is counted from there."""
    _, push, frequency = live
    state = jnp.concatenate([real[:1], jnp.zeros(1), real[2:states]])
    return state, Sine(push * jnp.cos(real[1]), push * jnp.sin(real[1]), frequency)


def _gap(
    root: Array, live: tuple[Isolator, Array, Array], way: _Way, shift: Array | None = None
) -> tuple[Array, Array]:
    """Give what vanishes for a cell's orbit, and the state that its period ends with."""
    states = root.size - way.kinks.size
    real = root * way.sizes
    state, drive = _state_and_drive(real, live, states)
    begin = state if shift is None else state + shift
    lane = Lane(tuple(begin), drive, tuple(real[states:]), real[0])
    moved, reached = way.method.moved_past(live[0], lane, way.kinks)
    end, omega = jnp.stack(moved), drive.angular_frequency
    scale = jnp.concatenate([way.sizes[:1], way.sizes[:1] * omega, way.sizes[2:states]])
    return jnp.concatenate([(end - state) / scale, reached]), end


def _gap_and_matrix(
    root: Array, live: tuple[Isolator, Array, Array], way: _Way
) -> tuple[Array, tuple[Array, Array]]:
    """Give the residual; the unknowns in SI units and the derivative of the map by the start.

    Where slopes are continuous across kinks, their instants need not follow a disturbance.
    """

    def after(shift: Array) -> tuple[Array, Array]:
        left, end = _gap(root, live, way, shift)
        return end, left

    matrix, left = jax.jacfwd(after, has_aux=True)(jnp.zeros(root.size - way.kinks.size))
    return left, (root * way.sizes, matrix)


@quick_jit
def _single(
    model: Isolator,
    method: ShootingMethod,
    y0: Float[Array, "cell state"],
    force: Float[Array, " cell"],
    frequency: Float[Array, " cell"],
) -> FoundCells:
    def one(cell: tuple[Array, Array, Array]) -> FoundCells:
        start, push, rate = cell
        state, direction, phases, roots, _, size, code = single_orbit(model, method, push, rate, start)
        return FoundCells(state, direction, phases, roots, size, code == FOUND)

    return jax.lax.map(one, (y0, force, frequency), batch_size=_SINGLE_ORBITS_AT_ONCE)
