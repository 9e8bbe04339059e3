"""One sine."""

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._excitation import AbstractSine


class Harmonic(AbstractSine):
    """`amplitude sin(2 pi frequency t)`, phase 0 at t = 0.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].

    Example:
        >>> float(ij.Harmonic(amplitude=100.0, frequency=5.0).frequency)
        5.0
    """

    amplitude: Scalar = parameter(symbol="F0", unit="N")
    frequency: Scalar = parameter(symbol="f", unit="Hz", lower=0.0)

    def angle(self, t: Lanes) -> Lanes:
        return 2.0 * jnp.pi * self.frequency * t
