"""The band around a curve that may fold back."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from ...models import CONFIDENCE

_PALE = 0.25

_WORDS = f"{100.0 * CONFIDENCE:g} % band"
"""Its entry of a legend; one stands for all of the axes."""


def draw_band(
    ax: Axes,
    lower: tuple[Float[np.ndarray, " point"], Float[np.ndarray, " point"]],
    upper: tuple[Float[np.ndarray, " point"], Float[np.ndarray, " point"]],
    colour: str,
) -> None:
    """Fill the band around a curve, piece by piece between two points, so that it may fold back.

    The first of the axes is labelled for their legend.

    Args:
        ax: the axes.
        lower: x and y of one end of each point's interval; NaN interrupts it.
        upper: of the other end.
        colour: of the curve.
    """
    ends = np.stack([np.transpose(lower), np.transpose(upper)])
    corners = np.stack([ends[0, :-1], ends[0, 1:], ends[1, 1:], ends[1, :-1]], axis=1)
    whole = corners[np.all(np.isfinite(corners), axis=(1, 2))]
    if not whole.size:
        return
    # One path of all pieces: where they overlap it is no darker.
    pieces = np.concatenate([whole, whole[:, :1]], axis=1)
    path = Path.make_compound_path(*(Path(_turning_left(piece), closed=True) for piece in pieces))
    label = "" if _WORDS in ax.get_legend_handles_labels()[1] else _WORDS
    ax.add_patch(PathPatch(path, facecolor=colour, edgecolor="none", alpha=_PALE, zorder=1, label=label))
    ax.update_datalim(whole.reshape(-1, 2))


def _turning_left(corners: Float[np.ndarray, "5 2"]) -> Float[np.ndarray, "5 2"]:
    """Give a polygon anticlockwise, because pieces that turn either way would cut holes into each other."""
    x, y = corners.T
    return corners if np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) >= 0.0 else corners[::-1]
