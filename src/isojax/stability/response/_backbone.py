"""Backbone curves: how the frequency of free vibration and of phase resonance moves with the amplitude."""

import math
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import brief, shown
from ..._small_systems import solve
from ..._types import check_float64
from ...models import (
    Band,
    EndsEstimated,
    Estimated,
    Instant,
    Integrator,
    Isolator,
    Modelled,
    State,
    as_isolator,
    coefficient_errors,
    find_band,
)
from ..map import Lane, MapMethod, states_at_zero
from ..orbit import (
    Sine,
    ascending,
    balanced_motion,
    imposed_balance,
    integrator_for,
    integrator_that_follows,
    is_traced,
    rest_displacement,
    trajectory,
    value_and_jacobian,
    with_overtones,
)
from ._free_vibration import natural_frequencies
from ._frequency_response import drive_amplitude, fundamental

_BALANCE = 30
"""Steps towards the resonance of the one-harmonic balance."""

_CORRECTIONS_A_POINT = 12
"""Steps of Newton's method on the orbit with its drive and frequency."""

_AMPLITUDE_STEP = 0.3
"""Largest change of an unknown in one step, as a share of its size: beyond, the basin may be left."""


@shown
class BackboneCurve(eqx.Module):
    """Resonance over amplitude, with and without damping.

    Attributes:
        displacements: largest displacement over rest [m].
        natural_frequency: of free vibration without damping [Hz]; NaN where the spring does not hold it.
        frequency: of phase resonance, the fundamental of the displacement a quarter of a period behind the
            drive that acts [Hz].
        force: amplitude of the recorded drive there [N, or m/s^2 for base excitation].
        y0: state there at t = 0 of the recorded drive: displacement, velocity, internal states.
        result: whether phase resonance was found; its numbers are NaN where not.
        band: of natural frequency, frequency and force, where a fit was given.
    """

    displacements: Float[Array, " point"]
    natural_frequency: Float[Array, " point"]
    frequency: Float[Array, " point"]
    force: Float[Array, " point"]
    y0: Float[Array, "point state"]
    result: RESULTS
    band: Band | None = None

    def _headline(self) -> str:
        spans = f"frequency {brief(self.frequency)} Hz, displacement {brief(self.displacements)} m"
        return f"phase resonance: {spans}"


def backbone_curve(
    model: Isolator | Modelled,
    displacements: Any,
    *,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> BackboneCurve:
    """Give the backbone curve, free and forced.

    Args:
        model: the isolator.
        displacements: largest displacement over rest, ascending and positive [m].
        integrator: solver and steps; 256 a period if omitted. More are taken where a state of the model
            follows the motion faster.
        fit: with whose errors the curve is given a band; `model` is its model. None for no band.

    Returns:
        The curve.

    Raises:
        ValueError: if the displacements do not ascend or are not positive.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 2.1 (free vibration); Peeters et al. 2011, J.
    Sound Vib. 330:486 (phase resonance).

    Example:
        >>> backbone = ij.backbone_curve(ij.paper.y_direction(), np.array([1e-4, 5e-4]))
        >>> bool(backbone.frequency[1] < backbone.frequency[0])  # this spring softens
        True
    """
    model = as_isolator(model)
    check_float64()
    errors = None if fit is None else coefficient_errors(fit, model)
    amplitudes = jnp.asarray(ascending("displacements", displacements))
    integrator, stiff = _steps(frozen(model), amplitudes, integrator_for(frozen(model), integrator, 256))

    def curve_of(isolator: Isolator) -> BackboneCurve:
        natural = natural_frequencies(isolator, amplitudes)
        return _resonance(isolator, amplitudes, natural, integrator, jnp.asarray(stiff))

    def quantities(isolator: Isolator) -> Array:
        found = curve_of(isolator)
        return jnp.stack([found.natural_frequency, found.frequency, found.force])

    curve = curve_of(model)
    if errors is None:
        return curve
    names = ("natural_frequency", "frequency", "force")
    band = find_band(errors, names, quantities, others=quantities)
    return eqx.tree_at(lambda one: one.band, curve, band, is_leaf=lambda x: x is None)


def _steps(
    model: Isolator, amplitudes: Float[Array, " point"], integrator: Integrator
) -> tuple[Integrator, bool]:
    """Give steps that follow the states of a model near resonance, and whether these are too fast."""
    if is_traced(model):
        return integrator, False
    frequencies = np.asarray(_near_resonance(model, amplitudes))
    known = np.isfinite(frequencies) & (frequencies > 0.0)
    return integrator_that_follows(model, integrator, np.asarray(amplitudes)[known], frequencies[known])


@quick_jit
def _near_resonance(model: Isolator, amplitudes: Float[Array, " point"]) -> Float[Array, " point"]:
    rest = rest_displacement(model)
    return jax.vmap(lambda amplitude: _balanced(model, amplitude, rest)[0].frequency)(amplitudes)


@quick_jit
def _resonance(
    model: Isolator,
    amplitudes: Float[Array, " point"],
    natural: Float[Array, " point"],
    integrator: Integrator,
    stiff: Bool[Array, ""],
) -> BackboneCurve:
    rest = rest_displacement(model)

    still, at_rest = frozen((model, rest))

    def point(amplitude: Array) -> tuple[Lane, Array]:
        start, cycle = _balanced(still, amplitude, at_rest)
        push = jnp.hypot(start.sine, jnp.asarray(start.cosine))
        internal = jnp.stack([values[0] for values in cycle]) if cycle else jnp.zeros(0)
        inner = jnp.where(internal == 0.0, amplitude, jnp.abs(internal))
        held = integrator, amplitude, jnp.concatenate([jnp.stack([push, push, start.frequency]), inner])

        def improve(_: Array | int, unknown: Array) -> Array:
            left, slope = value_and_jacobian(
                lambda at: _out_of_resonance(at, (still, at_rest), held)[0], unknown
            )
            step = solve(slope, left)
            return unknown - step * jnp.minimum(1.0, _AMPLITUDE_STEP / jnp.max(jnp.abs(step)))

        quadratures = jnp.stack([start.sine, jnp.asarray(start.cosine)]) / push
        begin = jnp.concatenate([quadratures, jnp.ones(1), internal / inner])
        found = jax.lax.fori_loop(0, _CORRECTIONS_A_POINT, improve, begin)
        left, (drive, state) = _out_of_resonance(found, (still, at_rest), held)
        good = jnp.max(jnp.abs(left)) < integrator.orbit_tolerance
        drive, state = with_derivatives((drive, state), _out_of_resonance, found, (model, rest), held)
        return Lane(state, drive, (), amplitude), good & (drive.frequency > 0.0)

    lanes, good = jax.vmap(point)(amplitudes)
    blank = jnp.where(good, 1.0, jnp.nan)
    force = jnp.hypot(lanes.drive.sine, jnp.asarray(lanes.drive.cosine))
    method = MapMethod(integrator, False, None, jnp.asarray(integrator.steps_a_period(model)))
    begin = jnp.stack(states_at_zero(model, method, lanes), axis=-1)

    def ending(well: Array) -> RESULTS:
        failed = RESULTS.where(stiff, RESULTS.stiff, RESULTS.not_converged)
        return RESULTS.where(well, RESULTS.promote(diffrax.RESULTS.successful), failed)

    return BackboneCurve(
        amplitudes,
        natural,
        lanes.drive.frequency * blank,
        force * blank,
        begin * blank[:, None],
        jax.vmap(ending)(good),
    )


def _balanced(
    model: Isolator, amplitude: Float[Array, ""], rest: Float[Array, ""]
) -> tuple[Sine, tuple[Array, ...]]:
    """Give the one-harmonic drive at which its part in phase with the displacement is zero."""
    # What of the drive a unit of in-phase acceleration needs: inertia, or minus one under base excitation.
    zero = jnp.zeros_like(amplitude)
    internal = (zero,) * model.internal_states
    still = (rest, zero, *internal)
    unit = model.acceleration(still, Instant(zero + 1.0)) - model.acceleration(still, Instant(zero))

    def approach(step: Array, square: Array) -> Array:
        frequency = jnp.sqrt(square) / (2.0 * math.pi)
        drive, _ = imposed_balance(model, amplitude, frequency, rest)
        moved = square + jnp.asarray(drive.cosine) * unit / amplitude
        return jnp.where(moved > 0.0, moved, 0.5 * square)

    pull = jnp.abs(model.acceleration((rest + amplitude, zero, *internal), Instant(zero))) / amplitude
    begin = jnp.where(pull > 0.0, pull, 1.0)
    square = jax.lax.fori_loop(0, _BALANCE, approach, begin)
    drive, internal, _ = balanced_motion(model, amplitude, jnp.sqrt(square) / (2.0 * math.pi), rest)
    return drive, internal


def _out_of_resonance(
    unknown: Float[Array, " unknown"],
    live: tuple[Isolator, Float[Array, ""]],
    held: tuple[Integrator, Float[Array, ""], Float[Array, " unknown"]],
) -> tuple[Float[Array, " unknown"], tuple[Sine, State]]:
    """Give what vanishes at phase resonance: the gap of the motion, and its part in phase with the drive."""
    (model, rest), (integrator, amplitude, sizes) = live, held
    sine, cosine, frequency, *internal = unknown * sizes
    drive, state = Sine(sine, cosine, frequency), (rest + amplitude, 0.0 * amplitude, *internal)
    path = trajectory(model, integrator, with_overtones(model, drive), state)
    scale = (amplitude, amplitude * drive.angular_frequency, *sizes[3:])
    open_end = [(along[-1] - along[0]) / size for along, size in zip(path, scale, strict=True)]
    turned = fundamental(path[0]) * jnp.conj(drive_amplitude(drive))
    return jnp.stack([*open_end, jnp.real(turned) / (amplitude * sizes[0])]), (drive, state)
