"""Branches beside the one that was followed: sought over the whole range, each followed both ways."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen
from ..orbit import ShootingMethod, integrator_for, is_odd
from ._arc_length import REACHED_BOUND, RETURNED, Departure, Followed, Stride
from ._branch import Branch, BranchEvent, Searched
from ._orbit_search import FoundOrbits, OrbitSearch, distinct
from ._orbit_starts import PLACES, OrbitStarts, one_harmonic, orbit_starts
from ._parameter_family import ParameterFamily
from ._tracing import assemble, trace

_COARSE_STEPS = 64
"""Steps a period with which orbits are sought."""

_NEAR_A_BRANCH, _ON_A_BRANCH = 5e-3, 1e-3
"""Distance from a branch, over the size of the orbit, below which it lies on the branch: found by coarse
steps, and by the steps of the branch. Coarse steps were seen to miss by up to 1e-3."""

_SMALLEST = 0.2
"""Size of an orbit, over that of the branch, below which it counts as this large: between its points a branch
with a sharp resonance is known to a share of its own size, not of the small orbits off it."""

_AMONG = 33
"""Points between two of a branch at which the distance from it is taken, and again between two of these."""


class Curve(NamedTuple):
    """One branch that was followed.

    Attributes:
        method: how its orbits are closed.
        scale: size of each state.
        unknowns: scaled states and shares.
        tangents: unit vectors along it.
        ending: why it ends.
    """

    method: ShootingMethod
    scale: Float[np.ndarray, " state"]
    unknowns: Float[np.ndarray, "point unknown"]
    tangents: Float[np.ndarray, "point unknown"]
    ending: int

    def distance(self, share: float, state: Float[np.ndarray, " state"]) -> float:
        """Give the distance of an orbit from the branch, in its scaled unknowns, over the orbit's size."""
        if not len(self.unknowns):
            return np.inf
        size = max(float(np.linalg.norm(state / self.scale)), _SMALLEST)
        place = np.append(state / self.scale, share)
        nearest = int(np.argmin(np.linalg.norm(self.unknowns - place, axis=1)))
        best = float(np.linalg.norm(self.unknowns[nearest] - place))
        for first in range(max(nearest - 1, 0), min(nearest + 1, len(self.unknowns) - 1)):
            if best > 2.0 * np.linalg.norm(self.unknowns[first + 1] - self.unknowns[first]):
                continue
            low, high = 0.0, 1.0
            for _ in range(2):
                parts = np.linspace(low, high, _AMONG)
                apart = np.linalg.norm(self._between(first, parts) - place, axis=1)
                best, at = min(best, float(apart.min())), parts[int(apart.argmin())]
                low, high = at - (high - low) / _AMONG, at + (high - low) / _AMONG
        return best / size

    def _between(self, first: int, part: np.ndarray) -> np.ndarray:
        """Give the cubic through two neighbours along their tangents."""
        begin, end = self.unknowns[first : first + 2]
        length = np.linalg.norm(end - begin)
        leave, arrive = length * self.tangents[first : first + 2]
        t = part[:, None]
        ahead = end - begin
        return begin + t * (
            leave + t * (3.0 * ahead - 2.0 * leave - arrive + t * (leave + arrive - 2.0 * ahead))
        )


class BranchSearch(NamedTuple):
    """What is sought beside a batch of branches.

    Attributes:
        periods: drive periods of the orbits that are sought.
        stride: steps along the branches that are found.
        events: what to look out for along them.
    """

    periods: tuple[int, ...]
    stride: Stride
    events: tuple[BranchEvent, ...] = ()


def find_other_branches(
    live: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    followed: Followed,
    search: BranchSearch,
) -> tuple[tuple[Branch, ...], Searched]:
    """Find branches that the followed ones do not reach within the range.

    At many values of the parameter Newton's method closes orbits from many states. Those that lie on no
    branch yet are followed both ways, one after the other, until they have as many points as one branch may.

    Args:
        live: isolators and drives, drive with a leading axis; its derivatives reach the branches.
        method: how the orbits of the followed branches are closed.
        scale: size of each state of these.
        followed: the branches.
        search: what is sought.

    Returns:
        The other branches, by drive and then by periods, and where they were sought.
    """
    still = frozen(live)
    found: list[Branch] = []
    reach, left, tried, unsettled = 0.0, 0, 0, 0
    for lane in range(scale.shape[0]):
        own = still.driven(still.amplitude[lane], still.frequency[lane])
        count = int(followed.found[lane])
        main = Curve(
            method,
            np.asarray(scale[lane]),
            np.asarray(followed.unknowns[lane, :count]),
            np.asarray(followed.tangents[lane, :count]),
            int(followed.ending[lane]),
        )
        sought = _other_curves(own, main, search)
        reach, left = max(reach, sought.reach), left + sought.left
        tried, unsettled = tried + sought.tried, unsettled + sought.unsettled
        lanes = live.driven(live.amplitude[lane : lane + 1], live.frequency[lane : lane + 1])
        found += [_branch(lanes, curve, search) for curve in sought.curves]
    shares = (np.arange(PLACES) + 0.5) / PLACES
    values = np.asarray(jax.vmap(still.values)(jnp.asarray(shares)[:, None]))[:, 0]
    where = still.names[0], jnp.asarray(values), search.periods, reach
    return tuple(found), Searched(*where, left, tried, unsettled)


class _Sought(NamedTuple):
    """What was found beside one branch.

    Attributes:
        curves: the other branches.
        reach: largest displacement tried [m].
        left: orbits on branches that were not followed any more.
        tried: starts from which orbits were sought.
        unsettled: those of them from which Newton's method did not close a motion.
    """

    curves: list[Curve]
    reach: float
    left: int
    tried: int
    unsettled: int


def _other_curves(family: ParameterFamily, main: Curve, search: BranchSearch) -> _Sought:
    """Give the other branches under one drive."""
    known, reach, left, tried, unsettled = [main], 0.0, 0, 0, 0
    forced, coarse = one_harmonic(family), integrator_for(family.model, None, _COARSE_STEPS)
    unknowns = main.unknowns if len(main.unknowns) else np.zeros((1, main.scale.size + 1))
    for periods in search.periods:
        starts = orbit_starts(family, forced, periods, unknowns, main.scale)
        reach, tried = max(reach, float(starts.sizes.max())), tried + starts.shares.size
        odd = is_odd(family.model, reach)
        groups, lost = OrbitSearch(family, coarse, odd, periods).settled(starts)
        closed = OrbitStarts(*map(np.concatenate, zip(*(group for _, group in groups), strict=True)))
        closed = _off(distinct(family, closed), known)
        unsettled += lost
        if not closed.shares.size:
            continue
        groups, lost = OrbitSearch(family, main.method.integrator, odd, periods).settled(closed)
        unsettled += lost
        for exact, group in groups:
            orbits = exact.orbits(group)
            orbits = orbits.where(_beside(orbits, known))
            method = ShootingMethod(exact.integrator, periods, False)
            followed, more = _followed_all(family, method, odd, orbits, known, search.stride)
            known, left = known + followed, left + more
    return _Sought(known[1:], reach, left, tried, unsettled)


def _followed_all(
    family: ParameterFamily,
    method: ShootingMethod,
    odd: bool,
    orbits: FoundOrbits,
    known: list[Curve],
    stride: Stride,
) -> tuple[list[Curve], int]:
    """Give the branches of orbits that lie on no known one, and how many orbits were left."""
    new: list[Curve] = []
    left = 0
    while orbits.shares.size:
        # Where motions are chaotic there are orbits without end.
        if sum(len(curve.unknowns) for curve in known[1:] + new) > stride.most:
            return new, left + orbits.shares.size
        curve = _followed_both_ways(family, method, odd, orbits, stride)
        orbits = orbits.where(np.arange(orbits.shares.size) > 0)
        if len(curve.unknowns) > 1:
            new.append(curve)
            orbits = orbits.where(_beside(orbits, [curve]))
        else:
            left += 1
    return new, left


def _off(closed: OrbitStarts, known: list[Curve]) -> OrbitStarts:
    """Give the motions that are not near a branch."""
    places = zip(closed.shares, closed.states, strict=True)
    far = [min(curve.distance(share, state) for curve in known) > _NEAR_A_BRANCH for share, state in places]
    return closed.where(np.array(far, bool))


def _beside(orbits: FoundOrbits, known: list[Curve]) -> Bool[np.ndarray, " orbit"]:
    """Say which orbits lie on no branch, nor any of their images."""
    apart = [
        min(curve.distance(share, image) for curve in known for image in images)
        for share, images in zip(orbits.shares, orbits.images, strict=True)
    ]
    return np.array(apart) > _ON_A_BRANCH


def _followed_both_ways(
    family: ParameterFamily, method: ShootingMethod, odd: bool, orbits: FoundOrbits, stride: Stride
) -> Curve:
    """Follow the branch of the first of some orbits."""
    share, images, scale = (values[0] for values in orbits)
    mirrored = odd and method.periods == 1 and np.max(np.abs(images[1] - images[0]) / scale) <= _ON_A_BRANCH
    method = ShootingMethod(method.integrator, method.periods, bool(mirrored))
    first = np.append(images[0] / scale, share)
    fixed = np.append(np.zeros(scale.size), 1.0)
    lanes = family.driven(family.amplitude[None], family.frequency[None])
    ways = []
    for sign in (1.0, -1.0):
        departure = Departure(*(jnp.asarray(row)[None] for row in (first, fixed, sign * fixed)))
        way = trace(lanes, method, jnp.asarray(scale)[None], departure, stride)
        count = int(way.found[0])
        unknowns, tangents = np.asarray(way.unknowns[0, :count]), np.asarray(way.tangents[0, :count])
        ways.append(Curve(method, scale, unknowns, tangents, int(way.ending[0])))
        if ways[0].ending == RETURNED:
            return ways[0]
    forth, back = ways
    unknowns = np.concatenate([back.unknowns[:0:-1], forth.unknowns])
    tangents = np.concatenate([-back.tangents[:0:-1], forth.tangents])
    ending = forth.ending if forth.ending != REACHED_BOUND else back.ending
    return Curve(method, scale, unknowns, tangents, ending)


def _branch(live: ParameterFamily, curve: Curve, search: BranchSearch) -> Branch:
    """Give a curve as a branch."""
    count, stride = len(curve.unknowns), search.stride
    room = ((0, max(2 * stride.most - count, 0)), (0, 0))
    unknowns, tangents = (
        jnp.asarray(np.pad(values, room, mode="edge"))[None] for values in (curve.unknowns, curve.tangents)
    )
    followed = Followed(unknowns, tangents, jnp.asarray([count]), jnp.asarray([curve.ending]))
    return assemble(
        live, curve.method, jnp.asarray(curve.scale)[None], followed, False, stride.longest, search.events
    )
