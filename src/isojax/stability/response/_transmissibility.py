"""What passes through the isolator: force to the ground, or motion from it."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import number, shown
from ..._small_systems import solve
from ..._types import Lanes, Scalar, as_float64, check_float64
from ...models import (
    Band,
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    Modelled,
    as_isolator,
    coefficient_errors,
    find_band,
)
from ..map import MapWindow, StabilityMap, found_again, stability_map, window_integrator
from ..orbit import (
    PeriodicDrive,
    Sine,
    ascending,
    integrator_for,
    period_map,
    recorded_sine,
    refuse_traced,
    trajectory,
    value_and_jacobian,
    with_overtones,
)
from ._frequency_response import fundamental

_CLOSING_STEPS = 4
"""Steps of Newton's method from an orbit of a map to machine precision."""


@shown
class Transmissibility(eqx.Module):
    """Force on the ground over the force on the mass; under base excitation absolute motion over the base's.

    Where coexisting orbits were asked for, an axis `orbit` stands in front, by rising displacement.

    Attributes:
        amplitude: of the recorded drive [N, or m/s^2 for base excitation].
        frequencies: [Hz].
        ratio: of the complex amplitudes of the fundamentals.
        peak: of half the peak-to-peak values, the harmonics included: of the forces, or of the displacements.
        spectral_radius: of each orbit; constant to JAX: `sensitivity` of a map has its derivatives.
        result: whether the orbit was found; beside NaN, why not.
        orbits: the map of one row that holds the orbits.
        count: orbits that were found at each frequency, also where only that of the smallest motion is given;
            None for a curve that was found again.
        band: of the magnitude, where a fit was given.
    """

    amplitude: Float[Array, ""]
    frequencies: Float[Array, " frequency"]
    ratio: Complex[Array, "*orbit frequency"]
    peak: Float[Array, "*orbit frequency"]
    spectral_radius: Float[Array, "*orbit frequency"]
    result: RESULTS
    orbits: StabilityMap
    count: Int[Array, " frequency"] | None = None
    band: Band | None = None

    @property
    def magnitude(self) -> Float[Array, "*orbit frequency"]:
        """Modulus of the ratio."""
        return jnp.abs(self.ratio)

    @property
    def phase(self) -> Float[Array, "*orbit frequency"]:
        """Of what passes after what drives, in (-pi, pi] [rad]."""
        return jnp.angle(self.ratio)

    @property
    def stable(self) -> Bool[Array, "*orbit frequency"]:
        """Whether each orbit is stable."""
        return self.spectral_radius < 1.0

    def _headline(self) -> str:
        ratio, band = np.abs(np.asarray(self.ratio)), np.asarray(self.frequencies)
        top = int(np.nanargmax(ratio))
        peak = f"{number(ratio.ravel()[top])} at {number(band[top % band.size])} Hz"
        return f"largest {peak}, drive {number(float(self.amplitude))}"

    def _lines(self) -> list[str]:
        elsewhere = "`frequency_response` looks for isolas between the frequencies, and for longer periods"
        if self.count is None:
            return [f"  the known orbits, found again; {elsewhere}"]
        several = np.asarray(self.frequencies)[np.asarray(self.count) > 1]
        if not several.size:
            return [f"  at these frequencies no coexisting orbit was found; {elsewhere}"]
        span = f"{number(several[0])} to {number(several[-1])} Hz"
        words = (
            f"at {several.size} of {np.size(self.frequencies)} frequencies, {span}, several orbits coexist"
        )
        if np.ndim(self.ratio) == 1:
            words += ", of which this is the one of the smallest motion: `coexisting=True` gives all"
        return [f"  {words}; {elsewhere}"]


def transmissibility(
    model: Isolator | Modelled,
    amplitude: Scalar | float,
    frequencies: Any,
    *,
    coexisting: bool = False,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> Transmissibility:
    """Give the transmissibility over frequency at one drive amplitude.

    Orbits of the period of the drive are sought at each of the frequencies, all up to three times the largest
    displacement that grows from rest without a jump. `count` and the print say where several coexist. Isolas
    that lie between two of the frequencies, and orbits of longer periods, are left to `frequency_response`.
    The force on the ground is the sum of all element forces, `restoring_force`.

    Args:
        model: the isolator.
        amplitude: of the recorded drive [N, or m/s^2 for base excitation].
        frequencies: ascending [Hz].
        coexisting: whether to give every orbit; else the one of the smallest motion.
        integrator: solver and steps; if omitted 256 a period, and more where a state of the model follows
            the motion faster.
        fit: with whose errors the curve is given a band; `model` is its model. None for no band.

    Returns:
        The transmissibility.

    Raises:
        ValueError: if the amplitude or a frequency is not positive, the frequencies do not ascend, or a state
            of the model is too fast for the steps of the `integrator` that was given.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Carrella et al. 2012, Int. J. Mech. Sci. 55:22 (force and displacement, nonlinear isolators).

    Example:
        >>> model = ij.Isolator(800.0, (ij.elements.LinearStiffness(1e6), ij.elements.LinearDamping(4e3)))
        >>> ratio = ij.transmissibility(model, 100.0, np.array([5.0, 20.0])).ratio
        >>> [f"{size:.2f}" for size in abs(ratio).ravel().tolist()]
        ['4.11', '0.10']
    """
    model = as_isolator(model)
    check_float64()
    errors = None if fit is None else coefficient_errors(fit, model)
    steps = integrator_for(frozen(model), integrator, 256)
    grid = ascending("frequencies", frequencies)
    force = as_float64(amplitude)
    refuse_traced(model, force)
    held = np.asarray(frozen(force))
    if held.ndim or not np.isfinite(held) or not held > 0.0:
        raise ValueError(f"Argument `amplitude` must be one positive number, but is {amplitude}.")
    if integrator is None:
        steps = window_integrator(frozen(model), steps, MapWindow(held[None], grid))
    every = stability_map(frozen(model), held[None], grid, coexisting=True, integrator=steps)
    orbits = every if coexisting else every.smallest()

    def curve(isolator: Isolator) -> Array:
        return jnp.abs(_of_orbits(isolator, force, orbits).ratio)[None]

    known = dataclasses.replace(_of_orbits(model, force, orbits), count=every.count[0])
    if errors is None:
        return known

    still = frozen(known)

    def others(isolator: Isolator) -> Array:
        return transmissibility_again(still, isolator).magnitude[None]

    return dataclasses.replace(known, band=find_band(errors, ("magnitude",), curve, others=others))


def transmissibility_again(
    known: Transmissibility, model: Isolator, amplitude: Float[Array, ""] | None = None
) -> Transmissibility:
    """Find the orbits of a curve again for another model, and what they pass on.

    Args:
        known: the curve, of known numbers.
        model: the isolator; traced or not.
        amplitude: of the recorded drive; that of the curve if omitted [N, or m/s^2 for base excitation].

    Returns:
        The transmissibility, without a band.
    """
    force = known.amplitude if amplitude is None else amplitude
    orbits = found_again(known.orbits, model, force - known.amplitude)
    return _of_orbits(model, force, orbits)


def _of_orbits(model: Isolator, force: Float[Array, ""], orbits: StabilityMap) -> Transmissibility:
    """Give what the orbits pass on, with derivatives by `model` and `force`, near which they were found."""
    starts, grid = orbits.y0[..., 0, :, :], orbits.frequencies
    ratio, peak = _passed(model, force, grid, starts, orbits.integrator, orbits.symmetric)
    result = jax.tree.map(lambda values: values[..., 0, :], orbits.result)
    radius = orbits.spectral_radius[..., 0, :]
    return Transmissibility(force, grid, ratio, peak, radius, result, orbits)


@quick_jit
def _passed(
    model: Isolator,
    amplitude: Float[Array, ""],
    frequencies: Float[Array, " frequency"],
    y0: Float[Array, "*orbit frequency state"],
    integrator: Integrator,
    half: bool,
) -> tuple[Complex[Array, "*orbit frequency"], Float[Array, "*orbit frequency"]]:
    shape = y0.shape[:-1]
    frequency = jnp.broadcast_to(frequencies, shape).ravel()
    # From the phase zero of the recorded drive: one that moved with the orbit would move the steps along it.
    drive = recorded_sine(model, jnp.broadcast_to(amplitude, frequency.shape), frequency)
    state = _closed(model, integrator, half, drive.fundamental, y0.reshape(-1, y0.shape[-1]))
    path = trajectory(model, integrator, drive, tuple(state.T))
    turn = 2.0 * np.pi / (path[0].shape[0] - 1) * np.arange(path[0].shape[0])
    at = jax.vmap(drive.at)(drive.waves(turn))
    acted, _ = model.drive(at)
    if model.excitation == "base_acceleration":
        absolute = model.motion(path, at, "acceleration")
        base = _base_displacement(acted, drive)
        ratio = fundamental(absolute) / fundamental(acted)
        peak = _half_range(path[0] + base) / _half_range(base)
    else:
        passed = model.restoring_force(path)
        ratio = fundamental(passed) / fundamental(acted)
        peak = _half_range(passed) / _half_range(acted)
    return ratio.reshape(shape), peak.reshape(shape)


def _base_displacement(acted: Float[Array, "time lane"], drive: PeriodicDrive) -> Float[Array, "time lane"]:
    """Give the displacement of a base about its mean from its acceleration over a period, with both ends."""
    square = drive.angular_frequency[None] ** 2
    if not drive.overtones:
        # A sine's displacement is minus its acceleration over omega^2.
        return -(acted - jnp.mean(acted[:-1], axis=0)[None]) / square
    steps = acted.shape[0] - 1
    order = np.arange(steps // 2 + 1)
    over = np.where(order == 0, 0.0, -1.0 / np.maximum(order, 1) ** 2)
    along = jnp.fft.irfft(over[:, None] * jnp.fft.rfft(acted[:-1], axis=0), n=steps, axis=0) / square
    return jnp.concatenate([along, along[:1]])


def _closed(
    model: Isolator, integrator: Integrator, half: bool, drive: Sine, start: Float[Array, "lane state"]
) -> Float[Array, "lane state"]:
    """Close each orbit to machine precision: only there do its equations have the derivative of the orbit."""
    cosine = jnp.broadcast_to(jnp.asarray(drive.cosine), drive.frequency.shape)

    def lane(sine: Array, cosine: Array, frequency: Array, state: Array) -> Array:
        live = model, Sine(sine, cosine, frequency)
        held = integrator, half

        def closing(_: Array | int, here: Array) -> Array:
            left, slope = value_and_jacobian(lambda it: _open_end(it, frozen(live), held)[0], here)
            return here - solve(slope, left)

        near = jax.lax.fori_loop(0, _CLOSING_STEPS, closing, frozen(state))
        return with_derivatives(near, _open_end, near, live, held)

    return jax.vmap(lane)(drive.sine, cosine, drive.frequency, start)


def _open_end(
    state: Float[Array, " state"], live: tuple[Isolator, Sine], held: tuple[Integrator, bool]
) -> tuple[Float[Array, " state"], Float[Array, " state"]]:
    """Give how far a motion misses its own start, and the start."""
    (model, drive), (integrator, half) = live, held
    acting = with_overtones(model, drive)
    end = period_map(model, integrator, acting, tuple(state), turns=0.5 if half else 1.0)
    return jnp.stack(end) - state, state


def _half_range(path: Float[Array, "time lane"]) -> Lanes:
    """Give half the peak-to-peak value, each peak by the parabola through its sample and its neighbours."""
    signal = path[:-1]

    def peak(values: Array) -> Array:
        place = jnp.argmax(values, axis=0)[None]
        before, here, after = (
            jnp.take_along_axis(values, (place + shift) % values.shape[0], axis=0)[0] for shift in (-1, 0, 1)
        )
        bend = 2.0 * here - before - after
        return here + (after - before) ** 2 / (8.0 * jnp.where(bend == 0.0, 1.0, bend))

    return 0.5 * (peak(signal) + peak(-signal))
