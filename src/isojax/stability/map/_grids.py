"""Grids of orbits over displacement and frequency: a first one from the balance of one harmonic, then closer
ones, each from the splines of the one before.
"""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import distance_transform_edt

from ...models import Integrator, Isolator
from ..orbit import integrator_for, integrator_over
from ._map_method import MapMethod
from ._nodes import closed_nodes, node_starts
from ._shared_kinks import SharedKinks, shared_kinks
from ._spline import spline_matrix

_FIRST_NODES = (49, 17)
"""Displacement amplitudes and frequencies of the first grid; each further one halves the distances."""

REFINEMENTS = 2
"""Times at most that the distances of the nodes are halved."""

GAIN = 64.0
"""How many times smaller a spline of degree five makes its error with nodes half as far apart, where the
function is smooth; a sample of cells then says whether it is."""

_KINK_GAIN = 4.0
"""The same next to a kink, which the surface has where friction begins to hold the mass."""

LEAST_SLOPE = 0.1
"""Smallest slope of the characteristic polynomial that an error of a multiplier is divided by: where two
multipliers all but coincide they separate like the square root of any error, and their distance would say
more of the place than of the error."""


class Grid(NamedTuple):
    """Orbits at the nodes of a grid.

    Attributes:
        logarithms: of the displacement amplitudes [m].
        frequencies: [Hz].
        tables: those of the surface, but the drive over the displacement amplitude.
        error: of multipliers read off, by the nodes that the grid before lacked; infinite at open orbits.
    """

    logarithms: Float[np.ndarray, " displacement"]
    frequencies: Float[np.ndarray, " frequency"]
    tables: Float[np.ndarray, "table frequency displacement"]
    error: Float[np.ndarray, "frequency displacement"]

    def at(
        self, logarithms: np.ndarray, frequencies: np.ndarray
    ) -> Float[np.ndarray, "table frequency node"]:
        """Give the tables elsewhere."""
        rows, columns = (
            spline_matrix(self.frequencies, frequencies),
            spline_matrix(self.logarithms, logarithms),
        )
        return rows @ (self.tables @ columns.T)

    def from_fewer(self, band: Float[np.ndarray, " frequency"]) -> Float[np.ndarray, "table row node"]:
        """Give the tables as read from every second node, whose distance from them tells the error.

        At the frequencies of the map itself no spline is needed over them.

        Args:
            band: frequencies of the map [Hz].
        """
        every = 1 if self.frequencies is band else 2
        axes = self.logarithms[::2], self.frequencies[::every]
        fewer = Grid(*axes, self.tables[:, ::every, ::2], self.error)
        return fewer.at(self.logarithms, self.frequencies)


class FirstGrid(NamedTuple):
    """Orbits that are not split, from which those at closer nodes start.

    Attributes:
        rest: displacement at rest [m].
        frequencies: of the map [Hz].
        ends: least and largest logarithm of a displacement that is held, with some room.
        method: how closer nodes are integrated over.
        kinks: those that most orbits share.
        grid: the orbits.
    """

    rest: float
    frequencies: Float[np.ndarray, " frequency"]
    ends: tuple[float, float]
    method: MapMethod
    kinks: SharedKinks
    grid: Grid

    def finer(self, model: Isolator, coarse: Grid, level: int) -> Grid:
        """Give a grid whose distances are halved so many times.

        Args:
            model: the isolator.
            coarse: the grid before.
            level: times.

        Returns:
            The grid; what does not share the order of kinks is not closed.
        """
        nodes = axes_of(self.ends, self.frequencies, level)
        own = self.kinks.shared[
            np.ix_(node_at(self.grid.frequencies, nodes[1]), node_at(self.grid.logarithms, nodes[0]))
        ]
        return _closed_grid(model, self.method, self.rest, coarse, nodes, self.frequencies, own)


def first_grid(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: float,
    ends: tuple[float, float],
    frequencies: Float[np.ndarray, " frequency"],
    most: int,
) -> FirstGrid:
    """Find orbits that are not split, without their invariants, and the kinks that most of them pass.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether to use the half-period map.
        rest: displacement at rest [m].
        ends: least and largest logarithm of the displacement amplitudes [m].
        frequencies: of the map [Hz].
        most: steps a period of the starts, of which half are taken: those of the first grid that is made, so
            that what is compiled for it serves the next.

    Returns:
        The orbits.
    """
    logarithms, band = axes_of(ends, frequencies, 0)
    usual = integrator_over(model, integrator_for(model, None), np.exp(ends), frequencies)
    frequency, amplitude = (axis.ravel() for axis in np.meshgrid(band, np.exp(logarithms), indexing="ij"))
    coarse = integrator.with_steps(2 * (min(most, usual.steps_per_period) // 4 + 2))
    starts = node_starts(model, coarse, half, rest, amplitude, frequency)
    shape = len(band), len(logarithms)
    if model.slides:
        # Each orbit is split at events of its own.
        still = tuple(jnp.zeros(()) for _ in range(2 + model.internal_states))
        sides = np.ones((1, len(model.switches(still))))
        kinks = SharedKinks(np.zeros((*shape, 0)), sides, np.ones(shape, bool))
    else:
        kinks = shared_kinks(starts.crossings, shape, math.pi if half else 2.0 * math.pi)
    unknown = filled(starts.unknown.T.reshape(-1, *shape)), np.moveaxis(kinks.phases, -1, 0)
    tables = np.concatenate([*unknown, np.zeros((2, *shape)), np.ones((1, *shape))])
    method = MapMethod(
        integrator,
        half,
        None if model.slides else jnp.asarray(kinks.sides),
        jnp.asarray(integrator.steps_a_period(model)),
    )
    grid = Grid(logarithms, band, tables, np.full(shape, np.inf))
    return FirstGrid(rest, frequencies, ends, method, kinks, grid)


def axes_of(
    ends: tuple[float, float], frequencies: Float[np.ndarray, " frequency"], level: int
) -> tuple[Float[np.ndarray, " displacement"], Float[np.ndarray, " row"]]:
    """Give logarithms of displacement amplitudes and frequencies of a grid.

    Args:
        ends: least and largest logarithm.
        frequencies: of the map [Hz].
        level: how many times the distances of the first grid are halved.

    Returns:
        The logarithms; the frequencies, or those of the map where these are few.
    """
    displacements, columns = (((count - 1) << level) + 1 for count in _FIRST_NODES)
    if len(frequencies) <= columns:
        return np.linspace(*ends, displacements), frequencies
    # Denser at the ends, where a spline has fewest neighbours.
    middle, reach = 0.5 * (frequencies[0] + frequencies[-1]), 0.5 * (frequencies[-1] - frequencies[0])
    return np.linspace(*ends, displacements), middle - reach * np.cos(
        np.pi * np.arange(columns) / (columns - 1)
    )


def node_at(
    nodes: Float[np.ndarray, " node"], places: Float[np.ndarray, " place"]
) -> Int[np.ndarray, " place"]:
    """Give the node at or behind each place.

    Args:
        nodes: ascending.
        places: among them.

    Returns:
        Indices of nodes.
    """
    return np.searchsorted(nodes, places).clip(0, len(nodes) - 1)


def _closed_grid(
    model: Isolator,
    method: MapMethod,
    rest: float,
    coarse: Grid,
    nodes: tuple[np.ndarray, np.ndarray],
    band: Float[np.ndarray, " frequency"],
    shared: Bool[np.ndarray, "row node"],
) -> Grid:
    """Close the orbits at other nodes that share the order of kinks; the others stay as the grid has them.

    The error is that of a spline through every second node.
    """
    tables, error = coarse.at(*nodes), np.full(shared.shape, np.inf)
    if not shared.any():
        return Grid(*nodes, tables, error)
    frequency, amplitude = np.meshgrid(nodes[1], np.exp(nodes[0]), indexing="ij")
    found = closed_nodes(model, method, rest, amplitude[shared], frequency[shared], tables[:-3, shared].T)
    closed = shared.copy()
    closed[shared] = found.closed
    tables[:-1, closed] = np.concatenate([found.unknown, found.invariants], axis=1)[found.closed].T
    tables[-3:-1] = filled(np.where(closed, tables[-3:-1], np.nan))
    fewer = Grid(*nodes, tables, error).from_fewer(band)
    gain = _KINK_GAIN if model.slides else GAIN
    error[closed] = _reading_error(fewer, tables, nodes[0], method.half)[closed] / gain
    return Grid(*nodes, tables, error)


def _reading_error(
    read: np.ndarray, tables: np.ndarray, logarithms: np.ndarray, half: bool
) -> Float[np.ndarray, "frequency displacement"]:
    """Give the error of multipliers that are read off tables at the same force, to first order."""
    force, read_force = (np.log(np.hypot(own[0], own[1])) + logarithms for own in (tables, read))
    half_trace, determinant = tables[-3:-1]
    slopes = [np.gradient(values, logarithms, axis=1) for values in (force, half_trace, determinant)]
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = (read_force - force) / slopes[0]
        trace_error = read[-3] - half_trace - slopes[1] * moved
        determinant_error = read[-2] - determinant - slopes[2] * moved
        spread = np.sqrt((half_trace**2 - determinant).astype(complex))
        worst = np.zeros(force.shape)
        for sign in (1.0, -1.0):
            root = half_trace + sign * spread
            error = np.abs(determinant_error - 2.0 * root * trace_error) / np.maximum(
                2.0 * np.abs(spread), LEAST_SLOPE
            )
            worst = np.maximum(worst, error * (2.0 * np.abs(root) if half else 1.0))
    return np.where(np.isfinite(worst), worst, np.inf)


def filled(tables: Float[np.ndarray, "table frequency displacement"]) -> np.ndarray:
    """Give the nearest node's values where there are none: one such would spoil all splines.

    Args:
        tables: over the nodes.

    Returns:
        The tables.
    """
    lost = ~np.isfinite(tables).all(axis=0)
    if not lost.any() or lost.all():
        return tables
    nearest = distance_transform_edt(lost, return_distances=False, return_indices=True)
    return tables[:, *np.asarray(nearest)]
