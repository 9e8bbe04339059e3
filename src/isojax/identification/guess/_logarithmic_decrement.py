"""Logarithmic decrement of a free decay."""

import dataclasses
import itertools

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True, eq=False)
class Decrement:
    """What a free decay says.

    Attributes:
        amplitude: size of each half swing, first to last [unit of the response].
        frequency: 1/(2 x duration) of each half swing [Hz].
        natural_frequency: undamped natural frequency [Hz]; NaN with fewer than three half swings.
        damping_ratio: from the slope of log amplitude over the swings [1]; NaN with fewer than three half
            swings.
    """

    amplitude: Float[np.ndarray, " swing"]
    frequency: Float[np.ndarray, " swing"]
    natural_frequency: float
    damping_ratio: float


def logarithmic_decrement(
    response: Float[np.ndarray, " time"], rate: float, floor: float = 0.05
) -> Decrement:
    """Find frequency and damping ratio of a free decay from its half swings.

    With `delta` the fall of log amplitude over a full swing, `zeta = delta/sqrt(4 pi^2 + delta^2)`.

    Args:
        response: free decay about its rest value [m, m/s or m/s^2; the ratio is the same].
        rate: samples a second [Hz].
        floor: half swings smaller than this share of the largest are noise.

    Returns:
        Half swings, natural frequency, damping ratio.

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
    if amplitude.size < 3:
        return Decrement(amplitude, frequency, float("nan"), float("nan"))
    slope = np.polynomial.polynomial.polyfit(np.arange(amplitude.size), np.log(amplitude), 1)[1]
    delta = -2.0 * float(slope)
    damped = 1.0 / float(np.mean(1.0 / frequency))
    ratio = delta / np.hypot(2 * np.pi, delta)
    return Decrement(amplitude, frequency, damped / float(np.sqrt(1.0 - ratio**2)), float(ratio))


def about_rest(output: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Give a free decay about the place where it ends: the mean of its last fifth.

    Args:
        output: the decay.

    Returns:
        The decay less that mean.
    """
    return output - np.mean(output[-max(1, output.size // 5) :])
