"""A curve of bifurcations: followed by fixed steps, found anew with kinks split, and its special points."""

from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..orbit import ShootingMethod, event_places, multipliers, state_scale, trajectory, value_and_jacobian
from ._arc_length import REACHED_BOUND, RETURNED, Departure, Followed, Stride, follow
from ._bifurcation_curves import CodimensionTwoPoint
from ._criticality import BifurcationKind, criticality
from ._curve_special_points import TESTS, codimension_two_point
from ._extended_system import MOST_PLACES, PointGuess, Polished, polish
from ._parameter_family import ParameterFamily

_POLISHED_AT_ONCE = 16
"""Points of a curve found anew together."""

_ERROR = 1e-9
"""Error of the multipliers that the integration of a curve's points may leave."""

_SECANTS = 4
"""Steps of the secant method for the zero of a test function, after one section of its piece of the curve."""

_ZERO_TO = 1e-6
"""Value of a test function, over its change along the piece of the curve, up to which its zero is found."""


class CurveStart(NamedTuple):
    """Where a curve is started.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        state: at t = 0, near a bifurcation's.
        method: how the orbit is closed.
    """

    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    state: Float[Array, " state"]
    method: ShootingMethod


class Whole(NamedTuple):
    """A curve followed both ways.

    Attributes:
        scale: size of each state.
        unknowns: points: scaled states and shares.
        tangents: unit vectors along it.
        start: place of the first point.
        closed: whether it returns to its first point.
        ended: whether it does, or leaves the window: at its first end and at its last.
    """

    scale: Float[np.ndarray, " state"]
    unknowns: Float[np.ndarray, "point unknown"]
    tangents: Float[np.ndarray, "point unknown"]
    start: int
    closed: bool
    ended: tuple[bool, bool]

    def part(self, first: int, last: int, ended: tuple[bool, bool]) -> "Whole":
        """Give the points from one to another, both included."""
        own = slice(first, last + 1)
        return Whole(self.scale, self.unknowns[own], self.tangents[own], self.start - first, False, ended)

    def result(self, good: Array) -> RESULTS:
        """Give the outcome, from which points were found."""
        well = jnp.asarray(all(self.ended)) & jnp.all(good)
        return RESULTS.where(well, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged)


class CurvePoints(NamedTuple):
    """What is known of the points of a curve.

    Attributes:
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        y0: state at t = 0, SI units.
        multipliers: over the period of the orbit.
        found: which points were found; the numbers of the others are NaN.
    """

    amplitude: Float[Array, "*point"]
    frequency: Float[Array, "*point"]
    y0: Float[Array, "*point state"]
    multipliers: Array
    found: Bool[Array, "*point"]


class OrbitCurve(eqx.Module):
    """The search for one curve: traced by fixed steps, found anew with the motion split at its kinks."""

    family: ParameterFamily
    method: ShootingMethod
    kind: BifurcationKind = eqx.field(static=True)
    start: CurveStart
    stride: Stride = eqx.field(static=True)

    def follow(self) -> Whole:
        """Follow the curve from its start both ways."""
        scale, ways = jax.tree.map(np.asarray, _walk(frozen(self)))
        counts = [int(count) for count in ways.found]
        forth, back = (
            (ways.unknowns[way, :count], ways.tangents[way, :count]) for way, count in enumerate(counts)
        )
        if int(ways.ending[0]) == RETURNED:
            return Whole(scale, *forth, 0, True, (True, True))
        unknowns = np.concatenate([back[0][:0:-1], forth[0]])
        tangents = np.concatenate([-back[1][:0:-1], forth[1]])
        ended = int(ways.ending[1]) == REACHED_BOUND, int(ways.ending[0]) == REACHED_BOUND
        return Whole(scale, unknowns, tangents, max(counts[1] - 1, 0), False, ended)

    def polished(self, whole: Whole) -> Polished:
        """Give the points found anew, in planes across the curve."""
        count = whole.unknowns.shape[0]
        blocks = -(-count // _POLISHED_AT_ONCE)
        places = np.resize(np.arange(count), (blocks, _POLISHED_AT_ONCE))
        still = frozen(self)
        room = event_places(still.family.model, self.method.turns)
        while True:
            rows = [
                [jnp.asarray(values) for values in (whole.scale, whole.unknowns[part], whole.tangents[part])]
                for part in places
            ]
            blocks = [_polish_points(still, room, *row) for row in rows]
            found = jax.tree.map(lambda *values: np.concatenate(values)[:count], *blocks)
            if np.all(found.complete) or room > MOST_PLACES:
                return found
            room *= 2

    def tests(
        self, found: Polished, before: Float[np.ndarray, " state"]
    ) -> dict[str, Float[np.ndarray, " point"]]:
        """Give what changes sign at the special points of the curve, for points one after the other.

        The quadratic coefficient turns its sign with the critical direction, which is followed from point to
        point, from the one `before`.
        """
        good = np.where(found.found & found.complete, 1.0, np.nan)
        known = np.where(np.isfinite(found.direction), found.direction, 0.0)
        chain = np.sum(known * np.concatenate([before[None], known[:-1]]), axis=1)
        turned = np.cumprod(np.where(chain < 0.0, -1.0, 1.0)) if self.kind == "fold" else 1.0
        bend = turned * found.bend
        return {
            name: good * (bend if cosine is None else found.cosine - cosine)
            for name, cosine in TESTS[self.kind].items()
        }

    def special_points(self, whole: Whole, found: Polished) -> tuple[CodimensionTwoPoint, ...]:
        """Give the special points along a curve, in its order."""
        met = []
        for name, values in self.tests(found, np.asarray(found.direction[0])).items():
            for place in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0):
                low, high = whole.unknowns[place : place + 2]
                if np.linalg.norm(high - low) > 0.0:
                    met.append((int(place), self.zero(name, whole.scale, low, high)))
        return tuple(point for _, point in sorted(met, key=lambda one: one[0]))

    def zero(self, name: str, scale: np.ndarray, low: np.ndarray, high: np.ndarray) -> CodimensionTwoPoint:
        """Give the special point between two points of the curve: by one section, and by secants."""
        chord = (high - low) / np.linalg.norm(high - low)

        def points(shares: np.ndarray) -> Polished:
            along = low + shares[:, None] * (high - low)
            tangents = np.broadcast_to(chord, along.shape)
            return self.polished(Whole(scale, along, tangents, 0, False, (True, True)))

        shares = np.linspace(0.0, 1.0, _POLISHED_AT_ONCE)
        section = points(shares)
        values = self.tests(section, np.asarray(section.direction[0]))[name]
        change = np.flatnonzero(values[:-1] * values[1:] <= 0.0)
        at = int(change[0]) if change.size else 0
        (a, b), (before, after) = shares[at : at + 2], values[at : at + 2]
        size = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else np.nan
        found, value = jax.tree.map(lambda own: own[at], section), before
        # With the sign that the direction has there after following it through the section.
        towards = found.direction * np.sign(value) * np.sign(found.bend)
        towards = np.where(np.isfinite(towards), towards, found.direction)
        for _ in range(_SECANTS if change.size else 0):
            share = a - before * (b - a) / np.where(after == before, 1.0, after - before)
            one = points(np.full(1, share))
            found, value = jax.tree.map(lambda own: own[0], one), self.tests(one, towards)[name][0]
            a, before, b, after = b, after, share, value
            if not np.isfinite(value) or abs(value) <= 1e-3 * _ZERO_TO * size:
                break
        good = bool(change.size) and bool(abs(value) <= _ZERO_TO * size)
        along, rise = _rise(section, values, at, towards if self.kind == "fold" else None)
        found = jax.tree.map(jnp.asarray, found._replace(found=found.found & good))
        return codimension_two_point(name, self.family, self.method, self.kind, found, along, rise)

    def numbers(self, found: Polished) -> CurvePoints:
        """Give what is known of points, with their derivatives by the model."""
        return _numbers(self, found)


def _rise(
    section: Polished, values: np.ndarray, at: int, critical: np.ndarray | None
) -> tuple[Float[Array, " unknown"], Float[Array, ""]]:
    """Give the unit vector along a curve, and how a coefficient changes along it, between two points of it.

    `critical` is the direction in which the coefficient of a fold counts: its sign is that of the vector.
    """
    pair = slice(at, at + 2)
    state, shares = (np.diff(own[pair], axis=0)[0] for own in (section.state, section.shares))
    step = np.concatenate([state / section.scale[at], shares])
    size = np.linalg.norm(step)
    turned = 1.0 if critical is None else np.where(critical @ step[: critical.size] < 0.0, -1.0, 1.0)
    return jnp.asarray(step / size), jnp.asarray(turned * (values[at + 1] - values[at]) / size)


@quick_jit
def _walk(curve: OrbitCurve) -> tuple[Array, Followed]:
    """Give the size of the states, and the curve followed forth and back."""
    family, start, method = curve.family, curve.start, curve.method
    shares = family.shares(jnp.stack([start.amplitude, start.frequency]))
    there, turns = family.at(shares), float(method.periods)
    scale = state_scale(
        trajectory(there.model, method.integrator, there.drive, tuple(start.state), turns=turns)
    )
    states = scale.shape[0]

    def equations(u: Array) -> Array:
        scaled, here = u[:states], u[states:]
        moved, matrix = value_and_jacobian(lambda z: family.image(method, scale, z, here), scaled)
        return jnp.concatenate([moved - scaled, criticality(curve.kind, matrix)[None]])

    first = jnp.concatenate([start.state / scale, shares])
    fixed = jnp.zeros_like(first).at[-1].set(1.0)

    def way(sign: Array) -> Followed:
        return follow(equations, Departure(first, fixed, sign * fixed), states, curve.stride)

    return scale, jax.vmap(way)(jnp.array([1.0, -1.0]))


@quick_jit
def _polish_points(curve: OrbitCurve, places: int, scale: Array, unknowns: Array, normals: Array) -> Polished:
    states = scale.shape[0]

    def lane(unknown: Array, normal: Array) -> Polished:
        guess = PointGuess(unknown[:states] * scale, unknown[states:], (normal, scale))
        return polish(curve.family, curve.method, curve.kind, guess, places, _ERROR)

    return jax.vmap(lane)(unknowns, normals)


@quick_jit
def _numbers(curve: OrbitCurve, found: Polished) -> CurvePoints:
    good = found.found & found.complete
    family = curve.family
    found = jax.vmap(lambda point: point.moving(family))(found)
    blank = jnp.where(good, 1.0, jnp.nan)
    values = jax.vmap(family.values)(found.shares) * blank[:, None]
    roots = multipliers(found.matrix * blank[:, None, None])
    roots = roots * roots if curve.method.half else roots
    return CurvePoints(values[:, 0], values[:, 1], found.state * blank[:, None], roots, good)
