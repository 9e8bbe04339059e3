"""Cells of a map found as single orbits: where nothing can be read off, and where Newton failed."""

from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import NamedSharding
from jaxtyping import Array, Float

from ..._cores import usable_cores
from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._small_systems import newton
from ...excitations import Harmonic
from ...models import Integrator, Isolator
from ..orbit import (
    Accuracy,
    ShootingMethod,
    closing,
    event_places,
    half_range,
    modulus,
    multipliers,
    recorded_sine,
    response_start,
    shoot,
    trajectory,
)
from ._batched_newton import (
    FOUND,
    NOT_ACCURATE,
    NOT_CONVERGED,
    NOT_FINITE,
    Found,
    padded,
    surface_lanes,
)
from ._map_method import Lane, MapMethod
from ._starts import Candidates, PlacedSurface, joined
from ._states_at_zero import states_at_zero

_ORBITS_TOGETHER = 128
"""Orbits found at once."""


class SingleOrbits(eqx.Module):
    """What finds the orbits of any list of candidates one by one, as `find_periodic_orbit` does.

    Attributes:
        model: the isolator.
        method: how to integrate starts.
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
        """Find orbits from others near them.

        Args:
            lanes: the orbits.
            count: how many.

        Returns:
            The same, with steps enough for each.
        """
        starts = np.stack(states_at_zero(self.model, self.method, lanes), axis=-1)
        sine, cosine, rate = (np.asarray(values) for values in lanes.drive)
        push = np.hypot(sine, cosine)
        return single_orbits(self.model, self.method.integrator, self.method.half, push, rate, starts)

    def __call__(self, candidates: Candidates, size: int) -> Found:
        """Find the orbits of candidates.

        Args:
            candidates: at most `size` of them.
            size: lanes of the compiled starts.

        Returns:
            Their orbits.
        """
        where = [jnp.asarray(padded(values, size)) for values in candidates[:3]]
        lanes = surface_lanes(self.model, self.surface, where)
        starts = np.stack(states_at_zero(self.model, self.method, lanes), axis=-1)[: candidates.force.size]
        push = np.asarray(self.surface.amplitudes)[candidates.force]
        rate = np.asarray(self.surface.frequencies)[candidates.frequency]
        found = single_orbits(self.model, self.method.integrator, self.method.half, push, rate, starts)
        kinks = self.surface.polynomials.shape[2] - self.states - 3
        return found._replace(phases=np.full((push.size, kinks), np.nan))


def single_orbits(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    amplitude: Float[np.ndarray, " orbit"],
    frequency: Float[np.ndarray, " orbit"],
    starts: Float[np.ndarray, "orbit state"] | None,
) -> Found:
    """Find orbits from starts.

    Args:
        model: the isolator.
        integrator: steps and tolerances.
        half: whether symmetric orbits are closed over half a period.
        amplitude: of the drive of each [N, or m/s^2 for base excitation].
        frequency: of the drive of each [Hz].
        starts: states at t = 0; those of the one-harmonic balance if omitted.

    Returns:
        The orbits, each from t = 0 of its recorded drive, without phases of kinks.
    """
    method = ShootingMethod(integrator, 1, half)

    def block(begin: int) -> Found:
        own = slice(begin, begin + _ORBITS_TOGETHER)
        push, rate = (jnp.asarray(padded(values[own], _ORBITS_TOGETHER)) for values in (amplitude, frequency))
        # Apart from the search, which is compiled once for starts of either kind.
        begins = _balanced(model, push, rate) if starts is None else padded(starts[own], _ORBITS_TOGETHER)
        found = _shoot(model, method, push, rate, jnp.asarray(begins))
        return Found(*(np.asarray(value)[: amplitude[own].size] for value in found))

    first, *others = range(0, amplitude.size, _ORBITS_TOGETHER)
    # The first compiles; then each core runs its own.
    orbits = [block(first)]
    with ThreadPoolExecutor(usable_cores()) as pool:
        orbits += pool.map(block, others)
    return joined(orbits)


@quick_jit
def _balanced(model: Isolator, amplitude: Array, frequency: Array) -> Array:
    return jax.vmap(lambda push, rate: response_start(model, push, rate))(amplitude, frequency)


@quick_jit
def _shoot(
    model: Isolator, method: ShootingMethod, amplitude: Array, frequency: Array, starts: Array
) -> tuple[Array, ...]:
    return jax.vmap(lambda *lane: single_orbit(model, method, *lane))(amplitude, frequency, starts)


def single_orbit(
    model: Isolator,
    method: ShootingMethod,
    amplitude: Float[Array, ""],
    frequency: Float[Array, ""],
    start: Float[Array, " state"],
) -> tuple[Array, ...]:
    """Find one orbit with the accuracy of maps, differentiable by the model and the drive.

    Args:
        model: the isolator; traced or not.
        method: steps, and how the orbit is closed.
        amplitude: of the drive [N, or m/s^2 for base excitation].
        frequency: of the drive [Hz].
        start: state at t = 0.

    Returns:
        The fields of `Found`, from t = 0 of the recorded drive, without phases of kinks.
    """
    goal = method.integrator.orbit_tolerance
    accuracy = Accuracy(method.integrator.map_orbit_tolerance, method.integrator.map_orbit_error)
    solver, places = newton(goal), event_places(model, method.turns)
    live = model, Harmonic(amplitude, frequency)
    still, known = frozen(live)
    drive = recorded_sine(still, known.amplitude, known.frequency)
    solution = shoot(still, method, solver, drive, frozen(start), places, accuracy)
    state, matrix = with_derivatives(
        (solution.state, solution.matrix), closing, solution.root, live, (method, solution.split)
    )
    drive = recorded_sine(model, amplitude, frequency)
    path = trajectory(model, method.integrator, drive, tuple(state), turns=method.turns)
    finite = jnp.all(jnp.isfinite(path[0])) & jnp.all(jnp.isfinite(matrix))
    failed = jnp.where(finite, NOT_CONVERGED, NOT_FINITE)
    code = jnp.where(solution.accurate, FOUND, NOT_ACCURATE)
    code = jnp.where(finite & solution.found, code, failed)
    blank = jnp.where(code == FOUND, 1.0, jnp.nan)
    roots = multipliers(matrix)
    roots = (roots * roots if method.half else roots) * blank
    unit = recorded_sine(model, jnp.ones(()), frequency).fundamental
    direction = jnp.stack([unit.sine, jnp.asarray(unit.cosine, dtype=float)])
    size = half_range(model, drive, path, method.turns) * blank
    return state * blank, direction, jnp.zeros(0), roots, modulus(roots[0]), size, code.astype(jnp.int8)
