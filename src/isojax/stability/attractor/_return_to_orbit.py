"""How a disturbed motion comes back to its orbit."""

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import brief, shown
from ..._small_systems import solve
from ..._types import Lanes, check_float64
from ...models import Integrator, Isolator, State
from ..orbit import Orbit, PeriodicDrive, integrator_for, modulus, multipliers, period_map, recorded_sine
from ._stroboscope import bounded_or_not

_FIXED_POINT_STEPS = 4
"""Steps of Newton's method from the orbit to the fixed point of the fixed steps, 1e-5 of it away."""

_LOST_IN_ROUNDING = 1e-9
"""Distance, in sizes of the motion, below which rounding shows in the rate."""

_PAIRS = 3
"""Periods per state from which the rate is taken: those of the smallest distances, where it is linear."""

_BACK = 1e-3
"""Share of the first distance at which the motion counts as returned."""


@shown
class ReturnToOrbit(eqx.Module):
    """The way of a disturbed motion back to its orbit, or away from it.

    Attributes:
        orbit: the orbit.
        states: displacement [m], velocity [m/s], internal states at the start and after each of the orbit's
            own periods.
        distance: to the orbit then: the root of the summed squares of the states' differences, each over the
            size of that state along the orbit.
        rate: factor by which small differences shrink over one of the orbit's periods: the spectral radius of
            the linear map that best carries each into the next; NaN where too few were seen.
        returned: whether the last distance is below a thousandth of the first.
        result: whether the motion stayed bounded.
    """

    orbit: Orbit
    states: Float[Array, "period state"]
    distance: Float[Array, " period"]
    rate: Float[Array, ""]
    returned: Bool[Array, ""]
    result: RESULTS

    @property
    def spectral_radius(self) -> Float[Array, ""]:
        """Of the orbit's multipliers: what `rate` must come to."""
        return self.orbit.floquet.spectral_radius

    def _headline(self) -> str:
        back = (
            "comes back to the orbit"
            if bool(np.asarray(self.returned))
            else "does not come back to the orbit"
        )
        return f"{back}, rate {brief(self.rate)} a period"


def return_to_orbit(
    model: Isolator,
    orbit: Orbit,
    perturbation: Sequence[Lanes | float] | Float[Array, " state"] | Any,
    *,
    periods: int = 40,
    integrator: Integrator | None = None,
) -> ReturnToOrbit:
    """Follow the motion from a disturbed state of an orbit.

    Args:
        model: the isolator.
        orbit: as `find_periodic_orbit` gave it.
        perturbation: what is added to the state at t = 0: displacement [m], velocity [m/s], internal states.
        periods: how many of the orbit's own periods to follow.
        integrator: solver and steps; 256 steps a drive period if omitted.

    Returns:
        The way back.

    Raises:
        ValueError: if the orbit was not found, `perturbation` has the wrong length or is zero, or `periods`
            is not positive.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: the paper, section 5, Figs. 20 and 21.
    """
    check_float64()
    periods = given_count("periods", periods)
    integrator = integrator_for(model, integrator, 256)
    kick = jnp.asarray(np.asarray(perturbation, dtype=float))
    if kick.shape != orbit.y0.shape:
        raise ValueError(
            f"Argument `perturbation` must hold {orbit.y0.size} states, but has shape {kick.shape}."
        )
    if not bool(jnp.any(kick != 0.0)) or not bool(jnp.all(jnp.isfinite(kick))):
        raise ValueError(f"Argument `perturbation` must be finite and not zero, but is {kick}.")
    if not bool(jnp.all(jnp.isfinite(jax.lax.stop_gradient(orbit.y0)))):
        raise ValueError("Argument `orbit` must be an orbit that was found, but its state is NaN.")
    return _return(model, orbit, kick, periods, integrator)


@quick_jit
def _return(
    model: Isolator, orbit: Orbit, kick: Float[Array, " state"], periods: int, integrator: Integrator
) -> ReturnToOrbit:
    drive = recorded_sine(model, orbit.excitation.amplitude, orbit.excitation.frequency)
    size = jnp.max(jnp.abs(orbit.states), axis=0)
    size = jnp.where(size > 0.0, size, 1.0)
    fixed = _fixed_point(model, integrator, drive, orbit, size)

    def body(state: State, _: None) -> tuple[State, State]:
        moved = _after_one(model, integrator, drive, orbit, state)
        return moved, moved

    begin = tuple(fixed + kick)
    _, path = jax.lax.scan(body, begin, length=periods)
    states = jnp.concatenate([jnp.stack(begin)[None], jnp.stack(path, axis=-1)])
    finite = jnp.all(jnp.isfinite(states))
    away = (states - fixed[None]) / size[None]
    distance = jnp.sqrt(jnp.sum(away**2, axis=1))
    blank = jnp.where(finite, 1.0, jnp.nan)
    return ReturnToOrbit(
        orbit,
        states * blank,
        distance * blank,
        _rate(away, distance) * blank,
        distance[-1] < _BACK * distance[0],
        bounded_or_not(finite),
    )


def _after_one(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, orbit: Orbit, state: State
) -> State:
    return period_map(model, integrator, drive, state, turns=float(orbit.periods))


def _fixed_point(
    model: Isolator, integrator: Integrator, drive: PeriodicDrive, orbit: Orbit, size: Float[Array, " state"]
) -> Float[Array, " state"]:
    """Give the orbit of the very steps that the disturbed motion takes, so that it can be reached."""

    def gap(scaled: Array) -> Array:
        moved = _after_one(model, integrator, drive, orbit, tuple(scaled * size))
        return jnp.stack(moved) / size - scaled

    def improve(_: Array, scaled: Array) -> Array:
        return scaled - solve(jax.jacfwd(gap)(scaled), gap(scaled))

    return jax.lax.fori_loop(0, _FIXED_POINT_STEPS, improve, orbit.y0 / size) * size


def _rate(away: Float[Array, "period state"], distance: Float[Array, " period"]) -> Float[Array, ""]:
    """Give the spectral radius of the linear map that best carries each difference into the next."""
    states = away.shape[1]
    wanted = min(_PAIRS * states, away.shape[0] - 1)
    if wanted < states:
        return jnp.array(math.nan)
    smallest = jnp.minimum(distance[:-1], distance[1:])
    usable = jnp.where(smallest > _LOST_IN_ROUNDING, smallest, jnp.inf)
    order = jnp.argsort(usable)[:wanted]
    weight = jnp.where(jnp.isfinite(usable[order]), 1.0 / distance[order], 0.0)[:, None]
    before, after = away[:-1][order] * weight, away[1:][order] * weight
    # A direction that died out long ago leaves nothing to estimate its own multiplier from.
    left, sizes, right = jnp.linalg.svd(before, full_matrices=False)
    inverse = jnp.where(sizes > 1e-8 * sizes[0], 1.0 / sizes, 0.0)
    carried = right.T @ (inverse[:, None] * (left.T @ after))
    enough = jnp.sum(jnp.isfinite(usable[order])) >= states
    return jnp.where(enough, modulus(multipliers(carried.T)[0]), jnp.nan)
