"""Spikes: single samples far from what their neighbours say, as a lost bit or a bad contact makes them."""

import numpy as np
from jaxtyping import Float, Int

_PATTERN = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0
"""Fourth difference: a sample less the cubic through two neighbours on either side. Its answer to a spike is
itself."""

_BLOCK = 256
"""Samples over which the scatter about such cubics is compared: that of a sweep changes on its way."""

_STANDARD_ERRORS = 10.0
"""Scatters that a spike stands out by; noise and a sine never do."""

_LIKENESS = 0.985
"""Correlation with the answer to a spike; that to a step has 0.935, that to a kink 0.976."""

_MOST = 5e-3
"""Share of the samples above which they are no outliers but how the signal is."""


def find_spikes(
    signal: Float[np.ndarray, " time"],
) -> tuple[Int[np.ndarray, " spike"], Float[np.ndarray, " spike"]]:
    """Gives the samples that stand alone, and by how much.

    A spike stands out of the median scatter of its surroundings, and the fourth difference around it looks as
    that of a single sample. A jump of the signal or of its slope, such as that of a dry friction, does not.

    Args:
        signal: Of one channel.

    Returns:
        Places of the samples, and their distances from the cubic through their neighbours [unit of the
        signal]; none where more than 0.5 % of the samples would be spikes.
    """
    nothing = np.zeros(0, dtype=int), np.zeros(0)
    if signal.size < 2 * _PATTERN.size:
        return nothing
    bend = np.convolve(signal, _PATTERN, mode="same")
    # The ends have no neighbours on one side.
    bend[:2], bend[-2:] = 0.0, 0.0
    size = np.abs(bend)
    blocks = -(-size.size // _BLOCK)
    padded = np.pad(size, (0, blocks * _BLOCK - size.size), constant_values=np.nan)
    # Where the converter's steps are coarse, or a drive stands still, most samples have no scatter at all.
    least = np.median(size[size > 0.0]) if np.any(size > 0.0) else 0.0
    scatter = np.maximum(np.nanmedian(padded.reshape(blocks, _BLOCK), axis=1), least) / 0.6745
    scatter = np.repeat(scatter, _BLOCK)[: size.size]
    largest = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])
    far = 1 + np.flatnonzero(largest & (size[1:-1] > _STANDARD_ERRORS * scatter[1:-1]))
    far = far[(far >= 4) & (far < signal.size - 4)]
    around = bend[far[:, None] + np.arange(-2, 3)]
    length = np.linalg.norm(around, axis=1)
    alike = np.abs(around @ _PATTERN) > _LIKENESS * np.linalg.norm(_PATTERN) * np.maximum(length, 1e-300)
    places = far[alike]
    return nothing if places.size > _MOST * signal.size else (places, bend[places])


def without_spikes(signal: Float[np.ndarray, " time"]) -> tuple[Float[np.ndarray, " time"], int]:
    """Gives a signal whose spikes are replaced by the cubic through two neighbours on either side.

    Args:
        signal: Of one channel.

    Returns:
        The signal, and how many samples were replaced.
    """
    places, sizes = find_spikes(signal)
    clean = signal.copy()
    clean[places] -= sizes
    return clean, places.size
