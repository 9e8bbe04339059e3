"""From starts to branches: many curves traced at once, and what is known of each point of them."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._types import on_device
from ..orbit import ShootingMethod, is_traced
from ._arc_length import HELD, REACHED_BOUND, RETURNED, STIFF, Departure, Followed, Stride, follow
from ._branch import Branch, BranchEvent, BranchPoints
from ._branch_point import branch_point
from ._locating import BranchCurves
from ._parameter_family import ParameterFamily
from ._special_points import find_special_points

_POINTS_A_BLOCK = 128
"""Points of each branch in one compiled batch."""


@quick_jit
def trace(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    departure: Departure,
    stride: Stride,
) -> Followed:
    """Follow a batch of branches.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        scale: size of each state.
        departure: where each starts: scaled state and share.
        stride: steps along the branches.

    Returns:
        The curves.
    """
    states = scale.shape[1]

    def lane(amplitude: Array, frequency: Array, scale: Array, departure: Departure) -> Followed:
        here = family.driven(amplitude, frequency)

        def is_held(u: Array) -> Array:
            return here.is_held(u[1], u[states:], jnp.ones(()))

        return follow(lambda u: here.open_end(method, scale, u), departure, states, stride, is_held)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, departure)


def branch_points(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch point unknown"],
    tangents: Float[Array, "branch point unknown"],
) -> tuple[BranchPoints, Float[Array, "branch point test"]]:
    """Give what is known of the points of a batch of branches, and what changes sign at bifurcations.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        scale: size of each state.
        unknowns: points: scaled states and shares.
        tangents: along the branches.

    Returns:
        The points, and `critical_values` there without derivatives. The derivatives of the points by the
        model are those of the branches moving across themselves.
    """
    count = unknowns.shape[1]
    blocks = [
        _points_of_block(family, method, scale, *(_block(values, begin) for values in (unknowns, tangents)))
        for begin in range(0, count, _POINTS_A_BLOCK)
    ]
    return jax.tree.map(lambda *parts: _joined(parts, count), *blocks)


def _joined(parts: tuple[Array, ...], count: int) -> Array:
    """Give the numbers of all blocks without what fills the last; by NumPy, which compiles nothing."""
    if is_traced(parts):
        return jnp.concatenate(parts, axis=1)[:, :count]
    return on_device(np.concatenate([np.asarray(own) for own in parts], axis=1)[:, :count])


def _block(values: Float[Array, "branch point unknown"], begin: int) -> Float[Array, "branch block unknown"]:
    """Give a block of points, filled up with NaN."""
    own = values[:, begin : begin + _POINTS_A_BLOCK]
    fill = _POINTS_A_BLOCK - own.shape[1]
    return jnp.pad(own, ((0, 0), (0, fill), (0, 0)), constant_values=jnp.nan) if fill else own


@quick_jit
def _points_of_block(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch block unknown"],
    tangents: Float[Array, "branch block unknown"],
) -> tuple[BranchPoints, Float[Array, "branch block test"]]:
    """Give what is known of a block of points of each branch, for which one compiled shape serves all."""

    def lane(
        amplitude: Array, frequency: Array, scale: Array, unknown: Array, tangent: Array
    ) -> tuple[BranchPoints, Array]:
        here = family.driven(amplitude, frequency)
        return jax.vmap(lambda u, t: branch_point(here, method, scale, u, t))(unknown, tangent)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, unknowns, tangents)


def room_for(counts: Int[np.ndarray, " branch"], most: int) -> int:
    """Give how many points of each branch to keep: all, rounded up, so that few shapes are compiled."""
    return min(-(-max(int(counts.max()), 2) // _POINTS_A_BLOCK) * _POINTS_A_BLOCK, most)


def lanes_of(
    branch: Branch,
) -> tuple[
    ParameterFamily,
    Float[Array, "branch state"],
    Float[Array, "branch point unknown"],
    Float[Array, "branch point unknown"],
]:
    """Give what branches were traced from, and their points, with an axis for the branches also of one.

    Args:
        branch: one, or a batch.

    Returns:
        Isolators and drives, sizes of the states, points (scaled states and shares) and tangents; NaN past
        the end of a branch.
    """
    points, single = branch.points, branch.points.value.ndim == 1
    shares = branch.family.shares(points.value)
    lanes = (branch.scale, points.y0, shares, points.tangent)
    scale, states, shares, tangents = (one[None] if single else one for one in lanes)
    unknowns = jnp.concatenate([states / scale[:, None], shares[..., None]], axis=-1)
    count = points.value.shape[-1]
    # Rounded up, so that few shapes are compiled.
    room = room_for(np.array([count]), 2 * count + 128) - count
    unknowns, tangents = (
        jnp.pad(values, ((0, 0), (0, room), (0, 0)), constant_values=jnp.nan)
        for values in (unknowns, tangents)
    )
    drives = (jnp.atleast_1d(one) for one in (branch.family.amplitude, branch.family.frequency))
    return branch.family.driven(*drives), scale, unknowns, tangents


def assemble(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    followed: Followed,
    batched: bool,
    step: float,
    events: tuple[BranchEvent, ...] = (),
) -> Branch:
    """Give the branch of traced points: what is known of each, and the bifurcations between them.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        scale: size of each state.
        followed: the traced points.
        batched: whether to keep the leading axis.
        step: largest step.
        events: what to look out for.

    Returns:
        The branch.
    """
    counts = np.asarray(followed.found)
    room = room_for(counts, followed.unknowns.shape[1])
    unknowns, tangents = followed.unknowns[:, :room], followed.tangents[:, :room]
    points, tests = branch_points(family, method, scale, unknowns, tangents)
    curves = BranchCurves(scale, unknowns, counts, tests)
    special = find_special_points(family, method, curves, events, points)
    longest = int(counts.max())

    def crop(values: Array) -> Array:
        used = np.arange(longest) < counts[:, None]
        used = used.reshape(used.shape + (1,) * (values.ndim - 2))
        if is_traced(values):
            kept = jnp.where(used, values[:, :longest], jnp.nan)
            return kept if batched else kept[0]
        kept = np.where(used, np.asarray(values)[:, :longest], np.nan)
        return on_device(kept if batched else kept[0])

    def single(values: Array) -> Array:
        return values if batched else values[0]

    ended = (followed.ending == REACHED_BOUND) | (followed.ending == RETURNED)
    good = RESULTS.promote(diffrax.RESULTS.successful)

    def outcome(well: Array, ending: Array) -> RESULTS:
        lost = RESULTS.where(ending == STIFF, RESULTS.stiff, RESULTS.not_converged)
        return RESULTS.where(well, good, RESULTS.where(ending == HELD, RESULTS.sticks, lost))

    result = jax.vmap(outcome)(ended, followed.ending)
    kept = family.driven(single(family.amplitude), single(family.frequency))
    return Branch(
        family.model,
        family.names[0],
        method.periods,
        method.half,
        single(followed.ending == RETURNED),
        jax.tree.map(crop, points),
        special,
        result if batched else jax.tree.map(lambda value: value[0], result),
        kept,
        method.integrator,
        single(scale),
        step,
        events=events,
    )
