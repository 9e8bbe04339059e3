"""Several harmonics balanced at once: the law in time, the balance in frequency."""

import math
from collections.abc import Sequence

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.core import Tracer
from jaxtyping import Array, Complex, Float

from ..._given_numbers import given_count
from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._small_systems import newton
from ..._types import Lanes, as_float64, check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, Modelled, as_isolator
from ._describing_function import imposed_internal, response_start, rest_displacement
from ._sine import highest_order, need_fundamental, recorded_sine


@shown
class HarmonicBalance(eqx.Module):
    """A periodic motion as a sum of a few harmonics of the drive.

    Attributes:
        model: the isolator.
        excitation: the drive.
        coefficients: complex amplitudes of the displacement [m] and of each internal state; the k-th is X of
            `X exp(i k omega t)` with the modulus of the amplitude, the first the mean. NaN where none were
            found.
        result: whether they were found, or why not.
    """

    model: Isolator
    excitation: Harmonic
    coefficients: Complex[Array, "function harmonic"]
    result: RESULTS

    def displacement(self, t: Lanes) -> Lanes:
        """Give the displacement.

        Args:
            t: times [s], any shape.

        Returns:
            Displacement then [m].
        """
        return _at(self.coefficients[0], 2.0 * math.pi * self.excitation.frequency * t)

    def velocity(self, t: Lanes) -> Lanes:
        """Give the velocity.

        Args:
            t: times [s], any shape.

        Returns:
            Velocity then [m/s].
        """
        omega = 2.0 * math.pi * self.excitation.frequency
        order = jnp.arange(self.coefficients.shape[1])
        return _at(1j * omega * order * self.coefficients[0], omega * t)

    @property
    def y0(self) -> Float[Array, " state"]:
        """Displacement [m], velocity [m/s], internal states at t = 0."""
        zero = jnp.zeros(())
        internal = [_at(row, zero) for row in self.coefficients[1:]]
        return jnp.stack([self.displacement(zero), self.velocity(zero), *internal])

    @property
    def amplitude(self) -> Float[Array, ""]:
        """Half the peak-to-peak displacement [m], each peak by a parabola through its sample."""
        order, row = jnp.arange(self.coefficients.shape[1]), self.coefficients[0]
        phase = 2.0 * math.pi / 1024 * jnp.arange(1024)
        along = _at(row, phase)

        def peak(sign: float) -> Array:
            here = phase[jnp.argmax(sign * along)]
            slope, bend = _at(1j * order * row, here), _at(-(order**2) * row, here)
            return _at(row, here) - 0.5 * slope**2 / jnp.where(bend == 0.0, 1.0, bend)

        return 0.5 * (peak(1.0) - peak(-1.0))


def _at(row: Complex[Array, " harmonic"], phase: Lanes) -> Lanes:
    """Give the sum of harmonics at phases."""
    order = jnp.arange(row.size)
    turned = jnp.exp(1j * jnp.multiply.outer(jnp.asarray(phase), order))
    return jnp.real(turned @ row)


def harmonic_balance(
    model: Isolator | Modelled,
    excitation: Harmonic,
    *,
    harmonics: int = 7,
    samples: int = 128,
    start: Sequence[Lanes | float] | Float[Array, " state"] | None = None,
    integrator: Integrator | None = None,
    solver: optx.AbstractRootFinder | None = None,
) -> HarmonicBalance:
    """Find a periodic motion as a sum of harmonics, by alternating between frequency and time.

    The sums give displacement, velocity and internal states at samples of one period; the laws give there
    what the rates should be; a Fourier transform gives the harmonics of the defect, which Newton's method
    brings to zero. What the law makes beyond the last harmonic is left out, so the error falls with
    `harmonics`; `find_periodic_orbit` has none of it. Works under `jax.jit`, `jax.vmap`, `jax.jacfwd` and
    `jax.grad`.

    Args:
        model: the isolator.
        excitation: the drive.
        harmonics: highest harmonic kept, beside the mean.
        samples: samples a period; more than twice `harmonics`.
        start: state at t = 0 of a motion to start from; the balance of one harmonic with the smallest motion
            if omitted.
        integrator: gives the tolerance.
        solver: root finder; `optimistix.Newton` if omitted.

    Returns:
        The harmonics. Where the search failed they are NaN and `result` says why.

    Raises:
        ValueError: if the frequency is not positive, `start` has the wrong length, `harmonics` is no positive
            count or lacks a harmonic of the drive, or `samples` are too few.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Cameron & Griffin 1989, J. Appl. Mech. 56:149.

    Example:
        >>> found = ij.harmonic_balance(ij.paper.y_direction(), ij.Harmonic(amplitude=150.0, frequency=4.3))
        >>> ij.is_successful(found.result)
        True
    """
    model = as_isolator(model)
    check_float64()
    tolerance = (Integrator() if integrator is None else integrator).orbit_tolerance
    solver = newton(tolerance) if solver is None else solver
    size = 2 + model.internal_states
    if start is not None and len(start) != size:
        raise ValueError(f"Argument `start` must hold {size} states, but holds {len(start)}.")
    harmonics, samples = given_count("harmonics", harmonics), given_count("samples", samples)
    order = highest_order(frozen(model))
    if harmonics < order:
        raise ValueError(
            f"Argument `harmonics` must be at least {order}, as of the drive, but is {harmonics}."
        )
    if samples <= 2 * harmonics:
        raise ValueError(
            f"Argument `samples` must be more than twice the harmonics ({harmonics}), but is {samples}."
        )
    frequency = frozen(excitation.frequency)
    if not isinstance(frequency, Tracer) and not 0.0 < float(frequency) < math.inf:
        raise ValueError(f"Argument `excitation` must have a positive frequency, but it is {frequency} Hz.")
    need_fundamental(frozen(model), frozen(excitation.amplitude))
    begin = None if start is None else jnp.stack([as_float64(value) for value in start])
    return _balance(model, excitation, begin, harmonics, samples, solver, tolerance)


@quick_jit
def _balance(
    model: Isolator,
    excitation: Harmonic,
    start: Float[Array, " state"] | None,
    harmonics: int,
    samples: int,
    solver: optx.AbstractRootFinder,
    tolerance: float,
) -> HarmonicBalance:
    still, held = frozen((model, excitation))
    state = response_start(still, held.amplitude, held.frequency) if start is None else frozen(start)
    first = _one_harmonic(still, held, state, samples)
    count = 1 + model.internal_states
    scale = jnp.max(jnp.abs(first), axis=1)
    scale = jnp.where(jnp.isfinite(scale) & (scale > 0.0), scale, 1.0)
    kept = min(harmonics + 1, first.shape[1])
    guess = jnp.zeros((count, 2 * harmonics + 1))
    scaled = first[:, :kept] / scale[:, None]
    guess = guess.at[:, :kept].set(jnp.real(scaled))
    guess = guess.at[:, harmonics + 1 : harmonics + kept].set(jnp.imag(scaled[:, 1:]))

    def defect(flat: Array, live: tuple[Isolator, Harmonic]) -> Array:
        return _defect(flat, live, (scale, samples))[0]

    live = still, held
    root = optx.root_find(defect, solver, guess.ravel(), live, max_steps=100, throw=False).value
    left, row = _defect(root, live, (scale, samples))
    row = with_derivatives(row, _defect, root, (model, excitation), (scale, samples))
    closed = jnp.all(jnp.isfinite(left)) & (jnp.max(jnp.abs(left)) < 1e3 * tolerance)
    if model.harmonics:
        # Of a model that is being traced no one could say before.
        drive = recorded_sine(still, held.amplitude, held.frequency)
        closed = closed & (drive.highest_order <= harmonics)
    result = RESULTS.where(
        closed,
        RESULTS.promote(diffrax.RESULTS.successful),
        RESULTS.where(jnp.all(jnp.isfinite(left)), RESULTS.not_converged, RESULTS.not_finite),
    )
    return HarmonicBalance(model, excitation, jnp.where(closed, row, jnp.nan + 0j), result)


def _defect(
    flat: Float[Array, " unknown"],
    live: tuple[Isolator, Harmonic],
    held: tuple[Float[Array, " function"], int],
) -> tuple[Float[Array, " unknown"], Complex[Array, "function harmonic"]]:
    """Give the harmonics of what the balance lacks, scaled; and the complex amplitudes of the motion."""
    (model, excitation), (scale, samples) = live, held
    unknown = flat.reshape(scale.size, -1)
    harmonics = unknown.shape[1] // 2
    order, phase = jnp.arange(harmonics + 1)[None], jnp.asarray(2.0 * np.pi / samples * np.arange(samples))
    real, imaginary = unknown[:, : harmonics + 1], unknown[:, harmonics + 1 :]
    row = scale[:, None] * (real + 1j * jnp.pad(imaginary, ((0, 0), (1, 0))))

    def wave(row: Array) -> Array:
        spectrum = jnp.concatenate([row[:, :1], 0.5 * row[:, 1:]], axis=1) * samples
        return jnp.fft.irfft(jnp.pad(spectrum, ((0, 0), (0, samples // 2 - harmonics))), n=samples)

    omega = 2.0 * math.pi * excitation.frequency
    values, slopes = wave(row), wave(1j * order * (omega * row))
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    rates = model.rates((values[0], slopes[0], *values[1:]), drive.at(drive.waves(phase)))
    bend = wave(-(order**2) * (omega**2 * row))[0]
    inner = [slope - rate for slope, rate in zip(slopes[1:], rates[2:], strict=True)]
    gaps = jnp.stack([(bend - rates[1]) / omega, *inner])
    spectrum = jnp.fft.rfft(gaps)[:, : harmonics + 1] * (2.0 / samples)
    parts = jnp.concatenate([jnp.real(spectrum), jnp.imag(spectrum)[:, 1:]], axis=1)
    return (parts / (scale[:, None] * omega)).ravel(), row


def _one_harmonic(
    model: Isolator, excitation: Harmonic, state: Float[Array, " state"], samples: int
) -> Complex[Array, "function harmonic"]:
    """Give the harmonics of the sine about rest that passes a state, and of the internal states along it."""
    omega = 2.0 * math.pi * excitation.frequency
    phase = jnp.asarray(2.0 * np.pi / samples * np.arange(samples))
    rest = rest_displacement(model)
    cosine, sine = state[0] - rest, state[1] / omega
    x = rest + cosine * jnp.cos(phase) + sine * jnp.sin(phase)
    v = omega * (sine * jnp.cos(phase) - cosine * jnp.sin(phase))
    internal = imposed_internal(model, x, v, as_float64(excitation.frequency))
    spectrum = jnp.fft.rfft(jnp.stack([x, *internal])) / samples
    return jnp.concatenate([spectrum[:, :1], 2.0 * spectrum[:, 1 : samples // 4]], axis=1)
