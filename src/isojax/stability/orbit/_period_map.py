"""The period map: the state one drive period later, by fixed steps."""

import jax
import jax.numpy as jnp

from ..._types import Lanes
from ...models import Integrator, Isolator, State, advance
from ._sine import Sine, stage_table


def period_map(
    model: Isolator, integrator: Integrator, drive: Sine, state: State, *, turns: float = 1.0
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
    model: Isolator, integrator: Integrator, drive: Sine, state: State, *, turns: float = 1.0
) -> State:
    """Give the states along the motion.

    Args:
        model: the isolator.
        integrator: steps a period and solver.
        drive: the drive that acts.
        state: state at t = 0.
        turns: periods.

    Returns:
        Each state at the start of each step and at the end of the last, time first.
    """
    end, path = _advance(model, integrator, drive, state, turns, keep=True)
    return tuple(jnp.concatenate([along, last[None]]) for along, last in zip(path, end, strict=True))


def _advance(
    model: Isolator, integrator: Integrator, drive: Sine, state: State, turns: float, keep: bool
) -> tuple[State, State]:
    steps = integrator.steps_a_period(model)
    step_time = 1.0 / (steps * drive.frequency)
    tables = tuple(jnp.asarray(table) for table in stage_table(steps, turns))

    def body(carry: State, table: tuple[Lanes, ...]) -> tuple[State, State]:
        sines, cosines = table
        stages = tuple(drive.at(sines[stage], cosines[stage]) for stage in range(3))
        moved = advance(model, integrator.solver, "acceleration", step_time, carry, stages)
        return moved, carry if keep else ()

    return jax.lax.scan(body, state, tables)
