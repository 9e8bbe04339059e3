"""Forces around a steady cycle of prescribed motion: what a model amounts to at one amplitude."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...models import Instant, Isolator, State

_POINTS = 256
"""Points of a cycle."""

_SETTLING = 10
"""Cycles after which internal states count as periodic."""


SIDES = ("stiffness", "damping")
"""What a cycle amounts to, in the order of `equivalent_of`."""


class Cycles(NamedTuple):
    """One steady cycle at each amplitude.

    Attributes:
        phase: [rad].
        displacement: X sin(phase) [m].
        velocity: [m/s].
        force: force of the elements [N].
    """

    phase: Float[np.ndarray, " phase"]
    displacement: Float[np.ndarray, "phase amplitude"]
    velocity: Float[np.ndarray, "phase amplitude"]
    force: Float[np.ndarray, "phase amplitude"]


def trace_cycles(model: Isolator, amplitudes: Float[np.ndarray, " amplitude"], frequency: float) -> Cycles:
    """Give the force of a model's elements around a prescribed cycle `x = X sin(phase)`.

    Args:
        model: the isolator; its mass takes no part.
        amplitudes: X [m].
        frequency: [Hz].

    Returns:
        The cycles, internal states settled.
    """
    omega = 2.0 * np.pi * frequency
    phase = 2.0 * np.pi * np.arange(_POINTS) / _POINTS
    force = cycle_forces(model, amplitudes, frequency)
    x = amplitudes * np.sin(phase)[:, None]
    v = omega * amplitudes * np.cos(phase)[:, None]
    return Cycles(phase, x, v, np.asarray(force))


def cycle_forces(
    model: Isolator, amplitudes: Float[np.ndarray, " amplitude"], frequency: float
) -> Float[Array, "phase amplitude"]:
    """Give the forces of `trace_cycles`, of a model that JAX may trace."""
    return _forces(model, jnp.asarray(amplitudes), jnp.asarray(2.0 * np.pi * frequency))[-_POINTS:]


@eqx.filter_jit
def _forces(
    model: Isolator, size: Float[Array, " amplitude"], omega: Float[Array, ""]
) -> Float[Array, "time amplitude"]:
    """Give the force at every point of every cycle, compiled once for each set of elements."""
    phase = 2.0 * np.pi * np.arange(_POINTS) / _POINTS
    step = 2.0 * np.pi / _POINTS / omega

    def state(angle: Array, internal: tuple[Array, ...]) -> State:
        return (size * jnp.sin(angle), omega * size * jnp.cos(angle), *internal)

    def rates(angle: Array, internal: tuple[Array, ...]) -> tuple[Array, ...]:
        return model.rates(state(angle, internal), Instant(jnp.zeros_like(size)))[2:]

    def ahead(internal: tuple[Array, ...], slope: tuple[Array, ...], share: float) -> tuple[Array, ...]:
        return tuple(s + share * step * r for s, r in zip(internal, slope, strict=True))

    def advance(internal: tuple[Array, ...], angle: Array) -> tuple[tuple[Array, ...], Array]:
        force = jnp.broadcast_to(model.restoring_force(state(angle, internal)), size.shape)
        half = angle + np.pi / _POINTS
        k1 = rates(angle, internal)
        k2 = rates(half, ahead(internal, k1, 0.5))
        k3 = rates(half, ahead(internal, k2, 0.5))
        k4 = rates(half + np.pi / _POINTS, ahead(internal, k3, 1.0))
        mean = tuple((a + 2.0 * (b + c) + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return ahead(internal, mean, 1.0), force

    cycles = 1 if model.internal_states == 0 else 1 + _SETTLING
    start = (jnp.zeros_like(size),) * model.internal_states
    return jax.lax.scan(advance, start, jnp.tile(jnp.asarray(phase), cycles))[1]


def equivalent_curves(
    model: Isolator, amplitudes: Float[np.ndarray, " amplitude"], frequency: float
) -> tuple[Float[np.ndarray, " amplitude"], Float[np.ndarray, " amplitude"]]:
    """Give equivalent stiffness and damping of a model by harmonic balance.

    `K_eq = 1/(pi X) ∮ f sin dphi`, `C_eq = 1/(pi omega X) ∮ f cos dphi`.

    Args:
        model: the isolator.
        amplitudes: X [m], positive.
        frequency: [Hz].

    Returns:
        K_eq [N/m] and C_eq [N s/m].

    Source: the paper, eqs. (7) and (8).
    """
    stiffness, damping = np.asarray(equivalent_of(model, amplitudes, frequency))
    return stiffness, damping


def equivalent_of(
    model: Isolator, amplitudes: Float[np.ndarray, " amplitude"], frequency: float
) -> Float[Array, "2 amplitude"]:
    """Give K_eq [N/m] and C_eq [N s/m] as `equivalent_curves` does, of a model that JAX may trace."""
    phase = 2.0 * np.pi * np.arange(_POINTS) / _POINTS
    omega = 2.0 * np.pi * frequency
    force = cycle_forces(model, amplitudes, frequency)
    sides = jnp.stack([jnp.asarray(np.sin(phase)), jnp.asarray(np.cos(phase)) / omega])
    return sides @ force * (2.0 / _POINTS / jnp.asarray(amplitudes))[None]
