"""Chances of a map: how probable a stable cell is, and one with several orbits, given the errors of a fit.

At a fold a cell gains or loses two orbits at once, so that no derivative of the cell says how probable that
is. Over displacement and frequency the orbits do not fold: there the force that an orbit takes and its
stability are smooth in the coefficients. Both are read off the surface of a map, and off that of one map
either way along each independent step of the covariance; where orbits cannot be read off a surface, off those
of the map. Draws of the coefficients then cost a product of matrices each.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation
from scipy.stats.qmc import Sobol

from ...models import CoefficientErrors, Isolator
from ._orbit_curves import Curve, Curves
from ._sought import Sought

if TYPE_CHECKING:
    from ._stability_map import StabilityMap

_REACH = 3.0**0.5
"""Standard deviations of the maps either way: the nodes of Gauss and Hermite."""

_DISPLACEMENTS, _DOUBTFUL = 400, 160
"""Displacements, even in their logarithm, at which the maps are compared; and within what is in doubt."""

_BELOW, _ABOVE = np.geomspace(0.87, 0.97, 4), np.geomspace(1.01, 1.3, 9)
"""Amplitudes beside the window that are mapped as well, over its least and its largest."""

_SHARE_OF_DOUBT = 1.0 / (2.0**1.5 * np.pi)
"""Of a normal boundary that is misplaced by a small `d`: the error of the chance at its median,
`d / (s sqrt(2 pi))`, over `d` as a share of the integral of `P (1 - P)`, which is `s / sqrt(pi)`."""

DRAWS = 512
"""Draws of the coefficients: quasi-random, so that chances scatter less than by independent ones."""


_IN_DOUBT = 0.05
"""Chance below which, or below which of the contrary, a cell counts as sure."""


class Chances(NamedTuple):
    """What the errors of the coefficients make of a map.

    Attributes:
        stable: chance that a cell holds no unstable orbit.
        coexisting: chance that it holds several orbits.
        standard_errors: of `response` and `spectral_radius` of each orbit; NaN where not every map has it.
        error: mean over the map of the error of a chance of one half, where chances are least exact: what one
            map more shows, of a draw that moves all coefficients at once, and no less than one cell would
            make; NaN where no chance is in doubt.
    """

    stable: Float[np.ndarray, "amplitude frequency"]
    coexisting: Float[np.ndarray, "amplitude frequency"]
    standard_errors: Mapping[str, Float[np.ndarray, "orbit amplitude frequency"]]
    error: float


def quasi_draws(errors: CoefficientErrors, count: int = DRAWS) -> Float[np.ndarray, "draw step"]:
    """Give steps that fill their space evenly, without those that leave a bound of a coefficient.

    Args:
        errors: of the coefficients.
        count: how many; fewer come back where bounds are near.

    Returns:
        The steps.

    Source: Sobol 1967, USSR Comput. Math. Math. Phys. 7:86; each point in the middle of its cell.
    """
    if errors.steps == 0:
        return np.zeros((1, 0))
    # Sobol points are even in numbers of a power of two; the first of them do as well.
    powers = 2 ** int(np.ceil(np.log2(count)))
    cells = Sobol(errors.even_numbers, scramble=False).random(powers)[:count]
    steps = errors.steps_of(cells + 0.5 / powers)
    kept = steps[errors.inside(steps)]
    return kept if len(kept) else np.zeros((1, errors.steps))


def find_chances(
    errors: CoefficientErrors,
    amplitudes: Float[np.ndarray, " amplitude"],
    find: Callable[[Isolator, Float[np.ndarray, " wide"]], tuple["StabilityMap", Sought]],
    steps: Float[np.ndarray, "draw step"],
) -> Chances:
    """Give the chances of every cell.

    Args:
        errors: of the coefficients.
        amplitudes: of the drive.
        find: gives the map of a model with all coexisting orbits, at some amplitudes, and their surface.
        steps: draws of the coefficients, in standard deviations.

    Returns:
        The chances; NaN in a cell with an orbit that lies beyond those of another of the maps.
    """
    # A fold that a draw moves out of the window must still be seen.
    wide = np.concatenate([amplitudes[0] * _BELOW, amplitudes, amplitudes[-1] * _ABOVE])
    inner = slice(_BELOW.size, _BELOW.size + amplitudes.size)
    found = [find(errors.model, wide)]
    for place in range(errors.steps):
        for sign in (1.0, -1.0):
            away = np.zeros(errors.steps)
            away[place] = sign * _REACH
            found.append(find(errors.moved(jnp.asarray(away)), wide))
    curves = Curves(found)
    # One draw of the usual length, which no map of one step knows of, tells how good the chances are.
    check = int(np.argmin(np.abs(np.linalg.norm(steps, axis=1) - errors.steps**0.5)))
    drawn = Curves([find(errors.moved(jnp.asarray(steps[check])), wide)])
    maps = [smap for smap, _ in found]
    weights = _weights(steps)
    forces, still = np.log(amplitudes), np.log(np.asarray(maps[0].response))[:, inner]
    shape = (forces.size, maps[0].frequencies.size)
    stable, coexisting, wrong = np.ones(shape), np.zeros(shape), np.zeros((2, *shape))
    for column in range(shape[1]):
        known = curves.at(column)
        if known is None:
            stable[:, column] = coexisting[:, column] = np.nan
            continue
        low, high = max(one.low for one in known), min(one.high for one in known)
        grid = _in_doubt(known, np.linspace(low, high, _DISPLACEMENTS))
        if grid.size:
            table = _tables(known, grid)
            stable[:, column], coexisting[:, column] = _counted(weights, grid, table, forces)
            told = _counted(weights[check][None], grid, table, forces)
            true = drawn.at(column)
            if true is None:  # what the draw does there is not known, and counts as told wrongly
                seen = np.subtract(1.0, told)
            else:  # beyond what is known of it, it neither folds nor becomes unstable
                reached = np.clip(grid, true[0].low, true[0].high)
                seen = _counted(np.ones((1, 1)), grid, _tables(true, reached), forces)
            wrong[..., column] = np.abs(np.subtract(told, seen))
        least, most = known[0].response(np.array([low, high]))
        beyond = np.any((still[..., column] < least) | (still[..., column] > most), axis=0)
        stable[beyond, column] = coexisting[beyond, column] = np.nan
    doubt = np.nansum(stable * (1.0 - stable) + coexisting * (1.0 - coexisting))
    # That one draw shows no wrong cell says that fewer than one a draw are wrong.
    cells = max(wrong[:, np.isfinite(stable)].sum(), 1.0)
    # Where hardly a cell is in doubt the share says nothing; no chance near a half is off by more than this.
    error = min(_SHARE_OF_DOUBT * cells / doubt, 0.5) if doubt > 0.0 else np.nan
    return Chances(stable, coexisting, _standard_errors(maps, inner), float(error))


def _weights(steps: Float[np.ndarray, "draw step"]) -> Float[np.ndarray, "draw map"]:
    """Give the weights of the maps in each draw: of the quadratic through three nodes of each step."""
    along = steps / _REACH
    sides = np.stack([0.5 * along * (along + 1.0), 0.5 * along * (along - 1.0)], axis=-1)
    return np.concatenate(
        [1.0 - np.sum(along**2, axis=1, keepdims=True), sides.reshape(len(steps), -1)], axis=1
    )


def _in_doubt(
    curves: list[Curve], grid: Float[np.ndarray, " displacement"]
) -> Float[np.ndarray, " doubtful"]:
    """Give log displacements that a draw may fold or destabilise; elsewhere all maps are far from it."""
    force, margin = _tables(curves, grid)
    rise, margin = np.diff(force, axis=1), np.minimum(margin[:, :-1], margin[:, 1:])
    near = np.any([one.min(axis=0) < 2.0 * np.ptp(one, axis=0) for one in (rise, margin)], axis=0)
    # A fold may lie within the interval beside.
    places = np.flatnonzero(binary_dilation(near))
    if not places.size:
        return np.zeros(0)
    each = -(-_DOUBTFUL // places.size)
    inner = grid[places, None] + np.diff(grid)[places, None] * np.arange(each) / each
    # Between what is in doubt all draws rise, or all fall: one interval says as much as many.
    return np.union1d(inner, grid[places + 1])


def _tables(
    curves: list[Curve], grid: Float[np.ndarray, " displacement"]
) -> Float[np.ndarray, "2 map displacement"]:
    """Give log force and margin of all maps over common displacements."""
    return np.array([[one.force(grid) for one in curves], [one.margin(grid) for one in curves]])


def _counted(
    weights: Float[np.ndarray, "draw map"],
    grid: Float[np.ndarray, " displacement"],
    table: Float[np.ndarray, "2 map displacement"],
    forces: Float[np.ndarray, " amplitude"],
) -> tuple[Float[np.ndarray, " amplitude"], Float[np.ndarray, " amplitude"]]:
    """Give the chances at one frequency, by counting what each draw has at each force."""
    force, margin = _with_folds(grid, weights @ table[0]), weights @ table[1]
    rank = np.searchsorted(forces, force)
    falls = rank[:, 1:] < rank[:, :-1]
    # The unstable part of each interval: whole where the force falls, else as far as the margin is negative.
    left, right = margin[:, :-1], margin[:, 1:]
    gap = left - right
    share = np.clip(left / np.where(gap == 0.0, 1.0, gap), 0.0, 1.0)
    passing = np.searchsorted(forces, force[:, :-1] + share * np.diff(force, axis=1))
    begin = np.where(falls | (left < 0.0), rank[:, :-1], passing)
    end = np.where(falls | (right < 0.0), rank[:, 1:], passing)
    unstable = _passed(begin, end, falls | (left < 0.0) | (right < 0.0), forces.size)
    # Between two folds the force falls, and an orbit that rises to it lies on either side.
    several = _passed(rank[:, :-1], rank[:, 1:], falls, forces.size)
    return np.mean(unstable == 0, axis=0), np.mean(several > 0, axis=0)


def _with_folds(
    grid: Float[np.ndarray, " displacement"], force: Float[np.ndarray, "draw displacement"]
) -> Float[np.ndarray, "draw displacement"]:
    """Give log forces whose largest and least ones are those of a parabola through their neighbours."""
    before, after = np.diff(grid)[:-1], np.diff(grid)[1:]
    left, right = force[:, 1:-1] - force[:, :-2], force[:, 2:] - force[:, 1:-1]
    over = before * after * (before + after)
    bend, slope = (right * before - left * after) / over, (right * before**2 + left * after**2) / over
    extreme = left * right < 0.0
    moved = force.copy()
    moved[:, 1:-1] -= np.where(extreme, slope**2 / (4.0 * np.where(extreme, bend, 1.0)), 0.0)
    return moved


def _passed(
    begin: np.ndarray, end: np.ndarray, counts: Bool[np.ndarray, "draw interval"], forces: int
) -> np.ndarray:
    """Count the intervals of each draw that pass each force."""
    draw, _ = np.nonzero(counts & (begin != end))
    some = counts & (begin != end)
    low, high = np.minimum(begin[some], end[some]), np.maximum(begin[some], end[some])
    size = len(begin) * (forces + 1)
    change = np.bincount(draw * (forces + 1) + low, minlength=size)
    change = change - np.bincount(draw * (forces + 1) + high, minlength=size)
    return np.cumsum(change.reshape(len(begin), forces + 1), axis=1)[:, :-1]


def _standard_errors(maps: list["StabilityMap"], inner: slice) -> dict[str, np.ndarray]:
    """Give standard errors by central differences, where every map has the same orbits."""
    orbits = max(one.response.shape[0] for one in maps)
    counts = np.array([np.asarray(one.count)[inner] for one in maps])
    alike = np.all(counts == counts[0], axis=0)
    errors = {}
    for name in ("response", "spectral_radius"):
        values = [np.asarray(getattr(one, name))[:, inner] for one in maps]
        values = np.array(
            [np.pad(v, ((0, orbits - len(v)), (0, 0), (0, 0)), constant_values=np.nan) for v in values]
        )
        slopes = (values[1::2] - values[2::2]) / (2.0 * _REACH)
        errors[name] = np.where(alike, np.linalg.norm(slopes, axis=0), np.nan)
    return errors


def chance_words(smap: "StabilityMap") -> str:
    """Say in how many cells the chances are sure and in how many in doubt; "" without chances."""
    if smap.probability_stable is None:
        return ""
    words, error = [], smap.chance_error
    for name, chance in (
        ("stable", smap.probability_stable),
        ("several orbits", smap.probability_coexisting),
    ):
        values = np.asarray(chance)
        sure = int(np.sum(values >= 1.0 - _IN_DOUBT))
        still = int(np.sum(smap.held & (values >= 1.0 - _IN_DOUBT))) if name == "stable" else 0
        how = f" (in {still} of them dry friction holds the mass)" if still else ""
        doubtful = int(np.sum((values > _IN_DOUBT) & (values < 1.0 - _IN_DOUBT)))
        unknown = int(np.sum(~np.isfinite(values)))
        lost = f", unknown in {unknown}" if unknown else ""
        words.append(f"{name}: at least 95 % in {sure} cells{how}, uncertain in {doubtful}{lost}")
    if error is not None and np.isfinite(error):
        words.append(
            f"a chance near a half is off by about {error:.2g} in the mean over the map, by more next to a "
            "fold where the grid is coarse beside the error of its force; "
            f"its standard error by the count of draws is below {0.5 / DRAWS**0.5:.2g}"
        )
    return "; ".join(words)
