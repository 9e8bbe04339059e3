"""The contract of an excitation: a drive at any time."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp

from .._show import declared_numbers, shown
from .._types import Lanes


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

    def _headline(self) -> str:
        return f"drive with {declared_numbers(self) or 'tabulated values'}"
