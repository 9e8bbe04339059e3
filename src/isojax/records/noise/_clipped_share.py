"""Samples that stand at an end of the range of their converter."""

import numpy as np
from jaxtyping import Float

_EXTREME = 0.02
"""Share of the range, or so many steps of the converter, in which samples near an end are counted ..."""

_LEVELS = 8
_CLIPPED = 0.5
"""... of which more than this share stands at the end itself where a channel clips; a sine has less."""

_FEWEST_CLIPPED = 6


def clipped_share(samples: Float[np.ndarray, " time"]) -> float:
    """Gives the share of samples that stand at an end of the range because the channel clips.

    Of the samples near an end, most are then exactly there. Of a sine only a few are, however coarse the
    steps of the converter. An end at which a channel rests most of the time is no
    clipping.

    Args:
        samples: Finite values, in any unit.
    """
    levels = np.unique(samples)
    if levels.size < 2 * _LEVELS:
        return 0.0
    near = max(_EXTREME * float(levels[-1] - levels[0]), _LEVELS * float(np.min(np.diff(levels))))
    share = 0.0
    for end in (levels[0], levels[-1]):
        at = int(np.count_nonzero(samples == end))
        around = int(np.count_nonzero(np.abs(samples - end) <= near))
        if at >= _FEWEST_CLIPPED and at > _CLIPPED * around and end != np.median(samples):
            share += at / samples.size
    return share
