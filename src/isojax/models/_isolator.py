"""The isolator: a mass and the effects that act on it."""

from typing import Literal, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from .._parameters import Parameter, find_parameter, list_parameters, parameter, replace_parameters
from .._types import Lanes, Scalar
from ..elements import AbstractElement, Channels
from ._element_states import Regime, State, gather, share_internal, share_sides, sum_forces

Quantity = Literal["acceleration", "velocity", "displacement"]

NO_CHANNELS: Channels = {}
"""No record, no signals of a record: the effects that follow them are absent."""


class Isolator(eqx.Module):
    """One coordinate: `mass x'' + sum of element forces = F(t)`.

    Under base excitation x is the motion relative to the base, the force is -mass times the base
    acceleration, and an acceleration reading is the absolute one.

    Attributes:
        mass: moving mass [kg].
        elements: the effects, in any order; those of the instruments act in the order given.
        excitation: what the recorded drive is.

    Raises:
        ValueError: if the mass is not positive, `elements` holds something else, or `excitation` is neither.

    Source: the paper, eq. (4).
    """

    mass: Scalar = parameter(symbol="m", unit="kg", lower=0.0, fitted=False)
    # A type checker reads `parameter(...)` as a default and misses one here.
    elements: tuple[AbstractElement, ...] = eqx.field(converter=tuple)  # pyright: ignore[reportGeneralTypeIssues]
    excitation: Literal["force", "base_acceleration"] = eqx.field(static=True, default="force")

    def __check_init__(self):
        """Refuse what is no isolator; a traced mass passes unseen."""
        if self.excitation not in ("force", "base_acceleration"):
            raise ValueError(
                f'Argument `excitation` must be "force" or "base_acceleration", but is {self.excitation!r}.'
            )
        for place, entry in enumerate(self.elements):
            if not isinstance(entry, AbstractElement):
                raise ValueError(
                    f"Argument `elements` must hold elements, but elements[{place}] = {entry!r}."
                )
        known = eqx.is_array(self.mass) and not isinstance(self.mass, Tracer)
        if known and not np.all(np.asarray(self.mass) > 0):
            raise ValueError(f"Argument `mass` must be positive, but is {self.mass}.")

    @property
    def internal_states(self) -> int:
        """Count of internal states of all elements."""
        return sum(element.internal_states for element in self.elements)

    @property
    def substeps(self) -> int:
        """Integration steps a sample that the sharpest element asks for."""
        return max((element.substeps for element in self.elements), default=1)

    @property
    def slides(self) -> bool:
        """Whether some law, unrounded, jumps where the velocity changes sign."""
        return any(element.slides for element in self.elements)

    @property
    def splits(self) -> bool:
        """Whether simulated records are split where some law jumps or bends."""
        return any(element.splits for element in self.elements)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Name, declaration and value of every physical number."""
        return list_parameters(self)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the signals of a record that some element follows."""
        return tuple(sorted({name for element in self.elements for name in element.channels}))

    def __getitem__(self, name: str) -> Float[Array, ""]:
        """Give a parameter by its name in reports.

        Args:
            name: such as `cubic_stiffness.coefficient`.

        Returns:
            Its value.

        Raises:
            ValueError: if there is no such parameter.
        """
        return list_parameters(self)[find_parameter(self, name)].value

    def replace(self, **values: Scalar | float) -> "Isolator":
        """Give the same isolator with other numbers.

        Args:
            **values: new values by the name in reports, with `__` for the dot:
                `model.replace(cubic_stiffness__coefficient=2e11)`.

        Returns:
            The new isolator.

        Raises:
            ValueError: if there is no such parameter.
        """
        numbers = [entry.value for entry in list_parameters(self)]
        for name, value in values.items():
            numbers[find_parameter(self, name.replace("__", "."))] = jnp.asarray(value, dtype=float)
        return replace_parameters(self, numbers)

    def element(self, name: str) -> AbstractElement | None:
        """Give the first element of a catalogue name, or None.

        Args:
            name: catalogue name.

        Returns:
            The element, or None if the model lacks the effect.
        """
        return next((element for element in self.elements if element.name == name), None)

    def with_elements(self, *added: AbstractElement) -> "Isolator":
        """Give the isolator with further effects, in place of those that they contain.

        Args:
            *added: elements to append.

        Returns:
            The new isolator.
        """
        gone = {name for element in added for name in element.absorbs}
        kept = tuple(element for element in self.elements if element.name not in gone)
        return Isolator(self.mass, (*kept, *added), self.excitation)

    def _following(self, channels: Channels) -> tuple[AbstractElement, ...]:
        """List the elements that follow signals of the record, where there is one."""
        return tuple(element for element in self.elements if element.channels) if channels else ()

    def shift(self) -> Lanes | float:
        """Give the time by which the recorded drive leads the one that acted [s]."""
        return sum((element.shift() for element in self.elements), start=cast("Lanes | float", 0.0))

    def drive(self, u: Lanes, u_rate: Lanes | float, channels: Channels = NO_CHANNELS) -> Lanes:
        """Give the drive that acted.

        Args:
            u: recorded drive, already shifted [N, or m/s^2 for base excitation].
            u_rate: its time derivative.
            channels: signals of the record, by name; none where there is no record.

        Returns:
            The drive that acted, in the same unit.
        """
        return self.acting(u, u_rate, channels)[0]

    def acting(
        self, u: Lanes, u_rate: Lanes | float, channels: Channels = NO_CHANNELS
    ) -> tuple[Lanes, Lanes]:
        """Give the drive that acted, and its rate.

        Args:
            u: recorded drive, already shifted [N, or m/s^2 for base excitation].
            u_rate: its time derivative.
            channels: see `drive`.

        Returns:
            The drive that acted and its time derivative, in the same unit.
        """
        rate = jnp.asarray(u_rate, dtype=float)
        for element in self._following(channels):
            u = u + element.channel_drive(channels)
        for element in self.elements:
            u, rate = element.drive(u, rate)
        return u, rate

    def base(self, u: Lanes, u_rate: Lanes | float, channels: Channels = NO_CHANNELS) -> Lanes | None:
        """Give the acceleration of what the coordinate moves with.

        Args:
            u: recorded drive, already shifted [N, or m/s^2 for base excitation].
            u_rate: its time derivative.
            channels: see `drive`.

        Returns:
            Acceleration of the base, or of the floor [m/s^2]; None where it stands still.
        """
        total = self.drive(u, u_rate, channels) if self.excitation == "base_acceleration" else None
        for element in self._following(channels):
            moved = element.channel_base(channels)
            if moved is not None:
                total = moved if total is None else total + moved
        return total

    def kinks(self, state: State) -> State:
        """Give the functions at whose zeros some law is not smooth.

        Args:
            state: displacement, velocity and internal states.

        Returns:
            One value a kink, those of each element in turn.
        """
        return gather(self.elements, state, "kinks")

    def corners(self, state: State) -> State:
        """Give the functions at whose zeros some law, unrounded, has a corner.

        Args:
            state: displacement, velocity and internal states.

        Returns:
            One value a corner, those of each element in turn.
        """
        return gather(self.elements, state, "corners")

    def restoring_force(self, state: State, sides: State | Regime | None = None) -> Lanes:
        """Give the sum of element forces [N].

        Args:
            state: displacement, velocity and internal states.
            sides: sign of each of `kinks` whose side is meant, or the regime in which the laws are sharp; the
                rounded laws on the sides of the state itself if omitted.

        Returns:
            Force on the left-hand side of the balance [N].
        """
        return sum_forces(self.elements, state, sides)

    def acceleration(
        self,
        state: State,
        u: Lanes,
        u_rate: Lanes | float = 0.0,
        sides: State | Regime | None = None,
        channels: Channels = NO_CHANNELS,
    ) -> Lanes:
        """Give the acceleration of the coordinate.

        Args:
            state: displacement, velocity and internal states.
            u: recorded drive, already shifted.
            u_rate: its time derivative.
            sides: see `restoring_force`.
            channels: see `drive`.

        Returns:
            Acceleration [m/s^2]; relative to a base or floor that moves.
        """
        inertia = self.mass
        for element in self.elements:
            inertia = inertia + element.inertia()
        force = self.restoring_force(state, sides)
        for element in self._following(channels):
            force = force + element.channel_force(state[0], state[1], channels)
        drive = 0.0 if self.excitation == "base_acceleration" else self.drive(u, u_rate, channels)
        base = self.base(u, u_rate, channels)
        absolute = (drive - force) / inertia
        relative = absolute if base is None else absolute - base
        return jnp.where(sides.is_held, 0.0, relative) if isinstance(sides, Regime) else relative

    def motion(
        self,
        state: State,
        u: Lanes,
        u_rate: Lanes | float,
        quantity: Quantity,
        channels: Channels = NO_CHANNELS,
        sides: Regime | None = None,
    ) -> Lanes:
        """Give the motion at the sensor.

        Args:
            state: displacement, velocity and internal states.
            u: recorded drive, already shifted.
            u_rate: its time derivative.
            quantity: what the sensor measures.
            channels: see `drive`.
            sides: see `restoring_force`.

        Returns:
            Acceleration [m/s^2], absolute; velocity [m/s] or displacement [m], relative to a base or floor
            that moves.
        """
        if quantity == "displacement":
            return state[0]
        if quantity == "velocity":
            return state[1]
        acceleration = self.acceleration(state, u, u_rate, sides, channels)
        base = self.base(u, u_rate, channels)
        return acceleration if base is None else acceleration + base

    def reading(
        self,
        state: State,
        u: Lanes,
        u_rate: Lanes | float,
        quantity: Quantity,
        channels: Channels = NO_CHANNELS,
        sides: Regime | None = None,
    ) -> Lanes:
        """Give what the sensor chain records.

        Args:
            state: displacement, velocity and internal states.
            u: recorded drive, already shifted.
            u_rate: its time derivative.
            quantity: what the sensor measures.
            channels: see `drive`.
            sides: see `restoring_force`.

        Returns:
            The reading [SI unit of the quantity].
        """
        y = self.sensed(state, u, u_rate, quantity, channels, sides)
        for element in self._following(channels):
            y = y + element.channel_reading(channels)
        return y

    def sensed(
        self,
        state: State,
        u: Lanes,
        u_rate: Lanes | float,
        quantity: Quantity,
        channels: Channels = NO_CHANNELS,
        sides: Regime | None = None,
    ) -> Lanes:
        """Give the reading before what signals of the record add to it.

        Args:
            state: displacement, velocity and internal states.
            u: recorded drive, already shifted.
            u_rate: its time derivative.
            quantity: what the sensor measures.
            channels: see `drive`.
            sides: see `restoring_force`.

        Returns:
            The reading [SI unit of the quantity].
        """
        y = self.motion(state, u, u_rate, quantity, channels, sides)
        for element, internal in zip(self.elements, share_internal(self.elements, state), strict=True):
            y = element.reading(y, internal)
        return y

    def rates(
        self,
        state: State,
        u: Lanes,
        u_rate: Lanes | float,
        quantity: Quantity = "acceleration",
        sides: State | Regime | None = None,
        channels: Channels = NO_CHANNELS,
    ) -> State:
        """Give the time derivative of the state.

        Args:
            state: displacement, velocity and internal states.
            u: recorded drive, already shifted.
            u_rate: its time derivative.
            quantity: what the sensor measures; an instrument with memory follows it, as changed by the
                instruments before.
            sides: see `restoring_force`.
            channels: see `drive`.

        Returns:
            One rate a state.
        """
        x, v = state[:2]
        internal_rates: list[Lanes] = []
        if self.internal_states:
            regime = sides if isinstance(sides, Regime) else None
            y = self.motion(state, u, u_rate, quantity, channels, regime)
            base = self.base(u, u_rate, channels)
            kinked = None if sides is None or regime is not None else share_sides(self.elements, state, sides)
            beside = [None] * len(self.elements) if kinked is None else kinked
            shares = share_internal(self.elements, state)
            for element, internal, own in zip(self.elements, shares, beside, strict=True):
                if own is None:
                    law = element.state_rate(x, v, internal)
                else:
                    law = element.state_rate_beside(x, v, internal, own)
                if base is not None:
                    moved = element.base_rate(base, internal)
                    law = tuple(a + b for a, b in zip(law, moved, strict=True))
                sensed = element.reading_rate(y, internal)
                internal_rates.extend(a + b for a, b in zip(law, sensed, strict=True))
                y = element.reading(y, internal)
        return (v, self.acceleration(state, u, u_rate, sides, channels), *internal_rates)
