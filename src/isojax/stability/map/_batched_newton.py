"""Batched Newton: orbits and multipliers of many cells of a map at once."""

import functools
import itertools
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Complex, Float, Int

from ..._cores import usable_cores
from ..._quick_jit import quick_jit
from ..._small_systems import solve
from ..._types import Lanes
from ...models import Integrator, Isolator, State
from ..orbit import Sine, modulus, multipliers
from ._map_method import Lane, MapMethod, kinks_between
from ._sizes import motion_sizes
from ._starts import Candidates, PlacedSurface, joined, read_surface
from ._surface import Surface

_NEWTON_STEPS = 12
"""Steps of Newton's method after which a cell counts as failed."""

SAMPLED = 1024
"""Cells of which the integration error is found."""

CELLS_TOGETHER = 512
"""Orbits that share a compiled step: those of a sample, and those for which a first step was not enough."""

_FINER_STEPS = 3
"""Times the steps of a map with which its error is found."""

FULLY_CLOSED = 1e-9
"""Relative step after which an orbit is closed far better than it is integrated."""

_WIDE = {"xla_cpu_prefer_vector_width": 512}
"""A tenth faster where processors have such vectors; the compiler's own preference is half of it."""

WHOLE_STEPS = 4
"""Times the steps of orbits that are not split at kinks."""

FOUND, NOT_CONVERGED, NOT_FINITE, NOT_ACCURATE, STICKS, NO_FURTHER_ORBIT = range(6)
"""Codes of how the search in a cell ended."""


class Found(NamedTuple):
    """Orbits of a list of candidates, each from the phase at which its start is largest.

    Attributes:
        states: there.
        direction: drive over its amplitude, sine and cosine part, tau counted from there.
        phases: where the orbit passes kinks.
        multipliers: over one drive period.
        radius: largest modulus.
        response: half the peak-to-peak displacement [m].
        code: how the search ended.
    """

    states: Float[np.ndarray, "candidate state"]
    direction: Float[np.ndarray, "candidate 2"]
    phases: Float[np.ndarray, "candidate crossing"]
    multipliers: Complex[np.ndarray, "candidate multiplier"]
    radius: Float[np.ndarray, " candidate"]
    response: Float[np.ndarray, " candidate"]
    code: Int[np.ndarray, " candidate"]


def blanked(found: Found, places: Int[np.ndarray, " orbit"], code: int) -> Found:
    """Give orbits without some, whose numbers are NaN.

    Args:
        found: the orbits.
        places: of those that are left out.
        code: why.

    Returns:
        The orbits.
    """
    if not places.size:
        return found
    found = Found(*(np.array(values) for values in found))
    found.code[places] = code
    for values in (found.states, found.multipliers, found.radius, found.response):
        values[places] = np.nan
    return found


def newton_step(
    model: Isolator, method: MapMethod, lane: Lane
) -> tuple[State, State, Float[Array, "state state"]]:
    """Give the step of Newton's method on the period map of one orbit, and the derivative of that map.

    The instants at which the orbit passes kinks are unknowns beside its state.

    Args:
        model: the isolator.
        method: how to integrate.
        lane: the orbit.

    Returns:
        Change of the state that closes the orbit to first order; that of the phases of its kinks; derivative
        of the map at the state, the phases following along.
    """
    states, phases = len(lane.state), () if method.sides is None else lane.phases
    kinks = None if method.sides is None or not phases else kinks_between(method.sides)

    def moved(begin: State, phases: State) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        end, reached = method.moved_past(model, lane._replace(state=begin, phases=phases), kinks)
        out = (*end, *(reached[place] for place in range(len(phases))))
        return out, out

    slopes, out = jax.jacfwd(moved, argnums=(0, 1), has_aux=True)(lane.state, phases)
    gap = [b - a for a, b in zip(lane.state, out[:states], strict=True)]
    if not phases and states == 2:
        (a, b), (c, d) = (own[0] for own in slopes)
        determinant = (1.0 - a) * (1.0 - d) - b * c
        step = (
            ((1.0 - d) * gap[0] + b * gap[1]) / determinant,
            (c * gap[0] + (1.0 - a) * gap[1]) / determinant,
        )
        return step, (), jnp.stack([jnp.stack([a, b]), jnp.stack([c, d])])
    whole = jnp.stack([jnp.stack([*by_state, *by_phase]) for by_state, by_phase in slopes])
    matrix, bend = whole[:states, :states], whole[:states, states:]
    missed = jnp.stack(out[states:]) if phases else jnp.zeros(0)
    # The phases that meet the kinks, to first order: p = -lower^-1 (missed + follow z).
    lower = whole[states:, states:]
    follow = solve(lower, whole[states:, :states]) if phases else jnp.zeros((0, states))
    shift = solve(lower, missed) if phases else missed
    matrix = matrix - bend @ follow
    step = solve(jnp.eye(states) - matrix, jnp.stack(gap) - bend @ shift)
    return tuple(step), tuple(-shift - follow @ step), matrix


@functools.partial(quick_jit, options=_WIDE)
def _newton_steps(
    model: Isolator, method: MapMethod, lanes: Lane
) -> tuple[State, State, Lanes, Array, Lanes]:
    step, turn, matrix = jax.vmap(lambda lane: newton_step(model, method, lane))(lanes)
    state, response, omega = lanes.state, lanes.response, lanes.drive.angular_frequency
    scales = (response, response * omega, *(jnp.maximum(jnp.abs(s), 1e-3 * response) for s in state[2:]))
    sizes = [jnp.abs(d) / c for d, c in zip(step, scales, strict=True)] + [jnp.abs(d) for d in turn]
    size = jnp.max(jnp.stack(sizes), axis=0)
    # Far off, a full step may leave the basin of the orbit that the start is near to.
    damping = jnp.minimum(1.0, 0.3 / size)
    moved = tuple(s + damping * d for s, d in zip(state, step, strict=True))
    phases = tuple(p + damping * d for p, d in zip(lanes.phases, turn, strict=True)) if turn else lanes.phases
    roots = multipliers(matrix)
    roots = roots * roots if method.half else roots
    return moved, phases, size, roots, modulus(roots[..., 0])


@functools.partial(quick_jit, options=_WIDE)
def surface_lanes(model: Isolator, surface: PlacedSurface, where: Any) -> Lane:
    """Give starts as the surface has them.

    Args:
        model: the isolator.
        surface: orbits over displacement and frequency.
        where: places of force, frequency and part of each.

    Returns:
        The starts.
    """
    read = read_surface(surface, 2 + model.internal_states, *where)
    push, (sine, cosine) = surface.amplitudes[where[0]], read.direction
    drive = Sine(push * sine, push * cosine, surface.frequencies[where[1]])
    return Lane(read.states, drive, read.phases, read.response)


class CellSolver(eqx.Module):
    """What finds the orbits of any list of candidates.

    Attributes:
        model: the isolator.
        method: how to integrate.
        surface: the orbits over displacement and frequency, with the axes of the map.
        sharding: how a chunk is spread over devices.
    """

    model: Isolator
    method: MapMethod
    surface: PlacedSurface
    sharding: NamedSharding = eqx.field(static=True)

    @property
    def states(self) -> int:
        """Count of states of the model."""
        return 2 + self.model.internal_states

    def confirmed(self, lanes: Lane, count: int) -> Found:
        """Find orbits with steps several times finer.

        Args:
            lanes: the orbits.
            count: how many.

        Returns:
            The same, so far closed that only the error of the integration remains.
        """
        method = self.method.finer(_FINER_STEPS)

        def closed(block: slice) -> Found:
            some = jax.tree.map(lambda values: padded(np.asarray(values[block]), CELLS_TOGETHER), lanes)
            own = len(range(*block.indices(count)))
            return self.improve(method, jax.device_put(some, self.sharding), own, limit=FULLY_CLOSED)

        return self.in_blocks(closed, count)

    def with_steps(self, steps: int) -> "CellSolver":
        """Give the same with other steps a period.

        Args:
            steps: of orbits that are split.

        Returns:
            The solver.
        """
        taken = jnp.asarray(steps * (1 if self.method.sides is not None else WHOLE_STEPS))
        method = MapMethod(self.method.integrator, self.method.half, self.method.sides, taken)
        return CellSolver(self.model, method, self.surface, self.sharding)

    def __call__(self, candidates: Candidates, size: int, limit: float | None = None) -> Found:
        """Find the orbits of candidates.

        Args:
            candidates: at most `size` of them.
            size: lanes of the compiled step.
            limit: see `improve`.

        Returns:
            Their orbits.
        """
        where = jax.device_put([padded(values, size) for values in candidates[:3]], self.sharding)
        lanes = surface_lanes(self.model, self.surface, where)
        found = self.improve(self.method, lanes, candidates.force.size, limit)
        if self.method.sides is not None:
            return found
        # Where orbits share no order of kinks the surface is rough, and an orbit may lie far from its start.
        push = np.asarray(self.surface.amplitudes)[candidates.force, None] * found.direction
        frequency = np.asarray(self.surface.frequencies)[candidates.frequency]
        sizes = motion_sizes(self.model, self.method, found.states, push, frequency)
        return found._replace(response=sizes)

    def in_blocks(self, work: Callable[[slice], Found], count: int) -> Found:
        """Find orbits block by block, as many blocks at once as there are cores.

        Args:
            work: gives the orbits of a block of at most `CELLS_TOGETHER`.
            count: of all orbits.

        Returns:
            All.
        """
        blocks = [
            slice(begin, min(begin + CELLS_TOGETHER, count)) for begin in range(0, count, CELLS_TOGETHER)
        ]
        with ThreadPoolExecutor(1 if self.sharding.num_devices > 1 else usable_cores()) as pool:
            return joined(list(pool.map(work, blocks)))

    def improve(self, method: MapMethod, lanes: Lane, count: int, limit: float | None = None) -> Found:
        """Improve starts until each has converged or failed.

        Args:
            method: how to integrate.
            lanes: the starts.
            count: how many of the lanes matter.
            limit: largest relative step after which an orbit needs no other; that of maps if omitted.

        Returns:
            The orbits.
        """
        limit = method.integrator.map_tolerance if limit is None else limit
        compiled = method.for_any_steps()
        moved, phases, *rest = _newton_steps(self.model, compiled, lanes)
        lanes = lanes._replace(state=moved, phases=phases)
        lanes, step, roots, radius = jax.tree_util.tree_map(lambda it: np.asarray(it)[:count], (lanes, *rest))
        for _ in range(_NEWTON_STEPS - 1):
            late = np.flatnonzero(~(step <= limit) & np.isfinite(radius))
            if not late.size:
                break
            if not step.flags.writeable:
                lanes, step, roots, radius = jax.tree_util.tree_map(np.array, (lanes, step, roots, radius))
            for begin in range(0, late.size, CELLS_TOGETHER):
                block = late[begin : begin + CELLS_TOGETHER]
                some = jax.tree_util.tree_map(
                    lambda it, block=block: padded(it[block], CELLS_TOGETHER), lanes
                )
                again = _newton_steps(self.model, compiled, jax.device_put(some, self.sharding))
                targets = [*lanes.state, *lanes.phases, step, roots, radius]
                for target, value in zip(targets, [*again[0], *again[1], *again[2:]], strict=True):
                    target[block] = np.asarray(value)[: block.size]
        states = np.stack(lanes.state, axis=-1)
        finite = np.isfinite(radius) & np.all(np.isfinite(states), axis=-1)
        inside = _in_order(lanes.phases, math.pi if method.half else 2.0 * math.pi)
        closed = (step <= limit) & inside
        code = np.where(finite, np.where(closed, FOUND, NOT_CONVERGED), NOT_FINITE).astype(np.int8)
        push = np.hypot(lanes.drive.sine, lanes.drive.cosine)
        direction = np.stack([lanes.drive.sine / push, lanes.drive.cosine / push], axis=-1)
        phases = np.stack(lanes.phases, axis=-1) if lanes.phases else np.zeros((count, 0))
        numbers = (states, roots, radius, np.asarray(lanes.response))
        if (code != FOUND).any():
            numbers = tuple(np.array(values) for values in numbers)
            for values in numbers:
                values[code != FOUND] = np.nan
        states, roots, radius, response = numbers
        return Found(states, direction, phases, roots, radius, response, code)


def _in_order(phases: tuple[Any, ...], end: float) -> np.ndarray:
    """Say whether kinks are passed one after the other, before the end."""
    bounds = [0.0, *phases, end]
    later = [np.asarray(after) >= np.asarray(before) - 1e-9 for before, after in itertools.pairwise(bounds)]
    return np.asarray(np.logical_and.reduce(np.broadcast_arrays(*later)))


def lanes_of(total: int, chunk: int) -> int:
    """Give the lanes of a batch: no wider than need be, so that small maps compile and run a small one.

    Args:
        total: of all orbits.
        chunk: most orbits in a batch.
    """
    return min(chunk, max(1 << max(total - 1, 0).bit_length(), CELLS_TOGETHER))


def padded(values: np.ndarray, size: int) -> np.ndarray:
    """Fill up to a fixed length by repeating the last value, so that one compiled step serves."""
    return np.concatenate([values, np.repeat(values[-1:], size - values.shape[0], axis=0)])


def cell_solvers(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    surface: Surface,
    forces: Float[np.ndarray, " force"],
    devices: Any,
) -> tuple[CellSolver, CellSolver]:
    """Give the solvers of a map's cells.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether to use the half-period map.
        surface: orbits over displacement and frequency.
        forces: drive amplitudes of the map.
        devices: to spread chunks over; all local ones if None.

    Returns:
        That of the orbits which share the order of kinks, and that of the others, which are not split and
        take four times the steps instead.
    """
    mesh = Mesh(np.asarray(jax.local_devices() if devices is None else devices), ("cell",))
    everywhere = NamedSharding(mesh, PartitionSpec())
    tables = (surface.polynomials, surface.breaks, surface.rest, forces, surface.frequencies)
    placed = PlacedSurface(*(jax.device_put(np.asarray(table), everywhere) for table in tables))
    cells = NamedSharding(mesh, PartitionSpec("cell"))
    steps = jnp.asarray(integrator.steps_a_period(model))
    split = MapMethod(integrator, half, jnp.asarray(surface.sides), steps)
    whole = MapMethod(integrator, half, None, WHOLE_STEPS * steps)
    return CellSolver(model, split, placed, cells), CellSolver(model, whole, placed, cells)
