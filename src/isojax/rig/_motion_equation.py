"""The force balance of a plant as functions of time and state, for the integrator and for whole records."""

from typing import Any, no_type_check

import numpy as np

from ._law import Switch, displacement, velocity
from ._plant import Plant


class EquationOfMotion:
    """Force balance of one plant.

    The state is (x, v, internal states of the first law that has any, of the second, ...). The sides are one
    sign per switch: those of the first law, of the second, ... Where a law moves the floor, x is the motion
    relative to it.

    Args:
        plant: the plant.
    """

    def __init__(self, plant: Plant) -> None:
        self.mass = plant.moving_mass
        self.order = 2
        self.holding = (sum(law.holding[0] for law in plant.laws), sum(law.holding[1] for law in plant.laws))
        self._friction = []
        self._laws: list[tuple[Any, slice, slice]] = []
        self.watches: list[tuple[Switch, slice, list[int]]] = []
        self.sides = 0
        self._floors = [law.floor for law in plant.laws if law.moves_floor]
        self._speeds: list[int] = []
        for law in plant.laws:
            states = slice(self.order, self.order + law.inner)
            sides = slice(self.sides, self.sides + len(law.switches))
            for switch in law.switches:
                self._watch(switch, states)
            self._speeds += [self.order + place for place in law.speeds]
            self.order += law.inner
            self._laws.append((law, states, sides))
            self._friction.append(law.holding != (0.0, 0.0))
        self._plain = [(law.force, sides) for law, states, sides in self._laws if not law.inner]
        self._inner = [(law.force, law.rate, states, sides) for law, states, sides in self._laws if law.inner]

    def _watch(self, switch: Switch, states: slice) -> None:
        """Give one more side to a switch; the two that all laws share are watched once."""
        shared = [
            watch for watch in self.watches if watch[0] is switch and switch in (displacement, velocity)
        ]
        if shared:
            shared[0][2].append(self.sides)
        else:
            self.watches.append((switch, states, [self.sides]))
        self.sides += 1

    @property
    def sticks(self) -> bool:
        """Whether any law can hold the plant at rest."""
        return self.holding != (0.0, 0.0)

    @no_type_check
    def rates(self, t, y, push, sides):
        """Rates of the state while sliding, under the force `push` at the instant `t`."""
        x, v = y[0], y[1]
        net = push
        for force, own in self._plain:
            net = net - force(t, x, v, (), sides[own])
        inner = ()
        for force, rate, states, own in self._inner:
            z, s = y[states], sides[own]
            net = net - force(t, x, v, z, s)
            inner += rate(t, x, v, z, s)
        if not self._floors:
            return v, net / self.mass, *inner
        ground, rates = self.ground(t), [v, net / self.mass, *inner]
        for place in (1, *self._speeds):
            rates[place] = rates[place] - ground
        return tuple(rates)

    @no_type_check
    def ground(self, t):
        """Acceleration of the floor, m/s^2."""
        return sum((floor(t) for floor in self._floors), 0.0)

    @no_type_check
    def rates_stuck(self, t, y, push, sides):
        """Rates of the state while stuck: the internal states go on relaxing."""
        rates = [0.0, 0.0]
        for _, rate, states, own in self._inner:
            rates += rate(t, y[0], 0.0, y[states], sides[own])
        if self._floors:
            ground = self.ground(t)
            for place in self._speeds:
                rates[place] = rates[place] - ground
        return tuple(rates)

    @no_type_check
    def net_at_rest(self, t, y, push, sides):
        """Force that friction must hold if the plant is to stay at rest, N; floats or arrays."""
        net = push - self.mass * self.ground(t) if self._floors else push
        for (law, states, own), friction in zip(self._laws, self._friction, strict=True):
            if not friction:
                net = net - law.force(t, y[0], 0.0, y[states], sides[own])
        return net

    @no_type_check
    def acceleration(self, t, y, push, sides, stuck):
        """Absolute acceleration (time,), m/s^2.

        Args:
            t: instants, s.
            y: states (state, time).
            push: force (time,), N.
            sides: (switch, time).
            stuck: (time,).
        """
        return self.ground(t) + np.where(stuck, 0.0, self.rates(t, y, push, sides)[1])
