"""Which attractor each initial state leads to."""

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._types import check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, State, as_isolator
from ..orbit import ascending, integrator_for, period_map, recorded_sine
from ._stroboscope import Repetition, Watch, bounded_or_not, repeats_after, settle_down

_SAME_ATTRACTOR = 1000.0
"""Distance over the tolerance of a repetition up to which two settled motions are one: a motion that repeats
to the tolerance, but creeps, lies further from its end than one period moves it."""


@shown
class BasinsOfAttraction(eqx.Module):
    """The attractor to which each initial state leads.

    Attributes:
        displacements: at t = 0 [m].
        velocities: at t = 0 [m/s].
        index: place of the attractor in `periods` and `attractors`; -1 where the motion left every bound.
        periods: drive periods after which each attractor repeats, that of the largest basin first; 0, and
            last, for all motions that repeat after none up to the bound.
        attractors: states of each once a period, from the largest displacement on; NaN past its period.
        result: whether each motion stayed bounded.
    """

    displacements: Float[Array, " displacement"]
    velocities: Float[Array, " velocity"]
    index: Int[Array, "displacement velocity"]
    periods: Int[Array, " attractor"]
    attractors: Float[Array, "attractor sample state"]
    result: RESULTS

    @property
    def shares(self) -> Float[Array, " attractor"]:
        """Share of the initial states that each attractor draws."""
        places = jnp.arange(self.periods.size)
        return jnp.mean(self.index.ravel()[None] == places[:, None], axis=1)

    def _headline(self) -> str:
        index, periods = np.asarray(self.index), np.asarray(self.periods)
        shares = ", ".join(
            f"period {period} draws {100.0 * float(np.mean(index == place)):.3g} %"
            for place, period in enumerate(periods)
        )
        return f"{periods.size} attractors on {index.shape[0]} × {index.shape[1]} initial states: {shares}"


def basins_of_attraction(
    model: Isolator,
    excitation: Harmonic,
    displacements: Any,
    velocities: Any,
    *,
    settle: int = 100,
    most: int = 2000,
    longest: int = 8,
    tolerance: float = 1e-6,
    integrator: Integrator | None = None,
) -> BasinsOfAttraction:
    """Give the attractor to which each initial state leads, internal states from zero.

    All motions go side by side until each repeats, has left every bound, or the periods are used up. Motions
    that end in the same points, whichever of them comes first, share an attractor.

    Args:
        model: the isolator.
        excitation: the drive.
        displacements: ascending, at t = 0 [m].
        velocities: ascending, at t = 0 [m/s].
        settle: drive periods between two looks at whether all have settled.
        most: drive periods after which the rest count as never repeating.
        longest: longest period that is distinguished from none.
        tolerance: largest distance between a sample and its repetition, as a share of the motion; attractors
            nearer than a thousand times this count as one.
        integrator: solver and steps.

    Returns:
        The basins.

    Raises:
        ValueError: if a list is empty or does not ascend, or a count is not positive.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Thompson & Stewart 2002, Nonlinear Dynamics and Chaos, sec. 7.3.
    """
    model = as_isolator(model)
    check_float64()
    settle = given_count("settle", settle)
    most = given_count("most", most)
    longest = given_count("longest", longest)
    integrator = integrator_for(model, integrator)
    places = ascending("displacements", displacements, positive=False)
    speeds = ascending("velocities", velocities, positive=False)
    x, v = (grid.ravel() for grid in np.meshgrid(places, speeds, indexing="ij"))
    state = (jnp.asarray(x), jnp.asarray(v), *(jnp.zeros(x.size),) * model.internal_states)
    looks = math.ceil(most / (settle + 2 * longest))
    repetition = Repetition(longest, tolerance)
    settled = _settled(model, excitation, Watch(integrator, settle, 2 * longest), state, looks, repetition)
    samples, period = (np.asarray(value) for value in settled)
    omega = 2.0 * math.pi * float(excitation.frequency)
    index, periods, attractors = _sorted(samples, period, omega, _SAME_ATTRACTOR * tolerance)
    shape = (len(places), len(speeds))
    return BasinsOfAttraction(
        jnp.asarray(places),
        jnp.asarray(speeds),
        jnp.asarray(index.reshape(shape)),
        jnp.asarray(periods),
        jnp.asarray(attractors),
        bounded_or_not(jnp.asarray((index >= 0).reshape(shape))),
    )


@quick_jit
def _settled(
    model: Isolator, excitation: Harmonic, how: Watch, state: State, looks: int, repetition: Repetition
) -> tuple[Float[Array, "sample lane state"], Int[Array, " lane"]]:
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)

    def sample(here: State, _: None) -> tuple[State, State]:
        moved = period_map(model, how.integrator, drive, here)
        return moved, moved

    def look(carry: tuple[Array, State, Array, Array]) -> tuple[Array, State, Array, Array]:
        count, here, _, _ = carry
        here = settle_down(model, how.integrator, drive, here, how.settle)
        here, seen = jax.lax.scan(sample, here, length=how.periods)
        period = repeats_after(seen[0], seen[1], drive.angular_frequency, repetition)
        return count + 1, here, jnp.stack(seen, axis=-1), period

    def unsettled(carry: tuple[Array, State, Array, Array]) -> Array:
        count, here, _, period = carry
        moving = (period == 0) & jnp.all(jnp.isfinite(jnp.stack(here)), axis=0)
        return (count < looks) & jnp.any(moving)

    lanes, states = state[0].size, len(state)
    blank = jnp.zeros((how.periods, lanes, states))
    begin = (jnp.array(0), state, blank, jnp.zeros(lanes, dtype=int))
    _, _, samples, period = jax.lax.while_loop(unsettled, look, begin)
    return samples[repetition.longest :], period


def _sorted(
    samples: Float[np.ndarray, "sample lane state"],
    period: Int[np.ndarray, " lane"],
    angular_frequency: float,
    near: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give the attractor of each motion, and of each attractor its period and states."""
    longest, lanes, states = samples.shape
    finite = np.isfinite(samples).all(axis=(0, 2))
    plane = samples[..., :2] / np.array([1.0, angular_frequency])
    size = np.hypot(*np.moveaxis(plane, -1, 0)).max(axis=0)
    group = np.full(lanes, -1)
    first: list[int] = []
    waiting = finite & (period > 0)
    while waiting.any():
        lane = int(np.argmax(waiting))
        steps = int(period[lane])
        gap = plane[-1, :, None] - plane[-steps:, lane][None]
        distance = np.hypot(gap[..., 0], gap[..., 1]).min(axis=1)
        own = waiting & (period == steps) & (distance <= near * np.maximum(size, size[lane]))
        own[lane] = True
        group[own] = len(first)
        first.append(lane)
        waiting &= ~own
    counts = np.bincount(group[group >= 0], minlength=len(first))
    order = np.argsort(-counts, kind="stable")
    rank = np.argsort(order)
    index = np.where(group >= 0, rank[group] if len(first) else -1, -1)
    chosen = [first[place] for place in order]
    if (finite & (period == 0)).any():
        index[finite & (period == 0)] = len(chosen)
        chosen.append(int(np.argmax(finite & (period == 0))))
    attractors = np.full((len(chosen), longest, states), np.nan)
    for place, lane in enumerate(chosen):
        kept = int(period[lane]) or longest
        points = samples[-kept:, lane]
        attractors[place, :kept] = np.roll(points, -int(np.argmax(points[:, 0])), axis=0)
    return index, period[chosen].astype(int), attractors
