"""The surface of periodic orbits over displacement and frequency, where it has one sheet.

Over force and frequency the orbits fold: one force belongs to several of them. Over displacement and
frequency each point belongs to one force. So the orbits are found there, on a coarse grid, and read off for
any force, with the invariants of their period map, from which the multipliers follow.
"""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.ndimage import distance_transform_edt, maximum_filter

from ..._quick_jit import quick_jit
from ...models import Integrator, Isolator
from ..orbit import integrator_for, integrator_over, response_amplitudes, rest_displacement
from ._map_method import MapMethod
from ._nodes import closed_nodes, node_responses, node_starts
from ._shared_kinks import AROUND, SharedKinks, shared_kinks
from ._spline import spline_matrix, spline_pieces

_FIRST_NODES = (49, 17)
"""Displacement amplitudes and frequencies of the first grid; each further one halves the distances."""

REFINEMENTS = 2
"""Times at most that the distances of the nodes are halved."""

_FEW = 0.002
"""Share of the nodes whose orbits may be left to Newton's method."""

_LARGEST_RESPONSE = 2.0
"""Half the peak-to-peak displacement over the largest from rest, beyond which a motion did not close: it
starts at its largest displacement."""

_ROWS_BEYOND = 2
"""Nodes of the first grid beyond the largest displacement that is held."""

PARTS = 8
"""Parts of a spline's piece between whose ends roots are sought."""

_GAIN = 64.0
"""How many times smaller a spline of degree five makes its error with nodes half as far apart, where the
function is smooth; a sample of cells then says whether it is."""

LEAST_SLOPE = 0.1
"""Smallest slope of the characteristic polynomial that an error of a multiplier is divided by: where two
multipliers all but coincide they separate like the square root of any error, and their distance would say
more of the place than of the error."""


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

    Tables are the drive, sine and cosine; over the displacement amplitude the internal states; the phases at
    which each orbit passes the kinks that most pass in this order; half the trace and the determinant of the
    derivative of the period map, or of its half; half the peak-to-peak displacement over the amplitude. On
    each piece of displacements they are polynomials in its logarithm.

    Attributes:
        rest: displacement at rest [m].
        breaks: logarithm of displacement over rest [m] where one piece ends and the next begins.
        frequencies: [Hz].
        polynomials: of the tables; powers of the share of a piece that is passed.
        force: drive amplitude [N, or m/s^2 for base excitation] at the ends of equal parts of the pieces.
        sides: signs of the kinks between those that are passed.
        shared: whether the orbits of a part pass the kinks in this order.
        error: of multipliers read off, by the nodes that a coarser grid lacked; infinite where none can be.
    """

    rest: float
    breaks: Float[np.ndarray, " break"]
    frequencies: Float[np.ndarray, " frequency"]
    polynomials: Float[np.ndarray, "frequency piece table power"]
    force: Float[np.ndarray, "frequency end"]
    sides: Float[np.ndarray, "piece kink"]
    shared: Bool[np.ndarray, "frequency part"]
    error: Float[np.ndarray, "frequency part"]

    def at(self, column: int, places: Float[np.ndarray, " place"]) -> Float[np.ndarray, "table place"]:
        """Give the tables of one frequency.

        Args:
            column: of the frequencies.
            places: logarithms of displacement over rest, between the first and the last break.

        Returns:
            Their values.
        """
        piece = np.searchsorted(self.breaks, places, side="right").clip(1, len(self.breaks) - 1) - 1
        share = (places - self.breaks[piece]) / np.diff(self.breaks)[piece]
        own = self.polynomials[column, piece]
        return np.einsum("ptk,pk->tp", own, share[:, None] ** np.arange(own.shape[-1]))


class _Grid(NamedTuple):
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


@quick_jit
def _forces(model: Isolator, frequencies: Array, amplitudes: Array) -> tuple[Array, Array]:
    rest = rest_displacement(model)
    return rest, response_amplitudes(model, frequencies, amplitudes, rest)


def displacements(model: Isolator, window: MapWindow) -> tuple[float, float, float]:
    """Give rest and the displacement amplitudes that the forces of a window can hold.

    Args:
        model: the isolator.
        window: of the map.

    Returns:
        The displacement at rest, the least amplitude and the largest [m].
    """
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


def find_surface(
    model: Isolator, integrator: Integrator, half: bool, window: MapWindow, goal: float
) -> Surface:
    """Find the orbits over displacement and frequency that a window of force and frequency can hold.

    Each grid starts from the spline of the one before. Nodes are added until all but a few of the orbits that
    are asked for can be read off.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether to use the half-period map.
        window: of the map.
        goal: error down to which multipliers are to be read off.

    Returns:
        The surface.
    """
    rest, low, high = displacements(model, window)
    ends = math.log(low), math.log(high)
    start, kinks = _start_grid(model, integrator, half, rest, ends, window.frequencies)
    steps = jnp.asarray(integrator.steps_a_period(model))
    method = MapMethod(integrator, half, jnp.asarray(kinks.sides), steps)
    ends, grid = _ends_needed(start, window), start
    for level in range(1, 1 + REFINEMENTS):
        nodes = _axes(ends, window.frequencies, level)
        own = kinks.shared[np.ix_(_place(start.frequencies, nodes[1]), _place(start.logarithms, nodes[0]))]
        rows = 1 if nodes[1] is window.frequencies else 2
        grid = _closed_grid(model, method, rest, grid, nodes, rows, own)
        if not own.any() or not _needs_doubling(grid, window, goal):
            break
    pieces = spline_pieces(grid.logarithms)
    tables = _with_responses(model, integrator, half, rest, grid)
    tables[:2] *= np.exp(grid.logarithms)
    count, columns = tables.shape[0], len(window.frequencies)
    basis = (tables @ pieces.to_basis.T).transpose(1, 0, 2).reshape(len(grid.frequencies), -1)
    basis = spline_matrix(grid.frequencies, window.frequencies) @ basis
    polynomials = pieces.polynomials(basis.reshape(columns, count, -1))
    shares = (np.arange(PARTS)[:, None] / PARTS) ** np.arange(polynomials.shape[-1])
    drive = np.moveaxis(polynomials[:, :, :2], 2, 0) @ shares.T
    last = polynomials[:, -1, :2].sum(axis=-1)
    square = np.concatenate(
        [(drive**2).sum(axis=0).reshape(columns, -1), (last**2).sum(axis=1)[:, None]], axis=1
    )
    force = np.sqrt(square)
    parts = np.linspace(pieces.breaks[:-1], pieces.breaks[1:], 2 * PARTS + 1, axis=1)[:, 1::2].ravel()
    shared = kinks.shared[
        np.ix_(_place(start.frequencies, window.frequencies), _place(start.logarithms, parts))
    ]
    around = maximum_filter(grid.error, [2 * reach + 1 for reach in AROUND])
    error = around[np.ix_(_place(grid.frequencies, window.frequencies), _place(grid.logarithms, parts))]
    error = np.where(shared, error, np.inf)
    return Surface(rest, pieces.breaks, window.frequencies, polynomials, force, kinks.sides, shared, error)


def _start_grid(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: float,
    ends: tuple[float, float],
    frequencies: Float[np.ndarray, " frequency"],
) -> tuple[_Grid, SharedKinks]:
    """Find orbits that are not split, without their invariants, and the kinks that most of them pass."""
    logarithms, band = _axes(ends, frequencies, 0)
    usual = integrator_over(model, integrator_for(model, None), np.exp(ends), frequencies)
    frequency, amplitude = (axis.ravel() for axis in np.meshgrid(band, np.exp(logarithms), indexing="ij"))
    # Starts need no more steps where the map takes more, and what is compiled for one grid serves the next.
    steps = min(integrator.steps_per_period, usual.steps_per_period)
    coarse = integrator.with_steps(2 * (steps // 4 + 2))
    starts = node_starts(model, coarse, half, rest, amplitude, frequency)
    shape = len(band), len(logarithms)
    kinks = shared_kinks(starts.crossings, shape, math.pi if half else 2.0 * math.pi)
    if model.slides:
        # At its largest displacement such a motion jumps from law to law: nodes there cannot be closed.
        kinks = kinks._replace(shared=np.zeros(shape, bool))
    unknown = _filled(starts.unknown.T.reshape(-1, *shape)), np.moveaxis(kinks.phases, -1, 0)
    tables = np.concatenate([*unknown, np.zeros((2, *shape)), np.ones((1, *shape))])
    return _Grid(logarithms, band, tables, np.full(shape, np.inf)), kinks


def _axes(ends: tuple[float, float], frequencies: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Give logarithms of displacement amplitudes and frequencies of a grid."""
    displacements, columns = (((count - 1) << level) + 1 for count in _FIRST_NODES)
    if len(frequencies) <= columns:
        return np.linspace(*ends, displacements), frequencies
    # Denser at the ends, where a spline has fewest neighbours.
    middle, reach = 0.5 * (frequencies[0] + frequencies[-1]), 0.5 * (frequencies[-1] - frequencies[0])
    return np.linspace(*ends, displacements), middle - reach * np.cos(
        np.pi * np.arange(columns) / (columns - 1)
    )


def _ends_needed(grid: _Grid, window: MapWindow) -> tuple[float, float]:
    """Give the least and largest logarithm of the displacements that the forces hold, with some room."""
    force = np.exp(grid.logarithms) * np.hypot(grid.tables[0], grid.tables[1])
    held = np.flatnonzero((force <= window.amplitudes[-1]).any(axis=0))
    last = min(int(held.max(initial=0)) + _ROWS_BEYOND, len(grid.logarithms) - 1)
    return float(grid.logarithms[0]), float(grid.logarithms[last])


def _place(nodes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Give the node at or behind each place."""
    return np.searchsorted(nodes, places).clip(0, len(nodes) - 1)


def _closed_grid(
    model: Isolator,
    method: MapMethod,
    rest: float,
    coarse: _Grid,
    nodes: tuple[np.ndarray, np.ndarray],
    every: int,
    shared: Bool[np.ndarray, "frequency node"],
) -> _Grid:
    """Close the orbits at other nodes that share the order of kinks; the others stay as the grid has them.

    The error is that of a spline through every second displacement, and every so many frequencies.
    """
    tables, error = coarse.at(*nodes), np.full(shared.shape, np.inf)
    if not shared.any():
        return _Grid(*nodes, tables, error)
    frequency, amplitude = np.meshgrid(nodes[1], np.exp(nodes[0]), indexing="ij")
    found = closed_nodes(model, method, rest, amplitude[shared], frequency[shared], tables[:-3, shared].T)
    closed = shared.copy()
    closed[shared] = found.closed
    tables[:-1, closed] = np.concatenate([found.unknown, found.invariants], axis=1)[found.closed].T
    tables[-3:-1] = _filled(np.where(closed, tables[-3:-1], np.nan))
    # At the frequencies of the map itself no spline is needed over them.
    fewer = _Grid(nodes[0][::2], nodes[1][::every], tables[:, ::every, ::2], error)
    error[closed] = _reading_error(fewer.at(*nodes), tables, nodes[0], method.half)[closed] / _GAIN
    return _Grid(*nodes, tables, error)


def _with_responses(
    model: Isolator, integrator: Integrator, half: bool, rest: float, grid: _Grid
) -> Float[np.ndarray, "table frequency displacement"]:
    """Give the tables of a grid with half the peak-to-peak displacements; without, of what slides."""
    if model.slides:
        return grid.tables
    frequency, amplitude = np.meshgrid(grid.frequencies, np.exp(grid.logarithms), indexing="ij")
    unknown = grid.tables[: 2 + model.internal_states].reshape(-1, amplitude.size).T
    sizes = node_responses(model, integrator, half, rest, amplitude.ravel(), frequency.ravel(), unknown)
    sizes = sizes.reshape(1, *amplitude.shape)
    # Of a motion that ran away there is none.
    sizes = _filled(np.where(sizes < _LARGEST_RESPONSE, sizes, np.nan))
    return np.concatenate([grid.tables[:-1], sizes])


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


def _needs_doubling(grid: _Grid, window: MapWindow, goal: float) -> bool:
    """Say whether more of the orbits that are asked for than a few cannot be read off."""
    force = np.exp(grid.logarithms) * np.hypot(grid.tables[0], grid.tables[1])
    asked = (force >= window.amplitudes[0]) & (force <= window.amplitudes[-1])
    return bool(asked.any() and np.mean(grid.error[asked] > goal) > _FEW)


def _filled(tables: Float[np.ndarray, "table frequency displacement"]) -> np.ndarray:
    """Give the nearest node's values where there are none: one such would spoil all splines."""
    lost = ~np.isfinite(tables).all(axis=0)
    if not lost.any() or lost.all():
        return tables
    nearest = distance_transform_edt(lost, return_distances=False, return_indices=True)
    return tables[:, *np.asarray(nearest)]
