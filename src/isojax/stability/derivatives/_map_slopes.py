"""Derivatives of the cells of a map: read off tables where these are exact enough, else cell by cell."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._cores import usable_cores
from ..map import (
    CellSlopes,
    Directions,
    SlopeTables,
    StabilityMap,
    cells_again,
    fewest_nodes,
    found_together,
    multiplier_slopes,
    relative_error,
)
from ..orbit import modulus
from ._parameter_values import DRIVE, differentiate, drive_values, with_values

_GOAL = 2e-5
"""Relative error of derivatives up to which they are read off."""

_CERTIFYING_CELLS = 512
"""Cells whose derivatives are compared with those read off."""

_MARGIN = 1.25
"""On the largest error of a sample: the worst cell of a map is seldom in it."""

_CELLS_TOGETHER, _SINGLE_TOGETHER = 512, 64
"""Cells that are differentiated at once; single orbits."""


class MapSlopes(NamedTuple):
    """Quantities of the cells of a map and their derivatives.

    Attributes:
        values: by name.
        slopes: derivatives by name, parameter first.
        error: largest relative error of those read off; None where all were found cell by cell.
    """

    values: dict[str, Array]
    slopes: dict[str, Array]
    error: float | None


def map_slopes(smap: StabilityMap, names: tuple[str, ...], at: Float[Array, " parameter"]) -> MapSlopes:
    """Differentiate all cells of a map.

    Args:
        smap: the map.
        names: of parameters.
        at: their values, NaN for the drive.

    Returns:
        Response, multipliers and spectral radius, with their derivatives.
    """
    cells = _Cells(smap, names, jnp.where(jnp.isnan(at), 0.0, at))
    read = _read_off(cells)
    wanted, error = np.flatnonzero(np.isfinite(np.asarray(smap.spectral_radius).ravel())), None
    parts = []
    if read is not None:
        own, slopes, error = read
        parts.append((own, cells.from_invariants(own, slopes)))
        wanted = np.setdiff1d(wanted, own)
    if wanted.size:
        parts.append((wanted, cells.solved(wanted)))
    return cells.gridded(parts, error)


class _Cells:
    """The cells of a map, flattened, and the parameters by which they are differentiated."""

    def __init__(self, smap: StabilityMap, names: tuple[str, ...], at: Float[Array, " parameter"]):
        """Take a map and parameters."""
        self.smap, self.names, self.at = smap, names, at

    def solved(self, cells: Int[np.ndarray, " cell"]) -> tuple[dict, dict]:
        """Find cells, in ascending order, again with their derivatives; blocks of one size compile once."""
        together = found_together(self.smap)[cells]
        blocks = [
            kind[begin : begin + size]
            for kind, size in ((cells[together], _CELLS_TOGETHER), (cells[~together], _SINGLE_TOGETHER))
            for begin in range(0, kind.size, size)
        ]

        def one(block: np.ndarray) -> tuple[dict, dict]:
            size = _CELLS_TOGETHER if found_together(self.smap)[block[0]] else _SINGLE_TOGETHER
            padded = np.concatenate([block, np.repeat(block[-1:], size - block.size)])

            def quantities(numbers: Array) -> dict[str, Array]:
                # Each cell has a drive of its own, which a parameter changes by as much in all.
                more = drive_values(self.names, numbers, (jnp.zeros(()), jnp.zeros(())))
                found = cells_again(
                    self.smap, with_values(self.smap.model, self.names, numbers), padded, *more
                )
                radius = modulus(found.multipliers[:, 0])
                return {
                    "response": found.response,
                    "multipliers": found.multipliers,
                    "spectral_radius": radius,
                }

            values, slopes = differentiate(quantities, self.at)
            count = block.size
            return (
                {name: np.asarray(value)[:count] for name, value in values.items()},
                {name: np.asarray(slope)[:, :count] for name, slope in slopes.items()},
            )

        with ThreadPoolExecutor(usable_cores()) as pool:
            parts = list(pool.map(one, blocks))
        order = np.argsort(np.concatenate(blocks))
        values, slopes = (
            {
                name: np.concatenate([part[which][name] for part in parts], axis=which).take(
                    order, axis=which
                )
                for name in parts[0][which]
            }
            for which in (0, 1)
        )
        return values, slopes

    def from_invariants(
        self, cells: Int[np.ndarray, " cell"], slopes: Float[np.ndarray, "parameter 3 cell"]
    ) -> tuple[dict, dict]:
        """Give the quantities of cells, and their derivatives from those of the invariants."""
        smap = self.smap
        roots = np.asarray(smap.multipliers).reshape(-1, 2)[cells]
        radius = np.asarray(smap.spectral_radius).ravel()[cells]
        moved = multiplier_slopes(roots, slopes[:, 1], slopes[:, 2])
        values = {
            "response": np.asarray(smap.response).ravel()[cells],
            "multipliers": roots,
            "spectral_radius": radius,
        }
        by_radius = np.real(np.conj(roots[:, 0]) * moved[..., 0]) / radius
        return values, {"response": slopes[:, 0], "multipliers": moved, "spectral_radius": by_radius}

    def gridded(
        self, parts: Sequence[tuple[np.ndarray, tuple[dict, dict]]], error: float | None
    ) -> MapSlopes:
        """Put the cells of all parts into their places."""
        shape, states = self.smap.spectral_radius.shape, self.smap.start.shape[-1]
        values, slopes = {}, {}
        for name in ("response", "multipliers", "spectral_radius"):
            own = (states,) if name == "multipliers" else ()
            kind = complex if own else float
            value = np.full((math.prod(shape), *own), np.nan, kind)
            slope = np.full((len(self.names), *value.shape), np.nan, kind)
            for cells, (some, moved) in parts:
                value[cells] = some[name]
                slope[:, cells] = moved[name]
            values[name] = jnp.asarray(value.reshape(*shape, *own))
            slopes[name] = jnp.asarray(slope.reshape(-1, *shape, *own))
        return MapSlopes(values, slopes, error)


def _directions(cells: _Cells) -> Directions:
    """Give the parameters as changes of the isolator and of the drive."""

    def numbers_of(numbers: Array) -> object:
        return eqx.filter(with_values(cells.smap.model, cells.names, numbers), eqx.is_inexact_array)

    amplitude, frequency = (np.array([float(name == own) for name in cells.names]) for own in DRIVE)
    slopes = jax.tree.map(lambda leaf: leaf if np.any(leaf) else None, jax.jacfwd(numbers_of)(cells.at))
    scale = np.abs(np.array(cells.at))
    for name, axis in zip(DRIVE, (cells.smap.amplitudes, cells.smap.frequencies), strict=True):
        scale[[place for place, own in enumerate(cells.names) if own == name]] = np.median(np.asarray(axis))
    return Directions(slopes, frequency, amplitude, np.where(scale == 0.0, 1.0, scale))


def _read_off(
    cells: _Cells,
) -> tuple[Int[np.ndarray, " cell"], Float[np.ndarray, "parameter 3 cell"], float] | None:
    """Read as many cells off tables as are exact enough; None where none are, or solving them costs less.

    Nodes are doubled while fewer of them are added than cells are left, and until a sample of cells agrees
    with derivatives found cell by cell.
    """
    smap = cells.smap
    together = found_together(smap)
    if smap.start.shape[-1] != 2 or smap.model.harmonics or together.sum() <= fewest_nodes(smap):
        return None
    directions = _directions(cells)
    tables = SlopeTables(smap, directions)
    left = int(together.sum())
    while left > tables.next_count():
        slopes = tables.doubled()
        read = np.flatnonzero(together & (slopes.error <= _GOAL))
        left = int(together.sum()) - read.size
        if left > tables.next_count() or not read.size:
            continue
        error = _sampled_error(cells, slopes, read, directions.scale)
        if error <= _GOAL:
            return read, slopes.values[..., read], error
        left = int(together.sum())
    return None


def _sampled_error(
    cells: _Cells,
    slopes: CellSlopes,
    read: Int[np.ndarray, " cell"],
    scale: Float[np.ndarray, " parameter"],
) -> float:
    """Give the largest relative error of a sample: by the estimated error, next to folds, and evenly."""
    count = min(_CERTIFYING_CELLS // 3, read.size)
    steep = np.abs(slopes.steepness[read])
    picked = [
        np.argpartition(slopes.error[read], read.size - count)[read.size - count :],
        np.argpartition(steep, count - 1)[:count],
        np.linspace(0, read.size - 1, count).astype(int),
    ]
    some = read[np.unique(np.concatenate(picked))]
    values, exact = cells.solved(some)
    moved, roots = exact["multipliers"], values["multipliers"]
    known = np.stack(
        [exact["response"], moved.sum(axis=-1).real, (moved * roots[:, ::-1]).sum(axis=-1).real], axis=1
    )
    error = relative_error(slopes.values[..., some], known, np.ones(some.size, bool), scale)
    return _MARGIN * float(error.max()) if np.isfinite(error).all() else math.inf
