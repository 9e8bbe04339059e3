"""Pictures of the unexplained residual: where it is, and as a force."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...identification import DwellRemainder, ForceMap
from ._style import BAND, LEVELS, axes_for, entitle


def plot_remainder_map(dwells: Sequence[DwellRemainder], *, ax: Axes | None = None) -> Figure:
    """Draw chi2/dof of each dwell over drive frequency and amplitude of the motion.

    Args:
        dwells: their force residuals.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if there are no dwells.
    """
    _refuse_none(dwells)
    figure, ax = axes_for(ax)
    goodness = np.array([max(one.chi2_per_dof, 1e-3) for one in dwells])
    highest = max(2.0, float(np.max(goodness)))
    shown = None
    for role, marker in (("fit", "o"), ("holdout", "D")):
        places = [place for place, one in enumerate(dwells) if one.role == role]
        if places:
            shown = ax.scatter(
                [dwells[place].frequency for place in places],
                [_height(dwells[place]) for place in places],
                c=goodness[places],
                norm=LogNorm(0.8, highest),
                cmap="YlOrRd",
                marker=marker,
                s=46,
                linewidths=0.5,
                edgecolors="#5d6b7a",
                label="fitted" if role == "fit" else "held out",
            )
    if shown is not None:
        bar = figure.colorbar(shown, ax=ax, label="χ²/dof of the dwell")
        ticks = [tick for tick in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0) if tick <= highest]
        bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
        bar.ax.minorticks_off()
        _small_print(bar)
    levelled = all(one.level is not None for one in dwells)
    ax.set_xlabel("drive frequency [Hz]")
    ax.set_ylabel("excitation level" if levelled else "amplitude [mm]")
    ax.margins(y=0.1)
    entitle(ax, "where the residual exceeds the noise")
    return figure


def _small_print(bar: Colorbar) -> None:
    """Write a colour bar as small as the axes beside it."""
    bar.ax.tick_params(labelsize=8)
    bar.ax.yaxis.label.set_fontsize(9)


def _height(one: DwellRemainder) -> float:
    return 1e3 * one.amplitude if one.level is None else one.level


def _refuse_none(dwells: Sequence[DwellRemainder]) -> None:
    if not dwells:
        raise ValueError("Argument `dwells` must hold at least one dwell, but holds none.")


def plot_force_residual_loops(
    dwells: Sequence[DwellRemainder],
    *,
    against: Literal["displacement", "velocity"] = "displacement",
    ax: Axes | None = None,
) -> Figure:
    """Draw the force residual over one cycle: the worst dwell of the lowest, middle and highest level.

    Args:
        dwells: force residuals; only those of fitted records are drawn, where there are any.
        against: quantity of the horizontal axis.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if there are no dwells.
    """
    _refuse_none(dwells)
    figure, ax = axes_for(ax)
    fitted = [one for one in dwells if one.role == "fit"] or list(dwells)
    for one, colour in zip(_worst_of_levels(fitted), (LEVELS[0], LEVELS[1], LEVELS[3]), strict=False):
        along = 1e3 * (one.displacement if against == "displacement" else one.velocity)
        force = one.force
        level = "" if one.level is None else f"level {one.level:g}, "
        noise = 2.0 * float(one.error[1])
        ax.fill_between([along.min(), along.max()], -noise, noise, color=BAND, alpha=0.6, zorder=0)
        ax.plot(
            np.append(along, along[0]),
            np.append(force, force[0]),
            color=colour,
            linewidth=1.5,
            label=f"{level}{one.frequency:.3g} Hz",
        )
        # The direction of time: an arrow on the upper branch.
        place = int(np.argmax(force))
        ahead = (place + 3) % force.size
        ax.annotate(
            "",
            (along[ahead], force[ahead]),
            (along[place], force[place]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.2},
        )
    ax.set_xlabel("displacement [mm]" if against == "displacement" else "velocity [mm/s]")
    ax.set_ylabel("force residual [N]")
    entitle(ax, f"force residual over a cycle, against {against}")
    return figure


def _worst_of_levels(dwells: Sequence[DwellRemainder]) -> list[DwellRemainder]:
    """Give the worst dwell of the lowest, the middle and the highest level."""
    levels = sorted({_height(one) for one in dwells} if dwells[0].level is not None else {0.0})
    chosen = sorted({levels[0], levels[len(levels) // 2], levels[-1]})
    groups = [[one for one in dwells if one.level is None or one.level == level] for level in chosen]
    return [max(group, key=lambda one: one.chi2_per_dof) for group in groups if group]


def plot_force_residual_map(force_map: ForceMap, *, ax: Axes | None = None) -> Figure:
    """Draw the mean force residual over the plane of displacement and velocity.

    Args:
        force_map: the mean force.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    known = np.abs(force_map.force[np.isfinite(force_map.force)])
    reach = float(np.quantile(known, 0.98)) if known.size else 1.0
    shown = ax.pcolormesh(
        1e3 * force_map.displacement,
        1e3 * force_map.velocity,
        np.ma.masked_invalid(force_map.force.T),
        cmap="RdBu_r",
        vmin=-reach,
        vmax=reach,
    )
    _small_print(figure.colorbar(shown, ax=ax, label="mean force residual [N]"))
    ax.set_xlabel("displacement [mm]")
    ax.set_ylabel("velocity [mm/s]")
    ax.grid(False)
    entitle(ax, "force residual over the plane of motion")
    return figure
