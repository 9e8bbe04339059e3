"""What is known of a curve of bifurcations over the plane of the drive."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._results import RESULTS
from ..._show import brief, number, shown
from ...models import Band


@shown
class Cusp(eqx.Module):
    """Where two folds meet and end.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
    """

    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    y0: Float[Array, " state"]

    def _headline(self) -> str:
        return f"{number(float(self.amplitude))} N or m/s², {number(float(self.frequency))} Hz"


@shown
class FoldCurve(eqx.Module):
    """Folds over the plane of the drive: where an orbit meets a saddle and both vanish.

    Attributes:
        amplitude: F0 along the curve [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
        multipliers: in falling modulus; one is +1.
        cusps: where two folds meet. Derivatives of their amplitude and frequency by the model hold; the state
            moves along the critical direction as well, which its derivative leaves out.
        closed: whether the last point is the first.
        periods: drive periods after which the orbits repeat.
        symmetric: whether they were closed with the half-period map.
        result: whether the curve was followed until it closed or left the window, every point to the
            tolerance of a single orbit; points that were not are NaN.
        band: of frequency and amplitude, across the curve, where a fit was given.
    """

    amplitude: Float[Array, " point"]
    frequency: Float[Array, " point"]
    y0: Float[Array, "point state"]
    multipliers: Complex[Array, "point multiplier"]
    cusps: tuple[Cusp, ...]
    closed: Bool[Array, ""]
    periods: int = eqx.field(static=True)
    symmetric: bool = eqx.field(static=True)
    result: RESULTS
    band: Band | None = None

    def _headline(self) -> str:
        amplitude, frequency = brief(self.amplitude), brief(self.frequency)
        shape = "closed" if bool(np.asarray(self.closed)) else "open"
        return f"{shape} curve of folds: amplitude {amplitude}, frequency {frequency} Hz"


@shown
class PeriodDoublingCurve(eqx.Module):
    """Period doublings over the plane of the drive.

    Attributes:
        amplitude: F0 along the curve [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0 of the orbit that doubles, SI units.
        multipliers: in falling modulus; one is -1.
        closed: whether the last point is the first.
        periods: drive periods after which the orbits that double repeat.
        result: see `FoldCurve`.
    """

    amplitude: Float[Array, " point"]
    frequency: Float[Array, " point"]
    y0: Float[Array, "point state"]
    multipliers: Complex[Array, "point multiplier"]
    closed: Bool[Array, ""]
    periods: int = eqx.field(static=True)
    result: RESULTS

    def _headline(self) -> str:
        amplitude, frequency = brief(self.amplitude), brief(self.frequency)
        shape = "closed" if bool(np.asarray(self.closed)) else "open"
        return f"{shape} curve of period doublings: amplitude {amplitude}, frequency {frequency} Hz"
