"""The surface of periodic orbits over displacement and frequency, where it has one sheet.

Over force and frequency the orbits fold: one force belongs to several of them. Over displacement and
frequency each point belongs to one force. So the orbits are found there, on a coarse grid, and read off for
any force.
"""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.interpolate import make_interp_spline
from scipy.ndimage import distance_transform_edt

from ..._types import Lanes
from ...models import Integrator, Isolator
from ..orbit import (
    Crossings,
    Sine,
    find_crossings,
    imposed_balance,
    period_map,
    response_amplitudes,
    rest_displacement,
    trajectory,
)
from ._shared_kinks import shared_kinks

_NODE_STEPS = 6
"""Steps of Newton's method on the coarse grid."""

_GRID_NODES = (96, 33)
"""Displacement amplitudes and frequencies of the coarse grid."""

_FINE = 1024
"""Displacement amplitudes between which roots are sought."""

_NODE_CROSSINGS = 16
"""Kinks an orbit to make room for."""

_NODE_CLOSED_TO = 1e-6
"""What a node's orbit may leave open, over its size; where it leaves more, the one-harmonic start is kept."""

_SPLINE = 5
"""Degree of the splines between the nodes."""


class MapWindow(NamedTuple):
    """What a map is asked for.

    Attributes:
        amplitudes: drive amplitudes, ascending [N, or m/s^2 for base excitation].
        frequencies: ascending [Hz].
        reach: largest displacement sought, over the largest that grows from rest without a jump.
    """

    amplitudes: Float[np.ndarray, " amplitude"]
    frequencies: Float[np.ndarray, " frequency"]
    reach: float


class Surface(NamedTuple):
    """Orbits over displacement amplitude and frequency; each orbit starts at its largest displacement.

    Attributes:
        rest: displacement at rest [m].
        amplitudes: a, largest displacement over rest [m], equidistant in the logarithm.
        frequencies: [Hz].
        stiffness: drive in phase (sine) and in quadrature (cosine) over a [N/m].
        internal: internal states at the largest displacement, over a.
        response: half the peak-to-peak displacement over a.
        phases: phase at which each orbit passes each kink [rad], of the kinks that most pass in this order.
        sides: signs of the kinks between these.
        shared: whether the orbits of an interval of displacements pass the kinks in this order.
    """

    rest: float
    amplitudes: Float[np.ndarray, " displacement"]
    frequencies: Float[np.ndarray, " frequency"]
    stiffness: Float[np.ndarray, "2 frequency displacement"]
    internal: Float[np.ndarray, "internal frequency displacement"]
    response: Float[np.ndarray, "frequency displacement"]
    phases: Float[np.ndarray, "crossing frequency displacement"]
    sides: Float[np.ndarray, "piece kink"]
    shared: Bool[np.ndarray, "frequency interval"]

    @property
    def tables(self) -> Float[np.ndarray, "table frequency displacement"]:
        """All that is read off for a candidate: stiffness, internal states, response, phases."""
        return np.concatenate([self.stiffness, self.internal, self.response[None], self.phases])

    @property
    def force(self) -> Float[np.ndarray, "frequency displacement"]:
        """Drive amplitude that holds each orbit [N, or m/s^2 for base excitation]."""
        return self.amplitudes * np.hypot(self.stiffness[0], self.stiffness[1])


@eqx.filter_jit
def _nodes(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: Float[Array, ""],
    amplitude: Float[Array, " node"],
    frequency: Float[Array, " node"],
) -> tuple[Array, Array, Array, Crossings]:
    turns = 0.5 if half else 1.0

    def node(a: Array, f: Array) -> tuple[Array, Array, Array, Crossings]:
        guess, cycle = imposed_balance(model, a, f, rest)
        push = jnp.hypot(guess.sine, jnp.asarray(guess.cosine))
        internal = jnp.stack([values[0] for values in cycle]) if cycle else jnp.zeros(0)
        inner = jnp.where(internal == 0.0, a, jnp.abs(internal))
        omega = 2.0 * math.pi * f

        def unpack(unknown: Array) -> tuple[Sine, tuple[Lanes, ...]]:
            state = (rest + a, 0.0 * a, *(unknown[2:] * inner))
            return Sine(unknown[0] * push, unknown[1] * push, f), state

        def gap(unknown: Array) -> Array:
            drive, state = unpack(unknown)
            moved = period_map(model, integrator, drive, state, turns=turns)
            scale = (a, a * omega, *inner)
            return jnp.stack([(m - s) / c for m, s, c in zip(moved, state, scale, strict=True)])

        start = jnp.concatenate([jnp.stack([guess.sine, guess.cosine]) / push, internal / inner])

        def improve(_: Array | int, unknown: Array) -> Array:
            step = jnp.linalg.solve(jax.jacfwd(gap)(unknown), gap(unknown))
            # Far from the balance of one harmonic a full step may leave the basin.
            return unknown - step * jnp.minimum(1.0, 0.5 / jnp.max(jnp.abs(step)))

        found = jax.lax.fori_loop(0, _NODE_STEPS, improve, start)
        good = jnp.all(jnp.isfinite(found)) & (jnp.max(jnp.abs(gap(found))) < _NODE_CLOSED_TO)
        unknown = jnp.where(good, found, start)
        drive, state = unpack(unknown)
        path = trajectory(model, integrator, drive, state, turns=turns)
        low, high = jnp.min(path[0]), jnp.max(path[0])
        response = (jnp.maximum(high, -low) if half else 0.5 * (high - low)) / a
        stiffness = jnp.stack([drive.sine, jnp.asarray(drive.cosine)]) / a
        crossings = find_crossings(model, path, 2.0 * math.pi * turns, _NODE_CROSSINGS)
        return stiffness, unknown[2:] * inner / a, response, crossings

    return jax.vmap(node)(amplitude, frequency)


@eqx.filter_jit
def _forces(model: Isolator, frequencies: Array, amplitudes: Array) -> tuple[Array, Array]:
    rest = rest_displacement(model)
    return rest, response_amplitudes(model, frequencies, amplitudes, rest)


def _displacements(model: Isolator, window: MapWindow) -> tuple[float, float, float]:
    """Give rest and the displacement amplitudes, least and largest, that the forces of a window can hold."""
    least, most, frequencies = (
        float(window.amplitudes.min()),
        float(window.amplitudes.max()),
        window.frequencies,
    )
    band = jnp.asarray(np.linspace(frequencies[0], frequencies[-1], 24 if len(frequencies) > 1 else 1))
    tiny = 1e-9
    _, slope = _forces(model, band, jnp.array([tiny]))
    soft = float(jnp.min(slope)) / tiny
    grid = most / soft * np.logspace(-9.0, 4.0, 400)
    rest, needed = (np.asarray(value) for value in _forces(model, band, jnp.asarray(grid)))
    # Connected with rest: from small motion up to the first that needs more than the largest force.
    beyond = np.maximum.accumulate(needed >= most, axis=0)
    reached = np.where(beyond.any(axis=0), beyond.argmax(axis=0), len(grid) - 1)
    below = np.minimum.accumulate(needed < least, axis=0).sum(axis=0)
    low = grid[max(int(below.min()) - 1, 0)]
    return float(rest), 0.5 * low, window.reach * float(grid[int(reached.max())])


def find_surface(model: Isolator, integrator: Integrator, half: bool, window: MapWindow) -> Surface:
    """Find the orbits over displacement and frequency that a window of force and frequency can hold."""
    (rest, low, high), frequencies = _displacements(model, window), window.frequencies
    displacements, columns = _GRID_NODES
    single = len(frequencies) == 1
    band = (
        frequencies if len(frequencies) <= columns else _chebyshev(frequencies[0], frequencies[-1], columns)
    )
    coarse = np.geomspace(low, high, displacements)
    frequency, amplitude = np.meshgrid(band, coarse, indexing="ij")
    found = _nodes(
        model,
        integrator,
        half,
        jnp.asarray(rest),
        jnp.asarray(amplitude.ravel()),
        jnp.asarray(frequency.ravel()),
    )
    shape = (len(band), displacements)
    stiffness, internal, response = (np.asarray(table).reshape(*shape, -1) for table in found[:3])
    kinks = shared_kinks(found[3], shape, math.pi if half else 2.0 * math.pi)
    tables = _filled(np.concatenate([stiffness, internal, response, kinks.phases], axis=-1))
    if not single and len(frequencies) > columns:
        tables = np.tensordot(_spline_matrix(band, frequencies), tables, axes=(1, 0))
    fine = np.geomspace(low, high, _FINE)
    tables = np.moveaxis(tables, -1, 0) @ _spline_matrix(np.log(coarse), np.log(fine)).T
    last = 2 + model.internal_states
    rows = np.searchsorted(band, frequencies).clip(0, len(band) - 1)
    middles = np.sqrt(fine[:-1] * fine[1:])
    shared = kinks.shared[rows][:, np.searchsorted(coarse, middles).clip(0, displacements - 1)]
    phases = tables[last + 1 :]
    return Surface(
        rest, fine, frequencies, tables[:2], tables[2:last], tables[last], phases, kinks.sides, shared
    )


def _filled(tables: Float[np.ndarray, "frequency displacement table"]) -> np.ndarray:
    """Give the nearest node's values where the motion ran away: one such would spoil all splines."""
    lost = ~np.isfinite(tables).all(axis=-1)
    if not lost.any() or lost.all():
        return tables
    nearest = distance_transform_edt(lost, return_distances=False, return_indices=True)
    return tables[tuple(np.asarray(nearest))]


def _spline_matrix(
    nodes: Float[np.ndarray, " node"], places: Float[np.ndarray, " place"]
) -> Float[np.ndarray, "place node"]:
    """Give what turns values at nodes into a spline's values: one product instead of a spline a table."""
    return make_interp_spline(nodes, np.eye(nodes.size), k=_SPLINE)(places)


def _chebyshev(start: float, stop: float, count: int) -> Float[np.ndarray, " node"]:
    """Give nodes that are denser at the ends, where a spline has fewest neighbours."""
    return 0.5 * (start + stop) - 0.5 * (stop - start) * np.cos(np.pi * np.arange(count) / (count - 1))
