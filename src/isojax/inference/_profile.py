"""Profile likelihood: how far one coefficient may go while all others make the best of it."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from .._given_numbers import given_chance
from .._parameters import find_parameter, list_parameters
from .._progress import silent
from .._quantities import typeset_unit
from .._results import RESULTS, is_successful
from .._show import Row, amount, number, shown
from .._types import check_float64
from ..identification import Coefficient, Fit, Rules
from ..identification.fitting import DEFAULT_SOLVER, Point, as_fit, fit_held, invert_information, search_of
from ..models import coefficient_errors

_STILL_GAINED = 1e-4
"""Decrease of chi2, per max(chi2/dof, 1), below which a search is over: an end of the interval is then off
by less than a thousandth of a standard error."""

_CLOSE = 5e-3
"""Share of its distance to the value within which an end is approached before it is interpolated."""

_MOST_HELD = 12
"""Points on either side at most: a straight profile needs two."""

_LONGEST_STEP = 4.0
"""A step outwards over the one before."""


@shown
class Profile(NamedTuple):
    """Profile likelihood of one coefficient.

    Attributes:
        name: of the coefficient.
        unit: of it.
        value: fitted.
        standard_error: of the fit.
        interval: lower and upper end; NaN where an end was not found, and `reasons` says why.
        confidence: chance that the interval is meant to hold the truth.
        coverage_factor: standard errors at which the root ends the interval: 1.96 for a confidence of 0.95.
        values: row at which the coefficient was held, ascending.
        root: signed root of the rise of chi2 there, in standard errors: a straight line of slope one over the
            standard error where the model is linear; NaN where the search of the others failed.
        others: names of the other free coefficients.
        best: their best values at each of the row.
        reasons: a sentence for each end that is not one of the profile, and each search that failed.
    """

    name: str
    unit: str
    value: float
    standard_error: float
    interval: Float[np.ndarray, "2"]
    confidence: float
    coverage_factor: float
    values: Float[np.ndarray, " row"]
    root: Float[np.ndarray, " row"]
    others: tuple[str, ...]
    best: Float[np.ndarray, "row other"]
    reasons: tuple[str, ...]

    @property
    def symmetric(self) -> Float[np.ndarray, "2"]:
        """The interval of the fit: value and standard error alone."""
        spread = self.coverage_factor * self.standard_error
        return np.array([self.value - spread, self.value + spread])

    def _headline(self) -> str:
        low, high = (number(float(end)) for end in self.interval)
        return f"{self.name}, {self.confidence:.0%} interval {low} to {high} {typeset_unit(self.unit)}"

    def _rows(self) -> list[Row]:
        spread = self.coverage_factor * self.standard_error
        rows = [Row("value", amount(self.value, self.unit, self.standard_error), "of the fit")]
        for word, end, other in zip(("lower end", "upper end"), self.interval, self.symmetric, strict=True):
            away = (float(end) - float(other)) / spread
            found = math.isfinite(away)
            beside = f"symmetric {amount(float(other), self.unit)}"
            beside += f", off by {away:+.1%} of the half-width" if found else ""
            rows.append(Row(word, amount(float(end), self.unit) if found else "not found", beside))
        return [*rows, Row("points", str(self.values.size), "at which the others were fitted anew")]

    def _lines(self) -> list[str]:
        return list(self.reasons)


class _Held(NamedTuple):
    """A point of the row: how far out it lies, root of the rise there, and the best fit."""

    away: float
    root: float
    point: Point


class _Side(NamedTuple):
    """What was found on one side of the fitted value.

    Attributes:
        points: from the fitted value outwards.
        lost: distance at which a search failed, if one did.
        end: distance of the end of the interval.
        reason: why it is not one of the profile, or "".
    """

    points: list[_Held]
    lost: tuple[float, ...]
    end: float
    reason: str


def profile(
    fit: object,
    name: str,
    *,
    confidence: float = 0.95,
    progress: Callable[[str], None] = silent,
) -> Profile:
    """Give the interval of one coefficient from the rise of chi2, all others fitted anew at each value.

    `t(p) = sign(p - p0) sqrt((chi2(p) - chi2(p0)) C / s^2)`, with C the variance of the coefficient at unit
    noise, and s its standard error in the fit. The interval ends where |t| is the coverage factor of the
    fit, 1.96 for 95 %: where the model is linear in its coefficients, at the ends that `uncertainty` gives.
    So the noise that chi2/dof shows, and that records tell the scatter of the stiffness only so well, count
    as in the fit. Where the motion is split at kinks, as under dry friction or at a stop, the initial states
    of the segments stay where the fit found them: beside a kink chi2 is rough in them.

    Each point starts from the optimum of its neighbour, by the search of the fit.

    Args:
        fit: a fit, or what ends with one: an extension, a closed loop.
        name: of a free coefficient, such as "cubic_stiffness.coefficient", or its symbol.
        confidence: chance that the interval is to hold the truth.
        progress: receives a line a point.

    Returns:
        The interval, and the row of points. An end that lies beyond a bound of the coefficient is the bound.

    Raises:
        ValueError: if the fit failed, the data do not determine the coefficient or it was held, or
            `confidence` is out of range.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Bates & Watts 1988, Nonlinear Regression Analysis, sec. 6.1 (profile t).

    Example:
        With the fit of `fit`'s example:

        >>> found = ij.profile(fitted, "c1")
        >>> bool(found.interval[0] < found.value < found.interval[1])
        True
    """
    check_float64()
    meant = as_fit(fit)
    confidence = given_chance("confidence", confidence)
    if not is_successful(meant.result):
        raise ValueError(f"Argument `fit` must have succeeded, but it did not. {RESULTS[meant.result]}")
    one = _coefficient(meant, name)
    estimate = meant.estimate
    search = search_of(meant.campaign, Rules(), DEFAULT_SOLVER, silent)
    search = search._replace(tolerance=_STILL_GAINED)
    begun = estimate.point._replace(nuisances=estimate.comparable_nuisances)
    lowest = fit_held(estimate, None, one.value, begun, search).point
    place = meant.free.index(one.name)
    unit_variance = invert_information(lowest.reduced.matrix[:-1, :-1]).covariance[place, place]
    scale = unit_variance / one.standard_error**2
    centre = float(lowest.model[one.name])
    spec = list_parameters(meant.model)[find_parameter(meant.model, one.name)].spec
    errors = coefficient_errors(meant)
    quantile = float(errors.coverage_factor(errors.root[place], 0.5 * (1.0 - confidence)))
    sides: list[_Side] = []
    for direction, bound in ((-1.0, spec.lower), (1.0, spec.upper)):

        def hold(away: float, near: Point, direction: float = direction) -> tuple[_Held, RESULTS]:
            value = centre + direction * away
            found = fit_held(estimate, one.name, value, near, search)
            rise = scale * (found.point.chi2 - lowest.chi2)
            root = math.copysign(math.sqrt(abs(rise)), rise)
            progress(f"{one.name} held at {amount(value, one.unit)}: {root:.3g} standard errors")
            return _Held(away, root, found.point), found.result

        room = direction * (bound - centre)
        sides.append(_walk(_Held(0.0, 0.0, lowest), hold, one.standard_error, quantile, room))
    return _profile(meant, one, confidence, quantile, centre, sides)


def _coefficient(fit: Fit, name: str) -> Coefficient:
    """Give the coefficient that is meant, which must be free and determined."""
    try:
        one = fit.parameters[name]
    except KeyError as error:
        raise ValueError(f"Argument `name` must name a coefficient: {error.args[0]}") from None
    if not one.fitted:
        raise ValueError(
            f"Argument `name` must name a free coefficient ({', '.join(fit.free)}), but {one.name} was held."
        )
    if not math.isfinite(one.standard_error):
        raise ValueError(
            f"Argument `name` must name a coefficient that the data determine, but they do not determine "
            f"{one.name}."
        )
    return one


def _walk(
    start: _Held,
    hold: Callable[[float, Point], tuple[_Held, RESULTS]],
    spread: float,
    quantile: float,
    room: float,
) -> _Side:
    """Go outwards until chi2 has risen enough, then close in on where it has.

    Args:
        start: the fit.
        hold: gives the point at a distance, from where the search starts, and how the search ended.
        spread: standard error.
        quantile: root at which the interval ends.
        room: distance of the bound.

    Returns:
        The side; its end is NaN where the walk was lost.
    """
    at_bound = "the bound of the coefficient is reached before chi2 has risen."
    points, lost = [start], float("nan")
    if not room > 0.0:
        return _Side(points, (), 0.0, at_bound)
    for _ in range(_MOST_HELD):
        away = min(_next_distance(points, spread, quantile), room)
        near = min(points, key=lambda one: abs(one.away - away))
        held, result = hold(away, near.point)
        if not is_successful(result):
            return _Side(points, (away,), lost, f"the search of the others failed. {RESULTS[result]}")
        points = sorted([*points, held], key=lambda one: one.away)
        roots = [one.root for one in points]
        if np.any(np.diff(roots) <= 0.0):
            return _Side(
                points,
                (),
                lost,
                "chi2 falls again on the way: another minimum, or the roughness beside a kink of a law.",
            )
        if away == room and held.root < quantile:
            return _Side(points, (), room, at_bound)
        if abs(held.root - quantile) < _CLOSE * quantile:
            return _Side(points, (), _distance_at(points, quantile), "")
    return _Side(points, (), lost, f"chi2 has not risen enough after {_MOST_HELD} points.")


def _next_distance(points: list[_Held], spread: float, quantile: float) -> float:
    """Give where to hold the coefficient next: half way to the quantile first, then at it."""
    last = points[-1]
    if len(points) == 1:
        return 0.5 * quantile * spread
    if last.root > quantile:
        return _distance_at(points, quantile)
    step = last.away - points[-2].away
    needed = (quantile - last.root) * step / (last.root - points[-2].root)
    return last.away + min(needed, _LONGEST_STEP * step)


def _distance_at(points: list[_Held], quantile: float) -> float:
    """Interpolate the distance at which the root is the quantile; it rises steadily."""
    roots, away = np.array([(one.root, one.away) for one in points]).T
    return float(PchipInterpolator(roots, away, extrapolate=True)(quantile))


def _profile(
    fit: Fit, one: Coefficient, confidence: float, quantile: float, centre: float, sides: list[_Side]
) -> Profile:
    """Put both sides into one row."""
    others = tuple(name for name in fit.free if name != one.name)
    rows: list[tuple[float, float, list[float]]] = []
    reasons: list[str] = []
    for word, direction, side in zip(("lower", "upper"), (-1.0, 1.0), sides, strict=True):
        # The fitted value itself begins both sides.
        for held in side.points[direction > 0.0 :]:
            best = [float(held.point.model[name]) for name in others]
            rows.append((centre + direction * held.away, direction * held.root, best))
        for away in side.lost:
            rows.append((centre + direction * away, float("nan"), [float("nan")] * len(others)))
        if side.reason:
            reasons.append(f"The {word} end: {side.reason}")
    rows.sort(key=lambda row: row[0])
    return Profile(
        one.name,
        one.unit,
        one.value,
        one.standard_error,
        np.array([centre - sides[0].end, centre + sides[1].end]),
        confidence,
        quantile,
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        others,
        np.array([row[2] for row in rows]).reshape(len(rows), len(others)),
        tuple(reasons),
    )
