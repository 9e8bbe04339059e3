"""Stability over a whole plane of drive amplitude and frequency."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from ..._results import RESULTS, cell_results
from ..._show import number, shown
from ..._types import check_float64
from ...models import (
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    Modelled,
    as_isolator,
    coefficient_errors,
)
from ..orbit import Sine, ascending, fewest_steps, integrator_for, is_odd, refuse_transformed
from ._batched_newton import (
    FOUND,
    NO_FURTHER_ORBIT,
    NOT_ACCURATE,
    NOT_CONVERGED,
    NOT_FINITE,
    STICKS,
    CellSolver,
    Found,
    states_at_zero,
)
from ._chance import chance_words, find_chances, quasi_draws
from ._chunks import claim_folder, fingerprint, run_chunks
from ._empty_cells import Cells, fill_empty, without_repeats
from ._map_error import sampled_error, steps_for, steps_needed
from ._map_method import Lane, MapMethod
from ._single_orbits import SingleOrbits
from ._sought import MapRun, Sought, seek
from ._starts import Candidates, joined
from ._surface import MapWindow
from ._window_steps import check_steps, window_integrator

_READING_SHARE = 0.2
"""Of the error that a map may have, where its orbits are read off: there steps cost little."""

_INSTEAD = (
    "Make the map outside: `isojax.find_again(smap, model)` finds its cells again under jax.jit, jax.vmap, "
    "jax.jacfwd and jax.grad, and `isojax.sensitivity(smap)` differentiates them."
)
"""What to use where JAX transforms the model of a map."""

_ROWS, _COLUMNS = 12, 60
"""Size of the map in characters."""


@shown
class StabilityMap(eqx.Module):
    """Periodic orbits and their multipliers over drive amplitude and frequency.

    With `coexisting` every array of a cell has an axis `orbit` in front, by rising displacement; places that
    a cell does not fill are NaN.

    Attributes:
        model: the isolator.
        amplitudes: drive amplitudes [N, or m/s^2 for base excitation].
        frequencies: [Hz].
        spectral_radius: largest modulus of the multipliers; stable below one.
        multipliers: Floquet multipliers over one drive period.
        start: state of each orbit at the phase at which it is largest.
        direction: drive over its amplitude, sine and cosine part, with the phase counted from there.
        phases: where each orbit passes kinks, counted from there.
        sides: signs of the kinks on the pieces between, alike for all orbits that are split.
        split: whether an orbit was split there; else it was integrated with four times the steps.
        response: half the peak-to-peak displacement [m].
        count: orbits found in each cell.
        result: how the search ended in each cell, in words: `smap.result[i, j]`; beside NaN, why.
        error: of a multiplier at most, from a sample of cells against steps three times finer.
        symmetric: whether the half-period map of an odd model was used, so that only symmetric orbits show.
        integrator: steps a period that were taken.
        probability_stable: chance that the cell holds no unstable orbit, coexisting ones included, where a
            fit was given; NaN where the maps that it rests on do not reach.
        probability_coexisting: chance that the cell holds several orbits, where a fit was given.
        standard_errors: of `response` and `spectral_radius` of each orbit, where a fit was given; NaN where
            orbits may appear or vanish.
        chance_error: of a chance near a half, at most, on average over the map, where a fit was given: what a
            map of one draw of all coefficients shows. Where it is large, map drawn models and count.
    """

    model: Isolator
    amplitudes: Float[Array, " amplitude"]
    frequencies: Float[Array, " frequency"]
    spectral_radius: Float[Array, "*orbit amplitude frequency"]
    multipliers: Complex[Array, "*orbit amplitude frequency multiplier"]
    start: Float[Array, "*orbit amplitude frequency state"]
    direction: Float[Array, "*orbit amplitude frequency 2"]
    phases: Float[Array, "*orbit amplitude frequency crossing"]
    sides: Float[Array, "piece kink"]
    split: Bool[Array, "*orbit amplitude frequency"]
    response: Float[Array, "*orbit amplitude frequency"]
    count: Int[Array, "amplitude frequency"]
    result: RESULTS = eqx.field(converter=cell_results)
    error: float
    symmetric: bool = eqx.field(static=True)
    integrator: Integrator
    probability_stable: Float[Array, "amplitude frequency"] | None = None
    probability_coexisting: Float[Array, "amplitude frequency"] | None = None
    standard_errors: Mapping[str, Float[Array, "*orbit amplitude frequency"]] | None = None
    chance_error: float | None = None

    @property
    def stable(self) -> Array:
        """Whether each orbit is stable; False where there is none."""
        return self.spectral_radius < 1.0

    @property
    def y0(self) -> Float[Array, "*orbit amplitude frequency state"]:
        """State of each orbit at t = 0 of the recorded drive, by integration from `start`."""
        force = jnp.broadcast_to(self.amplitudes[:, None], self.spectral_radius.shape).ravel()
        frequency = jnp.broadcast_to(self.frequencies, self.spectral_radius.shape).ravel()
        state = tuple(self.start.reshape(force.size, -1).T)
        sine, cosine = self.direction.reshape(force.size, 2).T * force[None]
        lane = Lane(state, Sine(sine, cosine, frequency), (), self.response.ravel())
        steps = jnp.asarray(self.integrator.steps_a_period(self.model))
        method = MapMethod(self.integrator, self.symmetric, None, steps)
        return jnp.stack(states_at_zero(self.model, method, lane), axis=-1).reshape(self.start.shape)

    def _headline(self) -> str:
        count, radius = np.asarray(self.count), np.asarray(self.spectral_radius)
        found = radius[np.isfinite(radius)]
        cells = {"with an unstable orbit": self._unstable}
        if self._all_sought:
            cells["with coexisting orbits"] = count > 1
        cells["without any"] = count == 0
        counted = ", ".join(f"{int(np.sum(which))} {words}" for words, which in cells.items())
        largest = number(found.max()) if found.size else "unknown"
        grid = " × ".join(map(str, count.shape))
        return f"{grid} cells of amplitude and frequency, {counted}; largest |mu| {largest}"

    @property
    def _all_sought(self) -> bool:
        return np.ndim(self.spectral_radius) > np.ndim(self.count)

    @property
    def _unstable(self) -> np.ndarray:
        radius = np.asarray(self.spectral_radius)
        return np.any((radius >= 1.0).reshape(-1, *radius.shape[-2:]), axis=0)

    def _rows(self) -> list[str]:
        return ["model", "amplitudes", "frequencies", "response", "symmetric", "error", "result"]

    def _lines(self) -> list[str]:
        count, unstable = np.asarray(self.count), self._unstable
        marks = np.where(count == 0, "?", np.where(count > 1, "2", "."))
        marks = np.where((count > 1) & (count < 10), count.astype(str), marks)
        marks = np.where((count == 1) & unstable, "x", marks)
        forces, band = np.asarray(self.amplitudes), np.asarray(self.frequencies)
        rows = np.unique(np.linspace(0, forces.size - 1, min(_ROWS, forces.size)).round().astype(int))
        columns = np.unique(np.linspace(0, band.size - 1, min(_COLUMNS, band.size)).round().astype(int))
        drawn = [f"  {forces[row]:>10.4g} |{''.join(marks[row, columns])}" for row in rows[::-1]]
        chances = chance_words(self)
        legend = (
            "  . one stable orbit, x one unstable orbit, 2 to 9 coexisting orbits, ? none found"
            if self._all_sought
            else "  the orbit of smallest motion in each cell: . stable, x unstable, ? none found"
        )
        return [
            *drawn,
            f"  {'F0':>10} +{'-' * columns.size}",
            f"  {'f [Hz]':>10}  {band[0]:.4g} to {band[-1]:.4g}",
            legend,
            *([f"  with all orbits of a cell, {chances}"] if chances else []),
        ]


def stability_map(
    model: Isolator | Modelled,
    amplitudes: Any,
    frequencies: Any,
    *,
    coexisting: bool = False,
    reach: float = 3.0,
    integrator: Integrator | None = None,
    chunk: int = 32768,
    checkpoint: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
    devices: Any = None,
    fit: Estimated | EndsEstimated | None = None,
) -> StabilityMap:
    """Find the periodic orbits over a grid of drive amplitude and frequency, and their Floquet multipliers.

    The orbits are found on a coarse grid of displacement amplitude and frequency, over which they do not
    fold, and each cell is read off splines through them. Where a sample of cells or the nodes themselves say
    that this is not exact enough, and for models with internal states, each cell takes steps of Newton's
    method on the period map from there, with its derivative by `jax.jacfwd` under `vmap`. Odd models use the
    half-period map. Orbits are split at kinks.

    Args:
        model: the isolator.
        amplitudes: drive amplitudes, ascending and positive [N, or m/s^2 for base excitation].
        frequencies: ascending and positive [Hz].
        coexisting: whether to give every orbit of a cell; else the one of the smallest motion, to which rest
            leads as the drive grows.
        reach: displacement up to which orbits are sought, over the largest that grows from rest without a
            jump anywhere in the window.
        integrator: steps a period; RK4 with as many as a sample of orbits needs if omitted.
        chunk: orbits computed at once by each core; bounds the memory.
        checkpoint: folder in which finished chunks are kept; a run that was killed goes on from there and
            gives the same numbers.
        progress: called with a line now and then.
        devices: devices to spread each chunk over; all of this process if omitted.
        fit: with whose errors each cell is given its chances; `model` is its model. None for none. That takes
            two more maps an independent step of its covariance, one more to check them, and as long again as
            two.

    Returns:
        The map. Where nothing converged the numbers are NaN and `result` says why.

    Raises:
        ValueError: if JAX traces or differentiates the model (see `find_again`), a grid is empty, not
            positive or not ascending, `reach` is below one, `chunk` is no positive count, the checkpoint
            belongs to another map, or the fit failed, leaves a coefficient undetermined or is of another
            model.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Floquet multipliers as in Nayfeh & Balachandran 1995, ch. 3; the paper, section 5.

    Example:
        >>> amplitudes, frequencies = np.array([100.0, 175.0, 300.0]), np.array([4.2, 5.0])
        >>> smap = ij.stability_map(ij.paper.y_direction(), amplitudes, frequencies, coexisting=True)
        >>> smap.count.shape, int(smap.count.max())
        ((3, 2), 3)
    """
    model = as_isolator(model)
    check_float64()
    refuse_transformed(model, _INSTEAD)
    if integrator is not None:
        integrator = integrator_for(model, integrator)
    carried = None if fit is None else coefficient_errors(fit, model)
    forces, band = ascending("amplitudes", amplitudes), ascending("frequencies", frequencies)
    if not 1.0 <= reach < math.inf:
        raise ValueError(f"Argument `reach` must be at least 1, but is {reach}.")
    if chunk < 1:
        raise ValueError(f"Argument `chunk` must be a positive count, but is {chunk}.")
    window = MapWindow(forces, band, reach)
    if integrator is not None:
        check_steps(model, integrator, window)
    folder = None if checkpoint is None else Path(checkpoint)
    run = MapRun(coexisting, integrator, chunk, folder, progress, devices)
    smap, _ = solve_map(model, window, run)
    if carried is None:
        return smap
    run = MapRun(True, smap.integrator, chunk, None, None, devices)

    def find(moved: Isolator, wide: Float[np.ndarray, " wide"]) -> tuple[StabilityMap, Sought]:
        if progress is not None:
            progress("chances of the cells")
        return solve_map(moved, window._replace(amplitudes=wide), run)

    chances = find_chances(carried, forces, find, quasi_draws(carried))
    orbits = smap.response.shape[0]
    own = slice(orbits) if coexisting else 0
    return eqx.tree_at(
        lambda one: (
            one.probability_stable,
            one.probability_coexisting,
            one.standard_errors,
            one.chance_error,
        ),
        smap,
        (
            jnp.asarray(chances.stable),
            jnp.asarray(chances.coexisting),
            {name: jnp.asarray(error[own]) for name, error in chances.standard_errors.items()},
            chances.error,
        ),
        is_leaf=lambda one: one is None,
    )


def solve_map(model: Isolator, window: MapWindow, run: MapRun) -> tuple[StabilityMap, Sought]:
    """Make a map without chances.

    Args:
        model: the isolator.
        window: its axes, and how far orbits are sought.
        run: how it is made.

    Returns:
        The map, and the surface from which its orbits came.
    """
    half, (forces, band, _) = is_odd(model), window
    integrator, least = run.integrator, fewest_steps(model)
    if integrator is None:
        usual = integrator_for(model, None)
        integrator = window_integrator(model, usual, window)
        if integrator.steps_per_period > usual.steps_per_period:
            least = integrator.steps_per_period
    sought = seek(model, integrator, half, window, integrator.map_error, run)
    goal = _READING_SHARE * integrator.map_error
    if run.integrator is None and sought.reading_error > goal:
        integrator = integrator.with_steps(steps_for(integrator.steps_per_period, sought.reading_error, goal))
        sought = seek(model, integrator, half, window, goal, run)
    first = sought.groups[0]
    if run.integrator is None and isinstance(first.solver, CellSolver):
        # Nothing is read off: each orbit is integrated for itself, and steps cost.
        steps = steps_needed(first.solver, first.candidates, window)
        integrator = integrator.with_steps(max(steps, least))
        sought = sought.with_steps(integrator.steps_a_period(model))
    if run.progress is not None:
        run.progress("orbits over displacement and frequency found")
    if run.folder is not None:
        axes = forces, band, run.coexisting, window.reach
        claim_folder(run.folder, fingerprint(model, integrator, *axes, run.chunk))
    parts, errors = [], [sought.reading_error]
    for name, solver, candidates in sought.groups:
        parts.append(run_chunks(solver, candidates, run.chunk, run.folder, name, run.progress))
        if isinstance(solver, CellSolver):
            errors.append(sampled_error(solver, candidates, parts[-1], window))
        elif isinstance(solver, SingleOrbits):
            errors.append(integrator.map_orbit_error)
    lists = [group.candidates for group in sought.groups]
    split = np.repeat(
        [group.name not in ("whole", "single") for group in sought.groups], [own.force.size for own in lists]
    )
    known = Cells(joined(lists), joined(parts), split)
    filled = fill_empty(model, integrator, half, window, known)
    candidates, found, split = without_repeats(model, integrator, half, window, filled)
    if np.sum(filled.found.code == FOUND) > np.sum(known.found.code == FOUND):
        errors.append(integrator.map_orbit_error)
    error = max((value for value in errors if not math.isnan(value)), default=math.nan)
    arrays = _gridded(candidates, found, split, len(forces), len(band), run.coexisting)
    code = arrays.pop("code")
    result = jax.tree.map(lambda *known: jax.device_put(np.stack(known)[code]), *_endings())
    # What is put on the device is not copied where it can be taken as it is.
    fields: dict[str, Any] = {name: jax.device_put(values) for name, values in arrays.items()}
    smap = StabilityMap(
        model=model,
        amplitudes=jnp.asarray(forces),
        frequencies=jnp.asarray(band),
        result=result,
        error=error,
        sides=jnp.asarray(sought.surface.sides),
        symmetric=half,
        integrator=integrator,
        **fields,
    )
    return smap, sought


def _endings() -> list[RESULTS]:
    """Give the outcomes, in the order of the codes of the search."""
    outcomes = {
        FOUND: RESULTS.promote(diffrax.RESULTS.successful),
        NOT_CONVERGED: RESULTS.not_converged,
        NOT_FINITE: RESULTS.not_finite,
        NOT_ACCURATE: RESULTS.not_accurate,
        STICKS: RESULTS.sticks,
        NO_FURTHER_ORBIT: RESULTS.no_further_orbit,
    }
    return [outcomes[code] for code in sorted(outcomes)]


def _gridded(
    candidates: Candidates, found: Found, split: np.ndarray, rows: int, columns: int, coexisting: bool
) -> dict[str, np.ndarray]:
    """Put the orbits into their cells; a cell in which none was found says that nothing converged."""
    orbits = int(candidates.order.max()) + 1 if candidates.order.size else 1
    place = np.ravel_multi_index(
        (candidates.order, candidates.force, candidates.frequency), (orbits, rows, columns)
    )
    # The common case, one orbit in every cell and in the order of the cells, takes no copying.
    whole = place.size == orbits * rows * columns and bool((np.diff(place) == 1).all())
    arrays: dict[str, np.ndarray] = {}
    names = {"states": "start", "radius": "spectral_radius"}
    names |= {name: name for name in ("response", "direction", "phases", "multipliers")}

    def onto_grid(values: np.ndarray, missing: float | int | bool) -> np.ndarray:
        grid = values
        if not whole:
            grid = np.full((orbits * rows * columns, *values.shape[1:]), missing, dtype=values.dtype)
            grid[place] = values
        grid = grid.reshape(orbits, rows, columns, *values.shape[1:])
        return grid if coexisting else grid[0]

    for name, public in names.items():
        arrays[public] = onto_grid(getattr(found, name), np.nan)
    arrays["split"] = onto_grid(split, False)
    code = onto_grid(found.code, NO_FURTHER_ORBIT)
    arrays["count"] = (code == FOUND).reshape(orbits, rows, columns).sum(axis=0)
    nothing = (arrays["count"] == 0) & (code == NO_FURTHER_ORBIT)
    arrays["code"] = np.where(nothing, NOT_CONVERGED, code)
    return arrays
