"""Derivatives of a whole stability map: in every cell, by the implicit function theorem."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from ..._parameters import list_parameters
from ...excitations import Harmonic
from ...models import Isolator
from ..map import Lane, MapMethod, StabilityMap
from ..orbit import Sine, find_periodic_orbit, modulus, multipliers, trajectory
from ._parameter_values import DRIVE, differentiate, drive_values, with_values
from ._smoothness import has_continuous_slopes

_CHUNK = 8192
"""Cells differentiated at once: their first and second derivatives then stay in the cache."""

_SINGLE = 256
"""Cells at once of those that are differentiated as single orbits."""


def map_slopes(smap: StabilityMap, names: Sequence[str]) -> tuple[dict[str, Array], dict[str, Array]]:
    """Give the derivatives of a map, cell by cell.

    One integration carries the motion with its first and second derivatives; the orbit's own change follows
    from the closing condition, and with it that of the multipliers. Orbits that the map did not split, and
    those of laws whose slope jumps at a kink, are differentiated as single orbits, which takes longer.

    Args:
        smap: the map.
        names: parameters of the model, `drive.amplitude` or `drive.frequency`.

    Returns:
        Values and derivatives of `response`, `multipliers` and `spectral_radius`, parameter first.
    """
    shape, states = smap.spectral_radius.shape, smap.start.shape[-1]
    cells = smap.spectral_radius.size
    force = np.broadcast_to(np.asarray(smap.amplitudes)[:, None], shape).ravel()
    frequency = np.broadcast_to(np.asarray(smap.frequencies), shape).ravel()
    direction = np.asarray(smap.direction).reshape(cells, 2)
    sine, cosine = (jnp.asarray(force * part) for part in direction.T)
    lanes = Lane(
        tuple(smap.start.reshape(cells, states).T),
        Sine(sine, cosine, jnp.asarray(frequency)),
        tuple(smap.phases.reshape(cells, -1).T),
        smap.response.ravel(),
    )
    found = np.isfinite(np.asarray(smap.spectral_radius).ravel())
    together = found & np.asarray(smap.split).ravel() & has_continuous_slopes(smap.model)
    count = len(names)
    slopes = {
        "response": np.full((count, cells), np.nan),
        "multipliers": np.full((count, cells, states), np.nan + 0j),
        "spectral_radius": np.full((count, cells), np.nan),
    }
    steps = jnp.asarray(smap.integrator.steps_a_period(smap.model))
    method = MapMethod(smap.integrator, smap.symmetric, smap.sides, steps)
    own = tuple(names)
    for block in _blocks(together, _CHUNK):
        some = jax.tree_util.tree_map(lambda values, block=block: values[block], lanes)
        _store(slopes, block, _cells(smap.model, method, own, some))
    y0 = np.asarray(smap.y0).reshape(cells, states) if (found & ~together).any() else np.zeros((0, states))
    for block in _blocks(found & ~together, _SINGLE):
        single = (jnp.asarray(force[block]), jnp.asarray(frequency[block]), jnp.asarray(y0[block]))
        _store(slopes, block, _single_orbits(smap.model, smap.symmetric, own, *single))
    values = {
        "response": smap.response,
        "multipliers": smap.multipliers,
        "spectral_radius": smap.spectral_radius,
    }
    return values, {
        name: jnp.asarray(slope.reshape(count, *shape, *slope.shape[2:])) for name, slope in slopes.items()
    }


def _blocks(chosen: Bool[np.ndarray, " cell"], size: int) -> list[np.ndarray]:
    """Share the chosen cells out in blocks of one length, the last one filled up with its last cell."""
    places = np.flatnonzero(chosen)
    size = min(size, max(1 << max(places.size - 1, 0).bit_length(), 1))
    return [
        np.pad(places[begin : begin + size], (0, max(0, begin + size - places.size)), mode="edge")
        for begin in range(0, places.size, size)
    ]


def _store(slopes: dict[str, np.ndarray], block: np.ndarray, given: dict[str, Array]) -> None:
    for name, values in given.items():
        slopes[name][:, block] = np.moveaxis(np.asarray(values), 1, 0)


@eqx.filter_jit
def _cells(model: Isolator, method: MapMethod, names: tuple[str, ...], lanes: Lane) -> dict[str, Array]:
    """Differentiate orbits that were found; parameter second."""
    entries = {entry.name: entry.value for entry in list_parameters(model)}
    turns = 0.5 if method.half else 1.0

    def one(lane: Lane) -> dict[str, Array]:
        drive = lane.drive
        push = jnp.hypot(drive.sine, jnp.asarray(drive.cosine))
        own = dict(zip(DRIVE, (push, drive.frequency), strict=True))
        at = jnp.stack([jnp.asarray((entries | own)[name], dtype=float) for name in names])
        begin = jnp.stack(lane.state)

        def there(numbers: Array) -> tuple[Isolator, Sine]:
            amplitude, frequency = drive_values(names, numbers, (push, drive.frequency))
            share = amplitude / push
            turned = Sine(drive.sine * share, drive.cosine * share, frequency)
            return with_values(model, names, numbers), turned

        def after(state: Array, numbers: Array) -> tuple[Array, Array]:
            moved_model, moved_drive = there(numbers)
            end = method.moved(moved_model, lane._replace(state=tuple(state), drive=moved_drive))
            return jnp.stack(end), jnp.stack(end)

        def slope(state: Array, numbers: Array) -> tuple[tuple[Array, Array], Array]:
            matrix, end = jax.jacfwd(after, has_aux=True)(state, numbers)
            return (matrix, end), matrix

        (bends, ends), matrix = jax.jacfwd(slope, argnums=(0, 1), has_aux=True)(begin, at)
        change = jnp.linalg.solve(jnp.eye(begin.size) - matrix, ends[1])
        total = bends[1] + jnp.einsum("ijk,kp->ijp", bends[0], change)

        def roots(matrix: Array) -> tuple[Array, Array]:
            values = multipliers(matrix)
            values = values * values if method.half else values
            return values, modulus(values[0])

        def along(direction: Array) -> tuple[Array, Array]:
            return jax.jvp(roots, (matrix,), (direction,))[1]

        root_slopes, radius_slopes = jax.vmap(along, in_axes=2)(total)

        def half_range(state: Array, numbers: Array) -> Array:
            moved_model, moved_drive = there(numbers)
            path = trajectory(moved_model, method.integrator, moved_drive, tuple(state), turns=turns)[0]
            return 0.5 * (jnp.max(path) - jnp.min(path))

        if method.half:
            # It starts at its largest displacement, where moving in time changes nothing to first order.
            response = change[0]
        else:
            response = jax.vmap(
                lambda state, number: jax.jvp(half_range, (begin, at), (state, number))[1], in_axes=(1, 0)
            )(change, jnp.eye(at.size))
        return {"response": response, "multipliers": root_slopes, "spectral_radius": radius_slopes}

    return jax.vmap(one)(lanes)


@eqx.filter_jit
def _single_orbits(
    model: Isolator, half: bool, names: tuple[str, ...], force: Array, frequency: Array, y0: Array
) -> dict[str, Array]:
    """Differentiate orbits one by one with their kinks; parameter second."""
    entries = {entry.name: entry.value for entry in list_parameters(model)}

    def one(f0: Array, f: Array, start: Array) -> dict[str, Array]:
        own = dict(zip(DRIVE, (f0, f), strict=True))
        at = jnp.stack([jnp.asarray((entries | own)[name], dtype=float) for name in names])

        def quantities(numbers: Array) -> dict[str, Array]:
            drive = Harmonic(*drive_values(names, numbers, (f0, f)))
            orbit = find_periodic_orbit(with_values(model, names, numbers), drive, start=start)
            return {
                "response": orbit.amplitude,
                "multipliers": orbit.floquet.multipliers,
                "spectral_radius": orbit.floquet.spectral_radius,
            }

        return differentiate(quantities, at)[1]

    return jax.vmap(one)(force, frequency, y0)
