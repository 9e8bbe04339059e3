"""Stepped sine: dwells of constant frequency."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Lanes, Scalar, as_float64
from ._excitation import AbstractSine


class SteppedSine(AbstractSine):
    """Dwells of whole cycles, one frequency after another; the phase runs on through each step.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequencies: frequency of each dwell [Hz], in the order of the test.
        cycles: cycles a dwell.

    Source: the test plan of the paper, sec. 4 (0.1 Hz steps, about 20 cycles each).
    """

    amplitude: Scalar = eqx.field(converter=as_float64)
    frequencies: Float[Array, " frequency"] = eqx.field(converter=lambda f: jnp.asarray(f, dtype=float))
    cycles: Scalar = eqx.field(converter=as_float64)

    @property
    def starts(self) -> Float[Array, " frequency"]:
        """Time at which each dwell starts [s]."""
        lengths = self.cycles / self.frequencies
        return jnp.cumsum(lengths) - lengths

    @property
    def duration(self) -> Scalar:
        """Time at which the last dwell ends [s]."""
        return jnp.sum(self.cycles / self.frequencies)

    def angle(self, t: Lanes) -> Lanes:
        dwell = jnp.clip(jnp.searchsorted(self.starts, t, side="right") - 1, 0, self.frequencies.size - 1)
        return 2.0 * jnp.pi * (self.cycles * dwell + self.frequencies[dwell] * (t - self.starts[dwell]))
