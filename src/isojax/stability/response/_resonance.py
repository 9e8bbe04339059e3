"""Resonance: the largest response over frequency to one drive amplitude, as a point that JAX can move."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import amount, brief, number, shown
from ..._small_systems import determinant, solve
from ..._types import Scalar, as_float64, check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, Modelled, as_isolator
from ..branch import tracing_steps
from ..orbit import (
    Orbit,
    closed_by_half,
    find_periodic_orbit,
    half_range,
    period_map,
    recorded_sine,
    refuse_traced,
    state_scale,
    trajectory,
    value_and_jacobian,
)
from ._frequency_response import FrequencyResponse, frequency_response

_RESONANCE_STEPS, _RESONANCE_CLOSED_TO = 12, 1e-8
"""Steps of Newton's method, and the last of them, over the size of the motion, after which it converged."""

_STAGES, _SAME_PEAK = 4, 0.5
"""Models between the known and the other one, through which a resonance is moved, and the largest move from
one to the next, over the size of the motion: where it is gone Newton's method may end at another peak."""


@shown
class Resonance(eqx.Module):
    """The largest response over frequency to a drive of one amplitude.

    Attributes:
        frequency: at which the response is largest [Hz]; NaN where it was not found.
        orbit: the motion there.
        integrator: solver and steps with which the frequency was found.
        response: the curve from the smallest motion, with those beside it among which this is the largest
            motion; None for a resonance that was found again.
    """

    frequency: Float[Array, ""]
    orbit: Orbit
    integrator: Integrator
    response: FrequencyResponse | None = None

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
        if np.isnan(np.asarray(self.frequency)):
            return f"none found under a drive of {drive}. {brief(self.result)}"
        return f"{amount(self.amplitude, 'm')} at {number(float(self.frequency))} Hz under a drive of {drive}"

    def _rows(self) -> list[str]:
        return ["frequency", "orbit", "integrator"]

    def _lines(self) -> list[str]:
        if self.response is None:
            return []
        curve = self.response.branch.points
        sizes = np.asarray(curve.response)
        top = int(np.nanargmax(sizes))
        peak = f"{amount(sizes[top], 'm')} at {number(float(curve.frequency[top]))} Hz"
        words = f"the curve from the smallest motion reaches {peak}"
        return [f"  {words}", *self.response.branch._beside_lines()]


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
    response = curve
    curve = max(own, key=lambda one: float(np.nanmax(np.asarray(one.amplitude))))
    sizes = np.asarray(curve.amplitude)
    top = int(np.nanargmax(sizes))
    if not curve.branch.closed and top in (0, int(np.flatnonzero(np.isfinite(sizes))[-1])):
        raise ValueError(
            f"Argument `frequencies` must hold the resonance, but from {frequencies[0]} to {frequencies[-1]} "
            "Hz the response is largest at an end of the curve."
        )
    points = curve.branch.points
    near = _Near(
        frozen(model), frozen(push), points.y0[top], points.frequency[top], curve.branch.symmetric, integrator
    )
    return dataclasses.replace(_moved(near, model, push, RESULTS.not_converged), response=response)


def resonance_again(known: Resonance, model: Isolator, amplitude: Float[Array, ""] | None) -> Resonance:
    """Find a known resonance again for another isolator or drive: the same peak, or none.

    Args:
        known: the resonance, of known numbers.
        model: the isolator; traced or not.
        amplitude: of the drive; that of the resonance if omitted [N, or m/s^2 for base excitation].

    Returns:
        The resonance. Where it is gone its numbers are NaN.
    """
    orbit = known.orbit
    push = as_float64(orbit.excitation.amplitude)
    near = _Near(orbit.model, push, orbit.y0, known.frequency, closed_by_half(orbit), known.integrator)
    return _moved(near, model, push if amplitude is None else amplitude, RESULTS.gone)


class _Near(eqx.Module):
    """A motion at or next to a resonance: isolator, drive, state at t = 0, frequency, and how it closes."""

    model: Isolator
    amplitude: Float[Array, ""]
    state: Float[Array, " state"]
    frequency: Float[Array, ""]
    symmetric: bool = eqx.field(static=True)
    integrator: Integrator


def _moved(near: _Near, model: Isolator, amplitude: Float[Array, ""], lost: RESULTS) -> Resonance:
    """Give the resonance of an isolator, traced or not, next to a motion; where it is lost, say so."""
    frequency, start = _stationary(model, amplitude, frozen(near))
    found = jnp.isfinite(frozen(frequency))
    # The search for the orbit is given numbers also where there is none.
    drive = Harmonic(amplitude, jnp.where(found, frequency, frozen(near.frequency)))
    start = jnp.where(found, start, near.state)
    orbit = find_periodic_orbit(
        model, drive, start=start, symmetric=near.symmetric, integrator=near.integrator
    )
    blank = jnp.where(found, 1.0, jnp.nan)
    orbit = dataclasses.replace(
        orbit,
        excitation=Harmonic(amplitude, frequency),
        y0=orbit.y0 * blank,
        floquet=jax.tree.map(lambda values: values * blank, orbit.floquet),
        symmetric=orbit.symmetric & found,
        time=orbit.time * blank,
        states=orbit.states * blank,
        error=orbit.error * blank,
        result=RESULTS.where(found, orbit.result, lost),
    )
    return Resonance(frequency, orbit, near.integrator)


Held = tuple[bool, Integrator, Float[Array, " state"], Float[Array, ""]]
"""Whether the motion is symmetric, how it is integrated, the size of its states, and a frequency beside."""


@quick_jit
def _stationary(
    model: Isolator, amplitude: Float[Array, ""], near: _Near
) -> tuple[Float[Array, ""], Float[Array, " state"]]:
    """Give frequency and state at the resonance; NaN where the search failed."""
    still, known = frozen((model, amplitude)), (near.model, near.amplitude)
    drive = recorded_sine(*known, near.frequency)
    scale = state_scale(trajectory(near.model, near.integrator, drive, tuple(near.state)))
    held = near.symmetric, near.integrator, scale, near.frequency

    def stage(begin: Array, share: Array) -> tuple[Array, None]:
        between = jax.tree.map(
            lambda old, new: old + share * (new - old) if eqx.is_inexact_array(old) else new, known, still
        )

        def newton(_: Array | int, carry: tuple[Array, Array]) -> tuple[Array, Array]:
            left, slope = value_and_jacobian(lambda at: _residual(at, between, held)[0], carry[0])
            step = solve(slope, left)
            size = jnp.max(jnp.abs(step))
            return carry[0] - step * jnp.minimum(1.0, 0.1 / size), size

        found, last = jax.lax.fori_loop(0, _RESONANCE_STEPS, newton, (begin, jnp.asarray(jnp.inf)))
        good = (last < _RESONANCE_CLOSED_TO) & (jnp.max(jnp.abs(found - begin)) < _SAME_PEAK)
        return jnp.where(good, found, jnp.nan), None

    begin = jnp.concatenate([near.state / scale, jnp.ones(1)])
    found, _ = jax.lax.scan(stage, begin, jnp.arange(1.0, _STAGES + 1.0) / _STAGES)
    value = with_derivatives(near.frequency * found[-1], _residual, found, (model, amplitude), held)
    return value, found[:-1] * scale


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
    return values.at[-1].set(determinant(slope)), frequency * unknown[-1]
