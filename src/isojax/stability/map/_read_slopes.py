"""Derivatives of the cells of a map, read off tables over displacement and frequency.

At a given displacement and frequency the drive and the invariants of the period map are smooth in the
parameters, as they are in displacement and frequency. The displacement of a cell then moves as its drive
asks.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.ndimage import maximum_filter

from ._found_again import found_together
from ._grids import GAIN, REFINEMENTS, FirstGrid, Grid, axes_of, filled, first_grid, node_at
from ._node_slopes import TABLES, Directions, node_slopes
from ._shared_kinks import AROUND
from ._spline import spline_matrix, spline_pieces, spline_slope_matrix
from ._stability_map import StabilityMap
from ._surface import displacement_at_rest

_ROOM = 1.2
"""Displacements of the nodes reach as many times beyond the least and the largest of the map."""

_SAME_DRIVE = 1e-4
"""Relative difference of the drive of a cell from that read off, beyond which they are two orbits."""

_LEAST_SHARE = 1e-4
"""Share of the largest change by a relative change of any parameter, below which one counts as this."""

_CELLS_AT_ONCE = 16384
"""Cells read at once; bounds the memory."""


class CellSlopes(NamedTuple):
    """Derivatives of cells, in the order of `StabilityMap.spectral_radius`, flattened.

    Attributes:
        values: by each parameter, of half the peak-to-peak displacement [m] and of sum and product of the
            multipliers.
        error: estimated from nodes that a coarser grid lacks: of any of these, over its size or over its
            median; infinite where a cell cannot be read.
        steepness: how the logarithm of the drive rises with that of the displacement; zero at folds.
    """

    values: Float[np.ndarray, "parameter 3 cell"]
    error: Float[np.ndarray, " cell"]
    steepness: Float[np.ndarray, " cell"]


def fewest_nodes(smap: StabilityMap) -> int:
    """Give the count of nodes that tables of a map have at least."""
    logarithms, rows = axes_of((0.0, 1.0), np.asarray(smap.frequencies), 1)
    return logarithms.size * rows.size


class SlopeTables:
    """Tables of a map's model and of their derivatives, at nodes that are doubled on demand."""

    def __init__(self, smap: StabilityMap, directions: Directions):
        """Take a map of two states whose orbits are split at kinks across which slopes are continuous.

        Args:
            smap: the map.
            directions: the parameters.
        """
        rest = displacement_at_rest(smap.model, smap.symmetric)
        # Cells that were found as single orbits keep another state than that at the largest displacement.
        together = found_together(smap).reshape(smap.split.shape)
        sizes = np.asarray(smap.start)[..., 0][together] - rest
        ends = math.log(np.nanmin(sizes) / _ROOM), math.log(np.nanmax(sizes) * _ROOM)
        self.smap, self.directions, self.level = smap, directions, 0
        integrator, frequencies = smap.integrator, np.asarray(smap.frequencies)
        self.first: FirstGrid = first_grid(
            smap.model, integrator, smap.symmetric, rest, ends, frequencies, integrator.steps_per_period
        )
        self.grid: Grid = self.first.grid

    def next_count(self) -> float:
        """Give the count of nodes that the next doubling takes; infinite where there is none."""
        if self.level == REFINEMENTS or not self.first.kinks.shared.any():
            return math.inf
        logarithms, rows = axes_of(self.first.ends, self.first.frequencies, self.level + 1)
        return float(logarithms.size * rows.size)

    def doubled(self) -> CellSlopes:
        """Halve the distances of the nodes, and read all cells."""
        self.level += 1
        self.grid = self.first.finer(self.smap.model, self.grid, self.level)
        tables = self._at_nodes()
        error = maximum_filter(self._node_error(tables), [2 * reach + 1 for reach in AROUND])
        return self._read(tables, error)

    def _at_nodes(self) -> Float[np.ndarray, "table frequency node"]:
        """Give tables and their derivatives at the nodes: values, then by each parameter."""
        frequency, amplitude = np.meshgrid(self.grid.frequencies, np.exp(self.grid.logarithms), indexing="ij")
        closed, method = np.isfinite(self.grid.error), self.first.method
        if method.half:
            method = method.for_any_steps()
        unknown = self.grid.tables[:-3, closed].T
        found = node_slopes(
            self.smap.model,
            self.directions,
            method,
            self.first.rest,
            amplitude[closed],
            frequency[closed],
            unknown,
        )
        count = TABLES * (1 + self.directions.frequency.size)
        tables = np.full((count, *closed.shape), np.nan)
        tables[:TABLES, closed] = found.values.T
        tables[TABLES:, closed] = np.moveaxis(found.slopes, 0, -1).swapaxes(0, 1).reshape(-1, closed.sum())
        return filled(tables)

    def _node_error(
        self, tables: Float[np.ndarray, "table frequency node"]
    ) -> Float[np.ndarray, "frequency node"]:
        """Give the relative error of derivatives at the nodes, from a spline through every second one."""
        logarithms, rows = self.grid.logarithms, self.grid.frequencies
        every = 1 if rows is self.first.frequencies else 2
        fine = tables[:TABLES] @ spline_slope_matrix(logarithms, logarithms).T
        along = spline_matrix(rows[::every], rows) @ tables[:, ::every, ::2]
        coarse = along @ spline_matrix(logarithms[::2], logarithms).T
        coarse_slopes = along[:TABLES] @ spline_slope_matrix(logarithms[::2], logarithms).T
        exact, _ = total_slopes(tables, fine, self.directions.amplitude)
        known, _ = total_slopes(coarse, coarse_slopes, self.directions.amplitude)
        error = relative_error(known, exact, np.isfinite(self.grid.error), self.directions.scale)
        return np.where(np.isfinite(self.grid.error) & np.isfinite(error), error / GAIN, np.inf)

    def _read(
        self,
        tables: Float[np.ndarray, "table frequency node"],
        error: Float[np.ndarray, "frequency node"],
    ) -> CellSlopes:
        smap, rows = self.smap, self.grid.frequencies
        shape, band = smap.spectral_radius.shape, np.asarray(smap.frequencies)
        sizes = np.asarray(smap.start)[..., 0] - self.first.rest
        force = np.broadcast_to(np.asarray(smap.amplitudes)[:, None], shape)
        held = np.isfinite(sizes) & np.asarray(smap.split)
        pieces = spline_pieces(self.grid.logarithms)
        basis = tables @ pieces.to_basis.T
        values = np.full((self.directions.frequency.size, 3, *shape), np.nan)
        errors, steepness = np.full(shape, np.inf), np.full(shape, np.nan)
        each = max(1, _CELLS_AT_ONCE // max(1, held[..., 0].size))
        for begin in range(0, band.size, each):
            block = slice(begin, begin + each)
            matrix = spline_matrix(rows, band)[block]
            own = np.einsum("fr,trn->ftn", matrix, basis)
            polynomials = pieces.polynomials(own)
            where = np.nonzero(held[..., block])
            size = sizes[..., block][where]
            column, places = where[-1], np.log(size)
            piece = np.searchsorted(pieces.breaks, places, side="right").clip(1, len(pieces.breaks) - 1) - 1
            length = np.diff(pieces.breaks)[piece]
            share = (places - pieces.breaks[piece]) / length
            read, slopes = _at_shares(polynomials[column, piece], share)
            total, steep = total_slopes(read, slopes / length, self.directions.amplitude)
            total[:, 0] *= size
            near = error[node_at(rows, band[block])[column], node_at(self.grid.logarithms, places)]
            drive = np.hypot(read[0], read[1])
            other = np.abs(drive / force[..., block][where] - 1.0) > _SAME_DRIVE
            target = (..., *where[:-1], begin + where[-1])
            values[target] = total
            errors[target[1:]] = np.where(other, np.inf, near)
            steepness[target[1:]] = steep
        return CellSlopes(values.reshape(*values.shape[:2], -1), errors.ravel(), steepness.ravel())


def total_slopes(
    tables: Float[np.ndarray, "table ..."],
    slopes: Float[np.ndarray, "value ..."],
    by_amplitude: Float[np.ndarray, " parameter"],
) -> tuple[Float[np.ndarray, "parameter 3 ..."], Float[np.ndarray, "..."]]:
    """Give derivatives at a given drive from those at a given displacement.

    With the drive `F(l, p)` at the logarithm `l` of a displacement: `dl/dp = (dF/dp - F_p) / F_l`, and
    `dq/dp = q_p + q_l dl/dp`.

    Args:
        tables: values, then their derivatives by each parameter.
        slopes: derivatives of the values by the logarithm of the displacement.
        by_amplitude: derivative of the amplitude of the drive by each parameter.

    Returns:
        The derivatives of the size of the motion, over the displacement, and of sum and product of the
        multipliers; how the logarithm of the drive rises with that of the displacement.
    """
    values, own = tables[:TABLES], tables[TABLES:].reshape(-1, TABLES, *tables.shape[1:])
    square = values[0] ** 2 + values[1] ** 2
    rise = values[0] * slopes[0] + values[1] * slopes[1]
    asked = by_amplitude.reshape(-1, *(1,) * (tables.ndim - 1)) * np.sqrt(square)
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = (asked - values[0] * own[:, 0] - values[1] * own[:, 1]) / rise
        total = own[:, 2:] + slopes[2:] * moved[:, None]
        steep = rise / square
    size = total[:, 2] + values[4] * moved
    return np.stack([size, total[:, 0], total[:, 1]], axis=1), steep


def relative_error(
    known: Float[np.ndarray, "parameter 3 ..."],
    exact: Float[np.ndarray, "parameter 3 ..."],
    counted: np.ndarray,
    scale: Float[np.ndarray, " parameter"],
) -> Float[np.ndarray, "..."]:
    """Give the largest error of derivatives, each over its size, or its median where that is larger.

    Args:
        known: derivatives.
        exact: the same, with less error.
        counted: places of which the median is.
        scale: size of each parameter.

    Returns:
        The error of each place.
    """
    size = np.abs(exact)
    usual = np.nanmedian(size[..., counted], axis=-1) if counted.any() else np.ones(size.shape[:2])
    # What hardly moves beside what the other parameters move is compared with these.
    moved = usual * scale[:, None]
    usual = np.maximum(moved, _LEAST_SHARE * moved.max(axis=0)) / scale[:, None]
    size = np.maximum(size, usual.reshape(*usual.shape, *(1,) * (size.ndim - 2)))
    gap = np.abs(known - exact)
    # What does not move at all is known as well as may be.
    return np.max(np.where(gap == 0.0, 0.0, gap / np.where(size == 0.0, 1.0, size)), axis=(0, 1))


def _at_shares(
    polynomials: Float[np.ndarray, "cell table power"], share: Float[np.ndarray, " cell"]
) -> tuple[Float[np.ndarray, "table cell"], Float[np.ndarray, "value cell"]]:
    """Give tables and the slopes of the values among them, by the share of a piece."""
    powers = share[:, None] ** np.arange(polynomials.shape[-1])
    read = (polynomials @ powers[:, :, None])[..., 0].T
    count = np.arange(1.0, polynomials.shape[-1])
    slopes = (polynomials[:, :TABLES, 1:] @ (count * powers[:, :-1])[:, :, None])[..., 0].T
    return read, slopes


def multiplier_slopes(
    multipliers: Complex[np.ndarray, "cell 2"],
    total: Float[np.ndarray, "parameter cell"],
    product: Float[np.ndarray, "parameter cell"],
) -> Complex[np.ndarray, "parameter cell 2"]:
    """Give derivatives of two multipliers from those of their sum and product: `(u s' - p') / (2 u - s)`.

    Args:
        multipliers: the two.
        total: derivatives of their sum.
        product: of their product.

    Returns:
        The derivatives; not finite where the two coincide, and where they have none.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = multipliers - multipliers[:, ::-1]
        return (multipliers * total[..., None] - product[..., None]) / apart
