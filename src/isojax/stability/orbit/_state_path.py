"""Displacement and velocity of whatever holds states of a motion."""

import equinox as eqx
from jaxtyping import Array, Float


class AbstractStatePath(eqx.Module):
    """States of a motion at instants of it: displacement [m], velocity [m/s], internal states."""

    states: eqx.AbstractVar[Array]

    @property
    def displacement(self) -> Float[Array, "*time"]:
        """[m]."""
        return self.states[..., 0]

    @property
    def velocity(self) -> Float[Array, "*time"]:
        """[m/s]."""
        return self.states[..., 1]
