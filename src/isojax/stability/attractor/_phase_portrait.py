"""The settled motion in the plane of displacement and velocity."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._types import check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, State, as_isolator
from ..orbit import AbstractStatePath, integrator_for, recorded_sine, trajectory
from ._stroboscope import bounded_or_not, settle_down, start_states


@shown
class PhasePortrait(AbstractStatePath):
    """The motion over some drive periods.

    Attributes:
        time: from the first drive period shown [s].
        states: displacement [m], velocity [m/s], internal states; NaN where the motion left every bound.
        result: whether the motion stayed bounded.
    """

    time: Float[Array, " time"]
    states: Float[Array, "time state"]
    result: RESULTS


def phase_portrait(
    model: Isolator,
    excitation: Harmonic,
    *,
    start: Any = None,
    settle: int = 200,
    periods: int = 8,
    integrator: Integrator | None = None,
) -> PhasePortrait:
    """Give the settled motion over some drive periods, periodic or not.

    Args:
        model: the isolator.
        excitation: the drive.
        start: state at t = 0; rest if omitted.
        settle: drive periods before.
        periods: drive periods shown.
        integrator: solver and steps.

    Returns:
        The motion.

    Raises:
        ValueError: if `start` has the wrong length, or a count is not positive.
        RuntimeError: if JAX is not in 64-bit mode.
    """
    model = as_isolator(model)
    check_float64()
    settle = given_count("settle", settle)
    periods = given_count("periods", periods)
    integrator = integrator_for(model, integrator)
    return _portrait(model, excitation, start_states(model, "start", start), integrator, settle, periods)


@quick_jit
def _portrait(
    model: Isolator, excitation: Harmonic, state: State, integrator: Integrator, settle: int, periods: int
) -> PhasePortrait:
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    settled = settle_down(model, integrator, drive, state, settle)
    path = jnp.stack(trajectory(model, integrator, drive, settled, turns=float(periods)), axis=-1)
    finite = jnp.all(jnp.isfinite(path))
    time = jnp.linspace(0.0, 1.0, path.shape[0]) * periods / excitation.frequency
    return PhasePortrait(time, jnp.where(finite, path, jnp.nan), bounded_or_not(finite))
