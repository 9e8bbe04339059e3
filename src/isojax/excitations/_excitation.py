"""The contract of an excitation: a drive at any time."""

import abc
import math

import equinox as eqx
import jax
import jax.numpy as jnp

from .._show import declared_numbers, shown
from .._types import Lanes, Scalar


@shown
class AbstractExcitation(eqx.Module):
    """A drive [N, or m/s^2 for base excitation] as a function of time [s]."""

    @abc.abstractmethod
    def __call__(self, t: Lanes) -> Lanes:
        """Give the drive.

        Args:
            t: time [s], any shape.

        Returns:
            The drive, same shape.
        """

    def rate(self, t: Lanes) -> Lanes:
        """Give the time derivative of the drive.

        Args:
            t: time [s], any shape.

        Returns:
            The derivative, same shape.
        """
        t = jnp.asarray(t, dtype=float)
        return jax.jvp(self.__call__, (t,), (jnp.ones_like(t),))[1]

    def harmonic(self, t: Lanes, order: Lanes, phase: Lanes) -> Lanes:
        """Give a harmonic of the drive, `A cos(n theta + phi)` where the drive is the sine `A cos(theta)`.

        Args:
            t: time [s], any shape.
            order: n.
            phase: phi [rad].

        Returns:
            The harmonic, same shape; zero where the drive is no sine.
        """
        return 0.0 * t

    def _headline(self) -> str:
        return f"drive with {declared_numbers(self) or 'tabulated values'}"


class AbstractSine(AbstractExcitation):
    """`amplitude sin(angle(t))`.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
    """

    amplitude: eqx.AbstractVar[Scalar]

    @abc.abstractmethod
    def angle(self, t: Lanes) -> Lanes:
        """Give the angle of the sine.

        Args:
            t: time [s], any shape.

        Returns:
            The angle [rad], same shape.
        """

    def __call__(self, t: Lanes) -> Lanes:
        return self.amplitude * jnp.sin(self.angle(t))

    def harmonic(self, t: Lanes, order: Lanes, phase: Lanes) -> Lanes:
        lag = jnp.where(self.amplitude < 0.0, -0.5 * math.pi, 0.5 * math.pi)
        return jnp.abs(self.amplitude) * jnp.cos(order * (self.angle(t) - lag) + phase)
