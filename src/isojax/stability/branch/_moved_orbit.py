"""A known orbit found again for another isolator or drive: on its own piece of the branch, or nowhere.

Along the amplitude of the drive a branch rises and falls by turns, and a fold separates two such pieces. An
orbit belongs to one of them. Where that piece of the other model does not reach the amplitude any more, the
orbit is gone, though others are there that Newton's method from the known one would find.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._types import Scalar, as_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator
from ..orbit import (
    Orbit,
    ShootingMethod,
    closed_by_half,
    find_periodic_orbit,
    integrator_for,
    recorded_sine,
    state_scale,
    trajectory,
)
from ._moved_point import Move, Place, zero_along
from ._parameter_family import ParameterFamily, family_of

_STEPS = 0.02 * 1.16 ** np.arange(56)
"""Steps along the branch either way, over the size of motion and drive: a resonance may move far."""

_ON_BRANCH_TO = 0.02
"""Distance over the size of the motion up to which the orbit found is that of the branch, whose steps do not
stop at kinks."""


def find_orbit_again(
    orbit: Orbit, model: Isolator, amplitude: Scalar | None = None, frequency: Scalar | None = None
) -> Orbit:
    """Find a known orbit again for another isolator or drive.

    Args:
        orbit: the known one; no number of it is traced.
        model: the isolator.
        amplitude: of the drive, in place of that of the orbit [N, or m/s^2 for base excitation].
        frequency: of the drive, in place of that of the orbit [Hz].

    Returns:
        The orbit. Its numbers are NaN where it is gone, or the branch was not followed to it.
    """
    own = orbit.excitation
    drive = Harmonic(
        own.amplitude if amplitude is None else amplitude, own.frequency if frequency is None else frequency
    )
    method = ShootingMethod(_integrator(orbit), orbit.periods, closed_by_half(orbit))
    start, size = _moved_start(frozen(orbit), method, *frozen((model, drive)))
    found = find_periodic_orbit(
        model,
        drive,
        start=start,
        periods=orbit.periods,
        symmetric=method.half,
        integrator=method.integrator,
    )
    return _only_near(found, start, size)


def _integrator(orbit: Orbit) -> Integrator:
    """Give steps as short as those of the known orbit, which a stiff law may have asked for."""
    usual = integrator_for(frozen(orbit.model), None)
    share = (orbit.time.size - 1) / (orbit.periods * usual.steps_a_period(orbit.model))
    return usual.with_steps(max(usual.steps_per_period, 2 * round(0.5 * share * usual.steps_per_period)))


@quick_jit
def _moved_start(
    orbit: Orbit, method: ShootingMethod, model: Isolator, drive: Harmonic
) -> tuple[Float[Array, " state"], Float[Array, " state"]]:
    """Give the state on the branch of another model, NaN where the orbit is gone, and the size of states."""
    old = orbit.excitation
    path = trajectory(
        orbit.model,
        method.integrator,
        recorded_sine(orbit.model, old.amplitude, old.frequency),
        tuple(orbit.y0),
        turns=method.turns,
    )
    scale = state_scale(path)
    unit = jnp.where(old.amplitude == 0.0, 1.0, old.amplitude)
    # The model moves first, under the drive as it was; another amplitude is sought along the branch.
    wanted = drive.amplitude / unit

    def family(isolator: Isolator, at: Harmonic, unit: Array) -> ParameterFamily:
        ends = jnp.zeros(1), unit[None]
        drives = as_float64(at.amplitude), as_float64(at.frequency)
        return family_of(isolator, drives, ends, ("amplitude",))

    def test(unknown: Array, _: Array, __: Array) -> Array:
        return unknown[-1] - wanted

    families = family(orbit.model, old, unit), family(model, drive, unit)
    move = Move(*families, method, scale, test)
    origin = jnp.concatenate([orbit.y0 / scale, (old.amplitude / unit)[None]])
    across = move.across(origin)
    place, line = move.line(origin, across, _STEPS)
    found = zero_along(place, line, _STEPS, jnp.asarray(1.0), _own_piece(line))
    return found.unknown[:-1] * scale, scale * jnp.maximum(jnp.abs(wanted), 1.0)


def _own_piece(line: Place) -> Bool[Array, " place"]:
    """Say which points of a branch lie next to the piece between two folds that holds its middle.

    The known orbit lies where the drive rises along the branch. Past a fold it falls: then the nearest piece
    counts on which it rises.
    """
    right = line.sound & (line.tangent[:, -1] > 0.0)
    ends = np.concatenate([[0.0], np.cumsum(_STEPS)])
    away = jnp.asarray(np.concatenate([ends[:0:-1], ends]))
    nearest = jnp.argmin(jnp.where(right, away, jnp.inf))
    piece = jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(right[1:] != right[:-1])])
    own = jnp.pad(right & (piece == piece[nearest]), 1)
    return own[1:-1] | own[:-2] | own[2:]


@quick_jit
def _only_near(orbit: Orbit, start: Float[Array, " state"], size: Float[Array, " state"]) -> Orbit:
    """Give an orbit where it is the one on the branch; NaN else."""
    near = jnp.max(jnp.abs(frozen(orbit.y0) - start) / size) < _ON_BRANCH_TO  # False of NaN
    other = ~jnp.all(jnp.isfinite(start)) | jnp.isfinite(orbit.y0[0])
    gone = ~near & other & (orbit.result != RESULTS.sticks)
    blank = jnp.where(near, 1.0, jnp.nan)
    return dataclasses.replace(
        orbit,
        y0=orbit.y0 * blank,
        floquet=jax.tree.map(lambda values: values * blank, orbit.floquet),
        symmetric=orbit.symmetric & near,
        states=orbit.states * blank,
        error=orbit.error * blank,
        result=RESULTS.where(gone, RESULTS.gone, orbit.result),
    )
