"""Resonance and damping ratio of one receptance: peak, phase resonance, half-power points, jumps."""

import dataclasses
import itertools

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.interpolate import CubicSpline, PchipInterpolator

from ..._show import shown

_POINTS_A_GAP = 256
"""Points between two lines of the interpolated curve."""

_ABRUPT = 1.5
"""A receptance has jumped where it changes by this many times its changes over the gaps beside."""

_OVERSHOOT = 0.5
"""A cubic through 1/|H|^2 that falls below this share of its smallest value is replaced by a monotone one."""


@shown
@dataclasses.dataclass(frozen=True)
class HalfPower:
    """Peak, half-power points and damping ratio of one receptance.

    Attributes:
        peak_frequency: where the receptance is largest [Hz].
        peak: largest receptance [m/N].
        lower: lower half-power frequency [Hz]; NaN where the sweep does not reach it.
        upper: upper half-power frequency [Hz]; NaN where the sweep does not reach it.
        damping_ratio: (upper - lower)/(2 peak_frequency) [1]; NaN without both points.
        peak_inside: whether the peak lies inside the sweep, not at its end.
        jump_inside: whether a jump lies between the half-power points.

    Source: the paper, eq. (9), first order in the damping ratio: for a linear isolator this ratio is too
    large by about 2 zeta^2 of itself (0.02 % at zeta = 1 %, 6 % at zeta = 17 %).
    """

    peak_frequency: float
    peak: float
    lower: float
    upper: float
    damping_ratio: float
    peak_inside: bool
    jump_inside: bool


def find_jumps(
    frequency: Float[np.ndarray, " frequency"],
    receptance: Complex[np.ndarray, " frequency"],
    mass: float,
    tolerance: float = 0.25,
) -> Bool[np.ndarray, " gap"]:
    """Find the gaps between neighbouring lines where the motion jumped from one branch to another.

    With stiffness and damping frozen at either line, the receptance of the other follows. A jump is a gap
    over which both predictions fail, and over which the receptance changes far more than over the gaps
    beside it. Beside a fold the motion may change so steeply that the lines cannot distinguish it from a
    jump: it counts as one.

    Args:
        frequency: lines, increasing [Hz].
        receptance: displacement over force [m/N].
        mass: moving mass [kg].
        tolerance: share of the amplitude by which both predictions must be wrong.

    Returns:
        One flag a gap, one fewer than there are lines.
    """
    dynamic = 1.0 / receptance
    omega = 2 * np.pi * frequency
    step = mass * np.diff(omega**2)
    growth = omega[1:] / omega[:-1]
    ahead = dynamic[:-1].real - step + 1j * dynamic[:-1].imag * growth
    behind = dynamic[1:].real + step + 1j * dynamic[1:].imag / growth
    miss_ahead = np.abs(np.log(np.abs(ahead / dynamic[1:])))
    miss_behind = np.abs(np.log(np.abs(behind / dynamic[:-1])))
    missed = np.minimum(miss_ahead, miss_behind) > np.log1p(tolerance)
    change = np.abs(np.diff(np.log(np.abs(receptance))))
    beside = np.pad(change, 1)
    return missed & (change > _ABRUPT * np.maximum(beside[:-2], beside[2:]))


def _inverse_square(
    square: Float[np.ndarray, " frequency"],
    value: Float[np.ndarray, " frequency"],
    fine: Float[np.ndarray, " fine"],
) -> Float[np.ndarray, " fine"]:
    """Interpolate 1/|H|^2 against omega^2: a parabola for a linear isolator, so a cubic is exact there."""
    if square.size >= 4:
        curve = CubicSpline(square, value)(fine)
        if np.min(curve) > _OVERSHOOT * np.min(value):
            return curve
    return PchipInterpolator(square, value)(fine)


def _crossing(
    fine: Float[np.ndarray, " fine"], excess: Float[np.ndarray, " fine"], top: int, direction: int
) -> float:
    """Find where `excess` first turns positive from index `top` on, walking up (+1) or down (-1)."""
    walk = excess[top:] if direction > 0 else excess[top::-1]
    beyond = np.flatnonzero(walk > 0)
    if beyond.size == 0 or beyond[0] == 0:
        return float("nan")
    outside = top + direction * int(beyond[0])
    inside = outside - direction
    share = excess[inside] / (excess[inside] - excess[outside])
    return float(fine[inside] + share * (fine[outside] - fine[inside]))


def find_half_power(
    frequency: Float[np.ndarray, " frequency"],
    receptance: Complex[np.ndarray, " frequency"],
    jumps: Bool[np.ndarray, " gap"] | None = None,
) -> HalfPower:
    """Find the peak of a receptance and its half-power points.

    The curve is interpolated as 1/|H|^2 against omega^2, in pieces between jumps; across a jump it is a
    straight line.

    Args:
        frequency: lines, increasing [Hz].
        receptance: displacement over the measured force of the same line [m/N].
        jumps: gaps across which the curve is not smooth, as `find_jumps` gives them; none if omitted.

    Returns:
        Peak, half-power points and damping ratio; NaN for what the sweep does not reach.

    Raises:
        ValueError: if there are fewer than three lines or they do not increase.

    Source: the paper, eq. (9).
    """
    if frequency.size < 3:
        raise ValueError(f"Argument `frequency` must hold at least 3 lines, but holds {frequency.size}.")
    if not np.all(np.diff(frequency) > 0):
        place = int(np.flatnonzero(np.diff(frequency) <= 0)[0])
        raise ValueError(
            f"Argument `frequency` must increase strictly, but frequency[{place + 1}] = "
            f"{frequency[place + 1]} follows {frequency[place]}."
        )
    square, value = frequency**2, 1.0 / np.abs(receptance) ** 2
    places = np.arange(_POINTS_A_GAP * (frequency.size - 1) + 1) / _POINTS_A_GAP
    fine = np.interp(places, np.arange(frequency.size), square)
    curve = np.interp(fine, square, value)
    flags = np.zeros(frequency.size - 1, dtype=bool) if jumps is None else jumps
    edges = np.concatenate([[0], np.flatnonzero(flags) + 1, [frequency.size]])
    for start, stop in itertools.pairwise(edges):
        if stop - start >= 3:
            inside = (fine >= square[start]) & (fine <= square[stop - 1])
            curve[inside] = _inverse_square(square[start:stop], value[start:stop], fine[inside])
    top = int(np.argmin(curve))
    excess = curve - 2.0 * curve[top]
    lower, upper = (_crossing(fine, excess, top, way) for way in (-1, 1))
    lower, upper, peak_frequency = float(np.sqrt(lower)), float(np.sqrt(upper)), float(np.sqrt(fine[top]))
    low_end = lower if np.isfinite(lower) else frequency[0]
    high_end = upper if np.isfinite(upper) else frequency[-1]
    crossed = flags & (frequency[1:] > low_end) & (frequency[:-1] < high_end)
    return HalfPower(
        peak_frequency=peak_frequency,
        peak=float(1.0 / np.sqrt(curve[top])),
        lower=lower,
        upper=upper,
        damping_ratio=(upper - lower) / (2.0 * peak_frequency),
        peak_inside=0 < top < fine.size - 1,
        jump_inside=bool(np.any(crossed)),
    )


def find_phase_resonance(
    frequency: Float[np.ndarray, " frequency"], receptance: Complex[np.ndarray, " frequency"]
) -> float:
    """Find where the displacement lags the force by 90 degrees.

    The real part of 1/H is interpolated linearly against omega^2, which is exact for a linear isolator.

    Args:
        frequency: lines, increasing [Hz].
        receptance: displacement over force [m/N].

    Returns:
        Frequency [Hz]: the crossing with the largest receptance beside it; NaN where the sweep has none.
    """
    real, square = (1.0 / receptance).real, frequency**2
    crossings = np.flatnonzero((real[:-1] >= 0) & (real[1:] < 0))
    if crossings.size == 0:
        return float("nan")
    size = np.abs(receptance)
    place = int(crossings[np.argmax(np.maximum(size[crossings], size[crossings + 1]))])
    share = real[place] / (real[place] - real[place + 1])
    return float(np.sqrt(square[place] + share * (square[place + 1] - square[place])))
