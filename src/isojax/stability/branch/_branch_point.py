"""What is known of one point of a branch, with its derivatives by the model."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._implicit import frozen, with_derivatives
from ..._small_systems import solve
from ..orbit import ShootingMethod, half_range, multipliers, trajectory, value_and_jacobian
from ._branch import BranchPoints
from ._criticality import critical_values
from ._parameter_family import ParameterFamily


def branch_point(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, " state"],
    unknown: Float[Array, " unknown"],
    tangent: Float[Array, " unknown"],
) -> tuple[BranchPoints, Float[Array, " test"]]:
    """Give what is known of one point of a branch, and what changes sign where the branch bifurcates.

    Args:
        family: isolators and drives.
        method: how the orbits are closed.
        scale: size of each state.
        unknown: scaled state and share of the parameter.
        tangent: along the branch.

    Returns:
        The point, and `critical_values` there without derivatives. The derivatives of the point by the model
        are those of the branch moving across itself.
    """
    moved, slope = moved_across(family, method, scale, unknown, tangent)
    states = scale.shape[0]
    tests = critical_values(slope[:states, :states] + jnp.eye(states), frozen(tangent))
    return orbit_at(family, method, scale, moved, tangent), tests


def moved_across(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, " state"],
    unknown: Float[Array, " unknown"],
    tangent: Float[Array, " unknown"],
) -> tuple[Float[Array, " unknown"], Float[Array, "unknown unknown"]]:
    """Give a point of a branch with its derivatives by the model: those of the branch moving across itself.

    Args:
        family: isolators and drives.
        method: how the orbits are closed.
        scale: size of each state.
        unknown: scaled state and share of the parameter.
        tangent: along the branch.

    Returns:
        Scaled state and share; and, at `unknown` and without derivatives, the slopes of the open end and of
        the way along the tangent.
    """
    held = method, scale, tangent, unknown
    still = frozen(held[1:])
    left, slope = value_and_jacobian(
        lambda here: _across(here, frozen(family), (method, *still))[0], frozen(unknown)
    )
    closed = unknown - solve(slope, left)
    return with_derivatives(closed, _across, closed, family, held), slope


def orbit_at(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, " state"],
    unknown: Float[Array, " unknown"],
    tangent: Float[Array, " unknown"],
) -> BranchPoints:
    """Give what is known of one closed motion.

    Args:
        family: isolators and drives.
        method: how the orbits are closed.
        scale: size of each state.
        unknown: scaled state and share of the parameter.
        tangent: along the branch.

    Returns:
        The point.
    """
    states = scale.shape[0]
    scaled, shares = unknown[:states], unknown[states:]
    setting = family.at(shares)
    matrix = jax.jacfwd(lambda z: family.image(method, scale, z, shares))(scaled)
    roots = multipliers(matrix)
    lasting = float(method.periods)
    path = trajectory(setting.model, method.integrator, setting.drive, tuple(scaled * scale), turns=lasting)
    return BranchPoints(
        family.values(shares)[0],
        jnp.asarray(setting.amplitude),
        jnp.asarray(setting.frequency),
        scaled * scale,
        half_range(setting.model, setting.drive, path, lasting),
        roots * roots if method.half else roots,
        roots if method.half else jnp.full(states, jnp.nan + 0j),
        tangent,
    )


def _across(
    unknown: Float[Array, " unknown"],
    family: ParameterFamily,
    held: tuple[ShootingMethod, Float[Array, " state"], Float[Array, " unknown"], Float[Array, " unknown"]],
) -> tuple[Float[Array, " unknown"], Float[Array, " unknown"]]:
    """Give what vanishes at a point that moves across the branch: the equations of its derivatives."""
    method, scale, tangent, origin = held
    left = family.open_end(method, scale, unknown)
    return jnp.concatenate([left, jnp.dot(tangent, unknown - origin)[None]]), unknown
