"""How far given motions are from the folds of their own branches, in the drive's amplitude and frequency."""

import math
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._small_systems import solve
from ..._types import check_float64
from ...models import Integrator, Isolator, as_isolator
from ..orbit import (
    is_odd,
    modulus,
    multipliers,
    period_map,
    recorded_sine,
    refuse_transformed,
    state_scale,
    trajectory,
    value_and_jacobian,
)
from ._arc_length import REACHED_BOUND, Departure, Followed, Stride, follow
from ._continuation import tracing_steps

_SETTLING_PERIODS = 4
"""Periods that a start is simulated for first: internal states, which no one measures, settle, and the
motion leans to the stable side of a fold."""

_ORBIT_STEPS = 12
"""Steps of Newton's method for an orbit."""

_CLOSED_TO = 1e-6
"""Largest last step of Newton's method, over the size of the motion: at a kink of the law it may stall far
above rounding."""

_STRIDE = Stride(longest=0.1, most=96, to_turn=True)
"""Steps along a branch, over the size of the motion and the reach, and points to make room for."""

_FOLLOWED_AT_ONCE = 128
"""Motions followed together."""

_WAYS = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
"""Amplitude down and up, frequency down and up."""


@shown
class NearestFolds(eqx.Module):
    """Periodic orbits next to given motions, and where their branches fold.

    A fold counts where the orbit's own branch leads to it as the drive changes; folds of other orbits at the
    same drive do not. It is infinite where there is none within reach, NaN where the branch was lost.

    Attributes:
        amplitude: F0 of each motion [N, or m/s^2 for base excitation].
        frequency: f of each motion [Hz].
        y0: state of the orbit at t = 0, SI units.
        response: half the peak-to-peak displacement [m].
        multipliers: over one drive period, in falling modulus.
        fold_amplitude: amplitudes at which the branch folds at the motion's frequency, below and above it.
        fold_frequency: frequencies at which it folds at the motion's amplitude, below and above it [Hz].
        result: whether an orbit was found; if not, its numbers are NaN.
    """

    amplitude: Float[Array, " motion"]
    frequency: Float[Array, " motion"]
    y0: Float[Array, "motion state"]
    response: Float[Array, " motion"]
    multipliers: Complex[Array, "motion multiplier"]
    fold_amplitude: Float[Array, "motion side"]
    fold_frequency: Float[Array, "motion side"]
    result: RESULTS

    @property
    def spectral_radius(self) -> Float[Array, " motion"]:
        """Largest modulus of the multipliers; stable below one."""
        return modulus(self.multipliers[..., 0])

    @property
    def amplitude_distance(self) -> Float[Array, " motion"]:
        """Change of the drive's amplitude to the nearest fold [N, or m/s^2]."""
        return jnp.min(jnp.abs(self.fold_amplitude - self.amplitude[:, None]), axis=1)

    @property
    def frequency_distance(self) -> Float[Array, " motion"]:
        """Change of the drive's frequency to the nearest fold [Hz]."""
        return jnp.min(jnp.abs(self.fold_frequency - self.frequency[:, None]), axis=1)


def find_nearest_folds(
    model: Isolator,
    amplitude: Any,
    frequency: Any,
    starts: Any,
    *,
    reach: tuple[float, float] = (0.3, 0.1),
    integrator: Integrator | None = None,
) -> NearestFolds:
    """Find the periodic orbits next to given motions, their multipliers, and the nearest folds.

    Newton's method on the period map from each start, a few periods later; of an odd model on that of half a
    period. From each orbit its branch is then followed by pseudo-arc-length four ways, to less and more drive
    and to lower and higher frequency, and the point at which the parameter first turns back is read off a
    cubic through the two points around it. All motions go side by side, in fixed steps; where laws jump, as
    friction and stops do, steps end at the jumps. Multipliers are good to 2e-4, folds to 1e-4 of the drive.

    Args:
        model: the isolator.
        amplitude: F0 of each motion, positive [N, or m/s^2 for base excitation].
        frequency: f of each motion, positive [Hz].
        starts: states at t = 0, where the drive passes zero upwards, motion first [SI units].
        reach: how far folds are sought, as shares of the amplitude and of the frequency.
        integrator: solver and steps; 256 a period if omitted.

    Returns:
        Orbits and folds.

    Raises:
        ValueError: if JAX traces or differentiates the model, the lists differ in length, a drive is not
            positive, a start has the wrong number of states, or a reach is not between 0 and 1.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Keller 1977, Applications of Bifurcation Theory, p. 359 (arc length); Nayfeh & Balachandran 1995,
    sec. 3.2 (multipliers) and 6.1.
    """
    model = as_isolator(model)
    check_float64()
    refuse_transformed(
        model,
        "Folds to differentiate are special points of `isojax.continue_branch`, and "
        "`isojax.find_again(point, model)` finds one again under jax.jit, jax.vmap, jax.jacfwd and jax.grad.",
    )
    drive = np.stack(np.broadcast_arrays(np.atleast_1d(amplitude), np.atleast_1d(frequency))).astype(float)
    begin = np.asarray(starts, dtype=float)
    count, size = drive.shape[1], 2 + model.internal_states
    if drive.ndim != 2 or not np.all(np.isfinite(drive) & (drive > 0.0)):
        raise ValueError("Arguments `amplitude` and `frequency` must be lists of positive numbers.")
    if begin.shape != (count, size):
        raise ValueError(f"Argument `starts` must have shape {(count, size)}, but has shape {begin.shape}.")
    if not all(0.0 < share < 1.0 for share in reach):
        raise ValueError(f"Argument `reach` must lie between 0 and 1, but is {reach}.")
    integrator = tracing_steps(model, integrator)
    turns = 0.5 if is_odd(model) else 1.0
    lanes = min(_FOLLOWED_AT_ONCE, 1 << max(2, (count - 1).bit_length()))
    parts = []
    for first in range(0, count, lanes):
        # Filled up by repeating the last, so that few shapes are compiled.
        chosen = np.minimum(np.arange(first, first + lanes), count - 1)
        pushes, rates = jnp.asarray(drive[0, chosen]), jnp.asarray(drive[1, chosen])
        orbit = _orbits(model, integrator, turns, pushes, rates, jnp.asarray(begin[chosen]))
        folds = _folds(model, integrator, turns, (pushes, rates), jnp.asarray(reach), orbit)
        fold_at = jnp.where(orbit.found[:, None], folds, jnp.nan)
        parts.append(jax.tree.map(lambda it, n=count - first: it[:n], (orbit, fold_at)))
    orbit, fold_at = jax.tree.map(lambda *each: jnp.concatenate(each), *parts)
    # Ways down come before ways up.
    side = np.array([[-1.0, 1.0, -1.0, 1.0]])
    share = np.asarray(fold_at)
    value = np.where(np.isinf(share), side * np.inf, drive.T[:, [0, 0, 1, 1]] * (1.0 + side * share))
    good = RESULTS.promote(diffrax.RESULTS.successful)
    result = jax.vmap(
        lambda found, finite: RESULTS.where(
            found, good, RESULTS.where(finite, RESULTS.not_converged, RESULTS.not_finite)
        )
    )(orbit.found, orbit.finite)
    blank = jnp.where(orbit.found, 1.0, jnp.nan)
    return NearestFolds(
        jnp.asarray(drive[0]),
        jnp.asarray(drive[1]),
        orbit.y0 * blank[:, None],
        orbit.response * blank,
        jnp.where(orbit.found[:, None], orbit.multipliers, jnp.nan + 0j),
        jnp.asarray(value[:, :2]),
        jnp.asarray(value[:, 2:]),
        result,
    )


class _Orbits(eqx.Module):
    """Orbits of a batch: state at t = 0, size of each state, and what is known of them."""

    y0: Float[Array, "*motion state"]
    scale: Float[Array, "*motion state"]
    response: Float[Array, "*motion"]
    multipliers: Complex[Array, "*motion multiplier"]
    found: Bool[Array, "*motion"]
    finite: Bool[Array, "*motion"]


@quick_jit
def _orbits(
    model: Isolator,
    integrator: Integrator,
    turns: float,
    amplitude: Float[Array, " motion"],
    frequency: Float[Array, " motion"],
    starts: Float[Array, "motion state"],
) -> _Orbits:
    def lane(push: Array, rate: Array, start: Array) -> _Orbits:
        drive = recorded_sine(model, push, rate)

        def period(_: Array | int, state: tuple[Array, ...]) -> tuple[Array, ...]:
            return period_map(model, integrator, drive, state)

        settled = jax.lax.fori_loop(0, _SETTLING_PERIODS, period, tuple(start))
        scale = state_scale(trajectory(model, integrator, drive, settled))

        def image(scaled: Array) -> Array:
            moved = period_map(model, integrator, drive, tuple(scaled * scale), turns=turns)
            return jnp.stack(moved) / scale

        def newton(_: Array | int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            scaled = carry[0]
            moved, slope = value_and_jacobian(image, scaled)
            change = solve(jnp.eye(scaled.size) - slope, moved - scaled)
            size = jnp.max(jnp.abs(change))
            # Far off, a full step may leave the basin of the orbit that the start is near to.
            return scaled + jnp.minimum(1.0, 0.3 / jnp.maximum(size, 1e-300)) * change, size, slope

        first = jnp.stack(settled) / scale
        begin = (first, jnp.asarray(jnp.inf), jnp.zeros((first.size, first.size)))
        scaled, last, slope = jax.lax.fori_loop(0, _ORBIT_STEPS, newton, begin)
        roots = multipliers(scale[:, None] * slope / scale[None])
        roots = roots * roots if turns == 0.5 else roots
        path = trajectory(model, integrator, drive, tuple(scaled * scale))
        own = state_scale(path)
        response = 0.5 * (jnp.max(path[0]) - jnp.min(path[0]))
        finite = jnp.all(jnp.isfinite(scaled)) & jnp.all(jnp.isfinite(jnp.abs(roots)))
        return _Orbits(scaled * scale, own, response, roots, finite & (last < _CLOSED_TO), finite)

    return jax.vmap(lane)(amplitude, frequency, starts)


@quick_jit
def _folds(
    model: Isolator,
    integrator: Integrator,
    turns: float,
    drives: tuple[Float[Array, " motion"], Float[Array, " motion"]],
    reach: Float[Array, "2"],
    orbits: _Orbits,
) -> Float[Array, "motion way"]:
    """Give the first fold each way, as a share of the own drive; infinite where there is none."""
    size = orbits.y0.shape[1]
    last = jnp.zeros(size + 1).at[-1].set(1.0)

    def lane(push: Array, rate: Array, state: Array, scale: Array, way: Array) -> Array:
        change = way * reach

        def open_end(u: Array) -> Array:
            drive = recorded_sine(model, push * (1.0 + u[-1] * change[0]), rate * (1.0 + u[-1] * change[1]))
            moved = period_map(model, integrator, drive, tuple(u[:-1] * scale), turns=turns)
            return jnp.stack(moved) / scale - u[:-1]

        first = jnp.concatenate([state / scale, jnp.zeros(1)])
        curve = follow(open_end, Departure(first, last, last), size, _STRIDE)
        return _first_turn(curve) * jnp.sum(jnp.abs(change))

    ways = jnp.asarray(_WAYS)
    over_ways = jax.vmap(lane, in_axes=(None, None, None, None, 0))
    return jax.vmap(over_ways, in_axes=(0, 0, 0, 0, None))(*drives, orbits.y0, orbits.scale, ways)


def _first_turn(curve: Followed) -> Float[Array, ""]:
    """Give the parameter at which a curve first turns back, by the cubic through points and tangents."""
    rates, values = curve.tangents[:, -1], curve.unknowns[:, -1]
    place = jnp.arange(rates.shape[0] - 1)
    turns = (rates[:-1] > 0.0) & (rates[1:] <= 0.0) & (place < curve.found - 1)
    at = jnp.argmax(turns)
    length = jnp.linalg.norm(curve.unknowns[at + 1] - curve.unknowns[at])
    begin, end = values[at], values[at + 1]
    up, down = rates[at] * length, rates[at + 1] * length
    # Derivative of the cubic: up + 2 b t + 3 c t^2, whose root between the points is sought.
    b, c = 3.0 * (end - begin) - 2.0 * up - down, 2.0 * (begin - end) + up + down
    share = up / (-b + jnp.sqrt(jnp.maximum(b * b - 3.0 * c * up, 0.0)))
    turned = begin + share * (up + share * (b + share * c))
    none = jnp.where(curve.ending == REACHED_BOUND, math.inf, math.nan)
    return jnp.where(jnp.any(turns), turned, none)
