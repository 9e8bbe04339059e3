"""Response over frequency at one drive amplitude, past its folds, with its unstable segments."""

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._quantities import DRIVE_UNITS
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import amount, number, shown
from ..._types import check_float64
from ...models import (
    Band,
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    Modelled,
    State,
    as_isolator,
)
from ..branch import Branch, BranchEvent, SpecialPoint, continue_branch
from ..orbit import Sine, recorded_sine, trajectory


@shown
class FrequencyResponse(eqx.Module):
    """Periodic response over frequency, in the order of the curve.

    For a list of drive amplitudes an axis `branch` stands in front; the shorter curves end in NaN.

    Attributes:
        branch: the orbits.
        receptance: complex amplitude of the fundamental of the displacement over that of the recorded drive
            [m/N, or s^2 for base excitation].
        others: responses that the curve does not reach within the band of frequencies, each a curve of its
            own: isolas, subharmonics, and what leaves the curve at a bifurcation; `branch.searched` says
            where they were sought.
    """

    branch: Branch
    receptance: Complex[Array, "*branch point"]
    others: tuple["FrequencyResponse", ...] = ()

    @property
    def frequency(self) -> Float[Array, "*branch point"]:
        """Along the curve; goes back where the response folds [Hz]."""
        return self.branch.points.frequency

    @property
    def amplitude(self) -> Float[Array, "*branch point"]:
        """Half the peak-to-peak displacement [m]."""
        return self.branch.points.response

    @property
    def phase(self) -> Float[Array, "*branch point"]:
        """Of the fundamental of the displacement after the recorded drive, in (-pi, pi] [rad]."""
        return jnp.angle(self.receptance)

    @property
    def stable(self) -> Bool[Array, "*branch point"]:
        """Whether each orbit is stable."""
        return self.branch.points.stable

    @property
    def special_points(self) -> tuple[SpecialPoint, ...]:
        """Folds and other bifurcations of the curve."""
        return self.branch.special_points

    @property
    def band(self) -> Band | None:
        """Of frequency and amplitude, across the curve, where a fit was given."""
        own = self.branch.band
        if own is None:
            return None
        error, lower, upper = (
            {"frequency": part["value"], "amplitude": part["response"]}
            for part in (own.standard_error, own.lower, own.upper)
        )
        bent = own.curved
        curved = None if bent is None else {"frequency": bent["value"], "amplitude": bent["response"]}
        return Band(error, lower, upper, own.confidence, curved)

    @property
    def result(self) -> RESULTS:
        """Whether the curve was followed to its end."""
        return self.branch.result

    def _headline(self) -> str:
        points = self.branch.points
        response, frequency = np.asarray(points.response), np.asarray(points.frequency)
        if not np.isfinite(response).any():
            return self.branch._headline()
        top = np.nanargmax(response)
        drive = amount(np.asarray(points.amplitude).ravel()[top], DRIVE_UNITS[self.branch.model.excitation])
        peak = f"{amount(response.ravel()[top], 'm')} at {number(frequency.ravel()[top])} Hz"
        if self.branch.missing_part:
            return f"{self.branch._headline()}; largest response so far {peak} under a drive of {drive}"
        return f"largest response {peak} under a drive of {drive}; {self.branch._headline()}"

    def _rows(self) -> list[str]:
        return ["branch", "receptance", *(["band"] if self.band is not None else []), "others"]

    def _lines(self) -> list[str]:
        return self.branch._lines()


def frequency_response(
    model: Isolator | Modelled,
    amplitude: Any,
    frequencies: Any,
    *,
    periods: Sequence[int] = (1, 2, 3),
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    events: Sequence[BranchEvent] = (),
    fit: Estimated | EndsEstimated | None = None,
) -> FrequencyResponse:
    """Follow the periodic response over frequency, and look for responses beside it.

    The curve itself starts with the smallest motion at the first frequency. Orbits that it does not reach are
    sought over the whole band and followed as curves of their own, in `others`: detached response curves
    (isolas), and subharmonics of order 1/n, which repeat after n drive periods. Superharmonics have the
    period of the drive: they are peaks of the curve, or in `others` where they are detached.

    Args:
        model: the isolator.
        amplitude: of the drive, a number or a list of them [N, or m/s^2 for base excitation].
        frequencies: of which the first and the last bound the curve; either may be the larger [Hz]. The curve
            chooses its own points between them.
        periods: drive periods after which the motions beside the curve repeat; () to look for none.
        step: largest step, over the size of the motion and the range of frequency.
        most: points to give up after.
        integrator: solver and steps; 256 a period if omitted.
        events: numbers of the orbits whose zeros are located among the special points of the curve and of
            those beside it; see `continue_branch`.
        fit: with whose errors the curves and their special points are given bands; `model` is its model. None
            for no band.

    Returns:
        The response. Where it ends early `result` says so, and the points found so far stand.

    Raises:
        ValueError: if an amplitude is not positive, there are not two different positive frequencies, or
            `periods`, `step` or `most` is not positive, or two events have one name or that of a bifurcation.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 4.1 (the curve) and 4.2 (subharmonics).

    Example:
        >>> response = ij.frequency_response(ij.paper.y_direction(), 50.0, (4.0, 7.0))
        >>> place = int(abs(response.receptance).argmax())
        >>> print(f"resonance near {float(response.branch.points.frequency[place]):.1f} Hz")
        resonance near 5.5 Hz
    """
    model = as_isolator(model)
    check_float64()
    forces, ends = np.asarray(amplitude, dtype=float), np.asarray(frequencies, dtype=float)
    if forces.ndim > 1 or not forces.size or not np.all(np.isfinite(forces) & (forces > 0.0)):
        raise ValueError(
            f"Argument `amplitude` must be a positive number or a list of them, but is {amplitude}."
        )
    good = ends.ndim == 1 and ends.size > 1 and bool(np.all(np.isfinite(ends) & (ends > 0.0)))
    if not good or ends[0] == ends[-1]:
        raise ValueError(
            "Argument `frequencies` must hold positive numbers and end at another than it begins with, but "
            f"is {frequencies}."
        )

    if any(count < 1 for count in periods):
        raise ValueError(f"Argument `periods` must hold positive counts, but is {tuple(periods)}.")

    branch = continue_branch(
        model,
        parameter="frequency",
        amplitude=jnp.asarray(forces),
        start=float(ends[0]),
        stop=float(ends[-1]),
        other_periods=periods,
        step=step,
        most=most,
        integrator=integrator,
        events=events,
        fit=fit,
    )
    others = tuple(FrequencyResponse(one, _receptance(model, one)) for one in branch.others)
    return FrequencyResponse(branch, _receptance(model, branch), others)


def _receptance(model: Isolator, branch: Branch) -> Complex[Array, "*branch point"]:
    points = branch.points
    shape, states = points.frequency.shape, points.y0.shape[-1]
    count = math.prod(shape)
    lanes = [
        points.amplitude.reshape(count),
        points.frequency.reshape(count),
        *points.y0.reshape(count, states).T,
    ]
    # Rounded up, so that few shapes are compiled.
    room = -count % 128
    amplitude, frequency, *state = (jnp.pad(lane, (0, room), constant_values=jnp.nan) for lane in lanes)
    found = _receptances(model, branch.integrator, branch.periods, amplitude, frequency, tuple(state))
    return found[:count].reshape(shape)


@quick_jit
def _receptances(
    model: Isolator, integrator: Integrator, periods: int, amplitude: Array, frequency: Array, state: State
) -> Complex[Array, " point"]:
    drive = recorded_sine(model, amplitude, frequency)
    path = trajectory(model, integrator, drive, state, turns=float(periods))
    # The recorded drive is a sine: -i of its amplitude times exp(i omega t).
    return fundamental(path[0], periods) / jax.lax.complex(0.0 * frequency, -amplitude)


def fundamental(path: Float[Array, "time ..."], periods: int | float = 1) -> Complex[Array, "..."]:
    """Give the complex amplitude X of the fundamental `X exp(i omega t)`, omega that of the drive.

    Args:
        path: a signal at equidistant instants of some drive periods, both ends included.
        periods: how many; half of one does for a signal whose other half is minus the first.

    Returns:
        X, with the modulus of the amplitude.
    """
    steps = path.shape[0] - 1
    turn = 2.0 * np.pi * periods / steps * np.arange(steps)
    real = jnp.tensordot(np.cos(turn), path[:-1], axes=1)
    imaginary = jnp.tensordot(np.sin(turn), path[:-1], axes=1)
    return jax.lax.complex(real, -imaginary) * (2.0 / steps)


def drive_amplitude(drive: Sine) -> Complex[Array, "..."]:
    """Give the complex amplitude of a sine.

    Args:
        drive: the sine.

    Returns:
        D of `D exp(i omega t)`.
    """
    cosine = jnp.broadcast_to(jnp.asarray(drive.cosine), jnp.shape(drive.sine))
    return jax.lax.complex(cosine, -jnp.asarray(drive.sine))
