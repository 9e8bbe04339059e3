"""Stability over a whole plane of drive amplitude and frequency."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._given_numbers import given_count
from ..._results import RESULTS
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
from ..orbit import (
    ascending,
    fewest_steps,
    integrator_for,
    is_odd,
    refuse_transformed,
    rest_displacements,
)
from ._batched_newton import (
    FOUND,
    NO_FURTHER_ORBIT,
    NOT_ACCURATE,
    NOT_CONVERGED,
    NOT_FINITE,
    STICKS,
    CellSolver,
    Found,
    blanked,
)
from ._chance import find_chances, quasi_draws
from ._chunks import claim_folder, fingerprint, run_chunks
from ._empty_cells import Cells, fill_empty, without_repeats
from ._map_error import sampled_error, steps_for, steps_needed
from ._map_method import MapMethod
from ._single_orbits import SingleOrbits
from ._sizes import motion_sizes
from ._sought import MapRun, Sought, seek
from ._stability_map import StabilityMap
from ._starts import Candidates, joined
from ._surface import MapWindow, Surface, displacement_at_rest, displacements
from ._window_steps import check_steps, window_integrator

_READING_SHARE = 0.2
"""Of the error that a map may have, where its orbits are read off: there steps cost little."""

_SLIDING_STEPS = 160
"""Steps a period of a first surface with dry friction, under which an orbit has kinks that smooth ones lack.
With the usual 128 the error of a map was just above what it may be, so that a second surface was sought."""

_INSTEAD = (
    "Make the map outside: `isojax.find_again(smap, model)` finds its cells again under jax.jit, jax.vmap, "
    "jax.jacfwd and jax.grad, and `isojax.sensitivity(smap)` differentiates them."
)
"""What to use where JAX transforms the model of a map."""

_INSTEAD_OF_AXES = (
    "Make the map outside: `isojax.sensitivity(smap)` differentiates its cells by `drive.amplitude` and "
    "`drive.frequency`, and `isojax.find_again(orbit, model, amplitude=..., frequency=...)` finds an orbit "
    "again for any drive under jax.jit, jax.vmap, jax.jacfwd and jax.grad."
)
"""What to use where JAX transforms the drive of a map."""


_RESTS_WITHIN = 100.0
"""Distance up to which other rests are looked for, over the largest motion of a map."""


def stability_map(
    model: Isolator | Modelled,
    amplitudes: Any,
    frequencies: Any,
    *,
    coexisting: bool = False,
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
        ValueError: if JAX traces or differentiates the model or a grid (see `find_again`), a grid is empty,
            not positive or not ascending, `chunk` is no positive count, the checkpoint
            is of another map or of other code, or the fit failed, leaves a coefficient undetermined or is of
            another model.
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
    for name, axis in (("amplitudes", amplitudes), ("frequencies", frequencies)):
        refuse_transformed(axis, _INSTEAD_OF_AXES, name)
    if integrator is not None:
        integrator = integrator_for(model, integrator)
    carried = None if fit is None else coefficient_errors(fit, model)
    forces, band = ascending("amplitudes", amplitudes), ascending("frequencies", frequencies)
    chunk = given_count("chunk", chunk)
    if coexisting not in (True, False):
        raise ValueError(f"Argument `coexisting` must be True or False, but is {coexisting!r}.")
    given = np.ravel(np.asarray(jax.local_devices() if devices is None else devices, dtype=object))
    if not given.size or not all(isinstance(one, jax.Device) for one in given):
        raise ValueError(
            "Argument `devices` must list devices of JAX, such as jax.local_devices()[:1], "
            f"but is {devices!r}."
        )
    window = MapWindow(forces, band)
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
        window: its axes.
        run: how it is made.

    Returns:
        The map, and the surface from which its orbits came.
    """
    forces, band = window
    half = is_odd(model, displacements(model, window).largest)
    integrator, least = run.integrator, fewest_steps(model)
    if integrator is None:
        usual = integrator_for(model, None, _SLIDING_STEPS) if model.slides else integrator_for(model, None)
        integrator = window_integrator(model, usual, window)
        if integrator.steps_per_period > usual.steps_per_period:
            least = integrator.steps_per_period
    start_steps = integrator.steps_per_period
    sought = seek(model, integrator, half, window, integrator.map_error, run, start_steps)
    goal = _READING_SHARE * integrator.map_error
    # Where friction begins to hold the mass a surface has a kink, near which more steps gain little.
    enough = integrator.map_error if model.slides else goal
    # Without friction orbits that are not read off are as well integrated together; with it each takes long.
    asked = run.integrator is None and (sought.reads or model.slides)
    if asked and sought.reading_error > enough:
        integrator = integrator.with_steps(steps_for(integrator.steps_per_period, sought.reading_error, goal))
        sought = seek(model, integrator, half, window, goal, run, start_steps)
    first = sought.groups[0]
    if run.integrator is None and isinstance(first.solver, CellSolver):
        # Nothing is read off: each orbit is integrated for itself, and steps cost.
        steps = steps_needed(first.solver, first.candidates, window)
        integrator = integrator.with_steps(max(steps, least))
        sought = sought.with_steps(integrator.steps_a_period(model))
    if run.progress is not None:
        run.progress("orbits over displacement and frequency found")
    if run.folder is not None:
        claim_folder(run.folder, fingerprint(model, integrator, forces, band, run.coexisting, run.chunk))
    measuring = MapMethod(integrator, half, None, jnp.asarray(integrator.steps_a_period(model)))
    known, errors, unconfirmed = _known_cells(model, measuring, sought, window, run)
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
        unconfirmed=unconfirmed,
        sides=jnp.asarray(sought.surface.sides),
        symmetric=half,
        integrator=integrator,
        other_rests=_other_rests(model, displacement_at_rest(model, half), arrays["response"]),
        **fields,
    )
    return smap, sought


def _other_rests(
    model: Isolator, rest: float, response: Float[np.ndarray, "*orbit force frequency"]
) -> Float[np.ndarray, " rest"]:
    """Give where the mass also rests without a drive, within some times the largest motion."""
    size = float(np.nanmax(response, initial=0.0))
    rests = rest_displacements(model, abs(rest) + _RESTS_WITHIN * size)
    return np.delete(rests, np.argmin(np.abs(rests - rest))) if rests.size else rests


def _known_cells(
    model: Isolator, measuring: MapMethod, sought: Sought, window: MapWindow, run: MapRun
) -> tuple[Cells, list[float], int]:
    """Give the orbits of all groups, the errors of these, and how many of a sample finer steps deny."""
    parts, errors, unconfirmed = [], [sought.reading_error] if sought.reads else [], 0
    for name, solver, candidates in sought.groups:
        part = run_chunks(solver, candidates, run.chunk, run.folder, name, run.progress)
        if isinstance(solver, CellSolver):
            error, denied = sampled_error(solver, candidates, part, window)
            part = blanked(part, denied, NOT_ACCURATE)
            errors.append(error)
            unconfirmed += denied.size
        elif isinstance(solver, SingleOrbits):
            errors.append(solver.method.integrator.map_orbit_error)
        if name in ("read", "split"):
            part = _measured(model, measuring, sought.surface, window, candidates, part)
        parts.append(part)
    lists = [group.candidates for group in sought.groups]
    split = np.repeat(
        [group.name not in ("whole", "single") for group in sought.groups], [own.force.size for own in lists]
    )
    return Cells(joined(lists), joined(parts), split), errors, unconfirmed


def _measured(
    model: Isolator,
    method: MapMethod,
    surface: Surface,
    window: MapWindow,
    candidates: Candidates,
    found: Found,
) -> Found:
    """Measure the motions of which the surface does not tell the size."""
    if surface.sized.all():
        return found
    some = np.flatnonzero((found.code == FOUND) & ~surface.sized[candidates.frequency, candidates.part])
    if not some.size:
        return found
    push = window.amplitudes[candidates.force[some], None] * found.direction[some]
    frequency = window.frequencies[candidates.frequency[some]]
    response = np.array(found.response)
    response[some] = motion_sizes(model, method, found.states[some], push, frequency)
    return found._replace(response=response)


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
    place = (candidates.order * np.int64(rows) + candidates.force) * columns + candidates.frequency
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
    cells = code.reshape(orbits, rows, columns)
    arrays["count"] = (cells == FOUND).sum(axis=0)
    answered = ((cells == FOUND) | (cells == STICKS)).any(axis=0)
    arrays["code"] = np.where(~answered & (code == NO_FURTHER_ORBIT), NOT_CONVERGED, code)
    return arrays
