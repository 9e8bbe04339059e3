"""One periodic orbit of the forced isolator."""

import math
from collections.abc import Sequence

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from ..._given_numbers import given_count
from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS, is_successful
from ..._show import amount, brief, declared_numbers, number, shown
from ..._small_systems import newton
from ..._types import Lanes, as_float64, check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, Modelled, as_isolator
from ._describing_function import response_start
from ._fast_states import answer_sizes, integrator_that_follows
from ._floquet import Floquet, multipliers, stable_words
from ._half_range import half_range
from ._harmonic_balance import harmonic_balance
from ._held import is_held
from ._known_numbers import is_traced
from ._period_map import split_trajectory
from ._settled import settled
from ._shooting import ShootingSolution, closing, shoot
from ._shooting_method import ShootingMethod
from ._sine import highest_order, integrator_for, need_fundamental, recorded_sine
from ._split_period_map import Split, event_places
from ._state_path import AbstractStatePath
from ._symmetry import is_odd, is_odd_along

_EVENT_ROOM = 16
"""Times the events of a motion for which room is made first, beyond which no more is made."""

_SYMMETRIC_TO = 1e-4
"""Distance of the two halves of a motion, over its size, up to which it counts as symmetric."""

_EVENTS_AT_ENDS = 8
"""Events of the path to make room for beyond those of the closed motion: one at its end may count twice."""


@shown
class Orbit(AbstractStatePath):
    """A periodic orbit of the forced isolator.

    Attributes:
        model: the isolator.
        excitation: the drive.
        periods: drive periods after which the motion repeats.
        y0: displacement [m], velocity [m/s], internal states at t = 0; NaN where none was found.
        floquet: multipliers over `periods` drive periods.
        symmetric: whether the second half of the motion is minus the first.
        time: over one period of the motion [s].
        states: along `time`.
        error: integration error of the multipliers, by halving the steps.
        result: whether the orbit was found, or why not.
    """

    model: Isolator
    excitation: Harmonic
    periods: int = eqx.field(static=True)
    y0: Float[Array, " state"]
    floquet: Floquet
    symmetric: Bool[Array, ""]
    time: Float[Array, " time"]
    states: Float[Array, "time state"]
    error: Float[Array, ""]
    result: RESULTS

    @property
    def amplitude(self) -> Float[Array, ""]:
        """Half the peak-to-peak displacement [m], each extreme where the velocity vanishes."""
        drive = recorded_sine(self.model, self.excitation.amplitude, self.excitation.frequency)
        return half_range(self.model, drive, tuple(self.states.T), float(self.periods))

    @property
    def harmonics(self) -> Array:
        """Complex amplitudes of the displacement [m]: mean, then each harmonic of the motion's own period.

        The k-th is X of `X exp(i k omega t)`, with the modulus of the amplitude.
        """
        spectrum = jnp.fft.rfft(self.displacement[:-1]) / (self.time.size - 1)
        return jnp.concatenate([spectrum[:1], 2.0 * spectrum[1:]])

    def _headline(self) -> str:
        at = declared_numbers(self.excitation)
        radius = np.abs(np.asarray(self.floquet.multipliers)[0])
        if np.isnan(radius):
            return f"none found at {at}. {brief(self.result)}"
        x = np.asarray(self.states)[:, 0]
        size = amount(0.5 * (x.max() - x.min()), "m")
        return f"{stable_words(radius)}, {size} at {at}, spectral radius {number(radius)}"

    def _rows(self) -> list[str]:
        return ["model", "periods", "y0", "floquet", "symmetric", "error", "result"]


def find_periodic_orbit(
    model: Isolator | Modelled,
    excitation: Harmonic,
    *,
    start: Sequence[Lanes | float] | Float[Array, " state"] | None = None,
    periods: int = 1,
    symmetric: bool | None = None,
    integrator: Integrator | None = None,
    solver: optx.AbstractRootFinder | None = None,
) -> Orbit:
    """Find a periodic orbit and its Floquet multipliers.

    Newton's method on the period map, with its derivative by forward mode; the motion is split where a law
    jumps or bends, such as |v|, dry friction and stops, and the steps are refined until the multipliers are
    good to 1e-9 or better. Where they are not, `result` says `not_accurate` and `error` by how much. Works
    under `jax.jit`, `jax.vmap`, `jax.jacfwd` and `jax.grad` (by the implicit function theorem).

    Args:
        model: the isolator.
        excitation: the drive; harmonics that elements of the model add to it act, too.
        start: state at t = 0 to start from; the one-harmonic balance with the smallest motion if omitted, and
            where this leads nowhere (and is not inside `jax.jit` or `jax.vmap`) the balance of several.
        periods: drive periods after which the motion repeats (2 for an orbit of doubled period).
        symmetric: whether to close half a period on minus itself, at which only symmetric orbits of odd
            models close; if omitted, so for an odd model without a `start`.
        integrator: solver of the equation of motion and its steps.
        solver: root finder; `optimistix.Newton` if omitted.

    Returns:
        The orbit. Where none was found, its numbers are NaN and `result` says why.

    Raises:
        ValueError: if the frequency is not positive, `start` has the wrong length, `periods` is no positive
            count, `symmetric` is asked of a model that is not odd, or the drive has harmonics but no
            amplitude.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Aprille & Trick 1972, Proc. IEEE 60:108 (shooting); Nayfeh & Balachandran 1995, ch. 3 and 5.

    Example:
        >>> drive = ij.Harmonic(amplitude=150.0, frequency=4.3)
        >>> orbit = ij.find_periodic_orbit(ij.paper.y_direction(), drive)
        >>> ij.is_successful(orbit.result), float(orbit.floquet.spectral_radius) < 1.0
        (True, True)
    """
    model = as_isolator(model)
    check_float64()
    integrator = integrator_for(frozen(model), integrator)
    tolerance = integrator.orbit_tolerance
    solver = newton(tolerance) if solver is None else solver
    size = 2 + model.internal_states
    if start is not None and len(start) != size:
        raise ValueError(f"Argument `start` must hold {size} states, but holds {len(start)}.")
    periods = given_count("periods", periods)
    still, drive = frozen((model, excitation))
    frequency = drive.frequency
    if not isinstance(frequency, Tracer) and not 0.0 < float(frequency) < math.inf:
        raise ValueError(f"Argument `excitation` must have a positive frequency, but it is {frequency} Hz.")
    need_fundamental(still, drive.amplitude)
    odd = periods == 1 and (symmetric or (symmetric is None and start is None))
    # Of a model that is being traced nothing can be said; whoever asks for symmetric orbits then knows.
    traced = is_traced(still)
    half = odd and (bool(symmetric) if traced else is_odd(still))
    if symmetric and not half:
        raise ValueError("Argument `symmetric` must be False for a model that is not odd, but is True.")
    begin = None if start is None else frozen(jnp.stack([as_float64(value) for value in start]))
    method = ShootingMethod(integrator, periods, half)
    orbit = _orbit(model, excitation, *_sought(still, drive, method, solver, begin))
    if (
        not half
        or traced
        or isinstance(frozen(orbit.y0), Tracer)
        or not np.all(np.isfinite(frozen(orbit.y0)))
    ):
        return orbit
    if is_odd_along(still, np.asarray(frozen(orbit.states)).T):
        return orbit
    # A law on one side only, between the displacements at which oddness is tried.
    if symmetric:
        raise ValueError("Argument `symmetric` must be False for a model that is not odd, but is True.")
    method = ShootingMethod(integrator, periods, False)
    return _orbit(model, excitation, *_sought(still, drive, method, solver, begin))


def _sought(
    model: Isolator,
    drive: Harmonic,
    method: ShootingMethod,
    solver: optx.AbstractRootFinder,
    begin: Float[Array, " state"] | None,
) -> tuple[ShootingMethod, ShootingSolution, Bool[Array, ""]]:
    """Search, once more with steps that follow fast states where this fails; say whether these are stiff."""
    places, most = event_places(model, method.turns), event_places(model, _EVENT_ROOM * method.turns)
    solution, stiff = _shoot(model, drive, method, solver, begin, places), False
    if isinstance(solution.found, Tracer):
        return method, solution, jnp.asarray(stiff)
    if not (solution.found & solution.accurate):
        # Steps that internal states need, before room for events: too few make events that are none.
        frequency = np.atleast_1d(np.asarray(drive.frequency))
        motion = answer_sizes(model, jnp.atleast_1d(drive.amplitude), jnp.asarray(frequency))
        finer, stiff = integrator_that_follows(model, method.integrator, np.asarray(motion), frequency)
        if finer.steps_per_period > method.integrator.steps_per_period:
            method = ShootingMethod(finer, method.periods, method.half)
            solution = _shoot(model, drive, method, solver, begin, places)
    while not solution.split.complete and places < most:
        places *= 2
        solution = _shoot(model, drive, method, solver, begin, places)
    if begin is None and not solution.found:
        order = highest_order(model)
        balance = harmonic_balance(
            model,
            drive,
            harmonics=max(7, 2 * order),
            samples=max(128, 16 * order),
            integrator=method.integrator,
        )
        if is_successful(balance.result):
            solution = _shoot(model, drive, method, solver, balance.y0, places)
        if not solution.found:
            start = _settled(model, drive, method.integrator)
            solution = _shoot(model, drive, method, solver, start, places)
    return method, solution, jnp.asarray(stiff)


def closed_by_half(orbit: Orbit) -> bool:
    """Say whether an orbit was closed with the half-period map: then alone has it multipliers over it.

    Args:
        orbit: of known numbers.

    Returns:
        Whether it was.
    """
    return bool(np.all(np.isfinite(np.asarray(orbit.floquet.half_period_multipliers))))


@quick_jit
def _shoot(
    model: Isolator,
    excitation: Harmonic,
    method: ShootingMethod,
    solver: optx.AbstractRootFinder,
    start: Float[Array, " state"] | None,
    places: int,
) -> ShootingSolution:
    if start is None:
        start = response_start(model, excitation.amplitude, excitation.frequency)
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    return shoot(model, method, solver, drive, start, places)


@quick_jit
def _settled(model: Isolator, drive: Harmonic, integrator: Integrator) -> Array:
    return settled(model, integrator, jnp.asarray(drive.amplitude), jnp.asarray(drive.frequency))


@quick_jit
def _orbit(
    model: Isolator,
    excitation: Harmonic,
    method: ShootingMethod,
    solution: ShootingSolution,
    stiff: Bool[Array, ""],
) -> Orbit:
    found = solution.found & jnp.all(jnp.isfinite(solution.matrix))
    blank = jnp.where(found, 1.0, jnp.nan)
    live, held = (model, excitation), (method, solution.split)
    known = solution.state, solution.matrix, _path(solution.state, frozen(live), held)
    state, matrix, path = with_derivatives(known, _closing_with_path, solution.root, live, held)
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    matrix = matrix * blank
    if method.half:
        roots = multipliers(matrix)
        floquet = Floquet(roots * roots, roots, matrix @ matrix)
    else:
        floquet = Floquet(multipliers(matrix), jnp.full(matrix.shape[0], jnp.nan + 0j), matrix)
    finite = jnp.all(jnp.isfinite(path))
    good = RESULTS.promote(diffrax.RESULTS.successful)
    failed = RESULTS.where(finite, RESULTS.not_converged, RESULTS.not_finite)
    failed = RESULTS.where(stiff, RESULTS.stiff, failed)
    failed = RESULTS.where(is_held(model, drive), RESULTS.sticks, failed)
    accurate = RESULTS.where(solution.accurate, good, RESULTS.not_accurate)
    result = RESULTS.where(found, accurate, failed)
    middle = (path.shape[0] - 1) // 2
    size = jnp.max(jnp.abs(path), axis=0)
    apart = jnp.abs(path[middle] + path[0])
    mirrored = jnp.array(True) if method.half else jnp.all(apart <= _SYMMETRIC_TO * size)
    time = jnp.linspace(0.0, 1.0, path.shape[0]) * method.periods / excitation.frequency
    return Orbit(
        model=model,
        excitation=excitation,
        periods=method.periods,
        y0=state * blank,
        floquet=floquet,
        symmetric=found & (mirrored if method.periods == 1 else False),
        time=time,
        states=path * blank,
        error=solution.error * blank,
        result=result,
    )


def _path(
    state: Float[Array, " state"], live: tuple[Isolator, Harmonic], held: tuple[ShootingMethod, Split]
) -> Float[Array, "time state"]:
    """Give the states along an orbit, from the one at t = 0."""
    (model, excitation), (method, split) = live, held
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    lasting = float(method.periods)
    # As many events as the split motion has, which may last for a half, and some at its ends.
    places = round(lasting / method.turns) * split.crossings.phases.size + _EVENTS_AT_ENDS
    path = split_trajectory(model, method.integrator, drive, tuple(state), lasting, places)
    return jnp.stack(path, axis=-1)


def _closing_with_path(
    root: Float[Array, " unknown"], live: tuple[Isolator, Harmonic], held: tuple[ShootingMethod, Split]
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Give what vanishes for an orbit; its state, the matrix, and the states along it."""
    left, (state, matrix) = closing(root, live, held)
    return left, (state, matrix, _path(state, live, held))
