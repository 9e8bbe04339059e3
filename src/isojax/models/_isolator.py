"""The isolator: a mass and the effects that act on it."""

from typing import Literal, cast

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._given_numbers import refuse_not_positive
from .._parameters import (
    Parameter,
    element_names,
    find_parameter,
    list_parameters,
    parameter,
    replace_named,
)
from .._show import Row, amount, listed, shown
from .._types import Lanes, Scalar
from ..elements import AbstractElement, AddedHarmonic, Channels
from ._conditions import followed_conditions, plain_elements
from ._instant import Instant
from ._laws import (
    ROUNDED,
    AbstractLaw,
    State,
    evaluate_corners,
    find_switches,
    share_internal,
)

Quantity = Literal["acceleration", "velocity", "displacement"]


@shown
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

    Example:
        >>> elements = (ij.elements.LinearStiffness(1e6), ij.elements.LinearDamping(4e3))
        >>> model = ij.Isolator(800.0, elements)
        >>> [entry.name for entry in model.parameters]
        ['mass', 'linear_stiffness.coefficient', 'linear_damping.coefficient']
        >>> float(model["linear_damping.coefficient"])
        4000.0
    """

    mass: Scalar = parameter(symbol="m", unit="kg", lower=0.0, fitted=False)
    # A type checker reads `parameter(...)` as a default and misses one here.
    elements: tuple[AbstractElement, ...] = eqx.field(converter=tuple)  # pyright: ignore[reportGeneralTypeIssues]
    excitation: Literal["force", "base_acceleration"] = eqx.field(static=True, default="force")

    def __check_init__(self):
        """Refuse what is no isolator; traced numbers pass unseen."""
        if self.excitation not in ("force", "base_acceleration"):
            raise ValueError(
                f'Argument `excitation` must be "force" or "base_acceleration", but is {self.excitation!r}.'
            )
        for place, entry in enumerate(self.elements):
            if not isinstance(entry, AbstractElement):
                raise ValueError(
                    f"Argument `elements` must hold elements, but elements[{place}] = {entry!r}."
                )
            # The rounding of a kink, and the pressure or temperature that others are compared with.
            for divisor in ("width", "reference"):
                refuse_not_positive(f"{entry.name}.{divisor}", getattr(entry, divisor, 1.0))
        refuse_not_positive("mass", self.mass)

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
            ValueError: if there is no such parameter, it is given twice, or its number is not admissible.
        """
        changed = replace_named(self, [name.replace("__", ".") for name in values], values.values())
        return Isolator(changed.mass, changed.elements, changed.excitation)  # refuses a mass of zero

    def element(self, name: str) -> AbstractElement | None:
        """Give the first element of a catalogue name, or None if the model lacks the effect.

        Args:
            name: catalogue name.
        """
        return next((element for element in self.elements if element.name == name), None)

    def with_elements(self, *added: AbstractElement) -> "Isolator":
        """Give the isolator with further effects, in place of those that they contain.

        Args:
            *added: elements to append.

        Returns:
            The new isolator.

        Raises:
            ValueError: if something given is no element, such as the name of one.
        """
        gone = {name for element in added for name in getattr(element, "absorbs", ())}
        kept = tuple(element for element in self.elements if element.name not in gone)
        return Isolator(self.mass, (*kept, *added), self.excitation)

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the operating conditions that some coefficient follows, such as "pressure"."""
        return followed_conditions(self.elements)

    def at(self, **conditions: Scalar | float) -> "Isolator":
        """Give the isolator at operating conditions: what follows them goes into plain coefficients.

        Args:
            **conditions: pressure [Pa] and temperature [K], absolute; every one that a coefficient follows.

        Returns:
            The isolator without effects that follow a condition, for orbits, maps and simulation.

        Raises:
            ValueError: if a condition is missing, is not positive, is far from a law's reference, or turns
                the sign of a linear spring or damper; if a shape of an effect lies outside its bounds.

        Example:
            >>> chamber = ij.elements.PressureStiffness(change=8e5, reference=2e5)
            >>> elements = (ij.elements.LinearStiffness(1e6), ij.elements.LinearDamping(4e3), chamber)
            >>> model = ij.Isolator(800.0, elements).at(pressure=2.5e5)
            >>> float(model["linear_stiffness.coefficient"]), len(model.elements)
            (1200000.0, 2)
        """
        return Isolator(self.mass, plain_elements(self.elements, conditions), self.excitation)

    def _following(self, channels: Channels) -> tuple[AbstractElement, ...]:
        """List the elements that follow signals of the record, where there is one."""
        return tuple(element for element in self.elements if element.channels) if channels else ()

    def shift(self, elapsed: Lanes | float | None = None) -> Lanes | float:
        """Give the time by which the recorded drive leads the one that acted [s].

        Args:
            elapsed: time since the start of the record [s]; none where there is no record.
        """
        shift = sum((element.shift() for element in self.elements), start=cast("Lanes | float", 0.0))
        return shift if elapsed is None else shift + self.skew() * elapsed

    @property
    def harmonics(self) -> tuple[AddedHarmonic, ...]:
        """The harmonics that act beside a recorded sine, of all elements."""
        return tuple(one for element in self.elements for one in element.harmonics())

    def with_delay_slope(self, at: Instant) -> Instant:
        """Give what acted at an instant its derivative with respect to the delay.

        Args:
            at: from a table that already holds the drive at the delayed times.

        Returns:
            The same numbers, with the derivative.
        """
        delay = self.shift(at.channels.get("elapsed", 0.0))
        return at.delayed(delay - jax.lax.stop_gradient(delay))

    def skew(self) -> Lanes | float:
        """Give the rate at which `shift` grows with the time since the start of the record [1]."""
        return sum((element.skew() for element in self.elements), start=cast("Lanes | float", 0.0))

    def drive(self, at: Instant) -> tuple[Lanes, Lanes]:
        """Give the drive that acted, and its rate.

        Args:
            at: what was recorded at the instant.

        Returns:
            The drive that acted [N, or m/s^2 for base excitation] and its time derivative.
        """
        u, rate = at.drive, jnp.asarray(at.drive_rate, dtype=float)
        for element in self._following(at.channels):
            u = u + element.channel_drive(at.channels)
        for element in self.elements:
            u, rate = element.drive(u, rate)
        return u, rate

    def base(self, at: Instant) -> Lanes | None:
        """Give the acceleration of what the coordinate moves with.

        Args:
            at: what acts at the instant.

        Returns:
            Acceleration of the base, or of the floor [m/s^2]; None where it stands still.
        """
        total = self.drive(at)[0] if self.excitation == "base_acceleration" else None
        for element in self._following(at.channels):
            moved = element.channel_base(at.channels)
            if moved is not None:
                total = moved if total is None else total + moved
        return total

    def switches(self, state: State) -> State:
        """Give the functions at whose zeros some law, unrounded, jumps or bends; orbits are split there.

        Args:
            state: displacement, velocity and internal states.

        Returns:
            One value a switch.
        """
        return find_switches(self.elements, state).values

    def corners(self, state: State) -> State:
        """Give the functions at whose zeros some law, unrounded, has a corner.

        Args:
            state: displacement, velocity and internal states.

        Returns:
            One value a corner, those of each element in turn.
        """
        return tuple(one for own in evaluate_corners(self.elements, state) for one in own)

    def restoring_force(self, state: State, law: AbstractLaw = ROUNDED) -> Lanes:
        """Give the sum of element forces.

        Args:
            state: displacement, velocity and internal states.
            law: which law is meant where one jumps or bends: `RoundedLaw`, the smooth `ContinuedLaw` of given
                sides, or the sharp one of a `Regime`.

        Returns:
            Force on the left-hand side of the balance [N].

        Raises:
            ValueError: if the state is no tuple.
        """
        if not isinstance(state, tuple | list):
            raise ValueError(f"Argument `state` must be a tuple (x, v), not of type {type(state).__name__}.")
        return sum(law.forces(self.elements, state), start=0.0 * state[0])

    def acceleration(self, state: State, at: Instant, law: AbstractLaw = ROUNDED) -> Lanes:
        """Give the acceleration of the coordinate.

        Args:
            state: displacement, velocity and internal states.
            at: what acts at the instant.
            law: see `restoring_force`.

        Returns:
            Acceleration [m/s^2]; relative to a base or floor that moves.
        """
        inertia = self.mass
        for element in self.elements:
            inertia = inertia + element.inertia()
        force = self.restoring_force(state, law)
        for element in self._following(at.channels):
            force = force + element.channel_force(state[0], state[1], at.channels)
        drive = 0.0 if self.excitation == "base_acceleration" else self.drive(at)[0]
        base = self.base(at)
        absolute = (drive - force) / inertia
        return law.acceleration(absolute if base is None else absolute - base)

    def motion(self, state: State, at: Instant, quantity: Quantity, law: AbstractLaw = ROUNDED) -> Lanes:
        """Give the motion at the sensor.

        Args:
            state: displacement, velocity and internal states.
            at: what acts at the instant.
            quantity: what the sensor measures.
            law: see `restoring_force`.

        Returns:
            Acceleration [m/s^2], absolute; velocity [m/s] or displacement [m], relative to a base or floor
            that moves.
        """
        if quantity == "displacement":
            return state[0]
        if quantity == "velocity":
            return state[1]
        acceleration, base = self.acceleration(state, at, law), self.base(at)
        return acceleration if base is None else acceleration + base

    def sensed(self, state: State, at: Instant, quantity: Quantity, law: AbstractLaw = ROUNDED) -> Lanes:
        """Give the reading before what signals of the record add to it: see `reading`."""
        y = self.motion(state, at, quantity, law)
        for element, internal in zip(self.elements, share_internal(self.elements, state), strict=True):
            y = element.reading(y, internal)
        return y

    def reading(self, state: State, at: Instant, quantity: Quantity, law: AbstractLaw = ROUNDED) -> Lanes:
        """Give what the sensor chain records.

        Args:
            state: displacement, velocity and internal states.
            at: what acts at the instant.
            quantity: what the sensor measures.
            law: see `restoring_force`.

        Returns:
            The reading [SI unit of the quantity].
        """
        y = self.sensed(state, at, quantity, law)
        for element in self._following(at.channels):
            y = y + element.channel_reading(at.channels)
        return y

    def rates(
        self, state: State, at: Instant, quantity: Quantity = "acceleration", law: AbstractLaw = ROUNDED
    ) -> State:
        """Give the time derivative of the state.

        Args:
            state: displacement, velocity and internal states.
            at: what acts at the instant.
            quantity: what the sensor measures; an instrument with internal states follows it, as changed by
                the instruments before.
            law: see `restoring_force`.

        Returns:
            One rate a state.
        """
        internal_rates: list[Lanes] = []
        if self.internal_states:
            y, base = self.motion(state, at, quantity, law), self.base(at)
            shares = share_internal(self.elements, state)
            own_rates = law.state_rates(self.elements, state)
            for element, internal, rates in zip(self.elements, shares, own_rates, strict=True):
                if base is not None:
                    moved = element.base_rate(base, internal)
                    rates = tuple(a + b for a, b in zip(rates, moved, strict=True))
                sensed = element.reading_rate(y, internal)
                internal_rates.extend(a + b for a, b in zip(rates, sensed, strict=True))
                y = element.reading(y, internal)
        return (state[1], self.acceleration(state, at, law), *internal_rates)

    def _headline(self) -> str:
        driven = "its base" if self.excitation == "base_acceleration" else "a force"
        return f"{amount(self.mass, 'kg')} driven by {driven}, with {listed(element_names(self), 20)}"

    def _rows(self) -> list[Row]:
        return [Row(one.name, amount(one.value, one.spec.unit), one.spec.symbol) for one in self.parameters]
