"""Pictures of the classical route: receptance, backbone, equivalent stiffness and damping."""

from collections.abc import Sequence
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import ClassicalGuess, Fit
from ...models import Isolator
from ._draw_band import draw_band
from ._force_cycles import SIDES, equivalent_curves, equivalent_of
from ._force_plots import band_of
from ._style import AFTER, BEFORE, CURVES, LEVELS, MEASURED, NEUTRAL, axes_for, entitle

_LINES = {"forward": "-", "backward": "--", "none": "-"}
_MARKERS = {"forward": "^", "backward": "v", "none": "o"}


def plot_receptance(
    guess: ClassicalGuess,
    *,
    what: Literal["receptance", "displacement"] = "receptance",
    fits: Sequence[tuple[str, Fit]] = (),
    ax: Axes | None = None,
) -> Figure:
    """Draw the measured response of each record over frequency, with its resonance.

    Args:
        guess: the classical start.
        what: displacement over force, or the displacement amplitude itself.
        fits: label and fit of models whose backbone is drawn over displacement amplitudes.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    levels = sorted({response.level for response in guess.responses if response.level is not None})
    for response in guess.responses:
        place = levels.index(response.level) if response.level is not None else 0
        size = response.receptance * 1e6 if what == "receptance" else response.displacement[:, 0] * 1e3
        level = as_mathtext(response.record) if response.level is None else f"{response.level:g}"
        label = level if response.direction == "none" else f"{level} {response.direction}"
        ax.plot(
            response.frequency,
            np.abs(size),
            _LINES[response.direction],
            color=LEVELS[place % len(LEVELS)],
            marker=_MARKERS[response.direction],
            markersize=2.5,
            linewidth=0.9,
            label=label,
        )
    for line in guess.linear:
        scale = 1e6 if what == "receptance" else np.nan
        ax.plot(
            line.frequency, scale * np.abs(line.receptance), linewidth=0.9, label=as_mathtext(line.record)
        )
    _resonance_points(guess, what, ax)
    if what == "displacement":
        for (label, fit), colour, width in zip(fits, (BEFORE, AFTER), CURVES, strict=False):
            _backbone(guess, fit, label, colour, width, ax)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("receptance [mm/kN]" if what == "receptance" else "displacement amplitude [mm]")
    entitle(ax, "measured receptance" if what == "receptance" else "measured amplitude and model backbone")
    return figure


def _resonance_points(guess: ClassicalGuess, what: str, ax: Axes) -> None:
    """Mark the resonance of each record."""
    found = () if guess.table is None else guess.table.resonances
    points = [
        (one.frequency, one.half_power.peak * 1e6 if what == "receptance" else one.amplitude * 1e3)
        for one in found
        if np.isfinite(one.frequency)
    ]
    if points:
        frequency, size = np.array(points).T
        ax.plot(
            frequency,
            size,
            "*",
            color="gold",
            markeredgecolor="black",
            markeredgewidth=0.6,
            markersize=9,
            label="resonance",
        )


def visited_amplitudes(guess: ClassicalGuess) -> tuple[float, float]:
    """Give the range of displacement amplitudes of the dwells.

    Args:
        guess: the classical start, with stepped-sine records.

    Returns:
        Smallest and largest amplitude [m].
    """
    sizes = np.concatenate([np.abs(response.displacement[:, 0]) for response in guess.responses])
    return float(np.min(sizes)), float(np.max(sizes))


def centre_frequency(guess: ClassicalGuess) -> float:
    """Give the frequency at which equivalent curves are drawn: the mean resonance, else that of the dwells.

    Args:
        guess: the classical start, with stepped-sine records.

    Returns:
        Frequency [Hz].
    """
    found = () if guess.table is None else guess.table.resonances
    resonances = [one.frequency for one in found if np.isfinite(one.frequency)]
    if resonances:
        return float(np.mean(resonances))
    return float(np.mean(np.concatenate([response.frequency for response in guess.responses])))


def _backbone(guess: ClassicalGuess, fit: Fit, label: str, colour: str, width: float, ax: Axes) -> None:
    lowest, highest = visited_amplitudes(guess)
    amplitudes = np.linspace(lowest, 1.05 * highest, 60)
    centre = centre_frequency(guess)

    def frequencies(model: Isolator) -> Float[Array, "1 amplitude"]:
        stiffness = equivalent_of(model, amplitudes, centre)[0]
        return jnp.sqrt(jnp.where(stiffness > 0.0, stiffness, jnp.nan) / model.mass)[None] / (2.0 * np.pi)

    (frequency,) = np.asarray(frequencies(fit.model))
    ax.plot(frequency, 1e3 * amplitudes, color=colour, linewidth=width, label=f"backbone, {label}")
    band = band_of(fit, ("frequency",), frequencies)
    if band is not None:
        lower, upper = (np.asarray(end["frequency"]) for end in (band.lower, band.upper))
        draw_band(ax, (lower, 1e3 * amplitudes), (upper, 1e3 * amplitudes), colour)


def plot_equivalent(
    guess: ClassicalGuess,
    fits: Sequence[tuple[str, Fit]],
    *,
    what: Literal["stiffness", "damping"] = "stiffness",
    ax: Axes | None = None,
) -> Figure:
    """Draw equivalent stiffness over displacement, or damping over velocity: resonance points and models.

    Args:
        guess: the classical start, with stepped-sine records.
        fits: label and fit of each model whose curve is drawn, before first.
        what: which of the two.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    lowest, highest = visited_amplitudes(guess)
    amplitudes = np.linspace(lowest, 1.05 * highest, 80)
    frequency = centre_frequency(guess)
    speeds = 2.0 * np.pi * frequency * amplitudes
    # mm on the abscissa; N/mm for stiffness and kN s/m (= N s/mm) for damping on the ordinate.
    for (label, fit), colour, width in zip(fits, (BEFORE, AFTER), CURVES, strict=False):
        stiffness, damping = equivalent_curves(fit.model, amplitudes, frequency)
        x, y = (amplitudes, stiffness) if what == "stiffness" else (speeds, damping)
        band = band_of(fit, SIDES, lambda model: equivalent_of(model, amplitudes, frequency))
        if band is not None:
            lower, upper = (1e-3 * np.asarray(end[what]) for end in (band.lower, band.upper))
            draw_band(ax, (1e3 * x, lower), (1e3 * x, upper), colour)
        ax.plot(
            1e3 * x,
            1e-3 * y,
            color=colour,
            linewidth=width,
            label=label if label == "model" else f"model {label}",
        )
    law = None if guess.table is None else getattr(guess.table, what)
    if law is not None:
        for direction, rows in zip(law.directions, law.points, strict=True):
            label = "resonances" if direction == "none" else f"resonances, {direction}"
            marker = _MARKERS[direction]
            ax.plot(1e3 * rows[:, 0], 1e-3 * rows[:, 1], marker, color=MEASURED, markersize=5, label=label)
        grid = np.linspace(lowest, highest, 80) if what == "stiffness" else speeds
        curve = np.polynomial.polynomial.polyval(grid, law.average)
        ax.plot(1e3 * grid, 1e-3 * curve, ":", color=NEUTRAL, linewidth=1.4, label="classical law")
    side = "displacement amplitude X [mm]" if what == "stiffness" else "velocity amplitude V [mm/s]"
    ax.set_xlabel(side)
    ax.set_ylabel(r"$K_\mathrm{eq}$ [N/mm]" if what == "stiffness" else r"$C_\mathrm{eq}$ [N s/mm]")
    entitle(ax, f"equivalent {what} at {frequency:.3g} Hz, visited amplitudes")
    return figure
