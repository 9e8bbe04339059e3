"""How fast the states of a model change by themselves along its motion, and the steps that follow this."""

import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ...models import ContinuedLaw, Instant, Integrator, Isolator
from ._describing_function import imposed_internal, response_start, rest_displacement
from ._split_period_map import state_scale

_STEP_BY_RATE = 0.5
"""Largest product of step and rate. Runge and Kutta's method is stable to 2.7; the pieces of a split motion
may take steps four times longer than the whole does."""

_MOST_STEPS = 1 << 14
"""Steps a drive period at most; beyond, a model is stiff."""

_RANGE_LOOKED_AT = 5
"""Sizes of motion, and frequencies, of a range at which the states are looked at."""

_SAMPLES = 64
"""Instants of a cycle at which rates are looked at."""

_SQUARINGS = 4
"""Of a matrix: the root of that power's size is its spectral radius within a few per cent."""


def integrator_over(
    model: Isolator,
    integrator: Integrator,
    sizes: Sequence[float] | Float[np.ndarray, "2"],
    frequencies: Float[np.ndarray, " frequency"],
) -> Integrator:
    """Give the integrator that follows the motions of a range of sizes and a band.

    Args:
        model: the isolator; none of its numbers is traced.
        integrator: with steps enough for motions that change no faster than the drive.
        sizes: the least and the largest displacement amplitude [m].
        frequencies: of the drives, ascending [Hz].

    Returns:
        The integrator.
    """
    motions = np.geomspace(sizes[0], sizes[1], _RANGE_LOOKED_AT)
    band = np.linspace(frequencies[0], frequencies[-1], _RANGE_LOOKED_AT)
    grid = np.meshgrid(motions, band, indexing="ij")
    return integrator_that_follows(model, integrator, *(axis.ravel() for axis in grid))[0]


def integrator_that_follows(
    model: Isolator,
    integrator: Integrator,
    sizes: Float[np.ndarray, " motion"],
    frequencies: Float[np.ndarray, " motion"],
) -> tuple[Integrator, bool]:
    """Give the integrator with as many steps as the fastest state of a model needs, and whether it is stiff.

    Bristles that bend within a hundredth of a motion, or a drive far below a resonance, make fixed steps
    unstable unless these are shorter.

    Args:
        model: the isolator; none of its numbers is traced.
        integrator: with steps enough for motions that change no faster than the drive.
        sizes: displacement amplitudes of the motions that are to be followed [m].
        frequencies: of their drives [Hz].

    Returns:
        The integrator, its steps doubled as often as needed; and whether more are needed than are taken.
    """
    rates = np.asarray(_fastest(model, jnp.asarray(sizes), jnp.asarray(frequencies)))
    return integrator_with(model, integrator, rates / frequencies)


def integrator_with(
    model: Isolator, integrator: Integrator, rates: Float[np.ndarray, " motion"], most: int = _MOST_STEPS
) -> tuple[Integrator, bool]:
    """Give the integrator with as many steps as some rates need, and whether they need more than are taken.

    Args:
        model: the isolator.
        integrator: with steps enough for motions that change no faster than the drive.
        rates: of the fastest states, per drive period; those that are not finite do not count.
        most: steps a period to take at most.

    Returns:
        The integrator, its steps doubled as often as needed; and whether more are needed than are taken.
    """
    needed = np.max(rates, initial=0.0, where=np.isfinite(rates)) / _STEP_BY_RATE
    taken = integrator.steps_a_period(model)
    most = max(most, taken)
    doublings = math.ceil(math.log2(max(min(needed, most) / taken, 1.0)))
    return integrator.with_steps(integrator.steps_per_period << doublings), bool(needed > most)


@quick_jit
def answer_sizes(
    model: Isolator, amplitudes: Float[Array, " drive"], frequencies: Float[Array, " drive"]
) -> Float[Array, " drive"]:
    """Give the displacement amplitude of the one-harmonic answer to each drive [m].

    Args:
        model: the isolator.
        amplitudes: of the drives [N, or m/s^2 for base excitation].
        frequencies: of the drives [Hz].

    Returns:
        The sizes.
    """

    def one(amplitude: Array, frequency: Array) -> Array:
        start = response_start(model, amplitude, frequency)
        return jnp.hypot(start[0] - rest_displacement(model), start[1] / (2.0 * math.pi * frequency))

    return jax.vmap(one)(amplitudes, frequencies)


@quick_jit
def _fastest(
    model: Isolator, sizes: Float[Array, " motion"], frequencies: Float[Array, " motion"]
) -> Float[Array, " motion"]:
    return jax.vmap(lambda size, frequency: fastest_rate(model, size, frequency)[0])(sizes, frequencies)


def fastest_rate(
    model: Isolator, size: Float[Array, ""], frequency: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, " state"]]:
    """Give the largest rate at which states change by themselves along a motion of one harmonic.

    Args:
        model: the isolator.
        size: displacement amplitude of the motion [m].
        frequency: of the motion [Hz].

    Returns:
        The largest spectral radius of the derivative of the rates by the state [1/s]; and the size of each
        state along the motion.
    """
    omega, rest = 2.0 * math.pi * frequency, rest_displacement(model)
    phase = 2.0 * np.pi / _SAMPLES * np.arange(_SAMPLES)
    x, v = rest + size * np.cos(phase), -size * omega * np.sin(phase)
    path = (x, v, *imposed_internal(model, x, v, frequency))
    scale = state_scale(path)

    def radius(state: Array) -> Array:
        law = ContinuedLaw(tuple(jnp.where(own >= 0.0, 1.0, -1.0) for own in model.switches(tuple(state))))

        def rates(scaled: Array) -> Array:
            return jnp.stack(model.rates(tuple(scaled * scale), Instant(0.0 * size), law=law)) / scale

        matrix = jax.jacfwd(rates)(state / scale)
        unit = jnp.maximum(jnp.max(jnp.abs(matrix)), 1e-300)
        power = matrix / unit
        for _ in range(_SQUARINGS):
            power = power @ power
        return unit * jnp.max(jnp.abs(power)) ** (1.0 / 2**_SQUARINGS)

    return jnp.max(jax.vmap(radius)(jnp.stack(path, axis=-1))), scale
