"""Logarithmic decrement of a free decay."""

import dataclasses
import itertools

import numpy as np
from jaxtyping import Float

from ..._show import shown

_FEWEST_HALF_CYCLES = 3
"""Half cycles without which no decrement is estimated."""

_LAST_FIFTH = 5
"""The mean of the last fifth of a decay is taken for the position at rest."""


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class Decrement:
    """Amplitude and frequency of a free decay, by half cycle, and its damping ratio.

    Attributes:
        amplitude: amplitude of each half cycle, first to last [unit of the response].
        frequency: 1/(2 x duration) of each half cycle [Hz].
        natural_frequency: undamped natural frequency [Hz]; NaN with fewer than three half cycles.
        damping_ratio: from the slope of log amplitude over the half cycles [1]; NaN with fewer than three.
    """

    amplitude: Float[np.ndarray, " half_cycle"]
    frequency: Float[np.ndarray, " half_cycle"]
    natural_frequency: float
    damping_ratio: float


def logarithmic_decrement(
    response: Float[np.ndarray, " time"], rate: float, floor: float = 0.05
) -> Decrement:
    """Find frequency and damping ratio of a free decay from its half cycles.

    With `delta` the decrease of log amplitude over a full cycle, `zeta = delta/sqrt(4 pi^2 + delta^2)`.

    Args:
        response: free decay about its rest value [m, m/s or m/s^2; the ratio is the same].
        rate: samples a second [Hz].
        floor: half cycles with an amplitude below this share of the largest are noise.

    Returns:
        Half cycles, natural frequency, damping ratio.

    Source: Ewins, Modal Testing, 2nd ed., sec. 1.4; the mean over a quadratic law's amplitudes where it is
    not linear.
    """
    sign = response >= 0
    before = np.flatnonzero(sign[1:] != sign[:-1])
    crossing = (before + response[before] / (response[before] - response[before + 1])) / rate
    amplitude = np.array([np.max(np.abs(response[a + 1 : b + 1])) for a, b in itertools.pairwise(before)])
    frequency = 0.5 / np.diff(crossing)
    if amplitude.size:
        start = int(np.argmax(amplitude))
        small = np.flatnonzero(amplitude[start:] < floor * amplitude[start])
        stop = start + int(small[0]) if small.size else amplitude.size
        amplitude, frequency = amplitude[start:stop], frequency[start:stop]
    if amplitude.size < _FEWEST_HALF_CYCLES:
        return Decrement(amplitude, frequency, float("nan"), float("nan"))
    slope = np.polynomial.polynomial.polyfit(np.arange(amplitude.size), np.log(amplitude), 1)[1]
    delta = -2.0 * float(slope)
    damped = 1.0 / float(np.mean(1.0 / frequency))
    ratio = delta / np.hypot(2 * np.pi, delta)
    return Decrement(amplitude, frequency, damped / float(np.sqrt(1.0 - ratio**2)), float(ratio))


def about_rest(output: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Give a free decay about its position at rest: the mean of its last fifth."""
    return output - np.mean(output[-max(1, output.size // _LAST_FIFTH) :])
