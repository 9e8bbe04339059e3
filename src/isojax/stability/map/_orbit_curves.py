"""The orbits of several maps at each frequency, as curves of the force over displacement."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PchipInterpolator

from ..orbit import margin_beside_folds
from ._forces import PARTS
from ._sought import Sought
from ._surface import Surface

if TYPE_CHECKING:
    from ._stability_map import StabilityMap

_FEWEST_ON_CURVE = 6
"""Orbits at one frequency that make a curve."""

_SAME, _FLAT = 1e-9, 0.2
"""Difference of log displacement below which two orbits are one; slope of log force over log displacement
below which the determinant knows it better than a spline."""


class Curve(NamedTuple):
    """The orbits of a model at one frequency, over the logarithm of a displacement.

    Attributes:
        low: least displacement that is known.
        high: largest one.
        force: logarithm of the force that an orbit takes; where it falls the orbit is unstable.
        margin: of each orbit, from any other loss of stability.
        response: logarithm of half the peak-to-peak displacement.
    """

    low: float
    high: float
    force: Callable[[np.ndarray], np.ndarray]
    margin: Callable[[np.ndarray], np.ndarray]
    response: Callable[[np.ndarray], np.ndarray]


def _read_off(surface: Surface, column: int) -> Curve:
    """Give the orbits of one frequency that a surface holds."""

    def force(grid: np.ndarray) -> np.ndarray:
        drive = surface.at(column, grid)[:2]
        return 0.5 * np.log(drive[0] ** 2 + drive[1] ** 2)

    def margin(grid: np.ndarray) -> np.ndarray:
        half_trace, determinant = surface.at(column, grid)[-3:-1]
        # The roots of x^2 - trace x + determinant lie within the unit circle where these two are positive,
        # and a third that vanishes at the folds.
        return np.minimum(1.0 + 2.0 * half_trace + determinant, 1.0 - determinant)

    def response(grid: np.ndarray) -> np.ndarray:
        return grid + np.log(surface.at(column, grid)[-1])

    return Curve(surface.breaks[0], surface.breaks[-1], force, margin, response)


class Curves:
    """The orbits of several maps at each frequency: read off their surfaces where these know all of them."""

    def __init__(self, found: list[tuple["StabilityMap", Sought]]):
        """Take maps with their surfaces."""
        self.surfaces = [sought.surface for _, sought in found]
        self.known = np.all([sought.known_columns for _, sought in found], axis=0)
        self.orbits = [] if self.known.all() else [_MapOrbits(*one) for one in found]

    def at(self, column: int) -> list[Curve] | None:
        """Give those of one frequency, map by map; None where one map knows too few."""
        if self.known[column]:
            return [_read_off(surface, column) for surface in self.surfaces]
        known = [curve for one in self.orbits if (curve := one.at(column)) is not None]
        return known if len(known) == len(self.orbits) else None


class _Points(NamedTuple):
    """Some orbits of one frequency.

    Attributes:
        x: logarithm of half the peak-to-peak displacement.
        y: logarithm of the force.
        fold: what vanishes at a fold: the product of one minus each multiplier.
        others: what vanishes where stability is lost otherwise.
        stable: whether each orbit is.
    """

    x: np.ndarray
    y: np.ndarray
    fold: np.ndarray
    others: np.ndarray
    stable: np.ndarray


class _MapOrbits:
    """The orbits of a map, and between them those that its surface knows, however coarse the map is."""

    def __init__(self, smap: "StabilityMap", sought: Sought):
        """Take the orbits of the map."""
        roots = np.asarray(smap.multipliers)
        stable = np.asarray(smap.spectral_radius) < 1.0
        force = np.broadcast_to(np.log(np.asarray(smap.amplitudes))[:, None], stable.shape)
        fold, others = np.prod(1.0 - roots, axis=-1).real, margin_beside_folds(roots)
        self.found = _Points(np.log(np.asarray(smap.response)), force, fold, others, stable)
        self.surface, self.parts, self.half = sought.surface, sought.known_parts, smap.symmetric

    def _points(self, column: int) -> _Points:
        """Give the orbits of one frequency, by displacement: of the map where the surface does not know."""
        found = _Points(*(one[..., column].ravel() for one in self.found))
        good = np.isfinite(found.x) & np.isfinite(found.fold)
        found = _Points(*(one[good] for one in found))
        parts = np.flatnonzero(self.parts[column])
        if parts.size and found.x.size:
            read = _read_points(self.surface, column, parts, self.half)
            behind = np.searchsorted(read.x, found.x).clip(1, parts.size - 1)
            between = (found.x > read.x[behind - 1]) & (found.x < read.x[behind])
            own = ~between | (np.diff(parts, prepend=-1)[behind] != 1)
            within = (read.x > found.x.min()) & (read.x < found.x.max())
            found = _Points(
                *(np.concatenate([one[own], more[within]]) for one, more in zip(found, read, strict=True))
            )
        order = np.argsort(found.x, kind="stable")
        order = order[np.diff(found.x[order], prepend=-np.inf) > _SAME]
        return _Points(*(one[order] for one in found))

    def at(self, column: int) -> Curve | None:
        """Give the orbits of one frequency; None where too few are known."""
        x, y, fold, others, stable = self._points(column)
        if x.size < _FEWEST_ON_CURVE:
            return None
        rise = CubicSpline(x, y).derivative()(x)
        clear = np.abs(rise) > _FLAT
        if np.count_nonzero(clear) < _FEWEST_ON_CURVE:
            return None
        # Both vanish at a fold, their ratio does not. Near one, where the orbits of a map lie far apart, the
        # determinant therefore says how the force rises.
        known = PchipInterpolator(x[clear], fold[clear] / rise[clear])
        ratio = known(np.clip(x, *x[clear][[0, -1]]))
        # Beyond the clear ones nothing interpolates it: where friction lets a mass go the force is flat, too,
        # over a small displacement, and no fold.
        between = (x > x[clear][0]) & (x < x[clear][-1])
        rise = np.where(clear | between, rise, PchipInterpolator(x, y).derivative()(x))
        known_better = ~clear & between & (ratio != 0.0)
        rise = np.where(known_better, fold / np.where(ratio == 0.0, 1.0, ratio), rise)
        # What is unstable though nothing says so, such as where two multipliers have left through one point,
        # counts as it is.
        margin = np.minimum(ratio, others)
        margin = np.where(stable | (rise < 0.0), margin, -np.abs(margin))
        force = CubicHermiteSpline(x, y, rise)
        return Curve(x[0], x[-1], force, lambda grid: np.interp(grid, x, margin), lambda grid: grid)


def _read_points(surface: Surface, column: int, parts: np.ndarray, half: bool) -> _Points:
    """Read orbits off a surface, one in the middle of each part."""
    piece, share = parts // PARTS, (parts % PARTS + 0.5) / PARTS
    places = surface.breaks[piece] + share * np.diff(surface.breaks)[piece]
    tables = surface.at(column, places)
    trace, determinant, size = 2.0 * tables[-3], tables[-2], tables[-1]
    if half:  # of the map over the whole period, which is the half twice
        trace, determinant = trace**2 - 2.0 * determinant, determinant**2
    fold = 1.0 - trace + determinant
    others = np.minimum(1.0 + trace + determinant, 1.0 - determinant)
    force = 0.5 * np.log(tables[0] ** 2 + tables[1] ** 2)
    return _Points(places + np.log(size), force, fold, others, (fold > 0.0) & (others > 0.0))
