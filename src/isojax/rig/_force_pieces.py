"""The force on the plant as a chain of smooth pieces, each evaluable at any instant."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import no_type_check

import numpy as np
from jaxtyping import Float


class ForcePiece(ABC):
    """An interval of time over which the force is smooth."""

    start: float
    """s"""
    stop: float
    """s, excluded"""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step, s, that still resolves every oscillation of the force."""

    @no_type_check
    @abstractmethod
    def force(self, t):
        """Force at the instant `t` (a float), N."""

    @abstractmethod
    def forces(self, times: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Force at each instant, N."""

    @abstractmethod
    def lasting_until(self, stop: float) -> "ForcePiece":
        """The piece with another end."""

    @abstractmethod
    def delayed(self, delay: float) -> "ForcePiece":
        """The piece, acting later by `delay` seconds."""

    def with_harmonic(self, order: int, share: float, phase: float) -> "ForcePiece":
        """The piece A cos(theta), and whatever it holds beside that, plus share A cos(order theta + phase).

        Raises:
            ValueError: if the piece is no sine or sweep, so that its theta is not known.
        """
        raise ValueError(f"Harmonics belong to a sine or a sweep, but the force is {self}.")


@dataclass(frozen=True)
class Tones(ForcePiece):
    """Sum of a_i sin(w_i (t - origin) + p_i); no tones, no force.

    Args:
        start: s.
        stop: s.
        origin: s.
        amplitudes: a_i, N.
        angular_frequencies: w_i, rad/s.
        phases: p_i, rad.
    """

    start: float
    stop: float
    origin: float = 0.0
    amplitudes: tuple[float, ...] = ()
    angular_frequencies: tuple[float, ...] = ()
    phases: tuple[float, ...] = ()

    @cached_property
    def _tones(self) -> list[tuple[float, float, float]]:
        return list(zip(self.amplitudes, self.angular_frequencies, self.phases, strict=True))

    @property
    def longest_step(self) -> float:
        """Half of the shortest period, s."""
        return math.pi / max(self.angular_frequencies, default=0.1)

    @no_type_check
    def force(self, t):
        """Force at the instant `t`, N."""
        total = 0.0
        since = t - self.origin
        sin = math.sin
        for a, w, p in self._tones:
            total += a * sin(w * since + p)
        return total

    def forces(self, times: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Force at each instant, N."""
        total = np.zeros_like(times)
        for a, w, p in self._tones:
            total += a * np.sin(w * (times - self.origin) + p)
        return total

    def lasting_until(self, stop: float) -> "ForcePiece":
        """The piece with another end."""
        return replace(self, stop=stop)

    def delayed(self, delay: float) -> "ForcePiece":
        """The piece, acting later by `delay` seconds."""
        return replace(self, start=self.start + delay, stop=self.stop + delay, origin=self.origin + delay)

    def with_harmonic(self, order: int, share: float, phase: float) -> "Tones":
        """The tones and one more; the first of them is the sine, and the others must be harmonics of it.

        Raises:
            ValueError: if they are not.
        """
        if not self.amplitudes:
            return self
        sine = self.angular_frequencies[0]
        orders = [angular / sine for angular in self.angular_frequencies]
        if any(abs(one - round(one)) > 1e-9 for one in orders):
            raise ValueError(
                f"Harmonics belong to a sine or a sweep, but the orders of the tones are {orders}."
            )
        theta = self.phases[0] - math.pi / 2
        return replace(
            self,
            amplitudes=(*self.amplitudes, share * self.amplitudes[0]),
            angular_frequencies=(*self.angular_frequencies, order * sine),
            phases=(*self.phases, order * theta + phase + math.pi / 2),
        )


@dataclass(frozen=True)
class Line(ForcePiece):
    """Force value + slope (t - origin).

    Args:
        start: s.
        stop: s.
        origin: s.
        value: N.
        slope: N/s.
    """

    start: float
    stop: float
    origin: float
    value: float
    slope: float = 0.0

    @property
    def longest_step(self) -> float:
        """The length of the piece, s: a line hides no oscillation."""
        return self.stop - self.start

    @no_type_check
    def force(self, t):
        """Force at the instant `t`, N."""
        return self.value + self.slope * (t - self.origin)

    def forces(self, times: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Force at each instant, N."""
        return self.value + self.slope * (times - self.origin)

    def lasting_until(self, stop: float) -> "Line":
        """The piece with another end."""
        return replace(self, stop=stop)

    def delayed(self, delay: float) -> "Line":
        """The piece, acting later by `delay` seconds."""
        return replace(self, start=self.start + delay, stop=self.stop + delay, origin=self.origin + delay)


@dataclass(frozen=True)
class Chirp(ForcePiece):
    """Linear sweep A sin(2 pi (f0 s + r s^2 / 2)) with s = t - origin, and its harmonics.

    Args:
        start: s.
        stop: s.
        origin: s.
        frequency: f0, Hz.
        sweep: r, Hz/s.
        amplitude: A, N.
        harmonics: (order, ratio to the fundamental, phase in rad) of each further tone.
        dip: depth, centre in Hz and width in Hz of the Gaussian drop-out of the drive.
    """

    start: float
    stop: float
    origin: float
    frequency: float
    sweep: float
    amplitude: float
    harmonics: tuple[tuple[int, float, float], ...] = ()
    dip: tuple[float, float, float] = (0.0, 1.0, 1.0)

    @property
    def longest_step(self) -> float:
        """Half of the shortest period, s."""
        highest = max(abs(self.frequency + self.sweep * (t - self.origin)) for t in (self.start, self.stop))
        return 0.5 / (highest * max((order for order, _, _ in self.harmonics), default=1))

    @no_type_check
    def force(self, t):
        """Force at the instant `t`, N."""
        since = t - self.origin
        phase = 2 * math.pi * (self.frequency + self.sweep * since / 2) * since
        depth, centre, width = self.dip
        away = (self.frequency + self.sweep * since - centre) / width
        shape = math.sin(phase)
        for order, ratio, shift in self.harmonics:
            shape += ratio * math.sin(order * phase + shift)
        return self.amplitude * (1 - depth * math.exp(-away * away)) * shape

    def forces(self, times: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Force at each instant, N."""
        since = times - self.origin
        phase = 2 * np.pi * (self.frequency + self.sweep * since / 2) * since
        depth, centre, width = self.dip
        away = (self.frequency + self.sweep * since - centre) / width
        shape = np.sin(phase)
        for order, ratio, shift in self.harmonics:
            shape = shape + ratio * np.sin(order * phase + shift)
        return self.amplitude * (1 - depth * np.exp(-away * away)) * shape

    def lasting_until(self, stop: float) -> "ForcePiece":
        """The piece with another end."""
        return replace(self, stop=stop)

    def delayed(self, delay: float) -> "ForcePiece":
        """The piece, acting later by `delay` seconds."""
        return replace(self, start=self.start + delay, stop=self.stop + delay, origin=self.origin + delay)

    def with_harmonic(self, order: int, share: float, phase: float) -> "Chirp":
        """The sweep with one more harmonic."""
        shift = (1 - order) * math.pi / 2 + phase
        return replace(self, harmonics=(*self.harmonics, (order, share, shift)))


def forces_of(pieces: Sequence[ForcePiece], times: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Force at each instant (increasing), N; zero outside the pieces."""
    forces = np.zeros_like(times)
    for piece in pieces:
        first, last = np.searchsorted(times, [piece.start, piece.stop])
        forces[first:last] = piece.forces(times[first:last])
    return forces
