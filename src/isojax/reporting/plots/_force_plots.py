"""Pictures of forces: that of a model over measured points, and that of one effect by itself."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._results import is_successful
from ...identification import Fit
from ...models import Band, Isolator, coefficient_errors, find_band
from ...records import Record, measured_state
from ._draw_band import draw_band
from ._force_cycles import cycle_forces, trace_cycles
from ._style import AFTER, BAND, CURVES, MEASURED, NEUTRAL, axes_for, entitle, fits_meant, pair

Slice = Literal["stiffness", "damping"]
"""An axis of the plane of x and v: force over displacement at v = 0, or over velocity at x = 0."""

_MOST_POINTS = 4000


def measured_forces(
    fit: Fit, record: Record
) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"], Float[np.ndarray, " time"]]:
    """Give the restoring force that a record implies: drive less inertia.

    Args:
        fit: gives mass, excitation and what was measured.
        record: the record.

    Returns:
        Displacement [m], velocity [m/s], force [N]; a tenth at each end is left out, where integrals stray.
    """
    quantity, drive, moving = fit.campaign.output.quantity, record.input, record
    if fit.model.excitation == "base_acceleration":
        drive = -float(fit.model.mass) * record.input
        if quantity == "acceleration":
            moving = dataclasses.replace(record, output=record.output - record.input)
    x, v, a = measured_state(moving, quantity)
    kept = slice(x.size // 10, x.size - x.size // 10)
    return x[kept], v[kept], (drive - float(fit.model.mass) * a)[kept]


@fits_meant
def plot_restoring_force(
    before: Fit,
    after: Fit | None = None,
    *,
    what: Slice = "stiffness",
    ax: Axes | None = None,
) -> Figure:
    """Draw the force of the models over displacement at v = 0, or over velocity at x = 0.

    The points are those where the measured motion crosses that axis, force F - m a (Masri & Caughey 1979).

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        what: "stiffness" for the slice v = 0 over x, "damping" for x = 0 over v.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    crossings, reach = [], 0.0
    for record in before.campaign.fit_records:
        x, v, force = measured_forces(before, record)
        along, across = (x, v) if what == "stiffness" else (v, x)
        crossings.append(_crossings(along, across, force))
        reach = max(reach, float(np.max(np.abs(along))))
    points = np.concatenate(crossings)
    points = points[:: max(1, len(points) // _MOST_POINTS)]
    ax.plot(
        1e3 * points[:, 0],
        points[:, 1],
        ".",
        color=MEASURED,
        markersize=1.5,
        zorder=3,
        label="measured F − m a",
    )
    grid = np.linspace(-1.25 * reach, 1.25 * reach, 801)
    for (label, fit, colour), width in zip(pair(before, after), CURVES, strict=False):
        ax.plot(1e3 * grid, _slice(fit.model, grid, what), color=colour, linewidth=width, label=label)
        band = band_of(fit, ("force",), lambda model: _force_along(model, grid, what)[None])
        if band is not None:
            lower, upper = (np.asarray(end["force"]) for end in (band.lower, band.upper))
            draw_band(ax, (1e3 * grid, lower), (1e3 * grid, upper), colour)
    ax.axvspan(-1e3 * reach, 1e3 * reach, color=BAND, alpha=0.6, zorder=0, label="visited")
    ax.set_xlim(1e3 * grid[0], 1e3 * grid[-1])
    ax.set_xlabel("displacement [mm]" if what == "stiffness" else "velocity [mm/s]")
    ax.set_ylabel("force [N]")
    entitle(
        ax, "restoring force over x, at v = 0" if what == "stiffness" else "restoring force over v, at x = 0"
    )
    return figure


def telling_slice(before: Fit, after: Fit | None = None) -> Slice:
    """Say along which axis the forces of two models differ most, within the visited range.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.

    Returns:
        "damping" where there is one model only: most of what an isolator's model lacks depends on velocity.
    """
    if after is None:
        return "damping"
    visited = [measured_forces(before, record)[:2] for record in before.campaign.fit_records]
    gaps: dict[Slice, float] = {}
    for place, what in enumerate(("stiffness", "damping")):
        reach = max(float(np.max(np.abs(motion[place]))) for motion in visited)
        grid = np.linspace(-reach, reach, 801)
        gaps[what] = float(np.max(np.abs(_slice(after.model, grid, what) - _slice(before.model, grid, what))))
    return "stiffness" if gaps["stiffness"] > gaps["damping"] else "damping"


def _crossings(
    along: Float[np.ndarray, " time"], across: Float[np.ndarray, " time"], force: Float[np.ndarray, " time"]
) -> Float[np.ndarray, "point 2"]:
    """Give motion and force where `across` passes zero, interpolated between the samples."""
    before = np.flatnonzero(across[:-1] * across[1:] < 0.0)
    share = across[before] / (across[before] - across[before + 1])
    return np.stack([one[before] + share * (one[before + 1] - one[before]) for one in (along, force)], axis=1)


def _slice(model: Isolator, grid: Float[np.ndarray, " point"], what: str) -> Float[np.ndarray, " point"]:
    return np.asarray(_force_along(model, grid, what))


def _force_along(model: Isolator, grid: Float[np.ndarray, " point"], what: str) -> Float[Array, " point"]:
    """Give the force along one axis of the plane of x and v, internal states at rest."""
    along, zero = jnp.asarray(grid), jnp.zeros(grid.size)
    pair = (along, zero) if what == "stiffness" else (zero, along)
    return model.restoring_force((*pair, *(zero,) * model.internal_states))


def band_of(
    fit: Fit, names: tuple[str, ...], curve: Callable[[Isolator], Float[Array, "quantity ..."]]
) -> Band | None:
    """Give the band around a curve that a picture draws; None where the fit has no errors to carry.

    Args:
        fit: the fit.
        names: of the quantities.
        curve: see `find_band`.
    """
    if not (is_successful(fit.result) and np.all(np.isfinite(fit.covariance))):
        return None
    return find_band(coefficient_errors(fit), names, curve)


def effect_on_its_own(model: Isolator, effect: str) -> Isolator:
    """Give the isolator with one effect only.

    Args:
        model: the isolator.
        effect: catalogue name.

    Returns:
        The isolator without every other element.
    """
    kept = tuple(element for element in model.elements if element.name == effect)
    return Isolator(model.mass, kept, model.excitation)


def plot_effect(
    fit: Fit, effect: str, amplitudes: Sequence[float], frequency: float, *, ax: Axes | None = None
) -> Figure:
    """Draw the force of one effect around a steady cycle: line, curve, loop or rectangle.

    Args:
        fit: the fit whose model has the effect.
        effect: catalogue name.
        amplitudes: displacement amplitudes [m].
        frequency: [Hz].
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    sizes = np.asarray(amplitudes, dtype=float)
    cycles = trace_cycles(effect_on_its_own(fit.model, effect), sizes, frequency)
    band = band_of(
        fit, ("force",), lambda model: cycle_forces(effect_on_its_own(model, effect), sizes, frequency)[None]
    )
    for column, amplitude in enumerate(amplitudes):
        x, force = cycles.displacement[:, column], cycles.force[:, column]
        colour = AFTER if column == len(amplitudes) - 1 else NEUTRAL
        ax.plot(
            1e3 * np.append(x, x[0]),
            np.append(force, force[0]),
            color=colour,
            linewidth=1.5,
            label=f"X = {1e3 * amplitude:.3g} mm",
        )
        if band is not None:
            ends = (np.asarray(end["force"])[:, column] for end in (band.lower, band.upper))
            lower, upper = ((1e3 * np.append(x, x[0]), np.append(end, end[0])) for end in ends)
            draw_band(ax, lower, upper, colour)
    ax.set_xlabel("displacement [mm]")
    ax.set_ylabel("force [N]")
    words = next(element.words for element in fit.model.elements if element.name == effect)
    entitle(ax, f"{words} by itself, a cycle at {frequency:.3g} Hz")
    return figure
