"""Random-phase multisine."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._types import Lanes, Scalar, as_float64
from ._excitation import AbstractExcitation


class Multisine(AbstractExcitation):
    """A sum of sines of equal amplitude on a frequency grid, with given phases.

    Attributes:
        amplitude: amplitude of each line [N, or m/s^2 for base excitation].
        frequencies: lines [Hz].
        phases: phase of each line at t = 0 [rad].

    Source: Pintelon & Schoukens 2012, System Identification, sec. 5.2.
    """

    amplitude: Scalar = eqx.field(converter=as_float64)
    frequencies: Float[Array, " frequency"] = eqx.field(converter=lambda f: jnp.asarray(f, dtype=float))
    phases: Float[Array, " frequency"] = eqx.field(converter=lambda p: jnp.asarray(p, dtype=float))

    def __call__(self, t: Lanes) -> Lanes:
        t = jnp.asarray(t, dtype=float)
        lines = (1,) * t.ndim + (-1,)
        angles = 2.0 * jnp.pi * t[..., None] * jnp.reshape(self.frequencies, lines)
        return self.amplitude * jnp.sum(jnp.sin(angles + jnp.reshape(self.phases, lines)), axis=-1)


def random_phase_multisine(
    amplitude: float, period: float, lowest: float, highest: float, *, odd: bool, seed: int
) -> Multisine:
    """Give a multisine with uniformly random phases.

    Args:
        amplitude: amplitude of each line [N, or m/s^2 for base excitation].
        period: period of the signal [s].
        lowest: lowest line [Hz].
        highest: highest line [Hz].
        odd: only odd multiples of the fundamental, so that even distortion shows between the lines.
        seed: of the phases.

    Returns:
        The multisine.

    Raises:
        ValueError: if no line falls between `lowest` and `highest`.
    """
    orders = np.arange(1, int(np.floor(highest * period + 1e-9)) + 1)
    orders = orders[(orders >= lowest * period - 1e-9) & ((orders % 2 == 1) | (not odd))]
    if orders.size == 0:
        raise ValueError(
            f"Arguments `lowest` and `highest` must enclose a multiple of 1/period = {1 / period:.6g} Hz, "
            f"but are {lowest} and {highest} Hz."
        )
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, orders.size)
    return Multisine(as_float64(amplitude), jnp.asarray(orders / period), jnp.asarray(phases))
