"""How far a curve that may fold back lies from another, point by point along the normal of that."""

import numpy as np
from jaxtyping import Float

_WINDOW = 8
"""Points to either side among which the place is sought where a shifted curve crosses a normal."""


def shifts_across(
    here: Float[np.ndarray, "2 ... point"],
    moved: Float[np.ndarray, "curve 2 ... point"],
    normal: Float[np.ndarray, "2 ... point"],
) -> Float[np.ndarray, "curve ... point"]:
    """Give where curves cross the normals of one.

    Args:
        here: points of the one, scaled to its extent.
        moved: those of the others: each point near that of the one.
        normal: unit vectors across the one.

    Returns:
        The distance along each normal; NaN where a curve does not cross it nearby. At the ends of a curve
        that of its own end.
    """
    count = here.shape[-1]
    near = np.clip(np.arange(count)[:, None] + np.arange(-_WINDOW, _WINDOW + 1), 0, count - 1)
    away = moved[..., near] - here[None, ..., None]
    forward = np.sum(np.stack([normal[1], -normal[0]])[None, ..., None] * away, axis=1)
    aside = np.sum(normal[None, ..., None] * away, axis=1)
    before, after = forward[..., :-1], forward[..., 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        crosses = (before <= 0.0) & (after > 0.0)
        share = -before / (after - before)
    place = np.where(crosses, np.abs(np.arange(2 * _WINDOW) + 0.5 - _WINDOW), np.inf)
    best = np.argmin(place, axis=-1)[..., None]
    left, right, share = (
        np.take_along_axis(one, best, axis=-1)[..., 0] for one in (aside[..., :-1], aside[..., 1:], share)
    )
    last = np.zeros(count, bool)
    last[[0, -1]] = True
    own = np.where(last, aside[..., _WINDOW], np.nan)
    with np.errstate(invalid="ignore"):
        return np.where(crosses.any(axis=-1), left + share * (right - left), own)
