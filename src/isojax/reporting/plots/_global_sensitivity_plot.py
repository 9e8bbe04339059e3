"""Which share of the variance of a quantity each input causes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...inference import GlobalSensitivity
from ._style import AFTER, MEASURED, NEUTRAL, axes_for, entitle, parameter_label

_HEIGHT = 0.36
"""Height of a bar, over the distance of two inputs."""


def plot_global_sensitivity(
    sensitivity: GlobalSensitivity, *, index: tuple[int, ...] | int = (), ax: Axes | None = None
) -> Figure:
    """Draw first and total index of each input with their intervals, the largest total on top.

    Args:
        sensitivity: the indices.
        index: which entry of the quantity, where that is an array.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if `index` does not lead to one number.
    """
    entry = index if isinstance(index, tuple) else (index,)
    if len(entry) != sensitivity.variance.ndim:
        raise ValueError(
            f"Argument `index` must lead to one number of the quantity, but is {index} for shape "
            f"{sensitivity.variance.shape}."
        )
    pick = (slice(None), *entry)
    total = sensitivity.total[pick]
    order = np.argsort(-total, kind="stable")
    figure, ax = axes_for(ax, 6.4, 1.4 + 0.42 * max(2, order.size))
    rows = np.arange(order.size)
    for values, interval, colour, shift, label in (
        (sensitivity.first, sensitivity.first_interval, AFTER, -0.5, "alone (first index)"),
        (sensitivity.total, sensitivity.total_interval, NEUTRAL, 0.5, "with interactions (total index)"),
    ):
        own = values[pick][order]
        low, high = (interval[end][pick][order] for end in (0, 1))
        ax.barh(rows + shift * _HEIGHT, own, height=_HEIGHT, color=colour, label=label)
        # The median of the resamples, and so an end, may lie on the other side of the estimate.
        whiskers = np.maximum(np.stack([own - low, high - own]), 0.0)
        ax.errorbar(
            own,
            rows + shift * _HEIGHT,
            xerr=whiskers,
            fmt="none",
            ecolor=MEASURED,
            capsize=2.0,
            linewidth=0.9,
        )
    ax.axvline(0.0, color=MEASURED, linewidth=0.8)
    ax.set_yticks(rows, [parameter_label(sensitivity.inputs[place]) for place in order])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    ax.set_xlabel("share of the variance of the quantity [1]")
    entitle(ax, f"Sobol indices with {100 * sensitivity.confidence:.0f} % intervals")
    return figure
