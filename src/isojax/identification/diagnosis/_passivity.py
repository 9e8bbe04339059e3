"""Whether a force with internal states takes energy: its work over the loop of a sinusoidal motion."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._kept import recall
from ..._quick_jit import quick_jit
from ...elements import AbstractElement

CYCLES = 6
"""Cycles of the motion; the work is that of the last, so that no internal state depends on its start."""

STEPS = 1024
"""Steps a cycle."""

STEADY = 1e-2
"""Share of its range by which a settled force may differ between the last two cycles."""

LOOPS = (0.25, 1.0)
"""Amplitudes over the largest visited one: a passive law is so over smaller loops, too."""

WORK_OF_STEPS = 1e-3
"""Share of the elastic energy of a loop up to which its work is the error of the steps."""


@quick_jit
def _loops(
    element: AbstractElement, amplitude: Float[Array, " lane"], angular: Float[Array, " lane"]
) -> Float[Array, "time lane"]:
    """Drive an element along sinusoids, from rest; give its force."""
    step = 2.0 * jnp.pi / STEPS

    def motion(phase: Array) -> tuple[Array, Array]:
        return amplitude * jnp.sin(phase), amplitude * angular * jnp.cos(phase)

    def rate(phase: Array, s: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(each / angular for each in element.state_rate(*motion(phase), s))

    def moved(s: tuple[Array, ...], rates: tuple[Array, ...], share: float) -> tuple[Array, ...]:
        return tuple(a + share * step * b for a, b in zip(s, rates, strict=True))

    def body(s: tuple[Array, ...], phase: Array) -> tuple[tuple[Array, ...], Array]:
        first = rate(phase, s)
        second = rate(phase + 0.5 * step, moved(s, first, 0.5))
        third = rate(phase + 0.5 * step, moved(s, second, 0.5))
        fourth = rate(phase + step, moved(s, third, 1.0))
        slopes = tuple(
            (a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(first, second, third, fourth, strict=True)
        )
        return moved(s, slopes, 1.0), element.force(*motion(phase), s)

    rest = tuple(jnp.zeros_like(amplitude) for _ in range(element.internal_states))
    return jax.lax.scan(body, rest, step * jnp.arange(CYCLES * STEPS, dtype=float))[1]


def work_per_cycle(
    element: AbstractElement, amplitude: Float[np.ndarray, " lane"], angular: Float[np.ndarray, " lane"]
) -> tuple[Float[np.ndarray, " lane"], Float[np.ndarray, " lane"]]:
    """Give the energy that an element takes from a sinusoidal motion in one cycle.

    `W = closed integral of f dx` over the last of several cycles of `x = X sin(w t)`. Where the internal
    states still ring then, as a lightly damped mass does, W is the mean over all cycles since rest, which no
    passive law makes negative.

    Args:
        element: the element, with its own force and internal states.
        amplitude: X [m].
        angular: w [rad/s].

    Returns:
        W [J], and the elastic energy that the loop moves, the range of the force times X over two [J]. Both
        NaN where an internal state diverged.

    Source: Erlicher & Point 2004, Comptes Rendus Mecanique 332:51, on what makes Bouc-Wen models passive.
    """

    def compute() -> tuple[np.ndarray]:
        return (np.asarray(_loops(element, jnp.asarray(amplitude), jnp.asarray(angular))),)

    (forces,) = recall("work per cycle", compute, element, amplitude, angular)
    before, force = forces[-2 * STEPS : -STEPS], forces[-STEPS:]
    phase = 2.0 * np.pi * np.arange(STEPS) / STEPS
    power = (forces * np.cos(np.tile(phase, CYCLES))[:, None]).reshape(CYCLES, STEPS, -1)
    # An internal state that diverged overflows the sums, and the result is not finite.
    with np.errstate(over="ignore", invalid="ignore"):
        works = 2.0 * np.pi * amplitude * np.mean(power, axis=1)
    reach = np.ptp(force, axis=0)
    rings = np.max(np.abs(force - before), axis=0) > STEADY * reach
    return np.where(rings, np.mean(works, axis=0), works[-1]), 0.5 * reach * amplitude


def find_activity(element: AbstractElement, largest_x: float, largest_v: float) -> str | None:
    """Find how an element with internal states feeds energy into the visited motion, if it does.

    Args:
        element: the element.
        largest_x: largest displacement visited [m].
        largest_v: largest velocity visited [m/s].

    Returns:
        A sentence, or None where every loop takes energy, the element is declared active, or it has no
        internal state.
    """
    if element.internal_states == 0 or largest_x <= 0.0:
        return None
    shape = element.unphysical_shape(largest_x)
    if shape is not None:
        return f"its {element.words} {shape}"
    amplitude = largest_x * np.array(LOOPS)
    work, elastic = work_per_cycle(element, amplitude, np.full(2, largest_v / largest_x))
    if not np.all(np.isfinite(work)):
        return f"its {element.words} diverges over the visited loop"
    if not element.active and np.any(work < -WORK_OF_STEPS * elastic):
        where = 1e3 * float(amplitude[int(np.argmin(work / np.maximum(elastic, 1e-300)))])
        return f"its {element.words} feeds energy into a loop of {where:.3g} mm, within the visited motion"
    return None
