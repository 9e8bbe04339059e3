"""Draw the signatures of the effects without internal states beside their pages in this folder.

python docs/effects/draw_laws.py
"""

from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isojax import elements
from isojax.elements import AbstractElement
from isojax.reporting.plots._style import AFTER, BEFORE, LEVELS, NEUTRAL, axes_for, entitle

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
PHASE = 2.0 * np.pi * np.arange(4096) / 4096
OMEGA = 2.0 * np.pi * 4.5
AMPLITUDES = (0.6e-3, 1.5e-3, 3.0e-3)
SWEPT = np.linspace(0.05e-3, 4e-3, 160)
Law = tuple[AbstractElement, ...]
Number = Callable[[AbstractElement | Law, float], float]
Line = tuple[AbstractElement | Law, str, str]


def cycle(law: AbstractElement | Law, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement [m], velocity [m/s] and force [N] along x = size sin(omega t) at 4.5 Hz."""
    x, v = size * np.sin(PHASE), size * OMEGA * np.cos(PHASE)
    parts = law if isinstance(law, tuple) else (law,)
    return x, v, np.asarray(sum(part.force(jnp.asarray(x), jnp.asarray(v), ()) for part in parts))


def stiffness(element: AbstractElement | Law, size: float) -> float:
    """Part of the force in phase with the displacement, over its amplitude [N/m]."""
    return float(2.0 * np.mean(cycle(element, size)[2] * np.sin(PHASE)) / size)


def resistance(element: AbstractElement | Law, size: float) -> float:
    """First harmonic of the force in phase with the velocity [N]."""
    return float(2.0 * np.mean(cycle(element, size)[2] * np.cos(PHASE)))


def mean(element: AbstractElement | Law, size: float) -> float:
    """Mean force over a cycle [N]."""
    return float(np.mean(cycle(element, size)[2]))


def draw_loops(ax: Axes, element: AbstractElement | Law, over: str) -> None:
    """Draw the force over displacement or velocity for three amplitudes."""
    for size, colour in reversed(list(zip(AMPLITUDES, LEVELS, strict=False))):
        x, v, force = cycle(element, size)
        along = x if over == "displacement" else v
        closed = np.append(np.arange(PHASE.size), 0)
        ax.plot(1e3 * along[closed], force[closed], color=colour, lw=1.5, label=f"{1e3 * size:.1f} mm")
    ax.set_xlabel("displacement [mm]" if over == "displacement" else "velocity [mm/s]")
    ax.set_ylabel("force [N]")
    entitle(ax, f"over {over}, at 4.5 Hz")


def draw_over_amplitude(
    ax: Axes,
    lines: tuple[Line, ...],
    value: Number,
    label: str,
    unit: float,
) -> None:
    """Draw what one first-harmonic number does over the amplitude."""
    for element, words, colour in lines:
        drawn = [value(element, size) / unit for size in SWEPT]
        ax.plot(1e3 * SWEPT, drawn, color=colour, lw=1.5, label=words)
    ax.set_xlabel("amplitude [mm]")
    ax.set_ylabel(label)
    entitle(ax, "over amplitude")


def page(
    element: AbstractElement | Law,
    lines: tuple[Line, ...],
    value: Number,
    label: str,
    unit: float,
    second: Callable[[Axes], None] | None = None,
) -> None:
    """Draw the picture of one effect: loops over displacement and velocity, and one number over amplitude."""
    figure = Figure(figsize=(9.6, 2.9), layout="constrained")
    axes = [axes_for(ax)[1] for ax in figure.subplots(1, 3)]
    draw_loops(axes[0], element, "displacement")
    if second is None:
        draw_loops(axes[1], element, "velocity")
    else:
        second(axes[1])
    draw_over_amplitude(axes[2], lines, value, label, unit)
    axes[0].legend(fontsize=7, frameon=False)
    if len(lines) > 1:
        axes[2].legend(fontsize=7, frameon=False)
    last = element[-1] if isinstance(element, tuple) else element
    figure.savefig(HERE / f"{last.name}.png", dpi=100)


def mean_force(lines: tuple[Line, ...]) -> Callable[[Axes], None]:
    """Give the drawing of the mean force over amplitude."""

    def draw(ax: Axes) -> None:
        draw_over_amplitude(ax, lines, mean, "mean force [N]", 1.0)
        ax.legend(fontsize=7, frameon=False)

    return draw


def draw_springs() -> None:
    """Draw the laws that depend on the displacement alone."""
    stiff = "added stiffness [kN/m]"
    cubic = elements.CubicStiffness(0.6 / 0.75 * 2e16 * (3e-3) ** 2)
    quintic = elements.QuinticStiffness(2e16)
    page(quintic, ((quintic, "x^5", AFTER), (cubic, "x^3", NEUTRAL)), stiffness, stiff, 1e3)

    gas = elements.PolytropicGas(4e3, 0.02, 1.4, 1.0)
    k = 1.4 * 4e3 / 0.02
    lines = (
        (gas, "n = 1.4", AFTER),
        (elements.PolytropicGas(4e3 * 1.4, 0.02, 1.0, 1.0), "n = 1, same k", BEFORE),
        (elements.QuadraticStiffness(k * 2.4 / 0.04), "its x^2 term alone", NEUTRAL),
    )
    page(gas, lines[:2], stiffness, stiff, 1e3, mean_force(lines))

    stop = elements.EndStop(1e6, 1e-3, 0.0, 1.5e-5)
    lines = (
        (stop, "both sides", AFTER),
        (elements.EndStop(0.5e6, 1e-3, 1.0, 1.5e-5), "one side", BEFORE),
        (elements.CubicStiffness(9e10), "cubic spring", NEUTRAL),
    )
    page(stop, lines, stiffness, stiff, 1e3, mean_force(lines))

    play = elements.Freeplay(1e6, 0.5e-3, 1.5e-5)
    lines = (
        (play, "free gap", AFTER),
        (elements.EndStop(1e6, 0.5e-3, 0.0, 1.5e-5), "end stop, same K and gap", BEFORE),
    )
    page(play, lines, stiffness, stiff, 1e3)


def draw_frictions() -> None:
    """Draw the laws that depend on the velocity alone."""
    first = "first harmonic [N]"
    coulomb = elements.CoulombFriction(10.0, 4e-4)
    falling = elements.StribeckFriction(10.0, 0.8, 0.02, 4e-4)
    lines = ((falling, "falling", AFTER), (coulomb, "constant (Coulomb)", NEUTRAL))
    page(falling, lines, resistance, first, 1.0)

    both = (coulomb, elements.AsymmetricFriction(3.0, 4e-4))
    lines = ((both, "Fc = 10 N, dF = 3 N", AFTER), (coulomb, "Fc alone", NEUTRAL))
    page(both, lines, mean, "mean force [N]", 1.0)


if __name__ == "__main__":
    draw_springs()
    draw_frictions()
