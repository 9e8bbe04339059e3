"""What is known of a curve of bifurcations over the plane of the drive."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._implicit import frozen
from ..._results import RESULTS
from ..._show import brief, shown
from ...models import Band, Integrator
from ..orbit import ShootingMethod, pair_angle
from ._criticality import BifurcationKind
from ._drive_words import drive_in_words
from ._parameter_family import ParameterFamily

WORDS = {
    "cusp": "cusp",
    "generalised_doubling": "generalised period doubling (the doubled orbit turns unstable)",
    "resonance_1_1": "1:1 resonance (fold meets Neimark-Sacker)",
    "resonance_1_2": "1:2 resonance (doubling meets Neimark-Sacker)",
    "resonance_1_3": "1:3 resonance",
    "resonance_1_4": "1:4 resonance",
}


@shown
class CodimensionTwoPoint(eqx.Module):
    """A special point of a curve of bifurcations: two conditions meet there.

    Attributes:
        kind: "cusp", where two folds meet and end; "generalised_doubling", where the orbit of twice the
            period turns from stable to unstable, and from which a curve of its folds starts;
            "resonance_1_1", a pair of multipliers +1; "resonance_1_2", a pair -1; "resonance_1_3" and
            "resonance_1_4", a pair `exp(+-i theta)` with theta of 120 and of 90 degrees. The multipliers are
            those of the map that closes the orbit: for symmetric orbits over half a period.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units. Its derivative by the model leaves out, at a cusp, what moves along the
            critical direction; those of amplitude and frequency hold.
        multipliers: over the period of the orbit, in falling modulus.
        result: whether it was found; if not, its numbers are NaN.
        along: kind of the curve on which it lies.
        periods: drive periods after which the orbit repeats.
        symmetric: whether it was closed with the half-period map.
        family: isolators and drives over the window.
        integrator: steps and solver.
        towards: unit vector along the curve, of the scaled state and the shares of the window.
        scale: size of each state.
        rise: change along it of the coefficient that vanishes there; NaN where none does.
        band: of amplitude and frequency, where a fit was given.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, sec. 9.5.
    """

    kind: str = eqx.field(static=True)
    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    y0: Float[Array, " state"]
    multipliers: Complex[Array, " multiplier"]
    result: RESULTS
    along: BifurcationKind = eqx.field(static=True)
    periods: int = eqx.field(static=True)
    symmetric: bool = eqx.field(static=True)
    family: ParameterFamily
    integrator: Integrator
    towards: Float[Array, " unknown"]
    scale: Float[Array, " state"]
    rise: Float[Array, ""]
    band: Band | None = None

    @property
    def method(self) -> ShootingMethod:
        """How the orbit is closed."""
        return ShootingMethod(self.integrator, self.periods, self.symmetric)

    def _headline(self) -> str:
        if not np.isfinite(np.asarray(self.amplitude)):
            return f"{WORDS[self.kind]}, not found. {brief(self.result)}"
        where = drive_in_words(self.family.model, self.amplitude, self.frequency, self.band)
        return f"{WORDS[self.kind]} at {where}"


@shown
class FoldCurve(eqx.Module):
    """Folds over the plane of the drive: where an orbit meets a saddle and both vanish.

    Attributes:
        amplitude: F0 along the curve [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
        multipliers: in falling modulus; one is +1.
        special_points: cusps and 1:1 resonances, in the order of the curve.
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
    special_points: tuple[CodimensionTwoPoint, ...]
    closed: Bool[Array, ""]
    periods: int = eqx.field(static=True)
    symmetric: bool = eqx.field(static=True)
    result: RESULTS
    band: Band | None = None

    @property
    def cusps(self) -> tuple[CodimensionTwoPoint, ...]:
        """Where two folds meet and end, those that were found."""
        return _found(self.special_points, "cusp")

    def _headline(self) -> str:
        return _headline("folds", self)

    def _lines(self) -> list[str]:
        return [f"  {point._headline()}" for point in self.special_points]


@shown
class PeriodDoublingCurve(eqx.Module):
    """Period doublings over the plane of the drive.

    Attributes:
        amplitude: F0 along the curve [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0 of the orbit that doubles, SI units.
        multipliers: in falling modulus; one is -1.
        special_points: generalised doublings and 1:2 resonances, in the order of the curve.
        closed: whether the last point is the first.
        periods: drive periods after which the orbits that double repeat.
        result: see `FoldCurve`.
        band: see `FoldCurve`.
    """

    amplitude: Float[Array, " point"]
    frequency: Float[Array, " point"]
    y0: Float[Array, "point state"]
    multipliers: Complex[Array, "point multiplier"]
    special_points: tuple[CodimensionTwoPoint, ...]
    closed: Bool[Array, ""]
    periods: int = eqx.field(static=True)
    result: RESULTS
    band: Band | None = None

    def _headline(self) -> str:
        return _headline("period doublings", self)

    def _lines(self) -> list[str]:
        return [f"  {point._headline()}" for point in self.special_points]


@shown
class NeimarkSackerCurve(eqx.Module):
    """Neimark-Sacker bifurcations over the plane of the drive: where quasi-periodic motion begins.

    Attributes:
        amplitude: F0 along the curve [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0 of the periodic orbit, SI units.
        multipliers: in falling modulus; two are `exp(+-i theta)`.
        special_points: strong resonances, in the order of the curve.
        closed: whether the last point is the first.
        periods: drive periods after which the orbits repeat.
        symmetric: whether they were closed with the half-period map.
        result: whether the curve was followed until it closed, left the window or ended at a resonance 1:1 or
            1:2, every point to the tolerance of a single orbit; points that were not are NaN.
        band: see `FoldCurve`.
    """

    amplitude: Float[Array, " point"]
    frequency: Float[Array, " point"]
    y0: Float[Array, "point state"]
    multipliers: Complex[Array, "point multiplier"]
    special_points: tuple[CodimensionTwoPoint, ...]
    closed: Bool[Array, ""]
    periods: int = eqx.field(static=True)
    symmetric: bool = eqx.field(static=True)
    result: RESULTS
    band: Band | None = None

    @property
    def angle(self) -> Float[Array, " point"]:
        """Theta of the pair on the unit circle, from 0 to pi [rad]."""
        return pair_angle(self.multipliers)

    @property
    def rotation_number(self) -> Float[Array, " point"]:
        """Turns of the quasi-periodic motion around the orbit within `periods` drive periods, up to whole
        turns and their sense: theta / (2 pi), from 0 to 1/2.
        """
        return self.angle / (2.0 * np.pi)

    def _headline(self) -> str:
        return (
            f"{_headline('Neimark-Sacker bifurcations', self)}, rotation number {brief(self.rotation_number)}"
        )

    def _lines(self) -> list[str]:
        return [f"  {point._headline()}" for point in self.special_points]


def _headline(what: str, curve: FoldCurve | PeriodDoublingCurve | NeimarkSackerCurve) -> str:
    shape = "closed" if bool(np.asarray(curve.closed)) else "open"
    amplitude, frequency = brief(curve.amplitude), brief(curve.frequency)
    return f"{shape} curve of {what}: amplitude {amplitude}, frequency {frequency} Hz"


def _found(points: tuple[CodimensionTwoPoint, ...], kind: str) -> tuple[CodimensionTwoPoint, ...]:
    return tuple(
        point for point in points if point.kind == kind and np.isfinite(np.asarray(frozen(point.amplitude)))
    )
