"""The isolators and drives along one parameter, or over a plane of two, and where their motion ends."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._parameters import find_parameter, list_parameters, replace_parameters
from ..._types import Lanes
from ...models import Integrator, Isolator
from ..orbit import Sine, period_map, recorded_sine


class Setting(NamedTuple):
    """One isolator under one drive.

    Attributes:
        model: the isolator.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
    """

    model: Isolator
    amplitude: Lanes
    frequency: Lanes

    @property
    def drive(self) -> Sine:
        """The drive that acts."""
        return recorded_sine(self.model, self.amplitude, self.frequency)


class Family(eqx.Module):
    """Isolators and drives over a range of one or two parameters.

    Attributes:
        model: the isolator.
        amplitude: F0 where it is no parameter.
        frequency: f [Hz] where it is no parameter.
        start: value of each parameter at share 0.
        stop: value of each parameter at share 1.
        names: "amplitude", "frequency" or a coefficient by its name in reports.
    """

    model: Isolator
    amplitude: Lanes
    frequency: Lanes
    start: Float[Array, " parameter"]
    stop: Float[Array, " parameter"]
    names: tuple[str, ...] = eqx.field(static=True)

    def values(self, shares: Float[Array, " parameter"]) -> Float[Array, " parameter"]:
        """Give the parameters.

        Args:
            shares: zero at `start`, one at `stop`.

        Returns:
            Their values [SI].
        """
        return self.start + shares * (self.stop - self.start)

    def at(self, shares: Float[Array, " parameter"]) -> Setting:
        """Give the isolator and its drive.

        Args:
            shares: zero at `start`, one at `stop`.

        Returns:
            Both.
        """
        found = dict(zip(self.names, self.values(shares), strict=True))
        amplitude, frequency = found.pop("amplitude", self.amplitude), found.pop("frequency", self.frequency)
        numbers = [entry.value for entry in list_parameters(self.model)]
        for name, value in found.items():
            numbers[find_parameter(self.model, name)] = value
        return Setting(replace_parameters(self.model, numbers), amplitude, frequency)

    def image(
        self,
        integrator: Integrator,
        turns: float,
        scale: Float[Array, " state"],
        scaled: Float[Array, " state"],
        shares: Float[Array, " parameter"],
    ) -> Float[Array, " state"]:
        """Give the state after `turns` periods by fixed steps, in scaled units.

        Args:
            integrator: steps and solver.
            turns: drive periods; 0.5 for minus the state after half of one.
            scale: size of each state.
            scaled: state at t = 0 over `scale`.
            shares: parameters.

        Returns:
            The state then, over `scale`.
        """
        setting = self.at(shares)
        moved = period_map(setting.model, integrator, setting.drive, tuple(scaled * scale), turns=turns)
        return jnp.stack(moved) / scale
