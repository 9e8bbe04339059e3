"""A motion stepped from event to event: where its laws jump or bend, and the state at the end."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._types import Lanes
from ...models import (
    ContinuedLaw,
    Instant,
    Isolator,
    State,
    find_switches,
    freeing_accelerations,
    law_beside,
    sliding_switch,
)
from ._kink_crossings import Crossings
from ._sine import PeriodicDrive

_PHASE_ROUNDING = 1e-12
"""Share of the size of a switch that it may be off by, and share of a step that an instant may be."""

_ON_A_SAMPLE = 1e-6
"""Share of a step within which a phase counts as that of the next sample."""

_HALVINGS, _NEWTON_STEPS = 6, 3
"""Of a bracket on a cubic, and steps of Newton's method from there; one more, on the motion, follows."""

_AT_ENDS, _TOGETHER = 1e-6, 1e-4
"""Shares of a motion: within which an event counts as lying at its end; by which two events may differ."""

_SHARES = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Shares of a step at which switches are looked at: a cubic goes through them, as the motion is one."""


class EventPath(NamedTuple):
    """A motion and its events.

    Attributes:
        end: state at its end; NaN where it has more events than there is room for.
        crossings: its events.
        path: states at equidistant phases, time first, as far as they were asked for.
    """

    end: State
    crossings: Crossings
    path: Float[Array, "time state"]


class _Walk(NamedTuple):
    phase: Array
    state: State
    sides: Float[Array, " switch"]
    crossings: Crossings
    events: Int[Array, ""]
    at_event: Bool[Array, ""]
    path: Float[Array, "time state"]


@eqx.filter_jit
def follow_events(
    model: Isolator,
    drive: PeriodicDrive,
    state: State,
    end: Lanes | float,
    steps: Int[Array, ""] | int,
    places: int,
    kept: int = 0,
) -> EventPath:
    """Step a motion with the sharp laws; a step in which one jumps or bends ends there.

    Each step is of Runge-Kutta's with four stages. Its dense output gives the first event in it, also where a
    switch is passed and passed back within one step; the derivative of the instant goes along.

    Args:
        model: the isolator.
        drive: the drive that acts.
        state: at phase 0.
        end: last phase [rad].
        steps: steps at least.
        places: events to make room for.
        kept: equidistant phases from 0 to `end` at which to keep the state; one more than `steps`, or 0.

    Returns:
        The motion.

    Source: Hairer, Norsett & Wanner 1993, Solving Ordinary Differential Equations I, sec. II.6 (dense
    output); Filippov 1988, sec. 15 (sticking); Aizerman & Gantmakher 1958 (derivatives).
    """
    state = tuple(jnp.asarray(value, dtype=float) for value in state)
    begin, length = jnp.zeros(()), end / steps
    sides = first_sides(model, drive, state)
    crossings = Crossings(
        jnp.full(places, end),
        jnp.full(places, -1),
        jnp.broadcast_to(sides, (places + 1, sides.size)),
        jnp.array(True),
    )
    path = jnp.zeros((kept, len(state)))
    path = path.at[:1].set(jnp.stack(state))
    walk = _Walk(begin, state, sides, crossings, jnp.asarray(0), jnp.array(False), path)

    def unfinished(walk: _Walk) -> Array:
        # From an event at the end a step of no length leads there, with the derivative of its instant.
        before = (walk.phase < end * (1.0 - _PHASE_ROUNDING)) | walk.at_event
        return before & (walk.events <= places)

    def body(walk: _Walk) -> _Walk:
        number = jnp.floor(jax.lax.stop_gradient(walk.phase) / length + _ON_A_SAMPLE) + 1.0
        target = jnp.minimum(number * length, end)
        ahead = target - walk.phase
        ahead = ahead - jax.lax.stop_gradient(jnp.minimum(ahead, 0.0))
        share, event, moved, after = _step(model, drive, walk.phase, walk.state, walk.sides, ahead)
        phase = jnp.where(event >= 0, walk.phase + share * ahead, target)
        here = (jnp.arange(places) == walk.events) & (event >= 0)
        later = (jnp.arange(places + 1) > walk.events)[:, None] & (event >= 0)
        old, old_sides = walk.crossings, walk.crossings.sides
        assert old_sides is not None
        found = Crossings(
            jnp.where(here, phase, old.phases),
            jnp.where(here, event, old.kinks),
            jnp.where(later, after, old_sides),
            old.complete & ((event < 0) | (walk.events < places)),
        )
        path = walk.path
        if kept:
            # An event that falls on a sample is that sample too: the next step goes to the one after it.
            reached = jnp.floor(jax.lax.stop_gradient(phase) / length + _ON_A_SAMPLE) >= number
            row = jnp.where(reached, number.astype(int), kept)
            path = path.at[row].set(jnp.stack(moved), mode="drop")
        return _Walk(phase, moved, after, found, walk.events + (event >= 0), event >= 0, path)

    last = jax.lax.while_loop(unfinished, body, walk)
    blank = jnp.where(last.crossings.complete, 1.0, jnp.nan)
    return EventPath(tuple(value * blank for value in last.state), last.crossings, last.path * blank)


class _Turn(NamedTuple):
    """A step towards an extreme.

    Attributes:
        phase: at its start [rad].
        state: there.
        sides: of the switches.
        length: as far as the extreme is sought, then up to it [rad].
        found: whether it was found.
    """

    phase: Array
    state: State
    sides: Float[Array, " switch"]
    length: Array
    found: Bool[Array, ""]


def turning_point(
    model: Isolator,
    drive: PeriodicDrive,
    state: State,
    phase: Lanes,
    length: Lanes | float,
    side: Array,
) -> tuple[Array, Bool[Array, ""]]:
    """Give the displacement where the velocity vanishes within a step; its instant follows the parameters.

    The step ends where a law jumps or bends, and another goes on from there.

    Args:
        model: the isolator.
        drive: the drive that acts.
        state: at the start of the step.
        phase: there [rad].
        length: of the step [rad].
        side: 1 if the displacement is largest there, -1 if it is smallest.

    Returns:
        The displacement [m], and whether the velocity does vanish.
    """
    velocity = find_switches(model.elements, state).velocity
    sides, turning = first_sides(model, drive, state, phase), max(velocity, 0)
    if velocity < 0:
        turning = sides.size
    elif not model.slides:
        sides = sides.at[velocity].set(side)

    def towards(_: Array | int, turn: _Turn) -> _Turn:
        share, event, moved, after = _step(model, drive, *turn[:4], side)
        met, ends = ~turn.found & (event == turning), ~turn.found & (event >= 0)
        onward = turn._replace(
            phase=turn.phase + share * turn.length,
            state=moved,
            sides=after,
            length=(1.0 - share) * turn.length,
        )
        there = turn._replace(length=share * turn.length, found=jnp.array(True))
        return jax.tree.map(
            lambda old, reached, passed: jnp.where(met, reached, jnp.where(ends, passed, old)),
            turn,
            there,
            onward,
        )

    begin = tuple(jnp.asarray(value, dtype=float) for value in state)
    first = _Turn(jnp.asarray(phase), begin, sides, jnp.asarray(length), jnp.array(False))
    others = sides.size - (velocity >= 0)
    last = jax.lax.fori_loop(0, 2, towards, first) if others else towards(0, first)
    # The whole step to the instant: the dense output, which finds it, is of one order less.
    time, law = last.length / drive.angular_frequency, law_beside(model, tuple(last.sides))
    acting = tuple(drive.at(drive.waves(last.phase + share * last.length)) for share in (0.0, 0.5, 1.0))
    reached = last.state[0] + sum(_cubic(model, law, last.state, time, acting)[0])
    return reached, last.found & (side * state[1] >= 0.0)


def first_sides(
    model: Isolator, drive: PeriodicDrive, state: State, phase: Lanes | float = 0.0
) -> Float[Array, " switch"]:
    """Give the side of each switch on which a motion begins."""
    values = model.switches(state)
    if not values:
        return jnp.zeros(0)
    sides = jnp.stack([jnp.where(value >= 0.0, 1.0, -1.0) for value in values])
    place = sliding_switch(model)
    if place < 0:
        return sides
    at = drive.at(drive.waves(jnp.asarray(phase)))
    direction = jnp.where(state[1] == 0.0, _leaves(model, state, at, sides), jnp.sign(state[1]))
    return sides.at[place].set(direction)


def _leaves(model: Isolator, state: State, at: Instant, sides: Float[Array, " switch"]) -> Array:
    """Give the direction in which a mass at rest leaves; 0 where friction holds it."""
    forward, backward = freeing_accelerations(model, state, at, tuple(sides))
    return jnp.where(forward > 0.0, 1.0, jnp.where(backward < 0.0, -1.0, 0.0))


@eqx.filter_jit
def _step(
    model: Isolator,
    drive: PeriodicDrive,
    phase: Array,
    start: State,
    sides: Float[Array, " switch"],
    length: Array,
    turning: Array | None = None,
) -> tuple[Array, Int[Array, ""], State, Float[Array, " switch"]]:
    """Give the share of a step at which an event ends it, which one, the state and the sides there.

    With `turning`, the sign that the velocity has at first, its zero is an event also where no law asks for
    it, one beyond the switches.
    """
    place = sliding_switch(model)
    law, time = law_beside(model, tuple(sides)), length / drive.angular_frequency
    if place >= 0:
        # What is held has no velocity, nor a derivative of it.
        start = (start[0], jnp.where(sides[place] == 0.0, 0.0, start[1]), *start[2:])

    def acting(share: Array | float) -> Instant:
        return drive.at(drive.waves(phase + share * length))

    begin, middle, finish = (acting(share) for share in (0.0, 0.5, 1.0))
    powers = _cubic(model, law, start, time, (begin, middle, finish))

    def at(share: Array | float) -> State:
        return tuple(
            value + share * (a + share * (b + share * c))
            for value, (a, b, c) in zip(start, powers, strict=True)
        )

    def ahead(share: Array | float) -> Array:
        """Give what is positive as long as the step keeps to its laws."""
        there = at(share)
        values = jnp.stack(model.switches(there)) if sides.size else jnp.zeros(0)
        values = sides * values
        if turning is not None and find_switches(model.elements, there).velocity < 0:
            return jnp.append(values, turning * there[1])
        if place < 0:
            return values
        held = sides[place] == 0.0
        forward, backward = freeing_accelerations(model, there, acting(share), tuple(sides))
        values = values.at[place].set(jnp.where(held, 1.0, values[place]))
        loose = jnp.where(held, jnp.stack([-forward, backward]), 1.0)
        return jnp.concatenate([values, loose])

    still = jax.lax.stop_gradient(jnp.stack([ahead(share) for share in _SHARES]))
    first, shares = _first_root(still)
    event = jnp.where(jnp.any(shares <= 1.0), first, -1)
    if not still.shape[1]:
        return jnp.ones(()), jnp.asarray(-1), at(1.0), sides
    share = jnp.where(event >= 0, shares[first], 1.0)
    value, slope = jax.jvp(lambda s: ahead(s)[first], (share,), (jnp.ones(()),))
    moved = share - value / jax.lax.stop_gradient(jnp.where(slope == 0.0, 1.0, slope))
    inside = (moved >= -_PHASE_ROUNDING) & (moved <= 1.0 + _PHASE_ROUNDING)
    share = jnp.where(event >= 0, jnp.where(inside, moved, share), 1.0)
    return share, event, *_after(model, acting(share), at(share), sides, event)


def _after(
    model: Isolator, at: Instant, state: State, sides: Float[Array, " switch"], event: Int[Array, ""]
) -> tuple[State, Float[Array, " switch"]]:
    """Give the state at an event, and the sides after it."""
    switches, place = sides.size, sliding_switch(model)
    flipped = jnp.where(jnp.arange(switches) == event, -sides, sides)
    if place < 0:
        return state, flipped
    stops = event == place
    state = (state[0], jnp.where(stops, 0.0, state[1]), *state[2:])
    direction = jnp.where(event == switches, 1.0, jnp.where(event == switches + 1, -1.0, sides[place]))
    direction = jnp.where(stops, _leaves(model, state, at, sides), direction)
    return state, flipped.at[place].set(jax.lax.stop_gradient(direction))


def _cubic(
    model: Isolator, law: ContinuedLaw, state: State, time: Array, stages: tuple
) -> list[tuple[Array, Array, Array]]:
    """Give the coefficients of t, t^2 and t^3 of a step's dense output."""

    def field(stage: int, there: State) -> State:
        return tuple(time * rate for rate in model.rates(there, stages[stage], law=law))

    def moved(share: float, increment: State) -> State:
        return tuple(one + share * other for one, other in zip(state, increment, strict=True))

    k1 = field(0, state)
    k2 = field(1, moved(0.5, k1))
    k3 = field(1, moved(0.5, k2))
    k4 = field(2, moved(1.0, k3))
    return [
        (a, b + c - 1.5 * a - 0.5 * d, (a - b - c + d) / 1.5)
        for a, b, c, d in zip(k1, k2, k3, k4, strict=True)
    ]


def _first_root(values: Float[Array, "4 switch"]) -> tuple[Int[Array, ""], Float[Array, " switch"]]:
    """Find which of several functions falls below zero first, and where each does.

    Args:
        values: at the shares looked at; below zero at the first by rounding alone.

    Returns:
        Which; the share of each, 2 where it does not.
    """
    if not values.shape[1]:
        return jnp.asarray(0), jnp.zeros(0)
    y0, y1, y2, y3 = values
    # The cubic through them: y0 + a s + b s^2 + c s^3.
    a = -5.5 * y0 + 9.0 * y1 - 4.5 * y2 + y3
    b = 9.0 * y0 - 22.5 * y1 + 18.0 * y2 - 4.5 * y3
    c = -4.5 * y0 + 13.5 * y1 - 13.5 * y2 + 4.5 * y3

    def value(s: Array) -> Array:
        return y0 + s * (a + s * (b + s * c))

    # Its least value inside: where the slope a + 2 b s + 3 c s^2 rises through zero.
    root = jnp.sqrt(jnp.maximum(b * b - 3.0 * a * c, 0.0))
    lowest = -a / jnp.where(b + root == 0.0, 1.0, b + root)
    lowest = jnp.where((b * b > 3.0 * a * c) & (lowest > 0.0) & (lowest < 1.0), lowest, 1.0)
    limit = -_PHASE_ROUNDING * jnp.max(jnp.abs(values), axis=0)
    dips, ends = value(lowest) < limit, value(jnp.ones_like(lowest)) < limit
    high = jnp.where(dips, lowest, 1.0)
    low = jnp.zeros_like(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        above = value(middle) >= 0.0
        low, high = jnp.where(above, middle, low), jnp.where(above, high, middle)
    share = 0.5 * (low + high)
    for _ in range(_NEWTON_STEPS):
        slope = a + share * (2.0 * b + 3.0 * share * c)
        share = jnp.clip(share - value(share) / jnp.where(slope == 0.0, 1.0, slope), low, high)
    shares = jnp.where(dips | ends, share, 2.0)
    return jnp.argmin(shares), shares


def same_events(one: Crossings, other: Crossings, end: float) -> Bool[Array, ""]:
    """Say whether two motions pass the same switches; those at the ends of the motion count for nothing.

    Args:
        one: events of one motion.
        other: those of another.
        end: last phase [rad].

    Returns:
        True if each event has one of the same switch next to it.
    """

    def covered(some: Crossings, others: Crossings) -> Array:
        inner = (some.kinks >= 0) & (some.phases > _AT_ENDS * end) & (some.phases < (1.0 - _AT_ENDS) * end)
        near = jnp.abs(some.phases[:, None] - others.phases[None]) <= _TOGETHER * end
        alike = some.kinks[:, None] == others.kinks[None]
        return jnp.all(~inner | jnp.any(near & alike, axis=1))

    return covered(one, other) & covered(other, one) & one.complete & other.complete
