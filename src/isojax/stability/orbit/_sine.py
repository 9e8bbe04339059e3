"""The periodic drive of an orbit, in quadratures: a delay of the recorded drive is a turn of phase."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ..._types import Lanes, as_float64
from ...models import Instant, Integrator, Isolator

_FEWEST_STEPS_A_HARMONIC = 16
"""Steps a period of the highest harmonic at least, where steps are asked for: RK4 then makes an error of
2e-4 of it."""

_STEPS_A_HARMONIC = 32
"""The same where none are asked for: 1e-5 of it."""

Waves = tuple[tuple[Lanes, Lanes], ...]
"""Sine and cosine of the phase tau, then of the multiples of it that the harmonics of a drive have."""


class Sine(NamedTuple):
    """`sine sin(tau) + cosine cos(tau)`, tau = 2 pi frequency t.

    Attributes:
        sine: [N, or m/s^2 for base excitation].
        cosine: in the same unit.
        frequency: f [Hz].
    """

    sine: Lanes
    cosine: Lanes | float
    frequency: Lanes

    @property
    def angular_frequency(self) -> Lanes:
        """[rad/s]."""
        return 2.0 * math.pi * self.frequency


class Overtone(NamedTuple):
    """`sine sin(n tau) + cosine cos(n tau)`.

    Attributes:
        order: n.
        sine: [N, or m/s^2 for base excitation].
        cosine: in the same unit.
    """

    order: Lanes
    sine: Lanes
    cosine: Lanes


class PeriodicDrive(NamedTuple):
    """A sine and the harmonics that act with it.

    Attributes:
        fundamental: the sine.
        overtones: the harmonics.
    """

    fundamental: Sine
    overtones: tuple[Overtone, ...]

    @property
    def frequency(self) -> Lanes:
        """Of the fundamental [Hz]."""
        return self.fundamental.frequency

    @property
    def angular_frequency(self) -> Lanes:
        """Of the fundamental [rad/s]."""
        return self.fundamental.angular_frequency

    def waves(self, phase: Lanes | np.ndarray) -> Waves:
        """Give what `at` asks for.

        Args:
            phase: tau [rad], any shape; an array of NumPy is no number that JAX follows.

        Returns:
            Sine and cosine of it and of its multiples.
        """
        if isinstance(phase, np.ndarray):
            first = jnp.asarray(np.sin(phase)), jnp.asarray(np.cos(phase))
        else:
            first = jnp.sin(phase), jnp.cos(phase)
        turned = (one.order * jnp.asarray(phase) for one in self.overtones)
        return (first, *((jnp.sin(angle), jnp.cos(angle)) for angle in turned))

    def at(self, waves: Waves) -> Instant:
        """Give what acts at a phase.

        Args:
            waves: of the phase.

        Returns:
            The drive and its time derivative.
        """
        (sine, cosine), *others = waves
        own, omega = self.fundamental, self.angular_frequency
        drive = own.sine * sine + own.cosine * cosine
        rate = omega * (own.sine * cosine - own.cosine * sine)
        for one, (upper_sine, upper_cosine) in zip(self.overtones, others, strict=True):
            drive = drive + (one.sine * upper_sine + one.cosine * upper_cosine)
            rate = rate + one.order * omega * (one.sine * upper_cosine - one.cosine * upper_sine)
        return Instant(drive, rate)

    @property
    def highest_order(self) -> Int[Array, "..."] | int:
        """The largest multiple of its frequency that the drive has."""
        orders = [jnp.asarray(one.order, dtype=float) for one in self.overtones]
        return jnp.max(jnp.stack(orders)).astype(int) if orders else 1


def with_overtones(model: Isolator, sine: Sine) -> PeriodicDrive:
    """Give the drive with a given fundamental: each harmonic follows its size and phase.

    `h A cos(n theta + phi)` beside `A cos(theta)`, so that the drive scales and turns as a whole.

    Args:
        model: the isolator, whose elements say which harmonics there are.
        sine: the fundamental.

    Returns:
        The drive.
    """
    if not model.harmonics:
        return PeriodicDrive(sine, ())
    # Without a drive there is no phase, nor a derivative of it.
    acts = (sine.sine != 0.0) | (jnp.asarray(sine.cosine) != 0.0)
    some = jnp.where(acts, sine.sine, 1.0)
    size = jnp.where(acts, jnp.sqrt(some**2 + jnp.asarray(sine.cosine) ** 2), 0.0)
    return PeriodicDrive(sine, _overtones(model, size, -jnp.arctan2(some, sine.cosine)))


def recorded_sine(model: Isolator, amplitude: Lanes | float, frequency: Lanes | float) -> PeriodicDrive:
    """Give the drive that acts where `amplitude sin(2 pi frequency t)` is recorded.

    Args:
        model: the isolator, whose delay shifts the drive and whose elements add harmonics to it.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].

    Returns:
        The drive; its fundamental is without a cosine part where the model has no delay.
    """
    shift = model.shift()
    amplitude, frequency = as_float64(amplitude), as_float64(frequency)
    delayed = not (isinstance(shift, float) and shift == 0.0)
    phase = 2.0 * math.pi * frequency * shift
    fundamental = Sine(amplitude, 0.0, frequency)
    if delayed:
        fundamental = Sine(amplitude * jnp.cos(phase), -amplitude * jnp.sin(phase), frequency)
    if not model.harmonics:
        return PeriodicDrive(fundamental, ())
    lag = jnp.where(amplitude < 0.0, -0.5 * math.pi, 0.5 * math.pi)
    size = jnp.where(amplitude < 0.0, -amplitude, amplitude)
    return PeriodicDrive(fundamental, _overtones(model, size, -lag - phase))


def _overtones(model: Isolator, size: Lanes, phase: Lanes) -> tuple[Overtone, ...]:
    """Give the harmonics of `size cos(tau + phase)`."""
    found = []
    for one in model.harmonics:
        turned, push = one.order * phase + one.phase, one.share * size
        found.append(Overtone(jnp.asarray(one.order), -push * jnp.sin(turned), push * jnp.cos(turned)))
    return tuple(found)


def need_fundamental(model: Isolator, amplitude: Lanes | float) -> None:
    """Refuse a drive of nothing whose harmonics are shares of it.

    Args:
        model: the isolator, whose elements say which harmonics there are.
        amplitude: of the recorded drive; one that is traced passes unseen.

    Raises:
        ValueError: if it is zero and there are harmonics.
    """
    if model.harmonics and not isinstance(amplitude, Tracer) and not np.all(np.asarray(amplitude)):
        raise ValueError(
            "The drive must have an amplitude other than 0 where harmonics are added to it, because they are "
            "shares of it; for harmonics alone give a small amplitude and large shares, such as 1e-9 N and "
            "1e11 for 100 N."
        )


def highest_order(model: Isolator) -> int:
    """Give the largest multiple of its frequency that a drive of a model has.

    Args:
        model: the isolator.

    Returns:
        The order; one where there is no harmonic, or its order is being traced.
    """
    orders = [one.order for one in model.harmonics]
    return max((int(order) for order in orders if not isinstance(order, Tracer)), default=1)


def fewest_steps(model: Isolator) -> int:
    """Give the steps a drive period that the highest harmonic of a drive takes at least; zero of a sine."""
    order = highest_order(model)
    return _FEWEST_STEPS_A_HARMONIC * order if order > 1 else 0


def integrator_for(model: Isolator, integrator: Integrator | None, steps: int = 128) -> Integrator:
    """Give the integrator of an orbit or a map: that of the caller, or one that resolves each harmonic.

    Args:
        model: the isolator, whose elements say which harmonics the drive has.
        integrator: of the caller; None where none was given.
        steps: a drive period, where none was given and the drive is a sine or has low harmonics.

    Returns:
        The integrator.

    Raises:
        ValueError: if the caller's is no RK4, or takes too few steps for the highest harmonic.
    """
    order, least = highest_order(model), fewest_steps(model)
    if integrator is None:
        return Integrator(steps_per_period=max(steps, _STEPS_A_HARMONIC * order))
    if not isinstance(integrator, Integrator) or not integrator.is_locked:
        given = type(integrator.solver).__name__ if isinstance(integrator, Integrator) else repr(integrator)
        raise ValueError(
            "Argument `integrator` must be an Integrator with RK4, into whose fixed steps a drive period is "
            f"divided, but is {given}. Give Integrator(steps_per_period=256), or omit it; `simulate` and "
            "`fit` take any solver of diffrax."
        )
    if integrator.steps_a_period(model) < least:
        raise ValueError(
            f"Argument `integrator` must take at least {least} steps a drive period, because the drive has a "
            f"harmonic of order {order}, but takes {integrator.steps_a_period(model)}. Give "
            f"Integrator(steps_per_period={least}) or more."
        )
    return integrator


def stage_phases(steps: int, turns: float) -> Float[np.ndarray, "time 3"]:
    """Give the phases of the stages of fixed steps: the same for every frequency in time scaled by it.

    Args:
        steps: steps a period.
        turns: periods, a half at least.

    Returns:
        tau at the start, middle and end of each step [rad].
    """
    count = round(steps * turns)
    return 2.0 * np.pi / steps * (np.arange(count)[:, None] + np.array([0.0, 0.5, 1.0]))
