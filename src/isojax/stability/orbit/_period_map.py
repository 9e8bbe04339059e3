"""The period map: the state one drive period later, by fixed steps; sharp laws from event to event."""

import math

import jax
import jax.numpy as jnp

from ..._types import Lanes
from ...models import Integrator, Isolator, State, advance
from ._event_path import follow_events
from ._sine import PeriodicDrive, Waves, stage_phases

_EVENTS_A_TURN = 8
"""Events of each switch in a period to make room for, where laws jump or bend."""

_FINER = 4
"""Times the steps with which the path of a single orbit is stepped."""


def period_map(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, state: State, *, turns: float = 1.0
) -> State:
    """Give the state after `turns` drive periods.

    Half a turn gives minus the state, `z -> -phi(T/2)`: of an odd model a symmetric orbit is a fixed point
    of it, at half the work, and its multipliers are the roots of those of the full period.

    Args:
        model: the isolator.
        integrator: steps a period and solver.
        drive: the drive that acts.
        state: displacement [m], velocity [m/s], internal states at t = 0; any leading shape.
        turns: periods; 0.5 for the half-period map.

    Returns:
        The state then.

    Source: Swift & Wiesenfeld 1984, Phys. Rev. Lett. 52:705 (the half-period map).
    """
    end, _ = _advance(model, integrator, drive, state, turns, keep=False)
    return tuple(-value for value in end) if turns == 0.5 else end


def trajectory(
    model: Isolator,
    integrator: Integrator,
    drive: PeriodicDrive,
    state: State,
    *,
    turns: float = 1.0,
    rounded: bool = False,
) -> State:
    """Give the states along the motion.

    Args:
        model: the isolator.
        integrator: steps a period and solver.
        drive: the drive that acts.
        state: state at t = 0.
        turns: periods.
        rounded: whether sharp laws are rounded over their width instead of split at events: a motion that
            begins at a reversal has an event at its start, which no derivative can follow.

    Returns:
        Each state at the start of each step and at the end of the last, time first.
    """
    end, path = _advance(model, integrator, drive, state, turns, keep=True, rounded=rounded)
    return tuple(jnp.concatenate([along, last[None]]) for along, last in zip(path, end, strict=True))


def split_trajectory(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, state: State, turns: float, places: int
) -> State:
    """Give the states along a motion split at its kinks, with steps finer than those at which they are kept.

    Args:
        model: the isolator.
        integrator: steps a period at which states are kept.
        drive: the drive that acts.
        state: state at t = 0.
        turns: periods.
        places: events to make room for.

    Returns:
        As `trajectory`; differentiable forwards alone.
    """
    steps = _FINER * round(integrator.steps_a_period(model) * turns)
    motion = follow_events(model, drive, state, 2.0 * math.pi * turns, steps, places, steps + 1)
    return tuple(motion.path[::_FINER].T)


def _advance(
    model: Isolator,
    integrator: Integrator,
    drive: PeriodicDrive,
    state: State,
    turns: float,
    keep: bool,
    rounded: bool = False,
) -> tuple[State, State]:
    if model.splits and not rounded:
        return _along_events(model, integrator, drive, state, turns, keep)
    steps = integrator.steps_a_period(model)
    step_time = 1.0 / (steps * drive.frequency)
    tables = drive.waves(stage_phases(steps, turns))

    def body(carry: State, table: Waves) -> tuple[State, State]:
        stages = tuple(
            drive.at(tuple((sines[stage], cosines[stage]) for sines, cosines in table)) for stage in range(3)
        )
        moved = advance(model, integrator.solver, "acceleration", step_time, carry, stages)
        return moved, carry if keep else ()

    return jax.lax.scan(body, state, tables)


def _along_events(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, state: State, turns: float, keep: bool
) -> tuple[State, State]:
    """Step the sharp laws from event to event, lane by lane."""
    shape = jnp.broadcast_shapes(*(jnp.shape(value) for value in jax.tree.leaves((state, drive))))
    steps = round(integrator.steps_a_period(model) * turns)
    places = math.ceil(_EVENTS_A_TURN * (len(model.switches(state)) + 2) * turns)

    def one(lane: State, own: PeriodicDrive) -> tuple[State, Lanes]:
        end = 2.0 * math.pi * turns
        motion = follow_events(model, own, lane, end, steps, places, steps + 1 if keep else 0)
        return motion.end, motion.path[:-1]

    lanes, own = jax.tree.map(lambda value: jnp.broadcast_to(value, shape), (state, drive))
    for _ in shape:
        one = jax.vmap(one)
    end, path = one(lanes, own)
    return end, tuple(jnp.moveaxis(path[..., place], -1, 0) for place in range(len(state))) if keep else ()
