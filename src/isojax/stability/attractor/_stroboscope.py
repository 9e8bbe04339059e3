"""The motion seen once a drive period, with the growth of a small disturbance beside it."""

from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..._results import RESULTS
from ..._types import Lanes, as_float64
from ...models import Integrator, Isolator, State
from ..orbit import PeriodicDrive, period_map

_TURNING = 20
"""Periods before the first sample in which a disturbance turns to the direction in which it grows most."""


_RETURNS = 16
"""Periods up to which a motion is compared with itself to see whether it still settles."""

_FALL = 0.95
"""Of its distance from itself over the samples, below which it does: on a torus chance may change it less."""


class Watch(NamedTuple):
    """How long a motion settles and is then watched.

    Attributes:
        integrator: steps a period and solver.
        settle: drive periods before.
        periods: drive periods that are watched.
    """

    integrator: Integrator
    settle: int
    periods: int


class Repetition(NamedTuple):
    """When a motion counts as repeating.

    Attributes:
        longest: drive periods to try.
        tolerance: largest distance between a sample and its repetition, displacement and velocity over the
            angular frequency, as a share of the largest sample.
    """

    longest: int
    tolerance: float


class Watched(NamedTuple):
    """What the stroboscope saw.

    Attributes:
        state: after the last period.
        tangent: a disturbance then, of unit size.
        samples: each state after each period, period first.
        growth: logarithm by which the disturbance grew over each period, period first.
    """

    state: State
    tangent: State
    samples: State
    growth: Lanes


def any_disturbance(state: State) -> State:
    """Give a disturbance that has a share in every direction."""
    return tuple(jnp.ones_like(value) for value in state)


def watch(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, state: State, tangent: State, periods: int
) -> Watched:
    """Watch the motion once a period.

    The disturbance follows the derivative of the period map along the motion and is brought back to unit size
    after each period; velocity counts over the drive's angular frequency.

    Args:
        model: the isolator.
        integrator: steps a period and solver.
        drive: the drive that acts.
        state: at t = 0; any leading shape.
        tangent: disturbance at t = 0, same shapes.
        periods: drive periods.

    Returns:
        What was seen.

    Source: Benettin et al. 1980, Meccanica 15:9 (renormalisation).
    """

    def size(values: State) -> Array:
        place, speed, *inner = values
        square = place**2 + (speed / drive.angular_frequency) ** 2
        return jnp.sqrt(sum((value**2 for value in inner), start=square))

    def body(carry: tuple[State, State], _: None) -> tuple[tuple[State, State], tuple[State, Lanes]]:
        here, disturbed = carry
        moved, turned = jax.jvp(lambda z: period_map(model, integrator, drive, z), (here,), (disturbed,))
        factor = size(turned)
        unit = tuple(value / jnp.where(factor == 0.0, 1.0, factor) for value in turned)
        return (moved, unit), (moved, jnp.log(factor))

    first = size(tangent)
    begin = (state, tuple(value / first for value in tangent))
    (state, tangent), (samples, growth) = jax.lax.scan(body, begin, length=periods)
    return Watched(state, tangent, samples, growth)


def settle_down(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, state: State, periods: int
) -> State:
    """Give the state after some periods.

    Args:
        model: the isolator.
        integrator: steps a period and solver.
        drive: the drive that acts.
        state: at t = 0; any leading shape.
        periods: drive periods.

    Returns:
        The state then.
    """

    def body(here: State, _: None) -> tuple[State, None]:
        return period_map(model, integrator, drive, here), None

    return jax.lax.scan(body, state, length=periods)[0]


def watch_settled(model: Isolator, how: Watch, drive: PeriodicDrive, state: State, tangent: State) -> Watched:
    """Watch the motion once it has settled; a disturbance follows it from shortly before.

    Args:
        model: the isolator.
        how: steps, and how long to settle and to watch.
        drive: the drive that acts.
        state: at t = 0; any leading shape.
        tangent: disturbance, same shapes.

    Returns:
        What was seen.
    """
    turning = min(how.settle, _TURNING)
    state = settle_down(model, how.integrator, drive, state, how.settle - turning)
    before = watch(model, how.integrator, drive, state, tangent, turning)
    return watch(model, how.integrator, drive, before.state, before.tangent, how.periods)


def repeats_after(
    displacement: Float[Array, "sample ..."],
    velocity: Float[Array, "sample ..."],
    angular_frequency: Lanes,
    repetition: Repetition,
) -> Int[Array, "..."]:
    """Give the drive periods after which a motion repeats.

    Args:
        displacement: once a period [m].
        velocity: once a period [m/s].
        angular_frequency: of the drive [rad/s].
        repetition: when it counts as repeating.

    Returns:
        The smallest count of periods; 0 where there is none up to the longest, or the motion is not finite.
    """
    longest, tolerance = repetition
    reduced = velocity / angular_frequency
    size = jnp.max(jnp.hypot(displacement, reduced), axis=0)
    found = jnp.zeros(size.shape, dtype=int)
    for period in range(longest, 0, -1):
        gap = jnp.hypot(displacement[period:] - displacement[:-period], reduced[period:] - reduced[:-period])
        found = jnp.where(jnp.max(gap, axis=0) <= tolerance * size, period, found)
    return found


def still_settling(
    displacement: Float[Array, "sample ..."], velocity: Float[Array, "sample ..."], angular_frequency: Lanes
) -> Bool[Array, "..."]:
    """Say whether a motion that repeats nowhere comes ever nearer to one that does.

    Its distance from itself some periods later falls from quarter to quarter of the samples; on a torus it
    stays. The periods are those after which the distance ends smallest.

    Args:
        displacement: once a period [m].
        velocity: once a period [m/s].
        angular_frequency: of the drive [rad/s].

    Returns:
        Whether it does. A torus around which the samples go less than once may pass for it.
    """
    reduced = velocity / angular_frequency
    count = displacement.shape[0]
    best = jnp.full(displacement.shape[1:], jnp.inf)
    falls = jnp.zeros(displacement.shape[1:], dtype=bool)
    for period in range(1, min(_RETURNS, count // 2) + 1):
        gap = jnp.hypot(displacement[period:] - displacement[:-period], reduced[period:] - reduced[:-period])
        first, second, third, last = (jnp.sqrt(jnp.mean(part**2, axis=0)) for part in jnp.array_split(gap, 4))
        fall = (first > second) & (second > third) & (third > last) & (last < _FALL * first)
        falls = jnp.where(last < best, fall, falls)
        best = jnp.minimum(last, best)
    return falls


def bounded_or_not(finite: Bool[Array, "..."]) -> RESULTS:
    """Give the outcome of motions.

    Args:
        finite: whether each stayed finite.

    Returns:
        Success, or `not_finite`.
    """

    def ending(well: Array) -> RESULTS:
        return RESULTS.where(well, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_finite)

    for _ in range(finite.ndim):
        ending = jax.vmap(ending)
    return ending(finite)


def start_states(model: Isolator, name: str, starts: Any) -> State:
    """Give starts, one array a state.

    Args:
        model: the isolator.
        name: of the argument.
        starts: one state, a list of states, or None for rest.

    Returns:
        The states, with the axis of the list if there is one.

    Raises:
        ValueError: if a start holds another number of states than the model.
    """
    states = 2 + model.internal_states
    if starts is None:
        return (jnp.zeros(()),) * states
    table = as_float64(np.asarray(starts, dtype=float))
    if table.ndim not in (1, 2) or table.shape[-1] != states:
        raise ValueError(
            f"Argument `{name}` must hold {states} numbers a state, but has shape {table.shape}."
        )
    return tuple(jnp.moveaxis(table, -1, 0))
