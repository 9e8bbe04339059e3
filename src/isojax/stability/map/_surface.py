"""The surface of periodic orbits over displacement and frequency, where it has one sheet.

Over force and frequency the orbits fold: one force belongs to several of them. Over displacement and
frequency each point belongs to one force. So the orbits are found there, on a coarse grid, and read off for
any force, with the invariants of their period map, from which the multipliers follow.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.ndimage import maximum_filter, minimum_filter

from ..._quick_jit import quick_jit
from ...models import Integrator, Isolator
from ..orbit import answer_scale, balanced_motion, rest_displacement
from ._forces import PARTS, Forces, forces_along
from ._grids import GAIN, REFINEMENTS, Grid, filled, first_grid, node_at
from ._nodes import node_responses
from ._shared_kinks import AROUND
from ._spline import spline_matrix, spline_pieces

_FEW = 0.002
"""Share of the nodes whose orbits may be left to Newton's method."""

_SIZED_TO = 1e-6
"""Error of half the peak-to-peak displacement, over the largest from rest, up to which it is read off."""

_LARGEST_RESPONSE = 2.0
"""Half the peak-to-peak displacement over the largest from rest, beyond which a motion did not close: it
starts at its largest displacement."""

_RESPONSE_STEPS = 256
"""Fewest steps a period of the motions whose size is read off: one compiled count serves most maps."""

_ROWS_BEYOND = 2
"""Nodes of the first grid beyond the largest displacement that is held."""

_BEYOND_BALANCE = 3.0
"""Largest displacement sought, over the largest that the drives hold by the balance of one harmonic."""

_FIRST_ERROR = 0.05
"""Share by which the drive may be off in the balance of one harmonic and on the first grid, at resonance."""

_TOLD_APART = 1e-3
"""Share by which the drive of a motion exceeds that of the smallest, below which no motion is told apart."""


class MapWindow(NamedTuple):
    """What a map is asked for.

    Attributes:
        amplitudes: drive amplitudes, ascending [N, or m/s^2 for base excitation].
        frequencies: ascending [Hz].
    """

    amplitudes: Float[np.ndarray, " amplitude"]
    frequencies: Float[np.ndarray, " frequency"]


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
        forces: drive amplitude along the displacements, over equal parts of the pieces.
        sides: signs of the kinks between those that are passed.
        shared: whether the orbits of a part pass the kinks in this order.
        error: of multipliers read off, by the nodes that a coarser grid lacked; infinite where none can be.
        sized: whether the peak-to-peak displacement can be read off: it bends where another of several
            maxima becomes the largest.
    """

    rest: float
    breaks: Float[np.ndarray, " break"]
    frequencies: Float[np.ndarray, " frequency"]
    polynomials: Float[np.ndarray, "frequency piece table power"]
    forces: Forces
    sides: Float[np.ndarray, "piece kink"]
    shared: Bool[np.ndarray, "frequency part"]
    error: Float[np.ndarray, "frequency part"]
    sized: Bool[np.ndarray, "frequency part"]

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

    def distance(
        self, column: Int[np.ndarray, " place"], part: Int[np.ndarray, " place"]
    ) -> Float[np.ndarray, " place"]:
        """Give how far orbits are from any change of stability: what vanishes there.

        Args:
            column: of the frequencies.
            part: in which each lies.

        Returns:
            The least of `|1 - trace + determinant|`, `|1 + trace + determinant|` and `|1 - determinant|` of
            the derivative of the map, in the middle of the part.
        """
        share = (part % PARTS + 0.5) / PARTS
        own = self.polynomials[column, part // PARTS, -3:-1]
        half_trace, determinant = np.einsum("ptk,pk->tp", own, share[:, None] ** np.arange(own.shape[-1]))
        along = np.abs(1.0 + determinant + np.outer([-2.0, 2.0], half_trace))
        return np.minimum(along.min(axis=0), np.abs(1.0 - determinant))


class Displacements(NamedTuple):
    """The displacement amplitudes of a window of force and frequency, by the balance of one harmonic.

    Attributes:
        rest: displacement at rest [m].
        least: smallest amplitude that a drive holds [m].
        grown: largest to which a motion grows from rest without a jump [m].
        largest: largest that a drive holds, with some room [m].
    """

    rest: float
    least: float
    grown: float
    largest: float


@quick_jit
def _drives(model: Isolator, frequencies: Array, amplitudes: Array) -> tuple[Array, Array, Array]:
    rest = rest_displacement(model)

    def drive(amplitude: Array) -> tuple[Array, Array]:
        held = balanced_motion(model, amplitude + 0.0 * frequencies, frequencies, rest).drive
        return jnp.asarray(held.sine) + 0.0 * frequencies, jnp.asarray(held.cosine) + 0.0 * frequencies

    return rest, *jax.vmap(drive)(amplitudes)


@quick_jit
def _largest_scale(model: Isolator, frequencies: Array, amplitude: Array) -> Array:
    rest = rest_displacement(model)
    return jnp.max(jax.vmap(lambda frequency: answer_scale(model, amplitude, frequency, rest))(frequencies))


def displacement_at_rest(model: Isolator, half: bool) -> float:
    """Give the displacement at rest [m].

    Args:
        model: the isolator.
        half: whether the half-period map is used, which only an odd model has.

    Returns:
        The displacement, from which those of a surface count.
    """
    return 0.0 if half else float(_drives(model, jnp.ones(1), jnp.array([1e-9]))[0])


def displacements(model: Isolator, window: MapWindow) -> Displacements:
    """Give rest and the displacement amplitudes that the forces of a window can hold.

    Args:
        model: the isolator.
        window: of the map.

    Returns:
        The amplitudes.
    """
    least, most, frequencies = (
        float(window.amplitudes.min()),
        float(window.amplitudes.max()),
        window.frequencies,
    )
    band = jnp.asarray(np.linspace(frequencies[0], frequencies[-1], 24 if len(frequencies) > 1 else 1))
    grid = float(_largest_scale(model, band, jnp.asarray(most))) * np.logspace(-9.0, 4.0, 400)
    rest, sine, cosine = (np.asarray(value) for value in _drives(model, band, jnp.asarray(grid)))
    needed = np.hypot(sine, cosine)
    # Connected with rest: from small motion up to the first that needs more than the largest force.
    beyond = np.maximum.accumulate(needed >= most, axis=0)
    reached = np.where(beyond.any(axis=0), beyond.argmax(axis=0), len(grid) - 1)
    # Friction takes a drive of the smallest motion; what takes no more are all of them alike.
    enough = np.maximum(least, (1.0 + _TOLD_APART) * needed[0])
    below = np.minimum.accumulate(needed < enough, axis=0).sum(axis=0)
    low = grid[max(int(below.min()) - 1, 0)]
    # Next to a resonance only the part out of phase, which the damping takes, is left of the drive.
    above = (cosine > 0.0).astype(np.uint8)
    resonant = maximum_filter(above, 3) != minimum_filter(above, 3)
    held = np.flatnonzero(
        np.any((needed <= most) | (resonant & (np.abs(sine) <= (1.0 + _FIRST_ERROR) * most)), axis=1)
    )
    grown = float(grid[int(reached.max())])
    largest = max(grown, float(grid[int(held.max(initial=0))]))
    return Displacements(float(rest), 0.5 * low, grown, _BEYOND_BALANCE * largest)


def find_surface(
    model: Isolator, integrator: Integrator, half: bool, window: MapWindow, goal: float, start_steps: int
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
        start_steps: most steps a period of the orbits from which the others start.

    Returns:
        The surface.
    """
    sizes = displacements(model, window)
    rest, ends = sizes.rest, (math.log(sizes.least), math.log(sizes.largest))
    first = first_grid(model, integrator, half, rest, ends, window.frequencies, start_steps)
    start, kinks = first.grid, first.kinks
    first = first._replace(ends=_ends_needed(start, window))
    grid = start
    # Under dry friction the first grid itself is not closed.
    for level in range(0 if model.slides else 1, 1 + REFINEMENTS):
        grid = first.finer(model, grid, level)
        if not kinks.shared.any() or not _needs_doubling(grid, window, goal):
            break
    pieces = spline_pieces(grid.logarithms)
    tables = _with_responses(model, integrator, half, rest, grid)
    fewer = grid._replace(tables=tables[-1:]).from_fewer(window.frequencies)
    rough = _around(np.abs(fewer - tables[-1:])[0] / GAIN) > _SIZED_TO
    tables[:2] *= np.exp(grid.logarithms)
    count, columns = tables.shape[0], len(window.frequencies)
    basis = (tables @ pieces.to_basis.T).transpose(1, 0, 2).reshape(len(grid.frequencies), -1)
    basis = spline_matrix(grid.frequencies, window.frequencies) @ basis
    polynomials = pieces.polynomials(basis.reshape(columns, count, -1))
    forces = forces_along(polynomials[:, :, :2])
    parts = np.linspace(pieces.breaks[:-1], pieces.breaks[1:], 2 * PARTS + 1, axis=1)[:, 1::2].ravel()
    shared = kinks.shared[
        np.ix_(node_at(start.frequencies, window.frequencies), node_at(start.logarithms, parts))
    ]
    nodes = np.ix_(node_at(grid.frequencies, window.frequencies), node_at(grid.logarithms, parts))
    error = np.where(shared, _around(grid.error)[nodes], np.inf)
    sized = ~rough[nodes]
    return Surface(
        rest, pieces.breaks, window.frequencies, polynomials, forces, kinks.sides, shared, error, sized
    )


def _ends_needed(grid: Grid, window: MapWindow) -> tuple[float, float]:
    """Give the least and largest logarithm of the displacements that the forces hold, with some room."""
    pieces = spline_pieces(grid.logarithms)
    drive = (grid.tables[:2] * np.exp(grid.logarithms)) @ pieces.to_basis.T
    ends, turns = forces_along(pieces.polynomials(drive.swapaxes(0, 1)))
    largest = (1.0 + _FIRST_ERROR) * window.amplitudes[-1]
    held = np.flatnonzero((ends <= window.amplitudes[-1]).any(axis=0))
    # Near resonance the force may dip between two ends.
    last = max(int(held.max(initial=0)), int(turns.part[turns.force <= largest].max(initial=-1)) + 1)
    behind = np.interp([last / PARTS], np.arange(pieces.breaks.size), pieces.breaks)
    node = min(int(node_at(grid.logarithms, behind)[0]) - 1 + _ROWS_BEYOND, grid.logarithms.size - 1)
    return float(grid.logarithms[0]), float(grid.logarithms[node])


def _with_responses(
    model: Isolator, integrator: Integrator, half: bool, rest: float, grid: Grid
) -> Float[np.ndarray, "table frequency displacement"]:
    """Give the tables of a grid with half the peak-to-peak displacements."""
    if model.slides and half:
        # The second half of such a motion is minus the first, and each goes from turn to turn.
        return grid.tables
    frequency, amplitude = np.meshgrid(grid.frequencies, np.exp(grid.logarithms), indexing="ij")
    unknown = grid.tables[: 2 + model.internal_states].reshape(-1, amplitude.size).T
    fine = integrator.with_steps(max(integrator.steps_per_period, _RESPONSE_STEPS))
    sizes = node_responses(model, fine, half, rest, amplitude.ravel(), frequency.ravel(), unknown)
    sizes = sizes.reshape(1, *amplitude.shape)
    # Of a motion that ran away there is none.
    sizes = filled(np.where(sizes < _LARGEST_RESPONSE, sizes, np.nan))
    return np.concatenate([grid.tables[:-1], sizes])


def _around(error: Float[np.ndarray, "frequency node"]) -> Float[np.ndarray, "frequency node"]:
    """Give the largest error of the nodes that a node is interpolated from."""
    return maximum_filter(error, [2 * reach + 1 for reach in AROUND])


def _needs_doubling(grid: Grid, window: MapWindow, goal: float) -> bool:
    """Say whether more of the orbits that are asked for than a few cannot be read off."""
    force = np.exp(grid.logarithms) * np.hypot(grid.tables[0], grid.tables[1])
    asked = (force >= window.amplitudes[0]) & (force <= window.amplitudes[-1])
    return bool(asked.any() and np.mean(grid.error[asked] > goal) > _FEW)
