"""What a model makes of small changes along its own path: partial derivatives, all samples at once.

A sharp law has the model take several steps a sample. Its slopes are then averaged to the samples, so that
what is absent is followed at one step a sample, whatever the model asks for.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ...models import (
    ROUNDED,
    Instant,
    Isolator,
    Quantity,
    Ringing,
    State,
    add_ringing,
    find_regime,
)
from ._batch import Batch
from ._effect_inputs import EFFECT_INPUTS, PathMotion, Perturbation
from ._unknowns import has_stiffness_scale, scaled_model


def sample_stages(table: Float[Array, "time stage lanes"]) -> Float[Array, "time 3 lanes"]:
    """Give start, middle and end of each sample."""
    return table[:, :: (table.shape[1] - 1) // 2]


def steps_of(table: Float[Array, "time stage lanes"]) -> Float[Array, "node 3 lanes"]:
    """Split each sample into its integration steps, three stages each."""
    time, stages, lanes = table.shape
    parts = (stages - 1) // 2
    split = jnp.stack([table[:, 2 * part : 2 * part + 3] for part in range(parts)], axis=1)
    return split.reshape(time * parts, 3, lanes)


def cubic_middle(before: Array, left: Array, right: Array, after: Array) -> Array:
    """Give the middle of a cubic through four equidistant values."""
    return (9.0 * (left + right) - before - after) / 16.0


def _to_samples(values: Float[Array, "step lanes"], steps: int) -> Float[Array, "time lanes"]:
    """Average what varies between samples, with the weight of a hat: the impulse of a spike is kept.

    What the hat adds to a smooth series, a twelfth of its second difference, is taken off again.
    """
    if steps == 1:
        return values
    time = values.shape[0] // steps
    ahead, behind = values[:1].repeat(steps - 1, axis=0), values[-1:].repeat(steps - 1, axis=0)
    padded = jnp.concatenate([ahead, values, behind])
    shares = [(1.0 - abs(offset) / steps) / steps for offset in range(1 - steps, steps)]
    mean = sum(
        (share * padded[first : first + time * steps : steps] for first, share in enumerate(shares)),
        start=jnp.zeros_like(values[:time]),
    )
    return _without_bend(mean)


@quick_jit
def impulse_at_samples(table: Float[Array, "time stage lanes"]) -> Float[Array, "time lanes"]:
    """Average a signal to the samples as slopes are: all of it may lie between them, as that of a hold does.

    Args:
        table: the signal at equidistant times from each sample to the next; it may jump there.

    Returns:
        At each sample what pushes a model as much.
    """
    place = jnp.linspace(0.0, 1.0, table.shape[1])
    pattern = jnp.ones(table.shape[1]).at[1::2].set(4.0).at[2:-1:2].set(2.0)
    simpson = pattern / pattern.sum()
    ahead = jnp.einsum("s,tsl->tl", simpson * (1.0 - place), table)
    behind = jnp.einsum("s,tsl->tl", simpson * place, table)
    return _without_bend(ahead + jnp.concatenate([0.5 * table[:1, 0], behind[:-1]]))


def _without_bend(mean: Float[Array, "time lanes"]) -> Float[Array, "time lanes"]:
    """Take off what a hat adds to a smooth series."""
    around = jnp.concatenate([mean[:1], mean, mean[-1:]])
    return mean - (around[2:] - 2.0 * mean + around[:-2]) / 12.0


class Change(NamedTuple):
    """Change of the reading, and of the rates of the carried states but the first (the velocity)."""

    rates: tuple[Array, ...]
    reading: Array


class Slopes(NamedTuple):
    """What the model makes of small changes along its path.

    Attributes:
        parameters: with each parameter that moves.
        inputs: with a unit at each effect input, by name.
        scale: with the stiffness scale, or None without one.
        states: with each state.
        motion: what absent effects see of the path.
    """

    parameters: tuple[Change, ...]
    inputs: dict[str, Change]
    scale: Change | None
    states: tuple[Change, ...]
    motion: PathMotion


@quick_jit
def slopes_along(
    model: Isolator,
    moving: tuple[int, ...],
    scale: Array,
    path: State,
    ringing: Ringing | None,
    batch: Batch,
    quantity: Quantity,
) -> Slopes:
    """Differentiate rates and reading along the path.

    A law that jumps has no slope. Where the path was split at its jumps, the rates are those of the rounded
    law, used by effect inputs alone; what the jumps do to changes of states and parameters is in
    `transitions_along`. Elsewhere the rounded law is the law.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    at = jax.tree_util.tree_map(steps_of, batch.acting).pick(np.s_[:, 0])
    scale = jnp.broadcast_to(scale, at.drive.shape)
    steps = at.drive.shape[0] // batch.measured.shape[0]
    present = scaled_model(model, values, scale)
    split = ringing is not None
    law = find_regime(present, path, at) if split else ROUNDED

    def along(values: tuple[Array, ...], scale: Array, state: State, inlet: dict[str, Array]) -> Change:
        current = scaled_model(model, values, scale)
        now = current.with_delay_slope(at)
        if inlet:
            small = Perturbation(inlet["acted"], inlet["force"], inlet["mass"], inlet["base"], inlet["read"])
            current = Isolator(current.mass, (*current.elements, small), current.excitation)
            followed = {**at.channels, "perturbation": inlet["base"]}
            now = Instant(now.drive + inlet["recorded"], at.drive_rate, followed)
        rates = current.rates(state, now, quantity)[1 : len(state)]
        return Change(rates, current.reading(state, now, quantity, law))

    def by_parameter(place: int) -> Change:
        def with_number(number: Array) -> Change:
            return along((*values[:place], number, *values[place + 1 :]), scale, path, {})

        return jax.jvp(with_number, (values[place],), (jnp.ones(()),))[1]

    def by_input(name: str) -> Change:
        nothing = {inlet: jnp.zeros(()) for inlet in EFFECT_INPUTS}

        def with_amount(amount: Array) -> Change:
            return along(values, scale, path, nothing | {name: amount})

        return jax.jvp(with_amount, (jnp.zeros(()),), (jnp.ones(()),))[1]

    def by_state(index: int) -> Change:
        def shifted(number: Array) -> Change:
            return along(values, scale, (*path[:index], number, *path[index + 1 :]), {})

        return jax.jvp(shifted, (path[index],), (jnp.ones_like(path[index]),))[1]

    by_scale = None
    if has_stiffness_scale(model):
        by_scale = jax.jvp(lambda s: along(values, s, path, {}), (scale,), (jnp.ones_like(scale),))[1]

    def sampled(change: Change) -> Change:
        return Change(tuple(_to_samples(rate, steps) for rate in change.rates), change.reading[::steps])

    present, own = scaled_model(model, values, scale[::steps]), tuple(state[::steps] for state in path)
    ends = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in own)
    befores = tuple(jnp.concatenate([state[:1], state[:-1]]) for state in own)
    afters = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in ends)
    middles = tuple(map(cubic_middle, befores, own, ends, afters))
    acting = jax.tree_util.tree_map(sample_stages, batch.acting)
    seen = []
    for stage, state in enumerate((own, middles, ends)):
        now = acting.pick(np.s_[:, stage])
        base = present.base(now)
        y = present.reading(state, now, quantity, find_regime(present, state, now) if split else ROUNDED)
        if stage == 0:
            y = add_ringing(y, ringing)
        seen.append((state[0], state[1], y) if base is None else (state[0], state[1], y, base))
    now = acting.pick(np.s_[:, 0])
    sharp = find_regime(present, own, now) if split else ROUNDED
    acted, acted_rate = present.drive(now)
    sensed = present.sensed(own, now, quantity, sharp)
    motion = PathMotion(
        own[0],
        own[1],
        now.drive_rate,
        acted,
        jnp.broadcast_to(acted_rate, acted.shape),
        add_ringing(sensed, ringing),
        tuple(jnp.stack(three, axis=1) for three in zip(*seen, strict=True)),
        {},
    )
    return Slopes(
        tuple(sampled(by_parameter(place)) for place in moving),
        {name: sampled(by_input(name)) for name in EFFECT_INPUTS},
        None if by_scale is None else sampled(by_scale),
        tuple(sampled(by_state(index)) for index in range(len(path))),
        motion,
    )
