"""Curves of bifurcations over the plane of the drive's amplitude and frequency."""

import dataclasses
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..._implicit import frozen
from ..._results import is_successful
from ..._types import check_float64
from ...models import (
    Band,
    CoefficientErrors,
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    Modelled,
    as_isolator,
    coefficient_errors,
    find_band_across,
)
from ..orbit import ShootingMethod, answer_sizes, integrator_that_follows, is_odd, refuse_traced
from ._arc_length import Stride
from ._bifurcation_curves import CodimensionTwoPoint, FoldCurve, NeimarkSackerCurve, PeriodDoublingCurve
from ._branch import SpecialPoint
from ._branch_bands import with_bands_at
from ._branch_switching import switch_branch
from ._continuation import continue_branch, follow_branches, swept_family, tracing_steps
from ._criticality import BifurcationKind
from ._extended_system import Polished
from ._locating import BranchCurves, critical_values_along, locate
from ._orbit_curve import CurvePoints, CurveStart, OrbitCurve, Whole
from ._parameter_family import family_of
from ._tracing import room_for


def fold_curve(
    model: Isolator | Modelled,
    *,
    amplitude_range: tuple[float, float],
    frequency_range: tuple[float, float],
    start: SpecialPoint | None = None,
    search: int = 17,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> FoldCurve:
    """Follow the folds over the plane of the drive's amplitude and frequency.

    The map's fixed point, its critical direction and both parameters are followed together; each point is
    then found anew with the motion split at its kinks. Where the quadratic coefficient `w D^2 P [v, v]`
    changes sign the curve has a cusp. `jax.jacfwd` and `jax.grad` over the model work: points move across the
    curve.

    Args:
        model: the isolator.
        amplitude_range: window of F0 [N, or m/s^2 for base excitation], ascending.
        frequency_range: window of f [Hz], ascending.
        start: a fold inside the window; the first met by branches along the amplitude if omitted.
        search: frequencies at which it is then looked for.
        step: largest step, over the size of the motion and the window.
        most: points to give up after.
        integrator: solver and steps; 256 a period if omitted.
        fit: with whose errors the curve and its special points are given bands; `model` is its model. None
            for no band.

    Returns:
        The curve: closed, or from edge to edge of the window.

    Raises:
        ValueError: if a range is not positive and ascending, `start` is no fold that was found, none was met
            inside the window, `search`, `step` or `most` is not positive, a state of the model is too fast
            for any steps, or `fit` failed, leaves a coefficient undetermined or is of another model.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, secs. 9.5 (cusp) and 10.3; Govaerts 2000,
    Numerical Methods for Bifurcations of Dynamical Equilibria, ch. 4.

    Example:
        >>> model = ij.paper.y_direction()
        >>> folds = ij.fold_curve(model, amplitude_range=(100.0, 250.0), frequency_range=(3.8, 4.8))
        >>> ij.is_successful(folds.result)
        True
    """
    model = as_isolator(model)
    errors = None if fit is None else coefficient_errors(fit, model)
    search_for = _Search("fold", (amplitude_range, frequency_range), search, Stride(step, most))
    curve = _curve(model, search_for, start, integrator)
    followed, points, special = _followed(curve)
    method, closed, result = curve.method, jnp.array(followed.closed), followed.result(points.found)
    special, band = _bands(curve, followed, special, errors)
    return FoldCurve(*points[:4], special, closed, method.periods, method.half, result, band)


def period_doubling_curve(
    model: Isolator | Modelled,
    *,
    amplitude_range: tuple[float, float],
    frequency_range: tuple[float, float],
    start: SpecialPoint | None = None,
    search: int = 5,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> PeriodDoublingCurve:
    """Follow the period doublings over the plane of the drive's amplitude and frequency.

    The arguments are those of `fold_curve`, `start` a period doubling inside the window; if omitted, the
    first met by branches along the amplitude, or by those that leave them at a broken symmetry.

    Returns:
        The curve: closed, or from edge to edge of the window.

    Raises:
        ValueError: as `fold_curve` does.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: as of `fold_curve`; Swift & Wiesenfeld 1984, Phys. Rev. Lett. 52:705.
    """
    search_for = _Search("period_doubling", (amplitude_range, frequency_range), search, Stride(step, most))
    model = as_isolator(model)
    errors = None if fit is None else coefficient_errors(fit, model)
    curve = _curve(model, search_for, start, integrator)
    followed, points, special = _followed(curve)
    closed, result = jnp.array(followed.closed), followed.result(points.found)
    special, band = _bands(curve, followed, special, errors)
    return PeriodDoublingCurve(*points[:4], special, closed, curve.method.periods, result, band)


def neimark_sacker_curve(
    model: Isolator | Modelled,
    *,
    amplitude_range: tuple[float, float],
    frequency_range: tuple[float, float],
    start: SpecialPoint | None = None,
    search: int = 5,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    fit: Estimated | EndsEstimated | None = None,
) -> NeimarkSackerCurve:
    """Follow the Neimark-Sacker bifurcations over the plane of the drive's amplitude and frequency.

    There a pair of multipliers `exp(+-i theta)` is on the unit circle, and quasi-periodic motion begins. The
    curve ends where the pair meets at +1 or at -1 (resonances 1:1 and 1:2); behind these two real
    multipliers have the product one, which bifurcates nothing. Where theta passes 120 or 90 degrees are the
    resonances 1:3 and 1:4.

    The arguments are those of `fold_curve`, `start` a Neimark-Sacker bifurcation inside the window; if
    omitted, the first met by branches along the amplitude.

    Returns:
        The curve: closed, or between edges of the window and resonances.

    Raises:
        ValueError: as `fold_curve` does.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, secs. 9.5 (resonances) and 10.3.

    Example:
        >>> van_der_pol = (ij.LinearStiffness(1.0), ij.LinearDamping(-0.3), ij.PositionDamping(0.3))
        >>> window = {"amplitude_range": (0.1, 2.0), "frequency_range": (0.18, 0.24)}
        >>> curve = ij.neimark_sacker_curve(ij.Isolator(1.0, van_der_pol), **window)
        >>> ij.is_successful(curve.result), bool(curve.closed)
        (True, False)
    """
    search_for = _Search("neimark_sacker", (amplitude_range, frequency_range), search, Stride(step, most))
    model = as_isolator(model)
    errors = None if fit is None else coefficient_errors(fit, model)
    curve = _curve(model, search_for, start, integrator)
    followed = curve.follow()
    followed, found = _between_resonances(followed, curve.polished(followed))
    special = curve.special_points(followed, found)
    # Where the curve was cut there must be a resonance.
    ends = sum(is_successful(point.result) for point in special if point.kind in _ENDS)
    inside = ~(np.abs(found.cosine) > 1.0)
    followed = followed._replace(ended=(all(followed.ended) and ends >= np.sum(~inside),) * 2)
    points = curve.numbers(jax.tree.map(lambda own: own[inside], found))
    closed, result = jnp.array(followed.closed), followed.result(points.found)
    method = curve.method
    on = followed._replace(unknowns=followed.unknowns[inside], tangents=followed.tangents[inside])
    special, band = _bands(curve, on, special, errors)
    return NeimarkSackerCurve(*points[:4], special, closed, method.periods, method.half, result, band)


def _followed(curve: OrbitCurve) -> tuple[Whole, CurvePoints, tuple[CodimensionTwoPoint, ...]]:
    """Give a curve as followed, its points found anew, and its special points."""
    followed = curve.follow()
    found = curve.polished(followed)
    return followed, curve.numbers(found), curve.special_points(followed, found)


def _bands(
    curve: OrbitCurve,
    followed: Whole,
    special: tuple[CodimensionTwoPoint, ...],
    errors: CoefficientErrors | None,
) -> tuple[tuple[CodimensionTwoPoint, ...], Band | None]:
    """Give the special points with their bands, and the band of the curve, where there are errors."""
    if errors is None:
        return special, None

    def across(isolator: Isolator) -> Array:
        moved = dataclasses.replace(curve, family=dataclasses.replace(curve.family, model=isolator))
        own = moved.numbers(moved.polished(followed))
        return jnp.stack([own.frequency, own.amplitude])

    band = find_band_across(errors, ("frequency", "amplitude"), across)
    return with_bands_at(special, errors), band


_ENDS = ("resonance_1_1", "resonance_1_2")
"""Where a curve of Neimark-Sacker bifurcations ends."""


def _between_resonances(whole: Whole, found: Polished) -> tuple[Whole, Polished]:
    """Give the part of a curve around its start on which the pair is on the unit circle, and one point more
    where it ends there.
    """
    inside = ~(np.abs(found.cosine) > 1.0)
    if inside.all():
        return whole, found
    count, start = inside.size, whole.start
    if whole.closed:
        # The last point is the first: turned so that the start is in the middle.
        turn = np.r_[np.arange(count // 2, count - 1), np.arange(count // 2 + 1)]
        whole = whole._replace(unknowns=whole.unknowns[turn], tangents=whole.tangents[turn], closed=False)
        found, inside = jax.tree.map(lambda own: own[turn], found), inside[turn]
        start = count - 1 - count // 2
    before, after = np.flatnonzero(~inside[:start]), np.flatnonzero(~inside[start:])
    first = int(before[-1]) if before.size else 0
    last = start + int(after[0]) if after.size else count - 1
    ended = bool(before.size) or whole.ended[0], bool(after.size) or whole.ended[1]
    return whole.part(first, last, ended), jax.tree.map(lambda own: own[first : last + 1], found)


_FREQUENCIES_TRIED = 17
"""Frequencies of a window at which states are looked at for how fast they are."""


class _Search(NamedTuple):
    """What curve is asked for.

    Attributes:
        kind: of its bifurcations.
        window: ranges of amplitude and frequency.
        frequencies: count of those at which a first point is looked for.
        stride: steps along the curve.
    """

    kind: BifurcationKind
    window: tuple[tuple[float, float], tuple[float, float]]
    frequencies: int
    stride: Stride


def _curve(
    model: Isolator,
    search: _Search,
    start: SpecialPoint | CurveStart | None,
    integrator: Integrator | None,
) -> OrbitCurve:
    """Check what was asked for, and give the search for a curve from its start on."""
    check_float64()
    refuse_traced(model)
    for name, ends in zip(("amplitude_range", "frequency_range"), search.window, strict=True):
        if not (len(ends) == 2 and 0.0 < ends[0] < ends[1] < math.inf):
            raise ValueError(f"Argument `{name}` must be two positive ascending numbers, but is {ends}.")
    counts = (("search", search.frequencies), ("step", search.stride.longest), ("most", search.stride.most))
    for name, value in counts:
        if not value > 0:
            raise ValueError(f"Argument `{name}` must be positive, but is {value}.")
    integrator = _steps_over(frozen(model), tracing_steps(model, integrator), search.window)
    if start is None:
        start = _meet(model, search, integrator)
    elif isinstance(start, SpecialPoint):
        if start.kind != search.kind or not is_successful(start.result):
            raise ValueError(
                f"Argument `start` must be a {search.kind} that was found, but is a {start.kind}."
            )
        # Only a symmetric orbit has multipliers over half a period; a doubling never is of one.
        symmetric = bool(np.isfinite(np.asarray(start.half_period_multipliers)).all())
        method = ShootingMethod(integrator, start.periods, symmetric)
        start = CurveStart(start.amplitude, start.frequency, start.y0, method)
    low, high = (jnp.asarray(np.array(ends)) for ends in zip(*search.window, strict=True))
    zero = jnp.asarray(np.zeros(()))
    family = family_of(model, (zero, zero), (low, high), ("amplitude", "frequency"))
    return OrbitCurve(family, start.method, search.kind, start, search.stride)


def _steps_over(
    model: Isolator, integrator: Integrator, window: tuple[tuple[float, float], tuple[float, float]]
) -> Integrator:
    """Give steps that follow the states of a model along its answers to the drives of a window."""
    if not model.internal_states:
        # Nothing is faster than the resonance, near which bifurcations lie.
        return integrator
    grid = np.meshgrid(window[0], np.linspace(*window[1], _FREQUENCIES_TRIED), indexing="ij")
    drives = [axis.ravel() for axis in grid]
    sizes = np.asarray(answer_sizes(model, *map(jnp.asarray, drives)))
    integrator, stiff = integrator_that_follows(model, integrator, sizes, drives[1])
    if stiff:
        raise ValueError(
            "Argument `model` must have no state that follows the motion within less than a step of "
            f"{integrator.steps_a_period(model)} a period, but has. Use the law that it tends to, such as "
            "dry friction for bristles that bend within a thousandth of the motion."
        )
    return integrator


def _meet(model: Isolator, search: _Search, integrator: Integrator) -> CurveStart:
    """Give where branches along the amplitude first meet a bifurcation of a kind."""
    (low, high), frequency_range = search.window
    frequencies = jnp.asarray(np.linspace(*frequency_range, search.frequencies))
    family, _ = swept_family(frozen(model), "amplitude", low, high, None, frequencies)
    method = ShootingMethod(integrator, 1, is_odd(frozen(model)))
    scale, followed = follow_branches(family, method, None, search.stride)
    found = np.asarray(followed.found)
    room = room_for(found, search.stride.most)
    points = followed.unknowns[:, :room], followed.tangents[:, :room]
    tests = critical_values_along(family, method, scale, *points)
    curves = BranchCurves(scale, points[0], found, tests)
    met = locate(family, method, curves)
    for point in met:
        if point.kind == search.kind:
            force = low + float(point.guess.shares[0]) * (high - low)
            return CurveStart(jnp.asarray(force), frequencies[point.branch], point.guess.state, point.method)
    if search.kind != "fold" and any(point.kind == "symmetry_breaking" for point in met):
        start = _meet_beside(model, search, integrator)
        if start is not None:
            return start
    raise ValueError(
        f"Argument `start` must be given where branches along the amplitude at {search.frequencies} "
        f"frequencies meet no {search.kind.replace('_', ' ')}, as in {(low, high)} x {frequency_range}, but "
        "is None."
    )


def _meet_beside(model: Isolator, search: _Search, integrator: Integrator) -> CurveStart | None:
    """Give where branches that leave those along the amplitude at a broken symmetry meet a bifurcation."""
    (low, high), frequency_range = search.window
    branch = continue_branch(
        frozen(model),
        parameter="amplitude",
        frequency=jnp.asarray(np.linspace(*frequency_range, search.frequencies)),
        start=low,
        stop=high,
        other_periods=(),
        step=search.stride.longest,
        integrator=integrator,
    )
    for point in branch.special_points:
        if point.kind == "symmetry_breaking" and is_successful(point.result):
            for further in switch_branch(branch, point).special_points:
                if further.kind == search.kind and is_successful(further.result):
                    return CurveStart(further.amplitude, further.frequency, further.y0, further.method)
    return None
