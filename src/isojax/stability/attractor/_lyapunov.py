"""The largest Lyapunov exponent: how fast neighbouring motions separate."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import amount, shown
from ..._types import Lanes, check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, State, as_isolator
from ..orbit import integrator_for, recorded_sine
from ._stroboscope import Watch, any_disturbance, bounded_or_not, start_states, watch_settled

_BLOCKS = 20
"""Segments of the motion whose scatter gives the standard error."""


@shown
class LyapunovExponent(eqx.Module):
    """Rate at which neighbouring motions separate.

    Attributes:
        value: [1/s]; positive where the motion is chaotic. NaN where it left every bound.
        standard_error: from the scatter between segments of the motion [1/s].
        growth: logarithm by which a small disturbance grew over each drive period.
        state: displacement, velocity, internal states at the end.
        result: whether the motion stayed bounded.
    """

    value: Float[Array, ""]
    standard_error: Float[Array, ""]
    growth: Float[Array, " period"]
    state: Float[Array, " state"]
    result: RESULTS

    def _headline(self) -> str:
        return f"largest exponent {amount(self.value, '1/s', float(np.asarray(self.standard_error)))}"


def largest_lyapunov_exponent(
    model: Isolator,
    excitation: Harmonic,
    *,
    start: Sequence[Lanes | float] | Float[Array, " state"] | Any = None,
    settle: int = 200,
    periods: int = 2000,
    integrator: Integrator | None = None,
) -> LyapunovExponent:
    """Give the largest Lyapunov exponent of the motion from a start.

    A small disturbance follows the derivative of the period map along the motion and is brought back to unit
    size after each period; the exponent is the mean of the logarithms over the time they took.

    Args:
        model: the isolator.
        excitation: the drive.
        start: state at t = 0; rest if omitted.
        settle: drive periods before the mean starts.
        periods: drive periods of the mean, 20 at least.
        integrator: solver and steps.

    Returns:
        The exponent.

    Raises:
        ValueError: if `start` has the wrong length, or a count is too small.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Benettin et al. 1980, Meccanica 15:9; Wolf et al. 1985, Physica D 16:285.
    """
    model = as_isolator(model)
    check_float64()
    settle = given_count("settle", settle)
    periods = given_count("periods", periods)
    if periods < _BLOCKS:
        raise ValueError(f"Argument `periods` must be at least {_BLOCKS}, but is {periods}.")
    integrator = integrator_for(model, integrator)
    return _exponent(model, excitation, start_states(model, "start", start), integrator, settle, periods)


@quick_jit
def _exponent(
    model: Isolator, excitation: Harmonic, state: State, integrator: Integrator, settle: int, periods: int
) -> LyapunovExponent:
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    seen = watch_settled(model, Watch(integrator, settle, periods), drive, state, any_disturbance(state))
    rate = seen.growth * excitation.frequency
    blocks = jnp.mean(rate[: periods // _BLOCKS * _BLOCKS].reshape(_BLOCKS, -1), axis=1)
    end = jnp.stack(seen.state)
    finite = jnp.all(jnp.isfinite(end))
    blank = jnp.where(finite, 1.0, jnp.nan)
    return LyapunovExponent(
        jnp.mean(rate) * blank,
        jnp.std(blocks, ddof=1) / _BLOCKS**0.5 * blank,
        seen.growth * blank,
        end * blank,
        bounded_or_not(finite),
    )
