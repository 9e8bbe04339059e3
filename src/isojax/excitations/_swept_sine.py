"""Swept sine: the frequency runs linearly or logarithmically."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp

from .._types import Lanes, Scalar, as_float64
from ._excitation import AbstractSine


class SweptSine(AbstractSine):
    """A sine whose frequency runs from `start` to `stop` in `duration`.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        start: frequency at t = 0 [Hz].
        stop: frequency at t = duration [Hz].
        duration: length of the sweep [s].
        law: "linear" in time, or "logarithmic", for which `start` and `stop` must differ.

    Raises:
        ValueError: if `law` is neither.

    Source: Farina 2000, AES 108, eq. (11), for the logarithmic phase.
    """

    amplitude: Scalar = eqx.field(converter=as_float64)
    start: Scalar = eqx.field(converter=as_float64)
    stop: Scalar = eqx.field(converter=as_float64)
    duration: Scalar = eqx.field(converter=as_float64)
    law: Literal["linear", "logarithmic"] = eqx.field(static=True, default="linear")

    def __check_init__(self):
        """Refuse an unknown law."""
        if self.law not in ("linear", "logarithmic"):
            raise ValueError(f'Argument `law` must be "linear" or "logarithmic", but is {self.law!r}.')

    def angle(self, t: Lanes) -> Lanes:
        if self.law == "linear":
            cycles = self.start * t + 0.5 * (self.stop - self.start) / self.duration * t**2
        else:
            growth = jnp.log(self.stop / self.start) / self.duration
            cycles = self.start * jnp.expm1(growth * t) / growth
        return 2.0 * jnp.pi * cycles
