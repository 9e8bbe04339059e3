"""One harmonic in closed form: the drive that holds a given amplitude at a given frequency."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..._types import Lanes, Scalar, as_float64
from ...models import ContinuedLaw, Instant, Isolator
from ._sine import PeriodicDrive, Sine

_SAMPLES = 64
"""Samples a cycle; the first harmonic of |x|x is then good to 1e-5, so good that only the others matter."""

_PHASES, _POLISHING = 256, 2
"""Phases at which the largest displacement is sought under harmonics; steps of Newton's method from there."""

_IMPOSED_CYCLES = 3
"""Cycles of imposed motion after which internal states count as settled."""

_ROS2 = 1.0 - 1.0 / math.sqrt(2.0)
"""Gamma of the step ROS2: of order two for any J, and what relaxes at once is damped at once."""

_GRID = np.logspace(-3.0, 3.0, 600)
"""Displacement amplitudes tried for one drive, over `answer_scale`."""

_TINY = 1e-9
"""Displacement amplitude that counts as next to rest [m]."""

_LARGER, _MOST_ROUNDS = 1e5, 5
"""Factor by which the amplitudes grow while all of them need less than the drive, and rounds at most."""


def rest_displacement(model: Isolator) -> Float[Array, ""]:
    """Give the displacement at which the isolator rests without a drive [m].

    Args:
        model: the isolator, whose offsets and preloads move it.

    Returns:
        Root of the static balance next to zero, by Newton's method; zero for an odd model.
    """

    def balance(x: Array) -> Array:
        state = (x, 0.0 * x, *(0.0 * x,) * model.internal_states)
        return model.acceleration(state, Instant(jnp.zeros_like(x)))

    def improve(_: Array | int, x: Array) -> Array:
        value, slope = jax.jvp(balance, (x,), (jnp.ones_like(x),))
        moved = x - value / jnp.where(slope == 0.0, 1.0, slope)
        return jnp.where(jnp.isfinite(moved) & (slope != 0.0), moved, x)

    return jax.lax.fori_loop(0, 20, improve, jnp.zeros(()))


def imposed_internal(
    model: Isolator, displacement: Lanes, velocity: Lanes, frequency: Lanes
) -> tuple[Lanes, ...]:
    """Give the internal states along an imposed cycle, once they repeat as far as a few cycles bring them.

    By the linearly implicit step ROS2, so that a state may relax within a fraction of a sample.

    Args:
        model: the isolator.
        displacement: one cycle [m], time first.
        velocity: the same cycle [m/s].
        frequency: [Hz].

    Returns:
        Each internal state along the cycle.

    Source: Verwer, Spee, Blom & Hundsdorfer 1999, SIAM J. Sci. Comput. 20:1456, eq. (2.5).
    """
    if not model.internal_states:
        return ()
    count = displacement.shape[0]
    step = 1.0 / (count * model.substeps * frequency)
    zero = 0.0 * displacement[0]

    def rates(internal: tuple[Lanes, ...], x: Lanes, v: Lanes) -> tuple[Lanes, ...]:
        return model.rates((x, v, *internal), Instant(zero))[2:]

    def relaxed(internal: tuple[Lanes, ...], x: Lanes, v: Lanes) -> list[Lanes]:
        """Give `1 - gamma h J`, with the rate at which each internal state relaxes by itself for J."""
        mapped = (len(internal), *zero.shape)
        units = (jnp.broadcast_to(one.reshape(-1, *(1,) * zero.ndim), mapped) for one in jnp.eye(mapped[0]))
        moved = jax.vmap(lambda *unit: jax.jvp(lambda *s: rates(s, x, v), internal, unit)[1])(*units)
        slopes = [rate[own] for own, rate in enumerate(moved)]
        # What relaxes damps; nothing else makes a step unstable.
        return [1.0 - _ROS2 * step * jnp.minimum(slope, 0.0) for slope in slopes]

    def advanced(
        number: int | Array, internal: tuple[Lanes, ...], ends: list[tuple[Lanes, Lanes]]
    ) -> tuple[Lanes, ...]:
        def at(share: Array | float) -> list[Lanes]:
            return [a + share * (b - a) for a, b in zip(*ends, strict=True)]

        before, after = at(number / model.substeps), at((number + 1.0) / model.substeps)
        over = relaxed(internal, *before)
        k1 = [step * rate / one for rate, one in zip(rates(internal, *before), over, strict=True)]
        moved = tuple(s + k for s, k in zip(internal, k1, strict=True))
        k2 = [
            (step * rate - 2.0 * k) / one for rate, k, one in zip(rates(moved, *after), k1, over, strict=True)
        ]
        return tuple(s + 1.5 * a + 0.5 * b for s, a, b in zip(internal, k1, k2, strict=True))

    def body(internal: tuple[Lanes, ...], place: Array) -> tuple[tuple[Lanes, ...], tuple[Lanes, ...]]:
        following = (place + 1) % count
        ends = [(displacement[place], velocity[place]), (displacement[following], velocity[following])]
        return jax.lax.fori_loop(
            0, model.substeps, lambda number, own: advanced(number, own, ends), internal
        ), internal

    start = (zero,) * model.internal_states
    _, along = jax.lax.scan(body, start, jnp.asarray(np.tile(np.arange(count), _IMPOSED_CYCLES)))
    return tuple(values[-count:] for values in along)


class BalancedMotion(NamedTuple):
    """A motion about rest with a given largest displacement, tau counted from there.

    Attributes:
        drive: fundamental of the drive that holds it.
        internal: internal states along a cycle, time first.
        parts: order, cosine and sine part of each multiple of tau in the displacement [m], where the drive
            holds harmonics; the motion is `amplitude cos(tau)` where there is none.
    """

    drive: Sine
    internal: tuple[Lanes, ...]
    parts: tuple[tuple[Lanes | float, Lanes, Lanes], ...]

    def at(self, amplitude: Lanes, phase: Lanes) -> tuple[Lanes, Lanes]:
        """Give displacement from rest and velocity.

        Args:
            amplitude: largest displacement [m].
            phase: tau [rad].

        Returns:
            Both [m, m/s].
        """
        omega = self.drive.angular_frequency
        if not self.parts:
            return amplitude * jnp.cos(phase), -amplitude * omega * jnp.sin(phase)
        x, v = 0.0 * amplitude, 0.0 * amplitude
        for order, cosine, sine in self.parts:
            turned = order * phase
            x = x + cosine * jnp.cos(turned) + sine * jnp.sin(turned)
            v = v + order * omega * (sine * jnp.cos(turned) - cosine * jnp.sin(turned))
        return x, v


def balanced_motion(
    model: Isolator, amplitude: Lanes, frequency: Lanes, rest: Lanes | float = 0.0
) -> BalancedMotion:
    """Give a motion in the balance of one harmonic, and the drive that holds it.

    Where the drive holds harmonics, each moves the mass as the equivalent linear isolator of this amplitude
    lets it, and the drive is the one under which all of them together reach the amplitude.

    Args:
        model: the isolator.
        amplitude: largest displacement over rest [m], positive.
        frequency: [Hz], same shape.
        rest: centre of the motion [m].

    Returns:
        The motion.
    """
    drive, internal = imposed_balance(model, amplitude, frequency, rest)
    if not model.harmonics:
        return BalancedMotion(drive, internal, ())
    pairs = zip(model.harmonics, _receptances(model, amplitude, frequency, rest), strict=True)
    waves: list[tuple[Lanes | float, Array]] = [(1.0, amplitude / _phasor(drive))]
    waves.extend((jnp.asarray(one.order), one.share * jnp.exp(1j * one.phase) * own) for one, own in pairs)

    def height(phase: Array, power: int) -> Array:
        """Give the displacement at the start under a unit drive of some phase, or its derivative by it."""
        own = [jnp.real((1j * n) ** power * one * jnp.exp(1j * n * phase)) for n, one in waves]
        return sum(own[1:], start=own[0])

    phases = jnp.asarray(2.0 * np.pi / _PHASES * np.arange(_PHASES))
    best = phases[jnp.argmax(jax.vmap(lambda phase: height(phase, 0))(phases), axis=0)]
    for _ in range(_POLISHING):
        bend = height(best, 2)
        best = best - jnp.where(bend < 0.0, height(best, 1) / jnp.where(bend < 0.0, bend, 1.0), 0.0)
    push = amplitude / height(best, 0)
    moved = [(n, push * one * jnp.exp(1j * n * best)) for n, one in waves]
    parts = tuple((n, jnp.real(one), -jnp.imag(one)) for n, one in moved)
    held = Sine(-push * jnp.sin(best), push * jnp.cos(best), frequency)
    motion = BalancedMotion(held, internal, parts)
    if model.internal_states:
        tau = jnp.asarray(2.0 * np.pi / _SAMPLES * np.arange(_SAMPLES))
        x, v = jax.vmap(lambda phase: motion.at(amplitude + 0.0 * frequency, phase))(tau)
        motion = motion._replace(internal=imposed_internal(model, rest + x, v, frequency))
    return motion


def _receptances(
    model: Isolator, amplitude: Lanes, frequency: Lanes, rest: Lanes | float
) -> list[Complex[Array, "..."]]:
    """Give displacement over force of the equivalent linear isolator at each harmonic of a drive."""
    found = []
    for one in model.harmonics:
        upper, _ = imposed_balance(model, amplitude, one.order * frequency, rest)
        found.append(amplitude / _phasor(upper))
    return found


def overtone_response(
    model: Isolator, drive: PeriodicDrive, amplitude: Lanes, rest: Lanes | float = 0.0
) -> tuple[Lanes, Lanes]:
    """Give what the harmonics of a drive add to displacement and velocity at tau = 0.

    Args:
        model: the isolator.
        drive: the drive.
        amplitude: of the whole motion [m], for which the equivalent linear isolator is taken.
        rest: centre of the motion [m].

    Returns:
        Both [m, m/s]; zero where the drive is a sine.
    """
    x, v = 0.0 * amplitude, 0.0 * amplitude
    pairs = zip(drive.overtones, _receptances(model, amplitude, drive.frequency, rest), strict=True)
    for one, receptance in pairs:
        moved = receptance * (one.cosine - 1j * one.sine)
        x = x + jnp.real(moved)
        v = v - one.order * drive.angular_frequency * jnp.imag(moved)
    return x, v


def _phasor(drive: Sine) -> Complex[Array, "..."]:
    """Give D of `D exp(i tau)`."""
    return jnp.asarray(drive.cosine) - 1j * drive.sine


def imposed_balance(
    model: Isolator, amplitude: Lanes, frequency: Lanes, rest: Lanes | float = 0.0
) -> tuple[Sine, tuple[Lanes, ...]]:
    """Give the sine that, to one harmonic, holds the motion `rest + amplitude cos(tau)`.

    The balance of the first harmonic, `F = (K_eq - m omega^2) a cos(tau) - C_eq omega a sin(tau)`, with K_eq
    and C_eq of whatever elements there are, by the trapezoid rule over one cycle.

    Args:
        model: the isolator.
        amplitude: a [m], positive.
        frequency: [Hz], same shape.
        rest: centre of the motion [m].

    Returns:
        The drive, and the internal states along the cycle from tau = 0, time first.

    Source: the paper, eqs. (7) and (8).
    """
    size, omega = jnp.asarray(amplitude)[None], 2.0 * math.pi * jnp.asarray(frequency)[None]
    phase = (2.0 * np.pi / _SAMPLES * np.arange(_SAMPLES)).reshape(
        -1, *(1,) * jnp.ndim(amplitude * frequency)
    )
    cosine, sine = np.cos(phase), np.sin(phase)
    x, v = rest + size * cosine, -size * omega * sine
    internal = imposed_internal(model, x, v, frequency)
    # Without a drive the acceleration is -force / inertia; what is missing for the imposed one is the drive.
    state, still = (x, v, *internal), Instant(0.0 * x)
    # Sharp laws are meant as they are: the rounded one of dry friction is a damper where motion is small.
    law = ContinuedLaw(tuple(jnp.where(value >= 0.0, 1.0, -1.0) for value in model.switches(state)))
    without = model.acceleration(state, still, law)
    missing = -size * omega**2 * cosine - without
    unit = model.acceleration(state, Instant(0.0 * x + 1.0), law) - without
    wanted = missing / unit
    in_phase, in_quadrature = 2.0 * jnp.mean(wanted * cosine, axis=0), 2.0 * jnp.mean(wanted * sine, axis=0)
    return Sine(in_quadrature, in_phase, frequency), internal


def response_amplitudes(
    model: Isolator, frequency: Lanes, amplitudes: Float[Array, " amplitude"], rest: Lanes | float = 0.0
) -> Lanes:
    """Give the drive amplitude that each displacement amplitude needs, to one harmonic.

    Args:
        model: the isolator.
        frequency: [Hz], any shape.
        amplitudes: displacement amplitudes [m].
        rest: centre of the motion [m].

    Returns:
        Drive amplitude [N, or m/s^2 for base excitation], amplitude first.
    """

    def needed(amplitude: Array) -> Array:
        drive = balanced_motion(model, amplitude + 0.0 * frequency, frequency, rest).drive
        return jnp.hypot(drive.sine, jnp.asarray(drive.cosine))

    return jax.vmap(needed)(amplitudes)


def answer_scale(model: Isolator, amplitude: Scalar, frequency: Lanes, rest: Scalar) -> Float[Array, ""]:
    """Give a displacement amplitude within three decades of which a drive's one-harmonic answer lies.

    It is that of the law next to rest, if no larger motion needs as much drive. Friction is stiff next to
    rest, dry friction without bound, and weak beside the spring further out.

    Args:
        model: the isolator.
        amplitude: F0 [N, or m/s^2 for base excitation], positive.
        frequency: [Hz].
        rest: centre of the motion [m].

    Returns:
        The amplitude [m].
    """
    return _scale_and_needed(model, amplitude, frequency, rest)[0]


def _scale_and_needed(
    model: Isolator, amplitude: Scalar, frequency: Lanes, rest: Scalar
) -> tuple[Float[Array, ""], Float[Array, " trial"]]:
    """Give `answer_scale`, and the drive that each amplitude of `_GRID` over it needs."""

    def needed(scale: Array) -> Array:
        return response_amplitudes(model, frequency, scale * jnp.asarray(_GRID), rest)

    def too_small(trial: tuple[Array, Array, Array]) -> Array:
        return (trial[2] < _MOST_ROUNDS) & jnp.all(trial[1] <= amplitude)

    def enlarge(trial: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        scale = _LARGER * trial[0]
        return scale, needed(scale), trial[2] + 1

    stiffness = response_amplitudes(model, frequency, jnp.array([_TINY]), rest)[0] / _TINY
    # The first round enlarges too, so that what is needed is compiled once.
    first = amplitude / stiffness / _LARGER
    nothing = jnp.zeros(_GRID.size)
    scale, last, _ = jax.lax.while_loop(too_small, enlarge, (first, nothing, jnp.asarray(0)))
    return scale, last


def response_start(model: Isolator, amplitude: Scalar, frequency: Scalar) -> Float[Array, " state"]:
    """Give the one-harmonic answer to a drive: the state at its phase zero.

    Of several answers the one of the smallest motion, which rest leads to as the drive grows.

    Args:
        model: the isolator.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: [Hz].

    Returns:
        Displacement, velocity, internal states at t = 0.
    """
    amplitude, frequency = as_float64(amplitude), as_float64(frequency)
    rest = rest_displacement(model)
    size = jnp.abs(amplitude)
    scale, needed = _scale_and_needed(model, size, frequency, rest)
    grid = scale * jnp.asarray(_GRID)
    rises = (needed[:-1] <= size) & (needed[1:] > size)
    place = jnp.where(jnp.any(rises), jnp.argmax(rises), jnp.argmin(jnp.abs(needed[:-1] - size)))
    span = needed[place + 1] - needed[place]
    share = jnp.where(jnp.any(rises), (size - needed[place]) / span, 0.0)
    motion = grid[place] + share * (grid[place + 1] - grid[place])
    balanced = balanced_motion(model, motion, frequency, rest)
    drive, internal, _ = balanced
    # The motion is largest at tau = 0; the recorded drive passes zero upwards at this tau.
    lead = jnp.where(amplitude < 0, math.pi, 0.0) + 2.0 * math.pi * frequency * model.shift()
    phase = -jnp.arctan2(drive.cosine, drive.sine) - lead
    x, v = balanced.at(motion, phase)
    sample = jnp.round(phase / (2.0 * math.pi) * _SAMPLES).astype(int) % _SAMPLES
    return jnp.stack([rest + x, v, *(values[sample] for values in internal)])
