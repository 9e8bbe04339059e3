"""Curves of bifurcations over the plane of the drive's amplitude and frequency."""

import math
from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..._results import RESULTS, is_successful
from ..._types import check_float64
from ...models import EndsEstimated, Estimated, Integrator, Isolator, Modelled, as_isolator, find_band
from ..orbit import ShootingMethod, event_places, multipliers, refuse_traced, state_scale, trajectory
from ._arc_length import REACHED_BOUND, RETURNED, Departure, Followed, Stride, follow
from ._bifurcation_curves import Cusp, FoldCurve, PeriodDoublingCurve
from ._branch import SpecialPoint
from ._branch_switching import switch_branch
from ._continuation import continue_branch, tracing_steps
from ._extended_system import (
    CRITICAL,
    MOST_PLACES,
    BifurcationKind,
    PointGuess,
    Polished,
    null_vector,
    polish,
)
from ._parameter_family import ParameterFamily

_POLISHED_AT_ONCE = 64
"""Points of a curve found anew together."""

_ERROR = 1e-9
"""Error of the multipliers that the integration of a curve's points may leave."""

_CUSP_SECTIONS = 3
"""Times the step with a cusp is cut into as many pieces as there are points polished together."""


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
        fit: with whose errors the curve is given a band; `model` is its model. None for no band.

    Returns:
        The curve: closed, or from edge to edge of the window.

    Raises:
        ValueError: if a range is not positive and ascending, `start` is no fold that was found, none was met
            inside the window, or `search`, `step` or `most` is not positive.
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
    search_for = _Search("fold", (amplitude_range, frequency_range), search, Stride(step, most))
    curve = _curve(model, search_for, start, integrator)
    followed = curve.follow()
    found = curve.polished(followed.unknowns, followed.tangents)
    cusps = []
    for point in curve.cusps(followed.unknowns, found):
        cusp = point.moving(curve.family)
        amplitude, frequency = curve.family.values(cusp.shares)
        cusps.append(Cusp(amplitude, frequency, cusp.state))
    numbers, good = curve.numbers(found)
    method, closed = curve.method, jnp.array(followed.closed)
    result = followed.result(good)

    def across(isolator: Isolator) -> Array:
        moved = _curve(isolator, search_for, curve.start, integrator)
        amplitude, frequency, _, _ = moved.numbers(moved.polished(followed.unknowns, followed.tangents))[0]
        return jnp.stack([frequency, amplitude])

    names = ("frequency", "amplitude")
    band = None if fit is None else find_band(fit, model, names, across, across=True)
    return FoldCurve(*numbers, tuple(cusps), closed, method.periods, method.half, result, band)


def period_doubling_curve(
    model: Isolator,
    *,
    amplitude_range: tuple[float, float],
    frequency_range: tuple[float, float],
    start: SpecialPoint | None = None,
    search: int = 5,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
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
    curve = _curve(model, search_for, start, integrator)
    followed = curve.follow()
    numbers, good = curve.numbers(curve.polished(followed.unknowns, followed.tangents))
    closed, result = jnp.array(followed.closed), followed.result(good)
    return PeriodDoublingCurve(*numbers, closed, curve.method.periods, result)


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


class _Whole(NamedTuple):
    """A curve followed both ways: its points, and whether it closes and ends as it should."""

    unknowns: Array
    tangents: Array
    closed: bool
    ended: bool

    def result(self, good: Array) -> RESULTS:
        """Give the outcome, from which points were found."""
        well = jnp.asarray(self.ended) & jnp.all(good)
        return RESULTS.where(well, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged)


def _curve(
    model: Isolator, search: _Search, start: SpecialPoint | None, integrator: Integrator | None
) -> "_OrbitCurve":
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
    integrator = tracing_steps() if integrator is None else integrator
    start = _meet(model, search, integrator) if start is None else start
    if start.kind != search.kind or not is_successful(start.result):
        raise ValueError(f"Argument `start` must be a {search.kind} that was found, but is a {start.kind}.")
    low, high = (jnp.array(ends) for ends in zip(*search.window, strict=True))
    zero = jnp.zeros(())
    family = ParameterFamily(model, zero, zero, low, high, ("amplitude", "frequency"))
    # Only a symmetric orbit has multipliers over half a period; a doubling never is of one.
    symmetric = bool(np.isfinite(np.asarray(start.half_period_multipliers)).all())
    method = ShootingMethod(integrator, start.periods, symmetric)
    return _OrbitCurve(family, method, search.kind, start, search.stride)


def _meet(model: Isolator, search: _Search, integrator: Integrator) -> SpecialPoint:
    """Give the first bifurcation of a kind that branches along the amplitude meet."""
    (low, high), frequency_range = search.window
    branch = continue_branch(
        frozen(model),
        parameter="amplitude",
        frequency=jnp.linspace(*frequency_range, search.frequencies),
        start=low,
        stop=high,
        other_periods=(),
        step=search.stride.longest,
        integrator=integrator,
    )
    met = [point for point in branch.special_points if is_successful(point.result)]
    for point in met:
        if point.kind == search.kind:
            return point
    for point in met:
        if search.kind == "period_doubling" and point.kind == "symmetry_breaking":
            for further in switch_branch(branch, point).special_points:
                if further.kind == search.kind and is_successful(further.result):
                    return further
    raise ValueError(
        f"Argument `start` must be given where branches along the amplitude at {search.frequencies} "
        f"frequencies meet no {search.kind.replace('_', ' ')}, as in {(low, high)} x {frequency_range}, but "
        "is None."
    )


class _OrbitCurve(eqx.Module):
    """The search for one curve: traced by fixed steps, found anew with the motion split at its kinks."""

    family: ParameterFamily
    method: ShootingMethod
    kind: BifurcationKind = eqx.field(static=True)
    start: SpecialPoint
    stride: Stride = eqx.field(static=True)

    @property
    def still(self) -> ParameterFamily:
        """The isolators and drives without derivatives."""
        return frozen(self.family)

    def begin(self) -> tuple[Float[Array, " state"], Float[Array, " unknown"]]:
        """Give the size of the states, and the first point: scaled state, direction, shares."""
        family, start = self.still, frozen(self.start)
        shares = family.shares(jnp.stack([start.amplitude, start.frequency]))
        there, turns = family.at(shares), float(self.method.periods)
        path = trajectory(there.model, self.method.integrator, there.drive, tuple(start.y0), turns=turns)
        scale = state_scale(path)
        scaled = start.y0 / scale
        matrix = jax.jacfwd(lambda z: family.image(self.method, scale, z, shares))(scaled)
        direction = null_vector(matrix - CRITICAL[self.kind] * jnp.eye(scale.shape[0]))
        return scale, jnp.concatenate([scaled, direction, shares])

    def follow(self) -> _Whole:
        """Follow the curve from its start both ways."""
        scale, first = _begin(self)
        forth, back = (_walk(self, scale, first, sign) for sign in (1.0, -1.0))
        ends, counts = [int(way.ending) for way in (forth, back)], [int(way.found) for way in (forth, back)]
        if ends[0] == RETURNED:
            return _Whole(forth.unknowns[: counts[0]], forth.tangents[: counts[0]], True, True)
        unknowns = jnp.concatenate([back.unknowns[: counts[1]][:0:-1], forth.unknowns[: counts[0]]])
        tangents = jnp.concatenate([-back.tangents[: counts[1]][:0:-1], forth.tangents[: counts[0]]])
        return _Whole(unknowns, tangents, False, all(end == REACHED_BOUND for end in ends))

    def polished(self, unknowns: Array, normals: Array) -> Polished:
        """Give the points found anew."""
        scale, _ = _begin(self)
        count = unknowns.shape[0]
        rows = -(-count // _POLISHED_AT_ONCE)
        places = np.resize(np.arange(count), (rows, _POLISHED_AT_ONCE))
        room = event_places(self.family.model, self.method.turns)
        while True:
            parts = [_polish_points(self, room, scale, unknowns[part], normals[part]) for part in places]
            whole = jax.tree.map(lambda *values: jnp.concatenate(values)[:count], *parts)
            if bool(jnp.all(whole.complete)) or room > MOST_PLACES:
                return whole
            room *= 2

    def cusps(self, unknowns: Array, found: Polished) -> list[Polished]:
        """Give the points at which the quadratic coefficient changes sign."""
        bends = np.asarray(found.bend)
        cusps = []
        for place in np.nonzero(bends[:-1] * bends[1:] < 0.0)[0]:
            low, high, cusp = unknowns[place], unknowns[place + 1], found
            for _ in range(_CUSP_SECTIONS):
                chord = (high - low) / jnp.linalg.norm(high - low)
                shares = jnp.linspace(0.0, 1.0, _POLISHED_AT_ONCE)[:, None]
                along = low[None] + shares * (high - low)[None]
                section = self.polished(along, jnp.broadcast_to(chord, along.shape))
                bent = np.asarray(section.bend)
                change = np.nonzero(bent[:-1] * bent[1:] <= 0.0)[0]
                if not change.size:
                    break
                low, high = along[change[0]], along[change[0] + 1]
                nearest = int(np.argmin(np.abs(bent)))
                cusp = jax.tree.map(lambda values, at=nearest: values[at], section)
            else:
                cusps.append(cusp)
        return cusps

    def numbers(self, found: Polished) -> tuple[tuple[Array, Array, Array, Array], Array]:
        """Give amplitude, frequency, state and multipliers, and which points were found."""
        good = found.found & found.complete
        found = _moving_points(self.family, found)
        blank = jnp.where(good, 1.0, jnp.nan)
        values = jax.vmap(self.family.values)(found.shares) * blank[:, None]
        roots = multipliers(found.matrix * blank[:, None, None])
        roots = roots * roots if self.method.half else roots
        return (values[:, 0], values[:, 1], found.state * blank[:, None], roots), good


@eqx.filter_jit
def _begin(curve: _OrbitCurve) -> tuple[Array, Array]:
    return curve.begin()


@eqx.filter_jit
def _walk(curve: _OrbitCurve, scale: Array, first: Array, sign: float) -> Followed:
    family, states = curve.still, scale.shape[0]
    critical = CRITICAL[curve.kind]

    def equations(u: Array) -> Array:
        scaled, direction, shares = u[:states], u[states : 2 * states], u[2 * states :]

        def image(z: Array) -> Array:
            return family.image(curve.method, scale, z, shares)

        moved, shift = jax.jvp(image, (scaled,), (direction,))
        norm = (jnp.dot(direction, direction) - 1.0)[None]
        return jnp.concatenate([moved - scaled, shift - critical * direction, norm])

    fixed = jnp.zeros_like(first).at[-1].set(1.0)
    return follow(equations, Departure(first, fixed, sign * fixed), 2 * states, curve.stride)


@eqx.filter_jit
def _polish_points(
    curve: _OrbitCurve, places: int, scale: Array, unknowns: Array, normals: Array
) -> Polished:
    states = scale.shape[0]

    def lane(unknown: Array, normal: Array) -> Polished:
        plane = (normal, scale, unknown[states : 2 * states])
        guess = PointGuess(unknown[:states] * scale, unknown[2 * states :], plane)
        return polish(curve.still, curve.method, curve.kind, guess, places, _ERROR)

    return jax.vmap(lane)(unknowns, normals)


@eqx.filter_jit
def _moving_points(family: ParameterFamily, found: Polished) -> Polished:
    return jax.vmap(lambda point: point.moving(family))(found)
