"""Channels whose samples were taken at uneven times, on the even grid nearest to these."""

import numpy as np
import scipy
from jaxtyping import Float

_DEGREE = 7
"""Degree of the spline: a higher one amplifies noise where times lie far apart, a lower one errs more."""


def on_even_grid(
    time: Float[np.ndarray, " time"], rate: float, *channels: Float[np.ndarray, " time"]
) -> tuple[int, tuple[Float[np.ndarray, " even"], ...]]:
    """Gives channels at the times of an even grid, by the spline through their samples.

    The grid has the mean phase of the times, and no time before the first or after the last of them. Where
    times are drawn evenly from 45 % of a step to either side, a sine is off, by rms over its own, by 1e-5 at
    a tenth of the rate, 2e-3 at a fifth and 1 % at a quarter; white noise grows by up to a half.

    Args:
        time: When the samples were taken [s].
        rate: Of the grid [Hz].
        channels: Their values.

    Returns:
        Number of the sample to which the first one of the grid belongs; the channels.
    """
    place = (time - time[0]) * rate
    place -= np.mean(place - np.arange(time.size))
    first = max(int(np.ceil(place[0])), 0)
    grid = np.arange(first, int(np.floor(place[-1])) + 1)
    splines = (scipy.interpolate.make_interp_spline(place, channel, k=_DEGREE) for channel in channels)
    return first, tuple(np.asarray(spline(grid)) for spline in splines)
