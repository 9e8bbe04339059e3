"""Where an absent effect acts on a known motion: its internal states follow, and six inputs say what it adds.

Nothing here knows the model that made the motion. A kind of effect is therefore compiled once, whatever it
rides along with.
"""

from collections.abc import Callable
from typing import ClassVar, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._types import Internal, Lanes, Scalar
from ...elements import AbstractElement, Channels, Scales
from ...models import RK4, State
from ._families import ElementFamily, follow_motion

_HOOKS: dict[str, tuple[str, ...]] = {
    "recorded": ("shift", "skew", "channel_drive"),
    "acted": ("drive",),
    "force": ("force", "channel_force", "dependence"),
    "mass": ("inertia",),
    "base": ("channel_base",),
    "read": ("reading", "channel_reading"),
}
"""The methods by which an element may act at each input."""

EFFECT_INPUTS = tuple(_HOOKS)
"""Drive before the model's own instruments change it, and after; restoring force; moving mass; acceleration
of the base; reading after the sensor chain."""


class Perturbation(AbstractElement):
    """A little of everything that an element may do, to see what the model makes of it.

    Attributes:
        acted: added to the drive that acted.
        opposing: added to the restoring force [N].
        mass: added to the moving mass [kg].
        base: added to the acceleration of the base [m/s^2].
        read: added to the reading.
    """

    name: ClassVar[str] = "perturbation"
    words: ClassVar[str] = "a little of everything"
    strength: ClassVar[str] = "opposing"
    channels: ClassVar[tuple[str, ...]] = ("perturbation",)

    acted: Scalar
    opposing: Scalar
    mass: Scalar
    base: Scalar
    read: Scalar

    @classmethod
    def guess(cls, scales: Scales) -> "Perturbation":
        return cls(0.0, 0.0, 0.0, 0.0, 0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.opposing + 0.0 * x

    def inertia(self) -> Lanes | float:
        return self.mass

    def drive(self, u: Lanes, u_rate: Lanes) -> tuple[Lanes, Lanes]:
        return u + self.acted, u_rate

    def channel_base(self, channels: Channels) -> Lanes | None:
        return jnp.asarray(self.base)

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return y + self.read


class PathMotion(NamedTuple):
    """What an absent effect may see of a motion, at each sample.

    Attributes:
        x: displacement [m].
        v: velocity [m/s].
        recorded_rate: rate of the recorded drive.
        acted: drive that acted.
        acted_rate: its rate.
        sensed: reading after the sensor chain, before what signals of the record add to it.
        stages: displacement, velocity, reading and, where it moves, acceleration of the base at start, middle
            and end of each sample, which internal states follow.
        channels: signals of the record.
    """

    x: Float[Array, "time lanes"]
    v: Float[Array, "time lanes"]
    recorded_rate: Float[Array, "time lanes"]
    acted: Float[Array, "time lanes"]
    acted_rate: Float[Array, "time lanes"]
    sensed: Float[Array, "time lanes"]
    stages: tuple[Float[Array, "time 3 lanes"], ...]
    channels: dict[str, Float[Array, "time lanes"]]


def inputs_of(kind: type[AbstractElement]) -> tuple[str, ...]:
    """Name the effect inputs at which a kind of effect acts.

    Args:
        kind: the class of the element.

    Returns:
        Some of `EFFECT_INPUTS`.
    """
    return tuple(
        inlet
        for inlet in EFFECT_INPUTS
        if any(getattr(kind, hook) is not getattr(AbstractElement, hook) for hook in _HOOKS[inlet])
    )


def input_columns(
    family: ElementFamily, motion: PathMotion, start: State, step: Scalar
) -> dict[str, Float[Array, "member time lanes"]]:
    """Give what a unit of strength adds at each effect input, along a motion.

    Args:
        family: the effects, of one kind and at zero strength.
        motion: the motion, with the channels that the kind follows.
        start: its internal states at the first step, members first.
        step: time between the instants of the motion [s].

    Returns:
        The changes, by effect input.
    """
    internal: State = ()
    if start:
        internal = internal_state_path(family.elements, motion.stages, start, step)[1]
    return _input_columns(family.elements, motion._replace(stages=()), internal)


@quick_jit
def internal_state_path(
    members: AbstractElement, stages: tuple[Float[Array, "time 3 lanes"], ...], start: State, step: Scalar
) -> tuple[State, State]:
    """Integrate the internal states of effects of one kind along a motion.

    Args:
        members: the effects, their numbers stacked.
        stages: see `Motion`.
        start: internal states at the first step, members first.
        step: duration of a step [s].

    Returns:
        The states after the last step; and at the start of each step, time first.
    """
    solver = RK4()

    def field(t: float, state: State, table: tuple[Array, ...]) -> State:
        x, v, y, *base = (values[round(2.0 * t)] for values in table)

        def rate(element: AbstractElement, s: State) -> State:
            return follow_motion(element, x, v, y, base[0] if base else None, s)

        return tuple(step * value for value in jax.vmap(rate)(members, state))

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(state: State, table: tuple[Array, ...]) -> tuple[State, State]:
        moved, *_ = solver.step(term, 0.0, 1.0, state, table, None, False)
        return moved, state

    return jax.lax.scan(body, start, stages)


def _or_nothing(value: Lanes | None) -> Lanes | float:
    return 0.0 if value is None else value


@quick_jit
def _input_columns(
    members: AbstractElement, motion: PathMotion, internal: State
) -> dict[str, Float[Array, "member time lanes"]]:
    """Differentiate what each member does at each effect input with respect to its strength."""
    strengths = getattr(members, members.strength)
    still = jnp.zeros_like(motion.x)

    def at_inputs(element: AbstractElement, s: State) -> dict[str, Lanes]:
        does: dict[str, Callable[[], Lanes | float]] = {
            # The drive as recorded, shifted: a delay and a skew take their rates from it.
            "recorded": lambda: (
                element.channel_drive(motion.channels)
                - (element.shift() + element.skew() * motion.channels.get("elapsed", 0.0))
                * motion.recorded_rate
            ),
            "acted": lambda: element.drive(motion.acted, motion.acted_rate)[0],
            "force": lambda: (
                element.force(motion.x, motion.v, s)
                + element.channel_force(motion.x, motion.v, motion.channels)
            ),
            "mass": element.inertia,
            "base": lambda: _or_nothing(element.channel_base(motion.channels)),
            "read": lambda: element.reading(motion.sensed, s) + element.channel_reading(motion.channels),
        }
        return {inlet: still + does[inlet]() for inlet in inputs_of(type(members))}

    def by_strength(element: AbstractElement, strength: Array, s: State) -> dict[str, Array]:
        def with_strength(number: Array) -> dict[str, Lanes]:
            return at_inputs(eqx.tree_at(lambda e: getattr(e, e.strength), element, number), s)

        return jax.jvp(with_strength, (strength,), (jnp.ones(()),))[1]

    # Along the motion the members of a kind come after time.
    own = tuple(jnp.moveaxis(values, 1, 0) for values in internal)
    return jax.vmap(by_strength)(members, strengths, own)
