"""Forced response of one isolator, by diffrax."""

import math
from collections.abc import Sequence
from typing import get_args

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._implicit import frozen, with_derivatives
from .._quick_jit import quick_jit
from .._results import RESULTS
from .._show import amount, brief, number, shown
from .._types import Lanes, as_float64, check_float64
from ..elements import AddedHarmonic
from ..excitations import AbstractExcitation
from ._as_isolator import Modelled, as_isolator
from ._instant import Instant
from ._integrator import Integrator
from ._isolator import Isolator, Quantity
from ._laws import State
from ._solve import solve_ode


@shown
class Simulation(eqx.Module):
    """A simulated record.

    Attributes:
        time: [s].
        drive: drive that acted [N, or m/s^2 for base excitation].
        displacement: [m]; relative to the base under base excitation.
        velocity: [m/s].
        acceleration: [m/s^2]; relative to the base under base excitation.
        reading: what the sensor chain records [SI unit of the quantity].
        internal: internal states of the elements.
        result: how the integration ended.
    """

    time: Float[Array, " time"]
    drive: Float[Array, " time"]
    displacement: Float[Array, " time"]
    velocity: Float[Array, " time"]
    acceleration: Float[Array, " time"]
    reading: Float[Array, " time"]
    internal: tuple[Float[Array, " time"], ...]
    result: RESULTS

    def _headline(self) -> str:
        time = np.asarray(self.time)
        return (
            f"{number(time[-1] - time[0])} s at {number(1.0 / (time[1] - time[0]))} Hz, displacement up to "
            f"{amount(np.max(np.abs(np.asarray(self.displacement))), 'm')}: {brief(self.result)}"
        )


@quick_jit
def _solve_ode(
    model: Isolator,
    excitation: AbstractExcitation,
    time: Float[Array, " time"],
    state: State,
    integrator: Integrator,
    quantity: Quantity,
    rate: float,
) -> tuple[State, diffrax.RESULTS]:
    live = model, excitation, state
    held: Held = time, integrator, quantity, rate
    states, ended = _states(frozen(live), held)
    # The loop of diffrax is left when the record ends: forwards JAX goes through it, backwards it cannot.
    return with_derivatives(states, _motion, jnp.zeros(0), live, held), ended


Held = tuple[Float[Array, " time"], Integrator, Quantity, float]


def _motion(
    root: Float[Array, "0"], live: tuple[Isolator, AbstractExcitation, State], held: Held
) -> tuple[Float[Array, "0"], State]:
    return root, _states(live, held)[0]


def _states(live: tuple[Isolator, AbstractExcitation, State], held: Held) -> tuple[State, diffrax.RESULTS]:
    (model, excitation, state), (time, integrator, quantity, rate) = live, held
    substeps = integrator.steps_per_sample(model)
    # Counted, not summed up: the steps of a zero-order hold must not drift against its samples.
    steps = jnp.arange((time.size - 1) * substeps + 1, dtype=float) / (rate * substeps)

    def field(t: Lanes, y: State) -> State:
        return model.rates(y, _acting(model, excitation, t - model.shift(t)), quantity)

    return solve_ode(field, integrator, state, time, steps)


def _acting(model: Isolator, excitation: AbstractExcitation, t: Lanes) -> Instant:
    """Give the drive at a time of its record, with the harmonics that elements add to a sine."""
    at = Instant(excitation(t), excitation.rate(t))
    for one in model.harmonics:

        def harmonic(time: Array, one: AddedHarmonic = one) -> Array:
            return one.share * excitation.harmonic(time, jnp.asarray(one.order), jnp.asarray(one.phase))

        value, rate = jax.jvp(harmonic, (jnp.asarray(t, dtype=float),), (jnp.ones_like(t, dtype=float),))
        at = at._replace(drive=at.drive + value, drive_rate=at.drive_rate + rate)
    return at


def simulate(
    model: Isolator | Modelled,
    excitation: AbstractExcitation,
    *,
    duration: float,
    rate: float = 1000.0,
    initial_state: Sequence[Lanes | float] | None = None,
    quantity: Quantity = "acceleration",
    integrator: Integrator | None = None,
) -> Simulation:
    """Integrate the forced response of an isolator.

    Args:
        model: the isolator.
        excitation: the drive.
        duration: length of the record [s].
        rate: samples a second [Hz].
        initial_state: displacement [m], velocity [m/s], internal states at t = 0; at rest if omitted.
        quantity: what the sensor measures.
        integrator: solver and steps; fixed RK4 steps locked to the samples if omitted.

    Returns:
        The simulated record, from t = 0 to `duration` inclusive. If the integration failed, every value that
        depends on it is NaN, and `result` says why.

    Raises:
        ValueError: if `duration` or `rate` is not positive and finite, the record is shorter than one sample,
            the initial state has the wrong length, or `quantity` is none of the three.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        >>> model = ij.Isolator(800.0, (ij.elements.LinearStiffness(1e6), ij.elements.LinearDamping(4e3)))
        >>> response = ij.simulate(model, ij.Harmonic(amplitude=100.0, frequency=5.0), duration=10.0)
        >>> settled = response.displacement[-1000:]
        >>> print(f"{1e3 * float(abs(settled).max()):.3f} mm")
        0.408 mm
    """
    model = as_isolator(model)
    check_float64()
    integrator = Integrator() if integrator is None else integrator
    for name, value in (("duration", duration), ("rate", rate)):
        if not 0 < value < math.inf:
            raise ValueError(f"Argument `{name}` must be positive and finite, but is {value}.")
    count = round(duration * rate)
    if count < 1:
        raise ValueError(
            f"Argument `duration` must be at least one sample of {1 / rate} s, but is {duration}."
        )
    if quantity not in get_args(Quantity):
        raise ValueError(f"Argument `quantity` must be one of {get_args(Quantity)}, but is {quantity!r}.")
    size = 2 + model.internal_states
    start = (0.0,) * size if initial_state is None else initial_state
    if len(start) != size:
        raise ValueError(f"Argument `initial_state` must hold {size} states, but holds {len(start)}.")
    state = tuple(as_float64(value) for value in start)
    time = jnp.arange(count + 1, dtype=float) / rate
    states, ended = _solve_ode(model, excitation, time, state, integrator, quantity, rate)
    acted = time - model.shift(time)
    at = jax.vmap(lambda t: _acting(model, excitation, t))(acted)
    ran = ended == diffrax.RESULTS.successful
    finite = jnp.all(jnp.isfinite(jnp.stack(states)))
    result = RESULTS.where(ran & ~finite, RESULTS.not_finite, RESULTS.promote(ended))
    good = ran & finite
    states = tuple(jnp.where(good, value, jnp.nan) for value in states)
    return Simulation(
        time,
        model.drive(at)[0],
        states[0],
        states[1],
        model.acceleration(states, at),
        model.reading(states, at, quantity),
        states[2:],
        result,
    )
