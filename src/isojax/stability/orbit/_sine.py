"""The sine that drives an orbit, in quadratures, so that a delay of the recorded drive is a turn of phase."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._types import Lanes, as_float64
from ...models import Instant, Isolator


class Sine(NamedTuple):
    """`sine sin(tau) + cosine cos(tau)`, tau = 2 pi frequency t.

    Attributes:
        sine: [N, or m/s^2 for base excitation].
        cosine: in the same unit.
        frequency: f [Hz].
    """

    sine: Lanes
    cosine: Lanes | float
    frequency: Lanes

    @property
    def angular_frequency(self) -> Lanes:
        """[rad/s]."""
        return 2.0 * math.pi * self.frequency

    def at(self, sine: Lanes, cosine: Lanes) -> Instant:
        """Give what acts at a phase.

        Args:
            sine: sin(tau).
            cosine: cos(tau).

        Returns:
            The drive and its time derivative.
        """
        drive = self.sine * sine + self.cosine * cosine
        return Instant(drive, self.angular_frequency * (self.sine * cosine - self.cosine * sine))


def recorded_sine(model: Isolator, amplitude: Lanes | float, frequency: Lanes | float) -> Sine:
    """Give the drive that acts where `amplitude sin(2 pi frequency t)` is recorded.

    Args:
        model: the isolator, whose delay shifts the drive.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].

    Returns:
        The drive; without a cosine part where the model has no delay.
    """
    shift = model.shift()
    amplitude, frequency = as_float64(amplitude), as_float64(frequency)
    if isinstance(shift, float) and shift == 0.0:
        return Sine(amplitude, 0.0, frequency)
    phase = 2.0 * math.pi * frequency * shift
    return Sine(amplitude * jnp.cos(phase), -amplitude * jnp.sin(phase), frequency)


def stage_table(steps: int, turns: float) -> tuple[Float[np.ndarray, "time 3"], Float[np.ndarray, "time 3"]]:
    """Give sine and cosine at the stages of fixed steps: the same for every frequency in time scaled by it.

    Args:
        steps: steps a period.
        turns: periods, a half at least.

    Returns:
        sin and cos at the start, middle and end of each step.
    """
    count = round(steps * turns)
    phase = 2.0 * np.pi / steps * (np.arange(count)[:, None] + np.array([0.0, 0.5, 1.0]))
    return np.sin(phase), np.cos(phase)
