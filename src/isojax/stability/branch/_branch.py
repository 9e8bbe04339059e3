"""A branch of periodic orbits: its points, its bifurcations, and what following another one needs."""

import math
from collections.abc import Callable
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._quantities import typeset_unit
from ..._results import RESULTS, names_of_results
from ..._show import Row, amount, brief, number, shown
from ..._types import Scalar
from ...models import Band, Integrator, Isolator
from ..orbit import ShootingMethod, modulus, pair_angle
from ._drive_words import drive_in_words, unit_of
from ._parameter_family import ParameterFamily


@shown
class BranchPoints(eqx.Module):
    """Points along a branch, in the order found; NaN past the end of the shorter branches of a batch.

    Attributes:
        value: of the parameter [its SI unit].
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
        response: half the peak-to-peak displacement [m].
        multipliers: over the period of the orbit, in falling modulus.
        half_period_multipliers: those of the half-period map; NaN where the orbits are not symmetric.
        tangent: unit vector along the branch, of the scaled state and the share of the parameter's range.
    """

    value: Float[Array, "*points"]
    amplitude: Float[Array, "*points"]
    frequency: Float[Array, "*points"]
    y0: Float[Array, "*points state"]
    response: Float[Array, "*points"]
    multipliers: Complex[Array, "*points multiplier"]
    half_period_multipliers: Complex[Array, "*points multiplier"]
    tangent: Float[Array, "*points unknown"]

    @property
    def spectral_radius(self) -> Float[Array, "*points"]:
        """Largest modulus of the multipliers."""
        return modulus(self.multipliers[..., 0])

    @property
    def stable(self) -> Bool[Array, "*points"]:
        """Whether every disturbance dies out."""
        return self.spectral_radius < 1.0

    def _headline(self) -> str:
        known = np.isfinite(np.asarray(self.value))
        stable = np.abs(np.asarray(self.multipliers)[..., 0]) < 1.0
        return f"{int(known.sum())} points, {int(stable.sum())} of them stable"


@shown
class BranchEvent(eqx.Module):
    """Something to look out for along a branch: a named number of its orbits whose zero is located.

    Attributes:
        name: by which the special points are called.
        function: gives the number of one orbit, a `BranchPoints` of a single point; written with `jax.numpy`,
            and smooth where its derivative is wanted.

    Example:
        >>> ij.BranchEvent("5 mm", lambda orbit: orbit.response - 5e-3).name
        '5 mm'
    """

    name: str = eqx.field(static=True)
    function: Callable[[BranchPoints], Scalar] = eqx.field(static=True)

    def _headline(self) -> str:
        return self.name


@shown
class SpecialPoint(eqx.Module):
    """A bifurcation of periodic orbits, or the zero of an event.

    Attributes:
        kind: "fold", "period_doubling", "neimark_sacker" (quasi-periodic motion begins there) or
            "symmetry_breaking"; of an event its name.
        periods: drive periods after which the orbit repeats.
        branch: which branch of a batch it lies on; 0 for a single one.
        value: of the parameter [its SI unit].
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
        multipliers: over `periods` drive periods, in falling modulus.
        half_period_multipliers: those of the half-period map; NaN where the orbit is not symmetric.
        direction: direction of the state in which the orbit loses its hold, SI units; of a pair
            its real part; NaN of an event.
        result: whether it was found to the tolerance of a single orbit (of an event, of the branch's own
            steps); if not, its numbers are NaN.
        family: isolators and drives along the parameter.
        integrator: steps and solver.
        symmetric: whether it was closed with the half-period map.
        band: of value, amplitude and frequency, where a fit was given; zero wide for what is held fixed. Of
            the models that have the bifurcation, where not all within the errors do.
        probability: that the true isolator has it, by the share of the models within the errors of the fit
            that do; None without a fit, and of an event.
        probability_error: standard error of that share, by the count of models.
    """

    kind: str = eqx.field(static=True)
    periods: int = eqx.field(static=True)
    branch: int = eqx.field(static=True)
    value: Float[Array, ""]
    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    y0: Float[Array, " state"]
    multipliers: Complex[Array, " multiplier"]
    half_period_multipliers: Complex[Array, " multiplier"]
    direction: Float[Array, " state"]
    result: RESULTS
    family: ParameterFamily
    integrator: Integrator
    symmetric: bool = eqx.field(static=True)
    band: Band | None = None
    probability: float | None = None
    probability_error: float | None = None

    @property
    def method(self) -> ShootingMethod:
        """How the orbit is closed."""
        return ShootingMethod(self.integrator, self.periods, self.symmetric)

    @property
    def spectral_radius(self) -> Float[Array, ""]:
        """Largest modulus of the multipliers."""
        return modulus(self.multipliers[0])

    @property
    def rotation_number(self) -> Float[Array, ""]:
        """Turns around the orbit within its period of the quasi-periodic motion that begins at a Neimark-
        Sacker bifurcation, up to whole turns and their sense: from 0 to 1/2; NaN of other kinds.
        """
        angle = pair_angle(self.multipliers) / (2.0 * math.pi)
        return angle if self.kind == "neimark_sacker" else jnp.nan * angle

    def _headline(self) -> str:
        drive = drive_in_words(self.family.model, self.amplitude, self.frequency, self.band)
        after = "" if self.periods == 1 else f", orbit over {self.periods} drive periods"
        torus = ""
        if self.kind == "neimark_sacker" and np.isfinite(np.asarray(self.value)):
            turns = number(float(self.rotation_number))
            torus = f": quasi-periodic motion begins here, rotation number {turns}"
        doubt = ""
        if self.probability is not None and self.probability < 1.0:
            doubt = f"; exists with probability {number(self.probability)}"
        return f"{self.kind.replace('_', ' ')} at {drive}{after}{torus}{doubt}"

    @property
    def in_doubt(self) -> str:
        """How probable a bifurcation is that the fitted model lacks, and where it lies if it exists."""
        kind, name = self.kind.replace("_", " "), self.family.names[0]
        held = {"amplitude": self.amplitude, "frequency": self.frequency}
        units = {one: typeset_unit(unit_of(self.family.model, one)) for one in held}
        at = ", ".join(f"{number(float(held[one]))} {units[one]}" for one in held if one != name)
        chance = f"{kind}: probability {number(self.probability)} at {at}"
        if self.band is None or not np.isfinite(float(self.band.lower["value"])):
            return chance
        unit = typeset_unit(unit_of(self.family.model, name))
        low, high = (number(float(end["value"])) for end in (self.band.lower, self.band.upper))
        share = f"{self.band.confidence:.0%}"
        return f"{chance}; where there is one, {share} of its {name} lies in {low} to {high} {unit}".rstrip()

    def _rows(self) -> list[str]:
        own = ["value", *(["band", "probability"] if self.band is not None else [])]
        return [*own, "y0", "multipliers", "direction", "result"]


@shown
class Searched(eqx.Module):
    """Where branches beside one were sought.

    Attributes:
        parameter: what varies.
        values: of the parameter, at which states were spread around the branch [its SI unit].
        periods: drive periods of the orbits that were sought.
        displacement: largest displacement amplitude of the motions that were tried [m].
        left: orbits that lie on branches that were not followed any more.
        starts: states from which an orbit was sought.
        unsettled: those of them from which Newton's method closed no motion. What lies there is not known.
    """

    parameter: str = eqx.field(static=True)
    values: Float[Array, " value"]
    periods: tuple[int, ...] = eqx.field(static=True)
    displacement: float
    left: int
    starts: int
    unsettled: int

    def _headline(self) -> str:
        *more, last = map(str, self.periods)
        periods = f"{', '.join(more)} and {last}" if more else last
        values = np.asarray(self.values)
        span = f"{number(values.min())} to {number(values.max())}"
        where = f"{values.size} values of {self.parameter} from {span}"
        left = f"; {self.left} orbits lie on branches that were not followed" if self.left else ""
        open_ended = f"; {self.unsettled} of {self.starts} starts did not settle" if self.unsettled else ""
        size = amount(self.displacement, "m")
        return f"orbits of {periods} drive periods, up to {size}, at {where}{left}{open_ended}"


@shown
class Branch(eqx.Module):
    """Periodic orbits along one parameter, or a batch of such branches.

    Attributes:
        model: the isolator.
        parameter: what varies.
        periods: drive periods after which the orbits repeat.
        symmetric: whether they were closed with the half-period map, so that the second half of each is minus
            the first.
        closed: whether the branch returns to its first point.
        points: the orbits.
        special_points: bifurcations and events in the order of the branch; of a batch, branch after branch.
        result: whether the branch was followed to the end of the range, or back to its start.
        family: isolators and drives along the parameter.
        integrator: steps and solver.
        scale: size of each state.
        longest: largest step.
        others: branches that this one does not reach within the range, each followed both ways: closed curves
            (isolas), curves that leave the range, subharmonics. Of mirror images one is given, and of the
            orbits that are one motion counted from another drive period.
        searched: where they were sought; None if they were not.
        events: what was looked out for.
        band: of value and response, across the branch, where a fit was given.
        possible_points: bifurcations that the model has not, but others within the errors of the fit have,
            each at the nearest such model, with its probability; `find_again` starts from there as from a
            special point. Empty without a fit.
        undecided: places where models within the errors of the fit should have a bifurcation, by their first
            derivatives, but none was found: whether the true isolator has one is not known.
    """

    model: Isolator
    parameter: str = eqx.field(static=True)
    periods: int = eqx.field(static=True)
    symmetric: bool = eqx.field(static=True)
    closed: Bool[Array, "*branch"]
    points: BranchPoints
    special_points: tuple[SpecialPoint, ...]
    result: RESULTS
    family: ParameterFamily
    integrator: Integrator
    scale: Float[Array, "*branch state"]
    longest: float = eqx.field(static=True)
    others: tuple["Branch", ...] = ()
    searched: Searched | None = None
    events: tuple[BranchEvent, ...] = ()
    band: Band | None = None
    possible_points: tuple[SpecialPoint, ...] = ()
    undecided: int = eqx.field(static=True, default=0)

    @property
    def connection(self) -> Literal["none", "bifurcation", "unknown"]:
        """How it meets other branches: at a "bifurcation", where its orbits lose a doubled period or regain a
        symmetry; "none" if it closes on itself without one; "unknown" if it goes on outside the range.
        """
        points = self.special_points
        doubled = [point.kind == "period_doubling" and point.periods < self.periods for point in points]
        broken = [point.kind == "symmetry_breaking" and not self.symmetric for point in points]
        if any(doubled + broken):
            return "bifurcation"
        return "none" if np.all(np.asarray(self.closed)) else "unknown"

    @property
    def missing_part(self) -> str:
        """What of the range the branch lacks, and why, in words; "" where it has all of it."""
        names = names_of_results(self.result)
        lacking = [name for name in names if name != "successful"]
        if not lacking:
            return ""
        if len(names) > 1:
            held = lacking.count("sticks")
            why = f", {held} because dry friction holds the mass" if held else ""
            return f"NOT WHOLE: {len(lacking)} of {len(names)} curves{why}"
        values = np.asarray(self.points.value).ravel()
        held = lacking == ["sticks"]
        if not values.size:
            return (
                "dry friction holds the mass over the whole range" if held else "NO ORBIT FOUND to start from"
            )
        if held:
            span = f"{number(np.nanmin(values))} to {number(np.nanmax(values))}"
            return f"{self.parameter} {span} only, dry friction holds the mass beyond"
        return f"NOT WHOLE: the search stopped at {self.parameter} {number(values[-1])}"

    @property
    def undecided_part(self) -> str:
        """Where bifurcations were sought within the errors of the fit in vain, in words; "" if nowhere."""
        if not self.undecided:
            return ""
        places = "1 place" if self.undecided == 1 else f"{self.undecided} places"
        return f"whether isolators within the errors have bifurcations was not found out at {places}"

    def _headline(self) -> str:
        kinds = [point.kind.replace("_", " ") for point in self.special_points]
        special = ", ".join(f"{kinds.count(kind)} × {kind}" for kind in dict.fromkeys(kinds))
        doubt = self.possible_points or self.undecided
        none = "no bifurcation of its own" if doubt else "no bifurcation"
        words = f"along {self.parameter}, {self.points._headline()}; {special or none}"
        return f"{self.missing_part}; {words}" if self.missing_part else words

    def _rows(self) -> list[str | Row]:
        points = self.points
        own = ["model", "closed", "result"]
        span = [Row(name, brief(getattr(points, name))) for name in ("amplitude", "frequency", "response")]
        return [*own, *span, *(["band"] if self.band is not None else [])]

    def _lines(self) -> list[str]:
        lines = [f"  {point._headline()}" for point in self.special_points]
        lines += [f"  possible {point.in_doubt}" for point in self.possible_points]
        lines += [f"  {self.undecided_part}"] if self.undecided else []
        return lines + self._beside_lines()

    def _beside_lines(self) -> list[str]:
        """Say which branches were found beside this one and where they were sought, a line each."""
        if self.searched is None:
            return []
        beside = [f"  beside it {other._in_words()}" for other in self.others]
        return [*beside, f"  looked for beside it: {self.searched._headline()}"]

    def _in_words(self) -> str:
        """Say what kind of curve this is beside another, where it lies and how large its motions are."""
        how = {
            "none": "detached, a closed curve",
            "bifurcation": "from a bifurcation, a curve",
            "unknown": "not reached in this range, a curve",
        }
        points, after = self.points, "" if self.periods == 1 else f" of {self.periods} drive periods"
        value, stable = np.asarray(points.value), np.abs(np.asarray(points.multipliers)[..., 0]) < 1.0
        span = f"{self.parameter} {number(np.nanmin(value))} to {number(np.nanmax(value))}"
        size = amount(np.nanmax(np.asarray(points.response)), "m")
        held = f"{int(stable.sum())} of {value.size} points stable"
        words = f"{how[self.connection]}{after}: {span}, up to {size}, {held}"
        return f"{words}; {self.missing_part}" if self.missing_part else words
