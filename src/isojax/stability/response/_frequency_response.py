"""Response over frequency at one drive amplitude, past its folds, with its unstable segments."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._results import RESULTS
from ..._show import amount, number, shown
from ..._types import check_float64
from ...models import Band, EndsEstimated, Estimated, Integrator, Isolator, Modelled, as_isolator, find_band
from ..branch import Branch, SpecialPoint, continue_branch
from ..orbit import Sine, recorded_sine, trajectory


@shown
class FrequencyResponse(eqx.Module):
    """Periodic response over frequency, in the order of the curve.

    For a list of drive amplitudes an axis `branch` stands in front; the shorter curves end in NaN.

    Attributes:
        branch: the orbits.
        receptance: complex amplitude of the fundamental of the displacement over that of the recorded drive
            [m/N, or s^2 for base excitation].
        band: of frequency and amplitude, across the curve, where a fit was given.
    """

    branch: Branch
    receptance: Complex[Array, "*branch point"]
    band: Band | None = None

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
    def result(self) -> RESULTS:
        """Whether the curve was followed to its end."""
        return self.branch.result

    def _headline(self) -> str:
        points = self.branch.points
        response, frequency = np.asarray(points.response), np.asarray(points.frequency)
        top = np.nanargmax(response)
        drive = number(float(np.asarray(points.amplitude).ravel()[top]))
        peak = f"{amount(response.ravel()[top], 'm')} at {number(frequency.ravel()[top])} Hz"
        return f"largest response {peak} under a drive of {drive}; {self.branch._headline()}"

    def _rows(self) -> list[str]:
        return ["branch", "receptance", *(["band"] if self.band is not None else [])]

    def _lines(self) -> list[str]:
        return self.branch._lines()


def frequency_response(
    model: Isolator | Modelled,
    amplitude: Any,
    frequencies: Any,
    *,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> FrequencyResponse:
    """Follow the periodic response over frequency.

    The curve that starts with the smallest motion at the first frequency; one that closes on itself apart
    from it is not met.

    Args:
        model: the isolator.
        amplitude: of the drive, a number or a list of them [N, or m/s^2 for base excitation].
        frequencies: of which the first and the last bound the curve; either may be the larger [Hz]. The curve
            chooses its own points between them.
        step: largest step, over the size of the motion and the range of frequency.
        most: points to give up after.
        integrator: solver and steps; 256 a period if omitted.
        fit: with whose errors the curve is given a band; `model` is its model. None for no band.

    Returns:
        The response. Where it ends early `result` says so, and the points found so far stand.

    Raises:
        ValueError: if an amplitude is not positive, there are not two different positive frequencies, or
            `step` or `most` is not positive.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 4.1.

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

    def branch_of(isolator: Isolator) -> Branch:
        return continue_branch(
            isolator,
            parameter="frequency",
            amplitude=jnp.asarray(forces),
            start=float(ends[0]),
            stop=float(ends[-1]),
            step=step,
            most=most,
            integrator=integrator,
        )

    def curve(isolator: Isolator) -> Array:
        points = branch_of(isolator).points
        return jnp.stack([points.frequency, points.response])

    branch = branch_of(model)
    names = ("frequency", "amplitude")
    band = None if fit is None else find_band(fit, model, names, curve, across=True)
    return FrequencyResponse(branch, _receptance(model, branch), band)


@eqx.filter_jit
def _receptance(model: Isolator, branch: Branch) -> Complex[Array, "*branch point"]:
    points = branch.points
    shape = points.frequency.shape
    drive = recorded_sine(model, points.amplitude.ravel(), points.frequency.ravel())
    state = tuple(jnp.moveaxis(points.y0.reshape(-1, points.y0.shape[-1]), -1, 0))
    path = trajectory(model, branch.integrator, drive, state)
    # The recorded drive is a sine: -i of its amplitude times exp(i omega t).
    recorded = jax.lax.complex(0.0 * drive.frequency, -points.amplitude.ravel())
    return (fundamental(path[0]) / recorded).reshape(shape)


def fundamental(path: Float[Array, "time ..."]) -> Complex[Array, "..."]:
    """Give the complex amplitude X of the fundamental `X exp(i omega t)`.

    Args:
        path: a signal at equidistant instants of one drive period, both ends included.

    Returns:
        X, with the modulus of the amplitude.
    """
    steps = path.shape[0] - 1
    turn = 2.0 * np.pi / steps * np.arange(steps)
    real = jnp.tensordot(np.cos(turn), path[:-1], axes=1)
    imaginary = jnp.tensordot(np.sin(turn), path[:-1], axes=1)
    return jax.lax.complex(real, -imaginary) * (2.0 / steps)


def drive_amplitude(drive: Sine) -> Complex[Array, "..."]:
    """Give the complex amplitude of a drive.

    Args:
        drive: the drive.

    Returns:
        D of `D exp(i omega t)`.
    """
    cosine = jnp.broadcast_to(jnp.asarray(drive.cosine), jnp.shape(drive.sine))
    return jax.lax.complex(cosine, -jnp.asarray(drive.sine))
