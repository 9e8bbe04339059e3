"""The isolators and drives along one parameter, or over a plane of two, and where their motion ends."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._parameters import find_parameter, list_parameters, replace_parameters
from ..._show import shown
from ..._types import Lanes, on_device
from ...models import Isolator
from ..orbit import PeriodicDrive, ShootingMethod, is_held, period_map, recorded_sine

_ALL_BUT_HELD = 1e-3
"""Excess of the drive over what frees a mass, as a share of its amplitude, up to which the mass counts as
held: it then moves for some hundredths of the period, and its multipliers go to one with the excess."""

_DRIVE = ("amplitude", "frequency")
"""Names of the parameters of the drive, in the order of `ParameterFamily.of_drive`."""

_STILL = 1e-6
"""Velocity over its size up to which a mass that friction can hold counts as held."""


def family_of(
    model: Isolator,
    drive: tuple[Lanes, Lanes],
    ends: tuple[Float[Array, " parameter"], Float[Array, " parameter"]],
    names: tuple[str, ...],
) -> "ParameterFamily":
    """Give the family along named parameters.

    Args:
        model: the isolator.
        drive: F0 and f [Hz] where they are no parameters.
        ends: value of each parameter at shares 0 and 1.
        names: "amplitude", "frequency" or a coefficient by its name in reports.

    Returns:
        The family.
    """
    of_drive = np.array([[name == part for part in _DRIVE] for name in names])
    coefficients = tuple("" if name in _DRIVE else name for name in names)
    return ParameterFamily(model, *drive, *ends, on_device(of_drive), coefficients)


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
    def drive(self) -> PeriodicDrive:
        """The drive that acts."""
        return recorded_sine(self.model, self.amplitude, self.frequency)


@shown
class ParameterFamily(eqx.Module):
    """Isolators and drives over a range of one or two parameters.

    Attributes:
        model: the isolator.
        amplitude: F0 where it is no parameter.
        frequency: f [Hz] where it is no parameter.
        start: value of each parameter at share 0.
        stop: value of each parameter at share 1.
        of_drive: whether each parameter is F0, and whether it is f: numbers and no names, so that what is
            compiled for the one serves the other.
        coefficients: name in reports of each parameter that is a coefficient; "" of one of the drive.
    """

    model: Isolator
    amplitude: Lanes
    frequency: Lanes
    start: Float[Array, " parameter"]
    stop: Float[Array, " parameter"]
    of_drive: Bool[Array, "parameter 2"]
    coefficients: tuple[str, ...] = eqx.field(static=True)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter: "amplitude", "frequency" or a coefficient's in reports."""
        found = zip(self.coefficients, np.asarray(self.of_drive), strict=True)
        return tuple(name or _DRIVE[int(np.argmax(own))] for name, own in found)

    def driven(self, amplitude: Lanes, frequency: Lanes) -> "ParameterFamily":
        """Give the same isolators under another drive.

        Args:
            amplitude: F0 [N, or m/s^2 for base excitation].
            frequency: f [Hz].

        Returns:
            The family.
        """
        return eqx.tree_at(lambda one: (one.amplitude, one.frequency), self, (amplitude, frequency))

    def shares(self, values: Float[Array, " parameter"]) -> Float[Array, " parameter"]:
        """Give parameters as shares of their ranges, the inverse of `values`."""
        return (values - self.start) / (self.stop - self.start)

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
        drive = self.amplitude, self.frequency
        numbers = [entry.value for entry in list_parameters(self.model)]
        found = zip(self.coefficients, self.of_drive, self.values(shares), strict=True)
        for name, own, value in found:
            if name:
                numbers[find_parameter(self.model, name)] = value
            else:
                drive = tuple(jnp.where(is_it, value, part) for is_it, part in zip(own, drive, strict=True))
        return Setting(replace_parameters(self.model, numbers), *drive)

    def is_held(
        self, velocity: Float[Array, ""], shares: Float[Array, " parameter"], speed: Float[Array, ""]
    ) -> Bool[Array, ""]:
        """Say whether a closed motion is none of its own because dry friction holds the mass throughout.

        Args:
            velocity: at t = 0.
            shares: parameters.
            speed: size of the velocity.

        Returns:
            Whether it does.
        """
        if not self.model.slides:
            return jnp.array(False)
        there = self.at(shares)
        return is_held(there.model, there.drive, _ALL_BUT_HELD) & (jnp.abs(velocity) <= _STILL * speed)

    def image(
        self,
        method: ShootingMethod,
        scale: Float[Array, " state"],
        scaled: Float[Array, " state"],
        shares: Float[Array, " parameter"],
    ) -> Float[Array, " state"]:
        """Give the state after the turns of the method by fixed steps, in scaled units.

        Args:
            method: how the orbits are closed.
            scale: size of each state.
            scaled: state at t = 0 over `scale`.
            shares: parameters.

        Returns:
            The state then, over `scale`.
        """
        there, begin = self.at(shares), tuple(scaled * scale)
        moved = period_map(there.model, method.integrator, there.drive, begin, turns=method.turns)
        return jnp.stack(moved) / scale

    def open_end(
        self, method: ShootingMethod, scale: Float[Array, " state"], unknown: Float[Array, " unknown"]
    ) -> Float[Array, " state"]:
        """Give how far a motion misses its own start, in scaled units.

        Args:
            method: how the orbits are closed.
            scale: size of each state.
            unknown: scaled state at t = 0, then the shares of the parameters.

        Returns:
            Zero for a periodic orbit.
        """
        states = scale.shape[0]
        return self.image(method, scale, unknown[:states], unknown[states:]) - unknown[:states]
