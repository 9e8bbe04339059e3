"""Resonance: the largest response over frequency to one drive amplitude, as a point that JAX can move."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import amount, number, shown
from ..._types import Scalar, as_float64, check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, Modelled, as_isolator
from ..branch import tracing_steps
from ..orbit import (
    Orbit,
    find_periodic_orbit,
    half_range,
    period_map,
    recorded_sine,
    refuse_traced,
    state_scale,
    trajectory,
    value_and_jacobian,
)
from ._frequency_response import frequency_response

_RESONANCE_STEPS, _RESONANCE_CLOSED_TO = 12, 1e-8
"""Steps of Newton's method, and the last of them, over the size of the motion, after which it converged."""


@shown
class Resonance(eqx.Module):
    """The largest response over frequency to a drive of one amplitude.

    Attributes:
        frequency: at which the response is largest [Hz]; NaN where it was not found.
        orbit: the motion there.
        integrator: solver and steps with which the frequency was found.
    """

    frequency: Float[Array, ""]
    orbit: Orbit
    integrator: Integrator

    @property
    def amplitude(self) -> Float[Array, ""]:
        """Half the peak-to-peak displacement [m]."""
        return self.orbit.amplitude

    @property
    def result(self) -> RESULTS:
        """Whether the resonance was found."""
        return self.orbit.result

    def _headline(self) -> str:
        drive = number(float(self.orbit.excitation.amplitude))
        return f"{amount(self.amplitude, 'm')} at {number(float(self.frequency))} Hz under a drive of {drive}"


def find_resonance(
    model: Isolator | Modelled,
    amplitude: Scalar | float,
    frequencies: tuple[float, float] | Float[np.ndarray, " frequency"],
    *,
    step: float = 0.02,
    integrator: Integrator | None = None,
) -> Resonance:
    """Find where the response over frequency is largest, and how large.

    From the largest point of `frequency_response`, isolas included, by Newton's method: the motion closes,
    and along the curve its amplitude is stationary. The orbit there is then found as `find_periodic_orbit`
    finds it; an error of the frequency changes its amplitude only by the square. `jax.jacfwd` and `jax.grad`
    over the model work; under `jax.jit` and `jax.vmap` use `find_again`.

    Args:
        model: the isolator.
        amplitude: of the drive [N, or m/s^2 for base excitation].
        frequencies: of which the first and the last bound the curve [Hz].
        step: largest step along the curve, over the size of the motion and the range of frequency.
        integrator: solver and steps of the curve; 256 a period if omitted.

    Returns:
        The resonance.

    Raises:
        ValueError: as `frequency_response` does; and if the response is largest at an end of the curve.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 4.1.

    Example:
        >>> resonance = ij.find_resonance(ij.paper.y_direction(), 60.0, (4.5, 6.5))
        >>> print(f"{1e3 * float(resonance.amplitude):.2f} mm at {float(resonance.frequency):.2f} Hz")
        0.21 mm at 5.43 Hz
    """
    model = as_isolator(model)
    check_float64()
    refuse_traced(model, amplitude)
    integrator = tracing_steps(model, integrator)
    push = as_float64(amplitude)
    curve = frequency_response(
        frozen(model), np.asarray(frozen(push)), frequencies, step=step, integrator=integrator
    )
    # An isola may reach higher than the curve; a subharmonic is no answer at the frequency of the drive.
    own = [one for one in (curve, *curve.others) if one.branch.periods == 1]
    curve = max(own, key=lambda one: float(np.nanmax(np.asarray(one.amplitude))))
    sizes = np.asarray(curve.amplitude)
    top = int(np.nanargmax(sizes))
    if not curve.branch.closed and top in (0, int(np.flatnonzero(np.isfinite(sizes))[-1])):
        raise ValueError(
            f"Argument `frequencies` must hold the resonance, but from {frequencies[0]} to {frequencies[-1]} "
            "Hz the response is largest at an end of the curve."
        )
    points = curve.branch.points
    return resonance_near(
        model, push, points.y0[top], points.frequency[top], curve.branch.symmetric, integrator
    )


def resonance_near(
    model: Isolator,
    amplitude: Float[Array, ""],
    state: Float[Array, " state"],
    frequency: Float[Array, ""],
    symmetric: bool,
    integrator: Integrator,
) -> Resonance:
    """Find a resonance from a motion close to it.

    Args:
        model: the isolator; traced or not.
        amplitude: of the drive [N, or m/s^2 for base excitation].
        state: of the motion at t = 0.
        frequency: of the motion [Hz].
        symmetric: whether the second half of it is minus the first.
        integrator: solver and steps.

    Returns:
        The resonance.
    """
    frequency, start = _stationary(model, amplitude, frozen(state), frozen(frequency), symmetric, integrator)
    drive = Harmonic(amplitude, frequency)
    orbit = find_periodic_orbit(model, drive, start=start, symmetric=symmetric)
    return Resonance(frequency, orbit, integrator)


Held = tuple[bool, Integrator, Float[Array, " state"], Float[Array, ""]]
"""Whether the motion is symmetric, how it is integrated, the size of its states, and a frequency beside."""


@quick_jit
def _stationary(
    model: Isolator,
    amplitude: Float[Array, ""],
    state: Float[Array, " state"],
    frequency: Float[Array, ""],
    symmetric: bool,
    integrator: Integrator,
) -> tuple[Float[Array, ""], Float[Array, " state"]]:
    """Give frequency and state at the resonance; NaN where the search failed."""
    still, push = frozen((model, amplitude))
    path = trajectory(still, integrator, recorded_sine(still, push, frequency), tuple(state))
    held = symmetric, integrator, state_scale(path), frequency

    def newton(_: Array | int, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        left, slope = value_and_jacobian(lambda at: _residual(at, (still, push), held)[0], carry[0])
        step = jnp.linalg.solve(slope, left)
        size = jnp.max(jnp.abs(step))
        return carry[0] - step * jnp.minimum(1.0, 0.1 / size), size

    begin = jnp.concatenate([state / held[2], jnp.ones(1)]), jnp.asarray(jnp.inf)
    found, last = jax.lax.fori_loop(0, _RESONANCE_STEPS, newton, begin)
    value = frequency * found[-1]
    value = with_derivatives(value, _residual, found, (model, amplitude), held)
    blank = jnp.where(last < _RESONANCE_CLOSED_TO, 1.0, jnp.nan)
    return value * blank, found[:-1] * held[2] * blank


def _residual(
    unknown: Float[Array, " unknown"], live: tuple[Isolator, Float[Array, ""]], held: Held
) -> tuple[Float[Array, " unknown"], Float[Array, ""]]:
    """Give what vanishes at a resonance, and its frequency.

    On the curve of orbits the amplitude is stationary where its gradient is a combination of those of the
    closing conditions: where the determinant of them all vanishes.
    """
    (model, amplitude), (symmetric, integrator, scale, frequency) = live, held

    def motion(at: Array) -> Array:
        drive, begin = recorded_sine(model, amplitude, frequency * at[-1]), tuple(at[:-1] * scale)
        end = period_map(model, integrator, drive, begin, turns=0.5 if symmetric else 1.0)
        size = half_range(model, drive, trajectory(model, integrator, drive, begin), 1.0)
        return jnp.concatenate([jnp.stack(end) / scale - at[:-1], size[None] / scale[0]])

    values, slope = value_and_jacobian(motion, unknown)
    return values.at[-1].set(jnp.linalg.det(slope)), frequency * unknown[-1]
