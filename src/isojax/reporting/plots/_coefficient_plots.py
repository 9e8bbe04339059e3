"""What is known of one coefficient: its profile likelihood, its posterior."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import PchipInterpolator
from scipy.stats import norm

from ...inference import Posterior, Profile
from ..words import typeset_unit
from ._style import AFTER, BAND, BEFORE, MEASURED, axes_for, entitle, parameter_label


def plot_profile(profile: Profile, *, ax: Axes | None = None) -> Figure:
    """Draw the rise of chi2 over a coefficient, and beside it what the standard error alone would say.

    Args:
        profile: the profile likelihood.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.4, 3.2)
    known = np.isfinite(profile.root)
    values, root = profile.values[known], profile.root[known]
    limit = float(norm.ppf(0.5 + 0.5 * profile.confidence)) ** 2
    low, high = profile.interval
    if np.isfinite(low) and np.isfinite(high):
        ax.axvspan(low, high, color=BAND, zorder=0, label=f"{profile.confidence:.0%} interval")
    ends = np.append(values, profile.symmetric)
    row = np.linspace(ends.min(), ends.max(), 200)
    straight = ((row - profile.value) / profile.standard_error) ** 2
    ax.plot(row, straight, color=BEFORE, linestyle="--", linewidth=1.2, label="standard error alone")
    if values.size > 1:
        inside = row[(row >= values[0]) & (row <= values[-1])]
        ax.plot(inside, PchipInterpolator(values, root)(inside) ** 2, color=AFTER, label="profile likelihood")
    ax.plot(values, root**2, "o", color=AFTER, markersize=3.5)
    ax.axhline(limit, color=MEASURED, linewidth=0.8, linestyle=":")
    ax.set_ylim(0.0, 1.5 * limit)
    ax.set_xlabel(f"{parameter_label(profile.name)} [{typeset_unit(profile.unit)}]")
    ax.set_ylabel("rise of χ² [standard errors squared]")
    entitle(ax, f"{parameter_label(profile.name)}: all other coefficients fitted anew at each value")
    return figure


def plot_posterior(posterior: Posterior, name: str = "", *, ax: Axes | None = None) -> Figure:
    """Draw the posterior of a coefficient as a histogram, and beside it the normal law of the fit.

    Args:
        posterior: the draws.
        name: of the coefficient, or its symbol; the first if omitted.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if no coefficient has the name.
    """
    known = [one.name for one in posterior.coefficients]
    symbols = [one.symbol for one in posterior.coefficients]
    if name and name not in (*known, *symbols):
        raise ValueError(f"Argument `name` must be one of {', '.join(known)}, but is {name!r}.")
    place = 0 if not name else known.index(name) if name in known else symbols.index(name)
    one, drawn = posterior.coefficients[place], posterior.pooled[:, place]
    figure, ax = axes_for(ax, 6.4, 3.2)
    low, high = posterior.interval[:, place]
    ax.axvspan(low, high, color=BAND, zorder=0, label=f"{posterior.confidence:.0%} interval")
    ax.hist(drawn, bins="auto", density=True, histtype="step", color=AFTER, label="draws")
    row = np.linspace(drawn.min(), drawn.max(), 200)
    ax.plot(
        row,
        norm.pdf(row, one.value, one.standard_error),
        color=BEFORE,
        linestyle="--",
        linewidth=1.2,
        label="value and standard error of the fit",
    )
    ax.set_xlabel(f"{parameter_label(one.name)} [{typeset_unit(one.unit)}]")
    ax.set_ylabel("density [1 / unit]")
    entitle(ax, f"posterior of {parameter_label(one.name)}")
    return figure
