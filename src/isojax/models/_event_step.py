"""One integration step of laws that jump or bend, split at the first event in it."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._types import Lanes
from ._instant import Instant
from ._isolator import Isolator, Quantity
from ._laws import Regime, State

_EVENT_ITERATIONS = 6
"""Safeguarded Newton steps to an event: two make a crossing exact, the others are for near tangents."""

_ROUNDING = 1e-9
"""By how much a share of a step may be off."""


class Step(NamedTuple):
    """An integration step: its length, and what acts during it.

    Attributes:
        length: [s].
        stages: what acts at its start, middle and end.
        push: further rates of the states at the same instants while they are free to move, none if omitted:
            what drives a column of derivatives.
    """

    length: Lanes | float
    stages: tuple[Instant, ...]
    push: tuple[State, ...] = ()


class Jump(NamedTuple):
    """What the reading does at once at an event.

    Attributes:
        share: of the step at which it happens.
        size: by how much the reading jumps there [SI unit of the quantity]; 0 without an event.
    """

    share: Lanes
    size: Lanes


class Ringing(NamedTuple):
    """What the jumps between two samples leave in the readings of these, as a record is band-limited.

    Attributes:
        before: in the reading of the sample before, added to that of the motion there.
        after: likewise of the sample after.
    """

    before: Lanes
    after: Lanes


def find_ringing(jump: Jump, step: Int[Array, "..."] | int, steps: int) -> Ringing:
    """Give what a jump leaves in the readings of the samples around it.

    Between samples a band-limited step is half done at its instant and rings on both sides (Gibbs). Of that
    the nearest sample on each side is kept: `+-(1 - d)(1/2 - 4/5 d)` of the jump at d samples from it. A
    sampled step differs from a band-limited one by 1/pi^2 of its square; this leaves 0.13 of that.

    Args:
        jump: the jump.
        step: number of its step from the sample before on.
        steps: steps a sample.

    Returns:
        The ringing.

    Source: correction of steps in sampled signals, Brandt 2001, Hard sync without aliasing; the polynomial
    stands for 1/2 - Si(pi d)/pi, and ends in zero at d = 1 where that is -0.09.
    """
    place = (step + jump.share) / steps
    return Ringing(
        (1.0 - place) * (0.5 - 0.8 * place) * jump.size, -place * (0.5 - 0.8 * (1.0 - place)) * jump.size
    )


def add_ringing(reading: Array, ringing: Ringing | None) -> Array:
    """Add the ringing of jumps to the readings of a record.

    Args:
        reading: of the motion at each sample, time first.
        ringing: of the jumps after each sample; None of a model without any.

    Returns:
        The band-limited readings.
    """
    if ringing is None:
        return reading
    return reading + ringing.before + jnp.concatenate([jnp.zeros_like(ringing.after[:1]), ringing.after[:-1]])


def find_regime(model: Isolator, state: State, at: Instant) -> Regime:
    """Find the piece of each law on which a motion goes on.

    Args:
        model: the isolator.
        state: displacement, velocity and internal states.
        at: what acts at the instant.

    Returns:
        The regime. A mass at rest slides forward if forward friction lets it accelerate forward, backward
        likewise, and is held otherwise.

    Source: Filippov 1988, Differential Equations with Discontinuous Righthand Sides, sec. 15.
    """
    model, state, at = _frozen((model, state, at))
    corners = tuple(jnp.where(corner < 0.0, -1.0, 1.0) for corner in model.corners(state))
    v = state[1]
    if not model.slides:
        return Regime(jnp.ones_like(v), corners)

    def from_rest() -> Lanes:
        forward, backward = _pushed(model, state, corners, at)
        leaves = jnp.where(forward > 0.0, 1.0, jnp.where(backward < 0.0, -1.0, 0.0))
        return jnp.where(v == 0.0, leaves, jnp.sign(v))

    return Regime(jax.lax.cond(jnp.any(v == 0.0), from_rest, lambda: jnp.sign(v)), corners)


def split_step(model: Isolator, quantity: Quantity, state: State, step: Step) -> tuple[State, Jump]:
    """Advance one step; where a law jumps or bends on the way, two steps that meet there.

    Dense output of the step gives the instant, and carries the derivative of that instant, so that
    derivatives of the path jump there as they must. Of several events in one step the first is met; what
    follows it in the same step is found at the start of the next.

    Args:
        model: the isolator.
        quantity: what the sensor measures.
        state: state at the start of the step.
        step: the step.

    Returns:
        State at its end; what the reading does at once on the way.

    Source: Hairer, Norsett & Wanner 1993, Solving Ordinary Differential Equations I, sec. II.6, for the
    dense output; Aizerman & Gantmakher 1958 for the derivatives.
    """
    regime = find_regime(model, state, step.stages[0])
    # Where it is held nothing is left of a velocity, nor of its derivative.
    state = (state[0], jnp.where(regime.is_held, 0.0, state[1]), *state[2:])
    powers = _dense(_increments(model, quantity, state, step, regime))
    end = _place(state, powers, 1.0)
    sides = (regime.direction, *regime.corners)

    def ahead(model: Isolator, there: State) -> tuple[Lanes, ...]:
        """Give what is positive as long as the piece of each law lasts."""
        values = (there[1], *model.corners(there))
        return tuple(side * value for side, value in zip(sides, values, strict=True))

    # The search has no derivative: the Newton step after it carries that of the root.
    still = _frozen((model, state, powers, end, step))
    passed = [value < 0.0 for value in ahead(still[0], still[3])]
    if model.slides:
        freed, free_at = _freed(regime, *still[:2], *still[3:])
    else:
        passed[0] = jnp.zeros_like(passed[0])
        freed, free_at = jnp.zeros_like(end[1]), jnp.ones_like(end[1])
    split = functools.reduce(jnp.logical_or, passed) | (freed != 0.0)

    def find() -> tuple[Lanes, tuple[Lanes, ...], list[Array], Lanes]:
        still_model, start, still_powers, _, still_step = still

        def along(share: Lanes) -> tuple[Lanes, ...]:
            return ahead(still_model, _place(start, still_powers, share))

        found, hit = free_at, [jnp.zeros_like(one) for one in passed]
        for place, one in enumerate(passed):
            root = _root(lambda share, place=place: along(share)[place], free_at)
            sooner = one & (root < found)
            found = jnp.where(sooner, root, found)
            hit = [other & ~sooner for other in hit]
            hit[place] = sooner
        slopes = jax.jvp(along, (found,), (jnp.ones_like(found),))[1]
        met = _at_rest(_place(start, still_powers, found), hit[0])
        turned = find_regime(still_model, met, _rest(still_step, found).stages[0]).direction
        direction = jnp.where(hit[0], turned, jnp.where(freed != 0.0, freed, regime.direction))
        return found, slopes, hit, direction

    def find_none() -> tuple[Lanes, tuple[Lanes, ...], list[Array], Lanes]:
        return free_at, tuple(jnp.ones_like(free_at) for _ in sides), passed, regime.direction

    # Conditions also keep the compiler from working out the search anew for every derivative.
    any_split = jnp.any(split)
    found, slopes, hit, direction = jax.lax.cond(any_split, find, find_none)

    nothing = jnp.zeros_like(end[1])

    def go_on() -> tuple[State, Jump]:
        share = found
        for one, value, slope in zip(hit, ahead(model, _place(state, powers, found)), slopes, strict=True):
            share = jnp.where(one, share - value / jnp.where(one & (slope != 0.0), slope, 1.0), share)
        met = _at_rest(_place(state, powers, share), hit[0])
        flipped = tuple(jnp.where(one, -side, side) for one, side in zip(hit[1:], sides[1:], strict=True))
        after, rest = Regime(direction, flipped), _rest(step, share)
        second = _place(met, _dense(_increments(model, quantity, met, rest, after)), 1.0)
        size = nothing
        if quantity == "acceleration":
            # Displacement and velocity never jump; breaking loose starts without acceleration.
            def read(side: Regime) -> Lanes:
                seen = model.reading(met, rest.stages[0], quantity, side)
                # What pushes a mass that moves is seen by the accelerometer.
                return seen + jnp.where(side.is_held, 0.0, rest.push[0][1]) if rest.push else seen

            size = jnp.where(functools.reduce(jnp.logical_or, hit), read(after) - read(regime), 0.0)
        moved = tuple(jnp.where(split, two, one) for two, one in zip(second, end, strict=True))
        return moved, Jump(share, size)

    return jax.lax.cond(any_split, go_on, lambda: (end, Jump(nothing, nothing)))


def _frozen(tree: Any) -> Any:
    return jax.tree_util.tree_map(jax.lax.stop_gradient, tree)


def _at_rest(state: State, reversal: Array) -> State:
    """Give the state with a velocity of exactly zero where it reverses."""
    return (state[0], jnp.where(reversal, 0.0, state[1]), *state[2:])


def _freed(regime: Regime, model: Isolator, start: State, end: State, step: Step) -> tuple[Lanes, Lanes]:
    """Find where friction that holds the mass gives way.

    While it holds, what drives the mass beyond it runs nearly straight over a step; one secant step takes
    the bend into account. The motion starts without acceleration, so that an error of the instant is one of
    second order, and its derivative one of first order that is left out.

    Returns:
        The direction in which the mass breaks loose, 0 where it does not; the share of the step at which.
    """
    none = jnp.zeros_like(end[1]), jnp.ones_like(end[1])

    def look() -> tuple[Lanes, Lanes]:
        before = _pushed(model, start, regime.corners, step.stages[0])
        later = _pushed(model, end, regime.corners, step.stages[2])
        ahead, back = regime.is_held & (later[0] > 0.0), regime.is_held & (later[1] < 0.0)
        freed = jnp.where(ahead, 1.0, jnp.where(back, -1.0, 0.0))
        one, two = (jnp.where(ahead, *pair) for pair in (before, later))
        rise = jnp.where(freed != 0.0, two - one, 1.0)
        share = jnp.clip(-one / rise, 0.0, 1.0)
        between = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
        left = model.acceleration(between, _rest(step, share).stages[0], Regime(freed, regime.corners))
        return freed, jnp.where(freed != 0.0, jnp.clip(share - left / rise, 0.0, 1.0), 1.0)

    return jax.lax.cond(jnp.any(regime.is_held), look, lambda: none)


def _root(value: Callable[[Lanes], Lanes], like: Lanes) -> Lanes:
    """Find where a function that is not negative at 0 and negative at 1 crosses zero."""
    low, high = jnp.zeros_like(like), jnp.ones_like(like)
    share = 0.5 * high
    for _ in range(_EVENT_ITERATIONS):
        here, slope = jax.jvp(value, (share,), (jnp.ones_like(share),))
        low, high = jnp.where(here > 0.0, share, low), jnp.where(here > 0.0, high, share)
        newton = share - here / slope
        # A root that is found lies at one end of the bracket, give or take rounding.
        kept = (newton > low - _ROUNDING) & (newton < high + _ROUNDING)
        share = jnp.where(kept, newton, 0.5 * (low + high))
    return share


def _pushed(model: Isolator, state: State, corners: tuple[Lanes, ...], at: Instant) -> tuple[Lanes, Lanes]:
    """Give the accelerations with friction against forward and against backward motion."""
    one = jnp.ones_like(state[1])
    forward, backward = (model.acceleration(state, at, Regime(sign * one, corners)) for sign in (1.0, -1.0))
    return forward, backward


def _increments(
    model: Isolator, quantity: Quantity, state: State, step: Step, regime: Regime
) -> tuple[State, ...]:
    """Give the four increments of a Runge-Kutta step on given sides."""

    def field(stage: int, there: State) -> State:
        rates = model.rates(there, step.stages[stage], quantity, regime)
        if step.push:
            held = (regime.is_held, regime.is_held, *(False,) * model.internal_states)
            pushes = zip(rates, held, step.push[stage], strict=True)
            rates = tuple(rate + jnp.where(stays, 0.0, push) for rate, stays, push in pushes)
        return tuple(step.length * rate for rate in rates)

    def moved(share: float, increment: State) -> State:
        return tuple(one + share * other for one, other in zip(state, increment, strict=True))

    k1 = field(0, state)
    k2 = field(1, moved(0.5, k1))
    k3 = field(1, moved(0.5, k2))
    return k1, k2, k3, field(2, moved(1.0, k3))


def _dense(stages: tuple[State, ...]) -> tuple[State, ...]:
    """Give the coefficients of t, t^2 and t^3 of the step's dense output, of third order inside."""
    powers = [
        (a, b + c - 1.5 * a - 0.5 * d, (a - b - c + d) / 1.5) for a, b, c, d in zip(*stages, strict=True)
    ]
    one, two, three = zip(*powers, strict=True)
    return one, two, three


def _place(state: State, powers: tuple[State, ...], share: Any) -> State:
    """Give the state at a share of the step."""
    return tuple(
        value + share * (a + share * (b + share * c)) for value, a, b, c in zip(state, *powers, strict=True)
    )


def _rest(step: Step, share: Lanes) -> Step:
    """Give the rest of a step that is left at a share of it.

    What acts follows a parabola through the three values of the step: these are the limits from inside, so
    that a drive that jumps from step to step is none the worse for it.
    """

    def along(during: tuple[Any, ...]) -> tuple[Any, ...]:
        def at(place: Lanes) -> Any:
            def curve(start: Lanes, middle: Lanes, end: Lanes) -> Lanes:
                bend = 2.0 * (start - 2.0 * middle + end)
                return start + place * (4.0 * middle - 3.0 * start - end + place * bend)

            return jax.tree_util.tree_map(curve, *during)

        return at(share), at(0.5 * (1.0 + share)), during[2]

    push = along(step.push) if step.push else ()
    return Step((1.0 - share) * step.length, along(step.stages), push)
